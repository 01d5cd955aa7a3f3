"""The certificate passes the right hidden robot and no other: deliberately wrong ones are caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hrsynth.geometry.ranks import compute_largest_angle
from hrsynth.geometry.vectors import Array, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.equivalence import EquivalenceCheck, check_equivalence
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.mechanism.model import JointType, Mechanism, Motor
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, RANK_GAP_MIN, RELATION_ANGLE_TOL
from kinematics.robots import derived

COUNT = 4


def hidden_of(robot: str, *legs: str) -> Mechanism:
    hidden = derived(robot, legs or None).hidden
    assert hidden is not None
    return hidden


def judged(robot: str, hidden: Mechanism, *legs: str) -> EquivalenceCheck:
    return check_equivalence(derived(robot, legs or None).setup.samples, hidden, count=COUNT)


def shifted(mechanism: Mechanism, joint: str, by: Array) -> Mechanism:
    """The mechanism with one joint elsewhere: still assembled, but its links have other lengths."""
    old = mechanism.joints[joint]
    return mechanism.changed(joints=[replace(old, point=old.point + by)])


def virtual(mechanism: Mechanism) -> list[str]:
    return [name for name, joint in mechanism.joints.items() if joint.is_actuated]


def caught(certificate: EquivalenceCheck) -> bool:
    """Whether the certificate refuses, with a reason and with evidence."""
    evidence = certificate.largest_angle > RELATION_ANGLE_TOL or certificate.residual > HIDDEN_ROBOT_RESIDUAL_TOL
    return not certificate.passed and bool(certificate.reason) and evidence


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"),
    [
        ("3rrr_m1", ()),
        ("3rrr_m1", ("1", "2")),
        ("gough_stewart", ("1", "2", "3")),
        ("3upu", ()),
        ("delta", ("1", "2")),
        ("rrrrr_m1", ()),
        ("prrrp_parallel_point", ()),
    ],
)
def test_the_right_one_passes(robot: str, legs: tuple[str, ...]) -> None:
    certificate = judged(robot, hidden_of(robot, *legs), *legs)
    assert certificate.passed
    assert certificate.reason == ""
    assert certificate.samples == COUNT
    assert certificate.largest_angle < RELATION_ANGLE_TOL
    assert certificate.residual < HIDDEN_ROBOT_RESIDUAL_TOL
    assert certificate.smallest_gap > RANK_GAP_MIN
    assert certificate.mismatch is None


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"), [("delta", ()), ("gough_stewart", ("1", "2", "3")), ("3rrr_m1", ()), ("3upu", ())]
)
def test_a_longer_rod_is_caught(robot: str, legs: tuple[str, ...]) -> None:
    """The end joint of one observed rod moves away by 1 % of the rod's length, along the rod and across it."""
    hidden = hidden_of(robot, *legs)
    derivation = derived(robot, legs or None)
    observation = derivation.setup.observed[0]
    assert isinstance(observation, Direction)
    last = next(
        j
        for j in hidden.joints_of(derivation.setup.decomposition.leg(observation.leg).platform_link)
        if j.name in derivation.setup.decomposition.leg(observation.leg).joints
    )
    u = hidden.links[observation.link].pose[:3, :3] @ observation.direction
    side = normalise_vector(np.cross(u, [0, 0, 1]))
    for direction in (u, side):
        assert caught(judged(robot, shifted(hidden, last.name, 0.01 * hidden.length * direction), *legs))


@pytest.mark.some(3)
@pytest.mark.parametrize(
    ("robot", "legs"), [("gough_stewart", ("1", "2", "3")), ("3rrr_m1", ()), ("3upu", ()), ("3rps", ()), ("3puu", ())]
)
def test_a_missing_leg_is_caught(robot: str, legs: tuple[str, ...]) -> None:
    hidden = hidden_of(robot, *legs)
    decomposition = derived(robot, legs or None).setup.decomposition
    leg = decomposition.leg(decomposition.labels[0])
    cut = hidden.changed(
        remove_links=[n for n in leg.links if n in hidden.links],
        remove_joints=[n for n in leg.joints if n in hidden.joints],
    )
    cut = replace(cut, observations=tuple(o for o in cut.observations if o.link in cut.links))
    loose = [n for n in cut.links if n != cut.base and not cut.joints_of(n)]
    assert caught(judged(robot, cut.changed(remove_links=loose), *legs))


