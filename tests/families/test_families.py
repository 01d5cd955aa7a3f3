"""The shipped robots: dimensions of the papers, freedoms (by the oracle, not by the engine), files up to date."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from hrsynth import description
from hrsynth.errors import BadRequest
from hrsynth.families import ROBOTS, ShippedRobot, delta, npod, planar
from hrsynth.families.__main__ import main
from hrsynth.families.geometry import (
    Z,
    compute_polar_point,
    compute_radial,
    compute_tangent,
    locate_on_circle,
    locate_on_line,
)
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.model import JointType, Mechanism
from oracle import Oracle, split_rank

FOLDER = Path(__file__).parents[2] / "robots"


class Freedoms(NamedTuple):
    mobility: int
    """With idle motions."""
    idle: int
    dof: int
    seen: int
    """Dimension of the platform twists that all legs' default segments show: dof less those that they cannot show."""


EXPECTED = {
    **dict.fromkeys(["rrrrr_m1", "rrrrr_m2", "rprpr_m1", "rprpr_m2", "prrrp_m1", "prrrp_m2"], Freedoms(2, 0, 2, 2)),
    "prrrp_parallel": Freedoms(2, 0, 2, 1),
    "prrrp_parallel_point": Freedoms(3, 1, 2, 1),
    **dict.fromkeys(["3rrr_m1", "3rrr_m2", "3rpr_m1", "3rpr_m2", "3prr_m1", "3prr_m2"], Freedoms(3, 0, 3, 3)),
    "3prp": Freedoms(3, 0, 3, 1),
    "3rrp": Freedoms(3, 0, 3, 1),
    "3ppr_m1": Freedoms(3, 0, 3, 0),
    "3ppr_m2": Freedoms(3, 0, 3, 0),
    "gough_stewart": Freedoms(6, 0, 6, 6),
    "3upu": Freedoms(3, 0, 3, 3),
    "3rps": Freedoms(3, 0, 3, 3),
    "delta": Freedoms(9, 6, 3, 3),
    "quattro_rigid": Freedoms(11, 8, 3, 3),
    "quattro": Freedoms(12, 8, 4, 4),
    "orthoglide": Freedoms(9, 6, 3, 3),
    "linear_delta": Freedoms(9, 6, 3, 3),
    "uranesx": Freedoms(9, 6, 3, 2),
    "i4l": Freedoms(12, 8, 3, 2),
    "3ruu": Freedoms(3, 0, 3, 3),
    "3puu": Freedoms(3, 0, 3, 3),
    "hexa": Freedoms(6, 0, 6, 6),
    "hexaglide": Freedoms(6, 0, 6, 5),
    "6pus": Freedoms(6, 0, 6, 6),
}
FAR = 0.1
"""Smallest response to a unit platform twist (lengths in characteristic lengths) at the zero configuration."""
NOT_IN_LEGS = {"quattro": "RRRR", "i4l": "P", "prrrp_parallel_point": "R"}
"""Joints that no architecture prints: those of articulated platforms, the end joint doubled by a point body."""

robots = pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)


# --- an instant, seen by the oracle ------------------------------------------------------------------------------


def platform_rates(oracle: Oracle, state: Array, velocities: Array) -> Array:
    """t without dimensions; of a point body its velocity alone."""
    t = oracle.twist(velocities, oracle.mechanism.platform)
    t = np.vstack((t[:3] / oracle.length, t[3:]))
    return t[:3] if oracle.mechanism.name.endswith("_point") else t


def segments(mechanism: Mechanism) -> list[tuple[str, Array]]:
    """Each leg's default segment: its link and its direction at zero, found by the names of the shipped robots."""
    found = []
    for leg in "123456":
        name = next((name for name in (f"dist_{leg}", f"rod_{leg}a", f"rod_{leg}") if name in mechanism.links), None)
        if name is not None:
            joints = mechanism.joints_of(name)
            slides = [joint.axis for joint in joints if joint.type is JointType.PRISMATIC]
            found.append((name, slides[0] if slides else joints[1].point - joints[0].point))
    return [(name, d / np.linalg.norm(d)) for name, d in found]


def leg_rates(oracle: Oracle, state: Array, velocities: Array) -> Array:
    """The rates of all default segments' directions."""
    return np.vstack(
        [
            np.cross(oracle.twist(velocities, link)[3:], oracle.pose(state, link)[:3, :3] @ d, axisa=0, axisc=0)
            for link, d in segments(oracle.mechanism)
        ]
    )


