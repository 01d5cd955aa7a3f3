"""Annotations that the writers add to foreign files and the readers take back: platform, camera, observed directions,
base."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from urllib.parse import quote, unquote

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import freeze_array, invert_pose
from ..mechanism.cameras import NamedCamera
from ..mechanism.model import JointType, Mechanism, Motor
from ..mechanism.observations.direction import Direction
from ..tolerances import VECTOR_LENGTH_MIN
from . import numerals
from .elements import TURNS
from .jointgraph import FrameSpec, JointGraph
from .observation_text import list_observe_attributes, parse_observe_attributes

NAMESPACE = "urn:hrsynth"
PREFIX = "hrsynth"
IMAGE = ("focal", "width", "height")
"""Attributes of a camera's image."""


def drop_world(graph: JointGraph) -> JointGraph:
    """Return the graph based on the only link that a fixed joint holds in the world, if nothing else or only free
    joints hang on the world; these then hang on that link."""
    at_world = [joint for joint in graph.joints.values() if graph.base in joint.links]
    welds = [joint for joint in at_world if joint.type is JointType.FIXED]
    floating = [joint for joint in at_world if joint.type is JointType.FREE]
    if graph.base is None or len(welds) != 1 or len(at_world) != 1 + len(floating) or len(graph.links) <= 2:
        return graph
    weld, world = welds[0], graph.base
    del graph.joints[weld.name], graph.links[world]
    here = weld.links.index(world)
    graph.base = weld.links[1 - here]
    X_BW = weld.ends[1 - here].X @ invert_pose(weld.ends[here].X)
    for joint in floating:
        one, two = (
            FrameSpec(graph.base, freeze_array(X_BW @ end.X), end.line) if end.link == world else end
            for end in joint.ends
        )
        graph.joints[joint.name] = replace(joint, ends=(one, two))
    return graph


def read_annotation(graph: JointGraph, key: str, text: str) -> str | None:
    """Read one annotation; return its error, or None."""
    words = [unquote(word) for word in text.split()]
    if key in ("platform", "formation", "camera") and len(words) == 1:
        if words[0] not in graph.links:
            return f"{key}: unknown link"
        setattr(graph, "platform" if key == "formation" else key, words[0])
        graph.formation = graph.formation or key == "formation"
    elif key == "turns" and words in (["true"], ["false"]):
        graph.turns = TURNS[words[0]]
    elif key == "motor" and len(words) == 2:
        if words[1] not in graph.joints:
            return "motor of an unknown joint"
        graph.joints[words[1]] = replace(graph.joints[words[1]], motor=Motor(words[0]))
    elif key == "observe" and len(words) == 5:
        if words[1] not in graph.links:
            return "observe: unknown link"
        try:
            direction = numerals.parse(" ".join(words[2:]), 3)
        except ValueError as error:
            return str(error)
        if not np.linalg.norm(direction) > VECTOR_LENGTH_MIN:
            return "observe: a zero direction"
        graph.observations.append(Direction(words[0], words[1], direction))
    elif key in ("see", "eye"):
        said = {name: value for name, _, value in (word.partition("=") for word in words)}
        try:
            if key == "see":
                graph.sights.append(parse_observe_attributes(said))
            else:
                graph.cameras.append(_parse_camera(said))
        except (BadRequest, KeyError, ValueError) as error:
            return str(error)
    else:
        return "unknown hrsynth annotation"
    return None


def _parse_camera(said: dict[str, str]) -> NamedCamera:
    place, turn = (numerals.parse(said.get(key, "0 0 0"), 3) for key in ("xyz", "rpy"))
    size = [float(numerals.parse(said[key], 1)[0]) if key in said else None for key in IMAGE]
    width, height = (None if each is None else int(each) for each in size[1:])
    return NamedCamera(said["name"], said["link"], numerals.compute_origin_pose(place, turn), size[0], width, height)


def list_annotations(robot: Mechanism, *, motors: bool = False) -> Iterable[tuple[str, str]]:
    """Yield key and text of all annotations of a robot, in order."""
    if not robot.has_open_platform:
        yield "formation" if robot.formation else "platform", quote(robot.platform)
    if robot.turns is not None:
        yield "turns", str(robot.turns).lower()
    if robot.camera is not None:
        yield "camera", quote(robot.camera)
    for joint in robot.joints.values():
        if motors and joint.motor is not None:
            yield "motor", f"{quote(joint.motor.name)} {quote(joint.name)}"
    for camera in robot.cameras:
        yield "eye", _write_attributes(list_camera_attributes(camera, numerals.ANGLE_DECIMALS_COUNT))
    for each in robot.observations:
        if isinstance(each, Direction) and each.is_segment_direction:
            yield "observe", f"{quote(each.leg)} {quote(each.link)} {numerals.format_axis(each.direction)}"
        else:
            yield "see", _write_attributes(list_observe_attributes(each, robot, numerals.ANGLE_DECIMALS_COUNT))


def list_camera_attributes(camera: NamedCamera, decimals: int) -> dict[str, str]:
    """Return the attributes of a camera by name."""
    image = {key: numerals.format_exact(value) for key in IMAGE if (value := getattr(camera, key)) is not None}
    return {"name": camera.name, "link": camera.link, **numerals.format_origin(camera.pose, decimals)[1], **image}


def _write_attributes(attributes: dict[str, str]) -> str:
    return " ".join(f"{key}={quote(value)}" for key, value in attributes.items())
