"""Builder of mechanisms in Python: points and axes at the zero configuration, in the base frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import build_pose
from .model import Coupling, Joint, JointType, Link, Mechanism, Motor
from .observations.direction import Direction


class Builder:
    """Collector of links and joints that builds the frozen mechanism. The first link is the base, its frame the
    world's.

    >>> b = Builder("pendulum"); b.link("base"); b.link("bob", at=(0, 0, -1))
    >>> b.joint("hinge", "R", "base", "bob", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
    >>> b.build(platform="bob").joints["hinge"].is_actuated
    True
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._links: list[Link] = []
        self._joints: list[Joint] = []
        self._observations: list[Direction] = []
        self._couplings: list[Coupling] = []

    def link(self, name: str, at: ArrayLike = (0, 0, 0), rotation: ArrayLike | None = None) -> None:
        """Add a link whose frame's origin is ``at``, with the axes ``rotation`` (3, 3), at the zero configuration."""
        self._links.append(Link(name, build_pose(at, rotation)))

    def joint(
        self,
        name: str,
        type: str,
        predecessor: str,
        successor: str,
        at: ArrayLike = (0, 0, 0),
        *,
        axis: ArrayLike | None = None,
        axis2: ArrayLike | None = None,
        motor: bool | str = False,
        loop: bool = False,
    ) -> None:
        """Add a joint of type R, P, U, S, C, E (planar) or F with its centre ``at``; ``motor`` names its transmission
        (True: ``motor_NAME``); ``loop``: a file writes it as a loop instead of a tree joint."""
        axes = tuple(np.asarray(a, dtype=float) for a in (axis, axis2) if a is not None)
        named = Motor(f"motor_{name}" if motor is True else str(motor)) if motor else None
        self._joints.append(
            Joint(
                name,
                JointType(type),
                predecessor,
                successor,
                np.asarray(at, dtype=float),
                axes,
                motor=named,
                in_tree=not loop,
            )
        )

    def observe(self, leg: str, link: str, direction: ArrayLike) -> None:
        """Add an observed segment: ``direction`` in the base frame at the zero configuration."""
        frame = next(each for each in self._links if each.name == link).pose
        self._observations.append(Direction(leg, link, frame[:3, :3].T @ np.asarray(direction, dtype=float)))

    def coupling(self, name: str, predecessor: str, successor: str, ratio: float) -> None:
        """Add a coupling between the coordinates of the two joints that carry these links."""
        self._couplings.append(Coupling(name, predecessor, successor, ratio))

    def build(self, platform: str) -> Mechanism:
        """Return the frozen mechanism; the first link is the base."""
        return Mechanism.of(
            self.name,
            self._links,
            self._joints,
            platform=platform,
            observations=tuple(self._observations),
            couplings=tuple(self._couplings),
        )
