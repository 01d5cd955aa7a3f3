"""Modes of a platform that one leg carries: as many solutions as there may be, each in a box of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...constraints.pattern import list_leg_ends
from ...errors import ExternalSolverFailure, UnsupportedLocus
from ...geometry.vectors import Array, cross, freeze_array, hat
from ...kinematics.configuration import ClosedConfiguration
from ...solving.krawczyk import Polynomial, enclose_zero
from ...solving.newton import approach_zeros, collect_zeros
from ...solving.platform.pose_boxes import (
    COMPLEX_ZERO_IMAGINARY_MIN,
    POSE_BOX_BITS_COUNT,
    PoseBox,
    UnitLength,
    describe_far,
    enclose_all,
    find_box_at,
    make_box,
)
from ...solving.platform.pose_conditions import PoseCondition
from ...solving.platform.pose_forms import Poses
from ...solving.platform.solve import SystemMode, SystemModes
from ..loci.carrying_leg import build_carried_platform
from ..loci.carrying_leg_system import CarriedCondition, CarriedEquation, CarriedPlatform
from ..loci.joint_forms import count_closures, find_closures
from ..measured import MeasuredRobot
from .branches import Model

RANDOM_START_JOINTS_MAX = 2
"""Joints up to which random starts find all zeros soon."""
START_SETS_COUNT = 20
"""Number of sets of 64 random starts."""
CLOSURES_MAX = 120
"""Largest number of solutions that are searched for."""


@dataclass(frozen=True, eq=False)
class _Half(CarriedEquation):
    """A condition in the tangents t of half the angles and in slides, numbers as they are: with an axis a the turn of
    the quaternion 1 + t a, whatever the length of a."""

    idle: frozenset[int]

    def point_and_arrow(self, x: Sequence[Any]) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        R, p, at = self.of(np.eye(3)), self.of(np.zeros(3)), list[tuple[int, Any, Any]]()
        for k, freedom in enumerate(self.freedoms[: self.joints]):
            if k in self.idle:
                continue
            a, o, t = self.of(freedom.axis), self.of(freedom.point), x[k]
            if freedom.slides:
                at.append((k, None, R @ a))
                p = p + R @ a * t
                continue
            w = 1 + t * t * (a @ a)
            at.append((k, R @ a * (2 / w), p + R @ o))
            turn = (
                np.eye(3, dtype=int) * (2 - w) + np.outer(a, a) * (2 * t * t) + self.of(hat(freedom.axis)) * (2 * t)
            ) / w
            R, p = R @ turn, p + R @ (o - turn @ o)
        point, arrow = p + R @ self.of(self.condition.b), R @ self.of(self.condition.c)
        return (
            point,
            arrow,
            [
                (k, place, 0 * arrow) if rate is None else (k, cross(rate, point - place), cross(rate, arrow))
                for k, rate, place in at
            ],
        )


@dataclass(frozen=True)
class _FixedUnknown:
    """An unknown, by its number, that has a value."""

    k: int
    at: int

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return x[self.k] - self.at

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        return [0 * v + (j == self.k) for j, v in enumerate(x)]


def measure_joint_distances(slides: Array, x: Array, y: Array) -> Array:
    """Distances of joint coordinates (…, n), angles up to whole turns."""
    return np.asarray(np.abs(np.where(slides, x - y, np.exp(1j * (x - y)) - 1.0)).max(axis=-1))


def propose_zeros(system: CarriedPlatform, most: int) -> Array:
    """Common zeros (k, n) that Newton's method finds from random complex starts, each with its conjugate."""
    rng, n = np.random.default_rng(0), len(system.freedoms_)
    starts = (rng.uniform(-np.pi, np.pi, (64, n)) + 3j * rng.normal(size=(64, n)) for _ in range(START_SETS_COUNT))
    return polish_zeros(system, starts, most)


def polish_zeros(system: CarriedPlatform, starts: Iterable[Array], enough: float = np.inf) -> Array:
    """The common zeros (k, n) to which Newton's method leads, each with its conjugate, until there are enough."""
    slides = np.array([freedom.slides for freedom in system.freedoms_])
    ends = (approach_zeros(lambda q: system.values(q, system.square), q, steps=100, longest=0.5) for q in starts)
    zeros = collect_zeros(ends, enough, measure=partial(measure_joint_distances, slides))
    return np.where(slides, zeros, np.angle(np.exp(1j * zeros.real)) + 1j * zeros.imag)


def solve_carried(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0) -> tuple[Model, SystemModes]:
    """List all modes, with the goal known to ``error`` (m). Raises ``UnsupportedLocus``, and ``ExternalSolverFailure``
    if not all zeros that there may be are enclosed."""
    if not np.isfinite(error):
        raise UnsupportedLocus(
            measured.setup.robot.name, "the distance to the exact closed configuration is not bounded"
        )
    system = build_carried_platform(measured, goal, error)
    (body,) = list_leg_ends(measured.setup.decomposition)
    return Model(system, lambda q: {body: system.pose(q)}, system.home), _judge(system)


def enclose_zeros(system: CarriedPlatform, proposed: Array) -> list[PoseBox]:
    """Boxes of common zeros in c, s and t, apart from each other."""
    n = len(system.freedoms_)
    equations: list[Polynomial] = [system.equation(carried) for carried in system.square]
    for k, freedom in enumerate(system.freedoms_):
        equations += (
            [_FixedUnknown(k, 1), _FixedUnknown(n + k, 0)]
            if freedom.slides
            else [UnitLength((k, n + k)), _FixedUnknown(2 * n + k, 0)]
        )
    return enclose_all(equations, map(system.unknowns, proposed))[0]


