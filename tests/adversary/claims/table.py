"""The checks, each with the share of robots on which it is made."""

from __future__ import annotations

from collections.abc import Callable

from adversary.case import Case
from adversary.claims import enclosures, endings, errors, lists, loci, poses, rewritten, verdicts, ways

CLAIMS: dict[str, tuple[Callable[[Case], None], float]] = {
    "verdicts": (verdicts.verdicts, 0.7),
    "hidden modes": (lists.hidden, 0.45),
    "real modes": (lists.real, 0.35),
    "cures": (verdicts.cures, 0.25),
    "errors": (errors.errors, 0.2),
    "poses": (poses.poses, 0.2),
    "enclosures": (enclosures.enclosures, 0.2),
    "hidden robot": (rewritten.rewritten, 0.1),
    "paths": (ways.ways, 0.06),
    "singularities": (loci.loci, 0.015),
    "equilibria": (endings.endings, 0.03),
}
