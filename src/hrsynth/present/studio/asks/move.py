"""Motion of the robot with closed loops: by sliders, by its platform, to a known or the zero configuration."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....errors import BadRequest
from ....geometry.so3 import rotation_of
from ....geometry.vectors import pose
from ....kinematics.limits import outside
from ....tolerances import SLIDER_ARRIVED
from ...view.scale import error, nothing, unit_of
from ...view.states import BEYOND_SLIDERS, Mover, Posed
from ..request import Request

PLACE = 7
"""Numbers of a displacement: position and unit quaternion."""


def answer(request: Request) -> dict[str, Any]:
    """Move the robot from ``here`` to the slider ``values``, or its platform to the displacement ``platform`` from the
    zero configuration; without either, describe ``here``."""
    mover = request.mover(request.flag("hidden"))
    here = request.here(mover)
    values = request.vector("values", len(mover.coordinates.places))
    place = request.vector("platform", PLACE)
    if values is not None and place is not None:
        raise BadRequest("values and platform: both are given", remedy="Give one of them.")
    if values is not None:
        if mover.far(values):
            raise BadRequest("values", values.tolist(), "values within reach of the sliders")
        here, reached = mover.send(here, values)
        return describe_pose(request, mover, here, bool(np.max(np.abs(reached - values), initial=0.0) > SLIDER_ARRIVED))
    if place is not None:
        return _draw_pose(request, mover, here, place)
    return describe_pose(request, mover, here)


def _draw_pose(request: Request, mover: Mover, here: Posed, place: Any) -> dict[str, Any]:
    size = float(np.linalg.norm(place[3:]))
    if not 0.5 < size < 2.0:
        raise BadRequest("platform", place.tolist(), "a position and a unit quaternion")
    link = mover.setup.motion.link
    wanted = pose(place[:3], rotation_of(place[[6, 3, 4, 5]] / size)) @ mover.setup.mechanism.links[link].pose
    if float(np.linalg.norm(place[:3])) > BEYOND_SLIDERS * mover.home.real.model.length:
        raise BadRequest("platform", place.tolist(), f"within {BEYOND_SLIDERS:g} characteristic lengths")
    found = mover.draw_to(here, wanted)
    apart = np.abs(found.real.pose(link) - wanted).max()
    return describe_pose(request, mover, found, bool(apart > SLIDER_ARRIVED))


def describe_pose(request: Request, mover: Mover, posed: Posed, stopped: bool = False) -> dict[str, Any]:
    """Return a configuration with all that is shown of it; ``stopped``: it did not reach its target."""
    return {
        "state": state(request, mover, posed),
        "here": request.describe_here(posed),
        "values": mover.read(posed).tolist(),
        "stopped": stopped,
        "residual": posed.real.residual,
    }


def state(request: Request, mover: Mover, posed: Posed) -> dict[str, Any]:
    """Return what is drawn of a configuration, the error of the platform, and the joints beyond their limits."""
    wrong = nothing(unit_of(mover.setup), "no leg is observed") if request.blind else error(mover.setup, posed.real)
    return {**mover.state(posed).scene(), "error": wrong, "beyond": outside(posed.real.model, posed.real.q)}
