"""The parts of a robot's loops that have no unknown in common, each with its own unknowns and square blocks of
equations that are solved one after another; closing a part in floating point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import BadRequest, MotorsNotEnough
from ...geometry.ranks import compute_matrix_spectrum
from ...geometry.vectors import Array, times
from ...results import Value
from ...tolerances import CLOSURE_SOLVER_TOL, NAMED_TWIST_TOL, RANK_CUTOFF_FRACTION
from .loops import CouplingEquation, JointLoop, LoopRow, LoopSystem, evaluate_residuals

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

    def names(self, system: LoopSystem) -> tuple[int, ...]:
        """The coordinates that it has to do with."""
        if isinstance(self.of, CouplingEquation):
            return self.of.first, self.of.second
        if self.row is not DISTANCE:
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
    """The loop that is closed by turning one joint, of a block that does this."""


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
        """The unknowns (c, p) near ``x`` at which the loops are closed, by Newton's method, and which (c,) are."""
        x = x.copy()
        for _ in range(LOOP_PART_NEWTON_STEPS_MAX):
            errors, A, _ = self.closure(q, x)
            far = np.linalg.norm(errors, axis=-1) >= CLOSURE_SOLVER_TOL
            if not far.any() or not np.all(np.isfinite(x)):
                break
            step = _solve_least_squares(A[far], errors[far][..., None])[..., 0]
            x[far] -= step * np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=-1, initial=0.0), 0.5))[..., None]
        done = np.linalg.norm(self.closure(q, x)[0], axis=-1) < 100 * CLOSURE_SOLVER_TOL
        return x, done & np.all(np.isfinite(x), axis=-1)

    def slopes(self, q: Array, x: Array) -> Array:
        """dx/dq (…, p, n) at closed configurations."""
        _, A, B = self.closure(q, x)
        return -_solve_least_squares(A, B)

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


def _solve_least_squares(A: Array, B: Array) -> Array:
    """The least squares solutions (…, p, k) of A X = B, (…, m, p) and (…, m, k)."""
    return np.asarray(np.linalg.pinv(A, rcond=RANK_CUTOFF_FRACTION) @ B)


def evaluate_all_equations(
    system: LoopSystem,
    loops: Sequence[JointLoop],
    gears: Sequence[CouplingEquation],
    values: Any,
    shape: tuple[int, ...] = (),
) -> tuple[Array, Array]:
    """Equations of loops and couplings (…, m) and their derivatives by all coordinates (…, m, N), at values of a
    ``shape``, None for those at zero."""
    count = sum(len(loop.rows) for loop in loops) + len(gears)
    errors, rates = np.zeros((*shape, count)), np.zeros((*shape, count, len(values)))
    place = 0
    for loop in loops:
        for value, slope in zip(*evaluate_residuals(system, loop, values, loop.rows), strict=True):
            errors[..., place] = value
            for i, rate in slope.items():
                rates[..., place, i] = rate
            place += 1
    for gear in gears:
        for i, rate in ((gear.second, 1.0), (gear.first, -gear.ratio)):
            rates[..., place, i] += rate
            if values[i] is not None:
                errors[..., place] += system.coordinates[i].from_zero(values[i]) * rate
        place += 1
    return errors, rates


def split_loop_system(system: LoopSystem) -> tuple[tuple[LoopPart, ...], tuple[int, ...]]:
    """Return the parts of a system, and the coordinates that are constant: those that rotate only themselves
    (internal), and those of loops without a motor. Raises ``MotorsNotEnough`` if the platform can move while all motors
    are fixed, ``BadRequest`` if motors depend on each other."""
    held = _find_internal_coordinates(system)
    unknowns = [i for i, each in enumerate(system.coordinates) if not each.driven and i not in held]
    parts = [_build_part(system, group) for group in _group_unknowns(system, unknowns)]
    held |= {i for part in parts if not part.driven for i in part.unknowns}
    return tuple(part for part in parts if part.driven), tuple(sorted(held))


