"""The joint graph that a reader of a foreign dialect hands over: frames on both ends of every joint, nothing solved."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from ...mechanism import graphs
from ...mechanism.model import JointType, Link, Note
from ...mechanism.observation import Direction
from ..draft import Edge

_COST = {JointType.FIXED: 0, JointType.REVOLUTE: 1, JointType.PRISMATIC: 1, JointType.UNIVERSAL: 2,
         JointType.CYLINDRICAL: 2, JointType.PLANAR: 3, JointType.SPHERICAL: 3, JointType.FREE: 5}
_OUTSIDE = 20
"""Added to the cost of a joint that the file does not write as part of its tree."""
LINKS = 1000
"""Links above which a foreign file is refused."""


@dataclass(frozen=True)
class Gear:
    """A coupling as a file gives it: coordinate of joint ``driven`` = ratio × that of ``driver`` + offset."""

    name: str
    driver: str
    driven: str
    ratio: float
    offset: float = 0.0
    line: int | None = None


@dataclass
class Graph:
    """What a foreign file says; with every tree joint at zero its frames on both links coincide."""

    name: str
    file: str
    dialect: str
    links: dict[str, Link] = field(default_factory=dict)
    edges: dict[str, Edge] = field(default_factory=dict)
    gears: list[Gear] = field(default_factory=list)
    base: str | None = None
    platform: str | None = None
    camera: str | None = None
    observations: list[Direction] = field(default_factory=list)
    rest: list[str] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    closing: set[str] = field(default_factory=set)
    """Frames that only tell where a loop closes."""
    assumed: dict[str, list[str]] = field(default_factory=dict)
    """Guesses of one kind about many joints: what, and which."""

    def note(self, kind: str, text: str) -> None:
        """Record what the file does not say."""
        self.notes.append(Note(kind, text))

    def note_assumed(self) -> None:
        """Record the guesses about many joints, one note a kind."""
        for what, names in self.assumed.items():
            self.note("guess", f"{what}: {listed(names)}")
        self.assumed.clear()

    def fresh(self, name: str) -> str:
        """``name``, or ``name_2``, ``name_3`` … if it is taken."""
        taken, number = {*self.links, *self.edges}, 2
        if name not in taken:
            return name
        while f"{name}_{number}" in taken:
            number += 1
        return f"{name}_{number}"

    def connected(self, base: str) -> set[str]:
        """The links that chains of joints join to ``base``."""
        return graphs.component(graphs.adjacency(self.links, (e.links for e in self.edges.values())), base)


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names set apart by commas, the first of many."""
    every = list(names)
    return ", ".join(every[:most]) + (" …" if every[most:] else "")


def spanning_tree(base: str, edges: Iterable[Edge]) -> list[tuple[Edge, str, str]]:
    """The edges of a tree that hangs on ``base``: (edge, parent, child), parents first; those that the file writes as
    tree joints before others, few freedoms before many."""
    bonds = list(edges)
    links = dict.fromkeys([base, *(link for edge in bonds for link in edge.links)])
    weights = [_COST[edge.type or JointType.FIXED] + (0 if edge.in_tree else _OUTSIDE) for edge in bonds]
    return graphs.outward(base, graphs.spanning_forest(links, bonds, weights))
