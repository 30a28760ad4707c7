#!/usr/bin/env python3
"""Tries a port that runs on this computer: conformance, then each planted fault, which must end at zero force.

    tests/ports.py native|cortexm3|cortexm4|rp2040 BUILD [1 or 2]

BUILD is the folder of what make has built. Prints a line for each; exit code 1 where one is wrong."""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
spec = importlib.util.spec_from_file_location("check_rig", os.path.join(here, "..", "check_rig.py"))
check_rig = importlib.util.module_from_spec(spec)
spec.loader.exec_module(check_rig)

FORCE_MN = 2000
# How many ms after the fault the force has ended, and whether the processor resets. Half a millisecond is how exactly that
# is seen.
FAULTS = {
    "silent": (50.5, False),
    "hang loop": (50.5, True),
    "hang write": (50.5, True),
    "hang clock": (50.5, False),
    "hang deaf": (50.5, True),
    "hang kicking": (50.5, False),
    "cut": (3, False),
    "reset": (3, True),
}
# A busy machine holds up board and host alike.
TRIES = 3


class Native:
    """build/native, which is processor and rig in one. Its times are those of a computer that may be busy."""

    slack = 4

    def __init__(self, build, axes, link, options):
        self.run = subprocess.Popen(
            [os.path.join(build, "native"), link, axes, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, order):
        self.run.stdin.write(order + "\n")
        self.run.stdin.flush()
        return json.loads(self.run.stdout.readline())

    def stop(self):
        self.run.stdin.close()
        self.run.wait(5)


class CortexM(Native):
    """The image in QEMU, and build/cortexm-rig with line, motors and encoders around it. The rig keeps the board's time."""

    slack = 1

    def __init__(self, build, axes, link, options, core):
        memory = link + ".memory"
        command = [os.path.join(build, "cortexm-rig"), memory, link, axes, *options]
        self.run = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.ask("stats")
        machine = {"cortexm3": "mps2-an385", "cortexm4": "mps2-an386"}[core]
        command = ["qemu-system-arm", "-M", machine + ",memory-backend=shared"]
        command += ["-object", "memory-backend-file,id=shared,size=16M,share=on,mem-path=" + memory]
        command += ["-display", "none", "-serial", "none", "-monitor", "none"]
        self.qemu = subprocess.Popen([*command, "-kernel", os.path.join(build, core + ".elf")])

    def stop(self):
        self.qemu.kill()
        self.qemu.wait(5)
        super().stop()


class Rp2040(Native):
    """The image in rp2040js, which runs in node and keeps the board's time."""

    slack = 1

    def __init__(self, build, axes, link, options):
        rig = os.path.join(here, "../ports/rp2040/rig.mjs")
        command = [os.path.join(build, "onpty"), link, "node", rig, os.path.join(build, f"rp2040-{axes}.bin"), axes, *options]
        self.run = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def started(port, build, axes, link):
    if port == "native":
        return Native(build, axes, link, ["rest"])
    if port == "rp2040":
        return Rp2040(build, axes, link, ["rest"])
    return CortexM(build, axes, link, ["rest"], port)


def forces(stats):
    return [axis["force_n"] for axis in stats["axes"]]


def plant(board, rig, fault):
    """Pulls, plants the fault, and goes on commanding as a host that has not noticed, except where the host is the fault."""
    within_ms, is_reset = FAULTS[fault]
    check_rig.wait_for_the_board(rig)
    rig.enable()
    rig.hold(0.1, FORCE_MN)
    before = board.ask("stats")
    check_rig.expect(forces(before)[0] == FORCE_MN / 1000, f"it does not pull: {before}")
    host_is_silent = fault in ("silent", "hang clock")
    # To a board, "silent" is no order; it marks the moment.
    board.ask(fault)
    began = time.monotonic()
    while any(forces(after := board.ask("stats"))):
        check_rig.expect(time.monotonic() - began < 1, f"the force stays: {after}")
        if not host_is_silent:
            rig.command(FORCE_MN)
        rig.listen(0.001)
    took_ms = after["off_after_order_ms"]
    check_rig.expect(took_ms <= within_ms * board.slack, f"off after {took_ms} ms")
    # A reset may come later than the timer's interrupt; the force must not come back.
    rig.hold(0.2, FORCE_MN)
    after = board.ask("stats")
    check_rig.expect(not any(forces(after)), f"the force comes back: {after}")
    resets = after["resets"] - before["resets"]
    check_rig.expect((resets > 0) == is_reset, f"{resets} resets")
    if fault == "cut":
        rig.say(check_rig.enable(rig.next()))
        answer = rig.wait_for(0.1, "acknowledge", lambda m: isinstance(m, check_rig.Acknowledge))
        check_rig.expect(answer.refused, "it enables the motors without a position")
    return f"no force after {took_ms} ms, {resets} resets"


def tried(board, rig, fault):
    for tries_left in range(TRIES - 1, -1, -1):
        try:
            print(f"ok    {fault}: {plant(board, rig, fault)}", flush=True)
            return True
        except check_rig.Fault as wrong:
            print(f"{'again' if tries_left else 'FAULT'} {fault}: {wrong}", flush=True)
        finally:
            board.ask("mend")
            time.sleep(0.1)
    return False


def main():
    port, build = sys.argv[1:3]
    axes = sys.argv[3] if len(sys.argv) > 3 else "1"
    is_right = True
    with tempfile.TemporaryDirectory() as folder:
        link = os.path.join(folder, "rig")
        board = started(port, build, axes, link)
        try:
            board.ask("stats")
            command = [sys.executable, os.path.join(here, "..", "check_rig.py"), link, "--slow", "2", "--push", "0.9"]
            if port == "rp2040":
                # At first node compiles, and the board stands still meanwhile.
                subprocess.run([*command, "--only", "begins_anew"], stdout=subprocess.DEVNULL)
            is_right = subprocess.run(command).returncode == 0
            rig = check_rig.Rig(check_rig.Line(link, 1_000_000), 2)
            is_right &= all([tried(board, rig, fault) for fault in FAULTS])
        finally:
            board.stop()
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
