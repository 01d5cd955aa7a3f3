"""Singularities at poses: the counts' identities, ranks against the oracle, poses known to be singular, grids."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from math import sqrt

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

import hrsynth
from hrsynth.analysis import configuration_report as posture_module
from hrsynth.analysis.check import MEASURES, UNREACHABLE, Check, check
from hrsynth.analysis.configuration_report import ConfigurationAnalysis, ConfigurationReport
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity_indices import (
    Counts,
    compute_interaction_matrix,
    count_redundant_rows,
    subtract_generic_rows,
)
from hrsynth.description import load
from hrsynth.geometry.ranks import CLEAN
from hrsynth.geometry.vectors import Array, invert_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.velocity_relation import VelocityRelation, compute_relation
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Limits
from kinematics.robots import ROBOTS, setting_of, state_of
from oracle import Oracle, span
from strategies import parallel_robots, random_rotation

quick = settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@cache
def at_zero(robot: str) -> Check:
    return check(load(robot))


def check_identities(found: ConfigurationReport) -> None:
    for kinds in (found.hidden, found.real):
        if kinds is None or kinds.singularity_indices is None:
            continue
        c = kinds.singularity_indices
        assert c.IO == c.RI + c.RPM - c.IIM
        assert c.II == c.RO + c.RPM - c.IIM
        assert c.is_type3 == (c.is_type1 and c.is_type2)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.parametrize("before", [("1 0 0", "0 0 1"), ("0 1 0", "0 0 1"), ("0 0 1",)])
def test_a_pose_may_have_fewer_dof_than_are_generically_unobserved(before: tuple[str, ...], angle: float):
    """Slides, a turn about z, a slide along its x: the turn and the slide after it are not observed."""
    joints = [*(f'type="slide" axis="{axis}"' for axis in before), 'axis="0 0 1"', 'type="slide" axis="1 0 0"']
    bodies = "".join(f'<body name="b{k}"><geom size=".1"/><joint name="j{k}" {each}/>' for k, each in enumerate(joints))
    text = f"<mujoco><worldbody>{bodies}{'</body>' * len(joints)}</worldbody></mujoco>"
    robot = load(text, platform=f"b{len(joints) - 1}")
    (found,) = check(robot, at=f"joints:j{len(before)}={angle}").postures
    slides = np.array([[float(v) for v in axis.split()] for axis in before] + [[np.cos(angle), np.sin(angle), 0.0]])
    assert found.dof == np.linalg.matrix_rank(slides) + 1
    check_identities(found)
    assert found.hidden.type2 is False


def motor_rates(oracle: Oracle, state: Array, velocities: Array) -> Array:
    """The rates of the R and P motors that the links' twists make, lengths in characteristic lengths."""
    rows = []
    for joint in oracle.mechanism.joints.values():
        if not joint.is_actuated:
            continue
        assert joint.type in (JointType.REVOLUTE, JointType.PRISMATIC), joint.name
        before, after = (oracle.twist(velocities, link) for link in joint.links)
        R = oracle.pose(state, joint.predecessor)[:3, :3] @ oracle.mechanism.links[joint.predecessor].pose[:3, :3].T
        axis = R @ joint.axis
        if joint.type is JointType.REVOLUTE:
            rows.append(axis @ (after[3:] - before[3:]))
        else:
            here, there = (oracle.pose(state, link)[:3, 3] for link in joint.links)
            carried = before[:3] + np.cross(before[3:], there - here, axisa=0, axisc=0)
            rows.append(axis @ (after[:3] - carried) / oracle.length)
    return np.array(rows)


def dims(basis: Array, twist_rows: int) -> tuple[int, int, int]:
    """dim ρ, dim proj_t ρ, dim proj_u̇ ρ by the oracle."""
    return basis.shape[1], span(basis[:twist_rows]).shape[1], span(basis[twist_rows:]).shape[1]


