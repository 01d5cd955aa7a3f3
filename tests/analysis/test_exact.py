"""Exact verdicts: they agree with the numbers and with the oracle, and are not given where they cannot be."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hrsynth.analysis import instances
from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import derive
from hrsynth.analysis.exact import (
    EXACT_RANK_INSTANCES_COUNT,
    IDENTITY_INSTANCES_COUNT,
    ExactArchitecture,
    ExactVerdict,
    build_architecture,
    get_architecture,
)
from hrsynth.analysis.instances import (
    Geometry,
    Instance,
    RecognitionFailure,
    compute_exact_kernel,
    compute_observed_direction,
    draw,
    rank,
)
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from hrsynth.errors import HrsynthError
from hrsynth.geometry.vectors import Array, freeze_array, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.velocity_relation import ObservationModel, compute_relation
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.incidences import DirectionSource, Incidences
from hrsynth.mechanism.model import Coupling
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.sensors import make_encoders
from hrsynth.present.text import robots as text
from kinematics.robots import ROBOTS, setting_of
from oracle import Oracle
from strategies import parallel_robots, planar, random_rotation, spherical, transformed

WORDS = (CONTROLLABLE, PARTIAL, BLIND)


def sets(setup: ObservedRobot) -> Iterator[tuple[tuple[int, ...], list[Observation]]]:
    """All sets of default segments: their places and themselves."""
    segments = setup.all_samples.observation_model.observations[: setup.defaults]
    for size in range(1, len(segments) + 1):
        for places in combinations(range(len(segments)), size):
            yield places, [segments[i] for i in places]


def checked(verdict: ExactVerdict) -> None:
    """What every exact verdict obeys."""
    assert verdict.exact == (verdict.rank is not None) == (verdict.verdict in WORDS)
    assert verdict.reason
    if verdict.rank is None:
        assert verdict.verdict is None
        assert verdict.instances == 0
        return
    assert (verdict.verdict == CONTROLLABLE) == (verdict.rank == verdict.dof)
    assert (verdict.verdict == BLIND) == (verdict.rank == 0)
    assert verdict.instances == (1 if verdict.rank == verdict.dof else EXACT_RANK_INSTANCES_COUNT)


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ROBOTS)
def test_exact_ranks_are_the_numerical_ones(robot: str) -> None:
    """Every shipped robot, every set of legs."""
    setup = setting_of(robot)
    generic = get_architecture(setup)
    for places, observed in sets(setup):
        verdict = generic.verdict(observed)
        checked(verdict)
        assert verdict.exact, verdict.reason
        assert verdict.rank == setup.all_samples.members[0].relation.select(places).rank


def placed(mechanism: Mechanism, relations: Incidences, drawn: Geometry) -> Mechanism:
    """A mechanism of doubles with the geometry of an instance."""
    centres = np.array([[float(x.p) / float(x.q) for x in point] for point in drawn.centres])
    directions = [normalise_vector(doubles(d)) for d in drawn.directions]
    joints = [
        replace(
            joint,
            point=centres[relations.centres[name]] if name in relations.centres else centres[0],
            axes=tuple(directions[c] for c in relations.axes[name]),
        )
        for name, joint in mechanism.joints.items()
    ]
    found = mechanism.changed(joints=joints)
    platform = found.links[found.platform]
    if relations.point is not None:
        X = np.eye(4)
        X[:3, 3] = centres[relations.point]
        found = found.changed(links=[replace(platform, pose=freeze_array(X))])
    return found


def doubles(vector: object) -> Array:
    """A rational vector as a share of its largest entry: its own numbers may be larger than doubles can be."""
    exact = [Fraction(int(x.p), int(x.q)) for x in vector]  # type: ignore[attr-defined]
    largest = max(map(abs, exact)) or 1
    return np.array([float(x / largest) for x in exact])


@pytest.mark.some(16)
@pytest.mark.parametrize("robot", ROBOTS)
def test_an_instance_is_a_mechanism_of_the_same_kind(robot: str) -> None:
    """The oracle, given the instance's geometry in doubles, finds the same dimensions as exact arithmetic."""
    setup = setting_of(robot)
    generic = get_architecture(setup)
    drawn = draw(generic.relations, random.Random(0))
    exact = generic.instance(0)
    mechanism = placed(setup.mechanism, generic.relations, drawn)
    observations = [
        Direction(
            o.leg, o.link, mechanism.links[o.link].pose[:3, :3].T @ doubles(compute_observed_direction(sight, drawn))
        )
        for o, sight in zip(generic.observations, generic.relations.sights, strict=True)
    ]
    oracle = Oracle(mechanism)
    assert exact.mobility == oracle.mobility(oracle.zero())
    for size in (1, 2, len(observations)):
        basis = oracle.relation(oracle.zero(), observations[:size], point_only=generic.relations.point is not None)
        rows = 6 if generic.relations.point is None else 3
        values = np.linalg.svd(basis[rows:], compute_uv=False)
        assert exact.ranks(range(size)) == (basis.shape[1], int(np.sum(values > 1e-9)))


