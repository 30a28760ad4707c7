"""A recording as a data frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hapticd.sample import STATES

if TYPE_CHECKING:
    import numpy
    import numpy.typing
    import pandas


def frame(columns: Mapping[str, Any], metadata: Mapping[str, Any], marks: list[dict[str, Any]]) -> pandas.DataFrame:
    """The data frame of columns, in which `state` is the place in `STATES`."""
    import pandas

    places: numpy.typing.NDArray[numpy.int8] = columns["state"].astype("i1")
    states = pandas.Categorical.from_codes(places, pandas.Index(STATES))
    table = pandas.DataFrame({**columns, "state": states}, copy=False)
    return annotated(table, metadata, marks)


def annotated(table: pandas.DataFrame, metadata: Mapping[str, Any], marks: list[dict[str, Any]]) -> pandas.DataFrame:
    """The data frame with what a recording holds beside its rows."""
    table.attrs["metadata"] = dict(metadata)
    table.attrs["marks"] = marks
    table.attrs["is_complete"] = bool(marks) and marks[-1]["mark"] == "end"
    return table