def passive(hidden: Mechanism, name: str) -> Mechanism:
    return hidden.changed(joints=[replace(hidden.joints[name], motor=None)])


def exchanged(hidden: Mechanism, name: str) -> Mechanism:
    joint = hidden.joints[name]
    assert joint.type is JointType.UNIVERSAL
    return hidden.changed(joints=[replace(joint, axes=(joint.axes[1], joint.axes[0]))])


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["3upu", "3puu", "3ruu"])
def test_exchanged_axes_of_a_universal_joint_are_caught(robot: str) -> None:
    """The two orders agree at the zero configuration, and it proves nothing."""
    hidden, samples = hidden_of(robot), derived(robot).setup.samples
    wrong = exchanged(hidden, virtual(hidden)[0])
    right_twin, wrong_twin = (PinocchioModel(each, samples.model.length) for each in (hidden, wrong))
    at_zero = [
        compute_relation(ClosedConfiguration.of(model, model.q0), samples.observation_model).basis
        for model in (right_twin, wrong_twin)
    ]
    assert compute_largest_angle(*at_zero) < RELATION_ANGLE_TOL
    assert caught(judged(robot, wrong))


def test_exchanged_axes_under_a_ball_are_no_mistake() -> None:
    """A rod that ends in a ball may spin: only its direction counts, and both orders reach it."""
    hidden = hidden_of("gough_stewart", "1", "2", "3")
    right = judged("gough_stewart", exchanged(hidden, virtual(hidden)[0]), "1", "2", "3")
    assert right.passed


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"), [("gough_stewart", ("1", "2", "3")), ("3rrr_m1", ()), ("delta", ("1", "2")), ("rrrrr_m1", ())]
)
def test_a_missing_actuator_is_caught(robot: str, legs: tuple[str, ...]) -> None:
    hidden = hidden_of(robot, *legs)
    certificate = judged(robot, passive(hidden, virtual(hidden)[0]), *legs)
    assert caught(certificate)
    assert "parametrise" in certificate.reason


def test_a_redundant_actuator_may_be_missing() -> None:
    """Three directions see one freedom of the platform: two angles follow from the third."""
    hidden = hidden_of("3prp")
    assert judged("3prp", passive(hidden, virtual(hidden)[0])).passed


def test_a_motor_that_moves_something_unseen_is_caught() -> None:
    hidden = hidden_of("3prp")
    slide = next(j for j in hidden.joints.values() if j.type is JointType.PRISMATIC)
    certificate = judged("3prp", hidden.changed(joints=[replace(slide, motor=Motor("extra"))]))
    assert caught(certificate)
    assert "parametrise" in certificate.reason


def test_a_blind_leg_that_moves_is_caught() -> None:
    """Where the observed link is not in the hidden robot its direction must be constant."""
    hidden = hidden_of("3rrr_m1")
    leg = derived("3rrr_m1").setup.decomposition.leg("3")
    owned = {n for n in hidden.links if n in leg.links}
    cut = hidden.changed(remove_links=sorted(owned))
    cut = replace(cut, observations=tuple(o for o in cut.observations if o.link in cut.links))
    certificate = judged("3rrr_m1", cut)
    assert caught(certificate)
    assert certificate.mismatch is not None
    assert certificate.mismatch.real.dimension == 3


def test_further_bodies_count() -> None:
    """A hidden robot that keeps the platform may still move a link of the real robot in another way."""
    derivation = derived("quattro", ("1", "4"))
    samples = derivation.setup.samples
    assert derivation.hidden is not None
    assert check_equivalence(samples, derivation.hidden, count=2, bodies=("plate_12", "plate_34")).passed
    rods = check_equivalence(samples, derivation.hidden, count=2, bodies=("rod_1a",))
    assert not rods.passed
    assert "dim ρ" in rods.reason or "turns" in rods.reason
