"""All assembly modes of a platform whose tips are confined to curves (docs/pages/theory.md, section 8)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

import numpy as np

from ...geometry.loci import Point
from ...geometry.vectors import Array, freeze_array
from ...results import Value
from ...tolerances import (
    LOCUS_DISTANCE_TOL,
    RELATION_ANGLE_TOL,
    SOLUTION_DISTANCE_MAX,
    TIP_ROUNDING,
)
from .constrained_platform import System
from .modular_root_bound import bound_zeros
from .overdetermined import (
    SnappedPoints,
    compute_residual,
    describe_fits,
    find_dimension,
    find_stationary,
    is_beyond_rigid_platform,
    is_excluded,
    may_be_goal,
    snap_centres,
)
from .pose_coordinate_solver import ProposedSolutions, enclose_roots, list_parts, propose_by_msolve, propose_roots
from .quadrics import PoseSystem
from .root_bound import Bound, find_least_bound
from .roots import DOUBLE_SOLUTION_DISTANCE_TOL, RealSolution, SolutionSet, has_nearly_double_solution, solve_square
from .square_systems import SquareSystem
from .translating import TranslatingPlatform

LEG_CHOICES_SOLVED_MAX = 5
"""Choices of legs that are given to a solver until one has finitely many solutions, and, besides the first, whose
solutions are starts for near modes."""

POSE_CHARTS_TRIED_MAX = 3
"""Charts of a rigid body's poses in which solutions are sought until all that are found can be enclosed apart."""

Part = SquareSystem | PoseSystem


@dataclass(frozen=True, eq=False, repr=False)
class SystemMode(Value):
    """Pose with the fixed directions.

    The exact pose is within ``shift`` (m, the origins of all bodies) and ``turn`` (rad) of ``pose`` (4, 4), the
    platform's frame in the base frame; ``radius`` is the larger of the two, lengths in sizes. ``parameters`` are those
    of the curves that were solved for (m, rad), none where the pose itself was solved for; ``legs`` the places of the
    curves in the square part; ``residual`` the largest distance of a tip from its curve (sizes); ``q`` the system's own
    coordinates. A size is that of the mechanism.
    """

    parameters: tuple[float, ...]
    radius: float
    shift: float
    turn: float
    residual: float
    pose: Array
    q: Array
    legs: tuple[int, ...] = ()
    multiplicity: int = 1
    proved: bool = False
    """True if exactly one mode is within the radius, for all input within its error."""
    match_residual: bool = False
    """True if the radius encloses exactly one solution of the square part, and all legs fit there to ``residual``: that
    does not prove it to be a mode."""
    rounded: bool = False
    """True if that is proved for the rounded input alone; then the radius is for it alone too."""
    near: bool = False
    """True if it is an unproved match."""


@dataclass(frozen=True, eq=False, repr=False)
class SquareSolution(Value):
    """Square part of a system with all its solutions; ``modes`` are its real ones, in the order of ``roots.real``,
    and ``kept`` marks those that are modes of the whole system."""

    system: System
    part: Part
    roots: SolutionSet
    modes: tuple[SystemMode, ...]
    kept: tuple[bool, ...]


@dataclass(frozen=True, eq=False, repr=False)
class SystemModes(Value):
    """All modes: ``complex`` solutions counted with multiplicity (None if not known), the real ones as ``modes``, and
    the proof as text.

    With redundant observation, ``complex`` counts only the modes. ``complete`` is True only if every real solution is
    in one of the enclosures; every complex one is isolated then too, except for ``combinations``. ``near`` are
    poses that match almost (with redundant observation only); ``bound`` names the root bound: ``resultant``, ``class``
    (the degrees of such systems), ``rank`` (of multiples of the equations), ``combinations`` (of the equations, for
    real solutions) or ``none``, if a solver's count is trusted; ``enclosed``: each counted solution has its enclosure;
    ``singular_solutions`` describes a special input: a continuous family, of dimension ``continuous_family``, a
    singular pose, tips on one line.
    """

    complex: int | None
    modes: tuple[SystemMode, ...]
    complete: bool
    proof: str
    near: tuple[SystemMode, ...] = ()
    singular_solutions: str | None = None
    continuous_family: int | None = None
    bound: str = "none"
    enclosed: bool = False
    snapped: tuple[SnappedPoints, ...] = ()
    """Joint centres that were snapped."""
    solved: tuple[SquareSolution, ...] = field(default=(), repr=False)
    """What was solved, one for each choice of the legs' branches, where the solutions of a square part are all: working
    material, which a copy or a pickle does not hold."""
    open: bool = False
    """True if no choice of legs has finitely many solutions, for some leg solutions at least."""

    @property
    def outcome(self) -> str:
        """Return whether all modes are proved to be listed, as text."""
        return "all modes" if self.complete else self.singular_solutions or "found, not proved to be all"

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "solved": ()}


