"""Many texts at once are searched as each by itself."""

from __future__ import annotations

import re
from fnmatch import translate

import numpy as np
import pytest
from hrsynth.catalog.search import Texts, narrow_type
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.catalog import search

LETTERS = st.text(st.sampled_from("abR*?[-(\n\0\u00df\u20ac\udcff"), max_size=12)
PLAIN = st.text(st.sampled_from("ab-R"), max_size=60)
PATTERN = st.text(st.sampled_from("abR**??[-\n\u20ac"), max_size=9)
MANY = st.one_of(st.lists(PLAIN, max_size=30), st.lists(LETTERS, max_size=12))


def fits(text: str, pattern: str) -> bool:
    return re.match(translate(pattern.replace("[", "[[]")), text) is not None


@given(every=MANY, pattern=st.one_of(PATTERN, PLAIN), data=st.data())
def test_texts_fit_a_pattern_as_each_does(every: list[str], pattern: str, data: st.DataObject):
    texts = Texts.of(every)
    assert list(texts) == every
    assert texts.matching(pattern).tolist() == [fits(text, pattern) for text in every]
    places = sorted(data.draw(st.sets(st.integers(0, max(0, len(every) - 1)), max_size=len(every)))) if every else []
    some = texts.at(np.array(places, int))
    assert some.matching(pattern).tolist() == [fits(every[i], pattern) for i in places]
    assert some.holding(pattern).tolist() == [pattern in every[i] for i in places]


def test_texts_beyond_those_that_are_compared_together_are_found(monkeypatch: pytest.MonkeyPatch):
    every = [f"{i}-{i * i}" for i in range(50)]
    for count in (1, 7, 50, 51):
        monkeypatch.setattr(search, "AT_ONCE", count)
        assert Texts.of(every).matching("*4-1*").tolist() == [fits(text, "*4-1*") for text in every]


@given(every=MANY, text=st.one_of(LETTERS, PLAIN), data=st.data())
def test_a_text_is_found_where_it_occurs(every: list[str], text: str, data: st.DataObject):
    if every and data.draw(st.booleans()):
        other = data.draw(st.sampled_from(every))
        text = other[data.draw(st.integers(0, len(other))) :]
    assert Texts.of(every).holding(text).tolist() == [text in each for each in every]


@given(st.lists(st.integers(0, 2**32 - 1), max_size=5))
def test_numbers_are_kept_in_as_few_bytes_as_hold_them(numbers: list[int]):
    found = narrow_type(np.array(numbers, np.int64))
    assert found.tolist() == numbers
    assert found.itemsize == max([1, *(1 if each < 2**8 else 2 if each < 2**16 else 4 for each in numbers)])