def test_an_instance_keeps_all_relations_exactly() -> None:
    relations = get_architecture(setting_of("quattro")).relations
    drawn = draw(relations, random.Random(3))
    for number, conditions in enumerate(relations.tower):
        for by in conditions:
            rows = np.array([drawn.directions[c] for c in (*by, number)])
            assert rows[0] @ rows[1] == 0 if len(by) == 1 else rank(rows) == 2
    for incidence in relations.incidences:
        vector = sum(sign * drawn.centres[i] for i, sign in incidence.terms)
        by = [drawn.directions[c] for c in incidence.classes]
        match incidence.kind:
            case "zero":
                assert all(x == 0 for x in vector)
            case "parallel":
                assert rank(np.array([vector, by[0]])) == 1
            case _:
                assert vector @ by[0] == 0


def test_directions_that_follow_from_axes_and_centres() -> None:
    rng = random.Random(5)
    drawn = Geometry(
        (instances.draw_whole_numbers(3, rng), instances.draw_whole_numbers(3, rng)),
        np.array([instances.draw_whole_numbers(3, rng) for _ in range(2)]),
    )
    a, b = drawn.directions
    between = drawn.centres[1] - drawn.centres[0]
    foot = compute_observed_direction(DirectionSource("foot", (0, 1), (0,)), drawn)
    assert foot @ a == 0
    assert rank(np.array([foot, between, a])) == rank(np.array([between, a])) == 2
    normal = compute_observed_direction(DirectionSource("normal", (), (0, 1)), drawn)
    assert normal @ a == normal @ b == 0
    assert rank(np.array([compute_observed_direction(DirectionSource("between", (0, 1)), drawn), between])) == 1


def test_a_mechanism_without_centres() -> None:
    """Two slides in series: nothing but directions matters."""
    builder = Builder("slides")
    for name in ("base", "one", "two"):
        builder.link(name)
    builder.joint("x", "P", "base", "one", axis=(1, 0, 0))
    builder.joint("y", "P", "one", "two", axis=(0, 1, 0))
    builder.observe("1", "two", (1, 2, 3))
    robot = builder.build(platform="two")
    start = ClosedConfiguration.of(PinocchioModel(robot), PinocchioModel(robot).q0)
    observation_model = ObservationModel("two", None, "base", robot.observations)
    verdict = build_architecture(robot, observation_model, [start], compute_relation(start, observation_model)).verdict(
        robot.observations
    )
    assert (verdict.exact, verdict.verdict, verdict.rank) == (True, BLIND, 0)


def test_the_largest_rank_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """An instance that is special by chance does not decide."""
    generic = get_architecture.__wrapped__(setting_of("delta"))  # none that has instances already
    real = instances.build_instance
    drawn: list[Instance] = []

    def unlucky(*geometry: object) -> Instance:
        found = real(*geometry)  # type: ignore[arg-type]
        drawn.append(found)
        return found if len(drawn) > 1 else replace(found, rates=(found.rates[0], *(0 * r for r in found.rates[1:])))

    monkeypatch.setattr("hrsynth.analysis.exact.build_instance", unlucky)
    assert generic.verdict(generic.observations[:2]).rank == 3
    assert len(drawn) == IDENTITY_INSTANCES_COUNT
    assert generic.verdict(generic.observations[:1]).rank == 2
    assert len(drawn) == EXACT_RANK_INSTANCES_COUNT


@given(st.lists(st.lists(st.integers(-3, 3), min_size=5, max_size=5), min_size=1, max_size=6))
def test_kernels_are_exact(rows: list[list[int]]) -> None:
    matrix = np.array(rows, dtype=object)
    basis = compute_exact_kernel(matrix)
    assert all(x == 0 for x in (matrix @ basis).ravel())
    assert basis.shape[1] == 5 - rank(matrix) == 5 - np.linalg.matrix_rank(np.array(rows, dtype=float))
    assert basis.shape[1] == (rank(basis) if basis.shape[1] else 0)


