"""Loci of the tips of a hidden robot with fixed directions, from the mechanism itself.

They follow from each leg's joints, for all leg solutions (:mod:`.loci_from_joints`). If not by the known laws, the
pattern of the locked legs gives the tangent of the tip's path, or the normal of the surface that it stays on; then the
path or surface through the goal is checked by moving the leg on its own along all of its dof: found, and not known to
be all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...constraints.locked_legs import LockedLeg
from ...constraints.named_vectors import BodyPoint, BodyVector, NamedVector, Tangent, collect_poses
from ...constraints.pattern import ConstraintPattern
from ...errors import UnsupportedLocus
from ...geometry.loci import Circle, Line, Plane, Point, Reach, Sphere
from ...geometry.ranks import compute_kernel_basis
from ...geometry.vectors import Array, transform
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.leg_reach import extract_leg
from ...kinematics.locked_twists import locate_joint, set_zero
from ...kinematics.pinocchio_model import PinocchioModel
from ...kinematics.tasks import FixedValuesTask, solve
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Observation
from ...mechanism.composites import WordGraph
from ...mechanism.legs import LegDecomposition, decompose
from ...results import Value
from ...tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    MOVED_AXIS_LEVER_MAX,
    POINT_DISTANCE_TOL,
    RELATION_ANGLE_TOL,
)
from .leg_orientations import find_kept_angle, list_orientations
from .loci_from_joints import derive_reaches
from .locked_chain import Chain, LocusDerivationFailure, build_chain

MOVES = (-0.4, -0.15, 0.15, 0.4)
"""Distance that a leg is moved along a dof to check its tip's locus (characteristic lengths, radians)."""

MIXED_LEG_MOTIONS_COUNT = 4
"""Number of combinations of its dof along which a leg with several of them is moved too."""


@dataclass(frozen=True, eq=False, repr=False)
class Tip(Value):
    """Tip of a locked leg: the body that carries it, where (3,) in the body's frame (m), and the curve or surface in
    the base frame (m) on which it is at the goal.

    ``others`` are those of other leg solutions, each with its gain of an error of the goal; ``doubt`` is the reason
    why there may be more, None if these are all.
    """

    leg: str
    body: str
    place: Array
    curve: Reach
    others: tuple[tuple[Reach, float], ...] = ()
    doubt: str | None = None
    moved: float = 0.0
    """Distance that the leg's geometry was moved (m)."""


@dataclass(frozen=True, eq=False, repr=False)
class KeptAngle(Value):
    """A direction (3,), in the frame of the body that carries it, whose angle with ``axis`` (3,) in the base frame a
    locked leg keeps as it is at the goal."""

    leg: str
    body: str
    direction: Array
    axis: Array
    moved: float
    """Distance that the leg's geometry was moved (m)."""


@dataclass(frozen=True, eq=False, repr=False)
class TipLoci(Value):
    """The platform at one configuration with its directions held: tips on curves and surfaces, and kept ``angles``.

    ``motion`` is that of :class:`ConstraintPattern`; ``plane`` the normal of planar motion; ``slide`` the circle on
    which the second body's origin moves relative to the first's, ``doubt`` why it may have other ways;
    ``bodies`` their names.
    """

    goal: ClosedConfiguration
    motion: str
    tips: tuple[Tip, ...]
    bodies: tuple[str, ...]
    plane: Array | None = None
    slide: Circle | Line | None = None
    angles: tuple[KeptAngle, ...] = ()
    error: float = 0.0
    """Distance of a point of the robot from its place at the exact goal (m)."""
    doubt: str | None = None
    as_written: bool = False
    """True if the numbers count as they are, without special geometry."""
    back: bool = False
    """True if the base is observed from the platform: tips are points of the base as if that moved."""


