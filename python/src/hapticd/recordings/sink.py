"""What a recording is written into: a file of one of the formats that this package writes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hapticd.errors import invalid
from hapticd.sample import Sample


class Sink(ABC):
    """A new file that holds rows and marks."""

    @abstractmethod
    def row(self, sample: Sample) -> None:
        """Takes the next row."""

    @abstractmethod
    def mark(self, mark: Mapping[str, Any]) -> None:
        """Takes what happened before the next row."""

    @abstractmethod
    def flush(self) -> None:
        """Passes on what is in memory, so that the file reads up to here."""

    @abstractmethod
    def close(self) -> None:
        """Passes on what is in memory, and closes the file."""


def create(path: Path, metadata: Mapping[str, Any], replace: bool, kind: type[Sample] = Sample) -> Sink:
    """Creates the file for samples of a kind; the ending of its name says its format.

    Raises:
        InvalidValue: The name ends in something else.
        FileExistsError: The file exists, and is not to be replaced.
    """
    ending = path.suffix.lower()
    if ending not in (".mcap", ".csv"):
        message = f"path = '{path}': the name of a recording ends in .mcap or .csv"
        if ending == ".parquet":
            message += "; `haptic-ctl recording export` makes Parquet of either"
        raise invalid("path", message)
    try:
        file = path.open("wb" if replace else "xb")
    except FileExistsError as error:
        raise FileExistsError(error.errno, "it exists, and `replace=True` replaces it", str(path)) from None
    if ending == ".csv":
        from hapticd.recordings.csv_writer import CsvWriter

        return CsvWriter(file, metadata, kind)
    from hapticd.recordings.mcap_writer import McapWriter

    return McapWriter(file, metadata, kind)
