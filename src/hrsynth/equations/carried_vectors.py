"""Points and directions that chains of coordinates carry, with first and second derivatives, and sums of their
products: for many floats or affine forms at once.

Behind the coordinates i ≤ j of a chain, i nearer to the base, ∂ᵢ∂ⱼ v = aᵢ × ∂ⱼ v for every point or direction v that
they carry, aᵢ the axis of a turn, zero of a slide.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.affine import AffineForms, compute_cross_forms, compute_dot_forms, compute_matrix_product, stack
from ..geometry.vectors import Array
from .joint_equations import JointLoop, LoopRow, LoopSystem, Swept, rotate

Places = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ChainColumns:
    """Derivatives of one vector behind a chain: indices (k,) of its coordinates, ∂v (…, k, 3), and axes (…, k, 3) of
    its rotations; the vector counts ``sign`` times."""

    places: Places
    columns: Any
    axes: Any
    sign: float = 1.0


@dataclass(frozen=True, eq=False)
class CarriedVector:
    """A vector (…, 3) that is a sum of such that chains carry."""

    value: Any
    parts: tuple[ChainColumns, ...] = ()

    def __sub__(self, other: CarriedVector) -> CarriedVector:
        turned = tuple(ChainColumns(each.places, each.columns, each.axes, -each.sign) for each in other.parts)
        return CarriedVector(self.value - other.value, self.parts + turned)


@dataclass(frozen=True, eq=False)
class Product:
    """x · y, less ``constant``."""

    x: CarriedVector
    y: CarriedVector
    constant: Any = 0.0

    @property
    def value(self) -> Any:
        """x · y − constant, (…)."""
        return compute_dot_forms(self.x.value, self.y.value) - self.constant


class SweptChains:
    """The vectors that a system's coordinates carry at some values (N,) of (…) each; what has been swept is kept."""

    def __init__(self, system: LoopSystem, values: Sequence[Any], order: Places | None = None) -> None:
        """Keep the values; with an ``order`` (N,) derivatives are by those that are not None, at its places."""
        self.system, self.values, self.order = system, values, order
        self._swept: dict[tuple[int, ...], tuple[Swept, Any, Any, Any]] = {}
        self._known: dict[tuple[Any, ...], CarriedVector] = {}

    def _chain(self, chain: tuple[int, ...]) -> tuple[Swept, Any, Any, Any]:
        """Screws of a chain: axes (…, k, 3) of the rotations, points on them, axes of the translations."""
        if chain not in self._swept:
            swept, none = self.system.displacement(chain, self.values), np.zeros(3)
            slides = [self.system.coordinates[i].slides for i in chain]
            rows = [
                [none if slide else axis for slide, axis in zip(slides, swept.axes, strict=True)],
                [none if point is None else point for point in swept.points],
                [axis if slide else none for slide, axis in zip(slides, swept.axes, strict=True)],
            ]
            axes, points, along = (stack(each, -2) if chain else np.zeros((0, 3)) for each in rows)
            self._swept[chain] = swept, axes, points, along
        return self._swept[chain]

    def rotation(self, chain: tuple[int, ...]) -> Any:
        """The rotation (…, 3, 3) behind a chain."""
        return self._chain(chain)[0].R

    def point(self, chain: tuple[int, ...], p: Array) -> CarriedVector:
        """The place of a point (3,), as it lies at zero, behind a chain."""
        key = (chain, *p.tolist())
        if key not in self._known:
            swept, axes, points, slides = self._chain(chain)
            at = swept.at(p)
            self._known[key] = CarriedVector(
                at,
                self._split_columns(chain, lambda: compute_cross_forms(axes, at[..., None, :] - points) + slides, axes),
            )
        return self._known[key]

    def direction(self, chain: tuple[int, ...], d: Array) -> CarriedVector:
        """A direction (3,), as it is at zero, behind a chain."""
        swept, axes, *_ = self._chain(chain)
        v = rotate(swept.R, d)
        return CarriedVector(v, self._split_columns(chain, lambda: compute_cross_forms(axes, v[..., None, :]), axes))

    def _split_columns(self, chain: tuple[int, ...], columns: Callable[[], Any], axes: Any) -> tuple[ChainColumns, ...]:
        places = np.array(chain, dtype=np.intp)
        if self.order is None:
            return (ChainColumns(places, columns(), axes),) if chain else ()
        moving = [k for k, i in enumerate(chain) if self.values[i] is not None]
        if not moving:
            return ()
        return (ChainColumns(self.order[places[moving]], columns()[..., moving, :], axes[..., moving, :]),)


def build_row_product(carrier: SweptChains, loop: JointLoop, row: LoopRow) -> Product:
    """An equation of a loop as a product that vanishes."""
    if row.kind == "direction":
        assert row.one is not None
        assert row.other is not None
        return Product(
            carrier.direction(loop.chains[0], row.one),
            carrier.direction(loop.chains[1], row.other),
            float(row.one @ row.other),
        )
    assert row.one is not None
    k = carrier.direction(loop.chains[0], row.one) if row.carried else CarriedVector(row.one)
    return Product(k, carrier.point(loop.chains[1], loop.point) - carrier.point(loop.chains[0], loop.point))