@pytest.mark.some(16)
@pytest.mark.parametrize("robot", ROBOTS)
def test_ranks_are_those_of_the_oracle(robot: str) -> None:
    setup = setting_of(robot)
    examiner, observation_model = ConfigurationAnalysis(setup), setup.samples.observation_model
    oracle = Oracle(setup.mechanism)
    for at in (setup.all_samples.start, *(m.configuration for m in setup.all_samples.members)):
        found = examiner.examine(at)
        check_identities(found)
        assert found.has_decided_ranks
        state = state_of(at.model, at.q)
        point = observation_model.point is not None
        seen = oracle.relation(state, observation_model.observations, point_only=point)
        velocities, _ = oracle.kernel(state)
        assert found.mobility.total == velocities.shape[1]
        whole, dof, _ = dims(seen, observation_model.twist_rows)
        assert found.dof == dof
        assert len(found.hidden.unobserved) == whole - dims(seen, observation_model.twist_rows)[2]
        assert found.hidden.rank == dof - len(found.hidden.unobserved)
        assert found.real is not None
        t = oracle.twist(velocities, oracle.mechanism.platform)
        blocks = [t[:3] / oracle.length] if point else [t[:3] / oracle.length, t[3:]]
        moved = span(np.vstack([*blocks, motor_rates(oracle, state, velocities)]))
        whole, dof, driven = dims(moved, observation_model.twist_rows)
        assert found.real.rank == dof - (whole - driven)


@pytest.mark.parametrize("robot", ["delta", "gough_stewart", "3rrr_m1", "quattro", "prrrp_m1", "hexa"])
def test_singular_values_are_those_of_the_oracle(robot: str) -> None:
    """The extreme ratios |u̇| / |t| over all motions, from the oracle's ρ."""
    setup = setting_of(robot)
    oracle, examiner = Oracle(setup.mechanism), ConfigurationAnalysis(setup)
    for member in setup.all_samples.members:
        at, distances = member.configuration, examiner.classify(member.configuration).distances
        basis = oracle.relation(state_of(at.model, at.q), setup.observed)
        directions = np.linalg.svd(basis[:6], full_matrices=False)[0][:, : basis.shape[1]]
        values = np.linalg.svd(basis[6:] @ np.linalg.pinv(basis[:6]) @ directions, compute_uv=False)[: basis.shape[1]]
        assert distances.type2 == pytest.approx(values[-1], rel=1e-6)
        assert distances.type1 == pytest.approx(1 / values[0], rel=1e-6)
        assert distances.condition == pytest.approx(values[0] / values[-1], rel=1e-6)
        error = np.hypot(distances.millimetres / (1e3 * oracle.length * np.radians(1)), distances.degrees)
        assert error == pytest.approx(1 / values[-1], rel=1e-6)
        found = compute_relation(at, setup.samples.observation_model)
        M = compute_interaction_matrix(found)
        assert M is not None
        t = found.twist_part @ np.ones(found.dimension)
        np.testing.assert_allclose(M @ (found.twists.T @ t), found.rates @ np.ones(found.dimension), atol=1e-9)


@pytest.mark.some(16)
@pytest.mark.parametrize("robot", ROBOTS)
def test_redundant_rows_add_up(robot: str) -> None:
    """All rows of the loops less their rank, at zero and at samples; what is redundant only here is what is lost."""
    examiner = ConfigurationAnalysis(setting_of(robot))
    for at in (examiner.setup.all_samples.start, *(m.configuration for m in examiner.setup.all_samples.members)):
        rows = count_redundant_rows(at)
        J = at.model.jacobian(at.q)
        assert sum(count for _, count in rows) == len(J) - np.linalg.matrix_rank(J, tol=1e-8)
        assert {name for name, _ in rows} == set(at.model.loops)
        found = examiner.examine(at)
        assert sum(each.rows for each in found.redundant) == found.hidden.singularity_indices.IIM


