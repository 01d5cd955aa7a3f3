"""All critical points of the error in a box of platform poses, by subdivision (docs/pages/endings.md).

A box is settled where a leg does not reach it, where E's gradient g is enclosed away from zero, or where Krawczyk's
operator proves that a box about it holds exactly one zero of g. Near a leg's limit g = a + Σ b_i / s_i, s_i of a known
sign and as small as one likes: there v · g > 0 is shown for some v with v · b_i / s_i > 0; the limit itself, where E is
smooth in s_i instead, is no critical point then. Other boxes are cut, down to a size at which they are left open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot
from ...batch.enclosures import BoxFormula, traced
from ...budgets import BOXES_AT_ONCE, COVER_BOXES
from ...closed_forms.legs import OnCrank, OnRail, OnRod
from ...geometry.affine import AffineForms, affine, combined, stacked
from ...geometry.duals import Dual
from ...geometry.so3 import exponential
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...results import Value
from ...tolerances import AFFINE_ROUNDING, COVER_REACH, FOLLOWED, SHORTEST_ROD, SMALLEST_BOX
from .cones import cut
from .pose_error import NotEnclosed, Number, PoseError

Flags = NDArray[np.bool_]
WIDER = 1.25
"""By how much the box is larger in which exactly one zero is to be proved."""
NEAR_LIMIT = 0.5
"""Ratio of the least to the largest reach margin in a box below which a leg's part of g is bounded by its sign."""
STRETCHED = 8.0
"""Ratio of a box's edges, as parts of those of the whole, above which the longest is cut."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalBox(Value):
    """A pose ``p`` (m), ``R`` about which exactly one critical point is proved: it lies within ``radius`` (coordinates)
    of it and is the only one in ``half``; ``error`` encloses ‖e‖; ``falling`` is the number of directions in which E
    falls (None where that is not decided), ``modes`` are the legs' working modes."""

    p: Array
    R: Array
    x: Array
    half: Array
    radius: float
    error: tuple[float, float]
    falling: int | None
    modes: tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Cover(Value):
    """What subdivision says of a box of platform poses: all critical points of E in it, in some working modes, but for
    ``open`` boxes (middle, half, in coordinates), which are a ``share`` of the whole. ``bounded``: whether the legs
    cannot reach beyond the box; ``unwatched``: legs whose own limits are not looked at."""

    found: tuple[CriticalBox, ...]
    modes: tuple[tuple[float, ...], ...]
    open: tuple[tuple[Array, Array], ...]
    share: float
    boxes: int
    bounded: bool
    unwatched: tuple[str, ...]
    reason: str = ""

    @property
    def complete(self) -> bool:
        """Whether these are all critical points in the box, in these working modes."""
        return not self.open and not self.reason and not self.unwatched


