"""onshape-to-robot: frames ``closing_X_1`` and ``closing_X_2`` meet; with ``closing_X_1_z``, ``closing_X_2_z`` as well,
in a hinge."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from ...mechanism.model import JointType
from ..draft import ORIGIN, Edge, End
from .graph import Graph

if TYPE_CHECKING:
    from .urdf import Reader

_FRAME = re.compile(r"closing_(?P<name>.+)_(?P<number>[12])")


def read(reader: Reader, graph: Graph) -> None:
    """Add a closure for each pair of closing frames; a frame without its partner is a defect."""
    for link in list(graph.links):
        match = _FRAME.fullmatch(link)
        if match is None:
            continue
        partner = f"closing_{match['name']}_{3 - int(match['number'])}"
        if partner not in graph.links:
            reader.defect(graph.links[link].line, f"closing frame {link!r} without its partner", None,
                          f"a link {partner!r} as well")
            continue
        if match["number"] == "2":
            continue
        ends = End(link, ORIGIN), End(partner, ORIGIN)
        hinge = f"{link}_z" in graph.links and f"{partner}_z" in graph.links
        kind = JointType.REVOLUTE if hinge else JointType.SPHERICAL
        name = graph.fresh(match["name"])
        graph.edges[name] = Edge(name, kind, ends, (np.array([0.0, 0.0, 1.0]),) * kind.axes, in_tree=False)
        graph.closing.update({link, partner, f"{link}_z", f"{partner}_z"})
