from __future__ import annotations

import io
import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy
import pandas
import pandas.testing
import pytest

import hapticd
from hapticd.fake import binary

FORMATS = ("mcap", "csv", "parquet")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same two seconds in every format, with a change of scene and two changes of state in it."""
    directory = tmp_path_factory.mktemp("recordings")
    paths = {ending: directory / f"r.{ending}" for ending in FORMATS}
    with hapticd.fake() as daemon, daemon.connect() as rig:
        command = ["record", str(paths["mcap"]), "--for", "2s", "--notes", "a test, of µ"]
        with rig.events(["log"]):
            recorder = subprocess.Popen(
                [str(ctl()), *command], env={"HAPTICD_SOCKET": str(daemon.path)}, stdout=subprocess.DEVNULL
            )
            # The file is there before its first samples are.
            while not has_rows(paths["mcap"]):
                rig.status()
            rig.engage()
            rig.wait_for("engaged")
            rig.set({"Fs+": 5.5}, mass=0.7)
            assert recorder.wait(60) == 0
    for ending in ("csv", "parquet"):
        subprocess.run(
            [str(ctl()), "recording", "export", str(paths["mcap"]), str(paths[ending])], check=True, capture_output=True
        )
    return paths


def has_rows(path: Path) -> bool:
    try:
        return len(hapticd.read(path)) > 0
    except (FileNotFoundError, hapticd.NotARecording):
        return False


def ctl() -> Path:
    return binary().with_name("haptic-ctl")


@pytest.mark.parametrize("ending", FORMATS)
def test_a_recording_is_read_with_its_marks_and_metadata(recordings: dict[str, Path], ending: str) -> None:
    rows = hapticd.read(recordings[ending])
    assert tuple(rows.columns) == hapticd.COLUMNS
    end = rows.attrs["marks"][-1]
    assert (end["mark"], end["row"], end["rows"], end["lost"]) == ("end", len(rows), len(rows), 0)
    assert len(rows) > 900
    assert (rows.tick.diff()[1:] == 1).all()
    assert (numpy.diff(rows.tick.to_numpy()) == 1).all()
    assert set(rows.state) == {"idle", "engaging", "engaged"}
    assert rows.command_force_N.abs().max() > 1
    metadata = rows.attrs["metadata"]
    assert metadata["notes"] == "a test, of µ"
    assert metadata["rate_hz"] == 1000.0
    assert metadata["scene"]["block"] == {"mass": 0.1}
    assert rows.attrs["is_complete"]
    scene = next(mark for mark in rows.attrs["marks"] if mark.get("revision") == metadata["revision"] + 1)
    assert scene["params"]["static_force"] == {"positive": 5.5, "negative": 4.0}
    # A mark stands before the first row that it concerns.
    assert rows.tick[scene["row"]] == scene["tick"]
    assert rows.revision[scene["row"]] == scene["revision"] == rows.revision[scene["row"] - 1] + 1


def test_all_formats_hold_the_same_to_the_last_bit(recordings: dict[str, Path]) -> None:
    mcap, csv, parquet = (hapticd.read(recordings[ending]) for ending in FORMATS)
    for other in (csv, parquet):
        pandas.testing.assert_frame_equal(mcap, other, check_exact=True)
        assert mcap.attrs == other.attrs
    # Equal numbers may differ in the sign of zero.
    for name in ("coupling_force_N", "command_force_N", "device_velocity_mps"):
        bits = [rows[name].to_numpy().view("u8") for rows in (mcap, csv, parquet)]
        assert (bits[0] == bits[1]).all() and (bits[0] == bits[2]).all(), name


def test_unfinished_parquet_is_read_from_its_partial_file(recordings: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "r.parquet").touch()
    (tmp_path / "r.parquet.partial.mcap").write_bytes(recordings["mcap"].read_bytes())
    assert hapticd.read(tmp_path / "r.parquet").equals(hapticd.read(recordings["mcap"]))


def flipped(data: bytes) -> bytes:
    """One bit in the middle of a row is another: behind its CDR header."""
    place = data.index(b"\x00\x01\x00\x00", len(data) // 2) + 20
    return data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :]


def torn(data: bytes, off: int) -> bytes:
    """The first half, and some bytes."""
    return data[: len(data) // 2 + off]


def records(data: bytes) -> list[bytes]:
    """The records of an MCAP file, behind its magic bytes."""
    found, at = [], 8
    while at + 9 <= len(data):
        length = 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        found.append(data[at : at + length])
        at += length
    return found


def reordered(data: bytes, order: Callable[[list[bytes]], list[bytes]]) -> bytes:
    """An MCAP file whose records up to the index are in another order."""
    before = [record for record in records(data) if record[0] in (0x01, 0x03, 0x04, 0x06, 0x0C)]
    return data[:8] + b"".join(order(before))


def chunks_swapped(found: list[bytes]) -> list[bytes]:
    places = [place for place, record in enumerate(found) if record[0] == 0x06]
    one, other = places[len(places) // 2 - 1 : len(places) // 2 + 1]
    found[one], found[other] = found[other], found[one]
    return found


def with_cell(data: bytes, wrong: str) -> bytes:
    """CSV in which the fifth cell of a row is another text."""
    lines = data.decode().splitlines(keepends=True)
    cells = lines[-100].split(",")
    return "".join([*lines[:-100], ",".join([*cells[:4], wrong, *cells[5:]]), *lines[-99:]]).encode()


def of_pandas(_: bytes) -> bytes:
    file = io.BytesIO()
    pandas.DataFrame({"t_s": [0.0, 0.1], "x": [1.0, 2.0]}).to_parquet(file)
    return file.getvalue()


#: What is done to a recording, and the words of its refusal; of what is read, none.
CASES: list[tuple[str, str, Callable[[bytes], bytes], list[str]]] = [
    *((ending, "whole", bytes, []) for ending in FORMATS),
    *((ending, "empty", lambda _: b"", ["broken off before its first row"]) for ending in ("mcap", "csv")),
    *((ending, "other", lambda _: b"something else\n", ["not a recording", "something else"]) for ending in FORMATS),
    ("mcap", "magic alone", lambda data: data[:8], ["broken off before its first row"]),
    *(("mcap", f"torn {off}", partial(torn, off=off), []) for off in range(0, 200, 13)),
    ("mcap", "damaged chunk", flipped, ["checksum", "recording repair"]),
    ("mcap", "chunks swapped", lambda data: reordered(data, chunks_swapped), []),
    (
        "mcap",
        "metadata last",
        lambda data: reordered(data, lambda found: sorted(found, key=lambda record: record[0] == 0x0C)),
        ["hapticd did not write this MCAP file", "before its messages"],
    ),
    (
        "mcap",
        "other version",
        lambda data: data.replace(b"version\x01\0\0\x001", b"version\x01\0\0\x003"),
        ["version 3"],
    ),
    (
        "mcap",
        "version of two axes",
        lambda data: data.replace(b"version\x01\0\0\x001", b"version\x01\0\0\x002"),
        ["device_position_y_m"],
    ),
    *(("csv", f"torn {off}", partial(torn, off=off), []) for off in range(0, 200, 13)),
    ("csv", "other version", lambda data: data.replace(b"recording 1", b"recording 3", 1), ["version 3"]),
    ("csv", "version of two axes", lambda data: data.replace(b"recording 1", b"recording 2", 1), ["column 21"]),
    ("csv", "head alone", lambda data: data[: data.index(b"\n") + 1], ["broken off before its first row"]),
    *(("csv", f"cell `{wrong}`", partial(with_cell, wrong=wrong), ["recording repair"]) for wrong in ("", "x", "1,2")),
    ("parquet", "torn", lambda data: data[: len(data) // 2], ["recording repair"]),
    ("parquet", "of pandas", of_pandas, ["hapticd did not write this Parquet file"]),
]


@pytest.mark.parametrize(("ending", "name", "change", "words"), CASES, ids=[f"{case[0]} {case[1]}" for case in CASES])
def test_rust_and_python_read_alike(
    recordings: dict[str, Path],
    tmp_path: Path,
    ending: str,
    name: str,
    change: Callable[[bytes], bytes],
    words: list[str],
) -> None:
    path, by_rust = tmp_path / f"case.{ending}", tmp_path / "exported.csv"
    path.write_bytes(change(recordings[ending].read_bytes()))
    export = [str(ctl()), "recording", "export", str(path), str(by_rust)]
    exported = subprocess.run(export, check=False, capture_output=True, text=True)
    try:
        rows = hapticd.read(path)
    except hapticd.NotARecording as error:
        assert words, error
        for message in (exported.stderr, str(error)):
            assert all(word in message for word in [*words, path.name]), message
        assert exported.returncode != 0
        return
    assert not words, name
    assert exported.returncode == 0, exported.stderr
    assert len(rows) > 200 and rows.attrs["is_complete"] == (not name.startswith("torn"))
    pandas.testing.assert_frame_equal(rows, hapticd.read(by_rust), check_exact=True)


def test_a_recording_has_a_known_name(tmp_path: Path) -> None:
    with pytest.raises(hapticd.NotARecording, match=r"r\.txt: .* ends in \.mcap, \.csv or \.parquet"):
        hapticd.read(tmp_path / "r.txt")
    with pytest.raises(FileNotFoundError):
        hapticd.read(tmp_path / "r.mcap")


def test_a_rig_is_recorded_into_a_data_frame(rig: hapticd.Rig) -> None:
    rig.engage()
    rig.wait_for("engaged")
    rows = rig.record("300ms")
    assert tuple(rows.columns) == hapticd.COLUMNS
    assert len(rows) == 300
    assert (rows.tick.diff()[1:] == 1).all()
    assert (rows.state == "engaged").all()
    marks: list[dict[str, Any]] = rows.attrs["marks"]
    assert [mark["mark"] for mark in marks] == ["scene", "state", "end"]
    assert rows.attrs["metadata"]["scene"]["friction"]["law"] == "karnopp"
    assert len(rig.record(0.2, rate_hz=100)) == 20
