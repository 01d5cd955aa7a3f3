"""All modes of a planar mechanism from its joints, whatever its loops and gears (docs/pages/theory.md, section 8).

Links turn by θ = E ψ, E of whole numbers: slides, gears and what is measured are relations between angles. With
u = exp(i ψ), v = 1/u each loop is a sum of a t Π u^E = 0, t a slide's length or 1, and so is its conjugate, with u and
v exchanged (C. W. Wampler, J. Mech. Des. 121, 1999, 387). The unknowns of the enclosures are cos ψ, sin ψ and t.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import combinations, islice, permutations
from typing import Any

import numpy as np

from ...budgets import LARGEST_GEAR, LARGEST_LOOPS, LOOP_SYSTEMS, PLANAR_STARTS
from ...constraints.pattern import moved
from ...errors import NotConfined, Unsolved
from ...geometry.vectors import Array, cross, frozen, perpendicular, pose, rotation_about, transform
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import solve as close
from ...mechanism import Joint, JointType, Observation, graphs
from ...mechanism.observations.direction import Direction
from ...mechanism.observations.encoder import Encoder
from ...tolerances import NUMBER_ROUNDING, SAME_DIRECTION, SAME_GEOMETRY, SAME_POINT, SOLVED
from ..measured import MeasuredRobot
from .branches import Model
from .multiples import Residues, bezout, partitions
from .polynomials import Polynomial
from .pose_boxes import PoseBox, UnitCircle, zeros
from .solve import SystemMode, SystemModes
from .systems import System

Exponents = tuple[int, ...]
Sum = dict[tuple[int, Exponents], complex]
"""Coefficients by the number of a slide (-1: none) and the exponents of u, negative ones of v."""
KINDS = (JointType.REVOLUTE, JointType.PRISMATIC)
MOST_GROUPED = 6
"""Unknowns up to which all ways to group them are tried."""


@dataclass(frozen=True, eq=False)
class PlanarLoop:
    """A sum that vanishes; ``angles`` and ``slides`` are how many unknowns of each kind there are."""

    terms: Sum
    angles: int
    slides: int

    def forms(self) -> Iterator[dict[Exponents, complex]]:
        """Itself and its conjugate, as polynomials in all u, all v and all t."""
        for sign in (1, -1):
            total: dict[Exponents, complex] = {}
            for (slide, e), a in self.terms.items():
                key = (*(max(0, sign * k) for k in e), *(max(0, -sign * k) for k in e),
                       *(int(slide == k) for k in range(self.slides)))
                total[key] = total.get(key, 0j) + (a if sign > 0 else a.conjugate())
            yield total


@dataclass(frozen=True, eq=False)
class _Part:
    """The real part of a loop, or the ``imaginary`` one, in cos ψ, sin ψ and t, numbers known to ``slack`` (sizes)."""

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
                    part = a * self._slid(x, slide) * abs(k) * _product(x, (*e[:j], k - sign, *e[j + 1:]))
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
    """E: by how many of each ψ a link turns."""
    shifts: dict[str, Sum]
    """How far each link's origin is shifted: the point that is at the frame's at the goal, for a turn about that."""
    moves: dict[str, tuple[int, float]]
    """The slide of each P, and how many times its length the joint's coordinate changes by."""
    loops: tuple[PlanarLoop, ...]
    angles: int
    slides: int
    bodies: tuple[str, ...]
    point: Array | None
    besides: tuple[PlanarLoop, ...]
    """What is measured besides: it vanishes too."""

    freedoms = 3

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.goal.twin.length

    @property
    def slack(self) -> float:
        """How far the numbers of a loop, sums of differences of points, can be from the exact ones (sizes)."""
        return 2.0 * (1 + len(self.loops)) * self.error / self.size

    @property
    def home(self) -> Array:
        """The goal."""
        return np.zeros(self.angles + self.slides)

    @cached_property
    def frame(self) -> Array:  # type: ignore[override]
        """Two unit vectors of the plane; shape (2, 3)."""
        first = perpendicular(self.normal)
        return np.array([first, cross(self.normal, first)])

    @cached_property
    def forms(self) -> list[dict[Exponents, complex]]:
        """All equations as polynomials in u, v and t."""
        n = 2 * self.angles + self.slides
        units = [{tuple(int(i in (k, self.angles + k)) for i in range(n)): 1 + 0j, (0,) * n: -1 + 0j}
                 for k in range(self.angles)]
        return [*(form for loop in self.loops for form in loop.forms()), *units]

    @cached_property
    def residues(self) -> Residues:
        """The equations modulo a prime."""
        return Residues.of(self.forms)

    @cached_property
    def most(self) -> int:
        """How many isolated closings the degrees allow, with unknowns eliminated or not."""
        groups = groupings(self.angles, self.slides)
        return min(self.residues.most_by_degrees(), *(bezout(self.forms, each) for each in groups))

    def pose_of(self, link: str, q: Array) -> Array:
        """X_BL of a link (4, 4), m."""
        psi, t = q[:self.angles], q[self.angles:]
        shift = sum(a * (1.0 if k < 0 else t[k]) * np.exp(1j * (np.array(e) @ psi))
                    for (k, e), a in self.shifts[link].items())
        start, angle = self.goal.pose(link), float(np.array(self.turns[link]) @ psi)
        moved = self.size * (np.real(shift) * self.frame[0] + np.imag(shift) * self.frame[1])
        return pose(start[:3, 3] + moved, rotation_about(self.normal, angle) @ start[:3, :3])

    def placed(self, q: Array) -> dict[str, Array]:
        """The poses (4, 4) of the bodies that tell where the platform is."""
        return {body: self.pose_of(body, q) for body in self.bodies}

    def closing(self, q: Array) -> ClosedConfiguration:
        """The whole mechanism there, gears on the teeth on which they are at the goal."""
        twin, step = self.goal.twin, np.zeros(self.goal.twin.nv)
        for joint in twin.mechanism.joints.values():
            (place,) = twin.coordinates[joint.name]
            if joint.type.slides:
                k, factor = self.moves[joint.name]
                step[place] = 0.0 if k < 0 else factor * q[self.angles + k]
            else:
                E = np.subtract(self.turns[joint.successor], self.turns[joint.predecessor])
                axis = self.goal.pose(joint.predecessor)[:3, :3] @ twin.mechanism.links[joint.predecessor].inverse[
                    :3, :3] @ joint.axis
                step[place] = float(E @ q[:self.angles]) * np.sign(axis @ self.normal)
        return ClosedConfiguration.of(twin, close(twin, twin.moved(self.goal.q, step), tolerance=SOLVED)[0])

    def seen(self, x: Sequence[Any]) -> list[Any]:
        """What tells the pose of the bodies, each with its conjugate, at balls (cos ψ, sin ψ, t)."""
        found: list[Any] = []
        for body in self.bodies:
            e = self.turns[body]
            at = 0j if self.point is None else self._flat(self.goal.pose(body)[:3, :3] @ self.point)
            for sign in (1, -1):
                turn = _product(x, tuple(sign * k for k in e))
                shift = sum((_ball(a, sign) * (1 if k < 0 else x[2 * self.angles + k])
                             * _product(x, tuple(sign * i for i in f))
                             for (k, f), a in self.shifts[body].items()), turn * 0)
                found += [turn, shift] if self.point is None else [shift + turn * _ball(at, sign)]
        return found

    def _flat(self, vector: Array) -> complex:
        """A vector (m) in the plane (sizes)."""
        return complex(*(self.frame @ vector / self.size))


