"""Loops that do not close: by how much, between which links, and what to try next."""

from __future__ import annotations

import math

import numpy as np

from ...errors import LoopClosureFailure
from ...tolerances import CHARACTERISTIC_LENGTH_MAX_M
from ..jointgraph import JointGraph, join_names
from ..jointmotion import compute_closure_residual, propose_closure_fix
from ..keyframes import list_keyframes
from ..overrides import Overrides
from .loops import LoopAssembly, LoopSolution

CLOSURE_POINT_DISTANCE_MAX = 10.0
"""Distance of a closure's point from its link's frame (characteristic lengths) above which its unit is doubted."""
_SMALL_M = 1e-9
"""Length (m) that stands for the characteristic one where only the distance of a closure residual counts."""


def describe_failure(
    graph: JointGraph, assembly: LoopAssembly, solution: LoopSolution, overrides: Overrides
) -> LoopClosureFailure:
    """Return the error of loops that stay open: opening in metres and radians, links, and the likeliest remedy."""
    name, _ = assembly.worst(solution.values)
    where = ""
    if name in graph.joints:
        joint = graph.joints[name]
        frames = joint.frames(assembly.poses(solution.values))
        distance = compute_closure_residual(joint, *frames, _SMALL_M) * _SMALL_M
        angle = compute_closure_residual(joint, *frames, math.inf)
        parts = [f"{distance:.3g} m"] * (distance > 2 * angle * _SMALL_M)
        parts += [f"{np.rad2deg(angle):.3g} degrees"] * (angle > _SMALL_M)
        where = f"{' and '.join(parts)} between {joint.links[0]!r} and {joint.links[1]!r}"
    remedy = propose_closure_fix(solution.residual) or _choose_remedy(graph, assembly, overrides)
    return LoopClosureFailure(graph.file, solution.residual, assembly.noise, name, remedy, where)


def _choose_remedy(graph: JointGraph, assembly: LoopAssembly, overrides: Overrides) -> str:
    loops = [joint for joint in graph.joints.values() if not joint.in_tree]
    far = max(
        ((float(np.linalg.norm(end.X[:3, 3])), str(end.link)) for joint in loops for end in joint.ends),
        default=(0.0, ""),
    )
    if overrides.close and far[0] > CLOSURE_POINT_DISTANCE_MAX * assembly.length:
        return f"Points of --close are in metres: one is {far[0]:.3g} m from the frame of {far[1]!r}."
    if overrides.unit is None and assembly.length > CHARACTERISTIC_LENGTH_MAX_M:
        return "Use --unit mm if the file is in millimetres."
    if known := list_keyframes(graph):
        return f"Start from a keyframe that nearly closes them: --keyframe {join_names(known)}."
    return "Correct the ends given with --close." if overrides.close else ""
