"""A short run of the mutations; ``make fuzz`` makes 100,000."""

from __future__ import annotations

from collections import Counter

import pytest

from description.foreign.examples import FILES
from description.foreign.fuzz import check_valid, outcomes
from description.foreign.test_dialects import written
from hrsynth.description import load


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_damaged_files_are_read_or_refused(seed: int):
    counts: Counter[str] = Counter()
    for outcome, files, _ in outcomes(150, seed):
        assert outcome in ("0", "2", "3"), (outcome, files)
        counts[outcome] += 1
    assert counts["0"] >= 10
    assert counts["2"] >= 50


@pytest.mark.some(10)
@pytest.mark.parametrize("name", FILES)
def test_what_is_read_is_valid(name: str, tmp_path):
    robot = load(written(tmp_path, FILES[name]))
    check_valid(robot)
    assert robot.notes
