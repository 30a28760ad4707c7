from __future__ import annotations

import asyncio
import time
from pathlib import Path

import pytest

import hapticd
import hapticd.aio


def test_a_rig_is_scripted_with_asyncio(daemon: hapticd.Fake, tmp_path: Path) -> None:
    async def script() -> None:
        connection = hapticd.aio.connect(daemon.path)
        assert repr(connection) == "<Rig: not connected yet>"
        async with connection as rig:
            assert ": idle" in repr(rig)
            assert (await rig.engage()).state == "engaging"
            await rig.wait_for("engaged")
            change = await rig.set(mass=1.5, ramp=0.02)
            assert change.applied == {"mass": 1.5}
            assert (await rig.get()).params["mass"] == 1.5
            with pytest.raises(hapticd.InvalidValue, match="mass = -1 kg"):
                await rig.set(mass=-1)
            rows = await rig.record("100ms")
            assert len(rows) == 100
            with await rig.record(path=tmp_path / "r.csv"):
                assert await rig.wait_for(lambda sample: sample.state == "engaged") > 0
            assert (await rig.stop()).state == "stopped"
            assert (await rig.reset()).state == "idle"
            assert (await rig.status()).leases == 1

    asyncio.run(script())
    assert hapticd.read(tmp_path / "r.csv").state.iloc[-1] == "engaged"
    with daemon.connect(lease=None) as rig:
        assert rig.status().leases == 0


def test_samples_and_events_come_beside_other_work(daemon: hapticd.Fake) -> None:
    async def script() -> None:
        async with hapticd.aio.connect(daemon.path, lease="2s") as rig, rig.samples() as samples:
            ticks = [(await anext(samples)).tick]
            await rig.engage()
            # A program that blocks its loop keeps its lease and its samples.
            time.sleep(2.5)
            async for sample in samples:
                ticks.append(sample.tick)
                if len(ticks) == 1000:
                    break
            assert ticks == list(range(ticks[0], ticks[0] + 1000))
            async with rig.events(["state"]) as events:
                assert (await anext(events))["state"] == "engaged"
                waiting = asyncio.ensure_future(anext(events))
                assert (await rig.stop()).state == "stopped"
                assert (await waiting)["state"] == "stopped"

    asyncio.run(script())


def test_stop_overtakes_a_request_that_waits(daemon: hapticd.Fake) -> None:
    async def script() -> None:
        async with hapticd.aio.connect(daemon.path) as rig:
            await rig.engage()
            with rig.blocking._control._sending:
                waiting = asyncio.ensure_future(rig.status())
                await asyncio.sleep(0)
                stopped = await asyncio.wait_for(rig.stop(), 30)
                assert stopped.state == "stopped"
                assert not waiting.done()
            assert (await waiting).state == "stopped"

    asyncio.run(script())


def test_a_loop_that_is_cancelled_lets_go_of_the_rig(daemon: hapticd.Fake) -> None:
    async def script() -> None:
        async with hapticd.aio.connect(daemon.path, keep=True) as rig:
            await rig.engage()
            await rig.wait_for("engaged")
            await asyncio.sleep(3600)

    async def cancelled() -> None:
        task = asyncio.ensure_future(script())
        async with hapticd.aio.connect(daemon.path, lease=None) as watcher, watcher.events(["state"]) as events:
            async for event in events:
                if event["state"] == "engaged":
                    task.cancel()
                if event["state"] == "releasing":
                    return

    asyncio.run(asyncio.wait_for(cancelled(), 30))
