"""The catalog that is shipped: all words, small, and what would be built today."""

from __future__ import annotations

import pytest

from hrsynth.catalog import load
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.build import check
from hrsynth.catalog.groups import EVERY
from hrsynth.catalog.store import locate_shipped_folder

pytestmark = pytest.mark.skipif(not locate_shipped_folder().groups(), reason="no catalog is shipped yet")
LARGEST = 10_000_000
"""Bytes of all files."""


def test_the_files_are_those_of_the_groups_and_small():
    assert locate_shipped_folder().groups() == sorted(EVERY)
    assert sum(file.stat().st_size for file in locate_shipped_folder().path.glob("*.jsonl*")) <= LARGEST


@pytest.mark.slow
def test_all_words_are_there_and_sorted():
    assert check(locate_shipped_folder(), sample=0) == ()


@pytest.mark.slow
def test_words_are_canonical_and_in_one_group():
    words = [word for group in EVERY for word in load(group=group).words]
    assert len(set(words)) == len(words)
    assert all(str(parse(word)) == word for word in words[::37])


@pytest.mark.slow
def test_some_records_are_fresh():
    assert check(locate_shipped_folder(), sample=3, seed=len(load())) == ()


@pytest.mark.long
@pytest.mark.timeout(43_200)
def test_all_records_are_fresh():
    assert check(locate_shipped_folder(), workers=2) == ()
