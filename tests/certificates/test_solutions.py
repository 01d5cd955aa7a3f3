"""Certificates of all real solutions in natural coordinates: accepted as they are, refused where they are false."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hrsynth
from adversary.kinds import KINDS
from analysis.modes import gears
from analysis.modes.ankles import ankle
from families.test_linkages import LISTED, drawn
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.natural_modes import NaturalPlatform, solve_natural
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.certificates import verify_solutions as checker
from hrsynth.certificates.solution_records import build_record
from hrsynth.errors import InvalidCertificate
from hrsynth.kinematics.goal_error import drift
from hrsynth.mechanism import Mechanism

Record = dict[str, Any]


def linkage(name: str) -> Mechanism:
    made, zero, tilt = drawn(name, 1)
    return made.mechanism(name, zero, tilt)


ROBOTS: dict[str, tuple[Callable[[], Mechanism], bool, int]] = {
    "five-bar": (lambda: hrsynth.load("rrrrr_m1"), True, 2),
    "3-RRR": (lambda: hrsynth.load("3rrr_m1"), False, 2),
    "ankle": (lambda: ankle("SPU", 1, offset=0.05)[0], True, 4),
    **{name: (lambda name=name: linkage(name), True, count) for name, count in LISTED.items()},  # type: ignore[misc]
}


def seal(record: Record) -> Record:
    """The record with its digest."""
    return {**record, "sha256": checker.digest(record)}


@cache
def certified(name: str) -> str:
    """The certificate of a robot's list in natural coordinates, as text."""
    made, real, _ = ROBOTS[name]
    setup = ObservedRobot.of(made(), driven=real)
    goal = setup.all_samples.start
    model, found = solve_natural(MeasuredRobot.of(setup, real), goal, drift(goal, None, setup.normal.moved))
    assert isinstance(model.system, NaturalPlatform)
    record = build_record(model.system, [mode.q for mode in found.modes])
    return json.dumps(seal({"format": "hrsynth-certificate-1", "claim": "solutions", **record}))


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ROBOTS)
def test_lists_are_accepted(name: str):
    record, count = json.loads(certified(name)), ROBOTS[name][2]
    said = checker.verify(record)
    assert said.startswith(
        f"{count} real pose{'s' * (count != 1)}, and no other among those of its equations within the bounds of the "
        "unknowns, to 1e-"
    )


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_list_without_one_of_its_poses_is_refused(name: str):
    """Or with one that is moved, or twice."""
    record = json.loads(certified(name))
    for k in {0, len(record["solutions"]) - 1}:
        less = copy.deepcopy(record)
        x = less["solutions"].pop(k)
        with pytest.raises(checker.SolutionsRejection):
            checker.verify(seal(less))
        less["solutions"] += [record["solutions"][0], record["solutions"][0]]
        with pytest.raises(checker.SolutionsRejection):
            checker.verify(seal(less))
        away = copy.deepcopy(record)
        away["solutions"][k] = [str(Fraction(v) + Fraction(1, 1000)) for v in x]
        with pytest.raises(checker.SolutionsRejection):
            checker.verify(seal(away))


