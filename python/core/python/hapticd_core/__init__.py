"""Scenes of hapticd on numpy arrays, by the code that the daemon runs: the same forces, to the last bit.

    import hapticd_core
    import numpy

    t = numpy.arange(0, 2, 1e-3)
    motion = {"t_s": t, "position_m": 0.03 * numpy.sin(numpy.pi * t)}
    run = hapticd_core.simulate(motion, hapticd_core.Scene.named("lugre").changed(mass=1.0))
    print(run.coupling_force_N.max(), "N")

Numbers are in SI units, and names have the unit at their end. What cannot be computed is a `ValueError` that names the
field, the value, the limit and the unit.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy
import numpy.typing

from hapticd_core import _native

if TYPE_CHECKING:
    import pandas

__all__ = ["Accuracy", "Scene", "Simulation", "accuracy", "reference", "replay", "simulate"]

Numbers: TypeAlias = numpy.typing.NDArray[numpy.float64]
"""Numbers, one a sample."""

Motion: TypeAlias = Any
"""Columns by name: a data frame, a structured array, or a dictionary of arrays. As in a motion's file they are `t_s`,
`position_m` or `device_position_m`, and where it was measured `velocity_mps` or `device_velocity_mps`. Without them
velocities are estimated from the positions, as the daemon does."""


class Scene:
    """A scene: block, coupling and friction. It is checked when it is made, and does not change."""

    def __init__(self, fields: Mapping[str, Any]) -> None:
        """The scene as it is on the wire, and in the metadata of a recording."""
        self._native = _native.Scene.from_json(json.dumps(fields))

    @classmethod
    def _of(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    @classmethod
    def from_toml(cls, text: str) -> Scene:
        """The scene of a file's text."""
        return cls._of(_native.Scene.from_toml(text))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene of a TOML file, as `haptic-ctl` reads them."""
        return cls.from_toml(Path(path).read_text("utf-8"))

    @classmethod
    def named(cls, name: str) -> Scene:
        """A scene that every library has: `lugre`, `simulated-friction`, ..."""
        return cls._of(_native.Scene.named(name))

    def changed(self, params: Mapping[str, float | str] | None = None, /, **more: float | str) -> Scene:
        """The scene with other values, by name or symbol: `scene.changed({"Fs+": 5}, mass="200 g")`."""
        return Scene._of(self._native.with_values(list({**(params or {}), **more}.items())))

    @property
    def params(self) -> dict[str, float | dict[str, float]]:
        """The parameters by name, SI units; one that differs between the directions has both."""
        params: dict[str, float | dict[str, float]] = json.loads(self._native.params_json())
        return params

    @property
    def fields(self) -> dict[str, Any]:
        """The scene as it is on the wire."""
        fields: dict[str, Any] = json.loads(self._native.to_json())
        return fields

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.fields["name"])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._native == other._native

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Scene({self.fields!r})"


@dataclass(frozen=True, eq=False)
class Simulation:
    """A scene along a motion: a value for each sample."""

    t_s: Numbers
    """Times, s."""
    device_position_m: Numbers
    """Positions of the device, m."""
    device_velocity_mps: Numbers
    """Velocities of the device, m/s."""
    block_position_m: Numbers
    """Positions of the block, m."""
    block_velocity_mps: Numbers
    """Velocities of the block, m/s."""
    coupling_force_N: Numbers
    """Force in the coupling, which drives the block, N; the hand feels its negative."""
    contact: numpy.typing.NDArray[numpy.int8]
    """0 stuck, +1 and -1 sliding."""
    changes: numpy.typing.NDArray[numpy.void]
    """Changes of contact: `t_s`, `before`, `after`."""
    energy_created_J: float
    """Energy that friction put into the block, J: 0 of a friction that only opposes motion."""
    exhausted_ticks: int
    """Ticks whose bounded work ran out."""

    @classmethod
    def _of(cls, native: _native.Simulation) -> Simulation:
        times, before, after = native.changes()
        changes = numpy.zeros(len(times), dtype=[("t_s", "f8"), ("before", "i1"), ("after", "i1")])
        changes["t_s"], changes["before"], changes["after"] = times, before, after
        t_s, device_m, device_mps, block_m, block_mps, force_n = native.numbers()
        contact, created, exhausted = native.contacts(), native.energy_created_j, native.exhausted_ticks
        return cls(t_s, device_m, device_mps, block_m, block_mps, force_n, contact, changes, created, exhausted)

    def frame(self) -> pandas.DataFrame:
        """The columns as a pandas data frame, named as those of a recording."""
        import pandas

        names = (
            *("t_s", "device_position_m", "device_velocity_mps"),
            *("block_position_m", "block_velocity_mps", "coupling_force_N", "contact"),
        )
        return pandas.DataFrame({name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class Accuracy:
    """How far a scheme is from the true motion, at worst."""

    position_error_m: float
    """Error of the block's position, m."""
    force_error_N: float
    """Error of the force, N."""
    relative_force_error: float
    """The same over the size of the numbers that the force is the difference of: `max(K |x|, 1 N)`."""
    event_time_error_s: float | None
    """Error of the time of a change of contact, s; `None` where the scheme has other changes."""


