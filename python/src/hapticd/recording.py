"""A recording into a file, which a thread writes while the program does something else."""

from __future__ import annotations

import bisect
import contextlib
import os
import threading
import time
from collections.abc import Callable, Mapping
from operator import itemgetter
from pathlib import Path
from typing import Any

from hapticd.change import given
from hapticd.closing import Closing
from hapticd.errors import HapticdError
from hapticd.marks import scene_mark, state_mark
from hapticd.recorder import circumstances
from hapticd.recordings.sink import create
from hapticd.sample import Sample, kind_of, of_row
from hapticd.samples import every
from hapticd.subscription import Queue, subscribe

#: Rows and changes that may wait for the disk: a minute at 1 kHz.
WAITING = 60_000

#: Rows that stay in memory while others follow, and for how long, s.
_FLUSH_ROWS, _FLUSH_S = 250, 1.0

#: How long the rows of a recording's last moment may take, s.
_LAST_ROWS_S = 2.0


class Recording(Closing):
    """A recording that is being written; it ends with its block, or with `close`. `Rig.record` makes one.

    It holds what one of `haptic-ctl record` does: rows, changes of scene and state, the journal, and the servo's state,
    from which `haptic-ctl replay` computes every force again.

    Attributes:
        path: The file.
        rows: Rows so far.
        lost: Rows that are missing so far; each gap has a mark.
        missed: Periods that the loop has missed so far.
    """

    def __init__(
        self,
        path: Path,
        request: Callable[[str, Mapping[str, Any]], dict[str, Any]],
        file: Path,
        length_s: float | None,
        *,
        rate_hz: float | None = None,
        notes: str | None = None,
        replace: bool = False,
    ) -> None:
        self.path = file
        self.rows = self.lost = self.missed = 0
        self._request = request
        self._queue: Queue[dict[str, Any]] = Queue(WAITING, lambda event: max(1, len(event.get("rows", ()))))
        self._lost_changes = 0
        self._is_closed = self._is_ending = False
        self._failure: Exception | None = None
        self._pending: list[dict[str, Any]] = []
        self._state: str | None = None
        #: Tick and deadline of the last row, s.
        self._last: tuple[int, float] | None = None
        status = request("status", {})
        answers: list[dict[str, Any]] = []
        topics = ["state", "log", "samples", "snapshot"]
        how = given(rate_hz=rate_hz)
        self._subscription = subscribe(path, topics, self._take, self._queue.end, answers.append, **how)
        try:
            scene = request("get", {})
            self._revision: int = scene["revision"]
            metadata = circumstances(status, answers[0], scene, time.time())
            user = os.environ.get("USER") or os.environ.get("LOGNAME")
            recorded_by = ", ".join(filter(None, ("hapticd for Python", user)))
            metadata = given(**metadata, recorded_by=recorded_by, notes=notes)
            self._loop_rate_hz: float = metadata["loop_rate_hz"]
            self._every = every(self._loop_rate_hz, metadata["rate_hz"])
            self._wanted = None if length_s is None else round(length_s * metadata["rate_hz"])
            self._kind = kind_of(answers[0]["columns"])
            self._sink = create(file, metadata, replace, self._kind)
        except BaseException:
            self._subscription.close()
            raise
        self._thread = threading.Thread(target=self._run, name="hapticd recording", daemon=True)
        self._thread.start()

    def _take(self, event: dict[str, Any]) -> None:
        # Rows that had to go are missed by their ticks.
        self._lost_changes += sum(gone["event"] != "samples" for gone in self._queue.put(event))

    def mark(self, text: str) -> int:
        """Marks this moment; returns its tick."""
        tick: int = self._request("status", {})["tick"] + 1
        self._take({"event": "marker", "tick": tick, "text": text})
        return tick

    def wait(self) -> None:
        """Waits until a recording of a given length has ended.

        Raises:
            HapticdError: The daemon has gone; the file reads up to there.
            OSError: The file cannot be written.
        """
        try:
            self._thread.join()
        finally:
            self.close()

    def close(self) -> None:
        """Ends it, once the rows up to this moment are written.

        Raises:
            HapticdError: The daemon has gone; the file reads up to there.
            OSError: The file cannot be written.
        """
        if not self._is_closed:
            self._is_closed = True
            # Asked on the connection of the rows: where the daemon has gone, that is how the recording ends.
            with contextlib.suppress(HapticdError):
                if self._thread.is_alive():
                    self._wait_for_rows(self._subscription.request("status", {})["tick"])
                self._is_ending = True
            self._subscription.close()
        self._thread.join()
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def _wait_for_rows(self, tick: int) -> None:
        until_s = time.monotonic() + _LAST_ROWS_S
        while self._thread.is_alive() and time.monotonic() < until_s:
            if self._last is not None and self._last[0] + self._every > tick:
                return
            time.sleep(0.002)

    def _run(self) -> None:
        try:
            with contextlib.closing(self._sink):
                lost = self._write()
                for mark in self._pending:
                    self._sink.mark(mark)
                if lost is None:
                    totals = {"rows": self.rows, "lost": self.lost, "missed": self.missed}
                    self._sink.mark({"mark": "end", **totals})
                else:
                    tick = 0 if self._last is None else self._last[0] + 1
                    self._sink.mark({"mark": "link", "tick": tick, "text": f"lost the daemon: {lost}"})
                    self._failure = lost
        except OSError as error:
            self._failure = error

    def _write(self) -> HapticdError | None:
        """Writes what comes until the recording is ended; returns the reason where nobody has ended it."""
        flushed_s, flushed_rows = time.monotonic(), 0
        while self._wanted is None or self.rows < self._wanted:
            try:
                self._event(self._queue.get(_FLUSH_S))
            except HapticdError as error:
                return None if self._is_ending else error
            except TimeoutError:
                pass
            if self.rows - flushed_rows >= _FLUSH_ROWS or time.monotonic() - flushed_s >= _FLUSH_S:
                self._sink.flush()
                flushed_s, flushed_rows = time.monotonic(), self.rows
        return None

    def _event(self, event: dict[str, Any]) -> None:
        topic = event.pop("event")
        if topic == "samples":
            self._samples(event["rows"], event["dropped"])
        elif topic == "state":
            if event["revision"] != self._revision:
                self._mark(scene_mark(event))
            if event["state"] != self._state:
                self._mark(state_mark(event))
            self._revision, self._state = event["revision"], event["state"]
        elif topic == "log":
            # What no tick carried out has changed nothing of the rows.
            if "tick" in event:
                self._mark({"mark": "journal", "tick": event["tick"], "entry": event})
        elif topic in ("servo", "snapshot", "marker"):
            self._mark({"mark": topic, **event})

    def _mark(self, mark: dict[str, Any]) -> None:
        """Keeps a mark for the first row of its tick: events of the topics overtake one another."""
        bisect.insort(self._pending, mark, key=itemgetter("tick"))

    def _samples(self, rows: list[list[Any]], dropped: int) -> None:
        if lost_changes := self._lost_changes:
            self._lost_changes -= lost_changes
            self._sink.mark({"mark": "lost_changes", "changes": lost_changes})
        for row in rows:
            if self.rows == self._wanted:
                return
            sample = of_row(row, self._kind)
            while self._pending and self._pending[0]["tick"] <= sample.tick:
                self._sink.mark(self._pending.pop(0))
            self._mark_gap(sample, dropped)
            dropped = 0
            self._sink.row(sample)
            self.rows += 1

    def _mark_gap(self, sample: Sample, dropped: int) -> None:
        """Marks the rows that are missing before this one, and the periods that the loop has missed."""
        # The deadlines are whole periods apart, and each tick has one.
        deadline_s = sample.t_s - sample.wake_latency_ns * 1e-9
        lost, missed = dropped, 0
        if self._last is not None and sample.tick > self._last[0]:
            ticks = sample.tick - self._last[0]
            lost = max(lost, ticks // self._every - 1)
            missed = max(0, round((deadline_s - self._last[1]) * self._loop_rate_hz) - ticks)
        self._last = (sample.tick, deadline_s)
        if lost:
            self.lost += lost
            self._sink.mark({"mark": "lost", "rows": lost})
        if missed:
            self.missed += missed
            self._sink.mark({"mark": "missed", "tick": sample.tick, "periods": missed})