def derive_tip_loci(
    decomposition: LegDecomposition,
    observation_model: ObservationModel,
    pattern: ConstraintPattern,
    goal: ClosedConfiguration,
) -> TipLoci:
    """Return the loci of all observed legs' tips with the directions of ``goal``.

    Raises ``UnsupportedLocus`` if a locus is not a point, line, circle, sphere or plane, or the platform's motion is
    not one of those known, or if a platform that rotates can be fixed in another rotation.
    """
    name = decomposition.mechanism.name
    if pattern.motion == "other":
        raise UnsupportedLocus(name, "the pattern of its legs is not a known one")
    if pattern.turning and not any(
        _has_one_orientation(decomposition, observation_model, leg, goal) for leg in pattern.legs
    ):
        raise UnsupportedLocus(name, "its legs may fix the platform in another rotation")
    plane = None if pattern.plane is None else _evaluate(pattern.plane, goal)
    end = (
        plane
        if plane is not None and pattern.motion == "planar"
        else "free"
        if pattern.motion in ("spatial", "oriented") or decomposition.point is not None
        else "kept"
    )
    tips = tuple(
        _derive_tip(decomposition, observation_model, leg, goal, end) for leg in pattern.legs if not leg.is_tip_free
    )
    angles = tuple(
        _find_angle(decomposition, observation_model, leg, goal)
        for leg in pattern.legs
        if pattern.motion == "oriented" and leg.turns < 3
    )
    slide, doubt = (None, None) if pattern.slide is None else _find_slide(decomposition, pattern, goal)
    return TipLoci(goal, pattern.motion, tips, pattern.bodies, plane, slide, angles, doubt=doubt)


def _build_held_chain(
    decomposition: LegDecomposition,
    observation_model: ObservationModel,
    leg: LockedLeg,
    at: ClosedConfiguration,
    end: Array | str,
) -> Chain:
    """The chain to a leg's tip, its observations held; raises ``LocusDerivationFailure``."""
    observed = [o for o in observation_model.observations if o.leg == leg.label]
    return build_chain(
        decomposition, decomposition.leg(leg.label), observed, at, _evaluate(leg.tip, at) * at.model.length, end
    )


def _has_one_orientation(
    decomposition: LegDecomposition, observation_model: ObservationModel, leg: LockedLeg, goal: ClosedConfiguration
) -> bool:
    """Return True if the joints of a locked leg leave its end one orientation, that at the goal, for all leg
    solutions."""
    if leg.virtual or leg.turns:
        return False
    try:
        known = [
            bodies
            for bodies, _ in list_orientations(_build_held_chain(decomposition, observation_model, leg, goal, "free"))
        ]
    except LocusDerivationFailure:
        return False
    return len(known) == 1 and known[0][-1] is not None


def _find_angle(
    decomposition: LegDecomposition, observation_model: ObservationModel, leg: LockedLeg, goal: ClosedConfiguration
) -> KeptAngle:
    """The angle that a leg keeps; raises ``UnsupportedLocus`` where its joints do not show one."""
    try:
        chain = _build_held_chain(decomposition, observation_model, leg, goal, "free")
        axis, direction = find_kept_angle(chain)
    except LocusDerivationFailure as error:
        raise UnsupportedLocus(
            decomposition.mechanism.name, f"how leg {leg.label} rotates the platform is not known: {error}"
        ) from None
    return KeptAngle(
        leg.label, leg.body, goal.pose(leg.body)[:3, :3].T @ direction, axis, MOVED_AXIS_LEVER_MAX * chain.moved
    )


def _derive_tip(
    decomposition: LegDecomposition,
    observation_model: ObservationModel,
    leg: LockedLeg,
    goal: ClosedConfiguration,
    end: Array | str,
) -> Tip:
    B = _evaluate(leg.tip, goal) * goal.model.length
    X = goal.pose(leg.body)
    place = X[:3, :3].T @ (B - X[:3, 3])
    observed = [o for o in observation_model.observations if o.leg == leg.label]

    def branches(at: ClosedConfiguration) -> tuple[list[tuple[Reach, float]], float]:
        return derive_reaches(_build_held_chain(decomposition, observation_model, leg, at, end))

    try:
        reaches, moved = branches(goal)
    except LocusDerivationFailure as error:
        return _fit_tip(
            decomposition,
            observed,
            observation_model.reference,
            Tip(leg.label, leg.body, place, Point(B), doubt=str(error)),
            leg,
            goal,
        )
    if moved:  # at the zero configuration, unless that is special, the file's own decimals show it
        with suppress(LocusDerivationFailure):
            moved = branches(ClosedConfiguration(goal.model, goal.model.q0, 0.0))[1]
    freedoms = 0 if leg.fixed else 1 if leg.line is not None else 2 if leg.normal is not None else 3
    here = reaches[0][0]
    if here.freedoms == freedoms and np.linalg.norm(here.miss(B)) <= HIDDEN_ROBOT_RESIDUAL_TOL * goal.model.length:
        return Tip(leg.label, leg.body, place, here, tuple(reaches[1:]), moved=moved)
    doubt = (
        f"its joints taken one by one leave {here.freedoms} dof, together {freedoms}"
        if here.freedoms != freedoms
        else "its joints put its end elsewhere"
    )
    return _fit_tip(
        decomposition,
        observed,
        observation_model.reference,
        Tip(leg.label, leg.body, place, Point(B), doubt=doubt),
        leg,
        goal,
    )