def _enclose_far(system: CarriedPlatform, proposed: Array, known: Sequence[PoseBox]) -> list[PoseBox]:
    """Boxes of the zeros, of the numbers as they are, at which a turn is far from real, apart from those known."""
    from flint import acb, ctx

    equations: list[Polynomial] = [
        _Half(carried.condition, Poses.spatial(), None, system.freedoms_, carried.joints, carried.idle)
        for carried in system.square
    ]
    slides, boxes = np.array([freedom.slides for freedom in system.freedoms_]), list[PoseBox]()
    with ctx.workprec(POSE_BOX_BITS_COUNT):
        for q in proposed:
            if np.abs(q.imag[~slides]).max(initial=0.0) < COMPLEX_ZERO_IMAGINARY_MIN or find_box_at(
                known, system.unknowns(q)
            ):
                continue
            with np.errstate(all="ignore"):
                start = np.where(slides, q, np.tan(q / 2.0))
            half = enclose_zero(equations, [acb(v.real, v.imag) for v in start.tolist()])
            if half is None:
                continue
            squares = [1 + t * t for t in half]
            box = make_box(
                [
                    *(t * 0 + 1 if slid else 2 / w - 1 for t, w, slid in zip(half, squares, slides, strict=True)),
                    *(t * 0 if slid else 2 * t / w for t, w, slid in zip(half, squares, slides, strict=True)),
                    *(t if slid else t * 0 for t, slid in zip(half, slides, strict=True)),
                ],
                False,
                0,
            )
            if box is not None and box.is_disjoint_from((*known, *boxes)):
                boxes.append(replace(box, rounded=True))
    return boxes


def _judge(system: CarriedPlatform) -> SystemModes:
    """The modes: as many zeros as the degrees allow."""
    from flint import ctx

    n, most = len(system.freedoms_), system.most(system.square)
    size = f"{n} joint{'s' * (n > 1)} of the leg that carries the platform"
    if most > CLOSURES_MAX:
        raise ExternalSolverFailure("the leg", f"{size}: up to {most} solutions, too many (at most {CLOSURES_MAX})")
    why, bound = "degrees in each (Bézout)", "class"
    boxes = enclose_zeros(system, propose_zeros(system, most)) if n <= RANDOM_START_JOINTS_MAX else []
    if len(boxes) < most and (counted := count_closures(system, system.square)) is not None:
        most, why, bound = counted.most, "ranks modulo a prime of 62 bits", "rank"
        proposed = polish_zeros(system, [find_closures(system, system.square, counted)])
        boxes = enclose_zeros(system, proposed)
        boxes += _enclose_far(system, proposed, boxes)
    at_goal = [box for box in boxes if box.real and box.has_pose(system.unknowns(system.home))]
    if len(boxes) != most or len(at_goal) != 1:
        raise ExternalSolverFailure("the leg", f"{size}: of {most} solutions at most ({why}) {len(boxes)} have boxes")
    bodies = [_place_body(system, box) for box in boxes]
    if any(
        all((a - b).contains(0) for a, b in zip(body, before, strict=True))
        for k, body in enumerate(bodies)
        for before in bodies[:k]
    ):
        raise ExternalSolverFailure("the leg", f"{size}: several of {most} solutions have one pose of the platform")
    besides = [system.equation(carried) for carried in system.told if carried not in system.square]
    real = [box for box in boxes if box.real]
    with ctx.workprec(POSE_BOX_BITS_COUNT):
        kept = [
            box
            for box in real
            if box is at_goal[0] or not any(not equation.value(box.box).contains(0) for equation in besides)
        ]
        modes = [make_mode(system, box, not besides or box is at_goal[0]) for box in kept]
    proof = (
        f"{size}: at most {most} solutions by {why}, {len(boxes)} enclosed, all distinct, complex ones "
        f"too{describe_far(boxes)}, {len(real)} real"
    )
    if not besides:
        return SystemModes(len(boxes), tuple(modes), True, proof, bound=bound, enclosed=True)
    out = [make_mode(system, box, False) for box in real if box not in kept]
    return SystemModes.of_more(modes, out, f"from {n} of {len(system.told)} conditions: {proof}", bound)


def _place_body(system: CarriedPlatform, box: PoseBox) -> list[Any]:
    """The position and the three columns of the turn that carries the platform from the goal, in balls."""
    from flint import ctx

    placed = list[Any]()
    with ctx.workprec(POSE_BOX_BITS_COUNT):
        for c in np.vstack([np.zeros(3), np.eye(3)]):
            carried = CarriedCondition(PoseCondition("", np.zeros(3), c), system.carrying)
            at, arrow, _ = system.equation(carried).point_and_arrow(box.box)
            placed += [*(arrow if c.any() else at)]
    return placed


def make_mode(system: CarriedPlatform, box: PoseBox, proved: bool, miss: float | None = None) -> SystemMode:
    """A real box as a mode, or as one that fits; ``miss``: how far it is from meeting all (sizes)."""
    n, x = len(system.freedoms_), box.middle.real
    q = np.array(
        [x[2 * n + k] if freedom.slides else np.arctan2(x[n + k], x[k]) for k, freedom in enumerate(system.freedoms_)]
    )
    spread = [float(v.rad()) for v in _place_body(system, box)]
    shift, turn = system.size * float(np.linalg.norm(spread[:3])), 2.0 * float(np.linalg.norm(spread[3:]))
    if miss is None:
        values, slopes = system.values(q, system.told)
        misses = np.abs(values) / np.maximum(1.0, np.linalg.norm(slopes, axis=-1))
        miss = float(np.max(misses)) if misses.size else np.inf
    return SystemMode(
        (),
        max(shift / system.size, turn),
        shift,
        turn,
        miss,
        freeze_array(system.pose(q)),
        freeze_array(q),
        proved=proved,
        match_residual=not proved,
    )
