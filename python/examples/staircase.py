"""A staircase: which difference of stiction does a person feel?

Each trial gives two surfaces, one after the other, and asks which is stickier. After two right answers in a row the
difference shrinks, after a wrong one it grows (2-down, 1-up: Levitt 1971), so that it settles where 71 % of the answers
are right. The surfaces of a trial are scheduled: each comes in at its tick, and the samples show what was felt from
there.

    python examples/staircase.py                    # asks you, with the rig that haptic-ctl finds
    python examples/staircase.py --simulated        # a simulated observer on a simulated rig: some minutes

With PsychoPy, show `visual.TextStim` in `announce`, and read `event.waitKeys` in `asked`.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import random
import statistics
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass

import hapticd

STANDARD_N = 4.0
"""Stiction of the standard surface, N."""

FIRST_DIFFERENCE_N = 2.0
PAUSE_S = 0.3
"""Time before the first surface of a trial, s."""
STEP = 0.7
"""Factor by which the difference shrinks."""


@dataclass
class Trial:
    """A trial, and what came of it."""

    difference_N: float
    stickier: int
    """Which of the two surfaces is the stickier one: 1 or 2."""
    ticks: list[int]
    """The ticks that began to render the surfaces."""
    peak_force_N: list[float]
    """Largest force on the hand during each."""
    is_right: bool = False
    turns: bool = False
    """Whether the difference turned after it: it had grown and now shrinks, or the other way round."""


def present(rig: hapticd.Rig, samples: hapticd.Samples, difference_N: float, stickier: int, duration_s: float) -> Trial:
    """Gives two surfaces, one after the other, each from a tick that is known before."""
    rate_hz = samples.rate_hz
    first = rig.status().tick + round(PAUSE_S * rate_hz)
    ticks = [first, first + round(duration_s * rate_hz)]
    stictions_N = [STANDARD_N + (difference_N if place == stickier else 0.0) for place in (1, 2)]
    changes = [
        {"at_tick": tick, "params": {"Fs": stiction_N}, "ramp": "20ms"}
        for tick, stiction_N in zip(ticks, stictions_N, strict=True)
    ]
    rig.schedule(changes)
    end = first + round(2 * duration_s * rate_hz)
    felt = [
        (sample.tick, abs(sample.command_force_N)) for sample in itertools.takewhile(lambda s: s.tick < end, samples)
    ]
    # Without the change from one surface to the other.
    spans = [(tick + 0.05 * rate_hz, tick + duration_s * rate_hz) for tick in ticks]
    peaks_N = [max(force_N for tick, force_N in felt if since <= tick < until) for since, until in spans]
    return Trial(difference_N, stickier, ticks, peaks_N)


def staircase(
    rig: hapticd.Rig,
    samples: hapticd.Samples,
    asked: Callable[[Trial], int],
    *,
    reversals: int,
    duration_s: float,
    chance: random.Random,
) -> Iterator[Trial]:
    """Runs until the difference has turned so many times; gives each trial when it has ended."""
    difference_N, right_in_a_row, direction, turned = FIRST_DIFFERENCE_N, 0, 0, 0
    while turned < reversals:
        trial = present(rig, samples, difference_N, chance.choice((1, 2)), duration_s)
        trial.is_right = asked(trial) == trial.stickier
        right_in_a_row = right_in_a_row + 1 if trial.is_right else 0
        step = -1 if right_in_a_row == 2 else 0 if trial.is_right else 1
        if step != 0:
            right_in_a_row = 0
            trial.turns = direction == -step
            turned += trial.turns
            direction = step
            difference_N = min(difference_N * STEP**-step, FIRST_DIFFERENCE_N)
        yield trial


def threshold_N(trials: list[Trial]) -> float:
    """The geometric mean of the differences at which the staircase turned, without the first turn."""
    turns = [trial.difference_N for trial in trials if trial.turns]
    return statistics.geometric_mean(turns[1:] or turns)


def observer(noise_N: float, chance: random.Random) -> Callable[[Trial], int]:
    """A simulated person, who feels the largest force of each surface with some noise."""

    def answer(trial: Trial) -> int:
        first, second = (peak + chance.gauss(0.0, noise_N) for peak in trial.peak_force_N)
        return 1 if first > second else 2

    return answer


def person(trial: Trial) -> int:
    """A person at the keyboard."""
    while (key := input("Which was stickier, 1 or 2? ")) not in ("1", "2"):
        pass
    return int(key)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="A staircase of stiction.")
    parser.add_argument("--simulated", action="store_true", help="a simulated observer on a simulated rig")
    parser.add_argument("--reversals", type=int, default=8, help="after which it ends [default: 8]")
    parser.add_argument("--duration", type=float, default=2.0, metavar="S", help="of a surface [default: 2]")
    parser.add_argument("--seed", type=int, default=None, help="for the same order again [default: another each time]")
    given = parser.parse_args()
    chance = random.Random(given.seed)
    asked = observer(0.3, chance) if given.simulated else person
    with engaged(simulated=given.simulated) as rig, rig.samples(on_gap="count") as samples:
        report(staircase(rig, samples, asked, reversals=given.reversals, duration_s=given.duration, chance=chance))


@contextlib.contextmanager
def engaged(*, simulated: bool) -> Iterator[hapticd.Rig]:
    """The rig that haptic-ctl finds or a simulated one, engaged on the standard surface."""
    with contextlib.ExitStack() as stack:
        if simulated:
            hand = hapticd.fake(hand="sine", hand_amplitude_m=0.005, hand_frequency_hz=2)
            rig = stack.enter_context(stack.enter_context(hand).connect())
        else:
            rig = stack.enter_context(hapticd.connect())
        rig.set(Fs=STANDARD_N)
        rig.engage()
        rig.wait_for("engaged")
        yield rig


def report(course: Iterator[Trial]) -> None:
    """A line for each trial as it ends, and the threshold."""
    trials = []
    for trial in course:
        print(json.dumps(asdict(trial)), flush=True)
        trials.append(trial)
    print(json.dumps({"trials": len(trials), "threshold_N": round(threshold_N(trials), 3)}))


if __name__ == "__main__":
    main()
