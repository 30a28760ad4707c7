from __future__ import annotations

import asyncio

import numpy
import pytest

import hapticd
import hapticd.aio

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")


def test_the_last_seconds_are_plotted(daemon: hapticd.Fake) -> None:
    with daemon.connect() as rig:
        force, position = rig.plot("200ms")
        assert force.get_title() == "simulated friction: idle"
        assert force.get_ylabel() == "force on the hand, N" and position.get_ylabel() == "position, mm"
        (line,) = force.get_lines()
        assert len(numpy.asarray(line.get_xdata())) == 200
        # Samples are kept from then on: what is plotted later was there before.
        assert rig._recent is not None
        rig._recent.wait_for(600)
        tick = rig.status().tick
        assert rig._last(0.4)[0]["tick"][0] < tick
        with pytest.raises(hapticd.InvalidValue, match="up to 60 s"):
            rig.plot("2min")

    async def script() -> None:
        async with hapticd.aio.connect(daemon.path) as rig:
            _, position = await rig.plot(0.1)
            assert [line.get_label() for line in position.get_lines()] == ["device", "block"]

    asyncio.run(script())


def test_a_rig_of_two_axes_shows_both() -> None:
    with hapticd.fake(kinematics="xy", hand="circle") as planar, planar.connect() as rig:
        force, position = rig.plot("100ms")
        assert [line.get_label() for line in force.get_lines()] == ["force x", "force y"]
        assert [line.get_label() for line in position.get_lines()] == ["device x", "block x", "device y", "block y"]