def list_row_products(carrier: SweptChains, loop: JointLoop, row: LoopRow) -> list[tuple[Product, float]]:
    """Return an equation of a loop as a sum of products with weights."""
    if row.kind != "distance":
        return [(build_row_product(carrier, loop, row), 1.0)]
    assert loop.swung is not None
    centre = carrier.system.coordinates[loop.chains[1][loop.swung]].point
    before, after = loop.chains[1][: loop.swung], loop.chains[1][loop.swung + loop.swings :]
    reach = carrier.point(loop.chains[0], loop.point) - carrier.point(before, centre)
    rod = carrier.point(after, loop.point) - CarriedVector(centre)
    return [(Product(reach, reach), 0.5), (Product(rod, rod), -0.5)]


def add_row_bend(total: Total, carrier: SweptChains, loop: JointLoop, row: LoopRow) -> None:
    """Add the second derivatives of an equation of a loop to a sum (c, N, N)."""
    for product, weight in list_row_products(carrier, loop, row):
        add_bend(total, product, weight)


class Total:
    """A sum of arrays or forms, (c, …), to parts of which is added."""

    def __init__(self, like: Any, shape: tuple[int, ...]) -> None:
        """Zero, for as many values as ``like`` (c,) has."""
        self.sum: Any = np.zeros((*np.shape(like), *shape))
        if isinstance(like, AffineForms):
            self.sum = AffineForms(np.zeros((*like.v.shape, *shape)), np.zeros((*like.r.shape, *shape)))

    @property
    def shape(self) -> tuple[int, ...]:
        """The last dimensions."""
        return tuple((self.sum.r if isinstance(self.sum, AffineForms) else self.sum).shape[1:])

    def add(self, where: tuple[Any, ...], part: Any) -> None:
        """Add to the places ``where`` of the last dimensions."""
        place = (..., *where)
        if isinstance(self.sum, AffineForms):
            total = self.sum[place] + part
            self.sum.v[place], self.sum.r[place] = total.v, total.r
        else:
            self.sum[place] += part


def add_slope(total: Total, product: Product, weight: Any = 1.0) -> None:
    """Add weight ∇(x · y) to a sum (c, N)."""
    square = product.x is product.y
    weight = weight * 2.0 if square else weight
    for vector, other in ((product.x, product.y), (product.y, product.x))[: 1 if square else 2]:
        for part in vector.parts:
            f = other.value * (part.sign * _convert_to_column(weight))
            total.add((part.places,), (part.columns * f[..., None, :]).sum(-1))


def add_bend(total: Total, product: Product, weight: Any = 1.0) -> None:
    """Add weight ∇²(x · y) to a sum (c, N, N)."""
    square = product.x is product.y
    weight = weight * 2.0 if square else weight
    for vector, other in ((product.x, product.y),) if square else ((product.x, product.y), (product.y, product.x)):
        for part in vector.parts:
            f = other.value * (part.sign * _convert_to_column(weight))
            pushed = compute_cross_forms(f[..., None, :], part.axes)
            later, (upper, lower) = compute_outer_product(pushed, part.columns), _make_triangle_masks(len(part.places))
            total.add(np.ix_(part.places, part.places), later * upper + _swap_last_axes(later) * lower)
    for one in product.x.parts:
        for two in product.y.parts:
            both = one.sign * two.sign
            columns = two.columns * _convert_to_column(_convert_to_column(weight)) * both
            across = compute_outer_product(one.columns, columns)
            total.add(np.ix_(one.places, two.places), across)
            if not square:
                total.add(np.ix_(two.places, one.places), _swap_last_axes(across))


@cache
def _make_triangle_masks(size: int) -> tuple[Array, Array]:
    """Ones on and above the diagonal of a matrix, and below it."""
    upper = np.triu(np.ones((size, size)))
    return upper, 1.0 - upper


def compute_outer_product(a: Any, b: Any) -> Any:
    """The products a_i · b_j (…, k, l) of vectors (…, k, 3) and (…, l, 3)."""
    if isinstance(a, AffineForms) and isinstance(b, AffineForms):
        return compute_matrix_product(a, b.transposed())
    if isinstance(a, AffineForms) or isinstance(b, AffineForms):
        return (a[..., :, None, :] * b[..., None, :, :]).sum(-1)
    return a @ np.swapaxes(b, -1, -2)


def _swap_last_axes(a: Any) -> Any:
    """Matrices or forms (…, k, l) with the last two dimensions in turn."""
    return a.transposed() if isinstance(a, AffineForms) else np.swapaxes(a, -1, -2)


def _convert_to_column(weight: Any) -> Any:
    """A weight (c,) for vectors (c, 3); numbers as they are."""
    return weight if isinstance(weight, int | float) else weight[..., None]
