"""Locked legs, and the virtual legs of locked observations: the motions that they allow the platform.

An observation of the platform holds its link by wrenches alone: forces at a point B leave B a line, a plane, a point or
all of space, and moments leave turns about one axis, about all normals of one, or all (docs/pages/observations.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array, freeze_array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism.cameras import CameraObservation
from ..mechanism.observations.direction import SeenAxis
from ..results import Value
from ..tolerances import RELATION_ANGLE_TOL
from .named_vectors import BodyPoint, BodyVector, CrossProduct, NamedVector, Ray, TangentNormal, collect_poses

Sight = CameraObservation | SeenAxis
Place = tuple[str, tuple[float, ...]]
"""A point (m) in the frame of a link."""


@dataclass(frozen=True, eq=False, repr=False)
class LockedLeg(Value):
    """Locked leg, or the virtual leg of an observation of the platform.

    Its end ``tip`` on ``body`` may move along ``line``, or in the plane with this ``normal``, or not at all where
    ``fixed``; ``turns`` is the number of independent rotations about axes through the tip: of an observation those
    about the axis ``about``, or about all normals of ``upright``, else all. ``eye`` is its camera's centre.
    """

    label: str
    body: str
    tip: BodyPoint
    line: NamedVector | None
    normal: NamedVector | None
    fixed: bool
    turns: int
    about: NamedVector | None = None
    upright: NamedVector | None = None
    eye: BodyPoint | None = None
    virtual: bool = False
    """True if it belongs to an observation."""
    spins: bool = False
    """True if its end may also rotate about the observed direction at special poses."""
    held_by: tuple[str, ...] = ()
    """The labels of the observations that hold it."""

    @property
    def turning(self) -> NamedVector | None:
        """Vector that defines the rotations that an observation allows, None if it allows all, and for legs."""
        return self.about or self.upright

    @property
    def is_tip_free(self) -> bool:
        """Return True if the tip may move anywhere."""
        return self.line is None and self.normal is None and not self.fixed

    @property
    def features(self) -> tuple[NamedVector, ...]:
        """All named vectors of the leg."""
        every = (self.tip, self.line, self.normal, self.about, self.upright, self.eye)
        return tuple(f for f in every if f is not None)


def compute_forbidden_projectors(leg: LockedLeg, values: Mapping[str, Array]) -> Array:
    """N_i: the projector (n, 3, 3) on what the tip's velocity must not have."""
    if leg.line is not None:
        return compute_projectors(values[leg.line.symbol])
    if leg.normal is not None:
        n = values[leg.normal.symbol]
        return np.asarray(n[:, :, None] * n[:, None, :])
    return np.broadcast_to(np.eye(3) * leg.fixed, (len(values[leg.tip.symbol]), 3, 3))


def compute_rotation_projectors(leg: LockedLeg, values: Mapping[str, Array]) -> Array | None:
    """The projector (n, 3, 3) on what the angular velocity must not have, None where that is nothing."""
    if leg.about is not None:
        return compute_projectors(values[leg.about.symbol])
    if leg.upright is not None:
        e = values[leg.upright.symbol]
        return np.asarray(e[:, :, None] * e[:, None, :])
    return None


def compute_projectors(vectors: Array) -> Array:
    """I − v vᵀ for unit vectors (n, 3)."""
    projector: Array = np.eye(3) - vectors[:, :, None] * vectors[:, None, :]
    return projector


def build_virtual_legs(
    seen: Sequence[Sight], reference: str, bodies: Sequence[str], first: int, samples: Sequence[ClosedConfiguration]
) -> tuple[LockedLeg, ...] | None:
    """The virtual legs of observations of a body of the platform, numbered from ``first``; None where one has wrenches
    that have no name, or that are not those of its rates everywhere."""
    found, eyes = [], _list_camera_centres(seen, reference, samples[0].model.length)
    for number, each in enumerate(seen, first):
        leg = _build_virtual_leg(each, reference, bodies, str(number), eyes, samples)
        if leg is None:
            return None
        found.append(leg)
    return tuple(found)


def list_observations(observation_model: ObservationModel, base: str, bodies: Sequence[str]) -> tuple[Sight, ...]:
    """The observations between the base and a body of the platform, without the directions that legs have."""
    return tuple(
        o
        for o in observation_model.observations
        if isinstance(o, CameraObservation | SeenAxis)
        and not o.is_segment_direction
        and (ends := {o.link, o.seen_from or observation_model.reference}) & set(bodies)
        and base in ends
    )


