"""A picture of samples (extra `plot`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy
    import numpy.typing
    from matplotlib.axes import Axes


def draw(samples: numpy.typing.NDArray[numpy.void], title: str) -> tuple[Axes, Axes]:
    """Draws force and position over the time before the last sample; returns the axes of both."""
    from matplotlib import pyplot

    time_s = samples["t_s"] - samples["t_s"][-1]
    _, (force, position) = pyplot.subplots(2, 1, sharex=True, layout="constrained")
    force.plot(time_s, samples["command_force_N"])
    force.set(title=title, ylabel="force on the hand, N")
    for name in ("device", "block"):
        position.plot(time_s, samples[f"{name}_position_m"] * 1e3, label=name)
    position.set(xlabel="time, s", ylabel="position, mm")
    position.legend()
    for axes in (force, position):
        axes.grid(True, alpha=0.3)
    return force, position