def _fit_tip(
    decomposition: LegDecomposition,
    own: Sequence[Observation],
    reference: str,
    tip: Tip,
    leg: LockedLeg,
    goal: ClosedConfiguration,
) -> Tip:
    """A tip's curve or surface as the pattern names it, to which the leg's moves keep."""
    B = _evaluate(leg.tip, goal) * goal.model.length
    paths = _follow_held_paths(own, reference, leg, goal, tip.place)
    if not leg.fixed and not paths:
        raise UnsupportedLocus(
            decomposition.mechanism.name, f"leg {leg.label} cannot be moved to find the locus of its tip"
        )
    worst = np.inf
    for curve in _propose_reaches(decomposition, leg, B, goal):
        miss = max((float(np.linalg.norm(curve.miss(point))) for point in paths), default=0.0) / goal.model.length
        if miss <= RELATION_ANGLE_TOL:
            return replace(tip, curve=curve)
        worst = min(worst, miss)
    what = (
        "is not confined to a curve or surface of a known kind"
        if worst == np.inf
        else f"leaves its curve or surface by {worst:.2g} characteristic lengths"
    )
    raise UnsupportedLocus(decomposition.mechanism.name, f"the tip of leg {leg.label} {what}")


def _propose_reaches(
    decomposition: LegDecomposition, leg: LockedLeg, tip: Array, goal: ClosedConfiguration
) -> Iterator[Reach]:
    """Curves with the tangent that the pattern names: a circle about the axis with the tip on it, or with the tip
    carried along by the end of the link that turns, whichever of the two bodies its axis is fixed in. Surfaces with
    the normal that it names: a plane, or a sphere with the radius of a link that lies along the normal."""
    if leg.fixed:
        yield Point(tip)
    elif isinstance(leg.line, BodyVector):
        yield Line(tip, _evaluate(leg.line, goal))
    elif isinstance(leg.line, Tangent):
        turning = _build_circle(leg.line, tip, goal)
        yield from (turning, _mirror_circle(turning, tip))
        axis, on = _evaluate(leg.line.axis, goal), _evaluate(leg.line.start, goal) * goal.model.length
        spoke = tip - on - axis * float(axis @ (tip - on))
        if np.linalg.norm(spoke) > POINT_DISTANCE_TOL * goal.model.length:
            yield Circle(tip - spoke, axis, float(np.linalg.norm(spoke)), spoke)
    elif leg.normal is not None:
        n = _evaluate(leg.normal, goal)
        for rod in _list_rods(decomposition, leg, n, goal):
            yield from (Sphere(tip - rod, float(np.linalg.norm(rod))), Sphere(tip + rod, float(np.linalg.norm(rod))))
        yield Plane(tip, n)


def _list_rods(decomposition: LegDecomposition, leg: LockedLeg, along: Array, goal: ClosedConfiguration) -> list[Array]:
    """From joint centre to joint centre (m) of a leg, where that is parallel to a direction."""
    joints = [decomposition.mechanism.joints[name] for name in decomposition.leg(leg.label).joints]
    centres = [locate_joint(goal, joint)[0] * goal.model.length for joint in joints]
    between = [end - start for start, end in combinations(centres, 2)]
    small = POINT_DISTANCE_TOL * goal.model.length
    return [
        rod
        for rod in between
        if np.linalg.norm(rod) > small
        and np.linalg.norm(np.cross(rod, along)) <= RELATION_ANGLE_TOL * np.linalg.norm(rod)
    ]


def _build_circle(tangent: Tangent, tip: Array, goal: ClosedConfiguration) -> Circle:
    """The circle on which ``tip`` moves when it translates with the end of a link that turns about an axis."""
    length = goal.model.length
    axis = _evaluate(tangent.axis, goal)
    on, end = _evaluate(tangent.start, goal) * length, _evaluate(tangent.end, goal) * length
    spoke = end - on - axis * float(axis @ (end - on))
    return Circle(tip - spoke, axis, float(np.linalg.norm(spoke)), spoke)


