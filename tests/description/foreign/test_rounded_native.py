"""Native files of rounded numbers are read as files of other tools are: closed, made exact, the same structure."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.foreign.rounded import exported
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.errors import LoopClosureFailure
from hrsynth.mechanism import Mechanism
from strategies import deltas, planar, pods

WORDS = (
    "RRR",
    "RPR",
    "PRR",
    "PPR",
    "PRP",
    "RRP",
    "6-UPS",
    "3-RPS",
    "3-UPU",
    "6-SPS",
    "R 2-SS",
    "P 2-SS",
    "R UU",
    "P UU",
    "R US",
    "P US",
)
DECIMALS = (9, 7, 6, 5)


@cache
def robot(word: str) -> Mechanism:
    """A robot of random dimensions, its links' frames random too."""
    rng = np.random.default_rng(WORDS.index(word) + 31)
    if word[1] == "-":
        return pods((word[2:],) * int(word[0]), rng)
    if " " not in word:
        return planar((word,) * 3, rng, [{word.index("P") if word == "RPR" else 0}] * 3)
    base, rods = word.split()
    count = 6 if rods == "US" else 3
    return deltas((base,) * count, (rods,) * count, rng, aligned=True)


def answer(robot: Mechanism) -> tuple[object, ...]:
    """The hidden architecture, mobility and verdict, which must not depend on the digits."""
    found = ObservedRobot.of(robot, samples=3)
    derived = hrsynth.derive(robot)
    return str(found.decomposition.architecture()), found.mobility, derived.hidden_architecture, derived.verdict.word


@pytest.mark.some(3, 12)
@pytest.mark.parametrize("decimals", DECIMALS)
@pytest.mark.parametrize("word", WORDS)
def test_the_structure_does_not_depend_on_the_digits(word: str, decimals: int, tmp_path: Path):
    path = exported(robot(word), tmp_path / "robot.urdf", decimals)
    assert answer(load(path)) == answer(robot(word))


@pytest.mark.some(1, 6)
@pytest.mark.parametrize("word", WORDS)
def test_where_only_the_lengths_are_rounded(word: str, tmp_path: Path):
    """Directions of many digits hide how coarse the others are: the loops are closed by moving joints, and that is
    said, as for the same file in another dialect; but not as it is written."""
    path = exported(robot(word), tmp_path / "robot.urdf", 14)
    text = path.read_text()
    for each in sorted({each.split('"')[0] for each in text.split('xyz="')[1:]}, key=len, reverse=True):
        text = text.replace(f'"{each}"', '"' + " ".join(f"{float(x):.6g}" for x in each.split()) + '"')
    path.write_text(text)
    with pytest.raises(LoopClosureFailure, match="--tolerance"):
        load(path, as_written=True)
    found = load(path)
    assert answer(found) == answer(robot(word))
    other = load(path, platform=robot(word).platform)
    assert [note.text for note in found.notes] == [note.text for note in other.notes]
