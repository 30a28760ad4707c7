"""What the daemon answers. Fields that a later daemon adds are passed over; `Rig.request` gives them all."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar, cast

Value: TypeAlias = float | str | dict[str, float]
"""A number, a word, or one number for each direction: `{"positive": 4.0, "negative": 5.0}`."""


@dataclass(frozen=True)
class StateReply:
    """The answer to `engage`, `release`, `stop` and `reset`."""

    state: str
    """State of the rig after that tick."""
    tick: int
    """The tick that carried it out."""


@dataclass(frozen=True)
class Difference:
    """A difference of two scenes."""

    param: str
    """A parameter, or `name`, `law`, `reseat`."""
    unit: str | None = None
    """SI unit of a parameter."""
    before: Value | None = None
    """The value before; `None` if the scene did not have it."""
    after: Value | None = None
    """The value after; `None` if the scene does not have it."""


@dataclass(frozen=True)
class ChangeReply:
    """The answer to `set`, `load`, `undo` and `redo`."""

    revision: int
    """Revision of the changed scene."""
    applied: dict[str, float]
    """The values set, by full name, SI units."""
    changed: bool = True
    """Whether the scene is changed by it: not by a dry run, and not by the values that it has."""
    tick: int | None = None
    """The first tick that rendered it, or began to ramp to it; `None` where nothing changed, and with `at_tick`."""
    at_tick: int | None = None
    """The tick that will render it, as asked for."""
    ramp_ends_tick: int | None = None
    """The tick at which the ramp ends, if no tick is missed."""
    dry_run: bool = False
    """Whether nothing was changed on purpose."""
    changes: list[Difference] = field(default_factory=list)
    """Differences from the previous scene."""
    advice: list[dict[str, Any]] = field(default_factory=list)
    """Remarks on the changed scene, and the bounds that it breaks."""


@dataclass(frozen=True)
class AcceptedChange:
    """A scheduled change, as the daemon has accepted it."""

    at_tick: int
    """The tick that will render it first."""
    revision: int
    """The revision that its scene will have."""
    applied: dict[str, float]
    """The values that it will set, by full name, SI units."""


@dataclass(frozen=True)
class ScheduleReply:
    """The answer to `schedule`."""

    name: str
    """Name of the schedule, for `cancel`."""
    changes: list[AcceptedChange]
    """Its changes, in the order of their ticks."""
    dry_run: bool = False
    """Whether nothing was scheduled on purpose."""
    advice: list[dict[str, Any]] = field(default_factory=list)
    """Remarks on the scenes, and the bounds that they break."""


@dataclass(frozen=True)
class SceneReply:
    """The answer to `get`."""

    revision: int
    """Revision of the newest scene."""
    params: dict[str, Value]
    """The parameters of the scene asked for, by name, SI units."""
    scene: dict[str, Any]
    """That scene, as its file holds it."""


@dataclass(frozen=True)
class Problem:
    """Something that is wrong, and what to do about it."""

    what: str
    """The problem."""
    remedy: str
    """The remedy."""


@dataclass(frozen=True)
class Device:
    """The rig, as `status` shows it."""

    description: str
    """What the rig is."""
    force_limit_N: float
    """Largest force sent to it, N."""
    slew_limit_N_per_s: float = 0.0
    """Fastest change of that force, N/s."""
    speed_limit_mps: float = 0.0
    """Speed at which the force is taken away, m/s."""
    acceleration_limit_mps2: float = 0.0
    """Acceleration that counts as a jump of its position, m/s^2."""
    engage_refused: list[Problem] = field(default_factory=list)
    """Why the daemon would refuse to engage it now."""
    link: dict[str, Any] | None = None
    """The link to it; `None` for a rig simulated in the daemon."""
    force_limit_by: str = ""
    """Which limit is the smaller one: `configuration` or `device`."""
    samples_forgotten: int = 0
    """Samples that were discarded, because no hand can have made them."""
    takes_hand: bool = False
    """Whether the operation `hand` moves the hand on it."""
    rig_friction: dict[str, Any] | None = None
    """The rig's own friction and damping, and where they come from."""


@dataclass(frozen=True)
class RealTime:
    """The real-time thread, as `status` shows it."""

    memory_locked: bool
    """Whether its memory is locked."""
    problems: list[Problem]
    """Its problems."""
    fifo_priority: int | None = None
    """Its SCHED_FIFO priority; `None` at an ordinary one."""
    cpu: int | None = None
    """The processor that it is pinned to; `None` when it is not."""
    deadline_scheduled: bool = False
    """Whether it is scheduled by deadline."""
    cpus_kept_awake: bool = False
    """Whether the processors are kept out of deep sleep."""
    spin_us: int = 0
    """Time that it spins before each tick, us."""
    denormals_flushed: bool = False
    """Whether the processor takes subnormal numbers as zero."""


@dataclass(frozen=True)
class LibraryScene:
    """The scene of the library that the active scene comes from."""

    name: str
    """Its name there."""
    changed: bool
    """Whether the active scene was changed since."""


@dataclass(frozen=True)
class Status:
    """The state of the rig and of the daemon."""

    server: str
    """Name and version of the daemon."""
    state: str
    """State of the rig: disconnected, idle, engaging, engaged, releasing, stopped or faulted."""
    tick: int
    """The last tick."""
    uptime_s: float
    """Time since the loop began, s."""
    rate_hz: float
    """Nominal rate of the loop, Hz."""
    revision: int
    """Revision of the active scene."""
    scene: str
    """Name of the active scene."""
    command_force_N: float
    """Force commanded on the hand in the last tick, N."""
    device_position_m: float
    """Position of the device in the last tick, m."""
    clients: int
    """Number of clients connected."""
    device: Device
    """The rig."""
    real_time: RealTime
    """The real-time thread."""
    broken_bounds: list[str] = field(default_factory=list)
    """The bounds of the adviser that it breaks on this rig, by name; up to a second old."""
    energy_excess_J: float = 0.0
    """Energy that the sampled loop has created beyond the rig's own losses, J."""
    scheme: str = ""
    """Integration of the block: `exact`, `literal` or `literal:N`."""
    velocity_estimator: str = ""
    """Estimator of the device's velocity from its positions."""
    leases: int = 0
    """Number of clients that hold a lease."""
    fault: str | None = None
    """Why the rig is faulted."""
    library_scene: LibraryScene | None = None
    """The scene of the library that the active scene comes from."""
    scheduled: dict[str, Any] | None = None
    """The changes that wait for their tick."""
    undo_depth: int = 0
    """Number of changes that `undo` can take back."""
    redo_depth: int = 0
    """Number of changes that `redo` can make again."""
    commissioning: dict[str, Any] | None = None
    """The client that commissions or identifies the rig."""


T = TypeVar("T")


def decoded(kind: type[T], answer: Mapping[str, Any]) -> T:
    """The answer as a dataclass."""
    return cast(T, _decode(kind, answer))


@functools.cache
def _types(kind: type[Any]) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {each.name: hints[each.name] for each in dataclasses.fields(kind)}


def _decode(kind: Any, value: Any) -> Any:
    if value is None:
        return None
    if isinstance(kind, types.UnionType):
        kind = next(each for each in typing.get_args(kind) if each is not type(None))
    if typing.get_origin(kind) is list:
        return [_decode(typing.get_args(kind)[0], each) for each in value]
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = _types(kind)
        return kind(**{name: _decode(hints[name], each) for name, each in value.items() if name in hints})
    return value
