"""The rig: what a program does with it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex, TypeAlias

from hapticd import socket_path
from hapticd.answers import ChangeReply, SceneReply, ScheduleReply, StateReply, Status, decoded
from hapticd.connection import Connection
from hapticd.duration import Duration, milliseconds, seconds
from hapticd.errors import HapticdError
from hapticd.events import Events
from hapticd.lease import Lease
from hapticd.samples import Buffer, Samples

if TYPE_CHECKING:
    import pandas

SceneRef: TypeAlias = int | str | Mapping[str, Any]
"""A revision, a name in the library, or the scene itself."""

Change: TypeAlias = SupportsFloat | Mapping[str, SupportsFloat]
"""A number in the parameter's SI unit, or a relative change: `{"times": 2}`, `{"plus": 0.5}`."""


class Rig:
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
        lease_ms = None if lease is None else _lease_ms(lease)
        with ExitStack() as opened:
            self._control = opened.enter_context(closing(Connection(path)))
            self._stop = opened.enter_context(closing(Connection(path)))
            self.hello = self._control.hello
            if lease_ms is not None and "rights" not in self.hello:
                self._lease = Lease(self._control, lease_ms)
            opened.pop_all()

    def request(self, op: str, **fields: Any) -> dict[str, Any]:
        """Any operation of the protocol, with its fields as on the wire; returns what `ok` holds."""
        if self._lease is not None:
            self._lease.check()
        return self._control.request(op, fields)

    def engage(self, same_rig: bool = False, *, anyway: bool = False) -> StateReply:
        """Ramps the force up.

        Args:
            same_rig: Says that the device is the rig that was commissioned, where it cannot tell: it has no serial
                number, or its firmware has changed.
            anyway: Engages once though the rig would chatter.

        Raises:
            Stopped: A person has stopped the rig.
            NotReady: The rig was never commissioned, may be another than the one that was, or lacks something; or the
                scene would chatter on it.
        """
        if same_rig:
            self.request("commission.confirm")
        return decoded(StateReply, self.request("engage", **_given(anyway=anyway or None)))

    def release(self) -> StateReply:
        """Ramps the force down."""
        return decoded(StateReply, self.request("release"))

    def reset(self) -> StateReply:
        """Clears a stop or a fault."""
        return decoded(StateReply, self.request("reset"))

    def stop(self) -> StateReply:
        """Zero force in the next tick, until a `reset`. It has a connection of its own, and overtakes everything.

        Raises:
            Refused: The rig is stopped, but its device has not confirmed the zero force: cut its power.
        """
        if self._stop.is_closed:
            self._stop = Connection(self.path)
        return decoded(StateReply, self._stop.request("stop", {}))

    def status(self) -> Status:
        """The state of the rig and of the daemon."""
        return decoded(Status, self.request("status"))

    def get(self, scene: SceneRef | None = None) -> SceneReply:
        """The active scene, or another one."""
        return decoded(SceneReply, self.request("get", **_given(scene=scene)))

    def set(
        self,
        params: Mapping[str, Change] | None = None,
        /,
        *,
        ramp: Duration | None = None,
        at_tick: int | None = None,
        if_revision: int | None = None,
        dry_run: bool = False,
        anyway: bool = False,
        **more: Change,
    ) -> ChangeReply:
        """Changes parameters, by name or symbol, all in one tick or none: `rig.set(mass=1.5, Fs=5)`, kg and N.

        Args:
            params: Parameters whose names Python does not take: `{"Fs+": 5, "Fs-": 4}` sets each direction.
            ramp: Time over which to change, up to 10 s; at once without it.
            at_tick: The tick that is to render it first; as soon as can be without it. See `at`.
            if_revision: Refuse unless this is the newest revision.
            dry_run: Answer with what would happen, and change nothing.
            anyway: Change once though the rig would chatter.
            more: Parameters by name or symbol, in SI units.

        Raises:
            InvalidValue: A value lies outside its limits, which the error has.
            UnknownName: No parameter has this name.
            Conflict: Another client has changed the scene since `if_revision`.
            NotReady: The scene would chatter on this rig, under whose force it is.
        """
        options = _options(ramp, at_tick, if_revision, dry_run, anyway)
        return self._change("set", params={**(params or {}), **more}, **options)

    def at(
        self,
        tick: SupportsIndex,
        params: Mapping[str, Change] | None = None,
        /,
        *,
        ramp: Duration | None = None,
        anyway: bool = False,
        **more: Change,
    ) -> ChangeReply:
        """Changes parameters in the tick `tick`, and no other: `rig.at(5000, Fs=6)`.

        The answer comes at once; `events` tell when it was rendered. The change is cancelled by `stop`, by
        `cancel`, and by the end of this connection.

        Raises:
            InvalidValue: The tick is past, or too far ahead.
        """
        return self.set({**(params or {}), **more}, ramp=ramp, at_tick=int(tick), anyway=anyway)

    def schedule(
        self,
        changes: Sequence[Mapping[str, Any]],
        *,
        name: str | None = None,
        keep: bool = False,
        if_revision: int | None = None,
        dry_run: bool = False,
        anyway: bool = False,
    ) -> ScheduleReply:
        """Changes the scene in ticks to come: all of these changes, or none.

            rig.schedule([{"at_tick": t + 500 * k, "params": {"Fs": 4 + 0.1 * k}} for k in range(50)])

        Args:
            changes: Objects with `at_tick`, either `params` or `scene`, and `ramp` where the change is to take time.
            name: The schedule's name, for `cancel`; the daemon's choice without it.
            keep: Keep it when this connection ends.
            if_revision: Refuse unless this is the newest revision.
            dry_run: Answer with what would happen, and schedule nothing.
            anyway: Schedule once though the rig would chatter.

        Raises:
            InvalidValue: A tick is past, a value lies outside its limits, or there are too many changes.
        """
        options = _given(
            name=name, keep=keep or None, if_revision=if_revision, dry_run=dry_run or None, anyway=anyway or None
        )
        wire = [_scheduled(change) for change in changes]
        return decoded(ScheduleReply, self.request("schedule", changes=wire, **options))

    def cancel(self, name: str | None = None) -> int:
        """Takes scheduled changes back: of this schedule and those after it, or all. Returns how many."""
        cancelled: int = self.request("schedule.cancel", **_given(name=name))["cancelled"]
        return cancelled

    def load(
        self,
        scene: SceneRef,
        *,
        ramp: Duration | None = None,
        at_tick: int | None = None,
        if_revision: int | None = None,
        dry_run: bool = False,
        anyway: bool = False,
    ) -> ChangeReply:
        """Loads a whole scene: a name in the library, an earlier revision, or the scene itself. See `set`."""
        options = _options(ramp, at_tick, if_revision, dry_run, anyway)
        return self._change("scene.load", scene=scene, **options)

    def undo(self, *, anyway: bool = False) -> ChangeReply:
        """Undoes the newest change, of any client; `anyway` though the rig would chatter."""
        return self._change("undo", **_given(anyway=anyway or None))

    def redo(self, *, anyway: bool = False) -> ChangeReply:
        """Redoes the change that was undone last; `anyway` though the rig would chatter."""
        return self._change("redo", **_given(anyway=anyway or None))

    def _change(self, op: str, **fields: Any) -> ChangeReply:
        return decoded(ChangeReply, self.request(op, **fields))

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
            length: How long samples are kept.
        """
        length_s = seconds("length", length)
        return Buffer(self.path, self.loop_rate_hz, length_s, rate_hz=rate_hz, batch_ms=batch_ms)

    def events(self, topics: Sequence[str] = ("state", "log")) -> Events:
        """What happens from now on, to iterate over: `state` (at once, and at every change), `log`, `timing`."""
        return Events(self.path, topics)

    def record(self, length: Duration, *, rate_hz: float | None = None) -> pandas.DataFrame:
        """Records for a time (extra `pandas`): a row for each sample, with `marks` and `metadata` in `.attrs`.

        Samples that are lost have a mark, and give a `SamplesLostWarning`.
        """
        from hapticd.recorder import record

        return record(self.path, self.request, seconds("length", length), rate_hz)

    def wait_for(self, state: str, timeout: Duration = 10.0) -> int:
        """Waits until the rig is in a state; returns the tick since which it is.

        Raises:
            Stopped, Faulted: The rig was stopped or faulted, while another state was waited for.
            TimeoutError: It is not in that state in time.
        """
        with self.events(["state"]) as events:
            return events.wait_for(state, seconds("timeout", timeout))

    def close(self) -> None:
        """Ends the connection. With a lease the rig is released, unless it was to be kept."""
        try:
            if self._lease is not None:
                self._lease.close(keep=self._keep)
        finally:
            self._control.close()
            self._stop.close()

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


def connect(path: str | os.PathLike[str] | None = None, *, lease: Duration | None = 1.0, keep: bool = False) -> Rig:
    """Connects to the daemon.

        with hapticd.connect() as rig:
            rig.engage()

    The connection is a lease: should this program end, die, or be silent for longer, the daemon releases the rig along
    its ramp. So is the end of the `with` block. A thread of its own renews the lease, however busy the program is.

    Args:
        path: The control socket; without it where haptic-ctl finds it.
        lease: Silence after which the rig is released, from 20 ms to 60 s; `None` for no lease. On the watchers'
            socket, where nothing can be engaged, there is none.
        keep: Leave the rig as it is at the end of the block, unless by an exception.

    Raises:
        NoDaemon: Nobody listens on the socket.
        NotAllowed: This user may not connect.
    """
    return Rig(socket_path.for_client(path), lease=lease, keep=keep)


def _lease_ms(lease: Duration) -> int:
    timeout_ms = round(milliseconds("lease", lease))
    if timeout_ms == 0:
        raise ValueError(f"lease = {lease!r} is out of range: it must be from 20 to 60000 ms, or None for no lease")
    return timeout_ms


def _options(
    ramp: Duration | None, at_tick: int | None, if_revision: int | None, dry_run: bool, anyway: bool
) -> dict[str, Any]:
    """The fields that say how a scene changes."""
    ramp_ms = None if ramp is None else milliseconds("ramp", ramp)
    return _given(
        ramp_ms=ramp_ms, at_tick=at_tick, if_revision=if_revision, dry_run=dry_run or None, anyway=anyway or None
    )


def _scheduled(change: Mapping[str, Any]) -> dict[str, Any]:
    """A change of a schedule, as on the wire."""
    wire = dict(change)
    if "ramp" in wire:
        wire["ramp_ms"] = milliseconds("ramp", wire.pop("ramp"))
    return wire


def _given(**fields: Any) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value is not None}
