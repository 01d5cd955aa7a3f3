"""The options of the command line that belong to no question of their own, and what is told of others."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..options import NEEDED, OUTPUT, OVERRIDES, Option, flag
from .colour import say

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def shipped_names() -> Iterable[str]:
    """The names of the shipped robots."""
    from ..description import list_robots

    return list_robots()


JSON = flag("json", "Print the result as one JSON object; its schema: hrsynth schema COMMAND.", OUTPUT)
SOURCE = (
    Option(
        "robot",
        "A robot file in any dialect, a shipped robot's name, or example:NAME.",
        "ROBOT",
        default=NEEDED,
        argument=True,
        words=shipped_names,
    ),
    Option("base", "Consider only what lies between this link and the platform.", "LINK", group=OVERRIDES),
    Option("platform", "The platform, if the file names none.", "LINK", group=OVERRIDES),
    Option("motors", "The driven joints, if the file names none.", "JOINTS", group=OVERRIDES),
    Option(
        "close",
        "A closure: the frames of two links, or points A@x,y,z in them, meet (default: in a point); repeat for more.",
        "A:B[:TYPE]",
        kind=list[str],
        group=OVERRIDES,
    ),
    Option("freeze", "Joints to hold at zero.", "JOINTS", default="", group=OVERRIDES),
    Option(
        "keyframe",
        "Zero pose: a named posture of the file, or of an SRDF file next to it; or FILE.srdf:NAME.",
        "NAME",
        group=OVERRIDES,
    ),
    Option(
        "unit",
        "The unit of the file's lengths: m, mm, cm or in.",
        "UNIT",
        group=OVERRIDES,
        words=("m", "mm", "cm", "in"),
    ),
    Option(
        "tolerance",
        "Deviation up to which axes and centres count as parallel, meeting and so on, and are made so "
        "(characteristic lengths, radians; default: from the digits of the file's numbers).",
        None,
        float,
        group=OVERRIDES,
    ),
    flag(
        "as_written",
        "Take the file's numbers as they are: do not correct what is parallel, or meets, up to rounding.",
        OVERRIDES,
    ),
)
"""A robot as the command line names it, with what its file does not say."""


def robot_of(values: dict[str, Any]) -> Mechanism:
    """The mechanism that the options of ``SOURCE`` name, which are taken out of ``values``; what was guessed or solved
    goes to standard error, a line each."""
    mechanism = quiet_robot_of(values)
    for note in mechanism.notes:
        warn(str(note))
    return mechanism


def quiet_robot_of(values: dict[str, Any]) -> Mechanism:
    """The same mechanism, of which nothing is told."""
    from ..description import load

    given = {option.name: values.pop(option.name) for option in SOURCE}
    given["freeze"] = [name for name in given["freeze"].split(",") if name]
    values["as_written"] = given["as_written"]  # `modes` asks again
    return load(given.pop("robot"), **{**given, "close": given["close"] or ()})


def warn(text: str) -> None:
    """Say something beside the answer."""
    say(f"hrsynth: {text}", err=True)


def told_radians(option: str, text: str | None) -> None:
    """Say how many degrees a small angle is that was given without a unit."""
    for field in (text or "").split(","):
        try:
            angle = float(field.rpartition("=")[2])
        except ValueError:
            continue
        if not angle:
            continue
        warn(
            f"--{option} {field.strip()}: taken as radians, {math.degrees(angle):.3g} degrees "
            f"({field.strip()}deg for degrees)"
        )


def told_turns(option: str, text: object) -> None:
    """Say how many degrees a turn of more than half a circle is that was given without a unit."""
    for pose in text if isinstance(text, list) else [text]:
        for field in pose.split(",") if isinstance(pose, str) else ():
            name, _, value = field.partition("=")
            with contextlib.suppress(ValueError):
                if name.strip() == "phi" and math.pi < abs(float(value)) < math.inf:
                    told_radians(option, field)


def split_names(text: str) -> list[str]:
    """Names set apart by commas."""
    from ..errors import BadRequest

    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadRequest("--observe: an empty name", text, "labels or links with commas between them, or all")
    return names
