"""Whether a robot can be assembled at a pose: each word held against legs that are placed by brute force."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.modes.assembly_mode import AssemblyMode
from hrsynth.geometry.vectors import inverse, rotation_about, unit
from hrsynth.kinematics.assembly import ASSEMBLED, BEYOND, IMPOSSIBLE, NOT_FOUND, Assembler, Assembly
from hrsynth.kinematics.leg_paths import MotionFactor
from hrsynth.kinematics.leg_solutions import LegEnd, closures
from hrsynth.mechanism import Joint, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.model import JointType, Limits
from hrsynth.mechanism.pose import Pose
from hrsynth.present.text.poses import assembly
from kinematics.placing import miss
from strategies import deltas, planar, pods, random_direction, random_normal, random_rotation

PLANAR = ("RRR", "RPR", "PRR", "RRP", "PRP")
PODS = ("UPS", "SPS", "RPS")
DELTAS = ("R2-SS", "P2-SS", "RUS", "PSS")
KINDS = (*PLANAR, "five-bar", *PODS, *DELTAS)


def robot(kind: str, rng: np.random.Generator) -> Mechanism:
    if kind in PLANAR:
        return planar([kind] * 3, rng, [{0}] * 3)
    if kind == "five-bar":
        return planar([str(rng.choice(["RRR", "RPR", "PRR"]))] * 2, rng, [{0}] * 2, point=True)
    if kind in PODS:
        return pods([kind] * (3 if kind == "RPS" else 6), rng, bool(rng.integers(2)))
    return deltas([kind[0]] * 3, [kind[1:]] * 3, rng, bool(rng.integers(2)))


def displaced(mechanism: Mechanism, rng: np.random.Generator) -> np.ndarray:
    """A random displacement (4, 4) of the platform, small to twice the robot's size; in the plane of a planar one."""
    turning = [joint.axis for joint in mechanism.joints.values() if joint.type is JointType.REVOLUTE]
    flat = mechanism.name.startswith("planar")
    axis = turning[0] if flat else random_direction(rng)
    size = rng.choice([0.05, 0.3, 0.8, 2.0])
    shift = size * mechanism.length * rng.normal(size=3)
    D = np.eye(4)
    if flat or rng.random() < 0.3:
        D[:3, :3] = rotation_about(axis, min(np.pi, 1.5 * size) * rng.uniform(-1, 1))
    at = mechanism.links[mechanism.platform].pose[:3, 3]
    D[:3, 3] = at - D[:3, :3] @ at + (shift - axis * (axis @ shift) if flat else shift)
    return D


def assembled(mechanism: Mechanism, D: np.ndarray) -> Assembly:
    decomposition = decompose(mechanism)
    bodies = {leg.platform_link: D @ mechanism.links[leg.platform_link].pose for leg in decomposition.legs}
    return Assembler(decomposition, mechanism.length, mechanism.reference).at(bodies, ())


@pytest.mark.some(2, 6)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("first", "count"), [(0, 2), pytest.param(100, 12, marks=pytest.mark.slow)])
def test_what_is_said_of_assembly_holds_by_brute_force(kind: str, first: int, count: int):
    """A leg that is said not to close is closed from no start; what is said to close does. All robots of these kinds
    get one of the two words, and both are met."""
    words: Counter[str] = Counter()
    for seed in range(first, first + count):
        rng = np.random.default_rng([KINDS.index(kind), seed])
        mechanism = robot(kind, rng)
        decomposition, D = decompose(mechanism), displaced(mechanism, rng)
        found = assembled(mechanism, D)
        words[found.verdict] += 1
        assert found.reachable is {ASSEMBLED: True, IMPOSSIBLE: False}[found.verdict]
        if found.configuration is not None:
            attach = decomposition.legs[0].platform_link
            assert closes(mechanism, found, D, attach, decomposition.point)
        point = decomposition.point
        if point is not None:
            point = (mechanism.links[mechanism.platform].pose @ np.append(point, 1.0))[:3]
        for label, why in found.misses[:1]:
            left = miss(mechanism, decomposition.leg(label), D, point, rng, starts=4 if count < 3 else 12)
            assert left > 1e-8, why
            assert why.by > 0
    assert words[ASSEMBLED] or kind == "RPS" or count < 3
    assert words[IMPOSSIBLE] or kind in ("SPS", "PRP") or count < 3


def closes(mechanism: Mechanism, found: Assembly, D: np.ndarray, attach: str, point: np.ndarray | None) -> bool:
    """Whether all joints hold in the configuration, by their definition, and the platform is where it was asked for."""
    assert found.configuration is not None
    moved = {link: found.configuration.pose(link) @ inverse(mechanism.links[link].pose) for link in mechanism.links}
    centre = (
        mechanism.links[attach].pose[:3, 3]
        if point is None
        else (mechanism.links[mechanism.platform].pose @ np.append(point, 1.0))[:3]
    )
    errors = [np.abs(_at(moved[attach], centre) - _at(D, centre)).max()]
    errors += [np.abs(moved[attach][:3, :3] - D[:3, :3]).max()] if point is None else []
    return max(*errors, *(violation(joint, moved) for joint in mechanism.joints.values())) < 1e-8


