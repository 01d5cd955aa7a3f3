"""What a user says of a file that the file does not say, or says otherwise."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import BadRequest
from ...mechanism.legs import decompose, observation_of
from ...mechanism.model import JointType, Mechanism, Motor
from ...mechanism.normal import normal_form
from ..draft import ORIGIN, Edge, End
from ..urdf import LOOP_TYPES
from .graph import Graph, listed

CLOSURES = {"3d": JointType.SPHERICAL, "6d": JointType.FIXED, **LOOP_TYPES}


@dataclass(frozen=True)
class Given:
    """Base, platform, the motors' joints, closures ``A:B[:type]``, joints to freeze, links to observe; None or empty
    where the file (or a guess) decides."""

    base: str | None = None
    platform: str | None = None
    motors: tuple[str, ...] | None = None
    close: tuple[str, ...] = ()
    freeze: tuple[str, ...] = ()
    observe: tuple[str, ...] | None = None

    @property
    def changes(self) -> bool:
        """Whether anything is given that changes what the file says."""
        return bool(self.platform or self.motors is not None or self.close or self.freeze)


def names(value: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """A list of names, also as one text set apart by commas."""
    if value is None:
        return None
    parts = value.split(",") if isinstance(value, str) else list(value)
    return tuple(name.strip() for name in parts)


def closed(graph: Graph, wishes: Sequence[str]) -> None:
    """Closures ``A:B[:type]``: the frames of links A and B meet in all that the type does not leave free (its axis is
    the z axis of A's frame); a point where no type is given."""
    for wish in wishes:
        parts = wish.split(":")
        kind = CLOSURES.get(parts[2] if len(parts) == 3 else "spherical")
        if len(parts) not in (2, 3) or kind is None or kind is JointType.UNIVERSAL:
            raise BadRequest("--close", wish, "A:B or A:B:TYPE with TYPE one of "
                             + ", ".join(name for name in CLOSURES if name != "universal"))
        for link in parts[:2]:
            if link not in graph.links:
                raise BadRequest("--close: no such link", link, listed(graph.links))
        if parts[0] == parts[1]:
            raise BadRequest("--close: a link cannot meet itself", wish, "two links")
        name = graph.fresh(f"close_{parts[0]}_{parts[1]}")
        axes = (np.array([0.0, 0.0, 1.0]),) if kind.axes else ()
        graph.edges[name] = Edge(name, kind, (End(parts[0], ORIGIN), End(parts[1], ORIGIN)), axes, in_tree=False)


def motors(edges: dict[str, Edge], wanted: Iterable[str]) -> dict[str, Edge]:
    """The same joints with motors on the named ones alone; both joints of a pair N__1, N__2 may be named as N."""
    chosen = set()
    for name in wanted:
        own = [each for each in edges if each == name or each.rpartition("__")[0] == name]
        if not own or all(edges[each].type is JointType.FIXED for each in own):
            raise BadRequest("--motors: no such joint that moves", name, listed(edges))
        chosen.update(own)
    return {name: replace(edge, motor=(edge.motor or Motor(f"motor_{name}")) if name in chosen else None)
            for name, edge in edges.items()}


def frozen(edges: dict[str, Edge], wanted: Iterable[str]) -> dict[str, Edge]:
    """The same joints, the named ones held at zero."""
    for name in wanted:
        if name not in edges:
            raise BadRequest("--freeze: no such joint", name, listed(edges))
    held = set(wanted)
    return {name: replace(edge, type=JointType.FIXED, axes=(), motor=None, limits=None) if name in held else edge
            for name, edge in edges.items()}


def observing(mechanism: Mechanism, links: Iterable[str]) -> Mechanism:
    """The mechanism with the default segments of the named links as its observed directions."""
    normal = normal_form(mechanism)
    anatomy = decompose(normal.mechanism)
    found = []
    for link in links:
        if normal.into.get(link) not in normal.mechanism.links:
            raise BadRequest(f"{mechanism.name}: no link of a leg to observe", link, listed(normal.mechanism.links))
        seen = observation_of(anatomy, normal.into[link])
        turn = mechanism.links[link].pose[:3, :3].T @ normal.mechanism.links[seen.link].pose[:3, :3]
        found.append(replace(seen, link=link, direction=turn @ seen.direction))
    return replace(mechanism, observations=tuple(found))
