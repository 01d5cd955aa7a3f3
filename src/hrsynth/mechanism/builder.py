"""Builder of mechanisms in Python: points and axes at the zero configuration, in the base frame."""

from __future__ import annotations

from collections.abc import Container

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadMechanism
from ..geometry.vectors import Array, build_pose
from .model import Coupling, Joint, JointType, Link, Mechanism, Motor
from .observations.direction import Direction


def build(name: str) -> Builder:
    """Begin a robot in Python, from points and axes; as the families of the catalog are made.

    Parameters
    ----------
    name
        Name of the robot.

    Returns
    -------
    Builder
        Its methods ``link``, ``joint``, ``observe`` and ``coupling`` add to the robot; ``build(platform)`` returns it.

    Raises
    ------
    BadMechanism
        By these methods, for unknown and repeated names, types and axes.

    Notes
    -----
    Points and axes are those of the zero configuration, in the frame of the first link, the base (m).

    Examples
    --------
    >>> robot = hrsynth.build("pendulum")
    >>> robot.link("base")
    >>> robot.link("bob", at=(0, 0, -1))
    >>> robot.joint("hinge", "R", "base", "bob", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
    >>> robot.build(platform="bob")
    <Mechanism: pendulum, 2 links, 1 joints, 1 motors>
    """
    return Builder(name)


class Builder:
    """Collector of links and joints that builds the frozen mechanism. The first link is the base, its frame the
    world's."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._links: dict[str, Link] = {}
        self._joints: dict[str, Joint] = {}
        self._observations: list[Direction] = []
        self._couplings: list[Coupling] = []

    def link(self, name: str, at: ArrayLike = (0, 0, 0), rotation: ArrayLike | None = None) -> None:
        """Add a link whose frame's origin is ``at``, with the axes ``rotation`` (3, 3), at the zero configuration."""
        _require_new("link", name, self._links)
        R = None if rotation is None else _read_numbers(f"link {name!r}: rotation", rotation, (3, 3))
        self._links[name] = Link(name, build_pose(_read_numbers(f"link {name!r}: at", at), R))

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
        _require_new("joint", name, self._joints)
        try:
            kind = JointType(type)
        except ValueError:
            raise BadMechanism(f"joint {name!r}: type", type, tuple(JointType)) from None
        axes = tuple(_read_numbers(f"joint {name!r}: axis", a) for a in (axis, axis2) if a is not None)
        named = Motor(f"motor_{name}" if motor is True else str(motor)) if motor else None
        point = _read_numbers(f"joint {name!r}: at", at)
        self._joints[name] = Joint(name, kind, predecessor, successor, point, axes, motor=named, in_tree=not loop)

    def observe(self, leg: str, link: str, direction: ArrayLike) -> None:
        """Add an observed segment: ``direction`` in the base frame at the zero configuration."""
        if link not in self._links:
            raise BadMechanism(f"leg {leg!r}: unknown link", link, tuple(self._links))
        seen = _read_numbers(f"leg {leg!r}: direction", direction)
        self._observations.append(Direction(leg, link, self._links[link].pose[:3, :3].T @ seen))

    def coupling(self, name: str, driver: str, driven: str, ratio: float) -> None:
        """Add a coupling between the coordinates of two joints: the second is ``ratio`` times the first."""
        self._couplings.append(Coupling(name, driver, driven, ratio))

    def build(self, platform: str) -> Mechanism:
        """Return the frozen mechanism; the first link is the base."""
        return Mechanism.of(
            self.name,
            self._links.values(),
            self._joints.values(),
            platform=platform,
            observations=tuple(self._observations),
            couplings=tuple(self._couplings),
        )


def _require_new(kind: str, name: str, names: Container[str]) -> None:
    if name in names:
        raise BadMechanism(f"second {kind} of the same name", name, "a new name")


def _read_numbers(what: str, values: ArrayLike, shape: tuple[int, ...] = (3,)) -> Array:
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if numbers.shape != shape or not np.all(np.isfinite(numbers)):
        raise BadMechanism(what, values, f"{' × '.join(map(str, shape))} finite numbers")
    return numbers
