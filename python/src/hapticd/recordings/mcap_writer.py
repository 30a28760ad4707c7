"""Writes recordings in MCAP (https://mcap.dev/spec), with the rows, marks and chunks of `haptic-ctl record`.

A file that is being written is whole at all times: each chunk is written with what ends a file, and the next chunk is
written over that.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Mapping
from operator import itemgetter
from typing import Any, BinaryIO

from hapticd.recordings.metadata import to_fields, version
from hapticd.recordings.sink import Sink
from hapticd.sample import DTYPES, PLACES, Sample

_MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06
_CHUNK_INDEX, _STATISTICS, _METADATA, _DATA_END = 0x08, 0x0B, 0x0C, 0x0F

_SAMPLES, _MARKS = 1, 2

#: Type in `ros2msg` and code of `struct` of each type of numpy.
_TYPES = {
    "<i8": ("uint64", "Q"),
    "<u8": ("uint64", "Q"),
    "<f8": ("float64", "d"),
    "<u4": ("uint32", "I"),
    "u1": ("uint8", "B"),
    "i1": ("int8", "b"),
}

_CDR_HEADER = b"\x00\x01\x00\x00"

_MARK_SCHEMA = {
    "title": "Mark",
    "description": "Something that happened between two rows of a recording of hapticd.",
    "type": "object",
    "required": ["mark"],
    "properties": {"mark": {"type": "string"}, "tick": {"type": "integer", "minimum": 0}},
}


class McapWriter(Sink):
    """A recording in MCAP."""

    def __init__(self, file: BinaryIO, metadata: Mapping[str, Any], kind: type[Sample]) -> None:
        # The widest columns first, so that none needs padding.
        layout = sorted(kind._fields, key=lambda name: -int(DTYPES[name][-1]))
        self._cells = itemgetter(*map(kind._fields.index, layout))
        self._row = struct.Struct("<4s" + "".join(_TYPES[DTYPES[name]][1] for name in layout))
        self._file = file
        self._at = 0
        self._started_s: float = metadata["started_unix_s"]
        self._first_s: float | None = None
        self._time_ns = round(self._started_s * 1e9)
        self._tick = 0
        self._records: list[bytes] = []
        self._chunk_began_ns = self._time_ns
        self._chunks: list[bytes] = []
        self._counts = {_SAMPLES: 0, _MARKS: 0}
        fields = {"version": version(kind), **to_fields(metadata)}
        self._channels = b"".join(
            (
                _schema(1, "hapticd/msg/Sample", "ros2msg", _row_schema(layout)),
                _channel(_SAMPLES, 1, "/hapticd/samples", "cdr"),
                _schema(2, "hapticd.Mark", "jsonschema", json.dumps(_MARK_SCHEMA)),
                _channel(_MARKS, 2, "/hapticd/marks", "json"),
            )
        )
        beginning = _MAGIC + _record(_HEADER, _text("") + _text("hapticd for Python"))
        self._put(beginning + _record(_METADATA, _text("hapticd recording") + _map(fields)) + self._channels)

    def row(self, sample: Sample) -> None:
        if self._first_s is None:
            self._first_s = sample.t_s
        self._time_ns = round(self._started_s * 1e9) + round((sample.t_s - self._first_s) * 1e9)
        self._tick = sample.tick
        cells = self._cells(sample._replace(state=PLACES[sample.state]))  # type: ignore[arg-type]
        self._message(_SAMPLES, self._row.pack(_CDR_HEADER, *cells))

    def mark(self, mark: Mapping[str, Any]) -> None:
        self._message(_MARKS, json.dumps(mark, ensure_ascii=False).encode())

    def _message(self, channel: int, data: bytes) -> None:
        if not self._records:
            self._chunk_began_ns = self._time_ns
        head = struct.pack("<HIQQ", channel, self._tick & 0xFFFFFFFF, self._time_ns, self._time_ns)
        self._records.append(_record(_MESSAGE, head + data))
        self._counts[channel] += 1

    def flush(self) -> None:
        if not self._records:
            return
        records = b"".join(self._records)
        self._records.clear()
        times = struct.pack("<QQ", self._chunk_began_ns, self._time_ns)
        checksum = struct.pack("<QI", len(records), zlib.crc32(records))
        chunk = _record(_CHUNK, times + checksum + _text("") + struct.pack("<Q", len(records)) + records)
        place = struct.pack("<QQ", self._at, len(chunk))
        sizes = struct.pack("<QQ", len(records), len(records))
        self._chunks.append(_record(_CHUNK_INDEX, times + place + bytes(4 + 8) + _text("") + sizes))
        self._put(chunk)

    def _put(self, data: bytes) -> None:
        self._file.seek(self._at)
        self._file.write(data + _DATA_ENDS + _footer(0))
        self._file.flush()
        self._at += len(data)

    def close(self) -> None:
        with self._file:
            self.flush()
            count = struct.pack("<QHIIII", sum(self._counts.values()), 2, 2, 0, 1, len(self._chunks))
            times = struct.pack("<QQ", round(self._started_s * 1e9), self._time_ns)
            counts = b"".join(struct.pack("<HQ", *each) for each in self._counts.items())
            statistics = _record(_STATISTICS, count + times + struct.pack("<I", len(counts)) + counts)
            self._file.seek(self._at)
            self._file.write(_DATA_ENDS + self._channels + statistics + b"".join(self._chunks))
            self._file.write(_footer(self._at + len(_DATA_ENDS)))
            self._file.flush()
            os.fsync(self._file.fileno())


def _footer(summary_at: int) -> bytes:
    """The end of a file, with the place of its summary; 0 without one."""
    return _record(_FOOTER, struct.pack("<QQI", summary_at, 0, 0)) + _MAGIC


def _row_schema(layout: list[str]) -> str:
    lines = ["# A tick of hapticd. The ends of the names are units: s, m, mps (m/s), n (N), ns.", ""]
    lines += ["# State of the rig", *(f"uint8 {state.upper()}={place}" for state, place in PLACES.items()), ""]
    lines += [f"{_TYPES[DTYPES[name]][0]} {name.lower()}" for name in layout]
    return "\n".join(lines).replace("int8 contact", "int8 contact # 0 stuck, +1 and -1 sliding") + "\n"


def _schema(number: int, name: str, encoding: str, text: str) -> bytes:
    return _record(_SCHEMA, struct.pack("<H", number) + _text(name) + _text(encoding) + _text(text))


def _channel(number: int, schema: int, topic: str, encoding: str) -> bytes:
    return _record(_CHANNEL, struct.pack("<HH", number, schema) + _text(topic) + _text(encoding) + _map({}))


def _record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def _text(text: str) -> bytes:
    """A text behind its length."""
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _map(fields: Mapping[str, str]) -> bytes:
    """A map of texts behind its length."""
    data = b"".join(_text(name) + _text(value) for name, value in fields.items())
    return struct.pack("<I", len(data)) + data


_DATA_ENDS = _record(_DATA_END, bytes(4))
