from __future__ import annotations

from typing import Any

import pytest

import hapticd

CHANGES = 50
# How long a request may be on its way on a busy machine, in ticks of 1 ms.
LEAD = 3_000


def _rendered(events: hapticd.Events, count: int) -> list[dict[str, Any]]:
    """The entries of the journal of so many scheduled changes."""
    found: list[dict[str, Any]] = []
    while len(found) < count:
        event = events.get(30)
        if event["event"] == "log" and "at_tick" in event:
            found.append(event)
    return found


def test_a_staircase_is_rendered_in_its_ticks(rig: hapticd.Rig) -> None:
    rig.engage()
    rig.wait_for("engaged")
    with rig.samples() as samples, rig.events(["log"]) as events:
        first = rig.status().tick + LEAD
        changes = [{"at_tick": first + 10 * place, "params": {"Fs": 4 + 0.1 * (place + 1)}} for place in range(CHANGES)]
        # Trials of so many scenes take their time on a busy machine.
        reply = rig.schedule(changes, name="staircase", anyway=True)
        assert reply.name == "staircase"
        assert [change.at_tick for change in reply.changes] == [change["at_tick"] for change in changes]
        assert reply.changes[0].applied == {"static_force": 4.1}
        # The rows prove the ticks: each revision begins in its own.
        began: dict[int, int] = {}
        for sample in samples:
            began.setdefault(sample.revision, sample.tick)
            if sample.tick > first + 10 * CHANGES:
                break
        for change in reply.changes:
            assert began[change.revision] == change.at_tick
        rendered = _rendered(events, CHANGES)
        assert [entry["tick"] for entry in rendered] == [change["at_tick"] for change in changes]


def test_a_change_is_rendered_in_its_tick(rig: hapticd.Rig) -> None:
    with rig.samples() as samples:
        tick = rig.status().tick + LEAD
        reply = rig.at(tick, {"mass": {"times": 2}})
        assert (reply.at_tick, reply.tick) == (tick, None)
        began = next(sample.tick for sample in samples if sample.revision == reply.revision)
    assert began == tick
    assert rig.get().params["mass"] == 1.0


def test_a_schedule_is_all_or_nothing_and_is_cancelled(rig: hapticd.Rig) -> None:
    tick = rig.status().tick + 30_000
    good = {"at_tick": tick, "params": {"mass": 1.5}, "ramp": "20ms"}
    with pytest.raises(hapticd.InvalidValue, match="mass = -1 kg"):
        rig.schedule([good, {"at_tick": tick + 1, "params": {"mass": -1}}])
    assert rig.status().scheduled is None
    with pytest.raises(hapticd.Refused):
        rig.at(1, mass=2)
    with pytest.raises(hapticd.InvalidValue, match="not a whole number"):
        rig.at(tick + 0.5, mass=2)  # type: ignore[arg-type]
    rig.schedule([good], name="later")
    scheduled = rig.status().scheduled
    assert scheduled is not None and scheduled["names"] == ["later"]
    assert rig.cancel("later") == 1
    assert rig.status().scheduled is None
    with pytest.raises(hapticd.UnknownName):
        rig.cancel("later")


def test_a_schedule_ends_with_its_connection(daemon: hapticd.Fake) -> None:
    with daemon.connect(lease=None) as watcher, watcher.events(["log"]) as events:
        with daemon.connect() as rig:
            rig.schedule([{"at_tick": rig.status().tick + 30_000, "params": {"mass": 1.5}}])
            assert watcher.status().scheduled is not None
        while events.get(30)["op"] != "schedule_cancelled":
            pass
        assert watcher.status().scheduled is None
