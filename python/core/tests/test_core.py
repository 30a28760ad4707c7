from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import hapticd
import hapticd_core
import numpy
import pandas
import pytest
from hapticd_core import Scene

LAWS = ("simulated-friction", "lugre", "asymmetric-with-memory", "viscous-drag", "stuck-spring-on-the-device")


def pull(seconds: float = 1.0) -> dict[str, Any]:
    t_s = numpy.arange(0.0, seconds, 1e-3)
    return {"t_s": t_s, "position_m": 0.02 * numpy.sin(9 * t_s) + 0.003 * numpy.sin(70 * t_s)}


def ctl(*arguments: object) -> None:
    program = hapticd.binary().with_name("haptic-ctl")
    subprocess.run([str(program), *map(str, arguments)], check=True, capture_output=True)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("scheme", ["exact", "literal:10"])
def test_forces_are_those_of_haptic_ctl_to_the_last_bit(tmp_path: Path, name: str, scheme: str) -> None:
    scene = Path(__file__).resolve().parents[3] / "scenes" / f"{name}.toml"
    motion = pandas.DataFrame(pull())
    motion.to_csv(tmp_path / "motion.csv", index=False, float_format="%.17g")
    ctl("simulate", scene, "--motion", tmp_path / "motion.csv", "--scheme", scheme, "--out", tmp_path / "out.csv")
    expected = numpy.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)
    assert expected.dtype.names is not None
    run = hapticd_core.simulate(motion, Scene.read(scene), scheme=scheme).frame()
    assert tuple(run.columns) == expected.dtype.names
    for column in run.columns:
        assert (run[column].to_numpy() == expected[column]).all(), column
        # Equal numbers may differ in the sign of zero.
        assert (numpy.signbit(run[column]) == numpy.signbit(expected[column])).all(), column
    assert run.coupling_force_N.abs().max() > 0.1


def test_a_recorded_session_is_computed_again_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with hapticd.fake() as daemon, daemon.connect() as rig:
        recorder = subprocess.Popen(
            [str(hapticd.binary().with_name("haptic-ctl")), "record", str(path), "--for", "2s"],
            env={**os.environ, "HAPTICD_SOCKET": str(daemon.path)},
            stdout=subprocess.DEVNULL,
        )
        while not path.exists():
            rig.status()
        # A replay begins where the estimate of velocity has settled before there is force.
        with rig.buffer() as buffer:
            buffer.wait_for(400)
        rig.engage()
        rig.wait_for("engaged")
        rig.set(Fs=5, mass=0.8)
        assert recorder.wait(60) == 0
    report = hapticd_core.replay(path)
    assert report["ticks"] == len(hapticd.read(path))
    assert report["differing"] == 0, report["first_differing"]
    assert report["with_force"] > 500


def test_the_exact_scheme_is_exact_and_the_literal_one_is_not() -> None:
    scene = Scene.named("simulated-friction")
    exact = hapticd_core.accuracy(pull(), scene)
    literal = hapticd_core.accuracy(pull(), scene, scheme="literal")
    assert exact.force_error_N < 1e-9
    assert exact.event_time_error_s is not None and exact.event_time_error_s < 1e-9
    assert literal.force_error_N > 1e-3
    truth = hapticd_core.reference(pull(), scene)
    run = hapticd_core.simulate(pull(), scene, scheme="literal")
    error = numpy.abs(run.coupling_force_N - truth.coupling_force_N).max()
    assert error == literal.force_error_N


def test_a_scene_is_read_changed_and_compared() -> None:
    scene = Scene.named("simulated-friction")
    heavier = scene.changed({"Fs+": 6.0}, mass="2000 g")
    assert heavier.params["mass"] == 2.0
    assert heavier.params["static_force"] == {"positive": 6.0, "negative": scene.params["static_force"]}
    assert heavier != scene and Scene(heavier.fields) == heavier
    with hapticd.fake() as daemon, daemon.connect() as rig:
        active = Scene(rig.get().scene)
        assert active.params == rig.get().params
    run = hapticd_core.simulate(pull(), scene)
    assert (numpy.diff(run.changes["t_s"]) > 0).all() and len(run.changes) > 3
    assert (run.changes["before"] != run.changes["after"]).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Scene.named("luge"), "no built-in scene is called `luge`, did you mean `lugre`?"),
        (lambda: Scene.named("lugre").changed(mass=-1), "mass = -1 kg is out of range"),
        (lambda: Scene.named("lugre").changed(mas=1), "mas"),
        (lambda: Scene.named("lugre").changed(mass="1 lb"), 'mass = "1 lb": `lb` is not a unit of this'),
        (
            lambda: hapticd_core.simulate(pull(), "lugre"),  # type: ignore[arg-type]
            "scene = 'lugre' is no Scene: use Scene.named",
        ),
        (lambda: Scene({"name": "x"}), "friction"),
        (lambda: hapticd_core.simulate({"t_s": [0.0]}, Scene.named("lugre")), "lacks a column"),
        (lambda: _simulated([0.0, 1e-3, 1e-3], [0.0, 0.0, 0.0]), r"t_s\[2\] = 0.001 s does not follow 0.001 s"),
        (lambda: _simulated([0.0, 1e-3], [0.0, float("nan")]), r"position_m\[1\] = NaN is not a finite number"),
        (lambda: _simulated([0.0, 1e-3], [0.0]), "position_m has 1 values, and t_s has 2"),
        (lambda: _simulated([], []), "no samples"),
        (lambda: _simulated([0.0, 1e-3], [0.0, 0.0], scheme="magic"), "magic"),
        (lambda: _simulated([0.0, 1e-3], [0.0, 0.0], block_velocity_mps=float("inf")), "block_velocity_mps = inf"),
    ],
)
def test_what_cannot_be_computed_is_refused_by_name(wrong: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wrong()


def _simulated(t_s: list[float], position_m: list[float], **options: Any) -> hapticd_core.Simulation:
    motion = {"t_s": t_s, "position_m": position_m, "velocity_mps": [0.0] * len(t_s)}
    return hapticd_core.simulate(motion, Scene.named("lugre"), **options)


def test_a_motion_comes_as_a_frame_an_array_or_a_dictionary() -> None:
    scene = Scene.named("lugre")
    frame = pandas.DataFrame(pull(0.1))
    runs = [hapticd_core.simulate(motion, scene) for motion in (frame, frame.to_records(index=False), pull(0.1))]
    recorded = frame.rename(columns={"position_m": "device_position_m"})
    runs.append(hapticd_core.simulate(recorded, scene))
    for run in runs[1:]:
        assert run.coupling_force_N.tobytes() == runs[0].coupling_force_N.tobytes()
    with pytest.raises(ValueError, match="both position_m and device_position_m"):
        hapticd_core.simulate(pull() | {"device_position_m": pull()["position_m"]}, scene)


def test_the_figure_of_the_readme_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import re

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    text = (Path(__file__).resolve().parents[1] / "README.md").read_text()
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(block.strip().splitlines()) <= 12
    exec(compile(block, "README.md", "exec"), {})
    assert (tmp_path / "stiction.png").stat().st_size > 10_000