def _ball(a: complex, sign: int = 1) -> Any:
    from flint import acb

    return acb(a.real, sign * a.imag)


def planar_loops(measured: MeasuredRobot, goal: ClosedConfiguration) -> PlanarLoops:
    """The mechanism with the measurements at a configuration. Raises ``NotConfined`` where it is not planar, or what is
    measured are not directions and joints' coordinates, as many as it has freedoms."""
    return next(systems(measured, goal))


def systems(measured: MeasuredRobot, goal: ClosedConfiguration) -> Iterator[PlanarLoops]:
    """The mechanism, with more and more left to be measured besides; last where loops that are left out ask more than
    their own unknowns can meet, so that closings of the others need not be closings. Raises ``NotConfined``."""
    seen, reason, looser = measured.question.observations, "", list[PlanarLoops]()
    many = 0
    for size in range(len(seen), 0, -1):
        for chosen in combinations(seen, size):
            reading = _Reading(measured, goal, chosen)
            found = reading.system([each for each in seen if each not in chosen])
            if isinstance(found, str):
                reason = reason or found
            elif not found.most:  # what is chosen holds some loop twice
                reason = reason or "what is measured does not hold its loops"
            elif reading.more:
                looser.append(found)
            else:
                many += 1
                yield found
    yield from looser[:1]
    if not many and not looser:
        raise NotConfined(goal.twin.mechanism.name, reason)


