"""Steps follow the branch: walks stay in one operation mode, a zero configuration in several is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hrsynth.analysis.advice import advise
from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import derive
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.setup_records import describe_other_modes
from hrsynth.analysis.verdict import compute_verdict
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.description import load
from hrsynth.errors import BadMechanism, BranchPoint, InfinitesimalMobility, SamplingFailure
from hrsynth.geometry.vectors import Array, rotate_about_axis
from hrsynth.kinematics.branch_tests import (
    SINGULAR_VALUE_RATIO_MAX,
    TANGENT_ANGLE_MAX_RAD,
    has_steady_values_after,
    is_small_principal_angle,
)
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.sampling import _Walks, sample
from hrsynth.kinematics.velocity_relation import ObservationModel, compute_relation
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.pose import Pose
from kinematics.robots import setting_of

POD = "(Pk*-Utn-Unt)+(Pz*-2SSt)+(Pz*-Utn-S)+(Rt*-2SSt)"


def parallelogram(angle: float, normal: tuple[float, float, float] = (0, 0, 1)) -> Mechanism:
    """A four-bar with equal cranks and equal rails, its cranks at ``angle`` from the rails; the coupler translates, but
    where it is flat it can cross over and turns from there on."""
    turn = rotate_about_axis(np.array([*normal], dtype=float), 0.4)
    tip = turn @ np.array([np.cos(angle), np.sin(angle), 0.0]) * 0.3
    rail = turn @ np.array([0.5, 0.0, 0.0])
    axis = turn @ np.array([0.0, 0.0, 1.0])
    builder = Builder("parallelogram")
    for name in ("base", "left", "right", "coupler"):
        builder.link(name)
    builder.joint("a", "R", "base", "left", (0, 0, 0), axis=axis, motor="m")
    builder.joint("b", "R", "left", "coupler", tip, axis=axis)
    builder.joint("c", "R", "base", "right", rail, axis=axis)
    builder.joint("d", "R", "right", "coupler", rail + tip, axis=axis, loop=True)
    builder.observe("1", "left", tip)
    builder.observe("2", "right", tip)
    return builder.build(platform="coupler")


@pytest.mark.parametrize("robot", ["3rrr_m1", "gough_stewart", "quattro", "3upu"])
def test_bounds_never_say_what_singular_values_deny(robot: str) -> None:
    """Of short and of long steps: where bounds decide, singular values and angles say the same; of both kinds some."""
    rng, here = np.random.default_rng(0), setting_of(robot).configurations[0]
    kept, said = here.strengths, set()
    for size in np.geomspace(0.01, 3.0, 60):
        step = rng.normal(size=here.model.nv)
        step *= size / np.linalg.norm(step)
        values = np.linalg.svd(here.model.jacobian(here.model.integrate(here.q, step)), compute_uv=False)[: len(kept)]
        alike = bool(
            np.all(values <= SINGULAR_VALUE_RATIO_MAX * kept) and np.all(kept <= SINGULAR_VALUE_RATIO_MAX * values)
        )
        assert has_steady_values_after(here, step) == alike
        tangent = here.kernel()[0]
        other = np.linalg.qr(tangent + size * rng.normal(size=tangent.shape) / 10)[0]
        little = bool(np.linalg.norm(other - tangent @ (tangent.T @ other), 2) <= np.sin(TANGENT_ANGLE_MAX_RAD))
        assert is_small_principal_angle(tangent, other) == little
        said |= {("alike", alike), ("little", little)}
    assert len(said) == 4


@pytest.mark.some(1)
@pytest.mark.parametrize("angle", [0.02, 0.1, 0.3, 1.2, np.pi - 0.05])
@pytest.mark.parametrize("normal", [(0, 0, 1), (0.48, 0.6, 0.64)])
def test_a_parallelogram_does_not_cross_over(angle: float, normal: tuple[float, float, float]) -> None:
    """The coupler never turns: not in samples, not on long walks towards the flat configurations."""
    robot = parallelogram(angle, normal)
    model = PinocchioModel(robot)
    observation_model = ObservationModel("coupler", None, "base", robot.observations)
    home = model.pose(model.q0, "coupler")[:3, :3]
    start = ClosedConfiguration.of(model, model.q0)
    drawn = sample(model, observation_model, 10)
    met = [*(member.configuration for member in drawn.members), *walk_randomly(start, 300, steps=60)]
    assert max(float(np.abs(at.pose("coupler")[:3, :3] - home).max()) for at in met) < 1e-8
    assert max(float(np.linalg.norm(model.difference(start.q, at.q))) for at in met) > 0.1


@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_a_flat_parallelogram_belongs_to_two_modes(angle: float) -> None:
    """Both ways out are told, and no verdict is given."""
    robot = parallelogram(angle)
    with pytest.raises(BranchPoint) as caught:
        sample(PinocchioModel(robot), ObservationModel("coupler", None, "base", robot.observations), 5)
    assert len(caught.value.modes) == 2
    assert any("1T" in mode for mode in caught.value.modes)
    assert any("1R" in mode for mode in caught.value.modes)
    assert caught.value.exit_status == 3


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["quattro", "3rrr_m1", "i4l", "orthoglide", "gough_stewart", "halved"])
def test_walks_in_step_end_where_each_ends_alone(robot: str) -> None:
    """To the last digit, where all steps are whole and where some have to be halved."""
    halved = build_mechanism(parse("(Ph*-Pj-Ra-Ra-Ra)+(Ph*-Ra-Rb-Ra-Pj)+(Ra*-Ra-Ph-Ra-Rb)"), 0)
    drawn = ObservedRobot.of(halved).all_samples if robot == "halved" else setting_of(robot).all_samples
    together, alone = (_Walks(drawn.observation_model, set(), np.random.default_rng(0), False) for _ in range(2))
    ends = together.walk([drawn.start] * 3), [end for _ in range(3) for end in alone.walk([drawn.start])]
    assert len(ends[0]) == 3
    assert len(together.beyond) == len(alone.beyond)
    assert bool(together.beyond) == (robot == "halved")
    for one, other in zip(*ends, strict=True):
        assert one.configuration.q.tolist() == other.configuration.q.tolist()
        assert one.relation.basis.tolist() == other.relation.basis.tolist()
        for target, same in zip(one.way, other.way, strict=True):
            assert target.pose.tolist() == same.pose.tolist()
            assert target.wanted.tolist() == same.wanted.tolist()


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["quattro", "3rrr_m1", "i4l", "orthoglide", "gough_stewart", "delta", "3rps"])
def test_samples_do_not_rest_on_rounding(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other last digits of the loops' Jacobian turn the bases of its kernel, but lead to the same configurations."""
    drawn = setting_of(robot).all_samples
    exactly, rng = PinocchioModel.jacobian, np.random.default_rng(4)

    def rounded(self: PinocchioModel, q: np.ndarray) -> np.ndarray:
        J = exactly(self, q)
        return J * (1 + 4e-16 * rng.normal(size=J.shape))

    plain = sample(PinocchioModel(drawn.model.mechanism), drawn.observation_model, 3)
    monkeypatch.setattr(PinocchioModel, "jacobian", rounded)
    other = sample(PinocchioModel(drawn.model.mechanism), drawn.observation_model, 3)
    for one, two in zip(plain.members, other.members, strict=True):
        assert np.abs(drawn.model.difference(one.configuration.q, two.configuration.q)).max() < 1e-6


