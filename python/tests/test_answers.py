"""The answers as dataclasses have every field of the protocol."""

from __future__ import annotations

import dataclasses
import functools
import json
import subprocess
from typing import Any

import pytest

from hapticd import answers, status
from hapticd.fake import binary

#: Names that differ from those of the protocol.
NAMES = {"Device": "DeviceStatus", "RealTime": "RealTimeStatus"}

KINDS = {kind for module in (answers, status) for kind in vars(module).values() if dataclasses.is_dataclass(kind)}


@functools.cache
def types() -> dict[str, Any]:
    """The types of what a server says, by name."""
    printed = subprocess.check_output([binary().with_name("haptic-ctl"), "raw", "--schema"])
    of_server: dict[str, Any] = json.loads(printed)["$defs"]["FromServer"]
    return of_server


@pytest.mark.parametrize("kind", sorted(KINDS, key=str), ids=lambda kind: kind.__name__)
def test_every_field_of_the_protocol_is_there(kind: type) -> None:
    wanted = types()[NAMES.get(kind.__name__, kind.__name__)]["properties"]
    assert {field.name for field in dataclasses.fields(kind)} == set(wanted)
