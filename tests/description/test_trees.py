"""Trees and joints of files and mechanisms: the fewest dof that networkx finds, and the same joints both ways."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.description import build_spanning_mechanism
from hrsynth.description.conversion import convert_to_joint, find_joint_value, list_joint_specs
from hrsynth.description.jointgraph import FrameSpec, JointSpec, build_spanning_tree, compute_zero_poses
from hrsynth.geometry.vectors import build_pose, rotate_about_axis
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import JointType, Mechanism
from hrsynth.mechanism.screws import split_elementary
from strategies import random_direction, random_normal, random_rotation


def tangled(seed: int) -> Mechanism:
    """Links with random frames, and more joints between them than a tree has, of all types that close loops."""
    rng = np.random.default_rng(seed)
    builder, count = Builder(f"tangled_{seed}"), 7
    builder.link("b")
    for number in range(1, count):
        builder.link(f"l{number}", rng.normal(size=3), random_rotation(rng))
    links = ["b", *(f"l{number}" for number in range(1, count))]
    pairs = [(links[rng.integers(number)], links[number]) for number in range(1, count)]
    pairs += [tuple(rng.choice(links, 2, replace=False)) for _ in range(count)]
    for number, (one, other) in enumerate(pairs):
        kind = str(rng.choice(list("RPUCESF")))
        first = random_direction(rng)
        axes = {"axis": None if kind in "SF" else first, "axis2": random_normal(rng, first) if kind == "U" else None}
        builder.joint(f"j{number}", kind, str(one), str(other), rng.normal(size=3), **axes)
    return builder.build(platform=links[-1])


@pytest.mark.parametrize("seed", range(12))
def test_all_trees_have_the_fewest_freedoms(seed: int):
    robot = tangled(seed)
    loose = robot.changed(joints=[replace(joint, in_tree=False) for joint in robot.joints.values()])
    graph = nx.MultiGraph((*joint.links, {"weight": joint.type.freedoms}) for joint in loose.joints.values())
    least = sum(freedoms for *_, freedoms in nx.minimum_spanning_tree(graph).edges(data="weight"))
    of_mechanism = [joint.type.freedoms for joint in build_spanning_mechanism(loose).joints.values() if joint.in_tree]
    of_file = [spec.kind.freedoms for spec, _, _ in build_spanning_tree(loose.base, list_joint_specs(loose))]
    of_model = [joint.type.freedoms for joint in PinocchioModel(loose).spanned[0]]
    assert sum(of_mechanism) == sum(of_file) == sum(of_model) == least


@pytest.mark.parametrize("seed", range(6))
def test_joints_are_the_same_through_their_specifications(seed: int):
    robot = build_spanning_mechanism(tangled(seed))
    specs = list_joint_specs(robot)
    poses = compute_zero_poses(robot.base, build_spanning_tree(robot.base, specs))
    for link in robot.links.values():
        assert poses[link.name] == pytest.approx(link.pose, abs=1e-12)
    for spec in specs:
        back, joint = convert_to_joint(spec, poses, in_tree=spec.in_tree), robot.joints[spec.name]
        assert (back.type, back.links, back.in_tree) == (joint.type, joint.links, joint.in_tree)
        assert back.point == pytest.approx(joint.point, abs=1e-12)
        assert np.array(back.axes) == pytest.approx(np.array(joint.axes), abs=1e-12)


@pytest.mark.parametrize("kind", "RPUCE")
@given(q=st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3), seed=st.integers(0, 99))
def test_a_value_is_found_from_the_displacement_that_it_makes(kind: str, q: list[float], seed: int):
    rng = np.random.default_rng(seed)
    axis, type_ = random_direction(rng), JointType(kind)
    axes = (axis, random_normal(rng, axis))[: type_.axes]
    spec = JointSpec("j", type_, (FrameSpec("one"), FrameSpec("two")), axes)
    D = np.eye(4)
    for value, (part, along) in zip(q, split_elementary(type_, axes), strict=False):
        turn = build_pose(np.zeros(3), rotate_about_axis(along, value))
        D = D @ (build_pose(value * along) if part is JointType.PRISMATIC else turn)
    assert find_joint_value(spec, D) == pytest.approx(q[: type_.freedoms], abs=1e-12)
