"""QUEST+: which difference of stiction does a person feel?

The trials are those of staircase.py. QUEST+ (Watson 2017) chooses each difference so that the answer to it tells the
most of threshold and slope, and ends with how sure it is of the threshold.

    pip install questplus
    python examples/questplus_stiction.py                  # asks you, with the rig that haptic-ctl finds
    python examples/questplus_stiction.py --simulated      # a simulated observer, on a simulated rig, without a display
"""

from __future__ import annotations

import argparse
import json
import random
from dataclasses import asdict

import numpy as np
from questplus import QuestPlusWeibull
from staircase import engaged, observer, person, present

DIFFERENCES_N = np.geomspace(0.05, 2.0, 25)
"""Differences that a trial may have, N, and that the threshold may be."""


def quest_plus() -> QuestPlusWeibull:
    """A Weibull function of a choice among two: guesses are right in half of the trials, 2 % are lapses."""
    return QuestPlusWeibull(
        intensities=DIFFERENCES_N,
        thresholds=DIFFERENCES_N,
        slopes=np.geomspace(1.0, 8.0, 7),
        lower_asymptotes=0.5,
        lapse_rates=0.02,
        responses=("right", "wrong"),
        stim_scale="linear",
    )


def interval_N(quest: QuestPlusWeibull) -> tuple[float, float]:
    """The 95 % interval of the threshold, N."""
    others = [name for name in quest.posterior.dims if name != "threshold"]
    below = quest.posterior.sum(others).cumsum("threshold")
    low, high = np.searchsorted(below, (0.025, 0.975))
    return float(DIFFERENCES_N[low]), float(DIFFERENCES_N[min(high, len(DIFFERENCES_N) - 1)])


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="A threshold of stiction by QUEST+.")
    parser.add_argument("--simulated", action="store_true", help="a simulated observer on a simulated rig")
    parser.add_argument("--trials", type=int, default=40, help="after which it ends [default: 40]")
    parser.add_argument("--duration", type=float, default=2.0, metavar="S", help="of a surface [default: 2]")
    parser.add_argument("--seed", type=int, default=None, help="for the same order again [default: another each time]")
    given = parser.parse_args()
    chance = random.Random(given.seed)
    asked = observer(0.3, chance) if given.simulated else person
    quest = quest_plus()
    with engaged(simulated=given.simulated) as rig, rig.samples(on_gap="count") as samples:
        for _ in range(given.trials):
            difference_N = float(quest.next_intensity)
            trial = present(rig, samples, difference_N, chance.choice((1, 2)), given.duration)
            trial.is_right = asked(trial) == trial.stickier
            quest.update(intensity=difference_N, response="right" if trial.is_right else "wrong")
            print(json.dumps(asdict(trial)))
    low_N, high_N = interval_N(quest)
    threshold_N = float(quest.param_estimate["threshold"])
    print(json.dumps({"trials": given.trials, "threshold_N": threshold_N, "low_N": low_N, "high_N": high_N}))


if __name__ == "__main__":
    main()
