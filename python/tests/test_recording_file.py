"""Recordings into files: this package and haptic-ctl read them, and a replay computes every force again."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy
import pytest

import hapticd
from hapticd.recordings.sink import create


def ctl(*arguments: object) -> Any:
    command = [str(hapticd.binary().with_name("haptic-ctl")), "--json", *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


@pytest.mark.parametrize("ending", ["mcap", "csv"])
def test_a_block_is_recorded_and_replayed(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"slide.{ending}"
    with hapticd.fake(hand="arm") as daemon, daemon.connect() as rig:
        rig.engage()
        rig.wait_for("engaged")
        with rig.record(path=path, notes="steel on Teflon") as recording, rig.buffer("10s") as buffer:
            buffer.wait_for(200)
            marked = recording.mark("first touch")
            change = rig.set(Fs="5 N")
            rig.stop()
            buffer.wait_for(len(buffer) + 200)
            until = rig.status().tick
        assert not recording.lost
        rows = hapticd.read(path)
        held = buffer.latest()
        held = held[numpy.isin(held["tick"], rows.tick)]
        assert rows.attrs["is_complete"] and recording.rows == len(rows)
        assert rows.tick.iloc[-1] >= until and (rows.tick.diff().iloc[1:] == 1).all()
        both = rows[rows.tick.isin(held["tick"])]
        # A recording begins with the first snapshot, some ticks after its subscription.
        assert len(both) > 350
        for name in set(hapticd.COLUMNS) - {"state"}:
            assert (both[name].to_numpy() == held[name]).all(), name
        metadata = rows.attrs["metadata"]
        assert metadata["notes"] == "steel on Teflon" and metadata["recorded_by"].startswith("hapticd for Python")
        marks = {mark["mark"]: mark for mark in rows.attrs["marks"]}
        assert marks["marker"]["text"] == "first touch" and marks["marker"]["tick"] == marked
        assert rows.tick[marks["scene"]["row"]] == change.tick and marks["scene"]["params"]["static_force"] == 5.0
        assert marks["state"]["state"] == rows.state[marks["state"]["row"]] == "stopped"
        assert "snapshot" in marks and "journal" in marks
        info = ctl("recording", "info", path)
        assert info["rows"] == len(rows) and info["lost"] == 0
        replayed = ctl("replay", path)
        assert replayed["compared"] > 350 and replayed["differing"] == 0
        # The other one holds the same.
        other = path.with_suffix(".csv" if ending == "mcap" else ".mcap")
        ctl("recording", "export", path, other)
        assert hapticd.read(other).equals(rows)


def test_a_time_is_recorded_at_a_lower_rate(rig: hapticd.Rig, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    recording = rig.record("200ms", path=path, rate_hz=100)
    assert recording.rows == 20 == len(hapticd.read(path))
    with pytest.raises(FileExistsError, match="`replace=True` replaces it"):
        rig.record("200ms", path=path)
    assert rig.record("100ms", path=path, replace=True).rows == 100
    with pytest.raises(hapticd.InvalidValue, match="haptic-ctl recording export"):
        rig.record(path=tmp_path / "r.parquet")


def test_a_daemon_that_ends_leaves_a_file_that_reads(daemon: hapticd.Fake, tmp_path: Path) -> None:
    rig = daemon.connect()
    recording = rig.record(path=tmp_path / "r.mcap")
    while recording.rows < 300:
        time.sleep(0.01)
    daemon.close()
    with pytest.raises(hapticd.ConnectionLost):
        recording.close()
    recording.close()
    rows = hapticd.read(tmp_path / "r.mcap")
    assert len(rows) >= 300 and not rows.attrs["is_complete"]
    assert rows.attrs["marks"][-1]["text"].startswith("lost the daemon: ")
    rig.close()


def test_a_file_that_is_written_is_whole_after_each_flush(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    about = {"server": "hapticd", "device": "", "loop_rate_hz": 1000.0, "rate_hz": 1000.0, "started_unix_s": 1e9}
    sink = create(path, {**about, "revision": 1, "scene": {}}, replace=False)
    for flushed in (1, 2):
        for tick in range(100):
            numbers = (0.0,) * 6
            sink.row(hapticd.Sample(100 * flushed + tick, tick * 1e-3, "idle", 0, *numbers, 1, 0, 0, 0))
        sink.flush()
        # As MCAP is to end, so that other programs read it without a repair.
        assert path.read_bytes().endswith(b"\x89MCAP0\r\n")
        assert len(hapticd.read(path)) == 100 * flushed
    sink.close()
    assert not hapticd.read(path).attrs["is_complete"]
