"""Relations that closed loops keep, what proofs rest on, and what is merely observed."""

from __future__ import annotations

import random
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hrsynth.analysis import instances
from hrsynth.analysis.exact import IDENTITY_INSTANCES_COUNT, ExactArchitecture, build_architecture, get_architecture
from hrsynth.analysis.instances import Instance, build_instance, compute_float_ranks, draw
from hrsynth.analysis.loop_invariants import bound_degree, find_invariant_incidences
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import CONTROLLABLE, PARTIAL
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism as built
from hrsynth.description import load
from hrsynth.errors import HrsynthError
from hrsynth.geometry.vectors import rotate_about_axis
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.mechanism import Direction, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.incidences import Incidences
from hrsynth.mechanism.structural_incidences import find_structural_incidences, list_incidences
from kinematics.robots import ROBOTS, setting_of
from mechanism.relating import miss, observed, recognised, walked
from oracle import NotAssembled, Undecided
from strategies import deltas, parallel_robots, random_rotation, transformed

POD = "(Pk*-Utn-Unt)+(Pz*-2SSt)+(Pz*-Utn-S)+(Rt*-2SSt)"
"""Its P axes of legs 2 and 3 are parallel: the two never see the translation along them."""


def one_of(mechanism: Mechanism, relations: Incidences, seed: int = 0) -> Instance:
    """A random instance of relations."""
    directions = [o for o in mechanism.observations if isinstance(o, Direction)]
    return build_instance(mechanism, relations, directions, draw(relations, random.Random(seed)))


@pytest.mark.some(17)
@pytest.mark.parametrize("robot", ROBOTS)
def test_all_relations_of_shipped_robots_are_derived(robot: str) -> None:
    generic = get_architecture(setting_of(robot))
    basis = generic.basis
    assert basis.sampled == ()
    assert basis.structural + basis.loop_invariant == len(list_incidences(generic.relations)) > 0
    assert basis.largest_defect_held < 1e-10
    assert basis.smallest_defect_not_held is None


@pytest.mark.some(5)
@pytest.mark.parametrize("robot", ROBOTS)
def test_what_is_kept_holds_far_away(robot: str) -> None:
    """Relations are proposed and kept from one small step; they hold at the end of a long walk by the oracle."""
    mechanism = observed(load(robot))
    relations = recognised(mechanism, walked(mechanism, 1, seed=1))
    every = list_incidences(relations)
    assert all(find_invariant_incidences(every, relations, one_of(mechanism, relations)))
    state = walked(mechanism, 6, seed=2)[-1]
    assert max(miss(tie, mechanism, relations, state) for tie in every) < 1e-7


