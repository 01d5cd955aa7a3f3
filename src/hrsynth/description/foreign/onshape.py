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

_FRAME = re.compile(r"closing_(?P<name>.+)_1")


def read(reader: Reader, graph: Graph) -> None:
    """Add a closure for each pair of closing frames."""
    for link in list(graph.links):
        match = _FRAME.fullmatch(link)
        if match is None or f"closing_{match['name']}_2" not in graph.links:
            continue
        ends = End(link, ORIGIN), End(f"closing_{match['name']}_2", ORIGIN)
        hinge = f"{link}_z" in graph.links and f"closing_{match['name']}_2_z" in graph.links
        kind = JointType.REVOLUTE if hinge else JointType.SPHERICAL
        name = graph.fresh(match["name"])
        graph.edges[name] = Edge(name, kind, ends, (np.array([0.0, 0.0, 1.0]),) * kind.axes, in_tree=False)
        graph.closing.update({link, f"closing_{match['name']}_2", f"{link}_z", f"closing_{match['name']}_2_z"})
