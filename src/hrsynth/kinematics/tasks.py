"""Tasks: goals of a configuration besides closed loops, each an error with its Jacobian; one solver for all.

Lengths are in characteristic lengths, so that errors of positions and of rotations mix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from ..geometry.screws import compute_point_velocity
from ..geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ..geometry.vectors import Array, times
from ..mechanism.observation import Observation
from ..results import Value
from ..solving.gauss_newton import DampingFactor, Residual, descend, descend_together
from ..solving.newton import solve_squares
from ..tolerances import CLOSURE_RESIDUAL_TOL
from .configuration import measure, measure_together
from .pinocchio_model import PinocchioModel

DAMPING = DampingFactor(start=1.0, eased=0.1, least=0.1, most=1e8)
"""Of loops and tasks, as a multiple of the squared residual."""


class Task(Protocol):
    """Goal of a configuration besides closed loops."""

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""


class GuidedTask(Task, Protocol):
    """Task to which a platform can be led along a path."""

    def towards(self, X: Array, fraction: float) -> GuidedTask:
        """Return the task at ``fraction`` of the path from the pose X (4, 4) to it."""


@dataclass(frozen=True, eq=False, repr=False)
class FixedValuesTask(Value):
    """Fixed measured values, from ``reference`` if an observation names no link."""

    reference: str
    measured: tuple[tuple[Observation, Array], ...]

    @classmethod
    def at(
        cls, model: PinocchioModel, q: Array, reference: str, observations: Sequence[Observation]
    ) -> FixedValuesTask:
        """Return the task with the values at a configuration."""
        values = measure(model, q, reference, observations)[2] if observations else []
        return cls(reference, tuple(zip(observations, values, strict=True)))

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""
        if not self.measured:
            return np.zeros(0), np.zeros((0, model.nv))
        _, _, values, rates = measure(model, q, self.reference, [o for o, _ in self.measured])
        errors = [o.difference(value, wanted) for value, (o, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.concatenate(rates)


@dataclass(frozen=True, eq=False, repr=False)
class PoseAndValuesTask(Value):
    """Goal of a configuration besides closed loops: the pose X_BP of ``link`` (only the position of ``point``, given in
    the link's frame, if there is one), and measured values."""

    link: str
    pose: Array
    point: Array | None
    reference: str
    measured: tuple[tuple[Observation, Array], ...]

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""
        observations = tuple(o for o, _ in self.measured)
        frames, velocities, values, rates = measure(model, q, self.reference, observations, (self.link,))
        X, V = frames[0], velocities[0]
        block = V if self.point is None else compute_point_velocity(V, X[:3, :3] @ self.point / model.length)
        apart = (o.difference(value, wanted) for value, (o, wanted) in zip(values, self.measured, strict=True))
        (missed,) = self.misses([self], X[None], model.length)
        return np.concatenate([missed, *apart]), np.concatenate([block, *rates])

    def of(self, chosen: Callable[[Observation], bool]) -> PoseAndValuesTask:
        """Return the same pose, with some of the measured values."""
        return replace(self, measured=tuple(pair for pair in self.measured if chosen(pair[0])))

    def between(self, other: PoseAndValuesTask, fraction: float) -> PoseAndValuesTask:
        """Return the target at ``fraction`` of the path from this one to another of the same kind, all values in
        proportion."""
        if fraction == 1:
            return other
        pose = other.pose.copy()
        pose[:3, :3] = (
            convert_vectors_to_rotations(
                fraction * convert_rotations_to_vectors(other.pose[:3, :3] @ self.pose[:3, :3].T)
            )
            @ self.pose[:3, :3]
        )
        pose[:3, 3] = (1 - fraction) * self.pose[:3, 3] + fraction * other.pose[:3, 3]
        return replace(
            self,
            pose=pose,
            measured=tuple(
                (o, (1 - fraction) * one + fraction * two)
                for (o, one), (_, two) in zip(self.measured, other.measured, strict=True)
            ),
        )

    @cached_property
    def wanted(self) -> Array:
        """Desired measured values (size,)."""
        return np.concatenate([np.zeros(0), *(value for _, value in self.measured)])

    @staticmethod
    def misses(targets: Sequence[PoseAndValuesTask], X: Array, length: float) -> Array:
        """Return the differences of poses X (n, 4, 4) from those of targets of one kind, or of their points:
        characteristic lengths, radians (n, 6 or 3)."""
        wanted, point = np.array([target.pose for target in targets]), targets[0].point
        if point is not None:
            return (
                np.array(
                    [
                        x[:3, :3] @ point + x[:3, 3] - w[:3, :3] @ point - w[:3, 3]
                        for x, w in zip(X, wanted, strict=True)
                    ]
                )
                / length
            )
        return compute_pose_errors(X, wanted, length)


def compute_pose_errors(X: Array, wanted: Array, length: float) -> Array:
    """Return the differences of poses (n, 4, 4) from the desired ones, shifts (lengths) and rotations, (n, 6)."""
    turns = X[:, :3, :3] @ wanted[:, :3, :3].swapaxes(1, 2)
    return np.concatenate(
        [(X[:, :3, 3] - wanted[:, :3, 3]) / length, [convert_rotations_to_vectors(R) for R in turns]], axis=1
    )


@dataclass(frozen=True, eq=False)
class LinkPoses:
    """Desired poses (4, 4) of several links, and a further task."""

    wanted: tuple[tuple[str, Array], ...]
    besides: Task | None = None

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""
        reached, velocities = model.frames(q, tuple(link for link, _ in self.wanted))
        missed = compute_pose_errors(reached, np.array([X for _, X in self.wanted]), model.length).ravel()
        error, rows = (
            ([], []) if self.besides is None else ([each] for each in self.besides.error_and_jacobian(model, q))
        )
        return np.concatenate([missed, *error]), np.vstack([*velocities, *rows])


def solve(
    model: PinocchioModel,
    q: Array,
    task: Task | None = None,
    *,
    tolerance: float = CLOSURE_RESIDUAL_TOL,
    iterations: int = 30,
) -> tuple[Array, float]:
    """Return the configuration that damped Gauss-Newton reaches from ``q``, and the residual left (loops and task).

    The damping is the square of the residual: off closure a redundant or internal direction has singular values of the
    residual's own size, which must not be followed; near closure the convergence stays fast.
    """

    def advance(q: Array, at: Residual, factor: float) -> Array:
        normal = at.J.T @ at.J
        normal.reshape(-1)[:: model.nv + 1] += max(factor * at.size**2, 1e-14)
        return model.integrate(q, shorten_step(solve_squares(normal, -(at.J.T @ at.error)), 0.5))

    q, left = descend(
        q, lambda q: stack_task(model, q, task), advance, DAMPING, iterations, lambda at: at.size <= tolerance
    )
    return q, left.size


def solve_together(
    places: TaskBatch,
    starts: Sequence[Array],
    targets: Sequence[PoseAndValuesTask | None],
    *,
    tolerance: float = CLOSURE_RESIDUAL_TOL,
    iterations: int = 30,
) -> list[tuple[Array, float]]:
    """As :func:`solve`, from several configurations in step, each to its own target: the same answers."""
    model = places.twin

    def evaluate(at: Mapping[int, Array]) -> Iterable[tuple[Array, Array]]:
        return places.at(list(at.values()), [targets[i] for i in at])

    def advance(going: Mapping[int, tuple[Array, Residual, float]]) -> dict[int, Array | None]:
        J = np.array([at.J for _, at, _ in going.values()])
        errors = np.array([at.error for _, at, _ in going.values()])
        normal = J.swapaxes(1, 2) @ J
        damping = [max(factor * at.size**2, 1e-14) for _, at, factor in going.values()]
        normal.reshape(len(J), -1)[:, :: model.nv + 1] += np.array(damping)[:, None]
        steps = solve_squares(normal, -times(J.swapaxes(1, 2), errors))
        longest = np.abs(steps).max(axis=1, initial=0.0).tolist()
        return {
            i: model.integrate(q, step if size <= 0.5 else shorten_step(step, 0.5))
            for (i, (q, _, _)), step, size in zip(going.items(), steps, longest, strict=True)
        }

    return [
        (q, left.size)
        for q, left in descend_together(starts, evaluate, advance, DAMPING, iterations, lambda at: at.size <= tolerance)
    ]


class TaskBatch:
    """Errors and Jacobians of the loops and of targets of one kind, at several configurations at once; values at a
    reached target are reused for the next one."""

    def __init__(self, model: PinocchioModel, like: PoseAndValuesTask | None) -> None:
        self.twin, self.like = model, like
        self.links = () if like is None else (like.link,)
        self.observations = () if like is None else tuple(o for o, _ in like.measured)
        self.plain = all(type(o).difference is Observation.difference for o in self.observations)
        self.known: dict[int, tuple[Array, tuple[Array, ...], int]] = {}

    def at(self, places: Sequence[Array], targets: Sequence[PoseAndValuesTask | None]) -> Iterable[tuple[Array, Array]]:
        """Error (rows,) and Jacobian (rows, nv) at each configuration, for its target."""
        if all(id(q) in self.known for q in places):
            known = [self.known[id(q)] for q in places]
            loops, J, X, values = (np.array([stack[part][i] for _, stack, i in known]) for part in range(4))
            self.known = {id(each[0]): each for each in known}
        else:
            stack = loops, J, X, values = self._measure(places)
            self.known |= {id(q): (q, stack, i) for i, q in enumerate(places)}
        goals = [target for target in targets if target is not None]
        if not goals:
            return zip(loops, J, strict=True)
        missed = PoseAndValuesTask.misses(goals, X, self.twin.length)
        wanted = np.array([goal.wanted for goal in goals])
        if self.plain:
            apart = values - wanted
        else:
            ends = np.cumsum([o.size for o in self.observations])[:-1]
            apart = np.array(
                [
                    np.concatenate(
                        [
                            o.difference(*pair)
                            for o, *pair in zip(self.observations, *(np.split(row, ends) for row in rows), strict=True)
                        ]
                    )
                    for rows in zip(values, wanted, strict=True)
                ]
            )
        return zip(np.concatenate([loops, missed, apart], axis=1), J, strict=True)

    def _measure(self, places: Sequence[Array]) -> tuple[Array, Array, Array, Array]:
        """The loops' residuals (n, rows), all Jacobians (n, rows, nv), poses X_BP (n, 4, 4), and values (n, size)."""
        model, like = self.twin, self.like
        reference = model.mechanism.base if like is None else like.reference
        loops, J, X, V, values, rates = measure_together(model, places, reference, self.observations, self.links)
        if like is None:
            return loops, J, X, values
        X, V = X[:, 0], V[:, 0]
        if like.point is not None:
            V = np.array(
                [compute_point_velocity(v, x[:3, :3] @ like.point / model.length) for v, x in zip(V, X, strict=True)]
            )
        return loops, np.concatenate([J, V, rates], axis=1), X, values


def shorten_step(step: Array, longest: float) -> Array:
    """A step (nv,), shortened where a coordinate would change by more than ``longest``."""
    largest = float(np.abs(step).max(initial=0.0))
    return step * (longest / largest) if largest > longest else step


def stack_task(model: PinocchioModel, q: Array, task: Task | None) -> tuple[Array, Array]:
    """Error and Jacobian of the loops and, below them, of the task."""
    error, J = model.residual(q), model.jacobian(q)
    if task is None:
        return error, J
    extra, rows = task.error_and_jacobian(model, q)
    return np.concatenate([error, extra]), np.concatenate([J, rows])
