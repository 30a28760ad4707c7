"""Reads every tick at 1 kHz, and prints what was lost and what it cost.

python benchmarks/stream.py                 # 60 s, on a simulated rig
python benchmarks/stream.py --seconds 10 --into buffer
"""

from __future__ import annotations

import argparse
import itertools
import resource
import time

import hapticd


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="Every tick at 1 kHz, into Python.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--into", choices=("iterator", "buffer"), default="iterator")
    given = parser.parse_args()
    count = round(given.seconds * 1000)
    with hapticd.fake(rate=1000) as daemon, daemon.connect() as rig:
        rig.engage()
        began_s, used_s = time.monotonic(), cpu_s()
        if given.into == "iterator":
            with rig.samples(on_gap="count") as samples:
                ticks = [sample.tick for sample in itertools.islice(samples, count)]
                lost = samples.lost
        else:
            with rig.buffer(given.seconds) as buffer:
                buffer.wait_for(count)
                ticks = buffer.latest(count)["tick"].tolist()
                lost = buffer.lost
        took_s, used_s = time.monotonic() - began_s, cpu_s() - used_s
    jumps = sum(1 for a, b in itertools.pairwise(ticks) if b != a + 1)
    print(
        f"{len(ticks)} samples in {took_s:.1f} s into the {given.into}: {lost} lost, {jumps} gaps, "
        f"{used_s / took_s:.1%} of a processor"
    )


def cpu_s() -> float:
    """Processor time of this process with all its threads, s; the daemon's is not in it."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
