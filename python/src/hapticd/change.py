"""Changes of a scene, as a program writes them and as they are on the wire."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, SupportsFloat, TypeAlias

from hapticd import quantity
from hapticd.duration import Duration, milliseconds

SceneRef: TypeAlias = int | str | Mapping[str, Any]
"""A revision, a name in the library, or the scene itself."""

Quantity: TypeAlias = SupportsFloat | str
"""A number in the SI unit, or a text with its unit: `"5 N"`, `"200 g"`."""

Change: TypeAlias = Quantity | Mapping[str, Quantity]
"""A quantity, one for each direction (`{"positive": 5, "negative": 4}`), or a relative change: `{"times": 2}`,
`{"plus": "0.5 N"}`.
"""


def given(**fields: Any) -> dict[str, Any]:
    """The fields that were given."""
    return {name: value for name, value in fields.items() if value is not None}


def merged(params: Mapping[str, Change] | None, more: Mapping[str, Change]) -> dict[str, Change]:
    """Parameters by both ways of naming them.

    Raises:
        TypeError: One is given both ways.
    """
    params = params or {}
    if twice := params.keys() & more.keys():
        raise TypeError(f"{min(twice)} is given twice: in the mapping, and by its name")
    return {**params, **more}


def options(
    ramp: Duration | None, at_tick: int | None, if_revision: int | None, dry_run: bool, anyway: bool
) -> dict[str, Any]:
    """The fields that say how a scene changes."""
    ramp_ms = None if ramp is None else milliseconds("ramp", ramp)
    return given(
        ramp_ms=ramp_ms, at_tick=at_tick, if_revision=if_revision, dry_run=dry_run or None, anyway=anyway or None
    )


def scheduled(change: Mapping[str, Any], unit_of: Callable[[str], str]) -> dict[str, Any]:
    """A change of a schedule, as on the wire."""
    wire = dict(change)
    if "ramp" in wire:
        wire["ramp_ms"] = milliseconds("ramp", wire.pop("ramp"))
    if "params" in wire:
        wire["params"] = numbers(wire["params"], unit_of)
    return wire


def numbers(params: Mapping[str, Change], unit_of: Callable[[str], str]) -> dict[str, Any]:
    """Parameters as on the wire: numbers in SI units.

    Args:
        unit_of: The SI unit of a parameter; asked only where a quantity is a text.

    Raises:
        InvalidValue: A text is not a quantity of the parameter's kind.
    """

    def number(name: str, value: Any, relative: bool = False) -> Any:
        if not isinstance(value, str):
            return value
        return quantity.parse(name, value, "1" if relative else unit_of(name))

    return {
        name: {key: number(name, each, key == "times") for key, each in change.items()}
        if isinstance(change, Mapping)
        else number(name, change)
        for name, change in params.items()
    }
