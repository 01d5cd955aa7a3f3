"""Subdivision of boxes of poses and joints until each is settled: it holds no critical point of the error, or exactly
one.

Coordinates y and equations g are those of :mod:`.joint_error`. At a critical point ∇E + μ ∇g = 0 for some μ: for any
choice P of as many coordinates as there are equations, F = ∇E_N − ∇E_P (∇g_P)⁻¹ ∇g_N vanishes, N the other coordinates.
A box is settled where g or F is enclosed away from zero, where a leg without a joint does not reach, or where
Krawczyk's operator on (∇E + μ ∇g, g) proves that a box about it holds exactly one zero; if only poses without error are
searched, also where that is enclosed away from zero; and where a moment is that would vanish. g = 0 narrows the others,
and gives the coordinates P in terms of N and of what each equation leaves open: of this one symbol each stands in all
of P, so that what an equation leaves open counts once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...geometry.affine import AffineForms, combine, make_affine, stack
from ...geometry.vectors import Array
from ...results import Value
from ...solving.exhaust import AGAIN, SETTLED, Exhaustion
from ...solving.krawczyk import bound_contraction, bound_image
from ...tolerances import AFFINE_ROUNDING, SINGULAR_BOX_MIN_FRACTION
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
from .joint_bounds import BOX_EDGE_ROUNDING_TOL
from .joint_error import JointError

CRITICAL_BOX_HALF_EDGE_MIN = 1e-7
"""Smallest half-edge (characteristic lengths, radians) of a box of one critical point."""
BOX_EDGE_RATIO_MIN = 1e-3
"""Smallest ratio of such a box's edges."""
POSE_BOX_MIN_FRACTION = 1e-8
"""Fraction of the whole box below which an undecided box remains undecided."""
SUBDIVISION_BATCH_COUNT = 4096
"""Boxes processed together."""
WIDER = (1.25, 4.0)
"""Factors by which boxes are enlarged, one after the other, to prove exactly one zero."""
ZERO_BOX_INFLATION_FRACTION = 4.0
"""Least size of such boxes over the uncertainty of a zero nearby."""
AROUND = 16.0 ** np.arange(4, -1, -1)
"""Least sizes of enclosing boxes over the smallest boxes, one after the other."""
SINGULAR, SMALL = SETTLED - 1, SETTLED - 2
"""In the place of an axis: a box is left open, as ∇g may lose rank in it, or as it is small."""
BOX_EDGE_RATIO_MAX = 8.0
"""Ratio of a box's edges, as parts of those of the whole, above which the longest is cut."""
JOINT_SLOPE_WEIGHT_FRACTION = 2.0
"""Factor for slopes by joints in the choice of the dependent coordinates: joints follow in closed form."""
DEPENDENT_EDGE_FRACTION = 0.25
"""Fraction of its edge that counts for a dependent coordinate in the choice of the edge to cut."""
COARSE_EDGE_MIN_FRACTION = 0.02
"""Fraction of the whole box above which edges count so: in small remaining boxes the other coordinates may determine
nothing."""
NARROWED_EDGE_FRACTION = 0.6
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
    """Flag: boxes were left when the limit was reached."""
    left: list[tuple[Array, Array]] = field(default_factory=list)
    lost: list[tuple[Array, Array]] = field(default_factory=list)
    """Small boxes in which the equations of the legs may be dependent."""
    proved: list[tuple[Array, Array, Array | None]] = field(default_factory=list)
    """Coordinates and multipliers, and the room about them, in which exactly one zero is proved: of one that is flat in
    a frame (columns)."""

    singular: float = SINGULAR_BOX_MIN_FRACTION
    """Part of the whole: boxes with edges below it in which equations may be dependent are not cut further."""

    @property
    def whole(self) -> Array:
        """Half the edges of the whole box."""
        return (self.high - self.low) / 2

    @property
    def share(self) -> float:
        """Return the undecided fraction of the whole box."""
        return float(sum(np.prod(half / self.whole) for _, half in self.left))

    def run(self, budget: int, place: int = 0, places: int = 1, jobs: int = 1) -> None:
        """Cut boxes until all are settled, too small, or ``budget`` boxes were processed. Progress reports have the
        number of the search (``place`` of ``places``). ``jobs`` processes share many boxes."""
        which = "" if places == 1 else f" of search {place + 1} of {places}"
        self._run(((self.low + self.high) / 2)[None], self.whole[None], budget, jobs, f"boxes{which}")

    def cut_lost(self, chosen: Sequence[bool], singular: float, budget: int, jobs: int = 1) -> None:
        """Cut on those of the lost boxes that were ``chosen``, down to a smaller part of the whole."""
        own = [each for each, is_own in zip(self.lost, chosen, strict=True) if is_own]
        self.lost = [each for each, is_own in zip(self.lost, chosen, strict=True) if not is_own]
        self.singular = singular
        middle, half = (np.array([each[k] for each in own]) for k in range(2))
        self._run(middle, half, budget, jobs, "boxes where legs may lock")

    def _run(self, middle: Array, half: Array, budget: int, jobs: int, stage: str) -> None:
        """Cut boxes (c, n)."""
        search = Exhaustion(self, (middle, half), budget, SUBDIVISION_BATCH_COUNT, stage=stage).run_shared(jobs)
        for middle, half, reason in search.given_up:
            for kind, boxes in ((SMALL, self.left), (SINGULAR, self.lost)):
                boxes += zip(middle[reason == kind], half[reason == kind], strict=True)
        self.left += zip(*search.waiting, strict=True)
        self.boxes += search.judged
        self.spent |= len(search.waiting[0]) > 0

    def fresh(self) -> Subdivision:
        """Return the same, with nothing done."""
        return replace(self, boxes=0, left=[], lost=[], proved=[])

    @property
    def flat(self) -> list[tuple[Array, Array, Array]]:
        """Zeros that are flat."""
        return [(at, room, frame) for at, room, frame in self.proved if frame is not None]

    def __call__(self, middle: Array, half: Array) -> tuple[Array, Array, Places]:
        """Boxes (c, n) that are not settled, narrowed, and the axes (c,) across which they are to be cut, or what else
        is to be done with them."""
        low, high = self._narrow(middle, half)
        known = np.all(low <= high, axis=1)
        low, high = low[known], high[known]
        middle, half = (low + high) / 2, (high - low) / 2 * (1 + BOX_EDGE_ROUNDING_TOL)
        forms = forms_of(middle, half)
        g = (
            self.error.closing.together(forms)
            if self.error.size[1]
            else AffineForms(np.zeros((middle.shape[1] + 1, len(middle), 0)), np.zeros((len(middle), 0)))
        )
        low, high = _narrow_symbols(g)
        if self.vanishing:
            low, high = (
                pick(one, other)
                for pick, one, other in zip(
                    (np.maximum, np.minimum),
                    (low, high),
                    _narrow_symbols(self.error.asked.together(forms)),
                    strict=True,
                )
            )
        gone = np.any(low > high, axis=1)
        with np.errstate(all="ignore"):
            J = np.where(half[:, None] > 0, np.moveaxis(g.v[1:], 0, -1) / half[:, None], 0.0)
        J[:, :, self.error.freedoms :] *= JOINT_SLOPE_WEIGHT_FRACTION
        P, N = pivots(J)
        back = inverse(columns(np.moveaxis(g.v[1:], 0, -1), P))
        follow = combine(back, g)
        inner = _narrow_symbols(follow, P)
        low, high = np.maximum(low, inner[0]), np.minimum(high, inner[1])
        gone |= np.any(low > high, axis=1)
        own, size = (
            middle + half * (low + high) / 2,
            half * np.maximum((high - low) / 2, 0.0) * (1 + BOX_EDGE_ROUNDING_TOL),
        )
        axis = np.full(len(middle), AGAIN)
        tiny = np.all(size <= 100 * POSE_BOX_MIN_FRACTION * self.whole, axis=1)
        look = np.flatnonzero(~gone & (tiny | np.all(high - low >= 2 * NARROWED_EDGE_FRACTION, axis=1)))
        if len(look):
            tube, loose = _tube(
                own[look],
                size[look],
                middle[look],
                half[look],
                P[look],
                N[look],
                AffineForms(follow.v[:, look], follow.r[look]),
                (back * g.r[:, None])[look],
            )
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
            lost = ~finite & np.all(size[look] <= self.singular * self.whole, axis=1)
            axis[look] = np.where(lost, SINGULAR, self._axes(size[look], N[look], F, loose))
        axis[(axis != SINGULAR) & np.all(size <= POSE_BOX_MIN_FRACTION * self.whole, axis=1)] = SMALL
        return own[~gone], size[~gone], axis[~gone]

    def _narrow(self, middle: Array, half: Array) -> tuple[Array, Array]:
        """Return the corners of boxes (c, n) with the joints narrowed by their closed forms."""
        return self.error.narrow(forms_of(middle, half), middle - half, middle + half)

    def _settle(self, tube: list[AffineForms], P: Places, N: Places) -> tuple[Flags, AffineForms]:
        """Return True where a tube holds no solution, and F there."""
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
        """Return the axes across which boxes are cut: that along which F changes most where only N are ``loose`` (c, n)
        and no edge is much longer than the others; else the longest of N, or one of the other loose ones where it is
        longer still: cutting along all axes would give more and smaller pieces of a surface that N determines."""
        share, slopes = size / self.whole, np.abs(np.moveaxis(F.v[1 : 1 + N.shape[1]], 0, -1)).max(axis=1, initial=0.0)
        changes, large = np.zeros(share.shape), share.max(axis=1, keepdims=True) > COARSE_EDGE_MIN_FRACTION
        weight = np.where(loose, np.where(large, DEPENDENT_EDGE_FRACTION, 1.0), 0.0)
        np.put_along_axis(changes, N, np.where(np.isfinite(slopes), slopes, 0.0), 1)
        np.put_along_axis(weight, N, 1.0, 1)
        even = share.max(axis=1) <= BOX_EDGE_RATIO_MAX * np.take_along_axis(share, N, 1).max(axis=1)
        known = even & np.isfinite(F.r).all(axis=1) & changes.any(axis=1) & (loose.sum(axis=1) == N.shape[1])
        return np.where(known, changes.argmax(axis=1), (share * weight).argmax(axis=1))

    def _values(self, forms: list[AffineForms]) -> tuple[AffineForms, AffineForms, AffineForms, list[AffineForms]]:
        """g (c, k), its rates (c, k, n), those of E (c, n), reach margins."""
        (n, k), out = self.error.size, self.error.slopes.together(forms)
        g, M, slope, margins = (
            out[..., part] for part in np.split(np.arange(out.r.shape[1]), [k, k + k * n, k + k * n + n])
        )
        return (
            g,
            AffineForms(M.v.reshape(*M.v.shape[:-1], k, n), M.r.reshape(len(M.r), k, n)),
            slope,
            [margins[..., i] for i in range(margins.r.shape[1])],
        )

    def _unique(self, middle: Array, half: Array, P: Places, wider: float) -> Flags:
        """Boxes (c, n) in which, made ``wider``, exactly one zero is proved, or that there is none in them."""
        n, wide = (
            self.error.size[0],
            np.maximum(
                wider * np.maximum(half, BOX_EDGE_RATIO_MIN * half.max(axis=1, keepdims=True)),
                CRITICAL_BOX_HALF_EDGE_MIN,
            ),
        )
        multipliers, known = self._multipliers(middle, wide, P)
        mu = multipliers.v[0]
        room = np.maximum(
            multipliers.spread.max(axis=1, keepdims=True, initial=0.0), CRITICAL_BOX_HALF_EDGE_MIN
        ) * np.ones_like(mu)
        at, about = np.concatenate([middle, mu], axis=1), np.concatenate([wide, WIDER[0] * room], axis=1)
        shift, reach = self._krawczyk(at, about)
        with np.errstate(all="ignore"):
            one = known & np.all(reach < about, axis=1)
            none = known & np.any((np.abs(shift) - (reach - np.abs(shift)))[:, :n] > half, axis=1)
        for i in np.flatnonzero(one & ~none):
            self.proved.append((at[i], about[i], None))
        return one | none

    def _near_zero(self, middle: Array, half: Array, P: Places) -> Flags:
        """Boxes (c, n) that lie, with their multipliers, in a box about a zero nearby that is proved to be the only one
        there: in the frame of K there, in which what is flat, or what numbers of the file leave open, is one direction,
        however steep the others are (epsilon-inflation). New ones are sought from the smallest boxes alone."""
        smallest = np.all(half <= POSE_BOX_MIN_FRACTION * self.whole, axis=1)
        if not self.flat and not smallest.any():
            return smallest
        own, known = self._with_multipliers(middle, half, P)
        found = known & self._near(own)
        left = np.flatnonzero(known & ~found & smallest)
        if not len(left):
            return found
        x = self._approach(own.v[0, left])
        x = np.where(np.isfinite(x), x, 0.0)
        frame = self._frame(x)
        open_by = ZERO_BOX_INFLATION_FRACTION * self._krawczyk(x, 0 * x, frame)[1]
        own, y = AffineForms(own.v[:, left], own.r[left]), x[:, : middle.shape[1]]
        for times in AROUND:
            cube = np.full(y.shape, times * POSE_BOX_MIN_FRACTION * float(self.whole.max()))
            about = np.maximum(open_by, WIDER[0] * _apart(self._with_multipliers(y, cube, P[left])[0], x, frame))
            with np.errstate(all="ignore"):
                one = np.all(self._krawczyk(x, about, frame)[1] < about, axis=1)
            one &= np.all(_apart(own, x, frame) <= about, axis=1)
            while np.any(new := one & ~found[left]):
                i = int(new.argmax())
                self.proved.append((x[i], about[i], frame[i]))
                found[left] |= self._near(own)
                found[left[i]] = True
        return found

    def _near(self, boxes: AffineForms) -> Flags:
        """Return True for boxes (c, n + k) that lie in one about a flat zero."""
        found = np.zeros(len(boxes.r), dtype=bool)
        for at, about, frame in self.flat:
            found |= np.all(_apart(boxes, at[None], frame[None]) <= about, axis=1)
        return found

    def _with_multipliers(self, middle: Array, half: Array, P: Places) -> tuple[AffineForms, Flags]:
        """Boxes (c, n) with their multipliers, (c, n + k), and whether these are known."""
        found, known = self._multipliers(middle, half, P)
        return stack([*forms_of(middle, half), *(found[..., i] for i in range(found.r.shape[1]))]), known

    def _multipliers(self, middle: Array, wide: Array, P: Places) -> tuple[AffineForms, Flags]:
        """Multipliers (c, k) at critical points in boxes, in the symbols of these, and whether they are known."""
        _, M, slope, _ = self._values(forms_of(middle, 0 * middle))
        back = inverse(columns(M.v[0], P))
        mu = np.nan_to_num(-(np.take_along_axis(slope.v[0], P, 1)[:, None] @ back)[:, 0])
        # over the box μ is μ₀ + δ, with (∇E + μ₀ ∇g)_P + δ ∇g_P = 0
        _, M, slope, _ = self._values(forms_of(middle, wide))
        turned = np.swapaxes(back, 1, 2)
        pull = combine(turned, entries(slope + (M * mu[:, :, None]).sum(-2), P))
        rates = entries(M, P)
        off = bound_contraction(turned, rates.transposed())
        with np.errstate(all="ignore"):
            most = (pull.size.max(axis=1, initial=0.0) / (1 - off.sum(axis=-1).max(axis=1, initial=0.0)))[:, None]
            found = AffineForms(
                -pull.v, (pull.r + np.abs(pull.v[0]) + (off * most[:, None]).sum(axis=-1)) * (1 + BOX_EDGE_ROUNDING_TOL)
            )
        found.v[0] = mu
        known = np.isfinite(found.size).all(axis=1) & np.all(most >= 0, axis=1)
        keep = known[:, None]
        return AffineForms(np.where(keep, found.v, 0.0), np.where(keep, found.r, 1.0)), known

    def _approach(self, x: Array) -> Array:
        """Coordinates and multipliers (c, n + k) after some of Newton's steps."""
        for _ in range(8):
            x = x - self._krawczyk(x, 0 * x)[0]
        return x

    def _frame(self, x: Array) -> Array:
        """Frames (columns) in which the columns of K are at right angles, at places (c, n + k): its right singular
        vectors where multipliers are counted by their size."""
        K, size = self._equations(x, forms_of(x, 0 * x))[1].v[0], np.maximum(1.0, np.abs(x))
        size[:, : self.error.size[0]] = 1.0
        rows = np.linalg.svd(np.where(np.isfinite(K), K, 0.0) * size[:, None])[2]
        return np.asarray(size[:, :, None] * np.swapaxes(rows, 1, 2))

    def _krawczyk(self, at: Array, about: Array, frame: Array | None = None) -> tuple[Array, Array]:
        """Newton's step from coordinates and multipliers (c, n + k), and how far from there the operator over a box
        about them reaches; the box and both in a frame, or in the coordinates themselves."""
        pull, K = self._equations(at, forms_of(at, about, frame))
        if frame is not None:
            K = combine(np.swapaxes(frame, 1, 2), K.transposed()).transposed()
        Y = pseudo_inverse(K.v[0])
        with np.errstate(all="ignore"):
            shift = combine(Y, pull)
            return shift.v[0], bound_image(shift.size, bound_contraction(Y, K), about)

    def _equations(self, at: Array, forms: list[AffineForms]) -> tuple[AffineForms, AffineForms]:
        """(∇E + μ ∇g, g) (c, n + k) at places, and its derivatives over boxes about these."""
        n, k = self.error.size
        g, M, slope, _ = self._values(forms_of(at[:, :n], 0 * at[:, :n]))
        mu = at[:, n:]
        pull = slope + (M * mu[:, :, None]).sum(-2)
        phi = AffineForms(np.concatenate([pull.v, g.v], axis=-1), np.concatenate([pull.r, g.r], axis=-1))
        out = self.error.bends.together(forms)
        # the rates of g along the fields, which multiply μ: those by the coordinates but for a far chart
        rates = self._values(forms[:n])[1]
        c, K = len(at), AffineForms(np.zeros((len(out.v), len(at), n + k, n + k)), np.zeros((len(at), n + k, n + k)))
        K.v[..., :n, :n], K.r[:, :n, :n] = out.v[..., : n * n].reshape(-1, c, n, n), out.r[:, : n * n].reshape(c, n, n)
        K.v[..., n:, :n] = out.v[..., n * n :].reshape(len(out.v), c, k, n)
        K.r[:, n:, :n] = out.r[:, n * n :].reshape(c, k, n)
        along = rates.transposed()
        K.v[..., :n, n:], K.r[:, :n, n:] = along.v, along.r
        return phi, K

    def zeros(self) -> list[CriticalBox]:
        """The zeros that were proved, enclosed; those that may be at no finite place are left open."""
        if not self.proved:
            return []
        n, far = self.error.size[0], self.error.far
        at, room, frame = self._rooms()
        x, reach, left, back = self._approach(at), room.copy(), np.arange(len(at)), inverse(frame)
        apart = np.abs(back @ (x - at)[..., None])[..., 0]
        for radius in CRITICAL_BOX_HALF_EDGE_MIN * 4.0 ** np.arange(8):
            found = self._krawczyk(x[left], np.full(x[left].shape, radius), frame[left])[1]
            done = np.all((found < radius) & (apart[left] + radius <= room[left]), axis=1)
            reach[left[done]] = found[done]
            left = left[~done]
            if not len(left):
                break
        if len(left):
            # nearly flat ones: the operator over the room holds the zero, and again over what it reaches
            inside = np.all(apart[left] <= room[left], axis=1)[:, None]
            x[left], own = np.where(inside, x[left], at[left]), frame[left]
            reach[left] = np.fmin(room[left], self._krawczyk(at[left], room[left], own)[1]) + np.where(
                inside, apart[left], 0.0
            )
            for _ in range(8):
                reach[left] = np.fmin(reach[left], self._krawczyk(x[left], reach[left], own)[1])
        if far is not None:
            along, most = (hull(each, frame) for each in (reach, room))
            endless = np.abs(x[:, far]) <= along[:, far]
            self.left += [(at[i, :n], most[i, :n]) for i in np.flatnonzero(endless)]
            x, reach, frame = x[~endless], reach[~endless], frame[~endless]
        return self._report(x, reach, frame) if len(x) else []

    def _rooms(self) -> tuple[Array, Array, Array]:
        """All boxes in which exactly one zero is proved: their middles (c, n + k), the room in frames, and these."""
        plain = [(at, room, np.eye(len(at))) for at, room, frame in self.proved if frame is None]
        at, room, frame = (np.array(each) for each in zip(*plain, *self.flat, strict=True))
        return at, room, frame

    def _report(self, x: Array, reach: Array, frame: Array) -> list[CriticalBox]:
        """Return the critical points of boxes in frames with one zero each."""
        (n, k), error, far, forms = self.error.size, self.error.error, self.error.far, forms_of(x, reach, frame)
        K, forms, radius = self._equations(x, forms)[1], forms[:n], hull(reach, frame)
        if far is not None:
            # rates by the turn itself, so that K is symmetric at the zero
            for place in self.error.turning:
                row = K[..., place, :] * forms[far].padded(len(K.v))[..., None]
                K.v[..., place, :], K.r[:, place] = row.v, row.r
        falling = negative(K) - k
        e, u = self.error.errors.together(forms), self.error.directions.together(forms_of(x[:, :n], 0 * x[:, :n]))
        least, most = np.maximum(np.maximum(e.low, -e.high), 0.0), e.size
        p, R = self.error.pose(x[:, :n])
        low, high = self.error.enclose_chart(x[:, :n], radius[:, :n])
        return [
            CriticalBox(
                error.length * p[i],
                R[i],
                (low[i] + high[i]) / 2,
                (high[i] - low[i]) / 2,
                (float(np.linalg.norm(least[i])), float(np.linalg.norm(most[i]))),
                int(falling[i]) if falling[i] >= 0 else None,
                u.v[0, i].reshape(-1, 3),
            )
            for i in range(len(x))
        ]