class _Reading:
    """A mechanism's joints, in its plane."""

    def __init__(self, measured: MeasuredRobot, goal: ClosedConfiguration, seen: Sequence[Observation]) -> None:
        anatomy = measured.setting.anatomy
        self.mechanism, self.goal, self.seen = goal.twin.mechanism, goal, seen
        self.reference = measured.question.reference
        self.bodies, self.point = moved(anatomy), anatomy.point
        self.joints = list(self.mechanism.joints.values())
        self.axes = {joint.name: self._moved(joint.predecessor)[:3, :3] @ joint.axis for joint in self.joints
                     if joint.type in KINDS}
        self.normal = next((self.axes[joint.name] for joint in self.joints if joint.type is KINDS[0]), np.zeros(3))
        for joint in self.joints:
            along = abs(float(self.axes.get(joint.name, np.zeros(3)) @ self.normal))
            if joint.type not in KINDS or abs(along - (not joint.type.slides)) > SAME_DIRECTION:
                raise self._refused(f"joint {joint.name} is none of a planar mechanism")
        first = perpendicular(self.normal)
        self.frame = np.array([first, cross(self.normal, first)]) / goal.twin.length
        self.middle = np.mean([self._centre(joint) for joint in self.joints], axis=0)
        self.places = {link: i for i, link in enumerate(self.mechanism.links)}
        self.dropped = 0.0
        self.more = False
        """Whether the loops that are left out ask more than their own unknowns can meet."""

    def _refused(self, reason: str) -> NotConfined:
        return NotConfined(self.mechanism.name, reason)

    def _moved(self, link: str) -> Array:
        """How a link is displaced at the goal since zero (4, 4)."""
        return self.goal.pose(link) @ self.mechanism.links[link].inverse

    def _centre(self, joint: Joint) -> Array:
        return transform(self._moved(joint.predecessor), joint.point)

    def _flat(self, point: Array) -> complex:
        """A point (m) in the plane (sizes)."""
        return complex(*(self.frame @ (point - self.middle)))

    def system(self, besides: Sequence[Observation]) -> PlanarLoops | str:
        """As few loops as decide the pose, all where there are gears, or why they do not decide it one by one;
        ``besides`` is measured too."""
        turns, moves = self._turns(), self._moves()
        shifts, loops = self._loops(turns, moves)
        told = [each for body in self.bodies for each in shifts[body]]
        told += [] if self.point is not None else [(-1, turns[body]) for body in self.bodies]
        more = [*({(-1, turns[a]): 1 + 0j, (-1, turns[b]): -1 + 0j} for a, b in self._held(besides)),
                *({(moves[each.joint][0], turns[self.mechanism.base]): 1 + 0j} for each in besides
                  if isinstance(each, Encoder) and moves.get(each.joint, (-1, 0.0))[0] >= 0)]
        needed = _unknowns([*told, *(each for loop in more for each in loop)])
        geared = bool(self.mechanism.couplings)
        for size in range(len(loops) if geared else 1, len(loops) + 1):
            for part in combinations(loops, size):
                used = _unknowns([each for loop in part for each in loop])
                if len(used) == 2 * size and needed <= used:
                    left = _unknowns([each for loop in loops for each in loop]) - used
                    self.more = 2 * (len(loops) - size) > len(left)
                    return self._system(turns, moves, shifts, part, more, used)
        used = _unknowns([each for loop in loops for each in loop])
        return (f"{len(loops)} loops, which give {2 * len(loops)} equations, have {sum(not k for k, _ in used)} angles "
                f"and {sum(k for k, _ in used)} slides")

    def _system(self, turns: dict[str, Exponents], moves: dict[str, tuple[int, float]], shifts: dict[str, Sum],
                loops: Sequence[Sum], more: Sequence[Sum], used: set[tuple[bool, int]]) -> PlanarLoops:
        angles, slides = ([k for kind, k in sorted(used) if kind == slide] for slide in (False, True))

        def kept(e: Exponents) -> Exponents:
            return tuple(e[j] for j in angles)

        def of(terms: Sum) -> Sum:
            return {(slides.index(k) if k in slides else -1, kept(e)): a for (k, e), a in terms.items()}

        whole = [tuple(PlanarLoop(of(loop), len(angles), len(slides)) for loop in part)
                 for part in (map(_turned, loops), loops, more)]
        found = PlanarLoops((), np.zeros((0, 3)), self.goal, self.normal, {k: kept(e) for k, e in turns.items()},
                           {body: of(shifts[body]) for body in self.bodies},
                           {name: (slides.index(k) if k in slides else -1, by) for name, (k, by) in moves.items()},
                           whole[0], len(angles), len(slides), self.bodies, self.point, whole[2],
                           error=self.dropped * self.goal.twin.length)
        return min(found, replace(found, loops=whole[1]), key=lambda each: each.most)

    def _turns(self) -> dict[str, Exponents]:
        """E: all turns that slides, gears, and what is measured of turns allow."""
        rows = [self._row({self.mechanism.base: 1})]
        geared = [joint for _, _, *both in self._gears() for joint in both if not joint.type.slides]
        for name, ratio, one, other in self._gears():
            if one.type.slides is not other.type.slides:
                raise self._refused(f"coupling {name} is of a turn and a slide")
            if not one.type.slides:
                q = Fraction(ratio).limit_denominator(LARGEST_GEAR)
                if abs(float(q) - ratio) > SAME_GEOMETRY or abs(q) > LARGEST_GEAR:
                    raise self._refused(f"coupling {name}: {ratio:g} is no quotient of whole numbers up to "
                                        f"{LARGEST_GEAR}")
                row = Counter[str]()
                for joint, factor in ((one, -q.numerator), (other, q.denominator)):
                    sense = factor * (1 if self.axes[joint.name] @ self.normal > 0 else -1)
                    row.update({joint.successor: sense})
                    row.update({joint.predecessor: -sense})
                rows.append(self._row(row))
        rows += [self._row({one: 1, other: -1}) for one, other in self._held(self.seen, [j.name for j in geared])]
        if len(graphs.spanning_forest(self.mechanism.links, list({j.name: j for j in geared}.values()),
                                      [0.0] * len(geared))) < len({joint.name for joint in geared}):
            raise self._refused("its gears are in a ring")
        tied = whole_kernel(rows)
        assert tied is not None
        equal = [*(joint.links for joint in self.joints if joint.type.slides), *self._held(self.seen)]
        places = [[each[i] for each in tied] for i in range(len(self.places))]
        rest = whole_kernel([[a - b for a, b in zip(*(places[self.places[link]] for link in links), strict=True)]
                             for links in equal] or [[0] * len(tied)], whole=True)
        if rest is None:
            raise self._refused("its gears have several positions for what is measured")
        return {link: tuple(sum(a * b for a, b in zip(places[i], each, strict=True)) for each in rest)
                for link, i in self.places.items()}

    def _row(self, entries: dict[str, int]) -> list[int]:
        return [entries.get(link, 0) for link in self.places]

    def _held(self, seen: Sequence[Observation], joints: Sequence[str] | None = None) -> Iterator[tuple[str, str]]:
        """Pairs of links that do not turn against each other, of ``joints`` alone where these are given."""
        for each in seen:
            if isinstance(each, Direction):
                direction = self.goal.pose(each.link)[:3, :3] @ each.direction
                if joints is None and float(np.linalg.norm(cross(direction, self.normal))) > SAME_DIRECTION:
                    yield each.link, each.seen_from or self.reference
            elif not isinstance(each, Encoder) or each.joint not in self.mechanism.joints:
                raise self._refused(f"{each.kind} {each.leg} is no direction and no joint's coordinate")
            elif not self.mechanism.joints[each.joint].type.slides and (joints is None or each.joint in joints):
                yield self.mechanism.joints[each.joint].links

    def _gears(self) -> Iterator[tuple[str, float, Joint, Joint]]:
        """Names, ratios and the joints that carry what turns, and what is turned."""
        carriers = {joint.successor: joint for joint in reversed(self.joints) if joint.in_tree}
        for each in self.mechanism.couplings:
            yield each.name, each.ratio, carriers[each.predecessor], carriers[each.successor]

    def _moves(self) -> dict[str, tuple[int, float]]:
        """The number of each P's slide, -1 where it is held, and how many times its length the P moves."""
        sliding = [joint.name for joint in self.joints if joint.type.slides]
        roots = {name: (name, 1.0) for name in sliding}
        for name, ratio, one, other in self._gears():
            if one.type.slides:
                (a, f), (b, g) = roots[one.name], roots[other.name]  # g b = ratio f a
                if a == b:
                    raise self._refused(f"coupling {name} ties what is tied")
                for each, (root, factor) in list(roots.items()):
                    if root == b:
                        roots[each] = a, factor * ratio * f / g
        held = {roots[seen.joint][0] for seen in self.seen if isinstance(seen, Encoder) and seen.joint in roots}
        free = [name for name in sliding if roots[name][0] == name and name not in held]
        return {name: (free.index(root), factor) if root in free else (-1, 0.0)
                for name, (root, factor) in roots.items()}

    def _loops(self, turns: dict[str, Exponents], moves: dict[str, tuple[int, float]]
               ) -> tuple[dict[str, Sum], list[Sum]]:
        """How each link's frame is shifted, and what vanishes for each joint besides a spanning tree."""
        still = (-1, (0,) * len(turns[self.mechanism.base]))
        tree = graphs.spanning_forest(self.mechanism.links, self.joints, [0.0] * len(self.joints))
        origins: dict[str, Sum] = {self.mechanism.base: {}}
        for joint, near, far in graphs.outward(self.mechanism.base, tree):
            step = self._step(joint, turns, moves)
            origins[far] = self._sum(origins[near], step, 1 if near == joint.predecessor else -1)
        loops = [self._sum(self._sum(origins[joint.predecessor], self._step(joint, turns, moves)),
                           origins[joint.successor], -1) for joint in self.joints if joint not in tree]
        shifts = {}
        for link, origin in origins.items():
            at = self._flat(self.goal.pose(link)[:3, 3])
            shifts[link] = self._sum(self._sum(origin, {(-1, turns[link]): at}), {still: at}, -1)
        loops = [loop for loop in loops if loop]
        while (better := self._fewer(loops)) is not None:
            loops[better[0]] = better[1]
        return shifts, loops

    def _fewer(self, loops: Sequence[Sum]) -> tuple[int, Sum] | None:
        """A loop's place, and its sum with another or difference from it, where that has fewer unknowns, or of as many
        fewer slides: the degrees are lower."""
        def size(loop: Sum) -> tuple[int, int]:
            unknowns = _unknowns(loop)
            return len(unknowns), sum(slide for slide, _ in unknowns)

        for (i, one), (_, other), sign in ((a, b, s) for a, b in permutations(enumerate(loops), 2) for s in (1, -1)):
            total = self._sum(one, other, sign)
            if size(total) < size(one):
                return i, total
        return None

    def _step(self, joint: Joint, turns: dict[str, Exponents], moves: dict[str, tuple[int, float]]) -> Sum:
        """By how much the successor's origin is shifted more than the predecessor's."""
        if joint.type.slides:
            k, factor = moves[joint.name]
            along = factor * complex(*(self.frame @ self.axes[joint.name] * self.goal.twin.length))
            return {} if k < 0 else {(k, turns[joint.predecessor]): along}
        centre = self._flat(self._centre(joint))
        return self._sum({(-1, turns[joint.predecessor]): centre}, {(-1, turns[joint.successor]): centre}, -1)

    def _sum(self, one: Sum, other: Sum, factor: int = 1) -> Sum:
        """one + factor × other; what is nothing to rounding is left out."""
        total = dict(one)
        for key, a in other.items():
            total[key] = total.get(key, 0j) + factor * a
        self.dropped = max([self.dropped, *(abs(a) for a in total.values() if abs(a) < SAME_POINT)])
        return {key: a for key, a in total.items() if abs(a) >= SAME_POINT}


