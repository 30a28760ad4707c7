"""Recordings in MCAP (https://mcap.dev/spec), a stretch of rows at a time.

hapticd's rows are structs of one size in chunks that are not compressed, so numpy takes them as they are: the general
reader of MCAP looks at each row by itself, which takes minutes for an hour.
"""

from __future__ import annotations

import json
import mmap
import struct
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticd.errors import NotARecording
from hapticd.frame import frame
from hapticd.recordings import metadata
from hapticd.sample import DTYPES, PLANAR_COLUMNS, STATES, Sample

if TYPE_CHECKING:
    import numpy
    import pandas

_MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _METADATA, _DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0C, 0x0F

_METADATA_NAME = "hapticd recording"

#: Opcode and length of a record.
_HEADER = struct.Struct("<BQ")
#: A message's record up to its data: opcode, length, channel, sequence, two times.
_MESSAGE_HEADER = struct.Struct("<BQHIQQ")
_CHUNK_HEADER = struct.Struct("<QQQII")
_CDR_HEADER = b"\x00\x01\x00\x00"

_TYPES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "float32": "<f4",
    "int64": "<i8",
    "uint64": "<u8",
    "float64": "<f8",
}
_NAMES = {name.lower(): name for name in PLANAR_COLUMNS}


def read(path: Path) -> pandas.DataFrame:
    """Reads a recording in MCAP."""
    with path.open("rb") as file:
        if (magic := file.read(len(_MAGIC))) != _MAGIC:
            if not magic:
                raise metadata.broken_off(path)
            file.seek(0)
            raise metadata.not_a_recording(path, file.read(60))
        # It is closed with the last array that looks into it.
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    reader = _Reader(path)
    try:
        reader.read(data)
    except (struct.error, ValueError, KeyError) as error:
        if isinstance(error, NotARecording):
            raise
        raise metadata.damaged(path, f"it is damaged: {error}") from error
    return reader.frame()


