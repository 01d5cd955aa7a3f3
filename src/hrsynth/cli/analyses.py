"""Commands that run one analysis of a robot: their options, and the outputs of their results."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..index import list_analyses, list_analysis_options
from ..options import OUTPUT, Option, output
from ..present.outputs import File, get_outputs, list_file_fields
from ..progress import on_progress
from .colour import paint, print_text
from .commands import Group, add_command
from .options import EXPLAIN, JSON, SOURCE, load_robot, split_names, warn, warn_radians, warn_turns
from .progress import Progress
from .studio import PORT, serve


@dataclass(frozen=True)
class Question:
    """Command of an analysis: its declared options, those of its files, and ``more``. ``shows`` replaces printing
    when no file was written; ``needs`` raises beforehand if a library is missing."""

    name: str
    more: tuple[Option, ...] = ()
    shows: Callable[..., None] | None = None
    needs: Callable[[], object] | None = None

    def add(self, app: Group) -> None:
        """Register the command."""
        declared = list_analyses()[self.name]
        files = get_outputs(self.name).files
        given = list_analysis_options(self.name)
        own = [each for each in given if each.name != "seed"]
        own += [each for file in files for each in file.asks]
        own += [_make_file_option(each) for each in files if each.option is not None]
        drawn = FIGURE if any(each.drawn for each in files) else ()
        seed = [each for each in given if each.name == "seed" and declared["seeded"]]
        every = [SOURCE[0], *own, *self.more, *seed, *drawn, JSON, *SOURCE[1:], EXPLAIN]
        add_command(app, self.name, declared["help"], every, self.answer, declared["examples"])

    def answer(self, *, json: bool, **values: Any) -> None:
        """Run the analysis, write the requested files, print the result."""
        import hrsynth

        from ..description.files import require_other
        from ..present.show import format_record, text

        files = {each: values.pop(each.option) for each in get_outputs(self.name).files if each.option is not None}
        for each, path in files.items():
            each.require(path, values)
        if self.needs is not None and not json and not any(files.values()):
            self.needs()
        source = {each.name: values[each.name] for each in SOURCE}
        more: dict[str, Any] = dict(list_file_fields(self.name))
        writers = []
        with Progress() as progress, on_progress(progress.tell):
            mechanism = load_robot(values)
            function = getattr(hrsynth, self.name)
            given = self._given_options(function, values)
            for each, path in files.items():
                given |= each.question_fields(path)
                if path is not None:
                    require_other(path, source["robot"], mechanism.file)
                each.require_drawable(path, mechanism, values | given)
            for option in ("at", "start", "goal"):
                warn_turns(option, values.get(option))
            found = function(mechanism, **given)
            for option in ("cone", "noise"):
                warn_radians(option, values.get(option))
            for each, path in files.items():
                if path is None:
                    continue
                why = each.unwritten(found, path)
                if why is not None:
                    warn(why)
                    files[each] = None
                    continue
                writer, told = each.writer(found, path, values)
                writers.append(writer)
                more |= told
        for write in writers:
            write()
        written = {each.field: path for each, path in files.items() if each.field is not None}
        if json:
            print_text(format_record(self.name, mechanism, {**found.to_dict(), **more, **written}))
        elif self.shows is not None and not any(written.values()):
            self.shows(found, source=source, **values)
        else:
            print_text(text(found), paint=paint)
            for each, path in files.items():
                if path is not None:
                    print_text(each.sentence(path))
        motors = mechanism.proposed_motors if self.name in ("derive", "check") else None
        if motors is not None and motors not in getattr(found, "more", ()):
            warn(motors)
        found.require_answered(**values)

    def _given_options(self, function: Callable[..., Any], values: dict[str, Any]) -> dict[str, Any]:
        """Return the given options that a function takes."""
        known = inspect.signature(function).parameters
        given = {name: value for name, value in values.items() if name in known and value is not None}
        if "observe" in given:
            given["observe"] = split_names(given["observe"])
        if len(given.get("camera", ())) == 1:
            (given["camera"],) = given["camera"]
        return given


def _require_server() -> None:
    """Raise ``MissingExtra`` if a library that serves pages is missing."""
    from ..present.studio.server import require_libraries

    require_libraries()


def _serve_view(found: Any, source: dict[str, Any], port: int, open_: bool, **_: Any) -> None:
    """Serve a view until Ctrl-C, and open its page in the browser."""
    from ..present.show import text
    from ..present.studio.server import serve_view

    serve(serve_view(found, port, open_, source), f"{text(found)}\nThe view")


def _make_file_option(file: File) -> Option:
    """Return the option of a file to which a result can be written."""
    if file.option == "output":
        return output(file.help)
    return Option(str(file.option), file.help, "FILE", group=OUTPUT)


FIGURE = (
    Option("width", "Width of a figure, such as 88mm or 3.5in; its text has 8pt.", "LENGTH", group=OUTPUT),
    Option("font", "Font of a figure, its size, or both: serif, 8pt, 'DejaVu Sans 8pt'.", group=OUTPUT),
)
VIEW = Question(
    "view",
    (PORT, Option("open_", "Open the page in the browser.", None, bool, True, ("--open/--no-open",))),
    _serve_view,
    _require_server,
)
QUESTIONS = tuple(VIEW if name == VIEW.name else Question(name) for name in list_analyses())
"""Commands in the order of the help."""
