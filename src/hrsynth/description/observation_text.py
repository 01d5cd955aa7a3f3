"""Observations of all kinds, and cameras, as texts: attributes of ``<observe>``, words of the command line.

They are resolved where links and joints are known: a description names them, an observation has their geometry.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from ..errors import BadRequest, BadRobotFile, Defect
from ..geometry.vectors import Array, build_pose, convert_rpy_to_rotation, freeze_array
from ..mechanism import Mechanism
from ..mechanism.cameras import CameraObservation, NamedCamera
from ..mechanism.observation import Observation
from ..mechanism.observations import list_kinds
from ..mechanism.observations.direction import Direction
from ..mechanism.observations.encoder import Encoder
from ..mechanism.observations.inclination import Inclination
from ..mechanism.sensors import make_encoders
from . import numerals

SENSOR = "[CAMERA=]KIND:LINK[@x,y,z][/dx,dy,dz][/radius]"
CAMERA = "NAME=LINK[@x,y,z[/roll,pitch,yaw[/focal[,width,height]]]]"
OFFERED = (
    ((0.5, 0.1, 0.2), (0.0, 0.0, 1.0)),
    ((-0.3, 0.4, 0.1), (1.0, 0.0, 0.0)),
    ((-0.1, -0.5, 0.3), (0.0, 1.0, 0.0)),
    ((0.2, 0.3, -0.4), (0.6, 0.0, 0.8)),
)
"""Points of a link (characteristic lengths) and axes that are candidates by default; no three points on one line, not
four in one plane."""
WORLD = "world"
"""Name of the base besides its own."""


@dataclass(frozen=True)
class ObservationSpec:
    """Observation as it is written: ``link`` is the joint of an encoder; ``at`` (m) and ``axis`` are in the link's
    frame; ``camera`` names one, None the mechanism's reference link."""

    kind: str
    link: str
    leg: str | None = None
    camera: str | None = None
    at: tuple[float, ...] | None = None
    axis: tuple[float, ...] | None = None
    radius: float | None = None
    line: int | None = None

    def __str__(self) -> str:
        return f"{self.kind} of {self.link!r}"


def parse_observe_attributes(attributes: Mapping[str, str], line: int | None = None) -> ObservationSpec:
    """Return the observation of an ``<observe>``. Raises ``BadRequest``."""
    kind = attributes.get("kind", "direction")
    needs = _list_needs(kind)
    own = "joint" if "joint" in needs else "link"
    numbers: dict[str, tuple[float, ...]] = {}
    for name, size in (("at", 3), ("axis", 3), ("radius", 1)):
        if name in attributes:
            try:
                numbers[name] = tuple(numerals.parse(attributes[name], size).tolist())
            except ValueError as error:
                raise BadRequest(f"observe {kind}: {name}", attributes[name], str(error)) from None
    for name in (own, *needs):
        if not name.endswith("?") and name not in attributes:
            raise BadRequest(f"observe {kind} without the attribute", name)
    used = (own, *(name.removesuffix("?") for name in needs))
    for name in ("link", "joint", "at", "axis", "radius"):
        if name in attributes and name not in used:
            raise BadRequest(f"observe {kind} does not use this attribute", name, list(dict.fromkeys(used)))
    if "axis" in numbers and not any(numbers["axis"]):
        raise BadRequest(f"observe {kind}: axis", attributes["axis"], "a non-zero vector")
    radius = numbers["radius"][0] if "radius" in numbers else None
    return ObservationSpec(
        kind,
        attributes[own],
        attributes.get("leg"),
        attributes.get("camera"),
        numbers.get("at"),
        numbers.get("axis"),
        radius,
        line,
    )


