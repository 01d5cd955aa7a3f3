"""Lists of modes have the counts of natural coordinates, which know no types of legs."""

from __future__ import annotations

import numpy as np
import pytest

import hrsynth
from analysis.modes.natural import count_modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.mechanism import Mechanism
from kinematics.robots import ROBOTS
from strategies import planar, pods

SETS = [
    ("gough_stewart", ("1", "3", "5")),
    ("hexa", ("1", "3", "5")),
    ("quattro", ("1", "4")),
    ("quattro_rigid", ("1", "3")),
    ("delta", ("1", "2")),
    ("3rrr_m1", ("1", "2")),
]
WORDS = [("RRR", "RRR", "RRR"), ("RPR", "RRR", "PRR"), ("PRR", "PRR", "RPR"), ("RRR", "RRR")]
PODS = [("UPS",) * 6, ("RPS",) * 3, ("UPS", "UPS", "RPS", "RPS")]


def compare(robot: Mechanism, legs: tuple[str, ...] | None, real: bool) -> bool:
    """Check the counts of a list; True if both have one."""
    setup = ObservedRobot.of(robot, legs, samples=150, driven=real)
    counted, listed = count_modes(setup, real, hull=True), hrsynth.modes(robot, legs, real=real)
    if listed.complex is None:  # a family, or more than one method finds
        return False
    if counted is None:
        return False
    _, every, actual = counted
    assert (every, actual) == (listed.complex, len(listed.modes))
    return True


@pytest.mark.some(4)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robots_have_the_modes_of_their_joint_graph(name: str, real: bool):
    found = compare(hrsynth.load(name), None, real)
    family = {"3ppr_m1", "3ppr_m2", "3prp", "3rrp", "hexaglide", "i4l", "uranesx"}
    assert found == (real or not (name in family or "parallel" in name))


@pytest.mark.some(2)
@pytest.mark.parametrize(("name", "legs"), SETS)
def test_some_legs_have_them_too(name: str, legs: tuple[str, ...]):
    assert compare(hrsynth.load(name), legs, real=False) == (name != "3rrr_m1")  # a family


@pytest.mark.some(3)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("words", [*WORDS, *PODS], ids="-".join)
def test_random_robots_have_them(words: tuple[str, ...], seed: int, real: bool):
    rng = np.random.default_rng(seed)
    motors = [(0,)] * 3 if len(words) == 3 else [(0,), (0, 1)]
    robot = pods(words, rng, square=True) if words in PODS else planar(words, rng, motors)
    family, too_many_paths = words == WORDS[-1] and not real, "UPS" in words and real
    assert compare(robot, None, real) != (family or too_many_paths)
