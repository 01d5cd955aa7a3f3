"""Masses and inertias that no body has: simulators refuse them, leave the link out, or let it gain energy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...description import xml
from ...geometry.vectors import Array
from ...mechanism import graphs
from ...mechanism.model import JointType
from ..elements import InertialElement, list_inertials
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile
from .names import OWN

NEGATIVE_MOMENT_TOL = 1e-6
"""Relative negative second moment that an inertia may have: printed digits of a flat link."""


def list_moving_links(file: LintedFile) -> set[str]:
    """Return the links that some joint moves: those that are not fixed to the base."""
    graph = file.said
    if graph is None:
        return set()
    return {
        link
        for joint in graph.joints.values()
        if joint.kind is not JointType.FIXED and joint.in_tree
        for link in joint.links[1:]
    }


def _find_negative(file: LintedFile) -> Iterator[RuleHit]:
    for each in list_inertials(file):
        if each.mass is not None and (value := each.mass.value) is not None and value < 0:
            yield RuleHit(
                xml.get_line(each.element), f"link {each.link!r} has mass {value:g}", partial(_remove_sign, each)
            )


def _remove_sign(inertial: InertialElement) -> None:
    assert inertial.mass is not None
    inertial.mass.put((inertial.mass.text or "").lstrip("-"))


def _find_zero(file: LintedFile) -> Iterator[RuleHit]:
    moved = list_moving_links(file)
    for each in list_inertials(file):
        massless = each.mass is None or each.mass.value == 0
        if massless and each.link in moved and each.inertia is not None and np.any(each.inertia):
            yield RuleHit(xml.get_line(each.element), f"link {each.link!r} moves and has an inertia, but no mass")


def compute_second_moments(inertia: Array) -> tuple[Array, Array]:
    """Return eigenvalues and eigenvectors of ∫ r rᵀ dm = ½ tr(I) 1 − I; a negative eigenvalue breaks the triangle
    inequality of the principal moments."""
    return np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)


def _find_impossible(file: LintedFile) -> Iterator[RuleHit]:
    for each in list_inertials(file):
        if each.inertia is None or not np.any(each.inertia):
            continue
        values, _ = compute_second_moments(each.inertia)
        if values[0] < -NEGATIVE_MOMENT_TOL * float(np.max(np.abs(each.inertia))):
            moments = ", ".join(f"{value:.4g}" for value in np.linalg.eigvalsh(each.inertia))
            yield RuleHit(
                xml.get_line(each.element),
                f"link {each.link!r}: principal moments {moments}, of which one is "
                "negative or larger than the two others together",
                partial(_set_nearest, each),
            )


def _set_nearest(inertial: InertialElement) -> None:
    """Write the inertia with negative second moments set to zero."""
    assert inertial.inertia is not None
    values, vectors = compute_second_moments(inertial.inertia)
    kept = np.maximum(values, 0.0)
    floor = 2 * NEGATIVE_MOMENT_TOL * float(np.sum(kept))  # no rounding of the written digits is below zero again
    moments = vectors @ np.diag(np.maximum(kept, floor)) @ vectors.T
    matrix = np.trace(moments) * np.eye(3) - moments
    inertial.write((matrix + matrix.T) / 2)


def _find_missing(file: LintedFile) -> Iterator[RuleHit]:
    known = {each.link for each in list_inertials(file)}
    graph, root = file.said, file.root
    if not known or graph is None or root is None:
        return
    moved = list_moving_links(file)
    bonds = graphs.build_adjacency(graph.links, (j.links for j in graph.joints.values() if j.kind is JointType.FIXED))
    for name in [name for name in graph.links if name in moved and not OWN.search(name)]:
        line = graph.links[name].line
        if not known & graphs.find_component(bonds, name) and file.element(line, "link", "body", name=name) is not None:
            yield RuleHit(
                line,
                f"link {name!r} moves without <inertial>, which other links have, and so do the links fixed to it",
            )


RULES = (
    LintRule(
        "mass-negative",
        "error",
        "negative mass",
        "No body has one: simulators refuse the file, or the robot gains energy.",
        "drop the sign",
        _find_negative,
        fixable=True,
    ),
    LintRule(
        "mass-zero",
        "warning",
        "a moving link with an inertia but no mass",
        "Gazebo drops such links, with their joints; MuJoCo refuses them.",
        "write the link's mass, or omit <inertial> for a link without a body",
        _find_zero,
    ),
    LintRule(
        "inertia-triangle",
        "error",
        "an inertia that no body has",
        "Principal moments are not negative, and the largest is at most the sum of the two others (triangle "
        "inequality). MuJoCo and Gazebo refuse others; elsewhere simulations blow up.",
        "take the nearest inertia that a body can have: negative second moments set to zero",
        _find_impossible,
        fixable=True,
    ),
    LintRule(
        "inertia-missing",
        "warning",
        "a moving link without <inertial> in a file that has some",
        "When Gazebo reads a URDF it drops links without <inertial>, with all that is attached to them; MuJoCo "
        "refuses moving bodies without mass.",
        "write the link's mass and inertia",
        _find_missing,
    ),
)
