"""A daemon with a simulated rig for each test, and one that tests share that leave it as it was."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import hapticd


@pytest.fixture
def daemon() -> Iterator[hapticd.Fake]:
    with hapticd.fake() as daemon:
        yield daemon


@pytest.fixture
def rig(daemon: hapticd.Fake) -> Iterator[hapticd.Rig]:
    with daemon.connect() as rig:
        yield rig
