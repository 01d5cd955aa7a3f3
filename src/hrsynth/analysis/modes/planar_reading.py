"""A planar mechanism's loops, read from its joints: turns of links by whole numbers, gears and measurements too."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import combinations, permutations

import numpy as np

from ...constraints.pattern import list_placing_links
from ...errors import UnsupportedLocus
from ...geometry.vectors import Array, build_plane_axes, cross, transform
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Observation, graphs
from ...mechanism.observations.direction import Direction
from ...mechanism.observations.encoder import Encoder
from ...tolerances import DIRECTION_SINE_TOL, GEOMETRY_DIFFERENCE_TOL, LARGEST_GEAR, POINT_DISTANCE_TOL
from ..measured import MeasuredRobot
from .planar_loops import Exponents, PlanarLoop, PlanarLoops, Sum

KINDS = (JointType.REVOLUTE, JointType.PRISMATIC)


def planar_loops(measured: MeasuredRobot, goal: ClosedConfiguration) -> PlanarLoops:
    """Read the mechanism with the measured values at a configuration. Raises ``UnsupportedLocus`` if it is not planar,
    or if the observations are not directions and joints' coordinates, as many as the dof."""
    return next(systems(measured, goal))


def systems(measured: MeasuredRobot, goal: ClosedConfiguration) -> Iterator[PlanarLoops]:
    """Yield the mechanism, with fewer and fewer values locked in its loops; last those whose left out loops have more
    conditions than unknowns, so that solutions of the others need not close them. Raises ``UnsupportedLocus``."""
    seen, reason, tight, looser = measured.observation_model.observations, "", False, list[PlanarLoops]()
    for size in range(len(seen), 0, -1):
        for chosen in combinations(seen, size):
            reading = _PlanarJoints(measured, goal, chosen)
            found = reading.system([each for each in seen if each not in chosen])
            if isinstance(found, str):
                reason = reason or found
            elif not found.most:  # the choice locks some loop twice
                reason = reason or "the measured values do not lock its loops"
            elif reading.more:
                looser.append(found)
            else:
                tight = True
                yield found
    yield from looser[:1]
    if not tight and not looser:
        raise UnsupportedLocus(goal.model.mechanism.name, reason)


