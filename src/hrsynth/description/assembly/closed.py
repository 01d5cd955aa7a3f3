"""Mechanism of a joint graph with known poses of its links, and of a complete graph, closed up to rounding errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...errors import BadRobotFile, Defect
from ...geometry.vectors import Array
from ...mechanism.model import FIRST, NAMED, Joint, JointType, Mechanism, PlatformChoice
from ...tolerances import DIRECTION_SINE_TOL, GEOMETRY_DIFFERENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION
from ..conversion import convert_couplings, convert_to_joint
from ..jointgraph import JointGraph, JointSpec, build_spanning_tree, compute_zero_poses
from ..jointmotion import compute_closure_residual, propose_closure_fix, require_closed
from ..observation_text import add_file_observations
from ..overrides import Overrides
from ..tree import build_spanning_mechanism


def make_mechanism(
    graph: JointGraph,
    base: str,
    platform: tuple[str, PlatformChoice],
    joints: Mapping[str, Joint],
    poses: Mapping[str, Array],
) -> Mechanism:
    """Return the mechanism of a graph with these joints, its links at ``poses``."""
    link, choice = platform
    mechanism = Mechanism(
        graph.name,
        {name: replace(each, pose=poses[name]) for name, each in graph.links.items()},
        joints,
        base,
        link,
        tuple(graph.observations),
        (),
        graph.camera,
        tuple(graph.rest),
        graph.file,
        tuple(graph.notes),
        formation=graph.formation,
        turns=graph.turns if link == graph.platform else None,
        choice=choice,
    )
    geared = {name for gear in graph.gears for name in (gear.driver, gear.driven)}
    mechanism = build_spanning_mechanism(mechanism, geared)
    mechanism = add_file_observations(mechanism, graph.sights, graph.cameras, graph.file)
    return replace(mechanism, couplings=convert_couplings(graph, mechanism))


def build_closed(graph: JointGraph, overrides: Overrides) -> Mechanism | None:
    """Return the mechanism of a complete graph, its geometry unchanged, or repaired if its numbers are rounded; None if
    rounded numbers leave its loops open by more than that."""
    base, platform = str(graph.base), (str(graph.platform), FIRST if graph.formation else NAMED)
    poses = compute_zero_poses(base, build_spanning_tree(base, graph.joints.values()))

    def convert(is_closed: bool) -> Mechanism:
        joints = {
            name: convert_to_joint(joint, poses, in_tree=joint.in_tree, is_closed=is_closed)
            for name, joint in graph.joints.items()
        }
        return make_mechanism(graph, base, platform, joints, poses)

    mechanism = convert(is_closed=True)
    loops = [(joint, *joint.frames(poses)) for joint in graph.joints.values() if not joint.in_tree]
    opening = max((compute_closure_residual(*loop, mechanism.length) for loop in loops), default=0.0)
    if loops and not overrides.as_written:
        rounded = overrides.tolerance or graph.digits.rounding(mechanism.length, opening)
        if rounded and opening <= TOLERANCE_AMBIGUITY_FRACTION * rounded:
            from .geometry_repair import snap_geometry

            return snap_geometry(convert(is_closed=False), opening, rounded)
        if opening > GEOMETRY_DIFFERENCE_TOL and propose_closure_fix(opening):
            return None
    _require_perpendicular(graph.file, loops, mechanism.length)
    require_closed(graph.file, loops, mechanism.length)
    return mechanism


def _require_perpendicular(file: str, loops: Sequence[tuple[JointSpec, Array, Array]], length: float) -> None:
    """Raise ``BadRobotFile`` for universal closures at one point whose axes are not perpendicular."""
    defects = []
    for joint, X_P, X_S in loops:
        if (
            joint.type is JointType.UNIVERSAL
            and np.linalg.norm(X_S - X_P, axis=0)[3] <= GEOMETRY_DIFFERENCE_TOL * length
        ):
            cosine = float(X_P[:3, :3] @ joint.axes[0] @ (X_S[:3, :3] @ joint.axes[1]))
            if not abs(cosine) <= DIRECTION_SINE_TOL:
                what = f"universal loop {joint.name!r}: cosine between axis and axis2"
                defects.append(Defect(file, joint.line, what, f"{cosine:.3g}", "0"))
    if defects:
        raise BadRobotFile(defects)
