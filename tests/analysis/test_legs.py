"""The verdict of every set of observed legs: what the theory says for whole families, and what any verdict obeys."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from math import comb

import numpy as np
import pytest

import hrsynth
from analysis.singularity.found import found as found_singular
from hrsynth.analysis.controllability import Legs, legs
from hrsynth.analysis.freedoms import name_freedoms
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import AT_REST, BLIND, CONTROLLABLE, PARTIAL, Verdict
from hrsynth.description import load
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Direction, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.tolerances import RANK_GAP_MIN
from kinematics.robots import setting_of, state_of
from oracle import Oracle


@cache
def found(robot: str) -> Legs:
    return legs(load(robot))


def table_of(answer: Legs) -> dict[tuple[str, ...], Verdict]:
    return {each.legs: each for each in answer.sets}


def table(robot: str) -> dict[tuple[str, ...], Verdict]:
    return table_of(found(robot))


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "robot",
    [
        "quattro",
        "quattro_rigid",
        "delta",
        "orthoglide",
        "gough_stewart",
        "3rrr_m1",
        "i4l",
        "hexaglide",
        "3ppr_m1",
        "prrrp_parallel_point",
        "3upu",
    ],
)
def test_all_sets_obey(robot: str) -> None:
    """All sets are there, ranks grow with the sets, verdicts follow from ranks, the smallest of the best are listed,
    none where no leg shows anything."""
    answer, sets = found(robot), table(robot)
    labels = tuple(each.legs[0] for each in answer.sets if len(each.legs) == 1)
    assert answer.complete
    assert len(sets) == 2 ** len(labels) - 1
    for chosen, verdict in sets.items():
        assert verdict.dof == answer.dof
        assert verdict.gap > RANK_GAP_MIN
        assert verdict.rank + len(verdict.unobserved) == answer.dof
        assert verdict.verdict == (CONTROLLABLE if verdict.rank == answer.dof else PARTIAL if verdict.rank else BLIND)
        for fewer in combinations(chosen, len(chosen) - 1):
            if fewer:
                assert sets[fewer].rank <= verdict.rank
        if verdict.unobserved:
            twists = np.column_stack([freedom.twist for freedom in verdict.unobserved])
            assert np.linalg.matrix_rank(twists) == len(verdict.unobserved)
            assert len({freedom.name for freedom in verdict.unobserved}) == len(verdict.unobserved)
    best = max(each.rank for each in answer.sets)
    size = min(len(each) for each, verdict in sets.items() if verdict.rank == best)
    assert set(answer.minimal) == {
        each for each, verdict in sets.items() if best and verdict.rank == best and len(each) == size
    }


def lost_by_oracle(setup: ObservedRobot, chosen: tuple[str, ...]) -> Array:
    """The platform twists (metres) that these legs do not see at the zero configuration, by the oracle."""
    all_samples = setup.all_samples
    observations = [o for o in all_samples.observation_model.observations if o.leg in chosen]
    oracle = Oracle(all_samples.model.mechanism)
    basis = oracle.relation(state_of(all_samples.model, all_samples.model.q0), observations, unit_length=1.0)
    _, values, right = np.linalg.svd(basis[6:])
    kernel = right[int(np.sum(values > 1e-8)) :].T
    U, values, _ = np.linalg.svd(basis[:6] @ kernel, full_matrices=False)
    return np.asarray(U[:, values > 1e-8])


@pytest.mark.some(4)
@pytest.mark.parametrize(
    ("robot", "size"),
    [
        ("quattro", 1),
        ("quattro", 2),
        ("quattro_rigid", 1),
        ("delta", 1),
        ("gough_stewart", 1),
        ("gough_stewart", 2),
        ("3upu", 1),
    ],
)
def test_lost_freedoms_are_those_of_the_oracle(robot: str, size: int) -> None:
    for chosen, verdict in table(robot).items():
        if len(chosen) != size:
            continue
        lost = lost_by_oracle(setting_of(robot), chosen)
        assert lost.shape[1] == len(verdict.unobserved)
        for freedom in verdict.unobserved:
            twist = freedom.twist / np.linalg.norm(freedom.twist)
            assert np.linalg.norm(twist - lost @ (lost.T @ twist)) < 1e-6, freedom.name


DRAWN = np.random.default_rng(7).normal(size=(6, 3))


@pytest.mark.parametrize(
    ("robot", "lost"),
    [
        ("delta", np.eye(6)[:, :3]),
        ("delta", DRAWN[:, :2] * np.eye(6)[:, :3].sum(axis=1)[:, None]),
        ("delta", DRAWN),
        ("gough_stewart", DRAWN[:, :2]),
        ("gough_stewart", np.eye(6)),
        ("3rps", np.column_stack([np.eye(6)[:, 2], DRAWN])),
        ("gough_stewart", lost_by_oracle(setting_of("gough_stewart"), ("1",))),
    ],
)
def test_lost_freedoms_are_named_by_their_space_alone(robot: str, lost: np.ndarray) -> None:
    """Whatever basis rounding gives of it: their twists span it, and are the same for any other basis."""
    decomposition, length = setting_of(robot).decomposition, setting_of(robot).mechanism.length
    twists = np.linalg.qr(lost / np.repeat([[length], [1.0]], 3, axis=0))[0]
    named = name_freedoms(twists, decomposition)
    assert len(named) == lost.shape[1]
    assert np.linalg.matrix_rank(np.column_stack([lost, *(each.twist for each in named)]), tol=1e-8) == len(named)
    for seed in range(5):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(named), len(named))))[0]
        again = name_freedoms(twists @ turn, decomposition)
        assert [each.name for each in again] == [each.name for each in named]
        assert all(np.allclose(a.twist, b.twist, atol=1e-9) for a, b in zip(again, named, strict=True))


@pytest.mark.some(1)
@pytest.mark.parametrize(("robot", "singular"), [("3rps", "1,2,3"), ("gough_stewart", "1,2,3"), ("3rrr_m1", "1,2,3")])
def test_sets_that_see_less_at_zero_are_told(robot: str, singular: str) -> None:
    """At a pose that is singular with some legs watched, by the oracle there: of no other set less is told."""
    checked = found_singular(robot, singular).checked
    assert checked is not None
    at = checked.on_locus[0]
    answer = legs(robot, at=at.pose("platform"))
    assert all(each.rank_at_zero is None for each in found(robot).sets)
    for each in answer.sets:
        shown = each.dof - lost_by_oracle(answer.setup, each.legs).shape[1]
        assert each.rank_at_zero == (shown if shown < each.rank else None), each.legs
        assert each.to_dict().get("rank_at_zero", each.rank) == shown
    chosen = table_of(answer)[tuple(singular.split(","))]
    assert chosen.verdict == CONTROLLABLE
    assert chosen.rank_at_zero == chosen.dof - 1
    said = " ".join(hrsynth.text(answer).split())
    assert "a Type 2 singularity with these sets" in said
    assert f"{{{singular.replace(',', ', ')}}} ({chosen.dof - 1} of {chosen.dof})" in said
    assert "lower rank at" not in hrsynth.text(found(robot))


def test_quattro() -> None:
    """One leg on each half sees all four freedoms; two on one half leave the other half free to turn."""
    answer, sets = found("quattro"), table("quattro")
    assert answer.architecture == "4-R*-{2-SS}"
    assert answer.dof == 4
    assert set(answer.minimal) == {("1", "3"), ("1", "4"), ("2", "3"), ("2", "4")}
    for pair in (("1", "2"), ("3", "4")):
        assert sets[pair].rank == 3
        assert sets[pair].unobserved[0].name.startswith("rotation about")
        axis = sets[pair].unobserved[0].twist[3:]
        assert abs(axis[2]) == pytest.approx(np.linalg.norm(axis))
    assert all(sets[each].verdict == CONTROLLABLE for each in combinations("1234", 3))
    assert all(sets[(each,)].rank == 2 for each in "1234")


def test_quattro_rigid() -> None:
    """A platform that only translates: any two legs whose circles are not in parallel planes."""
    answer, sets = found("quattro_rigid"), table("quattro_rigid")
    assert answer.dof == 3
    assert set(answer.minimal) == set(combinations("1234", 2))
    for label in "1234":
        (lost,) = sets[(label,)].unobserved
        assert lost.name.startswith("translation along")
        np.testing.assert_allclose(lost.twist[3:], 0, atol=1e-9)


@pytest.mark.parametrize("robot", ["delta", "orthoglide"])
def test_two_legs_of_a_delta_suffice(robot: str) -> None:
    answer, sets = found(robot), table(robot)
    assert set(answer.minimal) == set(combinations("123", 2))
    for label in "123":
        (lost,) = sets[(label,)].unobserved
        assert sets[(label,)].rank == 2
        assert lost.name.startswith("translation along")


def test_a_leg_of_the_orthoglide_does_not_see_its_own_rail() -> None:
    sets = table("orthoglide")
    assert [sets[(each,)].unobserved[0].name for each in "123"] == [f"translation along {axis}" for axis in "xyz"]


def test_a_leg_of_the_delta_does_not_see_its_circle() -> None:
    """With its rod's direction fixed a leg lets the platform follow the elbow: normal to the arm and to the R axis."""
    setup, sets = setting_of("delta"), table("delta")
    for label in "123":
        shoulder = next(
            j for n in setup.decomposition.leg(label).joints if (j := setup.mechanism.joints[n]).predecessor == "base"
        )
        elbow = np.mean([j.point for j in setup.mechanism.joints_of(shoulder.successor) if j is not shoulder], axis=0)
        twist = sets[(label,)].unobserved[0].twist[:3]
        tangent = np.cross(shoulder.axis, elbow - shoulder.point)
        assert np.linalg.norm(np.cross(twist, tangent)) < 1e-9 * np.linalg.norm(twist) + 1e-9


