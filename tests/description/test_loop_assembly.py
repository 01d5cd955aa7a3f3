"""Laws of the spanning tree and its loops: frames that meet as joints allow, whichever end carries the other."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.description.assembly.loops import LoopAssembly
from hrsynth.description.jointgraph import FrameSpec, JointSpec
from hrsynth.geometry.vectors import Array, build_pose, normalise_vector, rotate_about_axis
from hrsynth.mechanism import JointType
from hrsynth.mechanism.screws import split_elementary
from strategies import random_rotation

KINDS = [kind for kind in JointType if kind is not JointType.FIXED]


def random_pose(rng: np.random.Generator) -> Array:
    return build_pose(rng.normal(size=3), random_rotation(rng))


def random_axes(kind: JointType, rng: np.random.Generator) -> tuple[Array, ...]:
    first = normalise_vector(rng.normal(size=3))
    second = normalise_vector(np.cross(first, rng.normal(size=3)))
    return (first, second)[: kind.axes]


def displace(kind: JointType, axes: tuple[Array, ...], value: Array) -> Array:
    """The displacement of a joint's second frame from its first: one motion after the other."""
    D = np.eye(4)
    for (part, axis), q in zip(split_elementary(kind, axes), value, strict=True):
        D = D @ (
            build_pose(q * axis) if part is JointType.PRISMATIC else build_pose(rotation=rotate_about_axis(axis, q))
        )
    return D


def random_joint(name: str, kind: JointType, links: tuple[str, str], rng: np.random.Generator) -> JointSpec:
    ends = FrameSpec(links[0], random_pose(rng)), FrameSpec(links[1], random_pose(rng))
    return JointSpec(name, kind, ends, random_axes(kind, rng))


def as_posture(joint: JointSpec, value: Array) -> Array:
    """As keyframes give it: spherical and free joints by their displacement."""
    return displace(joint.kind, joint.axes, value) if joint.kind in (JointType.SPHERICAL, JointType.FREE) else value


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_a_tree_are_where_its_joints_put_them(kind: JointType, backward: bool):
    rng = np.random.default_rng(KINDS.index(kind))
    tip = random_joint("tip", JointType.REVOLUTE, ("middle", "hand"), rng)
    joint = random_joint("joint", kind, ("middle", "base") if backward else ("base", "middle"), rng)
    value = rng.uniform(-1, 1, kind.freedoms)
    start = {"joint": as_posture(joint, value)}
    assembly = LoopAssembly("base", [joint, tip], start=start)
    poses = assembly.poses(assembly.zero())
    X, Y = joint.frames(poses)
    np.testing.assert_allclose(np.linalg.inv(X) @ Y, displace(kind, joint.axes, value), atol=1e-12)
    if start["joint"].ndim == 1:
        np.testing.assert_allclose(assembly.coordinates(assembly.zero())["joint"], value, atol=1e-12)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("closing", [JointType.FIXED, *KINDS])
@pytest.mark.parametrize("kind", KINDS)
def test_residuals_and_their_derivative_are_those_of_the_frames(kind: JointType, closing: JointType, backward: bool):
    """Closed where the closing joint allows its frames to be; the derivative is the difference quotient."""
    rng = np.random.default_rng(100 * KINDS.index(kind) + len(closing.value) + backward)
    joints = [
        random_joint("joint", kind, ("middle", "base") if backward else ("base", "middle"), rng),
        random_joint("elbow", JointType.UNIVERSAL, ("middle", "hand"), rng),
        random_joint("slide", JointType.PRISMATIC, ("hand", "tool"), rng),
    ]
    start = {joint.name: as_posture(joint, rng.uniform(-1, 1, joint.kind.freedoms)) for joint in joints}
    tree = LoopAssembly("base", joints, start=start)
    poses = tree.poses(tree.zero())
    axes, near = random_axes(closing, rng), random_pose(rng)
    meet = poses["base"] @ near @ displace(closing, axes, rng.uniform(-1, 1, closing.freedoms))
    ends = FrameSpec("base", near), FrameSpec("tool", np.linalg.inv(poses["tool"]) @ meet)
    assembly = LoopAssembly("base", [*joints, JointSpec("loop", closing, ends, axes, in_tree=False)], start=start)
    values = assembly.zero()
    errors, J = assembly.system(values)
    assert J.shape == (6 - closing.freedoms, assembly.size)
    np.testing.assert_allclose(errors, 0.0, atol=1e-12)
    step = 1e-6
    quotient = [
        (assembly.system(assembly.step(values, step * e))[0] - assembly.system(assembly.step(values, -step * e))[0])
        / (2 * step)
        for e in np.eye(assembly.size)
    ]
    np.testing.assert_allclose(J, np.reshape(quotient, (assembly.size, -1)).T, atol=1e-7)
    near_by, residual = assembly.close(assembly.step(values, 0.05 * rng.normal(size=assembly.size)))
    assert residual < 1e-11
    X, Y = assembly.loops[0].frames(assembly.poses(near_by))
    D = np.linalg.inv(X) @ Y
    if closing in (JointType.SPHERICAL, JointType.REVOLUTE, JointType.UNIVERSAL, JointType.FIXED):
        np.testing.assert_allclose(D[:3, 3], 0.0, atol=1e-10)
    if closing in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR):
        np.testing.assert_allclose(D[:3, :3] @ axes[0], axes[0], atol=1e-10)
