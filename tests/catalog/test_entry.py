"""Entries: the papers' lists fall out of them, and they agree with the shipped robots, which were drawn by others."""

import json
import random
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hrsynth.analysis.derive import derive
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.catalog.architecture_key import ArchitectureKey, LegKey, parse
from hrsynth.catalog.entry import build_entry, choose_study_model
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import GROUPS, words
from hrsynth.catalog.groups.planar import chains
from hrsynth.description import load
from hrsynth.errors import BadRequest
from hrsynth.kinematics.velocity_relation import compute_relation
from oracle import Oracle

SHIPPED = {
    "3rrr_m1": "3(Rz*-Rz-Rz)",
    "3rrr_m2": "3(Rz-Rz*-Rz)",
    "3rpr_m1": "3(Rz*-Pl-Rz)",
    "3rpr_m2": "3(Rz-Pl*-Rz)",
    "3prr_m1": "3(Ph*-Rz-Rz)",
    "3prr_m2": "3(Ph-Rz*-Rz)",
    "3ppr_m1": "3(Ph*-Pj-Rz)",
    "3ppr_m2": "3(Ph-Pj*-Rz)",
    "3prp": "3(Ph*-Rz-Pj)",
    "3rrp": "3(Rz*-Rz-Ph)",
    "gough_stewart": "6(Utn-Pl*-S)",
    "3upu": "3(Utn-Pl*-Unt)",
    "3rps": "3(Rt-Pl*-S)",
    "delta": "3(Rt*-2SSt)",
    "quattro_rigid": "4(Rt*-2SSt)",
    "quattro": "bar:2(Rt*-2SSt)|2(Rt*-2SSt)",
    "orthoglide": "(Px*-2SSy)+(Py*-2SSz)+(Pz*-2SSx)",
    "linear_delta": "3(Pk*-2SSt)",
    "uranesx": "3(Pz*-2SSt)",
    "i4l": "slide:2(Px*-2SSt)|2(Px*-2SSt)",
    "3ruu": "3(Rt*-Utn-Unt)",
    "3puu": "3(Pk*-Utn-Unt)",
    "hexa": "6(Rt*-Utn-S)",
    "hexaglide": "6(Px*-Uyn-S)",
    "6pus": "6(Pk*-Utn-S)",
}
"""Shipped robots of which every special relation is said by a word."""


QUICK = ("3rps", "uranesx")
TWO_FIRST = [pytest.param(name, marks=pytest.mark.slow) if name in ("pods", "deltas") else name for name in GROUPS]
"""The groups, two left to the slow tests."""


@pytest.mark.some(1, 6)
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in SHIPPED])
def test_an_entry_says_what_the_shipped_robot_says(name):
    found, robot = build_entry(SHIPPED[name]), derive(load(name))
    assert found["notation"] == robot.architecture.ascii
    hidden = None if robot.hidden_architecture is None else robot.hidden_architecture.ascii
    assert found["hidden"] == hidden
    assert (found["verdict"], found["rank"], found["dof"]) == (robot.verdict.verdict, robot.verdict.rank, robot.dof)
    assert (found["mobility"], found["internal"]) == (robot.mobility.total, robot.mobility.internal)
    assert found["exact"]
    assert found["driven"]


def _symmetric(platform, motors):
    """The symmetric planar robots of seven chains, their entries by (chain, motor)."""
    table = {}
    for chain in chains():
        letters = "".join(joint.letter for joint in chain.joints)
        if platform and letters[-1] != "R":
            continue
        for motor in range(motors):
            leg = LegKey(
                tuple(joint.__class__(joint.letter, joint.axes, i == motor) for i, joint in enumerate(chain.joints))
            )
            table[letters, motor] = build_entry(
                str(ArchitectureKey.of([leg] * (2 if platform else 3), platform=platform))
            )
    return table


@pytest.mark.slow
def test_table_1_falls_out():
    """MMT 4.1.1: of 21 chains with a motor those that can be driven, alike up to exchange of base and platform, are
    ten; of two that are alike the one with the motor nearer to the base, then with the first joint a P, is printed."""
    table = _symmetric("", 3)
    driven = {key for key, found in table.items() if found["driven"]}
    chosen = set()
    for letters, motor in driven:
        chosen.add(min([(letters, motor), (letters[::-1], 2 - motor)], key=lambda key: (key[1], key[0])))
    assert {f"{word[: motor + 1]}*{word[motor + 1 :]}" for word, motor in chosen} == {
        "R*RR",
        "RR*R",
        "R*PR",
        "RP*R",
        "P*RR",
        "PR*R",
        "P*PR",
        "PP*R",
        "P*RP",
        "R*RP",
    }
    legs = {f"{word[: motor + 1]}*{word[motor + 1 :]}": table[word, motor]["hidden"] for word, motor in chosen}
    assert legs == {
        "R*RR": "3-PiR*R",
        "RR*R": "3-PiR*R",
        "R*PR": "3-R*PR",
        "RP*R": "3-R*PR",
        "P*RR": "3-PR*R",
        "PR*R": "3-PR*R",
        "P*PR": None,
        "PP*R": None,
        "P*RP": "3-PR*P",
        "R*RP": "3-PiR*P",
    }


