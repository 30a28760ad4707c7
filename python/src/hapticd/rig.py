"""The rig: what a program does with it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, overload

from hapticd import socket_path
from hapticd.answers import StateReply
from hapticd.connection import Connection
from hapticd.decoding import decoded
from hapticd.duration import Duration, milliseconds, seconds
from hapticd.errors import HapticdError, invalid
from hapticd.events import Events
from hapticd.extras import need
from hapticd.lease import Lease
from hapticd.operations import Operations
from hapticd.recording import Recording
from hapticd.sample import PlanarSample, Sample, State, checked_state
from hapticd.samples import Buffer, Samples
from hapticd.status import Status

if TYPE_CHECKING:
    import numpy
    import numpy.typing
    import pandas
    from matplotlib.axes import Axes

#: Longest plot, s: so much is kept once something was plotted.
_RECENT_S = 60.0


class Rig(Operations):
    """A rig, by its daemon. `connect` makes one.

    Every method may be called from any thread. Requests wait for one another; `stop` waits for nothing.

    Attributes:
        path: The control socket.
        hello: The daemon's greeting.
    """

    def __init__(self, path: Path, *, lease: Duration | None, keep: bool = False) -> None:
        self.path = path
        self._keep = keep
        self._lease: Lease | None = None
        self._loop_rate_hz: float | None = None
        self._recent: Buffer | None = None
        lease_ms = None if lease is None else _lease_ms(lease)
        with ExitStack() as opened:
            self._control = opened.enter_context(closing(Connection(path)))
            self._stop = opened.enter_context(closing(Connection(path)))
            self.hello = self._control.hello
            if lease_ms is not None and "rights" not in self.hello:
                self._lease = Lease(self._control, lease_ms)
            opened.pop_all()

    if not TYPE_CHECKING:  # a type checker knows already that there is no such attribute

        def __setattr__(self, name: str, value: object) -> None:
            if not (name.startswith("_") or name in ("path", "hello") or hasattr(type(self), name)):
                raise AttributeError(f"rig.{name} = {value!r} would change nothing: rig.set({name}={value!r}) does")
            object.__setattr__(self, name, value)

    def request(self, /, op: str, **fields: Any) -> dict[str, Any]:
        """Any operation of the protocol, with its fields as on the wire; returns what `ok` holds."""
        if self._lease is not None:
            self._lease.check()
        return self._control.request(op, fields)

    def stop(self) -> StateReply:
        """Zero force in the next tick, until a `reset`. It has a connection of its own, and overtakes everything.

        Raises:
            Refused: The rig is stopped, but its device has not confirmed the zero force: cut its power.
        """
        if self._stop.is_closed:
            self._stop = Connection(self.path)
        return decoded(StateReply, self._stop.request("stop", {}))

    @property
    def loop_rate_hz(self) -> float:
        """Nominal rate of the daemon's loop, Hz."""
        if self._loop_rate_hz is None:
            self._loop_rate_hz = self.status().rate_hz
        return self._loop_rate_hz

    def samples(
        self,
        *,
        rate_hz: float | None = None,
        batch_ms: int | None = None,
        on_gap: Literal["raise", "count"] = "raise",
    ) -> Samples:
        """The samples from now on, to iterate over: every tick, or `rate_hz` of them a second.

        Args:
            batch_ms: Time between two batches of samples, ms: 10 without it.
            on_gap: Whether samples that are lost raise `SamplesLost`, or are counted in `lost` alone.
        """
        return Samples(self.path, self.loop_rate_hz, rate_hz=rate_hz, batch_ms=batch_ms, on_gap=on_gap)

    def buffer(self, length: Duration = 60.0, *, rate_hz: float | None = None, batch_ms: int | None = None) -> Buffer:
        """The samples from now on in a numpy array, which a thread fills in the background (extra `numpy`).

        Args:
            length: How long samples are kept: an hour of 1000 samples a second, or less of more.
        """
        need("numpy", "numpy")
        length_s = seconds("length", length)
        return Buffer(self.path, self.loop_rate_hz, length_s, rate_hz=rate_hz, batch_ms=batch_ms)

    def events(self, topics: Sequence[str] = ("state", "log")) -> Events:
        """What happens from now on, to iterate over: `state` (at once, and at every change), `log`, `timing`."""
        return Events(self.path, topics)

    @overload
    def record(self, length: Duration, *, rate_hz: float | None = None) -> pandas.DataFrame: ...

    @overload
    def record(
        self,
        length: Duration | None = None,
        *,
        path: str | os.PathLike[str],
        notes: str | None = None,
        replace: bool = False,
        rate_hz: float | None = None,
    ) -> Recording: ...

    def record(
        self,
        length: Duration | None = None,
        *,
        path: str | os.PathLike[str] | None = None,
        notes: str | None = None,
        replace: bool = False,
        rate_hz: float | None = None,
    ) -> pandas.DataFrame | Recording:
        """Records for a time into a data frame (extra `pandas`), or with `path` into a file.

        The data frame has a row for each sample, with `marks` and `metadata` in `.attrs`. Samples that are lost have
        a mark, and give a `SamplesLostWarning`. Into a file a thread writes until the block ends:

            with rig.record(path="slide.mcap") as recording:
                recording.mark("first touch")

        Args:
            length: How long; the recording has ended when this returns.
            path: A new file, whose name ends in .mcap or .csv. `hapticd.read` and haptic-ctl read it.
            notes: What the file says about itself.
            replace: Replace a file that exists.

        Raises:
            FileExistsError: The file exists.
            InvalidValue: Neither a length nor a path is given, or the name ends in something else.
        """
        if isinstance(length, str) and length.endswith((".mcap", ".csv", ".parquet")):
            raise invalid("length", f"length = {length!r} is the name of a file: write record(path={length!r})")
        length_s = None if length is None else seconds("length", length)
        if path is not None:
            recording = Recording(
                self.path, self._control.request, Path(path), length_s, rate_hz=rate_hz, notes=notes, replace=replace
            )
            if length_s is not None:
                recording.wait()
            return recording
        if length_s is None:
            raise invalid("length", "length: give how long to record, or the path of a file")
        need("pandas", "numpy", "pandas")
        from hapticd.recorder import record

        return record(self.path, self.request, length_s, rate_hz)

    def plot(self, length: Duration = 5.0) -> tuple[Axes, Axes]:
        """Plots force and position of the last seconds, for a notebook (extra `plot`). Returns the two axes.

        The first call begins to keep samples, and so waits for this time.

        Args:
            length: Time to plot, up to a minute.
        """
        need("plot", "numpy", "matplotlib")
        from hapticd import plot

        return plot.draw(*self._last(seconds("length", length)))

    def _last(self, length_s: float) -> tuple[numpy.typing.NDArray[numpy.void], str]:
        """The samples of the last seconds, and what they are of."""
        if not 0 < length_s <= _RECENT_S:
            message = f"length = {length_s:g} s is out of range: it must be above 0 and up to {_RECENT_S:g} s"
            raise invalid("length", message, "out_of_range", value=length_s, min=0.0, max=_RECENT_S, unit="s")
        if self._recent is None:
            self._recent = self.buffer(_RECENT_S)
        count = max(2, round(length_s * self._recent.rate_hz))
        self._recent.wait_for(count)
        status = self.status()
        return self._recent.latest(count), f"{status.scene}: {status.state}"

    @overload
    def wait_for(self, condition: State | Callable[[Sample], object], timeout: Duration = 10.0) -> int: ...

    @overload
    def wait_for(self, condition: Callable[[PlanarSample], object], timeout: Duration = 10.0) -> int: ...

    def wait_for(self, condition: State | Callable[[Any], object], timeout: Duration = 10.0) -> int:
        """Waits until the rig is in a state, or until a condition holds of a sample; returns that tick.

            rig.wait_for("engaged")
            rig.wait_for(lambda sample: abs(sample.device_position_m) > 0.02)

        Raises:
            InvalidValue: There is no such state.
            Stopped, Faulted: The rig was stopped or faulted, while something else was waited for.
            TimeoutError: It has not come about in time.
        """
        timeout_s = seconds("timeout", timeout)
        if callable(condition):
            with self.samples(on_gap="count") as samples:
                return samples.wait_for(condition, timeout_s).tick
        checked_state(condition)
        with self.events(["state"]) as events:
            return events.wait_for(condition, timeout_s)

    def close(self) -> None:
        """Ends the connection. With a lease the rig is released, unless it was to be kept."""
        try:
            if self._lease is not None:
                self._lease.close(keep=self._keep)
        finally:
            if self._recent is not None:
                self._recent.close()
            self._control.close()
            self._stop.close()

    def __repr__(self) -> str:
        try:
            status = decoded(Status, self._control.request("status", {}))
        except HapticdError as error:
            return f"<Rig: {error}>"
        state = status.state if status.fault is None else f"{status.state} ({status.fault})"
        return f"<Rig {status.device.description}: {state}, scene {status.scene!r}, at {self.path}>"

    def __enter__(self) -> Rig:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            # What a program leaves behind that has failed, nobody watches over.
            self._keep = False
        try:
            self.close()
        except HapticdError:
            if kind is None:
                raise


