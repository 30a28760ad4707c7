"""The stream of samples, with no gap unnoticed: as an iterator, or into numpy in the background."""

from __future__ import annotations

import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from hapticd.change import given
from hapticd.closing import Closing
from hapticd.errors import Faulted, HapticdError, Refused, SamplesLost, Stopped, invalid
from hapticd.sample import COLUMNS, PLACES, Sample, State, dtype_of, kind_of, of_row
from hapticd.subscription import Queue, subscribe

if TYPE_CHECKING:
    import numpy
    import numpy.typing

#: Seconds of samples that may wait for a slow program.
WAITING_S = 120.0

#: Samples that a buffer keeps at most: an hour at 1 kHz, about half a gigabyte.
_MAX_KEPT = 3_600_000


class Gaps:
    """Finds missing samples: those that the daemon tells of, and ticks that are not there.

    Attributes:
        lost: How many samples were lost so far.
    """

    def __init__(self, every: int) -> None:
        self.lost = 0
        self._every = every
        self._last: int | None = None

    def before(self, rows: list[list[Any]], dropped: int) -> list[tuple[int, int]]:
        """Places in `rows` before which samples are missing, and how many."""
        gaps = []
        for place, row in enumerate(rows):
            tick: int = row[0]
            jump = 0 if self._last is None else (tick - self._last) // self._every - 1
            lost = max(jump, dropped)
            dropped = 0
            if lost > 0:
                gaps.append((place, lost))
                self.lost += lost
            self._last = tick
        return gaps


def every(loop_rate_hz: float, rate_hz: float) -> int:
    """Ticks from one sample to the next."""
    return max(1, round(loop_rate_hz / rate_hz))


class Batch(NamedTuple):
    """Samples that came together, and where some are missing."""

    rows: list[list[Any]]
    gaps: list[tuple[int, int]]


def _check_halted(state: State) -> None:
    """Raises the exception of a rig that was stopped or faulted while a condition was waited for."""
    kinds: dict[str, type[Refused]] = {"stopped": Stopped, "faulted": Faulted}
    if state in kinds:
        message = f"the rig was {state} before the condition held; `reset` clears that"
        raise kinds[state]({"code": state, "message": message})


class _Subscriber(Closing):
    """Samples of a subscription of their own."""

    def __init__(self, path: Path, loop_rate_hz: float, rate_hz: float | None, batch_ms: int | None) -> None:
        self._loop_rate_hz = loop_rate_hz
        how = given(rate_hz=rate_hz, batch_ms=batch_ms)
        self._subscription = subscribe(path, ["samples"], self._take, self._end, self._begin, **how)

    def _begin(self, answer: dict[str, Any]) -> None:
        self._kind = kind_of(answer["columns"])
        self.rate_hz: float = answer["rate_hz"]
        self._gaps = Gaps(every(self._loop_rate_hz, self.rate_hz))

    @abstractmethod
    def _take(self, event: dict[str, Any]) -> None: ...

    @abstractmethod
    def _end(self, reason: HapticdError) -> None: ...

    def close(self) -> None:
        """Ends the subscription; what has come stays."""
        self._subscription.close()


class Samples(_Subscriber):
    """The samples from now on, one after another.

    Up to two minutes of them wait while the program is busy. Samples that are lost raise `SamplesLost`, after which
    the iteration can go on; with `on_gap="count"` they are only counted.

    Attributes:
        rate_hz: Samples a second, Hz.
    """

    def __init__(
        self,
        path: Path,
        loop_rate_hz: float,
        *,
        rate_hz: float | None = None,
        batch_ms: int | None = None,
        on_gap: Literal["raise", "count"] = "raise",
    ) -> None:
        if on_gap not in ("raise", "count"):
            raise invalid("on_gap", f"on_gap = {on_gap!r}: expected 'raise' or 'count'")
        self._on_gap = on_gap
        self._ready: list[Sample | SamplesLost] = []
        super().__init__(path, loop_rate_hz, rate_hz, batch_ms)

    def _begin(self, answer: dict[str, Any]) -> None:
        super()._begin(answer)
        self._queue: Queue[Batch] = Queue(WAITING_S * self.rate_hz, lambda batch: len(batch.rows))
        self._overrun = 0
        self._taken = 0

    def _take(self, event: dict[str, Any]) -> None:
        rows = event["rows"]
        gone = self._queue.put(Batch(rows, self._gaps.before(rows, event["dropped"])))
        # Their own gaps are counted already.
        self._overrun += sum(len(batch.rows) for batch in gone)

    def _end(self, reason: HapticdError) -> None:
        self._queue.end(reason)

    @property
    def lost(self) -> int:
        """Samples that were lost so far."""
        return self._gaps.lost + self._overrun

    def __iter__(self) -> Iterator[Sample]:
        return self

    def __next__(self) -> Sample:
        """The next sample. See `get`."""
        return self.get()

    def get(self, timeout_s: float | None = None) -> Sample:
        """The next sample.

        Raises:
            TimeoutError: None has come in time.
            SamplesLost: Samples are missing before the next one.
            ConnectionLost: The connection to the daemon is closed.
        """
        while not self._ready:
            self._refill(timeout_s)
        ready = self._ready.pop()
        if isinstance(ready, SamplesLost):
            raise ready
        return ready

    def wait_for(self, condition: Callable[[Sample], object], timeout_s: float) -> Sample:
        """Waits until a condition holds of a sample; returns that sample. The time runs from the first sample on.

        Raises:
            Stopped, Faulted: The rig was stopped or faulted meanwhile.
            TimeoutError: The condition did not hold in time.
            SamplesLost, ConnectionLost: As `get`.
        """
        until_s: float | None = None
        before: State | None = None
        while True:
            try:
                sample = self.get(None if until_s is None else until_s - time.monotonic())
            except TimeoutError:
                message = f"the condition did not hold within {timeout_s:g} s; the rig is {before}"
                raise TimeoutError(message) from None
            if condition(sample):
                return sample
            if before not in (None, sample.state):
                _check_halted(sample.state)
            if until_s is None:
                until_s = time.monotonic() + timeout_s
            before = sample.state

    def _refill(self, timeout_s: float | None) -> None:
        if timeout_s is not None and timeout_s <= 0:
            raise TimeoutError
        batch = self._queue.get(timeout_s)
        gaps = dict(batch.gaps)
        if overrun := self._overrun - self._taken:
            gaps[0] = gaps.get(0, 0) + overrun
            self._taken += overrun
        for place, row in enumerate(batch.rows):
            if self._on_gap == "raise" and place in gaps:
                self._ready.append(SamplesLost(gaps[place], row[0]))
            self._ready.append(of_row(row, self._kind))
        self._ready.reverse()


