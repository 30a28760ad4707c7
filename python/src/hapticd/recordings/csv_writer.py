"""Writes recordings in CSV, with the metadata and the marks in lines of `#`."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, BinaryIO

from hapticd.recordings.metadata import version
from hapticd.recordings.sink import Sink
from hapticd.sample import Sample


class CsvWriter(Sink):
    """A recording in CSV."""

    def __init__(self, file: BinaryIO, metadata: Mapping[str, Any], kind: type[Sample]) -> None:
        self._file = file
        self._line(f"# hapticd recording {version(kind)}")
        self.mark(metadata)
        self._line(",".join(kind._fields))

    def row(self, sample: Sample) -> None:
        # Python writes a number with the digits that identify it.
        self._line(",".join(map(str, sample)))

    def mark(self, mark: Mapping[str, Any]) -> None:
        self._line("# " + json.dumps(mark, ensure_ascii=False))

    def _line(self, text: str) -> None:
        self._file.write(text.encode() + b"\n")

    def flush(self) -> None:
        self._file.flush()

    def close(self) -> None:
        with self._file:
            self._file.flush()
            os.fsync(self._file.fileno())