def motor_rates(oracle: Oracle, state: Array, velocities: Array) -> Array:
    """The rates of the actuated R and P, without dimensions."""
    rates = []
    for joint in oracle.mechanism.joints.values():
        if joint.is_actuated:
            assert joint.type in (JointType.REVOLUTE, JointType.PRISMATIC)
            (X_a, V_a), (X_b, V_b) = (
                (oracle.pose(state, link), oracle.twist(velocities, link)) for link in joint.links
            )
            axis = X_a[:3, :3] @ joint.axis
            at_zero = oracle.pose(oracle.zero(), joint.predecessor)
            point = X_a[:3, 3] + X_a[:3, :3] @ at_zero[:3, :3].T @ (joint.point - at_zero[:3, 3])
            if joint.type is JointType.PRISMATIC:
                of = [V[:3] + np.cross(V[3:], point - X[:3, 3], axisa=0, axisc=0) for X, V in ((X_a, V_a), (X_b, V_b))]
                rates.append(axis @ (of[1] - of[0]) / oracle.length)
            else:
                rates.append(axis @ (V_b[3:] - V_a[3:]))
    return np.array(rates)


def rank(matrix: Array) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    count, gap = split_rank(values, len(values))
    assert gap > 1e3, values
    return count


def weakest(T: Array, Y: Array) -> float:
    """min ‖Y x‖ over ‖T x‖ = 1: how well a platform twist shows in Y, whatever moves beside it."""
    _, values, right = np.linalg.svd(T)
    count = rank(T)
    move, rest = right[:count].T / values[:count], right[count:].T
    if rest.shape[1]:
        left, beside, _ = np.linalg.svd(Y @ rest, full_matrices=False)
        blind = left[:, beside > 1e-9]
        Y = Y - blind @ (blind.T @ Y)
    return float(np.linalg.svd(Y @ move, compute_uv=False)[-1]) if len(Y) >= count else 0.0


def freedoms(oracle: Oracle, state: Array) -> Freedoms:
    velocities, gap = oracle.kernel(state)
    assert gap > 1e3
    scaled = velocities / np.tile([oracle.length] * 3 + [1.0] * 3, len(oracle.moving))[:, None]
    assert np.allclose(scaled.T @ scaled, np.eye(scaled.shape[1]))
    T, Y = platform_rates(oracle, state, velocities), leg_rates(oracle, state, velocities)
    together = rank(np.vstack((T, Y)))
    lost = together - rank(Y)
    return Freedoms(velocities.shape[1], velocities.shape[1] - together, rank(T), rank(T) - lost)


# --- the table ---------------------------------------------------------------------------------------------------


def test_the_table_is_sorted_and_complete():
    names = [robot.name for robot in ROBOTS]
    assert names == sorted(set(names))
    assert set(names) == EXPECTED.keys()


@robots
def test_a_robot_is_what_the_table_says(robot: ShippedRobot):
    mechanism = robot.make()
    assert mechanism.name == robot.name
    assert robot.dof == EXPECTED[robot.name].dof
    assert robot.architecture.isascii()
    assert re.match(r"(MMT|IROS) ", robot.section)
    assert robot.provenance
    assert np.array_equal(mechanism.links[mechanism.base].pose, np.eye(4))
    assert not mechanism.observations, "the default segments are not ambiguous"


@robots
def test_the_architecture_counts_joints_and_motors(robot: ShippedRobot):
    count, legs = re.fullmatch(r"(?:(\d)-)?(.*)", robot.architecture).groups()
    legs = re.sub(r"-\{2-(\w+)\}", r"\1\1", legs) * int(count or 1)
    mechanism = robot.make()
    found = "".join(joint.type.value for joint in mechanism.joints.values())
    expected = legs.replace("*", "") + NOT_IN_LEGS.get(robot.name, "")
    assert sorted(found) == sorted(expected)
    driven = sorted(joint.type.value for joint in mechanism.joints.values() if joint.is_actuated)
    assert driven == sorted(re.findall(r"(\w)\*", legs))


# --- freedoms ----------------------------------------------------------------------------------------------------


@robots
def test_zero_is_assembled_and_far_from_singularities(robot: ShippedRobot):
    oracle = Oracle(robot.make())
    zero, expected = oracle.zero(), EXPECTED[robot.name]
    assert oracle.error(zero) < 1e-12
    assert freedoms(oracle, zero) == expected
    velocities, _ = oracle.kernel(zero)
    T = platform_rates(oracle, zero, velocities)
    motors = motor_rates(oracle, zero, velocities)
    assert rank(motors) == expected.mobility - expected.idle, "the motors determine all that is not idle"
    assert weakest(T, motors) > FAR
    sight = weakest(T, leg_rates(oracle, zero, velocities))
    assert sight > FAR if expected.seen == expected.dof else sight < 1e-9


