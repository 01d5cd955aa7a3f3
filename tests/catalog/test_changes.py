"""What the oracle says of records, and the page of those that changed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from catalog import changes
from catalog.witness import Witness
from hrsynth.catalog import load
from hrsynth.present.markdown import block

PAGE = Path(__file__).resolve().parents[2] / "docs" / "pages" / "catalog-changes.md"


def record(word: str) -> dict:
    return dict(load()[word])


@pytest.mark.some(1)
@pytest.mark.parametrize("word", ["3(Rz*-Rz-Rz)", "3(Ra*-Rb-Ra-Ph-Ra)", "2(Pz*-Utn-Unt)+(Rt*-2SSt)+(Rt*-Utn-S)"])
def test_the_oracle_agrees_with_a_record(word: str):
    assert list(Witness(record(word)).complaints()) == []


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "false", [{"mobility": 4}, {"dof": 2}, {"rank": 2}, {"motion": "3R"}, {"minimal": [["1", "2"]], "fewest": 2}]
)
def test_the_oracle_finds_a_false_record(false: dict):
    assert list(Witness({**record("3(Rz*-Rz-Rz)"), **false}).complaints())


def test_the_oracle_finds_modes_and_singular_values():
    witness = Witness(record("3(Rz-Pl*-Rz)"))
    assert witness.modes(witness.states[0]) == witness.record["modes_bound"] == 2
    assert 1e-3 < witness.weakest() < 1


def test_a_record_that_changed_has_one_reason():
    old = {"word": "w", "minimal": [["1"]], "condition": "a", "hidden": "h"}
    assert changes.reason(old, {**old, "minimal": [["1", "2"]], "condition": "b"}) == changes.MODE
    assert changes.reason(old, {"word": "w", "refused": "so"}) == changes.REFUSED
    assert changes.told(old, {**old, "condition": "b"}) == "condition: a → b"
    with pytest.raises(StopIteration):
        changes.reason(old, {**old, "dof": 4})


def test_the_page_lists_as_many_words_as_its_table_counts():
    page = block(PAGE.read_text(encoding="utf-8"), changes.START)
    counts = list(map(int, re.findall(r"(\d+) \|$", page, re.MULTILINE)))
    parts = [len(re.findall(r"`[^`]+`", part)) for part in page.split("\n## ")[1:]]
    assert counts == [*parts, sum(parts)]
    assert set(re.findall(r"`([^`]+)`", page)) <= set(load().words)
