"""What the daemon answers. Fields that a later daemon adds are passed over; `Rig.request` gives them all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeAlias

from hapticd.sample import State

Value: TypeAlias = float | str | dict[str, float]
"""A number, a word, or one number for each direction: `{"positive": 4.0, "negative": 5.0}`."""


@dataclass(frozen=True)
class StateReply:
    """The answer to `engage`, `release`, `stop` and `reset`."""

    state: State
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
class Finding:
    """A bound on the scene, and how the scene keeps it."""

    check: str
    """Name of the check."""
    passes: bool
    """Whether the scene keeps the bound."""
    bound: float
    """The bound, in `unit`."""
    unit: str
    """Unit of value and bound."""
    margin: float
    """How far inside the bound, as a ratio; below 1 it is broken."""
    value: float | None = None
    """The scene's value, in `unit`; `None` where it is infinite."""
    mending: float | None = None
    """The value of the advice's `param` that would fix it."""


@dataclass(frozen=True)
class Advice:
    """A remark on a scene."""

    param: str
    """The parameter concerned: the one to change, where one change fixes it."""
    message: str
    """The remark."""
    finding: Finding | None = None
    """The check of a bound; `None` for another remark."""


@dataclass(frozen=True)
class WorstPlace:
    """Where a property of a rig of two axes is the worst in its workspace."""

    direction_deg: float
    """Direction, from the x axis to the left, degrees from -90 to 90."""
    x_m: float | None = None
    """Position, m; `None` where every place is alike."""
    y_m: float | None = None
    """Position, m; `None` where every place is alike."""


@dataclass(frozen=True)
class AdviceBasis:
    """The facts of the rig that advice is based on."""

    period_us: float
    """Time between ticks of the loop, us."""
    delay_us: float
    """Delay from a sample to its force on the motor, us."""
    delay_measured: bool
    """Whether that delay was measured on the link; otherwise it is assumed."""
    damping_Ns_per_m: float
    """Viscous damping of the rig itself, without what is compensated, N s/m."""
    friction_N: float
    """Coulomb friction of the rig itself, without what is compensated, N."""
    damping_from: str
    """The source of the damping: option, identified, commissioned or default."""
    friction_from: str
    """The source of the friction: the same words."""
    resolution_m: float
    """Distance between two counts of its encoder, m; 0 for a perfect one."""
    sample_period_us: float | None = None
    """Time between two samples of the device, us; `None` if it measures whenever it is read."""
    mass_kg: float | None = None
    """Mass of the rig's moving part, kg; `None` where it is not known. Of two axes in the lightest direction."""
    compensated_share: float | None = None
    """Share of the identified friction that is compensated; `None` if none is."""
    heaviest_mass_kg: float | None = None
    """On two axes the mass in the heaviest direction, kg."""
    mass_at: WorstPlace | None = None
    """Where a commissioned rig of two axes is the lightest."""
    friction_at: WorstPlace | None = None
    """Where it has the least friction."""
    resolution_at: WorstPlace | None = None
    """Where one count moves the hand of two axes farthest."""


@dataclass(frozen=True)
class AdviceReply:
    """The answer to `advise`."""

    revision: int
    """Revision of the checked scene."""
    advice: list[Advice]
    """Every check and every remark, kept or broken."""
    basis: AdviceBasis | None = None
    """The facts of the rig that the advice is based on."""


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
    advice: list[Advice] = field(default_factory=list)
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
    advice: list[Advice] = field(default_factory=list)
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
class ListedScene:
    """A scene in the library."""

    name: str
    """Its name, for `load`."""
    title: str
    """Its title."""
    law: str
    """Its friction law."""
    path: str | None = None
    """Its file; `None` for a built-in scene."""
    problem: str | None = None
    """Why it cannot be loaded."""


@dataclass(frozen=True)
class SceneSaveReply:
    """The answer to `save`."""

    name: str
    """Its name in the library."""
    path: str
    """Its file."""


@dataclass(frozen=True)
class ParameterDescription:
    """A parameter of the scene."""

    name: str
    """Its name."""
    symbol: str
    """Its symbol in the paper."""
    unit: str
    """Its SI unit."""
    group: str
    """Part of the scene that it belongs to."""
    min: float
    """Smallest value accepted."""
    max: float
    """Largest value accepted."""
    slider_min: float
    """Lower end of a slider."""
    slider_max: float
    """Upper end of a slider."""
    step: float
    """The smallest difference worth a step."""
    logarithmic: bool
    """Whether a slider should be logarithmic."""
    directional: bool
    """Whether it may differ by direction."""
    feel: str
    """What a larger value makes the hand feel."""
    value: Value
    """The active value."""
    aliases: list[str] = field(default_factory=list)
    """Other symbols, accepted as well."""


@dataclass(frozen=True)
class Description:
    """The answer to `describe`."""

    law: str
    """The scene's friction law."""
    laws: list[str]
    """Names of all laws."""
    parameters: list[ParameterDescription]
    """The parameters of the scene."""
    sample_columns: list[str]
    """Names of a sample's columns."""
