"""The guided reader: shows what a file says and leaves open, asks what is missing, writes the native file."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..characters import escape_steering
from ..options import NEEDED, OBSERVATION, Option, flag, output
from ..records import OfRobot
from .colour import say
from .commands import Group, add_command
from .options import JSON, SOURCE, quiet_robot_of, robot_of, warn
from .progress import Progress

if TYPE_CHECKING:
    from ..description.assembly.choices import ImportChoices
    from ..mechanism import Mechanism
    from ..mechanism.observation import Observation

T = TypeVar("T")
SHOWN = 20
"""Choices that are listed; others are named."""


class Import(OfRobot):
    """A robot that was read with answers or guesses and written, and the command that does the same without
    questions."""

    file: str
    repeat: str
    links: int
    joints: int
    base: str
    motors: list[str]
    observed: dict[str, str]
    notes: list[str]
    warnings: list[str]


def importing(target: str, observe: str | None, yes: bool, view: bool, json: bool, **source: Any) -> None:
    """Read a robot with what is answered or guessed, and write it."""
    from ..description import file_of, save
    from ..description.files import require_other, require_writable
    from ..errors import BadRequest
    from ..present.show import record

    path = file_of(source["robot"])
    if Path(target).suffix.lower() != ".urdf":
        raise BadRequest("import writes the native dialect", target, "a file .urdf; hrsynth convert writes others")
    require_writable(target)
    require_other(target, path)
    asking = not (yes or json) and sys.stdin.isatty() and sys.stdout.isatty()
    if asking:
        sys.stdin.reconfigure(errors="replace")  # type: ignore[union-attr]
        source, observe = _ask_all(path, source, observe, target, view)
    with Progress():
        mechanism = _read(source, observe, tell=not asking)
        lost = [str(warning) for warning in save(mechanism, target, "native")]
    motors = [name for name, joint in mechanism.joints.items() if joint.actuated]
    notes = [str(note) for note in mechanism.notes]
    if not motors:
        notes.append(
            "open: no joint is driven, so nothing can be said about the real robot's motors "
            "(--motors JOINTS names the driven ones)"
        )
        if not asking:
            warn(notes[-1])
    for warning in lost:
        warn(warning)
    again = repeat_command(source, observe, target)
    if json:
        fields = {
            "file": target,
            "repeat": again,
            "links": len(mechanism.links),
            "joints": len(mechanism.joints),
            "base": mechanism.base,
            "motors": motors,
            "observed": {leg: seen.link for leg, seen in _segments(mechanism).items()},
            "notes": notes,
            "warnings": lost,
        }
        say(record("import", mechanism, fields))
    else:
        say(
            f"{mechanism.name} with {len(mechanism.links)} links and {len(mechanism.joints)} joints, platform "
            f"{mechanism.platform_words}, is written to {target}.\nThe same without questions: {again}"
        )


def repeat_command(source: dict[str, Any], observe: str | None, target: str) -> str:
    """The command line that writes the same file without questions."""
    words = ["hrsynth", "import", source["robot"]]
    words += [word for option in SOURCE[1:] for word in option.typed(source[option.name])]
    words += ["--observe", observe] if observe else []
    return shlex.join([*words, "--yes", "-o", target])


def _read(source: dict[str, Any], observe: str | None, *, tell: bool) -> Mechanism:
    """The mechanism that the answers give; ``tell`` its notes."""
    from ..description.overrides import names, observe_links

    mechanism = (robot_of if tell else quiet_robot_of)(dict(source))
    mechanism.require_platform()
    return mechanism if observe is None else observe_links(mechanism, names(observe) or ())


def _segments(mechanism: Mechanism) -> dict[str, Observation]:
    """The observed segment of each leg that has one."""
    from ..errors import HrsynthError
    from ..mechanism.legs import decompose
    from ..mechanism.normal import normal_form
    from ..mechanism.sensors import defaults_of

    try:
        return defaults_of(decompose(normal_form(mechanism).mechanism))
    except HrsynthError:
        return {}


def _ask_all(
    path: Path, source: dict[str, Any], observe: str | None, target: str, view: bool
) -> tuple[dict[str, Any], str | None]:
    """The questions, until the answers are confirmed; ends the command where they are given up."""
    status = 0
    try:
        while True:
            dialog = _Dialog(path, dict(source), observe, target)
            wanted = dialog.ask(view)
            if wanted:
                return dialog.source, dialog.observe
            if wanted is False:
                break
    except (EOFError, KeyboardInterrupt) as error:
        say("")
        status = 2 if isinstance(error, EOFError) else 130
    warn("nothing is written")
    raise SystemExit(status)


class _Dialog:
    """One round of questions: closures, base, platform, motors, segments, and whether that is right."""

    def __init__(self, path: Path, source: dict[str, Any], observe: str | None, target: str) -> None:
        self.path, self.source, self.observe, self.target = path, source, observe, target
        self.asked = any(source[name] in (None, []) for name in ("close", "base", "platform", "motors"))

    def ask(self, view: bool) -> bool | None:
        """Whether to write: None to be asked all again."""
        found = self._choices()
        self._show_file(found)
        if view:
            self._view()
        if not self.source["close"]:
            self._ask_closures(found)
        if self.source["base"] is None:
            self._ask_base(self._choices())
        if self.source["platform"] is None:
            self._ask_platform(self._choices())
        if self.source["motors"] is None:
            self._ask_motors(self._choices())
        mechanism = self._mechanism()
        if mechanism is None:
            return None
        if self.source["unit"] is None and any("--unit" in note.text for note in mechanism.notes):
            mechanism = self._ask_unit(mechanism)
        self._show_robot(mechanism)
        if self.observe is None and (seen := self._ask_segments(mechanism)) is not None:
            self.observe = seen
        return self._confirm()

    def _choices(self) -> ImportChoices:
        """What the file leaves open after the answers up to now."""
        from ..description.assembly.choices import choices
        from ..description.overrides import Overrides, names

        given = self.source
        with Progress():
            return choices(
                self.path,
                Overrides(
                    given["base"],
                    None,
                    names(given["motors"]),
                    tuple(given["close"] or ()),
                    tuple(name for name in given["freeze"].split(",") if name),
                    unit=given["unit"],
                ),
            )

    def _mechanism(self) -> Mechanism | None:
        """The robot as answered; what is wrong is said, and there is none."""
        from ..errors import HrsynthError

        try:
            with Progress():
                return _read(self.source, self.observe, tell=False)
        except HrsynthError as error:
            if not self.asked:
                raise
            say("\n".join(["", *error.lines(), "This cannot be read that way; here are the questions again.", ""]))
            return None

    def _show_file(self, found: ImportChoices) -> None:
        kinds: dict[str, int] = {}
        for joint in found.joints:
            kinds[_word(joint)] = kinds.get(_word(joint), 0) + 1
        counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        say(f"{self.path}: {found.dialect}, {len(found.links)} links, {len(found.joints)} joints ({counts})")
        for note in found.notes:
            say(f"  {note}")

    def _ask_closures(self, found: ImportChoices) -> None:
        """Frames to join, on top of what the file closes."""
        from ..description.overrides import closures

        closing, near = found.closing, found.candidates
        say(f"\nLoops: {len(closing) or 'none'} closed by the file")
        _list([f"{joint.name}: {joint.links[0]} to {joint.links[1]}, {_word(joint)}" for joint in closing], "-")
        if near:
            say("Frames that lie near to each other, and could be held together:")
            _list([str(each) for each in near])
        elif closing:
            return

        def chosen(text: str) -> list[str]:
            wishes = []
            for word in _words(text) if "@" not in text else closures(text):
                number, _, kind = word.partition(":")
                if number.isdecimal():
                    wishes.append(near[_number(number, len(near)) - 1].wish + (f":{kind}" if kind else ""))
                else:
                    wishes.append(word)
            self.source["close"] = wishes
            self._choices()
            return wishes

        self.source["close"] = _answer(
            "Which are to be closed? Numbers, 2:revolute for a hinge about z, A:B[:TYPE] or A@x,y,z:B for others",
            "none",
            lambda text: [] if text == "none" else chosen(text),
        )

    def _ask_base(self, found: ImportChoices) -> None:
        say(
            f"\nBase: {found.bases[0]}"
            + (f", of {len(found.bases)} that no joint carries" if len(found.bases) > 1 else "")
        )
        if len(found.bases) > 1:
            _list(found.bases)
        name = _answer(
            "All of the robot, or only what lies between a link and the platform? Its name or number",
            "all",
            lambda text: text if text == "all" else _one(text, found.bases, found.links),
        )
        self.source["base"] = None if name == "all" else name

    def _ask_platform(self, found: ImportChoices) -> None:
        why = found.why or "says the file"
        say(f"\nPlatform: {found.platforms[0]}, {why}" if found.told else "\nPlatform: several could be")
        _list(found.platforms)
        name = _answer(
            "Which link is the platform? A number or a name",
            found.platforms[0] if found.told else None,
            lambda text: _one(text, found.platforms, found.links),
            self._view,
        )
        if found.why is not None or name != found.platforms[0]:
            self.source["platform"] = name

    def _ask_motors(self, found: ImportChoices) -> None:
        joints = found.moving
        driven = [joint.name for joint in joints if joint.motor is not None]
        say(f"\nMotors: {', '.join(driven) or 'none is told'}")
        _list([f"{joint.name} ({_word(joint)}){', driven' if joint.motor is not None else ''}" for joint in joints])

        def chosen(text: str) -> str:
            named = [joint.name for joint in joints]
            return ",".join(dict.fromkeys(_one(word, named, named) for word in _words(text)))

        as_told = "as told" if driven else "none"
        answer = _answer(
            "Which joints are driven? Numbers or names, with commas between",
            as_told,
            lambda text: text if text == as_told else chosen(text),
            self._view,
        )
        self.source["motors"] = None if answer == as_told else answer

    def _show_robot(self, mechanism: Mechanism) -> None:
        points = [joint.point for joint in mechanism.joints.values()]
        span = max((float(abs(one - other).max()) for one in points for other in points), default=0.0)
        say(
            f"\nRead: {mechanism.headline()}; base {mechanism.base}, platform {mechanism.platform}; its joints "
            f"span {span:.4g} m"
        )
        for note in mechanism.notes:
            say(f"  {note}")

    def _ask_unit(self, mechanism: Mechanism) -> Mechanism:
        from ..description.overrides import UNITS

        def meant(text: str) -> str:
            if text not in UNITS:
                raise ValueError(", ".join(UNITS))
            return text

        say(f"\nLengths: the robot's characteristic length would be {mechanism.length:.3g} m")
        unit = _answer(f"In which unit is the file? {', '.join(UNITS)}", "m", meant)
        self.source["unit"] = None if unit == "m" else unit
        return mechanism if unit == "m" else self._mechanism() or mechanism

    def _ask_segments(self, mechanism: Mechanism) -> str | None:
        segments = _segments(mechanism)
        say(
            "\nObserved: "
            + (
                "; ".join(f"leg {leg} at {seen.link}" for leg, seen in segments.items())
                or "no leg has a segment that could be watched"
            )
        )
        if not segments:
            return None
        from ..description.overrides import observe_links

        def chosen(text: str) -> str | None:
            if text == "so":
                return None
            named = [_one(word, (), mechanism.links) for word in _words(text)]
            observe_links(mechanism, named)
            return ",".join(named)

        return _answer("Watch these, or other links? Names, with commas between", "so", chosen)

    def _confirm(self) -> bool | None:
        there = " (it already exists and will be replaced)" if Path(self.target).exists() else ""

        def meant(text: str) -> bool | None:
            words = {"yes": True, "y": True, "no": False, "n": False, "again": None, "a": None}
            if text.lower() not in words:
                raise ValueError("yes, no or again")
            return words[text.lower()]

        return _answer(f"\nWrite {self.target}{there}? yes, no, again", "yes", meant, self._view)

    def _view(self) -> None:
        """The robot as it stands, in the browser."""
        import tempfile
        import webbrowser

        from ..errors import HrsynthError
        from ..present.view.view import view

        try:
            with Progress():
                page = Path(tempfile.mkdtemp(prefix="hrsynth-"), "robot.html")
                view(_read(self.source, self.observe, tell=False)).save(page)
        except HrsynthError as error:
            say(f"No picture yet: {error.lines()[0]}")
            return
        say(f"The robot is drawn in {page}")
        webbrowser.open(page.as_uri())


def _answer(question: str, default: str | None, meant: Callable[[str], T], view: Callable[[], None] | None = None) -> T:
    """What an answer means, the default for an empty one; asked again until it means something. Raises ``EOFError``
    where the input ends."""
    from ..errors import HrsynthError

    more = ("; v: a picture" if view else "") + ("" if default is None else f" [{default}]")
    while True:
        text = input(escape_steering(f"{question}{more}: ")).strip()
        if view is not None and text == "v":
            view()
            continue
        if not text and default is None:
            continue
        try:
            return meant(text or str(default))
        except HrsynthError as error:
            say(f"  {error.lines()[0]}")
        except ValueError as error:
            say(f"  {text!r:.60} is not an answer: {error}")


def _words(text: str) -> list[str]:
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise ValueError("nothing is named")
    return words


def _number(text: str, most: int) -> int:
    number = int(text) if len(text) < 6 else 0
    if not 1 <= number <= most:
        raise ValueError(f"numbers go from 1 to {most}" if most else "there are no numbers to choose from")
    return number


def _one(text: str, listed: Sequence[str], named: Iterable[str]) -> str:
    """The choice of that name or number."""
    if text in named or text in listed:
        return text
    if text.isdecimal():
        return listed[_number(text, len(listed)) - 1]
    raise ValueError("there is no such name")


def _list(lines: Sequence[str], mark: str | None = None) -> None:
    for number, line in enumerate(lines[:SHOWN], 1):
        say(f"  {mark or number:>2}  {line}")
    if len(lines) > SHOWN:
        say(f"      and {len(lines) - SHOWN} more, which can be named")


def _word(joint: Any) -> str:
    return str(joint.kind.name).lower()


def add(app: Group) -> None:
    """Make it a command."""
    add_command(
        app,
        "import",
        "A guided reader: shows what a robot's file says and what is guessed, asks for "
        "closures, base, platform, motors and segments, writes the native file, and prints the command that "
        "does the same without questions. With --yes, or without a terminal, it accepts and reports guesses.",
        (
            *SOURCE,
            Option("observe", "Links to watch, at their default segments.", "LINKS", group=OBSERVATION),
            flag("yes", "Ask no questions: accept the guesses."),
            flag("view", "Show the robot in the browser before the questions."),
            Option(
                "target",
                "The file to write, in the native dialect.",
                "FILE",
                default=NEEDED,
                flags=("-o", "--output"),
                group=output("").group,
            ),
            JSON,
        ),
        importing,
        ("leg.xml -o leg.urdf", "leg.urdf --close heel:toe:revolute --platform foot --yes -o own.urdf"),
        Import,
    )