@pytest.mark.some(1)
@pytest.mark.parametrize("dimensions", [1000, 1002])
def test_a_sample_with_a_faint_turn_is_of_the_same_mode(dimensions: int) -> None:
    """At some samples of some seeds the platform's third turn has a singular value of 1e-8: no other operation mode."""
    robot = build_mechanism(parse("(Ph-Pj-Ra-Rb-Ra)+(Ph!-Ra-Rb-Ra-Pj)"), dimensions)
    found = [ObservedRobot.of(robot, seed=seed) for seed in range(5)]
    assert {setup.all_samples.signature.motion for setup in found} == {"1T3R"}


@pytest.mark.some(1)
@pytest.mark.parametrize(("dimensions", "seed"), [(7, 0), (140, 1), (185, 3), (518, 1), (572, 0)])
def test_samples_of_a_pod_stay_in_its_operation_mode(dimensions: int, seed: int) -> None:
    """The rails of legs 2 and 3 are along z, so neither sees the platform, which only translates, move along z. In its
    other operation mode, which lies near, the platform turns and both together see all."""
    setup = ObservedRobot.of(build_mechanism(parse(POD), dimensions), seed=seed)
    segments = setup.segments
    assert [setup.mechanism.joints[f"joint_{leg}_1"].axis.tolist() for leg in (2, 3)] == [[0, 0, 1]] * 2
    for at in setup.configurations:
        R = at.pose("platform")[:3, :3]
        assert np.abs(R - setup.motion.home[:3, :3]).max() < 1e-7
    verdict = compute_verdict(setup, ("2", "3"), setup.all_samples.restrict(segments[1:3]))
    assert (verdict.rank, verdict.dof) == (2, 3)
    assert [freedom.name for freedom in verdict.unobserved] == ["translation along z"]


