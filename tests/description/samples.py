"""Robots of the tests of robot files: a spatial one with rods, one joint of every type, and a file in few lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrsynth.geometry.vectors import (
    Array,
    build_pose,
    find_perpendicular,
    freeze_array,
    normalise_vector,
    rotate_about_axis,
)
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Joint, JointType, Limits, Link, Mechanism, Motor
from hrsynth.mechanism.observations.direction import Direction

FOUR_BAR = """\
<robot name="four_bar">
  <link name="base"/>
  <link name="crank"/>
  <link name="bar"/>
  <link name="rocker"/>
  <joint name="a" type="revolute">
    <parent link="base"/>
    <child link="crank"/>
    <origin xyz="0 0 0" rpy="0 0 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="5" velocity="2"/>
  </joint>
  <joint name="b" type="continuous">
    <parent link="crank"/>
    <child link="bar"/>
    <origin xyz="0 0 1"/>
    <axis xyz="0 1 0"/>
  </joint>
  <joint name="c" type="continuous">
    <parent link="base"/>
    <child link="rocker"/>
    <origin xyz="2 0 0"/>
    <axis xyz="0 1 0"/>
  </joint>
  <loop name="d" type="revolute">
    <predecessor link="rocker">
      <origin xyz="0 0 1"/>
    </predecessor>
    <successor link="bar">
      <origin xyz="2 0 0"/>
    </successor>
    <axis xyz="0 1 0"/>
  </loop>
  <transmission name="m">
    <joint name="a"/>
  </transmission>
  <hrsynth>
    <platform link="bar"/>
    <observe leg="1" link="crank" axis="0 0 1"/>
  </hrsynth>
</robot>
"""


def with_rods(legs: int = 3) -> Mechanism:
    """A rigid platform on legs of a driven R and two rods with ball ends, observed on the first rods."""
    builder = Builder("rods")
    builder.link("base")
    builder.link("platform", at=(0, 0, -0.8))
    for leg in range(legs):
        R = rotate_about_axis((0, 0, 1), 2 * np.pi * leg / legs)
        arm = f"arm_{leg}"
        builder.link(arm, at=R @ (0.2, 0, 0), rotation=R)
        builder.joint(f"shoulder_{leg}", "R", "base", arm, R @ (0.2, 0, 0), axis=R @ (0, 1, 0), motor=True)
        for letter, y in (("a", -0.05), ("b", 0.05)):
            rod, elbow, wrist = f"rod_{leg}{letter}", R @ (0.5, y, 0), R @ (0.05, y, -0.8)
            builder.link(rod, at=elbow, rotation=R)
            builder.joint(f"elbow_{leg}{letter}", "S", arm, rod, elbow)
            builder.joint(f"wrist_{leg}{letter}", "S", rod, "platform", wrist, loop=(leg, letter) != (0, "a"))
        builder.observe(str(leg + 1), f"rod_{leg}a", R @ (-0.45, 0, -0.8))
    return builder.build("platform")


def rotation(rng: np.random.Generator) -> Array:
    """A rotation; one in four has a pitch of ±90° or nearly so, one in eight is none."""
    if rng.random() < 0.125:
        return np.eye(3)
    R = rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))
    if rng.random() < 0.25:
        near = rng.choice([0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-5, 1e-3])
        R = (
            rotate_about_axis((0, 0, 1), rng.uniform(-3, 3))
            @ rotate_about_axis((0, 1, 0), np.pi / 2 - near)
            @ rotate_about_axis((1, 0, 0), rng.uniform(-3, 3))
        )
    return R


def every_joint(tree: Sequence[JointType], loops: Sequence[JointType], seed: int, scale: float = 1.0) -> Mechanism:
    """A random tree with joints of these types, loops of these types between its links, motors, limits, all kinds of
    kept content; half of the joints lie at the origin of the link that they carry."""
    rng = np.random.default_rng(seed)
    links = [Link("base")]
    joints: list[Joint] = []

    def joint(name: str, kind: JointType, ends: tuple[str, str], point: Array, in_tree: bool) -> Joint:
        first = normalise_vector(rng.normal(size=3))
        axes = (first, find_perpendicular(first, rng.normal(size=3)))[: kind.axes]
        driven = kind is not JointType.FIXED and rng.random() < 0.5
        limits = None
        if rng.random() < 0.4:
            low, high = sorted(rng.normal(size=2))
            limits = Limits(*(None if rng.random() < 0.4 else float(each) for each in (low, high, 3.0, 0.1)))
            limits = None if limits == Limits() else limits
        content = ('<dynamics damping="0.5"/>',) if rng.random() < 0.3 else ()
        motor = Motor(f"drive_{name}") if driven else None
        return Joint(name, kind, *ends, point, axes, motor, limits, in_tree, content)

    for number, kind in enumerate(tree):
        frame = build_pose(rng.normal(size=3) * scale, rotation(rng))
        parent = links[rng.integers(len(links))].name
        content = ("@flavour=a = 'b'", '<inertial><mass value="1"/></inertial>') if rng.random() < 0.3 else ()
        point = frame[:3, 3] if rng.random() < 0.5 else rng.normal(size=3) * scale
        links.append(Link(f"link_{number}", frame, content))
        joints.append(joint(f"tree_{number}", kind, (parent, links[-1].name), point, True))
    for number, kind in enumerate(loops):
        ends = rng.choice(len(links), 2, replace=False)
        names = (links[ends[0]].name, links[ends[1]].name)
        joints.append(joint(f"loop_{number}", kind, names, rng.normal(size=3) * scale, False))
    watched = [links[rng.integers(len(links))].name for _ in range(2)]
    observations = tuple(Direction(str(k), link, rng.normal(size=3)) for k, link in enumerate(watched, 1))
    return Mechanism.of(
        "all_sorts",
        links,
        joints,
        platform=links[-1].name,
        observations=observations,
        camera=links[1].name if rng.random() < 0.5 else None,
        xml=("@version=1.0", '<material name="red"><color rgba="1 0 0 1"/></material>'),
    )


def moved(mechanism: Mechanism, X: Array) -> Mechanism:
    """The whole geometry, the base link's frame included, seen from another frame."""
    links = {name: replace(link, pose=freeze_array(X @ link.pose)) for name, link in mechanism.links.items()}
    joints = {
        name: replace(each, point=X[:3, :3] @ each.point + X[:3, 3], axes=tuple(X[:3, :3] @ axis for axis in each.axes))
        for name, each in mechanism.joints.items()
    }
    return replace(mechanism, links=links, joints=joints)
