"""Orientations of the bodies of a locked chain: all of them, one leg solution after the other.

Two cones with one apex meet in two lines, so a direction that is held behind two axes has two solutions; so have three
axes between two bodies that do not turn. Only necessary conditions are used: what is not found here is left open, never
excluded, so no branch with real orientations is lost (docs/pages/proofs.md, section 8).

Each solution comes with its *gain*: an error ε of all directions of the chain (rad) makes one of at most gain · ε, to
first order, in the orientations. That of the goal's own is 1: nothing is computed for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...geometry import lines
from ...geometry.vectors import Array, cross, rotate_about_axis
from ...tolerances import EXACT_INCIDENCE_TOL, RELATION_ANGLE_TOL
from .locked_chain import Chain, LocusDerivationFailure

Known = tuple[Array | None, ...]
"""The orientation (3, 3) of each body, counted from the goal, or None where it is not a fixed one."""

Way = list[tuple[int, Array]]
"""Bodies met one after another, each with the axis about which it turns against the one before."""


def list_orientations(chain: Chain) -> list[tuple[Known, float]]:
    """All solutions for the bodies whose orientation is discrete, with their gains; the goal's own is the first."""
    known: list[Array | None] = [None] * len(chain.bodies)
    known[0] = np.eye(3)
    if chain.kept:
        known[-1] = np.eye(3)
    return _resolve(chain, tuple(known), 1.0)


def _resolve(chain: Chain, known: Known, gain: float) -> list[tuple[Known, float]]:
    for step in (
        _orient_driven,
        _orient_observed_once,
        _orient_between_two,
        _orient_observed_twice,
        _orient_between_three,
    ):
        for solved in step(chain, known):
            if any(known[k] is None for k in solved.places) or not solved.turns:
                return [
                    solution
                    for turns, factor in solved.turns
                    for solution in _resolve(chain, _set_turns(known, solved.places, turns), gain * factor)
                ]
    return [(known, gain)]


@dataclass(frozen=True, eq=False)
class _Found:
    """Bodies that are known now, and for each solution their orientations, with its gain; without a solution there is
    no such branch."""

    places: tuple[int, ...]
    turns: tuple[tuple[tuple[Array, ...], float], ...]


def _set_turns(known: Known, places: Sequence[int], turns: Sequence[Array]) -> Known:
    new = list(known)
    for k, Q in zip(places, turns, strict=True):
        new[k] = Q
    return tuple(new)


def list_ways(chain: Chain, known: Known, k: int) -> Iterator[tuple[Array, Way]]:
    """From the known bodies on either side of a body: that one's orientation, and the way to the body."""
    for step in (-1, 1):
        at, way = k, Way()
        while at in range(len(known)) and known[at] is None:
            axis = chain.bodies[at if step < 0 else at + 1].axis if 0 <= at + (step > 0) < len(known) else None
            if axis is None:
                break
            way.append((at, axis))
            at += step
        else:
            Q = known[at] if at in range(len(known)) else None
            if Q is not None:
                yield Q, way[::-1]


def group_axes(way: Way) -> list[Way]:
    """A way cut where the axis changes its direction."""
    groups: list[Way] = []
    for place, axis in way:
        if groups and lines.is_parallel(groups[-1][-1][1], axis):
            groups[-1].append((place, axis))
        else:
            groups.append([(place, axis)])
    return groups


def _list_held_directions(chain: Chain, known: Known) -> Iterator[tuple[Array, list[Way], Array]]:
    """For each direction that is held in a body that may turn, or in a crank on one: ways to it, and the direction."""
    for k, body in enumerate(chain.bodies):
        for Q, way in list_ways(chain, known, k):
            if way:
                yield from ((Q, group_axes(way), d) for d in body.observed)
            for crank in body.cranks:
                yield from ((Q, group_axes([*way, (-1, crank.axis)]), d) for d in crank.observed)


