"""Options and arguments that choose what is observed, and common ones of analyses, as a user gives them."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral
from typing import Annotated, Any

from ..description.observation_text import CAMERA, SENSOR
from ..errors import BadRequest
from ..mechanism import Mechanism
from ..mechanism.noise import Noise
from ..mechanism.pose import PoseLike
from ..options import OBSERVATION, option

LegsLike = Annotated[
    str | int | Iterable[str | int] | None,
    option(
        "Legs to observe (1,4), links, or all (default: what the file observes, else all; none with --sensor).",
        "LEGS",
        group=OBSERVATION,
    ),
]
"""Legs by their labels, or links, as a user gives them: one, several, a text with commas, ``all``; None: all."""
CameraLike = Annotated[
    str | Iterable[str] | None,
    option(
        "LINK: the link that carries the camera. Or a further, named camera NAME=LINK[@x,y,z[/r,p,y[/f[,w,h]]]]: "
        "position on the link (metres), roll, pitch, yaw (radians, or with deg), focal length, image width and height "
        "(pixels). Repeat for more.",
        "LINK|NAME=LINK@x,y,z/r,p,y/f,w,h",
        kind=list[str],
        group=OBSERVATION,
    ),
]
"""The link that carries the camera, or ``NAME=LINK@x,y,z/r,p,y``, or several of them."""
SensorLike = Annotated[
    str | Iterable[str] | None,
    option(
        "What else is observed: circle, depth, direction, distance, edge, edges, encoder, image_circle, "
        "image_line, inclination, line, point or position, with a point, an axis and a radius where the kind "
        "needs them (world: the base; for an encoder, its joint); repeat for more.",
        "[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius",
        kind=list[str],
        group=OBSERVATION,
    ),
]
"""``[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius``, or several of them."""
Seed = Annotated[int, option("Seed of the random configurations.", "NUMBER", low=0)]
BeginPose = Annotated[
    PoseLike | None,
    option(
        "Pose to start from instead of the zero configuration, perhaps in another operation mode; or mode:2.", "POSE"
    ),
]
StartPose = Annotated[
    PoseLike,
    option(
        "Start pose, such as x=0.02,y=0.1,z=-0.7; mode:2 is a mode with the directions at the goal.",
        "POSE",
    ),
]
NoiseLike = Annotated[
    str | Noise | None,
    option(
        "Largest errors of what else is observed, such as 0.3px (in images), 0.1deg or 1mm; separate several by "
        "commas.",
        "AMOUNT",
    ),
]
Jobs = Annotated[int | None, option("Processes (default: one per core).", low=1)]
"""Common options of analyses."""
POSES = (
    "or motors:0.1,0.2, or joints:NAME=0.3, or mode:2 as listed by modes; repeat for more "
    "(default: the zero configuration)."
)
POINTS = (
    "--camera eye=base@0.3,0.1,0 --sensor point:platform@0.1,0,0 --sensor point:platform@-0.1,0.1,0 "
    "--sensor point:platform@0,0.1,0.1"
)
"""Three image points by a camera beside the robot: an example."""


def normalise_names(given: LegsLike) -> tuple[str, ...] | None:
    """The legs or links that are given, ``("all",)`` for all legs, None where nothing is; raises ``BadRequest``."""
    if given is None:
        return None
    every: Any = given.split(",") if isinstance(given, str) else given if isinstance(given, Iterable) else [given]
    every = sorted(every, key=str) if isinstance(every, set | frozenset) else list(every)
    if not all(isinstance(each, str | Integral) and not isinstance(each, bool) for each in every):
        raise BadRequest(
            "--observe",
            given,
            "a label or a link such as 1 or 'rod_1a', several in a list or in a text with commas, or 'all'",
        )
    return tuple(str(each).strip() for each in every)


def list_requested_legs(robot: object, observe: LegsLike, sensor: SensorLike = None) -> tuple[str, ...] | None:
    """Return :func:`normalise_names`, but None for all legs if only segments are observed: the same request in one
    form."""
    names = normalise_names(observe)
    other = sensor is not None or (isinstance(robot, Mechanism) and bool(robot.observations))
    return None if names == ("all",) and not other else names


def normalise_texts(given: str | Iterable[str] | None) -> tuple[str, ...]:
    """One text or several; raises ``BadRequest`` for what is none."""
    every = (
        ()
        if given is None
        else tuple(given)
        if isinstance(given, Iterable) and not isinstance(given, str)
        else (given,)
    )
    if not all(isinstance(each, str) for each in every):
        raise BadRequest("--camera, --sensor", given, f"texts such as {SENSOR}, or {CAMERA}")
    return every