def violation(joint: Joint, moved: dict[str, np.ndarray]) -> float:
    one, two = (moved[link] for link in joint.links)
    gap, axes = _at(two, joint.point) - _at(one, joint.point), [np.array(axis) for axis in joint.axes]
    if joint.type is JointType.PRISMATIC:
        along = one[:3, :3] @ axes[0]
        return float(max(np.abs(gap - along * (along @ gap)).max(), np.abs(one[:3, :3] - two[:3, :3]).max()))
    turned = {
        JointType.REVOLUTE: lambda: one[:3, :3] @ axes[0] - two[:3, :3] @ axes[0],
        JointType.UNIVERSAL: lambda: (one[:3, :3] @ axes[0]) @ (two[:3, :3] @ axes[1]) - axes[0] @ axes[1],
        JointType.SPHERICAL: lambda: 0.0,
    }[joint.type]()
    return float(max(np.abs(gap).max(), np.max(np.abs(turned))))


def _at(D: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.asarray(D[:3, :3] @ x + D[:3, 3])


def shifted(part: MotionFactor, q: float) -> np.ndarray:
    """The displacement (4, 4) by a part with the value q."""
    D = np.eye(4)
    if part.slides:
        D[:3, 3] = q * part.axis
    else:
        D[:3, :3] = rotation_about(part.axis, q)
        D[:3, 3] = part.point - D[:3, :3] @ part.point
    return D


@pytest.mark.parametrize("last", ["S", "R"])
@pytest.mark.parametrize("second", ["R", "P"])
@pytest.mark.parametrize("first", ["R", "P", "S"])
def test_values_that_close_a_skew_leg_are_among_those_told(first: str, second: str, last: str):
    """Of a leg with axes of any direction, led to where random values of its joints bring it."""
    told = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)

        def part(kind: str, rng: np.random.Generator = rng) -> MotionFactor:
            axis = None if kind == "S" else random_direction(rng)
            return MotionFactor(kind == "P", rng.normal(size=3), axis, (f"joint_{rng.integers(1 << 30)}",))

        way = [part(first), part(second), part(last)]
        q = [rng.uniform(-0.5, 0.5) if each.slides else rng.uniform(-np.pi, np.pi) for each in way]
        values = {each.joint: value for each, value in zip(way, q, strict=True)}
        free = replace(way[0], axis=random_direction(rng)) if first == "S" else way[0]
        D = shifted(free, q[0]) @ shifted(way[1], q[1]) @ (np.eye(4) if last == "S" else shifted(way[2], q[2]))
        found = closures(way, LegEnd(D, 1.0, 1e-12, last != "S"))
        assert found.miss is None, found.miss
        told += bool(found.values)
        for joint, several in found.values:
            gaps = [abs(float(each.mid()) - values[joint]) for each in several]
            turning = not next(each for each in way if each.joint == joint).slides
            assert min(min(gap % (2 * np.pi), -gap % (2 * np.pi)) if turning else gap for gap in gaps) < 1e-3
    assert told or (second, last) == ("P", "R")


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("kind", ["R2-SS", "RRR", "PRR"])
def test_the_reach_told_is_the_boundary(kind: str):
    """A platform led straight away closes until the miss that is told begins: it
    goes to zero where the closures end."""
    rng = np.random.default_rng(5)
    mechanism = robot(kind, rng)
    limits = []
    for _ in range(3):
        shift = unit(displaced(mechanism, rng)[:3, 3])
        if kind in PLANAR:
            axis = next(joint.axis for joint in mechanism.joints.values() if joint.type is JointType.REVOLUTE)
            shift = unit(np.cross(axis, shift))
        low, high = 0.0, 10 * mechanism.length
        while high - low > 1e-6 * mechanism.length:
            D = np.eye(4)
            D[:3, 3] = 0.5 * (low + high) * shift
            found = assembled(mechanism, D)
            if found.verdict == IMPOSSIBLE:
                high = 0.5 * (low + high)
                limits.append(max(why.by for _, why in found.misses))
            else:
                low = 0.5 * (low + high)
        assert limits[-1] < 1e-3 * mechanism.length