def solve(system: System, *, near: bool = True, goal: Array | None = None) -> SystemModes:
    """List all modes of a system: the solutions of its first regular square part at which all tips fit.

    With redundant observation the ``goal``, coordinates of a pose at which all tips fit by construction, is
    proved to be a mode; others are modes that fit if their residual is at most ``LOCUS_DISTANCE_TOL`` and they are not
    excluded. ``near`` are the poses with a residual up to ``NEAR_MODE_DISTANCE_MAX`` where the sum of squares is
    stationary, from several square parts (unless ``near`` is false). Where no square part decides the pose, tips on
    surfaces are left to a solver that proposes poses: a homotopy for a rigid body, else msolve (``MissingExtra`` where
    that is not installed).
    """
    system, snapped = snap_centres(system)
    return replace(_solve(system, near, goal), snapped=snapped)


def _solve(system: System, near: bool, goal: Array | None) -> SystemModes:
    if system.missing:
        return _report_too_few(system)
    square = None
    for square in system.squares():
        roots = solve_square(square, system.balls(square.frame), system.farthest)
        if not roots.continuum:
            if not near:
                return _judge(system, square, roots, None, goal)
            others = (part for part in system.squares() if part.legs != square.legs)
            return _judge(
                system,
                square,
                roots,
                ((part, solve_square(part)) for part in islice(others, LEG_CHOICES_SOLVED_MAX)),
                goal,
            )
    if system.has_surface_loci and not isinstance(system, TranslatingPlatform):
        return _propose(system, near, goal, propose_roots)
    return _report_undecided(system, square is not None, goal, near)


def solve_by_msolve(system: System, *, near: bool = True, goal: Array | None = None) -> SystemModes:
    """All modes of a system in the pose's own coordinates, proposed by msolve and enclosed here.

    As :func:`solve`, but solutions that coincide are counted once, and near modes are looked for from the solutions of
    one choice of legs alone. Raises ``MissingExtra``, ``ExternalSolverFailure``.
    """
    system, snapped = snap_centres(system)
    return replace(_propose(system, near, goal, lambda part, enough: propose_by_msolve(part)), snapped=snapped)


def _propose(
    system: System,
    near: bool,
    goal: Array | None,
    proposer: Callable[[PoseSystem, int | None], ProposedSolutions | None],
) -> SystemModes:
    if system.missing:
        return _report_too_few(system)
    part = None
    for part in islice(list_parts(system), LEG_CHOICES_SOLVED_MAX):
        most = find_least_bound(system, part.legs)
        roots = None
        for number in range(POSE_CHARTS_TRIED_MAX):
            part = replace(part, chart=system.chart(number)) if number else part
            proposed = proposer(part, None if most is None else most.most)
            if proposed is None:
                break
            roots = enclose_roots(part, proposed, most, system.balls(part.chart.frame), system.farthest)
            if proposed.loose and roots.complex != (most and most.most) and find_dimension(system):
                roots = None
                break
            if roots.apart or not roots.complete or part.chart.study is None:
                break
        if roots is not None:
            return _judge(system, part, roots, () if near else None, goal, most)
    return _report_undecided(system, part is not None, goal, near)


def _report_too_few(system: System) -> SystemModes:
    return make_family(f"too few legs: a continuous family of dimension {system.missing}", system.missing)


def _report_undecided(system: System, tried: bool, goal: Array | None, near: bool) -> SystemModes:
    """Return the result if no choice of legs has finitely many solutions: the goal, if it is given, is one. Poses of a
    continuous family are sought if ``near`` ones are."""
    known = () if goal is None else (_make_goal_mode(system, goal, ()),)
    if not tried:
        return SystemModes(
            len(known),
            known,
            False,
            "nothing proved",
            singular_solutions="no choice of legs determines the pose: tips on one line, in one point, or fixed",
            open=True,
        )
    if not near:
        return SystemModes(
            len(known),
            known,
            False,
            "nothing proved",
            singular_solutions="the equations depend on each other",
            open=True,
        )
    size = find_dimension(system)
    if not size:
        return SystemModes(
            len(known),
            known,
            False,
            "nothing proved",
            singular_solutions="the equations depend on each other, but no continuous family of poses was found",
            open=True,
        )
    return replace(make_family(f"the tips can move together: a continuous family of dimension {size}", size), open=True)


def make_family(text: str, size: int) -> SystemModes:
    """Return modes that form a continuous family of this dimension."""
    return SystemModes(
        0, (), False, "a continuous family is not counted", singular_solutions=text, continuous_family=size
    )


