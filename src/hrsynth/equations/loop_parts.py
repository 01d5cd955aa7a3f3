"""The parts of a robot's loops that have no unknown in common, each with its own unknowns and square blocks of
equations that are solved one after another; closing a part in floating point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import BadRequest, MotorsNotEnough
from ..geometry.ranks import compute_matrix_spectrum
from ..geometry.vectors import Array, times
from ..results import Value
from ..solving.newton import ApproachedZeros, approach_zeros
from ..tolerances import CLOSURE_SOLVER_TOL, NAMED_TWIST_TOL, RANK_CUTOFF_FRACTION
from .carried_vectors import SweptChains, Total, add_slope, list_row_products
from .joint_equations import CouplingEquation, JointLoop, LoopRow, LoopSystem, evaluate_residuals

DISTANCE = LoopRow("distance")
LOOP_PART_NEWTON_STEPS_MAX = 30
"""Steps in which a part is closed at most."""


@dataclass(frozen=True, eq=False, repr=False)
class LoopEquation(Value):
    """Equation of a part: a row of a loop, or a coupling (``row`` is None); ``swings``: one of the equations that
    rotate a joint which was left out to where the loop closes."""

    of: JointLoop | CouplingEquation
    row: LoopRow | None = None
    swings: bool = False

    def names(self) -> tuple[int, ...]:
        """The coordinates that it has to do with."""
        if isinstance(self.of, CouplingEquation) or self.row is not DISTANCE:
            return self.of.coordinates
        assert self.of.swung is not None
        second = self.of.chains[1]
        return (*self.of.chains[0], *second[: self.of.swung], *second[self.of.swung + self.of.swings :])


@dataclass(frozen=True)
class LoopBlock:
    """Unknowns (places among all coordinates) and as many equations, solved when the blocks before it are."""

    unknowns: tuple[int, ...]
    equations: tuple[LoopEquation, ...]
    loop: JointLoop | None = None
    """The loop that is closed by turning one joint, of a block that does this: its equations depend on the cell, unless
    it turns the tips of this loop."""

    @property
    def needed(self) -> frozenset[int]:
        """The coordinates that its equations have to do with."""
        needed = set(self.unknowns) | ({*self.loop.chains[0], *self.loop.chains[1]} if self.loop else set())
        return frozenset(needed.union(*(each.names() for each in self.equations)))

    @property
    def closing(self) -> tuple[LoopEquation, ...]:
        """Equations that close it in floats, if the blocks before it are closed."""
        loop = self.loop
        return self.equations if loop is None or self.equations else tuple(LoopEquation(loop, row) for row in loop.rows)


@dataclass(frozen=True, eq=False, repr=False)
class LoopPart(Value):
    """A part of the loops: the coordinates that drive it, its unknowns, its blocks in order, and the equations that
    were left out."""

    system: LoopSystem
    driven: tuple[int, ...]
    unknowns: tuple[int, ...]
    blocks: tuple[LoopBlock, ...]
    loops: tuple[JointLoop, ...]
    gears: tuple[CouplingEquation, ...]
    left_out: tuple[LoopEquation, ...] = ()
    """Equations that depend on the others at zero."""

    @cached_property
    def place(self) -> dict[int, int]:
        """Return the index of an unknown in this part."""
        return {i: k for k, i in enumerate(self.unknowns)}

    @cached_property
    def core(self) -> LoopPart:
        """Return the part without the joints that only turn rods, and do not carry the platform: they follow."""
        way = set(self.system.way(self.system.body[self.system.mechanism.platform]))
        blocks = tuple(each for each in self.blocks if each.loop is None or way.intersection(each.unknowns))
        kept = {i for block in blocks for i in block.unknowns}
        return replace(self, unknowns=tuple(i for i in self.unknowns if i in kept), blocks=blocks)

    def places_in(self, whole: LoopPart) -> list[int]:
        """Return the indices of its unknowns in a part that it is the core of."""
        return [whole.place[i] for i in self.unknowns]

    @cached_property
    def bent(self) -> tuple[int, ...]:
        """The angles among its motors and the unknowns of its first blocks."""
        first = {i for block in self.blocks if block.loop is None for i in block.unknowns}
        return tuple(
            i for i, each in enumerate(self.system.coordinates) if not each.slides and (i in first or i in self.driven)
        )

    def values(self, q: Array, x: Array) -> list[Array | None]:
        """Coordinates, constant ones None, for those that drive this part (…, n) and its unknowns (…, p)."""
        found: list[Array | None] = [None] * len(self.system.coordinates)
        for places, given in ((self.driven, q), (self.unknowns, x)):
            for k, i in enumerate(places):
                found[i] = given[..., k]
        return found

    def closure(self, q: Array, x: Array) -> tuple[Array, Array, Array]:
        """All equations of its loops (…, m), and their derivatives by the unknowns (…, m, p) and by what drives it
        (…, m, n)."""
        errors, rates = evaluate_all_equations(self.system, self.loops, self.gears, self.values(q, x), q.shape[:-1])
        return errors, rates[..., list(self.unknowns)], rates[..., list(self.driven)]

    def close(self, q: Array, x: Array) -> tuple[Array, Array]:
        """The unknowns (c, p) near ``x`` at which the loops are closed, by Newton's method in one block after another,
        and which (c,) are; blocks that cannot be closed stay where they are."""
        x, done = x.copy(), np.ones(len(x), dtype=bool)
        for block in self.blocks:
            ends = self._approach_closure(block, q, x)
            closed = ends.errors < 100 * CLOSURE_SOLVER_TOL
            done &= closed
            x = np.where(closed[:, None], ends.x, x)
        if self.left_out:
            done &= np.linalg.norm(self.derive(self.left_out, q, x)[0], axis=-1) < 100 * CLOSURE_SOLVER_TOL
        return x, done & np.all(np.isfinite(x), axis=-1)

    def _approach_closure(self, block: LoopBlock, q: Array, x: Array) -> ApproachedZeros:
        """As :meth:`close`, one block."""

        def solve(J: Array, F: Array) -> Array:
            step = np.zeros((len(F), len(self.unknowns)))
            step[:, self.list_places(block)] = _solve_least_squares(J[..., list(block.unknowns)], F[..., None])[..., 0]
            return step

        evaluate, most = lambda x, q: self.derive(block.closing, q, x), LOOP_PART_NEWTON_STEPS_MAX
        return approach_zeros(evaluate, x, q, steps=most, longest=0.5, error_tol=CLOSURE_SOLVER_TOL, solve=solve)

    def list_places(self, block: LoopBlock) -> list[int]:
        """Return the indices of a block's unknowns in this part."""
        return [self.place[i] for i in block.unknowns]

    def derive(self, equations: Sequence[LoopEquation], q: Array, x: Array) -> tuple[Array, Array]:
        """Some equations (…, k), and their derivatives by all coordinates (…, k, N)."""
        return derive_equations(self.system, equations, self.values(q, x), q.shape[:-1])

    def slopes(self, q: Array, x: Array) -> Array:
        """dx/dq (…, p, n) at closed configurations."""
        dx = np.zeros((*x.shape, len(self.driven)))
        for block in self.blocks:
            places, others = self.list_places(block), list(self.unknowns)
            rates = self.derive(block.closing, q, x)[1]
            drift = rates[..., list(self.driven)] + rates[..., others] @ dx
            dx[..., places, :] = -_solve_least_squares(rates[..., list(block.unknowns)], drift)
        return dx

    def follow(self, q: Array, x: Array, goal: Array, step: float = 0.1) -> tuple[Array, Array]:
        """The unknowns (c, p) at ``goal`` (c, n), reached by short steps from closed configurations, and which (c,) are
        reached without a correction that is longer than the step."""
        count = max(1, int(np.ceil(np.abs(goal - q).max(initial=0.0) / step)))
        good = np.ones(len(q), dtype=bool)
        for k in range(count):
            here, there = q + (goal - q) * (k / count), q + (goal - q) * ((k + 1) / count)
            ahead = times(self.slopes(here, x), there - here)
            found, done = self.close(there, x + ahead)
            off = np.abs(found - x - ahead).max(axis=-1, initial=0.0)
            good &= done & (off <= step + np.abs(ahead).max(axis=-1, initial=0.0))
            x = np.where(good[:, None], found, x)
        return x, good


