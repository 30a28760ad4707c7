"""The answers as dataclasses have every field of the protocol."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from hapticd import answers, status

SCHEMA = Path(__file__).resolve().parents[2] / "docs/control-protocol.schema.json"

#: Names that differ from those of the protocol.
NAMES = {"Device": "DeviceStatus", "RealTime": "RealTimeStatus"}

KINDS = {kind for module in (answers, status) for kind in vars(module).values() if dataclasses.is_dataclass(kind)}


@pytest.mark.parametrize("kind", sorted(KINDS, key=str), ids=lambda kind: kind.__name__)
def test_every_field_of_the_protocol_is_there(kind: type) -> None:
    types = json.loads(SCHEMA.read_text())["$defs"]["FromServer"]
    wanted = types[NAMES.get(kind.__name__, kind.__name__)]["properties"]
    assert {field.name for field in dataclasses.fields(kind)} == set(wanted)
