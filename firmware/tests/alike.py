#!/usr/bin/env python3
"""Says the same bytes to the native board and to fake-rig, damaged frames included, and compares what they answer.

    tests/alike.py NATIVE FAKE_RIG [SECONDS [SEED]]

Both are programs; each conversation is held with one axis and with two. Equal must be each hello, acknowledge and error,
byte for byte, and of the newest sample its length, flags and newest command, once both have taken what was sent. Exit code
1 where they differ."""

import os
import random
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import check_rig  # noqa: E402

# Long enough for both to answer, and for one that a busy machine holds up a few times as long.
SETTLE_S = 0.008
TRIES = 4
# Beyond this, the watchdog of one of them may have acted, and of the other not.
HELD_UP_S = 0.045
# So long after the newest message that feeds it, a watchdog of 50 ms is about to act or has just acted: what is sent
# then may come before in one of them and after in the other.
DOUBTFUL_S = (0.04, 0.07)


class Device:
    """A device, and its answers since it was last asked."""

    def __init__(self, command, link):
        self.run = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(100):
            if os.path.exists(link):
                break
            time.sleep(0.05)
        self.line = check_rig.Line(link, 1_000_000)
        self.line.open = self.keep
        self.answers, self.newest = [], None

    def keep(self, stuffed):
        message = check_rig.unstuff(stuffed)[:-4]
        if message[0] in (check_rig.SAMPLE, check_rig.WIDE_SAMPLE):
            # Neither buttons nor counts nor times are compared.
            self.newest = (len(message), message[2], message[16:20].hex())
        else:
            self.answers.append(message.hex())

    def listen(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.line.receive(left)

    def outcome(self):
        return self.answers, self.newest

    def forget(self):
        self.answers, self.newest = [], None


def damaged(rng, sequence, axes):
    """Bytes that no device may take; of some it complains."""
    command = check_rig.command(sequence, (0,) * axes)
    whole = check_rig.frame(command)
    choice = rng.randrange(10)
    if choice == 0:
        return check_rig.frame(command, spoil=1 << rng.randrange(32))
    if choice == 1:
        return whole[: rng.randrange(1, len(whole))] + b"\0"
    if choice == 2:
        at, bit = rng.randrange(len(whole) - 1), 1 << rng.randrange(8)
        return whole[:at] + bytes([whole[at] ^ bit or 1]) + whole[at + 1 :] + b"\0"
    if choice == 3:
        return bytes(rng.randrange(1, 256) for _ in range(rng.randrange(1, 120))) + b"\0"
    if choice == 4:
        return check_rig.frame(bytes([rng.choice((0x77, 0x20, 0x14)), 1]) + bytes(rng.randrange(256) for _ in range(10)))
    if choice == 5:
        return check_rig.frame(check_rig.command(sequence, (0,) * axes, version=2))
    if choice == 6:
        return check_rig.frame(command[: rng.randrange(2, len(command))])
    if choice == 7:
        return check_rig.frame(bytes([rng.choice((0, 1, 2, 4, 5, 0x10))]) + command[1:])
    if choice == 8:
        return check_rig.frame(check_rig.command(sequence, (0,) * (3 - axes)))
    return bytes(rng.randrange(1, 5))


def next_bytes(rng, sequence, axes):
    """What the host says next, and its newest sequence then."""
    choice = rng.random()
    if choice < 0.4:
        forces_mn = [rng.choice((0, 300, -300)) for _ in range(axes)]
        return check_rig.frame(check_rig.command(sequence + 1, forces_mn, rng.random() < 0.9)), sequence + 1
    if choice < 0.55:
        return check_rig.frame(check_rig.enable(sequence + 1, rng.random() < 0.8)), sequence + 1
    if choice < 0.6:
        return check_rig.frame(check_rig.hello(rng.randrange(2**32))), 0
    if choice < 0.65:
        return check_rig.frame(check_rig.hello(rng.randrange(2**32), version=2)), sequence
    if choice < 0.7:
        old = (sequence - rng.randrange(3)) % 2**32
        return check_rig.frame(check_rig.command(old, (0,) * axes)), sequence
    return damaged(rng, sequence + 1, axes), sequence


def compared(native, fake_rig, axes, seconds, rng):
    """Talks to both for so long; returns the steps in which both answered in time, or nothing where they differ."""
    with tempfile.TemporaryDirectory() as folder:
        links = [os.path.join(folder, name) for name in ("native", "fake")]
        fake = [fake_rig, "--pty", links[1], "--firmware-name", "native 0.2.0", "--buttons", "1", "--hand", "free", "--axes", str(axes)]
        devices = [Device([native, links[0], str(axes), "rest"], links[0]), Device(fake, links[1])]
        end = time.monotonic() + seconds
        steps, skipped, sequence, history = 0, 0, 0, []
        is_known, fed = False, 0.0
        try:
            while time.monotonic() < end:
                greeting = check_rig.frame(check_rig.hello(rng.randrange(2**32))), 0
                sent, following = next_bytes(rng, sequence, axes) if is_known else greeting
                began = time.monotonic()
                if DOUBTFUL_S[0] < began - fed < DOUBTFUL_S[1]:
                    sent, following = greeting
                if following != sequence or following == 0:
                    fed = began
                sequence = following
                history.append(sent.hex())
                for device in devices:
                    device.forget()
                    device.line.send(sent)
                for _ in range(TRIES):
                    for device in devices:
                        device.listen(SETTLE_S / 2)
                    outcomes = [device.outcome() for device in devices]
                    if outcomes[0] == outcomes[1]:
                        break
                is_known = time.monotonic() - began <= HELD_UP_S
                if not is_known:
                    skipped += 1
                elif outcomes[0] != outcomes[1]:
                    print(f"FAULT {axes} axes, after {steps} steps native and fake-rig differ:", *outcomes, "last lines:", *history[-3:], sep="\n")
                    return None
                else:
                    steps += 1
        finally:
            for device in devices:
                device.run.kill()
                device.run.wait(5)
    print(f"ok    {axes} axes: {steps} steps alike, {skipped} skipped on a busy machine")
    return steps


def main():
    native, fake_rig = sys.argv[1:3]
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10
    rng = random.Random(int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    return 0 if all(compared(native, fake_rig, axes, seconds / 2, rng) for axes in (1, 2)) else 1


if __name__ == "__main__":
    sys.exit(main())
