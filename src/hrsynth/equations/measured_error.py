"""The error that a loop decreases, E = ½ ‖e‖², and the closed loops on which it does, in joint coordinates: values,
gradients and Hessians, for many floats or affine forms at once.

The law commands q̇ = −λ B (L U B)⁺ e with B a basis of the motions of the closed loops: its equilibria are exactly
where Bᵀ ∇E = 0, at the critical points of E on the configurations G(q) = 0. With multipliers these are the zeros of
∇E + DGᵀ μ beside G (docs/pages/proofs.md, section 11). Of a direction e = u × u_d, so that its part of E is
½ (1 − (u · u_d)²).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from ..geometry.affine import compute_cross_forms, stack
from ..geometry.jets import Jet, compute_jet_angle
from ..geometry.so3 import convert_vectors_to_rotations
from ..geometry.vectors import Array, cross, transform
from ..kinematics.configuration import ClosedConfiguration, measure
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism.cameras import CameraObservation
from ..mechanism.observation import Observation
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.observations.encoder import AngleEncoder, SlideEncoder
from ..results import Value
from ..tolerances import RANK_CUTOFF_FRACTION
from .carried_vectors import Product, SweptChains, Total, add_bend, add_slope, build_row_product, compute_outer_product
from .joint_equations import CouplingEquation, JointLoop, LoopRow, LoopSystem, build_loop_system

Row = tuple[JointLoop, LoopRow]


class ErrorTerm(Protocol):
    """A part of E of one observation."""

    def add(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """Add its value, gradient and Hessian."""


@dataclass(eq=False)
class ErrorSums:
    """E (c,), ∇E (c, N) and, if requested, ∇²E (c, N, N), and JᵀJ (c, N, N), J the rates of e."""

    value: Any
    slope: Total
    bend: Total | None = None
    gram: Total | None = None

    def add_square(self, e: Any, slope: Any, bends: Sequence[tuple[Product, Any]] = ()) -> None:
        """Add ½ e², for e with the gradient ``slope`` (c, N) and the Hessian that is the sum of those of products, each
        with its weight (c,)."""
        self.value = self.value + e * e * 0.5
        self.slope.add((slice(None),), slope * e[..., None])
        column = slope[..., :, None]
        if self.gram is not None:
            self.gram.add((slice(None), slice(None)), compute_outer_product(column, column))
        if self.bend is not None:
            self.bend.add((slice(None), slice(None)), compute_outer_product(column, column))
            for product, weight in bends:
                add_bend(self.bend, product, weight * e)


@dataclass(frozen=True, eq=False, repr=False)
class DirectionTerm(Value):
    """½ ‖u × u_d‖² = ½ (1 − c²), c = u · u_d, of a direction (3,) behind a chain and the desired one (3,) behind that
    of the reference link, both as they are at zero."""

    chains: tuple[tuple[int, ...], tuple[int, ...]]
    direction: Array
    wanted: Array

    def cosine(self, carrier: SweptChains) -> Product:
        """c."""
        return Product(
            carrier.direction(self.chains[0], self.direction), carrier.direction(self.chains[1], self.wanted)
        )

    def add(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """As of :class:`ErrorTerm`."""
        product = self.cosine(carrier)
        c = product.value
        slope = gradient(product, sums)
        sums.value = sums.value + (1.0 - c * c) * 0.5
        sums.slope.add((slice(None),), slope * -c[..., None])
        column = slope[..., :, None]
        if sums.gram is not None:
            # ė · ė' = u̇ · u̇' − (u̇ · u_d) (u̇' · u_d), u̇ seen from what carries u_d
            rates = seen_rates(product, sums)
            sums.gram.add(
                (slice(None), slice(None)), compute_outer_product(rates, rates) - compute_outer_product(column, column)
            )
        if sums.bend is not None:
            sums.bend.add((slice(None), slice(None)), -compute_outer_product(column, column))
            add_bend(sums.bend, product, -c)


@dataclass(frozen=True, eq=False, repr=False)
class SlideTerm(Value):
    """½ (a · (p − o) − wanted)², of a point p (3,) behind a chain, the point o and the axis a of its slide (3,) behind
    that of the joint's other link, all as they are at zero; characteristic lengths."""

    chains: tuple[tuple[int, ...], tuple[int, ...]]
    point: Array
    start: Array
    axis: Array
    wanted: float

    def add(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """As of :class:`ErrorTerm`."""
        way = carrier.point(self.chains[0], self.point) - carrier.point(self.chains[1], self.start)
        product = Product(carrier.direction(self.chains[1], self.axis), way, self.wanted)
        sums.add_square(product.value, gradient(product, sums), [(product, 1.0)])


@dataclass(frozen=True, eq=False, repr=False)
class AngleTerm(Value):
    """½ θ², θ = atan2(s, c) the angle by which a mark (3,) behind a chain is turned beyond where it is wanted: s and c
    are its products with ``across`` and ``along`` (3,) behind the chain of the joint's other link, as they are at zero.
    """

    chains: tuple[tuple[int, ...], tuple[int, ...]]
    mark: Array
    across: Array
    along: Array

    def add(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """As of :class:`ErrorTerm`: ∇θ = (c ∇s − s ∇c) / r², r² = s² + c², which is constant, as is the angle between
        mark and axis; ∇²θ = (c ∇²s − s ∇²c) / r²."""
        mark = carrier.direction(self.chains[0], self.mark)
        s, c = (Product(mark, carrier.direction(self.chains[1], each)) for each in (self.across, self.along))
        size = float(self.mark @ self.across) ** 2 + float(self.mark @ self.along) ** 2
        one, other = c.value * (1 / size), s.value * (-1 / size)
        slope = gradient(s, sums) * one[..., None] + gradient(c, sums) * other[..., None]
        sums.add_square(compute_jet_angle(s.value, c.value), slope, [(s, one), (c, other)])


@dataclass(frozen=True, eq=False, repr=False)
class ObservationTerm(Value):
    """½ ‖e‖² of what a camera sees of the ``point`` and the ``axis`` (3,) behind a chain, with its centre and the
    columns of its ``frame`` (3, 3) behind that of the reference link, all as they are at zero; characteristic lengths.
    """

    chains: tuple[tuple[int, ...], tuple[int, ...]]
    seen: CameraObservation
    point: Array
    axis: Array | None
    radius: float
    centre: Array
    frame: Array
    wanted: Array
    plane: Array | None = None
    """The plane in which the law supposes it to lie, where that is not known."""

    def coordinates(self, carrier: SweptChains) -> list[Product]:
        """p, and d where there is an axis, in the camera's frame."""
        ray = carrier.point(self.chains[0], self.point) - carrier.point(self.chains[1], self.centre)
        told = [ray] if self.axis is None else [ray, carrier.direction(self.chains[0], self.axis)]
        own = [carrier.direction(self.chains[1], each) for each in self.frame.T]
        return [Product(each, column) for each in told for column in own]

    def errors(self, values: Sequence[Any]) -> list[Jet]:
        """e and its derivatives by these coordinates, no numbers where nothing is measured."""
        x = [Jet.variable(value, place, len(values)) for place, value in enumerate(values)]
        with np.errstate(all="ignore"):
            return self.seen.error_jets(x[:3], x[3:], x[0] * 0.0 + self.radius, self.wanted)

    def add(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """As of :class:`ErrorTerm`: with X the rates of the coordinates, ∇e = X ∂e and ∇²e = X ∂²e Xᵀ + Σ ∂ₐe ∇²xₐ."""
        products = self.coordinates(carrier)
        e = self.errors([each.value for each in products])
        X = stack([gradient(each, sums) for each in products])
        along = sum(each.slope * each.value[..., None] for each in e)
        sums.value = sums.value + sum(each.value * each.value for each in e) * 0.5
        sums.slope.add((slice(None),), (X * along[..., None, :]).sum(-1))
        gram = sum(each.slope[..., :, None] * each.slope[..., None, :] for each in e)
        if sums.gram is not None:
            sums.gram.add((slice(None), slice(None)), compute_outer_product(compute_outer_product(X, gram), X))
        if sums.bend is not None:
            bend = gram + sum(each.bend * each.value[..., None, None] for each in e)
            sums.bend.add((slice(None), slice(None)), compute_outer_product(compute_outer_product(X, bend), X))
            for place, product in enumerate(products):
                add_bend(sums.bend, product, along[..., place])

    def add_supposed(self, carrier: SweptChains, sums: ErrorSums) -> None:
        """Add to ``slope`` and ``gram`` J̃ᵀe and J̃ᵀJ̃, J̃ the rates of e that hold if what is seen lies in the plane: for
        floats. It moves as the link does, x̃' = x' + ω × (x̃ − x)."""
        products = self.coordinates(carrier)
        x = np.array([each.value for each in products])
        there = x
        if self.plane is not None:
            r = np.full((x.shape[1], 1), self.radius)
            p, d = x[:3].T, x[3:].T if len(x) > 3 else np.zeros((x.shape[1], 3))
            there = np.concatenate([each.T for each in self.seen.suppose_plane(p, d, r, self.plane)])[: len(x)]
        e = self.errors(list(there))
        X = np.array([gradient(each, sums) for each in products])
        turn = np.array([spun(each, sums) for each in products[:3]])
        for k in range(0, len(x), 3):
            X[k : k + 3] += np.cross(turn, (there - x)[k : k + 3, :, None], axis=0)
        J = np.array([np.einsum("ca,acn->cn", each.slope, X) for each in e])
        sums.slope.add((slice(None),), np.einsum("kcn,kc->cn", J, np.array([each.value for each in e])))
        assert sums.gram is not None
        sums.gram.add((slice(None), slice(None)), np.einsum("kcm,kcn->cmn", J, J))
        sums.value = sums.value + sum(each.value * each.value for each in e) * 0.5


def spun(product: Product, sums: ErrorSums) -> Array:
    """The rates (c, N) of y · ω, ω the angular velocity of the links between which x goes, one less the other."""
    total = Total(sums.value, sums.slope.shape)
    for part in product.x.parts:
        total.add((part.places,), (part.axes * product.y.value[..., None, :]).sum(-1) * part.sign)
    return np.asarray(total.sum)


def gradient(product: Product, sums: ErrorSums) -> Any:
    """∇(x · y), (c, N)."""
    total = Total(sums.value, sums.slope.shape)
    add_slope(total, product)
    return total.sum


def seen_rates(product: Product, sums: ErrorSums) -> Any:
    """The rates (c, N, 3) of a direction x, seen from what carries y."""
    total = Total(sums.value, (*sums.slope.shape, 3))
    x = product.x.value
    for part in product.x.parts:
        total.add((part.places, slice(None)), part.columns * part.sign)
    for part in product.y.parts:
        total.add((part.places, slice(None)), compute_cross_forms(part.axes, x[..., None, :]) * -part.sign)
    return total.sum


@dataclass(frozen=True, eq=False, repr=False)
class ErrorSystem(Value):
    """The loops of a robot and the error that its controller decreases: ``rows`` are as many equations of the loops as
    are independent, ``terms`` one for each observation."""

    system: LoopSystem
    rows: tuple[Row, ...]
    gears: tuple[CouplingEquation, ...]
    terms: tuple[ErrorTerm, ...]

    @classmethod
    def of(
        cls,
        goal: ClosedConfiguration,
        observation_model: ObservationModel,
        generic: Sequence[ClosedConfiguration],
        planes: Sequence[Array | None] | None = None,
    ) -> ErrorSystem:
        """Build the error of the values measured at a goal. ``generic`` configurations select independent equations;
        ``planes`` (3,), in metres, are those of the assumed depths, None where the law knows these."""
        mechanism = goal.model.mechanism
        system = build_loop_system(mechanism, ())
        values = measure(goal.model, goal.q, observation_model.reference, observation_model.observations)[2]
        terms = tuple(
            term(system, observation_model.reference, each, value, None if plane is None else plane * system.length)
            for each, value, plane in zip(
                observation_model.observations, values, planes or [None] * len(values), strict=True
            )
        )
        return cls(system, (), (), terms).select_rows_at(np.array([system.read(each.pose) for each in generic]))

    def select_rows_at(self, q: Array) -> ErrorSystem:
        """Return the error with equations that are independent at configurations (c, N)."""
        system = self.system
        every = [(loop, row) for loop in system.loops for row in loop.rows]
        chosen, count = independent(self.closures(q)[1], self.size[1] or None), len(every)
        return replace(
            self,
            rows=tuple(every[k] for k in chosen if k < count),
            gears=tuple(system.gears[k - count] for k in chosen if k >= count),
        )

    def closures(self, q: Array) -> tuple[Array, Array]:
        """All equations of the loops at configurations (c, N), (c, m'), and their derivatives (c, m', N): beyond
        singularities of the loops ``rows`` may hold where those that were left out as dependent do not."""
        every = tuple((loop, row) for loop in self.system.loops for row in loop.rows)
        at = replace(self, rows=every, gears=self.system.gears, terms=()).at(list(q.T))
        return at.G, at.DG

    @property
    def has_assumed_depths(self) -> bool:
        """Return True if the law assumes depths, so that its command is no gradient of E."""
        return any(isinstance(each, ObservationTerm) and each.plane is not None for each in self.terms)

    @property
    def size(self) -> tuple[int, int]:
        """Coordinates N and equations m."""
        return len(self.system.coordinates), len(self.rows) + len(self.gears)

    def scale(self, curvatures: Array) -> float:
        """Curvatures of E that are small are so beside this: E of directions is of size one; of what is far from a
        camera it hardly changes at all."""
        return (
            min(1.0, float(np.abs(curvatures).max(initial=0.0)))
            if any(isinstance(each, ObservationTerm) for each in self.terms)
            else 1.0
        )

    def at(self, values: Sequence[Any]) -> CriticalPointEquations:
        """All of it at values (N,) of (c,) each."""
        return CriticalPointEquations(self, values)


class CriticalPointEquations:
    """The loops and the error at values (N,) of (c,) each: G (c, m), DG (c, m, N), E (c,), ∇E (c, N)."""

    def __init__(self, system: ErrorSystem, values: Sequence[Any]) -> None:
        size, count = system.size
        self.like = values[0] * 0.0
        self.carrier = SweptChains(system.system, values)
        self.system = system
        self.products = [build_row_product(self.carrier, *each) for each in system.rows]
        closing, rates = Total(self.like, (count,)), Total(self.like, (count, size))
        for k, product in enumerate(self.products):
            closing.add((k,), product.value)
            own = Total(self.like, (size,))
            add_slope(own, product)
            rates.add((k, slice(None)), own.sum)
        for k, gear in enumerate(system.gears, len(system.rows)):
            for i, rate in gear.slope.items():
                closing.add((k,), values[i] * rate)
                rates.add((k, i), rate)
        self.G, self.DG = closing.sum, rates.sum
        sums = self._error()
        self.E, self.slope = sums.value, sums.slope.sum

    def _error(self, **asked: bool) -> ErrorSums:
        size = self.system.size[0]
        sums = ErrorSums(
            self.like, Total(self.like, (size,)), **{each: Total(self.like, (size, size)) for each in asked}
        )
        for each in self.system.terms:
            each.add(self.carrier, sums)
        return sums

    def command_terms(self) -> tuple[Array, Array, Array]:
        """E (c,), J̃ᵀe (c, N) and J̃ᵀJ̃ (c, N, N), J̃ the rates of e with the depths that the law supposes."""
        size = self.system.size[0]
        sums = ErrorSums(self.like, Total(self.like, (size,)), gram=Total(self.like, (size, size)))
        for each in self.system.terms:
            (each.add_supposed if isinstance(each, ObservationTerm) else each.add)(self.carrier, sums)
        assert sums.gram is not None
        return sums.value, sums.slope.sum, sums.gram.sum

    def bend(self, multipliers: Any, error: bool = True) -> Any:
        """The Hessian (c, N, N) of E + μ · G for multipliers μ (c, m), or of μ · G alone."""
        size = self.system.size[0]
        total = self._error(bend=True).bend if error else Total(self.like, (size, size))
        assert total is not None
        for k, product in enumerate(self.products):
            add_bend(total, product, multipliers[..., k])
        return total.sum

    def gram(self) -> Any:
        """JᵀJ (c, N, N), J the rates of e."""
        total = self._error(gram=True).gram
        assert total is not None
        return total.sum

    def pull(self, multipliers: Any) -> Any:
        """∇E + DGᵀ μ, (c, N)."""
        return self.slope + (self.DG * multipliers[..., :, None]).sum(-2)


def independent(rates: Array, rank: int | None = None) -> list[int]:
    """Rows of a matrix (c, m, N), as many as ``rank`` or as are independent at most of the places, that are so at all
    of them if any are: those of a pivoted QR decomposition of all places beside each other."""
    if not rates.shape[-2]:
        return []
    from scipy.linalg import qr

    if rank is None:
        rank = int(np.median((np.linalg.svd(rates, compute_uv=False) > RANK_CUTOFF_FRACTION).sum(axis=-1)))
    _, _, order = qr(np.concatenate(list(rates), axis=-1).T, mode="economic", pivoting=True)
    return sorted(order[:rank].tolist())


def term(system: LoopSystem, reference: str, seen: Observation, value: Array, plane: Array | None = None) -> ErrorTerm:
    """The part of E of an observation whose desired value is given, and what the law supposes of its depth
    (characteristic lengths, radians)."""
    links, length = system.mechanism.links, system.length
    view = seen.seen_from or reference
    chains = system.way(system.body[seen.link]), system.way(system.body[view])
    shared = sum(1 for i, k in zip(*chains, strict=False) if i == k)
    chains = chains[0][shared:], chains[1][shared:]
    X, Y = links[seen.link].pose, links[view].pose
    R, S = X[:3, :3], Y[:3, :3]
    match seen:
        case SeenAxis():
            return DirectionTerm(chains, R @ seen.direction, S @ value)
        case CameraObservation():
            C = Y @ seen.view
            return ObservationTerm(
                chains,
                seen,
                transform(X, seen.at) / length,
                None if seen.axis is None else R @ seen.axis,
                (seen.radius or 0.0) / length,
                C[:3, 3] / length,
                C[:3, :3],
                value,
                plane,
            )
        case SlideEncoder():
            return SlideTerm(
                chains,
                transform(X, seen.point) / length,
                transform(Y, seen.start) / length,
                S @ seen.axis,
                float(value[0]),
            )
        case AngleEncoder():
            normal = seen.start - (seen.axis @ seen.start) * seen.axis
            along = convert_vectors_to_rotations(float(value[0]) * seen.axis) @ normal
            return AngleTerm(chains, R @ seen.mark, S @ cross(seen.axis, along), S @ along)
    raise NotImplementedError(type(seen).__name__)
