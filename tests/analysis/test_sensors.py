"""Observations of every kind, of every robot: the lift is certified, leg removal keeps what it must, verdicts agree
with an independent computation."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import Derivation, derive
from hrsynth.analysis.exact import get_architecture
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import compute_verdict
from hrsynth.description import list_robots, load, native
from hrsynth.errors import BadRequest, UndecidedRank, UndefinedValue
from hrsynth.geometry.vectors import Array, build_pose, transform
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observations import list_kinds
from hrsynth.tolerances import RELATION_ANGLE_TOL
from kinematics.robots import ROBOTS
from oracle import exponential
from strategies import pods, random_direction, random_rotation, transformed

KINDS = sorted(list_kinds())
POINTS = [f"point:platform@{at}" for at in ("0.1,0,0", "-0.1,0.1,0", "0,0.1,0.1", "0.05,-0.1,0")]


@cache
def free_body() -> Mechanism:
    """A body that nothing holds, one metre before a camera."""
    builder = Builder("body")
    builder.link("base")
    builder.link("platform", (0.1, 0.05, 1.2), random_rotation(np.random.default_rng(1)))
    builder.joint("free", "6", "base", "platform", (0.1, 0.05, 1.2))
    return builder.build(platform="platform")


@cache
def arm() -> Mechanism:
    """A serial arm of six R with random axes."""
    rng = np.random.default_rng(3)
    builder, before, here = Builder("arm"), "base", np.zeros(3)
    builder.link("base")
    for number in range(1, 7):
        name = "platform" if number == 6 else f"link_{number}"
        builder.link(name, here, random_rotation(rng))
        builder.joint(f"joint_{number}", "R", before, name, here, axis=random_direction(rng), motor=True)
        before, here = name, here + rng.uniform(0.2, 0.5) * random_direction(rng)
    return builder.build(platform="platform")


@cache
def spatial() -> Mechanism:
    """A random robot with six legs in a tilted base."""
    return pods(("UPS",) * 6, np.random.default_rng(5))


def asked(mechanism: Mechanism, kind: str, rng: np.random.Generator) -> list[str]:
    """Observations of a kind: of the platform from the base, and (all but encoders) of the base from the platform."""
    needs = list_kinds()[kind].needs
    if "joint" in needs:
        joint = next(j for j in mechanism.joints.values() if j.type in ("R", "P", "U", "C"))
        return [f"encoder:{joint.name}"]
    if kind == "inclination":
        return [f"{kind}:{mechanism.platform}"]
    far = 4 * mechanism.length
    words = []
    for camera, link in (("eye", mechanism.platform), ("hand", mechanism.base)):
        at, axis = far / 20 * rng.normal(size=3), random_direction(rng)
        text = f"{camera}={kind}:{link}"
        text += "@" + ",".join(map(str, at)) if "at" in needs else ""
        text += "/" + ",".join(map(str, axis)) if "axis" in needs else ""
        words.append(text + (f"/{far / 6}" if "radius" in needs else ""))
    return words


def watched(mechanism: Mechanism, kind: str) -> ObservedRobot:
    rng, far = np.random.default_rng(KINDS.index(kind)), 4 * mechanism.length
    cameras = []
    for name, link in (("eye", mechanism.base), ("hand", mechanism.platform)):
        centre = mechanism.links[mechanism.platform].pose[:3, 3] + far * random_direction(rng)
        local = np.linalg.inv(mechanism.links[link].pose) @ build_pose(centre)
        cameras.append(f"{name}={link}@" + ",".join(map(str, local[:3, 3])) + "/0.3,-0.2,0.1")
    return ObservedRobot.of(mechanism, camera=cameras, sensor=asked(mechanism, kind, rng), samples=5)


def certified(mechanism: Mechanism, kind: str, form: str = "simplified") -> Derivation:
    """The law: the lift, and what is left of it, have the relation of the robot; so does what is written of it."""
    setup = watched(mechanism, kind)
    found = derive(setup, form=form)
    assert found.equivalence.passed
    assert found.equivalence.largest_angle < RELATION_ANGLE_TOL
    lifts = [step for step in found.steps if step.rule == "lift"]
    assert lifts
    assert all(step.accepted for step in lifts)
    assert found.hidden is not None
    read = native.parse(native.write(found.hidden))
    assert [o.key for o in read.observations] == [o.key for o in found.hidden.observations]
    return found


@pytest.mark.some(1, 13)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("robot", ["free_body", "arm", "gough_stewart"])
def test_every_kind_is_certified(robot: str, kind: str) -> None:
    mechanism = load(robot) if robot in list_robots() else {"free_body": free_body, "arm": arm}[robot]()
    if robot == "free_body" and kind == "encoder":
        with pytest.raises(BadRequest, match="one with one axis or two"):
            ObservedRobot.of(mechanism, sensor="encoder:free")
        return
    assert certified(mechanism, kind).verdict.rank > 0


@pytest.mark.some(3, 13)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("robot", ["free_body", "arm", "gough_stewart", "delta"])
def test_exact_ranks_are_those_of_samples(robot: str, kind: str) -> None:
    """For a generic camera, point and axis, of one observation and of two; one edge alone is irrational."""
    if (robot, kind) == ("free_body", "encoder"):
        return
    setup = watched(
        {"free_body": free_body, "arm": arm}[robot]() if robot in ("free_body", "arm") else load(robot), kind
    )
    exact = get_architecture(setup)
    for observed in (setup.observed, setup.observed[:1]):
        found = exact.verdict(observed)
        if kind == "edge":
            assert (found.exact, found.reason) == (False, "what is measured by edge edge_1 is not rational")
            continue
        assert found.exact, found.reason
        try:
            samples = setup.all_samples.restrict(observed)
            assert found.rank == compute_verdict(setup, [o.leg for o in observed], samples).rank
        except UndecidedRank:  # a circle far away hardly shows how it is turned
            assert (kind, found.rank) == ("image_circle", min(5 * len(observed), found.dof))
        assert found.proved is (found.rank == found.dof)


def robot_of(name: str) -> Mechanism:
    return spatial() if name == "spatial" else arm() if name == "arm" else load(name)


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("robot", [*ROBOTS, "spatial"])
def test_all_kinds_together_are_certified_on_every_robot(robot: str) -> None:
    """Each lift is a step that is certified alone."""
    mechanism = robot_of(robot)
    every = [watched(mechanism, kind) for kind in KINDS]
    sensor = [word for kind in KINDS for word in asked(mechanism, kind, np.random.default_rng(KINDS.index(kind)))]
    cameras = [f"{c.name}={c.link}@" + ",".join(map(str, c.pose[:3, 3])) for c in every[0].robot.cameras]
    found = derive(mechanism, camera=cameras, sensor=sensor)
    assert found.equivalence.passed
    assert sum(step.rule == "lift" and step.accepted for step in found.steps) == len(sensor)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("robot", [*ROBOTS, "spatial"])
def test_every_kind_is_certified_on_every_robot(robot: str, kind: str) -> None:
    for form in ("simplified", "general"):
        assert certified(robot_of(robot), kind, form).equivalence.passed


@pytest.mark.parametrize(("robot", "least"), [("rprpr_m1", 1), ("rrrrr_m2", 0)])
def test_samples_with_the_camera_inside_of_a_cylinder_are_discarded(robot: str, least: int) -> None:
    setup = watched(load(robot), "edge")
    assert setup.all_samples.discarded >= least
    assert all(np.isfinite(member.relation.basis).all() for member in setup.all_samples.members)
    assert certified(load(robot), "edge").equivalence.passed


# ---- image points


def eye_in_hand(mechanism: Mechanism, count: int) -> ObservedRobot:
    """Points of the base, seen from a camera on the platform."""
    rng, X = np.random.default_rng(2), mechanism.links[mechanism.platform].pose
    places = [X[:3, 3] + X[:3, :3] @ (np.array([0, 0, 1.0]) + 0.3 * rng.normal(size=3)) for _ in range(count)]
    return ObservedRobot.of(
        mechanism,
        camera=f"hand={mechanism.platform}",
        sensor=["point:world@" + ",".join(map(str, place)) for place in places],
    )


def test_three_points_of_a_free_body_are_three_ups() -> None:
    found = derive(free_body(), sensor=POINTS[:3])
    assert found.hidden_architecture is not None
    assert found.hidden_architecture.unicode == "3-U̲PS"
    assert (str(found.architecture), found.verdict.verdict, found.verdict.rank) == ("6", "controllable", 6)
    assert found.unchecked is None


@pytest.mark.some(1)
@pytest.mark.parametrize("count", [3, 4])
def test_points_seen_from_the_hand_of_an_arm(count: int) -> None:
    """The arm itself goes: what is left is the camera between the points."""
    setup = eye_in_hand(arm(), count)
    found = derive(setup)
    assert found.hidden_architecture is not None
    assert found.hidden_architecture.unicode == f"{count}-SPU̲"
    assert found.verdict == "controllable"
    ranks = {len(each.legs): each.rank for each in legs(setup).sets}
    assert ranks == {size: min(2 * size, 6) for size in range(1, count + 1)}


@pytest.mark.some(2)
@pytest.mark.parametrize("count", [1, 2, 3])
def test_verdicts_agree_with_pixels_of_the_arm(count: int) -> None:
    """The rank of pixels' derivatives by the joints' angles, by the product of exponentials and differences alone."""
    setup = eye_in_hand(arm(), count)
    robot = setup.robot
    hand = robot.links["platform"].pose
    points = [robot.links["base"].pose @ np.append(o.to_dict()["at"], 1.0) for o in setup.observed]

    def pixels(angles: Array) -> Array:
        D = np.eye(4)
        for joint, angle in zip(robot.joints.values(), angles, strict=True):
            R = exponential(angle * joint.axis)
            D = D @ build_pose(joint.point - R @ joint.point, R)
        seen = [np.linalg.inv(D @ hand) @ point for point in points]
        return np.concatenate([each[:2] / each[2] for each in seen])

    angles, h = np.random.default_rng(4).uniform(-0.1, 0.1, 6), 1e-6
    J = np.column_stack([(pixels(angles + h * e) - pixels(angles - h * e)) / (2 * h) for e in np.eye(6)])
    assert np.linalg.matrix_rank(J, tol=1e-5) == derive(setup).verdict.rank


def test_a_leg_that_carries_what_is_observed_or_sees_is_never_removed() -> None:
    """A point on a rod, a camera on another, an encoder in a third."""
    found = derive("gough_stewart", camera="eye=rod_2", sensor=["point:rod_1@0,0,0.1", "encoder:slide_3"])
    refused = {step.leg: step.reason for step in found.steps if step.rule == "leg removal" and not step.accepted}
    assert {"1", "2", "3"} <= refused.keys()
    assert all("carries an observed link, an observed joint or a camera" in refused[leg] for leg in ("1", "2", "3"))
    assert found.hidden is not None
    assert {"rod_1", "rod_2", "rod_3"} <= found.hidden.links.keys()


def test_motions_that_move_an_observed_value_are_not_idle() -> None:
    """A rod that spins between two balls, seen by a camera."""
    plain, watched_ = (ObservedRobot.of("delta", sensor=sensor) for sensor in (None, ["point:rod_1a@0.05,0.02,-0.1"]))
    assert plain.mobility.total == watched_.mobility.total
    assert plain.mobility.internal == watched_.mobility.internal + 1


@pytest.mark.parametrize("kind", ["point", "distance", "image_line"])
@pytest.mark.parametrize("seed", range(3))
def test_what_always_goes_through_the_camera_s_centre_is_refused(kind: str, seed: int) -> None:
    """A camera in an elbow sees the elbow's point of the other link: the digits of the place are all that moves."""
    rng = np.random.default_rng(seed)
    mechanism = transformed(load("3rrr_m1"), random_rotation(rng), rng.normal(size=3))
    joint = mechanism.joints["elbow_1"]
    here, there = (
        ",".join(map(str, transform(np.linalg.inv(mechanism.links[link].pose), joint.point))) for link in joint.links
    )
    sensor = f"eye={kind}:{joint.links[1]}@{there}" + ("/0.3,0.4,0.5" if kind == "image_line" else "")
    with pytest.raises(UndefinedValue, match="distance from the camera centre"):
        ObservedRobot.of(mechanism, camera=[f"eye={joint.links[0]}@{here}"], sensor=[sensor])