def cover(setting: ObservedRobot, goal: ClosedConfiguration, *, every_mode: bool = False, budget: int = COVER_BOXES,
          reach: float = COVER_REACH) -> Cover:
    """All critical points of the error to a goal that subdivision finds and proves: in the goal's working mode, or in
    every one; where legs are not limited, in a box that is ``reach`` characteristic lengths wide either way."""
    try:
        error = PoseError.of(setting, goal)
        if error.fitted:
            raise NotEnclosed(f"forms are fitted to samples: {', '.join(error.fitted)}")
        if error.turns.shape[1] > 1:
            raise NotEnclosed("the platform turns about more than one axis")
    except NotEnclosed as why:
        return Cover((), (), (), 1.0, 0, False, (), str(why))
    low, high, bounded = _bounds(error, reach)
    seen = {each.limb for each in error.seen}
    own = tuple(limb.mode for limb in error.limbs)
    choices = [(mode, -mode) if every_mode and i in seen and isinstance(limb, OnRod) else (mode,)
               for i, (limb, mode) in enumerate(zip(error.limbs, own, strict=True))]
    every = tuple(product(*choices))
    found: list[CriticalBox] = []
    left: list[tuple[Array, Array]] = []
    boxes, volume = 0, 0.0
    for modes in every:
        for R in _charts(error):
            part = Subdivision.of(error.elsewhere(error.p, R, modes), low, high)
            part.run(budget // len(every))
            found += [each for each in part.zeros() if not any(_same(each, other, part.error) for other in found)]
            left += part.left
            boxes += part.boxes
            volume += sum(float(np.prod(half / part.whole)) for _, half in part.left)
    unwatched = tuple(limb.label for i, limb in enumerate(error.limbs) if i not in seen and isinstance(limb, OnRod))
    return Cover(tuple(found), every, tuple(left), volume / (len(every) * len(_charts(error))), boxes, bounded,
                 unwatched)


def _charts(error: PoseError) -> list[Array]:
    """Rotations from which a quarter of a turn either way reaches all."""
    if not error.turns.shape[1]:
        return [error.R]
    return [error.R, exponential(np.pi * error.turns[:, 0]) @ error.R]


def _bounds(error: PoseError, reach: float) -> tuple[Array, Array, bool]:
    """The box of coordinates that the legs can reach, and whether it is all of it: a rod's tip is no farther from its
    crank's centre or its rail than its length and the crank's."""
    from scipy.optimize import linprog

    k = error.shifts.shape[1]
    rows, limits = [], []
    for limb in error.limbs:
        if not isinstance(limb, OnCrank | OnRail):
            continue
        away = limb.rod + (limb.radius if isinstance(limb, OnCrank) else 0.0) + float(np.linalg.norm(limb.tip.turned))
        ways = np.eye(3) if isinstance(limb, OnCrank) else np.linalg.svd(limb.axis[None])[2][1:]
        offset = error.p + limb.tip.constant - limb.centre
        for way in (*ways, *-ways):
            rows.append(way @ error.shifts)
            limits.append(away - way @ offset)
    bounds, bounded = [], True
    for axis in np.eye(k):
        for sign in (1.0, -1.0):
            found = linprog(sign * axis, A_ub=np.array(rows), b_ub=limits, bounds=(None, None)) if rows else None
            reached = found is not None and found.status == 0
            bounded &= reached
            bounds.append(sign * found.fun - sign * SMALLEST_BOX if found is not None and reached else -sign * reach)
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    turns = np.ones(error.turns.shape[1])
    return np.concatenate([low, -turns]), np.concatenate([high, turns]), bounded


def _same(one: CriticalBox, other: CriticalBox, error: PoseError) -> bool:
    """Whether two enclosed zeros are one: the first lies where the second is the only one. Those of one pose seen from
    two charts, half a turn apart, are told by their poses."""
    if one.modes != other.modes:
        return False
    if np.array_equal(one.R, other.R) and one.half.shape == other.half.shape:
        return bool(np.all(np.abs(one.x - other.x) + one.radius < other.half))
    return bool(np.linalg.norm(one.p - other.p) < error.length * SMALLEST_BOX
                and np.linalg.norm(one.R - other.R) < SMALLEST_BOX)


@dataclass(eq=False)
class Subdivision:
    """Boxes of coordinates in one chart and one working mode that are cut until they are settled."""

    error: PoseError
    low: Array
    high: Array
    gradient: BoxFormula
    hessian: BoxFormula
    steep: tuple[int, ...]
    """The limbs at whose limits the gradient grows beyond all bounds."""
    boxes: int = 0

    @classmethod
    def of(cls, error: PoseError, low: Array, high: Array) -> Subdivision:
        """The formulas, traced: reach margins, g without what is steep, that and what it is divided by for each limb;
        then the Hessian."""
        n = error.size
        steep = tuple(each.limb for each in error.seen if each.limb is not None
                      and isinstance(error.limbs[each.limb], OnRod))

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
            return [*found.margins, *plain, *parts]

        def hessian(x: Sequence[Any], number: Number) -> list[Any]:
            def constant(value: Any) -> Any:
                return [constant(each) for each in value] if np.ndim(value) else Dual(number(value), [0.0] * n)

            y = [Dual(each, list(axis)) for each, axis in zip(x, np.eye(n).tolist(), strict=True)]
            rows = [[Dual(value, [0.0] * n) for value in axis] for axis in np.eye(n).tolist()]
            return [rate for slope in error.at(y, rows, constant).slopes for rate in slope.rates]

        made = cls(error, low, high, traced(gradient, n), traced(hessian, n), steep)
        made.left, made.proved = [], []
        return made

    left: Any = None
    proved: Any = None

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
        a, b = stacked(plain), []
        for i in range(len(self.steep)):
            *normal, share, along = parts[i * (n + 2) : (i + 1) * (n + 2)]
            b.append(SteepPart(stacked(normal), share, along))
        regular = inside & ~at_limit.any(axis=1)
        g = a
        with np.errstate(all="ignore"):
            for each in b:
                g = g + each.regular
        settled = beyond | (regular & _away(g))
        near = ~settled & inside & close.any(axis=1)
        if near.any():
            settled[near] = _sloping(_some(a, near), [each.some(near) for each in b], close[near])
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
        """The zeros that were proved, each once, enclosed by Newton's method from the middle."""
        found: list[CriticalBox] = []
        for middle, wide in self.proved:
            made = self._enclosed(middle, wide)
            if made is not None and not any(_same(made, other, self.error) for other in found):
                found.append(made)
        return found

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
        modes = tuple(limb.mode for limb in error.limbs)
        margins = self.gradient.at(forms)[: len(error.limbs)]
        if any(each.high[0] < 0 for each in margins):
            return None
        return CriticalBox(error.length * np.array(p, dtype=float), np.array(R, dtype=float).reshape(3, 3), place, wide,
                           radius, size, falling, modes)


@dataclass(frozen=True, eq=False)
class SteepPart:
    """A leg's part of g that grows beyond all bounds at its limit, ``share`` ``normal`` / ``along``."""

    normal: AffineForms
    share: AffineForms
    along: AffineForms

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
        return SteepPart(_some(self.normal, which), _some(self.share, which), _some(self.along, which))


def _some(forms: AffineForms, which: Flags) -> AffineForms:
    return AffineForms(forms.v[:, which], forms.r[which])


def _sloping(a: AffineForms, parts: Sequence[SteepPart], at_limit: Flags) -> Flags:
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
        signs = [np.sign(part.along.v[0]) for part in parts]
        for i, part in enumerate(parts):
            pull = part.normal.v[0] * (part.share.v[0] * signs[i])[:, None]
            size = np.linalg.norm(pull, axis=1)[:, None]
            towards += np.where(at_limit[:, i, None], pull / np.where(size > 0, size, 1.0), 0.0)
            total += np.where(at_limit[:, i, None], 2 * pull / part.top[:, None], 0.0)
        settled = np.zeros(count, dtype=bool)
        for v in (total, towards):
            size = np.linalg.norm(v, axis=1)
            v = (v / np.where(size > 0, size, 1.0)[:, None])[:, None, :]
            least, good = combined(v, rest).low[:, 0], np.ones(count, dtype=bool)
            for i, part in enumerate(parts):
                pull = (combined(v * signs[i][:, None, None], part.normal) * part.share[..., None]).low[:, 0]
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
    """Inverses (c, n, n); zero where there is none."""
    good = np.isfinite(A).all(axis=(1, 2), keepdims=True)
    found = np.linalg.pinv(np.where(good, A, np.eye(A.shape[1])))
    return np.asarray(np.where(good, found, 0.0))


def _solved(A: Array, b: Array) -> Array:
    """A⁻¹ b."""
    return np.asarray((_inverse(A) @ np.nan_to_num(b)[..., None])[..., 0])
