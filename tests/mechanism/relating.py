"""What the tests of relations share: relations proposed from the oracle's configurations, and how far one fails."""

from __future__ import annotations

import numpy as np

from hrsynth.geometry.vectors import Array, invert_pose, normalise_vector
from hrsynth.mechanism import Direction, Mechanism
from hrsynth.mechanism.incidences import Incidences, recognise
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.sensors import choose_default_segment
from hrsynth.mechanism.structural_incidences import GeometricIncidence
from oracle import Oracle


def walked(mechanism: Mechanism, n: int, seed: int) -> list[Array]:
    """The zero configuration and ``n`` others, by the oracle."""
    oracle = Oracle(mechanism)
    return [oracle.zero(), *oracle.random_walk(np.random.default_rng(seed), n, 0.15)]


def recognised(mechanism: Mechanism, states: list[Array], point: Array | None = None) -> Incidences:
    poses = {name: np.array([state[i] for state in states]) for i, name in enumerate(mechanism.links)}
    return recognise(mechanism, poses, segments(mechanism), point)


def segments(mechanism: Mechanism) -> list[Direction]:
    return [o for o in mechanism.observations if isinstance(o, Direction)]


def observed(mechanism: Mechanism) -> Mechanism:
    """The normal form with the default segments of its legs."""
    decomposition = decompose(reduce_to_normal_form(mechanism).mechanism)
    return decomposition.mechanism.changed(
        observations=tuple(choose_default_segment(decomposition, leg) for leg in decomposition.legs)
    )


def miss(tie: GeometricIncidence, mechanism: Mechanism, relations: Incidences, state: Array) -> float:
    """By how much a relation fails in a state of the oracle: a sine, or characteristic lengths; 0 where a centre of it
    is none of a joint."""
    moved = {name: state[i] @ invert_pose(link.pose) for i, (name, link) in enumerate(mechanism.links.items())}
    joints = {number: mechanism.joints[name] for name, number in relations.centres.items()}
    if any(number not in joints for number in (*(n for n, _ in tie.terms), *(tie.sight.points if tie.sight else ()))):
        return 0.0

    def axis(c: int, link: str | None = None) -> Array:
        found: Array = moved[link or relations.fixed[c][0]][:3, :3] @ relations.directions[c, 0]
        return found

    def centre(number: int) -> Array:
        point: Array = (moved[relations.hosts[number]] @ [*joints[number].point, 1.0])[:3] / mechanism.length
        return point

    def across(a: Array, b: Array) -> float:
        return float(np.linalg.norm(np.cross(a, b)))

    D = [axis(c) for c in tie.classes]
    match tie.kind:
        case "same":
            return across(D[0], axis(tie.classes[0], tie.links[1]))
        case "square":
            return abs(float(D[0] @ D[1]))
        case "plane":
            return abs(float(np.linalg.det(D)))
        case "seen":
            assert tie.sight is not None
            (o,) = (o for o in segments(mechanism) if o.link == tie.links[0])
            u = state[list(mechanism.links).index(o.link), :3, :3] @ o.direction
            if tie.sight.kind == "normal":
                return across(u, normalise_vector(np.cross(*D)))
            j, k = tie.sight.points
            along = centre(k) - centre(j)
            return across(u, normalise_vector(along - sum((d * (d @ along) for d in D), np.zeros(3))))
    vector = sum((sign * centre(number) for number, sign in tie.terms), np.zeros(3))
    match tie.kind:
        case "zero":
            return float(np.linalg.norm(vector))
        case "parallel":
            return across(vector, D[0])
        case _:
            return abs(float(vector @ D[0]))
