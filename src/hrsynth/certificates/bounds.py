"""Root bound of a certificate: multiples of the equations whose ranks prove as many solutions as are enclosed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

from .refining import Polynomial
from .verify_certificate import PRIME, CertificateRejection, multiples, poses, rank

MONOMIAL_CAP_MAX = 6
"""Largest cap of the monomials of a rank bound."""
COLUMNS, UNKNOWNS = 220, 4
"""The largest number of monomials, and of unknowns."""
BOUND_TRIES_WITHOUT_GAIN_MAX = 3
"""After so many bounds that are no better the search for one ends."""
MULTIPLES_ABOVE_CAP_MAX = 2
"""By how much multiples go beyond the caps at most, where zeros lie at infinity."""


def bound(record: dict[str, Any], equations: Sequence[Polynomial], halves: Sequence[bool]) -> dict[str, Any]:
    """The first bound of the checker that is the number of boxes; raises ``CertificateRejection``."""
    count, least = len(record["boxes"]), math.inf
    if record["kind"] == "pose":
        if poses(equations, halves, record) == count:
            return {"kind": "poses"}
        raise CertificateRejection(f"{count} solutions are enclosed, but the checker cannot exclude more")
    for most in (0, MULTIPLES_ABOVE_CAP_MAX) if len(halves) <= UNKNOWNS else ():
        best, worse = math.inf, 0
        for groups in _groups(halves, most):
            found = _most(equations, halves, groups)
            if found == count:
                return {"kind": "rank", "groups": groups, **_far(equations, halves, groups)}
            if found < math.inf:
                worse = 0 if found < best else worse + 1
                best = min(best, found)
            if worse == BOUND_TRIES_WITHOUT_GAIN_MAX:
                break
        least = min(least, best)
    raise CertificateRejection(
        f"{count} solutions are enclosed, but "
        + (f"there may be {least}" if least < math.inf else "no bound of their number is known")
    )


def _groups(halves: Sequence[bool], most: int) -> Iterator[list[list[Any]]]:
    """The groups of unknowns with their caps, and by how much multiples go beyond these: small ones first; not at all
    where ``most`` is zero."""
    n = len(halves)
    groups = [*filter(None, [[k for k in range(n) if not halves[k]], *([k] for k in range(n) if halves[k])])]
    choices = [(cap, more) for cap in range(1, MONOMIAL_CAP_MAX + 1) for more in range(most + 1)]
    for chosen in sorted(product(choices, repeat=len(groups)), key=lambda each: (sum(map(sum, each)), each)):
        size = math.prod(
            math.comb(len(group) + cap + more, len(group)) for group, (cap, more) in zip(groups, chosen, strict=True)
        )
        above = sum(more for _, more in chosen)
        if (
            size <= COLUMNS
            and (above > 0) == (most > 0)
            and not any(more and halves[group[0]] for group, (_, more) in zip(groups, chosen, strict=True))
        ):
            yield [[group, cap, more] for group, (cap, more) in zip(groups, chosen, strict=True)]


def _most(equations: Sequence[Polynomial], halves: Sequence[bool], groups: list[list[Any]]) -> float:
    """Return the bound with all zeros at infinity modulo the prime; infinite if there is none."""
    rows, above, edge, every = multiples(equations, halves, groups)
    if not rows:
        return math.inf
    high, sharp, whole = (_rank(rows, width) for width in (above, edge, every))
    return every - whole - (above - high) if sharp - high == edge - above else math.inf


def _far(equations: Sequence[Polynomial], halves: Sequence[bool], groups: list[list[Any]]) -> dict[str, Any]:
    """Short vectors above the caps that span all those that the rows annul, and what the checker makes of them."""
    from flint import fmpz_mat

    rows, above, *_ = multiples(equations, halves, groups)
    if not above:
        return {}
    kernel, size = fmpz_mat([row[:above] for row in rows]).nullspace()
    vectors = [[int(kernel[i, k]) for i in range(above)] for k in range(size)]
    vectors = [[c // math.gcd(*v) for c in v] for v in vectors]
    short = fmpz_mat(vectors).lll() if size else fmpz_mat(0, above)
    far = {"far": [[hex(int(c)) for c in row] for row in short.table()]}
    rank(equations, halves, {"bound": {"groups": groups, **far}}, ranks)
    return far


def ranks(rows: Sequence[Sequence[int]], first: int) -> tuple[int, int]:
    """As the checker computes them, fast."""
    columns = len(rows[0]) if rows else 0
    return _rank(rows, min(first, columns)), _rank(rows, columns)


def _rank(rows: Sequence[Sequence[int]], width: int) -> int:
    from flint import nmod_mat

    if not width:
        return 0
    return int(nmod_mat(len(rows), width, [c % PRIME for row in rows for c in row[:width]], PRIME).rank())
