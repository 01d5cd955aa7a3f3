"""Where all links are, at the zero configuration, along each slider, and wherever the platform is sent.

A link's place is its displacement from the zero configuration: position and unit quaternion (x, y, z, w).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ...analysis.configuration_report import ConfigurationAnalysis
from ...analysis.observed import ObservedRobot
from ...budgets import APPROACH, FOLLOWING
from ...geometry.vectors import Array, inverse
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.continuation import approach, track
from ...kinematics.coordinates import Coordinates
from ...kinematics.pinocchio_model import PinocchioModel
from ...kinematics.platform_motion import PoseTask
from ...kinematics.tasks import PoseAndValuesTask, solve, system
from ...mechanism import Mechanism
from ...records import As, Number, Recorded, Shown
from ...results import Value
from ...tolerances import FOLLOWED, SOLVED
from .scale import error
from .shapes import PAGE_DIGITS
from .sights import ShownSight, shown_sights

REAL, HIDDEN = "real", "hidden"
TURN, WAY = 1.0, 1.0
"""How far a slider turns (rad) and moves (characteristic lengths) the platform each way at most."""
BEYOND_SLIDERS = 100.0
"""Such distances beyond which no slider sends the platform."""
STEPS = 10
"""Configurations on each side of a slider's home."""


@dataclass(frozen=True, eq=False, repr=False)
class ViewState(Value):
    """The places (links, 7) of each machine's links, the smallest singular value of Mᵀ (characteristic lengths; None
    where Mᵀ does not exist), how wrong the platform can be there (:func:`.error`), where that was asked, and what
    sensors see."""

    places: Mapping[str, Array]
    distance: float | None
    error: Mapping[str, Any] | None = None
    sights: tuple[ShownSight, ...] = ()

    def scene(self) -> dict[str, Any]:
        """What the page is given."""
        return {
            **{key: page_values(places) for key, places in self.places.items()},
            "distance": None if self.distance is None else float(f"{self.distance:.5g}"),
            **({} if self.error is None else {"error": dict(self.error)}),
            **({"sights": [each.scene() for each in self.sights]} if self.sights else {}),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Slider(Value):
    """One freedom of the platform: its coordinate's values (n,) in metres or radians, the state at each of them, and
    the index of the zero configuration."""

    name: Recorded[str]
    unit: Recorded[str]
    values: Recorded[tuple[float, ...]]
    states: tuple[ViewState, ...]
    home: Annotated[int, As("zero_configuration"), "index of the value at the zero configuration"]

    distances = Shown(list[Number], lambda self: [state.distance for state in self.states])

    def scene(self) -> dict[str, Any]:
        """What the page is given."""
        values = [round(value, PAGE_DIGITS) for value in self.values]
        return {
            "name": self.name,
            "label": self.name,
            "unit": self.unit,
            "values": values,
            "home": values[self.home],
            "states": [state.scene() for state in self.states],
        }


@dataclass(frozen=True, eq=False, repr=False)
class Posed(Value):
    """A configuration of the real robot and the coordinates (nq,) of the hidden one that goes with it."""

    real: ClosedConfiguration
    hidden: Array | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Mover(Value):
    """The real robot with its platform's coordinates, and the twin of the hidden robot that follows it."""

    setup: ObservedRobot
    coordinates: Coordinates
    examiner: ConfigurationAnalysis
    hidden: PinocchioModel | None = None

    @classmethod
    def of(cls, setup: ObservedRobot, hidden: Mechanism | None) -> Mover:
        """At the zero configuration."""
        start = setup.all_samples.start
        model = None if hidden is None else PinocchioModel(hidden, start.model.length)
        coordinates = Coordinates.of(start, setup.all_samples.observation_model, setup.motion)
        return cls(setup, coordinates, ConfigurationAnalysis.of(setup), model)

    @property
    def home(self) -> Posed:
        """The zero configuration."""
        return Posed(self.setup.all_samples.start, None if self.hidden is None else self.hidden.q0)

    def state(self, at: Posed) -> ViewState:
        """What the page shows of a configuration."""
        sights = shown_sights(self.setup, at.real)
        return ViewState(self.places(at), self.examiner.classify(at.real).distances.type2, sights=sights)

    def places(self, at: Posed) -> dict[str, Array]:
        """The places (links, 7) of each machine's links."""
        places = {REAL: displacements(self.setup.mechanism, at.real.pose)}
        if self.hidden is not None and at.hidden is not None:
            q = at.hidden
            places[HIDDEN] = displacements(self.hidden.mechanism, lambda link: self.hidden.pose(q, link))
        return places

    def with_error(self, at: Posed) -> ViewState:
        """The same with the error there."""
        return replace(self.state(at), error=error(self.setup, at.real))

    def send(self, here: Posed, values: Array) -> tuple[Posed, Array]:
        """Where the robot comes to from ``here`` when the platform is sent to coordinates (n,), and those there."""
        aim = Coordinates(self.setup.motion, self.coordinates.places, values)
        there, _ = track(here.real, self.setup.motion, aim)
        followed = self.follow_hidden(here, [there])
        found = followed[-1] if followed else here
        return found, values + aim.apart(found.real.pose(self.setup.motion.link))

    def draw_to(self, here: Posed, X: Array) -> Posed:
        """Where the robot comes to from ``here`` when its platform is drawn to the pose X (4, 4): as near as it goes,
        lengths in characteristic lengths, turns in radians."""
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
        followed = self.follow_hidden(here, [approach(here.real, whole, APPROACH)])
        return followed[-1] if followed else here

    def read(self, posed: Posed) -> Array:
        """The coordinates (n,) of the platform."""
        return self.coordinates.read(posed.real.pose(self.setup.motion.link))

    def beside(self, at: ClosedConfiguration, q: Array) -> Posed | None:
        """The real robot with the hidden one at ``q``, None if that is at another pose or its directions at others."""
        assert self.hidden is not None
        return Posed(at, q) if np.linalg.norm(self._misses(at, q)) <= FOLLOWED else None

    def with_hidden(self, at: ClosedConfiguration) -> Posed:
        """The real robot with the hidden one beside it, which comes there from its zero configuration; without it where
        it does not arrive."""
        found = self.follow_hidden(self.home, [at])
        if not found:
            goal = Coordinates(
                self.setup.motion, self.coordinates.places, self.coordinates.read(at.pose(self.setup.motion.link))
            )
            halfway = goal.towards(self.home.real.pose(self.setup.motion.link), 0.5)
            way = [track(self.home.real, self.setup.motion, each)[0] for each in (halfway, goal)]
            found = self.follow_hidden(self.home, [*way, at])
        return found[-1] if found and found[-1].real is at else Posed(at)

    @cached_property
    def ends(self) -> tuple[tuple[Posed, Posed], ...]:
        """Where each coordinate alone comes to, down and up, as far as small steps lead within its slider's span."""
        found = []
        for index, place in enumerate(self.coordinates.places):
            span = TURN if place >= 3 else WAY * self.home.real.model.length
            down, up = self.coordinates.ends(self.home.real, index, (span, span))
            found.append((Posed(down), Posed(up)))
        return tuple(found)

    def far(self, values: Array) -> bool:
        """Whether coordinates (n,) are so far from home that no slider means them."""
        spans = np.where(np.array(self.coordinates.places) >= 3, TURN, WAY * self.home.real.model.length)
        return bool(np.any(np.abs(values - self.coordinates.values) > BEYOND_SLIDERS * spans))

    def sliders(self) -> tuple[Slider, ...]:
        """Each coordinate alone changed from home, as far as the robot, and the hidden one with it, goes."""
        return tuple(self._slider(index) for index in range(len(self.coordinates.places)))

    def _slider(self, index: int) -> Slider:
        home, turns = self.home, self.coordinates.places[index] >= 3
        span = TURN if turns else WAY * home.real.model.length
        ways = self.coordinates.along(home.real, index, (span, span), STEPS)
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

    def follow_hidden(self, start: Posed, way: Iterable[ClosedConfiguration]) -> list[Posed]:
        """The way with the hidden robot beside the real one, as far as it can follow."""
        found: list[Posed] = []
        q = start.hidden
        for at in way:
            if self.hidden is not None and q is not None:
                q, residual = solve(self.hidden, q, self._target(at), tolerance=SOLVED, iterations=FOLLOWING)
                if not residual <= FOLLOWED:
                    break
            found.append(Posed(at, q))
        return found

    def _misses(self, at: ClosedConfiguration, q: Array) -> Array:
        """What the hidden robot misses at ``q``: its loops, the pose and the directions."""
        assert self.hidden is not None
        return system(self.hidden, q, self._target(at))[0]

    def _target(self, at: ClosedConfiguration) -> PoseAndValuesTask:
        """The pose and the directions that the hidden robot takes over; blind links are not in it."""
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


def displacements(mechanism: Mechanism, pose: Any) -> Array:
    """The displacement of each link from the zero configuration, (links, 7); ``pose`` gives X_BL (4, 4) of a link."""
    return np.array([place(pose(name) @ inverse(link.pose)) for name, link in mechanism.links.items()])


def place(X: Array) -> Array:
    """Position and unit quaternion (x, y, z, w) of a pose X (4, 4), (7,)."""
    from scipy.spatial.transform import Rotation

    return np.concatenate([X[:3, 3], Rotation.from_matrix(X[:3, :3]).as_quat(canonical=True)])


def page_values(places: Array) -> list[list[float]]:
    """Places (links, 7) with the digits that the page is given."""
    return (np.round(places, PAGE_DIGITS) + 0.0).tolist()