def forms_of(middle: Array, half: Array, frame: Array | None = None) -> list[AffineForms]:
    """The coordinates of boxes (c, n), in a frame (columns) or as they are, and what cutting and narrowing them may
    have rounded."""
    off = AFFINE_ROUNDING * (1 + np.abs(middle))
    edges = half[:, None] * (np.eye(middle.shape[1]) if frame is None else frame)
    return [make_affine(middle[:, i], edges[:, i], off[:, i]) for i in range(middle.shape[1])]


def hull(half: Array, frame: Array) -> Array:
    """Return the half edges, in the coordinates themselves, of boxes (c, n) in frames."""
    return np.asarray((np.abs(frame) @ half[..., None])[..., 0] * (1 + BOX_EDGE_ROUNDING_TOL))


def _apart(boxes: AffineForms, at: Array, frame: Array) -> Array:
    """Return the distance of boxes from places (c, n), in frames."""
    apart, back = AffineForms(boxes.v.copy(), boxes.r), inverse(frame)
    apart.v[0] -= at
    with np.errstate(all="ignore"):
        size = combine(back, apart).size
        # s = back (z − at) + (1 − back frame) s
        off = (np.abs(np.eye(frame.shape[-1]) - back @ frame) + AFFINE_ROUNDING * (np.abs(back) @ np.abs(frame))).sum(
            axis=-1
        )
        left = 1 - off.max(axis=1)
        return np.asarray(size + off * np.where(left > 0, size.max(axis=1) / left, np.inf)[:, None])