def test_surplus_rows_stay_where_the_loss_stays() -> None:
    usual = (("a", 0), ("b", 2), ("c", 1))
    assert subtract_generic_rows((("a", 0), ("b", 2), ("c", 2)), usual) == (("a", 0), ("b", 0), ("c", 1))
    assert subtract_generic_rows((("a", 1), ("b", 1), ("c", 1)), usual) == (("a", 0), ("b", 0), ("c", 0))
    assert subtract_generic_rows((("a", 1), ("b", 2), ("c", 2)), usual) == (("a", 1), ("b", 0), ("c", 1))
    assert subtract_generic_rows((), usual) == ()


@pytest.mark.some(3)
@pytest.mark.parametrize("robot", ROBOTS)
def test_shipped_robots_are_regular_at_zero(robot: str) -> None:
    answer = at_zero(robot)
    (found,) = answer.postures
    check_identities(found)
    assert found.hidden.state == found.real.state == "regular"
    assert found.real.rank == found.dof
    assert found.redundant == found.gained == ()
    json.dumps(answer.to_dict(), allow_nan=False)


@pytest.mark.parametrize("robot", ["3rrr_m1", "rrrrr_m1", "3prr_m2"])
def test_a_planar_loop_repeats_three_constraints(robot: str) -> None:
    assert [(each.rows, each.generic) for each in at_zero(robot).redundant] == [(3, True)] * (
        len(load(robot).joints) - len(load(robot).links) + 1
    )


def test_parallel_cranks_are_type_2() -> None:
    """Both cranks of the five-bar robot are parallel: the tip moves across them, both rods keep their direction."""
    (found,) = check(load("rrrrr_m1"), at=[f"x=0,y={0.16 + sqrt(0.2**2 - 0.1**2)!r}"]).postures
    assert found.hidden.state == "type2"
    assert found.hidden.singularity_indices.to_dict() == {"RI": 0, "RO": 1, "II": 1, "IO": 0, "RPM": 0, "IIM": 0}
    assert found.real.state == "regular"
    assert found.hidden.unobserved[0].name.startswith("translation along x")
    assert found.distances.type2 == 0
    assert found.distances.condition is found.distances.millimetres is None


def test_a_stretched_leg_is_type_1() -> None:
    """Crank and rod of the second leg in line: both turn while the platform, the first rod, rests."""
    tip = np.array([0.1, 0]) + 0.36 * np.array([np.cos(np.radians(110)), np.sin(np.radians(110))])
    (found,) = check(load("rrrrr_m1"), at=[f"x={float(tip[0])!r},y={float(tip[1])!r}"]).postures
    assert found.hidden.state == found.real.state == "type1"
    for kinds in (found.hidden, found.real):
        assert kinds.singularity_indices.to_dict() == {"RI": 1, "RO": 0, "II": 0, "IO": 1, "RPM": 0, "IIM": 0}
    assert found.dof == 1
    assert found.distances.type1 == 0


def test_rods_in_line_are_type_2_of_the_real_robot() -> None:
    """Both rods in line: the motors held, the tip moves across them; the directions still see it."""
    (found,) = check(load("rrrrr_m1"), at=[f"x=0,y={sqrt(0.16**2 - 0.1**2)!r}"]).postures
    assert found.real.state == "type2"
    assert found.real.singularity_indices.to_dict() == {"RI": 0, "RO": 1, "II": 1, "IO": 0, "RPM": 0, "IIM": 0}
    assert found.hidden.state == "regular"
    np.testing.assert_allclose(found.real.unobserved[0].twist[[0, 2, 3, 4]], 0, atol=1e-9)


def parallelogram(tilt: Array) -> Mechanism:
    builder, (c, s) = Builder("parallelogram"), (np.cos(0.9), np.sin(0.9))
    builder.link("base")
    builder.link("crank_1")
    builder.link("crank_2")
    builder.link("coupler", tilt @ [0.2 * c, 0.2 * s, 0])
    for number, foot in ((1, 0.0), (2, 0.3)):
        builder.joint(
            f"foot_{number}", "R", "base", f"crank_{number}", tilt @ [foot, 0, 0], axis=tilt[:, 2], motor=number == 1
        )
        builder.joint(
            f"tip_{number}",
            "R",
            f"crank_{number}",
            "coupler",
            tilt @ [foot + 0.2 * c, 0.2 * s, 0],
            axis=tilt[:, 2],
            loop=number == 2,
        )
    return builder.build(platform="coupler")


