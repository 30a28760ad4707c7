"""Recordings in Parquet, by pyarrow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.frame import annotated
from hapticd.recordings import metadata
from hapticd.sample import DTYPES, STATES

if TYPE_CHECKING:
    import pandas


def read(path: Path) -> pandas.DataFrame:
    """Reads a recording in Parquet."""
    import pyarrow
    import pyarrow.parquet

    with path.open("rb") as file:
        if (beginning := file.read(60))[:4] != b"PAR1":
            raise metadata.not_a_recording(path, beginning)
    try:
        table = pyarrow.parquet.read_table(path, read_dictionary=["state"])
    except pyarrow.ArrowInvalid as error:
        raise metadata.damaged(path, error) from error
    about: dict[bytes, bytes] = table.schema.metadata or {}
    fields = {
        key.decode().removeprefix("hapticd."): value.decode()
        for key, value in about.items()
        if key.startswith(b"hapticd.")
    }
    if not fields:
        raise metadata.of_another_program(path, "Parquet", "the keys `hapticd.*`")
    for name in metadata.required(metadata.kind_of_version(path, fields.get("version"))):
        if name not in table.column_names:
            raise metadata.damaged(path, f"there is no column `{name}`")
    marks: list[dict[str, Any]] = [{"row": row, **mark} for row, mark in json.loads(fields.pop("marks", "[]"))]
    for place, name in enumerate(table.column_names):
        if name in DTYPES and name != "state":
            kind = pyarrow.from_numpy_dtype(DTYPES[name])
            table = table.set_column(place, name, table.column(place).cast(kind))
    # The table goes column by column, so that an hour is not in memory twice.
    rows: pandas.DataFrame = table.to_pandas(split_blocks=True, self_destruct=True)
    del table
    rows["state"] = rows["state"].cat.set_categories(list(STATES))
    rows.attrs.clear()
    return annotated(rows, metadata.of_fields(path, fields), marks)
