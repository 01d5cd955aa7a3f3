"""Command import: a dialog that shows a file, requests what is missing and writes the native file."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..characters import escape_steering
from ..options import NEEDED, OBSERVATION, Option, flag, output
from ..records import OfRobot
from .colour import print_text
from .commands import Group, add_command
from .options import EXPLAIN, JSON, SOURCE, load_robot, load_robot_silently, warn
from .progress import Progress

if TYPE_CHECKING:
    from ..description.assembly.choices import ImportChoices
    from ..mechanism import Mechanism
    from ..mechanism.observation import Observation

T = TypeVar("T")
IMPORT_CHOICES_PRINTED_MAX = 20
"""Largest number of listed choices; others are entered by name."""


class Import(OfRobot):
    """A robot that was read with overrides or assumptions and written, and the command that does the same without a
    dialog."""

    file: str
    repeat: str
    links: int
    joints: int
    base: str
    motors: list[str]
    observed: dict[str, str]
    warnings: list[str]


def run_import(target: str, observe: str | None, yes: bool, view: bool, json: bool, **source: Any) -> None:
    """Read a robot with overrides or assumptions, and write it."""
    from ..description import find_robot_file, save
    from ..description.files import require_other, require_writable
    from ..errors import BadRequest
    from ..present.show import format_record

    path = find_robot_file(source["robot"])
    if Path(target).suffix.lower() != ".urdf":
        raise BadRequest(f"--output {target}: not a .urdf file", remedy="Use hrsynth convert for others.")
    require_writable(target)
    require_other(target, path)
    asking = not (yes or json) and sys.stdin.isatty() and sys.stdout.isatty()
    if asking:
        sys.stdin.reconfigure(errors="replace")  # type: ignore[union-attr]
        source, observe = _ask_all(path, source, observe, target, view)
    with Progress():
        mechanism = _read(source, observe, tell=not asking)
        lost = [str(warning) for warning in save(mechanism, target, "native")]
    motors = [name for name, joint in mechanism.joints.items() if joint.is_actuated]
    notes = [str(note) for note in mechanism.notes]
    if not motors:
        notes.append(
            "open: no joint is actuated, so results that need motors are not available. Name them with --motors JOINTS."
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
            "observed": {leg: seen.link for leg, seen in _list_segments(mechanism).items()},
            "notes": notes,
            "warnings": lost,
        }
        print_text(format_record("import", mechanism, fields))
    else:
        print_text(
            f"{mechanism.name} with {len(mechanism.links)} links and {len(mechanism.joints)} joints, platform "
            f"{mechanism.platform_words}, is written to {target}.\nSame without dialog: {again}"
        )


def repeat_command(source: dict[str, Any], observe: str | None, target: str) -> str:
    """Return the command line that writes the same file without a dialog."""
    words = ["hrsynth", "import", source["robot"]]
    words += [word for option in SOURCE[1:] for word in option.typed(source[option.name])]
    words += ["--observe", observe] if observe else []
    return shlex.join([*words, "--yes", "-o", target])


def _read(source: dict[str, Any], observe: str | None, *, tell: bool) -> Mechanism:
    """Read the mechanism with the overrides; ``tell``: print all its notes."""
    from ..description.overrides import observe_links, parse_names

    mechanism = load_robot({**source, EXPLAIN.name: True}) if tell else load_robot_silently(dict(source))
    mechanism.require_platform()
    return mechanism if observe is None else observe_links(mechanism, parse_names(observe) or ())


def _list_segments(mechanism: Mechanism) -> dict[str, Observation]:
    """Return the observed segment of each leg that has one."""
    from ..errors import HrsynthError
    from ..mechanism.legs import decompose
    from ..mechanism.normal import reduce_to_normal_form
    from ..mechanism.sensors import list_default_segments

    try:
        return list_default_segments(decompose(reduce_to_normal_form(mechanism).mechanism))
    except HrsynthError:
        return {}


def _ask_all(
    path: Path, source: dict[str, Any], observe: str | None, target: str, view: bool
) -> tuple[dict[str, Any], str | None]:
    """Run the dialog until its answers are confirmed; end the command if it is cancelled."""
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
        print_text("")
        status = 2 if isinstance(error, EOFError) else 130
    warn("nothing written")
    raise SystemExit(status)


class _Dialog:
    """One round of the dialog: closures, base, platform, motors, segments, confirmation."""

    def __init__(self, path: Path, source: dict[str, Any], observe: str | None, target: str) -> None:
        self.path, self.source, self.observe, self.target = path, source, observe, target
        self.asked = any(source[name] in (None, []) for name in ("close", "base", "platform", "motors"))

    def ask(self, view: bool) -> bool | None:
        """Return True to write, False to stop, None to repeat the dialog."""
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
        """Return the open choices of the file with the answers so far."""
        from ..description.assembly.choices import choices
        from ..description.overrides import Overrides, parse_names

        given = self.source
        with Progress():
            return choices(
                self.path,
                Overrides(
                    given["base"],
                    None,
                    parse_names(given["motors"]),
                    tuple(given["close"] or ()),
                    tuple(name for name in given["freeze"].split(",") if name),
                    unit=given["unit"],
                    args=tuple(given["args"] or ()),
                    model=given["model"],
                ),
            )

    def _mechanism(self) -> Mechanism | None:
        """Read the robot with the answers; print errors and return None if that fails."""
        from ..errors import HrsynthError

        try:
            with Progress():
                return _read(self.source, self.observe, tell=False)
        except HrsynthError as error:
            if not self.asked:
                raise
            print_text("\n".join(["", *error.lines(), "The file cannot be read this way. Answer again.", ""]))
            return None

    def _show_file(self, found: ImportChoices) -> None:
        kinds: dict[str, int] = {}
        for joint in found.joints:
            kinds[_name_joint(joint)] = kinds.get(_name_joint(joint), 0) + 1
        counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        print_text(f"{self.path}: {found.dialect}, {len(found.links)} links, {len(found.joints)} joints ({counts})")
        for note in found.notes:
            print_text(f"  {note}")

    def _ask_closures(self, found: ImportChoices) -> None:
        """Request loop closures besides those of the file."""
        from ..description.overrides import parse_closures

        closing, near = found.closing, found.candidates
        print_text(f"\nLoops: {len(closing) or 'none'} closed by the file")
        _list([f"{joint.name}: {joint.links[0]} to {joint.links[1]}, {_name_joint(joint)}" for joint in closing], "-")
        if near:
            print_text("Candidates for closures (frames near each other):")
            _list([str(each) for each in near])
        elif closing:
            return

        def chosen(text: str) -> list[str]:
            wishes = []
            for word in parse_closures(",".join(re.split(r"[,\s]+", text.strip(", ")))):
                number, _, kind = word.partition(":")
                if number.isdecimal():
                    wishes.append(near[_parse_number(number, len(near)) - 1].wish + (f":{kind}" if kind else ""))
                else:
                    wishes.append(word)
            self.source["close"] = wishes
            self._choices()
            return wishes

        self.source["close"] = _answer(
            "Close which? Numbers, 2:revolute/0,0,1 for a revolute joint about z, A:B[:TYPE] or A@x,y,z:B for others",
            "none",
            lambda text: [] if text == "none" else chosen(text),
        )

    def _ask_base(self, found: ImportChoices) -> None:
        print_text(
            f"\nBase: {found.bases[0]}"
            + (f", one of {len(found.bases)} links without parent" if len(found.bases) > 1 else "")
        )
        if len(found.bases) > 1:
            _list(found.bases)
        name = _answer(
            "Use the whole robot, or only the links between another base and the platform? Name or number",
            "all",
            lambda text: text if text == "all" else _choose_one(text, found.bases, found.links),
        )
        self.source["base"] = None if name == "all" else name

    def _ask_platform(self, found: ImportChoices) -> None:
        why = found.why or "named by the file"
        print_text(f"\nPlatform: {found.platforms[0]}, {why}" if found.told else "\nPlatform: several candidates")
        _list(found.platforms)
        name = _answer(
            "Which link is the platform? Number or name",
            found.platforms[0] if found.told else None,
            lambda text: _choose_one(text, found.platforms, found.links),
            self._view,
        )
        if found.why is not None or name != found.platforms[0]:
            self.source["platform"] = name

    def _ask_motors(self, found: ImportChoices) -> None:
        joints = found.moving
        driven = [joint.name for joint in joints if joint.motor is not None]
        print_text(f"\nMotors: {', '.join(driven) or 'none named'}")
        _list(
            [
                f"{joint.name} ({_name_joint(joint)}){', actuated' if joint.motor is not None else ''}"
                for joint in joints
            ]
        )

        def chosen(text: str) -> str:
            named = [joint.name for joint in joints]
            return ",".join(dict.fromkeys(_choose_one(word, named, named) for word in _split_words(text)))

        as_told = "as in the file" if driven else "none"
        answer = _answer(
            "Which joints are actuated? Numbers or names, with commas between",
            as_told,
            lambda text: text if text == as_told else chosen(text),
            self._view,
        )
        self.source["motors"] = None if answer == as_told else answer

    def _show_robot(self, mechanism: Mechanism) -> None:
        points = [joint.point for joint in mechanism.joints.values()]
        span = max((float(abs(one - other).max()) for one in points for other in points), default=0.0)
        print_text(
            f"\nRead: {mechanism.headline()}; base {mechanism.base}, platform {mechanism.platform}; joint span "
            f"{span:.4g} m"
        )
        for note in mechanism.notes:
            print_text(f"  {note}")

    def _ask_unit(self, mechanism: Mechanism) -> Mechanism:
        from ..description.overrides import UNITS

        def meant(text: str) -> str:
            if text not in UNITS:
                raise ValueError(", ".join(UNITS))
            return text

        print_text(f"\nLengths: characteristic length {mechanism.length:.3g} m if the file is in metres")
        unit = _answer(f"Unit of the file? {', '.join(UNITS)}", "m", meant)
        self.source["unit"] = None if unit == "m" else unit
        return mechanism if unit == "m" else self._mechanism() or mechanism

    def _ask_segments(self, mechanism: Mechanism) -> str | None:
        segments = _list_segments(mechanism)
        print_text(
            "\nObserved: "
            + (
                "; ".join(f"leg {leg} at {seen.link}" for leg, seen in segments.items())
                or "no leg has an observable segment"
            )
        )
        if not segments:
            return None
        from ..description.overrides import observe_links

        def chosen(text: str) -> str | None:
            if text == "these":
                return None
            named = [_choose_one(word, (), mechanism.links) for word in _split_words(text)]
            observe_links(mechanism, named)
            return ",".join(named)

        return _answer("Observe these, or other links? Names, with commas between", "these", chosen)

    def _confirm(self) -> bool | None:
        there = " (existing file, will be replaced)" if Path(self.target).exists() else ""

        def meant(text: str) -> bool | None:
            words = {"yes": True, "y": True, "no": False, "n": False, "again": None, "a": None}
            if text.lower() not in words:
                raise ValueError("yes, no or again")
            return words[text.lower()]

        return _answer(f"\nWrite {self.target}{there}? yes, no, again", "yes", meant, self._view)

    def _view(self) -> None:
        """Show the robot with the answers so far in the browser."""
        import tempfile
        import webbrowser

        from ..errors import HrsynthError
        from ..present.view.view import view

        try:
            with Progress():
                page = Path(tempfile.mkdtemp(prefix="hrsynth-"), "robot.html")
                view(_read(self.source, self.observe, tell=False)).save(page)
        except HrsynthError as error:
            print_text(f"No figure yet: {error.lines()[0]}")
            return
        print_text(f"Robot drawn in {page}")
        webbrowser.open(page.as_uri())


def _answer(question: str, default: str | None, meant: Callable[[str], T], view: Callable[[], None] | None = None) -> T:
    """Return the meaning of an answer, of the default if it is empty; repeat until it is valid. Raises ``EOFError``
    at the end of input."""
    from ..errors import HrsynthError

    more = ("; v: view" if view else "") + ("" if default is None else f" [{default}]")
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
            print_text(f"  {error.lines()[0]}")
        except ValueError as error:
            print_text(f"  {text!r:.60}: not a valid answer: {error}")


def _split_words(text: str) -> list[str]:
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise ValueError("no name")
    return words


def _parse_number(text: str, most: int) -> int:
    number = int(text) if len(text) < 6 else 0
    if not 1 <= number <= most:
        raise ValueError(f"numbers go from 1 to {most}" if most else "no numbers to choose from")
    return number


def _choose_one(text: str, listed: Sequence[str], named: Iterable[str]) -> str:
    """Return the choice of a name or number."""
    if text in named or text in listed:
        return text
    if text.isdecimal():
        return listed[_parse_number(text, len(listed)) - 1]
    raise ValueError("unknown name")


def _list(lines: Sequence[str], mark: str | None = None) -> None:
    for number, line in enumerate(lines[:IMPORT_CHOICES_PRINTED_MAX], 1):
        print_text(f"  {mark or number:>2}  {line}")
    if len(lines) > IMPORT_CHOICES_PRINTED_MAX:
        print_text(f"      and {len(lines) - IMPORT_CHOICES_PRINTED_MAX} more, by name")


def _name_joint(joint: Any) -> str:
    return str(joint.kind.name).lower()


def add(app: Group) -> None:
    """Register the command."""
    add_command(
        app,
        "import",
        "Read a foreign file in a dialog: show its content and the assumptions, choose closures, base, platform, "
        "motors and segments, write the native file, and print the command that does the same without a dialog. "
        "With --yes, or without a terminal, assumptions are accepted and reported.",
        (
            *SOURCE,
            Option("observe", "Links to observe, at their default segments.", "LINKS", group=OBSERVATION),
            flag("yes", "No dialog: accept the assumptions."),
            flag("view", "Show the robot in the browser before the dialog."),
            Option(
                "target",
                "The file to write, in the native format.",
                "FILE",
                default=NEEDED,
                flags=("-o", "--output"),
                group=output("").group,
            ),
            JSON,
        ),
        run_import,
        ("leg.xml -o leg.urdf", "leg.urdf --close heel:toe:revolute/0,0,1 --platform sole --yes -o own.urdf"),
        Import,
    )