def list_observe_attributes(seen: Observation, mechanism: Mechanism, decimals: int) -> dict[str, str]:
    """Return the attributes of an ``<observe>``, points with so many decimals. Raises ``BadRequest`` if files do not
    have this kind, or no named camera is on the observing link."""
    if not isinstance(seen, (*list_kinds().values(),)):
        raise BadRequest(f"observation {seen.leg!r}", type(seen).__name__, list(list_kinds()))
    link = str(seen.seen_from) if isinstance(seen, Inclination) else seen.link
    own = {"joint": seen.joint} if isinstance(seen, Encoder) else {"link": link}
    found = {**({} if seen.is_segment_direction else {"kind": seen.kind}), "leg": seen.leg, **own}
    if isinstance(seen, CameraObservation):
        camera = _find_camera_name(mechanism, seen) if seen.camera is None else seen.camera.name
        found |= {"camera": camera} if camera else {}
        found |= {"at": numerals.format_vector(seen.at, decimals)} if "at" in seen.needs else {}
        found |= {} if seen.axis is None else {"axis": numerals.format_axis(seen.axis)}
        return found | ({} if seen.radius is None else {"radius": numerals.format_exact(seen.radius)})
    if isinstance(seen, Direction) and (camera := _find_camera_name(mechanism, seen)):
        found["camera"] = camera
    return found | ({"axis": numerals.format_axis(seen.direction)} if isinstance(seen, Direction | Inclination) else {})


def _find_camera_name(mechanism: Mechanism, seen: Observation) -> str | None:
    """Return the name of a camera on the link from which something is observed; None for the reference link."""
    if seen.seen_from in (None, mechanism.reference):
        return None
    for camera in mechanism.cameras:
        if camera.link == seen.seen_from:
            return camera.name
    raise BadRequest(f"{seen.text} is seen from a link without a named camera", seen.seen_from)


def parse_sensor(text: str, cameras: Sequence[str]) -> ObservationSpec:
    """Return the observation of a word of ``--sensor``; without a camera's name, by the only one of ``cameras``."""
    head, given, place = text.partition(":")
    camera, named, kind = head.rpartition("=")
    if not given or (named and not camera.strip()):
        raise BadRequest(
            *(("--sensor", text) if not given else (f"--sensor {text}: the camera's name", camera)), SENSOR
        )
    needs = _list_needs(kind)
    # names of links and joints may have slashes: numbers follow the last @, or have commas
    if "at" in needs:
        link, _, numbers = place.rpartition("@")
        at, *more = numbers.split("/")
    else:
        link, *more = re.split("/(?=[^/]*,[^/]*$)", place)
        at = ""
        if where := re.search("@([^@/]*,[^@/]*)$", link):
            form = f"{head}:{'JOINT' if 'joint' in needs else 'LINK'}"
            raise BadRequest(
                f"--sensor {text}: kind {kind} has no point",
                where[1],
                form + "/dx,dy,dz" * ("axis" in needs) + "[/dx,dy,dz]" * ("axis?" in needs),
            )
    attributes = {"kind": kind, "joint" if "joint" in needs else "link": link or at}
    if "at" in needs:
        if not link:
            raise BadRequest(f"--sensor {text}: point on the link", at, SENSOR)
        attributes["at"] = _parse_numbers(at, f"--sensor {text}")
    for name in ("axis", "radius"):
        if more and (name in needs or f"{name}?" in needs):
            attributes[name] = _parse_numbers(more.pop(0), f"--sensor {text}")
    if more:
        raise BadRequest(
            f"--sensor {text}: too many values for this kind", "/".join(more), ", ".join(needs) or "no more"
        )
    by_camera = issubclass(list_kinds()[kind], CameraObservation)
    if by_camera and not camera and len(set(cameras)) > 1:
        raise BadRequest(f"--sensor {text}: no camera named", None, ", ".join(f"{name}={text}" for name in cameras))
    camera = camera or (cameras[0] if by_camera and cameras else "")
    try:
        found = parse_observe_attributes(attributes | ({"camera": camera} if camera else {}))
    except BadRequest as error:
        raise BadRequest(
            f"--sensor {text}: {error.problem}",
            error.got,
            error.expected or (None if error.remedy else SENSOR),
            remedy=error.remedy,
        ) from None
    return found


def split_offers(text: str) -> list[str]:
    """Return the words of a ``--candidate-sensor`` separated by commas, as point:platform,inclination: a kind without a
    link is of the link before it; commas between numbers do not separate."""
    found: list[str] = []
    for part in re.split(rf",(?=(?:[^,:=@/]+=)?(?:{'|'.join(list_kinds())})(?:[:,]|$))", text):
        link = re.sub("/[^/]*,[^/]*$", "", found[-1].partition(":")[2].partition("@")[0]) if found else ""
        found.append(part if ":" in part or not link else f"{part}:{link}")
    return found