class _PlanarJoints:
    """A mechanism's joints, in its plane."""

    def __init__(self, measured: MeasuredRobot, goal: ClosedConfiguration, seen: Sequence[Observation]) -> None:
        decomposition = measured.setup.decomposition
        self.mechanism, self.goal, self.seen = goal.model.mechanism, goal, seen
        self.reference = measured.observation_model.reference
        self.bodies, self.point = list_placing_links(decomposition), decomposition.point
        self.joints = list(self.mechanism.joints.values())
        self.axes = {
            joint.name: self._displacement(joint.predecessor)[:3, :3] @ joint.axis
            for joint in self.joints
            if joint.type in KINDS
        }
        self.normal = next((self.axes[joint.name] for joint in self.joints if joint.type is KINDS[0]), np.zeros(3))
        for joint in self.joints:
            along = abs(float(self.axes.get(joint.name, np.zeros(3)) @ self.normal))
            if joint.type not in KINDS or abs(along - (not joint.type.has_translation)) > DIRECTION_SINE_TOL:
                raise self._refuse(f"joint {joint.name} is not one of a planar mechanism")
        self.frame = build_plane_axes(self.normal) / goal.model.length
        self.middle = np.mean([self._centre(joint) for joint in self.joints], axis=0)
        self.places = {link: i for i, link in enumerate(self.mechanism.links)}
        self.dropped = 0.0
        self.more = False
        """Return True if the left out loops have more conditions than their own unknowns can meet."""

    def _refuse(self, reason: str) -> UnsupportedLocus:
        return UnsupportedLocus(self.mechanism.name, reason)

    def _displacement(self, link: str) -> Array:
        """Return the displacement of a link at the goal since zero (4, 4)."""
        return self.goal.pose(link) @ self.mechanism.links[link].inverse

    def _centre(self, joint: Joint) -> Array:
        return transform(self._displacement(joint.predecessor), joint.point)

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
        more = [
            *({(-1, turns[a]): 1 + 0j, (-1, turns[b]): -1 + 0j} for a, b in self._held_pairs(besides)),
            *(
                {(moves[each.joint][0], turns[self.mechanism.base]): 1 + 0j}
                for each in besides
                if isinstance(each, Encoder) and moves.get(each.joint, (-1, 0.0))[0] >= 0
            ),
        ]
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
        return (
            f"{len(loops)} loops, which give {2 * len(loops)} equations, have {sum(not k for k, _ in used)} angles "
            f"and {sum(k for k, _ in used)} slides"
        )

    def _system(
        self,
        turns: dict[str, Exponents],
        moves: dict[str, tuple[int, float]],
        shifts: dict[str, Sum],
        loops: Sequence[Sum],
        more: Sequence[Sum],
        used: set[tuple[bool, int]],
    ) -> PlanarLoops:
        angles, slides = ([k for kind, k in sorted(used) if kind == slide] for slide in (False, True))

        def kept(e: Exponents) -> Exponents:
            return tuple(e[j] for j in angles)

        def of(terms: Sum) -> Sum:
            return {(slides.index(k) if k in slides else -1, kept(e)): a for (k, e), a in terms.items()}

        whole = [
            tuple(PlanarLoop(of(loop), len(angles), len(slides)) for loop in part)
            for part in (map(_turn_loop, loops), loops, more)
        ]
        found = PlanarLoops(
            (),
            np.zeros((0, 3)),
            self.goal,
            self.normal,
            {k: kept(e) for k, e in turns.items()},
            {body: of(shifts[body]) for body in self.bodies},
            {name: (slides.index(k) if k in slides else -1, by) for name, (k, by) in moves.items()},
            whole[0],
            len(angles),
            len(slides),
            self.bodies,
            self.point,
            whole[2],
            error=self.dropped * self.goal.model.length,
        )
        return min(found, replace(found, loops=whole[1]), key=lambda each: each.most)

    def _turns(self) -> dict[str, Exponents]:
        """E: all turns that slides, gears, and what is measured of turns allow."""
        rows = [self._row({self.mechanism.base: 1})]
        geared = [joint for _, _, *both in self._gears() for joint in both if not joint.type.has_translation]
        for name, ratio, one, other in self._gears():
            if one.type.has_translation is not other.type.has_translation:
                raise self._refuse(f"coupling {name} joins a rotation and a translation")
            if not one.type.has_translation:
                q = Fraction(ratio).limit_denominator(LARGEST_GEAR)
                if abs(float(q) - ratio) > GEOMETRY_DIFFERENCE_TOL or abs(q) > LARGEST_GEAR:
                    raise self._refuse(
                        f"coupling {name}: {ratio:g} is not a quotient of whole numbers up to {LARGEST_GEAR}"
                    )
                row = Counter[str]()
                for joint, factor in ((one, -q.numerator), (other, q.denominator)):
                    sense = factor * (1 if self.axes[joint.name] @ self.normal > 0 else -1)
                    row.update({joint.successor: sense})
                    row.update({joint.predecessor: -sense})
                rows.append(self._row(row))
        rows += [self._row({one: 1, other: -1}) for one, other in self._held_pairs(self.seen, [j.name for j in geared])]
        if len(
            graphs.build_spanning_forest(
                self.mechanism.links, list({j.name: j for j in geared}.values()), [0.0] * len(geared)
            )
        ) < len({joint.name for joint in geared}):
            raise self._refuse("its couplings form a cycle")
        tied = whole_kernel(rows)
        assert tied is not None
        equal = [*(joint.links for joint in self.joints if joint.type.has_translation), *self._held_pairs(self.seen)]
        places = [[each[i] for each in tied] for i in range(len(self.places))]
        rest = whole_kernel(
            [[a - b for a, b in zip(*(places[self.places[link]] for link in links), strict=True)] for links in equal]
            or [[0] * len(tied)],
            whole=True,
        )
        if rest is None:
            raise self._refuse("its couplings have several positions for the measured values")
        return {
            link: tuple(sum(a * b for a, b in zip(places[i], each, strict=True)) for each in rest)
            for link, i in self.places.items()
        }

    def _row(self, entries: dict[str, int]) -> list[int]:
        return [entries.get(link, 0) for link in self.places]

    def _held_pairs(
        self, seen: Sequence[Observation], joints: Sequence[str] | None = None
    ) -> Iterator[tuple[str, str]]:
        """Pairs of links that do not turn against each other, of ``joints`` alone where these are given."""
        for each in seen:
            if isinstance(each, Direction):
                direction = self.goal.pose(each.link)[:3, :3] @ each.direction
                if joints is None and float(np.linalg.norm(cross(direction, self.normal))) > DIRECTION_SINE_TOL:
                    yield each.link, each.seen_from or self.reference
            elif not isinstance(each, Encoder) or each.joint not in self.mechanism.joints:
                raise self._refuse(f"{each.text} is neither a direction nor a joint's coordinate")
            elif not self.mechanism.joints[each.joint].type.has_translation and (
                joints is None or each.joint in joints
            ):
                yield self.mechanism.joints[each.joint].links

    def _gears(self) -> Iterator[tuple[str, float, Joint, Joint]]:
        """Names, ratios, drivers and driven joints of the couplings."""
        joints = {joint.name: joint for joint in self.joints}
        for each in self.mechanism.couplings:
            yield each.name, each.ratio, joints[each.driver], joints[each.driven]

    def _moves(self) -> dict[str, tuple[int, float]]:
        """Return the number of each P's slide, -1 where it is fixed, and how many times its length the P moves."""
        sliding = [joint.name for joint in self.joints if joint.type.has_translation]
        roots = {name: (name, 1.0) for name in sliding}
        for name, ratio, one, other in self._gears():
            if one.type.has_translation:
                (a, f), (b, g) = roots[one.name], roots[other.name]  # g b = ratio f a
                if a == b:
                    raise self._refuse(f"coupling {name} joins coupled joints")
                for each, (root, factor) in list(roots.items()):
                    if root == b:
                        roots[each] = a, factor * ratio * f / g
        held = {roots[seen.joint][0] for seen in self.seen if isinstance(seen, Encoder) and seen.joint in roots}
        free = [name for name in sliding if roots[name][0] == name and name not in held]
        return {
            name: (free.index(root), factor) if root in free else (-1, 0.0) for name, (root, factor) in roots.items()
        }

    def _loops(
        self, turns: dict[str, Exponents], moves: dict[str, tuple[int, float]]
    ) -> tuple[dict[str, Sum], list[Sum]]:
        """Return the shift of each link's frame, and the closure equations of each joint besides a spanning tree."""
        still = (-1, (0,) * len(turns[self.mechanism.base]))
        tree = graphs.build_spanning_forest(self.mechanism.links, self.joints, [0.0] * len(self.joints))
        origins: dict[str, Sum] = {self.mechanism.base: {}}
        for joint, near, far in graphs.order_outward(self.mechanism.base, tree):
            step = self._step(joint, turns, moves)
            origins[far] = self._sum(origins[near], step, 1 if near == joint.predecessor else -1)
        loops = [
            self._sum(
                self._sum(origins[joint.predecessor], self._step(joint, turns, moves)), origins[joint.successor], -1
            )
            for joint in self.joints
            if joint not in tree
        ]
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
        """Return the difference of the successor's and the predecessor's origin shift."""
        if joint.type.has_translation:
            k, factor = moves[joint.name]
            along = factor * complex(*(self.frame @ self.axes[joint.name] * self.goal.model.length))
            return {} if k < 0 else {(k, turns[joint.predecessor]): along}
        centre = self._flat(self._centre(joint))
        return self._sum({(-1, turns[joint.predecessor]): centre}, {(-1, turns[joint.successor]): centre}, -1)

    def _sum(self, one: Sum, other: Sum, factor: int = 1) -> Sum:
        """Return one + factor × other, without what rounding makes zero."""
        total = dict(one)
        for key, a in other.items():
            total[key] = total.get(key, 0j) + factor * a
        self.dropped = max([self.dropped, *(abs(a) for a in total.values() if abs(a) < POINT_DISTANCE_TOL)])
        return {key: a for key, a in total.items() if abs(a) >= POINT_DISTANCE_TOL}


def _turn_loop(loop: Sum) -> Sum:
    """A loop, turned with what most of its slides are on."""
    on = Counter(e for k, e in loop if k >= 0)
    if not on:
        return loop
    ((by, _),) = on.most_common(1)
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
                    basis[done + k] = [
                        a - v // divisor * b for a, b in zip(basis[done + k], basis[done + least], strict=True)
                    ]
        if left:
            k = done + left[0][1]
            basis[done], basis[k] = basis[k], basis[done]
            done += 1
    return basis[done:]


def _products(row: Sequence[int], vectors: Sequence[Sequence[int]]) -> list[int]:
    return [sum(a * b for a, b in zip(row, each, strict=True)) for each in vectors]