def test_gough_stewart() -> None:
    """Three legs see all six freedoms; two leave the platform free to turn about the line of their ends."""
    answer, sets = found("gough_stewart"), table("gough_stewart")
    assert set(answer.minimal) == set(combinations("123456", 3))
    assert len(answer.minimal) == comb(6, 3) == 20
    pairs = [each for each in sets if len(each) == 2]
    assert len(pairs) == 15
    for a, b in pairs:
        assert sets[a, b].verdict == PARTIAL
        assert sets[a, b].rank == 4
        assert f"rotation about the line B{a} B{b}" in [freedom.name for freedom in sets[a, b].unobserved]
    assert all(sets[(each,)].rank == 2 for each in "123456")


def test_blind_legs() -> None:
    answer = found("3ppr_m1")
    assert {each.verdict for each in answer.sets} == {BLIND}
    assert {each.rank for each in answer.sets} == {0}


def test_the_whole_hexaglide_misses_its_rails() -> None:
    whole = table("hexaglide")[tuple("123456")]
    assert whole.verdict == PARTIAL
    assert [freedom.name for freedom in whole.unobserved] == ["translation along x"]


def test_progress_and_record() -> None:
    told: list[str] = []
    with hrsynth.on_progress(told.append):
        answer = legs(load("3rrr_m1"))
    assert [each for each in told if "sets" in each] == [f"sets of legs, {number} of 7" for number in range(1, 8)]
    assert len(answer.sets) == 7
    record = answer.to_dict()
    assert record["robot"] == "3rrr_m1"
    assert record["architecture_ascii"] == "3-R*RR"
    assert record["complete"] is True
    assert [each["legs"] for each in record["sets"]] == [list(each.legs) for each in answer.sets]
    assert record["minimal"] == [list(each) for each in answer.minimal]


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["delta", "gough_stewart"])
def test_a_carried_camera_sees_no_less_of_a_rigid_platform(robot: str) -> None:
    answer = legs(load(robot), camera="platform")
    assert max(each.rank for each in answer.sets) == answer.dof
    assert answer.dof == found(robot).dof


