"""Legs as closed forms, recognised from their joints and verified at closed configurations.

The observed link is a rod from B to the leg's tip C on the platform; B is fixed in the base (the leg's length is free),
or lies on the circle or the line that the leg's first joint draws, at a fixed distance from C. A direction that never
changes, or turns with the platform, needs neither. What is proposed counts only if it gives the directions of all
configurations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ..closed_forms.legs import ClosedFormLeg, FixedDirection, OnCrank, OnRail, PlatformDirection, SlidingRod
from ..closed_forms.platform_points import PlatformPoint
from ..geometry.lines import project_to_line
from ..geometry.vectors import Array, invert_pose
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.normal import locate_centre_pair
from ..mechanism.observations.direction import Direction
from ..tolerances import GEOMETRY_DIFFERENCE_TOL
from .platform_coordinates import Frames, PlatformCoordinates

DRIVING = (JointType.REVOLUTE, JointType.PRISMATIC)


def recognise_leg(
    decomposition: LegDecomposition, leg: Leg, seen: Direction, coordinates: PlatformCoordinates, frames: Frames
) -> ClosedFormLeg | None:
    """The closed form of the leg, or None; ``seen`` is the direction observed in it."""
    X = frames[decomposition.mechanism.platform]
    p, R = coordinates.place(X)
    u = frames[seen.link][:, :3, :3] @ seen.direction
    for form in _list_candidates(decomposition, leg, coordinates, frames, p, R, u):
        if form is not None and _is_form_confirmed(form, p, R, u):
            if coordinates.rotations.shape[1] or isinstance(form, PlatformDirection):
                return form
            return replace(form, tip=PlatformPoint(True, np.zeros(3), R[0] @ form.tip.turned + form.tip.constant))
    return None


def _is_form_confirmed(form: ClosedFormLeg, p: Array, R: Array, u: Array) -> bool:
    """Return True if a form gives the directions u (m, 3) at poses, in one of its modes, at the first in its own."""
    with np.errstate(invalid="ignore", divide="ignore"):
        if not isinstance(form, OnCrank | OnRail):
            found, reached = form.direction(p, R)
            return bool(
                np.max(np.abs(u - found)) <= GEOMETRY_DIFFERENCE_TOL * (10 if isinstance(form, SlidingRod) else 1)
                and reached.all()
            )
        errors = []
        for mode in (form.mode, -form.mode):
            found, reached = replace(form, mode=mode).direction(p, R)
            errors.append(np.where(reached, np.max(np.abs(found - u), axis=1), np.inf))
    return bool(
        errors[0][0] <= 10 * GEOMETRY_DIFFERENCE_TOL and np.all(np.min(errors, axis=0) <= 10 * GEOMETRY_DIFFERENCE_TOL)
    )


def _list_candidates(
    decomposition: LegDecomposition,
    leg: Leg,
    coordinates: PlatformCoordinates,
    frames: Frames,
    p: Array,
    R: Array,
    u: Array,
) -> Iterator[ClosedFormLeg | None]:
    mechanism = decomposition.mechanism
    joints = [mechanism.joints[name] for name in leg.joints]
    feet = [joint for joint in joints if mechanism.base in joint.links]
    if sum(joint.type.has_translation for joint in joints) >= 2:
        yield FixedDirection(leg.label, axis=u[0])
        yield PlatformDirection(leg.label, axis=R[0].T @ u[0])
    if leg.takes_platform:
        yield PlatformDirection(leg.label, axis=R[0].T @ u[0])
    for one in feet:
        for joint in joints:
            yield _recognise_crossing(decomposition, leg, coordinates, one, joint, frames, R, u)
    for tip, ends in _list_tips(decomposition, leg, coordinates):
        for one in feet:
            for start in dict.fromkeys(map(tuple, (one.point, ends(one)[0]))):
                yield _recognise_sliding_rod(leg.label, tip(ends(one)[1]), np.array(start), p, R, u)
        for one in feet:
            crank = one.other(mechanism.base)
            for joint in joints:
                if joint is one or crank not in joint.links or one.type not in DRIVING:
                    continue
                near, far = ends(joint)
                end = tip(far)
                C = end.value(p, R)[0]
                for place in (near, joint.point):
                    yield _recognise_crank(
                        leg.label, end, one, crank, place, compute_displacement(frames, mechanism, crank), C, u[0]
                    )


Place = Callable[[Array], PlatformPoint]
Centres = Callable[[Joint], tuple[Array, Array]]


def _list_tips(
    decomposition: LegDecomposition, leg: Leg, coordinates: PlatformCoordinates
) -> Iterator[tuple[Place, Centres]]:
    """For each joint on the platform: what makes a point of the platform, and what gives the centres of another joint
    and of this one, as a segment sees them."""
    mechanism = decomposition.mechanism
    if decomposition.point is not None:
        frame = mechanism.links[mechanism.platform].pose
        place = frame[:3, :3] @ decomposition.point + frame[:3, 3]
        end = mechanism.joints_of(mechanism.platform)[0]
        yield (
            (lambda point: PlatformPoint(True, np.zeros(3), point - place)),
            (lambda other: locate_centre_pair(other, end)),
        )
        return
    body = coordinates.links.get(leg.platform_link)
    if body is None:
        return
    to_body = invert_pose(mechanism.links[leg.platform_link].pose)
    for name in leg.joints:
        if leg.platform_link in mechanism.joints[name].links:
            yield (
                (lambda point: body.point(to_body[:3, :3] @ point + to_body[:3, 3])),
                partial(_locate_centres, mechanism.joints[name]),
            )


def _locate_centres(tip: Joint, other: Joint) -> tuple[Array, Array]:
    return locate_centre_pair(other, tip)


def compute_displacement(frames: Frames, mechanism: Mechanism, link: str) -> Array:
    """The motion (4, 4) of a link from the zero configuration to the first one."""
    return frames[link][0] @ invert_pose(mechanism.links[link].pose)


def _recognise_crossing(
    decomposition: LegDecomposition,
    leg: Leg,
    coordinates: PlatformCoordinates,
    first: Joint,
    second: Joint,
    frames: Frames,
    R: Array,
    u: Array,
) -> PlatformDirection | None:
    """A crank whose end slides along a line of the platform: an R at the base, an R, a P."""
    mechanism, body = decomposition.mechanism, coordinates.links.get(leg.platform_link)
    kinds = "".join(mechanism.joints[name].type.value for name in leg.joints)
    crank = first.other(mechanism.base)
    if (
        body is None
        or sorted(kinds) != ["P", "R", "R"]
        or first is second
        or {first.type, second.type} != {JointType.REVOLUTE}
        or crank not in second.links
        or not body.turns
    ):
        return None

    def moved(link: str) -> Array:
        X = compute_displacement(frames, mechanism, link)
        return np.asarray(X[:3, :3] @ second.point + X[:3, 3])

    B, tip = (
        moved(crank),
        body.point(invert_pose(mechanism.links[leg.platform_link].pose)[:3] @ np.append(second.point, 1.0)),
    )
    C = moved(leg.platform_link)
    centre = project_to_line(second.point, first.point, first.axis)
    if np.linalg.norm(np.cross(B - C, u[0])) > GEOMETRY_DIFFERENCE_TOL * mechanism.length:
        return None
    radius = float(np.linalg.norm(second.point - centre))
    return PlatformDirection(
        leg.label,
        tip,
        _choose_sign(float((B - centre) @ u[0])),
        axis=R[0].T @ u[0],
        centre=centre,
        pivot=first.axis,
        radius=radius,
        crank=crank,
        place=second.point,
    )


def _recognise_sliding_rod(label: str, tip: PlatformPoint, start: Array, p: Array, R: Array, u: Array) -> SlidingRod:
    return SlidingRod(label, tip, _choose_sign(float((tip.value(p, R)[0] - start) @ u[0])), centre=start)


def _recognise_crank(
    label: str, tip: PlatformPoint, first: Joint, crank: str, place: Array, moved: Array, C: Array, u: Array
) -> OnCrank | OnRail | None:
    """The rod to C from the point that was at ``place`` on the link that the leg's first joint carries; C, u and the
    link's displacement are those of the first configuration."""
    B = moved[:3, :3] @ place + moved[:3, 3]
    rod, sense = float(np.linalg.norm(C - B)), _choose_sign(float((C - B) @ u))
    if rod == 0:
        return None
    if first.type is JointType.PRISMATIC:
        mode = -_choose_sign(float((C - B) @ first.axis))
        return OnRail(label, tip, mode, centre=place, axis=first.axis, rod=rod, sense=sense, crank=crank, place=place)
    centre = project_to_line(place, first.point, first.axis)
    mode = _choose_sign(float(np.cross(first.axis, C - centre) @ (B - centre)))
    return OnCrank(
        label,
        tip,
        mode,
        centre=centre,
        axis=first.axis,
        radius=float(np.linalg.norm(place - centre)),
        rod=rod,
        sense=sense,
        crank=crank,
        place=place,
    )


def _choose_sign(value: float) -> float:
    return -1.0 if value < 0 else 1.0
