"""Servo run from the present to a desired configuration, with the image of its camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ....errors import BadRequest
from ....geometry.vectors import Array
from ....simulation.camera import Camera, Cylinder, cylinders, place_camera
from ....simulation.outcome import MODE
from ....simulation.servo import ServoTask
from ....tolerances import SLIDER_TARGET_TOL
from ...view.states import Mover, RealAndHiddenState
from ..commands import NONE, format_commands, format_pose, is_reproduced_by_pose
from ..request import Request
from .move import describe_state

RUN_FRAMES_COUNT = 60
"""Frames of a run."""
IMAGE_DISTANCE_TOL = 1.0
"""Distance in the image from which two images of a leg are called different (pixels)."""

Poses = Callable[[str], Array]


def answer(request: Request) -> dict[str, Any]:
    """Return the run from ``here`` to the configuration ``end``, or to the coordinates ``goal``."""
    setup, mover = request.seeing(), request.mover(request.has_flag("hidden"))
    start = request.here(mover)
    end = _send_to(request, mover, start) if request.fields.get("end") is None else request.here(mover, "end")
    task = ServoTask.between(setup, start.real, end.real)
    found = task.run()
    reference, rods = setup.mechanism.reference, cylinders(setup.mechanism, setup.observed)
    eye = place_camera(rods, reference, (start.real.pose, end.real.pose))
    last = len(found.run.times) - 1
    chosen = sorted({round(last * part) for part in np.linspace(0, 1, RUN_FRAMES_COUNT)})
    way = mover.follow_hidden(start, [found.run.configurations[i] for i in chosen])
    frames = [
        {
            **describe_state(request, mover, posed),
            "here": request.describe_here(posed),
            "t": float(found.run.times[i]),
            "e": found.run.commands[i].size,
            "image": project_legs(eye, reference, rods, posed.real.pose),
        }
        for i, posed in zip(chosen, way, strict=False)
    ]
    seen = project_legs(eye, reference, rods, end.real.pose)
    poses = [format_pose(setup, each.real) for each in (start, end)]
    same = format_commands(request, "servo", start=poses[0], goal=poses[1])
    return {
        "frames": frames,
        "desired": seen,
        "size": [eye.width, eye.height],
        "kind": found.outcome,
        "words": f"Outcome: {found.outcome} ({found.run_outcome.reason}), after {found.run.times[-1]:.3g} s"
        + describe_image(found.outcome, frames[-1]["image"], seen),
        **(same if is_reproduced_by_pose(setup, start.real, end.real) else NONE),
    }


def describe_image(
    outcome: str, reached: list[list[list[float]] | None], desired: list[list[list[float]] | None]
) -> str:
    """Describe, of a run that ends in another assembly mode, how far the legs are from their desired places in the
    image; their directions agree."""
    pairs = [(a, b) for a, b in zip(reached, desired, strict=True) if a is not None and b is not None]
    apart = max((float(np.linalg.norm(np.subtract(a, b), axis=1).max()) for a, b in pairs), default=0.0)
    if outcome != MODE or apart < IMAGE_DISTANCE_TOL:
        return ""
    return (
        f". All observed directions agree with the goal, but the camera image does not: legs lie up to {apart:.0f}"
        " pixels from their dashed places, since the controller compares directions only."
    )


def _send_to(request: Request, mover: Mover, start: RealAndHiddenState) -> RealAndHiddenState:
    """Track the robot to the coordinates ``goal``."""
    goal = request.vector("goal", len(mover.coordinates.places))
    if goal is None or mover.is_beyond_sliders(goal):
        raise BadRequest("goal", None if goal is None else goal.tolist(), "values within reach of the sliders")
    end, reached = mover.send(start, goal)
    if np.max(np.abs(reached - goal), initial=0.0) > SLIDER_TARGET_TOL:
        raise BadRequest("goal: not reached from the start", goal.tolist(), remedy="Choose a goal closer to the start.")
    return end


def project_legs(
    eye: Camera, reference: str, rods: tuple[Cylinder, ...], poses: Poses
) -> list[list[list[float]] | None]:
    """Return the two ends of each observed leg in the image (pixels); None for one that is behind it."""
    found: list[list[list[float]] | None] = []
    for rod in rods:
        ends = eye.project(poses(reference), poses, rod)
        found.append(np.round(eye.pixels(ends), 2).tolist() if np.all(ends[:, 2] > 0) else None)
    return found
