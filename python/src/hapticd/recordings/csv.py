"""Recordings in CSV: the rows by pyarrow, what lies between them by a search for `#`."""

from __future__ import annotations

import json
import mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.frame import annotated
from hapticd.recordings import metadata
from hapticd.sample import DTYPES, STATES, Sample

if TYPE_CHECKING:
    import pandas

_TITLE = b"# hapticd recording "


def read(path: Path) -> pandas.DataFrame:
    """Reads a recording in CSV."""
    import pyarrow

    with path.open("rb") as file:
        title = file.readline(100)
        if not title:
            raise metadata.broken_off(path)
        if not title.startswith(_TITLE):
            raise metadata.not_a_recording(path, title)
        kind = metadata.kind_of_version(path, title[len(_TITLE) :].decode("utf-8", "replace").strip())
        # It is closed with the last buffer that looks into it.
        text = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    # A line counts only when its newline is there.
    end = text.rfind(b"\n") + 1
    about: dict[str, Any] = {}
    at = _line_end(text, 0, end)
    while at < end and (line := text[at : (after := _line_end(text, at, end))]).startswith(b"#"):
        about.update(_object(path, line) or {})
        at = after
    if at == end:
        raise metadata.broken_off(path)
    at = _line_end(text, at, end)
    names = line.decode().strip().split(",")
    _check_columns(path, names, kind)
    buffer = pyarrow.py_buffer(text)
    tables, marks, rows = [], [], 0
    while at < end:
        remark = at if text[at : at + 1] == b"#" else text.find(b"\n#", at, end) + 1
        until = remark or end
        if until > at:
            tables.append(_rows(path, names, buffer.slice(at, until - at)))
            rows += tables[-1].num_rows
        at = _line_end(text, until, end)
        if (mark := _object(path, text[until:at])) is not None and "mark" in mark:
            marks.append({"row": rows, **mark})
    return annotated(_frame(path, names, tables), about, marks)


def _rows(path: Path, names: list[str], stretch: Any) -> Any:
    """The rows of a stretch without remarks."""
    import pyarrow.csv

    types = {name: pyarrow.from_numpy_dtype(kind) for name, kind in DTYPES.items()}
    types["state"] = pyarrow.dictionary(pyarrow.int32(), pyarrow.string())
    try:
        return pyarrow.csv.read_csv(
            pyarrow.BufferReader(stretch),
            pyarrow.csv.ReadOptions(column_names=names, block_size=1 << 22),
            pyarrow.csv.ParseOptions(quote_char=False),
            pyarrow.csv.ConvertOptions(column_types=types, null_values=[], strings_can_be_null=False),
        )
    except pyarrow.ArrowInvalid as error:
        raise metadata.damaged(path, error) from error


def _frame(path: Path, names: list[str], tables: list[Any]) -> pandas.DataFrame:
    import pandas
    import pyarrow

    if not tables:
        kinds = {name: DTYPES.get(name, "f8") for name in names}
        empty = pandas.DataFrame({name: pandas.Series(dtype=kind) for name, kind in kinds.items()})
        return empty.assign(state=pandas.Categorical([], list(STATES)))
    whole = pyarrow.concat_tables(tables).unify_dictionaries()
    tables.clear()
    # The table goes column by column, so that an hour is not in memory twice.
    frame: pandas.DataFrame = whole.to_pandas(split_blocks=True, self_destruct=True)
    unknown = set(frame["state"].cat.categories) - set(STATES)
    if unknown:
        raise metadata.damaged(path, f"`{unknown.pop()}` is not a state of the rig")
    frame["state"] = frame["state"].cat.set_categories(list(STATES))
    return frame


def _line_end(text: mmap.mmap, at: int, end: int) -> int:
    found = text.find(b"\n", at, end)
    return end if found < 0 else found + 1


def _object(path: Path, line: bytes) -> dict[str, Any] | None:
    """The object of a line of `#`; `None` for a remark."""
    line = line[1:].strip()
    if not line.startswith(b"{"):
        return None
    try:
        found: dict[str, Any] = json.loads(line)
    except ValueError as error:
        raise metadata.damaged(path, f"a line of `#` is damaged: {error}: {metadata.shown(line)}") from error
    return found


def _check_columns(path: Path, names: list[str], kind: type[Sample]) -> None:
    wanted = kind._fields[: max(len(names), len(metadata.required(kind)))]
    for place, name in enumerate(wanted):
        found = names[place] if place < len(names) else ""
        if found != name:
            raise metadata.damaged(path, f"column {place + 1} is `{found}` in place of `{name}`")
