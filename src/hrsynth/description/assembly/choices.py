"""What a file says and what it leaves open, before it is put together: what a guided reader shows and asks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...errors import BadRequest
from ...mechanism.model import Mechanism, Note, likely_motors
from .. import formats
from ..jointgraph import JointGraph, JointSpec
from ..overrides import Overrides
from ..reading import robot_file
from . import assumptions, closures
from .candidates import ClosureCandidate, closure_candidates


@dataclass(frozen=True)
class ImportChoices:
    """What stands in a file (``joints`` with their motors and closures), the links that could be base and platform, the
    likeliest first, and why the first is the platform (None: the file says so); frames that a closure could join."""

    dialect: str
    links: tuple[str, ...]
    joints: tuple[JointSpec, ...]
    bases: tuple[str, ...]
    platforms: tuple[str, ...]
    why: str | None
    told: bool
    """Whether the first of the platforms is the file's or an assumption, not one of several that are as good."""
    candidates: tuple[ClosureCandidate, ...]
    notes: tuple[Note, ...]

    @property
    def closing(self) -> tuple[JointSpec, ...]:
        """The joints that close loops."""
        return tuple(joint for joint in self.joints if not joint.in_tree)

    @property
    def moving(self) -> tuple[JointSpec, ...]:
        """The joints that can be driven."""
        return tuple(joint for joint in self.joints if joint.kind.freedoms)

    @property
    def proposed_motors(self) -> list[str]:
        """The joints that could be driven where nothing says which are."""
        return likely_motors(self.bases[0], self.joints)[0]


def choices(path: Path, overrides: Overrides) -> ImportChoices:
    """What the file at ``path`` leaves open once closures, motors and frozen joints are given; raises as reading it
    does."""
    graph = formats.read(robot_file(path, overrides, strict=False))
    if isinstance(graph, Mechanism):
        raise BadRequest(f"{path}: its dialect leaves nothing open", graph.name)
    closures.join_halves(graph)
    overrides.apply(graph)
    closures.merge_points(graph)
    base = assumptions.standing(graph, graph.base or assumptions.base(graph), overrides.base)
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
    """The links that could be the platform: the file's or the assumption, what was as good, then those that hold most
    joints."""
    joints = {link: 0 for link in graph.links}
    for joint in graph.joints.values():
        for link in joint.links:
            joints[link] += bool(joint.kind.freedoms)
    others = sorted((link for link in graph.links if link != base), key=lambda link: -joints[link])
    if graph.platform is not None:
        return tuple(dict.fromkeys([graph.platform, *others])), None, True
    found, why = assumptions.platforms(graph, base)
    return tuple(dict.fromkeys([*found, *others])), why or None, bool(why)
