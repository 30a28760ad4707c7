"""What a program asks the daemon, and the error for a wrong value."""

from __future__ import annotations

import os
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import hapticd
import hapticd.aio


def test_the_scene_describes_itself(rig: hapticd.Rig) -> None:
    about = rig.describe()
    assert about.law == "karnopp" and "lugre" in about.laws
    mass = next(each for each in about.parameters if each.name == "mass")
    assert (mass.symbol, mass.unit, mass.min, mass.value) == ("M", "kg", 1e-6, 0.5)


def test_a_scene_is_saved_and_listed(rig: hapticd.Rig) -> None:
    rig.set(mass="1 kg")
    saved = rig.save("mine")
    assert saved.name == "mine" and Path(saved.path).exists()
    scenes = {scene.name: scene for scene in rig.scenes()}
    assert scenes["mine"].path == saved.path and scenes["lugre"].law == "lugre"
    with pytest.raises(hapticd.Conflict, match="mine"):
        rig.save("mine")
    rig.save("mine", "lugre", replace=True)
    assert rig.load("mine").changed
    assert rig.describe().law == "lugre"


def test_units_of_a_call_are_asked_for_once(rig: hapticd.Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    request = rig.request

    def counted(op: str, **fields: Any) -> dict[str, Any]:
        asked.append(op)
        return request(op, **fields)

    monkeypatch.setattr(rig, "request", counted)
    rig.set(mass="200 g", Fs="5 N", Fd="4 N")
    rig.set(mass=0.3)
    assert asked == ["describe", "set", "set"]
    with pytest.raises(TypeError, match="mass is given twice"):
        rig.set({"mass": 1}, mass=2)


def test_the_journal_and_the_advice_have_types(rig: hapticd.Rig) -> None:
    rig.engage()
    change = rig.set(mass=2)
    entries = rig.log(limit=2)
    assert [entry.op for entry in entries] == ["engage", "set"]
    engage, changed = entries
    assert engage.state is not None and engage.state.before == "idle"
    assert changed.by is not None and changed.by.pid == os.getpid()
    assert changed.changes == change.changes and changed.revision == change.revision
    assert rig.log(after=engage.seq) == [changed]
    reply = rig.advise()
    assert reply.revision == change.revision and reply.basis is not None and reply.basis.period_us == 1000.0
    checks = [each.finding for each in reply.advice if each.finding is not None]
    assert checks and all(isinstance(check.margin, float) for check in checks)
    assert all(isinstance(each, hapticd.Advice) for each in change.advice)


def test_a_rig_says_what_it_is(daemon: hapticd.Fake) -> None:
    with daemon.connect() as rig:
        shown = repr(rig)
        assert "fake rig" in shown and ": idle, scene 'simulated friction'" in shown and str(daemon.path) in shown
        rig.stop()
        assert ": stopped, " in repr(rig)
    assert "closed here" in repr(rig)


def test_a_condition_is_waited_for() -> None:
    with hapticd.fake(hand="arm") as daemon, daemon.connect() as rig:
        rig.engage()
        tick = rig.wait_for(lambda sample: sample.state == "engaged" and sample.device_position_m > 0.005)
        assert tick <= rig.status().tick
        with pytest.raises(TimeoutError, match=r"did not hold within 0\.05 s; the rig is engaged"):
            rig.wait_for(lambda sample: sample.device_position_m > 5, timeout="50ms")
        # A condition that takes longer than a tick does not put the end off.
        with pytest.raises(TimeoutError, match="did not hold"):
            rig.wait_for(lambda sample: time.sleep(0.003), timeout="50ms")
        states: list[str] = []

        def is_far(sample: hapticd.Sample) -> bool:
            if not states:
                rig.stop()
            states.append(sample.state)
            return False

        with pytest.raises(hapticd.Stopped, match="stopped before the condition held"):
            rig.wait_for(is_far)
        assert states[-1] == "stopped"
        # Who begins to wait while it is stopped may do so: for the hand to come home.
        assert rig.wait_for(lambda sample: abs(sample.device_position_m) < 5) > tick


def test_a_misspelt_state_is_refused_at_once(rig: hapticd.Rig) -> None:
    # mypy says where an ignored error is none: so it refuses these, too.
    with pytest.raises(hapticd.InvalidValue, match="did you mean 'engaged'"):
        rig.wait_for("engagd")  # type: ignore[call-overload]
    with rig.events() as events, pytest.raises(hapticd.InvalidValue, match="the states are disconnected, idle"):
        events.wait_for("asleep", 10)  # type: ignore[arg-type]
    assert rig.status().state != "engagd"  # type: ignore[comparison-overlap]


def test_every_refused_value_is_an_invalid_value(rig: hapticd.Rig, tmp_path: Path) -> None:
    anything: Any = rig
    for refused, message in (
        (lambda: anything.wait_for("engaged", timeout="soon"), "timeout = 'soon': expected a number and its unit"),
        (lambda: anything.set(mass=float("nan")), "mass = nan is not a finite number"),
        (lambda: anything.set(mass="heavy"), "mass = 'heavy' is not a finite number"),
        (lambda: anything.set(mass=None), "mass"),
        (lambda: anything.set(mass=1, ramp=-1), "ramp = -1 is out of range"),
        (lambda: anything.set(mass=1, ramp=11), "ramp_ms"),
        (lambda: anything.at(1, mass=1), "at_tick"),
        (lambda: anything.save("../mine"), "mine"),
        (lambda: anything.load({"friction": 5}), "friction"),
        (lambda: anything.samples(on_gap="ignore"), "on_gap = 'ignore'"),
        (lambda: anything.samples(rate_hz=-1), "rate_hz"),
        (lambda: anything.buffer(0), "length = 0 s is out of range"),
        (lambda: anything.buffer("2h"), "length = 7200 s is out of range: above 0 and up to 3600 s at this rate"),
        (lambda: anything.plot(0), "length = 0 s is out of range"),
        (lambda: anything.record(), "give how long to record"),
        (lambda: anything.record("r.mcap"), r"write record\(path='r.mcap'\)"),
        (lambda: anything.record(path=tmp_path / "r.txt"), "ends in .mcap or .csv"),
        (lambda: hapticd.connect(rig="no/slash"), "the name of a rig has 1 to 64"),
        (lambda: hapticd.connect(rig.path, rig="left"), "give one of the two"),
        (lambda: hapticd.connect(rig.path, lease=0), "lease = 0 is out of range"),
    ):
        with pytest.raises(hapticd.InvalidValue, match=message) as error:
            refused()
        assert error.value.param is not None, message


def test_a_rig_is_found_by_its_name(daemon: hapticd.Fake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("HAPTICD_SOCKET", "/nowhere")
    (tmp_path / "hapticd@left").symlink_to(daemon.path.parent)
    with hapticd.connect(rig="left", lease=None) as rig:
        assert rig.status().state == "idle"
    with pytest.raises(hapticd.NoDaemon, match="hapticd@right"):
        hapticd.connect(rig="right")


def test_the_package_has_a_version() -> None:
    assert hapticd.__version__ == version("hapticd")
    with pytest.raises(AttributeError):
        hapticd.no_such_name  # noqa: B018


def test_asyncio_has_the_same_operations() -> None:
    methods = {name for name, each in vars(hapticd.aio.Rig).items() if callable(each) and not name.startswith("_")}
    blocking = {name for name in dir(hapticd.Rig) if not name.startswith("_")}
    assert blocking - methods == {"close", "loop_rate_hz"}


def test_a_condition_may_be_of_the_second_axis() -> None:
    with hapticd.fake(kinematics="xy", hand="circle") as planar, planar.connect() as rig:
        # mypy reads this, too.
        assert rig.wait_for(lambda sample: abs(sample.device_position_y_m) < 1) > 0
