"""Motion of the robot with closed loops: by sliders, by its motors or its platform, to a known or the zero
configuration."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....errors import BadRequest
from ....geometry.so3 import convert_from_quaternion
from ....geometry.vectors import build_pose
from ....kinematics.joint_coordinates import FileCoordinates, track_to_joints
from ....kinematics.limits import list_joints_beyond
from ....mechanism.pose import JointPose
from ....tolerances import SLIDER_TARGET_TOL
from ...view.scale import choose_error_unit, describe_no_error, describe_pose_error
from ...view.states import SLIDER_DISTANCE_MAX, Mover, RealAndHiddenState
from ..commands import format_commands
from ..request import Request

LINK_POSE_NUMBERS_COUNT = 7
"""Numbers of a displacement: position and unit quaternion."""


def answer(request: Request) -> dict[str, Any]:
    """Move the robot from ``here`` to the slider ``values``, or its platform to the displacement ``platform`` from the
    zero configuration, or from the zero configuration to the coordinates ``motors``; without any, describe ``here``."""
    mover = request.mover(request.has_flag("hidden"))
    here = request.here(mover)
    values = request.vector("values", len(mover.coordinates.places))
    place = request.vector("platform", LINK_POSE_NUMBERS_COUNT)
    given = [name for name in ("values", "platform", "motors") if request.fields.get(name) is not None]
    if len(given) > 1:
        raise BadRequest("more than one target", given, "one of them")
    if values is not None:
        if mover.is_beyond_sliders(values):
            raise BadRequest("values", values.tolist(), "values within reach of the sliders")
        here, reached = mover.send(here, values)
        return describe_pose(
            request, mover, here, bool(np.max(np.abs(reached - values), initial=0.0) > SLIDER_TARGET_TOL)
        )
    if place is not None:
        return _draw_pose(request, mover, here, place)
    if given:
        return _drive_motors(request, mover)
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


def _drive_motors(request: Request, mover: Mover) -> dict[str, Any]:
    motors = request.vector("motors", len(read_motors(mover.home)))
    assert motors is not None
    asked = JointPose.of("motors", motors.tolist())
    at, _ = track_to_joints(mover.home.real, mover.setup.motion, asked)
    return {
        **describe_pose(request, mover, mover.with_hidden(at)),
        **format_commands(request, "check", at=str(asked)),
    }


def read_motors(posed: RealAndHiddenState) -> list[float]:
    """Return the coordinates of the motors, as the file counts them, in its order."""
    return [
        number for value in FileCoordinates.of(posed.real).motors.values() for number in np.atleast_1d(value).tolist()
    ]


def describe_pose(request: Request, mover: Mover, posed: RealAndHiddenState, stopped: bool = False) -> dict[str, Any]:
    """Return a configuration with all that is shown of it; ``stopped``: it did not reach its target."""
    return {
        "state": describe_state(request, mover, posed),
        "here": request.describe_here(posed),
        "values": mover.read(posed).tolist(),
        "motors": read_motors(posed),
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
