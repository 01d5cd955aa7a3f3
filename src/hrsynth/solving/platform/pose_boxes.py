"""Poses that meet conditions, enclosed: proposed in floats, each proved in balls.

The unknowns are the coordinates y of a unit quaternion and those of the position z: in space seven, with q · q = 1 and
six conditions. Each pose that is proposed is enclosed (Krawczyk), complex ones too, for all input within its error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import BOX_SEPARATION_TOL, NUMBER_ROUNDING
from ..krawczyk import Polynomial, enclose_zero
from ..newton import approach_zeros
from .pose_conditions import PoseCondition
from .pose_forms import ROTATION, Poses, SquareForms

NEARLY_REAL_POSE_TOL = 1e-9
"""Imaginary parts of a proposed pose below which a real one is searched."""

POSE_BOX_BITS_COUNT = 128
"""Bits of the enclosures."""
COMPLEX_ZERO_IMAGINARY_MIN = 1.0
"""Imaginary part of a coordinate, or of an angle, from which on a zero is not taken for a real one with other last
digits."""
PROPOSAL_NEWTON_STEPS_COUNT = 4
"""Steps that make a proposal as good as floats allow."""


@dataclass(frozen=True, eq=False)
class Zero:
    """The equation of a condition in (q, p), with numbers in balls."""

    condition: PoseCondition
    poses: Poses
    slack: float | None
    """Difference of a number from the exact one (sizes); None: the numbers are exact."""

    @cached_property
    def _tensors(self) -> tuple[Any, Any]:
        """M with x = p + y M y, and that of d; shape (3, a, a)."""
        E = self.poses.turns
        T = np.einsum("ikab,ac,bd->ikcd", ROTATION, E, E) if E.shape[1] < 4 else ROTATION.astype(int)
        T = self.of(T) if E.shape[1] < 4 else T.astype(object)
        return tuple(np.einsum("ikab,k->iab", T, self.of(v)) for v in (self.condition.b, self.condition.c))

    @cached_property
    def _moves(self) -> Any:
        """The position of its coordinates; shape (3, k)."""
        return self.of(self.poses.moves) if self.poses.moves.shape[1] < 3 else np.eye(3, dtype=int).astype(object)

    def of(self, values: Array) -> Any:
        """Numbers as balls."""
        from flint import arb

        slack = self.slack
        flat = np.array(
            [
                arb(v) if slack is None else arb(v, slack + NUMBER_ROUNDING * (1.0 + abs(v)))
                for v in np.ravel(values).tolist()
            ],
            dtype=object,
        )
        return flat.reshape(np.shape(values)) if np.shape(values) else flat[0]

    @cached_property
    def _profile(self) -> float:
        """Factor by which the numbers of a profile are less exact than others."""
        f = getattr(self.condition, "f", None)
        return 1.0 if f is None else (1.0 + float(np.abs(f).sum())) ** 1.5

    def _at(self, x: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
        turned = self.poses.turns.shape[1]
        y, p = np.array(x[:turned], dtype=object), self._moves @ np.array(x[turned:], dtype=object)
        by = [M @ y for M in self._tensors]
        return p + by[0] @ y, by[1] @ y, by[0], by[1]

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        point, arrow, *_ = self._at(x)
        return self.condition.value(point, arrow, self._of)

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        point, arrow, by_x, by_d = self._at(x)
        along, turned = self.condition.slopes(point, arrow, self._of)
        return [*(2 * (along @ by_x + turned @ by_d)), *(along @ self._moves)]

    def _of(self, values: Array) -> Any:
        if self.slack is not None and values is getattr(self.condition, "f", None):
            from flint import arb

            return np.array(
                [arb(float(v), (self.slack + NUMBER_ROUNDING) * self._profile) for v in values], dtype=object
            )
        return self.of(values)


@dataclass(frozen=True)
class UnitLength:
    """The squares of some unknowns, by their numbers, add up to 1: of a quaternion, of a cosine and a sine."""

    places: Sequence[int]

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return sum(x[k] * x[k] for k in self.places) - 1

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        return [2 * v if k in self.places else 0 * v for k, v in enumerate(x)]


@dataclass(frozen=True, eq=False)
class PoseBox:
    """A pose enclosed: the middle of (y, z), complex where it is not ``real``, and the radii; ``turned`` of the
    coordinates are those of the quaternion."""

    middle: Array
    radii: Array
    real: bool
    box: tuple[Any, ...]
    turned: int
    rounded: bool = False
    """True if it is proved for the rounded geometry alone: far from real."""

    def alike(self, x: Array) -> Array:
        """A pose with q and with -q, which are one; shape (2, n)."""
        return np.array([x, np.r_[-x[: self.turned], x[self.turned :]]])

    def pose(self, poses: Poses) -> tuple[Array, Array]:
        """The quaternion (4,) and the position (3,) at the middle of a real box."""
        x = self.middle.real
        return poses.turns @ x[: self.turned], poses.moves @ x[self.turned :]

    def has_pose(self, x: Array) -> bool:
        """Return True if a pose is in it."""
        return bool(np.any(np.all(np.abs(self.alike(x) - self.middle) <= self.radii, axis=1)))

    def is_disjoint_from(self, others: Sequence[PoseBox]) -> bool:
        """Return True if no pose is in this one and in one of the others."""
        if not others:
            return True
        radii = self.radii + np.array([box.radii for box in others])
        far = np.abs(np.array([box.middle for box in others]) - self.alike(self.middle)[:, None]) > radii
        return bool(np.all(np.any(far, axis=2)))


def refine_poses(forms: SquareForms, y: Array, p: Array) -> Array:
    """Newton's method on proposals (n, a) and (n, 3), all at once; (n, a + k)."""
    conditions, poses = (*forms.planes, *forms.others), forms.poses
    E, moves = poses.turns, poses.moves
    M = [[np.einsum("ikab,k,ac,bd->icd", ROTATION, v, E, E) for v in (c.b, c.c)] for c in conditions]
    turned = E.shape[1]

    def evaluate(x: Array) -> tuple[Array, Array]:
        y, p = x[:, :turned], x[:, turned:] @ moves.T
        F, J = [np.sum(y * y, axis=1) - 1.0], [np.hstack([2.0 * y, 0.0 * x[:, turned:]])]
        for c, (b, a) in zip(conditions, M, strict=True):
            by_x, by_d = (np.einsum("iab,nb->nia", T, y) for T in (b, a))
            at, d = p + np.einsum("nia,na->ni", by_x, y), np.einsum("nia,na->ni", by_d, y)
            along, across = c.slopes(at, d, np.asarray)
            F.append(c.value(at, d, np.asarray))
            turning = np.einsum("ni,nia->na", along, by_x) + np.einsum("ni,nia->na", across, by_d)
            J.append(np.hstack([2.0 * turning, along @ moves]))
        return np.stack(F, axis=1), np.stack(J, axis=1)

    return approach_zeros(evaluate, np.hstack([y, p @ moves]), steps=PROPOSAL_NEWTON_STEPS_COUNT).x


