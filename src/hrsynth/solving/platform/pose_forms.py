"""Conditions on a pose as forms in a quaternion, and all their common zeros proposed by linear algebra.

Planes with fixed normals give p from R, but for m coordinates s. With q · q = 1 a condition of degree d in (R, p) is a
form of degree 2 d in (q, s), q of degree one and s of degree two; n = 3 + m of them have at most Π 2 dᵢ / 2ᵐ isolated
zeros (Bézout in the weighted projective space). Those with w = q · q = 0 are no poses. In a plane q has two coordinates
and p has two.

The forms of degree t, as functions on random points, are spanned by an orthonormal basis; what vanishes on the
multiples of all conditions is the space of functionals that the zeros span, that of the poses where it is restricted to
multiples of wᵏ. Multiplication by a linear form of q has the poses as eigenvectors (H. J. Stetter 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from math import prod

import numpy as np

from ...geometry.ranks import decompose_matrix
from ...geometry.vectors import Array, build_plane_axes, cross
from .pose_conditions import OnPlane, PoseCondition

FORM_PIVOT_MIN_FRACTION = 1e-11
"""Relative pivot that counts in the rank of a matrix of multiples of conditions."""
INDEPENDENT_RATES_MIN = 1e-6
"""Least singular value of the unit rates of independent conditions at the goal."""

INDEPENDENT_PLANES_SINE_MIN = 1e-3
"""Least sine between a plane's normal and the span of the other normals that determine the position."""
EXTRANEOUS_QUATERNION_TOL = 1e-5
"""|q · q| of a unit quaternion below which it is extraneous."""

RANDOM_COORDINATE_MAX = 1.5
"""Range of the random s (sizes), of either sign."""
POINTS_PER_FORM_FRACTION = 1.15
"""Points for each form."""


