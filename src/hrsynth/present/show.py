"""Results as text, JSON, HTML for notebooks and figures."""

from __future__ import annotations

import html as markup
import io
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, overload

from ..characters import name_steering
from ..errors import BadRequest, MissingExtra
from ..options import require_range
from ..results import Result, with_spelling
from ..version import __version__
from .outputs import CSV, FIGURES, OUTPUTS, File, get_outputs, list_file_fields, load_function

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from ..mechanism.model import Mechanism
    from ..mechanism.pose import Grid, Pose

PICTURES = (*FIGURES, ".gif")
"""Suffixes of figures."""


@dataclass(frozen=True, repr=False)
class Picture:
    """Figure of a result, shown by a notebook if it is ``png`` or ``svg``."""

    content: bytes
    words: str
    kind: str
    draws: Callable[[str], bytes]
    """Function that draws it with another of the suffixes ``endings``."""
    endings: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.words}>"

    def _repr_png_(self) -> bytes | None:
        return self.content if self.kind == "png" else None

    def _repr_svg_(self) -> str | None:
        return self.content.decode() if self.kind == "svg" else None

    def save(self, file: str | Path) -> None:
        """Write the figure, completely or not at all, drawn again for another suffix.

        Raises
        ------
        BadRequest
            If the suffix is none of ``endings``.
        """
        from ..description.files import write_whole

        ending = _require_ending(file, self.endings)
        write_whole(file, self.content if ending == f".{self.kind}" else self.draws(ending))


def text(result: Result) -> str:
    """Return the text that the command line prints of a result.

    Parameters
    ----------
    result
        Result of an analysis.

    Returns
    -------
    str
        Text of several lines.

    Examples
    --------
    >>> print(hrsynth.text(hrsynth.legs("rrrrr_m1")).splitlines()[0])
    rrrrr_m1   R*RRRR*   2 dof
    """
    shown: str = load_function(get_outputs(result.shown_as).text)(result)
    return shown


def format_record(command: str, robot: Mechanism | None, fields: dict[str, Any]) -> str:
    """Return the JSON text of a command: one object with ``command`` and ``version``, and the name, platform and
    notes of the ``robot`` if it concerns one (no NaN, no infinity)."""
    head: dict[str, Any] = {}
    if robot is not None:
        chosen = None if robot.choice is None else {"chosen": robot.choice.chosen, "reason": robot.choice.reason}
        link = None if robot.has_open_platform else robot.platform
        head = {"robot": robot.name, "platform": {"link": link, **(chosen or {})}}
        head |= {"notes": [str(note) for note in robot.notes]} if robot.notes else {}
    text = io.StringIO()  # json.dumps keeps all small pieces of the text at once
    json.dump(
        {**head, "command": command, "version": __version__, **fields},
        text,
        ensure_ascii=False,
        indent=2,
        allow_nan=False,
    )
    return text.getvalue()


def html(result: Result) -> str:
    """Return the HTML that a notebook shows: a moving view, otherwise the text in columns, motors underlined by markup.

    Parameters
    ----------
    result
        Result of an analysis.

    Returns
    -------
    str
        HTML fragment.

    Examples
    --------
    >>> hrsynth.html(hrsynth.derive("3rrr_m1"))[:4]
    '<pre'
    """
    said, inline = text(result), get_outputs(result.shown_as).inline
    if inline is not None:
        try:
            return str(load_function(inline)(result))
        except MissingExtra as error:
            said = f"{said}\n\n{error}"
    shown = re.sub("(.)\u0332", r"<u>\1</u>", markup.escape(name_steering(said)))
    return f'<pre style="white-space: pre; overflow-x: auto">{shown}</pre>'


def to_json(result: Result) -> str:
    """Return a result as the JSON text that its command prints with ``--json``; also as ``Result.to_json()``.

    Parameters
    ----------
    result
        Result of an analysis.

    Returns
    -------
    str
        One JSON object.

    Examples
    --------
    >>> import json
    >>> json.loads(hrsynth.to_json(hrsynth.legs("rrrrr_m1")))["robot"]
    'rrrrr_m1'
    """
    setup = getattr(result, "setup", None)
    asked = (getattr(setup, "robot", setup), getattr(result, "robot", None))
    robot: Any = next((value for value in asked if isinstance(value, Result)), None)
    return format_record(result.command, robot, {**result.to_dict(), **list_file_fields(result.command)})


def to_pandas(result: Result) -> Any:
    """Return a result as a ``pandas.DataFrame``; also as ``Result.to_pandas()``.

    Parameters
    ----------
    result
        Result of an analysis.

    Returns
    -------
    pandas.DataFrame
        The table that the command writes as .csv (grid, plane, basins), or else the one row of ``to_row()``.

    Raises
    ------
    MissingExtra
        If pandas is not installed.

    Examples
    --------
    >>> list(hrsynth.to_pandas(hrsynth.check("3rrr_m1", grid="x=0:0.01:2,y=0")).columns[:3])
    ['x', 'y', 'state']
    """
    try:
        pandas = import_module("pandas")
    except ModuleNotFoundError:
        raise MissingExtra("a table of pandas", "pandas", package=True) from None
    for file in get_outputs(result.shown_as).files:
        if CSV in file.makers and (file.part is None or getattr(result, file.part) is not None):
            return pandas.read_csv(io.BytesIO(_render_content(file, result, {}, CSV)))
    return pandas.DataFrame([result.to_row()])