def check_agreement(mechanism: Mechanism) -> None:
    """Exact ranks are those of a random robot, or there is a reason."""
    try:
        setup = ObservedRobot.of(mechanism, samples=3)
    except HrsynthError:
        assume(False)
    generic = get_architecture(setup)
    for places, observed in sets(setup):
        verdict = generic.verdict(observed)
        checked(verdict)
        assert verdict.exact, verdict.reason
        assert verdict.rank == max(m.relation.select(places).rank for m in setup.all_samples.members)


@given(parallel_robots(), st.integers(0, 2**32 - 1))
@settings(max_examples=12, deadline=None)
def test_random_robots(mechanism: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    check_agreement(transformed(mechanism, random_rotation(rng), rng.normal(size=3)))


@pytest.mark.parametrize("seed", [0, 1])
def test_spherical_robots(seed: int) -> None:
    """Over-constrained by axes that meet in one point."""
    check_agreement(spherical(np.random.default_rng(seed)))


def spinning() -> ObservedRobot:
    """A robot with rods between balls, the direction seen of the first not along the rod: it moves as the rod spins."""
    robot = setting_of("delta").mechanism
    first, *rest = setting_of("delta").all_samples.observation_model.observations
    assert isinstance(first, Direction)
    tilted = replace(first, direction=normalise_vector(first.direction + [0.3, -0.5, 0.4]))
    return ObservedRobot.of(robot.changed(observations=(tilted, *rest)), samples=3)


def test_directions_that_move_while_the_platform_rests() -> None:
    setup = spinning()
    assert setup.all_samples.members[0].relation.RI == 1
    generic = get_architecture(setup)
    for places, observed in sets(setup):
        verdict = generic.verdict(observed)
        assert verdict.exact
        assert verdict.rank == setup.all_samples.members[0].relation.select(places).rank


def test_what_some_legs_leave_free_must_be_the_robots_own() -> None:
    """Where the rates of two legs are exchanged, ρ for all legs has its dimension, for one of them it has not."""
    generic = get_architecture(spinning())
    own = generic.relation
    order = [*range(6), *range(9, 12), *range(6, 9), *range(12, 15)]
    other = ExactArchitecture(
        generic.mechanism, generic.relations, generic.observations, replace(own, basis=own.basis[order])
    )
    assert other.verdict(other.observations).exact
    verdict = other.verdict(other.observations[:1])
    checked(verdict)
    assert "dim ρ of these legs is 3, but 4" in verdict.reason


@pytest.mark.slow
@given(parallel_robots())
@settings(max_examples=150, deadline=None)
def test_many_random_robots(mechanism: Mechanism) -> None:
    check_agreement(mechanism)


@pytest.mark.some(3)
@pytest.mark.parametrize(
    ("robot", "observe", "camera"),
    [
        ("delta", ("arm_1", "rod_2b"), None),
        ("delta", None, "platform"),
        ("gough_stewart", ("1", "2", "3"), "platform"),
        ("quattro", ("arm_2", "rod_3b"), None),
        ("3rrr_m1", None, "platform"),
        ("delta", ("1", "2"), "rod_3a"),
    ],
)
def test_other_segments_and_cameras(robot: str, observe: tuple[str, ...] | None, camera: str | None) -> None:
    setup = setting_of(robot, observe, camera)
    verdict = get_architecture(setup).verdict(setup.observed)
    checked(verdict)
    assert verdict.exact, verdict.reason
    assert verdict.rank == max(member.relation.rank for member in setup.samples.members)


# --- what must not be claimed ------------------------------------------------------------------------------------


def check_refused(generic: ExactArchitecture, words: str) -> None:
    verdict = generic.verdict(generic.observations)
    checked(verdict)
    assert not verdict.exact
    assert words in verdict.reason
    with pytest.raises(RecognitionFailure):
        generic.instance(0)


def test_axes_that_are_not_quite_parallel() -> None:
    """A joint with its axis off by 1e-4 is locked: no planar robot any more, neither in fact nor in its instances."""
    robot = planar(["RRR"] * 3, np.random.default_rng(1), [{0}] * 3)
    observation_model = ObservedRobot.of(robot, samples=2).all_samples.observation_model
    mobile = compute_relation(
        ClosedConfiguration.of(PinocchioModel(robot), PinocchioModel(robot).q0), observation_model
    )
    joint = robot.joints["joint_2_2"]
    bent = robot.changed(
        joints=[replace(joint, axes=(normalise_vector(joint.axis + 1e-4 * np.array([0.3, -0.5, 0.7])),))]
    )
    model = PinocchioModel(bent)
    start = ClosedConfiguration.of(model, model.q0)
    check_refused(build_architecture(bent, observation_model, [start], mobile), "mobility is 3, but")
    found = legs(bent)
    assert found.dof == 2
    assert all(each.exact and each.rank == other.rank for each, other in zip(found.exact, found.sets, strict=True))


def test_six_rods_that_meet_one_line() -> None:
    """SS rods that meet one line let the platform turn about it for an instant, and no further (proofs.md 12)."""
    rng = np.random.default_rng(2)
    builder = Builder("hexapod")
    builder.link("base")
    builder.link("platform", at=(0.1, 0.2, 1.0))
    for number in range(6):
        meet = np.array([0.0, 0.0, rng.uniform(-1, 2)])
        along = normalise_vector(rng.normal(size=3))
        A, B = meet + rng.uniform(0.5, 1) * along, meet - rng.uniform(0.5, 1) * along
        builder.link(f"rod_{number}", at=A)
        builder.joint(f"foot_{number}", "S", "base", f"rod_{number}", A)
        builder.joint(f"tip_{number}", "S", f"rod_{number}", "platform", B, loop=number > 0)
        builder.observe(str(number + 1), f"rod_{number}", along)
    robot = builder.build(platform="platform")
    model = PinocchioModel(robot)
    start = ClosedConfiguration.of(model, model.q0)
    observation_model = ObservationModel("platform", None, "base", robot.observations)
    here = compute_relation(start, observation_model)
    assert here.dof.value == 1
    check_refused(build_architecture(robot, observation_model, [start], here), "mobility is 7, but 6")


def test_another_dof() -> None:
    generic = get_architecture(setting_of("3rrr_m1"))
    basis = generic.relation.basis.copy()
    basis[:6] *= 0
    check_refused(
        ExactArchitecture(
            generic.mechanism, generic.relations, generic.observations, replace(generic.relation, basis=basis)
        ),
        "dof is 0, but 3",
    )


def test_gears_are_said_to_be_left_out() -> None:
    generic = get_architecture(setting_of("3rrr_m1"))
    geared = replace(generic.mechanism, couplings=(Coupling("gear", "shoulder_1", "shoulder_2", 2.0),))
    check_refused(ExactArchitecture(geared, generic.relations, generic.observations, generic.relation), "couplings")


def test_relations_that_leave_no_direction() -> None:
    generic = get_architecture(setting_of("rrrrr_m1"))
    crowded = replace(generic.relations, tower=(*generic.relations.tower, (), ((1,),), ((0,), (1,), (2,))))
    check_refused(
        ExactArchitecture(generic.mechanism, crowded, generic.observations, generic.relation), "no random direction"
    )


def test_what_is_no_direction() -> None:
    setup = setting_of("delta")
    joint = next(joint for joint in setup.mechanism.joints.values() if joint.type.value == "R")
    verdict = get_architecture(setup).verdict(make_encoders(setup.mechanism, joint, "1"))
    checked(verdict)
    assert not verdict.exact
    assert "not a direction" in verdict.reason


@pytest.mark.parametrize(("robot", "kept"), [("quattro_rigid", "zero"), ("i4l", "parallel")])
def test_an_over_constrained_robot_needs_its_incidences(robot: str, kept: str) -> None:
    generic = get_architecture(setting_of(robot))
    fewer = tuple(each for each in generic.relations.incidences if each.kind == kept and len(each.terms) == 2)
    relations = replace(generic.relations, incidences=fewer)
    check_refused(ExactArchitecture(generic.mechanism, relations, generic.observations, generic.relation), "mobility")


def test_a_planar_robot_needs_its_parallel_axes() -> None:
    generic = get_architecture(setting_of("3rrr_m1"))
    axes = {name: (i,) for i, name in enumerate(generic.relations.axes)}
    relations = replace(generic.relations, axes=axes, tower=((),) * len(axes))
    check_refused(
        ExactArchitecture(generic.mechanism, relations, generic.observations, generic.relation), "mobility is 3, but 0"
    )


# --- an architecture and a robot ---------------------------------------------------------------------------------


def collinear() -> Mechanism:
    """A hexapod with three of its tips on one line of the platform."""
    robot = prepare_robot("gough_stewart")
    tips = [robot.joints[f"wrist_{i}"] for i in (1, 2, 3)]
    return robot.changed(joints=[replace(tips[2], point=0.4 * tips[0].point + 0.6 * tips[1].point)])


def prepare_robot(name: str) -> Mechanism:
    return setting_of(name).mechanism


def test_a_robot_may_see_less_than_its_architecture() -> None:
    """Three legs whose tips lie on one line do not see the turn about it; both verdicts are given."""
    found = derive(collinear(), ["1", "2", "3"])
    assert (found.verdict.verdict, found.verdict.rank) == (PARTIAL, 5)
    assert (found.exact.verdict, found.exact.rank) == (CONTROLLABLE, 6)
    record = found.to_dict()
    assert record["verdict"] == PARTIAL
    assert record["architecture"]["verdict"] == CONTROLLABLE
    assert record["architecture"]["exact"] is True
    (row,) = [row for row in re.split(r"\n(?=\S)", text.format_derivation(found)) if row.startswith("architecture")]
    line = " ".join(row.split())
    assert "rank 6 of 6 for generic geometry" in line
    assert "5 for this robot" in line


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "observe", "verdict", "words"),
    [
        ("3rrr_m1", None, CONTROLLABLE, "controllable, proved in exact arithmetic"),
        (
            "quattro_rigid",
            None,
            CONTROLLABLE,
            "controllable, proved in exact arithmetic, except for a chance below 1e-16",
        ),
        ("uranesx", None, PARTIAL, "partially controllable, exact at 5 random instances"),
        ("3ppr_m1", None, BLIND, "uncontrollable, exact at 5 random instances"),
    ],
)
def test_the_architecture_in_a_derivation(robot: str, observe: None, verdict: str, words: str) -> None:
    found = derive(prepare_robot(robot), observe)
    record = found.to_dict()["architecture"]
    assert record.pop("chance") == (pytest.approx(8e-17, rel=0.2) if "chance" in words else 0)
    basis = record.pop("relations")
    assert (basis["loop_invariant"] > 0) == (robot in ("quattro_rigid", "uranesx"))
    assert basis["sampled"] == []
    assert record == {
        "verdict": verdict,
        "exact": True,
        "rank": found.verdict.rank,
        "proved": verdict == CONTROLLABLE,
        "instances": 1 if verdict == CONTROLLABLE else 5,
        "reason": words.split(", ", 1)[1],
    }
    (row,) = [row for row in re.split(r"\n(?=\S)", text.format_derivation(found)) if row.startswith("architecture")]
    line = " ".join(row.split())
    assert line.split(maxsplit=1)[1] == words


