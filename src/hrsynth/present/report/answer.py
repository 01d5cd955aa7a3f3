"""Summary of a report: observed dof, singularities, poses that look the same, errors."""

from __future__ import annotations

from collections.abc import Iterator

from ...analysis.controllability import Legs
from ...analysis.derive import Derivation
from ...analysis.verdict import Verdict
from ..text.robots import exact_cell, unseen
from ..text.sentences import alike, describe_seen, fewest, things, usual_error, where_lost
from .parts import Parts, Refused


def answer(found: Derivation, told: Parts) -> Iterator[str]:
    """Yield a sentence for each part of the report that has a result."""
    yield describe_seen(found.verdict, found.setup.labels, found.setup)
    if not isinstance(told.legs, Refused):
        best = max(each.rank for each in told.legs.sets)
        yield fewest(told.legs.minimal, things(found.setup), best, found.dof)
    if not isinstance(told.singularity, Refused):
        yield where_lost(told.singularity.words)
    if not isinstance(told.modes, Refused) and (poses := alike(told.modes)) is not None:
        yield poses
    if not isinstance(told.accuracy, Refused):
        yield from usual_error(told.accuracy)


def good(found: Verdict) -> bool:
    """Return True if all dof are observed; of a formation all but its trivial motions."""
    return not found.unobserved and (found.rank == found.dof if found.formation is None else not found.formation.flexes)


def set_rows(found: Legs, most: int) -> Iterator[tuple[tuple[str, ...], Verdict, str, bool]]:
    """Yield the rows of the table, ``most`` at most: sets (equal ones of full rank share a row), verdict, exact
    verdict, whether they are smallest."""
    alike: dict[object, tuple[list[str], Verdict, str, bool]] = {}
    for each, exact in zip(found.sets[:most], found.exact, strict=False):
        cell, smallest = exact_cell(exact, each.rank), each.legs in found.minimal
        shown = (len(each.legs), each.verdict, each.rank, each.rank_at_zero, cell, smallest)
        key = each.legs if unseen(each) else shown
        alike.setdefault(key, ([], each, cell, smallest))[0].append(", ".join(each.legs))
    for sets, each, cell, smallest in alike.values():
        yield tuple(sets), each, cell, smallest