def leaves(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The places of all numbers of a record."""
    if isinstance(part, dict):
        return [at for key, each in part.items() for at in leaves(each, (*path, key))]
    if isinstance(part, list):
        return [at for k, each in enumerate(part) for at in leaves(each, (*path, k))]
    return [path]


def change(record: Record, rng: random.Random) -> None:
    """Change one number of the proof, or drop, repeat or exchange parts of it."""
    places = leaves(record["proof"])
    *path, last = rng.choice(places)
    part = record["proof"]
    for key in path:
        part = part[key]
    value = part[last]
    if isinstance(value, str) and not value.isalpha():
        factor = rng.choice([-1, 0, 2, Fraction(1, 2), 1 + Fraction(1, 2 ** rng.randint(1, 50)), 1000])
        part[last] = str(Fraction(value) * factor + rng.choice([0, 0, 1, -1]))
    elif isinstance(value, str):
        part[last] = rng.choice(["none", "one", "cases", "algebra"])
    else:
        part[last] = value + rng.choice([-1, 1])
    holders = [at for at in {tuple(place[:k]) for place in places for k in range(1, len(place))}]
    if rng.random() < 0.3:
        part = record["proof"]
        for key in rng.choice(holders):
            part = part[key]
        if isinstance(part, list) and part:
            k = rng.randrange(len(part))
            action = rng.randrange(3)
            if action == 0:
                del part[k]
            elif action == 1:
                part.append(copy.deepcopy(part[k]))
            else:
                part[k], part[0] = part[0], part[k]


def attack(name: str, tries: int, seed: int) -> int:
    """Change proofs of lists without their last pose; the number that is refused."""
    whole = json.loads(certified(name))
    if len(whole["solutions"]) > 1:
        whole["solutions"].pop()
    else:  # the goal's place is taken by a pose that is none
        whole["solutions"][0] = [str(Fraction(v) + Fraction(1, 500)) for v in whole["solutions"][0]]
    refused, rng = 0, random.Random(seed)
    for _ in range(tries):
        record = copy.deepcopy(whole)
        for _ in range(rng.randint(1, 4)):
            change(record, rng)
        try:
            checker.verify(seal(record))
        except checker.SolutionsRejection:
            refused += 1
    return refused


@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["five-bar", "sarrus", "schatz"])
def test_a_changed_proof_proves_nothing_false(name: str):
    assert attack(name, 40, 1) == 40


@pytest.mark.long
def test_ten_thousand_changed_proofs():
    assert sum(attack(name, 5000, seed) for seed, name in enumerate(["five-bar", "sarrus"])) == 10_000


FORGERIES: dict[str, Callable[[Record], None]] = {
    "no cases": lambda r: r["proof"].update(cases=[]),
    "one case": lambda r: r["proof"]["cases"].pop(),
    "the same case twice": lambda r: r["proof"]["cases"].__setitem__(1, r["proof"]["cases"][0]),
    "intervals exchanged": lambda r: r["proof"]["cases"].reverse(),
    "an interval of no length": lambda r: r["proof"]["cases"][0].update(interval=["1", "1"]),
    "an interval beside the zero": lambda r: r["proof"]["cases"][0].update(interval=["2", "3"]),
    "a case that has none": lambda r: r["proof"]["cases"][0].update(node={"rounds": [], "kind": "none", "weights": []}),
    "a contradiction from nothing": lambda r: r["proof"].update(kind="none", weights=[]),
    "nothing left": lambda r: r["proof"].update(kind="one"),
    "no rounds": lambda r: r["proof"].update(rounds=[]),
    "another unknown": lambda r: r["proof"].update(unknown=0),
    "an equation that there is not": lambda r: r["proof"]["rounds"][0][0][1][0].__setitem__(0, -1),
    "no solutions": lambda r: r.update(solutions=[]),
    "no digits": lambda r: r.update(digits=0),
    "negative errors": lambda r: r["system"].update(errors=["-1"] * len(r["system"]["errors"])),
    "no pose": lambda r: r["system"].update(pose=[]),
    "another format": lambda r: r.update(format="x"),
    "another claim": lambda r: r.update(claim="modes"),
    "a term twice": lambda r: r["system"]["equations"][0].append(r["system"]["equations"][0][0]),
    "a number in words": lambda r: r["system"]["errors"].__setitem__(0, "nan"),
    "a number that is none": lambda r: r["system"]["errors"].__setitem__(0, 0.5),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_forgeries_are_refused(name: str):
    record = json.loads(certified("five-bar"))
    FORGERIES[name](record)
    with pytest.raises(checker.SolutionsRejection):
        checker.verify(seal(record))


ALGEBRA: dict[str, Callable[[Record, int], Any]] = {
    "an eigenvalue called complex": lambda node, k: node["eigenvalues"][k].__setitem__(1, "1/100"),
    "a vector without its first part": lambda node, k: node["V"][0].__setitem__(k, ["0", "0"]),
    "a vector that is zero": lambda node, k: [row.__setitem__(k, ["0", "0"]) for row in node["V"]],
    "an inverse without a row": lambda node, k: node["W"].__setitem__(k, [["0", "0"]] * len(node["basis"])),
    "an eigenvalue less": lambda node, k: node["eigenvalues"].pop(k),
    "a monomial less": lambda node, k: node["basis"].pop(),
    "a sum of nothing": lambda node, k: node.update(sum=["0"] * len(node["sum"])),
    "a negative power": lambda node, k: node["multiples"][0][0].__setitem__(1, [-1] + [0] * (len(node["sum"]) - 1)),
    "a broken power": lambda node, k: node["multiples"][0][0].__setitem__(1, [0.5] + [0] * (len(node["sum"]) - 1)),
    "no multiples": lambda node, k: node.update(multiples=[[]] * len(node["multiples"])),
}


@pytest.mark.parametrize("name", ALGEBRA)
def test_no_eigenvalue_is_left_out(name: str):
    record = json.loads(certified("3-RRR"))
    record["solutions"].pop()
    ALGEBRA[name](record["proof"], record["proof"]["inverses"][-1]["eigenvalue"])
    with pytest.raises(checker.SolutionsRejection):
        checker.verify(seal(record))


@pytest.mark.slow
def test_the_command_writes_one_that_is_tied_to_its_robot(tmp_path: Path):
    """A 4-RUU robot; not for another one."""
    for seed in (0, 1):
        (tmp_path / f"{seed}.urdf").write_text(
            KINDS["schoenflies"](np.random.default_rng(seed)).text(), encoding="utf-8"
        )
    record = hrsynth.certificate(hrsynth.modes(tmp_path / "0.urdf", cone=0))
    (tmp_path / "c.json").write_text(json.dumps(record), encoding="utf-8")
    said = hrsynth.verify(tmp_path / "c.json", tmp_path / "0.urdf")
    assert said.startswith("1 real pose, and no other among poses in space within the bounds of the unknowns, to 1e-")
    with pytest.raises(InvalidCertificate, match="not for"):
        hrsynth.verify(record, tmp_path / "1.urdf")


def test_a_proof_among_poses_that_keep_directions_says_so():
    """A parallelogram's crossed form is beyond a list among poses with one rotation, and beyond its certificate."""
    corners = [(0, 0), (0, 1), (2, 1), (2, 0)]
    links = {"base": (0, 3), "crank": (0, 1), "bar": (1, 2), "rocker": (2, 3)}
    bar, rocker = (gears.linkage(corners, links, platform, "j0") for platform in ("bar", "rocker"))
    kept, whole = (hrsynth.modes(robot, real=True, cone=0) for robot in (bar, rocker))
    assert (len(kept.modes), len(whole.modes)) == (1, 2)
    record = hrsynth.certificate(kept)
    assert "keep the directions" in hrsynth.verify(record, bar)
    del record["within"]
    record["sha256"] = checker.digest(record)
    assert "among those of its equations" in hrsynth.verify(record)
    with pytest.raises(InvalidCertificate, match="not for"):
        hrsynth.verify(record, bar)


def test_equations_beside_those_of_a_robot_do_not_leave_a_pose_out():
    """Moved by less than what is compared, two numbers leave the goal alone: its other pose is missing in the file."""
    listed = hrsynth.modes("3rrr_m1", real=True, cone=0)
    true = hrsynth.certificate(listed)
    measured = MeasuredRobot.of(listed.setup, True)
    system = solve_natural(measured, listed.goal, drift(listed.goal, None, listed.setup.normal.moved))[0].system
    assert isinstance(system, NaturalPlatform)
    x, matrices = np.append(1.0, system.view.goal), system.view.matrices.copy()
    (p, q), M = np.argwhere(np.triu(matrices[56]) != 0)[:2], matrices[56]
    a, b = x[p[0]] * x[p[1]], x[q[0]] * x[q[1]]
    for (i, j), d in ((p, b), (q, -a)):
        M[i, j] += d / max(abs(a), abs(b)) * 5e-8
        M[j, i] = M[i, j]
    view = replace(system.view, matrices=matrices)
    record = true | build_record(replace(system, view=view), [system.view.goal])
    assert len(record["solutions"]) == 1 < len(true["solutions"])
    with pytest.raises(InvalidCertificate, match="not for"):
        hrsynth.verify(seal(record), "3rrr_m1")
