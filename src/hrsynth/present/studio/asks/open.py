"""Scene of a robot: its drawing, legs and sliders, and the assumptions of reading its file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ....analysis.observed import ObservedRobot
from ....analysis.setup_records import describe_other_modes
from ....description import find_robot_file
from ....description.assembly.choices import ImportChoices, choices
from ....description.overrides import UNITS, Overrides
from ....errors import HrsynthError, NoSegment
from ....kinematics.joint_coordinates import list_coordinate_joints
from ....mechanism.legs import Leg
from ....mechanism.sensors import choose_default_segment, explain_default
from ...view.meshes import collect_meshes
from ...view.scale import choose_error_unit, scale
from ...view.shapes import PAGE_DIGITS_COUNT
from ...view.states import REAL, Mover, RealAndHiddenState
from ...view.view import build_machine, describe_stage, list_arrows
from ..commands import format_commands
from ..request import Request
from .move import describe_pose, read_motors

ASSUMPTION_CANDIDATES_MAX = 30
"""Largest number of alternatives to an assumption that are offered."""


def answer(request: Request) -> dict[str, Any]:
    """Return the scene of a robot. If its file can be read but makes no robot: the reason (``failed``) and the
    assumptions."""
    found = list_assumptions(request)
    guesses = [] if found is None else list(list_alternatives(request, found))
    dialect = "hrsynth" if found is None else found.dialect
    try:
        return {**describe_opened(request), "guesses": guesses, "dialect": dialect, "failed": None}
    except HrsynthError as error:
        if not guesses:
            raise
        name = request.source.robot.rpartition("/")[2]
        return {
            "name": name,
            "words": "",
            "failed": "\n".join(error.lines()),
            "guesses": guesses,
            "dialect": dialect,
            "notes": [str(note) for note in found.notes] if found else [],
            **format_commands(request, "derive"),
        }


def describe_opened(request: Request) -> dict[str, Any]:
    """Return what is drawn and moved."""
    setup, mover = request.setup, request.mover()
    known = {each.leg: each for each in (*setup.segments, *setup.observed)}
    shapes, missing = collect_meshes(setup, request.fence)
    places = [mover.places(each)[REAL] for each in (mover.home, *(end for pair in request.ends for end in pair))]
    words = str(setup.decomposition.architecture())
    machine = build_machine(REAL, setup, setup.mechanism, words, places, shapes)
    here = request.here(mover)
    return {
        **describe_stage(setup, [machine], list_arrows(setup, known.values())),
        "words": f"{words}, {setup.dof} dof",
        "link": request.describe_link(),
        "legs": [_describe_leg(request, setup, leg) for leg in setup.decomposition.legs],
        "sliders": make_sliders(mover, request.ends),
        "motor_sliders": make_motor_sliders(mover),
        "scale": scale(choose_error_unit(setup)),
        **describe_pose(request, mover, here),
        "notes": [*map(str, setup.robot.notes), *describe_other_modes(setup), *missing],
        **format_commands(request, "derive"),
    }


def make_sliders(mover: Mover, ends: Sequence[tuple[RealAndHiddenState, RealAndHiddenState]]) -> list[dict[str, Any]]:
    """Return a slider for each platform coordinate, over its range from the zero configuration."""
    made = []
    coordinates = mover.coordinates
    for number, (name, place, pair) in enumerate(zip(coordinates.names, coordinates.places, ends, strict=True)):
        low, high = (float(mover.read(each)[number]) for each in pair)
        home = float(coordinates.values[number])
        low, high = sorted((min(low, home), max(high, home)))
        made.append(
            {
                "name": name,
                "label": name,
                "unit": "rad" if place >= 3 else "m",
                "min": round(low, PAGE_DIGITS_COUNT),
                "max": round(high, PAGE_DIGITS_COUNT),
                "home": home,
            }
        )
    return made


def make_motor_sliders(mover: Mover) -> list[dict[str, Any]]:
    """Return a slider for each coordinate of a motor, within its limits; without limits over half a turn or the
    characteristic length, in each direction."""
    at = mover.home.real
    robot = at.model.mechanism.written or at.model.mechanism
    axes = [
        (joint, axis) for joint in list_coordinate_joints(robot, motors=True) for axis in range(joint.type.freedoms)
    ]
    made = []
    for (joint, axis), home in zip(axes, read_motors(mover.home), strict=False):
        slides = joint.type.has_translation and axis == 0
        span = at.model.length if slides else np.pi
        low, high = robot.filed.get(joint.name, (-np.inf, np.inf))
        made.append(
            {
                "name": joint.name,
                "label": joint.name if joint.type.freedoms == 1 else f"{joint.name} {axis + 1}",
                "unit": "m" if slides else "rad",
                "min": low if np.isfinite(low) else home - span,
                "max": high if np.isfinite(high) else home + span,
                "home": home,
            }
        )
    return made


def _describe_leg(request: Request, setup: ObservedRobot, leg: Leg) -> dict[str, Any]:
    """Return a leg: its chain, whether it can be observed, the reason, and its name in requests (``ask``)."""
    seen = next((each for each in setup.observed if each.leg == leg.label), None)
    default = next((each for each in setup.segments if each.leg == leg.label), None)
    shown, why = seen or default, None
    if shown is None:
        try:
            shown = choose_default_segment(setup.decomposition, leg)
        except NoSegment as error:
            why = str(error)
    if shown is not None:
        why = explain_default(setup.decomposition, shown)
    return {
        "name": leg.label,
        "words": str(setup.decomposition.word(leg)),
        "can": shown is not None,
        "why": why,
        "watched": seen is not None and not request.has_no_observation,
        "link": None if shown is None else shown.link,
        "ask": seen.link if seen and not (default and seen.link == default.link) else leg.label,
    }


def list_assumptions(request: Request) -> ImportChoices | None:
    """Return what reading the file assumed; None if nothing, or if the file is unreadable."""
    said = dict(request.source.options)
    try:
        given = Overrides.said(
            base=said.get("base"),
            motors=said.get("motors"),
            close=said.get("close", ()),
            freeze=said.get("freeze", ()),
            unit=said.get("unit"),
            args=said.get("args", ()),
            model=said.get("model"),
        )
        return choices(find_robot_file(request.source.robot), given)
    except HrsynthError:
        return None


def list_alternatives(request: Request, found: ImportChoices) -> Iterator[dict[str, Any]]:
    """Yield each assumption by the name of the option that overrides it, with the alternatives."""
    said = dict(request.source.options)

    def offer(name: str, now: Any, why: str, candidates: list[Any]) -> dict[str, Any]:
        offered = [now, *(each for each in candidates if each != now)]
        return {"name": name, "found": now, "why": why, "candidates": offered[:ASSUMPTION_CANDIDATES_MAX]}

    if found.platforms:
        told = "chosen" if "platform" in said else found.why if found.told else "several are possible"
        yield offer(
            "platform", said.get("platform", found.platforms[0]), told or "given by the file", list(found.platforms)
        )
    if len(found.bases) > 1:
        yield offer("base", said.get("base", found.bases[0]), "no joint carries it", list(found.bases))
    driven = [joint.name for joint in found.moving if joint.motor is not None]
    yield offer(
        "motors",
        list(said.get("motors", driven)),
        "chosen" if "motors" in said else "as in the file",
        [driven, found.proposed_motors],
    )
    if found.candidates or "close" in said:
        near = [each.wish for each in found.candidates]
        yield offer(
            "close",
            list(said.get("close", ())),
            "neighbouring frames that a loop closure may join",
            [[], near, *([each] for each in near)],
        )
    yield offer("unit", said.get("unit", "m"), "of the lengths in the file", list(UNITS))
    yield offer(
        "as_written",
        said.get("as_written", False),
        "if no: axes that are parallel or intersect up to rounding are snapped",
        [False, True],
    )
