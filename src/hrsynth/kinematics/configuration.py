"""Closed configurations: a type that exists only if its loops are closed.

Solved by damped Gauss-Newton from a nearby configuration; targets (a platform pose, measured values) are solved along
with the loops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np

from ..errors import LoopsNotClosed
from ..geometry.ranks import Rank, Spectrum, spectrum
from ..geometry.so3 import logarithm
from ..geometry.vectors import Array, frozen, hat
from ..mechanism.observation import Observation
from ..tolerances import CLOSED
from .pinocchio_model import PinocchioModel


@dataclass(frozen=True, eq=False)
class ClosedConfiguration:
    """A configuration of a twin whose loops are closed to ``tolerances.CLOSED``; ``q`` is read-only."""

    twin: PinocchioModel
    q: Array
    residual: float

    @classmethod
    def of(cls, twin: PinocchioModel, q: Array, tolerance: float = CLOSED) -> ClosedConfiguration:
        """``q`` itself, if it is closed; raises ``LoopsNotClosed`` with the loop that misses most."""
        q = frozen(q)
        residual = float(np.linalg.norm(twin.residual(q)))
        if not residual <= tolerance:
            raise LoopsNotClosed(twin.mechanism.name, residual, tolerance, twin.worst_loop(q)[0])
        return cls(twin, q, residual)

    def pose(self, link: str) -> Array:
        """X_BL (4, 4), metres."""
        return self.twin.pose(self.q, link)

    def velocity(self, link: str) -> Array:
        """V (6, nv) of a link's frame, see :meth:`PinocchioModel.velocity`."""
        return self.twin.velocity(self.q, link)

    @cached_property
    def loops(self) -> Spectrum:
        """The constraints' Jacobian taken apart."""
        return spectrum(self.twin.jacobian(self.q))

    def kernel(self) -> tuple[Array, Rank]:
        """A basis of T_qC, shape (nv, mobility), and the constraints' rank."""
        return self.loops.kernel, self.loops.rank

    @property
    def strengths(self) -> Array:
        """The singular values of the constraints that count, descending, (rank,)."""
        return self.loops.values


