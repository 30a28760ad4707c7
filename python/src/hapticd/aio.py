"""The same for asyncio.

    async with hapticd.aio.connect() as rig:
        await rig.engage()
        async for sample in rig.samples():
            ...

Requests and subscriptions run on threads of their own, so that a busy event loop keeps its lease and loses no sample.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial, wraps
from types import TracebackType
from typing import TYPE_CHECKING, Any, Concatenate, Generic, Literal, ParamSpec, Protocol, TypeVar, overload

from hapticd import rig as blocking
from hapticd.duration import Duration, seconds
from hapticd.recording import Recording
from hapticd.sample import PlanarSample, Sample, State

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

P = ParamSpec("P")
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class _Source(Protocol[T_co]):
    def __next__(self) -> T_co: ...
    def close(self) -> None: ...


class Stream(Generic[T]):
    """Samples or events, to iterate over. The subscription begins with its `async with` block, or else with the
    first item that is awaited, and ends with the block, with `close`, or with the rig's.

    Attributes:
        source: The blocking stream, with its attributes.
    """

    def __init__(self, begin: Callable[[], _Source[T]]) -> None:
        self._begin = begin
        self._thread = ThreadPoolExecutor(1, "hapticd stream")
        self.source: _Source[T] | None = None

    def __aiter__(self) -> AsyncIterator[T]:
        return self

    async def __anext__(self) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._next)

    def _next(self) -> T:
        return next(self._subscribe())

    def _subscribe(self) -> _Source[T]:
        if self.source is None:
            self.source = self._begin()
        return self.source

    def close(self) -> None:
        """Ends the subscription."""
        if self.source is not None:
            self.source.close()
        self._thread.shutdown(wait=False)

    async def __aenter__(self) -> Stream[T]:
        await asyncio.get_running_loop().run_in_executor(self._thread, self._subscribe)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _awaited(
    method: Callable[Concatenate[blocking.Rig, P], T], thread: str = "_requests"
) -> Callable[Concatenate[Rig, P], Coroutine[Any, Any, T]]:
    """A method of the blocking rig, to await: it runs on a thread of the rig."""

    @wraps(method)
    async def awaited(self: Rig, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return await self._run(getattr(self, thread), partial(method, self.blocking, *args, **kwargs))

    return awaited


class Rig:
    """A rig, by its daemon: `hapticd.Rig` with methods to await.

    Attributes:
        blocking: The rig for code that may block.
    """

    def __init__(self, begin: Callable[[], blocking.Rig]) -> None:
        self._begin = begin
        self.blocking: blocking.Rig
        # A stop has a thread of its own, and so waits for nothing.
        self._requests = ThreadPoolExecutor(1, "hapticd requests")
        self._stops = ThreadPoolExecutor(1, "hapticd stop")
        self._waits = ThreadPoolExecutor(4, "hapticd wait")
        self._streams: list[Stream[Any]] = []

    async def _run(self, thread: ThreadPoolExecutor, call: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(thread, call)

    request = _awaited(blocking.Rig.request)
    engage = _awaited(blocking.Rig.engage)
    release = _awaited(blocking.Rig.release)
    reset = _awaited(blocking.Rig.reset)
    stop = _awaited(blocking.Rig.stop, "_stops")
    status = _awaited(blocking.Rig.status)
    describe = _awaited(blocking.Rig.describe)
    advise = _awaited(blocking.Rig.advise)
    log = _awaited(blocking.Rig.log)
    scenes = _awaited(blocking.Rig.scenes)
    save = _awaited(blocking.Rig.save)
    get = _awaited(blocking.Rig.get)
    set = _awaited(blocking.Rig.set)
    at = _awaited(blocking.Rig.at)
    schedule = _awaited(blocking.Rig.schedule)
    cancel = _awaited(blocking.Rig.cancel)
    load = _awaited(blocking.Rig.load)
    undo = _awaited(blocking.Rig.undo)
    redo = _awaited(blocking.Rig.redo)
    #: Its `wait_for` waits in the calling thread: `await asyncio.to_thread(buffer.wait_for, n)`.
    buffer = _awaited(blocking.Rig.buffer)

    @overload
    async def record(self, length: Duration, *, rate_hz: float | None = None) -> pandas.DataFrame: ...

    @overload
    async def record(
        self,
        length: Duration | None = None,
        *,
        path: str | os.PathLike[str],
        notes: str | None = None,
        replace: bool = False,
        rate_hz: float | None = None,
    ) -> Recording: ...

    async def record(self, length: Duration | None = None, **how: Any) -> pandas.DataFrame | Recording:
        """See `hapticd.Rig.record`. A recording is the blocking one: its block waits for the last rows alone."""
        begin: Callable[[], pandas.DataFrame | Recording] = partial(self.blocking.record, length, **how)
        return await self._run(self._waits, begin)

    async def plot(self, length: Duration = 5.0) -> tuple[Axes, Axes]:
        """See `hapticd.Rig.plot`."""
        from hapticd import plot

        # Drawn here: pyplot is for one thread.
        return plot.draw(*await self._run(self._waits, partial(self.blocking._last, seconds("length", length))))

    @overload
    async def wait_for(self, condition: State | Callable[[Sample], object], timeout: Duration = 10.0) -> int: ...

    @overload
    async def wait_for(self, condition: Callable[[PlanarSample], object], timeout: Duration = 10.0) -> int: ...

    async def wait_for(self, condition: State | Callable[[Any], object], timeout: Duration = 10.0) -> int:
        """See `hapticd.Rig.wait_for`. The condition is called on another thread."""
        return await self._run(self._waits, partial(self.blocking.wait_for, condition, timeout))

    def samples(
        self,
        *,
        rate_hz: float | None = None,
        batch_ms: int | None = None,
        on_gap: Literal["raise", "count"] = "raise",
    ) -> Stream[Sample]:
        """See `hapticd.Rig.samples`."""
        return self._stream(partial(self.blocking.samples, rate_hz=rate_hz, batch_ms=batch_ms, on_gap=on_gap))

    def events(self, topics: Sequence[str] = ("state", "log")) -> Stream[dict[str, Any]]:
        """See `hapticd.Rig.events`."""
        return self._stream(partial(self.blocking.events, topics))

    def _stream(self, begin: Callable[[], _Source[T]]) -> Stream[T]:
        stream = Stream(begin)
        self._streams.append(stream)
        return stream

    def __repr__(self) -> str:
        return repr(self.blocking) if hasattr(self, "blocking") else "<Rig: not connected yet>"

    async def __aenter__(self) -> Rig:
        self.blocking = await self._run(self._requests, self._begin)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream in self._streams:
            stream.close()
        # Shielded: the rig is let go of even if this task is cancelled again.
        await asyncio.shield(self._run(self._stops, partial(self.blocking.__exit__, kind, error, trace)))
        for thread in (self._requests, self._stops, self._waits):
            thread.shutdown(wait=False)


def connect(
    path: str | os.PathLike[str] | None = None,
    *,
    rig: str | None = None,
    lease: Duration | None = 1.0,
    keep: bool = False,
) -> Rig:
    """A rig, for `async with`. See `hapticd.connect`."""
    return Rig(lambda: blocking.connect(path, rig=rig, lease=lease, keep=keep))
