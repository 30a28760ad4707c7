#!/usr/bin/env python3
"""Holds the library against a model of docs/device-protocol.md, in random conversations.

    tests/property.py LIBRARY.so [CONVERSATIONS]

The board around the library, its time, line, motors and timer, is here; so a conversation of seconds takes a millisecond.
Each is held with one and two axes, on a serial line or HID, with samples and wide ones, written whole or in parts. Exit
code 1 where they differ."""

import ctypes as c
import os
import random
import re
import struct
import sys

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, ".."))
from check_rig import COMMAND, ENABLE, ERROR, HELLO, HOST_HELLO, SAMPLE, WIDE_SAMPLE, frame, hello, unstuff  # noqa: E402

LIMIT_MN = (5000, 4000)
WATCHDOG_US, SILENCE_US, TICK_US = 50_000, 1_000_000, 1000
# Of each axis: count, force of the hand, acceleration.
MEASURED = ((-2, 2500, -9810), (9, -100, 40))
BUTTONS = 2


class Sample(c.Structure):
    _fields_ = [
        ("time_us", c.c_uint32),
        ("count", c.c_int32 * 2),
        ("hand_force_mn", c.c_int32 * 2),
        ("acceleration_mm_s2", c.c_int32 * 2),
        ("lost", c.c_bool),
    ]


def function(result, *arguments):
    return c.CFUNCTYPE(result, c.c_void_p, *arguments)


BYTES = c.POINTER(c.c_uint8)


class Config(c.Structure):
    _fields_ = [
        ("name", c.c_char_p),
        ("axes", c.c_uint8),
        ("buttons_there", c.c_uint8),
        ("hid", c.c_bool),
        ("wide", c.c_bool),
        ("rotary", c.c_bool),
        ("absolute", c.c_bool),
        ("counts_per_metre", c.c_float * 2),
        ("force_limit_mn", c.c_uint32 * 2),
        ("sample_rate_hz", c.c_uint16),
        ("watchdog_ms", c.c_uint16),
        ("context", c.c_void_p),
        ("clock_us", function(c.c_uint32)),
        ("measure", function(None, c.POINTER(Sample))),
        ("motor_force", function(None, c.POINTER(c.c_int32))),
        ("motor_off", function(None)),
        ("motor_on", function(c.c_bool)),
        ("buttons", function(c.c_uint8)),
        ("read", function(c.c_uint8, BYTES, c.c_uint8)),
        ("write", function(c.c_bool, BYTES, c.c_uint8)),
        ("room", function(c.c_uint8)),
    ]


class Wrong(Exception):
    """The library does what the protocol does not allow."""


def expect(condition, complaint):
    if not condition:
        raise Wrong(complaint)