@pytest.mark.slow
def test_the_twelve_symmetric_planar_robots_fall_out():
    """MMT 4.1.2: motors on the base or on the second joint, all legs observed at their last segment."""
    found = {
        each["notation"]
        for platform in ("", "point")
        for (letters, _), each in _symmetric(platform, 2).items()
        if each["verdict"] == "controllable" and each["driven"]
    }
    assert found == {
        "R*RRRR*",
        "RR*RR*R",
        "R*PRPR*",
        "RP*RP*R",
        "P*RRRP*",
        "PR*RR*P",
        "3-R*RR",
        "3-RR*R",
        "3-R*PR",
        "3-RP*R",
        "3-P*RR",
        "3-PR*R",
    }


def test_what_is_driven_changes_nothing_else():
    can_be_driven = [text for text in words("planar") if "(Pi" not in text]
    for text in random.Random(1).sample(can_be_driven, 3):
        word = parse(text)
        other = str(
            ArchitectureKey.of(
                [
                    LegKey(
                        tuple(
                            joint.__class__(joint.letter, joint.axes, i == 0, joint.watched)
                            for i, joint in enumerate(leg.joints)
                        )
                    )
                    for leg in word.legs
                ],
                platform=word.platform,
            )
        )
        one, two = build_entry(text), build_entry(other)
        for field in one.keys() - {"key", "notation", "motors", "motor_rank", "driven", "base_motors"}:
            assert one[field] == two[field]


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("part", range(10))
def test_fifty_entries_are_the_same_in_another_process(part: int):
    chosen = random.Random(11).sample([word for name in GROUPS for word in words(name)], 50)[part::10]
    code = (
        "import json, sys; from hrsynth.catalog.entry import build_entry; "
        "[print(json.dumps(build_entry(line.strip()), sort_keys=True)) for line in sys.stdin]"
    )
    there = subprocess.run(
        [sys.executable, "-c", code], input="\n".join(reversed(chosen)), text=True, capture_output=True, check=True
    ).stdout.splitlines()
    assert there == [json.dumps(build_entry(word), sort_keys=True) for word in reversed(chosen)]


@pytest.mark.some(1)
@pytest.mark.parametrize("name", TWO_FIRST)
def test_verdicts_are_exact_and_confirmed(name):
    for text in random.Random(2).sample(words(name), 3):
        found = build_entry(text)
        assert "refused" in found or (found["exact"] and found["confirmed"] >= 5)
        if "refused" not in found:
            assert (
                (found["verdict"] == "controllable") == (found["rank"] == found["dof"]) == (found["suggestion"] is None)
            )
            assert found["modes_seen"] is None or 1 <= found["modes_seen"] <= found["modes_bound"]


def test_what_does_not_move_has_no_verdict():
    assert build_entry("3(Pz*-S)+3(Rt*-S)")["refused"].startswith("its loops let no link move")
    other = build_entry("3(Ra*-Ra-Ra-Ra-Rb)")["refused"]  # each leg is a four-bar whose coupler is not watched
    assert other.startswith("neither the platform nor an observed segment moves, but other links do (link_1_1, ")
    with pytest.raises(BadRequest):
        build_entry("3(Rz*-Q-Rz)")


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("name", TWO_FIRST)
def test_screws_without_pinocchio_see_the_same(name):
    """In maximal coordinates: dof, mobility and rank of all legs and of a smallest set, beside the zero configuration.
    At zero, where a rank is less if the word makes it special (slides normal to z in all legs), Pinocchio's there."""
    for text in random.Random(7).sample(words(name), 3):
        found = build_entry(text)
        if "refused" in found:
            continue
        setup = ObservedRobot.of(build_mechanism(parse(text)), samples=1)
        oracle = Oracle(setup.mechanism)
        start, question = setup.all_samples.start, setup.all_samples.observation_model
        sets = [setup.segments, *([o for o in setup.segments if o.leg in each] for each in found["minimal"])]
        for state in (oracle.zero(), *oracle.random_walk(np.random.default_rng(1), 1)):
            assert oracle.mobility(state) == found["mobility"]
            for seen in sets:
                point = setup.decomposition.point is not None
                basis = oracle.relation(state, seen, point_only=point)
                size = 3 if point else 6
                assert _rank(basis[:size]) == found["dof"]
                rank = _rank(basis[:size]) - (basis.shape[1] - _rank(basis[size:]))
                special = compute_relation(start, replace(question, observations=tuple(seen))).rank
                assert rank == (special if np.array_equal(state, oracle.zero()) else found["rank"]), text
                assert special <= found["rank"]


def _rank(rows):
    return int(np.linalg.matrix_rank(rows, tol=1e-8))


@pytest.mark.parametrize(
    ("word", "own"), [("3(Rz-Rz*-Rz)", False), ("3(Ra*-Ro-Ro-Ro)", False), ("3(Ra-Ro*-Ro-Ro)", True)]
)
def test_motors_count_where_they_keep_joints_apart(word, own):
    assert str(choose_study_model(parse(word))) == (word if own else str(parse(word).driven))