@pytest.mark.some(8)
@robots
def test_freedoms_are_finite_motions(robot: ShippedRobot):
    oracle = Oracle(robot.make())
    for state in oracle.random_walk(np.random.default_rng(7), 3, 0.2):
        assert oracle.error(state) < 1e-10
        assert freedoms(oracle, state) == EXPECTED[robot.name]


@pytest.mark.parametrize("name", ["uranesx", "i4l", "hexaglide", "prrrp_parallel", "prrrp_parallel_point"])
def test_parallel_rails_hide_the_translation_along_them(name: str):
    mechanism = next(robot.make() for robot in ROBOTS if robot.name == name)
    oracle = Oracle(mechanism)
    rail = mechanism.joints["guide_1"].axis
    for state in oracle.random_walk(np.random.default_rng(3), 2, 0.2):
        velocities, _ = oracle.kernel(state)
        T, Y = platform_rates(oracle, state, velocities), leg_rates(oracle, state, velocities)
        _, values, right = np.linalg.svd(Y)
        lost = T @ right[int(np.sum(values > 1e-9)) :].T
        left, sizes, _ = np.linalg.svd(lost)
        assert np.sum(sizes > 1e-9) == 1
        assert abs(left[:3, 0] @ rail) == pytest.approx(1)


def test_the_plates_slide_without_the_platform():
    oracle = Oracle(delta.i4l())
    zero = oracle.zero()
    velocities, _ = oracle.kernel(zero)
    slide = oracle.twist(velocities, "plate_12") - oracle.twist(velocities, "platform")
    assert rank(np.vstack((platform_rates(oracle, zero, velocities), slide))) == 4


# --- dimensions of the papers ------------------------------------------------------------------------------------


def centre(mechanism: Mechanism, *joints: str) -> Array:
    return np.mean([mechanism.joints[joint].point for joint in joints], axis=0)


@pytest.mark.parametrize(("make", "radius"), [(delta.quattro_rigid, 0.296), (delta.quattro, 0.275)])
def test_both_quattros_have_the_legs_of_the_papers(make, radius: float):
    mechanism = make()
    for leg, angle in enumerate((-3 * math.pi / 4, -math.pi / 4, math.pi / 4, 3 * math.pi / 4), start=1):
        A = mechanism.joints[f"shoulder_{leg}"].point
        B = centre(mechanism, f"elbow_{leg}a", f"elbow_{leg}b")
        C = centre(mechanism, f"wrist_{leg}a", f"wrist_{leg}b")
        assert pytest.approx(radius * np.array([math.cos(angle), math.sin(angle), 0]), abs=1e-15) == A
        assert np.linalg.norm(B - A) == pytest.approx(0.380, abs=1e-14)
        assert np.linalg.norm(C - B) == pytest.approx(0.825, abs=1e-14)
        assert abs(mechanism.joints[f"shoulder_{leg}"].axis @ compute_radial(angle)) < 1e-15
        assert (B - A) @ compute_radial(angle) > 0, "knees outwards"
    assert mechanism.links["platform"].pose[:3, 3] == pytest.approx([0, 0, -0.7])


def test_the_rigid_quattro_has_the_platform_of_iros():
    mechanism = delta.quattro_rigid()
    for leg, angle in enumerate((-3 * math.pi / 4, -math.pi / 4, math.pi / 4, 3 * math.pi / 4), start=1):
        PC = centre(mechanism, f"wrist_{leg}a", f"wrist_{leg}b") - mechanism.links["platform"].pose[:3, 3]
        assert pytest.approx(0.102 * np.array([math.cos(angle), math.sin(angle), 0]), abs=1e-14) == PC


def test_the_quattro_has_the_platform_of_mmt():
    mechanism = delta.quattro()
    P = mechanism.links["platform"].pose[:3, 3]
    C = [centre(mechanism, f"wrist_{leg}a", f"wrist_{leg}b") for leg in (1, 2, 3, 4)]
    D1, D2, E1, E4 = (mechanism.joints[name].point for name in ("hinge_1", "hinge_2", "side_hinge_1", "side_hinge_4"))
    assert C[0] - D1 == pytest.approx([-0.066, -0.048, 0], abs=1e-14)
    assert C[1] - D1 == pytest.approx([0.066, -0.048, 0], abs=1e-14)
    assert C[2] - D2 == pytest.approx([0.066, 0.048, 0], abs=1e-14)
    assert C[3] - D2 == pytest.approx([-0.066, 0.048, 0], abs=1e-14)
    assert pytest.approx([0.057, 0, 0], abs=1e-14) == D1 - E1
    assert pytest.approx([0.057, 0, 0], abs=1e-14) == D2 - E4
    assert pytest.approx([0, -0.043, 0], abs=1e-14) == D1 - P
    assert pytest.approx([0, 0.043, 0], abs=1e-14) == D2 - P
    assert np.mean(C, axis=0) == pytest.approx(P, abs=1e-14)
    bodies = [joint.links for joint in mechanism.joints.values() if joint.name.startswith("hinge")]
    assert bodies == [("plate_12", "platform"), ("platform", "plate_34")]


