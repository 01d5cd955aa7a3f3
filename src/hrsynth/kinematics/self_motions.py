"""Self-motions: curves of modes, along which the robot moves with constant measured values.

Where the measured values leave the platform a dof to first order, the robot is led along it by steps that are closed
again (predictor and corrector). If it stays closed over a distance a self-motion is *found*; if not, the pose is
singular. Samples of a curve prove neither.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice, takewhile
from typing import Annotated

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.screws import compute_point_velocity
from ..geometry.so3 import convert_rotations_to_vectors
from ..geometry.vectors import Array, build_pose, compare_poses, transform
from ..records import As, Record, Recorded, Shown
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    MODE_SEARCH_ITERATIONS_MAX,
    NONZERO_SINGULAR_VALUE_MIN,
    PSEUDOINVERSE_CUTOFF_FRACTION,
    RELATION_ANGLE_TOL,
)
from .configuration import ClosedConfiguration
from .limits import list_joints_beyond
from .pinocchio_model import PinocchioModel
from .tasks import FixedValuesTask, shorten_step, solve, stack_task
from .velocity_relation import ObservationModel

SELF_MOTION_STEP_MAX = 0.1
"""Longest step (nv,) along a self-motion (characteristic lengths, radians)."""
SELF_MOTION_PROBE_FRACTION = 0.01
"""Length of random steps, closed again, that count the finite mobility; the closed set bends little over it."""
SELF_MOTION_BEND_TOL = 0.3
"""Largest correction of such a step as a fraction of it, and largest 1 - cosine between successive tangents."""
SELF_MOTION_SINGULAR_TOL = 1e-3
"""Relative singular value of loops and measurements below which a self-motion is searched; following it decides."""
SELF_MOTION_LENGTH_MIN = 0.2
"""Distance (characteristic lengths and radians) over which a self-motion must stay closed."""
SELF_MOTION_STEPS_MAX = 100
"""Steps of a self-motion in each direction."""
SELF_MOTION_STEP_HALVINGS_MAX = 6
"""Halvings of such a step."""


@dataclass(frozen=True, eq=False)
class SelfMotion(Record):
    """Motion of the robot with constant measured values, as far as it was followed from one of its poses.

    ``dimension``: number of independent ways in which the platform's bodies were led to closed configurations nearby;
    ``links``: those that move; ``shift`` (m) and ``turn`` (rad): how far the platform went; ``returns``: True if it
    came back to its start; ``goal``: True if it began at the pose at which the values were measured; ``hits``: number
    of starts of a search that ended on it; ``beyond_limits``: joints that are outside their limits somewhere along it;
    ``inside`` (m, rad): how far the platform went with all joints within theirs.
    """

    configuration: ClosedConfiguration
    dimension: Recorded[int]
    links: Recorded[tuple[str, ...]]
    shift: Annotated[float, As("followed_m")]
    turn: Annotated[float, As("followed_rad")]
    returns: Recorded[bool]
    goal: Recorded[bool] = False
    hits: Recorded[int] = 0
    way: tuple[dict[str, Array], ...] = field(default=(), repr=False)
    """The poses (4, 4) of the platform's bodies on the way."""
    beyond_limits: Annotated[tuple[str, ...], "joints that are beyond their limits somewhere along the motion"] = ()
    inside: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def words(self) -> str:
        """Links that move, and how far it was followed; where joint limits end it."""
        mechanism = self.configuration.model.mechanism
        resting = [link for link in mechanism.links if link not in self.links and link != mechanism.base]
        moving = ", ".join(self.links) if resting else "all links"
        far = _far(self.shift, self.turn) + (", until it closed" if self.returns else "")
        ends = (
            ""
            if not self.beyond_limits
            else (
                f", beyond the limits of {', '.join(self.beyond_limits)}; within all limits over {_far(*self.inside)}"
                if any(self.inside)
                else f", all of it beyond the limits of {', '.join(self.beyond_limits)}"
            )
        )
        return f"of dimension {self.dimension}, which moves {moving} (followed over {far}{ends})"

    def has_visited(self, at: ClosedConfiguration, observation_model: ObservationModel) -> bool:
        """Return True if it was followed to where the platform's bodies are at a closed configuration, to a step."""
        poses = {body: at.pose(body) for body in self.way[0]}
        return any(
            bodies_apart(poses, each, observation_model, at.model.length) <= SELF_MOTION_STEP_MAX for each in self.way
        )

    def may_continue_to(self, dimension: int, links: Sequence[str]) -> bool:
        """Return True if a closed configuration with these mobile links and this dimension may be on it, beyond where
        it was followed."""
        return not (self.dimension == 1 and self.returns) and (self.dimension, self.links) == (dimension, tuple(links))

    within_m = Shown(
        float,
        lambda self: self.inside[0] if self.beyond_limits else self.shift,
        "how far the platform went with all joints within their limits",
    )
    within_rad = Shown(float, lambda self: self.inside[1] if self.beyond_limits else self.turn)


