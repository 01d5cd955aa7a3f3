"""Figures on paper of any width: no text is small, leaves the page or lies on another; widths are as asked."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text

import hrsynth
from hrsynth.families.__main__ import main
from hrsynth.present import figure_format as papers
from hrsynth.present.figure_format import Paper, choose_paper, scale_figure
from hrsynth.present.outputs import OUTPUTS
from hrsynth.present.plots import make_empty_figure
from hrsynth.present.sketch import Sketch
from hrsynth.results import Result

SMALLEST = 6.0
SLACK = 1.0
"""Pixels at 100 an inch that a text may reach beyond where it belongs: rounding of glyphs."""


@cache
def six_poses(folder: str) -> str:
    main(folder, "six_poses")
    return f"{folder}/six_poses.urdf"


QUESTIONS: dict[str, Callable[[str], Any]] = {
    "check of a line": lambda _: hrsynth.check("quattro", "1,4", grid="x=-0.3:0.3:11,y=0,z=-0.7,phi=0"),
    "check of a plane": lambda _: hrsynth.check("quattro", "1,4", grid="x=-0.3:0.3:9,y=-0.3:0.3:9,z=-0.7,phi=0"),
    "check of a box": lambda _: hrsynth.check("quattro", "1,4", grid="x=-0.3:0.3:5,y=-0.3:0.3:5,z=-0.8:-0.6:5,phi=0"),
    "accuracy of a line": lambda _: hrsynth.accuracy(
        "quattro", "1,4", cone="0.1deg", grid="x=-0.3:0.3:11,y=0,z=-0.7,phi=0"
    ),
    "accuracy of a plane": lambda _: hrsynth.accuracy(
        "quattro", "1,4", cone="0.1deg", grid="x=-0.3:0.3:9,y=-0.3:0.3:9,z=-0.7,phi=0"
    ),
    "accuracy of a box": lambda _: hrsynth.accuracy(
        "quattro", "1,4", cone="0.1deg", grid="x=-0.3:0.3:5,y=-0.3:0.3:5,z=-0.8:-0.6:3,phi=0"
    ),
    "singularities": lambda _: hrsynth.singularities("3rrr_m1"),
    "modes in the plane": lambda _: hrsynth.modes("3rrr_m1"),
    "modes in space": lambda _: hrsynth.modes("hexa", "1,3,5"),
    "servo in the plane": lambda _: hrsynth.servo(
        "3rpr_m1", start="x=-0.08,y=-0.06,phi=-10deg", goal="x=0.034,y=0.23,phi=23deg"
    ),
    "servo in space": lambda _: hrsynth.servo(
        "quattro", "1,4", start="x=0,y=0,z=-0.75,phi=0", goal="x=-0.2,y=0,z=-0.56,phi=0"
    ),
    "equilibria in the plane": lambda _: hrsynth.equilibria("prrrp_m1", goal="mode:1"),
    "basins of a plane": lambda _: hrsynth.basins(
        "3rpr_m1", goal="x=0,y=0,phi=0", grid="x=0:0.3:6,y=0:0.3:7,phi=0", jobs=1
    ),
    "aspects": lambda _: hrsynth.aspects("quattro", "1,4"),
    "aspects with its section": lambda folder: hrsynth.aspects(six_poses(folder)),
}
ASKED = (("88mm", None), ("130mm", "10pt"), ("180mm", None), ("300mm", "9pt"))


@cache
def answer(name: str, folder: str) -> Result:
    found: Result = QUESTIONS[name](folder)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(tmp_path_factory.mktemp("robots"))


def drawn(found: Result, paper: tuple[str | None, str | None]) -> tuple[Any, list[Text]]:
    """The figure as it is printed, and the texts that are drawn in it."""
    figures: list[Any] = []
    texts: dict[int, Text] = {}
    fit, draw = Paper.fit, Text.draw

    def fitted(self: Paper, figure: Any) -> None:
        fit(self, figure)
        figures.append(figure)

    def seen(self: Text, *given: Any, **named: Any) -> None:
        if figures and self.get_visible() and self.get_text().strip():
            texts[id(self)] = self
        draw(self, *given, **named)

    (file,) = (each for each in OUTPUTS[found.shown_as].files if each.drawn)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Paper, "fit", fitted)
        patch.setattr(Text, "draw", seen)
        file.content(found, ".png", {"width": paper[0], "font": paper[1], "plane": None, "steps": 15, "seed": 0})
    return figures[0], list(texts.values())


def overlapping(texts: list[Text]) -> Iterator[tuple[str, str]]:
    boxes = [(each.get_text(), each.get_window_extent()) for each in texts]
    for (one, a), (other, b) in combinations(boxes, 2):
        wide, tall = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if min(wide, tall) > 2 * SLACK:
            yield one, other


@pytest.mark.some(1, 2)
@pytest.mark.parametrize(
    "name", [name if name == "check of a line" else pytest.param(name, marks=pytest.mark.slow) for name in QUESTIONS]
)
def test_text_is_legible_on_the_page_and_apart_at_any_width(name: str, folder: str):
    found = answer(name, folder)
    for given in ASKED:
        figure, texts = drawn(found, given)
        width, height = figure.get_size_inches() * figure.dpi
        paper = choose_paper(".png", *given)
        assert len(texts) >= 3
        smallest = min(texts, key=lambda each: each.get_fontsize())
        least = SMALLEST * (1.0 if paper.size is None else paper.size / papers.PRINTED)
        assert smallest.get_fontsize() >= least, (given, smallest.get_text(), smallest.get_fontsize())
        if paper.width is not None:
            assert figure.get_figwidth() == pytest.approx(paper.width, abs=1e-9)
        for each in texts:
            box = each.get_window_extent()
            inside = min(box.x0, box.y0, width - box.x1, height - box.y1)
            assert inside >= -SLACK, (given, each.get_text(), inside)
        assert not list(overlapping(texts)), (given, list(overlapping(texts)))
        for legend in figure.legends:
            box = legend.get_window_extent()
            for place in figure.axes:
                other = place.get_window_extent()
                wide = min(box.x1, other.x1) - max(box.x0, other.x0)
                tall = min(box.y1, other.y1) - max(box.y0, other.y0)
                assert place.name == "3d" or not place.get_visible() or min(wide, tall) <= 2 * SLACK, given


def test_every_drawing_command_is_looked_at():
    assert {name for name, outputs in OUTPUTS.items() if any(file.drawn for file in outputs.files)} == {
        name.split()[0] for name in QUESTIONS
    }


def test_a_size_alone_scales_the_whole_figure():
    found = answer("check of a line", "")
    usual, larger = (drawn(found, (None, size))[0] for size in (None, "15pt"))
    assert larger.get_size_inches() == pytest.approx(1.5 * usual.get_size_inches())


@pytest.mark.parametrize(
    "whole",
    [
        "from x = 0.25 m, y = -0.5 m to x = 0.75 m, y = 0.125 m",
        "with the same directions of legs 1, 2, 3 as at x=0,y=0.5",
    ],
)
def test_lines_break_at_spaces_into_like_parts_and_keep_numbers_with_their_units(whole: str):
    from hrsynth.present.plots import make_empty_figure

    figure = make_empty_figure(4, 4)
    for width in (3.0, 2.0, 1.5, 1.0):
        text = figure.text(0.5, 0.5, whole)
        papers.wrap(text, width)
        lines = text.get_text().split("\n")
        assert " ".join(lines) == whole
        assert text.get_window_extent().width <= width * figure.dpi + 1e-9
        assert not any(re.match(r"m\b|=", line) or re.search(r"=$|\d,$", line) for line in lines)


@pytest.mark.parametrize("scale", [1.0, 0.6])
@pytest.mark.parametrize("extent", [(1, 1, 1), (1, 0.3, 3), (4, 2, 0.5)])
def test_names_of_axes_in_space_are_beside_their_scales(extent: tuple[float, float, float], scale: float):
    figure = make_empty_figure(6, 6)
    place = Sketch.of(None, np.zeros((1, 3)), []).place(figure, (0.1, 0.1, 0.8, 0.8), np.array([(0, 0, 0), extent]))
    scale_figure(figure, list({id(each): each for each in figure.findobj()}.values()), scale)
    figure.draw_without_rendering()
    for axis in (place.xaxis, place.yaxis, place.zaxis):
        name = axis.label.get_window_extent()
        numbers = [tick.label1.get_window_extent() for tick in axis.get_major_ticks()]
        assert (np.abs(name.corners() - figure.bbox.size / 2) < figure.bbox.size / 2).all()
        assert not any(name.shrunk(0.8, 0.8).overlaps(each) for each in numbers)
        gap = min(
            np.linalg.norm(np.subtract(*(each.corners().mean(axis=0) for each in (name, other)))) for other in numbers
        )
        assert gap < 60 * scale * figure.dpi / 72
