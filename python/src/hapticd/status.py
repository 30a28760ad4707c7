"""The answers to `status` and `log`: how the rig is, and what was done."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hapticd.answers import Difference
from hapticd.sample import State


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
    axes: int = 1
    """Number of its axes, 1 or 2."""
    kinematics: str | None = None
    """How the motors of a rig of two axes move the hand."""
    homed: bool | None = None
    """Whether the home pose of a rig of two axes is known, where it must be."""


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
class Peer:
    """A client, as the kernel knows it."""

    session: str
    """Name of its connection, as in its greeting."""
    uid: int
    """Its user."""
    user: str | None = None
    """The user's name, if the system has one."""
    pid: int | None = None
    """Its process, if it is visible to the daemon."""
    program: str | None = None
    """Its program, if it is visible to the daemon."""


@dataclass(frozen=True)
class Status:
    """The state of the rig and of the daemon."""

    server: str
    """Name and version of the daemon."""
    state: State
    """State of the rig."""
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
    """Integration of the block: `exact`, `implicit`, `literal` or `literal:N`."""
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
    commissioning: Peer | None = None
    """The client that commissions or identifies the rig."""
    device_position_y_m: float | None = None
    """Of a rig of two axes the position along the second one in the last tick, m."""
    command_force_y_N: float | None = None
    """Of a rig of two axes the force along the second one in the last tick, N."""


@dataclass(frozen=True)
class StateChange:
    """A change of the rig's state."""

    before: State
    """The state before."""
    after: State
    """The state after."""


@dataclass(frozen=True)
class JournalEntry:
    """An entry of the journal: what was done, by whom and when."""

    seq: int
    """Counts the entries since the daemon began, from 1."""
    time_unix_s: float
    """Time, seconds since 1970 (UTC)."""
    op: str
    """The operation, or an event of the daemon's own, as `fault` or `lease_lapsed`."""
    revision: int
    """The newest revision after it."""
    tick: int | None = None
    """The tick that carried it out, if one did."""
    by: Peer | None = None
    """The client that did it; `None` for the daemon's own entries."""
    state: StateChange | None = None
    """Change of the rig's state."""
    fault: str | None = None
    """The fault's code."""
    changes: list[Difference] = field(default_factory=list)
    """Changes of the scene."""
    ramp_ms: float | None = None
    """Duration of the scene's ramp, ms."""
    at_tick: int | None = None
    """The tick that was asked for, of a scheduled change."""
    schedule: str | None = None
    """Name of the schedule that it belongs to."""
    message: str | None = None
    """Further text, as the reason of a fault."""