def _make_tensor() -> Array:
    """T with R_ik = Σ T[i, k, a, b] q_a q_b for a unit quaternion; symmetric in a and b; shape (3, 3, 4, 4)."""
    T = np.zeros((3, 3, 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        T[i, i] = np.diag([1.0, *(1.0 if n == i else -1.0 for n in range(3))])
        for row, column, sign in ((i, j, -1.0), (j, i, 1.0)):
            T[row, column, 1 + i, 1 + j] = T[row, column, 1 + j, 1 + i] = 1.0
            T[row, column, 0, 1 + k] = T[row, column, 1 + k, 0] = sign
    return T


ROTATION = _make_tensor()


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses with the quaternion ``turns`` y, turns (4, a), and the position ``moves`` z, moves (3, k)."""

    turns: Array
    moves: Array

    @classmethod
    def spatial(cls) -> Poses:
        """All poses."""
        return cls(np.eye(4), np.eye(3))

    @classmethod
    def planar(cls, n: Array) -> Poses:
        """Poses in a plane with a normal."""
        return cls(np.array([[1.0, 0.0], *([0.0, v] for v in n)]), np.column_stack([*build_plane_axes(n)]))

    @classmethod
    def translating(cls) -> Poses:
        """Poses with the rotation of the goal."""
        return cls(np.eye(4, 1), np.eye(3))

    @property
    def motion(self) -> str:
        """Their name."""
        return {1: "translations", 2: "planar", 4: "spatial"}[self.turns.shape[1]]

    @property
    def freedoms(self) -> int:
        """Number of dof."""
        return int(self.turns.shape[1] - 1 + self.moves.shape[1])

    def rates(self, condition: PoseCondition) -> Array:
        """Return the derivative of a condition at the goal by the dof; shape (dof,)."""
        along, turned = condition.slopes(condition.b, condition.c, np.asarray)
        moment = cross(condition.b, along) + cross(condition.c, turned)
        return np.hstack([along @ self.moves, moment @ self.turns[1:, 1:]])

    def rotations(self, y: Array) -> Array:
        """R for coordinates (n, a), complex ones too, of unit quaternions; shape (n, 3, 3)."""
        q = y @ self.turns.T
        return np.asarray(np.einsum("ikab,na,nb->nik", ROTATION, q, q))


@dataclass(frozen=True, eq=False)
class SquareForms:
    """As many conditions as poses have dof: ``planes`` that give p, but for m coordinates along ``free`` (k, m), and
    the ``others``."""

    poses: Poses
    planes: tuple[OnPlane, ...]
    free: Array
    others: tuple[PoseCondition, ...]

    @classmethod
    def of(cls, conditions: Sequence[PoseCondition], poses: Poses) -> SquareForms | None:
        """The planes that meet most squarely, then conditions of least degree that are independent at the goal; None
        where they are too few."""
        planes, rest, basis = list[OnPlane](), list(conditions), np.zeros((0, poses.moves.shape[1]))
        while len(planes) < poses.moves.shape[1]:
            normals = {k: c.n @ poses.moves for k, c in enumerate(rest) if isinstance(c, OnPlane)}
            across = {k: n - basis.T @ (basis @ n) for k, n in normals.items()}
            best = max(across, key=lambda k: (round(float(np.linalg.norm(across[k])), 9), -k), default=-1)
            if best < 0 or (size := float(np.linalg.norm(across[best]))) < INDEPENDENT_PLANES_SINE_MIN:
                break
            basis = np.vstack([basis, across[best] / size])
            plane = rest.pop(best)
            assert isinstance(plane, OnPlane)
            planes.append(plane)
        rows = np.array([poses.rates(c) for c in planes]).reshape(-1, poses.freedoms)
        others = list[PoseCondition]()
        for condition in sorted(rest, key=lambda c: c.degree):
            rate = poses.rates(condition)
            more = np.vstack([rows, rate / max(float(np.linalg.norm(rate)), INDEPENDENT_RATES_MIN)])
            if len(rows) < poses.freedoms and np.linalg.svd(more, compute_uv=False)[-1] > INDEPENDENT_RATES_MIN:
                rows, others = more, [*others, condition]
        if len(rows) < poses.freedoms:
            return None
        free = np.linalg.svd(np.vstack([basis, np.zeros((1, basis.shape[1]))]))[2][len(planes) :].T
        return cls(poses, tuple(planes), free, tuple(others))

    @property
    def degrees(self) -> tuple[int, ...]:
        """The degrees of the forms."""
        return tuple(2 * c.degree for c in self.others)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of coordinates of degree one and of degree two."""
        return self.poses.turns.shape[1], self.free.shape[1]

    @property
    def most(self) -> int:
        """Bound of the isolated zeros."""
        return int(prod(self.degrees)) // 2 ** self.shape[1]

    @property
    def degree(self) -> int:
        """An even degree from which on, were all zeros isolated, there are as many functionals as zeros, in the degree
        below too."""
        a, m = self.shape
        t = sum(self.degrees) - a - 2 * m + 2
        return t + t % 2

    @property
    def size(self) -> int:
        """Number of forms of that degree."""
        return len(list_exponents(self.shape, self.degree))

    @cached_property
    def system(self) -> Array:
        """Map from the heights of the planes and s to z; shape (k, k)."""
        return np.vstack([*(c.n @ self.poses.moves for c in self.planes), self.free.T])

    def position(self, R: Array, s: Array) -> Array:
        """p (n, 3) of turns (n, 3, 3) and free coordinates (n, m)."""
        heights = [c.h - np.einsum("nij,i,j->n", R, c.n, c.b) for c in self.planes]
        return np.asarray(np.column_stack([*heights, s]) @ np.linalg.inv(self.system).T @ self.poses.moves.T)

    def values(self, R: Array, p: Array) -> list[Array]:
        """The values (n,) of the other conditions at poses."""
        return [c.value(p + R @ c.b, R @ c.c, np.asarray) for c in self.others]


@lru_cache(maxsize=64)
def list_exponents(shape: tuple[int, int], t: int) -> Array:
    """The exponents of q and s in the monomials of a degree; shape (n, a + m)."""
    a, m = shape
    exponents = [
        (*first, r - sum(first), *s)
        for s in product(range(t // 2 + 1), repeat=m)
        if (r := t - 2 * sum(s)) >= 0
        for first in product(range(r + 1), repeat=a - 1)
        if sum(first) <= r
    ]
    return np.array(exponents, dtype=int).reshape(-1, a + m)


@lru_cache(maxsize=16)
def _sample_points(shape: tuple[int, int], count: int) -> tuple[Array, Array]:
    """Random unit vectors (n, a) and free coordinates (n, m)."""
    rng = np.random.default_rng(0)
    y = rng.normal(size=(count, shape[0]))
    return y / np.linalg.norm(y, axis=1)[:, None], rng.uniform(
        -RANDOM_COORDINATE_MAX, RANDOM_COORDINATE_MAX, size=(count, shape[1])
    )


@lru_cache(maxsize=64)
def _build_basis(shape: tuple[int, int], t: int, count: int) -> Array:
    """Orthonormal values (points, forms) of the forms of a degree."""
    x = np.hstack(_sample_points(shape, count))
    values = np.prod(x[:, None, :] ** list_exponents(shape, t)[None], axis=2)
    return np.asarray(np.linalg.qr(values / np.linalg.norm(values, axis=0))[0])


@lru_cache(maxsize=64)
def _build_products(shape: tuple[int, int], t: int, count: int, what: str) -> Array:
    """Multiplication of lower forms by each of what is named: y, s, or w = 1 on the points; (n, lower forms, forms)."""
    y, s = _sample_points(shape, count)
    by = {"y": y.T, "s": s.T, "w": np.ones((1, count))}[what]
    high, low = _build_basis(shape, t, count), _build_basis(shape, t - (1 if what == "y" else 2), count)
    return np.array([(low * factor[:, None]).T @ high for factor in by]).reshape(-1, low.shape[1], high.shape[1])


def propose_poses(forms: SquareForms, t: int, number: int, k: int) -> tuple[Array, Array] | None:
    """Return all poses to rounding, from the forms of degree t, ``number`` of them on the multiples of wᵏ: coordinates
    y (n, a), of unit quaternions, complex, and positions (n, 3); None if they are not separated, or if there are more
    functionals than isolated zeros could span: some zeros are not isolated, and then these are fewer."""
    from scipy.linalg import lstsq, qr

    shape = forms.shape
    size = len(list_exponents(shape, t))
    count = int(POINTS_PER_FORM_FRACTION * size) + 10
    y, s = _sample_points(shape, count)
    high, R = _build_basis(shape, t, count), forms.poses.rotations(y)
    rows = [
        (_build_basis(shape, t - degree, count) * (values / np.abs(values).max())[:, None]).T @ high
        for values, degree in zip(forms.values(R, forms.position(R, s)), forms.degrees, strict=True)
    ]
    space = np.eye(size)
    if rows:
        Q, upper, _ = qr(np.vstack(rows).T, pivoting=True)
        pivots = np.abs(np.diag(upper))
        space = Q[:, int(np.sum(pivots > FORM_PIVOT_MIN_FRACTION * pivots[0])) :]
    for step in range(k):
        space = _build_products(shape, t - 2 * step, count, "w")[0] @ space
    if space.shape[1] < number or (not k and space.shape[1] > number):
        return None
    if k:
        space = decompose_matrix(space)[0][:, :number]
    t -= 2 * k
    by_w, by_s = (_build_products(shape, t, count, what) @ space for what in "ws")
    shifted = _build_products(shape, t, count, "y") @ space if shape[0] > 1 else np.concatenate([by_w, by_s])
    first, second = np.einsum("cj,jnd->cnd", np.random.default_rng(1).normal(size=(2, len(shifted))), shifted)
    _, X = np.linalg.eig(lstsq(first, second)[0])
    if shape[0] > 1:
        at = first @ X
        values = np.einsum("nd,jnd->dj", at.conj(), shifted @ X)
        values = values / np.linalg.norm(values, axis=1)[:, None]
    else:
        values = np.ones((space.shape[1], 1), dtype=complex)
    norms = np.sum(values * values, axis=1)
    real = np.abs(norms) > EXTRANEOUS_QUATERNION_TOL
    unit = by_w[0] @ X[:, real]
    free = [np.sum(unit.conj() * s, axis=0) / np.sum(unit.conj() * unit, axis=0) for s in by_s @ X[:, real]]
    values = values[real] / np.sqrt(norms[real])[:, None]
    return values, forms.position(forms.poses.rotations(values), np.array(free).reshape(shape[1], len(values)).T)
