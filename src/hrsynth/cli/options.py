"""Options as data: each is declared once, the commands' tables put them together; the command line is read
by them, the help and the completion of shells are made of them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..ranges import in_range, plain_number, range_of, range_words
from .colour import say

if TYPE_CHECKING:
    from ..mechanism import Mechanism

NEEDED: Any = ...
"""The default of what must be given."""
OWN, WATCHING, OUTPUT, READING = "Options", "What is watched", "Output", "What the file does not say"
"""Groups of options, in the order of the help."""


@dataclass(frozen=True)
class Option:
    """One option or (``argument``) one word of the command line; ``flags`` are its names, by default its own; ``old``
    ones are taken too, and told. ``words`` are what its value can be, where that can be told."""

    name: str
    help: str
    metavar: str | None = None
    kind: Any = str
    default: Any = None
    flags: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    argument: bool = False
    group: str = OWN
    words: Callable[[], Iterable[str]] | tuple[str, ...] = ()
    old: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Its names on the command line: none of an argument, ``--open/--no-open`` of a flag that can be denied."""
        return () if self.argument else self.flags or (f"--{self.name.replace('_', '-')}",)

    @property
    def value(self) -> str:
        """How the help calls what is given."""
        return self.metavar or {int: "COUNT", float: "NUMBER"}.get(self.kind, self.name.upper())

    @property
    def shown(self) -> str:
        """How the help names it."""
        names = ", ".join(self.names).replace("/", " / ")
        return f"{names} {'' if self.kind is bool else self.value}".strip()

    @property
    def told(self) -> str:
        """What the help says of it: what it is for, its default, its range."""
        given = not isinstance(self.default, bool) and self.default not in (NEEDED, None, "")
        facts = [f"default: {self.default}"] if given else ["required"] if self.default is NEEDED else []
        facts += [] if self.low is None else [f"at least {self.low}"]
        facts += [] if self.high is None else [f"at most {self.high}"]
        return f"{self.help}  [{'; '.join(facts)}]" if facts else self.help

    @property
    def several(self) -> bool:
        """Whether it can be given more than once."""
        return self.kind == list[str]

    @property
    def names_several(self) -> bool:
        """Whether one value names several things, so that a second value would not be taken for the only one."""
        return self.metavar in ("LEGS", "LINKS", "JOINTS")

    def ranged(self, question: str) -> Option:
        """The same with the range that a question has for it."""
        low, high = range_of(question, self.name)
        return replace(self, low=self.low if low is None else low, high=self.high if high is None else high)

    def read(self, text: str) -> Any:
        """A value as it is written on the command line; raises ``BadRequest``."""
        from ..errors import BadRequest

        if self.kind not in (int, float):
            return text
        try:
            number = plain_number(text, self.kind)
            if in_range(number, self.low, self.high):
                return number
        except ValueError:
            pass
        name = self.names[0] if self.names else self.value
        word = "an integer" if self.kind is int else "a number"
        raise BadRequest(name, text, ", ".join([word, *range_words(self.low, self.high)])) from None


def flag(name: str, help: str, group: str = OWN) -> Option:
    """An option that is given or not."""
    return Option(name, help, kind=bool, default=False, group=group)


def output(help: str, metavar: str = "FILE", default: Any = None) -> Option:
    """What is written with ``-o``."""
    return Option("output", help, metavar, default=default, flags=("-o", "--output"), group=OUTPUT)


def shipped_names() -> Iterable[str]:
    """The names of the shipped robots."""
    from ..description import shipped

    return shipped()


JSON = flag("json", "Print the result as one JSON object; its schema: hrsynth schema COMMAND.", OUTPUT)
OBSERVE = Option(
    "observe",
    "Legs to watch (1,4), links, or all (default: what the file observes, else all; none with --see).",
    "LEGS",
    group=WATCHING,
)
CAMERA = Option(
    "camera",
    "The link that carries the camera; or a further camera with a name and its place on a link "
    "(metres; radians or deg; focal length, width and height in pixels); repeat for more.",
    "LINK|NAME=LINK@x,y,z/r,p,y/f,w,h",
    list[str],
    group=WATCHING,
)
WATCHED = (OBSERVE, CAMERA)
SEE = Option(
    "see",
    "What else is observed: circle, depth, direction, distance, edge, edges, encoder, image_circle, "
    "image_line, inclination, line, point or position, with a point, an axis and a radius where the kind "
    "needs them (world: the base; for an encoder, its joint); repeat for more.",
    "[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius",
    list[str],
    group=WATCHING,
)
OFFER = Option(
    "offer",
    "What could be observed in addition, written as for --see; without a place, such as "
    "point:plate, several places of that link; separate more by commas, or repeat.",
    "[CAMERA=]KIND:LINK[@x,y,z/dx,dy,dz/radius]",
    list[str],
    group=WATCHING,
)
SEED = Option("seed", "Seed of the random configurations.", "NUMBER", int, 0)
SOURCE = (
    Option(
        "robot",
        "A robot file in any dialect, a shipped robot's name, or example:NAME.",
        "ROBOT",
        default=NEEDED,
        argument=True,
        words=shipped_names,
    ),
    Option("base", "Consider only what lies between this link and the platform.", "LINK", group=READING),
    Option("platform", "The platform, if the file names none.", "LINK", group=READING),
    Option("motors", "The driven joints, if the file names none.", "JOINTS", group=READING),
    Option(
        "close",
        "A closure: the frames of two links, or points A@x,y,z in them, meet (default: in a point); repeat for more.",
        "A:B[:TYPE]",
        kind=list[str],
        group=READING,
    ),
    Option("freeze", "Joints to hold at zero.", "JOINTS", default="", group=READING),
    Option(
        "keyframe",
        "Zero pose: a named posture of the file, or of an SRDF file next to it; or FILE.srdf:NAME.",
        "NAME",
        group=READING,
    ),
    Option(
        "unit", "The unit of the file's lengths: m, mm, cm or in.", "UNIT", group=READING, words=("m", "mm", "cm", "in")
    ),
    Option(
        "tolerance",
        "Deviation up to which axes and centres count as parallel, meeting and so on, and are made so "
        "(characteristic lengths, radians; default: from the digits of the file's numbers).",
        None,
        float,
        group=READING,
    ),
    flag(
        "as_written",
        "Take the file's numbers as they are: do not correct what is parallel, or meets, up to rounding.",
        READING,
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
