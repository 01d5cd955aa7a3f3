"""Root bound of quadrics with integer coefficients: ranks of their multiples modulo a prime (docs/pages/proofs.md,
section 8).

Linear combinations without a quadratic part give unknowns by others, exactly. B are the monomials whose degree in each
of some groups of unknowns is below a cap, S those at a cap; rows are all multiples of the quadrics within the caps. If
the columns S have full rank, each polynomial is one in the span of B modulo the quadrics: at most |B| + |S| - rank
zeros, multiple ones counted so often, and no curve of zeros. A rank modulo a prime is at most that over ℚ.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from .polynomials import Quadric

CAP_OF_MULTIPLES, LARGEST_MULTIPLES = 4, 250
"""Largest degree in a group of unknowns, and number of monomials, of a bound by multiples of quadrics."""

PRIME = (1 << 62) - 87
Form = dict[tuple[int, ...], Any]
"""Coefficients, fractions or residues, by exponents."""


def bound_zeros(quadrics: Sequence[Quadric], enough: int) -> int | None:
    """The least bound that is found, the first that is ``enough``; None where none is."""
    forms, n = [_read_form(quadric) for quadric in quadrics], len(quadrics[0].A) - 1
    left = list(range(n))
    while (line := _find_line(forms := _reduce_forms(forms))) is not None:
        k = max((k for k in left if _get_slope(line, k)), key=lambda k: abs(_get_slope(line, k)), default=None)
        if k is None:
            return 0
        forms = [_eliminate(form, line, k) for form in forms if form is not line]
        left.remove(k)
    if len(forms) < len(left):
        return None
    flat = [
        {tuple(e[k] for k in left): int(c * math.lcm(*(d.denominator for d in form.values()))) for e, c in form.items()}
        for form in forms
    ]
    best: int | None = None
    for groups in list_partitions(list(range(len(left)))):
        best = min((b for b in (best, _find_least_bound(flat, groups, enough)) if b is not None), default=None)
        if best is not None and best <= enough:
            break
    return best if left else 1


def combine_quadrics(quadrics: Sequence[Quadric]) -> list[Quadric]:
    """Return the same span of quadrics, as many as can be without their quadratic parts."""
    n, combined = len(quadrics[0].A) - 1, []
    for form in _reduce_forms([_read_form(quadric) for quadric in quadrics]):
        A, common = np.zeros((n + 1, n + 1), dtype=object), math.lcm(*(c.denominator for c in form.values()))
        for e, c in form.items():
            i, j = sorted([0, 0, *(k + 1 for k in range(n) for _ in range(e[k]))])[-2:]
            A[i, j] = int(c * common)
        combined.append(Quadric(A))
    return combined


def _read_form(quadric: Quadric) -> Form:
    n, form = len(quadric.A) - 1, Form()
    for i in range(n + 1):
        for j in range(n + 1):
            if quadric.A[i, j]:
                e = tuple(int(k + 1 == i) + int(k + 1 == j) for k in range(n))
                form[e] = form.get(e, Fraction(0)) + Fraction(int(quadric.A[i, j]))
    return {e: c for e, c in form.items() if c}


def _get_slope(line: Form, k: int) -> Any:
    """The coefficient of an unknown."""
    return next((c for e, c in line.items() if e[k] and sum(e) == 1), 0)


def _reduce_forms(forms: Sequence[Form]) -> list[Form]:
    """Return the same span, quadratic monomials eliminated first."""
    rows, reduced = [dict(form) for form in forms], list[Form]()
    columns = sorted({e for form in forms for e in form}, key=lambda e: (-sum(e), [-k for k in e]))
    for e in columns:
        pivot = next((row for row in rows if row.get(e)), None)
        if pivot is None:
            continue
        rows = [_subtract(row, pivot, row.get(e, 0) / pivot[e]) for row in rows if row is not pivot]
        reduced.append(pivot)
    return reduced


def _subtract(row: Form, second: Form, factor: Any) -> Form:
    total = {e: row.get(e, 0) - factor * second.get(e, 0) for e in row.keys() | second.keys()}
    return {e: c for e, c in total.items() if c}


def _find_line(forms: Sequence[Form]) -> Form | None:
    """One of degree one at most, that with the last unknowns."""
    return next((form for form in reversed(forms) if all(sum(e) <= 1 for e in form)), None)


def _eliminate(form: Form, line: Form, k: int) -> Form:
    """With x_k as the line gives it."""
    given = {e: -c / _get_slope(line, k) for e, c in line.items() if not e[k]}
    total = Form()
    for e, c in form.items():
        terms = {(*e[:k], 0, *e[k + 1 :]): c}
        for _ in range(e[k]):
            terms = _expand_product(terms, given)
        total = _subtract(total, terms, -1)
    return total


def _expand_product(first: Form, second: Form) -> Form:
    total = Form()
    for e, c in first.items():
        total = _subtract(total, {tuple(map(sum, zip(e, f, strict=True))): c * d for f, d in second.items()}, -1)
    return total


def list_partitions(left: list[int]) -> Iterator[list[list[int]]]:
    """All ways to group unknowns."""
    if not left:
        yield []
        return
    for rest in list_partitions(left[1:]):
        yield [[left[0]], *rest]
        for k in range(len(rest)):
            yield [*rest[:k], [left[0], *rest[k]], *rest[k + 1 :]]


def _find_least_bound(forms: Sequence[Form], groups: Sequence[Sequence[int]], enough: int) -> int | None:
    """The least bound with some groups."""
    from flint import nmod_mat

    least = None
    for caps in sorted(product(range(2, CAP_OF_MULTIPLES + 1), repeat=len(groups)), key=sum):
        if (
            math.prod(math.comb(len(group) + cap, cap) for group, cap in zip(groups, caps, strict=True))
            > LARGEST_MULTIPLES
        ):
            continue
        below = {
            e: min(cap - sum(e[k] for k in group) for group, cap in zip(groups, caps, strict=True))
            for e in product(range(max(caps) + 1), repeat=sum(map(len, groups)))
        }
        columns = sorted((e for e in below if below[e] >= 0), key=lambda e: below[e] > 0)
        edge = sum(below[e] == 0 for e in columns)
        moved = [
            {tuple(map(sum, zip(e, by, strict=True))): c % PRIME for e, c in form.items()}
            for form in forms
            for by in columns
        ]
        rows = [[row.get(e, 0) for e in columns] for row in moved if all(below.get(e, -1) >= 0 for e in row)]
        if not rows or nmod_mat([row[:edge] for row in rows], PRIME).rank() < edge:
            continue
        bound = len(columns) - int(nmod_mat(rows, PRIME).rank())
        if least is None or bound < least:
            least = bound
        if bound <= enough:
            break
    return least