@pytest.mark.parametrize("tilt", [np.eye(3), random_rotation(np.random.default_rng(3))], ids=["level", "tilted"])
def test_a_flat_parallelogram_is_a_constraint_singularity(tilt: Array) -> None:
    """All four bars in line: the loops lose a row, the coupler may turn about its first tip as well."""
    x, y, z = (float(value) for value in tilt @ [0.2, 0, 0])
    where = f"x={x!r},y={y!r}" + (f",z={z!r}" if z else "")
    answer = check(parallelogram(tilt), at=[where])
    (found,) = answer.postures
    check_identities(found)
    assert found.hidden.state == found.real.state == "constraint"
    assert found.constraint_singular is True
    assert found.hidden.singularity_indices.IIM == 1
    assert (found.mobility.total, found.dof, found.hidden.singularity_indices.IO) == (2, 2, -1)
    assert found.real.singularity_indices.RO == 1
    assert [(each.rows, each.generic) for each in found.redundant] == [(1, False)]
    assert [each.rows for each in answer.redundant] == [3]
    assert any(abs(tilt[:, 2] @ freedom.twist[3:]) > 0.9 for freedom in found.gained)
    assert found.distances.constraints == 0


def test_gained_freedoms_are_those_beyond_the_usual_ones() -> None:
    """A platform that translates and, at some pose, also turns about z has gained the turn alone."""

    def having(columns: list[int]) -> VelocityRelation:
        return VelocityRelation(np.eye(6)[:, columns], 6, (), len(columns), CLEAN)

    examiner = ConfigurationAnalysis(setting_of("delta"))
    gained = examiner._gained_twists(having([0, 1, 2, 5]))
    np.testing.assert_allclose(np.abs(gained[:, 0]), [0, 0, 0, 0, 0, 1], atol=1e-9)
    assert gained.shape[1] == 1
    assert examiner._gained_twists(having([0, 1, 2])).shape[1] == 0


@given(parallel_robots())
@quick
def test_random_robots_obey_the_identities(mechanism: Mechanism) -> None:
    setup = ObservedRobot.of(mechanism, samples=3)
    examiner = ConfigurationAnalysis(setup)
    for at in (setup.all_samples.start, *(m.configuration for m in setup.all_samples.members)):
        found = examiner.examine(at)
        check_identities(found)
        counts = Counts.of(compute_relation(at, setup.samples.observation_model))
        assert counts.relation == counts.dof + counts.unexplained == counts.seen + counts.unseen
        assert found.mobility.total >= found.mobility.internal >= 0


@pytest.mark.parametrize("robot", ["rrrrr_m1", "3rrr_m1"])
def test_a_grid_says_what_single_poses_say(robot: str) -> None:
    text = "x=-0.05:0.05:3,y=0.2:0.24:2" if robot == "rrrrr_m1" else "x=-0.02:0.02:3,phi=-5deg:5deg:2,y=0.01"
    answer = check(load(robot), grid=text)
    assert answer.grid is not None
    record = answer.grid.to_dict()
    poses = answer.grid.grid.poses()
    single = check(load(robot), at=poses).postures
    for index, each in zip(np.ndindex(answer.grid.grid.shape), single, strict=True):
        assert record["state"][index[0]][index[1]] == each.hidden.state
        for measure in MEASURES:
            value = record[measure][index[0]][index[1]]
            assert value == pytest.approx(each.distances.to_dict()[measure], rel=1e-6, abs=1e-9)
    assert record["axes"] == list(answer.grid.grid.names)


