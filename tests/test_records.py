"""What a result tells is said once: values, JSON, schema and rows agree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple, TypedDict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from hrsynth.records import (
    DEG,
    FLAT,
    MM,
    OPTIONAL,
    SCALED,
    As,
    Number,
    Record,
    Recorded,
    Shown,
    build_type_schema,
    list_members,
    recorded,
)


class Names(TypedDict):
    """Names."""

    first: str


class Corner(NamedTuple):
    """A corner."""

    x: float
    label: Annotated[str, "what it is called"]


@dataclass(frozen=True)
class Error(Record, all_recorded=True):
    """How wrong it is. More is said here."""

    largest: Annotated[float, Number, SCALED, "largest"]
    gap: float


@dataclass(frozen=True)
class Place(Record):
    """Where it is: ``p`` and more."""

    p: Annotated[np.ndarray, list[float], As("p_mm", scale=MM, digits=6), "point"]
    error: Annotated[Error, As("error_deg", scale=DEG)]
    corner: Annotated[Corner | None, FLAT]
    name: Annotated[str | None, str, OPTIONAL] = None
    count: Recorded[int] = 0
    hidden: object = None

    weight = Shown(float, lambda self: 2.0 * self.count, "twice the count")
    names = Shown(Names, lambda self: {"first": "a"})

    @property
    @recorded(As("is_far"))
    def far(self) -> bool:
        """Whether it is far.

        Not told.
        """
        return bool(abs(self.p).max() > 1)


NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@given(
    st.lists(st.floats(-9, 9), min_size=3, max_size=3),
    NUMBERS,
    st.floats(0, 1),
    st.none() | st.text(),
    st.integers(0, 9),
)
def test_a_record_is_what_its_schema_says(p: list[float], largest: float, gap: float, name: str | None, count: int):
    corner = None if name is None else Corner(gap, name)
    place = Place(np.array(p), Error(largest, gap), corner, name, count)
    parts: dict = {}
    wanted = {**build_type_schema(Place, parts), "$defs": parts}
    told = place.to_dict()
    assert not list(Draft202012Validator(wanted).iter_errors(told))
    assert told["p_mm"] == pytest.approx([1e3 * each for each in p], abs=1e-6)
    finite = np.isfinite(largest) and np.isfinite(DEG * largest)
    assert told["error_deg"] == {"largest": pytest.approx(DEG * largest) if finite else None, "gap": gap}
    assert ("name" in told, "x" in told) == (name is not None,) * 2
    assert (told["weight"], told["is_far"], told["names"]) == (2.0 * count, max(map(abs, p)) > 1, {"first": "a"})
    row = place.to_row()
    assert row["error_deg.gap"] == gap
    assert not any(isinstance(each, dict) for each in row.values())


def test_a_schema_says_of_each_member_what_stands_beside_it():
    parts: dict = {}
    build_type_schema(Place, parts)
    of = parts["Place"]["properties"]
    assert of["p_mm"] == {"type": "array", "items": {"type": "number"}, "description": "point"}
    assert of["is_far"] == {"type": "boolean", "description": "Whether it is far."}
    assert of["weight"]["description"] == "twice the count"
    assert of["label"] == {"type": "string", "description": "what it is called"}
    assert parts["Place"]["description"] == "Where it is."
    assert parts["Error"]["description"] == "How wrong it is."
    assert {*parts["Place"]["required"]} == {"p_mm", "error_deg", "count", "weight", "names", "is_far"}
    assert "hidden" not in {each.name for each in list_members(Place)}
