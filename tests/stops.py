#!/usr/bin/env python3
"""What happens to a rig that must be stopped, or not be engaged, on the built programs: nine rows, then times.

A simulated device on a line writes down every command that it takes (`fake-rig --commands`); what is printed is read
from there. Each row is something that people have met with such rigs; a row says `ok` or `WRONG`, and the program ends
with 1 if one is wrong. `--binaries` names the programs of another version, to see what they did.

    cargo build --release --workspace && tests/stops.py
    tests/stops.py --binaries target/debug --stops 20 --rows 1,3
"""

import argparse
import bisect
import json
import os
import pty
import resource
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
LATEST_S = 20.0


def now_us():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000


def wait(what, is_so):
    began = time.monotonic()
    while not is_so():
        if time.monotonic() - began > LATEST_S:
            raise TimeoutError(what)
        time.sleep(0.005)


class Client:
    """A client of a daemon: one request, one answer."""

    def __init__(self, path):
        self.line = socket.socket(socket.AF_UNIX)
        self.line.settimeout(LATEST_S)
        self.line.connect(str(path))
        self.answers = self.line.makefile("rb")
        self.answers.readline()

    def ask(self, op, **fields):
        self.line.sendall(json.dumps({"id": 1, "op": op, **fields}).encode() + b"\n")
        while True:
            answer = json.loads(self.answers.readline())
            if answer.get("id") == 1:
                return answer

    def status(self):
        return self.ask("status")["ok"]

    def why_not(self):
        """Why the rig is not engaged, by its code; nothing if it is."""
        # Anyway: what a scene would do behind a slow line is no matter of a stop.
        answer = self.ask("engage", anyway=True)
        return answer["error"]["code"] if "error" in answer else None


class Bench:
    """Rigs and daemons in a folder of their own; they end with it."""

    def __init__(self, binaries):
        self.binaries = binaries
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name)
        self.running = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in reversed(self.running):
            process.kill()
            process.wait()
        self.folder.cleanup()

    def start(self, program, *arguments, **options):
        options = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **options}
        # What is asked for must start nothing of the person's own.
        process = subprocess.Popen([self.binaries / program, *map(str, arguments)], env=self.environment(), **options)
        self.running.append(process)
        return process

    def environment(self):
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.path), "HOME": str(self.path)}
        environment.pop("HAPTICD_SOCKET", None)
        return environment

    def rig(self, *arguments, name="rig", kind=()):
        program = "fake-board" if kind else "fake-rig"
        link, commands = self.path / name, self.path / f"{name}.commands"
        links = [] if kind else ["--commands", commands]
        process = self.start(program, *kind, "--pty", link, *links, *arguments, stdin=subprocess.PIPE)
        wait("the rig", link.is_symlink)
        return Rig(process, link, commands)

    def daemon(self, device, *arguments, service="hapticd", idle=True, **options):
        folder = self.path / service
        folder.mkdir(mode=0o700, exist_ok=True)
        path = folder / "control.sock"
        common = ["--state-dir", self.path / "state", "--scene-dir", self.path / "scenes", "--ramp-ms", 20]
        process = self.start("hapticd", "--device", device, "--socket", path, *common, *arguments, **options)
        wait("the daemon", lambda: path.exists() or process.poll() is not None)
        if process.poll() is not None:
            return process, None
        client = None
        while client is None:
            try:
                client = Client(path)
            except ConnectionRefusedError:
                time.sleep(0.005)
        if idle:
            wait("an idle rig", lambda: client.status()["state"] == "idle")
        return process, client

    def ctl(self, *arguments, **options):
        done = subprocess.run(
            [self.binaries / "haptic-ctl", *map(str, arguments)],
            env=self.environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=LATEST_S,
            **options,
        )
        return done.returncode, (done.stdout + done.stderr).strip()