def find_kept_angle(chain: Chain) -> tuple[Array, Array]:
    """Unit vectors a, fixed in the base, and c, of the chain's last body at the goal, whose angle the chain keeps:
    a · Q c = a · c, where all that turns the last body is axes along a, then axes along c.

    Raises :class:`LocusDerivationFailure` where other axes turn it too, or where a differs between branches.
    """
    pairs = [find_two_axes(chain, known) for known, _ in list_orientations(chain)]
    first = pairs[0]
    if any(not _is_same_orientation(a, first[0]) for a, *_ in pairs):
        raise LocusDerivationFailure("the axis with which its end keeps an angle differs between leg solutions")
    return first[:2]


def find_two_axes(chain: Chain, known: Known) -> tuple[Array, Array, Array]:
    """The two directions about which the last body turns against what is known, or against a direction that is held in
    a body that spins about it: the first as it is fixed in the base, the second at the goal; and the first at the
    goal."""
    base, parts = _find_turning(chain, known)
    if len(parts) != 2:
        raise LocusDerivationFailure(f"{len(parts)} axes turn its end")
    return base @ parts[0][0][1], parts[1][0][1], parts[0][0][1]


def find_one_axis(chain: Chain, known: Known) -> tuple[Array, Array]:
    """The only direction about which the last body turns so, as it is fixed in the base, and at the goal."""
    base, parts = _find_turning(chain, known)
    if len(parts) != 1:
        raise LocusDerivationFailure(f"{len(parts)} axes turn its end")
    return base @ parts[0][0][1], parts[0][0][1]


def _find_turning(chain: Chain, known: Known) -> tuple[Array, list[Way]]:
    """The orientation from which on the last body turns, and about what."""
    axes, base = list[Array](), np.eye(3)
    for body, Q in zip(chain.bodies[::-1], known[::-1], strict=True):
        if Q is not None:
            base = Q
            break
        if body.axis is None and not body.observed:
            raise LocusDerivationFailure("its end rotates freely")
        axes.append(body.observed[0] if body.axis is None else body.axis)
        if body.axis is None:
            break
    return base, group_axes([(0, axis) for axis in axes[::-1]])


def _orient_driven(chain: Chain, known: Known) -> Iterator[_Found]:
    """A body that a drive turns, on one of known orientation: as many solutions as the drive leaves angles."""
    for k, body in enumerate(chain.bodies):
        Q, axis = known[k - 1], body.axis
        if body.angles and axis is not None and Q is not None:
            yield _Found((k,), tuple(((Q @ rotate_about_axis(axis, angle),), gain) for angle, gain in body.angles))


def _orient_observed_once(chain: Chain, known: Known) -> Iterator[_Found]:
    """A direction held behind one axis keeps all bodies up to it from turning, where it is not along that axis."""
    for Q, parts, d in _list_held_directions(chain, known):
        if len(parts) == 1 and not lines.is_parallel(parts[0][0][1], d):
            turn = _turn_about(parts[0][0][1], d, Q.T @ d)
            place = parts[0][-1][0]
            if turn is None:
                yield _Found((), ())
            elif place >= 0:
                yield _Found((place,), (((Q @ turn[0],), turn[1]),))


def _orient_observed_twice(chain: Chain, known: Known) -> Iterator[_Found]:
    """A direction held behind two axes: two solutions."""
    for Q, parts, d in _list_held_directions(chain, known):
        if len(parts) == 2:
            both = _solve_cones(parts[0][0][1], parts[1][0][1], d, Q.T @ d)
            places = [part[-1][0] for part in parts]
            if both is not None:
                keep = [n for n, place in enumerate(places) if place >= 0]
                turns = [((Q @ first, Q @ first @ second), gain) for first, second, gain in both]
                yield _Found(
                    tuple(places[n] for n in keep), tuple((tuple(turn[n] for n in keep), gain) for turn, gain in turns)
                )


def _list_gaps(chain: Chain, known: Known) -> Iterator[tuple[Array, Array, list[Way]]]:
    """Two known bodies with no known one between: their orientations, and the way in groups (none over a ball)."""
    for start, end in pairwise([k for k, Q in enumerate(known) if Q is not None]):
        axes = [chain.bodies[k].axis for k in range(start + 1, end + 1)]
        Q, R = known[start], known[end]
        if Q is not None and R is not None and all(axis is not None for axis in axes):
            yield Q, R, group_axes([(start + 1 + n, axis) for n, axis in enumerate(axes) if axis is not None])


