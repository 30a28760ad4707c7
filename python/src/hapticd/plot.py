"""A picture of samples (extra `plot`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticd.sample import SECOND_AXIS

if TYPE_CHECKING:
    import numpy
    import numpy.typing
    from matplotlib.axes import Axes


def draw(samples: numpy.typing.NDArray[numpy.void], title: str) -> tuple[Axes, Axes]:
    """Draws force and position over the time before the last sample; returns the axes of both."""
    from matplotlib import pyplot

    time_s = samples["t_s"] - samples["t_s"][-1]
    _, (force, position) = pyplot.subplots(2, 1, sharex=True, layout="constrained")
    is_planar = SECOND_AXIS[0] in (samples.dtype.names or ())
    for axis, label in (("", " x"), ("_y", " y")) if is_planar else (("", ""),):
        force.plot(time_s, samples[f"command_force{axis}_N"], label=f"force{label}")
        for name in ("device", "block"):
            position.plot(time_s, samples[f"{name}_position{axis}_m"] * 1e3, label=f"{name}{label}")
    force.set(title=title, ylabel="force on the hand, N")
    position.set(xlabel="time, s", ylabel="position, mm")
    position.legend()
    if is_planar:
        force.legend()
    for axes in (force, position):
        axes.grid(True, alpha=0.3)
    return force, position
