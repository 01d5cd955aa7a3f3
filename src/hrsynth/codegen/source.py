"""Contents of a program, for all languages: the parts of a branch with their formulas and cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mechanism.observations.direction import Direction
from ..results import Value
from .branch_cells import TubedBranch, TubePart
from .cell_tree import Node, build_cell_tree, compute_tree_depth
from .inverse import LegMotor
from .trace import FormulaTracer, TracedFunction
from .tracker import Tracker


@dataclass(frozen=True, eq=False, repr=False)
class SourcePart(Value):
    """A part: the places of its motors in q and of its unknowns in x; G, J and K of as many equations as unknowns, E of
    all; the cells and the tree in which they are found; what counts as 1 of each unknown."""

    motors: tuple[int, ...]
    unknowns: tuple[int, ...]
    equations: TracedFunction
    slopes: TracedFunction
    closure: TracedFunction
    rows: tuple[int, ...]
    """The places of G among E."""
    closed: tuple[float, ...]
    """Tolerance of each of them in a result."""
    root: int
    nodes: tuple[Node, ...]
    depth: int
    """Root of the tree."""
    cells: tuple[tuple[tuple[float, ...], ...], ...]
    """Centre, x there, slopes row by row, radius."""
    units: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Source(Value):
    """Contents of the program of a branch."""

    branch: TubedBranch
    parts: tuple[SourcePart, ...]
    platform: TracedFunction
    cut: tuple[str, ...]
    """Names of the coordinates of joints at which loops are cut."""
    cut_values: TracedFunction
    cut_slopes: TracedFunction
    rates: TracedFunction
    observed: tuple[Direction, ...]
    legs: tuple[LegMotor, ...]
    """Closed forms of the motors of a pose; none where Newton's method finds them."""
    tracker: Tracker | None = None
    """Formulas that are proved at run time."""

    @classmethod
    def of(
        cls,
        branch: TubedBranch,
        observed: Sequence[Direction],
        legs: Sequence[LegMotor] = (),
        tracker: Tracker | None = None,
    ) -> Source:
        """The formulas of a branch, those of observed directions and of the motors of a pose."""
        tracer = FormulaTracer(branch.system, branch.motors, branch.passive)
        parts = tuple(_build_part(branch, tracer, part) for part in branch.parts if part.cells)
        names, values, slopes = tracer.cut()
        return cls(
            branch,
            parts,
            tracer.platform(),
            tuple(names),
            values,
            slopes,
            tracer.rates(observed),
            tuple(observed),
            tuple(legs),
            tracker,
        )

    def names(self, places: Sequence[int]) -> list[str]:
        """The names of coordinates."""
        return [self.branch.system.coordinates[i].name for i in places]


def _build_part(branch: TubedBranch, tracer: FormulaTracer, part: TubePart) -> SourcePart:
    driven = [branch.motors.index(i) for i in part.driven]
    rows, every, sparse = _choose_rows(branch, part)
    part = part.ordered(sparse)
    unknowns = [branch.passive.index(i) for i in part.unknowns]
    equations, slopes = tracer.loops(rows, part.unknowns, part.driven)
    lower, upper = branch.lower[driven], branch.upper[driven]
    root, nodes = build_cell_tree(lower, upper, [(cell.lower, cell.upper) for cell in part.cells])
    cells = tuple(
        (tuple(cell.centre), tuple(cell.middle), tuple(cell.slopes.ravel()), tuple(cell.radius)) for cell in part.cells
    )
    return SourcePart(
        tuple(driven),
        tuple(unknowns),
        equations,
        slopes,
        tracer.closure(every),
        tuple(every.index(i) for i in rows),
        _convert_to_floats(tuple(branch.closing_tolerance(every))),
        root,
        tuple(nodes),
        compute_tree_depth(root, nodes),
        _convert_to_floats(cells),
        tuple(float(branch.unit(i)) for i in part.unknowns),
        tuple(map(float, lower)),
        tuple(map(float, upper)),
    )


def _convert_to_floats(values: Any) -> Any:
    return tuple(map(_convert_to_floats, values)) if isinstance(values, tuple) else float(values)


def _choose_rows(branch: TubedBranch, part: TubePart) -> tuple[list[int], list[int], list[int]]:
    """As many equations as unknowns, those that the proof solved, else the firmest at the middles of the part's cells
    together; all that have to do with the unknowns; the unknowns' places, those that few of the equations know first,
    so that elimination fills little."""
    from scipy.linalg import qr

    units = np.array([branch.unit(i) for i in part.unknowns])
    places = [branch.passive.index(i) for i in part.unknowns]
    driven = [branch.motors.index(i) for i in part.driven]
    stacked = []
    step = max(1, len(part.cells) // 16)
    for cell in part.cells[::step]:
        q, x = np.zeros(len(branch.motors)), np.zeros(len(branch.passive))
        q[driven], x[places] = cell.centre, cell.middle
        stacked.append(branch.evaluate(q, x)[1][:, part.unknowns] * units)
    every = [i for i in range(len(stacked[0])) if any(np.any(each[i]) for each in stacked)]
    together = np.hstack(stacked)[every]
    kept = [every.index(i) for i in part.solved] if part.is_square else qr(together.T, pivoting=True, mode="r")[1]
    chosen: list[int] = []
    for k in kept:  # independent at the first cell as well
        trial = stacked[0][[every[i] for i in (*chosen, k)]]
        if part.is_square or np.linalg.matrix_rank(trial, tol=1e-6 * np.linalg.norm(trial, 2)) == len(trial):
            chosen.append(int(k))
        if len(chosen) == len(part.unknowns):
            break
    sparse = np.argsort(np.count_nonzero(stacked[0][[every[k] for k in chosen]], axis=0), kind="stable")
    return sorted(every[k] for k in chosen), every, sparse.tolist()
