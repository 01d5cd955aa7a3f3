"""Rules by themselves: the certificate and the oracle catch wrong ones, refusals say why, forms are as stated."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.kinematics.equivalence import check_equivalence
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import JointType, Mechanism, Motor
from hrsynth.rewrite.evidence import Evidence, choose_far_direction, fit_linear_locus
from hrsynth.rewrite.rule import Proposal, Refusal
from hrsynth.rewrite.rules import end_change, joint_substitution, leg_removal, lift, list_rules, motors_off, pi_form
from hrsynth.rewrite.state import State
from hrsynth.rewrite.strategy import GENERAL, SIMPLIFIED, RewriteTrace, apply_unchecked
from kinematics.robots import derived, led, seen_by_oracle, setting_of, state_of
from oracle import NotAssembled, Oracle, Undecided, logarithm, same_relation
from strategies import deltas, random_direction, random_rotation

DIFFERENT = 1e-4


def oracle_angle(setup: ObservedRobot, mechanism: Mechanism) -> float:
    """The largest angle between the relations of the real robot and a rewritten one over the samples, by the oracle;
    pi/2 where it cannot follow."""
    samples = setup.samples
    real, angle = Oracle(setup.mechanism), 0.0
    for member in samples.members:
        ours = seen_by_oracle(
            real, state_of(samples.model, member.configuration.q), samples.observation_model, samples.model.length
        )
        try:
            oracle, state = led(mechanism, samples.observation_model, member.way)
            theirs = seen_by_oracle(oracle, state, samples.observation_model, samples.model.length)
        except (NotAssembled, Undecided):
            return float(np.pi / 2)
        angle = max(angle, same_relation(ours, theirs))
    return angle


def is_wrong(setup: ObservedRobot, mechanism: Mechanism, bodies: tuple[str, ...] = ()) -> None:
    """The certificate refuses it, and the oracle sees the difference."""
    certificate = check_equivalence(setup.samples, mechanism, bodies=bodies, complete=False)
    assert not certificate.passed
    assert certificate.reason
    assert oracle_angle(setup, mechanism) > DIFFERENT


def is_right(setup: ObservedRobot, mechanism: Mechanism) -> None:
    certificate = check_equivalence(setup.samples, mechanism, complete=False)
    assert certificate.passed, certificate.reason
    assert oracle_angle(setup, mechanism) < 1e-6


def evidence_of(setup: ObservedRobot) -> Evidence:
    return Evidence(setup.decomposition, setup.samples)


def simplified(setup: ObservedRobot) -> RewriteTrace:
    def check(mechanism: Mechanism, bodies: tuple[str, ...]) -> object:
        return check_equivalence(setup.samples, mechanism, bodies=bodies, complete=False)

    return SIMPLIFIED(RewriteTrace.of(evidence_of(setup), check))  # type: ignore[arg-type]


def proposals(found: Iterable[Proposal | Refusal]) -> tuple[list[Proposal], list[Refusal]]:
    all_samples = list(found)
    return ([p for p in all_samples if isinstance(p, Proposal)], [r for r in all_samples if isinstance(r, Refusal)])


def lifted(setup: ObservedRobot) -> State:
    """The exact lift of all observed legs, motors off."""
    evidence = evidence_of(setup)
    state = State(setup.decomposition, replace(setup.decomposition.mechanism, observations=()))
    state = proposals(motors_off.RULE.proposals(state, evidence))[0][0].state
    for leg in dict.fromkeys(o.leg for o in setup.observed):
        state = proposals(lift.RULE.proposals(state, evidence, leg))[0][0].state
    return state


def skew(legs: int, rng: np.random.Generator, pods: int = 0) -> Mechanism:
    """A robot with R-R-S legs whose two R are skew, and further S-P-S legs."""
    builder = Builder("skew")
    builder.link("base")
    height = np.array([0.05, -0.03, 0.9])
    builder.link("platform", height, random_rotation(rng))
    for number in range(legs + pods):
        angle = 2 * np.pi * number / (legs + pods) + rng.uniform(-0.2, 0.2)
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot, tip = 0.6 * way, height + 0.25 * way
        label = str(number + 1)
        if number >= legs:
            builder.link(f"barrel_{label}", foot, random_rotation(rng))
            builder.link(f"rod_{label}", tip, random_rotation(rng))
            builder.joint(f"ball_{label}", "S", "base", f"barrel_{label}", foot)
            builder.joint(f"slide_{label}", "P", f"barrel_{label}", f"rod_{label}", foot, axis=tip - foot, motor=True)
            builder.joint(f"wrist_{label}", "S", f"rod_{label}", "platform", tip, loop=True)
            builder.observe(label, f"rod_{label}", tip - foot)
            continue
        elbow = (foot + tip) / 2 + 0.3 * way + 0.05 * rng.normal(size=3)
        builder.link(f"arm_{label}", elbow, random_rotation(rng))
        builder.link(f"rod_{label}", tip, random_rotation(rng))
        first = np.cross(way, [0, 0, 1]) + 0.3 * random_direction(rng)
        builder.joint(f"shoulder_{label}", "R", "base", f"arm_{label}", foot, axis=first, motor=True)
        builder.joint(
            f"elbow_{label}", "R", f"arm_{label}", f"rod_{label}", elbow, axis=first + 0.8 * random_direction(rng)
        )
        builder.joint(f"wrist_{label}", "S", f"rod_{label}", "platform", tip, loop=number > 0)
        builder.observe(label, f"rod_{label}", tip - elbow)
    return builder.build(platform="platform")


# --- wrong rules -------------------------------------------------------------------------------------------------


@pytest.mark.some(1)
@pytest.mark.parametrize(("legs", "pods", "seed"), [(3, 0, 1), (3, 0, 2), (1, 5, 3), (2, 3, 4)])
def test_takeover_of_a_skew_elbow_is_caught(legs: int, pods: int, seed: int) -> None:
    """An R that is skew to the base R cannot give way to U: done without its side condition it changes the relation."""
    setup = ObservedRobot.of(skew(legs, np.random.default_rng(seed), pods), samples=3)
    state, evidence = lifted(setup), evidence_of(setup)
    offered, refused = proposals(joint_substitution.RULE.proposals(state, evidence, "1"))
    assert offered == []
    assert "cannot rotate about its own direction" in refused[0].reason
    forced, _ = proposals(joint_substitution.RULE.proposals(state, evidence, "1", waive=True))
    is_wrong(setup, forced[0].state.mechanism)
    is_right(setup, state.mechanism)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("legs", "pods", "seed", "word"),
    [(3, 0, 1, "3-{RR|Pi-U*R}-S"), (1, 5, 3, "{RR|Pi-U*R}-S"), (2, 3, 4, "2-{RR|Pi-U*R}-S")],
)
def test_legs_with_skew_axes_keep_their_joint(legs: int, pods: int, seed: int, word: str) -> None:
    setup = ObservedRobot.of(skew(legs, np.random.default_rng(seed), pods), samples=3)
    result = simplified(setup)
    is_right(setup, result.state.mechanism)
    assert word in result.state.architecture().ascii.split("+")
    refused = [s for s in result.steps if s.rule == "joint substitution" and not s.accepted and int(s.leg or 0) <= legs]
    assert len(refused) == legs
    for number in range(1, legs + 1):
        assert f"elbow_{number}" in result.state.mechanism.joints


@pytest.mark.parametrize("observed", [("1", "2"), ("3",)])
def test_removal_of_a_leg_that_holds_the_platform_is_caught(observed: tuple[str, ...]) -> None:
    """Each leg of 3-RPS takes one freedom from the platform."""
    setup = setting_of("3rps", observed, None, 3)
    result = simplified(setup)
    assert result.state.removed == ()
    kept = {step.leg for step in result.steps if step.rule == "keep"}
    assert kept == set(setup.decomposition.labels) - set(observed)
    for leg in kept:
        offered, _ = proposals(leg_removal.RULE.proposals(result.state, evidence_of(setup), leg or ""))
        is_wrong(setup, offered[0].state.mechanism, offered[0].bodies)


def test_the_leg_with_the_camera_is_never_removed() -> None:
    setup = setting_of("delta", ("1", "2"), "rod_3a", 3)
    offered, refused = proposals(leg_removal.RULE.proposals(lifted(setup), evidence_of(setup), "3", waive=True))
    assert offered == []
    assert "camera" in refused[0].reason
    assert "rod_3a" in simplified(setup).state.mechanism.links


def turned_carriers(setup: ObservedRobot, mechanism: Mechanism, state: State) -> float:
    """By how much (rad) the carriers of the virtual actuators turn on the way to the samples, by the oracle."""
    turns = []
    for member in setup.samples.members:
        oracle, reached = led(mechanism, setup.samples.observation_model, member.way)
        for chain in state.chains:
            R = oracle.pose(reached, chain.carrier)[:3, :3] @ mechanism.links[chain.carrier].pose[:3, :3].T
            turns.append(float(np.linalg.norm(logarithm(R))))
    return max(turns)


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["3rrr_m1", "delta", "3ruu", "quattro_rigid"])
def test_a_parallelogram_with_a_wrong_offset_is_caught(robot: str) -> None:
    """One crank's foot 2 % off: the carrier turns with the arm, and the actuator's angle is not the direction's."""
    setup = setting_of(robot, None, None, 3)
    before = GENERAL(
        RewriteTrace.of(
            evidence_of(setup),
            lambda m, bodies: check_equivalence(setup.samples, m, count=1, bodies=bodies, complete=False),
        )
    )
    offered, _ = proposals(pi_form.RULE.proposals(before.state, evidence_of(setup), "1"))
    state, right = offered[0].state, offered[0].state.mechanism
    is_right(setup, right)
    assert turned_carriers(setup, right, state) < 1e-9
    joint = right.joints[next(n for n in right.joints if n.startswith("crank_base"))]
    for direction in np.linalg.svd(joint.axis[None])[2][1:]:
        wrong = right.changed(joints=[replace(joint, point=joint.point + 0.02 * right.length * direction)])
        assert turned_carriers(setup, wrong, state) > 1e-4
        certificate = check_equivalence(setup.samples, wrong, complete=False)
        assert not certificate.passed
        assert "parametrise" in certificate.reason


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(4))
def test_trust_in_arms_that_turn_the_parallelogram_is_caught(seed: int) -> None:
    """Where the base R is not parallel to the short side, the companion rod does not stay beside the observed one."""
    setup = ObservedRobot.of(deltas(["R"] * 3, ["2-SS"] * 3, np.random.default_rng(seed), False), samples=3)
    evidence = evidence_of(setup)
    trusted = apply_unchecked(evidence, change_ends=False)
    assert len(trusted) == 1
    assert trusted[0].state.architecture().ascii == "3-Pi-{2-U*S}"
    is_wrong(setup, trusted[0].state.mechanism)
    result = simplified(setup)
    is_right(setup, result.state.mechanism)
    refused = [step for step in result.steps if step.rule == "rod transfer" and not step.accepted]
    assert {step.leg for step in refused} == {"1", "2", "3"}
    assert all("changes direction" in step.reason for step in refused)
    assert result.state.architecture().ascii != "3-Pi-{2-U*S}"


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
def test_trust_in_aligned_arms_is_justified(seed: int) -> None:
    setup = ObservedRobot.of(deltas(["R"] * 3, ["2-SS"] * 3, np.random.default_rng(seed), True), samples=3)
    trusted = apply_unchecked(evidence_of(setup), change_ends=False)
    is_right(setup, trusted[0].state.mechanism)
    result = simplified(setup)
    assert result.state.architecture() == trusted[0].state.architecture()
    assert result.state.architecture().ascii == "3-Pi-{2-U*S}"


