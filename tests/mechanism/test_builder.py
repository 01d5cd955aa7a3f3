"""Robots from points and axes: a shipped robot, made again, is the same; mistakes are told in a line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import hrsynth
from hrsynth.errors import BadMechanism
from hrsynth.mechanism.builder import Builder
from kinematics.robots import ROBOTS


@pytest.mark.some(8)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_made_of_points_and_axes_is_the_robot(name: str):
    robot = hrsynth.load(name)
    builder = hrsynth.build(name)
    links = [robot.links[robot.base], *(link for link in robot.links.values() if link.name != robot.base)]
    for link in links:
        builder.link(link.name, link.pose[:3, 3], link.pose[:3, :3])
    for joint in robot.joints.values():
        axes = dict(zip(("axis", "axis2"), joint.axes, strict=False))
        motor = joint.motor.name if joint.motor else False
        builder.joint(joint.name, joint.type, *joint.links, joint.point, **axes, motor=motor, loop=not joint.in_tree)
    for coupling in robot.couplings:
        builder.coupling(coupling.name, coupling.driver, coupling.driven, coupling.ratio)
    made = builder.build(platform=robot.platform)
    free = ("observed ", "content of ", "xml of ", "limits of ")
    assert [text for text in made.differences(robot) if not text.startswith(free)] == []


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (lambda b: b.link("base"), "second link of the same name: got 'base'"),
        (lambda b: b.link("two", at=(0, 0)), "link 'two': at: got .*, expected 3 finite numbers"),
        (lambda b: b.link("two", rotation=np.eye(2)), "link 'two': rotation: got .*, expected 3 × 3 finite numbers"),
        (lambda b: b.joint("turn", "R", "base", "one", axis=(0, 0, 1)), "second joint of the same name: got 'turn'"),
        (lambda b: b.joint("slide", "Q", "base", "one"), "joint 'slide': type: got 'Q', expected R, P, U"),
        (lambda b: b.joint("slide", "P", "base", "one", at="far"), "joint 'slide': at: got 'far'"),
        (lambda b: b.joint("slide", "P", "base", "one", axis=(0, np.nan, 1)), "joint 'slide': axis: got"),
        (lambda b: b.joint("slide", "P", "base", "none", axis=(0, 0, 1)), "joint 'slide': unknown link: got 'none'"),
        (lambda b: b.joint("slide", "P", "base", "one"), "joint 'slide' of type P: number of axes: got 0, expected 1"),
        (lambda b: b.observe("1", "none", (0, 0, 1)), "leg '1': unknown link: got 'none', expected base, one"),
        (lambda b: b.observe("1", "one", 3), "leg '1': direction: got 3"),
        (lambda b: b.coupling("gear", "turn", "none", 2.0), "coupling of a joint: got 'none'"),
        (lambda b: b.build(platform="none"), "unknown platform link: got 'none'"),
    ],
)
def test_a_mistake_is_told_in_a_line(mistake: Callable[[Builder], object], said: str):
    builder = hrsynth.build("arm")
    builder.link("base")
    builder.link("one", at=(0, 0, 1))
    builder.joint("turn", "R", "base", "one", axis=(0, 0, 1), motor=True)

    def finish() -> None:
        mistake(builder)
        builder.build(platform="one")

    with pytest.raises(BadMechanism, match=said):
        finish()