@robots
def test_pairs_of_rods_are_equal_and_parallel(robot: ShippedRobot):
    mechanism = robot.make()
    pairs = [name[:-1] for name in mechanism.links if re.fullmatch(r"rod_\da", name)]
    assert bool(pairs) == ("{2-SS}" in robot.architecture)
    for leg in (name[4:] for name in pairs):
        elbow, wrist = (
            [mechanism.joints[f"{kind}_{leg}{letter}"].point for letter in "ab"] for kind in ("elbow", "wrist")
        )
        assert wrist[0] - elbow[0] == pytest.approx(wrist[1] - elbow[1], abs=1e-14)
        first = mechanism.joints.get(f"shoulder_{leg}")
        if first is not None:
            assert np.linalg.norm(np.cross(first.axis, elbow[0] - elbow[1])) < 1e-14, "the side is along the base R"


@pytest.mark.parametrize("make", [npod.three_upu, delta.three_ruu, delta.three_puu], ids=lambda make: make.__name__)
def test_inner_and_outer_axes_of_translational_legs_are_parallel(make):
    mechanism = make()
    for leg in "123":
        names = ("shoulder", "wrist") if make is npod.three_upu else ("elbow", "wrist")
        first, last = (mechanism.joints[f"{name}_{leg}"] for name in names)
        assert first.axes[0] == pytest.approx(last.axes[1])
        assert first.axes[1] == pytest.approx(last.axes[0])
        assert abs(first.axes[0] @ first.axes[1]) < 1e-15
        if make is delta.three_ruu:
            assert abs(first.axes[0] @ mechanism.joints[f"shoulder_{leg}"].axis) == pytest.approx(1)


# --- constructors ------------------------------------------------------------------------------------------------


def test_dimensions_are_parameters():
    small = delta.delta(distal=0.5, home=(0.01, 0.02, -0.45))
    B, C = centre(small, "elbow_2a", "elbow_2b"), centre(small, "wrist_2a", "wrist_2b")
    assert np.linalg.norm(C - B) == pytest.approx(0.5)
    assert small.links["platform"].pose[:3, 3] == pytest.approx([0.01, 0.02, -0.45])
    turned = Oracle(planar.three_rrr(home=(0.0, 0.01, 0.3)))
    assert turned.mobility(turned.zero()) == 3


def test_a_home_out_of_reach_is_refused():
    with pytest.raises(BadRequest, match="out of the leg's reach"):
        delta.delta(home=(0, 0, -2))
    with pytest.raises(BadRequest, match="does not come near enough"):
        delta.uranesx(distal=0.1)


def test_a_third_motor_is_refused():
    with pytest.raises(BadRequest, match="1 or 2"):
        planar.three_rrr(motor=3)


def test_circles_and_lines_meet_spheres():
    target = np.array([0.1, 0.05, -0.6])
    for outward in (True, False):
        B = locate_on_circle(compute_polar_point(0.2, 0.0), compute_radial(0.0), Z, 0.25, target, 0.6, outward)
        assert np.linalg.norm(B - compute_polar_point(0.2, 0.0)) == pytest.approx(0.25)
        assert np.linalg.norm(B - target) == pytest.approx(0.6)
        assert abs(B @ compute_tangent(0.0)) < 1e-15
    near, far = (locate_on_line(compute_polar_point(0.2, 0.0), Z, target, 0.6, forward) for forward in (False, True))
    assert np.linalg.norm(near - target) == pytest.approx(0.6)
    assert np.linalg.norm(far - target) == pytest.approx(0.6)
    assert far[2] > near[2]


# --- files -------------------------------------------------------------------------------------------------------


def test_the_folder_holds_the_table():
    assert sorted(path.stem for path in FOLDER.glob("*.urdf")) == [robot.name for robot in ROBOTS]


@robots
def test_the_file_is_not_stale(robot: ShippedRobot):
    text = (FOLDER / f"{robot.name}.urdf").read_text(encoding="utf-8")
    assert text == description.native.write(robot.make()), "run: python -m hrsynth.families"


@robots
def test_the_file_reads_back(robot: ShippedRobot):
    assert description.load(FOLDER / f"{robot.name}.urdf").differences(robot.make()) == []


def test_the_command_writes_all_files(tmp_path: Path):
    main(str(tmp_path / "robots"))
    assert sorted(path.stem for path in (tmp_path / "robots").iterdir()) == [robot.name for robot in ROBOTS]
