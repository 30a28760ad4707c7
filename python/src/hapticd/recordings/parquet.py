"""Recordings in Parquet, by pyarrow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.errors import NotARecording
from hapticd.frame import annotated
from hapticd.recordings import metadata
from hapticd.sample import DTYPES, STATES

if TYPE_CHECKING:
    import pandas


def read(path: Path) -> pandas.DataFrame:
    """Reads a recording in Parquet."""
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path, read_dictionary=["state"])
    except pyarrow.ArrowInvalid as error:
        raise NotARecording(f"{path}: {error}") from error
    about: dict[bytes, bytes] = table.schema.metadata or {}
    fields = {
        key.decode().removeprefix("hapticd."): value.decode()
        for key, value in about.items()
        if key.startswith(b"hapticd.")
    }
    marks: list[dict[str, Any]] = [{"row": row, **mark} for row, mark in json.loads(fields.pop("marks", "[]"))]
    rows: pandas.DataFrame = table.to_pandas()
    rows = rows.astype({name: kind for name, kind in DTYPES.items() if name in rows and name != "state"})
    rows["state"] = rows["state"].cat.set_categories(list(STATES))
    rows.attrs.clear()
    return annotated(rows, metadata.of_fields(path, fields), marks)
