"""Publishes a rig to the Lab Streaming Layer, so that it is recorded beside other instruments.

    python -m hapticd.lsl                 # until interrupted
    python -m hapticd.lsl --rate 250 --name left-hand

There are two streams. NAME (type `Haptics`) has a channel of doubles for each column of a sample, labelled as the
column, with `state` as its place in `hapticd.STATES`. NAME-events (type `Markers`) has a line of JSON for each state,
each change of the scene, and each entry of the daemon's log, as on the wire. Both are stamped with the time of the tick
on the clock of the Lab Streaming Layer. The program takes no lease: it looks on, and never moves the rig.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from typing import Any

from hapticd.change import given
from hapticd.connection import encoded
from hapticd.errors import HapticdError
from hapticd.extras import need
from hapticd.rig import Rig, connect
from hapticd.sample import Sample, kind_of
from hapticd.samples import cells
from hapticd.subscription import Queue, subscribe

#: How long the daemon's clock is asked for, s. The daemon's answer is up to 5 ms old; the newest of many counts.
_SEARCH_S = 0.5


def publish(rig: Rig, *, name: str = "hapticd", rate_hz: float | None = None, batch_ms: int = 10) -> None:
    """Publishes a rig until its daemon ends.

    Args:
        name: The name of the stream of samples; that of events ends in `-events`.
        rate_hz: Samples a second, Hz; every tick without it.
        batch_ms: Time between two batches of samples, ms.

    Raises:
        ConnectionLost: The daemon has ended.
    """
    need("lsl", "pylsl")
    import pylsl

    queue: Queue[dict[str, Any]] = Queue(math.inf, lambda event: 1)
    offset_s = clock_offset_s(rig)
    period_s = 1.0 / rig.loop_rate_hz
    topics = ["samples", "state", "log"]
    answers: list[dict[str, Any]] = []
    how = given(rate_hz=rate_hz, batch_ms=batch_ms)
    subscription = subscribe(rig.path, topics, queue.put, queue.end, answers.append, **how)
    try:
        device = rig.status().device.description
        kind = kind_of(answers[0]["columns"])
        samples = pylsl.StreamOutlet(_samples_info(name, kind, float(answers[0]["rate_hz"]), device))
        events = pylsl.StreamOutlet(
            pylsl.StreamInfo(f"{name}-events", "Markers", 1, pylsl.IRREGULAR_RATE, pylsl.cf_string, device)
        )
        newest: tuple[int, float] | None = None
        waiting: list[dict[str, Any]] = []
        while True:
            event = queue.get()
            if event["event"] != "samples":
                waiting.append(event)
            elif rows := event["rows"]:
                newest = (rows[-1][0], rows[-1][1])
                # Each with its own time: a chunk would have that of its newest, and the nominal rate.
                for row in rows:
                    samples.push_sample([float(cell) for cell in cells(row, kind)], row[1] + offset_s)
            # An event has a tick, and ticks have times once there was a sample.
            if newest is not None:
                for each in waiting:
                    tick = each.get("tick") or newest[0]
                    t_s = newest[1] + (tick - newest[0]) * period_s
                    events.push_sample([encoded(each).decode().strip()], t_s + offset_s)
                waiting.clear()
    finally:
        subscription.close()


def clock_offset_s(rig: Rig) -> float:
    """What to add to `t_s` for the clock of the Lab Streaming Layer, s.

    It is too large by as long as the fastest answer took, and the tick in it was old.
    """
    import pylsl

    until_s, offset_s = pylsl.local_clock() + _SEARCH_S, math.inf
    while pylsl.local_clock() < until_s:
        uptime_s = rig.status().uptime_s
        offset_s = min(offset_s, pylsl.local_clock() - uptime_s)
    return offset_s


def _samples_info(name: str, kind: type[Sample], rate_hz: float, device: str) -> Any:
    import pylsl

    info = pylsl.StreamInfo(name, "Haptics", len(kind._fields), rate_hz, pylsl.cf_double64, device)
    channels = info.desc().append_child("channels")
    for column in kind._fields:
        _, _, unit = column.rpartition("_")
        channel = channels.append_child("channel")
        channel.append_child_value("label", column)
        channel.append_child_value("unit", unit if unit in ("s", "m", "mps", "N", "ns") else "")
    return info


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m hapticd.lsl", description=__doc__.splitlines()[0])
    parser.add_argument("--socket", metavar="PATH", help="control socket [default: as haptic-ctl]")
    parser.add_argument("--name", default="hapticd", help="name of the stream [default: hapticd]")
    parser.add_argument("--rate", type=float, metavar="HZ", help="samples a second [default: every tick]")
    given = parser.parse_args(arguments)
    try:
        with connect(given.socket, lease=None) as rig:
            publish(rig, name=given.name, rate_hz=given.rate)
    except KeyboardInterrupt:
        return 130
    except (HapticdError, ImportError) as error:
        print(f"hapticd.lsl: {error}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