class Board:
    """What is around the library."""

    def __init__(self, library, axes, rng, hid=False, in_parts=False, has_motor_on=True):
        self.library, self.axes, self.rng, self.hid = library, axes, rng, hid
        self.now = rng.randrange(2**32)
        self.force, self.is_on = [7, 7], True
        self.received, self.reports, self.sent = bytearray(), [], bytearray()
        self.is_full = self.is_lost = self.has_no_timer = self.trips_in_force = self.ticks_in_on = False
        self.stands_at = None
        self.device = (c.c_uint8 * 1024)()
        # Without motor_on nothing but the library keeps the motors off.
        self.has_motor_on, self.capacity = has_motor_on, 2**32
        given = {"motor_on": self.on} if has_motor_on else {}
        given |= {"buttons": lambda _: BUTTONS, "clock_us": self.clock, "measure": self.measure}
        given |= {"motor_force": self.drive, "motor_off": self.off, "read": self.read, "write": self.write}
        if in_parts:
            given["room"] = lambda _: 0 if self.is_full else min(64, self.capacity)
        types = dict(Config._fields_)
        functions = {name: types[name](called) for name, called in given.items()}
        self.config = Config(b"test 1.0", axes, 3, hid, sample_rate_hz=1000, **functions)
        self.config.counts_per_metre[:] = (100_000, 50_000)
        self.config.force_limit_mn[:] = LIMIT_MN
        self.init()

    def init(self):
        self.force = [7, 7]
        expect(self.library.haptic_device_init(self.device, c.byref(self.config)), "init refuses a good config")
        expect(not any(self.force), "init leaves the motors as they were")

    def clock(self, _):
        return (self.now if self.stands_at is None else self.stands_at) % 2**32

    def measure(self, _, sample):
        to = sample.contents
        to.count[:], to.hand_force_mn[:], to.acceleration_mm_s2[:] = zip(*MEASURED)
        to.lost = self.is_lost

    def drive(self, _, force_mn):
        if self.trips_in_force:
            self.tick(60)
        self.force = [force_mn[axis] if (self.is_on or not self.has_motor_on) and axis < self.axes else 0 for axis in range(2)]

    def on(self, _):
        self.is_on = True
        if self.ticks_in_on:
            self.tick(1)
        return True

    def off(self, _):
        self.force, self.is_on = [0, 0], False

    def read(self, _, at, room):
        if self.hid:
            taken = self.reports.pop(0) if self.reports else b""
        else:
            taken = bytes(self.received[:room])
            del self.received[:room]
        for i, byte in enumerate(taken):
            at[i] = byte
        return len(taken)

    def write(self, _, at, length):
        is_taken = not self.is_full and length <= self.capacity
        if is_taken:
            self.sent += bytes(at[:length])
            self.capacity -= length
        return is_taken

    def tick(self, times=1):
        """Time and the timer's interrupt go on, and the loop does not."""
        for _ in range(times):
            self.now += TICK_US
            if not self.has_no_timer:
                self.library.haptic_device_watchdog_from_isr(self.device, TICK_US)

    def poll(self):
        self.library.haptic_device_poll(self.device)
        while self.received or self.reports:
            self.library.haptic_device_poll(self.device)
        self.library.haptic_device_poll(self.device)

    def say(self, message):
        if self.hid:
            self.reports.append(message.ljust(64, b"\0"))
        else:
            self.received += frame(message)

    def answers(self):
        sent, self.sent = bytes(self.sent), bytearray()
        if self.hid:
            return [sent[i : i + 64] for i in range(0, len(sent), 64)]
        return [unstuff(stuffed)[:-4] for stuffed in sent.split(b"\0") if stuffed]

    def order(self, kind, sequence, is_on=True, forces=(0, 0)):
        values = forces[: self.axes] if kind == COMMAND else (0,)
        return struct.pack(f"<BBBBI{len(values)}i", kind, 1, is_on, 0, sequence % 2**32, *values)

    def pull(self):
        """Opens, enables and pulls with 2 N."""
        for message in (hello(1), self.order(ENABLE, 1), self.order(COMMAND, 2, True, (2000, 2000))):
            self.say(message)
            self.poll()


class Model:
    """What the protocol says of the device."""

    def __init__(self, board):
        self.board = board
        self.is_open = self.is_enabled = self.is_tripped = False
        self.newest = self.command = self.received = self.fed = 0
        self.force = (0, 0)

    def live(self):
        """What time does, and a lost position."""
        now = self.board.now
        if self.is_enabled and now - self.fed >= WATCHDOG_US:
            self.is_enabled, self.is_tripped = False, True
        if self.is_open and now - self.received >= SILENCE_US:
            self.is_open = self.is_enabled = False
        if self.board.is_lost:
            self.is_enabled = False

    def hello(self):
        self.is_open, self.is_enabled, self.is_tripped = True, False, False
        self.newest = self.command = 0
        self.received = self.board.now

    def order(self, kind, sequence, is_on, forces):
        if not self.is_open or not 0 < (sequence - self.newest) % 2**32 < 2**31:
            return
        self.newest = sequence % 2**32
        self.fed = self.received = self.board.now
        if kind == COMMAND:
            self.command = self.newest
            self.is_enabled &= is_on
            self.force = tuple(max(-limit, min(limit, force)) for force, limit in zip(forces, LIMIT_MN))
        elif not is_on or self.board.is_lost:
            self.is_enabled = False
        else:
            self.is_enabled, self.is_tripped, self.force = True, False, (0, 0)

    def expect_force(self, when):
        expected = [self.force[axis] if self.is_enabled and axis < self.board.axes else 0 for axis in range(2)]
        expect(self.board.force == expected, f"{when}: the force is {self.board.force} instead of {expected}")

    def expect_sample(self, samples, when):
        expect(bool(samples) == self.is_open, f"{when}: {len(samples)} samples")
        if not samples:
            return
        message, axes = samples[-1], self.board.axes
        is_wide = self.board.config.wide
        _, _, flags, buttons, _, _, count, command = struct.unpack_from("<BBBBIIiI", message)
        expected = self.is_enabled + 2 * self.is_tripped, self.command
        expect((flags, command) == expected, f"{when}: flags and command {flags, command} instead of {expected}")
        expected = [value for measured in MEASURED[:axes] for value in (measured if is_wide else measured[:1])][1:]
        rest = struct.pack(f"<{len(expected)}i", *expected)
        expect((count, buttons) == (MEASURED[0][0], BUTTONS), f"{when}: count {count}, buttons {buttons}")
        expect((message[20 : 20 + len(rest)] if self.board.hid else message[20:]) == rest, f"{when}: {message.hex()}")