def test_the_architecture_in_a_table_of_legs() -> None:
    found = legs(prepare_robot("quattro"))
    record = found.to_dict()
    for each, exact in zip(record["sets"], found.exact, strict=True):
        assert each["exact"] is True
        assert each["architecture"]["verdict"] == each["verdict"]
        assert each["architecture"]["rank"] == each["rank"]
        assert tuple(each["legs"]) == exact.legs
    lines = text.format_legs(found).splitlines()
    (header,) = [line for line in lines if line.split()[:1] == ["legs"]]
    assert "exact" in header.split()
    assert sum("proved" in line for line in lines) == sum(each.verdict == CONTROLLABLE for each in found.sets) == 9
    assert sum("5 instances" in line for line in lines) == 6
    assert "exact except for a chance below 1e-14: identities tested at random instances" in lines
    assert not any("chance" in line for line in text.format_legs(legs(prepare_robot("3rrr_m1"))).splitlines())


@pytest.fixture
def none_remembered() -> Iterator[None]:
    """Architectures of this test alone: what is patched in them is not met by another."""
    get_architecture.cache_clear()
    yield
    get_architecture.cache_clear()


@pytest.mark.usefixtures("none_remembered")
def test_what_is_not_decided_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def crowded(*_: object) -> Instance:
        raise RecognitionFailure("crowded")

    monkeypatch.setattr("hrsynth.analysis.exact.build_instance", crowded)
    found = legs(prepare_robot("rrrrr_m1"))
    assert not any(each.exact for each in found.exact)
    assert [each["architecture"]["verdict"] for each in found.to_dict()["sets"]] == [None] * 3
    printed = text.format_legs(found)
    assert printed.count("undecided") == 4
    assert "undecided in exact arithmetic: crowded" in printed
    line = next(
        line
        for line in text.format_derivation(derive(prepare_robot("rrrrr_m1"))).splitlines()
        if line.startswith("architecture")
    )
    assert line.endswith("undecided: crowded")


def test_the_numbers_drawn_are_many() -> None:
    """Two that should differ are equal by chance once in a million draws."""
    rng = random.Random(0)
    drawn = [instances.draw_whole_numbers(3, rng) for _ in range(200)]
    assert len({int(x.p) for vector in drawn for x in vector}) == 600
