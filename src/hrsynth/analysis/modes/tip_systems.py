"""From tips on curves to the systems whose solutions are the modes: one for each choice of the legs' solutions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, islice, product

import numpy as np

from ...errors import TooLarge
from ...geometry.loci import Circle, Line, Plane, Reach
from ...geometry.vectors import Array, build_plane_axes, build_pose, compare_poses, invert_pose, transform
from ...kinematics.configuration import ClosedConfiguration
from ...results import Value
from ...solving.platform.constrained_platform import System
from ...solving.platform.rigid import Planar, Spatial
from ...solving.platform.solve import SystemMode, SystemModes, solve
from ...solving.platform.translating import ArticulatedPlatform, TranslatingPlatform
from ...tolerances import POINT_DISTANCE_TOL, RANK_GAP_MIN
from ..loci.tips import TipLoci

LEG_SOLUTION_CHOICES_MAX = 256
"""Largest number of combinations of leg solutions; beyond it the list of modes is not complete."""
MODES_TIME_LIMIT_S = 120.0
"""Default time limit of a list of modes (s of one core), compared with an estimate that no machine changes."""


@dataclass(frozen=True, eq=False, repr=False)
class Model(Value):
    """The system of a confined platform; ``bodies`` gives the poses (4, 4) of the bodies on which legs end, in the base
    frame, at the system's coordinates; ``home`` are the coordinates of the goal itself."""

    system: System
    bodies: Callable[[Array], dict[str, Array]]
    home: Array
    back: bool = False
    """True if the system's pose is that of the base, relative to the platform."""
    closing: Callable[[Array], ClosedConfiguration] | None = None
    """Whole robot at the system's coordinates, if these determine it."""
    confined: TipLoci | None = None
    """The curves of the tips, where these give the system."""


def build_model(confined: TipLoci) -> Model:
    """The system for the way in which the platform moves."""
    at = {body: confined.goal.pose(body) for body in confined.bodies}
    curves = tuple(tip.curve for tip in confined.tips)
    model = {"translations": _build_translating, "bodies": _build_articulated}.get(confined.motion, _build_rigid)
    made = model(confined, at, curves)
    return replace(
        made, confined=confined, system=replace(made.system, error=confined.error, as_written=confined.as_written)
    )


def _build_translating(confined: TipLoci, at: dict[str, Array], curves: tuple[Reach, ...]) -> Model:
    """q is the position of the first body's origin; tips are counted from there."""
    p = at[confined.bodies[0]][:3, 3]
    tips = np.array([_place_point(at[tip.body], tip.place) - p for tip in confined.tips])
    return Model(TranslatingPlatform(curves, tips), partial(_shift_bodies, at, p), p)


def _build_rigid(confined: TipLoci, at: dict[str, Array], curves: tuple[Reach, ...]) -> Model:
    """q is relative to the goal: the frame of the plane of motion (in space: the base's) is at the first link's origin
    there."""
    p, n = at[confined.bodies[0]][:3, 3], confined.plane if confined.motion == "planar" else None
    X_goal = build_pose(p)
    if n is not None:
        X_goal = build_pose(p, np.column_stack([*build_plane_axes(n), n]))
    back = invert_pose(X_goal)
    tips = np.array([_place_point(back @ at[tip.body], tip.place) for tip in confined.tips]).reshape(-1, 3)
    if n is None:
        size = confined.goal.model.length
        arrows = np.array([size * (at[angle.body][:3, :3] @ angle.direction) for angle in confined.angles]).reshape(
            -1, 3
        )
        planes = tuple(
            Plane(p + angle.axis * float(angle.axis @ arrow), angle.axis)
            for angle, arrow in zip(confined.angles, arrows, strict=True)
        )
        system: Spatial | Planar = Spatial((*curves, *planes), np.vstack([tips, arrows]), len(arrows), p)
    else:
        system = Planar(curves, tips[:, :2], X_goal)
    home = np.array([*p, 0.0, 0.0, 0.0]) if n is None else np.zeros(3)
    carry = (
        partial(_carry_back, system, X_goal, at)
        if confined.back
        else partial(_carry_bodies, system, {body: back @ X for body, X in at.items()})
    )
    return Model(system, carry, home, confined.back)


