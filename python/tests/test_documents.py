"""The examples of the documents run."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import hapticd

HERE = Path(__file__).resolve().parents[1]


def test_the_blocks_of_the_readme_run(daemon: hapticd.Fake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HAPTICD_SOCKET", str(daemon.path))
    monkeypatch.chdir(tmp_path)
    text = (HERE / "README.md").read_text()
    blocks = list(re.finditer(r"```python\n(.*?)```", text, re.DOTALL))
    assert len(blocks) >= 8
    names: dict[str, object] = {}
    for block in blocks:
        # An error then names the line of the document.
        source = "\n" * text[: block.start(1)].count("\n") + block[1]
        exec(compile(source, "README.md", "exec"), names)


def example(name: str, *arguments: str) -> list[dict[str, Any]]:
    """The lines of an experiment with the simulated observer."""
    program = [sys.executable, str(HERE / "examples" / name), "--simulated", "--duration", "0.3", "--seed", "2"]
    run = subprocess.run([*program, *arguments], check=True, capture_output=True, text=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def test_threshold_is_the_mean_of_the_turns_but_the_first() -> None:
    names = runpy.run_path(str(HERE / "examples" / "staircase.py"))
    steps = [(2.0, False), (1.4, True), (1.4, False), (0.98, False), (1.4, True), (0.98, True), (1.4, True)]
    trials = [names["Trial"](difference_N, 1, [], [], turns=turns) for difference_N, turns in steps]
    assert names["threshold_N"](trials) == pytest.approx((1.4 * 0.98 * 1.4) ** (1 / 3))
    assert names["threshold_N"](trials[:2]) == pytest.approx(1.4)


def test_a_missing_extra_is_named_before_anything_begins(rig: hapticd.Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match="extra `numpy`"):
        rig.buffer()
    with pytest.raises(ModuleNotFoundError, match="extra `plot`"):
        rig.plot()
    with pytest.raises(ModuleNotFoundError, match="extra `pandas`"):
        rig.record(0.1)


def test_the_staircase_finds_a_threshold_without_a_display() -> None:
    *trials, summary = example("staircase.py", "--reversals", "2")
    assert summary["trials"] == len(trials) >= 4
    assert 0.05 < summary["threshold_N"] < 2.0
    for trial in trials:
        assert trial["ticks"][0] < trial["ticks"][1]
        if trial["difference_N"] > 1.5:
            first, second = trial["peak_force_N"]
            assert (first > second) == (trial["stickier"] == 1)


def test_questplus_follows_the_answers_to_a_threshold() -> None:
    *trials, summary = example("questplus_stiction.py", "--trials", "8")
    assert summary["trials"] == len(trials) == 8
    assert 0.05 <= summary["low_N"] < summary["threshold_N"] < summary["high_N"] <= 2.0
    assert len({trial["difference_N"] for trial in trials}) > 1
