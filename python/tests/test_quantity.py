"""Values with units: as haptic-ctl reads them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import hapticd
from hapticd.quantity import UNITS, parse

SOURCE = Path(__file__).resolve().parents[2] / "crates/haptic-ipc/src/quantity.rs"


def test_the_units_are_those_of_haptic_ctl() -> None:
    table = SOURCE.read_text().split("const UNITS", 1)[1].split("];\n", 1)[0]
    rows = re.findall(r'\(\s*"([^"]+)",\s*&\[(.*?)\],?\s*\)', table, re.DOTALL)
    units = {si: {unit: int(shift) for unit, shift in re.findall(r'\("([^"]+)", (-?\d+)\)', row)} for si, row in rows}
    del units["ns"]  # of samples alone
    assert units == UNITS


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("5 N", "N", 5.0),
        ("7g", "kg", 0.007),
        ("-4.5e3 mN", "N", -4.5),
        ("25 N/mm", "N/m", 25_000.0),
        ("2 N·s/m", "N s/m", 2.0),
        ("2 N s/m", "N s/m", 2.0),
        ("50 µm/s", "m/s", 50e-6),
        ("70%", "1", 0.7),
        ("3", "kg", 3.0),
    ],
)
def test_quantities_are_read_as_people_write_them(text: str, si: str, value: float) -> None:
    assert parse("it", text, si) == value


@pytest.mark.parametrize(
    ("text", "si", "message"),
    [
        ("5 N", "kg", "it = '5 N': it is in kg, g or mg; `N` is not accepted"),
        ("5 MN", "N", "N, mN or kN"),
        ("5 N", "1", "a bare number or in %"),
        ("heavy", "kg", "it = 'heavy' is not a finite number"),
        ("nan", "kg", "not a finite number"),
        ("1e999 N", "N", "not a finite number"),
        ("0,5 kg", "kg", "has a comma: write a decimal point"),
    ],
)
def test_a_wrong_unit_is_refused_with_the_right_ones(text: str, si: str, message: str) -> None:
    with pytest.raises(hapticd.InvalidValue, match=re.escape(message)) as refused:
        parse("it", text, si)
    assert refused.value.param == "it"


def test_a_change_may_have_units(rig: hapticd.Rig) -> None:
    change = rig.set({"Fs+": "5 N", "K": "20 N/mm"}, mass="200 g", Fd={"plus": "500 mN"}, b=2)
    forces = {"static_force+": 5.0, "dynamic_force": 4.0}
    assert change.applied == {**forces, "stiffness": 20_000.0, "mass": 0.2, "viscous": 2.0}
    assert rig.set(mass={"times": "50%"}).applied == {"mass": 0.1}
    both = rig.set(static_force={"positive": "5 N", "negative": 4500e-3}).applied
    assert both == {"static_force+": 5.0, "static_force-": 4.5}
    tick = rig.status().tick + 500
    accepted = rig.schedule([{"at_tick": tick, "params": {"Fs": "6 N"}}], dry_run=True)
    assert accepted.changes[0].applied == {"static_force": 6.0}
    before = rig.get()
    with pytest.raises(hapticd.InvalidValue, match="mass is in kg, g or mg; `N` is not accepted"):
        rig.set(Fs=6, mass="5 N")
    with pytest.raises(hapticd.UnknownName, match="did you mean `mass`"):
        rig.set(masss="5 kg")
    with pytest.raises(hapticd.InvalidValue, match="DV"):
        rig.load("lugre", dry_run=True)
        rig.set({"no_such+": 1, "DV": "5 kg"})
    assert rig.get() == before
