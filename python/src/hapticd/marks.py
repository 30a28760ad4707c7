"""Marks: what happened between the rows of a recording.

A mark is an object with its kind in `mark` (`scene`, `state`, `lost`, `missed`, `marker`, `link`, `end`), as
docs/how-to/record.md has them, and in `row` the number of rows before it.
"""

from __future__ import annotations

from typing import Any


def scene_mark(event: dict[str, Any]) -> dict[str, Any]:
    """The mark of a scene that came in, by an event `state`."""
    fields = _fields(event, ("tick", "revision", "law", "params", "arrival"))
    return {"mark": "scene", "name": event["scene"], **fields}


def state_mark(event: dict[str, Any]) -> dict[str, Any]:
    """The mark of a new state, by an event `state`."""
    fields = _fields(event, ("tick", "state", "fault"))
    return {"mark": "state", **fields}


def _fields(event: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: event[name] for name in names if name in event}