class Rig:
    """A simulated rig, and the commands that it has taken: time in us, sequence, force in mN, enabled."""

    def __init__(self, process, link, path):
        self.process, self.link, self.path = process, link, path
        self.rows, self.file = [], None

    @property
    def address(self):
        return f"serial:{self.link}"

    def fail(self, *faults):
        self.process.stdin.write("".join(f"{fault}\n" for fault in faults).encode())
        self.process.stdin.flush()

    def commands(self, since_us=0):
        if self.file is None:
            self.file = self.path.open()
        while True:
            at = self.file.tell()
            line = self.file.readline()
            if not line.endswith("\n"):
                self.file.seek(at)
                break
            self.rows.append(tuple(map(int, line.split())))
        first = bisect.bisect_left(self.rows, (since_us,))
        return self.rows[first:]

    def pulls(self):
        rows = self.commands(now_us() - 50_000)
        return any(row[3] and abs(row[2]) > 500 for row in rows)

    def zero_after_ms(self, at_us):
        """Time from then until the device has taken the last command with force or an enabled motor, ms."""
        last = [row for row in self.commands(at_us) if row[3] or row[2]]
        zero = [row for row in self.commands(last[-1][0] if last else at_us) if not (row[3] or row[2])]
        return (zero[0][0] - at_us) / 1000 if zero else None


def engaged(client):
    """Engages the rig, again where a late tick of a busy machine was a fault; or says why it is not."""
    began = time.monotonic()
    while (state := client.status()["state"]) != "engaged":
        if time.monotonic() - began > LATEST_S:
            raise TimeoutError("it is engaged")
        if state == "engaging":
            time.sleep(0.005)
            continue
        client.ask("reset")
        why = client.why_not()
        if why is not None:
            return why
    return None


def pulling(rig, client):
    began = time.monotonic()
    while not rig.pulls():
        if time.monotonic() - began > LATEST_S:
            raise TimeoutError("force")
        why = engaged(client)
        if why is not None:
            return why
        time.sleep(0.005)
    return None


def every_rig(bench):
    """A forgotten demo beside the rig, and slips of the finger."""
    rig = bench.rig()
    _, client = bench.daemon(rig.address, "--uncommissioned", service="hapticd@left")
    bench.daemon("fake")
    for line in ["stop", "stop --all", "stop --rig left", "stop now", "stop --rig lefft"]:
        pulling(rig, client)
        at_us = now_us()
        code, _ = bench.ctl(*line.split())
        time.sleep(0.1)
        after_ms = rig.zero_after_ms(at_us) if client.status()["state"] == "stopped" else None
        yield f"{line}: exit {code}, zero force after {after_ms} ms", after_ms is not None


def confirmed_is_what_the_device_reported(bench):
    """An ODrive that does not do as it is told."""
    for fault in ["ignore-off", "stay-enabled"]:
        with Bench(bench.binaries) as own:
            board = own.rig(kind=["odrive"])
            device = f"odrive:{board.link}?radius_mm=5&torque_limit_nm=0.1"
            _, client = own.daemon(device, "--uncommissioned", "--allow-no-watchdog")
            engaged(client)
            board.fail(fault)
            time.sleep(0.2)
            answer = client.ask("stop")
            reported = answer.get("error", {}).get("code", "ok")
            time.sleep(0.5)
            fault_reported = (client.status().get("fault") or "none").split(":")[0]
            yield (
                f"{fault}: stop {reported}, then fault {fault_reported}",
                (reported, fault_reported)
                == (
                    "not_confirmed",
                    "still_enabled",
                ),
            )


def bounded_in_time(bench):
    """A device that takes 14 kB/s, at 1 kHz and at 500 Hz; a daemon that is killed."""
    for rate in [1000, 500]:
        with Bench(bench.binaries) as own:
            rig = own.rig("--fault", "carry 14000", "--sample-rate-hz", rate)
            daemon, client = own.daemon(rig.address, "--uncommissioned", "--rate", rate)
            time.sleep(1.0)
            why = pulling(rig, client)
            if why is not None:
                yield f"{rate} Hz: not engaged, {why}", why == "commands_late"
                continue
            time.sleep(2.0)
            at_us = now_us()
            client.ask("stop")
            time.sleep(2.0)
            after_ms = rig.zero_after_ms(at_us)
            yield f"{rate} Hz: zero force {after_ms} ms after a stop", after_ms is not None and after_ms <= 50
            if pulling(rig, client) is None:
                at_us = now_us()
                daemon.kill()
                time.sleep(2.0)
                late = [row for row in rig.commands(at_us + 100_000) if row[3]]
                yield f"{rate} Hz: {len(late)} commands with force 100 ms after SIGKILL", not late


