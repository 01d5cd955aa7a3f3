"""Rests of arms with a camera in the hand, against kinematics, image and descent that are written by hand."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.vectors import Array, build_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.simulation.equilibria.equilibrium import Equilibria
from hrsynth.simulation.equilibria.search import told_by
from oracle import exponential

SQUARE = np.array([[0.4, 0, 0], [0.55, 0, 0], [0.55, 0.15, 0], [0.4, 0.15, 0]])
SPREAD = np.array([[0.5, 0.1, 0], [0.6, 0.1, 0.1], [0.5, 0.3, 0.1], [0.6, 0.3, 0]])
ARMS = {
    "panda": ("panda_hand", SPREAD, "x=0.5,y=0.2,z=0.5,rpy=180deg/0/0"),
    "ur5_robot": ("wrist_3_link", SQUARE, "x=0.47,y=0.08,z=0.45,rpy=3.1/0.05/0.1"),
}


@cache
def found(name: str) -> Equilibria:
    hand, points, at = ARMS[name]
    sensor = ["point:world@" + ",".join(map(str, point)) for point in points]
    return hrsynth.equilibria(f"example:{name}", camera=f"hand={hand}", sensor=sensor, goal=at)


def at_rest(name: str, configuration: ClosedConfiguration) -> Array:
    """The hand's pose (4, 4): it is fixed to the platform."""
    setup = found(name).setup
    links, tip = setup.robot.links, setup.motion.link
    return np.asarray(configuration.pose(tip) @ np.linalg.inv(links[tip].pose) @ links[ARMS[name][0]].pose)


class Arm:
    """The hand by a product of exponentials of the joints that carry it, and what its camera sees."""

    def __init__(self, name: str) -> None:
        hand, self.points, _ = ARMS[name]
        robot = found(name).setup.robot
        way, link = [], hand
        while (joint := next((j for j in robot.joints.values() if j.links[1] == link), None)) is not None:
            way.insert(0, joint)
            link = joint.links[0]
        moving = [joint for joint in way if joint.type == "R"]
        self.axes = np.array([joint.axis for joint in moving])
        self.places = np.array([joint.point for joint in moving])
        self.hand = robot.links[hand].pose
        self.wanted = self.image(at_rest(name, found(name).goal))

    def placed(self, q: Array) -> Array:
        D = np.eye(4)
        for angle, axis, place in zip(q, self.axes, self.places, strict=True):
            R = exponential(angle * axis)
            D = D @ build_pose(place - R @ place, R)
        return np.asarray(D @ self.hand)

    def image(self, X: Array) -> Array:
        local = (self.points - X[:3, 3]) @ X[:3, :3]
        return np.concatenate([(local[:, :2] / local[:, 2:]).ravel(), local[:, 2]])

    def error(self, q: Array) -> Array:
        return np.asarray((self.image(self.placed(q)) - self.wanted)[: 2 * len(self.points)])

    def slope(self, q: Array, h: float = 1e-5) -> Array:
        """The gradient of ½ ‖e‖²."""
        J = np.array([(self.error(q + h * n) - self.error(q - h * n)) / (2 * h) for n in np.eye(len(q))])
        return np.asarray(J @ self.error(q))

    def angles(self, X: Array, near: Array) -> Array:
        """Joint angles at which the hand is at X."""
        exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
        told = least_squares(lambda q: (self.placed(q) - X)[:3].ravel(), near, max_nfev=100, **exact)
        return np.asarray(told.x) if told.cost < 1e-18 else near * np.nan


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_rests_of_an_arm_are_rests_and_descents_meet_no_other_that_attracts(name: str) -> None:
    """The gradient by differences vanishes at each that is told. Descents from random joint angles with all points in
    view, 40 of which end in view, end where a rest that attracts is told; one of them is a singularity of an arm with
    seven joints."""
    told, arm = found(name), Arm(name)
    rng = np.random.default_rng(8)
    assert told.points[0].kind == "goal"
    assert told.points[0].stability == "stable"
    for each in told.points:
        X = at_rest(name, each.configuration)
        for _ in range(3):
            q = arm.angles(X, rng.uniform(-np.pi, np.pi, len(arm.axes)))
            if np.isfinite(q).all() and each.singular is None:
                assert np.linalg.norm(arm.slope(q)) < 1e-6
                break
    assert name != "panda" or any(each.singular for each in told.stable)
    poses = [at_rest(name, each.configuration) for each in told.stable]
    met = 0
    while met < 40:
        q = rng.uniform(-np.pi, np.pi, len(arm.axes))
        if arm.image(arm.placed(q))[2 * len(arm.points) :].min() < 0.05:
            continue
        way = least_squares(arm.error, q, xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=2000)
        X = arm.placed(way.x)
        if np.linalg.norm(arm.slope(way.x)) > 1e-9 or arm.image(X)[2 * len(arm.points) :].min() <= 0:
            continue
        met += 1
        assert min(float(np.abs(X - each).max()) for each in poses) < 1e-5


def test_what_moves_though_the_hand_rests_parts_nothing() -> None:
    """The elbow of an arm with seven joints, not of one with six."""
    for name, free in (("panda", True), ("ur5_robot", False)):
        hand, points, _ = ARMS[name]
        sensor = ["point:world@" + ",".join(map(str, point)) for point in points]
        setup = ObservedRobot.of(f"example:{name}", camera=f"hand={hand}", sensor=sensor)
        told = {o.leg for o in told_by(setup)}
        assert told >= set(setup.labels)
        assert (told == {o.leg for o in setup.all_samples.observation_model.observations}) is not free


@pytest.mark.long
def test_free_joints_do_not_part_a_rest() -> None:
    """An arm of seven joints holds its hand in infinitely many ways: that is one rest, shown within the limits of all
    joints."""
    goal = found("panda").points[0]
    assert goal.working_modes == 1
    assert not goal.beyond_limits