def simulate(
    motion: Motion,
    scene: Scene,
    *,
    scheme: str = "exact",
    block_position_m: float | None = None,
    block_velocity_mps: float = 0.0,
) -> Simulation:
    """Renders a scene along a motion, tick by tick as the daemon does.

    Args:
        scheme: `exact`, `literal` as the paper prints it, `literal:N` with N steps a tick, or `implicit`.
        block_position_m: Initial position of the block, m; the device's without it.
        block_velocity_mps: Initial velocity of the block, m/s; a block that moves begins sliding.

    Raises:
        ValueError: The motion or the scene cannot be rendered.
    """
    native = _native.simulate(_motion(motion), _scene(scene), scheme, block_position_m, block_velocity_mps)
    return Simulation._of(native)


def reference(
    motion: Motion, scene: Scene, *, block_position_m: float | None = None, block_velocity_mps: float = 0.0
) -> Simulation:
    """The true motion of a scene, to about 1e-13 N. It takes a thousand times longer than `simulate`.

    Raises:
        ValueError: There is no reference for the scene's law.
    """
    native = _native.reference(_motion(motion), _scene(scene), block_position_m, block_velocity_mps)
    return Simulation._of(native)


def accuracy(
    motion: Motion,
    scene: Scene,
    *,
    scheme: str = "exact",
    block_position_m: float | None = None,
    block_velocity_mps: float = 0.0,
) -> Accuracy:
    """How far a scheme is from the `reference`. The arguments are those of `simulate`."""
    samples, native = _motion(motion), _scene(scene)
    run = _native.simulate(samples, native, scheme, block_position_m, block_velocity_mps)
    truth = _native.reference(samples, native, block_position_m, block_velocity_mps)
    return Accuracy(*_native.compare(run, truth, native))


def replay(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Steps the daemon's servo through a recording, and compares every output to the last bit.

    Returns:
        The report of `haptic-ctl replay`: rows in `ticks`, those that differ in `differing`, those that were not
        compared in `not_compared`.
    """
    report: dict[str, Any] = json.loads(_native.replay(path))
    return report


def _scene(scene: Scene) -> _native.Scene:
    if not isinstance(scene, Scene):
        raise ValueError(f"scene = {scene!r} is no Scene: use Scene.named, Scene.read or Scene.from_toml")
    return scene._native


def _motion(motion: Motion) -> _native.Motion:
    def column(*names: str) -> Numbers | None:
        found = [name for name in names if name in _names(motion)]
        if len(found) > 1:
            raise ValueError(f"the motion has both {found[0]} and {found[1]}, and either could be meant")
        return numpy.ascontiguousarray(motion[found[0]], dtype=numpy.float64) if found else None

    times, positions = column("t_s"), column("position_m", "device_position_m")
    if times is None or positions is None:
        raise ValueError("the motion lacks a column: it must have t_s, and position_m or device_position_m")
    return _native.Motion(times, positions, column("velocity_mps", "device_velocity_mps"))


def _names(motion: Any) -> Any:
    return motion.dtype.names if isinstance(motion, numpy.ndarray) else motion
