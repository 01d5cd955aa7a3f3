"""Format of figures: file, width, text size and font, and the layout of narrow ones."""

from __future__ import annotations

import difflib
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from ..characters import name_steering
from ..errors import BadRequest
from .sketch import NAME_ON_AXIS, NUMBER_ON_AXIS

USUAL, PRINTED = 10.0, 8.0
"""Text size (points) of the layout, and smallest text size of a figure unless another is requested."""
BESIDE, AXES, LEAST = 2.3, 5.0, 3.2
"""Room for a legend beside the axes, what must be left to them, and the narrowest layout (inches with usual text)."""
TITLE_BORDER_INCHES_MIN = 0.15
"""Left free on both sides of a title (inches)."""
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "in": 25.4}
WIDTHS, TEXTS = (1.0, 40.0), (4.0, 40.0)
"""The least and the largest width of a figure (inches) and size of its text (points)."""


@dataclass(frozen=True)
class Paper:
    """Format of a figure: the suffix of its file, its width (inches), the size (points) of its text and its font;
    None: as it was made. Figures are laid out with text of the usual size in the ``room`` that this leaves, and then
    scaled as a whole. ``given`` are axes of a figure that is not ours, in which to draw instead."""

    ending: str = ".png"
    width: float | None = None
    size: float | None = None
    font: str | None = None
    given: tuple[Any, ...] = ()

    @property
    def room(self) -> float:
        """The largest width (inches) of a layout with text of the usual size."""
        return inf if self.width is None else self.width * USUAL / (self.size or PRINTED)

    def wide(self, natural: float) -> float:
        """Return the width (inches) of a layout that has ``natural`` if it is free: all of the room if the text size is
        requested too. Raise ``BadRequest`` if axes are given: the figure has a layout of its own."""
        if self.given:
            raise BadRequest("ax: this figure has a layout of its own", remedy="Omit ax, and give a file.")
        return self.room if self.width is not None and self.size is not None else min(natural, self.room)

    def axes(self, natural: float, least: float = AXES) -> float:
        """The width (inches) of a layout without the legend that is to stand beside it, or below where that would leave
        less than ``least``."""
        rest = self.wide(natural + BESIDE) - BESIDE
        return rest if rest >= max(AXES, least) else self.wide(natural)

    def columns(self, most: int, side: float) -> int:
        """Return the number of axes, of ``side`` inches at least, that fit beside each other."""
        return most if self.room == inf else max(1, min(most, int(self.room / side)))

    def fit(self, figure: Any) -> None:
        """Break lines that are too long for their place, and scale a figure with its texts and strokes."""
        if self.room != inf and self.size is not None:
            figure.set_figwidth(self.room)
        wrap_labels(figure)
        scale = (self.size or USUAL) / USUAL if self.width is None else self.width / figure.get_figwidth()
        every: list[Any] = list({id(each): each for each in figure.findobj()}.values())
        for each in every:
            if self.font is not None and hasattr(each, "set_fontfamily"):
                each.set_fontfamily(self.font)
        for axis in list_axes(figure):
            if self.font is not None:
                axis.set_tick_params(labelfontfamily=self.font)
        if scale != 1.0:
            scale_figure(figure, every, scale)


PNG = Paper()
GIVEN_LEGEND: dict[str, Any] = {"fontsize": "small", "framealpha": 0.7}
"""Style of a legend in given axes: what it hides can be seen."""


@dataclass(frozen=True)
class GivenFigure:
    """Figure of given axes, as a maker sees it: the title and the legend belong to the first of them."""

    axes: tuple[Any, ...]

    def suptitle(self, text: str) -> Any:
        """Set the title."""
        return self.axes[0].set_title(text)

    def colorbar(self, *given: Any, **named: Any) -> Any:
        """Draw a scale of colours beside axes."""
        return self.axes[0].figure.colorbar(*given, **named)


def choose_paper(ending: str, width: str | None, font: str | None) -> Paper:
    """Return the format of a figure: ``width`` as 88mm, 8.8cm or 3.5in, ``font`` as a name, a size (8pt) or both
    (Times 8pt). Raise ``BadRequest``."""
    inches = size = None
    if width is not None:
        found = re.fullmatch(r"(\d+\.?\d*) *(mm|cm|in)", width.strip(), re.ASCII)
        inches = 0.0 if found is None else float(found[1]) * MILLIMETRES[found[2]] / MILLIMETRES["in"]
        if not WIDTHS[0] <= inches <= WIDTHS[1]:
            raise BadRequest("--width", width, f"{WIDTHS[0]:g}in to {WIDTHS[1]:g}in, as 88mm, 8.8cm or 3.5in")
    if font is not None:
        name, points = re.fullmatch(r"(.*?)(?:(?:^| +)(\d+\.?\d*) *pt)?", font.strip(), re.ASCII).groups()  # type: ignore[union-attr]
        size = None if points is None else float(points)
        if size is not None and not TEXTS[0] <= size <= TEXTS[1]:
            raise BadRequest("--font", font, f"a name, a size of {TEXTS[0]:g}pt to {TEXTS[1]:g}pt, or both")
        font = require_font(name)
    made = Paper(ending, inches, size, font)
    if inches is not None and made.room < LEAST:
        points = size or PRINTED
        most, least = np.floor(10 * inches * USUAL / LEAST) / 10, np.ceil(25.4 * LEAST * points / USUAL)
        raise BadRequest(
            f"--width {width}: text of {points:g}pt does not fit",
            remedy=f"Set --font to at most {most:g}pt, or --width to at least {least:.0f}mm.",
        )
    return made