def test_a_ball_made_universal_where_the_rod_spins_otherwise_is_caught() -> None:
    """Ends of a Gough-Stewart platform may not be changed: each takes a freedom away."""
    setup = setting_of("gough_stewart", None, None, 3)
    state = simplified(setup).state
    offered, _ = proposals(end_change.RULE.proposals(state, evidence_of(setup), waive=True))
    assert offered
    for proposal in offered:
        is_wrong(setup, proposal.state.mechanism)


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["delta", "3rrr_m1", "gough_stewart"])
def test_the_lift_has_virtual_motors_only(robot: str) -> None:
    """The lift has one motor a leg, a virtual one; every real motor is passive, and nothing is constrained."""
    setup = setting_of(robot, None, None, 3)
    state = lifted(setup)
    driven = {n for n, joint in state.mechanism.joints.items() if joint.is_actuated}
    assert driven == {chain.actuator for chain in state.chains}
    assert driven.isdisjoint(setup.mechanism.joints)
    is_right(setup, state.mechanism)


# --- reasons and conditions --------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", ["3rrr_m1", "3prr_m1", "gough_stewart", "3upu", "delta", "hexaglide", "rprpr_m2"])
def test_every_rule_gives_a_reason(robot: str) -> None:
    setup = setting_of(robot, None, None, 3)
    state, evidence = lifted(setup), evidence_of(setup)
    for rule in list_rules():
        assert rule.source
        for leg in setup.decomposition.labels:
            for found in rule.proposals(state, evidence, leg):
                assert len(found.reason) > 10, rule.name