def evaluate_equations(
    system: LoopSystem, equations: Sequence[LoopEquation], forms: Sequence[Any]
) -> tuple[list[Any], list[dict[int, Any]]]:
    """Values of equations, and their derivatives by the coordinates that are not constant, for floats or forms."""
    values: list[Any] = [0.0] * len(equations)
    slopes: list[dict[int, Any]] = [{} for _ in equations]
    groups: dict[int, list[int]] = {}
    for k, each in enumerate(equations):
        if isinstance(each.of, CouplingEquation):
            slopes[k] = {i: rate for i, rate in each.of.slope.items() if forms[i] is not None}
            for i, rate in slopes[k].items():
                values[k] = values[k] + system.coordinates[i].from_zero(forms[i]) * rate
        else:
            groups.setdefault(id(each.of), []).append(k)
    for members in groups.values():
        loop = equations[members[0]].of
        rows = [row for row in (equations[k].row for k in members) if row is not None]
        assert isinstance(loop, JointLoop)
        found = evaluate_residuals(system, loop, forms, rows)
        for k, value, slope in zip(members, *found, strict=True):
            values[k], slopes[k] = value, slope
    return values, slopes


def _solve_least_squares(A: Array, B: Array) -> Array:
    """The least squares solutions (…, p, k) of A X = B, (…, m, p) and (…, m, k)."""
    return np.asarray(np.linalg.pinv(A, rcond=RANK_CUTOFF_FRACTION) @ B)


