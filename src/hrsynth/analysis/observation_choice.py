"""Choice of observations: those that a user requests, those of the file, else the default segments of legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..description.observation_text import ObservationSpec, add_observations, parse_camera, parse_sensor
from ..errors import BadRequest, NoSegment
from ..mechanism import Mechanism, Observation
from ..mechanism.legs import LegDecomposition
from ..mechanism.normal import NormalForm
from ..mechanism.observation import list_labels
from ..mechanism.sensors import choose_default_segment, make_encoders, observe_segment


def add_sensors(
    robot: Mechanism, cameras: tuple[str, ...], sensor: tuple[str, ...], candidate_sensor: tuple[str, ...]
) -> tuple[Mechanism, set[str], set[str]]:
    """Add the requested and candidate cameras and observations to a robot; also return their labels."""
    named = [parse_camera(text) for text in cameras if "=" in text]
    links = [text for text in cameras if "=" not in text]
    if len(links) > 1:
        raise BadRequest(
            f"--camera {', '.join(links)}: several links carry the camera",
            remedy="Name one; give others as NAME=LINK@x,y,z.",
        )
    for link in links:
        if link not in robot.links:
            raise BadRequest(f"--camera: link of {robot.name}", link, sorted(robot.links))
        robot = replace(robot, camera=link)
    eyes = [each.name for each in named or robot.cameras]
    every = [("--sensor", text) for text in sensor] + [("--candidate-sensor", text) for text in candidate_sensor]
    specs = [_parse_spec(flag, text, eyes) for flag, text in every]
    used = {each.camera for each in specs} & set(eyes)
    for camera in named:
        if camera.name not in used and (used or not specs):  # an inclination or an encoder alone needs none
            raise BadRequest(
                f"--camera {camera.name}: no observation uses this camera of {robot.name}",
                remedy=f"Add --sensor {camera.name}=KIND:LINK…, or use --camera LINK for a camera that observes legs.",
            )
    robot = add_observations(robot, (), named)
    labels: list[set[str]] = [{o.leg for o in robot.observations}]
    for (flag, text), spec in zip(every, specs, strict=True):
        try:
            robot = add_observations(robot, [spec])
        except BadRequest as error:
            raise BadRequest(
                f"{flag} {text}: {error.problem}", error.got, error.expected, remedy=error.remedy
            ) from None
        labels.append({o.leg for o in robot.observations}.difference(*labels))
    return robot, set().union(*labels[1 : len(sensor) + 1]), set().union(*labels[len(sensor) + 1 :])


def _parse_spec(option: str, text: str, eyes: Sequence[str]) -> ObservationSpec:
    try:
        return parse_sensor(text, eyes)
    except BadRequest as error:
        raise BadRequest(
            error.problem.replace("--sensor", option, 1), error.got, error.expected, remedy=error.remedy
        ) from None


def choose_observations(
    decomposition: LegDecomposition,
    normal: NormalForm,
    defaults: dict[str, Observation],
    observe: Sequence[str] | None,
    given_too: Sequence[Observation],
) -> tuple[Observation, ...]:
    if observe is not None and not observe:
        raise BadRequest("--observe: nothing is observed", remedy="Give leg labels, links, or all.")
    if observe is None or list(observe) == ["all"]:
        for leg in decomposition.legs:
            if leg.label not in defaults:
                try:
                    choose_default_segment(decomposition, leg)
                except NoSegment:
                    if not defaults:
                        raise
        observe = tuple(defaults)
    chosen: dict[tuple[str, ...], Observation] = {}
    for name in observe:
        others = [o for o in given_too if o.leg == name]
        chosen |= {o.key: o for o in others}
        if others and name not in decomposition.labels:
            continue
        if name in decomposition.labels:
            observation = defaults.get(name) or choose_default_segment(decomposition, decomposition.leg(name))
            chosen |= {
                o.key: o for o in decomposition.mechanism.observations if o.is_segment_direction and o.leg == name
            }
        elif name in normal.into:
            link = normal.into[name]
            if link not in decomposition.mechanism.links:
                raise BadRequest(
                    f"--observe {name}: the link is part of a joint and has no direction", remedy="Name another link."
                )
            given = next(
                (o for o in decomposition.mechanism.observations if o.link == link and o.is_segment_direction), None
            )
            observation = given or observe_segment(decomposition, link)
        else:
            raise BadRequest(
                f"--observe: unknown leg or link of {decomposition.mechanism.name}",
                name,
                "legs "
                + ", ".join([*decomposition.labels, *list_labels(given_too)])
                + "; links "
                + ", ".join(n for leg in decomposition.legs for n in leg.links),
            )
        chosen[observation.key] = observation
    return tuple(chosen.values())


def list_encoders(decomposition: LegDecomposition) -> tuple[Observation, ...]:
    mechanism = decomposition.mechanism
    of = {name: leg.label for leg in decomposition.legs for name in leg.joints}
    mechanism.require_motors()
    driven = [joint for joint in mechanism.joints.values() if joint.is_actuated]
    return tuple(each for joint in driven for each in make_encoders(mechanism, joint, of.get(joint.name, "")))
