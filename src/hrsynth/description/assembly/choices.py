"""Content of a file before assembly and its open choices, for a guided import."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...mechanism.model import Note, infer_motors
from .. import formats
from ..jointgraph import JointGraph, JointSpec
from ..overrides import Overrides
from ..reading import open_robot_file
from . import assumptions, closures
from .candidates import ClosureCandidate, closure_candidates


@dataclass(frozen=True)
class ImportChoices:
    """Joints of a file with motors and closures, the links that could be base and platform, the likeliest first, the
    reason for the first platform (None: the file names it), and frames that a closure could connect."""

    dialect: str
    links: tuple[str, ...]
    joints: tuple[JointSpec, ...]
    bases: tuple[str, ...]
    platforms: tuple[str, ...]
    why: str | None
    told: bool
    """The first platform is named or assumed, not one of several equal candidates."""
    candidates: tuple[ClosureCandidate, ...]
    notes: tuple[Note, ...]

    @property
    def closing(self) -> tuple[JointSpec, ...]:
        """Joints that close loops."""
        return tuple(joint for joint in self.joints if not joint.in_tree)

    @property
    def moving(self) -> tuple[JointSpec, ...]:
        """Joints that can have motors."""
        return tuple(joint for joint in self.joints if joint.kind.freedoms)

    @property
    def proposed_motors(self) -> list[str]:
        """Joints that could have motors if the file names none."""
        return infer_motors(self.bases[0], self.joints)[0]


def choices(path: Path, overrides: Overrides) -> ImportChoices:
    """Return the open choices of the file at ``path`` once closures, motors and frozen joints are given; raises as
    reading it does."""
    graph = formats.read(open_robot_file(path, overrides, strict=False))
    closures.join_halves(graph)
    overrides.apply(graph)
    closures.merge_points(graph)
    base = assumptions.standing(graph, assumptions.base(graph), overrides.base)
    graph.prune(base)
    carried = {joint.links[1] for joint in graph.joints.values() if joint.in_tree}
    bases = dict.fromkeys([base, *(link for link in graph.links if link not in carried)])
    platforms, why, told = _platforms(graph, base)
    return ImportChoices(
        graph.dialect,
        tuple(graph.links),
        tuple(graph.joints.values()),
        tuple(bases),
        platforms,
        why,
        told,
        closure_candidates(graph, base),
        tuple(graph.notes),
    )


def _platforms(graph: JointGraph, base: str) -> tuple[tuple[str, ...], str | None, bool]:
    """Return the links that could be the platform: the file's or the assumed one, equal candidates, then those with
    most joints."""
    joints = {link: 0 for link in graph.links}
    for joint in graph.joints.values():
        for link in joint.links:
            joints[link] += bool(joint.kind.freedoms)
    others = sorted((link for link in graph.links if link != base), key=lambda link: -joints[link])
    if graph.platform is not None:
        return tuple(dict.fromkeys([graph.platform, *others])), None, True
    found, why = assumptions.platforms(graph, base)
    return tuple(dict.fromkeys([*found, *others])), why or None, bool(why)
