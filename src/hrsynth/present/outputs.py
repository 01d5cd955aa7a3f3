"""Outputs of each kind of result: text, figures, files and their requirements, for prompts, notebooks and commands.

The maker of an output is named ``module:function`` of this folder, or with a dot before it of the package, and loaded
on use.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ..errors import BadRequest
from ..options import Option
from ..results import Result
from .text.tables import encode_csv

Content = bytes | Iterable[bytes]
Asked = Mapping[str, Any]
"""Options by name."""
PNG, CSV, HTML = ".png", ".csv", (".html", ".htm")
FIGURES = (PNG, ".pdf", ".svg")


def load_function(name: str | Callable[..., Any]) -> Callable[..., Any]:
    """Return the function ``module:function`` of this folder or ``.module:function`` of the package."""
    if callable(name):
        return name
    module, _, attribute = name.partition(":")
    found: Callable[..., Any] = getattr(import_module(f".{module}", __package__), attribute)
    return found


@dataclass(frozen=True, eq=False)
class File:
    """File of a result: ``makers`` return the content by the file's suffix, ``refusal`` is the message without one. The
    command line has an ``option`` for it with its ``help`` (or None), its JSON a ``field``.

    ``part`` names the part of the result that is written, None if it was not requested; then ``needs`` are the options
    that request it, and ``words`` its name. ``computed`` is computed from the result first, with the options ``asks``
    and the seed; the makers get it too, and the JSON as ``record``.
    """

    refusal: str
    makers: Mapping[str, str | Callable[..., Any]]
    holds: str = ""
    """Content: the subject of the sentence that reports where it is written."""
    help: str = ""
    option: str | None = "output"
    field: str | None = "file"
    allowed: str | None = None
    part: str | None = None
    needs: tuple[str, ...] = ()
    words: str = ""
    computed: str | None = None
    asks: tuple[Option, ...] = ()
    record: str | None = None
    nothing: str | None = None
    """Function that returns why there is nothing to draw in a result, or None."""
    drawn: bool = False
    """True for a figure with options for width and font."""
    installed: tuple[str, str] | None = None
    """Suffix, and function that raises ``MissingExtra`` if its library is missing."""
    limited: tuple[tuple[str, ...], str] | None = None
    """Suffixes, and function that raises ``BadRequest`` for an observed robot that cannot be drawn with the options."""
    plotted: tuple[str, ...] = (".png", ".svg", ".pdf")
    """Suffixes that are drawn with matplotlib."""
    streamed: tuple[str, str] | None = None
    """Suffix that is written in parts during the analysis, and the parameter that names the file."""

    @property
    def takes(self) -> tuple[str, ...]:
        """Names of its options."""
        return tuple(each.name for each in self.asks)

    def require(self, path: str | None, asked: Asked) -> None:
        """Raise ``BadRequest`` if there is nothing to write, the suffix is unknown or the file cannot be written, and
        ``MissingExtra``; called before long work."""
        from ..description.files import require_writable

        for name in ("width", "font") if self.drawn else ():
            if asked.get(name) is not None and (path is None or Path(path).suffix.lower() not in FIGURES):
                raise BadRequest(
                    f"--{name}: no figure is written", asked[name], remedy=f"Add --output with {', '.join(FIGURES)}."
                )
            if asked.get(name) is not None:
                load_function("figure_format:choose_paper")(PNG, asked.get("width"), asked.get("font"))
        if path is None:
            for name in {"plane", "grid"} & {*self.takes}:
                if asked.get(name) is not None:
                    raise BadRequest(f"--{name}: no figure is written", asked[name], remedy="Add -o FILE.png.")
            return
        ending = Path(path).suffix.lower()
        if self.needs and all(asked[name] is None for name in self.needs):
            options = " or ".join(f"--{name}" for name in self.needs)
            raise BadRequest(f"--output: only {self.words} is written", path, remedy=f"Add {options}.")
        known = (*self.makers, *(self.streamed or ())[:1])
        if ending not in known:
            raise BadRequest(f"{self.refusal}: unknown extension", path, self.allowed or known)
        if ending in self.plotted:
            load_function("plots:require_matplotlib")()
        if self.installed is not None and ending == self.installed[0]:
            load_function(self.installed[1])()
        require_writable(path)

    def require_drawable(self, path: str | None, robot: Any, asked: Asked) -> None:
        """Raise ``BadRequest`` if the robot cannot be drawn with the options; called before long work."""
        if path is not None and self.limited is not None and Path(path).suffix.lower() in self.limited[0]:
            from ..analysis.observed import ObservedRobot

            watched = {name: asked[name] for name in ("observe", "camera", "sensor", "seed") if name in asked}
            load_function(self.limited[1])(
                ObservedRobot.of(robot, **watched), **{name: asked[name] for name in self.takes}
            )

    def question_fields(self, path: str | None) -> dict[str, str]:
        """Return the parameter of an analysis that writes the file itself."""
        if path is None or self.streamed is None or Path(path).suffix.lower() != self.streamed[0]:
            return {}
        return {self.streamed[1]: path}

    def sentence(self, path: str) -> str:
        """Report where it was written."""
        return f"{self.holds} is written to {path}."

    def unwritten(self, found: Any, path: str) -> str | None:
        """Return the message if there is nothing to write."""
        why = None if self.nothing is None else load_function(self.nothing)(found)
        return None if why is None else f"{path} is not drawn: {why}"

    def content(self, found: Any, ending: str, asked: Asked) -> tuple[Content, dict[str, Any]]:
        """Return the content of the file and further JSON fields; raise ``BadRequest`` if there is nothing to draw."""
        maker = load_function(self.makers[ending])
        if ending in FIGURES and self.drawn:
            paper = load_function("figure_format:choose_paper")(ending, asked.get("width"), asked.get("font"))
            maker = partial(maker, paper=replace(paper, given=asked.get("axes", ())))
        if self.computed is None:
            return maker(found), {}
        value = load_function(self.computed)(found, **{name: asked[name] for name in (*self.takes, "seed")})
        return maker(found, value), {} if self.record is None else {self.record: value.to_dict()}

    def writer(self, found: Any, path: str, asked: Asked) -> tuple[Callable[[], object], dict[str, Any]]:
        """Return a function that writes the file, completely or not at all, and further JSON fields."""
        from ..description.files import write_whole

        if self.question_fields(path):
            return (lambda: None), {}
        content, more = self.content(found, Path(path).suffix.lower(), asked)
        return partial(write_whole, path, content), more


class HiddenFile(File):
    """File of the hidden robot in any format."""

    def require(self, path: str | None, asked: Asked) -> None:
        """Raise ``BadRequest`` for the suffix of no format."""
        from ..description import list_save_targets

        if path is not None:
            list_save_targets(path)

    def sentence(self, path: str) -> str:
        """Report all files of a format."""
        from ..description import list_save_targets

        return super().sentence(" and ".join(map(str, list_save_targets(path))))

    def unwritten(self, found: Any, path: str) -> str | None:
        """Return the message if there is no hidden robot."""
        return (
            "nothing was written: every observed direction is constant, there is no hidden robot"
            if found.hidden is None
            else None
        )

    def writer(self, found: Any, path: str, asked: Asked) -> tuple[Callable[[], object], dict[str, Any]]:
        """Return a function that writes the robot."""
        from ..description import save

        return partial(save, found.hidden, path), {}


class CodeFile(File):
    """File of source code in the requested language."""

    def require(self, path: str | None, asked: Asked) -> None:
        """Raise ``BadRequest`` also for the suffix of another language."""
        super().require(path, asked)
        endings = {"python": (".py",), "c++": (".hpp", ".h")}.get(asked["lang"])  # another is refused by the analysis
        if path is not None and endings and Path(path).suffix.lower() not in endings:
            raise BadRequest(
                f"{self.refusal} of --lang {asked['lang']}: extension",
                path,
                endings,
                remedy="Change the extension or --lang.",
            )


def map_figure_endings(maker: str) -> dict[str, str]:
    """Return one maker for all suffixes of a figure."""
    return dict.fromkeys(FIGURES, maker)


@dataclass(frozen=True)
class Outputs:
    """Outputs of one kind of result: ``text`` formats it, ``inline`` makes HTML for a notebook, if that differs."""

    text: str | Callable[..., str]
    files: tuple[File, ...] = ()
    inline: str | None = None


CERTIFICATE = File(
    "cannot write the certificate",
    {".json": ".certificates:write_certificate"},
    "The certificate",
    "Write a certificate (.json), which the command verify, or a single file of plain Python, can check.",
    "certificate",
    "certificate_file",
)
OUTPUTS = {
    "accuracy": Outputs(
        "text.runs:format_accuracy",
        (
            File(
                "cannot write the errors",
                {**map_figure_endings("maps:draw_error_map"), CSV: "maps:format_error_table"},
                "The map of errors",
                "Write the plane or grid: map.png, .pdf, .svg; a table, map.csv; or an array, map.npy, part by part: "
                "up to 10^10 poses, and after an interruption the same command continues.",
                part="field",
                needs=("plane", "grid"),
                words="a plane or a grid",
                drawn=True,
                streamed=(".npy", "into"),
            ),
        ),
    ),
    "advise": Outputs("text.robots:format_advice"),
    "aspects": Outputs(
        "text.poses:format_aspects",
        (
            File(
                "cannot draw the aspects",
                map_figure_endings("aspects:draw_aspects"),
                "The figure of the aspects",
                "Draw the table of pairs of modes: aspects.png, .pdf, .svg.",
                nothing="aspects:explain_no_table",
                drawn=True,
            ),
        ),
    ),
    "basins": Outputs(
        "text.runs:format_basins",
        (
            File(
                "cannot write the basins",
                {**map_figure_endings("basins:draw_basins"), CSV: "basins:format_basin_table"},
                "The map of basins",
                "Draw where each start ends: basins.png, .pdf, .svg, or a table, basins.csv.",
                drawn=True,
            ),
        ),
    ),
    "branch": Outputs("text.branches:format_branch"),
    "certificate": Outputs("text.robots:format_certificate"),
    "check": Outputs(
        "text.poses:check",
        (
            File(
                "cannot write the grid",
                {**map_figure_endings("maps:draw_distance_map"), CSV: "maps:check_table"},
                "The grid",
                "Write the grid: map.png, .pdf, .svg, or a table, map.csv.",
                part="grid",
                needs=("grid",),
                words="a grid of poses",
                drawn=True,
            ),
        ),
    ),
    "derive": Outputs(
        "text.robots:format_derivation",
        (
            HiddenFile(
                "cannot write the robot", {}, "The hidden robot", "Write the hidden robot.", field="hidden_file"
            ),
            File(
                "cannot write the report",
                dict.fromkeys(HTML, "report.pages:render_report"),
                "The report",
                "Write a page (.html) with drawings, proof, singularities, assembly modes and accuracy.",
                "report",
                "report_file",
                computed="report.parts:collect_report_parts",
                plotted=HTML,
            ),
            CERTIFICATE,
            File("cannot draw the robots", {".svg": "drawings.schematic:draw_derivation_svg"}, option=None, plotted=()),
        ),
    ),
    "equilibria": Outputs(
        "text.equilibria:format_equilibria",
        (
            File(
                "cannot draw the equilibria",
                map_figure_endings("equilibria:draw_equilibria"),
                "The figure of the equilibria",
                "Draw the equilibria: equilibria.png, .pdf, .svg.",
                drawn=True,
            ),
        ),
    ),
    "export": Outputs(
        "text.robots:describe_export",
        (
            CodeFile(
                "cannot write the code",
                dict.fromkeys((".hpp", ".h", ".py"), "text.robots:encode_program"),
                "The code",
                "Write the code: robot.hpp (C++), robot.py (Python).",
                plotted=(),
            ),
        ),
    ),
    "legs": Outputs("text.robots:format_legs"),
    "lint": Outputs("text.lint:lint"),
    "loop_check": Outputs("text.poses:format_loop_check"),
    "modes": Outputs(
        "text.poses:format_modes",
        (
            File(
                "cannot draw the modes",
                map_figure_endings("modes:draw_modes"),
                "The figure of the modes",
                "Draw the modes: modes.png, .pdf, .svg.",
                nothing="modes:explain_no_figure",
                drawn=True,
            ),
            CERTIFICATE,
        ),
    ),
    "path": Outputs("text.poses:format_path", (CERTIFICATE,)),
    "robot": Outputs("text.robots:format_robot"),
    "select": Outputs("text.runs:format_selection"),
    "servo": Outputs(
        "text.runs:format_run",
        (
            File(
                "cannot draw the run",
                {**map_figure_endings("runs:draw_run"), ".gif": "animations:draw_animation"},
                "The figure of the run",
                "Draw the run: curves (run.png, .pdf, .svg) or an animation (run.gif).",
                allowed=".png, .pdf, .svg (curves) or .gif (camera view)",
                drawn=True,
                installed=(".gif", ".simulation.rendered_images:drawing"),
                limited=((".gif",), "animations:require_legs"),
                plotted=(*FIGURES, ".gif"),
            ),
        ),
    ),
    "singularities": Outputs(
        "text.poses:format_singularity",
        (
            File(
                "cannot draw the locus",
                map_figure_endings("maps:draw_locus_map"),
                "The locus",
                "Draw the locus: locus.png, .pdf, .svg.",
                computed="maps:compute_singular_locus",
                asks=(
                    Option("plane", "Plane of poses to draw, such as z=-0.7.", "PART=VALUE"),
                    Option(
                        "grid",
                        "What to draw instead: two ranges of poses, joints or motors: roll=-1:1:41,pitch=-1:1:41 "
                        "or motors:NAME=-1:1:41,NAME=-1:1:41.",
                        "GRID",
                    ),
                    Option("steps", "Poses along each side of the plane.", None, int, 51, low=5, high=300),
                ),
                record="locus",
                drawn=True,
                limited=(FIGURES, "maps:require_plane"),
            ),
        ),
    ),
    "verdict": Outputs("text.robots:format_verdict"),
    "view": Outputs(
        "text.robots:format_view",
        (
            File(
                "cannot write the view",
                dict.fromkeys(HTML, "studio.saved:render_static_page"),
                "The view",
                "Write a page that needs no server (.html).",
                "static",
                allowed=".html",
            ),
        ),
        inline="studio.saved:format_inline",
    ),
}
"""Outputs by the name under which a result is shown (:attr:`hrsynth.results.Result.shown_as`): its command, or its
kind if it is a part of a result."""


def get_outputs(name: str) -> Outputs:
    """Return the outputs of a kind of result: those of the table, else those that its class defines."""
    if name in OUTPUTS:
        return OUTPUTS[name]
    kind = Result.answer_of(name)
    makers: dict[str, str | Callable[..., Any]] = {}
    if kind.plot is not Result.plot:
        makers |= dict.fromkeys(FIGURES, "plots:draw_own_figure")
    if kind.rows is not Result.rows:
        makers[CSV] = _format_csv
    help = f"Write {name}{', '.join(makers)}."
    file = File(f"cannot write the result of {name}", makers, f"The result of {name}", help, drawn=PNG in makers)
    return Outputs(kind.text, (file,) if makers else ())


def list_file_fields(name: str) -> dict[str, None]:
    """Return the JSON fields of the files of a command, none of which is written."""
    files = [file for file in get_outputs(name).files if file.option is not None]
    every = (*(file.record for file in files), *(file.field for file in files))
    return dict.fromkeys(field for field in every if field is not None)


def _format_csv(found: Result) -> bytes:
    """The rows of an answer as comma-separated values."""
    return encode_csv(found.rows())
