"""Portraits: every robot is drawn whole, inside its frame, and turns with its base."""

from __future__ import annotations

import re

import numpy as np
import pytest
from lxml import etree

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load
from hrsynth.present.portrait import Portrait
from hrsynth.present.view.shapes import MOTOR, PLATFORM


@pytest.mark.some(17)
@pytest.mark.parametrize("name", sorted(list_robots()))
def test_a_portrait_holds_the_robot_and_nothing_beyond_its_frame(name: str):
    robot = load(name)
    drawn = Portrait.of(ObservedRobot.of(robot))
    root = etree.fromstring(drawn.svg(400, 300).encode())
    at = [float(value) for path in root.iter("{*}path") for value in re.findall(r"-?[0-9.]+", path.get("d"))]
    assert min(at) > 0
    assert max(at) < 400
    assert root.get("role") == "img"
    motors = sum(joint.is_actuated for joint in robot.joints.values())
    assert sum(mark.role == MOTOR for mark in drawn.marks) == motors
    every = np.vstack([mark.points for mark in drawn.marks])
    for joint in robot.joints.values():
        assert np.min(np.linalg.norm(every - joint.point, axis=1)) < 0.1 * robot.length


def test_axes_are_a_right_handed_frame_and_a_planar_robot_is_seen_from_above():
    for name in ("3rrr_m1", "quattro", "orthoglide"):
        drawn = Portrait.of(ObservedRobot.of(load(name)))
        np.testing.assert_allclose(drawn.axes @ drawn.axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(drawn.axes) == pytest.approx(1)
        assert (abs(drawn.axes[2, 2]) > 1 - 1e-12) == (name == "3rrr_m1")
        assert any(mark.role == PLATFORM for mark in drawn.marks)