def crowd(path, idle, over):
    lines = []
    for _ in range(idle):
        line = socket.socket(socket.AF_UNIX)
        line.settimeout(1)
        try:
            line.connect(str(path))
            lines.append(line)
        except OSError:
            line.close()
    while not over.wait(0.05):
        for line in lines[:12]:
            line.close()
        fresh = []
        for _ in lines[:12]:
            line = socket.socket(socket.AF_UNIX)
            line.settimeout(1)
            try:
                line.connect(str(path))
                fresh.append(line)
            except OSError:
                line.close()
        lines[:12] = fresh
    for line in lines:
        line.close()


def a_way_in(bench):
    """Few descriptors, a full house that comes again, a socket that was removed."""
    for descriptors, idle in [(40, 30), (None, 32)]:
        with Bench(bench.binaries) as own:
            rig = own.rig()
            limit = (lambda few: lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (few, few)))(descriptors)
            _, client = own.daemon(rig.address, "--uncommissioned", preexec_fn=limit if descriptors else None)
            over = threading.Event()
            others = threading.Thread(target=crowd, args=(own.path / "hapticd/control.sock", idle, over))
            others.start()
            try:
                time.sleep(0.5)
                obeyed, longest_ms = 0, 0
                for _ in range(6):
                    pulling(rig, client)
                    at_us = now_us()
                    code, _ = own.ctl("stop")
                    time.sleep(0.05)
                    if code == 0:
                        obeyed += 1
                        longest_ms = max(longest_ms, rig.zero_after_ms(at_us) or 0)
            finally:
                over.set()
                others.join()
            what = (
                f"{descriptors} descriptors, {idle} idle clients" if descriptors else f"{idle} clients that come again"
            )
            yield f"{what}: {obeyed} of 6 stops, the longest {longest_ms} ms with the start of haptic-ctl", obeyed == 6
    rig = bench.rig()
    _, client = bench.daemon(rig.address, "--uncommissioned")
    pulling(rig, client)
    (bench.path / "hapticd/control.sock").unlink()
    time.sleep(0.5)
    code, _ = bench.ctl("stop")
    reached = code == 0 or client.status()["state"] != "engaged"
    yield f"the socket was removed: stop exits {code}", reached


def what_is_relied_on(bench):
    """Buttons, another board, a name, a device that takes no commands, a clock."""

    def with_rig(rig_arguments, daemon_arguments, faults=(), commissioned=False):
        with Bench(bench.binaries) as own:
            rig = own.rig("--hand", "free", *rig_arguments[0])
            _, client = own.daemon(rig.address, *daemon_arguments)
            if commissioned:
                own.ctl("commission", "--yes", "--range", "skip")
                rig.process.kill()
                rig.process.wait()
                wait("it is gone", lambda: client.status()["state"] == "disconnected")
                rig.link.unlink(missing_ok=True)
                own.rig("--hand", "free", *rig_arguments[1])
                wait("it is back", lambda: client.status()["state"] == "idle")
            rig.fail(*faults) if faults else None
            time.sleep(1.0 if faults else 0.1)
            why = client.why_not()
            time.sleep(0.6)
            return why, (client.status().get("fault") or "").split(":")[0]

    loose = ["--uncommissioned"]
    own_name = ["--firmware-name", "mine 1.0"]
    yield from (
        (f"{what}: {why or 'engaged'} {fault}", (why or fault) == wanted)
        for what, (why, fault), wanted in [
            ("stop button 5 of 1", with_rig([["--buttons", "1"]], [*loose, "--stop-button", "5"]), "no_button"),
            (
                "a dead man's switch that is not pressed",
                with_rig([["--buttons", "1"]], [*loose, "--enable-button", "1"]),
                "wrong_state",
            ),
            (
                "another board without serial number, reversed",
                with_rig([own_name, [*own_name, "--reversed"]], [], commissioned=True),
                "maybe_another_rig",
            ),
            ("a device that calls itself fake-rig", with_rig([[]], []), "not_commissioned"),
            ("a device that takes no commands", with_rig([[]], loose, ["no-echo"]), "commands_ignored"),
            ("a device clock at half its speed, idle", with_rig([[]], loose, ["clock-half"]), "device_clock"),
        ]
    )


