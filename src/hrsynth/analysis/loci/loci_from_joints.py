"""Locus of the tip of a locked leg, from the leg's own joints: p₁ + Σ Q_i w_i, one reach a branch.

What each body adds is a fixed vector, a circle (it turns about a fixed direction), a sphere (it turns freely) or a line
(it slides). The sum holds all places of the tip; where its dimension is that which the leg's screws give, it is the
whole of each branch, since it is irreducible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...geometry import lines
from ...geometry.loci import Circle, Line, Plane, Point, Quadrics, Reach, Revolution, Sphere, SweptCircle
from ...geometry.vectors import Array
from ...tolerances import CHAIN_ROUNDING, MOVED_AXIS_LEVER_MAX, POINT_DISTANCE_TOL, RANK_GAP_MIN
from .leg_orientations import Known, group_axes, list_orientations, list_ways
from .locked_chain import Chain, ChainBody, LocusDerivationFailure


def derive_reaches(chain: Chain) -> tuple[list[tuple[Reach, float]], float]:
    """All components of the places of the tip, each once, the goal's own first, and by what an error of the goal grows
    in each (1 in the goal's own); and how far the leg's geometry was moved (m): what nearly meets, is parallel or at
    one point is taken to be so.

    Raises :class:`LocusDerivationFailure`, also where two branches are nearly one: neither the same to 1e-10 nor 1e-7
    apart."""
    reaches: list[tuple[Reach, float]] = []
    moved = 0.0
    for known, gain in list_orientations(chain):
        reach, radii = place(chain, known)
        if isinstance(reach, Quadrics):
            raise LocusDerivationFailure("two parts that move on a surface that is neither a plane nor a sphere")
        moved = max(moved, radii)
        gap = min((compare_reaches(reach, known_reach, chain.length) for known_reach, _ in reaches), default=np.inf)
        if gap > POINT_DISTANCE_TOL:
            reaches.append((reach, gain * chain.extent / chain.length if reaches else 1.0))
        elif gap > POINT_DISTANCE_TOL / RANK_GAP_MIN:
            raise LocusDerivationFailure(f"two of its solutions differ by only {gap:.1e} characteristic lengths")
        else:
            moved = max(moved, gap * chain.length)
    moved = moved if moved > CHAIN_ROUNDING * chain.extent else 0.0
    return reaches, MOVED_AXIS_LEVER_MAX * (chain.moved + moved)


@dataclass(eq=False)
class _Sum:
    """Fixed vectors, and the circles (axis, spoke), lines and spheres that are added to them."""

    small: float
    centre: Array = field(default_factory=lambda: np.zeros(3))
    circles: list[tuple[Array, Array]] = field(default_factory=list)
    lines: list[Array] = field(default_factory=list)
    spheres: list[float] = field(default_factory=list)
    sweeps: list[tuple[Array, Array, Array]] = field(default_factory=list)
    """Slides oblique to the axes about which they rotate: axis, other rotating parts, slide."""
    moved: float = 0.0
    """Radii of circles and spheres that count as points, all together (m)."""
    tilt: float = 0.0
    """Angles of directions that count as perpendicular, and are not, all together (rad)."""

    def turn(self, axis: Array, vector: Array) -> None:
        """A vector that turns about a fixed direction."""
        along = axis * float(axis @ vector)
        spoke = vector - along
        if np.linalg.norm(spoke) > self.small:
            self.centre = self.centre + along
            self.circles.append((axis, spoke))
        else:
            self.centre = self.centre + vector
            self.moved += float(np.linalg.norm(spoke))

    def ball(self, vector: Array) -> None:
        """A vector that turns freely."""
        radius = float(np.linalg.norm(vector))
        if radius > self.small:
            self.spheres.append(radius)
        else:
            self.centre = self.centre + vector
            self.moved += radius

    def reach(self) -> Reach | Quadrics:
        """Its name. Raises :class:`LocusDerivationFailure` where it has none."""
        if self.sweeps:
            if len(self.sweeps) > 1 or self.spheres or self.circles or self.lines:
                raise LocusDerivationFailure(
                    "a P that rotates about an axis oblique to it, and another part that moves"
                )
            return Revolution.swept(self.centre, *self.sweeps[0])
        if self.spheres and (len(self.spheres) > 1 or self.circles or self.lines):
            raise LocusDerivationFailure("a part that rotates freely and another that moves")
        if self.spheres:
            return Sphere(self.centre, self.spheres[0])
        if not self.circles and not self.lines:
            return Point(self.centre)
        if not self.circles and all(lines.is_parallel(d, self.lines[0]) for d in self.lines):
            return Line(self.centre, self.lines[0])
        if len(self.circles) == 1 and not self.lines:
            axis, spoke = self.circles[0]
            return Circle(self.centre, axis, float(np.linalg.norm(spoke)), spoke)
        first = [axis for axis, _ in self.circles] or [_find_normal(self.lines)]
        normal = first[0]
        if all(lines.is_parallel(axis, normal) for axis in first) and all(
            lines.is_perpendicular(d, normal) for d in self.lines
        ):
            self.tilt += sum(abs(float(d @ normal)) for d in self.lines)
            return Plane(self.centre, normal)
        if len(self.circles) == 1 and all(lines.is_parallel(d, self.lines[0]) for d in self.lines):
            return SweptCircle(self.centre, normal, float(np.linalg.norm(self.circles[0][1])), self.lines[0])
        if len(self.circles) == 2 and not self.lines:
            radius, second = (float(np.linalg.norm(spoke)) for _, spoke in self.circles)
            return SweptCircle(self.centre, normal, radius, first[1], second)
        raise LocusDerivationFailure("circles and lines that lie in no common plane")


def _find_normal(directions: Sequence[Array]) -> Array:
    crossed = max((np.cross(directions[0], d) for d in directions[1:]), key=lambda n: float(np.linalg.norm(n)))
    return np.asarray(crossed / np.linalg.norm(crossed))


def place(chain: Chain, known: Known) -> tuple[Reach | Quadrics, float]:
    """The reach in one branch of orientations, and how far radii were moved (m)."""
    total = _Sum(POINT_DISTANCE_TOL * chain.length, chain.bodies[0].point)
    for k, body in enumerate(chain.bodies):
        Q = known[k]
        if Q is not None:
            _add_fixed(total, body, Q)
            continue
        alone = [(R, parts[0][0][1]) for R, way in list_ways(chain, known, k) if len(parts := group_axes(way)) == 1]
        if alone:
            _add_turning(total, body, *alone[0])
        elif body.observed:
            _add_spinning(total, body)
        elif not body.is_rigid:
            raise LocusDerivationFailure("a link that rotates freely and carries a P or a parallelogram")
        else:
            total.ball(body.shift)
    reach = total.reach()
    return reach, total.moved + total.tilt * chain.extent


def _add_fixed(total: _Sum, body: ChainBody, Q: Array) -> None:
    """A body of fixed orientation."""
    total.centre = total.centre + Q @ body.shift
    total.lines += [Q @ slide for slide in body.slides]
    for crank in body.cranks:
        if crank.held:
            total.centre = total.centre + Q @ crank.vector
        else:
            _add_crank(total, Q, Q @ crank.axis, crank.vector, crank.observed)


def _add_crank(total: _Sum, Q: Array, axis: Array, vector: Array, observed: Sequence[Array]) -> None:
    """A crank that turns about a fixed direction, from the orientation Q of what carries it."""
    for d in observed:
        if not lines.is_parallel(axis, d):
            start, end = Q @ d, d
            angle = np.arctan2(axis @ np.cross(start, end), start @ end - (axis @ start) * (axis @ end))
            v = Q @ vector
            across = v - axis * float(axis @ v)
            total.centre = total.centre + v - across + across * np.cos(angle) + np.cross(axis, across) * np.sin(angle)
            return
    total.turn(axis, Q @ vector)


def _add_turning(total: _Sum, body: ChainBody, Q: Array, a: Array) -> None:
    """A body that turns about the fixed direction Q a, counted from the orientation Q."""
    axis = Q @ a
    if (
        len(body.slides) == 1
        and not body.cranks
        and not any(test(body.slides[0], a) for test in (lines.is_parallel, lines.is_perpendicular))
    ):
        total.sweeps.append((axis, Q @ body.shift, Q @ body.slides[0]))
        return
    total.turn(axis, Q @ body.shift)
    for slide in body.slides:
        if lines.is_parallel(slide, a):
            total.lines.append(axis)
        elif lines.is_perpendicular(slide, a):
            first = Q @ slide
            total.lines += [first, np.cross(axis, first)]
            total.tilt += abs(float(slide @ a))
        else:
            raise LocusDerivationFailure("a P that rotates about an axis oblique to it")
    for crank in body.cranks:
        if crank.held or not lines.is_parallel(crank.axis, a):
            raise LocusDerivationFailure("a parallelogram that rotates about another axis than its own")
        _add_crank(total, Q, axis, crank.vector, crank.observed)


def _add_spinning(total: _Sum, body: ChainBody) -> None:
    """A body with a direction held that turns about it."""
    d = body.observed[0]
    total.turn(d, body.shift)
    if body.cranks or any(not lines.is_parallel(slide, d) for slide in body.slides):
        raise LocusDerivationFailure(
            "a link that spins about its observed direction and carries more than a P along it"
        )
    total.lines += [d] * len(body.slides)


def compare_reaches(one: Reach | Quadrics, other: Reach | Quadrics, length: float) -> float:
    """Return the difference of two loci (characteristic lengths, radians); infinite if they are of different kinds."""
    if type(one) is not type(other):
        return np.inf
    between = (
        one.miss(other.centre)
        if isinstance(one, Line | Plane)
        else one.off(other.centre)
        if isinstance(one, SweptCircle)
        else one.centre - other.centre
    )
    differences = [float(np.linalg.norm(between)) / length]
    for name in ("direction", "normal", "axis"):
        if hasattr(one, name):
            differences.append(float(np.linalg.norm(np.cross(getattr(one, name), getattr(other, name)))))
    for name, unit in (("radius", length), ("other", length), ("profile", 1.0)):
        if hasattr(one, name):
            differences.append(float(np.abs(np.subtract(getattr(one, name), getattr(other, name))).max()) / unit)
    return max(differences)
