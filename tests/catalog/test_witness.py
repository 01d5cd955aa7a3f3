"""What the oracle says of records."""

from __future__ import annotations

import pytest

from catalog.witness import Witness
from hrsynth.catalog import load


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
