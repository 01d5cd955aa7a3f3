"""Boxes of poses and joints that are cut until each is settled: it holds no critical point of the error, or exactly
one.

Coordinates y and equations g are those of :mod:`.joint_error`. At a critical point ∇E + μ ∇g = 0 for some μ: for any
choice P of as many coordinates as there are equations, F = ∇E_N − ∇E_P (∇g_P)⁻¹ ∇g_N vanishes, N the other
coordinates. A box is settled where g or F is enclosed away from zero, where a leg without a joint does not reach, or
where Krawczyk's operator on (∇E + μ ∇g, g) proves that a box about it holds exactly one zero; where poses are asked for
at which the error vanishes, also where that is enclosed away from zero; and where a moment is that would vanish. g = 0
narrows the others, and tells the coordinates P in terms of N and of what each equation leaves open: of this one symbol
each stands in all of P, so that what an equation leaves open counts once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ...budgets import BOXES_AT_ONCE
from ...geometry.affine import AffineForms, affine, combine
from ...geometry.vectors import Array
from ...progress import tell
from ...results import Value
from ...tolerances import AFFINE_ROUNDING, BOX_ROUNDING, MET_AGAIN, SINGULAR_BOX, SMALLEST_BOX, THINNEST_BOX
from .cones import cut
from .elimination import (
    Flags,
    Places,
    away,
    columns,
    entries,
    inverse,
    pivots,
    pseudo_inverse,
    reduced_gradient,
    solution,
)
from .enclosure import negative
from .joint_error import JointError
from .reached import narrow_joints

WIDER = (1.25, 4.0)
"""By how much boxes are larger in which exactly one zero is to be proved, one after the other."""
INFLATED = (2.0, 8.0, 32.0)
"""How many times as large as what is open of a zero such boxes are about one nearby, one after the other."""
AROUND = 16.0 ** np.arange(4, 0, -1)
"""How many times as large as the smallest boxes those are about a zero nearby, one after the other."""
SINGULAR = -2
"""In the place of an axis: a box is left open, ∇g may lose rank in it."""
STRETCHED = 8.0
"""Ratio of a box's edges, as parts of those of the whole, above which the longest is cut."""
TOLD = 2.0
"""How many times as large slopes by joints count where it is chosen which coordinates the others tell: joints follow in
closed form."""
FOLLOWING = 0.25
"""What part of its edge counts of a coordinate that the others tell where it is chosen which is cut."""
COARSE = 0.02
"""Part of the whole box from which edges on this is so: in small boxes that are left the others may tell nothing."""
NARROWED = 0.6
"""Part of an edge to which g = 0 narrows it below which a box is looked at again before it is cut."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalBox(Value):
    """A pose ``p`` (m), ``R`` about which exactly one critical point is proved: in coordinates it lies within
    ``radius`` of ``x``; ``error`` encloses ‖e‖; ``falling`` is the number of directions in which E falls (None where
    that is not decided); ``directions`` those observed (legs, 3)."""

    p: Array
    R: Array
    x: Array
    radius: Array
    error: tuple[float, float]
    falling: int | None
    directions: Array


@dataclass(eq=False)
class Subdivision:
    """Boxes between two corners of coordinates in one chart; ``vanishing``: only where the error vanishes."""

    error: JointError
    low: Array
    high: Array
    vanishing: bool = False
    boxes: int = 0
    spent: bool = False
    """Whether there were boxes left as so many had been looked at as were allowed."""
    left: list[tuple[Array, Array]] = field(default_factory=list)
    lost: list[tuple[Array, Array]] = field(default_factory=list)
    """Small boxes in which the equations of the legs may be dependent."""
    proved: list[tuple[Array, Array]] = field(default_factory=list)
    """Coordinates and multipliers, and the room about them, in which exactly one zero is proved."""
    flat: list[tuple[Array, Array]] = field(default_factory=list)
    """The same of zeros that are flat."""

    @property
    def whole(self) -> Array:
        """Half the edges of the whole box."""
        return (self.high - self.low) / 2

    @property
    def share(self) -> float:
        """What part of the whole is left open."""
        return float(sum(np.prod(half / self.whole) for _, half in self.left))

    def run(self, budget: int, place: int = 0, places: int = 1) -> None:
        """Cut boxes until all are settled, too small, or so many were looked at; of so many ``places`` at which this is
        done, it is told which it is at, how much space is settled, and how many boxes wait: the last per cent of space
        may need most boxes."""
        whole = self.whole
        middle, half, share = ((self.low + self.high) / 2)[None], whole[None], self.share
        while len(middle) and self.boxes < budget:
            settled = 1 - share - float(np.prod(half / whole, axis=1).sum())
            which = "" if places == 1 else f" of search {place + 1} of {places}"
            tell(f"boxes{which}: {np.floor(100 * settled):.0f} % of the space settled, {self.boxes:,} looked at of at "
                 f"most {budget:,}, {len(middle):,} waiting")
            # the smallest first: memory stays small
            first = max(0, len(middle) - BOXES_AT_ONCE)
            part, size, axis = self._open(middle[first:], half[first:])
            self.boxes += len(middle) - first
            lost, small = axis == SINGULAR, np.all(size <= SMALLEST_BOX * whole, axis=1)
            for where, boxes in ((small & ~lost, self.left), (lost, self.lost)):
                boxes += list(zip(part[where], size[where], strict=True))
            share += float(np.prod(size[small & ~lost] / whole, axis=1).sum())
            small |= lost
            again, rest = ~small & (axis < 0), ~small & (axis >= 0)
            below, edges = cut(part[rest], size[rest], axis[rest])
            middle = np.concatenate([middle[:first], part[again], below])
            half = np.concatenate([half[:first], size[again], edges])
        self.left += list(zip(middle, half, strict=True))
        self.spent = len(middle) > 0

    def _open(self, middle: Array, half: Array) -> tuple[Array, Array, Places]:
        """Boxes (c, n) that are not settled, narrowed, and the axes (c,) across which they are to be cut, −1 of those
        that are to be looked at again first."""
        low, high = self._narrow(middle, half)
        known = np.all(low <= high, axis=1)
        low, high = low[known], high[known]
        middle, half = (low + high) / 2, (high - low) / 2 * (1 + BOX_ROUNDING)
        forms = forms_of(middle, half)
        g = self.error.closing.together(forms) if self.error.size[1] else AffineForms(
            np.zeros((middle.shape[1] + 1, len(middle), 0)), np.zeros((len(middle), 0)))
        low, high = _narrow_symbols(g)
        if self.vanishing:
            low, high = (pick(one, other) for pick, one, other in zip(
                (np.maximum, np.minimum), (low, high), _narrow_symbols(self.error.asked.together(forms)), strict=True))
        gone = np.any(low > high, axis=1)
        with np.errstate(all="ignore"):
            J = np.where(half[:, None] > 0, np.moveaxis(g.v[1:], 0, -1) / half[:, None], 0.0)
        J[:, :, self.error.freedoms :] *= TOLD
        P, N = pivots(J)
        back = inverse(columns(np.moveaxis(g.v[1:], 0, -1), P))
        follow = combine(back, g)
        inner = _narrow_symbols(follow, P)
        low, high = np.maximum(low, inner[0]), np.minimum(high, inner[1])
        gone |= np.any(low > high, axis=1)
        own, size = middle + half * (low + high) / 2, half * np.maximum((high - low) / 2, 0.0) * (1 + BOX_ROUNDING)
        axis = np.full(len(middle), -1)
        tiny = np.all(size <= 100 * SMALLEST_BOX * self.whole, axis=1)
        look = np.flatnonzero(~gone & (tiny | np.all(high - low >= 2 * NARROWED, axis=1)))
        if len(look):
            tube, loose = _tube(own[look], size[look], middle[look], half[look], P[look], N[look],
                                AffineForms(follow.v[:, look], follow.r[look]), (back * g.r[:, None])[look])
            settled, F = self._settle(tube, P[look], N[look])
            step = solution(np.moveaxis(F.v[1 : 1 + N.shape[1]], 0, -1), F.v[0])
            finite = np.isfinite(F.r).all(axis=1)
            likely = ~settled & finite & (tiny[look] | np.all(np.abs(step) < 3.0, axis=1))
            for wider in WIDER:
                at = look[likely]
                if len(at):
                    settled[likely] = self._unique(own[at], size[at], P[at], wider)
                    likely &= ~settled
            close = np.flatnonzero(likely & tiny[look])
            if len(close):
                settled[close] = self._near_zero(own[look[close]], size[look[close]], P[look[close]])
            gone[look[settled]] = True
            lost = ~finite & np.all(size[look] <= SINGULAR_BOX * self.whole, axis=1)
            axis[look] = np.where(lost, SINGULAR, self._axes(size[look], N[look], F, loose))
        return own[~gone], size[~gone], axis[~gone]

    def _narrow(self, middle: Array, half: Array) -> tuple[Array, Array]:
        """The corners of boxes (c, n) with the joints where closed forms say that they can be."""
        return narrow_joints(self.error, forms_of(middle, half), middle - half, middle + half)

    def _settle(self, tube: list[AffineForms], P: Places, N: Places) -> tuple[Flags, AffineForms]:
        """Whether nothing is asked for on a tube, and F there."""
        _, M, slope, margins = self._values(tube)
        F, minors = reduced_gradient(M, slope, P, N)
        settled = away(F, N.shape[1])
        rest = np.flatnonzero(~settled)
        settled[rest] = away(AffineForms(minors.v[:, rest], minors.r[rest]), N.shape[1])
        if self.vanishing:
            settled |= away(self.error.asked.together(tube), N.shape[1])
        for margin in margins:
            settled |= margin.high < 0
        rest = np.flatnonzero(~settled)
        if self.error.apart and len(rest):
            left = [AffineForms(each.v[:, rest], each.r[rest]) for each in tube]
            settled[rest] = away(self.error.moments.together(left), N.shape[1])
        return settled, F

    def _axes(self, size: Array, N: Places, F: AffineForms, loose: Flags) -> Places:
        """Across which axes boxes are cut: that along which F changes most where only N are ``loose`` (c, n) and no
        edge is much longer than the others; else the longest of N, or one of the other loose ones where it is longer
        still: a surface that N tells would be cut to more and smaller pieces by all axes."""
        share, slopes = size / self.whole, np.abs(np.moveaxis(F.v[1 : 1 + N.shape[1]], 0, -1)).max(axis=1, initial=0.0)
        changes, large = np.zeros(share.shape), share.max(axis=1, keepdims=True) > COARSE
        weight = np.where(loose, np.where(large, FOLLOWING, 1.0), 0.0)
        np.put_along_axis(changes, N, np.where(np.isfinite(slopes), slopes, 0.0), 1)
        np.put_along_axis(weight, N, 1.0, 1)
        even = share.max(axis=1) <= STRETCHED * np.take_along_axis(share, N, 1).max(axis=1)
        known = even & np.isfinite(F.r).all(axis=1) & changes.any(axis=1) & (loose.sum(axis=1) == N.shape[1])
        return np.where(known, changes.argmax(axis=1), (share * weight).argmax(axis=1))

    def _values(self, forms: list[AffineForms]) -> tuple[AffineForms, AffineForms, AffineForms, list[AffineForms]]:
        """g (c, k), its rates (c, k, n), those of E (c, n), reach margins."""
        (n, k), out = self.error.size, self.error.slopes.together(forms)
        g, M, slope, margins = (out[..., part] for part in np.split(
            np.arange(out.r.shape[1]), [k, k + k * n, k + k * n + n]))
        return (g, AffineForms(M.v.reshape(*M.v.shape[:-1], k, n), M.r.reshape(len(M.r), k, n)), slope,
                [margins[..., i] for i in range(margins.r.shape[1])])

    def _unique(self, middle: Array, half: Array, P: Places, wider: float) -> Flags:
        """Boxes (c, n) in which, made ``wider``, exactly one zero is proved, or that there is none in them."""
        n, wide = self.error.size[0], np.maximum(
            wider * np.maximum(half, THINNEST_BOX * half.max(axis=1, keepdims=True)), MET_AGAIN)
        mu, room, known = self._multipliers(middle, wide, P)
        room = np.maximum(room.max(axis=1, keepdims=True, initial=0.0), MET_AGAIN) * np.ones_like(mu)
        at, about = np.concatenate([middle, mu], axis=1), np.concatenate([wide, WIDER[0] * room], axis=1)
        shift, reach = self._krawczyk(at, about)
        with np.errstate(all="ignore"):
            one = known & np.all(reach < about, axis=1)
            none = known & np.any((np.abs(shift) - (reach - np.abs(shift)))[:, :n] > half, axis=1)
        for i in np.flatnonzero(one & ~none):
            self.proved.append((at[i], about[i]))
        return one | none

    def _near_zero(self, middle: Array, half: Array, P: Places) -> Flags:
        """Boxes (c, n) that lie, with their multipliers, in a box about a zero nearby that is proved to be the only one
        there: its edges are equal, or in the ratio in which the numbers of the file leave the zero open
        (epsilon-inflation). New ones are sought from the smallest boxes alone."""
        smallest = np.all(half <= SMALLEST_BOX * self.whole, axis=1)
        if not self.flat and not smallest.any():
            return smallest
        mu, room, known = self._multipliers(middle, half, P)
        at, own = np.concatenate([middle, mu], axis=1), np.concatenate([half, room], axis=1)
        found = known & self._near(at, own)
        left = np.flatnonzero(known & ~found & smallest)
        if not len(left):
            return found
        x = at[left]
        for _ in range(8):
            x = x - self._krawczyk(x, 0 * x)[0]
        open_by = self._krawczyk(x, 0 * x)[1]
        for about in (*self._around(x, P[left]), *(times * open_by for times in INFLATED)):
            with np.errstate(all="ignore"):
                one = np.all(self._krawczyk(x, about)[1] < about, axis=1)
                one &= np.all(np.abs(at[left] - x) + own[left] <= about, axis=1)
            while np.any(new := one & ~found[left]):
                i = int(new.argmax())
                self.flat.append((x[i], about[i]))
                found[left] |= self._near(at[left], own[left])
        return found

    def _around(self, x: Array, P: Places) -> Iterator[Array]:
        """Half the edges (c, n + k) of boxes about zeros x, the largest first: equal ones of the coordinates, those of
        the multipliers as they follow."""
        n = self.error.size[0]
        for times in AROUND:
            wide = np.full((len(x), n), times * SMALLEST_BOX * float(self.whole.max()))
            _, room, _ = self._multipliers(x[:, :n], wide, P)
            yield np.concatenate([wide, WIDER[0] * room], axis=1)

    def _near(self, at: Array, half: Array) -> Flags:
        """Boxes (c, n + k) that lie in one about a flat zero."""
        return np.any([np.all(np.abs(at - x) + half <= about, axis=1) for x, about in self.flat], axis=0) if (
            self.flat) else np.zeros(len(at), dtype=bool)

    def _multipliers(self, middle: Array, wide: Array, P: Places) -> tuple[Array, Array, Flags]:
        """Multipliers (c, k) at the middle of boxes, how far they are from there at critical points in them, and
        whether that is known."""
        k = self.error.size[1]
        _, M, slope, _ = self._values(forms_of(middle, 0 * middle))
        back = inverse(columns(M.v[0], P))
        mu = np.nan_to_num(-(np.take_along_axis(slope.v[0], P, 1)[:, None] @ back)[:, 0])
        # over the box μ is μ₀ + δ, with (∇E + μ₀ ∇g)_P + δ ∇g_P = 0
        _, M, slope, _ = self._values(forms_of(middle, wide))
        turned = np.swapaxes(back, 1, 2)
        pull = combine(turned, entries(slope + (M * mu[:, :, None]).sum(-2), P))
        rates = entries(M, P)
        off = (combine(turned, rates.transposed()) - np.eye(k)).size
        with np.errstate(all="ignore"):
            most = (pull.size.max(axis=1, initial=0.0) / (1 - off.sum(axis=-1).max(axis=1, initial=0.0)))[:, None]
            room = (pull.size + (off * most[:, None]).sum(axis=-1)) * (1 + BOX_ROUNDING)
        known = np.isfinite(room).all(axis=1) & np.all(most >= 0, axis=1)
        return mu, np.where(known[:, None], room, 1.0), known

    def _krawczyk(self, at: Array, about: Array) -> tuple[Array, Array]:
        """Newton's step from coordinates and multipliers (c, n + k), and how far from there the operator over a box
        about them reaches."""
        pull, K = self._equations(at, about)
        Y = pseudo_inverse(K.v[0])
        with np.errstate(all="ignore"):
            shift = combine(Y, pull)
            off = ((np.eye(at.shape[1]) - combine(Y, K)).size @ about[..., None])[..., 0]
            return shift.v[0], (shift.size + off) * (1 + AFFINE_ROUNDING)

    def _equations(self, at: Array, about: Array) -> tuple[AffineForms, AffineForms]:
        """(∇E + μ ∇g, g) (c, n + k) at places, and its derivatives over boxes about these."""
        n, k = self.error.size
        g, M, slope, _ = self._values(forms_of(at[:, :n], 0 * at[:, :n]))
        mu = at[:, n:]
        pull = slope + (M * mu[:, :, None]).sum(-2)
        phi = AffineForms(np.concatenate([pull.v, g.v], axis=-1), np.concatenate([pull.r, g.r], axis=-1))
        out = self.error.bends.together(forms_of(at, about))
        # the rates of g along the fields, which multiply μ: those by the coordinates but for a far chart
        rates = self._values(forms_of(at, about)[:n])[1]
        c, K = len(at), AffineForms(np.zeros((len(out.v), len(at), n + k, n + k)), np.zeros((len(at), n + k, n + k)))
        K.v[..., :n, :n], K.r[:, :n, :n] = out.v[..., : n * n].reshape(-1, c, n, n), out.r[:, : n * n].reshape(c, n, n)
        K.v[..., n:, :n] = out.v[..., n * n :].reshape(len(out.v), c, k, n)
        K.r[:, n:, :n] = out.r[:, n * n :].reshape(c, k, n)
        along = rates.transposed()
        K.v[..., :n, n:], K.r[:, :n, n:] = along.v, along.r
        return phi, K

    def zeros(self) -> list[CriticalBox]:
        """The zeros that were proved, enclosed; those that may be at no finite place are left open."""
        if not self.proved and not self.flat:
            return []
        n, far = self.error.size[0], self.error.far
        at, room = (np.array(each) for each in zip(*self.proved, *self.flat, strict=True))
        x, reach, left = at.copy(), room.copy(), np.arange(len(at))
        for _ in range(8):
            x = x - self._krawczyk(x, 0 * x)[0]
        for radius in MET_AGAIN * 4.0 ** np.arange(8):
            found = self._krawczyk(x[left], np.full(x[left].shape, radius))[1]
            done = np.all((found < radius) & (np.abs(x - at)[left] + radius <= room[left]), axis=1)
            reach[left[done]] = found[done]
            left = left[~done]
            if not len(left):
                break
        if len(left):
            # nearly flat ones: the operator over the room holds the zero, and again over what it reaches
            inside = np.all(np.abs(x - at)[left] <= room[left], axis=1)
            x[left] = np.where(inside[:, None], x[left], at[left])
            reach[left] = np.fmin(room[left], self._krawczyk(at[left], room[left])[1]) + np.abs(x - at)[left]
            for _ in range(8):
                reach[left] = np.fmin(reach[left], self._krawczyk(x[left], reach[left])[1])
        if far is not None:
            endless = np.abs(x[:, far]) <= reach[:, far]
            self.left += [(at[i, :n], room[i, :n]) for i in np.flatnonzero(endless)]
            x, reach = x[~endless], reach[~endless]
        return self._report(x, reach) if len(x) else []

    def _report(self, x: Array, reach: Array) -> list[CriticalBox]:
        """What boxes with one zero each hold."""
        (n, k), error, far = self.error.size, self.error.error, self.error.far
        K, forms = self._equations(x, reach)[1], forms_of(x[:, :n], reach[:, :n])
        if far is not None:
            # rates by the turn itself, so that K is symmetric at the zero
            for place in self.error.turning:
                row = K[..., place, :] * forms[far].padded(len(K.v))[..., None]
                K.v[..., place, :], K.r[:, place] = row.v, row.r
        falling = negative(K) - k
        e, u = self.error.errors.together(forms), self.error.directions.together(forms_of(x[:, :n], 0 * x[:, :n]))
        least, most = np.maximum(np.maximum(e.low, -e.high), 0.0), e.size
        p, R = self.error.pose(x[:, :n])
        low, high = self.error.enclose_chart(x[:, :n], reach[:, :n])
        return [CriticalBox(error.length * p[i], R[i], (low[i] + high[i]) / 2, (high[i] - low[i]) / 2,
                            (float(np.linalg.norm(least[i])), float(np.linalg.norm(most[i]))),
                            int(falling[i]) if falling[i] >= 0 else None, u.v[0, i].reshape(-1, 3))
                for i in range(len(x))]


def forms_of(middle: Array, half: Array) -> list[AffineForms]:
    """The coordinates of boxes (c, n), and what cutting and narrowing them may have rounded."""
    eye, off = np.eye(middle.shape[1]), AFFINE_ROUNDING * (1 + np.abs(middle))
    return [affine(middle[:, i], half[:, i, None] * eye[i], off[:, i]) for i in range(len(eye))]


def _narrow_symbols(g: AffineForms, P: Places | None = None) -> tuple[Array, Array]:
    """Where in [−1, 1] the symbols (c, n) are, as far as equations g (c, k) = 0 tell; those ``P`` alone of one equation
    each, which it has the coefficient 1 in."""
    J = np.moveaxis(g.v[1:], 0, -1)
    size = np.abs(J)
    if P is not None:
        size = np.where(np.arange(size.shape[2]) == P[:, :, None], size, 0.0)
    rest = np.abs(J).sum(axis=2, keepdims=True) - np.abs(J) * (size > 0) + g.r[:, :, None]
    with np.errstate(all="ignore"):
        far = np.where(size > 0, rest * (1 + BOX_ROUNDING) / size, np.inf) + BOX_ROUNDING
        at = np.where(size > 0, -g.v[0][:, :, None] / J, 0.0)
    far, at = np.where(np.isfinite(far) & np.isfinite(at), far, np.inf), np.where(np.isfinite(at), at, 0.0)
    return (at - far).max(axis=1, initial=-1.0), (at + far).min(axis=1, initial=1.0)


def _tube(middle: Array, half: Array, old: Array, edges: Array, P: Places, N: Places, follow: AffineForms, doubts: Array
          ) -> tuple[list[AffineForms], Flags]:
    """The coordinates of boxes (c, n), those of P as they follow from N: ε_P = −(f₀ + Σ f_N ε_N + Σ ``doubts`` δ) ± r
    in the symbols of the ``old`` boxes, δ what each equation leaves open, the same for all of P; or as wide as they are
    where that is no narrower: these are loose (c, n), as those of N are."""
    (c, n), d, k = middle.shape, N.shape[1], P.shape[1]
    slopes, radius = np.zeros((c, n, d + k)), np.zeros((c, n))
    own, was = np.take_along_axis(half, N, 1), np.take_along_axis(edges, N, 1)
    np.put_along_axis(slopes[:, :, :d], N[:, :, None], own[:, :, None] * np.eye(d), 1)
    with np.errstate(all="ignore"):
        ratio = np.where(was > 0, own / was, 0.0)
        shift = np.where(was > 0, np.take_along_axis(middle - old, N, 1) / was, 0.0)
        J, wide = columns(np.moveaxis(follow.v[1:], 0, -1), N), np.take_along_axis(edges, P, 1)
        at = np.take_along_axis(old, P, 1) - wide * (follow.v[0] + (J * shift[:, None]).sum(-1))
        along, doubt = -wide[:, :, None] * np.concatenate([J * ratio[:, None], doubts], 2), wide * (
            follow.r + BOX_ROUNDING)
        rounded = wide * (np.maximum(follow.r - np.abs(doubts).sum(axis=2), 0.0) + 2 * BOX_ROUNDING)
    plain = np.take_along_axis(half, P, 1)
    good = np.isfinite(doubt) & np.isfinite(at) & np.isfinite(along).all(axis=-1) & (doubt < plain)
    centre = middle.copy()
    np.put_along_axis(centre, P, np.where(good, at, np.take_along_axis(middle, P, 1)), 1)
    np.put_along_axis(slopes, P[:, :, None], np.where(good[:, :, None], along, 0.0), 1)
    np.put_along_axis(radius, P, np.where(good, rounded, plain), 1)
    loose = np.ones((c, n), dtype=bool)
    np.put_along_axis(loose, P, ~(good & (doubt < NARROWED * plain)), 1)
    return [affine(centre[:, i], slopes[:, i], radius[:, i]) for i in range(n)], loose
