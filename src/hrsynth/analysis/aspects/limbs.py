"""Legs that can be closed by hand: where the tip decides what the leg does, and whether it reaches at all.

Lengths in characteristic lengths, base axes. Each limb has a *reserve*, a number that is positive as long as the leg
reaches its tip and stays in its working mode, and carries one vector that the tip decides: the end of a crank or of a
carriage, or the direction of a rod that slides.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...geometry.balls import Field, normed, widened
from ...geometry.vectors import Array, cross, dot
from ...tolerances import FOLLOWED
from .carriage import Rigid


@dataclass(frozen=True, eq=False)
class Limb:
    """A leg's way from the base to a tip; ``branch`` ±1 is its working mode."""

    leg: str
    tip: Rigid
    branch: float
    fitted: bool = field(default=False, kw_only=True)
    """Whether the leg's form or its tip was found by fitting samples, not read from its joints."""

    def solve(self, tip: Field, branch: Field | float) -> tuple[Field, Field]:
        """The reserve (n,) and the vector that the tip decides (n, 3), for tips (n, 3)."""
        raise NotImplementedError

    def branches(self, tip: Array, carried: Array) -> Array:
        """The working modes (n,) in which tips and carried vectors (n, 3) go together."""
        with np.errstate(invalid="ignore", divide="ignore"):
            one, other = (self.solve(tip, sign)[1] for sign in (1.0, -1.0))
        return np.where(np.linalg.norm(one - carried, axis=1) <= np.linalg.norm(other - carried, axis=1), 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class OnRail(Limb):
    """A rod of constant length from a carriage at ``start`` + s ``axis`` to the tip: |tip − start − s axis| = rod."""

    start: Array
    axis: Array
    rod: float

    def solve(self, tip: Field, branch: Field | float) -> tuple[Field, Field]:
        start, axis, rod = (known(x, tip) for x in (self.start, self.axis, self.rod))
        D = tip - start
        along = dot(D, axis)
        across = D - along[:, None] * axis
        reserve = rod**2 - dot(across, across)
        return reserve, start + (along + branch * np.sqrt(reserve))[:, None] * axis


@dataclass(frozen=True, eq=False)
class OnCrank(Limb):
    """A rod of constant length from the end of a crank to the tip: the crank turns about ``axis`` through ``centre``
    with radius ``crank``; with D = tip − centre, D·(end − centre) = (|D|² + crank² − rod²) / 2."""

    centre: Array
    axis: Array
    crank: float
    rod: float

    def solve(self, tip: Field, branch: Field | float) -> tuple[Field, Field]:
        centre, axis, crank, rod = (known(x, tip) for x in (self.centre, self.axis, self.crank, self.rod))
        D = tip - centre
        flat = D - dot(D, axis)[:, None] * axis
        far = dot(flat, flat)
        share = (dot(D, D) + crank**2 - rod**2) * 0.5
        reserve = crank**2 * far - share * share
        aside = branch * np.sqrt(reserve)
        spoke = share[:, None] * flat + aside[:, None] * cross(np.broadcast_to(axis, D.shape), flat)
        return reserve, centre + spoke / far[:, None]


@dataclass(frozen=True, eq=False)
class Sliding(Limb):
    """A rod that slides along its own line, which passes the base point ``centre`` at the distance ``aside`` (on the
    side of axis × direction, where the leg turns about a base ``axis``): its direction u."""

    centre: Array
    axis: Array | None
    aside: float

    def solve(self, tip: Field, branch: Field | float) -> tuple[Field, Field]:
        D = tip - known(self.centre, tip)
        if self.axis is None:
            return dot(D, D), normed(D) * np.asarray(branch)[..., None]
        axis, aside = known(self.axis, tip), known(self.aside, tip)
        flat = D - dot(D, axis)[:, None] * axis
        far = dot(flat, flat)
        reserve = far - aside**2
        drawn = branch * np.sqrt(reserve)
        turned = cross(np.broadcast_to(axis, D.shape), flat)
        return reserve, (drawn[:, None] * flat - aside * turned) / far[:, None]


def known(value: Any, like: Field) -> Any:
    """A number or vector of the geometry, for numbers; among balls, one that holds what it was rounded from."""
    if like.dtype != object:
        return value
    found = widened(np.asarray(value, dtype=object), FOLLOWED)
    return found[()] if found.ndim == 0 else found


def on_rail(leg: str, tip: Rigid, tips: Array, ends: Array, axis: Array) -> OnRail | None:
    """The rod from points (n, 3) that move along a base direction to tips (n, 3), or None where it is no rod."""
    rods = np.linalg.norm(tips - ends, axis=1)
    paths = ends - ends[0]
    off = paths - (paths @ axis)[:, None] * axis
    if np.ptp(rods) > FOLLOWED or np.max(np.abs(off)) > FOLLOWED:
        return None
    return OnRail(leg, tip, 1.0, ends[0], axis, float(rods[0]))


def on_crank(leg: str, tip: Rigid, tips: Array, ends: Array, on: Array, axis: Array) -> OnCrank | None:
    """The rod from points (n, 3) that turn about a base axis to tips (n, 3), or None where it is no rod."""
    rods = np.linalg.norm(tips - ends, axis=1)
    spokes = ends - on
    height = spokes @ axis
    spokes = spokes - height[:, None] * axis
    cranks = np.linalg.norm(spokes, axis=1)
    if max(np.ptp(rods), np.ptp(cranks), np.ptp(height)) > FOLLOWED or cranks[0] < FOLLOWED:
        return None
    return OnCrank(leg, tip, 1.0, on + height[0] * axis, axis, float(cranks[0]), float(rods[0]))


def sliding(leg: str, tip: Rigid, tips: Array, centre: Array, axis: Array | None, directions: Array) -> Sliding | None:
    """The rod with directions (n, 3) that slides through tips (n, 3), or None where it does not."""
    D = tips - centre
    if np.max(np.linalg.norm(np.cross(D, directions), axis=1)) < FOLLOWED:
        return Sliding(leg, tip, 1.0, centre, None, 0.0)
    if axis is None or np.max(np.abs(directions @ axis)) > FOLLOWED:
        return None
    aside = np.cross(axis, directions)
    offsets = np.einsum("ij,ij->i", D, aside)
    return None if np.ptp(offsets) > FOLLOWED else Sliding(leg, tip, 1.0, centre, axis, float(offsets[0]))
