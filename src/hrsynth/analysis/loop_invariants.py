"""Incidences that every motion preserves, to first order, at a random instance: the loop-invariant ones.

F is the irreducible family of geometries with all proposed incidences (:mod:`.instances`), A(g) the constraints of a
member g. Motions change the geometry by ġ = D(g) q̇. If ġ preserves all incidences to first order for all q̇ ∈ ker A(g)
at almost all g ∈ F, then D ker A is a field of tangent spaces of F, of constant dimension where the ranks are the
generic ones, and the paths that follow it stay in F while all loops stay closed. From such a g the mechanism moves with
mobility dim ker A within F, and not otherwise. So incidences that hold at one such configuration hold on the whole
branch, and T_qC = ker A there.

The first-order condition is a polynomial identity in the numbers of which an instance is made. It is tested at
instances, in whole numbers: one that fails refutes it, one that passes is wrong with a probability of at most the
identity's degree divided by the range of the numbers (Schwartz and Zippel), of which :func:`bound_degree` is a bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import groupby

import numpy as np

from ..geometry.vectors import Numbers, cross, dot, scale_to_whole
from ..mechanism.incidences import Incidences
from ..mechanism.structural_incidences import GeometricIncidence
from .instances import Instance


def find_invariant_incidences(
    every: Sequence[GeometricIncidence], relations: Incidences, found: Instance
) -> list[bool]:
    """Return the incidences that all motions of an instance preserve to first order."""
    moving = _InstanceMotion(relations, found)
    return [answer for _, group in groupby(every, key=_classify_incidence) for answer in moving.keeps(list(group))]


def bound_degree(relations: Incidences, rates: int) -> int:
    """A bound of the degree of the identities, and of all minors of a mechanism's maps, in the numbers drawn.

    Directions are minors of the rows that they obey, centres minors of the rows of all incidences, motions minors of
    the constraints on the ``rates`` of the joints.
    """
    axes: list[int] = []
    for conditions in relations.tower:
        axes.append(1 + sum(sorted(sum(axes[c] for c in by) for by in conditions)[-2:]))
    rows = [
        size * axes[c]
        for each in relations.incidences
        for c in each.classes
        for size in ((1, 2) if each.kind == "parallel" else (1,))
    ]
    centre = 1 + sum(sorted(rows)[-3 * relations.count :])
    return (rates + 5) * (centre + max(axes, default=0))


def _classify_incidence(tie: GeometricIncidence) -> tuple[str, int, int]:
    """Relations of one shape are tested together."""
    return tie.kind if tie.sight is None else tie.sight.kind, len(tie.classes), len(tie.terms)


class _InstanceMotion:
    """The geometry of an instance and its rates along a basis of ker A, centres and velocities of points times a common
    factor: values (…, 3, 1), rates (…, 3, mobility)."""

    def __init__(self, relations: Incidences, found: Instance) -> None:
        drawn = found.geometry
        centres, factor = scale_to_whole(drawn.centres.ravel())
        self.twists = found.twists()
        self.D = np.array([scale_to_whole(direction)[0] for direction in drawn.directions]).reshape(-1, 3, 1)
        turns = np.array([self.twists[links[0]][3:] for links in relations.fixed])
        self.dD = _cross(turns.reshape(len(self.D), 3, found.mobility), self.D)
        self.P = centres.reshape(-1, 3, 1)
        at = np.array([self.twists[host] for host in relations.hosts]).reshape(len(self.P), 6, found.mobility)
        self.dP = factor * at[:, :3] + _cross(at[:, 3:], self.P)

    def keeps(self, alike: list[GeometricIncidence]) -> list[bool]:
        """The answers for relations of one shape."""
        return [not rate.any() for rate in self._rates(alike)]

    def _rates(self, alike: list[GeometricIncidence]) -> Numbers:
        """The rates of values that vanish where the relations hold."""
        classes = np.array([tie.classes for tie in alike], dtype=int).T
        D, dD = [self.D[c] for c in classes], [self.dD[c] for c in classes]
        match alike[0].kind:
            case "same":
                spin = np.array(
                    [self.twists[other][3:] - self.twists[first][3:] for first, other in (tie.links for tie in alike)]
                )
                return _cross(spin, D[0])
            case "square":
                return _derive_product_rate(_dot, D[0], dD[0], D[1], dD[1])
            case "plane":
                return _derive_product_rate(
                    _dot, _cross(D[0], D[1]), _derive_product_rate(_cross, D[0], dD[0], D[1], dD[1]), D[2], dD[2]
                )
            case "seen":
                return self._directions(alike, D, dD)
        numbers = np.array([[number for number, _ in tie.terms] for tie in alike])
        signs = np.array([[sign for _, sign in tie.terms] for tie in alike])[..., None, None]
        S, dS = (signs * self.P[numbers]).sum(axis=1), (signs * self.dP[numbers]).sum(axis=1)
        match alike[0].kind:
            case "zero":
                return np.asarray(dS)
            case "parallel":
                return _derive_product_rate(_cross, S, dS, D[0], dD[0])
            case _:
                return _derive_product_rate(_dot, S, dS, D[0], dD[0])

    def _directions(self, alike: list[GeometricIncidence], D: list[Numbers], dD: list[Numbers]) -> Numbers:
        """(ẇ − ω × w) × w of observed directions w."""
        sights = [tie.sight for tie in alike if tie.sight is not None]
        if sights[0].kind == "normal":
            w, dw = _cross(D[0], D[1]), _derive_product_rate(_cross, D[0], dD[0], D[1], dD[1])
        else:
            one, two = np.array([sight.points for sight in sights]).T
            w, dw = self.P[two] - self.P[one], self.dP[two] - self.dP[one]
        if sights[0].kind == "foot":
            aside, rate = _cross(w, D[0]), _derive_product_rate(_cross, w, dw, D[0], dD[0])
            w, dw = _cross(D[0], aside), _derive_product_rate(_cross, D[0], dD[0], aside, rate)
        spin = np.array([self.twists[tie.links[0]][3:] for tie in alike])
        return _cross(dw - _cross(spin, w), w)


def _derive_product_rate(
    times: Callable[[Numbers, Numbers], Numbers], a: Numbers, da: Numbers, b: Numbers, db: Numbers
) -> Numbers:
    """The rate of a bilinear product."""
    return np.asarray(times(da, b) + times(a, db))


_cross, _dot = partial(cross, axis=-2), partial(dot, axis=-2)
