"""A leg's part of Mᵀ: its direction u and how it changes with the platform's twists, in closed form.

A rod of constant length from B to the tip C has u = ±(C − B) / |BC|. C moves with y = v + ω × R b. B moves along the
tangent t of its circle or line, so fast that the rod keeps its length, u·(y − t s) = 0, and u̇ = ±(y − t s) / |BC|. The
rod of a leg that changes its length is the same with t = u.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..closed_forms.legs import ClosedFormLeg, FixedDirection, Number, OnCrank, OnRod, PlatformDirection
from ..geometry.components import Components, cross, dot, minus, plus, scale, sqrt, transform_vector


def compute_direction_rows(
    leg: ClosedFormLeg, p: Components, R: Components, twists: Components, number: Number
) -> tuple[Any, Components, list[Any]]:
    """Reach margin, u and the rows of Mᵀ (3, d) for twists (6, d) of the platform's point, m and rad."""
    d = len(twists) // 6
    if isinstance(leg, FixedDirection):
        return 1.0, number(leg.axis), [0.0] * (3 * d)
    arm = transform_vector(R, number(leg.tip.turned))
    D = plus(plus(p, arm), number(leg.tip.constant - leg.centre))
    columns = [([twists[i * d + j] for i in range(3)], [twists[(3 + i) * d + j] for i in range(3)]) for j in range(d)]
    seen = replace(leg, centre=np.zeros(3))
    if isinstance(leg, PlatformDirection):
        u: Components = transform_vector(R, number(leg.axis))
        margin = seen.at(D, number, leg.mode, *u)[0] if leg.radius else 1.0
        return margin, u, _order_by_rows([cross(w, u) for _, w in columns])
    margin, carried = seen.at(D, number, leg.mode)
    if isinstance(leg, OnRod):
        gain = leg.sense / number(leg.rod)
        u = scale(gain, minus(D, carried))
        axis = number(leg.axis)
        tangent = cross(axis, carried) if isinstance(leg, OnCrank) else axis
        slip = scale(gain / dot(tangent, u), tangent)
    else:
        u, gain = carried, leg.mode / sqrt(margin)
        slip = scale(gain, u)
    return (
        margin,
        u,
        _order_by_rows(
            [minus(scale(gain, y), scale(dot(u, y), slip)) for y in (plus(v, cross(w, arm)) for v, w in columns)]
        ),
    )


def _order_by_rows(columns: list[list[Any]]) -> list[Any]:
    return [column[i] for i in range(3) for column in columns]
