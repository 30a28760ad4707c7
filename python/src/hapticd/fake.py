"""A rig without hardware: the real daemon with its simulated rig, on a socket of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from hapticd.closing import Closing
from hapticd.duration import Duration
from hapticd.errors import HapticdError
from hapticd.rig import Rig

#: How much patience a daemon has with a busy machine, where no hand is on the rig.
_PATIENT = ("--stale-ms", "500", "--control-timeout-ms", "5000", "--spin-us", "0")


def binary() -> Path:
    """The hapticd binary: `$HAPTICD_BINARY`, else the one on `PATH`, else the newest in a `target/` above.

    Raises:
        FileNotFoundError: There is none.
    """
    if named := os.environ.get("HAPTICD_BINARY"):
        if not os.access(named, os.X_OK):
            raise FileNotFoundError(f"HAPTICD_BINARY = {named} is no program that can be run")
        return Path(named)
    if found := shutil.which("hapticd"):
        return Path(found)
    places = [*Path.cwd().parents, Path.cwd(), *Path(__file__).resolve().parents]
    built = {
        path
        for place in places
        for profile in ("debug", "release")
        if (path := place / "target" / profile / "hapticd").is_file()
    }
    if not built:
        raise FileNotFoundError(
            "there is no hapticd: install it, build it (cargo build -p hapticd), or name it in $HAPTICD_BINARY"
        )
    return max(built, key=lambda path: path.stat().st_mtime)


class Fake(Closing):
    """A daemon with a simulated rig. It ends with this object, and with this program.

    Attributes:
        path: Its control socket.
        directory: Where it keeps scenes and state.
        messages: What it has written to standard error so far.
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        program = binary()
        self._temporary = tempfile.TemporaryDirectory(prefix="hapticd-")
        self.directory = Path(self._temporary.name)
        # A socket's path has at most 107 bytes, and its directory is the daemon's to create.
        self.path = self.directory / "run" / "control.sock"
        self.messages: list[str] = []
        command = [
            *(str(program), "--device", "fake", "--socket", str(self.path)),
            *("--scene-dir", str(self.directory / "scenes"), "--state-dir", str(self.directory / "state")),
            *_PATIENT,
            *arguments,
        ]
        self._supervisor = subprocess.Popen(
            [sys.executable, "-S", "-c", _SUPERVISE, self._temporary.name, *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._came_up = threading.Event()
        assert self._supervisor.stderr is not None
        self._listener = threading.Thread(
            target=self._listen, args=(self._supervisor.stderr,), name="hapticd messages", daemon=True
        )
        self._listener.start()
        self._came_up.wait()
        if self._supervisor.poll() is not None or not self.path.exists():
            self.close()
            printed = "".join(self.messages) or "it ended without a word"
            raise HapticdError(f"hapticd ({program}) did not come up:\n{printed}")

    def _listen(self, stderr: IO[str]) -> None:
        for line in stderr:
            self.messages.append(line)
            # The line on its rate and privileges is the last that every daemon says.
            if " Hz, " in line:
                self._came_up.set()
        self._supervisor.wait()
        self._came_up.set()

    def connect(self, *, lease: Duration | None = 1.0, keep: bool = False) -> Rig:
        """Connects to it, as `hapticd.connect` does."""
        return Rig(self.path, lease=lease, keep=keep)

    def close(self) -> None:
        """Ends it."""
        assert self._supervisor.stdin is not None and self._supervisor.stderr is not None
        self._supervisor.stdin.close()
        self._supervisor.wait()
        self._listener.join()
        self._supervisor.stderr.close()
        self._temporary.cleanup()


def fake(*arguments: str, **options: Any) -> Fake:
    """Starts the daemon with a simulated rig, for tests and for trying things out.

        with hapticd.fake(hand="arm") as daemon, daemon.connect() as rig:
            rig.engage()

    Args:
        arguments: More arguments of hapticd.
        options: Options of hapticd by name, as in `rate=2000`, `hand="free"`, `force_limit_n=10`; `True` for an option
            without a value.

    Raises:
        FileNotFoundError: There is no hapticd.
        HapticdError: It does not come up; the message has what it printed.
    """
    given = list(arguments)
    for name, value in options.items():
        given.append("--" + name.replace("_", "-"))
        if value is not True:
            given.append(str(value))
    # What is given here replaces what is patient.
    return Fake(given)


#: Runs a command until it ends, or until nobody holds the other end of standard input: then this program is dead, and
#: its folder, the first argument, goes too.
_SUPERVISE = """
import os, shutil, signal, subprocess, sys, threading
child = subprocess.Popen(sys.argv[2:], stdin=subprocess.DEVNULL)
is_alone = threading.Event()
def watch():
    sys.stdin.buffer.read()
    is_alone.set()
    child.terminate()
    try:
        child.wait(5)
    except subprocess.TimeoutExpired:
        child.kill()
signal.signal(signal.SIGINT, signal.SIG_IGN)
threading.Thread(target=watch, daemon=True).start()
code = child.wait()
if is_alone.is_set():
    shutil.rmtree(sys.argv[1], ignore_errors=True)
os._exit(code & 0xFF)
"""