def test_a_rule_does_not_touch_the_state_it_is_given() -> None:
    setup = setting_of("delta", None, None, 3)
    state, evidence = lifted(setup), evidence_of(setup)
    before = (dict(state.mechanism.links), dict(state.mechanism.joints), state.chains, dict(state.owners))
    for rule in list_rules():
        if rule is not lift.RULE:
            for leg in setup.decomposition.labels:
                list(rule.proposals(state, evidence, leg))
    assert before == (dict(state.mechanism.links), dict(state.mechanism.joints), state.chains, dict(state.owners))


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["3rpr_m1", "gough_stewart", "3upu", "3rps", "rprpr_m1"])
def test_sliding_joints_are_never_taken_over(robot: str) -> None:
    """PPR and PRP legs: a P before the observed link carries its direction, and stays."""
    derivation = derived(robot)
    assert derivation.hidden is not None
    slides = {n for n, j in derivation.setup.mechanism.joints.items() if j.type is JointType.PRISMATIC}
    assert slides
    assert slides <= derivation.hidden.joints.keys()


def test_companions_are_the_other_rods() -> None:
    setup = setting_of("delta", None, None, 3)
    evidence = evidence_of(setup)
    assert evidence.parallel_rods("rod_1a") == ("rod_1b",)
    assert evidence.parallel_rods("rod_1b") == ("rod_1a",)
    assert evidence.parallel_rods("arm_1") == ()
    assert evidence_of(setting_of("hexa", None, None, 3)).parallel_rods("rod_1") == ()