@pytest.mark.slow
def test_another_operation_mode_is_named_and_can_be_asked_for() -> None:
    """Beside its translations this pod has a mode in which it turns: legs 2 and 3 see all of that."""
    robot, seed = build_mechanism(parse(POD), 572), 3
    found = legs(robot, seed=seed)
    (other,) = found.setup.all_samples.other_modes
    assert (found.setup.all_samples.signature.motion, other.signature.motion) == ("3T", "3R")
    assert "legs 2, 3 observe 3 of 3" in describe_other_modes(found.setup)[0]
    there = legs(robot, at=str(Pose.of(other.at.pose("platform"))), seed=seed)
    ranks = [{each.legs: each.rank for each in answer.sets}["2", "3"] for answer in (found, there)]
    assert ranks == [2, 3]


def test_a_cure_cures_on_the_whole_branch() -> None:
    """Legs of this robot have closures beside each other, 0.01 rad apart; samples of two make 18 wrong cures of 36."""
    setup = ObservedRobot.of(build_mechanism(parse("3(Ph*-Ra-Rb-Rb-Pj)"), 4))
    advice = advise(setup)
    assert advice.has_sufficient_sets
    assert (len(advice.sets), advice.undecided) == (18, 0)
    places = list(walk_randomly(setup.all_samples.start, 24, seed=5, steps=6))[3::4]
    for cure in advice.sets:
        watched = (*setup.observed, *(each.observation for each in cure.measurements))
        observation_model = replace(setup.all_samples.observation_model, observations=watched)
        assert all(compute_relation(at, observation_model).rank == setup.dof for at in places)


CASSIE = """<mujoco model="leg"><compiler eulerseq="zyx" autolimits="true"/><worldbody><body name="hip">
  <body name="achilles-rod" pos="0 0 0.045" xyaxes="0.7922 -0.60599 -0.072096 0.60349 0.79547 -0.054922">
    <joint name="achilles-rod" type="ball"/></body>
  <body name="knee" pos="0.12 0 0.0045" xyaxes="0.70711 -0.70711 0 0.70711 0.70711 0">
    <joint name="knee" type="hinge" ref="-45"/>
    <body name="shin" pos="0.06068 0.04741 0"><joint name="shin" type="hinge"/>
      <body name="tarsus" pos="0.43476 0.02 0" xyaxes="0.52992 0.84805 0 -0.84805 0.52992 0">
        <joint name="tarsus" type="hinge" ref="58"/>
        <body name="heel-spring" pos="-0.01269 -0.03059 0.00092"
              xyaxes="-0.91211 0.40829 0.036948 -0.40992 -0.90952 -0.068841">
          <joint name="heel-spring" type="hinge"/></body>
        <body name="foot-crank" pos="0.058 -0.034 0.02275"><joint name="foot-crank" type="hinge"/>
          <body name="plantar-rod" pos="0.055 0 -0.00791"><joint name="plantar-rod" type="hinge"/></body></body>
        <body name="foot" pos="0.408 -0.04 0"><joint name="foot" type="hinge"/></body>
      </body></body></body></body></worldbody>
  <equality><connect body1="plantar-rod" body2="foot" anchor="0.35012 0 0"/>
    <connect body1="achilles-rod" body2="heel-spring" anchor="0.5012 0 0"/></equality>
  <actuator><motor name="knee" joint="knee"/><motor name="foot" joint="foot"/></actuator></mujoco>
"""
"""A leg of the walking robot Cassie between hip and foot (dimensions of its MuJoCo model): at zero the spring's heel is
at a dead point."""