class Conversation:
    """Random steps, after each of which board and model agree."""

    STEPS = {
        "go on": 30,
        "command": 40,
        "enable": 6,
        "damage": 8,
        "old": 4,
        "hang": 2,
        "reset": 0.5,
        "hello": 1,
        "lose": 1,
        "full": 1,
        "silence": 0.6,
        "wrap": 0.3,
        "insist": 1,
    }
    DAMAGES = ("crc", "cut", "distance", "version", "long", "kind", "echo")

    def __init__(self, library, axes, seed):
        self.rng = random.Random(seed)
        self.board = Board(library, axes, self.rng, hid=seed % 4 == 3, in_parts=seed % 2 == 0, has_motor_on=seed % 3 == 0)
        self.board.config.wide = seed % 5 == 0
        self.model = Model(self.board)

    def say(self, kind, sequence, is_on=True, forces=(0, 0)):
        self.board.say(self.board.order(kind, sequence, is_on, forces))
        self.model.order(kind, sequence, is_on, forces)

    def hello(self):
        self.board.say(hello(self.rng.randrange(2**32)))
        self.model.hello()

    def damage(self, kind, sequence, forces, damage):
        """Says a message that the device must not take; HID carries no frame, and reports of one length."""
        board, message = self.board, self.board.order(kind, sequence, True, forces)
        if damage in ("crc", "cut", "distance"):
            if not board.hid:
                whole = bytearray(frame(message, spoil=damage != "distance"))
                if damage == "cut":
                    whole[self.rng.randrange(1, 15) : -1] = b""
                elif damage == "distance":
                    # The last one leads beyond the end.
                    at = 0
                    while at + whole[at] < len(whole) - 1:
                        at += whole[at]
                    whole[at] += 1
                board.received += whole
        elif damage == "version":
            board.say(message[:1] + b"\2" + message[2:])
        elif damage == "kind":
            board.say(b"\x77" + message[1:])
        elif damage == "echo":
            board.say(struct.pack("<BBBBIIiI", SAMPLE, 1, 1, 0, sequence % 2**32, 0, 0, 0))
        elif not board.hid:
            board.say(message + bytes(4))

    def step(self, what):
        board, model, rng = self.board, self.model, self.rng
        forces = rng.choice((0, 1500, -1500, 7000, -(2**31), 2**31 - 1)), rng.choice((0, -900, 9000))
        kind = rng.choice((COMMAND, ENABLE))
        if what == "command":
            self.say(COMMAND, model.newest + rng.choice((1, 1, 1, 5)), rng.random() < 0.95, forces)
        elif what == "wrap":
            self.say(COMMAND, model.newest + 2**31 - 1, True, forces)
        elif what == "enable":
            self.say(ENABLE, model.newest + 1, rng.random() < 0.8)
        elif what == "damage":
            self.damage(kind, model.newest + 1, forces, rng.choice(self.DAMAGES))
        elif what == "old":
            self.say(COMMAND, model.newest - rng.choice((0, 1, 2**31)), True, forces)
        elif what == "insist":
            # For longer than the watchdog the host says only what is refused.
            damage = rng.choice((None, *self.DAMAGES))
            for _ in range(60):
                if damage:
                    self.damage(kind, model.newest + 1, forces, damage)
                else:
                    self.say(kind, model.newest, True, forces)
                board.poll()
                board.tick()
                model.live()
        elif what == "hang":
            times = rng.choice((20, 48, 52, 80, 300))
            board.tick(times)
            expect(times < 52 or not any(board.force), f"the loop hung for {times} ms, and the force is {board.force}")
        elif what == "reset":
            if not board.hid:
                board.received += frame(board.order(COMMAND, 9))[: rng.randrange(1, 12)]
                board.poll()
            board.init()
            self.model = model = Model(board)
            self.say(COMMAND, 5, True, (2000, 2000))
            board.poll()
            model.expect_force("after a reset")
            self.hello()
        elif what == "hello":
            self.hello()
        elif what == "lose":
            board.is_lost = not board.is_lost
            board.tick()
            model.live()
        elif what == "full":
            board.is_full = True
        elif what == "silence":
            board.tick(1100)

    def settle(self, when):
        self.board.poll()
        self.model.live()
        self.model.expect_force(when)

    def run(self):
        board = self.board
        self.say(ENABLE, 1)
        self.say(COMMAND, 2, True, (3000, 3000))
        self.settle("before a hello")
        self.hello()
        self.settle("after a hello")
        for _ in range(400):
            what = self.rng.choices(list(self.STEPS), list(self.STEPS.values()))[0]
            self.model.live()
            self.step(what)
            self.settle(f"after {what}")
            board.tick()
            board.is_full = False
            self.settle(f"a tick after {what}")
            board.answers()
            board.tick()
            self.settle(f"two ticks after {what}")
            kind = WIDE_SAMPLE if board.config.wide else SAMPLE
            self.model.expect_sample([m for m in board.answers() if m[0] == kind], f"after {what}")


