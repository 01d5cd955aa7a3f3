"""Boxes of platform poses that are cut until each is settled: it holds no critical point of the error, or exactly one.

A box is settled where a leg does not reach it, where E's gradient g is enclosed away from zero, or where Krawczyk's
operator proves that a box about it holds exactly one zero of g; where poses are asked for at which the error vanishes,
also where an observed direction is enclosed away from the desired one's line. Near a leg's limit see :mod:`.steep`; the
limit itself, where E is smooth in s_i instead, is no critical point then. Other boxes are cut, down to a size at which
they are left open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...batch.enclosures import BoxFormula, traced
from ...budgets import BOXES_AT_ONCE
from ...closed_forms.legs import OnRod
from ...geometry.affine import AffineForms, affine, combined, stacked
from ...geometry.components import dot, minus
from ...geometry.duals import Dual
from ...geometry.vectors import Array
from ...results import Value
from ...tolerances import AFFINE_ROUNDING, FOLLOWED, SHORTEST_ROD, SMALLEST_BOX
from .cones import cut
from .pose_error import Number, PoseError
from .steep import Flags, SteepPart, sloping, some

WIDER = 1.25
"""By how much the box is larger in which exactly one zero is to be proved."""
NEAR_LIMIT = 0.5
"""Ratio of the least to the largest reach margin in a box below which a leg's part of g is bounded by its sign."""
STRETCHED = 8.0
"""Ratio of a box's edges, as parts of those of the whole, above which the longest is cut."""
PAIRS_AT_ONCE = 4_000_000
"""Pairs of boxes that are compared at once."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalBox(Value):
    """A pose ``p`` (m), ``R`` about which exactly one critical point is proved, where no leg is at its limit: in
    coordinates it lies within ``radius`` of ``x`` and is the only one in ``half``; ``error`` encloses ‖e‖; ``falling``
    is the number of directions in which E falls (None where that is not decided), ``modes`` are the legs' working
    modes; ``directions`` those observed (legs, 3). ``chart``: what tells apart the coordinates in which it was
    found."""

    p: Array
    R: Array
    x: Array
    half: Array
    radius: float
    error: tuple[float, float]
    falling: int | None
    modes: tuple[float, ...]
    directions: Array
    chart: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class PoseBoxes:
    """Boxes of the pose's coordinates: middles and half edges (c, n)."""

    middle: Array
    half: Array

    def meet(self, other: PoseBoxes) -> Flags:
        """Which of these boxes (c,) meet one of the others."""
        found = np.zeros(len(self.middle), dtype=bool)
        step = max(1, PAIRS_AT_ONCE // max(1, other.middle.size))
        for i in range(0, len(found), step):
            part = slice(i, i + step)
            apart = np.abs(self.middle[part, None] - other.middle) - self.half[part, None] - other.half
            found[part] = np.any(np.all(~(apart > 0), axis=-1), axis=-1)
        return found

    def some(self, which: Any) -> PoseBoxes:
        """Some of them."""
        return PoseBoxes(self.middle[which], self.half[which])


@dataclass(eq=False)
class Subdivision:
    """Boxes of coordinates in one chart and one working mode that are cut until they are settled; ``within``: boxes of
    poses besides which nothing is asked for."""

    error: PoseError
    low: Array
    high: Array
    gradient: BoxFormula
    hessian: BoxFormula
    errors: BoxFormula | None
    steep: tuple[int, ...]
    """The limbs at whose limits the gradient grows beyond all bounds."""
    signs: tuple[float, ...] = ()
    """Those of what it is divided by there."""
    within: PoseBoxes | None = None
    boxes: int = 0
    left: list[tuple[Array, Array]] = field(default_factory=list)
    proved: list[tuple[Array, Array]] = field(default_factory=list)

    @classmethod
    def of(cls, error: PoseError, low: Array, high: Array, vanishing: bool = False, within: PoseBoxes | None = None
           ) -> Subdivision:
        """The formulas, traced: reach margins, g without what is steep, that and what it is divided by for each limb,
        the pose's shifts where these are no coordinates; then the Hessian."""
        n, held = error.size, error.held
        steep = tuple(each.limb for each in error.seen if each.limb is not None
                      and isinstance(error.limbs[each.limb], OnRod) and not (held and held.limb == each.limb))

        def gradient(x: Sequence[Any], number: Number) -> list[Any]:
            found = error.at(x, list(np.eye(n)), number)
            plain: list[Any] = [0.0] * n
            parts: list[Any] = []
            for seen, turning in zip(error.seen, found.seen, strict=True):
                slopes, rest = turning.slopes
                plain = [a + b for a, b in zip(plain, slopes, strict=True)]
                if seen.limb in steep:
                    parts += [*turning.normal, rest, turning.along]
                else:
                    plain = [a + rest * b for a, b in zip(plain, turning.normal, strict=True)]
            if held is not None:
                away = minus(error.pose(x, number)[0], number(error.p))
                parts += [dot(number(axis), away) for axis in error.shifts.T]
            return [*found.margins, *plain, *parts]

        def hessian(x: Sequence[Any], number: Number) -> list[Any]:
            def constant(value: Any) -> Any:
                return [constant(each) for each in value] if np.ndim(value) else Dual(number(value), [0.0] * n)

            y = [Dual(each, list(axis)) for each, axis in zip(x, np.eye(n).tolist(), strict=True)]
            rows = [[Dual(value, [0.0] * n) for value in axis] for axis in np.eye(n).tolist()]
            return [rate for slope in error.at(y, rows, constant).slopes for rate in slope.rates]

        def errors(x: Sequence[Any], number: Number) -> list[Any]:
            return [e for each in error.at(x, [], number).seen for e in each.error]

        signs = tuple(-error.limbs[each.limb].mode * each.sense for each in error.seen if each.limb in steep)
        return cls(error, low, high, traced(gradient, n), traced(hessian, n), traced(errors, n) if vanishing else None,
                   steep, signs, within)

    @property
    def whole(self) -> Array:
        """Half the edges of the whole box."""
        return (self.high - self.low) / 2

    def run(self, budget: int) -> None:
        """Cut boxes until all are settled, too small, or so many were looked at."""
        middle, half = ((self.low + self.high) / 2)[None], self.whole[None]
        while len(middle) and self.boxes < budget:
            # the smallest first: memory stays small
            now, later = slice(len(middle) - BOXES_AT_ONCE if len(middle) > BOXES_AT_ONCE else 0, None), slice(
                0, max(0, len(middle) - BOXES_AT_ONCE))
            part, size = middle[now], half[now]
            self.boxes += len(part)
            weights = size / self.whole
            if self.errors is not None:
                kept = self._vanishing(part, size)
                part, size, weights = part[kept], size[kept], weights[kept]
            if len(part):
                open_, weights = self._open(part, size)
                part, size, weights = part[open_], size[open_], weights[open_]
            small = np.all(size <= SMALLEST_BOX * self.whole, axis=1)
            self.left += list(zip(part[small], size[small], strict=True))
            part, size, weights = part[~small], size[~small], weights[~small]
            share = size / self.whole
            axis = np.argmax(np.where((share.max(axis=1) > STRETCHED * share.min(axis=1))[:, None], share, weights),
                             axis=1)
            part, size = cut(part, size, axis)
            middle, half = np.concatenate([middle[later], part]), np.concatenate([half[later], size])
        self.left += list(zip(middle, half, strict=True))

    def forms(self, middle: Array, half: Array) -> list[AffineForms]:
        """The coordinates of boxes (c, n)."""
        eye = np.eye(middle.shape[1])
        return [affine(middle[:, i], half[:, i, None] * eye[i], np.zeros(len(middle))) for i in range(len(eye))]

    def _vanishing(self, middle: Array, half: Array) -> Flags:
        """In which boxes (c,) every observed direction may be along the desired one."""
        assert self.errors is not None
        e = stacked(self.errors.at(self.forms(middle, half)))
        with np.errstate(all="ignore"):
            away = np.any(np.abs(e.v[0]) > e.spread * (1 + AFFINE_ROUNDING), axis=1)
            near = combined(_inverse(np.moveaxis(e.v[1:], 0, -1)), e)
            away |= np.any(np.abs(near.v[0]) > near.spread * (1 + AFFINE_ROUNDING), axis=1)
        return np.asarray(~away)

    def poses(self, found: Sequence[AffineForms], middle: Array, half: Array) -> PoseBoxes:
        """The poses of boxes, of what the gradient's formula gives for them."""
        k = self.error.shifts.shape[1]
        if self.error.held is None:
            return PoseBoxes(middle, half)
        shifts = stacked(found[len(found) - k:])
        wide = shifts.spread + AFFINE_ROUNDING * np.abs(shifts.v[0])
        return PoseBoxes(np.concatenate([shifts.v[0], middle[:, k:]], axis=1),
                         np.concatenate([wide, half[:, k:]], axis=1))

    def left_poses(self) -> PoseBoxes:
        """The poses of the boxes that are left open."""
        middle, half = (np.array(each).reshape(-1, self.error.size) for each in
                        (zip(*self.left, strict=True) if self.left else ([], [])))
        if not len(middle):
            return PoseBoxes(middle, half)
        return self.poses(self.gradient.at(self.forms(middle, half)), middle, half)

    def _open(self, middle: Array, half: Array) -> tuple[Flags, Array]:
        """Which boxes (c,) are not settled, and how much g changes across each axis (c, n)."""
        n, k = middle.shape[1], len(self.error.limbs)
        found = self.gradient.at(self.forms(middle, half))
        margins, plain, parts = found[:k], found[k : k + n], found[k + n :]
        beyond, inside = np.zeros(len(middle), dtype=bool), np.ones(len(middle), dtype=bool)
        at_limit, close = np.zeros((2, len(middle), len(self.steep)), dtype=bool)
        for i, margin in enumerate(margins):
            limb = self.error.limbs[i]
            least = 0.0 if isinstance(limb, OnRod) else SHORTEST_ROD**2
            beyond |= margin.high < least
            if i in self.steep:
                at_limit[:, self.steep.index(i)] = ~(margin.low > 0)
                close[:, self.steep.index(i)] = ~(margin.low > NEAR_LIMIT * margin.high)
            elif not isinstance(limb, OnRod):
                inside &= margin.low > 0
        if self.within is not None:
            asked = np.flatnonzero(~beyond)
            beyond[asked] = ~self.poses(found, middle, half).some(asked).meet(self.within)
        a, b = stacked(plain), []
        for i in range(len(self.steep)):
            *normal, share, along = parts[i * (n + 2) : (i + 1) * (n + 2)]
            b.append(SteepPart(stacked(normal), share, along, self.signs[i]))
        regular = inside & ~at_limit.any(axis=1)
        g = a
        with np.errstate(all="ignore"):
            for each in b:
                g = g + each.regular
        settled = beyond | (regular & _away(g))
        near = ~settled & inside & close.any(axis=1)
        if near.any():
            settled[near] = sloping(some(a, near), [each.some(near) for each in b], close[near])
        rest = ~settled & regular
        if rest.any():
            # a zero may be where Newton's step from the middle ends
            S = np.moveaxis(g.v[1:, rest], 0, -1)
            step = _solved(S, g.v[0, rest])
            likely = np.flatnonzero(rest)[np.all(np.abs(step) < 3.0, axis=1)]
            if len(likely):
                settled[likely] = self._unique(middle[likely], half[likely])
        weights = np.abs(np.nan_to_num(g.v[1:], nan=0.0, posinf=0.0)).max(axis=-1).T
        weights = np.where(weights.any(axis=1)[:, None] & regular[:, None], weights, half / self.whole)
        return ~settled, weights

    def _unique(self, middle: Array, half: Array) -> Flags:
        """Boxes (c,) in which, made ``WIDER``, Krawczyk's operator proves exactly one zero, or that there is none."""
        n, wide = middle.shape[1], WIDER * half
        g = stacked(self._slopes(self.forms(middle, 0 * half)))
        H = stacked(self.hessian.at(self.forms(middle, wide)))
        H = AffineForms(H.v.reshape(*H.v.shape[:-1], n, n), H.r.reshape(-1, n, n))
        Y = _inverse(H.v[0])
        with np.errstate(all="ignore"):
            shift = combined(Y, g)
            M = (np.eye(n) - combined(Y, H)).size
            off = (M @ wide[..., None])[..., 0] * (1 + AFFINE_ROUNDING)
            reach = shift.size + off
            one = np.all(reach < wide, axis=1)
            none = np.any((np.abs(shift.v[0]) - shift.spread - off) > half, axis=1)
        for i in np.flatnonzero(one):
            self.proved.append((middle[i], wide[i]))
        return one | none

    def _slopes(self, forms: list[AffineForms]) -> list[AffineForms]:
        """g where no leg is at its limit."""
        n, k = len(forms), len(self.error.limbs)
        found = self.gradient.at(forms)
        g = found[k : k + n]
        for i in range(len(self.steep)):
            *normal, share, along = found[k + n + i * (n + 2) : k + n + (i + 1) * (n + 2)]
            factor = share * along.inverse()
            g = [one + other * factor for one, other in zip(g, normal, strict=True)]
        return g

    def zeros(self) -> list[CriticalBox]:
        """The zeros that were proved, enclosed by Newton's method from the middle."""
        found = (self._enclosed(middle, wide) for middle, wide in self.proved)
        return [each for each in found if each is not None]

    def _enclosed(self, middle: Array, wide: Array) -> CriticalBox | None:
        """The one zero within ``wide`` of a place; None where it lies out of the legs' reach."""
        n = len(middle)
        x, still = middle[None], np.zeros((1, n))
        for _ in range(8):
            g = stacked(self._slopes(self.forms(x, still))).v[0]
            bent = np.array([each.v[0] for each in self.hessian.at(self.forms(x, still))]).T.reshape(1, n, n)
            x = x - _solved(bent, g)
            x = np.clip(x, middle - wide, middle + wide)
        radius = FOLLOWED ** 0.75
        while True:
            half = np.full((1, n), radius)
            g = stacked(self._slopes(self.forms(x, still)))
            H = stacked(self.hessian.at(self.forms(x, half)))
            H = AffineForms(H.v.reshape(*H.v.shape[:-1], n, n), H.r.reshape(-1, n, n))
            Y = _inverse(H.v[0])
            reach = combined(Y, g).size + ((np.eye(n) - combined(Y, H)).size @ half[..., None])[..., 0]
            if np.all(reach < half):
                break
            radius *= 4
            if radius > np.min(wide):
                radius = float(np.max(wide))
                break
        values = np.linalg.eigvalsh((H.v[0, 0] + H.v[0, 0].T) / 2)
        off = float(np.linalg.norm(H.spread[0]))
        falling = int(np.sum(values < 0)) if np.min(np.abs(values)) > off else None
        error, place = self.error, x[0]
        p, R = error.pose(list(place), _plain)
        forms = self.forms(x, half)
        E = traced(lambda y, number: [error.at(y, [], number).E], n).at(forms)[0]
        size = (float(np.sqrt(max(0.0, 2 * E.low[0]))), float(np.sqrt(2 * max(0.0, E.high[0]))))
        margins = self.gradient.at(forms)[: len(error.limbs)]
        if any(each.high[0] < 0 for each in margins):
            return None
        seen = [np.array(each.u, dtype=float) for each in error.at(list(place), [], _plain).seen]
        return CriticalBox(error.length * np.array(p, dtype=float), np.array(R, dtype=float).reshape(3, 3), place, wide,
                           radius, size, falling, error.modes_at(place), np.array(seen))


def _plain(value: Any) -> Any:
    return value


def _away(g: AffineForms) -> Flags:
    """Whether g (c, n) is enclosed away from zero: a component of it, g along its own middle, or a component in the
    coordinates in which it is nearest to the box's own."""
    with np.errstate(all="ignore"):
        found = np.any(np.abs(g.v[0]) > g.spread * (1 + AFFINE_ROUNDING), axis=1)
        v = np.nan_to_num(g.v[0])[:, None, :]
        found |= combined(v, g).low[:, 0] > 0
        Y = _inverse(np.moveaxis(g.v[1:], 0, -1))
        near = combined(Y, g)
        found |= np.any(np.abs(near.v[0]) > near.spread * (1 + AFFINE_ROUNDING), axis=1)
    return np.asarray(found)


def _inverse(A: Array) -> Array:
    """Pseudo-inverses (c, n, m) of matrices (c, m, n); zero where there is none."""
    good = np.isfinite(A).all(axis=(1, 2), keepdims=True)
    found = np.linalg.pinv(np.where(good, A, np.eye(*A.shape[1:])))
    return np.asarray(np.where(good, found, 0.0))


def _solved(A: Array, b: Array) -> Array:
    """A⁻¹ b."""
    return np.asarray((_inverse(A) @ np.nan_to_num(b)[..., None])[..., 0])
