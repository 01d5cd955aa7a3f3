"""Robots as exports write them: numbers of few decimals, balls and U joints as R one after the other, millimetres."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from hrsynth.description import build_spanning_mechanism, save
from hrsynth.geometry.vectors import build_pose
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.model import Joint, Link, Motor

ENDINGS = {"native": ".urdf", "gepetto": ".yaml", "mjcf": ".xml", "sdf": ".sdf"}
_NUMBER = re.compile(rb"(?<![\w.])-?\d+\.\d+(?:[eE][-+]?\d+)?|(?<![\w.])-?\d+[eE][-+]?\d+")


def of_hinges(robot: Mechanism, aligned: bool = False, slid: float = 0.0, apart: float = 0.0) -> Mechanism:
    """Every ball as three R and every U as two R, through links whose names and frames say nothing; the axes of balls
    in any directions, or ``aligned`` with the base's. The links between have no size, or the R are ``slid`` along their
    axes, or these pass each other ``apart`` (characteristic lengths): then the joint is no ball and no U."""
    links, joints, rng = dict(robot.links), {}, np.random.default_rng(7)
    for joint in robot.joints.values():
        if joint.type not in (JointType.SPHERICAL, JointType.UNIVERSAL):
            joints[joint.name] = joint
            continue
        Q = np.eye(3) if aligned else np.linalg.qr(np.random.default_rng(len(joints)).normal(size=(3, 3)))[0]
        axes = joint.axes or tuple(Q)
        before = joint.predecessor
        for number, axis in enumerate(axes):
            last = number == len(axes) - 1
            after = joint.successor if last else f"{joint.name}_cross{number}"
            point = joint.point + robot.length * (
                slid * rng.uniform(-1, 1) * axis + apart * number * np.cross(axes[0], axes[1])
            )
            if not last:
                links[after] = Link(after, build_pose(point))
            name = f"{joint.name}_hinge{number}"
            motor = None if joint.motor is None else Motor(f"{joint.motor.name}_{number}")
            joints[name] = Joint(
                name, JointType.REVOLUTE, before, after, point, (axis,), motor, in_tree=joint.in_tree or not last
            )
            before = after
    return build_spanning_mechanism(replace(robot, links=links, joints=joints))


def in_millimetres(robot: Mechanism) -> Mechanism:
    """The same robot, its lengths a thousand times as large."""

    def far(X: np.ndarray) -> np.ndarray:
        return build_pose(1000 * X[:3, 3], X[:3, :3])

    links = {name: replace(link, pose=far(link.pose)) for name, link in robot.links.items()}
    joints = {name: replace(joint, point=1000 * joint.point, limits=None) for name, joint in robot.joints.items()}
    return replace(robot, links=links, joints=joints)


def round_file(path: Path, decimals: int, significant: bool = False) -> None:
    """Every number of a file with at most so many decimals, or significant digits."""

    def short(match: re.Match[bytes]) -> bytes:
        if significant:
            return f"{float(match[0]):.{decimals}g}".encode()
        return (f"{round(float(match[0]), decimals):.{decimals}f}".rstrip("0").rstrip(".") or "0").encode()

    for file in (path, path.with_suffix(".urdf")):
        if file.exists() and file.suffix != ".yaml":
            head, mark, rest = file.read_bytes().partition(b"\n" if file.suffix == ".usda" else b"?>")
            file.write_bytes(head + mark + _NUMBER.sub(short, rest) if rest else _NUMBER.sub(short, head))


def exported(robot: Mechanism, path: Path, decimals: int, significant: bool = False) -> Path:
    """The robot written in the dialect of the file's ending, with so many decimals or significant digits."""
    save(robot, path)
    round_file(path, decimals, significant)
    return path