def _list_camera_centres(seen: Sequence[Sight], reference: str, length: float) -> dict[Place, BodyPoint]:
    """The centres of all cameras, each once: C, or C1, C2 and so on."""
    found: dict[Place, str] = {}
    for o in seen:
        if isinstance(o, CameraObservation):
            named = f"camera {o.camera.name}" if o.camera else "the camera"
            found.setdefault(_place(o, reference), f"centre of {named}")
    return {
        key: BodyPoint(
            "C" if len(found) == 1 else f"C{n}",
            f"{words}, fixed in {key[0]}",
            key[0],
            freeze_array(np.array(key[1]) / length),
        )
        for n, (key, words) in enumerate(found.items(), 1)
    }


def _place(seen: CameraObservation, reference: str) -> Place:
    return seen.seen_from or reference, tuple(seen.view[:3, 3].tolist())


def _build_virtual_leg(
    seen: Sight,
    camera: str,
    bodies: Sequence[str],
    symbol: str,
    eyes: Mapping[Place, BodyPoint],
    samples: Sequence[ClosedConfiguration],
) -> LockedLeg | None:
    """The leg whose tip and turns are those that the observation's wrenches leave, at all samples."""
    link, reference = seen.link, seen.seen_from or camera
    body, length = link if link in bodies else reference, samples[0].model.length
    if isinstance(seen, CameraObservation):
        if not seen.whole:
            return None
        eye, place = eyes[_place(seen, camera)], seen.at / length
    else:
        eye, place = None, np.zeros(3)
    tip = BodyPoint(f"B{symbol}", f"point of {seen.leg} on {link}", link, freeze_array(place))
    forces, moments = [], []
    for at in samples:
        sighting = seen.sighting(at.pose(reference), at.pose(link))
        wrenches = np.array(seen.wrenches(sighting), dtype=float)
        couples = np.linalg.norm(wrenches[:, :3], axis=1) == 0
        forces.append(compute_range_basis(wrenches[~couples, :3].T, 1.0)[0])
        moments.append(compute_range_basis(wrenches[couples, 3:].T, 1.0)[0])
    if len({(F.shape[1], M.shape[1]) for F, M in zip(forces, moments, strict=True)}) != 1:
        return None
    candidates = _list_candidates(seen, symbol, link, reference, tip, eye, length)
    places = collect_poses(samples, [name for each in candidates for name in each.links])

    def named(normals: Sequence[Array]) -> NamedVector | None:
        """The vector along these (n of (3, 1)), or normal to these (n of (3, 2))."""
        along = np.array([N[:, 0] if N.shape[1] == 1 else np.cross(N[:, 0], N[:, 1]) for N in normals])
        return next(
            (
                each
                for each in candidates
                if np.max(np.linalg.norm(np.cross(each.value(places), along), axis=1)) < RELATION_ANGLE_TOL
            ),
            None,
        )

    held, stopped = forces[0].shape[1], moments[0].shape[1]
    at_tip, turn = (named(forces) if held in (1, 2) else None), (named(moments) if stopped in (1, 2) else None)
    if (held in (1, 2) and at_tip is None) or (stopped in (1, 2) and turn is None) or stopped == 3:
        return None
    return LockedLeg(
        seen.leg,
        body,
        tip,
        at_tip if held == 2 else None,
        at_tip if held == 1 else None,
        held == 3,
        3 - stopped,
        turn if stopped == 2 else None,
        turn if stopped == 1 else None,
        eye,
        True,
        held_by=(seen.leg,),
    )


def _list_candidates(
    seen: Sight, symbol: str, link: str, reference: str, tip: BodyPoint, eye: BodyPoint | None, length: float
) -> list[NamedVector]:
    """The ray to the point, the axis, the camera's z axis, the normal n of the plane of both first, and axis × n."""
    found: list[NamedVector] = []
    axis = seen.axis if isinstance(seen, CameraObservation) else seen.direction
    if eye is not None:
        found += [
            Ray(f"r{symbol}", f"ray from {eye.symbol} to {tip.symbol}", eye, tip),
            BodyVector(
                f"z{symbol}",
                f"z axis of {eye.meaning.removeprefix('centre of ')}",
                reference,
                freeze_array(seen.view[:3, 2]),
            ),
        ]
    if axis is not None:
        d = BodyVector(f"d{symbol}", f"axis of {seen.leg} on {link}", link, axis)
        found.append(d)
    if eye is not None and axis is not None:
        words, foot = f"normal of the plane of {eye.symbol} and the line of {seen.leg}", "the line"
        plane: NamedVector = CrossProduct(f"n{symbol}", words, found[0], d)
        if isinstance(seen, CameraObservation) and seen.radius is not None and not seen.rational:
            foot = "the edge"
            words = f"normal of the plane through {eye.symbol} that touches the cylinder of {seen.leg}"
            plane = TangentNormal(f"n{symbol}", words, eye, tip, d, seen.radius / length)
        found += [
            plane,
            CrossProduct(
                f"e{symbol}",
                f"direction from {eye.symbol} to the footpoint of its perpendicular on {foot} of {seen.leg}",
                d,
                plane,
            ),
        ]
    return found
