#!/usr/bin/env python3
"""Holds a rig's firmware against docs/device-protocol.md, over a serial line:

    ./check_rig.py /dev/ttyACM0
    ./check_rig.py /dev/ttyACM0 --push 0.5

It commands 0 N unless it is told to push; then the handle has to be free to move. Otherwise leave the handle at rest.
It needs nothing but Python. Exit code: 0 where all is as the protocol wants it, 1 where it is not, 2 where it could not be
tried.
"""

import argparse
import fcntl
import os
import random
import select
import struct
import sys
import termios
import threading
import time
import tty
import zlib
from collections import deque, namedtuple

VERSION = 1
HELLO, SAMPLE, WIDE_SAMPLE, ACKNOWLEDGE, ERROR = 0x01, 0x02, 0x03, 0x04, 0x05
HOST_HELLO, COMMAND, ENABLE = 0x11, 0x12, 0x13
# By kind, with one axis; and what a second axis appends.
LENGTHS = {HELLO: 48, SAMPLE: 20, WIDE_SAMPLE: 28, ACKNOWLEDGE: 8, ERROR: 8}
SECOND_AXIS = {HELLO: 8, SAMPLE: 4, WIDE_SAMPLE: 12}
MAX_FRAME = 62
# The host refuses a device whose clock is further off than this over 100 ms, and a stamp that is further off than that
# from where it should be.
CLOCK_TOLERANCE = 0.05
STALE_MS = 20

# counts_per_metre, force_limit_mn and count: one for each axis.
Hello = namedtuple("Hello", "nonce counts_per_metre force_limit_mn rate_hz watchdog_ms buttons wide firmware axes unit")
Sample = namedtuple("Sample", "enabled bitten buttons sequence time_us count command")
Acknowledge = namedtuple("Acknowledge", "refused sequence")
Error = namedtuple("Error", "version code detail")
# Codes of an error: with the first the motor stays on; the others and what is wrong.
BAD_MESSAGE = 1
ERRORS = {2: "the position sensor fails, or the handle moved faster than it can follow", 3: "the motor or its amplifier", 255: "other"}
# What the quadrature encoder of the ATmega328P's firmware follows, counts a second.
QUADRATURE_COUNTS_PER_S = 80_000
# A handle that is faster under a push needs a smaller one, m/s or rad/s.
FAST = 0.3


class Fault(Exception):
    """The device does something that the protocol does not allow."""


def expect(condition, complaint):
    if not condition:
        raise Fault(complaint)


def stuff(data):
    """COBS, with the zero that ends the frame."""
    out, group = bytearray(), bytearray()
    for byte in data + b"\0":
        if byte == 0:
            out.append(len(group) + 1)
            out += group
            group.clear()
        else:
            group.append(byte)
    return bytes(out) + b"\0"


def unstuff(data):
    """Takes COBS out; None where no sender stuffs so."""
    out, at = bytearray(), 0
    while at < len(data):
        end = at + data[at]
        if end > len(data):
            return None
        out += data[at + 1 : end]
        at = end
        if at < len(data):
            out.append(0)
    return bytes(out)


def frame(message, spoil=0):
    return stuff(message + struct.pack("<I", zlib.crc32(message) ^ spoil))


def hello(nonce, version=VERSION):
    return struct.pack("<BBHI", HOST_HELLO, version, 0, nonce)


def command(sequence, forces_mn=(0,), enabled=True, version=VERSION):
    return struct.pack(f"<BBBBI{len(forces_mn)}i", COMMAND, version, enabled, 0, sequence, *forces_mn)


def enable(sequence, on=True):
    return struct.pack("<BBBBII", ENABLE, VERSION, on, 0, sequence, 0)