def connect(
    path: str | os.PathLike[str] | None = None,
    *,
    rig: str | None = None,
    lease: Duration | None = 1.0,
    keep: bool = False,
) -> Rig:
    """Connects to the daemon.

        with hapticd.connect() as rig:
            rig.engage()

    The connection is a lease: should this program end, die, or be silent for longer, the daemon releases the rig along
    its ramp. So is the end of the `with` block. A thread of its own renews the lease, however busy the program is.

    Args:
        path: The control socket; without it where haptic-ctl finds it.
        rig: Name of the rig, of many: the daemon of the service hapticd@NAME.
        lease: Silence after which the rig is released, from 20 ms to 60 s; `None` for no lease. On the watchers'
            socket, where nothing can be engaged, there is none.
        keep: Leave the rig as it is at the end of the block, unless by an exception.

    Raises:
        NoDaemon: Nobody listens on the socket.
        NotAllowed: This user may not connect.
    """
    return Rig(socket_path.for_client(path, rig), lease=lease, keep=keep)


def _lease_ms(lease: Duration) -> int:
    timeout_ms = round(milliseconds("lease", lease))
    if timeout_ms == 0:
        message = f"lease = {lease!r} is out of range: it must be from 20 to 60000 ms, or None for no lease"
        raise invalid("lease", message, "out_of_range", value=0.0, min=0.02, max=60.0, unit="s")
    return timeout_ms
