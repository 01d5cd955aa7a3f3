"""Summary of a report: observed dof, singularities, poses that look the same, errors."""

from __future__ import annotations

from collections.abc import Iterator

from ...analysis.controllability import Legs
from ...analysis.derive import Derivation
from ...analysis.verdict import Verdict
from ..text.robots import format_exact_cell, format_unobserved_cell
from ..text.sentences import (
    describe_locus,
    describe_map_error,
    describe_seen,
    describe_similar_poses,
    describe_smallest_sets,
    name_set_members,
)
from .parts import Parts, RefusedPart


def answer(found: Derivation, told: Parts) -> Iterator[str]:
    """Yield a sentence for each part of the report that has a result."""
    yield describe_seen(found.verdict, found.setup.labels, found.setup)
    if not isinstance(told.legs, RefusedPart):
        best = max(each.rank for each in told.legs.sets)
        yield describe_smallest_sets(told.legs.minimal, name_set_members(found.setup), best, found.dof)
    if not isinstance(told.singularity, RefusedPart):
        yield describe_locus(told.singularity.words)
    if not isinstance(told.modes, RefusedPart) and (poses := describe_similar_poses(told.modes)) is not None:
        yield poses
    if not isinstance(told.accuracy, RefusedPart):
        yield from describe_map_error(told.accuracy)


def is_fully_observed(found: Verdict) -> bool:
    """Return True if all dof are observed; of a formation all but its trivial motions."""
    return not found.unobserved and (found.rank == found.dof if found.formation is None else not found.formation.flexes)


def set_rows(found: Legs, most: int) -> Iterator[tuple[tuple[str, ...], Verdict, str, bool]]:
    """Yield the rows of the table, ``most`` at most: sets (equal ones of full rank share a row), verdict, exact
    verdict, whether they are smallest."""
    alike: dict[object, tuple[list[str], Verdict, str, bool]] = {}
    for each, exact in zip(found.sets[:most], found.exact, strict=False):
        cell, smallest = format_exact_cell(exact, each.rank), each.legs in found.minimal
        shown = (len(each.legs), each.verdict, each.rank, each.rank_at_zero, cell, smallest)
        key = each.legs if format_unobserved_cell(each) else shown
        alike.setdefault(key, ([], each, cell, smallest))[0].append(", ".join(each.legs))
    for sets, each, cell, smallest in alike.values():
        yield tuple(sets), each, cell, smallest