def _judge(
    system: System,
    square: Part,
    roots: SolutionSet,
    others: Iterable[tuple[Part, SolutionSet]] | None,
    goal: Array | None,
    most: Bound | None = None,
) -> SystemModes:
    """The modes among the solutions of a square part, ``most`` at most; near ones are looked for from those of others
    too (not at all where these are None)."""
    listed = [_make_mode(system, square, root) for root in roots.real]
    enclosed = roots.complete and all(mode.proved for mode in listed)
    bound, proof = (
        ("resultant", _describe_proof(system, roots))
        if isinstance(square, SquareSystem)
        else _bound(system, square, most, roots)
    )
    if square.whole:
        return SystemModes(
            roots.complex,
            tuple(listed),
            enclosed and bound != "none",
            proof,
            (),
            _describe_special(roots),
            None,
            bound,
            enclosed,
            solved=(SquareSolution(system, square, roots, tuple(listed), (True,) * len(listed)),),
        )
    whole = [
        mode for mode, root in zip(listed, roots.real, strict=True) if not _is_beyond_platform(system, square, root)
    ]
    at_goal = _find_goal(system, roots, whole, goal)
    left = [
        mode
        for mode in whole
        if mode is at_goal or not (mode.proved and is_excluded(system, mode.q, mode.shift, mode.turn))
    ]
    modes = tuple(
        mode if mode is at_goal else replace(mode, proved=False, match_residual=mode.proved)
        for mode in left
        if mode is at_goal or mode.residual <= LOCUS_DISTANCE_TOL
    )
    enclosed = roots.complete and len(modes) == len(left) and all(mode.proved or mode.match_residual for mode in modes)
    open_ = [mode for mode in left if mode is not at_goal and mode.residual > LOCUS_DISTANCE_TOL]
    lost = goal is not None and not any(_is_goal_pose(system, mode.q, goal) for mode in left)
    if goal is not None and not any(_is_goal_pose(system, mode.q, goal) for mode in modes):
        at_goal = _make_goal_mode(system, goal, square.legs)  # its solution is known too roughly to match
        modes, open_ = (*modes, at_goal), [mode for mode in open_ if not _is_goal_pose(system, mode.q, goal)]
        enclosed = False
    near = () if others is None else _find_near(system, listed, modes, others)
    fitting = [mode.residual for mode in modes if mode is not at_goal]
    proof = f"from {len(square.legs)} of {len(system.curves)} tips: {proof}; of these " + describe_fits(
        at_goal is not None, lost, fitting, len(listed) - len(left), len(open_)
    )
    kept = tuple(mode in left and mode not in open_ for mode in listed)
    return SystemModes(
        len(modes),
        modes,
        enclosed and bound != "none",
        proof,
        near,
        _describe_special(roots),
        None,
        bound,
        enclosed,
        solved=(SquareSolution(system, square, roots, tuple(listed), kept),),
    )


def _make_goal_mode(system: System, goal: Array, legs: tuple[int, ...]) -> SystemMode:
    """The goal as a mode whose place no solution proves."""
    return SystemMode(
        (),
        np.inf,
        np.inf,
        np.pi,
        system.residual(system.tips_at(goal)),
        freeze_array(system.pose(goal)),
        freeze_array(goal),
        legs,
    )


def _find_goal(
    system: System, roots: SolutionSet, listed: Sequence[SystemMode], goal: Array | None
) -> SystemMode | None:
    """The solution that is the goal: the only one that can be, where all are known."""
    if goal is None or not roots.complete:
        return None
    able = [mode for mode in listed if not mode.proved or may_be_goal(system, mode.q, goal, mode.shift, mode.turn)]
    return able[0] if len(able) == 1 and able[0].proved else None


def _is_goal_pose(system: System, q: Array, goal: Array) -> bool:
    """Return True if a pose is the goal, but for the differences of poses of one relation."""
    return float(np.abs(system.tips_at(q) - system.tips_at(goal)).max()) <= RELATION_ANGLE_TOL * system.size


def _bound(system: System, part: PoseSystem, most: Bound | None, roots: SolutionSet) -> tuple[str, str]:
    """Return the root bound beyond the solutions that a solver proposes, and the proof as text (proofs.md 8)."""
    proof = _describe_proof(system, roots)
    known = f", {roots.beyond} enclosed at infinity" if roots.beyond else ""
    known += f", the {roots.far} far ones for the rounded geometry" if roots.far else ""
    count = roots.complex + roots.beyond + roots.far
    if most is not None and roots.apart and count == most.most:
        return "class", (
            f"{proof}; the complex ones are enclosed too, all distinct{known}, and there are at "
            f"most {most.most}: {most.why}"
        )
    if roots.apart and part.chart.study is None and bound_zeros(part.equations(), count) == count:
        return "rank", (
            f"{proof}; the complex ones are enclosed too, all distinct{known}, and there are no "
            "more: ranks of multiples of the equations modulo a prime of 62 bits"
        )
    limit = "" if most is None else f"{known}, of at most {most.most}: {most.why}"
    return "none", f"{proof}; that is what the solver found{limit}"


