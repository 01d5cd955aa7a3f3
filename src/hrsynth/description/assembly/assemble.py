"""Assembly of a joint graph to a mechanism: the solver of loops is needed only for files that leave something open."""

from __future__ import annotations

from ...mechanism.model import Mechanism
from ..jointgraph import JointGraph
from ..overrides import Overrides
from .closed import build_closed


def assemble(graph: JointGraph, overrides: Overrides) -> Mechanism:
    """Return the mechanism of a file with its overrides. A complete graph keeps its tree, its order and its zero
    configuration, at which its loops must be closed up to rounding errors. Raises like :func:`.build.build`."""
    closed = build_closed(graph, overrides) if graph.is_complete else None
    if closed is not None:
        return closed
    from .build import build

    graph.is_complete = False
    return build(graph, overrides)