def _mirror_circle(circle: Circle, tip: Array) -> Circle:
    """The circle with the same tangent at ``tip`` and its centre on the other side."""
    return Circle(2 * tip - circle.centre, circle.axis, circle.radius, circle.centre - tip)


def _find_slide(
    decomposition: LegDecomposition, pattern: ConstraintPattern, goal: ClosedConfiguration
) -> tuple[Circle | Line, str | None]:
    """The curve of the second body's origin relative to the first's, and why it may not be all.

    Where a P joins the bodies, a line. Where a parallelogram joins them it is that of a crank; else of the two circles
    with the tangent that the pattern names (whichever of the bodies its link turns about) the one that nearby
    configurations keep to."""
    at, moving = _compute_offset(pattern, goal, goal.q)
    if pattern.slide is not None and not isinstance(pattern.slide, Tangent):
        return Line(at, _evaluate(pattern.slide, goal)), None
    first, second = pattern.bodies
    graph = WordGraph(decomposition.mechanism, pattern.bodies, decomposition.platform).recognise()
    for _, edge in graph.between(first, second):
        if len(edge.joints) == 4:
            joints = [decomposition.mechanism.joints[name] for name in edge.joints[:2]]
            near, far = joints if edge.tail == first else joints[::-1]
            (start, axes), (end, _) = locate_joint(goal, near), locate_joint(goal, far)
            spoke = (end - start - axes[0] * float(axes[0] @ (end - start))) * goal.model.length
            return Circle(at - spoke, axes[0], float(np.linalg.norm(spoke)), spoke), None
    assert isinstance(pattern.slide, Tangent)
    circle = _build_circle(pattern.slide, at, goal)
    mirrored = _mirror_circle(circle, at)
    kernel, _ = goal.kernel()
    step = kernel @ np.linalg.svd(moving @ kernel)[2][0]
    nearby, _ = solve(goal.model, goal.model.integrate(goal.q, MOVES[-1] * step), tolerance=CLOSURE_SOLVER_TOL)
    offset, _ = _compute_offset(pattern, goal, nearby)
    nearest = min((circle, mirrored), key=lambda circle: float(np.linalg.norm(circle.miss(offset))))
    return nearest, f"no parallelogram joins {first} and {second}"


def _compute_offset(pattern: ConstraintPattern, goal: ClosedConfiguration, q: Array) -> tuple[Array, Array]:
    """From the first body's origin to the second's (3,), and its velocity (3, nv)."""
    X, V = goal.model.frames(q, pattern.bodies)
    return X[1, :3, 3] - X[0, :3, 3], V[1, :3] - V[0, :3]


def _follow_held_paths(
    own: Sequence[Observation], reference: str, leg: LockedLeg, goal: ClosedConfiguration, place: Array
) -> list[Array]:
    """Return the positions of a tip when its leg alone, with fixed measured values, is moved along each of its dof, and
    along some random combinations of them."""
    rest = decompose(set_zero(goal))
    model = PinocchioModel(extract_leg(rest, rest.leg(leg.label)), goal.model.length)
    held = FixedValuesTask.at(model, model.q0, reference, own)
    start = ClosedConfiguration.of(model, model.q0, RELATION_ANGLE_TOL)
    free, _ = compute_kernel_basis(np.vstack([model.jacobian(start.q), held.error_and_jacobian(model, start.q)[1]]))
    positions = []
    directions = free.T
    if len(directions) > 1:
        mixed = np.random.default_rng(0).normal(size=(MIXED_LEG_MOTIONS_COUNT, len(directions))) @ directions
        directions = np.vstack([directions, mixed / np.linalg.norm(mixed, axis=1, keepdims=True)])
    for direction in directions:
        for size in MOVES:
            q, residual = solve(model, model.integrate(start.q, size * direction), held, tolerance=CLOSURE_SOLVER_TOL)
            X = model.pose(q, leg.body)
            if residual <= CLOSURE_RESIDUAL_TOL:
                positions.append(transform(X, place))
    return positions


def _evaluate(feature: NamedVector | BodyPoint, goal: ClosedConfiguration) -> Array:
    value: Array = feature.value(collect_poses([goal], feature.links))[0]
    return value