def test_an_unknown_camera() -> None:
    with pytest.raises(BadRequest) as caught:
        legs(load("delta"), camera="moon")
    assert caught.value.got == "moon"
    assert "platform" in str(caught.value)


def watching_both(robot: str = "rrrrr_m1") -> Mechanism:
    """A five-bar of which the file names both links of leg 1, and the last of leg 2."""
    mechanism = load(robot)
    seen = [("1", "prox_1"), ("1", "dist_1"), ("2", "dist_2")]
    return replace(mechanism, observations=tuple(Direction(leg, link, np.array([1.0, 0, 0])) for leg, link in seen))


def test_all_that_the_file_watches_of_a_leg_counts_in_its_sets() -> None:
    """The directions of both links of one leg are the place of their end: u1 and u2, whatever the other leg does."""
    robot = watching_both()
    setup = ObservedRobot.of(robot)
    model, oracle = setup.all_samples.model, Oracle(setup.all_samples.model.mechanism)
    state = state_of(model, setup.configurations[0].q)
    for chosen in (("1",), ("2",), ("1", "2")):
        seen = [o for o in robot.observations if o.leg in chosen]
        basis = oracle.relation(state, seen, point_only=setup.all_samples.observation_model.point is not None)
        twists, rates = basis[: -3 * len(seen)], basis[-3 * len(seen) :]
        _, values, right = np.linalg.svd(rates)
        unseen = np.linalg.matrix_rank(twists @ right[int(np.sum(values > 1e-8)) :].T, tol=1e-8)
        expected = np.linalg.matrix_rank(twists, tol=1e-8) - unseen
        for asked in (robot, ObservedRobot.of(robot, ["2"])):
            (verdict,) = (each for each in legs(asked).sets if each.legs == chosen)
            assert verdict.rank == expected
    assert legs(robot).minimal == (("1",),)