def derive_equations(
    system: LoopSystem, equations: Sequence[LoopEquation], values: Any, shape: tuple[int, ...] = ()
) -> tuple[Array, Array]:
    """Equations (…, m) and their derivatives by all coordinates (…, m, N), at values of a ``shape``, None for those at
    zero."""
    if not equations:
        return np.zeros((*shape, 0)), np.zeros((*shape, 0, len(values)))
    errors, rates = evaluate_by_vectors(system, equations, values, np.zeros(shape), range(len(values)))
    return np.stack(errors, axis=-1), np.stack(rates, axis=-2)


def evaluate_by_vectors(
    system: LoopSystem, equations: Sequence[LoopEquation], values: Any, zero: Any, places: Sequence[int]
) -> tuple[list[Any], list[Any]]:
    """As :func:`evaluate_equations`, with derivatives (…, m) by the coordinates ``places`` (m,), the only ones that
    count, at floats or forms of the shape of ``zero``; vectors and their derivatives are evaluated once."""
    order = np.zeros(len(values), dtype=np.intp)
    order[list(places)] = np.arange(len(places))
    carrier = SweptChains(system, [form if i in places else None for i, form in enumerate(values)], order)
    errors, slopes = list[Any](), list[Any]()
    for equation in equations:
        error, slope = zero, Total(zero, (len(places),))
        if isinstance(equation.of, CouplingEquation):
            for i, rate in equation.of.slope.items():
                if carrier.values[i] is not None:
                    error = error + system.coordinates[i].from_zero(values[i]) * rate
                    slope.add(([order[i]],), rate)
        elif equation.row is not None:
            for product, weight in list_row_products(carrier, equation.of, equation.row):
                error = error + product.value * weight
                add_slope(slope, product, weight)
        errors.append(error)
        slopes.append(slope.sum)
    return errors, slopes


def evaluate_all_equations(
    system: LoopSystem,
    loops: Sequence[JointLoop],
    gears: Sequence[CouplingEquation],
    values: Any,
    shape: tuple[int, ...] = (),
) -> tuple[Array, Array]:
    """As :func:`derive_equations`, all equations of loops, then couplings."""
    equations = [LoopEquation(loop, row) for loop in loops for row in loop.rows] + [*map(LoopEquation, gears)]
    return derive_equations(system, equations, values, shape)


def split_loop_system(system: LoopSystem) -> tuple[tuple[LoopPart, ...], tuple[int, ...]]:
    """Return the parts of a system, and the coordinates that are constant: those that rotate only themselves
    (internal), and those of loops without a motor. Raises ``MotorsNotEnough`` if the platform can move while all motors
    are fixed, ``BadRequest`` if motors depend on each other."""
    held = _find_internal_coordinates(system)
    unknowns = [i for i, each in enumerate(system.coordinates) if not each.driven and i not in held]
    parts = [_build_part(system, group) for group in _group_unknowns(system, unknowns)]
    held |= {i for part in parts if not part.driven for i in part.unknowns}
    return tuple(part for part in parts if part.driven), tuple(sorted(held))