def enclose_poses(
    forms: SquareForms, slack: float, proposed: tuple[Array, Array], needed: int = 0
) -> tuple[list[PoseBox], int]:
    """Boxes of poses, each with one for all input within the slack (sizes), no two with the same; and how many
    proposals had none. Poses far from real ones may have a box for the numbers as they are alone. Where no ``needed``
    ones can be found any more, the others are not looked for."""
    from flint import acb, arb, ctx

    turned = forms.poses.turns.shape[1]
    conditions = (*forms.planes, *forms.others)
    equations, exact = (
        list[Polynomial]([UnitLength(range(turned)), *(Zero(c, forms.poses, errors) for c in conditions)])
        for errors in (slack, None)
    )
    boxes: list[PoseBox] = []
    lost = 0
    with ctx.workprec(POSE_BOX_BITS_COUNT):
        for number, x in enumerate(refine_poses(forms, *proposed)):
            if lost and len(boxes) + len(proposed[0]) - number < needed:
                break
            real = bool(np.abs(x.imag).max() < NEARLY_REAL_POSE_TOL)
            model = None if real else find_box_at([box for box in boxes if not box.real], x.conj())
            if model is not None:
                candidate: PoseBox | None = replace(model, middle=model.middle.conj())
            elif np.all(np.isfinite(x)):
                start = [arb(v) for v in x.real.tolist()] if real else [acb(v.real, v.imag) for v in x.tolist()]
                candidate = make_box(enclose_zero(equations, start), real, turned)
                if candidate is None and turned == 4 and np.abs(x.imag).max() > COMPLEX_ZERO_IMAGINARY_MIN:
                    candidate = make_box(enclose_zero(exact, start), False, turned)
                    candidate = None if candidate is None else replace(candidate, rounded=True)
            else:
                candidate = None
            if candidate is None:
                lost += 1
            elif candidate.is_disjoint_from(boxes):
                boxes.append(candidate)
    return boxes, lost


def find_box_at(boxes: Sequence[PoseBox], x: Array) -> PoseBox | None:
    """The first box of which a pose is the middle to rounding."""
    if not boxes:
        return None
    same = np.abs(np.array([box.middle for box in boxes]) - boxes[0].alike(x)[:, None]) <= (
        NEARLY_REAL_POSE_TOL * (1.0 + np.abs(x))
    )
    places = np.nonzero(np.any(np.all(same, axis=2), axis=0))[0]
    return boxes[places[0]] if len(places) else None


def describe_far(boxes: Iterable[PoseBox]) -> str:
    """Return the number proved for the rounded geometry alone, as text."""
    far = sum(box.rounded for box in boxes)
    return f", {far} far from real ones for the rounded geometry" if far else ""


def make_box(box: Sequence[Any] | None, real: bool, turned: int) -> PoseBox | None:
    """A box with its radii made a little larger; None where there is none, or a complex one may hold a real pose."""
    if box is None:
        return None
    middle = np.array([complex(v.mid()) for v in box])
    radii = np.array([float(v.rad()) if real else float(v.real.rad()) + float(v.imag.rad()) for v in box])
    radii = radii * (1.0 + BOX_SEPARATION_TOL) + BOX_SEPARATION_TOL * np.abs(middle)
    if not real and np.all(np.abs(middle.imag) <= radii):
        return None
    return PoseBox(middle, radii, real, tuple(box), turned)


def is_box_excluded(conditions: Sequence[PoseCondition], poses: Poses, box: PoseBox, slack: float) -> bool:
    """Return True if one of the conditions is met nowhere in a box, for all input within the slack."""
    from flint import ctx

    with ctx.workprec(POSE_BOX_BITS_COUNT):
        return any(not Zero(c, poses, slack).value(box.box).contains(0) for c in conditions)