@pytest.mark.slow
def test_the_verdict_of_a_leg_at_a_dead_point_is_that_of_its_branch(tmp_path: Path) -> None:
    """Where the heel has left its dead point, the leg with the spring sees one freedom, the other none."""
    file = tmp_path / "leg.xml"
    file.write_text(CASSIE)
    robot = load(str(file), base="hip", platform="foot")
    for seed in range(3):
        assert [each.rank for each in legs(robot, seed=seed).sets] == [1, 0, 2]
    found = derive(robot)
    assert (found.verdict.rank, found.dof, found.equivalence.passed) == (2, 3, True)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("tilt", "rank", "near"), [(1e-3, 2, False), (1e-6, 2, True), (1e-8, 1, True), (0.0, 1, False)]
)
def test_the_distance_to_another_verdict_is_told(tilt: float, rank: int, near: bool) -> None:
    """Parallel rails leave a translation unseen; rails that are nearly so show it by as little as they are aslant."""
    robot = load("prrrp_parallel")
    rails = [joint for joint in robot.joints.values() if joint.type is JointType.PRISMATIC]
    turned = replace(rails[0], axes=(rotate_about_axis(np.array([0.0, 0.0, 1.0]), tilt) @ rails[0].axis,))
    robot = robot.changed(joints=[turned if joint.name == turned.name else joint for joint in robot.joints.values()])
    for seed in range(3):
        verdict = legs(robot, seed=seed).sets[-1]
        assert (verdict.rank, verdict.is_near_cutoff) == (rank, near)
        margin = verdict.margin
        assert margin.largest_dropped < margin.cutoff < margin.smallest_kept
        if near:
            value = margin.smallest_kept if rank == 2 else margin.largest_dropped
            assert tilt / 10 < value < 10 * tilt


def slider_crank(angle: float) -> Mechanism:
    """A crank of 1 m at an angle from its rail, a rod of 2 m and a slide; the slide carries the platform by a link that
    never turns."""
    tip = np.array([np.cos(angle), 0.0, np.sin(angle)])
    foot = np.array([tip[0] + np.sqrt(4 - tip[2] ** 2), 0.0, 0.0])
    end = foot + [1.0, 0.0, 1.0]
    b = Builder("slider_crank")
    for link, at in {
        "base": np.zeros(3),
        "crank": np.zeros(3),
        "rod": tip,
        "slide": foot,
        "link": foot,
        "plate": end,
    }.items():
        b.link(link, at=at)
    for name, ends, at in (
        ("a", "base crank", np.zeros(3)),
        ("b", "crank rod", tip),
        ("c", "rod slide", foot),
        ("d", "slide link", foot),
        ("e", "link plate", end),
    ):
        b.joint(name, "R", *ends.split(), at=at, axis=(0, 1, 0), motor=name == "a")
    for name, link, at in (("p", "slide", foot), ("f", "plate", end)):
        b.joint(name, "P", "base", link, at=at, axis=(1, 0, 0), loop=True)
    return b.build("plate")


def test_a_platform_at_rest_at_a_dead_centre_moves_beyond_it() -> None:
    """By hand: x(θ) = cos θ + √(4 − sin² θ) + 1 has x′(0) = 0 and x(0.4) < x(0)."""
    dead, beside = (ObservedRobot.of(slider_crank(angle), samples=2) for angle in (0.0, 0.4))
    assert dead.dof == beside.dof == 1
    places = [member.pose("plate")[0, 3] for member in dead.configurations]
    assert max(places) < 4.0
    assert compute_verdict(dead, ("1",), dead.samples).verdict == "uncontrollable"