def expand_candidates(text: str, length: float) -> list[str]:
    """Return the words of ``--sensor`` that ``--candidate-sensor`` stands for: itself, or several points if it names
    only a link, for a characteristic ``length`` (m). Raises ``BadRequest``."""
    head, _, place = text.partition(":")
    kind = head.rpartition("=")[2]
    needs = list_kinds()[kind].needs if kind in list_kinds() else ()
    if "joint" in needs:
        raise BadRequest(
            f"--candidate-sensor {text}: encoders are always tried on all joints", remedy="Name another kind."
        )
    if "radius" in needs or ("at" if "at" in needs else "axis") not in needs or re.search("@|/[^/]*,[^/]*$", place):
        return [text]
    found = []
    for at, axis in OFFERED:
        numbers = ",".join(f"{length * value:.2g}" for value in at)
        found.append(text + f"@{numbers}" * ("at" in needs) + "/{:g},{:g},{:g}".format(*axis) * ("axis" in needs))
    return found


def _parse_numbers(part: str, option: str) -> str:
    """Return numbers with spaces in place of commas, as attributes have them. Raises ``BadRequest`` for an empty
    number."""
    if not all(each.strip() for each in part.split(",")):
        raise BadRequest(f"{option}: an empty number", part, "numbers with commas between them")
    return part.replace(",", " ")


def parse_camera(text: str) -> NamedCamera:
    """Return the camera of ``NAME=LINK@x,y,z/r,p,y/FOCAL,WIDTH,HEIGHT``; angles in radians or with ``deg``, the image
    in pixels."""
    name, _, place = text.partition("=")
    link, *where = place.split("@")
    parts = where[0].split("/") if len(where) == 1 else []
    if not name or not link or len(where) > 1 or len(parts) > 3:
        raise BadRequest("--camera", text, f"LINK or {CAMERA}")
    numbers: list[Array] = [np.zeros(3), np.zeros(3)]
    image: list[Any] = [None, None, None]
    for part in parts:
        _parse_numbers(part, f"--camera {text}")
    for part in parts[2:]:
        found = part.split(",")
        try:
            values = numerals.parse(" ".join(found), len(found))
        except ValueError as error:
            raise BadRequest(f"--camera {text}", part, str(error)) from None
        if len(found) not in (1, 3) or not np.all(values > 0) or np.any(values[1:] % 1):
            raise BadRequest(f"--camera {text}", part, "the focal length in pixels, alone or with width and height")
        image[: len(found)] = [float(values[0]), *map(int, values[1:])]
    for number, part in enumerate(parts[:2]):
        words = [re.fullmatch(r"(.*?)(deg)?", word) for word in part.split(",")]
        try:
            values = numerals.parse(" ".join(word[1] for word in words if word), 3)
        except ValueError as error:
            raise BadRequest(f"--camera {text}", part, f"{error} with commas between them") from None
        if any(word and word[2] for word in words) and number == 0:
            raise BadRequest(f"--camera {text}", part, "metres")
        numbers[number] = values * [math.radians(1) if word and word[2] else 1.0 for word in words]
    focal, width, height = image
    return NamedCamera(name, link, build_pose(numbers[0], convert_rpy_to_rotation(*numbers[1])), focal, width, height)


def add_observations(
    mechanism: Mechanism, specs: Sequence[ObservationSpec], cameras: Iterable[NamedCamera] = ()
) -> Mechanism:
    """Return the mechanism with these cameras and observations added. Raises ``BadRequest``."""
    for camera in cameras:
        mechanism = _add_camera(mechanism, camera)
    for spec in specs:
        mechanism = _add_observation(mechanism, spec)
    return mechanism


def add_file_observations(
    mechanism: Mechanism, specs: Sequence[ObservationSpec], cameras: Sequence[NamedCamera], file: str
) -> Mechanism:
    """Return the mechanism with the cameras and observations of a file. Raises ``BadRobotFile`` with all their
    defects."""
    defects: list[Defect] = []
    every: list[NamedCamera | ObservationSpec] = [*cameras, *specs]
    for each in every:
        try:
            mechanism = (
                _add_camera(mechanism, each) if isinstance(each, NamedCamera) else _add_observation(mechanism, each)
            )
        except BadRequest as error:
            defects.append(
                Defect(
                    file,
                    each.line,
                    error.problem,
                    None if error.got is None else str(error.got),
                    error.expected,
                    error.remedy,
                )
            )
    if defects:
        raise BadRobotFile(defects)
    return mechanism


