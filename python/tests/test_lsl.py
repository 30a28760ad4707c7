from __future__ import annotations

import json
import subprocess
import sys

import numpy
import pylsl
import pytest

import hapticd
from hapticd import lsl


def _inlet(name: str) -> pylsl.StreamInlet:
    found = pylsl.resolve_byprop("name", name, timeout=30)
    assert found, f"no stream {name}"
    inlet = pylsl.StreamInlet(found[0])
    inlet.open_stream(timeout=30)
    return inlet


def test_samples_and_events_reach_an_inlet(daemon: hapticd.Fake) -> None:
    name = daemon.directory.name
    program = [sys.executable, "-m", "hapticd.lsl", "--socket", str(daemon.path), "--name", name]
    publisher = subprocess.Popen(program, stderr=subprocess.DEVNULL)
    try:
        with daemon.connect() as rig:
            samples, events = _inlet(name), _inlet(f"{name}-events")
            rig.engage()
            changed = rig.set(mass=1.25)
            rows: list[list[float]] = []
            times: list[float] = []
            while len(rows) < 500:
                more, stamps = samples.pull_chunk(timeout=10.0)
                rows += more
                times += stamps
            table = numpy.array(rows)
            assert (numpy.diff(table[:, 0]) == 1).all()
            # Stamped with the moments of the ticks, and not with those at which they arrived.
            t_s = table[:, hapticd.COLUMNS.index("t_s")]
            offset_s = numpy.array(times) - t_s
            assert numpy.ptp(offset_s) < 1e-9
            change = None
            while change is None:
                line, stamp = events.pull_sample(timeout=10.0)
                event = json.loads(line[0])
                if event["event"] == "log" and event["op"] == "set":
                    change = event
            assert change["tick"] == changed.tick
            assert changed.tick is not None
            expected_s = t_s[0] + offset_s[0] + (changed.tick - table[0, 0]) * 1e-3
            assert stamp == pytest.approx(expected_s, abs=0.1)
    finally:
        publisher.terminate()
        publisher.wait()


def test_an_absent_daemon_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert lsl.main(["--socket", "/nowhere/control.sock"]) == 1
    assert "does not listen on /nowhere/control.sock" in capsys.readouterr().err
