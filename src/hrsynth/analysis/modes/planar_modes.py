"""Modes of a planar mechanism: as many solutions as there may be, each in a box of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from ...errors import ExternalSolverFailure
from ...geometry.vectors import Array, freeze_array
from ...kinematics.configuration import ClosedConfiguration
from ...solving.krawczyk import Polynomial
from ...solving.newton import approach_zeros, collect_zeros
from ...tolerances import LARGEST_LOOPS, LOOP_SYSTEMS, PLANAR_STARTS
from ..measured import MeasuredRobot
from .branches import Model
from .planar_loops import Exponents, PlanarLoops, SumPart
from .planar_reading import systems
from .pose_boxes import PoseBox, UnitLength, zeros
from .solve import SystemMode, SystemModes


def proposals(forms: Sequence[dict[Exponents, complex]], angles: int, enough: int) -> Array:
    """Common zeros (k, n) that Newton's method finds from random starts, with the conjugate of each, ``enough`` at
    most."""
    monomials = sorted({e for form in forms for e in form})
    M = np.array(monomials, dtype=float)
    C = np.array([[form.get(e, 0j) for e in monomials] for form in forms])
    rng = np.random.default_rng(0)
    model = [*range(angles, 2 * angles), *range(angles), *range(2 * angles, M.shape[1])]

    def evaluate(x: Array) -> tuple[Array, Array]:
        x = np.where(x == 0, 1e-200, x)
        values = np.exp(np.log(x) @ M.T)
        return values @ C.T, ((values[:, None, :] * C) @ M) / x[:, None, :]

    def draw() -> Array:
        x = rng.normal(size=(64, M.shape[1])) + 1j * rng.normal(size=(64, M.shape[1]))
        x[:, angles : 2 * angles] = 1.0 / x[:, :angles]
        return x

    ends = (approach_zeros(evaluate, draw(), steps=40) for _ in range(PLANAR_STARTS))
    return collect_zeros(ends, enough, lambda x: x[:, model].conj())[:enough]


def solve_loops(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0) -> tuple[Model, SystemModes]:
    """All modes, with the goal known to ``error`` (m). Raises ``UnsupportedLocus``, and ``ExternalSolverFailure`` where
    not all closings are enclosed that there may be."""
    refused = list[ExternalSolverFailure]()
    for system in islice(systems(measured, goal), LOOP_SYSTEMS):
        system = replace(system, error=system.error + error)
        try:
            found = _judge(system)
        except ExternalSolverFailure as unsolved:
            refused.append(unsolved)
        else:
            # without couplings not all loops need be among those
            closing = system.closing if goal.model.mechanism.couplings else None
            return Model(system, system.body_poses, system.home, closing=closing), found
    raise refused[0]


def _judge(system: PlanarLoops) -> SystemModes:
    """The modes: as many closings as the degrees in groups of unknowns allow, or else the ranks of multiples."""
    loops, angles, slides = (
        f"{n} {word}{'s' * (n != 1)}"
        for n, word in ((len(system.loops), "loop"), (system.angles, "angle"), (system.slides, "slide"))
    )
    size = f"{loops}, {angles} and {slides}"
    most, why, bound = system.most, "degrees in groups of unknowns (Bézout)", "class"
    if most > LARGEST_LOOPS:
        raise ExternalSolverFailure("the loops", f"{size}: up to {most} solutions, too many (at most {LARGEST_LOOPS})")
    boxes, lost = _enclose(system, proposals(system.forms, system.angles, most))
    if len(boxes) < most and (fewer := system.residues.most_by_ranks(len(boxes))) is not None and fewer < most:
        most, why, bound = fewer, "ranks modulo a prime of 62 bits", "rank"
    start = np.array([1.0] * system.angles + [0.0] * (system.angles + system.slides))
    at_goal = [box for box in boxes if box.real and box.has_pose(start)]
    if len(boxes) < most or lost or len(at_goal) != 1:
        raise ExternalSolverFailure("the loops", f"{size}: of {most} solutions at most ({why}) {len(boxes)} have boxes")
    seen = [system.pose_terms(_balls(box)) for box in boxes]
    if any(
        all((a - b).contains(0) for a, b in zip(one, other, strict=True))
        for k, one in enumerate(seen)
        for other in seen[:k]
    ):
        raise ExternalSolverFailure("the loops", f"{size}: several of {most} solutions have one pose of the platform")
    real = [box for box in boxes if box.real]
    proof = (
        f"{size}: at most {most} solutions by {why}, {len(boxes)} enclosed, all distinct, complex ones "
        f"too, {len(real)} real"
    )
    if not system.besides:
        modes = tuple(_mode(system, box, True) for box in real)
        return SystemModes(len(boxes), modes, True, proof, bound=bound, enclosed=True)
    kept = [box for box in real if box is at_goal[0] or not is_excluded(system, box)]
    modes = tuple(_mode(system, box, box is at_goal[0]) for box in kept)
    return SystemModes.of_more(modes, [_mode(system, box, False) for box in real if box not in kept], proof, bound)


def enclosures(system: PlanarLoops) -> list[PoseBox]:
    """Boxes of closings, complex ones too, apart from each other."""
    return _enclose(system, proposals(system.forms, system.angles, system.most))[0]


def is_excluded(system: PlanarLoops, box: PoseBox) -> bool:
    """Return True if a further measured value is another at each solution in a real box."""
    return any(
        not SumPart(each, part, system.slack).value(_balls(box)).contains(0)
        for each in system.besides
        for part in (False, True)
    )


def _balls(box: PoseBox) -> list[Any]:
    """The unknowns of a box as complex balls."""
    from flint import acb, arb

    return [
        acb(arb(float(m.real), float(r)), arb(float(m.imag), 0.0 if box.real else float(r)))
        for m, r in zip(box.middle, box.radii, strict=True)
    ]


def _enclose(system: PlanarLoops, proposed: Array) -> tuple[list[PoseBox], int]:
    """Boxes of closings, apart from each other, and how many proposals have none."""
    a, slack = system.angles, system.slack
    equations: list[Polynomial] = [
        *(SumPart(loop, part, slack) for loop in system.loops for part in (False, True)),
        *(UnitLength((k, a + k)) for k in range(a)),
    ]
    u, v, t = proposed[:, :a], proposed[:, a : 2 * a], proposed[:, 2 * a :]
    return zeros(equations, np.hstack([(u + v) / 2, (u - v) / 2j, t]))


def _mode(system: PlanarLoops, box: PoseBox, proved: bool) -> SystemMode:
    """A real box as a mode, or as one that fits."""
    a, x = system.angles, box.middle.real
    q = np.array([*np.arctan2(x[a : 2 * a], x[:a]), *x[2 * a :]])
    spread = [float(each.real.rad()) + float(each.imag.rad()) for each in system.pose_terms(_balls(box))]
    shift = 2.0 * system.size * max(spread)
    turn = 0.0 if system.point is not None else 4.0 * max(spread)
    at = np.array([*np.exp(1j * q[:a]), *np.exp(-1j * q[:a]), *q[a:]])
    forms = [*system.forms, *(form for each in system.besides for form in each.forms())]
    residual = max(float(abs(sum(c * complex(np.prod(at**e)) for e, c in form.items()))) for form in forms)
    return SystemMode(
        (),
        max(shift / system.size, turn),
        shift,
        turn,
        residual,
        freeze_array(system.pose_of(system.bodies[0], q)),
        freeze_array(q),
        proved=proved,
        match_residual=not proved,
    )