def _find_internal_coordinates(system: LoopSystem) -> set[int]:
    """Choose coordinates to fix, one for each motion at zero that leaves the platform and the motors fixed: of each the
    one with the largest share. Raises ``BadRequest`` if the motors are not independent at zero."""
    held: set[int] = set()
    _, rates = evaluate_all_equations(system, system.loops, system.gears, system.zero)
    looped = {i for loop in system.loops for i in loop.coordinates}
    looped |= {i for gear in system.gears for i in (gear.first, gear.second)}
    # a ball on a rod spins about it
    for loop in system.loops:
        if loop.swings == 3 and loop.swung is not None:
            own = loop.chains[1][loop.swung : loop.swung + 3]
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
        own = each.coordinates if isinstance(each, JointLoop) else (each.first, each.second)
        members = [home[i] for i in own if i in home]
        joined = set().union(*members)
        for i in joined:
            home[i] = joined
    found, seen = [], set()
    for i in unknowns:
        if i in seen:
            continue
        seen |= home[i]
        loops = [loop for loop in system.loops if home[i].intersection(loop.coordinates)]
        gears = [gear for gear in system.gears if home[i].intersection((gear.first, gear.second))]
        found.append((sorted(home[i]), loops, gears))
    return found


def _build_part(system: LoopSystem, group: tuple[list[int], list[JointLoop], list[CouplingEquation]]) -> LoopPart:
    """The blocks of a group of unknowns: those that close rods by turning them come last."""
    from scipy.linalg import qr

    unknowns, every, gears = group
    loops = [_restore_loop_rows(loop, unknowns) for loop in every]
    asked = {i for loop in loops for i in loop.coordinates} | {i for gear in gears for i in (gear.first, gear.second)}
    driven = tuple(i for i in system.driven if i in asked)
    swung: dict[int, tuple[int, ...]] = {}
    candidates: list[LoopEquation] = []
    for place, loop in enumerate(loops):
        if loop.swung is not None:
            own = loop.chains[1][loop.swung : loop.swung + loop.swings]
            swung[place] = tuple(i for i in own if i in unknowns)
            candidates.append(LoopEquation(loop, DISTANCE))
        else:
            candidates += [LoopEquation(loop, row) for row in loop.rows]
    candidates += [LoopEquation(gear) for gear in gears]
    last = {i for own in swung.values() for i in own}
    main = [i for i in unknowns if i not in last]
    zero = system.zero
    rates = np.array([_derive_equation_slope(system, each, zero) for each in candidates]).reshape(
        len(candidates), len(zero)
    )[:, main]
    # independent equations at zero, the firmest first
    order = qr(rates.T, mode="r", pivoting=True)[1][: len(main)] if main else []
    chosen = [candidates[k] for k in sorted(order)]
    left_out = tuple(each for k, each in enumerate(candidates) if k not in order)
    blocks = [*_order_blocks(system, main, chosen), *(LoopBlock(own, (), loops[place]) for place, own in swung.items())]
    return LoopPart(system, driven, tuple(unknowns), tuple(blocks), tuple(loops), tuple(gears), left_out)


def _restore_loop_rows(loop: JointLoop, unknowns: Sequence[int]) -> JointLoop:
    """Return a loop with all its equations if the joint that was left out cannot rotate its rod everywhere: a constant
    coordinate of it is no spin."""
    if loop.swung is None:
        return loop
    turning = sum(i in unknowns for i in loop.chains[1][loop.swung : loop.swung + loop.swings])
    return loop if turning == min(loop.swings, 2) else replace(loop, swung=None, swings=0)


def _derive_equation_slope(system: LoopSystem, equation: LoopEquation, values: Array) -> Array:
    """The derivatives (N,) of an equation."""
    row = np.zeros(len(values))
    if isinstance(equation.of, CouplingEquation):
        row[equation.of.second], row[equation.of.first] = 1.0, -equation.of.ratio
        return row
    assert equation.row is not None
    (slope,) = evaluate_residuals(system, equation.of, values, [equation.row])[1]
    row[list(slope)] = list(slope.values())
    return row


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
    needs = [set(each.names(system)).intersection(unknowns) for each in equations]
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
