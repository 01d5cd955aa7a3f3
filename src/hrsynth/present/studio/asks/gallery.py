"""Gallery: the shipped robots with drawings, and the files of the opened folder."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ....description import list_robots, load
from ....families.table import ROBOTS
from ....geometry.vectors import Array, orient_axis
from ....mechanism import JointType, Mechanism
from ....mechanism.legs import decompose
from ....mechanism.normal import normal_form
from ....mechanism.notation import parse
from ....tolerances import SAME_DIRECTION
from ...portrait import Portrait
from ..request import SHIPPED, Request

ENDINGS = (".urdf", ".xacro", ".sdf", ".xml", ".mjcf", ".usd", ".usda", ".usdc", ".usdz", ".yaml", ".yml")
"""Suffixes of files that may be robots."""
WIDTH, HEIGHT = 180, 130
"""Size of a drawing (pixels)."""


def answer(request: Request) -> dict[str, Any]:
    """Return all robots that can be opened by a click."""
    return {"robots": robots(), "files": [] if request.folder is None else files(request)}


@cache
def robots() -> list[dict[str, Any]]:
    """Return the shipped robots, sorted."""
    known = {each.name: each for each in ROBOTS}
    return [
        {
            "source": f"{SHIPPED}:{name}",
            "name": name,
            "title": name.replace("_", " "),
            "words": f"{parse(known[name].architecture)}, {known[name].dof} dof",
            "picture": picture(load(name)),
        }
        for name in list_robots()
    ]


def picture(robot: Mechanism) -> str:
    """Draw a robot, small."""
    decomposition = decompose(normal_form(robot).mechanism)
    portrait = Portrait.draw(decomposition.mechanism, decomposition.platform, (), flat(decomposition.mechanism))
    return portrait.svg(WIDTH, HEIGHT, robot.name)


def flat(robot: Mechanism) -> Array | None:
    """Return the normal of the plane to which the joints of a robot confine it, None if they do not."""
    turns = [joint.axis for joint in robot.joints.values() if joint.type is JointType.REVOLUTE]
    slides = [joint.axis for joint in robot.joints.values() if joint.type is JointType.PRISMATIC]
    if not turns or len(turns) + len(slides) < len(robot.joints):
        return None
    away = max([np.linalg.norm(np.cross(turns[0], axis)) for axis in turns] + [abs(turns[0] @ axis) for axis in slides])
    return orient_axis(turns[0]) if away < SAME_DIRECTION else None


def files(request: Request) -> list[str]:
    """List the robot files of the folder, by name; links that lead out of it are ignored."""
    assert request.folder is not None
    try:
        named = [path.name for path in request.folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file()]
    except OSError:
        return []
    top = request.folder.resolve()
    return sorted(name for name in named if (top / name).resolve().is_relative_to(top))