def circumcircle(points: Array) -> tuple[Array, float, Array]:
    """Centre, radius and unit normal."""
    a, b = points[1] - points[0], points[2] - points[0]
    normal = np.cross(a, b)
    centre = points[0] + np.cross(normal, (a @ a) * b - (b @ b) * a) / (-2 * normal @ normal)
    return centre, float(np.linalg.norm(points[0] - centre)), normal / np.linalg.norm(normal)


def smallest(points: Array, cameras: Array) -> Array:
    """The smallest singular value of the rates of three image points of a free body, for each camera centre."""
    kind, V, found = list_kinds()["point"], np.eye(6), []
    seen = [kind("p", "l", at=point) for point in points]  # type: ignore[call-arg]
    for C in cameras:
        _, rates = kind.together(seen, build_pose(C), np.array([build_pose()] * 3), np.zeros((6, 6)), np.array([V] * 3))
        found.append(np.linalg.svd(rates, compute_uv=False)[5])
    return np.array(found)


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(2))
def test_three_points_are_singular_on_the_danger_cylinder_and_nowhere_else(seed: int) -> None:
    """The circular cylinder over the circumcircle: 2500 centres of the camera on it and as many off it, for each of two
    triangles; collinear points are singular everywhere."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(3, 3))
    centre, radius, z = circumcircle(points)
    np.testing.assert_allclose(np.linalg.norm(points - centre, axis=1), radius)
    x = (points[0] - centre) / radius
    turn, height = rng.uniform(0, 2 * np.pi, 2500), rng.uniform(0.3, 2, 2500) * rng.choice([-1, 1], 2500)
    around = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(z, x)
    on, off = (
        centre + each * around + height[:, None] * z
        for each in (radius, radius * rng.choice([0.8, 1.25], 2500)[:, None])
    )
    assert smallest(points, on).max() < 1e-12
    assert smallest(points, off).min() > 1e-7
    line = points[0] + np.outer([0.0, 0.4, 1.3], points[1] - points[0])
    assert smallest(line, on[:100]).max() < 1e-12
