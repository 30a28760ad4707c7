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


#: What keeps the rest of a recording of which a part cannot be read.
REMEDY = "`haptic-ctl recording repair` keeps what can be read"


def not_a_recording(path: Path, beginning: bytes) -> NotARecording:
    """The error for a file that is something else."""
    return NotARecording(f"{path}: not a recording: it begins with {shown(beginning)}")


def of_another_program(path: Path, form: str, lacking: str) -> NotARecording:
    """The error for a file of a format that recordings have."""
    return NotARecording(f"{path}: not a recording: hapticd did not write this {form} file, which lacks {lacking}")


def broken_off(path: Path) -> NotARecording:
    """The error for a recording without a row."""
    return NotARecording(f"{path}: the recording was broken off before its first row")


def damaged(path: Path, reason: object) -> NotARecording:
    """The error for a recording of which a part cannot be read."""
    return NotARecording(f"{path}: {reason}; {REMEDY}")


def check_version(path: Path, found: object) -> None:
    """Refuses a recording of another version."""
    if found != VERSION:
        raise NotARecording(f"{path}: a recording of version {found}; this package reads version {VERSION}")


def of_fields(path: Path, fields: Mapping[str, str]) -> dict[str, Any]:
    """The metadata of texts by name."""
    check_version(path, fields.get("version"))
    try:
        return {
            name: text if name in _TEXTS else json.loads(text) for name, text in fields.items() if name != "version"
        }
    except ValueError as error:
        raise damaged(path, f"the metadata cannot be read: {error}") from error


def to_fields(metadata: Mapping[str, Any]) -> dict[str, str]:
    """Metadata as texts by name."""
    return {name: value if name in _TEXTS else json.dumps(value) for name, value in metadata.items()}


def shown(data: bytes) -> str:
    """The beginning of what stands in a file, for messages."""
    return ascii(data[:60].decode("utf-8", "replace"))
