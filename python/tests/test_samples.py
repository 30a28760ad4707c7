from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from typing import Any

import numpy
import pytest

import hapticd
from hapticd.samples import Gaps, Samples
from hapticd.subscription import Queue


def test_every_tick_is_a_sample(rig: hapticd.Rig) -> None:
    rig.engage()
    with rig.samples() as samples:
        assert samples.rate_hz == 1000.0
        found = list(itertools.islice(samples, 500))
    ticks = [sample.tick for sample in found]
    assert ticks == list(range(ticks[0], ticks[0] + 500))
    assert {sample.state for sample in found} <= {"idle", "engaging", "engaged"}
    assert found[-1].elapsed_ns > 0
    assert samples.lost == 0


def test_samples_may_be_thinned(rig: hapticd.Rig) -> None:
    with rig.samples(rate_hz=100, batch_ms=50) as samples:
        ticks = [sample.tick for sample in itertools.islice(samples, 20)]
    assert [b - a for a, b in itertools.pairwise(ticks)] == [10] * 19


def test_a_slow_reader_loses_no_sample(rig: hapticd.Rig) -> None:
    with rig.samples() as samples:
        first = next(samples).tick
        # The daemon disconnects whoever has not read for two seconds.
        with rig.buffer("10s", rate_hz=100) as buffer:
            buffer.wait_for(250, timeout_s=60)
        ticks = [sample.tick for sample in itertools.islice(samples, 2000)]
    assert ticks == list(range(first + 1, first + 2001))


def test_a_gap_is_raised_and_the_iteration_goes_on() -> None:
    samples = _fed(on_gap="raise")
    assert next(samples).tick == 10
    assert next(samples).tick == 11
    with pytest.raises(hapticd.SamplesLost, match="3 samples before tick 15 were lost") as lost:
        next(samples)
    assert (lost.value.lost, lost.value.tick) == (3, 15)
    assert [next(samples).tick, samples.lost] == [15, 5]
    with pytest.raises(hapticd.SamplesLost, match="2 samples before tick 18"):
        next(samples)
    assert next(samples).tick == 18


def test_a_gap_is_counted() -> None:
    samples = _fed(on_gap="count")
    assert [next(samples).tick for _ in range(4)] == [10, 11, 15, 18]
    assert samples.lost == 5


def test_what_a_slow_program_does_not_fetch_is_counted() -> None:
    samples = _fed(on_gap="raise", most=2)
    with pytest.raises(hapticd.SamplesLost, match="5 samples before tick 15"):
        next(samples)
    assert next(samples).tick == 15


def _fed(on_gap: Any, most: int = 100) -> Samples:
    """A stream that gets events from here: ticks 10, 11, then three are not there, and two the daemon tells of."""
    samples = Samples.__new__(Samples)
    samples._on_gap = on_gap
    samples._ready = []
    samples._gaps = Gaps(1)
    samples._kind = hapticd.Sample
    samples._queue = Queue(most, lambda batch: len(batch.rows))
    samples._overrun = samples._taken = 0
    for ticks, dropped in (([10, 11], 0), ([15], 0), ([18], 2)):
        rows = [[tick, 0.0, "idle", 0, *[0] * 16] for tick in ticks]
        samples._take({"event": "samples", "seq": 0, "dropped": dropped, "rows": rows})
    return samples


def test_a_program_stopped_for_too_long_is_disconnected(daemon: hapticd.Fake) -> None:
    program = (
        "import sys, hapticd\n"
        "rig = hapticd.connect(sys.argv[1], lease=None)\n"
        "samples = rig.samples(batch_ms=1)\n"
        "print(next(samples).tick, flush=True)\n"
        "try:\n"
        "    while True: next(samples)\n"
        "except hapticd.ConnectionLost: print('disconnected')\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program, str(daemon.path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert int(child.stdout.readline()) >= 0
    os.kill(child.pid, signal.SIGSTOP)
    with daemon.connect(lease=None) as rig:
        until = time.monotonic() + 30
        while rig.status().clients == 5 and time.monotonic() < until:
            time.sleep(0.01)
    os.kill(child.pid, signal.SIGCONT)
    printed, _ = child.communicate(timeout=30)
    assert printed.strip() == "disconnected"


def test_a_buffer_keeps_the_newest_samples_in_numpy(rig: hapticd.Rig) -> None:
    rig.engage()
    with rig.buffer("200ms") as buffer:
        buffer.wait_for(150, timeout_s=30)
        first = buffer.take()
        buffer.wait_for(450, timeout_s=30)
        held = buffer.latest()
        newest = buffer.latest(10)
        assert len(buffer) == 200
    assert first.dtype.names == hapticd.COLUMNS
    assert (numpy.diff(first["tick"]) == 1).all()
    assert len(held) == 200 and len(newest) == 10
    assert (numpy.diff(held["tick"]) == 1).all()
    assert held["tick"][0] > first["tick"][-1] - 200
    rest = buffer.take()
    assert len(rest) == 200
    # What was not taken in time is counted, so that taken and lost samples are all there are.
    assert first["tick"][0] + len(first) + buffer.lost + len(rest) - 1 == rest["tick"][-1]
    with pytest.raises(hapticd.ConnectionLost):
        buffer.take()
