"""Redundant constraints of the loops: which loop, and how many of its rows say nothing new."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..geometry.ranks import Rank, rank_of
from ..kinematics.configuration import ClosedConfiguration
from ..tolerances import RANK_GAP


@dataclass(frozen=True)
class Redundancy:
    """``rows`` constraints of the loop that is closed at joint ``loop`` repeat what earlier loops say already; at all
    configurations where ``generic``."""

    loop: str
    rows: int
    generic: bool

    def to_dict(self) -> dict[str, object]:
        """The record of the command line."""
        return {"loop": self.loop, "rows": self.rows, "generic": self.generic}


Rows = tuple[tuple[str, int], ...]
"""Each loop's name with its number of redundant rows, in the order of the twin's loops."""


def redundant_rows(at: ClosedConfiguration) -> Rows:
    """Redundant rows of each loop, counted greedily in the order of ``PinocchioModel.loops``: all rows of a loop but
    those by which it raises the rank of the loops before it. Empty where a rank is not decided."""
    J = at.twin.jacobian(at.q)
    names, sizes = at.twin.blocks
    scale = float(np.linalg.norm(J, 2)) if J.size else 1.0
    ranks = [Rank(0, np.inf)]
    ranks += [rank_of(np.asarray(np.linalg.svd(J[:end], compute_uv=False)), scale) for end in np.cumsum(sizes)]
    if min(rank.gap for rank in ranks) < RANK_GAP:
        return ()
    return tuple((name, size - (after.value - before.value))
                 for name, size, (before, after) in zip(names, sizes, pairwise(ranks), strict=True))


def usual_rows(configurations: Iterable[ClosedConfiguration]) -> Rows:
    """The redundant rows of each loop at most of the configurations."""
    found = Counter(rows for at in configurations if (rows := redundant_rows(at)))
    return max(found, key=lambda rows: found[rows], default=())


def surplus(here: Rows, usual: Rows) -> Rows:
    """The rows that are redundant here and not in general: as many as the loops lose rank, each with the loop from
    which on the loss stays."""
    more = np.cumsum([count - often for (_, count), (_, often) in zip(here, usual, strict=False)])
    lasting = np.maximum(np.minimum.accumulate(more[::-1])[::-1], 0)
    return tuple((name, int(count)) for (name, _), count in zip(here, np.diff(lasting, prepend=0), strict=False))


def listed(rows: Rows, *, generic: bool) -> tuple[Redundancy, ...]:
    """The loops with redundant rows."""
    return tuple(Redundancy(name, count, generic) for name, count in rows if count > 0)