class Wanted(Protocol):
    """What a configuration is to reach besides closed loops."""

    def rows(self, twin: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) and its Jacobian."""


class Aim(Wanted, Protocol):
    """What a platform is led to along a way."""

    def towards(self, X: Array, fraction: float) -> Aim:
        """What lies ``fraction`` of the way from the pose X (4, 4) to it."""


@dataclass(frozen=True, eq=False)
class Target:
    """What a configuration is to reach besides closed loops: the pose X_BP of ``link`` (only the position of ``point``,
    given in the link's frame, where there is one), and measured values."""

    link: str
    pose: Array
    point: Array | None
    reference: str
    measured: tuple[tuple[Observation, Array], ...]

    def rows(self, twin: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) and its Jacobian."""
        observations = tuple(o for o, _ in self.measured)
        frames, velocities, values, rates = measure(twin, q, self.reference, observations, (self.link,))
        X, V = frames[0], velocities[0]
        if self.point is not None:
            errors = [(X[:3, :3] @ self.point + X[:3, 3] - self.pose[:3, :3] @ self.point - self.pose[:3, 3])
                      / twin.length]
            blocks = [point_velocity(V, X, self.point, twin.length)]
        else:
            errors = [(X[:3, 3] - self.pose[:3, 3]) / twin.length, logarithm(X[:3, :3] @ self.pose[:3, :3].T)]
            blocks = [V]
        errors += [o.apart(value, wanted) for value, (o, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.concatenate([*blocks, *rates])


def measure(twin: PinocchioModel, q: Array, reference: str, observations: Sequence[Observation],
            links: Sequence[str] = ()) -> tuple[Array, Array, list[Array], list[Array]]:
    """Poses (k, 4, 4) and velocities (k, 6, nv) of ``links``; the value (size,) and the rates (size, nv) of each
    observation, seen from ``reference`` where it names no link of its own, lengths in characteristic lengths."""
    names, groups = _grouped(reference, tuple(observations), tuple(links))
    X, V = twin.frames(q, names)
    metric = V.copy()
    metric[:, :3] *= twin.length
    values: list[Array] = [np.zeros(0)] * len(observations)
    rates: list[Array] = [np.zeros((0, twin.nv))] * len(observations)
    for group in groups:
        kind, view, at = group.kind, group.view, group.at
        found, moving = kind.together(group.observations, X[view], X[at], metric[view], metric[at])
        unit = twin.length**kind.dimension
        if unit != 1.0:
            found, moving = found / unit, moving / unit
        for number, i in enumerate(group.members):
            rows = slice(number * kind.size, (number + 1) * kind.size)
            values[i], rates[i] = found[rows], moving[rows]
    return X[: len(links)], V[: len(links)], values, rates


@dataclass(frozen=True, eq=False)
class _Group:
    """Observations of one kind, seen from one link: their places among all, the places of the links."""

    kind: type[Observation]
    view: int
    members: list[int]
    observations: list[Observation]
    at: list[int]


@lru_cache(maxsize=512)
def _grouped(reference: str, observations: tuple[Observation, ...], links: tuple[str, ...]
             ) -> tuple[tuple[str, ...], list[_Group]]:
    """All links that matter, ``links`` first, and the observations that are evaluated together."""
    seen = [o.seen_from or reference for o in observations]
    names = (*links, *dict.fromkeys(name for name in (*seen, *(o.link for o in observations)) if name not in links))
    place = {name: i for i, name in enumerate(names)}
    groups = []
    for kind, view in dict.fromkeys((type(o), name) for o, name in zip(observations, seen, strict=True)):
        members = [i for i, o in enumerate(observations) if (type(o), seen[i]) == (kind, view)]
        chosen = [observations[i] for i in members]
        groups.append(_Group(kind, place[view], members, chosen, [place[o.link] for o in chosen]))
    return names, groups


def point_velocity(V: Array, X: Array, point: Array, length: float) -> Array:
    """The linear rows of V moved from a link frame's origin to ``point`` (3,) in that frame; X is the link's pose."""
    return V[:3] - hat(X[:3, :3] @ point / length) @ V[3:]


def closed(twin: PinocchioModel, q: Array, target: Wanted | None = None, *, tolerance: float = CLOSED,
           iterations: int = 30) -> tuple[Array, float]:
    """Damped Gauss-Newton from ``q``: the configuration reached and the residual left (loops and target).

    The damping is the square of the residual: off closure a redundant or idle direction has singular values of the
    residual's own size, which must not be followed; near closure the convergence stays fast.
    """
    error, J = system(twin, q, target)
    size = math.sqrt(error @ error)
    factor = 1.0
    for _ in range(iterations):
        if size <= tolerance or factor > 1e8:
            break
        normal = J.T @ J
        normal.flat[:: twin.nv + 1] += max(factor * size**2, 1e-14)
        step: Array = np.asarray(np.linalg.solve(normal, -(J.T @ error)), dtype=float)
        trial = twin.moved(q, limited(step, 0.5))
        trial_error, trial_J = system(twin, trial, target)
        trial_size = math.sqrt(trial_error @ trial_error)
        if trial_size < size:
            q, error, J, size = trial, trial_error, trial_J, trial_size
            factor = max(0.1 * factor, 0.1)
        else:
            factor *= 10.0
    return q, size


def limited(step: Array, longest: float) -> Array:
    """A step (nv,), shortened where a coordinate would change by more than ``longest``."""
    largest = float(np.abs(step).max(initial=0.0))
    return step * (longest / largest) if largest > longest else step


def system(twin: PinocchioModel, q: Array, target: Wanted | None) -> tuple[Array, Array]:
    """Error and Jacobian of the loops and, below them, of the target."""
    error, J = twin.residual(q), twin.jacobian(q)
    if target is None:
        return error, J
    extra, rows = target.rows(twin, q)
    return np.concatenate([error, extra]), np.concatenate([J, rows])