def _add_camera(mechanism: Mechanism, camera: NamedCamera) -> Mechanism:
    link = _link(mechanism, camera.link, f"camera {camera.name!r}: unknown link")
    if any(camera.name == each.name for each in mechanism.cameras):
        raise BadRequest("camera name already used", camera.name, "another name")
    return replace(mechanism, cameras=(*mechanism.cameras, replace(camera, link=link)))


def _add_observation(mechanism: Mechanism, spec: ObservationSpec) -> Mechanism:
    """Return the mechanism with the observation, labelled by default with its kind and a free number."""
    taken = {o.leg for o in mechanism.observations}
    label = spec.leg or next(f"{spec.kind}_{n}" for n in count(1) if f"{spec.kind}_{n}" not in taken)
    found = resolve_sight(mechanism, replace(spec, leg=label))
    if {each.key for each in found} & {each.key for each in mechanism.observations}:
        raise BadRequest(f"observe {spec}: label already used", label, "another label")
    return replace(mechanism, observations=(*mechanism.observations, *found))


def resolve_sight(mechanism: Mechanism, spec: ObservationSpec) -> tuple[Observation, ...]:
    """Return the observations (for a joint with two coordinates, two) of a description. Raises ``BadRequest``."""
    label, kind = str(spec.leg), list_kinds()[spec.kind]
    if label == "all" or "," in label:
        raise BadRequest(f"observe {spec}: label not usable in a list", label, "a label without commas, other than all")
    if kind is Encoder:
        if spec.link not in mechanism.joints:
            raise BadRequest("observe encoder: unknown joint", spec.link, sorted(mechanism.joints))
        read = make_encoders(mechanism, mechanism.joints[spec.link], label)
        if not read:
            raise BadRequest(
                f"observe encoder: type of joint {spec.link!r}",
                mechanism.joints[spec.link].type.name.lower(),
                "one with one axis or two",
            )
        return tuple(replace(each, line=spec.line) for each in read)
    link = _link(mechanism, spec.link, f"observe {spec.kind}: unknown link")
    if issubclass(kind, Inclination):
        if link == mechanism.base:
            raise BadRequest("observe inclination: the base does not move", link, "a link that moves")
        vertical = freeze_array((0, 0, 1) if spec.axis is None else spec.axis)
        return (Inclination(label, mechanism.base, vertical, seen_from=link, line=spec.line),)
    camera = _find_camera(mechanism, spec)
    seen_from = mechanism.reference if camera is None else camera.link
    if seen_from == link:
        raise BadRequest(f"observe {spec}: the camera is on the same link", link, "another link")
    if issubclass(kind, Direction):
        return (Direction(label, link, freeze_array(spec.axis or ()), line=spec.line, seen_from=seen_from),)
    assert issubclass(kind, CameraObservation)
    if spec.radius is not None and not (abs(spec.radius) if kind.signed else spec.radius) > 0:
        raise BadRequest(
            f"observe {spec}: radius (m)", spec.radius, "a number other than 0" if kind.signed else "more than 0"
        )
    axis = None if spec.axis is None else freeze_array(spec.axis)
    return (
        kind(
            label,
            link,
            at=freeze_array(spec.at or (0, 0, 0)),
            axis=axis,
            radius=spec.radius,
            camera=camera,
            line=spec.line,
        ),
    )


def _find_camera(mechanism: Mechanism, spec: ObservationSpec) -> NamedCamera | None:
    if spec.camera is None:
        return None
    for camera in mechanism.cameras:
        if camera.name == spec.camera:
            return camera
    raise BadRequest(
        f"observe {spec}: unknown camera",
        spec.camera,
        [camera.name for camera in mechanism.cameras] or "a camera declared with --camera or <camera>",
    )


def _link(mechanism: Mechanism, link: str, what: str) -> str:
    found = mechanism.base if link == WORLD and link not in mechanism.links else link
    if found not in mechanism.links:
        raise BadRequest(what, link, sorted(mechanism.links))
    return found


def _list_needs(kind: str) -> tuple[str, ...]:
    if kind not in list_kinds():
        raise BadRequest("unknown kind of observation", kind, sorted(list_kinds()))
    return list_kinds()[kind].needs