def require_font(name: str) -> str | None:
    """A font that is installed, None for no name; raises ``BadRequest``."""
    from matplotlib import font_manager

    known = {each.name for each in font_manager.fontManager.ttflist}
    if name and name not in known and name not in ("serif", "sans-serif", "monospace"):
        close = difflib.get_close_matches(name, known, 3, 0.4)
        raise BadRequest("--font: font not found", name, ", ".join(["an installed font", *close, "serif, sans-serif"]))
    return name or None


def print_figure(figure: Any, paper: Paper) -> bytes:
    """The bytes of a matplotlib figure; of a PNG without ``savefig``, which would draw it twice."""
    import matplotlib.text

    if paper.given:
        return b""
    for each in figure.findobj(matplotlib.text.Text):
        each.set_text(name_steering(each.get_text()))
    stream = io.BytesIO()
    paper.fit(figure)
    if paper.ending == ".png":
        figure.set_dpi(150)
        figure.canvas.print_png(stream, pil_kwargs={"compress_level": 3})
    else:
        known = {"CreationDate": None} if paper.ending == ".pdf" else {"Date": None}
        with matplotlib.rc_context({"pdf.fonttype": 42, "svg.hashsalt": "hrsynth"}):
            figure.savefig(stream, format=paper.ending[1:], metadata=known, dpi=150)
    return stream.getvalue()


def wrap_labels(figure: Any) -> None:
    """Break titles and names of axes that are longer than their place; where axes are placed by themselves, let them
    find it."""
    if figure.get_layout_engine() is None:
        return
    if figure.get_suptitle():
        wrap_title(figure, figure._suptitle)
    figure.draw_without_rendering()
    for place in figure.axes:
        box = place.get_window_extent()
        for text, pixels in ((place.title, box.width), (place.xaxis.label, box.width), (place.yaxis.label, box.height)):
            wrap(text, pixels / figure.dpi)
    figure.draw_without_rendering()


def wrap_title(figure: Any, title: Any) -> float:
    """Break a title where it is wider than its figure; its height (inches)."""
    wrap(title, figure.get_figwidth() - 2 * TITLE_BORDER_INCHES_MIN)
    return float(title.get_window_extent().height / figure.dpi)


def wrap(text: Any, width: float) -> None:
    """Break the lines of a text of a figure at spaces, but for those of units and of lists of numbers, so that none is
    longer than ``width`` inches, and all that come of one are about as long."""

    def length(line: str) -> float:
        text.set_text(line)
        box = text.get_window_extent()
        return float((box.height if text.get_rotation() else box.width) / text.get_figure(root=True).dpi)

    lines = []
    for given in text.get_text().split("\n"):
        whole = length(given)
        words = re.split(r"(?<!=)(?!(?<=\d,) \d) (?!=|m\b)", given)
        broken = [given]
        if whole > width:
            least = -(-whole // width)
            shares = (whole / least * (1 + step / 10) for step in range(10))
            tries = [fill_lines(words, length, share) for share in (*(each for each in shares if each < width), width)]
            broken = min(tries, key=lambda each: (len(each), max(map(length, each))))
        lines += broken
    text.set_text("\n".join(lines))


def fill_lines(words: list[str], length: Callable[[str], float], width: float) -> list[str]:
    """Words in lines, each as long as ``width`` allows."""
    lines = words[:1]
    for word in words[1:]:
        longer = f"{lines[-1]} {word}"
        if length(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def draw_legend_within(figure: Any, entries: list[Any], width: float, **where: Any) -> float:
    """A legend of a figure in as many columns as ``width`` inches allow; its height (inches)."""
    for columns in range(len(entries), 0, -1):
        made = figure.legend(handles=entries, ncols=columns, **where)
        box = made.get_window_extent()
        if box.width <= width * figure.dpi or columns == 1:
            return float(box.height / figure.dpi)
        made.remove()
    return 0.0


def list_axes(figure: Any) -> list[Any]:
    """All axes with ticks."""
    return [axis for place in figure.axes for axis in place._axis_map.values()]


def scale_figure(figure: Any, every: list[Any], scale: float) -> None:
    """Scale a figure with all texts, strokes and marks."""
    for each in every:
        for name, power in (("fontsize", 1), ("linewidth", 1), ("markersize", 1), ("sizes", 2)):
            if hasattr(each, f"set_{name}"):
                getattr(each, f"set_{name}")(np.multiply(scale**power, getattr(each, f"get_{name}")()))
    for axis in list_axes(figure):
        given = axis.get_tick_params()
        for label in axis.get_ticklabels()[:1]:
            axis.set_tick_params(labelsize=label.get_fontsize())
        numbers, names = (NUMBER_ON_AXIS, NAME_ON_AXIS) if axis.axes.name == "3d" else (0.0, 0.0)
        pad = numbers + scale * (given.get("pad", 3.5) - numbers)
        axis.set_tick_params(pad=pad, length=scale * given.get("length", 3.5))
        axis.labelpad = names + scale * (axis.labelpad - names)
    figure.set_size_inches(scale * figure.get_size_inches())