def _turned(loop: Sum) -> Sum:
    """A loop, turned with what most of its slides are on."""
    on = Counter(e for k, e in loop if k >= 0)
    if not on:
        return loop
    (by, _), = on.most_common(1)
    return {(k, tuple(a - b for a, b in zip(e, by, strict=True))): c for (k, e), c in loop.items()}


def _unknowns(terms: Iterable[tuple[int, Exponents]]) -> set[tuple[bool, int]]:
    """Angles and slides (True) that are in some terms."""
    return {(False, j) for _, e in terms for j, k in enumerate(e) if k} | {(True, k) for k, _ in terms if k >= 0}


def whole_kernel(rows: Sequence[Sequence[int]], whole: bool = False) -> list[list[int]] | None:
    """A basis of the whole vectors that are annulled; None where ``whole`` and the rows span less than all whole
    vectors that they do over the rationals: angles with whole turns in all rows are then not all joined to zero."""
    from flint import fmpz_mat

    if whole and any(abs(d) > 1 for row in fmpz_mat([list(row) for row in rows]).snf().table() for d in row):
        return None
    n, done = len(rows[0]), 0
    basis = [[int(i == j) for i in range(n)] for j in range(n)]
    for row in rows:
        while len(left := [(abs(v), k, v) for k, v in enumerate(_products(row, basis[done:])) if v]) > 1:
            _, least, divisor = min(left)
            for _, k, v in left:
                if k != least:
                    basis[done + k] = [a - v // divisor * b
                                       for a, b in zip(basis[done + k], basis[done + least], strict=True)]
        if left:
            k = done + left[0][1]
            basis[done], basis[k] = basis[k], basis[done]
            done += 1
    return basis[done:]