def test_a_grid_reaches_whatever_legs_that_stretch_without_limit_reach() -> None:
    found = check(load("gough_stewart"), grid="x=-3:3:7,y=-3:3:7,z=0.2,rpy=0/0/0").grid
    assert found is not None
    assert UNREACHABLE not in found.states


def test_a_pose_beyond_joint_limits_says_so() -> None:
    robot = load("3rpr_m1")
    made = robot.changed(
        joints=[replace(joint, limits=Limits(-1e-3, 1e-3)) for joint in robot.joints.values() if joint.is_actuated]
    )
    (at,), (home,) = (check(made, at=poses).postures for poses in (["x=0.05,y=0,phi=0"], []))
    assert set(at.to_dict()["beyond_limits"]) == {name for name, joint in robot.joints.items() if joint.is_actuated}
    assert home.beyond_limits == ()


def test_a_grid_marks_what_is_out_of_reach_and_singular() -> None:
    answer = check(load("rrrrr_m1"), grid=f"y=0.25:{2 * (0.16 + sqrt(0.03)) - 0.25!r}:3,x=0")
    assert answer.grid.states == ("regular", "type2", "unreachable")
    assert answer.grid.values("type2")[1:] == (0.0, None)


def test_fewer_legs_and_a_camera() -> None:
    one = check(load("gough_stewart"), ["1", "2"]).postures[0]
    assert (one.hidden.rank, len(one.hidden.unobserved), one.hidden.state) == (4, 2, "regular")
    assert one.distances.condition is not None
    assert one.real.rank == 6
    carried = check(load("gough_stewart"), camera="platform")
    assert carried.to_dict()["camera"] == "platform"
    assert carried.postures[0].hidden.rank == 6


def test_without_motors_nothing_is_said_of_the_real_robot() -> None:
    mechanism = parallelogram(np.eye(3))
    passive = mechanism.changed(
        joints=[
            type(j)(j.name, j.type, j.predecessor, j.successor, j.point, j.axes, in_tree=j.in_tree)
            for j in mechanism.joints.values()
        ]
    )
    (found,) = check(passive).postures
    assert found.real is None
    assert found.to_dict()["real"] is None


def test_a_rank_that_is_not_clear_is_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posture_module, "RANK_GAP_MIN", 1e30)
    (found,) = check(load("3rrr_m1")).postures
    record = found.to_dict()
    assert not found.has_decided_ranks
    assert record["type1"] is record["type2"] is record["type3"] is record["singularity_indices"] is None
    assert record["constraint"]["singular"] is None
    assert found.hidden.state == "undecided"


def test_the_singular_pose_really_moves() -> None:
    """At the Type 2 pose the lost twist is a finite-difference fact: the platform moves, the directions do not."""
    pose = f"x=0,y={0.16 + sqrt(0.03)!r}"
    answer = check(load("rrrrr_m1"), at=[pose])
    at: ClosedConfiguration = answer.postures[0].configuration
    kernel, _ = at.kernel()
    rows = answer.setup.samples.observation_model.rows(at) @ kernel
    lost = kernel @ np.linalg.svd(rows[6:])[2][-1]
    h = 1e-5
    ahead, behind = (ClosedConfiguration(at.model, at.model.integrate(at.q, s * h * lost), 0.0) for s in (1, -1))
    moved = invert_pose(behind.pose("dist_1")) @ ahead.pose("dist_1")
    assert np.linalg.norm(moved[:3, 3]) > 1e-6
    target = answer.setup.samples.observation_model.target
    for (_, a), (_, b) in zip(target(ahead).measured, target(behind).measured, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-8)


def test_a_set_that_never_shows_all_is_not_called_regular_alone():
    found = hrsynth.check("delta", ["1"])
    assert repr(found).endswith("regular, observes 2 of 3 dof>")
    assert "the directions show 2 of 3: as many as at generic poses, not singular" in hrsynth.text(found)
    assert repr(hrsynth.check("delta")).endswith("regular>")
