"""The operations of the daemon as methods: each asks once, and returns its answer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from operator import index
from typing import Any, SupportsIndex

from hapticd.answers import (
    AdviceReply,
    ChangeReply,
    Description,
    ListedScene,
    SceneReply,
    SceneSaveReply,
    ScheduleReply,
    StateReply,
)
from hapticd.change import Change, SceneRef, given, merged, numbers, options, scheduled
from hapticd.decoding import decoded
from hapticd.duration import Duration
from hapticd.errors import invalid
from hapticd.status import JournalEntry, Status


class Operations(ABC):
    """What a program asks of the daemon."""

    @abstractmethod
    def request(self, /, op: str, **fields: Any) -> dict[str, Any]:
        """Any operation of the protocol, with its fields as on the wire; returns what `ok` holds."""

    def engage(self, same_rig: bool = False, *, anyway: bool = False) -> StateReply:
        """Ramps the force up.

        Args:
            same_rig: Says that the device is the rig that was commissioned, where it cannot tell: it has no serial
                number, or its firmware has changed.
            anyway: Engages once though the rig would chatter.

        Raises:
            Stopped: A person has stopped the rig.
            NotReady: The rig was never commissioned, may be another than the one that was, or lacks something.
            InvalidValue: The scene would chatter on it (`code` is `would_chatter`).
        """
        if same_rig:
            self.request("commission.confirm")
        return decoded(StateReply, self.request("engage", **given(anyway=anyway or None)))

    def release(self) -> StateReply:
        """Ramps the force down."""
        return decoded(StateReply, self.request("release"))

    def reset(self) -> StateReply:
        """Clears a stop or a fault."""
        return decoded(StateReply, self.request("reset"))

    def status(self) -> Status:
        """The state of the rig and of the daemon."""
        return decoded(Status, self.request("status"))

    def describe(self) -> Description:
        """The friction law of the active scene, its parameters with their units and limits, and all laws."""
        return decoded(Description, self.request("describe"))

    def advise(self) -> AdviceReply:
        """Every check of the active scene against the rig, such as stability and passivity. `engage` and `set` find out
        whether it chatters."""
        return decoded(AdviceReply, self.request("advise"))

    def log(self, *, after: int | None = None, limit: int | None = None) -> list[JournalEntry]:
        """Who changed what and when, oldest first.

        Args:
            after: Only entries after this number (`seq`).
            limit: The newest so many; 100 without it.
        """
        entries = self.request("log", **given(after=after, limit=limit))["entries"]
        return [decoded(JournalEntry, entry) for entry in entries]

    def scenes(self) -> list[ListedScene]:
        """The scenes in the library, for `load`."""
        return [decoded(ListedScene, scene) for scene in self.request("scene.list")["scenes"]]

    def get(self, scene: SceneRef | None = None) -> SceneReply:
        """The active scene, or another one."""
        return decoded(SceneReply, self.request("get", **given(scene=scene)))

    def save(self, name: str, scene: SceneRef | None = None, *, replace: bool = False) -> SceneSaveReply:
        """Saves the active scene, or another one, in the library.

        Args:
            name: At most 64 letters, digits, `-`, `_`, `.` and spaces.
            replace: Replace a saved scene of this name.

        Raises:
            InvalidValue: The name is not valid.
            Conflict: The library has a scene of this name; built-in ones cannot be replaced.
        """
        fields = given(scene=scene, replace=replace or None)
        return decoded(SceneSaveReply, self.request("scene.save", name=name, **fields))

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
        """Changes parameters, by name or symbol, all in one tick or none: `rig.set(mass=1.5, Fs=5)`, kg and N, or
        `rig.set(mass="1500 g", Fs="5 N")`.

        Args:
            params: Parameters whose names Python does not take: `{"Fs+": 5, "Fs-": 4}` sets each direction.
            ramp: Time over which to change, up to 10 s; at once without it.
            at_tick: The tick that is to render it first; as soon as can be without it. See `at`.
            if_revision: Refuse unless this is the newest revision.
            dry_run: Answer with what would happen, and change nothing.
            anyway: Change once though the rig would chatter.
            more: Parameters by name or symbol; numbers are in SI units. `describe` lists them.

        Raises:
            InvalidValue: A value lies outside its limits, which the error has, or has the unit of something else; or
                the scene would chatter on this rig, under whose force it is (`code` is `would_chatter`).
            UnknownName: No parameter has this name.
            Conflict: Another client has changed the scene since `if_revision`.
        """
        how = options(ramp, at_tick, if_revision, dry_run, anyway)
        return self._change("set", params=numbers(merged(params, more), self._units()), **how)

    def _units(self) -> Callable[[str], str]:
        """Finds the SI unit of a parameter of the active scene, which the daemon refuses otherwise. The scene is asked
        for once, with the first parameter."""
        describe = cache(self.describe)

        def unit_of(param: str) -> str:
            bare = param.removesuffix("+").removesuffix("-")
            for each in describe().parameters:
                if bare in (each.name, each.symbol, *each.aliases):
                    return each.unit
            self.request("set", params={param: 1}, dry_run=True)
            raise invalid(param, f"{param}: its unit is not known here; give a number in SI units")

        return unit_of

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
            InvalidValue: The tick is not whole, is past, or too far ahead.
        """
        try:
            whole = index(tick)
        except TypeError:
            raise invalid("tick", f"tick = {tick!r} is not a whole number") from None
        return self.set(merged(params, more), ramp=ramp, at_tick=whole, anyway=anyway)

    def schedule(
        self,
        changes: Sequence[Mapping[str, Any]] | Mapping[str, Any],
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
            changes: One object or several, with `at_tick`, either `params` or `scene`, and `ramp` where the change is
                to take time.
            name: The schedule's name, for `cancel`; the daemon's choice without it.
            keep: Keep it when this connection ends.
            if_revision: Refuse unless this is the newest revision.
            dry_run: Answer with what would happen, and schedule nothing.
            anyway: Schedule once though the rig would chatter.

        Raises:
            InvalidValue: A tick is past, a value lies outside its limits, or there are too many changes.
        """
        how = given(
            name=name, keep=keep or None, if_revision=if_revision, dry_run=dry_run or None, anyway=anyway or None
        )
        unit_of = self._units()
        several = [changes] if isinstance(changes, Mapping) else changes
        wire = [scheduled(change, unit_of) for change in several]
        return decoded(ScheduleReply, self.request("schedule", changes=wire, **how))

    def cancel(self, name: str | None = None) -> int:
        """Takes scheduled changes back: of this schedule and those after it, or all. Returns how many."""
        cancelled: int = self.request("schedule.cancel", **given(name=name))["cancelled"]
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
        how = options(ramp, at_tick, if_revision, dry_run, anyway)
        return self._change("scene.load", scene=scene, **how)

    def undo(self, *, anyway: bool = False) -> ChangeReply:
        """Undoes the newest change, of any client; `anyway` though the rig would chatter."""
        return self._change("undo", **given(anyway=anyway or None))

    def redo(self, *, anyway: bool = False) -> ChangeReply:
        """Redoes the change that was undone last; `anyway` though the rig would chatter."""
        return self._change("redo", **given(anyway=anyway or None))

    def _change(self, op: str, **fields: Any) -> ChangeReply:
        return decoded(ChangeReply, self.request(op, **fields))