def test_a_second_direction_of_a_link_is_not_passed_over() -> None:
    robot = watching_both()
    more = (*robot.observations, Direction("1", "prox_1", np.array([0, 0, 1.0])))
    with pytest.raises(BadRobotFile, match="second direction of a link"):
        legs(replace(robot, observations=more))
    again = (*robot.observations, Direction("1", "prox_1", np.array([-1.0, 0, 0])))
    assert legs(replace(robot, observations=again)).minimal == (("1",),)


@pytest.mark.parametrize("seed", range(6))
def test_a_loop_that_holds_nothing_back_has_no_rank(seed: int) -> None:
    """A platform on two R whose axes meet in the centre of its ball: all joints at one point, the loop is rounding."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=3)
    made = Builder("wrist")
    made.link("base")
    made.link("a", centre)
    made.link("platform", centre)
    made.joint("1", "R", "base", "a", centre, axis=rng.normal(size=3))
    made.joint("2", "R", "a", "platform", centre, axis=rng.normal(size=3))
    made.joint("3", "S", "base", "platform", centre, loop=True)
    made.observe("1", "a", rng.normal(size=3))
    robot = made.build("platform")
    assert robot.length == 1
    basis = Oracle(robot).relation(np.array([each.pose for each in robot.links.values()]), robot.observations)
    (verdict,) = (each for each in legs(robot).sets if each.legs == ("1",))
    assert (
        (verdict.dof, verdict.rank)
        == (np.linalg.matrix_rank(basis[:6], tol=1e-8), np.linalg.matrix_rank(basis[6:], tol=1e-8))
        == (2, 1)
    )


def held_plate() -> Mechanism:
    """In a plane three rods hold a plate (3 freedoms less 3), and a chain of four R between base and plate moves."""
    b = Builder("held_plate")
    for link in ("base", "plate", "crank", "coupler", "rocker", "rod_1", "rod_2", "rod_3"):
        b.link(link)
    chain = [("base", 2.0, 0.0), ("crank", 2.2, 0.5), ("coupler", 2.0, 1.1), ("rocker", 1.0, 1.0), ("plate", 0.0, 0.0)]
    for (one, x, z), (other, *_) in pairwise(chain):
        b.joint(f"of_{one}", "R", one, other, at=(x, 0, z), axis=(0, 1, 0), loop=other == "plate", motor=one == "base")
    rods = [((-1.0, 0.0), (-0.8, 0.9)), ((0.0, 0.0), (0.7, 1.1)), ((1.0, 0.0), (0.1, 1.4))]
    for k, (foot, tip) in enumerate(rods, 1):
        b.joint(f"foot_{k}", "R", "base", f"rod_{k}", at=(foot[0], 0, foot[1]), axis=(0, 1, 0))
        b.joint(f"tip_{k}", "R", f"rod_{k}", "plate", at=(tip[0], 0, tip[1]), axis=(0, 1, 0), loop=k > 1)
    return b.build("plate")


def test_a_platform_without_freedom_is_not_called_controllable() -> None:
    """Nothing is proved of it either: that it rests at one instance does not say that it rests at others."""
    answer = legs(held_plate())
    assert (answer.dof, answer.setup.mobility.total) == (0, 1)
    assert {(each.verdict, each.rank) for each in answer.sets} == {(AT_REST, 0)}
    assert {(each.verdict, each.proved, each.chance) for each in answer.exact} <= {
        (AT_REST, False, 0.0),
        (None, False, 0.0),
    }
    told = hrsynth.derive(held_plate())
    assert told.to_dict()["verdict"] == "nothing to control"
    assert "controllable" not in hrsynth.text(told)
    advice = hrsynth.advise(held_plate())
    assert advice.nothing_missing
    assert "The platform cannot move" in hrsynth.text(advice)