def _narrow_symbols(g: AffineForms, P: Places | None = None) -> tuple[Array, Array]:
    """Return the ranges in [−1, 1] of the symbols (c, n) that equations g (c, k) = 0 allow; those ``P`` alone of one
    equation each, in which it has the coefficient 1."""
    J = np.moveaxis(g.v[1:], 0, -1)
    size = np.abs(J)
    if P is not None:
        size = np.where(np.arange(size.shape[2]) == P[:, :, None], size, 0.0)
    rest = np.abs(J).sum(axis=2, keepdims=True) - np.abs(J) * (size > 0) + g.r[:, :, None]
    with np.errstate(all="ignore"):
        far = np.where(size > 0, rest * (1 + BOX_EDGE_ROUNDING_TOL) / size, np.inf) + BOX_EDGE_ROUNDING_TOL
        at = np.where(size > 0, -g.v[0][:, :, None] / J, 0.0)
    far, at = np.where(np.isfinite(far) & np.isfinite(at), far, np.inf), np.where(np.isfinite(at), at, 0.0)
    return (at - far).max(axis=1, initial=-1.0), (at + far).min(axis=1, initial=1.0)


def _tube(
    middle: Array, half: Array, old: Array, edges: Array, P: Places, N: Places, follow: AffineForms, doubts: Array
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
        along, doubt = (
            -wide[:, :, None] * np.concatenate([J * ratio[:, None], doubts], 2),
            wide * (follow.r + BOX_EDGE_ROUNDING_TOL),
        )
        rounded = wide * (np.maximum(follow.r - np.abs(doubts).sum(axis=2), 0.0) + 2 * BOX_EDGE_ROUNDING_TOL)
    plain = np.take_along_axis(half, P, 1)
    good = np.isfinite(doubt) & np.isfinite(at) & np.isfinite(along).all(axis=-1) & (doubt < plain)
    centre = middle.copy()
    np.put_along_axis(centre, P, np.where(good, at, np.take_along_axis(middle, P, 1)), 1)
    np.put_along_axis(slopes, P[:, :, None], np.where(good[:, :, None], along, 0.0), 1)
    np.put_along_axis(radius, P, np.where(good, rounded, plain), 1)
    loose = np.ones((c, n), dtype=bool)
    np.put_along_axis(loose, P, ~(good & (doubt < NARROWED_EDGE_FRACTION * plain)), 1)
    return [make_affine(centre[:, i], slopes[:, i], radius[:, i]) for i in range(n)], loose