def _products(row: Sequence[int], vectors: Sequence[Sequence[int]]) -> list[int]:
    return [sum(a * b for a, b in zip(row, each, strict=True)) for each in vectors]


def groupings(angles: int, slides: int) -> Iterator[list[list[int]]]:
    """Ways to group all u, all v and all t: by kinds, each alone, few unknowns in all ways."""
    u, v, t = ([*range(k, k + n)] for k, n in ((0, angles), (angles, angles), (2 * angles, slides)))
    n = 2 * angles + slides
    alone = [[k] for k in t]
    for groups in ([u, v, t], [u + v + t], [u, v, *alone], [u + v, t], [[k] for k in range(n)],
                   [*map(list, zip(u, v, strict=True)), t]):
        yield [*filter(None, groups)]
    yield from partitions([*range(n)]) if n <= MOST_GROUPED else ()


def proposals(forms: Sequence[dict[Exponents, complex]], angles: int, enough: int) -> Array:
    """Common zeros (k, n) that Newton's method finds from random starts, with the conjugate of each, ``enough`` at
    most."""
    monomials = sorted({e for form in forms for e in form})
    M = np.array(monomials, dtype=float)
    C = np.array([[form.get(e, 0j) for e in monomials] for form in forms])
    rng, found = np.random.default_rng(0), np.zeros((0, M.shape[1]), dtype=complex)
    twin = [*range(angles, 2 * angles), *range(angles), *range(2 * angles, M.shape[1])]
    for _ in range(PLANAR_STARTS):
        x = rng.normal(size=(64, M.shape[1])) + 1j * rng.normal(size=(64, M.shape[1]))
        x[:, angles:2 * angles] = 1.0 / x[:, :angles]
        with np.errstate(all="ignore"):
            for _ in range(40):
                values = np.exp(np.log(x) @ M.T)
                J = ((values[:, None, :] * C) @ M) / x[:, None, :]
                good = np.all(np.isfinite(J), axis=(1, 2))
                x, values, J = x[good], values[good], J[good]
                F = (values @ C.T)[:, :, None]
                try:
                    step = np.linalg.solve(J, F)[:, :, 0]
                except np.linalg.LinAlgError:
                    step = (np.linalg.pinv(J) @ F)[:, :, 0]
                x = x - step
                x[x == 0] = 1e-200
            close_ = np.abs(step).max(axis=1) < 1e-10 * (1.0 + np.abs(x).max(axis=1))
        for each in x[close_]:
            for y in (each, each[twin].conj()):
                if len(found) < enough and not np.any(np.abs(found - y).max(axis=1, initial=0.0)
                                                      < 1e-6 * (1.0 + np.abs(y).max())):
                    found = np.vstack([found, y])
        if len(found) >= enough:
            break
    return found


