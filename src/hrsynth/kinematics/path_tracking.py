"""Path tracking of a model: each configuration is solved from the one before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..errors import UndefinedValue
from ..geometry.vectors import Array
from ..tolerances import CLOSURE_SOLVER_TOL, WAYPOINT_RESIDUAL_TOL
from .pinocchio_model import PinocchioModel
from .tasks import PoseAndValuesTask, TaskBatch, solve_together


def track_paths(
    model: PinocchioModel, ways: Sequence[Sequence[PoseAndValuesTask]], iterations: int = 120
) -> Iterator[tuple[Array, float] | UndefinedValue]:
    """Track paths from the zero configuration: yield (q, closure residual) of each path, or its UndefinedValue; all
    paths in step, or each alone if a value is undefined on one."""
    try:
        yield from _track_ways(model, ways, iterations)
    except UndefinedValue as error:
        for way in ways if len(ways) > 1 else ():
            yield from track_paths(model, [way], iterations)
        if len(ways) == 1:
            yield error


def _track_ways(
    model: PinocchioModel, ways: Sequence[Sequence[PoseAndValuesTask]], iterations: int
) -> list[tuple[Array, float]]:
    longest = max(map(len, ways))  # a shorter path ends with its last target, again and again
    found, stages = (
        [(model.q0, 0.0)] * len(ways),
        list(zip(*([*way, *[way[-1]] * (longest - len(way))] for way in ways), strict=True)),
    )
    places = TaskBatch(model, stages[0][0] if stages else None)
    for targets in stages:
        tolerance = CLOSURE_SOLVER_TOL if targets is stages[-1] else WAYPOINT_RESIDUAL_TOL
        found = solve_together(places, [q for q, _ in found], targets, tolerance=tolerance, iterations=iterations)
    return found
