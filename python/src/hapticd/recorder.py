"""A recording in memory: a data frame, with what happened meanwhile."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.change import given
from hapticd.errors import SamplesLostWarning
from hapticd.frame import frame
from hapticd.marks import scene_mark, state_mark
from hapticd.sample import dtype_of, kind_of
from hapticd.samples import Gaps, cells, every
from hapticd.subscription import Queue, subscribe

if TYPE_CHECKING:
    import pandas


def record(
    path: Path, request: Callable[[str], dict[str, Any]], length_s: float, rate_hz: float | None
) -> pandas.DataFrame:
    """Records for a time. See `Rig.record`, which gives the socket and its own requests."""
    import numpy

    status = request("status")
    # Samples and states come on one connection, so that their order is the daemon's.
    queue: Queue[dict[str, Any]] = Queue(float("inf"), lambda event: 1)
    answers: list[dict[str, Any]] = []
    how = given(rate_hz=rate_hz)
    subscription = subscribe(path, ["state", "samples"], queue.put, queue.end, answers.append, **how)
    try:
        scene = request("get")
        started_unix_s = time.time()
        rate_hz = float(answers[0]["rate_hz"])
        gaps = Gaps(every(status["rate_hz"], rate_hz))
        kind = kind_of(answers[0]["columns"])
        wanted = round(length_s * rate_hz)
        rows: list[tuple[Any, ...]] = []
        marks: list[dict[str, Any]] = []
        known: dict[str, Any] = {}
        while len(rows) < wanted:
            event = queue.get()
            if event["event"] == "state":
                if event["revision"] != known.get("revision"):
                    marks.append({"row": len(rows), **scene_mark(event)})
                if event["state"] != known.get("state"):
                    marks.append({"row": len(rows), **state_mark(event)})
                known = event
            elif event["event"] == "samples":
                new = event["rows"][: wanted - len(rows)]
                for place, lost in gaps.before(new, event["dropped"]):
                    marks.append({"row": len(rows) + place, "mark": "lost", "rows": lost})
                rows.extend(cells(row, kind) for row in new)
    finally:
        subscription.close()
    marks.append({"row": len(rows), "mark": "end", "rows": len(rows), "lost": gaps.lost})
    if gaps.lost:
        warnings.warn(f"{gaps.lost} samples were lost", SamplesLostWarning, stacklevel=3)
    table = numpy.array(rows, dtype=dtype_of(kind))
    metadata = circumstances(status, answers[0], scene, started_unix_s)
    return frame({name: table[name] for name in kind._fields}, metadata, marks)


def circumstances(
    status: Mapping[str, Any], answer: Mapping[str, Any], scene: Mapping[str, Any], started_unix_s: float
) -> dict[str, Any]:
    """The metadata of a recording.

    Args:
        status: The answer to `status`.
        answer: The answer to `subscribe`.
        scene: The answer to `get`.
    """
    return {
        "server": status["server"],
        "device": status["device"]["description"],
        "loop_rate_hz": status["rate_hz"],
        "rate_hz": float(answer["rate_hz"]),
        "started_unix_s": started_unix_s,
        "revision": scene["revision"],
        "scene": scene["scene"],
        "servo": answer.get("servo"),
        "configuration": status,
    }
