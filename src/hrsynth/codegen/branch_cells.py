"""A proved branch as code needs it: independent parts, each with cells of motor coordinates and an affine tube in each,
in metres and radians (docs/pages/proofs.md, section 12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ..analysis.branch.answer import BranchPart, BranchProof
from ..equations.joint_equations import LoopSystem
from ..equations.loop_parts import DISTANCE, LoopPart, evaluate_all_equations, split_loop_system
from ..errors import NoProvedCell
from ..geometry.vectors import Array
from ..results import Value

GENERATED_CLOSURE_TOL = 1e-11
"""Largest closure residual of generated code (cosines; metres, or characteristic lengths above one metre)."""
FREE_MOTOR_VALUE_MAX = 1e6
"""Largest coordinate (m, rad) of a motor outside of all loops without limits."""


@dataclass(frozen=True, eq=False, repr=False)
class TubeCell(Value):
    """Cell of motor values between ``lower`` and ``upper`` (m,) in which the loops have one closure with |x − middle −
    slopes (q − (lower + upper) / 2)| ≤ radius, (p,); slopes (p, m)."""

    lower: Array
    upper: Array
    middle: Array
    slopes: Array
    radius: Array

    @property
    def centre(self) -> Array:
        """The middle of the cell (m,)."""
        return np.asarray((self.lower + self.upper) / 2)


@dataclass(frozen=True, eq=False, repr=False)
class TubePart(Value):
    """Unknowns that ``driven`` coordinates decide, by their places among all coordinates, and the cells; ``solved``:
    the places among all equations of those that hold where the proof's equations do, whatever the others are."""

    driven: tuple[int, ...]
    unknowns: tuple[int, ...]
    cells: tuple[TubeCell, ...]
    solved: tuple[int, ...]

    @property
    def is_square(self) -> bool:
        """Return True if these are as many as the unknowns: the closure is their zero."""
        return len(self.solved) == len(self.unknowns)

    def ordered(self, places: Sequence[int]) -> TubePart:
        """Return the same with its unknowns in another order."""
        own = list(places)
        return TubePart(
            self.driven,
            tuple(self.unknowns[k] for k in own),
            tuple(
                replace(each, middle=each.middle[own], slopes=each.slopes[own], radius=each.radius[own])
                for each in self.cells
            ),
            self.solved,
        )


@dataclass(frozen=True, eq=False, repr=False)
class TubedBranch(Value):
    """The loops in metres, the motors' coordinates and the bounds (m,) of the proved box, the parts; coordinates in no
    part are held as they are at the zero configuration."""

    system: LoopSystem
    motors: tuple[int, ...]
    lower: Array
    upper: Array
    parts: tuple[TubePart, ...]
    injective_box: tuple[Array, Array] | None
    """The box of motors (m,) in which no two are proved to have one pose."""

    @classmethod
    def of(cls, proof: BranchProof, asked: Mapping[str, tuple[float, float]] = MappingProxyType({})) -> TubedBranch:
        """The parts of a proof that have cells; a motor that is in none keeps to its limits and to the interval that is
        ``asked`` for. Raises ``NoProvedCell`` where a part has no cells."""
        system, table = proof.system, {name: i for i, name in enumerate(proof.system.names)}
        motors = tuple(table[name] for name in proof.motors)
        lower, upper = np.full(len(motors), -np.inf), np.full(len(motors), np.inf)
        parts = []
        solved = {
            tuple(own.unknowns): _list_solved_rows(proof.system, own) for own in split_loop_system(proof.system)[0]
        }
        for part in proof.parts:
            if not part.cells:
                raise NoProvedCell(proof.robot.name, part.motors, _explain_unproved(part))
            driven = tuple(table[name] for name in part.motors)
            cells = tuple(TubeCell(each.low, each.high, each.centre, each.slopes, each.radius) for each in part.cells)
            places = [motors.index(i) for i in driven]
            lower[places] = np.maximum(lower[places], np.min([each.lower for each in cells], axis=0))
            upper[places] = np.minimum(upper[places], np.max([each.upper for each in cells], axis=0))
            unknowns = tuple(table[name] for name in part.passive)
            parts.append(TubePart(driven, unknowns, cells, solved[unknowns]))
        for place, i in enumerate(motors):
            low, high = proof.robot.filed.get(system.coordinates[i].joint, (-np.inf, np.inf))
            if not np.isfinite(lower[place]):  # in no loop
                ends = asked.get(system.coordinates[i].name, (-FREE_MOTOR_VALUE_MAX, FREE_MOTOR_VALUE_MAX))
                lower[place], upper[place] = max(low, ends[0]), min(high, ends[1])
        return cls(system.metric, motors, lower, upper, tuple(parts), proof.injective_box)

    @property
    def passive(self) -> tuple[int, ...]:
        """The passive coordinates that the loops decide."""
        return tuple(sorted(i for part in self.parts for i in part.unknowns))

    @property
    def internal(self) -> tuple[int, ...]:
        """The coordinates that are held."""
        return tuple(i for i in range(len(self.system.coordinates)) if i not in {*self.motors, *self.passive})

    def unit(self, i: int) -> float:
        """Return the unit of a coordinate: the characteristic length, or a radian."""
        return self.system.mechanism.length if self.system.coordinates[i].slides else 1.0

    def unit_name(self, i: int) -> str:
        """Return the name of its unit."""
        return "m" if self.system.coordinates[i].slides else "rad"

    @property
    def far(self) -> float:
        """The length (m) of which the tolerances of lengths are parts: a metre, or the characteristic length where that
        is more, so that rounding of large numbers is no error."""
        return max(1.0, float(self.system.mechanism.length))

    def closing_tolerance(self, rows: Sequence[int]) -> Array:
        """Return the residuals of equations, by their indices among all, below which their loops count as closed."""
        units = [self.far if row.kind == "point" else 1.0 for loop in self.system.loops for row in loop.rows]
        units += [self.far if self.system.coordinates[gear.second].slides else 1.0 for gear in self.system.gears]
        return np.asarray(GENERATED_CLOSURE_TOL * np.array(units)[list(rows)])

    def evaluate(self, q: Array, x: Array) -> tuple[Array, Array]:
        """All equations (e,) and their derivatives (e, N) at q and x, in the order of ``motors`` and ``passive``."""
        values = self.system.zero
        values[list(self.motors)], values[list(self.passive)] = q, x
        return evaluate_all_equations(self.system, self.system.loops, self.system.gears, values)


def _explain_unproved(part: BranchPart) -> str:
    """Return the reasons for which nothing of a part is proved: each once, with the place nearest to zero."""
    nearest: dict[str, Array] = {}
    for each in sorted(part.toggles, key=lambda each: float(np.linalg.norm(each.q))):
        nearest.setdefault(each.reason, each.q)
    return "; ".join(f"{reason} (at {part.place(q)})" for reason, q in nearest.items())


def _list_solved_rows(system: LoopSystem, part: LoopPart) -> tuple[int, ...]:
    """The places among all equations of those that hold where a part is solved: of a loop that is closed by turning a
    rod all of them, if its length is among what was solved."""
    left = {(each.of.name, id(each.row)) for each in part.left_out}
    turned = {loop.name: (loop.name, id(DISTANCE)) not in left for loop in part.loops if loop.swung is not None}
    own = {loop.name for loop in part.loops} | {gear.name for gear in part.gears}
    every = [(loop.name, id(row)) for loop in system.loops for row in loop.rows]
    every += [(gear.name, id(None)) for gear in system.gears]
    return tuple(k for k, (name, row) in enumerate(every) if name in own and turned.get(name, (name, row) not in left))
