"""That the error slopes where legs are at their limits. Its gradient grows without bounds there:
g = a + Σ κ_i n_i / s_i, s_i of a known sign and as small as one likes, n_i the normal of a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...geometry.affine import AffineForms, combined
from ...geometry.vectors import Array
from ...tolerances import AFFINE_ROUNDING

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SteepPart:
    """A leg's part of g that grows beyond all bounds at its limit, ``share`` ``normal`` / ``along``; ``sign`` is that
    of ``along`` where the leg reaches, which the middle of a form does not tell: it may be out of reach."""

    normal: AffineForms
    share: AffineForms
    along: AffineForms
    sign: float

    @property
    def regular(self) -> AffineForms:
        """Away from the limit."""
        return self.normal * (self.share * self.along.inverse())[..., None]

    @property
    def top(self) -> Array:
        """An upper bound of |along|."""
        return self.along.size

    def some(self, which: Flags) -> SteepPart:
        """That of some boxes."""
        return SteepPart(some(self.normal, which), some(self.share, which), some(self.along, which), self.sign)


def some(forms: AffineForms, which: Flags) -> AffineForms:
    """Forms of some boxes."""
    return AffineForms(forms.v[:, which], forms.r[which])


def sloping(a: AffineForms, parts: Sequence[SteepPart], at_limit: Flags) -> Flags:
    """Whether E slopes in boxes that hold limits of legs: either v · g > 0 for v that all legs at their limits pull
    the same way, or g is not along the normal of one of them: two components of g × normal, in which that leg's part
    cancels, do not, or are outweighed by the part of one other."""
    count, n = a.r.shape
    rest = a
    with np.errstate(all="ignore"):
        for i, part in enumerate(parts):
            whole = part.regular
            free = ~at_limit[:, i, None]
            rest = rest + AffineForms(np.where(free, whole.v, 0.0), np.where(free, whole.r, 0.0))
        towards, total = np.zeros((count, n)), np.where(np.isfinite(rest.v[0]), rest.v[0], 0.0)
        for i, part in enumerate(parts):
            pull = part.normal.v[0] * (part.share.v[0] * part.sign)[:, None]
            size = np.linalg.norm(pull, axis=1)[:, None]
            towards += np.where(at_limit[:, i, None], pull / np.where(size > 0, size, 1.0), 0.0)
            total += np.where(at_limit[:, i, None], 2 * pull / part.top[:, None], 0.0)
        settled = np.zeros(count, dtype=bool)
        for v in (total, towards):
            size = np.linalg.norm(v, axis=1)
            v = (v / np.where(size > 0, size, 1.0)[:, None])[:, None, :]
            least, good = combined(v, rest).low[:, 0], np.ones(count, dtype=bool)
            for i, part in enumerate(parts):
                pull = (combined(v * part.sign, part.normal) * part.share[..., None]).low[:, 0]
                good &= ~at_limit[:, i] | (pull > 0)
                least = least + np.where(at_limit[:, i], pull / part.top, 0.0)
            settled |= good & (least > 0)
        for i, part in enumerate(parts):
            others = at_limit.sum(axis=1) - at_limit[:, i]
            for j, k in combinations(range(n), 2):
                base = _minor(rest, part.normal, j, k)
                pull, top = np.zeros(count), np.ones(count)
                for m, other in enumerate(parts):
                    if m != i:
                        cross_ = _minor(other.normal, part.normal, j, k) * other.share
                        least = np.maximum(np.abs(cross_.v[0]) - cross_.spread, 0.0)
                        pull, top = np.where(at_limit[:, m], least, pull), np.where(at_limit[:, m], other.top, top)
                alone = (np.abs(base.v[0]) > base.spread * (1 + AFFINE_ROUNDING)) & (others == 0)
                settled |= at_limit[:, i] & (alone | ((others == 1) & (pull > base.size * top)))
    return settled


def _minor(a: AffineForms, b: AffineForms, j: int, k: int) -> AffineForms:
    """a_j b_k − a_k b_j."""
    return a[..., j] * b[..., k] - a[..., k] * b[..., j]
