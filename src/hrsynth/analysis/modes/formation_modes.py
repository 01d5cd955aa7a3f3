"""Modes of a formation: all its configurations with the same measurements, trivial motions taken out.

Where no body turns, what a value leaves of a point are planes, linear in the slides: a rank proves that there are no
configurations but similar ones (bearings in a common frame). Anything else is searched for from random starts, and each
configuration that is found is brought to the first by the similarity of the group that takes it nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import UndefinedValue
from ...geometry.ranks import compute_kernel_basis
from ...geometry.vectors import Array, build_pose
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.goal_error import drift
from ...kinematics.tasks import FixedValuesTask, solve
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...mechanism import JointType
from ...mechanism.cameras import CameraObservation
from ...mechanism.observations.direction import SeenAxis
from ...progress import report
from ...tolerances import (
    CHAIN_ROUNDING,
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    LOCUS_DISTANCE_TOL,
    MODE_SEARCH_ITERATIONS_MAX,
    MODE_SEARCH_QUIET_STARTS_COUNT,
    MODE_SEARCH_STARTS_MAX,
    MOVED_AXIS_LEVER_MAX,
    NAMED_TWIST_TOL,
    NUMBER_ROUNDING,
    RELATION_ANGLE_TOL,
)
from ..formation import Formation, Similarities, analyze_formation, list_sensed_points
from ..loci.observation_loci import list_opposite
from ..observed import ObservedRobot

Bodies = dict[str, Array]


@dataclass(frozen=True, eq=False)
class FormedMode:
    """Configuration with the measured values of the goal, the poses (4, 4) of its links moved by a trivial motion to
    where they are nearest to the goal's, the residual, and the observations with the opposite value."""

    configuration: ClosedConfiguration
    bodies: Bodies
    residual: float
    opposite: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FormedModes:
    """Modes, the goal first, and their proof, named as of :class:`.solve.SystemModes`."""

    formation: Formation
    modes: tuple[FormedMode, ...]
    proof: str
    complete: bool = False
    complex: int | None = None
    bound: str = "none"
    degenerate: str | None = None
    continuum: int | None = None


def list_formation_modes(setup: ObservedRobot) -> FormedModes:
    """The modes of a formation with the measurements of its zero configuration."""
    at, observation_model = setup.all_samples.start, setup.samples.observation_model
    formation = analyze_formation(at, observation_model, compute_relation(at, observation_model), setup.decomposition)
    goal = FormedMode(at, {body: at.pose(body) for body in formation.bodies}, at.residual)
    sliding = _SliderFormation(setup) if _has_only_sliders(at) else None
    if formation.count:
        flexes = "; ".join(flex.name for flex in formation.flexes)
        generic = setup.samples.members[0]
        usual = analyze_formation(generic.configuration, observation_model, generic.relation, setup.decomposition).count
        if formation.count == usual or (sliding is not None and not sliding.spheres):
            words = f"no measured value shows {flexes}: a continuous family of dimension {formation.count}"
            return FormedModes(formation, (), words, degenerate=words, continuum=formation.count)
        return FormedModes(
            formation,
            (goal,),
            "others are not searched for: the configuration is singular",
            degenerate=f"to first order no measured value shows {flexes}",
        )
    if formation.group is None:
        return FormedModes(
            formation, (goal,), "others are not searched for: a trivial motion couples a rotation or a scale to another"
        )
    listed = None if sliding is None else sliding.modes(formation, goal)
    return listed or _search(observation_model, formation, formation.group, goal)


def _has_only_sliders(at: ClosedConfiguration) -> bool:
    """Return True if all joints are prismatic and in no loop: no link rotates, and points are linear in the
    coordinates."""
    mechanism = at.model.mechanism
    return (
        at.model.nv == len(mechanism.joints)
        and not mechanism.couplings
        and all(joint.type is JointType.PRISMATIC and joint.in_tree for joint in mechanism.joints.values())
    )