def _far(shift: float, turn: float) -> str:
    """Return a distance of the platform (m, rad) as text."""
    return " and ".join([f"{shift:.3g} m"] * (shift > 0) + [f"{turn:.3g} rad"] * (turn > 0))


def self_motion(
    at: ClosedConfiguration,
    observation_model: ObservationModel,
    bodies: Sequence[str],
    known: Sequence[SelfMotion] = (),
    *,
    goal: bool = False,
) -> SelfMotion | None:
    """Return the self-motion through a closed configuration, one of those ``known`` if it may be that; None if the
    platform's bodies cannot move even to first order, or if no step stays closed: a singular pose."""
    model = at.model
    held = FixedValuesTask.at(model, at.q, observation_model.reference, observation_model.observations)
    walker = _Follower(model, held, observation_model, tuple(dict.fromkeys((*bodies, observation_model.platform))))
    ways, near = walker.around(at.q)
    if not ways.shape[1]:
        return None
    alike = next((each for each in known if each.may_continue_to(ways.shape[1], walker.links_moved(at.q, near))), None)
    if alike is not None:
        return alike
    walks = [walk for w in ways.T if (walk := walker.walk(at.q, w)).far >= SELF_MOTION_LENGTH_MIN]
    if not walks:
        return None
    longest = max(walks, key=lambda walk: walk.far)
    places = [q for walk in walks for q in walk.places]
    middle = [walk.places[len(walk.places) // 2] for walk in walks]
    size = min(each for each in [ways.shape[1], *(walker.around(q)[0].shape[1] for q in middle)] if each)
    return SelfMotion(
        at,
        size,
        walker.links_moved(at.q, places),
        longest.shift * model.length,
        longest.turn,
        longest.returns,
        goal,
        way=tuple(map(walker.bodies, places)),
        beyond_limits=tuple(dict.fromkeys(name for walk in walks for name in walk.beyond)),
        inside=(longest.inside[0] * model.length, longest.inside[1]),
    )


def follow_motion(
    at: ClosedConfiguration, observation_model: ObservationModel, twist: Array, count: int
) -> tuple[tuple[ClosedConfiguration, ...], ...]:
    """Return the self-motion that begins with a twist (rows of t; m, rad) of the platform, and with its opposite: up to
    ``count`` closed configurations each way, none if the twist is one to first order only."""
    model = at.model
    walker = _Follower(
        model,
        FixedValuesTask.at(model, at.q, observation_model.reference, observation_model.observations),
        observation_model,
        (observation_model.platform,),
    )
    w = twist / np.repeat([model.length, 1.0], 3)[: len(twist)]
    ways = (islice(walker.steps(at.q, sign * w / np.linalg.norm(w)), count) for sign in (1.0, -1.0))
    return tuple(tuple(ClosedConfiguration.of(model, q) for q in way) for way in ways)


@dataclass(frozen=True, eq=False)
class _FollowedPath:
    """Configurations along one tangent and back along the other, how far the platform went (characteristic lengths,
    radians), and whether it came back; joints that are beyond their limits on the way, and how far the platform went
    before the first."""

    places: tuple[Array, ...]
    shift: float
    turn: float
    returns: bool
    beyond: tuple[str, ...] = ()
    inside: tuple[float, float] = (0.0, 0.0)

    @property
    def far(self) -> float:
        """Distance of the platform's motion, shift and rotation together."""
        return self.shift + self.turn


@dataclass(frozen=True, eq=False)
class _Follower:
    """Steps along motions of a robot with fixed measured values."""

    model: PinocchioModel
    held: FixedValuesTask
    observation_model: ObservationModel
    names: tuple[str, ...]

    def bodies(self, q: Array) -> dict[str, Array]:
        """The poses (4, 4) of the platform's bodies."""
        return dict(zip(self.names, self.model.poses(q, self.names), strict=True))

    def tangents(self, q: Array, least: float = NONZERO_SINGULAR_VALUE_MIN) -> tuple[Array, Array]:
        """Return the twists of the bodies to first order, where singular values below ``least`` are zero: an
        orthonormal basis, (rows, d), and joint velocities (nv, d), without internal ones, that make them."""
        _, values, right = np.linalg.svd(stack_task(self.model, q, self.held)[1])
        kernel = right[int(np.sum(values > least * values.max(initial=1.0))) :].T
        X, V = self.model.frames(q, self.names)
        point = self.observation_model.point
        rows = [
            v
            if point is None or name != self.observation_model.platform
            else compute_point_velocity(v, x[:3, :3] @ point / self.model.length)
            for name, x, v in zip(self.names, X, V, strict=True)
        ]
        moves = np.vstack(rows) @ kernel
        basis, _ = compute_range_basis(moves, 1.0)
        return basis, np.asarray(kernel @ np.linalg.lstsq(moves, basis, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0])

    def around(self, q: Array) -> tuple[Array, list[Array]]:
        """Return the directions of closed configurations about one: an orthonormal basis of the bodies' twists that
        lead to them (rows, d), fewer than :meth:`build_tangents` if a dof is one to first order only; and the
        configurations."""
        basis, joints = self.tangents(q, SELF_MOTION_SINGULAR_TOL)
        found, came, home, rng = [], [], self.bodies(q), np.random.default_rng(0)
        size = basis.shape[1]
        if not size:
            return basis, []
        for c in np.vstack([np.eye(size), rng.normal(size=(size, size))]):
            step = joints @ (c / np.linalg.norm(c))
            part = SELF_MOTION_PROBE_FRACTION / max(1.0, float(np.abs(step).max()))  # of a unit twist of the bodies
            there, residual = solve(
                self.model,
                self.model.integrate(q, part * step),
                self.held,
                tolerance=CLOSURE_SOLVER_TOL,
                iterations=MODE_SEARCH_ITERATIONS_MAX,
            )
            if residual <= CLOSURE_RESIDUAL_TOL:
                found.append(there)
                came.append(
                    np.concatenate(
                        [twist for name, X in self.bodies(there).items() for twist in self._twist(name, X, home[name])]
                    )
                    @ basis
                    / part
                )
        _, values, right = np.linalg.svd(np.reshape(came, (-1, size)), full_matrices=False)
        return basis @ right[values > SELF_MOTION_BEND_TOL].T, found

    def _twist(self, name: str, X: Array, home: Array) -> tuple[Array, ...]:
        """The twist that leads a body from one pose to another, in parts, as rows of :meth:`build_tangents`."""
        if self.observation_model.point is not None and name == self.observation_model.platform:
            return (
                (transform(X, self.observation_model.point) - transform(home, self.observation_model.point))
                / self.model.length,
            )
        return (X[:3, 3] - home[:3, 3]) / self.model.length, convert_rotations_to_vectors(X[:3, :3] @ home[:3, :3].T)

    def links_moved(self, q: Array, places: Sequence[Array]) -> tuple[str, ...]:
        """The links that are elsewhere, or turned, at one of some configurations."""
        links = tuple(link for link in self.model.mechanism.links if link != self.model.mechanism.base)
        home = self.model.poses(q, links)
        found = [
            max(
                (
                    compare_poses(X, Y, self.model.length)
                    for X, Y in ((self.model.poses(there, (link,))[0], home[k]) for there in places)
                ),
                default=0.0,
            )
            for k, link in enumerate(links)
        ]
        return tuple(link for link, far in zip(links, found, strict=True) if far > RELATION_ANGLE_TOL)

    def walk(self, q: Array, w: Array) -> _FollowedPath:
        """As far as the motion leads along the bodies' twist w (rows,), and then the other way."""
        places, shift, turn, returns = [q], 0.0, 0.0, False
        inside, beyond = np.zeros(2), dict.fromkeys(list_joints_beyond(self.model, q))
        home = not beyond
        for sign in (1.0, -1.0):
            before, taken = self._platform(q), list[tuple[Array, bool]]()
            for number, there in enumerate(self.steps(q, sign * w), 1):
                now = self._platform(there)
                places.append(there)
                step = np.array(
                    [
                        np.linalg.norm(now[:3, 3] - before[:3, 3]) / self.model.length,
                        np.linalg.norm(convert_rotations_to_vectors(now[:3, :3] @ before[:3, :3].T)),
                    ]
                )
                shift, turn = shift + float(step[0]), turn + float(step[1])
                beyond |= dict.fromkeys(past := list_joints_beyond(self.model, there))
                taken.append((step, not past))
                along, before = now[:3, 3] - before[:3, 3], now
                returns = (
                    number > 2
                    and bodies_apart(self.bodies(there), self.bodies(q), self.observation_model, self.model.length)
                    <= SELF_MOTION_STEP_MAX / 2
                )
                if returns:
                    left = self._platform(q)[:3, 3] - now[:3, 3]
                    shift += math.copysign(float(np.linalg.norm(left)), float(left @ along)) / self.model.length
                    break
            for way in (taken, taken[::-1]) if returns else (taken,):  # what comes back is another way out
                inside += sum((step for step, _ in takewhile(lambda each: home and each[1], way)), np.zeros(2))
            if returns:
                break
        small = RELATION_ANGLE_TOL * len(places)
        inside[inside <= small] = 0.0
        return _FollowedPath(
            tuple(places),
            shift if shift > small else 0.0,
            turn if turn > small else 0.0,
            returns,
            tuple(beyond),
            (float(inside[0]), float(inside[1])),
        )

    def steps(self, q: Array, w: Array) -> Iterator[Array]:
        """Closed configurations one step apart, until no step is closed again or the motion ends."""
        for _ in range(SELF_MOTION_STEPS_MAX):
            basis, joints = self.tangents(q)
            ahead = basis.T @ w
            size = float(np.linalg.norm(ahead))
            if size < 1.0 - SELF_MOTION_BEND_TOL:
                return
            w = basis @ ahead / size
            step = shorten_step(SELF_MOTION_STEP_MAX * (joints @ ahead) / size, SELF_MOTION_STEP_MAX)
            there = self._close(q, step)
            if there is None:
                return
            q = there
            yield q

    def _close(self, q: Array, step: Array) -> Array | None:
        """The closed configuration beside the end of a step, or of a part of it; None where there is none."""
        for part in 0.5 ** np.arange(SELF_MOTION_STEP_HALVINGS_MAX):
            predicted = self.model.integrate(q, part * step)
            there, residual = solve(self.model, predicted, self.held, tolerance=CLOSURE_SOLVER_TOL, iterations=15)
            if residual <= CLOSURE_RESIDUAL_TOL and (
                np.linalg.norm(self.model.difference(predicted, there))
                <= SELF_MOTION_BEND_TOL * part * np.linalg.norm(step)
            ):
                return there
        return None

    def _platform(self, q: Array) -> Array:
        """The platform's pose (4, 4); of a point, without turn."""
        X = self.model.pose(q, self.observation_model.platform)
        return X if self.observation_model.point is None else build_pose(transform(X, self.observation_model.point))


def bodies_apart(
    one: dict[str, Array], other: dict[str, Array], observation_model: ObservationModel, length: float
) -> float:
    """Return how far bodies are from where they are elsewhere, as :func:`compare_poses`; of a platform that is a
    point, the point."""
    return max(
        compare_poses(X, other[body], length, observation_model.point if body == observation_model.platform else None)
        for body, X in one.items()
    )