@pytest.mark.parametrize(
    ("robot", "joints", "dimension", "translates"),
    [
        ("3rrr_m1", 1, 2, False),
        ("3prr_m1", 1, 1, True),
        ("gough_stewart", 0, 0, True),
        ("delta", 1, 2, False),
        ("hexaglide", 1, 1, True),
        ("3ruu", 1, 2, False),
    ],
)
def test_the_part_before_the_observed_link(robot: str, joints: int, dimension: int, translates: bool) -> None:
    setup = setting_of(robot, None, None, 3)
    evidence = evidence_of(setup)
    for chain in lifted(setup).chains:
        proximal = evidence.proximal(chain.link)
        assert proximal is not None
        assert len(proximal.joints) == joints
        assert proximal.anchor_locus.dimension == dimension
        assert proximal.is_translating is translates
        assert (proximal.single_revolute is not None) is (dimension == 2)
        if dimension == 2:
            axis = proximal.joints[0].axis
            assert proximal.has_constant_direction(axis)
            assert proximal.turning_axis is not None
            assert abs(proximal.turning_axis @ axis) == pytest.approx(1)


@pytest.mark.parametrize("dimension", range(4))
def test_locus(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = rng.normal(size=3) + rng.normal(size=(15, dimension)) @ basis[:dimension]
    found = fit_linear_locus(points, 1.0)
    assert found.dimension == dimension
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-12)
    if dimension == 2:
        assert abs(found.normal @ basis[2]) == pytest.approx(1)


def test_a_circle_lies_in_a_plane_and_a_cone_has_an_axis() -> None:
    angles = np.linspace(0, 1, 9)
    cone = np.column_stack((np.cos(angles), np.sin(angles), np.full(9, 0.4)))
    assert fit_linear_locus(cone, 1.0).dimension == 2
    assert abs(fit_linear_locus(cone, 1.0).normal[2]) == pytest.approx(1)


def test_far_from() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        u = random_direction(rng)
        near = [u + 0.1 * random_direction(rng) for _ in range(5)]
        directions = np.array([v / np.linalg.norm(v) for v in near])
        e = choose_far_direction(directions)
        assert np.linalg.norm(e) == pytest.approx(1)
        assert np.max(np.abs(directions @ e)) < 0.3


def test_motors_are_counted_one_by_one() -> None:
    """A driven U has two motors; a robot may have none."""
    setup = setting_of("3upu")
    mechanism = setup.decomposition.mechanism
    universal = next(joint for joint in mechanism.joints.values() if joint.type == JointType.UNIVERSAL)
    passive = [replace(joint, motor=None) for joint in mechanism.joints.values()]
    for joints, words in (
        ([replace(universal, motor=Motor("m"))], "5 real motors become passive"),
        (passive, "the robot has no motors"),
        ([*passive, replace(universal, motor=Motor("m"))], "2 real motors become passive"),
    ):
        state = State(setup.decomposition, mechanism.changed(joints=joints))
        assert [match.reason for match in motors_off.find(state, evidence_of(setup), "1")] == [words]
