"""Metadata as MCAP and Parquet hold them: texts by name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hapticd.errors import NotARecording

VERSION = "1"

#: Fields that are text; the others are JSON.
_TEXTS = ("server", "device", "notes")


def check_version(path: Path, found: object) -> None:
    """Refuses a recording of another version."""
    if found != VERSION:
        raise NotARecording(f"{path}: the recording has version {found}; this package reads version {VERSION}")


def of_fields(path: Path, fields: Mapping[str, str]) -> dict[str, Any]:
    """The metadata of texts by name."""
    check_version(path, fields.get("version"))
    try:
        return {
            name: text if name in _TEXTS else json.loads(text) for name, text in fields.items() if name != "version"
        }
    except ValueError as error:
        raise NotARecording(f"{path}: the metadata are damaged: {error}") from error


def shown(data: bytes) -> str:
    """The beginning of what stands in a file, for messages."""
    return ascii(data[:60].decode("utf-8", "replace"))