def test_a_triangle_does_not_move() -> None:
    b = Builder("triangle")
    for link in ("base", "side", "plate"):
        b.link(link)
    for name, ends, at in (
        ("a", ("base", "side"), (0, 0, 0)),
        ("b", ("side", "plate"), (0, 0, 1)),
        ("c", ("base", "plate"), (1, 0, 0)),
    ):
        b.joint(name, "R", *ends, at=at, axis=(0, 1, 0), loop=name == "c")
    with pytest.raises(BadMechanism, match=r"its loops let no link move"):
        ObservedRobot.of(b.build("plate"), samples=2)


def equal_rods(feet: Array, along: Array) -> Mechanism:
    """A plate on equal parallel rods from these feet."""
    b = Builder("equal_rods")
    b.link("base")
    b.link("plate", at=along)
    for k, foot in enumerate(feet):
        b.link(f"rod_{k}", at=foot)
        b.joint(f"u_{k}", "U", "base", f"rod_{k}", at=foot, axis=(1, 0, 0), axis2=np.cross(along, [1, 0, 0]))
        b.joint(f"s_{k}", "S", f"rod_{k}", "plate", at=foot + along, loop=k > 0)
    return b.build("plate")


@pytest.mark.parametrize("seed", range(3))
def test_three_equal_parallel_rods_turn_their_plate(seed: int) -> None:
    """They lie on a circular cylinder, about whose axis rods turn by any angle; other four do not."""
    rng, along = np.random.default_rng(seed), np.array([0.3, 0.1, 0.8])
    feet = np.c_[rng.normal(size=(4, 2)), np.zeros(4)]
    assert ObservedRobot.of(equal_rods(feet[:3], along), samples=2).dof == 3
    u, length = along / np.linalg.norm(along), float(np.linalg.norm(along))
    across = feet - np.outer(feet @ u, u)
    sides = across[1:3] - across[0]
    centre = across[0] + np.linalg.solve(np.vstack([sides, u]), [*(np.sum(sides**2, axis=1) / 2), 0])
    radius = float(np.linalg.norm(across[0] - centre))
    angle = 0.5 * length / radius
    R = Rotation.from_rotvec(angle * u).as_matrix()
    shift = centre - R @ centre + np.sqrt(length**2 - (2 * radius * np.sin(angle / 2)) ** 2) * u
    ends = np.linalg.norm(feet @ R.T + shift - feet, axis=1)
    np.testing.assert_allclose(ends[:3], length, rtol=1e-12)
    assert abs(ends[3] - length) > 1e-4 * length


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize(("rods", "seed"), [(5, 1), (6, 1)])
def test_equal_parallel_rods_do_not_turn_their_plate(rods: int, seed: int) -> None:
    """To first order the plate turns about the rods' direction. Lengths alone: of poses near the first, turned so,
    the nearest with rods of this length is not turned."""
    feet = np.c_[np.random.default_rng(seed).normal(size=(rods, 2)), np.zeros(rods)]
    along = np.array([0.3, 0.1, 0.8])
    robot = equal_rods(feet, along)
    model = PinocchioModel(robot)
    assert ClosedConfiguration.of(model, model.q0).kernel()[0].shape[1] == 3
    with pytest.raises(InfinitesimalMobility, match="mobility 3 to first order, 2 in finite motion"):
        ObservedRobot.of(robot)

    def misses(pose: Array) -> Array:
        turned = feet @ Rotation.from_rotvec(pose[3:]).as_matrix().T
        return np.asarray(np.sum((turned + pose[:3] - feet) ** 2, axis=1) - along @ along)

    for turn in (0.02, -0.02):
        start = np.r_[along, turn * along / np.linalg.norm(along)]
        closed = least_squares(misses, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert np.abs(misses(closed.x)).max() < 1e-9
        assert np.linalg.norm(closed.x[3:]) < 0.002


def test_walks_that_lead_nowhere_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    all_samples = setting_of("3rrr_m1").all_samples
    monkeypatch.setattr(_Walks, "walk", lambda walks, roots: [])
    with pytest.raises(SamplingFailure, match=r": 0 samples from 20 random walks, 5 needed: .*--at POSE"):
        sample(all_samples.model, all_samples.observation_model, 5)
