"""Motion of the robot with closed loops: by sliders, by its platform, to a known or the zero configuration."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....errors import BadRequest
from ....geometry.so3 import convert_from_quaternion
from ....geometry.vectors import build_pose
from ....kinematics.limits import list_joints_beyond
from ....tolerances import SLIDER_TARGET_TOL
from ...view.scale import choose_error_unit, describe_no_error, describe_pose_error
from ...view.states import SLIDER_DISTANCE_MAX, Mover, RealAndHiddenState
from ..request import Request

LINK_POSE_NUMBERS_COUNT = 7
"""Numbers of a displacement: position and unit quaternion."""


def answer(request: Request) -> dict[str, Any]:
    """Move the robot from ``here`` to the slider ``values``, or its platform to the displacement ``platform`` from the
    zero configuration; without either, describe ``here``."""
    mover = request.mover(request.has_flag("hidden"))
    here = request.here(mover)
    values = request.vector("values", len(mover.coordinates.places))
    place = request.vector("platform", LINK_POSE_NUMBERS_COUNT)
    if values is not None and place is not None:
        raise BadRequest("values and platform: both are given", remedy="Give one of them.")
    if values is not None:
        if mover.is_beyond_sliders(values):
            raise BadRequest("values", values.tolist(), "values within reach of the sliders")
        here, reached = mover.send(here, values)
        return describe_pose(
            request, mover, here, bool(np.max(np.abs(reached - values), initial=0.0) > SLIDER_TARGET_TOL)
        )
    if place is not None:
        return _draw_pose(request, mover, here, place)
    return describe_pose(request, mover, here)


def _draw_pose(request: Request, mover: Mover, here: RealAndHiddenState, place: Any) -> dict[str, Any]:
    size = float(np.linalg.norm(place[3:]))
    if not 0.5 < size < 2.0:
        raise BadRequest("platform", place.tolist(), "a position and a unit quaternion")
    link = mover.setup.motion.link
    wanted = (
        build_pose(place[:3], convert_from_quaternion(place[[6, 3, 4, 5]] / size))
        @ mover.setup.mechanism.links[link].pose
    )
    if float(np.linalg.norm(place[:3])) > SLIDER_DISTANCE_MAX * mover.home.real.model.length:
        raise BadRequest("platform", place.tolist(), f"within {SLIDER_DISTANCE_MAX:g} characteristic lengths")
    found = mover.draw_to(here, wanted)
    apart = np.abs(found.real.pose(link) - wanted).max()
    return describe_pose(request, mover, found, bool(apart > SLIDER_TARGET_TOL))


def describe_pose(request: Request, mover: Mover, posed: RealAndHiddenState, stopped: bool = False) -> dict[str, Any]:
    """Return a configuration with all that is shown of it; ``stopped``: it did not reach its target."""
    return {
        "state": describe_state(request, mover, posed),
        "here": request.describe_here(posed),
        "values": mover.read(posed).tolist(),
        "stopped": stopped,
        "residual": posed.real.residual,
    }


def describe_state(request: Request, mover: Mover, posed: RealAndHiddenState) -> dict[str, Any]:
    """Return what is drawn of a configuration, the error of the platform, and the joints beyond their limits."""
    wrong = (
        describe_no_error(choose_error_unit(mover.setup), "no leg is observed")
        if request.has_no_observation
        else describe_pose_error(mover.setup, posed.real)
    )
    return {**mover.state(posed).scene(), "error": wrong, "beyond": list_joints_beyond(posed.real.model, posed.real.q)}
