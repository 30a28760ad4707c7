"""Script a force-feedback rig: engage it, change its friction at an exact tick, and read every sample.

    import hapticd

    with hapticd.connect() as rig:
        rig.engage()
        rig.set(mass=1.5, Fs=5)

Numbers are in SI units, and names have the unit at their end. `hapticd.aio` has the same for asyncio, and
`python -m hapticd.lsl` publishes a rig to the Lab Streaming Layer.
"""

from hapticd import aio
from hapticd.answers import (
    AcceptedChange,
    ChangeReply,
    Device,
    Difference,
    LibraryScene,
    Problem,
    RealTime,
    SceneReply,
    ScheduleReply,
    StateReply,
    Status,
)
from hapticd.errors import (
    Conflict,
    ConnectionLost,
    Faulted,
    HapticdError,
    InvalidValue,
    LeaseLapsed,
    NoAnswer,
    NoDaemon,
    NotAllowed,
    NotARecording,
    NotReady,
    Refused,
    SamplesLost,
    SamplesLostWarning,
    Stopped,
    UnknownName,
    WrongState,
)
from hapticd.events import Events
from hapticd.fake import Fake, binary, fake
from hapticd.recordings import read
from hapticd.rig import Rig, connect
from hapticd.sample import COLUMNS, STATES, Sample
from hapticd.samples import Buffer, Samples

__all__ = [
    "COLUMNS",
    "STATES",
    "AcceptedChange",
    "Buffer",
    "ChangeReply",
    "Conflict",
    "ConnectionLost",
    "Device",
    "Difference",
    "Events",
    "Fake",
    "Faulted",
    "HapticdError",
    "InvalidValue",
    "LeaseLapsed",
    "LibraryScene",
    "NoAnswer",
    "NoDaemon",
    "NotARecording",
    "NotAllowed",
    "NotReady",
    "Problem",
    "RealTime",
    "Refused",
    "Rig",
    "Sample",
    "Samples",
    "SamplesLost",
    "SamplesLostWarning",
    "SceneReply",
    "ScheduleReply",
    "StateReply",
    "Status",
    "Stopped",
    "UnknownName",
    "WrongState",
    "aio",
    "binary",
    "connect",
    "fake",
    "read",
]
