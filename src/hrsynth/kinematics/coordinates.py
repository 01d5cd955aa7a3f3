"""Coordinates of a platform, as many as its dof, and the poses that are reached by changing one of them.

Components of its position in base axes, and its rotation since the zero configuration: the angle if it rotates about
one axis only, else components of the rotation vector.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..geometry.screws import compute_point_velocity
from ..geometry.so3 import compute_rotation_vector_rate, convert_rotations_to_vectors, turn_about, wrap_angle
from ..geometry.vectors import Array
from ..results import Value
from .configuration import ClosedConfiguration
from .continuation import track
from .pinocchio_model import PinocchioModel
from .platform_motion import PlatformMotion
from .velocity_relation import ObservationModel, compute_relation

SLIDER_SPAN_MIN_FRACTION = 1e-3
"""Fraction of its span below which the travel of a slider of the view counts as zero."""
SLIDER_RANGE_FRACTION = 0.98
"""Fraction of the travel of a slider of the view that is used."""

NAMES = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
COORDINATE_INDEPENDENCE_FRACTION = 0.5
"""Least independence of the coordinates (the smallest singular value of their rates), as part of that of the most
independent ones."""


@dataclass(frozen=True, eq=False, repr=False)
class Coordinates(Value):
    """Coordinates of a platform, by their indices among :data:`TABLE_NAME_COLUMNS_MAX`, as a task: ``values`` (n,) in
    metres, radians."""

    motion: PlatformMotion
    places: tuple[int, ...]
    values: Array

    @classmethod
    def of(cls, start: ClosedConfiguration, observation_model: ObservationModel, motion: PlatformMotion) -> Coordinates:
        """Return the coordinates that distinguish a configuration from its neighbours best, positions before rotations;
        if its dof differ from the generic ones, those of the generic motion."""
        twists = compute_relation(start, observation_model.of_platform).twists
        if twists.shape[1] != motion.dof:
            twists = motion.twists
        if motion.has_one_rotation:
            twists = np.vstack([twists[:3], motion.normal @ twists[3:]])
        rows = twists if motion.body else twists[:3]
        size = min(motion.dof, len(rows))
        sets = list(combinations(range(len(rows)), size))
        weakest = np.array([np.linalg.svd(rows[list(each)], compute_uv=False)[:size].min(initial=1.0) for each in sets])
        chosen = sets[int(np.argmax(weakest >= COORDINATE_INDEPENDENCE_FRACTION * weakest.max()))]
        made = cls(motion, chosen, np.zeros(len(chosen)))
        return replace(made, values=made.read(start.pose(motion.link)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        names = (*NAMES[:3], "phi") if self.motion.has_one_rotation else NAMES
        return tuple(names[place] for place in self.places)

    def read(self, X: Array) -> Array:
        """Return the coordinates (n,) of a platform pose X (4, 4)."""
        return np.concatenate([self.motion.position(X), self._turn(X)[0]])[list(self.places)]

    def apart(self, X: Array) -> Array:
        """Return the difference of a platform pose X (4, 4) from the coordinates (n,), metres, radians; a rotation
        about one axis modulo 2π."""
        found = self.read(X) - self.values
        if self.motion.has_one_rotation:
            found = np.array([wrap_angle(x) if place == 3 else x for x, place in zip(found, self.places, strict=True)])
        return found

    def _turn(self, X: Array) -> tuple[Array, Array]:
        """Return the rotation since the zero configuration, and the map from the angular velocity to its rate."""
        R = X[:3, :3] @ self.motion.home[:3, :3].T
        if self.motion.has_one_rotation:
            angle, row = turn_about(self.motion.normal, R)
            return np.array([angle]), row[None]
        turn = convert_rotations_to_vectors(R)
        return turn, compute_rotation_vector_rate(turn)

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) in characteristic lengths and radians, and its Jacobian."""
        frames, velocities = model.frames(q, (self.motion.link,))
        X, V = frames[0], velocities[0]
        J = np.vstack(
            [compute_point_velocity(V, X[:3, :3] @ self.motion.point / model.length), self._turn(X)[1] @ V[3:]]
        )
        scale = np.where(np.array(self.places) < 3, model.length, 1.0)
        return self.apart(X) / scale, J[list(self.places)]

    def towards(self, X: Array, fraction: float) -> Coordinates:
        """Return the coordinates at ``fraction`` of the path from the pose X (4, 4) to these."""
        return replace(self, values=self.values + (1 - fraction) * self.apart(X))

    def along(
        self, start: ClosedConfiguration, index: int, spans: tuple[float, float], count: int
    ) -> tuple[tuple[float, ClosedConfiguration], ...]:
        """Return closed configurations as one coordinate alone changes from ``start``, in the order of its values:
        ``count`` on each side, equally spaced as far as small steps lead within ``spans`` (metres, radians)."""
        down, up = (list(self._out(start, index, way, count)) for way in (-spans[0], spans[1]))
        return (*reversed(down), (float(self.values[index]), start), *up)

    def ends(
        self, start: ClosedConfiguration, index: int, spans: tuple[float, float]
    ) -> tuple[ClosedConfiguration, ClosedConfiguration]:
        """Return the last configurations as one coordinate alone goes down and up from ``start``, within ``spans``."""
        down, up = (
            track(start, self.motion, self._change(index, self.values[index] + span))[0]
            for span in (-spans[0], spans[1])
        )
        return down, up

    def _out(
        self, start: ClosedConfiguration, index: int, span: float, count: int
    ) -> Iterator[tuple[float, ClosedConfiguration]]:
        end = self._change(index, self.values[index] + span)
        came = track(start, self.motion, end)[1] if span else 0.0
        if came < 1:
            came *= SLIDER_RANGE_FRACTION
        here = start
        for step in range(1, count + 1) if came > SLIDER_SPAN_MIN_FRACTION else ():
            aim = self._change(index, self.values[index] + came * span * step / count)
            here, arrived = track(here, self.motion, aim)
            if arrived < 1:
                return
            yield float(aim.values[index]), here

    def _change(self, index: int, value: float) -> Coordinates:
        values = self.values.copy()
        values[index] = value
        return replace(self, values=values)
