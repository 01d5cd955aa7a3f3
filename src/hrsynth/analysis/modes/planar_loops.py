"""The loops of a planar mechanism as polynomials, whatever its gears (docs/pages/proofs.md, section 8).

Links turn by θ = E ψ, E of whole numbers: slides, gears and what is measured are relations between angles. With
u = exp(i ψ), v = 1/u each loop is a sum of a t Π u^E = 0, t a slide's length or 1, and so is its conjugate, with u and
v exchanged (C. W. Wampler, J. Mech. Des. 121, 1999, 387). The unknowns of the enclosures are cos ψ, sin ψ and t.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ...geometry.vectors import Array, build_plane_axes, build_pose, rotate_about_axis
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import solve as close
from ...tolerances import CLOSURE_SOLVER_TOL, NUMBER_ROUNDING
from .constrained_platform import System
from .modular_root_bound import Residues, bezout, partitions

Exponents = tuple[int, ...]
Sum = dict[tuple[int, Exponents], complex]
"""Coefficients by the number of a slide (-1: none) and the exponents of u, negative ones of v."""
ALL_GROUPINGS_UNKNOWNS_MAX = 6
"""Unknowns up to which all ways to group them are tried."""


@dataclass(frozen=True, eq=False)
class PlanarLoop:
    """A sum that vanishes; ``angles`` and ``slides`` are how many unknowns of each kind there are."""

    terms: Sum
    angles: int
    slides: int

    def used_coordinates(self) -> frozenset[int]:
        """Its angles, and its slides after all angles."""
        return unknowns(self.terms, self.angles)

    def forms(self) -> Iterator[dict[Exponents, complex]]:
        """Itself and its conjugate, as polynomials in all u, all v and all t."""
        for sign in (1, -1):
            total: dict[Exponents, complex] = {}
            for (slide, e), a in self.terms.items():
                key = (
                    *(max(0, sign * k) for k in e),
                    *(max(0, -sign * k) for k in e),
                    *(int(slide == k) for k in range(self.slides)),
                )
                total[key] = total.get(key, 0j) + (a if sign > 0 else a.conjugate())
            yield total


@dataclass(frozen=True, eq=False)
class SumPart:
    """Real part of a loop, or the ``imaginary`` one, in cos ψ, sin ψ and t, numbers known to ``slack`` (sizes)."""

    loop: PlanarLoop
    imaginary: bool
    slack: float

    @cached_property
    def _terms(self) -> list[tuple[Any, int, Exponents]]:
        """The coefficients of the loop and of its conjugate in balls, with slides and exponents."""
        from flint import acb, arb

        found = []
        for (slide, e), a in self.loop.terms.items():
            x, y = (arb(v, self.slack + NUMBER_ROUNDING * (1.0 + abs(a))) / 2 for v in (a.real, a.imag))
            for sign in (1, -1):
                ball = acb(x, sign * y) * (acb(0, -sign) if self.imaginary else 1)
                found.append((ball, slide, tuple(sign * k for k in e)))
        return found

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return _like(x, sum(a * self._slid(x, slide) * _product(x, e) for a, slide, e in self._terms))

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        from flint import acb

        angles = self.loop.angles
        found: list[Any] = [acb(0) for _ in x]
        for a, slide, e in self._terms:
            for j, k in enumerate(e):
                if k:
                    sign = 1 if k > 0 else -1
                    part = a * self._slid(x, slide) * abs(k) * _product(x, (*e[:j], k - sign, *e[j + 1 :]))
                    found[j] += part
                    found[angles + j] += part * acb(0, sign)
            if slide >= 0:
                found[2 * angles + slide] += a * _product(x, e)
        return [_like(x, each) for each in found]

    def _slid(self, x: Sequence[Any], slide: int) -> Any:
        return 1 if slide < 0 else x[2 * self.loop.angles + slide]


def _product(x: Sequence[Any], e: Exponents) -> Any:
    """Π u^e at balls (cos ψ, sin ψ, …)."""
    from flint import acb

    i, total = acb(0, 1), acb(1)
    for j, k in enumerate(e):
        if k:
            total *= (x[j] + (i if k > 0 else -i) * x[len(e) + j]) ** abs(k)
    return total


def _like(x: Sequence[Any], value: Any) -> Any:
    """A complex ball, or its real part where all unknowns are real."""
    from flint import acb, arb

    return acb(value).real if isinstance(x[0], arb) else acb(value)


@dataclass(frozen=True, eq=False, repr=False)
class PlanarLoops(System):
    """A planar mechanism with what is measured held; q are its angles ψ (rad) and slides t (characteristic lengths)
    since the goal."""

    goal: ClosedConfiguration
    normal: Array
    turns: dict[str, Exponents]
    """E: how many times a link rotates with each ψ."""
    shifts: dict[str, Sum]
    """Shift of each link's origin: the point that is at the frame's at the goal, for a rotation about that."""
    moves: dict[str, tuple[int, float]]
    """Slide of each P, and the factor from its length to the joint's coordinate."""
    loops: tuple[PlanarLoop, ...]
    angles: int
    slides: int
    bodies: tuple[str, ...]
    point: Array | None
    besides: tuple[PlanarLoop, ...]
    """Further measured values: they vanish too."""

    freedoms = 3

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.goal.model.length

    @property
    def slack(self) -> float:
        """Error of the numbers of a loop, sums of differences of points (sizes)."""
        return 2.0 * (1 + len(self.loops)) * self.error / self.size

    @property
    def home(self) -> Array:
        """The goal."""
        return np.zeros(self.angles + self.slides)

    @cached_property
    def frame(self) -> Array:  # type: ignore[override]
        """Two unit vectors of the plane; shape (2, 3)."""
        return build_plane_axes(self.normal)

    @cached_property
    def forms(self) -> list[dict[Exponents, complex]]:
        """All equations as polynomials in u, v and t."""
        n = 2 * self.angles + self.slides
        units = [
            {tuple(int(i in (k, self.angles + k)) for i in range(n)): 1 + 0j, (0,) * n: -1 + 0j}
            for k in range(self.angles)
        ]
        return [*(form for loop in self.loops for form in loop.forms()), *units]

    @cached_property
    def residues(self) -> Residues:
        """The equations modulo a prime."""
        return Residues.of(self.forms)

    @cached_property
    def most(self) -> int:
        """Bound of the isolated closed configurations from degrees, with unknowns eliminated or not."""
        groups = groupings(self.angles, self.slides, [loop.used_coordinates() for loop in self.loops])
        return min(self.residues.most_by_degrees(), *(bezout(self.forms, each) for each in groups))

    def pose_of(self, link: str, q: Array) -> Array:
        """X_BL of a link (4, 4), m."""
        psi, t = q[: self.angles], q[self.angles :]
        shift = sum(
            a * (1.0 if k < 0 else t[k]) * np.exp(1j * (np.array(e) @ psi)) for (k, e), a in self.shifts[link].items()
        )
        start, angle = self.goal.pose(link), float(np.array(self.turns[link]) @ psi)
        moved = self.size * (np.real(shift) * self.frame[0] + np.imag(shift) * self.frame[1])
        return build_pose(start[:3, 3] + moved, rotate_about_axis(self.normal, angle) @ start[:3, :3])

    def body_poses(self, q: Array) -> dict[str, Array]:
        """Return the poses (4, 4) of the bodies that determine the platform."""
        return {body: self.pose_of(body, q) for body in self.bodies}

    def closing(self, q: Array) -> ClosedConfiguration:
        """The whole mechanism there, gears on the teeth on which they are at the goal."""
        model, step = self.goal.model, np.zeros(self.goal.model.nv)
        for joint in model.mechanism.joints.values():
            (place,) = model.coordinates[joint.name]
            if joint.type.has_translation:
                k, factor = self.moves[joint.name]
                step[place] = 0.0 if k < 0 else factor * q[self.angles + k]
            else:
                E = np.subtract(self.turns[joint.successor], self.turns[joint.predecessor])
                axis = (
                    self.goal.pose(joint.predecessor)[:3, :3]
                    @ model.mechanism.links[joint.predecessor].inverse[:3, :3]
                    @ joint.axis
                )
                step[place] = float(E @ q[: self.angles]) * np.sign(axis @ self.normal)
        return ClosedConfiguration.of(
            model, close(model, model.integrate(self.goal.q, step), tolerance=CLOSURE_SOLVER_TOL)[0]
        )

    def pose_terms(self, x: Sequence[Any]) -> list[Any]:
        """Return the components of the bodies' pose, each with its conjugate, at balls (cos ψ, sin ψ, t)."""
        found: list[Any] = []
        for body in self.bodies:
            e = self.turns[body]
            at = 0j if self.point is None else self._flat(self.goal.pose(body)[:3, :3] @ self.point)
            for sign in (1, -1):
                turn = _product(x, tuple(sign * k for k in e))
                shift = sum(
                    (
                        _ball(a, sign)
                        * (1 if k < 0 else x[2 * self.angles + k])
                        * _product(x, tuple(sign * i for i in f))
                        for (k, f), a in self.shifts[body].items()
                    ),
                    turn * 0,
                )
                found += [turn, shift] if self.point is None else [shift + turn * _ball(at, sign)]
        return found

    def _flat(self, vector: Array) -> complex:
        """A vector (m) in the plane (sizes)."""
        return complex(*(self.frame @ vector / self.size))