def read_message(message):
    """A message as a value. Raises Fault where the device may not say such a thing."""
    kind, version = message[0], message[1]
    if kind == ERROR and len(message) == LENGTHS[ERROR]:
        _, _, code, _, detail = struct.unpack("<BBBBI", message)
        return Error(version, code, detail)
    expect(version == VERSION, f"it speaks version {version} of the protocol; this checks version {VERSION}")
    expect(kind in LENGTHS, f"a message of kind {kind:#04x}, which no device sends")
    lengths = [LENGTHS[kind], LENGTHS[kind] + SECOND_AXIS.get(kind, 0)]
    expect(len(message) in lengths, f"a message of kind {kind:#04x} with {len(message)} bytes instead of {lengths[0]}")
    second = message[LENGTHS[kind] :]
    if kind == HELLO:
        _, _, flags, buttons, nonce, counts, limit, rate, watchdog, _, name = struct.unpack("<BBBBIfIIHH24s", message[:48])
        axes = 1 + (flags >> 1 & 1)
        expect(len(message) == lengths[axes - 1], f"a hello of {axes} axes with {len(message)} bytes instead of {lengths[axes - 1]}")
        per_axis = [(counts, limit)] + ([struct.unpack("<fI", second)] if axes > 1 else [])
        name = name.rstrip(b"\0").decode("ascii", "replace")
        return Hello(nonce, *zip(*per_axis), rate, watchdog, buttons, bool(flags & 1), name, axes, "rad" if axes > 1 and flags & 4 else "m")
    if kind in (SAMPLE, WIDE_SAMPLE):
        _, _, flags, buttons, sequence, time_us, count, echo = struct.unpack("<BBBBIIiI", message[:20])
        counts = (count, *struct.unpack("<i", second[:4])) if second else (count,)
        return Sample(bool(flags & 1), bool(flags & 2), buttons, sequence, time_us, counts, echo)
    _, _, refused, _, sequence = struct.unpack("<BBBBI", message)
    return Acknowledge(refused, sequence)


class Stillness:
    """Notices when a processor of this computer stands still: what the device sent meanwhile comes late, or not at all, and
    so does what a simulated device is sent."""

    def __init__(self):
        self.longest_s = 0.0
        processors = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else [None]
        pause_s = max(0.005, len(processors) / 1000)
        for processor in processors:
            threading.Thread(target=self.watch, args=(processor, pause_s), daemon=True).start()

    def watch(self, processor, pause_s):
        if processor is not None:
            # 0 is this thread, not the program.
            os.sched_setaffinity(0, {processor})
        while True:
            before = time.monotonic()
            time.sleep(pause_s)
            self.longest_s = max(self.longest_s, time.monotonic() - before - pause_s)