def _list_coordinates(loops: Iterable[JointLoop], gears: Iterable[CouplingEquation]) -> set[int]:
    """The coordinates of loops and couplings."""
    return {i for each in (loops, gears) for one in each for i in one.coordinates}


def _find_internal_coordinates(system: LoopSystem) -> set[int]:
    """Choose coordinates to fix, one for each motion at zero that leaves the platform and the motors fixed: of each the
    one with the largest share. Raises ``BadRequest`` if the motors are not independent at zero."""
    held: set[int] = set()
    _, rates = evaluate_all_equations(system, system.loops, system.gears, system.zero)
    looped = _list_coordinates(system.loops, system.gears)
    # a ball on a rod spins about it
    for loop in system.loops:
        if loop.swings == 3 and loop.swung is not None:
            own = list_turned(loop)
            rod = loop.point - system.coordinates[own[0]].point
            held.add(max(own, key=lambda i: abs(float(system.coordinates[i].axis @ rod))))
    free = [i for i, each in enumerate(system.coordinates) if not each.driven and i not in held and i in looped]
    way = set(system.way(system.body[system.mechanism.platform]))
    loose = [system.coordinates[i].name for i in sorted(way) if i not in looped and not system.coordinates[i].driven]
    if loose:
        raise MotorsNotEnough(system.mechanism.name, loose)
    held |= {i for i, each in enumerate(system.coordinates) if not each.driven and i not in looped}
    every = [i for i, each in enumerate(system.coordinates) if i in looped and (each.driven or i in free)]
    count = sum(system.coordinates[i].driven for i in every)
    dependent = compute_matrix_spectrum(rates[:, every]).rank.value - compute_matrix_spectrum(rates[:, free]).rank.value
    if dependent:
        raise BadRequest(
            f"{system.mechanism.name}: only {count - dependent} of {count} motor coordinates are independent at zero",
            remedy=f"Choose {count - dependent} with --motors.",
        )
    while free:
        kernel = compute_matrix_spectrum(rates[:, free]).kernel
        if not kernel.shape[1]:
            break
        moved = [_is_platform_moving(system, free, vector) for vector in kernel.T]
        weights = np.abs(kernel).max(axis=1)
        if any(moved):
            names = [system.coordinates[i].name for i, w in zip(free, weights, strict=True) if w > NAMED_TWIST_TOL]
            raise MotorsNotEnough(system.mechanism.name, names)
        i = free[int(np.argmax(weights))]
        held.add(i)
        free.remove(i)
    return held


def _is_platform_moving(system: LoopSystem, free: Sequence[int], rates: Array) -> bool:
    """Return True if the platform moves at zero with rates of some coordinates."""
    by = dict(zip(free, rates, strict=True))
    spin, velocity = np.zeros(3), np.zeros(3)
    for i in system.way(system.body[system.mechanism.platform]):
        each, rate = system.coordinates[i], by.get(i, 0.0)
        if each.slides:
            velocity = velocity + rate * each.axis
        else:
            spin = spin + rate * each.axis
            velocity = velocity + rate * np.cross(each.point, each.axis)
    return float(np.linalg.norm([*spin, *velocity])) > NAMED_TWIST_TOL


def _group_unknowns(
    system: LoopSystem, unknowns: Sequence[int]
) -> list[tuple[list[int], list[JointLoop], list[CouplingEquation]]]:
    """Unknowns that equations connect, with those loops and couplings."""
    home = {i: {i} for i in unknowns}
    every: list[JointLoop | CouplingEquation] = [*system.loops, *system.gears]
    for each in every:
        members = [home[i] for i in each.coordinates if i in home]
        joined = set().union(*members)
        for i in joined:
            home[i] = joined
    found, seen = [], set()
    for i in unknowns:
        if i in seen:
            continue
        seen |= home[i]
        loops = [loop for loop in system.loops if home[i].intersection(loop.coordinates)]
        gears = [gear for gear in system.gears if home[i].intersection(gear.coordinates)]
        found.append((sorted(home[i]), loops, gears))
    return found