def parallel_pod(rng: np.random.Generator, apart: float) -> Mechanism:
    """A hexapod whose rods are parallel but for ``apart``, so that its modes lie far away."""
    tilt, b = random_rotation(rng), Builder("pod")
    b.link("base")
    b.link("platform", at=tilt[:, 2])
    for k in range(1, 7):
        foot = np.array([*rng.uniform(-1, 1, 2), 0.1 * rng.normal()])
        A, B = tilt @ foot, tilt @ (foot + [0, 0, 1] + apart * rng.normal(size=3))
        rod = unit(B - A)
        first = random_normal(rng, rod)
        b.link(f"lower_{k}", at=A)
        b.link(f"upper_{k}", at=B)
        b.joint(f"foot_{k}", "U", "base", f"lower_{k}", at=A, axis=first, axis2=np.cross(rod, first))
        b.joint(f"slide_{k}", "P", f"lower_{k}", f"upper_{k}", at=(A + B) / 2, axis=rod, motor=f"motor_{k}")
        b.joint(f"tip_{k}", "S", f"upper_{k}", "platform", at=B, loop=k > 1)
    return b.build(platform="platform")


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_far_modes_of_nearly_parallel_pods_are_assembled(seed: int):
    """No start from near by reaches them: that once was told as *cannot be assembled*."""
    mechanism = parallel_pod(np.random.default_rng(seed), 3e-4)
    found = hrsynth.modes(mechanism, ["1", "2", "3"])
    assert max(abs(value) for mode in found.modes for value in (mode.pose.x, mode.pose.y, mode.pose.z)) > 8
    assert [mode.assembly for mode in found.modes] == [ASSEMBLED] * len(found.modes)


def with_limits(mechanism: Mechanism, name: str, lower: float | None, upper: float | None) -> Mechanism:
    return mechanism.changed(joints=[replace(mechanism.joints[name], limits=Limits(lower, upper))])


def test_limits_of_turns_count_modulo_whole_turns():
    """A joint's angle at zero is 0, which is 4π too; a range without any of these is refused with proof."""
    mechanism = planar(["RRR"] * 3, np.random.default_rng(2), [{0}] * 3)
    for name in ("joint_1_1", "joint_1_2"):
        for lower, upper, verdict in (
            (4 * np.pi - 0.1, 4 * np.pi + 0.1, ASSEMBLED),
            (-8 * np.pi - 0.1, -8 * np.pi + 0.1, ASSEMBLED),
            (12.0, None, ASSEMBLED),
            (-30.0, 30.0, ASSEMBLED),
            (6.2, 6.27, BEYOND),
            (0.001, 0.01, BEYOND),
        ):
            found = assembled(with_limits(mechanism, name, lower, upper), np.eye(4))
            assert (found.verdict, found.reachable) == (verdict, verdict == ASSEMBLED), (lower, upper)
            assert found.beyond == (() if verdict == ASSEMBLED else (name,))


def test_beyond_limits_is_said_only_where_all_closures_are():
    """The elbow's other side is taken where it alone is within limits; where the joint's values are not listed, nothing
    is claimed."""
    mechanism = planar(["RRR"] * 3, np.random.default_rng(2), [{0}] * 3)
    elbow = mechanism.joints["joint_1_2"]
    other = assembled(with_limits(mechanism, elbow.name, 0.05, 6.2), np.eye(4))
    assert other.verdict == ASSEMBLED
    last = assembled(with_limits(mechanism, "joint_1_3", 0.001, 0.002), np.eye(4))
    assert (last.verdict, last.reachable, last.beyond) == (NOT_FOUND, None, ("joint_1_3",))


def test_beyond_limits_names_the_joints_of_the_closure_that_was_found() -> None:
    """Of both closures of a leg no elbow is within its limits, and of one no shoulder: that one is named with both
    joints, and the words do not say that the robot is beyond the shoulder's in the other."""
    mechanism = planar(["RRR"] * 3, np.random.default_rng(2), [{0}] * 3)
    shoulder, elbow = (mechanism.joints[name] for name in ("joint_1_1", "joint_1_2"))
    arm, rod = elbow.point - shoulder.point, mechanism.joints["joint_1_3"].point - shoulder.point
    turn = 2 * np.arctan2(shoulder.axis @ np.cross(arm, rod), arm @ rod)  # mirrors the elbow at the rod
    tight = with_limits(mechanism, elbow.name, 0.001, 0.01)
    low, high = sorted((turn - 0.1, turn + 0.1))
    found = assembled(with_limits(tight, shoulder.name, low, high), np.eye(4))
    assert (found.verdict, found.beyond) == (BEYOND, (shoulder.name, elbow.name))
    free = with_limits(with_limits(mechanism, elbow.name, 0.05, 6.2), shoulder.name, low, high)
    assert assembled(free, np.eye(4)).verdict == ASSEMBLED
    assert "only beyond joint limits: as found, of joint_1_1, joint_1_2" in words_of(found)


def words_of(found: Assembly) -> str:
    mode = AssemblyMode(Pose(), 0.0, 0.0, 0.0, False, found.reachable, None, found.verdict, beyond_limits=found.beyond)
    return " ".join(assembly(mode))
