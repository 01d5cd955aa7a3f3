"""Where the tips of a hidden robot can be while its directions are held: curves found from the mechanism itself.

The pattern of the held legs names the tangent of each tip's path; here the whole path is written down, as a line or a
circle, and checked by moving the leg on its own along it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import NotConfined
from ...kinematics.configuration import ClosedConfiguration, closed, measure
from ...kinematics.locked import rezeroed
from ...kinematics.misses import alone
from ...kinematics.ranks import kernel_basis
from ...kinematics.relation import Question
from ...kinematics.twin import Twin
from ...mechanism import Observation
from ...mechanism.legs import Anatomy, dissect
from ...mechanism.vectors import Array
from ...tolerances import CLOSED, SAME_POINT, SAME_RELATION, SOLVED
from ..singularity.features import Carried, Feature, Spot, Tangent, poses_at
from ..singularity.structure import HeldLeg, Structure
from .curves import Circle, Curve, Line, Point

MOVES = (-0.4, -0.15, 0.15, 0.4)
"""How far a leg is moved along its freedom to check the path of its tip (characteristic lengths, radians)."""


@dataclass(frozen=True, eq=False)
class Tip:
    """The tip of a held leg: the body that carries it, where (3,) in the body's frame (m), and its curve in the base
    frame (m)."""

    leg: str
    body: str
    place: Array
    curve: Curve


@dataclass(frozen=True, eq=False)
class Confinement:
    """The platform at one configuration with its directions held: tips on curves.

    ``motion`` is that of :class:`Structure`; ``plane`` the normal of planar motion; ``slide`` the circle on which the
    second body's origin moves relative to the first's; ``bodies`` their names.
    """

    goal: ClosedConfiguration
    motion: str
    tips: tuple[Tip, ...]
    bodies: tuple[str, ...]
    plane: Array | None = None
    slide: Circle | None = None


def confinement(anatomy: Anatomy, question: Question, structure: Structure, goal: ClosedConfiguration) -> Confinement:
    """The curves of all watched legs' tips with the directions held at their values at ``goal``.

    Raises ``NotConfined`` where a tip's path is no point, line or circle, or the platform's motion none of those known.
    """
    name = anatomy.mechanism.name
    if structure.motion == "other":
        raise NotConfined(name, "the pattern of its legs is none of those known")
    tips = tuple(_tip(anatomy, question, leg, goal) for leg in structure.legs)
    plane = None if structure.plane is None else _value(structure.plane, goal)
    slide = None if structure.slide is None else _slide(structure, goal)
    return Confinement(goal, structure.motion, tips, structure.bodies, plane, slide)


def _tip(anatomy: Anatomy, question: Question, leg: HeldLeg, goal: ClosedConfiguration) -> Tip:
    B = _value(leg.tip, goal) * goal.twin.length
    X = goal.pose(leg.body)
    place = X[:3, :3].T @ (B - X[:3, 3])
    paths = _held_paths(anatomy, question, leg, goal, place)
    worst = np.inf
    for curve in _candidates(leg, B, goal):
        miss = max((float(np.linalg.norm(curve.miss(point))) for point in paths), default=0.0) / goal.twin.length
        if miss <= SAME_RELATION:
            return Tip(leg.label, leg.body, place, curve)
        worst = min(worst, miss)
    what = "moves on a surface" if worst == np.inf else f"leaves its curve by {worst:.2g} characteristic lengths"
    raise NotConfined(anatomy.mechanism.name, f"the tip of leg {leg.label} {what}")


def _candidates(leg: HeldLeg, tip: Array, goal: ClosedConfiguration) -> Iterator[Curve]:
    """Curves with the tangent that the pattern names: a circle about the axis with the tip on it, or with the tip
    carried along by the end of the link that turns."""
    if leg.fixed:
        yield Point(tip)
    elif isinstance(leg.line, Carried):
        yield Line(tip, _value(leg.line, goal))
    elif isinstance(leg.line, Tangent):
        yield _circle(leg.line, tip, goal)
        axis, on = _value(leg.line.axis, goal), _value(leg.line.start, goal) * goal.twin.length
        spoke = tip - on - axis * float(axis @ (tip - on))
        if np.linalg.norm(spoke) > SAME_POINT * goal.twin.length:
            yield Circle(tip - spoke, axis, float(np.linalg.norm(spoke)), spoke)


def _circle(tangent: Tangent, tip: Array, goal: ClosedConfiguration) -> Circle:
    """The circle on which ``tip`` moves when it translates with the end of a link that turns about an axis."""
    length = goal.twin.length
    axis = _value(tangent.axis, goal)
    on, end = _value(tangent.start, goal) * length, _value(tangent.end, goal) * length
    spoke = end - on - axis * float(axis @ (end - on))
    return Circle(tip - spoke, axis, float(np.linalg.norm(spoke)), spoke)


def _slide(structure: Structure, goal: ClosedConfiguration) -> Circle:
    """The circle of the second body's origin relative to the first's."""
    assert isinstance(structure.slide, Tangent)
    first, second = (goal.pose(body)[:3, 3] for body in structure.bodies)
    return _circle(structure.slide, second - first, goal)


@dataclass(frozen=True, eq=False)
class _Held:
    """Measured values that are to stay as they are."""

    reference: str
    measured: Sequence[tuple[Observation, Array]]

    def rows(self, twin: Twin, q: Array) -> tuple[Array, Array]:
        _, _, values, rates = measure(twin, q, self.reference, [o for o, _ in self.measured])
        errors = [value - wanted for value, (_, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.vstack(rates)


def _held_paths(anatomy: Anatomy, question: Question, leg: HeldLeg, goal: ClosedConfiguration,
                place: Array) -> list[Array]:
    """Positions of a tip when its leg alone, with what is measured held, is moved along each of its freedoms."""
    own = [o for o in question.observations if o.leg == leg.label]
    rest = dissect(rezeroed(goal))
    twin = Twin(alone(rest, rest.leg(leg.label)), goal.twin.length)
    _, _, values, _ = measure(twin, twin.q0, question.reference, own)
    held = _Held(question.reference, tuple(zip(own, values, strict=True)))
    start = ClosedConfiguration.of(twin, twin.q0, SAME_RELATION)
    free, _ = kernel_basis(np.vstack([twin.jacobian(start.q), held.rows(twin, start.q)[1]]))
    found = []
    for direction in free.T:
        for size in MOVES:
            q, residual = closed(twin, twin.moved(start.q, size * direction), held, tolerance=SOLVED)
            X = twin.pose(q, leg.body)
            if residual <= CLOSED:
                found.append(X[:3, :3] @ place + X[:3, 3])
    return found


def _value(feature: Feature | Spot, goal: ClosedConfiguration) -> Array:
    value: Array = feature.value(poses_at([goal], feature.links))[0]
    return value