def _ball(a: complex, sign: int = 1) -> Any:
    from flint import acb

    return acb(a.real, sign * a.imag)


def groupings(angles: int, slides: int, loops: Sequence[frozenset[int]]) -> Iterator[list[list[int]]]:
    """Ways to group all u, all v and all t: by kinds, each alone, few unknowns in all ways; where some loops close
    before others, those of each part by themselves. Of angles and slides, ``loops`` are those that each loop has."""
    u, v, t = ([*range(k, k + n)] for k, n in ((0, angles), (angles, angles), (2 * angles, slides)))
    n = 2 * angles + slides
    alone = [[k] for k in t]
    for groups in (
        [u, v, t],
        [u + v + t],
        [u, v, *alone],
        [u + v, t],
        [[k] for k in range(n)],
        [*map(list, zip(u, v, strict=True)), t],
    ):
        yield [*filter(None, groups)]
    if len(parts := blocks(loops)) > 1:
        own = [
            (
                [u[k] for k in part if k < angles],
                [v[k] for k in part if k < angles],
                [t[k - angles] for k in part if k >= angles],
            )
            for part in parts
        ]
        yield [group for part in own for group in part if group]
        yield [group for x, y, z in own for group in (x + y, z) if group]
        yield [x + y + z for x, y, z in own]
    yield from partitions([*range(n)]) if n <= ALL_GROUPINGS_UNKNOWNS_MAX else ()


def unknowns(terms: Iterable[tuple[int, Exponents]], angles: int) -> frozenset[int]:
    """The angles, and the slides after all angles, of a loop's terms: (slide, how often each angle)."""
    return frozenset(
        k
        for slide, e in terms
        for k in (*(j for j, times in enumerate(e) if times), *([angles + slide] if slide >= 0 else []))
    )


def blocks(loops: Sequence[frozenset[int]]) -> list[list[int]]:
    """The unknowns of loops in the order in which these close: those of as few loops as have two unknowns each, then in
    the same way what the others have besides."""
    left, found = [*filter(None, loops)], list[list[int]]()
    while left:
        own = next(
            (
                own
                for size in range(1, len(left))
                for part in combinations(left, size)
                if len(own := frozenset[int]().union(*part)) == 2 * size
            ),
            frozenset[int]().union(*left),
        )
        found.append(sorted(own))
        left = [*filter(None, (each - own for each in left))]
    return found
