"""Metadata as MCAP and Parquet hold them: texts by name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hapticd.errors import NotARecording
from hapticd.sample import PlanarSample, Sample

#: What the rows of each version are.
VERSIONS: dict[str, type[Sample]] = {"1": Sample, "2": PlanarSample}

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


def version(kind: type[Sample]) -> str:
    """The version of a recording of samples of a kind."""
    return next(version for version, of in VERSIONS.items() if of is kind)


def kind_of_version(path: Path, found: str | None) -> type[Sample]:
    """What the rows of a recording are, by its version; one of another version is refused."""
    if found is None or found not in VERSIONS:
        known = " and ".join(VERSIONS)
        raise NotARecording(f"{path}: a recording of version {found}; this package reads versions {known}")
    return VERSIONS[found]


def required(kind: type[Sample]) -> tuple[str, ...]:
    """The columns that every recording of samples of a kind has: version 1 began with so many."""
    return kind._fields[:14] if kind is Sample else kind._fields


def of_fields(path: Path, fields: Mapping[str, str]) -> dict[str, Any]:
    """The metadata of texts by name, of a version that the caller has looked at."""
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
