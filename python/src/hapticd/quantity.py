"""Quantities as people write them: `"5 N"`, `"200 g"`, `"25 N/mm"`. haptic-ctl accepts the same."""

from __future__ import annotations

import math
import re

from hapticd.errors import InvalidValue, invalid

#: For each unit of a parameter the units accepted in its place, with the power of ten that turns each into it.
UNITS: dict[str, dict[str, int]] = {
    "kg": {"kg": 0, "g": -3, "mg": -6},
    "N": {"N": 0, "mN": -3, "kN": 3},
    "m/s": {"m/s": 0, "cm/s": -2, "mm/s": -3, "um/s": -6},
    "N s/m": {"Ns/m": 0, "Ns/cm": 2, "Ns/mm": 3, "mNs/m": -3, "mNs/mm": 0, "kg/s": 0},
    "N/m": {"N/m": 0, "N/cm": 2, "N/mm": 3, "N/um": 6, "mN/mm": 0, "kN/m": 3},
    "1/s": {"1/s": 0, "/s": 0, "Hz": 0, "1/ms": 3},
    "Hz": {"Hz": 0, "kHz": 3},
    "1": {"%": -2},
    "m": {"m": 0, "cm": -2, "mm": -3, "um": -6},
    "s": {"s": 0, "ms": -3, "us": -6, "ns": -9},
}

_NUMBER = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eE]([+-]?[0-9]+))?")

#: Spaces and signs of multiplication, which people write differently; micro has two letters.
_PLAIN = str.maketrans({**dict.fromkeys(" \t*.·⋅"), "µ": "u", "μ": "u"})


def parse(name: str, text: str, si: str) -> float:
    """A number with or without a unit, in the SI unit `si`; without a unit it is in that one already.

    Raises:
        InvalidValue: It is not a finite number, or its unit measures something else.
    """
    found = _NUMBER.match(text.strip())
    if found is None:
        raise _not_a_number(name, text, si)
    unit = text.strip()[found.end() :]
    if "," in unit:
        remedy = "write a decimal point, and no separator between thousands"
        raise invalid(name, f"{name} = {text!r} has a comma: {remedy}")
    plain = unit.translate(_PLAIN)
    accepted = UNITS.get(si, {})
    if plain and plain != si.translate(_PLAIN) and plain not in accepted:
        raise invalid(name, f"{name} = {text!r}: {name} is {_units(si)}; `{unit.strip()}` is not accepted")
    # The decimal point moves in the text: "7 g" is the number nearest to 0.007 kg, not a rounding error beside it.
    value = float(f"{found[1]}e{int(found[2] or 0) + accepted.get(plain, 0)}")
    if not math.isfinite(value):
        raise _not_a_number(name, text, si)
    return value


def _not_a_number(name: str, text: str, si: str) -> InvalidValue:
    return invalid(name, f"{name} = {text!r} is not a finite number; {name} is {_units(si)}", "not_finite")


def _units(si: str) -> str:
    units = list(UNITS.get(si, {})) or [si]
    listed = "in " + " or ".join(filter(None, (", ".join(units[:-1]), units[-1])))
    return f"a bare number or {listed}" if si == "1" else listed
