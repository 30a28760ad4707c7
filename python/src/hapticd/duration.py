"""Durations: `0.05`, `"50ms"`, or a `timedelta`."""

from __future__ import annotations

import datetime
import math
from typing import TypeAlias

from hapticd.errors import invalid

Duration: TypeAlias = float | str | datetime.timedelta
"""A number is in seconds; a text has its unit: `"50ms"`, `"2s"`, `"1min"`."""

_UNITS_S = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def seconds(name: str, duration: Duration) -> float:
    """The duration in seconds.

    Raises:
        InvalidValue: It is not a duration, is negative, or is not finite.
    """
    if isinstance(duration, datetime.timedelta):
        value = duration.total_seconds()
    elif isinstance(duration, str):
        text = duration.strip()
        number = text.rstrip("abcdefghijklmnopqrstuvwxyz")
        unit = text[len(number) :]
        try:
            value = float(number) * _UNITS_S[unit]
        except (ValueError, KeyError):
            accepted = ", ".join(_UNITS_S)
            message = f"{name} = {duration!r}: expected a number and its unit, one of {accepted}"
            raise invalid(name, message) from None
    else:
        value = float(duration)
    if not (math.isfinite(value) and value >= 0):
        message = f"{name} = {duration!r} is out of range: a duration is finite, and at least 0 s"
        raise invalid(name, message, "out_of_range", value=value, min=0.0, unit="s")
    return value


def milliseconds(name: str, duration: Duration) -> float:
    """The duration in milliseconds."""
    # Rounded to a nanosecond: 0.05 s is to be 50 ms, and not 50.00000000000001.
    return round(seconds(name, duration) * 1e3, 6)
