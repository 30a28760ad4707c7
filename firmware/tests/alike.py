#!/usr/bin/env python3
"""Says the same bytes to the native board and to fake-rig, damaged frames included, and compares what they answer.

    tests/alike.py NATIVE FAKE_RIG [SECONDS [SEED]]

Both are programs. Equal must be each hello, acknowledge and error, byte for byte, and of the newest sample its length,
flags and newest command, once both have taken what was said. A complaint about a message (code 1) is any device's choice.
Exit code 1 where they differ."""

import os
import random
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import check_rig  # noqa: E402

# Long enough for both to answer, and short enough for the watchdog.
SETTLE_S = 0.008
# Beyond this, the watchdog of one of them may have acted, and of the other not.
HELD_UP_S = 0.03


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
        elif message[0] != check_rig.ERROR or message[2] != 1:
            self.answers.append(message.hex())

    def listen(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.line.receive(left)

    def told(self):
        told = self.answers, self.newest
        self.answers, self.newest = [], None
        return told


def damaged(rng, sequence):
    """Bytes that no device may take, or only as a complaint."""
    whole = check_rig.frame(check_rig.command(sequence))
    choice = rng.randrange(9)
    if choice == 0:
        return check_rig.frame(check_rig.command(sequence), spoil=1 << rng.randrange(32))
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
        return check_rig.frame(check_rig.command(sequence, version=2))
    if choice == 6:
        return check_rig.frame(check_rig.command(sequence)[: rng.randrange(2, 12)])
    if choice == 7:
        return check_rig.frame(bytes([rng.choice((1, 2, 4, 5))]) + check_rig.command(sequence)[1:])
    return bytes(rng.randrange(1, 5))


def said(rng, sequence):
    """What the host says next, and its newest sequence then."""
    choice = rng.random()
    if choice < 0.4:
        return check_rig.frame(check_rig.command(sequence + 1, (rng.choice((0, 300, -300)),), rng.random() < 0.9)), sequence + 1
    if choice < 0.55:
        return check_rig.frame(check_rig.enable(sequence + 1, rng.random() < 0.8)), sequence + 1
    if choice < 0.6:
        return check_rig.frame(check_rig.hello(rng.randrange(2**32))), 0
    if choice < 0.65:
        return check_rig.frame(check_rig.hello(rng.randrange(2**32), version=2)), sequence
    if choice < 0.7:
        old = (sequence - rng.randrange(3)) % 2**32
        return check_rig.frame(check_rig.command(old)), sequence
    return damaged(rng, sequence + 1), sequence


def main():
    native, fake_rig = sys.argv[1:3]
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10
    rng = random.Random(int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    with tempfile.TemporaryDirectory() as folder:
        links = [os.path.join(folder, name) for name in ("native", "fake")]
        fake = [fake_rig, "--pty", links[1], "--firmware-name", "native 0.2.0", "--buttons", "1", "--hand", "free"]
        devices = [Device([native, links[0], "1", "rest"], links[0]), Device(fake, links[1])]
        end = time.monotonic() + seconds
        compared, skipped, sequence, history = 0, 0, 0, []
        is_known = False
        try:
            while time.monotonic() < end:
                bytes_said, sequence = said(rng, sequence) if is_known else (check_rig.frame(check_rig.hello(rng.randrange(2**32))), 0)
                history.append(bytes_said.hex())
                began = time.monotonic()
                for device in devices:
                    device.line.send(bytes_said)
                for device in devices:
                    device.listen(SETTLE_S / 2)
                told = [device.told() for device in devices]
                if time.monotonic() - began > HELD_UP_S:
                    skipped += 1
                    is_known = False
                    continue
                is_known = True
                if told[0] != told[1]:
                    print(f"FAULT after {compared} steps, native and fake-rig differ:", *told, "last said:", *history[-3:], sep="\n")
                    return 1
                compared += 1
        finally:
            for device in devices:
                device.run.kill()
                device.run.wait(5)
    print(f"ok    {compared} steps alike, {skipped} skipped on a busy machine")
    return 0


if __name__ == "__main__":
    sys.exit(main())