def slew_and_guard(bench):
    """Wrong samples under force, 0.6 mm and 0.25 mm off."""
    for off_mm in [0.6, 0.25]:
        with Bench(bench.binaries) as own:
            rig = own.rig("--hand-amplitude-m", "0.01")
            _, client = own.daemon(rig.address, "--uncommissioned", "--stale-ms", "100")
            largest_n = 0.0
            for _ in range(20):
                if client.status()["state"] != "engaged" and pulling(rig, client) is not None:
                    break
                at_us = now_us()
                for _ in range(3):
                    rig.fail(f"position-spike {off_mm * 100:.0f}")
                    time.sleep(0.001)
                time.sleep(0.05)
                rows = rig.commands(at_us)
                for before, after in zip(rows, rows[1:]):
                    # Towards zero is never limited.
                    grown = abs(after[2] - before[2]) if before[2] * after[2] < 0 else abs(after[2]) - abs(before[2])
                    if after[1] == before[1] + 1:
                        largest_n = max(largest_n, grown / 1000)
            yield f"{off_mm} mm off: at most {largest_n:.2f} N more in a tick, the slew limit is 5", largest_n <= 5.01


def every_end(bench):
    """Signals that can end the daemon."""
    for name in ["SIGQUIT", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGXCPU", "SIGVTALRM", "SIGIO"]:
        with Bench(bench.binaries) as own:
            rig = own.rig()
            daemon, client = own.daemon(rig.address, "--uncommissioned")
            pulling(rig, client)
            daemon.send_signal(getattr(signal, name))
            wait("its end", lambda: daemon.poll() is not None)
            time.sleep(0.1)
            rows = rig.commands()
            is_zero = bool(rows) and rows[-1][2:] == (0, 0)
            yield f"{name}: exit {daemon.returncode}, last command {'zero' if is_zero else 'FORCE'}", is_zero


def panel(_bench):
    """The panel: its own tests cover the rest, `cargo test -p haptic-panel`."""
    yield from ()


def first_contact(bench):
    """No daemon, a directory that may not be entered, a port that cannot be opened."""
    code, _ = bench.ctl("status")
    yield f"no daemon: exit {code}", code == 3
    code, _ = bench.ctl("devices")
    yield f"devices without a daemon: exit {code}", code == 0
    if os.getuid() == 0:
        bench.daemon("fake", service="closed")
        try:
            code, _ = bench.ctl("status", "--socket", bench.path / "closed/control.sock", user=65534, group=65534)
            yield f"a directory that may not be entered: exit {code}", code == 4
        except PermissionError:
            print("   left out: nobody may not run the programs in this folder")
    log = bench.path / "log"
    with log.open("w") as out:
        bench.daemon(f"serial:{bench.path}/nowhere", idle=False, stderr=out, stdout=out)
        time.sleep(3.0)
    mentions = [line for line in log.read_text().splitlines() if "nowhere" in line]
    yield f"a port that is not there: {len(mentions)} lines of the log in 3 s", 1 <= len(mentions) <= 3


ROWS = [
    every_rig,
    confirmed_is_what_the_device_reported,
    bounded_in_time,
    a_way_in,
    what_is_relied_on,
    slew_and_guard,
    every_end,
    panel,
    first_contact,
]


class TopKey:
    """`haptic-ctl top` on a terminal, whose space bar stops."""

    def __init__(self, bench):
        self.child, self.terminal = pty.fork()
        if self.child == 0:
            os.environ.update(bench.environment(), TERM="xterm")
            os.execv(bench.binaries / "haptic-ctl", ["haptic-ctl", "top"])
        self.over = threading.Event()
        self.reader = threading.Thread(target=self.read)
        self.reader.start()
        time.sleep(1.0)

    def read(self):
        while not self.over.is_set():
            if select.select([self.terminal], [], [], 0.05)[0]:
                try:
                    os.read(self.terminal, 65536)
                except OSError:
                    return

    def __call__(self):
        os.write(self.terminal, b" ")

    def end(self):
        os.kill(self.child, signal.SIGKILL)
        os.waitpid(self.child, 0)
        self.over.set()
        self.reader.join()


def times(binaries, stops):
    """From the act of a person to the command with zero force at the device."""
    print("\n| line | stop by | stops | p50, ms | p99, ms | longest, ms |\n|---|---|---|---|---|---|", flush=True)
    sys.path.insert(0, str(HERE / "python/src"))
    wrong = 0
    for name, arguments, options in [
        ("a good line", [], []),
        ("14 kB/s, 500 Hz", ["--fault", "carry 14000", "--sample-rate-hz", "500"], ["--rate", "500"]),
    ]:
        with Bench(binaries) as bench:
            rig = bench.rig("--buttons", "1", *arguments)
            _, client = bench.daemon(
                rig.address, "--uncommissioned", "--stop-button", "1", "--stale-ms", "100", *options
            )
            path = bench.path / "hapticd/control.sock"
            time.sleep(1.0)
            key = TopKey(bench)
            acts = [
                ("key in `haptic-ctl top`", key),
                ("the rig's button", lambda: rig.fail("button 1 on")),
                ("`haptic-ctl stop`, its start included", lambda: bench.ctl("stop")),
            ]
            try:
                import hapticd

                python = hapticd.connect(path, lease=None)
                acts.append(("Python, `rig.stop()`", python.stop))
            except ImportError as error:
                print(f"| {name} | Python: left out, {error} | - | - | - | - |")
            for who, act in acts:
                taken = []
                for turn in range(stops):
                    if pulling(rig, client) is not None:
                        break
                    # At no moment of the loop's choosing.
                    time.sleep(0.01 + 0.0007 * (turn % 17))
                    at_us = now_us()
                    act()
                    wait("the stop", lambda: client.status()["state"] == "stopped")
                    wait("zero force", lambda: rig.zero_after_ms(at_us) is not None)
                    time.sleep(0.03)
                    taken.append(rig.zero_after_ms(at_us))
                    rig.fail("button 1 off")
                taken.sort()
                if not taken:
                    print(f"| {name} | {who} | 0 | - | - | - |")
                    wrong += 1
                    continue
                p50, p99 = taken[len(taken) // 2], taken[min(len(taken) - 1, len(taken) * 99 // 100)]
                print(f"| {name} | {who} | {len(taken)} | {p50:.1f} | {p99:.1f} | {taken[-1]:.1f} |", flush=True)
                wrong += taken[-1] > 100
            key.end()
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binaries", type=Path, default=HERE / "target/release", help="folder of the programs")
    parser.add_argument("--rows", default="1,2,3,4,5,6,7,8,9", help="rows to be shown")
    parser.add_argument("--stops", type=int, default=100, help="stops of each row of times; 0 leaves them out")
    chosen = parser.parse_args()
    wrong = 0
    for number in map(int, filter(None, chosen.rows.split(","))):
        row = ROWS[number - 1]
        print(f"{number}. {row.__doc__}")
        with Bench(chosen.binaries.resolve()) as bench:
            try:
                for seen, is_right in row(bench):
                    wrong += not is_right
                    print(f"   {'ok   ' if is_right else 'WRONG'} {seen}", flush=True)
            except (TimeoutError, OSError, KeyError) as error:
                wrong += 1
                print(f"   WRONG {type(error).__name__}: {error}", flush=True)
    if chosen.stops:
        wrong += times(chosen.binaries.resolve(), chosen.stops)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