def document_vectors():
    """The messages and frames of the protocol's page, by kind and length."""
    page = open(os.path.join(here, "../../docs/device-protocol.md"), encoding="utf-8").read()
    found = re.findall(r"message ([0-9a-f ]+)\nframe   ([0-9a-f ]+)\n", page)
    expect(len(found) == 12, f"{len(found)} vectors in the page")
    vectors = [(bytes.fromhex(message), bytes.fromhex(stuffed)) for message, stuffed in found]
    return {(message[0], len(message)): (message, stuffed) for message, stuffed in vectors}


def speaks_as_documented(library):
    """answers the page's own bytes with the page's own bytes"""
    page = document_vectors()
    for axes, force in ((1, [-1500, 0]), (2, [-1500, 700])):
        for in_parts in (False, True):
            board = Board(library, axes, random.Random(0), in_parts=in_parts)
            board.config.name, board.config.buttons_there = (b"demo 1.0", b"demo 2.0")[axes - 1], 1
            board.config.force_limit_mn[:] = (20_000, 10_000)
            board.init()
            expected = page[HELLO, (48, 56)[axes - 1]][1] + page[4, 8][1]
            board.now = board.now // 1000 * 1000
            for key in ((HOST_HELLO, 8), (ENABLE, 12)):
                board.received += page[key][1]
                # No time goes by, so no sample is due.
                while board.received:
                    board.is_full = False
                    board.library.haptic_device_poll(board.device)
            sent = b"".join(part + b"\0" for part in bytes(board.sent).split(b"\0")[:-1] if unstuff(part)[0] != SAMPLE)
            expect(sent == expected, f"{axes} axes: {sent.hex()} instead of {expected.hex()}")
            board.received += page[COMMAND, (12, 16)[axes - 1]][1]
            board.poll()
            expect(board.force == force, f"the page's command gives {board.force}")


def survives_a_trip_while_it_drives(library):
    """the timer trips inside motor_force"""
    board = Board(library, 2, random.Random(0), has_motor_on=False)
    board.say(hello(1))
    board.say(board.order(ENABLE, 1))
    board.poll()
    board.trips_in_force = True
    board.say(board.order(COMMAND, 2, True, (2000, 2000)))
    board.library.haptic_device_poll(board.device)
    expect(not any(board.force), f"the interrupt tripped while the loop drove, and the force is {board.force}")


