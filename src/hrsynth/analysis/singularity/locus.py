"""The locus of singular poses over a plane of poses: what is reached, and where the condition vanishes there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import BadRequest, PlaneNotMet, PoseNotReached
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.parts import PlatformMotion
from ...kinematics.reach import reach, sweep
from ...kinematics.relation import Question
from ...mechanism.pose import Grid, Pose
from ...mechanism.vectors import Array
from ...tolerances import SAME_GEOMETRY
from .agreement import descend, spectrum
from .condition import Condition
from .structure import Structure

Asked = tuple[Question, Structure, Condition]
"""What is measured, and the pattern and condition that belong to it."""

COARSE = 25
"""Poses a side of the grid that finds how far a plane is reached."""
WIDE = (2.5, 5.0)
"""Half the side of that grid (characteristic lengths), and where the robot reaches its border, of a second one."""
STARTS = 4


@dataclass(frozen=True, eq=False)
class Field:
    """A robot over a plane: the expression's value, the smallest singular value (Type 2 where zero) and the inverse of
    the largest (Type 1 where zero), each (nx, ny), NaN where no pose is reached; ``spots`` are singular poses (k, 2)
    where the locus is no curve."""

    value: Array
    signed: bool
    type2: Array
    type1: Array
    spots: Array


@dataclass(frozen=True, eq=False)
class Locus:
    """The fields of the hidden and, where it has motors that determine its platform, the real robot over a plane."""

    grid: Grid
    hidden: Field
    real: Field | None

    @property
    def reached(self) -> int:
        """How many of its poses the robot reaches."""
        return int(np.sum(np.isfinite(self.hidden.type2)))

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line: axes, what is fixed, and for each robot the tables (null: not reached)."""
        robots = {"hidden": self.hidden, "real": self.real}
        return {"axes": {name: values.tolist() for name, values in self.grid.axes}, "fixed": self.grid.fixed.to_dict(),
                "reached": self.reached,
                **{name: field and {"expression": _table(field.value), "type2": _table(field.type2),
                                    "type1": _table(field.type1), "poses": field.spots.tolist()}
                   for name, field in robots.items()}}


def _table(values: Array) -> list[list[float | None]]:
    return [[float(value) if np.isfinite(value) else None for value in row] for row in values]


def locus(start: ClosedConfiguration, motion: PlatformMotion, plane: Pose | None, steps: int,
          hidden: Asked, real: Asked | None,
          progress: Callable[[], None] | None = None) -> Locus:
    """Both robots over the plane that ``plane`` fixes (default: of three parts the third as at the zero configuration).

    Raises ``PlaneNotMet`` where no pose of it is reached, ``BadRequest`` where it does not leave two parts free.
    """
    question = hidden[0]
    grid = _grid(start, question, motion, plane, steps, progress)
    configurations = sweep(start, question, grid, motion, progress)
    if not any(configurations):
        raise PlaneNotMet(start.twin.mechanism.name, str(grid.fixed), "none of its poses is reached")

    def field(asked: Question, structure: Structure, condition: Condition) -> Field:
        reached = [(i, at) for i, at in enumerate(configurations) if at is not None]
        places, here = [i for i, _ in reached], [at for _, at in reached]
        smallest, largest = spectrum(here, asked)
        value = condition.expressed(structure.scene(here))
        tables = []
        for column in (value, smallest, 1 / np.where(largest > 0, largest, np.nan)):
            table = np.full(len(configurations), np.nan)
            table[places] = column
            tables.append(table.reshape(grid.shape))
        spots = np.zeros((0, 2)) if condition.signed or condition.never else _spots(
            grid, motion, [here[i] for i in np.argsort(smallest)[:STARTS]], asked, structure, condition)
        return Field(tables[0], condition.signed, tables[1], tables[2], spots)

    return Locus(grid, field(*hidden), None if real is None else field(*real))


def _grid(start: ClosedConfiguration, question: Question, motion: PlatformMotion, plane: Pose | None, steps: int,
          progress: Callable[[], None] | None) -> Grid:
    plane, names = _axes(start, motion, plane)
    try:
        first = reach(start, question, plane, motion) if plane.given else start
    except PoseNotReached as error:
        raise PlaneNotMet(start.twin.mechanism.name, str(plane), str(error)) from None
    centre = _coordinates(motion, first, names)
    for wide in WIDE:
        half = [np.pi if name == "phi" else wide * start.twin.length for name in names]
        axes = [(name, np.linspace(c - h, c + h, COARSE)) for name, c, h in zip(names, centre, half, strict=True)]
        coarse = Grid(tuple(axes), plane)
        found = [at is not None for at in sweep(first, question, coarse, motion, progress)]
        cells = np.argwhere(np.array(found).reshape(coarse.shape))
        if not len(cells):
            cells = np.array([[COARSE // 2, COARSE // 2]])
        if cells.min() > 0 and cells.max() < COARSE - 1:
            break
    fine = []
    for (name, values), low, high in zip(axes, cells.min(axis=0), cells.max(axis=0), strict=True):
        step = values[1] - values[0]
        fine.append((name, np.linspace(values[low] - step, values[high] + step, steps)))
    return Grid(tuple(fine), plane)


def _axes(start: ClosedConfiguration, motion: PlatformMotion, plane: Pose | None) -> tuple[Pose, tuple[str, ...]]:
    """The plane's fixed parts and the two that vary."""
    plane = plane or Pose()
    name = start.twin.mechanism.name
    fixed = set(plane.given)
    turned = bool(fixed & {"phi", "rpy"})
    parts = [part for part in motion.parts if part != "rpy" and not (part == "phi" and turned)]
    unknown = [part for part in fixed if part not in motion.parts]
    if unknown:
        raise BadRequest(f"{name}: the platform cannot change {unknown[0]}", str(plane), motion.parts)
    free = [part for part in parts if part not in fixed]
    if len(free) > 2 and "phi" in free and motion.spins.shape[1] == 1 and not fixed:
        plane, free = replace(plane, phi=0.0), [part for part in free if part != "phi"]
    if len(free) > 2:
        free = [part for part in free if part != "phi"]
    if len(free) == 3 and not fixed & set("xyz"):
        plane, free = replace(plane, z=round(_coordinates(motion, start, ("z",))[0], 9)), free[:2]
    if len(free) != 2:
        raise BadRequest(f"{name}: a plane of poses leaves two parts free", str(plane) or "none", parts)
    return plane, tuple(free)


def _coordinates(motion: PlatformMotion, at: ClosedConfiguration, names: Sequence[str]) -> list[float]:
    position = motion.position(at.pose(motion.link))
    return [0.0 if name == "phi" else float(position["xyz".index(name)]) for name in names]


def _spots(grid: Grid, motion: PlatformMotion, starts: Sequence[ClosedConfiguration], question: Question,
           structure: Structure, condition: Condition) -> Array:
    """Singular poses that lie in the plane, sought from its weakest poses."""
    found: list[list[float]] = []
    for start in starts:
        at = descend(start, question, structure, condition)
        if at is None:
            continue
        X = at.pose(motion.link)
        error, _ = motion.goal(grid.fixed).rows(at.twin, at.q)
        place = _coordinates(motion, at, grid.names)
        new = all(np.linalg.norm(np.subtract(place, other)) > 1e-6 for other in found)
        if new and np.all(np.isfinite(X)) and np.linalg.norm(error) < SAME_GEOMETRY ** 0.5:
            found.append(place)
    return np.array(found).reshape(-1, 2)