def solve_loops(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0) -> tuple[Model, SystemModes]:
    """All modes, with the goal known to ``error`` (m). Raises ``NotConfined``, and ``Unsolved`` where not all closings
    are enclosed that there may be."""
    refused: Unsolved | None = None
    for system in islice(systems(measured, goal), LOOP_SYSTEMS):
        system = replace(system, error=system.error + error)
        try:
            found = _judged(system)
        except Unsolved as unsolved:
            refused = refused or unsolved
        else:
            break
    else:
        assert refused is not None
        raise refused
    closing = system.closing if goal.twin.mechanism.couplings else None  # else not all loops need be among those
    return Model(system, system.placed, system.home, closing=closing), found


def _judged(system: PlanarLoops) -> SystemModes:
    """The modes: as many closings as the degrees in groups of unknowns allow, or else the ranks of multiples."""
    loops, angles, slides = (f"{n} {word}{'s' * (n != 1)}" for n, word in (
        (len(system.loops), "loop"), (system.angles, "angle"), (system.slides, "slide")))
    size = f"{loops}, {angles} and {slides}"
    most, why, bound = system.most, "degrees in groups of unknowns (Bézout)", "class"
    if most > LARGEST_LOOPS:
        raise Unsolved("the loops", f"{size}: up to {most} closings, too many (at most {LARGEST_LOOPS})")
    boxes, lost = _enclosed(system, proposals(system.forms, system.angles, most))
    if len(boxes) < most and (fewer := system.residues.most_by_ranks(len(boxes))) is not None and fewer < most:
        most, why, bound = fewer, "ranks modulo a prime of 62 bits", "rank"
    start = np.array([1.0] * system.angles + [0.0] * (system.angles + system.slides))
    at_goal = [box for box in boxes if box.real and box.holds(start)]
    if len(boxes) < most or lost or len(at_goal) != 1:
        raise Unsolved("the loops", f"{size}: of {most} closings at most ({why}) {len(boxes)} have boxes")
    seen = [system.seen(_balls(box)) for box in boxes]
    if any(all((a - b).contains(0) for a, b in zip(one, other, strict=True))
           for k, one in enumerate(seen) for other in seen[:k]):
        raise Unsolved("the loops", f"{size}: several of {most} closings have one pose of the platform")
    real = [box for box in boxes if box.real]
    proof = (f"{size}: at most {most} closings by {why}, {len(boxes)} enclosed apart from each other, complex ones "
             f"too, {len(real)} real")
    if not system.besides:
        modes = tuple(_mode(system, box, True) for box in real)
        return SystemModes(len(boxes), modes, True, proof, bound=bound, enclosed=True)
    kept = [box for box in real if box is at_goal[0] or not excluded(system, box)]
    modes = tuple(_mode(system, box, box is at_goal[0]) for box in kept)
    return SystemModes.of_more(modes, len(real) - len(kept), proof, bound)


