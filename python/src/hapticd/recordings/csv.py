"""Recordings in CSV: the rows by pyarrow, what lies between them by a search for `#`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.errors import NotARecording
from hapticd.frame import annotated
from hapticd.recordings import metadata
from hapticd.sample import COLUMNS, DTYPES, STATES

if TYPE_CHECKING:
    import pandas

_TITLE = b"# hapticd recording "

#: Columns that every recording has: version 1 began with so many.
_FIRST_COLUMNS = 14


def read(path: Path) -> pandas.DataFrame:
    """Reads a recording in CSV."""
    import pandas
    import pyarrow
    import pyarrow.csv

    text = path.read_bytes()
    # A line counts only when its newline is there.
    end = text.rfind(b"\n") + 1
    at = _line_end(text, 0, end)
    if not text.startswith(_TITLE):
        raise NotARecording(f"{path} is not a recording of hapticd: it begins with {metadata.shown(text)}")
    metadata.check_version(path, text[len(_TITLE) : at].decode().strip())
    about: dict[str, Any] = {}
    while text.startswith(b"#", at, end):
        about.update(_object(path, text[at : (after := _line_end(text, at, end))]) or {})
        at = after
    after = _line_end(text, at, end)
    if at == end:
        raise NotARecording(f"{path}: the recording was broken off before its first row")
    names = text[at:after].decode().strip().split(",")
    _check_columns(path, names)
    parts, remarks = _split(text, after, end)
    types = {name: pyarrow.from_numpy_dtype(kind) for name, kind in DTYPES.items()}
    types["state"] = pyarrow.dictionary(pyarrow.int32(), pyarrow.string())
    table = pandas.DataFrame()
    rows = b"".join(parts)
    starts = _row_numbers(parts, remarks)
    del text, parts
    try:
        read = (
            pyarrow.csv.read_csv(
                pyarrow.BufferReader(rows),
                pyarrow.csv.ReadOptions(column_names=names, block_size=1 << 22),
                pyarrow.csv.ParseOptions(quote_char=False),
                pyarrow.csv.ConvertOptions(column_types=types, null_values=[], strings_can_be_null=False),
            )
            if rows
            else pyarrow.table({name: pyarrow.array([], types.get(name, pyarrow.float64())) for name in names})
        )
    except pyarrow.ArrowInvalid as error:
        raise NotARecording(f"{path}: {error}") from error
    table = read.unify_dictionaries().to_pandas()
    unknown = set(table["state"].cat.categories) - set(STATES)
    if unknown:
        raise NotARecording(f"{path}: `{unknown.pop()}` is not a state of the rig")
    table["state"] = table["state"].cat.set_categories(list(STATES))
    marks = []
    for row, remark in zip(starts, remarks, strict=True):
        mark = _object(path, remark)
        if mark is not None and "mark" in mark:
            marks.append({"row": row, **mark})
    return annotated(table, about, marks)


def _line_end(text: bytes, at: int, end: int) -> int:
    found = text.find(b"\n", at, end)
    return end if found < 0 else found + 1


def _split(text: bytes, at: int, end: int) -> tuple[list[bytes], list[bytes]]:
    """The stretches of rows, and the lines of `#` between them: a stretch before each, and one at the end."""
    parts: list[bytes] = []
    remarks: list[bytes] = []
    while True:
        remark = at if text.startswith(b"#", at, end) else text.find(b"\n#", at, end) + 1
        if remark == 0:
            parts.append(text[at:end])
            return parts, remarks
        after = _line_end(text, remark, end)
        parts.append(text[at:remark])
        remarks.append(text[remark:after])
        at = after


def _row_numbers(parts: list[bytes], remarks: list[bytes]) -> list[int]:
    rows, numbers = 0, []
    for part, _ in zip(parts, remarks, strict=False):
        rows += part.count(b"\n")
        numbers.append(rows)
    return numbers


def _object(path: Path, line: bytes) -> dict[str, Any] | None:
    """The object of a line of `#`; `None` for a remark."""
    line = line[1:].strip()
    if not line.startswith(b"{"):
        return None
    try:
        found: dict[str, Any] = json.loads(line)
    except ValueError as error:
        raise NotARecording(f"{path}: a line of `#` is damaged: {error}: {metadata.shown(line)}") from error
    return found


def _check_columns(path: Path, names: list[str]) -> None:
    wanted = COLUMNS[: max(len(names), _FIRST_COLUMNS)]
    for place, name in enumerate(wanted):
        found = names[place] if place < len(names) else ""
        if found != name:
            raise NotARecording(f"{path}: column {place + 1} is `{found}` in place of `{name}`")
