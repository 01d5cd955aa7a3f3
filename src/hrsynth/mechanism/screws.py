"""Screws of joints: their elementary one-dof joints, the wrenches they transmit, the twists they allow, and the
constraints of a mechanism on the twists of its links. Numbers may be floats or exact, as in
:mod:`hrsynth.geometry.screws`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..geometry.screws import find_normals, force, make_couple, make_rotation_twist, make_translation_twist
from ..geometry.vectors import Array, Numbers, cross, find_perpendicular
from .model import Joint, JointType

Geometry = Callable[[Joint], tuple[Numbers, Sequence[Numbers]]]
"""Centre and axes of a joint, in base axes, at a configuration."""


def split_elementary(
    kind: JointType, axes: Sequence[Array], across: Callable[[Array], Array] = find_perpendicular
) -> list[tuple[JointType, Array]]:
    """Return the one-dof joints, type and axis, of the chain that a joint is, one for each dof; ``across`` gives the
    direction of the first translation of a planar joint.

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


def list_transmitted_wrenches(kind: JointType, point: Numbers, axes: Sequence[Numbers]) -> list[Numbers]:
    """Return the wrenches that a joint transmits, 6 − dof of them: the allowed twists are reciprocal to all of them."""
    basis = np.eye(3, dtype=point.dtype)
    forces = [force(e, point) for e in basis]
    couples = [make_couple(e) for e in basis]
    match kind:
        case JointType.REVOLUTE:
            return forces + [make_couple(n) for n in find_normals(axes[0])]
        case JointType.PRISMATIC:
            return [force(n, point) for n in find_normals(axes[0])] + couples
        case JointType.UNIVERSAL:
            return [*forces, make_couple(cross(axes[0], axes[1]))]
        case JointType.CYLINDRICAL:
            return [wrench for n in find_normals(axes[0]) for wrench in (force(n, point), make_couple(n))]
        case JointType.SPHERICAL:
            return forces
        case JointType.PLANAR:
            return [force(axes[0], point), *(make_couple(n) for n in find_normals(axes[0]))]
        case JointType.FIXED:
            return forces + couples
        case _:
            return []


def list_allowed_twists(kind: JointType, point: Numbers, axes: Sequence[Numbers]) -> list[Numbers]:
    """Return the twists of the successor that a joint allows, one for each dof: reciprocal to all transmitted
    wrenches."""
    basis = np.eye(3, dtype=point.dtype)
    match kind:
        case JointType.REVOLUTE | JointType.UNIVERSAL:
            return [make_rotation_twist(axis, point) for axis in axes]
        case JointType.PRISMATIC:
            return [make_translation_twist(axes[0])]
        case JointType.CYLINDRICAL:
            return [make_translation_twist(axes[0]), make_rotation_twist(axes[0], point)]
        case JointType.SPHERICAL:
            return [make_rotation_twist(e, point) for e in basis]
        case JointType.PLANAR:
            return [*(make_translation_twist(n) for n in find_normals(axes[0])), make_rotation_twist(axes[0], point)]
        case JointType.FIXED:
            return []
        case _:
            return [*(make_translation_twist(e) for e in basis), *(make_rotation_twist(e, point) for e in basis)]


def build_constraint_matrix(joints: Sequence[Joint], place: Mapping[str, int], geometry: Geometry) -> Numbers:
    """Return the constraint matrix of joints on the stacked twists of links: A ξ = 0, shape (rows, 6 links).

    ``place`` numbers the links whose twists are unknown; a link that is not in it (the base) is fixed.
    """
    blocks = [np.zeros((0, 6 * len(place)))]
    for joint in joints:
        wrenches = np.array(list_transmitted_wrenches(joint.type, *geometry(joint))).reshape(-1, 6)
        block = np.zeros((len(wrenches), 6 * len(place)))
        for link, sign in ((joint.successor, 1), (joint.predecessor, -1)):
            if link in place:
                block[:, 6 * place[link] : 6 * place[link] + 6] += sign * wrenches
        blocks.append(block)
    return np.concatenate(blocks)
