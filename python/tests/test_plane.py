"""A rig of two axes: a gantry whose hand goes round in a circle of 30 mm."""

from __future__ import annotations

import itertools
import json
import math
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy
import pytest

import hapticd
from hapticd.sample import of_row


@pytest.fixture
def plane() -> Iterator[hapticd.Rig]:
    with hapticd.fake(kinematics="xy", hand="circle") as daemon, daemon.connect() as rig:
        # The hand is brought from the middle to its circle.
        rig.wait_for(is_at_the_top, timeout=60)
        yield rig


def is_at_the_top(sample: hapticd.Sample) -> bool:
    return isinstance(sample, hapticd.PlanarSample) and sample.device_position_y_m > 0.029


def is_on_circle(rows: Any) -> bool:
    radii_m = numpy.hypot(rows["sample_position_m"], rows["sample_position_y_m"])
    return bool((abs(radii_m - 0.03) < 0.002).all())


def test_the_columns_of_a_plane_are_those_of_the_daemon(plane: hapticd.Rig) -> None:
    assert tuple(plane.request("describe")["sample_columns"]) == hapticd.PLANAR_COLUMNS


def test_a_sample_has_the_second_axis(plane: hapticd.Rig) -> None:
    with plane.samples() as samples:
        for sample in itertools.islice(samples, 50):
            assert isinstance(sample, hapticd.PlanarSample) and isinstance(sample, hapticd.Sample)
            assert is_on_circle(sample._asdict())
            assert tuple(sample._asdict()) == hapticd.PLANAR_COLUMNS


def test_a_place_where_the_linkage_cannot_close_is_no_number() -> None:
    row = [0.5] * len(hapticd.PLANAR_COLUMNS)
    place = hapticd.PLANAR_COLUMNS.index("device_position_y_m")
    sample = of_row([None if index == place else cell for index, cell in enumerate(row)], hapticd.PlanarSample)
    assert isinstance(sample, hapticd.PlanarSample)
    assert math.isnan(sample.device_position_y_m) and sample.device_position_m == 0.5


def test_one_axis_has_none(rig: hapticd.Rig) -> None:
    with rig.samples() as samples:
        assert next(samples)._fields == hapticd.COLUMNS
    assert tuple(rig.record(0.01).columns) == hapticd.COLUMNS


def test_arrays_and_frames_have_the_second_axis(plane: hapticd.Rig) -> None:
    with plane.buffer("1s") as buffer:
        buffer.wait_for(50)
        latest = buffer.latest()
    frame = plane.record(0.05)
    assert latest.dtype.names == tuple(frame.columns) == hapticd.PLANAR_COLUMNS
    assert is_on_circle(latest) and is_on_circle(frame)


@pytest.mark.parametrize("ending", ["mcap", "csv"])
def test_a_recording_has_the_second_axis(plane: hapticd.Rig, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"r.{ending}"
    plane.record("100ms", path=path)
    rows = hapticd.read(path)
    assert tuple(rows.columns) == hapticd.PLANAR_COLUMNS and len(rows) == 100
    assert is_on_circle(rows) and rows.device_velocity_y_mps.abs().max() > 0
    ctl = [str(hapticd.binary().with_name("haptic-ctl")), "--json", "recording"]
    info = json.loads(subprocess.run([*ctl, "info", str(path)], check=True, capture_output=True).stdout)
    assert (info["axes"], info["rows"]) == (2, 100)
    for other in {"mcap", "csv", "parquet"} - {ending}:
        to = tmp_path / f"other.{other}"
        subprocess.run([*ctl, "export", str(path), str(to)], check=True, capture_output=True)
        assert hapticd.read(to).equals(rows), other