def _orient_between_two(chain: Chain, known: Known) -> Iterator[_Found]:
    """One axis between two known bodies must be that of their turn; of two, each has one angle."""
    for Q, R, parts in _list_gaps(chain, known):
        M = Q.T @ R
        if len(parts) == 1 and not _is_same_orientation(M @ parts[0][0][1], parts[0][0][1]):
            yield _Found((), ())
        elif len(parts) == 2:
            a, b = parts[0][0][1], parts[1][0][1]
            turn = _turn_about(a, b, M @ b)
            yield _Found((parts[0][-1][0],), () if turn is None else (((Q @ turn[0],), turn[1]),))


def _orient_between_three(chain: Chain, known: Known) -> Iterator[_Found]:
    """Three axes between two known bodies: two solutions."""
    for Q, R, parts in _list_gaps(chain, known):
        if len(parts) == 3:
            a, b, c = (part[0][1] for part in parts)
            both = _solve_cones(a, b, c, Q.T @ R @ c)
            if both is not None:
                yield _Found(
                    (parts[0][-1][0], parts[1][-1][0]),
                    tuple(((Q @ first, Q @ first @ second), gain) for first, second, gain in both),
                )


def _turn_about(axis: Array, start: Array, end: Array) -> tuple[Array, float] | None:
    """The turn about an axis that brings a unit vector to another, with its gain, or None.

    The angle is that of two vectors of length r normal to the axis, each off by at most 2 ε."""
    if not _is_same_orientation(np.array([axis @ start]), np.array([axis @ end])):
        return None
    if np.max(np.abs(start - end)) <= EXACT_INCIDENCE_TOL:
        return np.eye(3), 1.0
    angle = math.atan2(float(axis @ cross(start, end)), float(start @ end - (axis @ start) * (axis @ end)))
    return rotate_about_axis(axis, angle), 3.0 + 4.0 / float(np.linalg.norm(cross(axis, start)))


def _solve_cones(a: Array, b: Array, start: Array, end: Array) -> list[tuple[Array, Array, float]] | None:
    """All (R(a, α), R(b, β)) with R(a, α) R(b, β) start = end, with their gains, the one that turns nothing first; None
    where α or β is free. Raises :class:`LocusDerivationFailure` where two solutions nearly coincide.

    z = R(b, β) start has b·z = b·start, a·z = a·end and is of length 1: z = p a + q b ± s a × b. Errors ε of a, b,
    start and end leave δα (a × end) + δβ (R(a, α) b × end) of at most 6 ε.
    """
    c, alpha, beta = float(a @ b), float(a @ end), float(b @ start)
    sine = 1 - c * c
    p, q = (alpha - c * beta) / sine, (beta - c * alpha) / sine
    square = (1 - p * p - q * q - 2 * p * q * c) / sine
    if square < -RELATION_ANGLE_TOL:
        return []
    s = math.sqrt(max(square, 0.0))
    solutions = []
    ends = [p * a + q * b + sign * s * cross(a, b) for sign in (1.0, -1.0)]
    if any(lines.is_parallel(z, axis) for z in ends for axis in (a, b)):
        return None
    if EXACT_INCIDENCE_TOL < s <= RELATION_ANGLE_TOL:
        raise LocusDerivationFailure("two of its solutions nearly coincide")
    for z in sorted(ends[: 1 + (s > EXACT_INCIDENCE_TOL)], key=lambda z: float(np.linalg.norm(z - start))):
        second, first = _turn_about(b, start, z), _turn_about(a, z, end)
        if first is not None and second is not None:
            slopes = np.column_stack([cross(a, end), cross(first[0] @ b, end)])
            still = first[1] == second[1] == 1.0
            solutions.append((first[0], second[0], 1.0 if still else 4.0 + 9.0 / float(np.linalg.norm(slopes, -2))))
    return solutions


def _is_same_orientation(one: Array, other: Array) -> bool:
    return bool(np.max(np.abs(one - other)) <= RELATION_ANGLE_TOL)
