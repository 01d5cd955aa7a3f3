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
from ....mechanism.normal import reduce_to_normal_form
from ....mechanism.notation import parse
from ....tolerances import DIRECTION_SINE_TOL
from ...portrait import Portrait
from ..request import SHIPPED, Request

ENDINGS = (".urdf", ".xacro", ".sdf", ".xml", ".mjcf", ".usd", ".usda", ".usdc", ".usdz", ".yaml", ".yml")
"""Suffixes of files that may be robots."""
WIDTH, HEIGHT = 180, 130
"""Size of a drawing (pixels)."""


def answer(request: Request) -> dict[str, Any]:
    """Return all robots that can be opened by a click."""
    return {"robots": list_gallery(), "files": [] if request.folder is None else list_robot_files(request)}


@cache
def list_gallery() -> list[dict[str, Any]]:
    """Return the shipped robots, sorted."""
    known = {each.name: each for each in ROBOTS}
    return [
        {
            "source": f"{SHIPPED}:{name}",
            "name": name,
            "title": name.replace("_", " "),
            "words": f"{parse(known[name].architecture)}, {known[name].dof} dof",
            "picture": draw_thumbnail(load(name)),
        }
        for name in list_robots()
    ]


def draw_thumbnail(robot: Mechanism) -> str:
    """Draw a robot, small."""
    decomposition = decompose(reduce_to_normal_form(robot).mechanism)
    portrait = Portrait.draw(
        decomposition.mechanism, decomposition.platform, (), find_confining_plane(decomposition.mechanism)
    )
    return portrait.svg(WIDTH, HEIGHT, robot.name)


def find_confining_plane(robot: Mechanism) -> Array | None:
    """Return the normal of the plane of motion if all joints are R along one direction and P across it (at least one
    R), else None."""
    turns = [joint.axis for joint in robot.joints.values() if joint.type is JointType.REVOLUTE]
    slides = [joint.axis for joint in robot.joints.values() if joint.type is JointType.PRISMATIC]
    if not turns or len(turns) + len(slides) < len(robot.joints):
        return None
    away = max([np.linalg.norm(np.cross(turns[0], axis)) for axis in turns] + [abs(turns[0] @ axis) for axis in slides])
    return orient_axis(turns[0]) if away < DIRECTION_SINE_TOL else None


def list_robot_files(request: Request) -> list[str]:
    """List the robot files of the folder, by name; links that lead out of it are ignored."""
    assert request.folder is not None
    try:
        named = [path.name for path in request.folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file()]
    except OSError:
        return []
    top = request.folder.resolve()
    return sorted(name for name in named if (top / name).resolve().is_relative_to(top))
