"""Recordings of many rigs as one set: the example of docs/how-to/record.md, and what Spark is known to want."""

from __future__ import annotations

import re
import subprocess
from datetime import date
from pathlib import Path
from typing import Any

import pyarrow.dataset
import pyarrow.parquet
import pytest

import hapticd
from hapticd.fake import binary

PAGE = Path(__file__).resolve().parents[2] / "docs/how-to/record.md"


def ctl(*arguments: str, **environment: str) -> None:
    command = [str(binary().with_name("haptic-ctl")), *arguments]
    subprocess.run(command, check=True, capture_output=True, env=environment)


def test_the_example_of_many_rigs_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with hapticd.fake() as daemon, daemon.connect() as rig:
        rig.engage()
        rig.wait_for("engaged")
        for day in ("monday", "tuesday"):
            ctl("record", f"{day}.mcap", "--for", "200ms", HAPTICD_SOCKET=str(daemon.path))
    section = PAGE.read_text().split("## Many rigs\n")[1].split("\n## ")[0]
    # The recordings are made above, and `tests/tests/book.rs` follows the whole of it.
    collecting = re.findall(r"^\$ haptic-ctl (recording collect .*)$", section, re.MULTILINE)
    assert len(collecting) == 2
    for line in collecting:
        ctl(*line.split())
    python = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(python[0], str(PAGE), "exec"), names)
    rows = names["peaks"].fetchall()
    assert [row[0] for row in rows] == ["left", "right"]
    for _, day, ticks, peak_n in rows:
        assert isinstance(day, date) and ticks > 100 and 0.0 < peak_n < 20.0

    found = pyarrow.dataset.dataset("set", partitioning="hive").to_table().to_pandas()
    assert set(found.rig) == {"left", "right"}
    for path in Path("set").rglob("*.parquet"):
        file = pyarrow.parquet.ParquetFile(path)
        columns = [column.name.lower() for column in file.schema]
        assert len(set(columns)) == len(columns) and not {"rig", "date"} & set(columns)
        assert all(column.max_definition_level == column.max_repetition_level == 0 for column in file.schema)
        group = file.metadata.row_group(0)
        encodings = {encoding for index in range(len(columns)) for encoding in group.column(index).encodings}
        assert encodings <= {"PLAIN", "RLE", "RLE_DICTIONARY", "PLAIN_DICTIONARY", "DELTA_BINARY_PACKED"}
