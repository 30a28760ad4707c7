"""Script a force-feedback rig: engage it, change its friction at an exact tick, and read every sample.

    import hapticd

    with hapticd.connect() as rig:
        rig.engage()
        rig.set(mass=1.5, Fs=5)

Numbers are in SI units, and names have the unit at their end. `hapticd.aio` has the same for asyncio, and
`python -m hapticd.lsl` publishes a rig to the Lab Streaming Layer.
"""

from __future__ import annotations

from hapticd import aio
from hapticd.answers import (
    AcceptedChange,
    Advice,
    AdviceBasis,
    AdviceReply,
    ChangeReply,
    Description,
    Difference,
    Finding,
    ListedScene,
    ParameterDescription,
    SceneReply,
    SceneSaveReply,
    ScheduleReply,
    StateReply,
    WorstPlace,
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
from hapticd.recording import Recording
from hapticd.recordings import read
from hapticd.rig import Rig, connect
from hapticd.sample import COLUMNS, PLANAR_COLUMNS, STATES, PlanarSample, Sample, State
from hapticd.samples import Buffer, Samples
from hapticd.status import Device, JournalEntry, LibraryScene, Peer, Problem, RealTime, StateChange, Status

__all__ = [
    "COLUMNS",
    "PLANAR_COLUMNS",
    "STATES",
    "AcceptedChange",
    "Advice",
    "AdviceBasis",
    "AdviceReply",
    "Buffer",
    "ChangeReply",
    "Conflict",
    "ConnectionLost",
    "Description",
    "Device",
    "Difference",
    "Events",
    "Fake",
    "Faulted",
    "Finding",
    "HapticdError",
    "InvalidValue",
    "JournalEntry",
    "LeaseLapsed",
    "LibraryScene",
    "ListedScene",
    "NoAnswer",
    "NoDaemon",
    "NotARecording",
    "NotAllowed",
    "NotReady",
    "ParameterDescription",
    "Peer",
    "PlanarSample",
    "Problem",
    "RealTime",
    "Recording",
    "Refused",
    "Rig",
    "Sample",
    "Samples",
    "SamplesLost",
    "SamplesLostWarning",
    "SceneReply",
    "SceneSaveReply",
    "ScheduleReply",
    "State",
    "StateChange",
    "StateReply",
    "Status",
    "Stopped",
    "UnknownName",
    "WorstPlace",
    "WrongState",
    "aio",
    "binary",
    "connect",
    "fake",
    "read",
]

__version__: str


def __getattr__(name: str) -> str:
    """The version, as the package was installed; looking it up takes longer than all else here."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(__name__)
    except PackageNotFoundError as error:
        raise AttributeError(f"{__name__} is not installed, so it has no version") from error
