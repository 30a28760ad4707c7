"""The examples of the documents run."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

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


def test_the_staircase_finds_a_threshold_without_a_display() -> None:
    program = [sys.executable, str(HERE / "examples/staircase.py"), "--simulated"]
    run = subprocess.run(
        [*program, "--reversals", "2", "--duration", "0.3", "--seed", "2"],
        check=True,
        capture_output=True,
        text=True,
    )
    *trials, summary = map(json.loads, run.stdout.splitlines())
    assert summary["trials"] == len(trials) >= 4
    assert 0.05 < summary["threshold_N"] < 2.0
    for trial in trials:
        assert trial["ticks"][0] < trial["ticks"][1]
        if trial["difference_N"] > 1.5:
            first, second = trial["peak_force_N"]
            assert (first > second) == (trial["stickier"] == 1)
