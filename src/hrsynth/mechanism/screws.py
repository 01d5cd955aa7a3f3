"""Screws of joints: the one-freedom joints that a joint is a chain of, the wrenches it transmits, the twists it allows,
and the constraints of a mechanism on the twists of its links. Numbers may be floats or exact, as in
:mod:`hrsynth.geometry.screws`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..geometry.screws import couple, force, normals, rotation, translation
from ..geometry.vectors import Array, Numbers, cross, perpendicular
from .model import Joint, JointType

Geometry = Callable[[Joint], tuple[Numbers, Sequence[Numbers]]]
"""The centre and the axes of a joint, in base axes, at the configuration in question."""


def elementary(
    kind: JointType, axes: Sequence[Array], across: Callable[[Array], Array] = perpendicular
) -> list[tuple[JointType, Array]]:
    """The one-freedom joints, type and axis, that a joint is a chain of, one a freedom; ``across`` gives the direction
    in which a planar joint slides first.

    ``axes`` are those of the joint in the frame of the first link of the chain, and so are the axes found.
    """
    turn, slide = JointType.REVOLUTE, JointType.PRISMATIC
    match kind:
        case JointType.REVOLUTE | JointType.PRISMATIC:
            return [(kind, axes[0])]
        case JointType.UNIVERSAL:
            return [(turn, axes[0]), (turn, axes[1])]
        case JointType.SPHERICAL:
            return [(turn, axis) for axis in np.eye(3)]
        case JointType.FREE:
            return [*((slide, axis) for axis in np.eye(3)), *((turn, axis) for axis in np.eye(3))]
        case JointType.CYLINDRICAL:
            return [(slide, axes[0]), (turn, axes[0])]
        case JointType.PLANAR:
            first = across(axes[0])
            return [(slide, first), (slide, cross(axes[0], first)), (turn, axes[0])]
    return []


def transmitted_wrenches(kind: JointType, point: Numbers, axes: Sequence[Numbers]) -> list[Numbers]:
    """The wrenches that a joint transmits, 6 − freedoms of them: what it allows is reciprocal to all of them."""
    basis = np.eye(3, dtype=point.dtype)
    forces = [force(e, point) for e in basis]
    couples = [couple(e) for e in basis]
    match kind:
        case JointType.REVOLUTE:
            return forces + [couple(n) for n in normals(axes[0])]
        case JointType.PRISMATIC:
            return [force(n, point) for n in normals(axes[0])] + couples
        case JointType.UNIVERSAL:
            return [*forces, couple(cross(axes[0], axes[1]))]
        case JointType.CYLINDRICAL:
            return [wrench for n in normals(axes[0]) for wrench in (force(n, point), couple(n))]
        case JointType.SPHERICAL:
            return forces
        case JointType.PLANAR:
            return [force(axes[0], point), *(couple(n) for n in normals(axes[0]))]
        case JointType.FIXED:
            return forces + couples
        case _:
            return []


def allowed_twists(kind: JointType, point: Numbers, axes: Sequence[Numbers]) -> list[Numbers]:
    """The twists of the successor that a joint allows, one a freedom: reciprocal to all that it transmits."""
    basis = np.eye(3, dtype=point.dtype)
    match kind:
        case JointType.REVOLUTE | JointType.UNIVERSAL:
            return [rotation(axis, point) for axis in axes]
        case JointType.PRISMATIC:
            return [translation(axes[0])]
        case JointType.CYLINDRICAL:
            return [translation(axes[0]), rotation(axes[0], point)]
        case JointType.SPHERICAL:
            return [rotation(e, point) for e in basis]
        case JointType.PLANAR:
            return [*(translation(n) for n in normals(axes[0])), rotation(axes[0], point)]
        case JointType.FIXED:
            return []
        case _:
            return [*(translation(e) for e in basis), *(rotation(e, point) for e in basis)]


def constraints(joints: Sequence[Joint], place: Mapping[str, int], geometry: Geometry) -> Numbers:
    """The constraint matrix of joints on the stacked twists of links: A ξ = 0, shape (rows, 6 links).

    ``place`` numbers the links whose twists are unknown; a link that is not in it (the base) rests.
    """
    blocks = [np.zeros((0, 6 * len(place)))]
    for joint in joints:
        wrenches = np.array(transmitted_wrenches(joint.type, *geometry(joint))).reshape(-1, 6)
        block = np.zeros((len(wrenches), 6 * len(place)))
        for link, sign in ((joint.successor, 1), (joint.predecessor, -1)):
            if link in place:
                block[:, 6 * place[link] : 6 * place[link] + 6] += sign * wrenches
        blocks.append(block)
    return np.concatenate(blocks)