@overload
def draw(
    result: Result,
    file: str | Path | None = None,
    *,
    plane: Pose | str | None = None,
    grid: Grid | str | None = None,
    steps: int = 51,
    width: str | None = None,
    font: str | None = None,
    ax: None = None,
) -> Picture: ...
@overload
def draw(
    result: Result,
    *,
    plane: Pose | str | None = None,
    grid: Grid | str | None = None,
    steps: int = 51,
    ax: Axes | Sequence[Axes],
) -> None: ...
@with_spelling
def draw(
    result: Result,
    file: str | Path | None = None,
    *,
    plane: Pose | str | None = None,
    grid: Grid | str | None = None,
    steps: int = 51,
    width: str | None = None,
    font: str | None = None,
    ax: Any = None,
) -> Picture | None:
    """Draw a result: schemes of a derivation, modes, aspects, a servo run, poses over a grid, or the Type 2 locus.

    Parameters
    ----------
    result
        Result of an analysis.
    file
        File to write: .png, .pdf or .svg; of a servo run also .gif; of a derivation .svg.
    plane
        Plane of poses of the Type 2 locus, of the result of ``singularities``.
    grid
        Two ranges of the pose, of joints or of motors for that locus instead, as ``"motors:a=-1:1:41,b=-1:1:41"``.
    steps
        Poses per side of the plane, 5 to 300.
    width
        Width of the figure (``"88mm"``).
    font
        Font and size of its text (``"serif 8pt"``).
    ax
        Axes of matplotlib in which to draw a map, the curves of a servo run or a table of aspects instead, in the style
        of their figure; a sequence of axes if there are several panels: errors of ``accuracy`` have one for positions
        and one for orientations, runs of ``servo`` three or four. ``ax.get_legend().remove()`` leaves out a legend.

    Returns
    -------
    Picture
        Figure, shown by a notebook; None if ``ax`` is given.

    Raises
    ------
    BadRequest
        If the result has no figure, or another number of panels than axes are given.

    Examples
    --------
    >>> hrsynth.draw(hrsynth.modes("3rrr_m1"), width="88mm").kind
    'png'
    """
    require_range("steps", steps, "an integer", 5, 300)
    asked: dict[str, Any] = {"plane": plane, "grid": grid, "steps": steps, "seed": 0, "width": width, "font": font}
    if ax is not None:
        asked["axes"] = tuple(ax.flat if hasattr(ax, "flat") else ax if isinstance(ax, Sequence) else (ax,))
        if file is not None or width is not None or font is not None:
            raise BadRequest("draw: ax with file, width or font", "both", remedy="Save the figure of the axes.")
    if not isinstance(result, Result):
        raise BadRequest("draw: not a result", repr(result), remedy="Give the result of a function of hrsynth.")
    for drawn in get_outputs(result.shown_as).files:
        endings = tuple(each for each in PICTURES if each in drawn.makers)
        if not endings or (drawn.part is not None and getattr(result, drawn.part) is None):
            continue
        if (plane, grid) != (None, None) and "plane" not in drawn.takes:
            raise BadRequest("plane, grid: not for this result", type(result).__name__, "result of singularities")
        if not drawn.drawn and any(value is not None for value in (width, font, ax)):
            raise BadRequest("width, font, ax: not for this result", type(result).__name__, remedy="Omit them.")
        draws = partial(_render_content, drawn, result, asked)
        if ax is not None:
            draws(endings[0])
            return None
        ending = endings[0] if file is None else _require_ending(file, endings)
        picture = Picture(draws(ending), result.headline(), ending[1:], draws, endings)
        if file is not None:
            picture.save(file)
        return picture
    raise BadRequest(
        "draw: no figure of this result",
        repr(result),
        [
            f"{name} with {each.words}" if each.words else name
            for name, outputs in OUTPUTS.items()
            for each in outputs.files
            if any(ending in each.makers for ending in PICTURES)
        ],
    )


def _require_ending(file: str | Path, endings: tuple[str, ...]) -> str:
    """Return the suffix of a file for a figure; raise ``BadRequest`` if it is unknown."""
    from ..description.files import convert_to_path, require_writable

    ending = convert_to_path(file).suffix.lower()
    if ending not in endings:
        raise BadRequest("cannot write the figure: unknown extension", str(file), endings)
    require_writable(file)
    return ending


def _render_content(drawn: File, result: Result, asked: dict[str, Any], ending: str) -> bytes:
    content, _ = drawn.content(result, ending, asked)
    return b"".join([content] if isinstance(content, bytes) else content)
