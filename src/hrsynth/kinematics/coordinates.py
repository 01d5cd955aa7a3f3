"""As many coordinates of a platform as it has freedoms, and what can be reached by changing one of them.

Components of its position, and of the rotation vector of its turn since the zero configuration, in base axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..mechanism.vectors import Array, hat
from .configuration import ClosedConfiguration, point_velocity
from .parts import PlatformMotion, rotation_vector
from .relation import Question, relation
from .steps import led
from .twin import Twin

NAMES = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
INDEPENDENT = 0.1
"""Part of a coordinate's rate that those before it must leave free."""
SHORT = 0.98
"""Part of the way to where a slider stops that is used: the edge of the workspace is left out."""
NOTHING = 1e-3
"""Ways shorter than this part of the span count as none."""
HALVINGS = 4
"""How often a step is halved before a slider stops."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of a platform, by their places among :data:`NAMES`, as an aim: ``values`` (n,) in metres, radians."""

    motion: PlatformMotion
    places: tuple[int, ...]
    values: Array

    @classmethod
    def of(cls, start: ClosedConfiguration, question: Question, motion: PlatformMotion) -> Coordinates:
        """Those of a configuration that tell its neighbours apart, positions before turns; where it has other freedoms
        than the platform generically has, those of the generic motion."""
        twists = relation(start, replace(question, observations=(), bodies=())).twists
        if twists.shape[1] != motion.dof:
            twists = motion.twists
        chosen: list[int] = []
        for place in range(len(twists) if motion.body else 3):
            before = twists[chosen]
            rest = twists[place] - np.linalg.pinv(before) @ (before @ twists[place]) if chosen else twists[place]
            if np.linalg.norm(rest) > INDEPENDENT and len(chosen) < motion.dof:
                chosen.append(place)
        made = cls(motion, tuple(chosen), np.zeros(len(chosen)))
        return replace(made, values=made.read(start.pose(motion.link)))

    @property
    def names(self) -> tuple[str, ...]:
        """What the coordinates are called."""
        return tuple(NAMES[place] for place in self.places)

    def read(self, X: Array) -> Array:
        """The coordinates (n,) of a platform pose X (4, 4)."""
        turn = rotation_vector(X[:3, :3] @ self.motion.home[:3, :3].T)
        return np.concatenate([self.motion.position(X), turn])[list(self.places)]

    def rows(self, twin: Twin, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) in characteristic lengths and radians, and its Jacobian."""
        frames, velocities = twin.frames(q, (self.motion.link,))
        X, V = frames[0], velocities[0]
        J = np.vstack([point_velocity(V, X, self.motion.point, twin.length),
                       _rate(rotation_vector(X[:3, :3] @ self.motion.home[:3, :3].T)) @ V[3:]])
        scale = np.where(np.array(self.places) < 3, twin.length, 1.0)
        return (self.read(X) - self.values) / scale, J[list(self.places)]

    def towards(self, X: Array, fraction: float) -> Coordinates:
        """The coordinates that lie ``fraction`` of the way from the pose X (4, 4) to these."""
        here = self.read(X)
        return replace(self, values=here + fraction * (self.values - here))

    def along(self, start: ClosedConfiguration, index: int, spans: tuple[float, float], count: int
              ) -> tuple[tuple[float, ClosedConfiguration], ...]:
        """Closed configurations as one coordinate alone changes from ``start``, in the order of its values: ``count``
        on each side, equally spaced as far as small steps lead within ``spans`` (metres, radians)."""
        down, up = (list(self._out(start, index, way, count)) for way in (-spans[0], spans[1]))
        return (*reversed(down), (float(self.values[index]), start), *up)

    def _out(self, start: ClosedConfiguration, index: int, span: float, count: int
             ) -> Iterator[tuple[float, ClosedConfiguration]]:
        end = self._changed(index, self.values[index] + span)
        came = led(start, self.motion, end, HALVINGS)[1] if span else 0.0
        if came < 1:
            came *= SHORT
        here = start
        for step in range(1, count + 1) if came > NOTHING else ():
            aim = self._changed(index, self.values[index] + came * span * step / count)
            here, arrived = led(here, self.motion, aim, HALVINGS)
            if arrived < 1:
                return
            yield float(aim.values[index]), here

    def _changed(self, index: int, value: float) -> Coordinates:
        values = self.values.copy()
        values[index] = value
        return replace(self, values=values)


def _rate(vector: Array) -> Array:
    """The map (3, 3) from the angular velocity to the rate of the rotation vector."""
    angle, K = float(np.linalg.norm(vector)), hat(vector)
    factor = 1 / 12 if angle < 1e-4 else 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    return np.asarray(np.eye(3) - 0.5 * K + factor * K @ K)