class Line:
    """The serial line: frames out, messages in."""

    def __init__(self, path, baud):
        self.descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        # The superuser may open it beside hapticd, which holds this lock.
        fcntl.flock(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        tty.setraw(self.descriptor, termios.TCSANOW)
        settings = termios.tcgetattr(self.descriptor)
        settings[4] = settings[5] = getattr(termios, f"B{baud}")
        settings[2] |= termios.CLOCAL | termios.CREAD
        termios.tcsetattr(self.descriptor, termios.TCSANOW, settings)
        self.buffer = b""
        self.damaged = 0

    def send(self, data):
        while data:
            select.select([], [self.descriptor], [])
            data = data[os.write(self.descriptor, data) :]

    def flush(self):
        termios.tcflush(self.descriptor, termios.TCIOFLUSH)
        self.buffer = b""

    def receive(self, timeout_s):
        """The messages that have come; waits for the first bytes."""
        if not select.select([self.descriptor], [], [], timeout_s)[0]:
            return []
        self.buffer += os.read(self.descriptor, 65536)
        *frames, self.buffer = self.buffer.split(b"\0")
        return [message for message in map(self.open, filter(None, frames)) if message is not None]

    def open(self, stuffed):
        message = unstuff(stuffed) if len(stuffed) < MAX_FRAME else None
        if message is None or len(message) < 6 or zlib.crc32(message[:-4]) != struct.unpack("<I", message[-4:])[0]:
            self.damaged += 1
            return None
        return read_message(message[:-4])


class Rig:
    """A conversation with the device."""

    def __init__(self, line, slow=1.0):
        self.line = line
        self.slow = slow
        self.waiting = deque()
        self.sequence = 0
        self.hello = None
        self.error = None

    def listen(self, seconds, until=lambda message: False):
        """Listens for so long, or until a message; returns all that came."""
        came = []
        end = time.monotonic() + seconds
        while True:
            while self.waiting:
                came.append(self.waiting.popleft())
                if until(came[-1]):
                    return came
            left = end - time.monotonic()
            if left <= 0:
                return came
            news = self.line.receive(left)
            self.error = next((m for m in news if isinstance(m, Error) and m.code != BAD_MESSAGE), self.error)
            self.waiting += news

    def listen_long(self, seconds):
        """Listens for so long on the device's clock, more or less."""
        return self.listen(seconds * self.slow)

    def listen_out(self, seconds):
        """Listens until nothing has come for a quarter of a second, and at most for so long; returns all that came."""
        came = []
        end = time.monotonic() + seconds * self.slow
        while time.monotonic() < end and (news := self.listen(0.25 * self.slow, lambda message: True)):
            came += news
        return came

    def wait_for(self, seconds, what, wanted):
        came = self.listen(seconds * self.slow, wanted)
        expect(came and wanted(came[-1]), f"no {what} within {seconds * 1000:.0f} ms")
        return came[-1]

    def say(self, message, spoil=0):
        self.line.send(frame(message, spoil))

    def next(self):
        self.sequence = (self.sequence + 1) % 2**32
        return self.sequence

    def open(self):
        """A hello and its answer. What lay in the line before is dropped."""
        nonce = random.randrange(2**32)
        self.line.flush()
        self.waiting.clear()
        self.say(hello(nonce))
        self.hello = self.wait_for(0.25, "answer to the hello", lambda m: isinstance(m, Hello) and m.nonce == nonce)
        self.sequence = 0
        self.line.damaged = 0
        return self.hello

    def order(self, sequence, enabled=True, version=VERSION):
        """A command of no force, for as many axes as the device has."""
        return command(sequence, (0,) * self.hello.axes, enabled, version)

    def command(self, force_mn=0, enabled=True, axis=0):
        forces_mn = tuple(force_mn if other == axis else 0 for other in range(self.hello.axes))
        self.say(command(self.next(), forces_mn, enabled))

    def sample(self, what, wanted, seconds=0.2):
        return self.wait_for(seconds, what, lambda m: isinstance(m, Sample) and wanted(m))

    def echoed(self, what="echo of the command"):
        return self.sample(what, lambda s: s.command == self.sequence)

    def enable(self, on=True):
        self.say(enable(self.next(), on))
        answer = self.wait_for(0.1, "acknowledge of the enable", lambda m: isinstance(m, Acknowledge))
        expect(answer.sequence == self.sequence, f"it acknowledges {answer.sequence} instead of {self.sequence}")
        expect(not answer.refused, "it refuses to enable the motor")
        if on:
            self.sample("sample with the motor enabled", lambda s: s.enabled, 0.1)
        else:
            self.expect_off("an enable(off)")

    def expect_off(self, after):
        """The motor is off, and not by the watchdog: commands feed that meanwhile, and must not switch the motor on either."""
        first = self.sequence + 1
        known = []
        # What was sent comes back late where this computer is busy.
        for _ in range(10):
            known += [s for s in self.hold(0.1) if isinstance(s, Sample) and 0 <= (s.command - first) % 2**32 < 2**31]
            if known:
                break
        expect(known, f"no samples after {after}")
        expect(not any(s.enabled for s in known), f"{after} leaves the motor enabled")

    def hold(self, seconds, force_mn=0, axis=0):
        """Commands a force on an axis about each millisecond; returns what came meanwhile."""
        came = []
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.command(force_mn, axis=axis)
            came += self.listen(0.001)
        return came


def steps(first, last):
    """Counts between two positions, which wrap around."""
    return (last - first + 2**31) % 2**32 - 2**31


def elapsed_ms(first, last):
    """Time between two samples on the device's clock; negative where that runs backwards."""
    return ((last.time_us - first.time_us + 2**31) % 2**32 - 2**31) / 1000


def says_who_it_is(rig):
    """answers a hello"""
    answer = rig.open()
    for counts, limit in zip(answer.counts_per_metre, answer.force_limit_mn):
        expect(1 <= counts <= 1e10, f"{counts} counts to a {answer.unit}")
        expect(limit > 0, "a motor without a force: hapticd does not engage it")
    expect(10 <= answer.rate_hz <= 100_000, f"{answer.rate_hz} samples a second")
    expect(1 <= answer.watchdog_ms <= 200, f"a watchdog of {answer.watchdog_ms} ms, where 1 to 200 are allowed")
    force = "N" if answer.unit == "m" else "N m"
    shown = [
        f"{counts:.0f} counts/{answer.unit}, {limit / (1000 if force == 'N' else 1e6)} {force}"
        for counts, limit in zip(answer.counts_per_metre, answer.force_limit_mn)
    ]
    fastest_mps = QUADRATURE_COUNTS_PER_S / answer.counts_per_metre[0]
    follows = f", follows up to {fastest_mps:.2g} m/s" if answer.firmware.startswith("hapkit") and " quad" in answer.firmware else ""
    return f"{answer.firmware}: {', second axis '.join(shown)}, {answer.rate_hz} Hz{follows}"


def counts_its_samples(rig):
    """sends every sample, with sequence and time"""
    rate = rig.open().rate_hz
    samples = []
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        rig.command(enabled=False)
        samples += [message for message in rig.listen(0.1) if isinstance(message, Sample)]
    expect(len(samples) > 2, "no samples")
    expect(all(len(s.count) == rig.hello.axes for s in samples), f"samples that are not of {rig.hello.axes} axes, as the hello says")
    for index, sample in enumerate(samples):
        expect(sample.sequence == index, f"sample {index} after the hello has the sequence {sample.sequence}")
        expect(not sample.enabled, "the motor is enabled after a hello")
    steps = [elapsed_ms(*pair) for pair in zip(samples, samples[1:])]
    expect(min(steps) >= 0, f"the clock runs backwards, by {-min(steps):.3f} ms from one sample to the next")
    expect(min(steps) > 0, "the clock stands still: two samples with the same time stamp")
    expect(max(steps) < STALE_MS + 2000 / rate, f"the clock jumps by {max(steps):.3f} ms from one sample to the next")
    mean = sum(steps) / len(steps)
    expect(abs(mean * rate / 1000 - 1) < 0.01, f"a sample each {mean:.4f} ms, where {rate} Hz were promised")
    expect(rig.line.damaged == 0, f"{rig.line.damaged} damaged frames")
    return f"{len(samples)} samples, one each {mean:.4f} ms, {min(steps):.3f} to {max(steps):.3f}"


def keeps_time(rig):
    """has a clock that goes as fast as this computer's"""
    rate = rig.open().rate_hz
    came = []
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        rig.command(enabled=False)
        news = [message for message in rig.listen(0.5 / rate) if isinstance(message, Sample)]
        # Of those that came at once only the newest tells when it was sent.
        came += [(time.monotonic(), news[-1])] if news else []
    expect(len(came) > 10, "no samples")
    # Samples may come late, never early: of the first and of the last third, those that were quickest are compared.
    late = [(arrived * 1000 - elapsed_ms(came[0][1], sample), arrived, sample) for arrived, sample in came]
    third = len(late) // 3
    first, last = min(late[:third], key=lambda one: one[0]), min(late[-third:], key=lambda one: one[0])
    speed = elapsed_ms(first[2], last[2]) / ((last[1] - first[1]) * 1000)
    expect(speed <= 1 + CLOCK_TOLERANCE, f"its clock runs at {speed:.3f} times the speed of this computer's")
    # A simulated rig may be slower than time itself, and its clock with it.
    expect(speed >= (1 - CLOCK_TOLERANCE) / rig.slow, f"its clock runs at {speed:.3f} times the speed of this computer's")
    return f"{(speed - 1) * 1e6:+.0f} ppm in {elapsed_ms(first[2], last[2]) / 1000:.2f} s"


def keeps_its_origin(rig):
    """goes on counting from where it was when it is greeted and enabled"""
    rig.open()
    before = rig.sample("sample", lambda s: True).count
    rig.open()
    greeted = rig.sample("sample", lambda s: True).count
    rig.enable()
    enabled = rig.sample("sample with the motor enabled", lambda s: s.enabled).count
    rig.enable(False)
    for what, count in (("a hello", greeted), ("an enable", enabled)):
        for now, then, scale in zip(count, before, rig.hello.counts_per_metre):
            moved = steps(then, now) / scale * 1000
            expect(abs(moved) < 1, f"{what} moves the position by {moved:.1f} m{rig.hello.unit}; was the handle at rest?")
    shown = ", ".join(map(str, before))
    return f"it stands at {shown}" if any(before) else f"it stands at {shown}, so a reset to 0 could not be seen"


def begins_anew(rig):
    """begins anew with each hello"""
    rig.open()
    rig.enable()
    rig.command()
    rig.echoed()
    rig.open()
    first = rig.sample("sample", lambda s: True)
    expect(first.sequence == 0, f"the first sample has the sequence {first.sequence}")
    expect(first.command == 0, f"it still knows command {first.command}")
    expect(not first.enabled, "the motor is still enabled")
    rig.command()
    rig.echoed("echo of the sequence begun anew")


def says_what_it_has_heard(rig):
    """gives back the sequence of the newest command"""
    rig.open()
    for _ in range(20):
        rig.command(enabled=False)
        rig.echoed()
    first = rig.sequence
    rig.say(rig.order(first + 1000, enabled=False))
    rig.sample("echo after a gap", lambda s: s.command == first + 1000)
    rig.sequence = first + 1000
    rig.enable()
    sample = rig.sample("sample with the motor enabled", lambda s: s.enabled)
    expect(sample.command == first + 1000, "an enable is counted as a command")


def enables_and_disables(rig):
    """enables the motor, and no longer"""
    rig.open()
    rig.enable()
    rig.command()
    rig.echoed()
    rig.enable(False)
    rig.enable()
    rig.command(enabled=False)
    expect(not rig.echoed().enabled, "a command without 'enabled' leaves the motor on")
    rig.expect_off("a command without 'enabled'")


def takes_a_second_enable(rig):
    """takes a second enable as it took the first"""
    watchdog_s = rig.open().watchdog_ms / 1000
    rig.enable()
    rig.command()
    rig.echoed()
    # Twice three fifths of what the watchdog allows: each enable gives it all of its time again, and neither switches the
    # motor off.
    for _ in range(2):
        rig.listen(0.6 * watchdog_s)
        rig.enable()
    last = rig.sample("sample", lambda s: True)
    expect(last.enabled, "a second enable switches the motor off, or does not feed the watchdog")
    rig.sample("watchdog's bite after an enable without a command", lambda s: s.bitten)
    rig.enable()
    rig.enable(False)


def has_a_watchdog(rig):
    """switches the motor off when no command comes any more"""
    watchdog_ms = rig.open().watchdog_ms
    rig.enable()
    came = rig.hold(0.2)
    expect(all(m.enabled for m in came if isinstance(m, Sample)), "the motor goes off while commands come")
    echoes = [m for m in came if isinstance(m, Sample) and m.command == rig.sequence]
    last = echoes[0] if echoes else rig.echoed("echo of the last command")
    off = rig.sample("sample with the motor off", lambda s: not s.enabled, 0.15 + watchdog_ms / 1000)
    after = elapsed_ms(last, off)
    expect(
        0.9 * watchdog_ms <= after <= watchdog_ms + 1 + 2000 / rig.hello.rate_hz,
        f"the motor went off {after:.1f} ms after the last command, where {watchdog_ms} ms were promised",
    )
    expect(off.bitten, "the watchdog leaves no mark")
    rig.command()
    again = rig.echoed()
    expect(not again.enabled and again.bitten, "a command brings the motor back after the watchdog")
    rig.say(enable(rig.next(), False))
    rig.wait_for(0.1, "acknowledge of an enable(off)", lambda m: isinstance(m, Acknowledge) and m.sequence == rig.sequence)
    expect(rig.sample("sample", lambda s: True).bitten, "an enable(off) takes the watchdog's mark away, and with it why the motor is off")
    rig.enable()
    rig.sample("sample without the mark", lambda s: s.enabled and not s.bitten)
    rig.sample("second bite, after an enable without a command", lambda s: s.bitten, 0.15 + watchdog_ms / 1000)
    return f"after {after:.1f} ms"


def refuses(rig):
    """refuses what is damaged, old, foreign or unknown, and does not let it feed the watchdog"""
    watchdog_ms = rig.open().watchdog_ms
    rig.command(enabled=False)
    rig.echoed()
    cases = {
        "a wrong CRC": lambda newest: frame(rig.order(newest + 1), spoil=1),
        "another version": lambda newest: frame(rig.order(newest + 1, version=VERSION + 1)),
        "an unknown kind": lambda newest: frame(struct.pack("<BBHII", 0x77, VERSION, 0, newest + 1, 0)),
        "a command that is too long": lambda newest: frame(rig.order(newest + 1) + b"\0"),
        "a command that is too short": lambda newest: frame(rig.order(newest + 1)[:-1]),
        "a command for another number of axes": lambda newest: frame(command(newest + 1, (0,) * (3 - rig.hello.axes))),
        "the same sequence": lambda newest: frame(rig.order(newest)),
        "an old sequence": lambda newest: frame(rig.order(newest - 1)),
        "a sequence from half way round": lambda newest: frame(rig.order(newest + 2**31)),
        "a sample sent back": lambda newest: frame(struct.pack("<BBBBIIiI", SAMPLE, VERSION, 1, 0, newest + 1, 0, 0, 0)),
    }
    for what, spoiled in cases.items():
        newest = rig.sequence
        rig.enable()
        began = rig.sample("sample", lambda s: True)
        bitten = None
        for _ in range(150 + watchdog_ms):
            rig.line.send(spoiled(rig.sequence))
            samples = [m for m in rig.listen(0.001) if isinstance(m, Sample)]
            expect(all(s.command == newest for s in samples), f"{what}: it was taken")
            bitten = next((s for s in samples if s.bitten), None)
            if bitten:
                break
        expect(bitten, f"{what}: it feeds the watchdog")
        expect(elapsed_ms(began, bitten) <= watchdog_ms + 5, f"{what}: the motor went off after {elapsed_ms(began, bitten):.1f} ms")
        # What was refused has not become the newest.
        rig.command(enabled=False)
        rig.echoed(f"echo after {what}")


def goes_on(rig):
    """lets nothing that it does not know take the motor away"""
    rig.open()
    rig.enable()
    rig.hold(0.02)
    reported = 0
    for what, message in {
        "another version": rig.order(rig.sequence + 1, version=VERSION + 1),
        "an unknown kind": struct.pack("<BB", 0x77, VERSION),
        "a wrong length": enable(rig.sequence + 1) + b"\0",
    }.items():
        rig.say(message)
        came = rig.hold(0.02)
        errors = [m for m in came if isinstance(m, Error)]
        expect(len(errors) <= 1 and all(m.code == 1 for m in errors), f"{what}: {errors} instead of one error with code 1")
        reported += bool(errors)
        expect(all(m.enabled for m in came if isinstance(m, Sample)), f"{what}: the motor went off")
    rig.command(enabled=False)
    return f"tells {reported} of 3 as errors"


def comes_back_into_step(rig):
    """is in step again after the next zero"""
    rig.open()
    noise = random.Random(1)
    for _ in range(100):
        choice = noise.randrange(4)
        if choice == 0:
            rig.line.send(bytes(noise.randrange(1, 256) for _ in range(noise.randrange(1, 200))))
        elif choice == 1:
            rig.line.send(frame(rig.order(7777))[: noise.randrange(1, 17)])
        elif choice == 2:
            rig.line.send(bytes(noise.randrange(1, 8)))
        else:
            damaged = bytearray(frame(rig.order(7777)))
            damaged[noise.randrange(len(damaged) - 1)] ^= 1 << noise.randrange(8)
            rig.line.send(bytes(damaged))
        rig.line.send(b"\0")
        # Noise may fill a small buffer, and with it what comes right behind: a host repeats its command too.
        first = rig.sequence + 1
        for tries_left in (2, 1, 0):
            rig.command(enabled=False)
            came = rig.listen(0.05 * rig.slow, lambda m: isinstance(m, Sample) and first <= m.command <= rig.sequence)
            if came and isinstance(came[-1], Sample) and first <= came[-1].command <= rig.sequence:
                break
            expect(tries_left, "no echo of three commands after noise")


def counts_around(rig):
    """follows a sequence that wraps around"""
    rig.open()
    for sequence in (0x7FFFFFFF, 0xFFFFFFFE, 0xFFFFFFFF, 0, 1):
        rig.say(rig.order(sequence, enabled=False))
        rig.sample(f"echo of {sequence:#x}", lambda s: s.command == sequence)


def falls_silent(rig):
    """falls silent a second after the last message"""
    rig.open()
    rig.command(enabled=False)
    echo = rig.echoed()
    samples = [echo, *(m for m in rig.listen_out(1.5) if isinstance(m, Sample))]
    if elapsed_ms(echo, samples[-1]) < 950:
        # A simulated rig may have stood still.
        samples += (m for m in rig.listen_long(1.5) if isinstance(m, Sample))
    after = elapsed_ms(echo, samples[-1])
    expect(950 <= after <= 1050, f"the last sample came {after:.0f} ms after the last message")
    rig.say(rig.order(rig.next()))
    expect(not rig.listen_long(0.2), "it speaks without having been asked")
    return f"after {after:.0f} ms"


def keeps_to_its_version(rig):
    """does not open a conversation with a host of another version"""
    rig.listen_out(1.2)
    rig.say(hello(1, version=VERSION + 1))
    came = rig.listen_long(0.25)
    expect(all(isinstance(m, Error) and m.code == 1 for m in came), f"a hello of version {VERSION + 1} opens the conversation")
    return "says which it speaks" if came else "says nothing"


def pushes(rig, force_n):
    """counts upwards where a positive force pulls, each axis by itself"""
    axes, limits_mn = rig.open().axes, rig.hello.force_limit_mn
    expect(1000 * force_n <= min(limits_mn), f"{force_n} N are beyond its {min(limits_mn) / 1000} N")
    results = []
    rest = [m for m in rig.hold(0.15) if isinstance(m, Sample)]
    for axis in range(axes):
        # What it moves by itself shows no direction, nor does the last count of the encoder.
        clear = max(4, 2 * abs(steps(rest[0].count[axis], rest[-1].count[axis])))
        moved, seen, fault = {}, [], None
        for sign in (1, -1):
            samples = []
            try:
                rig.enable()
                samples = [m for m in rig.hold(0.15, round(sign * force_n * 1000), axis) if isinstance(m, Sample)]
                expect(samples, "no samples while it pushes")
                seen += samples
                rig.enable(False)
                rig.hold(0.5)
            except Fault as why:
                fault = why
            if fault or rig.error or not all(s.enabled for s in samples):
                moves = [(abs(steps(a.count[axis], b.count[axis])), elapsed_ms(a, b)) for a, b in zip(seen, seen[1:])]
                speed = max((1000 * count / ms for count, ms in moves if ms > 0), default=0) / rig.hello.counts_per_metre[axis]
                advice = f": it runs at {speed:.1f} {rig.hello.unit}/s, push less" if speed > FAST else ""
                watchdog = " by its watchdog" if any(s.bitten for s in samples) else ""
                raise Fault(f"{fault or 'the motor went off' + watchdog}{advice}")
            moved[sign] = [steps(first, last) for first, last in zip(samples[0].count, samples[-1].count)]
        shown = ", ".join(f"{sign * force_n:+g} N: {counts[axis]:+} counts" for sign, counts in moved.items())
        if axes > 1:
            shown = f"axis {axis + 1}, {shown}"
        strokes = [up - down for up, down in zip(moved[1], moved[-1])]
        other = abs(strokes[1 - axis]) if axes > 1 else 0
        expect(other <= abs(strokes[axis]), f"{shown}, but the other axis moves by {other}: swap the plugs of the two encoders or motors")
        expect(abs(strokes[axis]) >= clear, f"{shown}: less than {clear} counts apart show no direction: let go of the handle, or push harder")
        expect(strokes[axis] > 0, f"{shown}: swap the motor's or the encoder's wires, or set MOTOR_REVERSED the other way")
        results.append(shown)
    return "; ".join(results)


CHECKS = [
    says_who_it_is,
    counts_its_samples,
    keeps_time,
    keeps_its_origin,
    begins_anew,
    says_what_it_has_heard,
    enables_and_disables,
    takes_a_second_enable,
    has_a_watchdog,
    refuses,
    goes_on,
    comes_back_into_step,
    counts_around,
    falls_silent,
    keeps_to_its_version,
]


def wait_for_the_board(rig):
    """Opening the port resets an Arduino; its boot loader takes up to two seconds."""
    for _ in range(20):
        try:
            return rig.open()
        except Fault:
            pass
    raise Fault("no device answers")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("port")
    parser.add_argument("--baud", type=int, default=1_000_000)
    parser.add_argument("--push", type=float, metavar="N", help="also pull the handle to and fro with so many newtons")
    parser.add_argument("--slow", type=float, default=1.0, metavar="N", help="wait N times as long for everything: for a rig in simulation")
    parser.add_argument("--only", metavar="NAME", help="one check: " + ", ".join(check.__name__ for check in CHECKS))
    options = parser.parse_args()
    names = [check.__name__ for check in CHECKS]
    if options.only not in (None, *names):
        parser.error(f"--only {options.only}: no such check; there are {', '.join(names)}")
    if not hasattr(termios, f"B{options.baud}"):
        known = sorted(int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit() and name != "B0")
        parser.error(f"--baud {options.baud}: this machine has {', '.join(map(str, known))}")
    if options.push is not None and not options.push > 0:
        parser.error(f"--push {options.push:g}: a force above 0 N is wanted; it pulls either way")
    try:
        rig = Rig(Line(options.port, options.baud), options.slow)
        wait_for_the_board(rig)
    except BlockingIOError:
        print(f"{options.port}: another program has it open, as hapticd would: end it first")
        return 2
    except (OSError, termios.error, Fault) as error:
        print(f"{options.port}: {error}")
        return 2
    checks = [(check.__doc__, lambda check=check: check(rig)) for check in CHECKS if options.only in (None, check.__name__)]
    if options.push:
        checks.append((pushes.__doc__, lambda: pushes(rig, options.push)))
    failures = 0
    stillness = Stillness()
    for name, check in checks:
        stillness.longest_s, rig.error = 0.0, None
        try:
            note = check()
            print(f"ok    it {name}" + (f" ({note})" if note else ""), flush=True)
        except Fault as fault:
            failures += 1
            still_ms = 1000 * stillness.longest_s
            # Samples are counted for a second, of which a hundredth is 10 ms; a watcher sees a stop but for its own pause.
            excuse = f"; this computer stood still for {still_ms:.0f} ms meanwhile, try again" if still_ms > 5 else ""
            if rig.error:
                part = ERRORS.get(rig.error.code, "unknown")
                excuse = f"; the device reports an error: code {rig.error.code} ({part}), detail {rig.error.detail}"
            print(f"FAULT it {name}: {fault}{excuse}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
