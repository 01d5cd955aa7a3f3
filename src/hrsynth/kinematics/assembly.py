"""Assembly of a robot at a given pose of its platform's links, leg by leg.

A configuration shows that it closes. That it does not, or only beyond a joint's limits, is reported only if the list of
a leg's solutions proves it (:mod:`.leg_solutions`). Starts from which nothing closes prove nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..description.assembly.zero_configuration import zeroed_at
from ..errors import LoopClosureFailure
from ..geometry.vectors import Array, invert_pose
from ..mechanism import Joint, JointType, Mechanism, Observation
from ..mechanism.legs import Leg, LegDecomposition
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL
from . import limits
from .configuration import ClosedConfiguration
from .leg_paths import MotionFactor, list_leg_paths
from .leg_reach import extract_leg
from .leg_solutions import UNDECIDED, LegEnd, LegSolutions, ReachFailure, solve_leg
from .pinocchio_model import PinocchioModel
from .tasks import LinkPoses, PoseAndValuesTask, solve

LEG_CLOSURE_ITERATIONS_MAX = 400
"""Largest number of iterations that close a leg at a pose."""

LEG_START_CONFIGURATIONS_COUNT = 24
"""Number of configurations of a leg, the zero configuration first, from which it is closed at a pose: for each of its
listed solutions, and as many without a list."""

ASSEMBLED, BEYOND, IMPOSSIBLE, NOT_FOUND = "yes", "beyond limits", "no", "not found"
"""Verdicts on the assembly of a robot: a configuration is known; only beyond joint limits, and not at all, both proved;
none of these."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """Assembly of a robot at a pose: the configuration, or None and the legs that were not closed (``open``), with
    proofs that legs cannot close (``misses``); joints beyond their limits there (``beyond``), and whether all solutions
    of a leg, or of the platform, are (``held``); the poses (4, 4) of the platform's links; couplings that were not
    closed where all legs are (``gears``)."""

    configuration: ClosedConfiguration | None
    open: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    platform: Mapping[str, Array] | None = None
    misses: tuple[tuple[str, ReachFailure], ...] = ()
    held: bool = False
    gears: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """``ASSEMBLED``, ``BEYOND``, ``IMPOSSIBLE`` or ``NOT_FOUND``."""
        if self.misses:
            return IMPOSSIBLE
        if self.configuration is None:
            return NOT_FOUND
        if self.beyond:
            return BEYOND if self.held else NOT_FOUND
        return ASSEMBLED

    @property
    def reachable(self) -> bool | None:
        """True if the whole robot closes within its joint limits; None if neither was found."""
        return {ASSEMBLED: True, NOT_FOUND: None}.get(self.verdict, False)


@dataclass(frozen=True, eq=False)
class Assembler:
    """Robot whose legs are closed one at a time between the base and links of the platform at given poses."""

    decomposition: LegDecomposition
    length: float
    reference: str

    @cached_property
    def _twins(self) -> dict[str, PinocchioModel]:
        return {
            leg.label: PinocchioModel(extract_leg(self.decomposition, leg), self.length)
            for leg in self.decomposition.legs
        }

    @cached_property
    def _platform(self) -> Mechanism:
        """Platform alone, floating with the first link on which a leg ends."""
        mechanism, body = self.decomposition.mechanism, self.decomposition.legs[0].platform_link
        kept = {mechanism.base, *self.decomposition.platform}
        floats = Joint(
            mechanism.fresh("floating"), JointType.FREE, mechanism.base, body, mechanism.links[body].pose[:3, 3]
        )
        inside = set(self.decomposition.platform)
        outside = [name for name, joint in mechanism.joints.items() if not set(joint.links) <= inside]
        return mechanism.changed(
            remove_links=set(mechanism.links) - kept,
            remove_joints=outside,
            joints=[floats],
            observations=(),
            camera=None,
        )

    def platform(self, bodies: Mapping[str, Array]) -> dict[str, Array]:
        """Return the poses (4, 4) of all links of the platform where the links on which legs end have these; raises
        ``LoopClosureFailure`` if its own joints do not allow that."""
        return self._platform_at(bodies)[0]

    def _platform_at(
        self, bodies: Mapping[str, Array], within: float = 0.0
    ) -> tuple[dict[str, Array], list[str], bool]:
        """Return the assembly with its joints that are beyond their limits, and whether one of them has no other value
        at these poses of the links, which are known to ``within``."""
        mechanism, body = self._platform, self.decomposition.legs[0].platform_link
        displacement = bodies[body] @ invert_pose(mechanism.links[body].pose)
        poses = {link: displacement @ mechanism.links[link].pose for link in self.decomposition.platform}
        base = mechanism.links[mechanism.base].pose
        model = PinocchioModel(zeroed_at(mechanism, {mechanism.base: base, **poses}), self.length)
        target = LinkPoses(tuple(bodies.items()))
        residual = np.inf
        for start in _list_starts(model):
            q, residual = solve(model, start, target, tolerance=CLOSURE_SOLVER_TOL, iterations=60)
            if residual <= CLOSURE_RESIDUAL_TOL and all(
                _has_same_rotation(model.pose(q, body), X) for body, X in bodies.items()
            ):
                return (
                    {link: model.pose(q, link) for link in self.decomposition.platform},
                    limits.list_joints_beyond(model, q),
                    self.decomposition.point is None and limits.is_proved_outside(model, q, bodies, within),
                )
        raise LoopClosureFailure(model.mechanism.name, residual, CLOSURE_RESIDUAL_TOL, "inside the platform")

    @cached_property
    def _ways(self) -> dict[str, list[tuple[MotionFactor, ...]]]:
        return {leg.label: list(list_leg_paths(self.decomposition, leg)) for leg in self.decomposition.legs}

    def at(
        self, bodies: Mapping[str, Array], measured: Sequence[tuple[Observation, Array]], within: float = 0.0
    ) -> Assembly:
        """Assemble the robot with the links (on which legs end) at these poses (4, 4), known to ``within``
        (characteristic lengths, radians), and the measured values as given."""
        platform, beyond, held = self._platform_at(bodies, within)
        poses = dict(platform)
        missing, misses = list[str](), list[tuple[str, ReachFailure]]()
        for leg in self.decomposition.legs:
            own = [each for each in measured if each[0].leg == leg.label]
            closing = self._leg(leg, bodies[leg.platform_link], own, within)
            if closing.found is None:
                missing.append(leg.label)
                misses += [] if closing.miss is None else [(leg.label, closing.miss)]
                continue
            model, q = closing.found
            poses.update({link: model.pose(q, link) for link in leg.links if link not in poses})
            beyond += limits.list_joints_beyond(model, q, leg.joints)
            held |= closing.held
        if missing:
            return Assembly(None, tuple(missing), (), platform, tuple(misses))
        mechanism = self.decomposition.mechanism
        poses[mechanism.base] = mechanism.links[mechanism.base].pose
        while len(poses) < len(mechanism.links):  # links that are in no leg, as fingers, are carried along
            carrier, link = next(
                (one, other)
                for joint in mechanism.joints.values()
                for one, other in (joint.links, joint.links[::-1])
                if one in poses and other not in poses
            )
            poses[link] = poses[carrier] @ mechanism.links[carrier].inverse @ mechanism.links[link].pose
        whole = PinocchioModel(zeroed_at(mechanism, poses), self.length)
        return Assembly(ClosedConfiguration.of(whole, whole.q0), (), tuple(beyond), platform, (), held)

    def _leg(self, leg: Leg, X: Array, measured: Sequence[tuple[Observation, Array]], within: float) -> _LegClosure:
        """Close one leg with its end at X: within its joint limits if it is found there."""
        model = self._twins[leg.label]
        target = PoseAndValuesTask(leg.platform_link, X, self.decomposition.point, self.reference, tuple(measured))
        first = self._close(model, model.q0, target)
        if first is not None and not limits.list_joints_beyond(model, first, leg.joints):
            return _LegClosure((model, first))
        zero = self.decomposition.mechanism.links[leg.platform_link].pose
        end = LegEnd(X @ invert_pose(zero), self.length, within, target.point is None)
        known = solve_leg(self._ways[leg.label], end)
        if known.miss is not None:
            return _LegClosure(None, known.miss)
        held = any(
            limits.is_every_value_excluded(model.mechanism, joint, values) for joint, values in known.values
        ) or any(
            limits.is_tilt_excluded(way, dict(known.values), end.D, within, len(self._ways[leg.label]) == 1)
            for way in self._ways[leg.label]
        )
        for start in () if held and first is not None else _list_starts(model, known):
            q = self._close(model, start, target)
            if q is not None and (held or not limits.list_joints_beyond(model, q, leg.joints)):
                return _LegClosure((model, q), None, held)
            first = q if first is None else first
        return _LegClosure(None if first is None else (model, first), None, held)

    def _close(self, model: PinocchioModel, start: Array, target: PoseAndValuesTask) -> Array | None:
        """Return the closed configuration that a start leads to."""
        q, residual = solve(model, start, target, tolerance=CLOSURE_SOLVER_TOL, iterations=LEG_CLOSURE_ITERATIONS_MAX)
        turned = target.point is not None or _has_same_rotation(model.pose(q, target.link), target.pose)
        return q if residual <= CLOSURE_RESIDUAL_TOL and turned else None


def build_from_link_poses(model: PinocchioModel, pose: Callable[[str], Array]) -> ClosedConfiguration:
    """Return the configuration of a model at which its links have their poses (4, 4); raises ``LoopClosureFailure``."""
    poses = {link: pose(link) for link in model.mechanism.links}
    q, residual = solve(model, model.read(poses.__getitem__), tolerance=CLOSURE_SOLVER_TOL)
    if residual > CLOSURE_RESIDUAL_TOL or not all(
        _has_same_rotation(model.pose(q, link), X) for link, X in poses.items()
    ):
        raise LoopClosureFailure(
            model.mechanism.name, residual, CLOSURE_RESIDUAL_TOL, "in coordinates of the zero configuration"
        )
    return ClosedConfiguration.of(model, q)


@dataclass(frozen=True, eq=False)
class _LegClosure:
    """Leg at a pose: its closed configuration (model, q), or the proof that there is none, or neither; whether all its
    solutions are beyond limits."""

    found: tuple[PinocchioModel, Array] | None
    miss: ReachFailure | None = None
    held: bool = False


def _has_same_rotation(X: Array, wanted: Array) -> bool:
    """Return True if two poses have one rotation: the solver's error of a rotation vanishes at half a turn as well."""
    return float(np.trace(X[:3, :3].T @ wanted[:3, :3])) > 1.0


def _list_starts(model: PinocchioModel, known: LegSolutions = UNDECIDED) -> Iterator[Array]:
    """Yield configurations with the joints' known values, other joints as at zero, then random, always the same; last
    without values."""
    rng = np.random.default_rng(0)
    joints = [model.coordinates[joint] for joint, _ in known.values if joint in model.coordinates]
    lists = [
        [
            float(value.mid()) / (model.length if model.mechanism.joints[joint].type.has_translation else 1.0)
            for value in values
            if value.is_finite()
        ]
        for joint, values in known.values
        if joint in model.coordinates
    ]
    for combination in (*product(*lists), None):
        for number in range(LEG_START_CONFIGURATIONS_COUNT):
            step = rng.uniform(-np.pi, np.pi, model.nv) if number else np.zeros(model.nv)
            if combination is not None:
                for (place,), value in zip(joints, combination, strict=True):
                    step[place] = value
            yield model.integrate(model.q0, step)