class _Reader:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._metadata: dict[str, Any] | None = None
        self._kind: type[Sample] = Sample
        self._schemas: dict[int, str] = {}
        self._samples: int | None = None
        self._marks: int | None = None
        self._found: list[dict[str, Any]] = []
        self._columns: dict[str, Any] = {}
        self._rows = 0
        self._room = 0

    def read(self, data: memoryview) -> None:
        at, end = len(_MAGIC), len(data)
        while at + _HEADER.size <= end:
            opcode, length = _HEADER.unpack_from(data, at)
            body = at + _HEADER.size
            # What comes after the rows is an index, or was torn off.
            is_torn = body + length > end
            if opcode in (0, _DATA_END) or (is_torn and opcode != _CHUNK):
                return
            if opcode in (_CHUNK, _MESSAGE) and self._metadata is None:
                lacking = f"the record `{_METADATA_NAME}` before its messages"
                raise metadata.of_another_program(self._path, "MCAP", lacking)
            if opcode == _CHUNK:
                self._chunk(data, at, body, min(length, end - body), is_torn)
            elif opcode == _METADATA:
                name, rest = _text(bytes(data[body : body + length]))
                if name == _METADATA_NAME:
                    fields = _map(rest)
                    self._kind = metadata.kind_of_version(self._path, fields.get("version"))
                    self._metadata = metadata.of_fields(self._path, fields)
            else:
                self._record(opcode, bytes(data[body : body + length]))
            at = body + length

    def _chunk(self, data: memoryview, at: int, body: int, length: int, is_torn: bool) -> None:
        if is_torn and length < _CHUNK_HEADER.size + 8:
            return
        _, _, _, checksum, name_length = _CHUNK_HEADER.unpack_from(data, body)
        compression_at = body + _CHUNK_HEADER.size
        compression = bytes(data[compression_at : compression_at + name_length]).decode()
        if compression:
            reason = f"a chunk is compressed with {compression}, which hapticd never does: `mcap decompress` undoes it"
            raise NotARecording(f"{self._path}: byte {at}: {reason}")
        records_at = compression_at + name_length + 8
        records = data[records_at : body + length]
        if checksum and not is_torn and zlib.crc32(records) != checksum:
            reason = f"byte {at}: the checksum of a chunk of {len(records)} bytes is wrong"
            raise metadata.damaged(self._path, reason)
        self._records(records)

    def _records(self, records: memoryview) -> None:
        at = 0
        while at + _HEADER.size <= len(records):
            opcode, length = _HEADER.unpack_from(records, at)
            # The last record of a torn chunk.
            if at + _HEADER.size + length > len(records):
                return
            if opcode != _MESSAGE:
                self._record(opcode, bytes(records[at + _HEADER.size : at + _HEADER.size + length]))
                at += _HEADER.size + length
                continue
            _, _, channel, *_ = _MESSAGE_HEADER.unpack_from(records, at)
            if channel == self._samples:
                at += self._take_rows(records[at:], _HEADER.size + length)
                continue
            if channel == self._marks:
                text = records[at + _MESSAGE_HEADER.size : at + _HEADER.size + length]
                self._found.append({"row": self._rows, **json.loads(bytes(text))})
            at += _HEADER.size + length

    def _record(self, opcode: int, body: bytes) -> None:
        if opcode == _SCHEMA:
            (number,) = struct.unpack_from("<H", body)
            _, rest = _text(body[2:])
            _, rest = _text(rest)
            self._schemas[number] = _text(rest)[0]
        elif opcode == _CHANNEL:
            number, schema = struct.unpack_from("<HH", body)
            topic, _ = _text(body[4:])
            if topic == "/hapticd/samples":
                self._samples = number
                self._begin(self._schemas[schema])
            elif topic == "/hapticd/marks":
                self._marks = number

    def _begin(self, schema: str) -> None:
        self._fields = _layout(self._path, schema, self._kind)
        self._stride = _MESSAGE_HEADER.size + self._fields.pop("")[1]
        self._record_type = self._row_type(self._stride)

    def _row_type(self, size: int) -> numpy.dtype[numpy.void]:
        """numpy's type of a row of a size, with its header."""
        import numpy

        kinds, places = zip(*self._fields.values(), strict=True)
        return numpy.dtype(
            {
                "names": ["head", "cdr", *self._fields],
                "formats": [f"V{_HEADER.size + 2}", "V4", *kinds],
                "offsets": [0, _MESSAGE_HEADER.size, *(_MESSAGE_HEADER.size + at for at in places)],
                "itemsize": size,
            }
        )

    def _take_rows(self, records: memoryview, stride: int) -> int:
        """Takes the rows that follow one another; returns how many bytes they are."""
        import numpy

        if stride < self._stride or records[_MESSAGE_HEADER.size : _MESSAGE_HEADER.size + 4] != _CDR_HEADER:
            raise metadata.damaged(self._path, f"a row of {stride} bytes in place of {self._stride}")
        if stride > self._stride:
            # Padding at the end of a row.
            self._record_type = self._row_type(stride)
            self._stride = stride
        rows = numpy.frombuffer(records, self._record_type, len(records) // stride)
        others = numpy.flatnonzero(rows["head"] != rows["head"][0])
        if len(others):
            rows = rows[: others[0]]
        self._make_room(len(rows))
        for name in self._fields:
            self._columns[name][self._rows : self._rows + len(rows)] = rows[name]
        self._rows += len(rows)
        return len(rows) * stride

    def _make_room(self, count: int) -> None:
        import numpy

        if self._rows + count <= self._room:
            return
        self._room = max(2 * self._room, self._rows + count, 1 << 16)
        for name in self._fields:
            column = numpy.empty(self._room, DTYPES.get(name) or self._record_type[name])
            if name in self._columns:
                column[: self._rows] = self._columns[name][: self._rows]
            self._columns[name] = column

    def frame(self) -> pandas.DataFrame:
        if self._metadata is None or self._samples is None:
            raise metadata.broken_off(self._path)
        self._make_room(0 if self._columns else 1)
        known = [name for name in PLANAR_COLUMNS if name in self._columns]
        names = known + [name for name in self._fields if name not in known]
        columns = {name: self._columns[name][: self._rows] for name in names}
        if self._rows and columns["state"].max() >= len(STATES):
            raise metadata.damaged(self._path, f"state = {columns['state'].max()} is out of range")
        return frame(columns, self._metadata, self._found)


def _layout(path: Path, schema: str, rows: type[Sample]) -> dict[str, tuple[str, int]]:
    """Type and place of each field of a row of CDR; under no name the size of the row."""
    fields: dict[str, tuple[str, int]] = {}
    size = len(_CDR_HEADER)
    for line in schema.split("\n===")[0].splitlines():
        words = line.split("#")[0].split()
        if len(words) < 2 or "=" in line.split("#")[0]:
            continue
        kind, name = words[:2]
        if kind not in _TYPES:
            raise NotARecording(f"{path}: field `{name}` has the type `{kind}`, which has no fixed size")
        width = int(_TYPES[kind][-1])
        # CDR counts from behind its header.
        at = size + -(size - len(_CDR_HEADER)) % width
        size = at + width
        fields[_NAMES.get(name, name)] = (_TYPES[kind], at)
    for name in metadata.required(rows):
        if name not in fields:
            raise NotARecording(f"{path}: there is no field `{name.lower()}`")
    fields[""] = ("", size)
    return fields


def _text(data: bytes) -> tuple[str, bytes]:
    """A text behind its length, and what follows."""
    (length,) = struct.unpack_from("<I", data)
    return data[4 : 4 + length].decode(), data[4 + length :]


def _map(data: bytes) -> dict[str, str]:
    """A map of texts behind its length."""
    (length,) = struct.unpack_from("<I", data)
    data, found = data[4 : 4 + length], {}
    while data:
        name, data = _text(data)
        found[name], data = _text(data)
    return found
