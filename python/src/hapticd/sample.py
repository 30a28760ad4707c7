"""A tick, as subscribers and recordings have it."""

from __future__ import annotations

import difflib
from collections import namedtuple
from collections.abc import Sequence
from math import nan
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias, get_args

from hapticd.errors import invalid

State: TypeAlias = Literal["disconnected", "idle", "engaging", "engaged", "releasing", "stopped", "faulted"]
"""A state of the rig."""

STATES: tuple[State, ...] = get_args(State)
"""The states of the rig; a recording in MCAP holds their places in this list."""

PLACES = {state: place for place, state in enumerate(STATES)}


def checked_state(state: str) -> State:
    """A state by its name.

    Raises:
        InvalidValue: There is no such state.
    """
    if state not in STATES:
        near = difflib.get_close_matches(str(state), STATES, 1)
        meant = f", did you mean {near[0]!r}?" if near else ";"
        if any(sign in str(state) for sign in "<>="):
            meant = "; a condition on samples is a function, as in lambda sample: sample.device_position_m > 0.01;"
        raise invalid("state", f"state = {state!r}: unknown state{meant} the states are {', '.join(STATES)}")
    return state


class Sample(NamedTuple):
    """One tick."""

    tick: int
    """Number of the tick; consecutive unless samples were thinned or lost."""
    t_s: float
    """Time of the tick on the daemon's monotonic clock, s since the loop began."""
    state: State
    """State of the rig."""
    contact: int
    """0 stuck, +1 and -1 sliding."""
    device_position_m: float
    """Position of the device, m."""
    device_velocity_mps: float
    """Velocity of the device as estimated, m/s."""
    block_position_m: float
    """Position of the block, m."""
    block_velocity_mps: float
    """Velocity of the block, m/s."""
    coupling_force_N: float
    """Force in the coupling, which drives the block, N."""
    command_force_N: float
    """Force commanded on the hand after ramps and limits, N."""
    revision: int
    """Revision of the scene that this tick rendered."""
    wake_latency_ns: int
    """How long after its deadline the tick began, ns."""
    tick_ns: int
    """How long the tick took, the device's read and write included, ns."""
    device_round_trip_ns: int
    """How long the device's read and write took, ns; 0 where the rig is in the daemon itself."""
    elapsed_ns: int = 0
    """Time since the tick before on the daemon's clock, ns."""
    device_sequence: int = 0
    """Number of the device's sample, which wraps around."""
    device_time_ns: int = 0
    """When the device took the sample, on its own clock, ns."""
    sample_position_m: float = 0.0
    """Position as the device reported it, m, before anything was made of it."""
    input_flags: int = 0
    """The other inputs, bit by bit."""
    error_detail: int = 0
    """Detail of an error that the device reported."""


COLUMNS = Sample._fields

#: What a row of a rig of two axes has behind these.
SECOND_AXIS = (
    "device_position_y_m",
    "device_velocity_y_mps",
    "block_position_y_m",
    "block_velocity_y_mps",
    "coupling_force_y_N",
    "command_force_y_N",
    "sample_position_y_m",
)

PLANAR_COLUMNS: tuple[str, ...] = (*COLUMNS, *SECOND_AXIS)

if TYPE_CHECKING:

    class _Plane: ...

else:
    _Plane = namedtuple("_Plane", PLANAR_COLUMNS)


class PlanarSample(_Plane, Sample):
    """One tick of a rig of two axes: what a `Sample` has is of the first one."""

    __slots__ = ()
    device_position_y_m: float
    """Position of the device, m."""
    device_velocity_y_mps: float
    """Velocity of the device as estimated, m/s."""
    block_position_y_m: float
    """Position of the block, m."""
    block_velocity_y_mps: float
    """Velocity of the block, m/s."""
    coupling_force_y_N: float
    """Force in the coupling, which drives the block, N."""
    command_force_y_N: float
    """Force commanded on the hand after ramps and limits, N."""
    sample_position_y_m: float
    """Position as the device reported it, m, before anything was made of it."""


#: numpy's types of the columns; `state` is its place in `STATES`. Ticks and times are signed
#: here, though they never are below 0, so that a difference of two may be.
DTYPES: dict[str, str] = {
    "tick": "<i8",
    "t_s": "<f8",
    "state": "u1",
    "contact": "i1",
    "device_position_m": "<f8",
    "device_velocity_mps": "<f8",
    "block_position_m": "<f8",
    "block_velocity_mps": "<f8",
    "coupling_force_N": "<f8",
    "command_force_N": "<f8",
    "revision": "<i8",
    "wake_latency_ns": "<i8",
    "tick_ns": "<i8",
    "device_round_trip_ns": "<i8",
    "elapsed_ns": "<i8",
    "device_sequence": "<u4",
    "device_time_ns": "<u8",
    "sample_position_m": "<f8",
    "input_flags": "<u4",
    "error_detail": "<u4",
    **dict.fromkeys(SECOND_AXIS, "<f8"),
}


def kind_of(columns: Sequence[str]) -> type[Sample]:
    """What the rows with these columns are."""
    return PlanarSample if SECOND_AXIS[0] in columns else Sample


def of_row(row: list[Any], kind: type[Sample]) -> Sample:
    """The sample of a row, with NaN for null. A later daemon may have more columns."""
    if None in row:
        row = [nan if cell is None else cell for cell in row]
    return kind(*row[: len(kind._fields)])


def dtype_of(kind: type[Sample]) -> list[tuple[str, str]]:
    """numpy's type of the rows of a kind."""
    return [(name, DTYPES[name]) for name in kind._fields]
