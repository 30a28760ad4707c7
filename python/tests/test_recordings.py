from __future__ import annotations

import subprocess
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


@pytest.mark.parametrize("ending", ["mcap", "csv"])
def test_a_recording_that_was_broken_off_reads_as_far_as_it_goes(
    recordings: dict[str, Path], tmp_path: Path, ending: str
) -> None:
    data = recordings[ending].read_bytes()
    torn = tmp_path / f"torn.{ending}"
    whole = hapticd.read(recordings[ending])
    lengths = []
    for length in range(len(data) // 2, len(data) // 2 + 200, 13):
        torn.write_bytes(data[:length])
        rows = hapticd.read(torn)
        lengths.append(len(rows))
        assert not rows.attrs["is_complete"]
        pandas.testing.assert_frame_equal(rows, whole[: len(rows)], check_exact=True)
    assert min(lengths) > 200


def test_a_parquet_recording_in_the_making_is_read_from_the_file_beside_it(
    recordings: dict[str, Path], tmp_path: Path
) -> None:
    (tmp_path / "r.parquet").touch()
    (tmp_path / "r.parquet.partial.mcap").write_bytes(recordings["mcap"].read_bytes())
    assert hapticd.read(tmp_path / "r.parquet").equals(hapticd.read(recordings["mcap"]))


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("data", [b"", b"something else\n", b"\x89MCAP0\r\n", b"# hapticd recording 2\n", b"PAR1"])
def test_another_file_is_refused_by_its_name(tmp_path: Path, ending: str, data: bytes) -> None:
    path = tmp_path / f"other.{ending}"
    path.write_bytes(data)
    with pytest.raises(hapticd.NotARecording, match="other"):
        hapticd.read(path)


def test_a_damaged_chunk_is_told(recordings: dict[str, Path], tmp_path: Path) -> None:
    data = bytearray(recordings["mcap"].read_bytes())
    # In the middle of a row: behind its CDR header.
    data[data.index(b"\x00\x01\x00\x00", len(data) // 2) + 20] ^= 1
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    with pytest.raises(hapticd.NotARecording, match=r"the chunk at byte \d+ is damaged; .*repair"):
        hapticd.read(damaged)


def test_a_damaged_row_of_csv_is_told(recordings: dict[str, Path], tmp_path: Path) -> None:
    lines = recordings["csv"].read_text().splitlines(keepends=True)
    cells = lines[-100].split(",")
    for wrong in ("", "x", "1,2"):
        damaged = tmp_path / "damaged.csv"
        damaged.write_text("".join([*lines[:-100], ",".join([*cells[:4], wrong, *cells[5:]]), *lines[-99:]]))
        with pytest.raises(hapticd.NotARecording, match="damaged"):
            hapticd.read(damaged)


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
