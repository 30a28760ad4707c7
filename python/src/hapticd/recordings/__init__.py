"""Recordings: files with every tick of a rig (docs/how-to/record.md has their formats)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from hapticd.errors import NotARecording
from hapticd.extras import need

if TYPE_CHECKING:
    import pandas


def read(path: str | os.PathLike[str]) -> pandas.DataFrame:
    """Reads a recording (extra `pandas`): a row for each tick, with the columns that the protocol names.

    `.attrs["metadata"]` holds under which circumstances it was made, `.attrs["marks"]` what happened meanwhile (each
    with the number of rows before it in `row`), and `.attrs["is_complete"]` whether it was ended on purpose: one that
    was broken off reads as far as it was written.

    Args:
        path: A file whose name ends in .mcap, .csv or .parquet.

    Raises:
        NotARecording: The file is not a recording, or is damaged.
        OSError: It cannot be read.
    """
    need("pandas", "numpy", "pandas")
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".mcap":
        from hapticd.recordings import mcap

        return mcap.read(path)
    if ending == ".csv":
        from hapticd.recordings import csv

        return csv.read(path)
    if ending == ".parquet":
        # While it is recorded, its rows are in another file.
        partial = path.with_name(path.name + ".partial.mcap")
        if partial.exists():
            from hapticd.recordings import mcap

            return mcap.read(partial)
        from hapticd.recordings import parquet

        return parquet.read(path)
    raise NotARecording(f"{path}: the name of a recording ends in .mcap, .csv or .parquet")
