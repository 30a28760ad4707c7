"""A daemon with a simulated rig for each test."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import hapticd

# Streams of the Lab Streaming Layer are looked for on this machine alone.
_LSL = tempfile.TemporaryDirectory(prefix="hapticd-lsl-")
os.environ["LSLAPICFG"] = f"{_LSL.name}/lsl_api.cfg"
Path(os.environ["LSLAPICFG"]).write_text("[multicast]\nResolveScope = machine\n")


# The paper's scene, whose values the tests name; hapticd itself begins with a light block.
PAPER_SCENE = Path(__file__).parents[2] / "scenes" / "simulated-friction.toml"


@pytest.fixture
def daemon() -> Iterator[hapticd.Fake]:
    with hapticd.fake(scene=PAPER_SCENE) as daemon:
        yield daemon


@pytest.fixture
def rig(daemon: hapticd.Fake) -> Iterator[hapticd.Rig]:
    with daemon.connect() as rig:
        yield rig
