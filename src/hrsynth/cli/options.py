"""Options common to several commands, and notes on the units of others."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..options import NEEDED, OUTPUT, OVERRIDES, Option, flag
from .colour import print_text

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def list_shipped_names() -> Iterable[str]:
    """Return the names of the shipped robots."""
    from ..description import list_robots

    return list_robots()


JSON = flag("json", "Print the result as one JSON object; its schema: hrsynth schema COMMAND.", OUTPUT)
SOURCE = (
    Option(
        "robot",
        "A robot file in any format, a shipped robot's name, or example:NAME.",
        "ROBOT",
        default=NEEDED,
        argument=True,
        words=list_shipped_names,
    ),
    Option("base", "The base: consider only the links between it and the platform.", "LINK", group=OVERRIDES),
    Option("platform", "The platform, if the file names none.", "LINK", group=OVERRIDES),
    Option("motors", "The actuated joints, if the file names none.", "JOINTS", group=OVERRIDES),
    Option(
        "close",
        "A loop closure: frames of two links, or points A@x,y,z in them (metres), that coincide (default: spherical "
        "joint, in a planar loop revolute; revolute/0,0,1: an axis in A's frame); repeat for more.",
        "A:B[:TYPE[/AXIS]]",
        kind=list[str],
        group=OVERRIDES,
    ),
    Option("freeze", "Joints to lock at zero.", "JOINTS", default="", group=OVERRIDES),
    Option(
        "keyframe",
        "Zero configuration: a keyframe of the file, or of an SRDF file next to it; or FILE.srdf:NAME.",
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
        "Tolerance within which axes and centres are snapped to special geometry "
        "(characteristic lengths, rad; default: from the decimals of the file's numbers).",
        None,
        float,
        group=OVERRIDES,
    ),
    Option("model", "The model to read, if an SDFormat file has several.", "NAME", group=OVERRIDES),
    Option(
        "args",
        "An argument of a xacro file; repeat for more.",
        "NAME:=VALUE",
        list[str],
        flags=("--arg",),
        group=OVERRIDES,
    ),
    flag(
        "as_written",
        "Use the file's numbers unchanged: do not repair rounded geometry.",
        OVERRIDES,
    ),
)
"""Robot file and its overrides."""


EXPLAIN = flag("explain", "List all elements and relations of the file that are read as equivalents.", OVERRIDES)


def load_robot(values: dict[str, Any]) -> Mechanism:
    """Load the mechanism of the options of ``SOURCE``, removed from ``values``; print assumptions to standard error."""
    explain = values.pop(EXPLAIN.name, False)
    mechanism = load_robot_silently(values)
    merged = [note for note in mechanism.notes if note.kind == "merged"]
    for note in mechanism.notes:
        if explain or len(merged) < 2 or note.kind != "merged":
            warn(str(note))
        elif note is merged[0]:
            change = max(note.change for note in merged)
            size = f"the largest change is {change:.1e} (characteristic lengths, rad)" if change else "nothing moves"
            count = sum(note.count for note in merged)
            warn(f"merged: {count} elements or relations are read as equivalents, {size}; --explain lists them")
    return mechanism


def load_robot_silently(values: dict[str, Any]) -> Mechanism:
    """Load the mechanism without printing assumptions."""
    from ..description import load

    given = {option.name: values.pop(option.name) for option in SOURCE}
    given["freeze"] = [name for name in given["freeze"].split(",") if name]
    values["as_written"] = given["as_written"]  # `modes` reads it again
    return load(given.pop("robot"), **{**given, "close": given["close"] or ()})


def warn(text: str) -> None:
    """Print a note to standard error."""
    print_text(f"hrsynth: {text}", err=True)


def warn_radians(option: str, text: str | None) -> None:
    """Print in degrees an angle that was given without a unit."""
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


def warn_turns(option: str, text: object) -> None:
    """Print in degrees a rotation above 180 degrees that was given without a unit."""
    for pose in text if isinstance(text, list) else [text]:
        for field in pose.split(",") if isinstance(pose, str) else ():
            name, _, value = field.partition("=")
            with contextlib.suppress(ValueError):
                if name.strip() == "phi" and math.pi < abs(float(value)) < math.inf:
                    warn_radians(option, field)


def split_names(text: str) -> list[str]:
    """Split names at commas."""
    from ..errors import BadRequest

    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadRequest(f"--observe {text}: empty name", remedy="Give labels or links with commas, or all.")
    return names