def _build_part(system: LoopSystem, group: tuple[list[int], list[JointLoop], list[CouplingEquation]]) -> LoopPart:
    """The blocks of a group of unknowns: those that close rods by turning them come last."""
    from scipy.linalg import qr

    unknowns, every, gears = group
    loops = _restore_loop_rows(every, unknowns)
    asked = _list_coordinates(loops, gears)
    driven = tuple(i for i in system.driven if i in asked)
    after: list[LoopBlock] = []
    candidates: list[LoopEquation] = []
    for loop in loops:
        rows = tuple(LoopEquation(loop, row) for row in loop.rows)
        turned = tuple(i for i in list_turned(loop) if i in unknowns)
        if turned:
            after.append(LoopBlock(turned, rows if loop.tips else (), loop))
        candidates += [LoopEquation(loop, DISTANCE)] if loop.swung is not None else [] if turned else rows
    candidates += [LoopEquation(gear) for gear in gears]
    last = {i for block in after for i in block.unknowns}
    way = set(system.way(system.body[system.mechanism.platform]))
    after.sort(key=lambda block: not way.intersection(block.unknowns))
    main = [i for i in unknowns if i not in last]
    rates = derive_equations(system, candidates, system.zero)[1][:, main]
    # independent equations at zero, the firmest first
    order = qr(rates.T, mode="r", pivoting=True)[1][: len(main)] if main else []
    chosen = [candidates[k] for k in sorted(order)]
    left_out = tuple(each for k, each in enumerate(candidates) if k not in order)
    blocks = [*_order_blocks(system, main, chosen), *after]
    return LoopPart(system, driven, tuple(unknowns), tuple(blocks), tuple(loops), tuple(gears), left_out)


def list_turned(loop: JointLoop) -> tuple[int, ...]:
    """Return the coordinates that a loop turns when the others are known: those of a rod's joint, or tips."""
    return loop.tips if loop.swung is None else loop.chains[1][loop.swung : loop.swung + loop.swings]


def _restore_loop_rows(loops: Sequence[JointLoop], unknowns: Sequence[int]) -> list[JointLoop]:
    """Return loops with all their equations if the joint that was left out cannot rotate its rod everywhere: a constant
    coordinate of it is no spin; or if the tips of a rod do not follow."""
    turning = {(loop.name, not loop.tips): sum(i in unknowns for i in list_turned(loop)) for loop in loops}
    stiff = {loop.name for loop in loops if loop.swung is not None and turning[loop.name, True] != min(loop.swings, 2)}
    stiff |= {loop.name for loop in loops if loop.tips and turning[loop.name, False] != len(loop.rows)}
    return [replace(loop, swung=None, swings=0, tips=()) if loop.name in stiff else loop for loop in loops]


def _order_blocks(system: LoopSystem, unknowns: Sequence[int], equations: Sequence[LoopEquation]) -> list[LoopBlock]:
    """The blocks of a square system that can be solved one after another: a matching of equations and unknowns, then
    the strong components of who needs whom (Dulmage and Mendelsohn)."""
    import networkx as nx

    if not unknowns:
        return []
    pairs: nx.Graph = nx.Graph()
    rows = [("row", k) for k in range(len(equations))]
    pairs.add_nodes_from(rows)
    pairs.add_nodes_from(unknowns)
    needs = [set(each.names()).intersection(unknowns) for each in equations]
    pairs.add_edges_from((row, i) for row, own in zip(rows, needs, strict=True) for i in own)
    match = nx.bipartite.hopcroft_karp_matching(pairs, rows)
    if len(rows) < len(unknowns) or any(row not in match for row in rows):
        return [LoopBlock(tuple(unknowns), tuple(equations))]
    graph: nx.DiGraph = nx.DiGraph()
    graph.add_nodes_from(range(len(rows)))
    solver = {match[row]: k for k, row in enumerate(rows)}
    graph.add_edges_from((solver[i], k) for k, own in enumerate(needs) for i in own if solver[i] != k)
    merged = nx.condensation(graph)
    found = []
    for node in nx.lexicographical_topological_sort(merged):
        members = sorted(merged.nodes[node]["members"])
        found.append(LoopBlock(tuple(sorted(match[rows[k]] for k in members)), tuple(equations[k] for k in members)))
    return found