def _find_near(
    system: System,
    listed: Sequence[SystemMode],
    modes: Sequence[SystemMode],
    others: Iterable[tuple[Part, SolutionSet]],
) -> tuple[SystemMode, ...]:
    """Near modes, from all solutions of one square part and of others."""
    starts = [mode.q for mode in listed]
    for part, found_there in others:
        starts += [_make_mode(system, part, root).q for root in found_there.real]
    return tuple(_make_near_mode(system, q) for q in find_stationary(system, starts, [mode.q for mode in modes]))


def _make_mode(system: System, square: Part, root: RealSolution) -> SystemMode:
    parameters = tuple(float(ball.mid()) for ball in root.parameters)
    q = square.place(parameters)
    at = system.tips_at(q)
    if isinstance(square, SquareSystem):
        on_curves = parameters
        apart = system.apart(q, at, square.legs, _list_points(square, root))
    else:
        on_curves, apart = (), {k: miss + TIP_ROUNDING * system.size for k, miss in enumerate(root.misses)}
    shift, turn = system.spread(q, apart)
    sure = _is_proved_for_input(system, root) and bool(np.isfinite(shift))
    return SystemMode(
        on_curves,
        max(shift / system.size, turn),
        shift,
        turn,
        system.residual(at),
        freeze_array(system.pose(q)),
        freeze_array(q),
        square.legs,
        root.multiplicity,
        sure,
        root.unique and not sure,
    )


def _list_points(square: SquareSystem, root: RealSolution) -> list[tuple[Array, float]]:
    """The points of a square's curves at a solution, and how far the exact ones can be from them (m)."""
    points = [curve.at(float(s.mid())) for curve, s in zip(square.unknowns, root.parameters, strict=True)]
    return list(zip(points, root.misses, strict=True))


def _is_beyond_platform(system: System, square: Part, root: RealSolution) -> bool:
    """Return True if the tips of a solution's legs do not fit a rigid platform; unless one is fixed, the square part's
    equations exclude that."""
    return (
        isinstance(square, SquareSystem)
        and system.rigid
        and _is_proved_for_input(system, root)
        and any(isinstance(system.curves[k], Point) for k in square.legs)
        and is_beyond_rigid_platform(system, system.known_tips(square.legs, _list_points(square, root)))
    )


def _is_proved_for_input(system: System, root: RealSolution) -> bool:
    """Return True if a root's enclosure is proved for all input within its error."""
    return bool(np.isfinite(system.error) and root.unique and root.thick)


def _make_near_mode(system: System, q: Array) -> SystemMode:
    return SystemMode(
        (), np.inf, np.inf, np.pi, compute_residual(system, q), freeze_array(system.pose(q)), freeze_array(q), near=True
    )


def _describe_proof(system: System, roots: SolutionSet) -> str:
    if not roots.degree and roots.complex:
        return "fixed tips, which leave one pose"
    text = f"{roots.method} of degree {roots.degree}"
    if roots.extraneous:
        text += f" (besides {roots.extraneous} roots at infinity, which are not poses)"
    if roots.far:
        beyond = f"{roots.far} beyond {SOLUTION_DISTANCE_MAX:g} characteristic lengths"
        text += f" (besides {beyond}: at infinity, up to rounding)"
    text += f", {roots.complex} {'root' if roots.complex == 1 else 'roots'} isolated"
    if roots.real:
        thin = sum(root.unique and not root.thick for root in roots.real)
        double = sum(root.real and not root.unique for root in roots.real)
        almost = sum(not root.real for root in roots.real)
        sure = len(roots.real) - almost
        text += f", {sure} real" + (", each enclosed with existence and uniqueness proved" if sure else "")
        thin = thin if np.isfinite(system.error) else sure
        text += f" ({thin} for the rounded geometry only)" if thin else ""
        text += f" ({double} not: multiple)" if double else ""
        pairs = "one pair" if almost == 1 else f"{almost} pairs"
        text += f", {pairs} so close that rounding decides whether they are real" if almost else ""
    else:
        text += ", none real"
    return text


def _describe_special(roots: SolutionSet) -> str | None:
    if roots.undecided:
        return (
            "the solutions of all distances are counted: undecided which of them a snapped geometry sends to infinity"
        )
    if not has_nearly_double_solution(roots):
        return None
    if any(root.multiplicity > 1 for root in roots.real):
        return "a double solution: a singular pose"
    return (
        f"two solutions differ by only {roots.closest:.1e} "
        f"(limit for distinct poses: {DOUBLE_SOLUTION_DISTANCE_TOL:g}): a singular pose, to rounding"
    )