def _build_articulated(confined: TipLoci, at: dict[str, Array], curves: tuple[Reach, ...]) -> Model:
    """q is the first body's origin and the second's place on its circle about it."""
    assert confined.slide is not None
    first, second = confined.bodies
    p = at[first][:3, 3]
    tips = np.array([_place_point(at[tip.body], tip.place) - at[tip.body][:3, 3] for tip in confined.tips])
    sides = tuple(confined.bodies.index(tip.body) for tip in confined.tips)
    return Model(
        ArticulatedPlatform(curves, tips, sides, confined.slide),
        partial(_place_on_curve, at[first], at[second], first, second, confined.slide),
        np.array([*p, 0.0]),
    )


def _shift_bodies(at: dict[str, Array], p: Array, q: Array) -> dict[str, Array]:
    """Bodies that move with one point from ``p`` to ``q``."""
    return {body: _translate(X, q - p) for body, X in at.items()}


def _carry_bodies(system: Spatial | Planar, at: dict[str, Array], q: Array) -> dict[str, Array]:
    """Bodies in the frame that the system's coordinates place."""
    return {body: system.pose(q) @ X for body, X in at.items()}


def _carry_back(system: Spatial | Planar, X_goal: Array, at: dict[str, Array], q: Array) -> dict[str, Array]:
    """Bodies from which the base is seen displaced as the system's frame is from where it is at the goal."""
    D = X_goal @ invert_pose(system.pose(q))
    return {body: D @ X for body, X in at.items()}


def _place_on_curve(
    X_one: Array, X_other: Array, one: str, other: str, slide: Circle | Line, q: Array
) -> dict[str, Array]:
    """Two bodies, the second at a place of its curve about the first."""
    first = q[:3] - X_one[:3, 3]
    second = q[:3] + slide.at(float(q[3])) - X_other[:3, 3]
    return {one: _translate(X_one, first), other: _translate(X_other, second)}


def _place_point(X: Array, place: Array) -> Array:
    """A body's point (3,) in the frame of its pose."""
    return transform(X, place)


def _translate(X: Array, by: Array) -> Array:
    """A pose moved by a translation (3,)."""
    return build_pose(X[:3, 3] + by, X[:3, :3])


def list_choices(confined: TipLoci) -> Iterator[TipLoci]:
    """The platform with each tip on one of its reaches, in all combinations, the goal's own first."""
    for chosen in product(*(((tip.curve, 1.0), *tip.others) for tip in confined.tips)):
        tips = tuple(
            replace(tip, curve=reach, others=()) for tip, (reach, _) in zip(confined.tips, chosen, strict=True)
        )
        yield replace(confined, tips=tips, error=confined.error * max(gain for _, gain in chosen))


def solve_all(
    confined: TipLoci, *, near: bool = True, time_limit: float = MODES_TIME_LIMIT_S
) -> tuple[Model, SystemModes]:
    """The goal's own system, and the modes of all choices of branches together, each pose once; of those as many as
    ``time_limit`` (s, by their size) allows. Raises ``TooLarge`` where it allows none."""
    first = build_model(next(list_choices(confined))).system
    if first.seconds > time_limit:
        raise TooLarge(
            "a system of equations", f"{len(first.curves)} legs and {first.freedoms} dof", first.seconds, time_limit
        )
    most = int(min(LEG_SOLUTION_CHOICES_MAX, time_limit / first.seconds))
    made = [build_model(choice) for choice in islice(list_choices(confined), most)]
    size = made[0].system.size
    solved = [
        _scale_radii(solve(model.system, near=near, goal=None if k else model.home), model.system.size / size)
        for k, model in enumerate(made)
    ]
    total = int(np.prod([1 + len(tip.others) for tip in confined.tips]))
    modes = unite_modes(solved, {tip.leg: 1 + len(tip.others) for tip in confined.tips}, size)
    doubts = [f"leg {tip.leg}: {tip.doubt}" for tip in confined.tips if tip.doubt is not None]
    doubts += [] if confined.doubt is None else [confined.doubt]
    if total > len(made):
        doubts.append(
            f"only {len(made)} of {total} combinations of leg solutions were solved: all would need about "
            f"{total * first.seconds:g} s, and the time limit is {time_limit:g} s"
        )
    if doubts and modes.continuous_family is None:
        proof = f"{modes.proof}; there may be other leg solutions ({'; '.join(doubts)})"
        modes = replace(modes, complete=False, bound="none", proof=proof)
    return made[0], modes