class _SliderFormation:
    """A formation whose bodies only slide, about its goal: the measured values are planes, linear in the slides, and
    ``spheres``, vectors (3,) of constant length with their slopes (3, slides), metres."""

    def __init__(self, setup: ObservedRobot) -> None:
        self.at, self.question = setup.all_samples.start, setup.samples.observation_model
        model = self.at.model
        steps = [ClosedConfiguration.of(model, model.integrate(self.at.q, unit)) for unit in np.eye(model.nv)]
        seen, points = list_sensed_points(self.at, self.question)
        known = drift(self.at, None, setup.normal.moved) + CHAIN_ROUNDING * float(np.abs(points).max(initial=0.0))
        planes, nearest = list[Array](), np.inf
        self.spheres: list[tuple[Array, Array]] = []
        self.known = len(seen) == len(self.question.observations)
        """True if the locus of each value is known."""
        for observation, place in seen:
            assert isinstance(observation, CameraObservation | SeenAxis)
            ends = [(observation.link, 1.0), (observation.seen_from or self.question.reference, -1.0)]
            slopes = np.array(
                [sum(sign * (step.pose(link) - self.at.pose(link))[:3, 3] for link, sign in ends) for step in steps]
            ).T
            loci = observation.loci(place)
            self.known &= bool(loci)
            for locus in loci:
                if locus.radius is not None:
                    self.spheres.append((locus.place - locus.through, slopes))
                elif not locus.turns:
                    planes += list(locus.normals @ slopes / model.length)
                    along = isinstance(observation, CameraObservation) and observation.axis is not None
                    nearest = min(nearest, float(np.linalg.norm((place.foot if along else place.B) - place.C)))
        self.rows = np.array(planes).reshape(-1, model.nv)
        self.slack = NUMBER_ROUNDING + MOVED_AXIS_LEVER_MAX * known / nearest
        """Error of their entries."""

    def modes(self, formation: Formation, goal: FormedMode) -> FormedModes | None:
        """All modes of a rigid formation; None where the planes leave more than similarities, one of them perhaps cut
        by spheres, or that cannot be proved."""
        group, (kernel, seen) = formation.group, compute_kernel_basis(self.rows, 1.0)
        more = kernel.shape[1] - len(formation.trivial)
        if not self.known or group is None or group.axes.shape[1] or more > bool(self.spheres) * (not group.scaled):
            return None
        if more < 0 or not _has_rank(self.rows, self.slack, seen.value):
            return None
        proof = (
            f"{len(self.rows)} planes in {self.at.model.nv} slides, of rank {seen.value} for all that the file's "
            "decimals allow (interval arithmetic): "
        )
        if not more:
            return FormedModes(
                formation,
                (goal,),
                proof
                + "only trivial motions are left"
                + ("; a negative scale would reverse the measured values" if group.scaled else ""),
                True,
                1,
                "rank",
            )
        others = self._on_spheres(kernel, goal, group)
        return (
            None
            if others is None
            else FormedModes(
                formation,
                (goal, *others),
                proof + "besides trivial motions a line is left, on which the distances decide",
                True,
                1 + len(others),
                "rank",
            )
        )

    def _on_spheres(self, kernel: Array, goal: FormedMode, group: Similarities) -> list[FormedMode] | None:
        """Return the nontrivial solution of the spheres on the line of the ``kernel``: σ with (σ w + 2 v) · w = 0; None
        if several nearly agree."""
        changed = np.vstack([slopes @ kernel for _, slopes in self.spheres])
        line = kernel @ np.linalg.svd(changed)[2][0]
        cuts = [
            -2.0 * (v @ w) / (w @ w)
            for v, slopes in self.spheres
            if np.linalg.norm(w := slopes @ line) > NAMED_TWIST_TOL * self.at.model.length
        ]
        spread = float(np.ptp(cuts))
        if spread > NAMED_TWIST_TOL:  # no second point is on all spheres
            return []
        if spread > LOCUS_DISTANCE_TOL or abs(cuts[0]) <= NAMED_TWIST_TOL:
            return None
        at = ClosedConfiguration.of(self.at.model, self.at.model.integrate(self.at.q, cuts[0] * line))
        bodies, _ = _move_nearest(at, self.at, self.question, group, tuple(goal.bodies))
        reversed_ = list_opposite(self.question.observations, self.at, self.question.reference, at.pose)
        return [FormedMode(at, bodies, at.residual, reversed_)]