class Buffer(_Subscriber):
    """The newest samples as a numpy array, kept by a thread in the background.

    Attributes:
        rate_hz: Samples a second, Hz.
    """

    def __init__(
        self,
        path: Path,
        loop_rate_hz: float,
        length_s: float,
        *,
        rate_hz: float | None = None,
        batch_ms: int | None = None,
    ) -> None:
        longest_s = _MAX_KEPT / (rate_hz or loop_rate_hz)
        if not 0 < length_s <= longest_s:
            message = f"length = {length_s:g} s is out of range: above 0 and up to {longest_s:g} s at this rate"
            raise invalid("length", message, "out_of_range", value=length_s, min=0.0, max=longest_s, unit="s")
        self._length_s = length_s
        self._changed = threading.Condition()
        self._written = 0
        self._read = 0
        self._overwritten = 0
        self._ended: HapticdError | None = None
        super().__init__(path, loop_rate_hz, rate_hz, batch_ms)

    def _begin(self, answer: dict[str, Any]) -> None:
        import numpy

        super()._begin(answer)
        length = max(1, round(self._length_s * self.rate_hz))
        self._ring = numpy.zeros(length, dtype=dtype_of(self._kind))

    def _take(self, event: dict[str, Any]) -> None:
        import numpy

        rows = event["rows"]
        new = numpy.array([cells(row, self._kind) for row in rows], dtype=self._ring.dtype)
        with self._changed:
            self._gaps.before(rows, event["dropped"])
            length = len(self._ring)
            kept = new[-length:]
            places = numpy.arange(self._written + len(new) - len(kept), self._written + len(new)) % length
            self._ring[places] = kept
            self._written += len(new)
            self._changed.notify_all()

    def _end(self, reason: HapticdError) -> None:
        with self._changed:
            self._ended = reason
            self._changed.notify_all()

    @property
    def lost(self) -> int:
        """Samples that were lost so far: on the way, or because `take` came too late for them."""
        with self._changed:
            return self._gaps.lost + self._overwritten

    def __len__(self) -> int:
        """How many samples it holds."""
        with self._changed:
            return min(self._written, len(self._ring))

    def latest(self, count: int | None = None) -> numpy.typing.NDArray[numpy.void]:
        """The newest samples, oldest first; all that are held without a `count`. Fields are named as columns."""
        with self._changed:
            held = min(self._written, len(self._ring))
            return self._between(self._written - min(held, held if count is None else count), self._written)

    def take(self) -> numpy.typing.NDArray[numpy.void]:
        """The samples since the last `take`. Those that are not held any more are counted in `lost`.

        Raises:
            ConnectionLost: Nothing more comes, and everything was taken.
        """
        with self._changed:
            if self._ended is not None and self._read == self._written:
                raise self._ended.with_traceback(None)
            oldest = max(self._written - len(self._ring), 0)
            self._overwritten += max(oldest - self._read, 0)
            taken = self._between(max(self._read, oldest), self._written)
            self._read = self._written
            return taken

    def wait_for(self, count: int, timeout_s: float | None = None) -> None:
        """Waits until `count` samples have come since the beginning.

        Raises:
            ConnectionLost: Nothing more comes.
            TimeoutError: They have not come in time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: self._written >= count or self._ended, timeout_s):
                raise TimeoutError(f"{self._written} samples of {count} after {timeout_s} s")
            if self._written < count:
                assert self._ended is not None
                raise self._ended.with_traceback(None)

    def _between(self, first: int, end: int) -> numpy.typing.NDArray[numpy.void]:
        import numpy

        taken: numpy.typing.NDArray[numpy.void] = self._ring[numpy.arange(first, end) % len(self._ring)]
        return taken


_STATE = COLUMNS.index("state")


def cells(row: list[Any], kind: type[Sample]) -> tuple[Any, ...]:
    """A row for an array of `dtype_of`."""
    sample = of_row(row, kind)
    return (*sample[:_STATE], PLACES[sample.state], *sample[_STATE + 1 :])