def enclosures(system: PlanarLoops) -> list[PoseBox]:
    """Boxes of closings, complex ones too, apart from each other."""
    return _enclosed(system, proposals(system.forms, system.angles, system.most))[0]


def excluded(system: PlanarLoops, box: PoseBox) -> bool:
    """Whether something that is measured besides is another at each closing in a real box."""
    return any(not _Part(each, part, system.slack).value(_balls(box)).contains(0) for each in system.besides
               for part in (False, True))


def _balls(box: PoseBox) -> list[Any]:
    """The unknowns of a box as complex balls."""
    from flint import acb, arb

    return [acb(arb(float(m.real), float(r)), arb(float(m.imag), 0.0 if box.real else float(r)))
            for m, r in zip(box.middle, box.radii, strict=True)]


def _enclosed(system: PlanarLoops, proposed: Array) -> tuple[list[PoseBox], int]:
    """Boxes of closings, apart from each other, and how many proposals have none."""
    a, slack = system.angles, system.slack
    equations: list[Polynomial] = [*(_Part(loop, part, slack) for loop in system.loops for part in (False, True)),
                                   *(UnitCircle(k, a + k) for k in range(a))]
    u, v, t = proposed[:, :a], proposed[:, a:2 * a], proposed[:, 2 * a:]
    return zeros(equations, np.hstack([(u + v) / 2, (u - v) / 2j, t]))


def _mode(system: PlanarLoops, box: PoseBox, proved: bool) -> SystemMode:
    """A real box as a mode, or as one that fits."""
    a, x = system.angles, box.middle.real
    q = np.array([*np.arctan2(x[a:2 * a], x[:a]), *x[2 * a:]])
    spread = [float(each.real.rad()) + float(each.imag.rad()) for each in system.seen(_balls(box))]
    shift = 2.0 * system.size * max(spread)
    turn = 0.0 if system.point is not None else 4.0 * max(spread)
    at = np.array([*np.exp(1j * q[:a]), *np.exp(-1j * q[:a]), *q[a:]])
    forms = [*system.forms, *(form for each in system.besides for form in each.forms())]
    residual = max(float(abs(sum(c * complex(np.prod(at ** e)) for e, c in form.items()))) for form in forms)
    return SystemMode((), max(shift / system.size, turn), shift, turn, residual,
                      frozen(system.pose_of(system.bodies[0], q)), frozen(q), proved=proved, fits=not proved)
