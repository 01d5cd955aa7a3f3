"""Tasks: what a configuration is to reach besides closed loops, each an error with its Jacobian; one solver for all.

Lengths are in characteristic lengths, so that errors of positions and of turns mix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..geometry.gauss_newton import Damping, Residual, descend
from ..geometry.screws import point_velocity
from ..geometry.so3 import logarithm
from ..geometry.vectors import Array
from ..mechanism.observation import Observation
from ..results import Value
from ..tolerances import CLOSED
from .configuration import measure
from .pinocchio_model import PinocchioModel

DAMPING = Damping(start=1.0, eased=0.1, least=0.1, most=1e8)
"""Of loops and tasks, as a multiple of the squared residual."""


class Task(Protocol):
    """What a configuration is to reach besides closed loops."""

    def rows(self, twin: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) and its Jacobian."""


class GuidedTask(Task, Protocol):
    """A task to which a platform can be led along a way."""

    def towards(self, X: Array, fraction: float) -> GuidedTask:
        """What lies ``fraction`` of the way from the pose X (4, 4) to it."""


@dataclass(frozen=True, eq=False, repr=False)
class Held(Value):
    """Measured values that are to stay as they are, seen from ``reference`` where an observation names no link."""

    reference: str
    measured: tuple[tuple[Observation, Array], ...]

    @classmethod
    def at(cls, twin: PinocchioModel, q: Array, reference: str, observations: Sequence[Observation]) -> Held:
        """As they are at a configuration."""
        values = measure(twin, q, reference, observations)[2] if observations else []
        return cls(reference, tuple(zip(observations, values, strict=True)))

    def rows(self, twin: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) and its Jacobian."""
        if not self.measured:
            return np.zeros(0), np.zeros((0, twin.nv))
        _, _, values, rates = measure(twin, q, self.reference, [o for o, _ in self.measured])
        errors = [o.apart(value, wanted) for value, (o, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.concatenate(rates)


@dataclass(frozen=True, eq=False, repr=False)
class Target(Value):
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
            blocks = [point_velocity(V, X[:3, :3] @ self.point / twin.length)]
        else:
            errors = [(X[:3, 3] - self.pose[:3, 3]) / twin.length, logarithm(X[:3, :3] @ self.pose[:3, :3].T)]
            blocks = [V]
        errors += [o.apart(value, wanted) for value, (o, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.concatenate([*blocks, *rates])


@dataclass(frozen=True, eq=False)
class LinkPoses:
    """Poses (4, 4) wanted of several links, and what else is wanted besides."""

    wanted: tuple[tuple[str, Array], ...]
    besides: Task | None = None

    def rows(self, twin: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error (reached − wanted) and its Jacobian."""
        parts = [Target(link, X, None, twin.mechanism.base, ()).rows(twin, q) for link, X in self.wanted]
        parts += [] if self.besides is None else [self.besides.rows(twin, q)]
        return np.concatenate([error for error, _ in parts]), np.vstack([rows for _, rows in parts])


def solve(twin: PinocchioModel, q: Array, task: Task | None = None, *, tolerance: float = CLOSED,
          iterations: int = 30) -> tuple[Array, float]:
    """The configuration that damped Gauss-Newton reaches from ``q``, and the residual left (loops and task).

    The damping is the square of the residual: off closure a redundant or idle direction has singular values of the
    residual's own size, which must not be followed; near closure the convergence stays fast.
    """
    def advance(q: Array, at: Residual, factor: float) -> Array:
        normal = at.J.T @ at.J
        normal.reshape(-1)[:: twin.nv + 1] += max(factor * at.size**2, 1e-14)
        wanted = -(at.J.T @ at.error)
        try:
            step: Array = np.asarray(np.linalg.solve(normal, wanted), dtype=float)
        except np.linalg.LinAlgError:  # singular but for rounding, beside which the least damping is nothing
            step = np.asarray(np.linalg.lstsq(normal, wanted)[0], dtype=float)
        return twin.moved(q, shortened(step, 0.5))

    q, left = descend(q, lambda q: system(twin, q, task), advance, DAMPING, iterations,
                      lambda at: at.size <= tolerance)
    return q, left.size


def shortened(step: Array, longest: float) -> Array:
    """A step (nv,), shortened where a coordinate would change by more than ``longest``."""
    largest = float(np.abs(step).max(initial=0.0))
    return step * (longest / largest) if largest > longest else step


def system(twin: PinocchioModel, q: Array, task: Task | None) -> tuple[Array, Array]:
    """Error and Jacobian of the loops and, below them, of the task."""
    error, J = twin.residual(q), twin.jacobian(q)
    if task is None:
        return error, J
    extra, rows = task.rows(twin, q)
    return np.concatenate([error, extra]), np.concatenate([J, rows])
