"""Formations: several bodies without joints between them, and the bearings and distances between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadRequest
from ..geometry.vectors import Array, freeze_array
from ..mechanism.builder import Builder
from ..mechanism.cameras import NamedCamera
from ..mechanism.model import Mechanism
from ..mechanism.observation import Observation
from ..mechanism.observations.distance import PointDistance
from ..mechanism.observations.point import ImagePoint

MOVES = {"free": "6", "yaw": "xyzR", "position": "xyz", "plane": "xyR", "plane position": "xy"}
"""The joints that carry a body from the ground, by what it can do: slides along the axes of the common frame, a turn
about its z axis, or a free joint."""


def build_formation(
    places: Sequence[ArrayLike],
    bearings: Iterable[tuple[int, int]] = (),
    distances: Iterable[tuple[int, int]] = (),
    *,
    bodies: str = "free",
    turns: Sequence[Array] | None = None,
    frame: Array | None = None,
    name: str = "formation",
) -> Mechanism:
    """Bodies b1, b2 … with their frames at ``places`` (n, 3), metres, each with a camera there.

    A bearing (i, j) is the direction of body j in the camera's frame on body i, counted from 1; a distance is that of
    their origins. ``bodies`` gives the motion of each (:data:`MOVES`); ``turns`` (n, 3, 3) are their orientations at
    zero, ``frame`` (3, 3) that of the common frame. Raises ``BadRequest``.

    >>> square = formation([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)], [(1, 2), (2, 3), (3, 4), (4, 1)])
    >>> square.bodies
    ('b1', 'b2', 'b3', 'b4')
    """
    if bodies not in MOVES:
        raise BadRequest("motion of the bodies of a formation", bodies, ", ".join(MOVES))
    count, axes = len(places), np.eye(3) if frame is None else np.asarray(frame, dtype=float)
    builder = Builder(name)
    builder.link("ground")
    cameras = {i: NamedCamera(f"c{i}", f"b{i}") for i in range(1, count + 1)}
    for i, place in enumerate(places, 1):
        before, steps = "ground", MOVES[bodies]
        for number, step in enumerate(steps, 1):
            link = f"b{i}" if number == len(steps) else f"b{i}_{step}"
            builder.link(link, place, axes if turns is None else turns[i - 1])
            axis = None if step == "6" else axes[:, 2] if step == "R" else axes[:, "xyz".index(step)]
            builder.joint(f"{step}{i}", step if step in "6R" else "P", before, link, place, axis=axis)
            before = link
    seen: list[Observation] = []
    for kind, mark, pairs in ((ImagePoint, "", bearings), (PointDistance, "d", distances)):
        for i, j in pairs:
            if i == j or not {i, j} <= cameras.keys():
                raise BadRequest("a pair of bodies", (i, j), f"two of 1 to {count}")
            seen.append(kind(f"{mark}{i}-{j}", f"b{j}", at=freeze_array(np.zeros(3)), camera=cameras[i]))
    made = builder.build(platform="b1")
    return replace(made, observations=tuple(seen), cameras=tuple(cameras.values()), formation=True)
