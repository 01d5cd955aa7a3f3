"""Exact rates of observations of all kinds: on the relative twist of two links, the wrenches that are transmitted when
the observation is held, at the points and directions of a rational instance; of an encoder its joint's own rate.

These wrenches are polynomials of the camera's centre C, the point B, the axis d and the camera's z axis, so their rank
is that of the measured rates wherever those are regular (docs/pages/observations.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Numbers, scale_to_whole
from ..mechanism import Direction, Mechanism, Observation
from ..mechanism.cameras import CameraObservation, ViewGeometry
from ..mechanism.incidences import Incidences
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.observations.encoder import AngleEncoder, Encoder

WRENCH_DEGREE_MAX = 4
"""No wrench of a kind has a larger degree in points and directions together, each counted as the largest of them."""

Place = tuple[str, tuple[float, ...]]
"""A point (m) or a direction in the frame of a link."""


@dataclass(frozen=True, eq=False)
class SensorPlaces:
    """Points and directions, fixed in links, on which observations depend besides joints, each once."""

    points: tuple[Place, ...]
    directions: tuple[Place, ...]

    @classmethod
    def of(cls, observations: Sequence[Observation], mechanism: Mechanism) -> SensorPlaces:
        """Return those of some observations."""
        points: dict[Place, None] = {}
        directions: dict[Place, None] = {}
        for each in observations:
            for point in _list_points(each, mechanism):
                points[point] = None
            for direction in _list_directions(each, mechanism):
                directions[direction] = None
        return cls(tuple(points), tuple(directions))

    def as_observed(self) -> list[Direction]:
        """Return the directions as if each were observed: so incidences find parallel ones."""
        return [Direction("", link, np.array(axis)) for link, axis in self.directions]


def has_exact_rates(seen: Observation) -> bool:
    """Return True if an observation has exact rates: all but a single edge of a cylinder, whose plane is irrational."""
    return isinstance(seen, SeenAxis | Encoder) or (isinstance(seen, CameraObservation) and seen.rational)


def build_view_geometry(
    seen: Observation,
    places: SensorPlaces,
    relations: Incidences,
    centres: Numbers,
    sights: Sequence[Numbers],
    mechanism: Mechanism,
    direction: Numbers | None,
) -> ViewGeometry | None:
    """Frames of camera and link of an observation at a rational instance; ``centres`` are rational, the ``sights`` the
    directions of ``places``, ``direction`` is that of an observed axis. None for an encoder."""
    from flint import fmpq

    nothing = np.array([fmpq(0)] * 3, dtype=object)
    if isinstance(seen, SeenAxis):
        assert direction is not None
        return ViewGeometry(nothing, nothing, nothing, np.array([fmpq(x) for x in direction], dtype=object))
    if not isinstance(seen, CameraObservation):
        return None
    B, C = (
        centres[relations.count - len(places.points) + places.points.index(point)]
        for point in _list_points(seen, mechanism)
    )
    axes = [sights[places.directions.index(axis)] for axis in _list_directions(seen, mechanism)]
    return ViewGeometry(C, axes[-1] if axes else nothing, B, axes[0] if seen.axis is not None else nothing)


def compute_observation_rates(
    seen: Observation,
    at: ViewGeometry | None,
    mechanism: Mechanism,
    velocities: Mapping[str, Numbers],
    columns: Mapping[str, slice],
) -> Numbers:
    """The rates of an observation for each joint's rate, whole numbers (rows, rates); ``columns`` are those of each
    joint."""
    total = next(iter(velocities.values())).shape[1]
    if isinstance(seen, Encoder):
        row = np.zeros((1, total), dtype=object)
        row[0, columns[seen.joint].start + _find_coordinate(seen, mechanism)] = 1
        return row
    assert isinstance(seen, CameraObservation)
    assert at is not None
    turn = velocities[seen.link] - velocities[seen.seen_from or mechanism.reference]
    return np.vstack([_scale_to_whole(wrench) @ turn for wrench in seen.wrenches(at)])


def _scale_to_whole(wrench: Numbers) -> Numbers:
    from flint import fmpq

    return scale_to_whole(np.array([fmpq(x) for x in wrench], dtype=object))[0]


def _find_coordinate(seen: Encoder, mechanism: Mechanism) -> int:
    """Return the index of an encoder's coordinate among those of its joint."""
    joint = mechanism.joints[seen.joint]
    if joint.type == "U":
        return int(seen.link != joint.successor)
    return int(isinstance(seen, AngleEncoder) and joint.type == "C")


def _list_points(seen: Observation, mechanism: Mechanism) -> tuple[Place, ...]:
    """B and C."""
    if not isinstance(seen, CameraObservation):
        return ()
    reference = seen.seen_from or mechanism.reference
    return (seen.link, tuple(seen.at.tolist())), (reference, tuple(seen.view[:3, 3].tolist()))


def _list_directions(seen: Observation, mechanism: Mechanism) -> tuple[Place, ...]:
    """d, where there is one; the camera's z axis, where the depth is measured."""
    if not isinstance(seen, CameraObservation):
        return ()
    own = () if seen.axis is None else ((seen.link, tuple(seen.axis.tolist())),)
    reference = seen.seen_from or mechanism.reference
    return (*own, *([(reference, tuple(seen.view[:3, 2].tolist()))] if seen.along_z else []))
