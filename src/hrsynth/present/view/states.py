"""Displacements of all links at the zero configuration, along each slider, and at poses of the platform.

A displacement from the zero configuration is a position and a unit quaternion (x, y, z, w).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ...analysis.configuration_report import ConfigurationAnalysis
from ...analysis.observed import ObservedRobot
from ...geometry.vectors import Array, invert_pose
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.continuation import approach, track
from ...kinematics.coordinates import Coordinates
from ...kinematics.pinocchio_model import PinocchioModel
from ...kinematics.platform_motion import PoseTask
from ...kinematics.tasks import PoseAndValuesTask, solve, stack_task
from ...mechanism import Mechanism
from ...records import As, Number, Recorded, Shown
from ...results import Value
from ...tolerances import CLOSURE_SOLVER_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .scale import describe_pose_error
from .shapes import PAGE_DIGITS_COUNT
from .sights import ShownSight, list_shown_observations

VIEW_TRACKING_ITERATIONS_MAX = 60
"""Iterations in which a hidden robot follows the real one in the view."""
DRAG_APPROACH_STEPS_COUNT = 8
"""Steps by which a dragged platform approaches its target after the straight path ends."""

REAL, HIDDEN = "real", "hidden"
TURN, WAY = 1.0, 1.0
"""Largest rotation (rad) and translation (characteristic lengths) of a slider, in each direction."""
SLIDER_DISTANCE_MAX = 100.0
"""Largest displacement that is accepted, in multiples of these."""
SLIDER_CONFIGURATIONS_COUNT = 10
"""Configurations of a slider on each side of the zero configuration."""


@dataclass(frozen=True, eq=False, repr=False)
class ViewState(Value):
    """Displacements (links, 7) of each machine's links, smallest singular value of Mᵀ (characteristic lengths; None if
    Mᵀ does not exist), error of the platform (:func:`.describe_pose_error`) if requested, and observations."""

    places: Mapping[str, Array]
    distance: float | None
    error: Mapping[str, Any] | None = None
    sights: tuple[ShownSight, ...] = ()

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        return {
            **{key: round_page_values(places) for key, places in self.places.items()},
            "distance": None if self.distance is None else float(f"{self.distance:.5g}"),
            **({} if self.error is None else {"error": dict(self.error)}),
            **({"sights": [each.scene() for each in self.sights]} if self.sights else {}),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Slider(Value):
    """Slider of one platform coordinate: its values (n,) in metres or radians, the state at each of them, and the index
    of the zero configuration."""

    name: Recorded[str]
    unit: Recorded[str]
    values: Recorded[tuple[float, ...]]
    states: tuple[ViewState, ...]
    home: Annotated[int, As("zero_configuration"), "index of the value at the zero configuration"]

    distances = Shown(list[Number], lambda self: [state.distance for state in self.states])

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        values = [round(value, PAGE_DIGITS_COUNT) for value in self.values]
        return {
            "name": self.name,
            "label": self.name,
            "unit": self.unit,
            "values": values,
            "home": values[self.home],
            "states": [state.scene() for state in self.states],
        }


@dataclass(frozen=True, eq=False, repr=False)
class RealAndHiddenState(Value):
    """Configuration of the real robot with the coordinates (nq,) of the hidden one."""

    real: ClosedConfiguration
    hidden: Array | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Mover(Value):
    """Real robot with its platform coordinates, and the model of the hidden robot that follows it."""

    setup: ObservedRobot
    coordinates: Coordinates
    examiner: ConfigurationAnalysis
    hidden: PinocchioModel | None = None

    @classmethod
    def of(cls, setup: ObservedRobot, hidden: Mechanism | None) -> Mover:
        """Start at the zero configuration."""
        start = setup.all_samples.start
        model = None if hidden is None else PinocchioModel(hidden, start.model.length)
        coordinates = Coordinates.of(start, setup.all_samples.observation_model, setup.motion)
        return cls(setup, coordinates, ConfigurationAnalysis.of(setup), model)

    @property
    def home(self) -> RealAndHiddenState:
        """Return the zero configuration."""
        return RealAndHiddenState(self.setup.all_samples.start, None if self.hidden is None else self.hidden.q0)

    def state(self, at: RealAndHiddenState) -> ViewState:
        """Return what the page shows of a configuration."""
        sights = list_shown_observations(self.setup, at.real)
        return ViewState(self.places(at), self.examiner.classify(at.real).distances.type2, sights=sights)

    def places(self, at: RealAndHiddenState) -> dict[str, Array]:
        """Return the displacements (links, 7) of each machine's links."""
        places = {REAL: compute_link_displacements(self.setup.mechanism, at.real.pose)}
        if self.hidden is not None and at.hidden is not None:
            q = at.hidden
            places[HIDDEN] = compute_link_displacements(self.hidden.mechanism, lambda link: self.hidden.pose(q, link))
        return places

    def with_error(self, at: RealAndHiddenState) -> ViewState:
        """Return the state with the error of the platform."""
        return replace(self.state(at), error=describe_pose_error(self.setup, at.real))

    def send(self, here: RealAndHiddenState, values: Array) -> tuple[RealAndHiddenState, Array]:
        """Track the robot from ``here`` to platform coordinates (n,); return where it arrives, and the coordinates."""
        aim = Coordinates(self.setup.motion, self.coordinates.places, values)
        there, _ = track(here.real, self.setup.motion, aim)
        followed = self.follow_hidden(here, [there])
        found = followed[-1] if followed else here
        return found, values + aim.apart(found.real.pose(self.setup.motion.link))

    def draw_to(self, here: RealAndHiddenState, X: Array) -> RealAndHiddenState:
        """Move the platform from ``here`` as near as possible to the pose X (4, 4), lengths in characteristic lengths,
        rotations in radians."""
        motion = self.setup.motion
        whole = PoseTask(
            motion.link,
            motion.point,
            motion.home[:3, :3],
            np.eye(3),
            motion.position(X),
            motion.normal,
            rotation=X[:3, :3] if motion.body and motion.rotations.shape[1] else None,
        )
        followed = self.follow_hidden(here, [approach(here.real, whole, DRAG_APPROACH_STEPS_COUNT)])
        return followed[-1] if followed else here

    def read(self, posed: RealAndHiddenState) -> Array:
        """Return the coordinates (n,) of the platform."""
        return self.coordinates.read(posed.real.pose(self.setup.motion.link))

    def beside(self, at: ClosedConfiguration, q: Array) -> RealAndHiddenState | None:
        """Return the real robot with the hidden one at ``q``, None if pose or directions differ."""
        assert self.hidden is not None
        return RealAndHiddenState(at, q) if np.linalg.norm(self._misses(at, q)) <= HIDDEN_ROBOT_RESIDUAL_TOL else None

    def with_hidden(self, at: ClosedConfiguration) -> RealAndHiddenState:
        """Return the real robot with the hidden one, tracked from its zero configuration; without it if that fails."""
        found = self.follow_hidden(self.home, [at])
        if not found:
            goal = Coordinates(
                self.setup.motion, self.coordinates.places, self.coordinates.read(at.pose(self.setup.motion.link))
            )
            halfway = goal.towards(self.home.real.pose(self.setup.motion.link), 0.5)
            way = [track(self.home.real, self.setup.motion, each)[0] for each in (halfway, goal)]
            found = self.follow_hidden(self.home, [*way, at])
        return found[-1] if found and found[-1].real is at else RealAndHiddenState(at)

    @cached_property
    def ends(self) -> tuple[tuple[RealAndHiddenState, RealAndHiddenState], ...]:
        """Return the lower and upper end of each slider, tracked within its span."""
        found = []
        for index, place in enumerate(self.coordinates.places):
            span = TURN if place >= 3 else WAY * self.home.real.model.length
            down, up = self.coordinates.ends(self.home.real, index, (span, span))
            found.append((RealAndHiddenState(down), RealAndHiddenState(up)))
        return tuple(found)

    def is_beyond_sliders(self, values: Array) -> bool:
        """Return True if coordinates (n,) are far beyond all sliders."""
        spans = np.where(np.array(self.coordinates.places) >= 3, TURN, WAY * self.home.real.model.length)
        return bool(np.any(np.abs(values - self.coordinates.values) > SLIDER_DISTANCE_MAX * spans))

    def sliders(self) -> tuple[Slider, ...]:
        """Return the sliders, each over the range in which the robot and the hidden one can be tracked."""
        return tuple(self._slider(index) for index in range(len(self.coordinates.places)))

    def _slider(self, index: int) -> Slider:
        home, turns = self.home, self.coordinates.places[index] >= 3
        span = TURN if turns else WAY * home.real.model.length
        ways = self.coordinates.along(home.real, index, (span, span), SLIDER_CONFIGURATIONS_COUNT)
        start = next(i for i, (_, at) in enumerate(ways) if at is home.real)
        down = self.follow_hidden(home, [at for _, at in reversed(ways[:start])])
        up = self.follow_hidden(home, [at for _, at in ways[start + 1 :]])
        posed = [*reversed(down), home, *up]
        values = [value for value, _ in ways[start - len(down) : start + len(up) + 1]]
        return Slider(
            self.coordinates.names[index],
            "rad" if turns else "m",
            tuple(values),
            tuple(map(self.with_error, posed)),
            len(down),
        )

    def follow_hidden(self, start: RealAndHiddenState, way: Iterable[ClosedConfiguration]) -> list[RealAndHiddenState]:
        """Track the hidden robot along a path of the real one, as far as it can follow."""
        found: list[RealAndHiddenState] = []
        q = start.hidden
        for at in way:
            if self.hidden is not None and q is not None:
                q, residual = solve(
                    self.hidden,
                    q,
                    self._target(at),
                    tolerance=CLOSURE_SOLVER_TOL,
                    iterations=VIEW_TRACKING_ITERATIONS_MAX,
                )
                if not residual <= HIDDEN_ROBOT_RESIDUAL_TOL:
                    break
            found.append(RealAndHiddenState(at, q))
        return found

    def _misses(self, at: ClosedConfiguration, q: Array) -> Array:
        """Return the residuals of the hidden robot at ``q``: loops, pose and directions."""
        assert self.hidden is not None
        return stack_task(self.hidden, q, self._target(at))[0]

    def _target(self, at: ClosedConfiguration) -> PoseAndValuesTask:
        """Return the pose and the directions that the hidden robot has; constant-direction legs are not in it."""
        target = self.setup.samples.observation_model.target(at)
        assert self.hidden is not None
        links = self.hidden.mechanism.links
        return PoseAndValuesTask(
            target.link,
            target.pose,
            target.point,
            target.reference,
            tuple(pair for pair in target.measured if pair[0].link in links),
        )


def compute_link_displacements(mechanism: Mechanism, pose: Any) -> Array:
    """Return the displacement of each link from the zero configuration, (links, 7); ``pose`` gives X_BL (4, 4)."""
    return np.array([place(pose(name) @ invert_pose(link.pose)) for name, link in mechanism.links.items()])


def place(X: Array) -> Array:
    """Return position and unit quaternion (x, y, z, w) of a pose X (4, 4), (7,)."""
    from scipy.spatial.transform import Rotation

    return np.concatenate([X[:3, 3], Rotation.from_matrix(X[:3, :3]).as_quat(canonical=True)])


def round_page_values(places: Array) -> list[list[float]]:
    """Round displacements (links, 7) for the page."""
    return (np.round(places, PAGE_DIGITS_COUNT) + 0.0).tolist()