def _has_rank(rows: Array, slack: float, rank: int) -> bool:
    """Return True if all matrices whose entries are within ``slack`` of these have this rank at least: a minor that has
    an inverse in interval arithmetic."""
    from flint import arb, arb_mat
    from scipy.linalg import qr

    if not rank:
        return True
    chosen = qr(rows.T, mode="r", pivoting=True)[1][:rank]
    columns = qr(rows[chosen], mode="r", pivoting=True)[1][:rank]
    minor = rows[np.ix_(chosen, columns)]
    try:
        arb_mat([[arb(float(x), slack) for x in row] for row in minor]).inv()
    except ZeroDivisionError:
        return False
    return True


def _move_nearest(
    at: ClosedConfiguration,
    goal: ClosedConfiguration,
    observation_model: ObservationModel,
    group: Similarities,
    bodies: Sequence[str],
) -> tuple[Bodies, float]:
    """The bodies at a configuration, moved by a trivial motion to where the sensed points are nearest to the goal's,
    and how far points (characteristic lengths of the goal) and bodies that turn are from there."""
    points, wanted = list_sensed_points(at, observation_model)[1], list_sensed_points(goal, observation_model)[1]
    s, R, t = group.nearest(points, wanted) if len(points) else (1.0, np.eye(3), np.zeros(3))
    moved, off = Bodies(), float(np.abs(s * points @ R.T + t - wanted).max(initial=0.0)) / goal.model.length
    for body in bodies:
        X, turns = (
            at.pose(body),
            bool(np.abs(at.model.frames(at.q, (body,))[1][0][3:]).max(initial=0.0) > NAMED_TWIST_TOL),
        )
        moved[body] = build_pose(s * R @ X[:3, 3] + t, R @ X[:3, :3] if turns else X[:3, :3])
        off = max(off, float(np.abs(moved[body][:3, :3] - goal.pose(body)[:3, :3]).max()))
    return moved, off


def _search(
    observation_model: ObservationModel, formation: Formation, group: Similarities, goal: FormedMode
) -> FormedModes:
    """The modes that random starts lead to."""
    at = goal.configuration
    model, rng, rank = at.model, np.random.default_rng(0), compute_relation(at, observation_model).rank
    held, modes, met = (
        FixedValuesTask.at(model, at.q, observation_model.reference, observation_model.observations),
        [goal],
        [1],
    )
    starts = closed = quiet = loose = 0
    while starts < MODE_SEARCH_STARTS_MAX and quiet < MODE_SEARCH_QUIET_STARTS_COUNT:
        starts += 1
        report("starts")
        far = np.pi if starts % 2 else rng.uniform(0.0, np.pi)
        try:
            q, residual = solve(
                model,
                model.integrate(model.q0, rng.uniform(-far, far, model.nv)),
                held,
                tolerance=CLOSURE_SOLVER_TOL,
                iterations=MODE_SEARCH_ITERATIONS_MAX,
            )
        except UndefinedValue:  # along the path a point came to a camera's centre
            continue
        if residual > CLOSURE_RESIDUAL_TOL:
            continue
        closed, quiet = closed + 1, quiet + 1
        restored = ClosedConfiguration.of(model, model.remove_turns(q))
        if compute_relation(restored, observation_model).rank < rank:
            loose += 1
            continue
        known = next(
            (
                k
                for k, mode in enumerate(modes)
                if _move_nearest(restored, mode.configuration, observation_model, group, formation.bodies)[1]
                <= RELATION_ANGLE_TOL
            ),
            None,
        )
        if known is None:
            bodies, _ = _move_nearest(restored, at, observation_model, group, formation.bodies)
            modes.append(FormedMode(restored, bodies, residual))
            met.append(1)
            quiet = 0
        else:
            met[known] += 1
    rare = sum(count == 1 for count in met[1:])
    proof = f"found from {starts} random starts of all links, of which {closed} closed"
    proof += f"; {rare} of the modes found only once" if rare else ""
    return FormedModes(
        formation,
        tuple(modes),
        proof,
        degenerate=None
        if not loose
        else (f"{loose} starts ended at configurations, not listed, at which further motions are unobserved"),
    )
