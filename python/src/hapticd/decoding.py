"""From an answer on the wire to a dataclass."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar, cast

T = TypeVar("T")


def decoded(kind: type[T], answer: Mapping[str, Any]) -> T:
    """The answer as a dataclass."""
    return cast(T, _decode(kind, answer))


@functools.cache
def _types(kind: type[Any]) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {each.name: hints[each.name] for each in dataclasses.fields(kind)}


def _decode(kind: Any, value: Any) -> Any:
    if value is None:
        return None
    if isinstance(kind, types.UnionType):
        kind = next(each for each in typing.get_args(kind) if each is not type(None))
    if typing.get_origin(kind) is list:
        return [_decode(typing.get_args(kind)[0], each) for each in value]
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = _types(kind)
        return kind(**{name: _decode(hints[name], each) for name, each in value.items() if name in hints})
    return value