@given(parallel_robots(), st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_relations_of_random_robots_are_derived(mechanism: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = transformed(mechanism, random_rotation(rng), rng.normal(size=3))
    try:
        generic = get_architecture(ObservedRobot.of(robot, samples=3))
        states = walked(generic.mechanism, 3, seed)
    except (HrsynthError, NotAssembled, Undecided):
        assume(False)
    assert generic.basis.sampled == ()
    for tie in list_incidences(generic.relations):
        if tie.kind != "seen":
            assert miss(tie, generic.mechanism, generic.relations, states[-1]) < 1e-7, tie.words(generic.relations)


@pytest.mark.parametrize("robot", ["3rps", "3ruu", "6pus", "delta", "i4l", "quattro_rigid"])
def test_what_holds_at_zero_by_accident_is_not_kept(robot: str) -> None:
    """These are more special at zero than elsewhere: motion breaks some of it, and a word of proof is not said."""
    setup = setting_of(robot)
    all_samples = setup.all_samples
    start, observation_model = all_samples.start, all_samples.observation_model
    here = build_architecture(setup.mechanism, observation_model, [start], compute_relation(start, observation_model))
    persistent = get_architecture(setup)
    assert len(list_incidences(here.relations)) > len(list_incidences(persistent.relations))
    every = list_incidences(here.relations)
    answers = find_invariant_incidences(
        every,
        here.relations,
        build_instance(here.mechanism, here.relations, here.observations, draw(here.relations, random.Random(0))),
    )
    assert not all(answers)
    known = find_structural_incidences(here.mechanism, here.relations, every)
    assert all(keeps for keeps, holds in zip(answers, known, strict=True) if holds)
    verdict = here.verdict(here.observations)
    assert not verdict.proved
    assert "proved" not in verdict.reason
    if verdict.exact:
        assert "sampled incidences" in verdict.reason


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_carried_is_kept(seed: int) -> None:
    """Joints carry it, so do all motions: two ways to one answer."""
    rng = np.random.default_rng(seed)
    for robot in (
        deltas(["R"] * 3, ["2-SS", "UU", "2-SS"], rng, True),
        deltas(["P"] * 3, ["US", "2-SS", "SS"], rng, False),
    ):
        relations = recognised(robot, walked(robot, 0, seed))
        every = list_incidences(relations)
        answers = find_invariant_incidences(every, relations, one_of(robot, relations))
        known = find_structural_incidences(robot, relations, every)
        assert all(keeps for keeps, holds in zip(answers, known, strict=True) if holds)


@pytest.mark.some(6)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_degree_of_identities_is_bounded(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers of k more bits make motions of at most degree · k more: the bound is none that is too low."""
    setup = setting_of(robot)
    relations = get_architecture(setup).relations
    bits = []
    for power in (20, 100):
        monkeypatch.setattr(instances, "LARGEST_RANDOM", 2**power)
        found = build_instance(
            setup.mechanism, relations, get_architecture(setup).observations, draw(relations, random.Random(0))
        )
        bits.append(max(int(x).bit_length() for twist in found.twists().values() for x in twist.ravel()))
    assert 0 < bits[1] - bits[0] <= 80 * bound_degree(relations, len(found.free))


def test_an_instance_is_no_more_special_than_the_robot() -> None:
    """The conditions on directions and centres have the same rank at an instance and where the robot is."""
    for robot in ("quattro", "hexaglide", "3upu"):
        generic = get_architecture(setting_of(robot))
        assert (
            generic.instance(0).geometry.ranks
            == compute_float_ranks(generic.relations, 0)
            == compute_float_ranks(generic.relations, -1)
        )
    special = replace(generic.relations, directions=np.ones_like(generic.relations.directions))
    other = ExactArchitecture(generic.mechanism, special, generic.observations, generic.relation)
    verdict = other.verdict(other.observations)
    assert not verdict.exact
    assert "more special" in verdict.reason


def test_a_special_zero_configuration_proves_nothing_of_what_loops_keep() -> None:
    """Where more can move at zero than elsewhere, no relation is known to hold on the branch because it holds there."""
    generic = get_architecture(setting_of("delta"))
    other = ExactArchitecture(
        generic.mechanism, generic.relations, generic.observations, generic.relation, generic.relation.mobility + 1
    )
    verdict = other.verdict(other.observations)
    assert (verdict.exact, verdict.proved, verdict.verdict) == (True, False, CONTROLLABLE)
    assert "sampled incidences" in verdict.reason
    planar = get_architecture(setting_of("3rrr_m1"))
    other = ExactArchitecture(planar.mechanism, planar.relations, planar.observations, planar.relation, 9)
    assert other.verdict(other.observations).proved


def test_robots_without_axes_or_without_centres() -> None:
    """Rods between balls have no axes, slides no centres; what they see is fixed in their links."""
    rods, slides = Builder("rods"), Builder("slides")
    rods.link("base")
    rods.link("platform", at=(0, 0, 1))
    rng = np.random.default_rng(0)
    for number in range(4):
        foot = rng.normal(size=3)
        tip = foot * [0.5, 0.5, 0] + [0, 0, 1]
        rods.link(f"rod_{number}", at=foot)
        rods.joint(f"foot_{number}", "S", "base", f"rod_{number}", foot)
        rods.joint(f"tip_{number}", "S", f"rod_{number}", "platform", tip, loop=number > 0)
        rods.observe(str(number + 1), f"rod_{number}", tip - foot)
    for name in ("base", "one", "platform"):
        slides.link(name)
    slides.joint("x", "P", "base", "one", axis=(1, 0, 0))
    slides.joint("y", "P", "one", "platform", axis=(0, 1, 0))
    slides.observe("1", "platform", (1, 2, 3))
    for builder in (rods, slides):
        robot = builder.build(platform="platform")
        relations = recognised(robot, walked(robot, 2, seed=0))
        every = list_incidences(relations)
        assert every
        assert all(find_invariant_incidences(every, relations, one_of(robot, relations)))
        assert all(find_structural_incidences(robot, relations, every))


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["3upu", "delta", "quattro", "3rps", "hexaglide"])
def test_the_seed_of_the_samples_does_not_matter(robot: str) -> None:
    settings = [ObservedRobot.of(load(robot), samples=4, seed=seed) for seed in (0, 1, 2)]
    architectures = [get_architecture(setup) for setup in settings]
    assert len({frozenset(list_incidences(each.relations)) for each in architectures}) == 1
    verdicts = [each.verdict(each.observations) for each in architectures]
    assert len({(verdict.rank, verdict.proved, verdict.reason) for verdict in verdicts}) == 1


def test_identities_are_tested_at_several_instances() -> None:
    generic = get_architecture(setting_of("delta"))
    verdict = generic.verdict(generic.observations)
    assert 0 < verdict.chance < 1e-12
    assert len(generic._instances) == IDENTITY_INSTANCES_COUNT
    planar = get_architecture(setting_of("3rrr_m1"))
    assert planar.verdict(planar.observations).chance == 0
    assert len(planar._instances) == 1


# --- operation modes ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[0, 7, 42])
def pod(request: pytest.FixtureRequest) -> ObservedRobot:
    """The pod with the catalog's own dimensions and with others, some samples of which may be of another mode."""
    return ObservedRobot.of(built(parse(POD), request.param))


@pytest.mark.some(1)
def test_a_mixture_of_operation_modes_proves_nothing(pod: ObservedRobot) -> None:
    generic = get_architecture(pod)
    verdict = generic.verdict(pod.segments[1:3])
    ranks = {m.relation.select((1, 2)).rank for m in pod.all_samples.members}
    assert verdict.verdict in ((PARTIAL,) if ranks == {2} else (PARTIAL, None))
    if verdict.verdict is None:
        assert "operation modes" in verdict.reason


def test_one_sample_of_another_mode_is_seen() -> None:
    """The relations of a translating platform do not hold where it turns: one sample is enough to tell."""
    robot = observed(load("3upu"))
    states = walked(robot, 5, seed=3)
    poses = {name: np.array([state[i] for state in states]) for i, name in enumerate(robot.links)}
    assert recognised(robot, states).doubt == ""
    turned = poses["platform"].copy()
    turned[-1, :3, :3] = rotate_about_axis((1, 2, 3), 0.2) @ turned[-1, :3, :3]
    index = list(robot.links).index("platform")
    mixed = [state.copy() for state in states]
    mixed[-1][index] = turned[-1]
    assert "operation modes: an incidence of its geometry holds at zero and at 4 of 5" in recognised(robot, mixed).doubt


# --- nearly special geometry -------------------------------------------------------------------------------------


def nearly(misses: dict[str, float], seed: int) -> Mechanism:
    """A PRRRP with parallel rails, some turned by an angle, anywhere."""
    robot = load("prrrp_parallel")
    normal = robot.joints["elbow_1"].axis
    rails = [
        replace(robot.joints[name], axes=(rotate_about_axis(normal, angle) @ robot.joints[name].axis,))
        for name, angle in misses.items()
    ]
    rng = np.random.default_rng(seed)
    return transformed(robot.changed(joints=rails), random_rotation(rng), rng.normal(size=3))


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-8, 1e-6, 1e-4])
def test_rails_that_are_nearly_parallel(angle: float) -> None:
    """The verdict is that of the numbers, and says how near the other one is."""
    setup = ObservedRobot.of(nearly({"guide_2": angle}, seed=int(-np.log10(angle))), samples=4)
    verdict = get_architecture(setup).verdict(setup.observed)
    assert {member.relation.rank for member in setup.all_samples.members} == {verdict.rank}
    assert verdict.verdict == (PARTIAL if angle < 1e-7 else CONTROLLABLE)
    told = "defect up to" if angle < 1e-7 else "does not count"
    assert (told in verdict.reason) == (angle > 1e-10)
    if told in verdict.reason:
        assert 0.5 * angle < float(re.findall(r"defect (?:up to|of) (\S+)", verdict.reason)[0]) <= angle


def test_no_verdict_where_held_and_missed_are_close() -> None:
    """Rails that miss by 3e-8 and by 3e-6 leave no gap between what is meant and what is not."""
    robot = load("hexaglide")
    rails = [joint for joint in robot.joints.values() if joint.type.value == "P"]
    angles = (3e-8, 3e-6, 0, 0, 0, 0)
    bent = robot.changed(
        joints=[
            replace(rail, axes=(rotate_about_axis((1, 2, 3), angle) @ rail.axis,))
            for rail, angle in zip(rails, angles, strict=True)
        ]
    )
    setup = ObservedRobot.of(bent, samples=4)
    verdict = get_architecture(setup).verdict(setup.observed)
    assert not verdict.exact
    assert "nearly special" in verdict.reason
