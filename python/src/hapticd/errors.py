"""What can go wrong, as exceptions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class HapticdError(Exception):
    """Anything that this package raises about the rig or the daemon."""


class NoDaemon(HapticdError, ConnectionError):
    """Nobody listens on the socket."""


class ConnectionLost(HapticdError, ConnectionError):
    """The daemon has closed the connection, or the connection was closed here."""


class NoAnswer(HapticdError, TimeoutError):
    """The daemon has not answered in time."""


class LeaseLapsed(HapticdError):
    """The daemon has released the rig, because this program was silent for longer than its lease."""


class SamplesLost(HapticdError):
    """Samples are missing.

    Attributes:
        lost: How many.
        tick: The first tick after them.
    """

    def __init__(self, lost: int, tick: int) -> None:
        super().__init__(f"{lost} samples before tick {tick} were lost; with on_gap='count' they are only counted")
        self.lost = lost
        self.tick = tick


class SamplesLostWarning(UserWarning):
    """Samples are missing, and were counted."""


class NotARecording(HapticdError, ValueError):
    """A file is not a recording of hapticd, or is damaged."""


class Refused(HapticdError):
    """The daemon has refused an operation, and nothing has changed.

    Attributes:
        code: The reason for programs, as docs/control.md lists them.
        message: The reason for people.
        param: The parameter or field, where there is one.
        value: The value refused, in `unit`.
        min: The smallest value accepted, in `unit`.
        max: The largest value accepted, in `unit`.
        unit: The SI unit of the value and its limits.
    """

    def __init__(self, error: Mapping[str, Any]) -> None:
        super().__init__(error["message"])
        self.code: str = error["code"]
        self.message: str = error["message"]
        self.param: str | None = error.get("param")
        self.value: float | None = error.get("value")
        self.min: float | None = error.get("min")
        self.max: float | None = error.get("max")
        self.unit: str | None = error.get("unit")

    def __reduce__(self) -> tuple[type[Refused], tuple[dict[str, Any]]]:
        fields = ("code", "message", "param", "value", "min", "max", "unit")
        return type(self), ({name: getattr(self, name) for name in fields},)


class InvalidValue(Refused, ValueError):
    """A value is refused: outside its limits, unreadable, forbidden by the scene's law, or the rig would chatter.

    This package refuses what it can tell itself before it asks the daemon, with the same codes.
    """


class UnknownName(Refused, LookupError):
    """No parameter, scene, field or operation has this name."""


class Stopped(Refused):
    """A person has stopped the rig: check that it is safe, then `reset`."""


class Faulted(Refused):
    """A check has taken the force away: fix the cause, then `reset`."""


class WrongState(Refused):
    """The rig's state does not allow the operation."""


class Conflict(Refused):
    """Another client has changed the scene since, scheduled changes wait that this would come between, or the library
    has a scene of this name.
    """


class NotAllowed(Refused, PermissionError):
    """This user, or this socket, may not do that."""


class NotReady(Refused):
    """The rig cannot be engaged: it has no device, no watchdog, no force, or was never commissioned."""


_BY_CODE: dict[str, type[Refused]] = {
    code: kind
    for kind, codes in {
        InvalidValue: (
            "bad_request",
            "bad_name",
            "out_of_range",
            "not_finite",
            "not_directional",
            "given_twice",
            "no_coupling",
            "not_applicable",
            "law_forbids",
            "block_and_coupling",
            "too_fast_for_rate",
            "would_chatter",
        ),
        UnknownName: ("unknown_op", "unknown_field", "unknown_parameter", "no_such_scene", "no_such_schedule"),
        Stopped: ("stopped",),
        Faulted: ("faulted",),
        WrongState: ("wrong_state", "no_hand", "hand_held"),
        Conflict: ("conflict", "scheduled", "scene_exists"),
        NotAllowed: ("not_permitted", "read_only"),
        NotReady: (
            "no_device",
            "no_force",
            "no_watchdog",
            "no_button",
            "commands_late",
            "commands_ignored",
            "not_commissioned",
            "maybe_another_rig",
            "device_clock",
            "not_identified",
            "commissioning",
        ),
    }.items()
    for code in codes
}


def refusal(error: Mapping[str, Any]) -> Refused:
    """The exception of an error on the wire."""
    return _BY_CODE.get(error["code"], Refused)(error)


def invalid(param: str, message: str, code: str = "bad_request", **limits: float | str) -> InvalidValue:
    """The exception of a value that is refused before the daemon is asked.

    Args:
        limits: `value`, `min`, `max` and `unit`, where they apply.
    """
    return InvalidValue({"code": code, "message": message, "param": param, **limits})
