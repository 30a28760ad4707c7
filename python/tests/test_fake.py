from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hapticd
from hapticd import socket_path


def test_options_are_those_of_the_daemon() -> None:
    with hapticd.fake(rate=2000, force_limit_n=7.5, hand="free") as daemon, daemon.connect() as rig:
        status = rig.status()
        assert (status.rate_hz, status.device.force_limit_N) == (2000.0, 7.5)
        assert any("control socket" in line for line in daemon.messages)
    with pytest.raises(hapticd.HapticdError, match="force-limit"):
        hapticd.fake(force_limit_n=-1)


def test_the_binary_is_the_one_that_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    named = hapticd.binary()
    monkeypatch.setenv("HAPTICD_BINARY", str(named))
    assert hapticd.binary() == named
    monkeypatch.setenv("HAPTICD_BINARY", "/nowhere/hapticd")
    with pytest.raises(FileNotFoundError, match="HAPTICD_BINARY = /nowhere/hapticd"):
        hapticd.fake()
    monkeypatch.delenv("HAPTICD_BINARY")
    (tmp_path / "hapticd").symlink_to(named)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert hapticd.binary() == tmp_path / "hapticd"
    monkeypatch.setenv("PATH", "")
    built = tmp_path / "target/debug/hapticd"
    built.parent.mkdir(parents=True)
    # The newest of all that are built, in the checkout as well.
    built.touch()
    monkeypatch.chdir(built.parent)
    assert hapticd.binary() == built


def test_daemon_and_folder_end_with_their_program() -> None:
    program = (
        "import sys, hapticd\n"
        "daemon = hapticd.fake()\n"
        "rig = daemon.connect()\n"
        "rig.engage()\n"
        "print(daemon.path, flush=True)\n"
        "sys.stdin.read()\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    path = child.stdout.readline().strip()
    with hapticd.connect(path, lease=None) as rig:
        child.kill()
        child.communicate()
        until_s = time.monotonic() + 30
        with pytest.raises(hapticd.ConnectionLost):
            while time.monotonic() < until_s:
                rig.status()
    folder = Path(path).parents[1]
    while folder.exists():
        assert time.monotonic() < until_s, f"{folder} is still there"
        time.sleep(0.005)


def test_the_socket_is_looked_for_where_haptic_ctl_looks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("HAPTICD_SOCKET", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("HOME", "/home/ada")
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    name = "hapticd/control.sock"
    assert [str(path) for path in socket_path.candidates()] == [
        f"{tmp_path}/{name}",
        f"/run/user/1000/{name}",
        f"/home/ada/.local/state/{name}",
        f"/run/{name}",
    ]
    assert socket_path.for_client(None) == tmp_path / name
    monkeypatch.setenv("HAPTICD_SOCKET", "/srv/rig.sock")
    assert socket_path.for_client(None) == Path("/srv/rig.sock")
    assert socket_path.for_client("mine.sock") == Path("mine.sock")


def test_who_may_not_enter_the_directory_learns_the_group(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("HAPTICD_SOCKET", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "empty"))
    closed = tmp_path / "state" / "hapticd"
    closed.mkdir(parents=True)
    places = [tmp_path / "empty/control.sock", closed / "control.sock"]
    monkeypatch.setattr(socket_path, "candidates", lambda rig: places)
    found = Path.stat

    def stat(path: Path) -> os.stat_result:
        if path.parent == closed:
            raise PermissionError
        return found(path)

    assert socket_path.for_client(None) == places[0]
    with monkeypatch.context() as patched:
        patched.setattr(Path, "stat", stat)
        assert socket_path.for_client(None) == places[1]
    closed.chmod(0o750)
    remedy = socket_path.permission_remedy(places[1])
    assert str(closed) in remedy and "usermod -aG " in remedy and "log in again" in remedy
    closed.chmod(0o700)
    assert "alone" in socket_path.permission_remedy(places[1])


def test_the_rig_without_a_name_goes_by_its_service(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HAPTICD_SOCKET", "/elsewhere")
    named = socket_path.candidates("hapticd")
    monkeypatch.delenv("HAPTICD_SOCKET")
    assert named == socket_path.candidates() and named != socket_path.candidates("left")


def test_a_service_that_does_not_run_is_looked_up_in_its_log(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(socket_path, "_UNITS", [str(tmp_path)])
    assert "start the service hapticd@left" in socket_path.start_remedy(Path("/run/hapticd@left/control.sock"))
    (tmp_path / "hapticd@.service").touch()
    remedy = socket_path.start_remedy(Path("/run/hapticd@left/control.sock"))
    assert "journalctl -u hapticd@left`" in remedy and "--demo" not in remedy
    assert "--demo" in socket_path.start_remedy(Path("/run/user/1000/hapticd/control.sock"))