def is_on_after_an_interrupt_while_it_enables(library):
    """the timer's interrupt comes right behind motor_on, and must not undo it"""
    board = Board(library, 1, random.Random(0))
    board.ticks_in_on = True
    board.pull()
    expect(any(board.force), "an interrupt in the middle of an enable leaves the motors off, and enabled")


def trips_without_a_clock(library):
    """the board's clock stands still, and the host falls silent"""
    board = Board(library, 1, random.Random(0))
    board.pull()
    expect(any(board.force), "no force")
    board.stands_at = board.now
    for _ in range(51):
        board.tick()
        board.poll()
    expect(not any(board.force), "the clock stands still, the host is silent, and the force stays")


def trips_without_a_timer(library):
    """poll is the only guard"""
    board = Board(library, 1, random.Random(0))
    board.has_no_timer = True
    board.pull()
    for _ in range(51):
        board.tick()
        board.poll()
    expect(not any(board.force), "without the timer, poll does not end the force")


def tells_why_it_is_off(library):
    """a lost position is reported although a bad message comes before the line takes it; nothing is reported after silence"""
    board = Board(library, 1, random.Random(0))
    board.pull()
    board.answers()
    board.is_full = board.is_lost = True
    board.tick()
    board.poll()
    board.say(b"\x77\1")
    board.poll()
    board.is_full = False
    board.poll()
    codes = [m[2] for m in board.answers() if m[0] == ERROR]
    expect(codes[:1] == [2], f"errors {codes} where the position is lost")
    board.is_full = True
    board.say(board.order(ENABLE, 9))
    board.poll()
    board.tick(1100)
    board.poll()
    board.is_full = False
    board.poll()
    expect(not board.sent, "it speaks although it is silent")


def waits_with_a_frame_for_room(library):
    """a line with room for a sample and not for a hello gets neither half a hello nor a sample before it"""
    for in_parts in (False, True):
        board = Board(library, 1, random.Random(0), in_parts=in_parts)
        board.capacity = 40
        board.say(hello(1))
        for _ in range(5):
            board.poll()
            board.tick()
        expect(not board.sent, f"it sends {board.sent.hex()} before its hello")
        board.capacity = 2**32
        board.poll()
        board.tick()
        board.poll()
        expect([m[0] for m in board.answers()][:2] == [HELLO, SAMPLE], "no hello once there is room")


def refuses_a_wrong_config(library):
    """init looks at the config"""
    board = Board(library, 1, random.Random(0))
    for name, value in (("axes", 0), ("axes", 3), ("watchdog_ms", 201), ("sample_rate_hz", 9), ("sample_rate_hz", 20_001)):
        before = getattr(board.config, name)
        setattr(board.config, name, value)
        expect(not library.haptic_device_init(board.device, c.byref(board.config)), f"init takes {name} = {value}")
        setattr(board.config, name, before)
    for counts in (0.5, -1.0, 2e10, float("nan"), float("inf")):
        board.config.counts_per_metre[0] = counts
        expect(not library.haptic_device_init(board.device, c.byref(board.config)), f"init takes {counts} counts a metre")


CASES = [
    speaks_as_documented,
    survives_a_trip_while_it_drives,
    is_on_after_an_interrupt_while_it_enables,
    trips_without_a_clock,
    trips_without_a_timer,
    tells_why_it_is_off,
    waits_with_a_frame_for_room,
    refuses_a_wrong_config,
]


def main():
    library = c.CDLL(os.path.abspath(sys.argv[1]))
    library.haptic_device_init.restype = c.c_bool
    library.haptic_device_watchdog_from_isr.argtypes = (c.c_void_p, c.c_uint16)
    conversations = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    try:
        for case in CASES:
            case(library)
        for seed in range(conversations):
            for axes in (1, 2):
                try:
                    Conversation(library, axes, seed).run()
                except Wrong as wrong:
                    raise Wrong(f"conversation {seed}, {axes} axes, {wrong}") from None
    except Wrong as wrong:
        print("FAULT", wrong)
        return 1
    print(f"ok    {len(CASES)} cases, {conversations} conversations of one and of two axes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