def _scale_radii(modes: SystemModes, factor: float) -> SystemModes:
    """Radii and residuals in sizes of another system."""

    def scaled(each: Sequence[SystemMode]) -> tuple[SystemMode, ...]:
        return tuple(
            replace(mode, radius=max(mode.radius * factor, mode.turn), residual=mode.residual * factor) for mode in each
        )

    if factor == 1.0:
        return modes

    return replace(modes, modes=scaled(modes.modes), near=scaled(modes.near))


def unite_modes(found: Sequence[SystemModes], branches: Mapping[str, int], size: float) -> SystemModes:
    """One list of the modes of several systems, the goal's own first; a pose that is in two of them counts once.
    ``branches``: how many each leg has.

    A continuous family on the goal's own leg solutions is the whole result; on others it leaves the list open.
    """
    if len(found) == 1 or found[0].continuous_family is not None:
        return found[0]
    modes = _drop_repeats([mode for listed in found for mode in listed.modes], size)
    near = _drop_repeats([*modes, *(mode for listed in found for mode in listed.near)], size)[len(modes) :]
    unclear = sum(_compare_modes(a, b, size) <= a.radius + b.radius for a, b in combinations(modes, 2))
    twice = sum(len(listed.modes) for listed in found) - len(modes)
    legs = ", ".join(f"leg {leg}: {count}" for leg, count in branches.items() if count > 1)
    counts = [f"{number} complex in {count}" for number, count in Counter(listed.complex for listed in found).items()]
    proofs = [f"{count} × ({text})" if count > 1 else text for text, count in Counter(e.proof for e in found).items()]
    proof = (
        f"{len(found)} combinations of the locked legs' solutions ({legs}), {', '.join(counts)}"
        + (f", {twice} in two of them" if twice else "")
        + (f", {unclear} pairs not distinguished" if unclear else "")
        + f": {'; '.join(proofs)}"
    )
    special = found[0].singular_solutions or next(
        (
            f"for other leg solutions: {listed.singular_solutions}"
            for listed in found
            if listed.singular_solutions is not None
        ),
        None,
    )
    complete = not unclear and all(listed.complete for listed in found)
    return SystemModes(
        sum(listed.complex or 0 for listed in found) - twice,
        modes,
        complete,
        proof,
        near,
        special,
        None,
        next((listed.bound for listed in found if listed.bound != "resultant"), "resultant"),
        all(listed.enclosed for listed in found),
        found[0].snapped,
        tuple(part for listed in found for part in listed.solved),
        any(listed.open for listed in found),
    )


def _drop_repeats(modes: Sequence[SystemMode], size: float) -> tuple[SystemMode, ...]:
    """Each pose once, the first of those that are one to rounding."""
    distinct: list[SystemMode] = []
    for mode in modes:
        if all(_compare_modes(mode, known, size) > POINT_DISTANCE_TOL / RANK_GAP_MIN for known in distinct):
            distinct.append(mode)
    return tuple(distinct)


def _compare_modes(one: SystemMode, other: SystemMode, size: float) -> float:
    """Return the difference of two poses (sizes, entries of the rotations)."""
    return compare_poses(one.pose, other.pose, size)
