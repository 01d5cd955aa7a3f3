"""Results at a prompt, in print and in a notebook: one line, the command line's text, the same as HTML, pictures."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from functools import cache
from inspect import signature
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import hrsynth
from hrsynth import load
from hrsynth.cli import app, run_command
from hrsynth.cli.analyses import FIGURE, QUESTIONS
from hrsynth.cli.options import EXPLAIN, JSON, SOURCE
from hrsynth.errors import BadRequest
from hrsynth.present.outputs import OUTPUTS, get_outputs, load_function
from hrsynth.results import Result

GOAL, OTHER = "x=0.05,y=0.3", "x=0.06,y=0.3"
BOX = "shoulder_1=-0.05:0.05,shoulder_2=-0.05:0.05"
ASKED = {
    "derive": (lambda robot: hrsynth.derive(robot), []),
    "legs": (lambda robot: hrsynth.legs(robot), []),
    "check": (lambda robot: hrsynth.check(robot, at=[GOAL]), ["--at", GOAL]),
    "singularities": (lambda robot: hrsynth.singularities(robot, points=50), ["--points", "50"]),
    "advise": (lambda robot: hrsynth.advise(robot), []),
    "branch": (lambda robot: hrsynth.branch(robot, BOX), ["--box", BOX]),
    "modes": (lambda robot: hrsynth.modes(robot, at=GOAL), ["--at", GOAL]),
    "path": (lambda robot: hrsynth.path(robot, start=GOAL, goal=OTHER), ["--start", GOAL, "--goal", OTHER]),
    "servo": (lambda robot: hrsynth.servo(robot, start=OTHER, goal=GOAL), ["--start", OTHER, "--goal", GOAL]),
    "accuracy": (lambda robot: hrsynth.accuracy(robot, cone="0.1deg", at=[GOAL]), ["--cone", "0.1deg", "--at", GOAL]),
    "select": (
        lambda robot: hrsynth.select(robot, start=GOAL, goal=OTHER, runs=0),
        ["--start", GOAL, "--goal", OTHER, "--runs", "0"],
    ),
}
"""Each command's function, and the same question on the command line."""


@cache
def answer(command: str) -> Result:
    return ASKED[command][0](load("rrrrr_m1"))


def every_result() -> Iterator[tuple[str, str]]:
    """The name of each class of results and what it is shown as."""
    for path in Path(hrsynth.__file__).parent.rglob("*.py"):
        yield from re.findall(r"^class (\w+)\(Result(.*)\):", path.read_text(encoding="utf-8"), re.MULTILINE)


def test_every_kind_of_result_has_its_outputs():
    kinds = [re.fullmatch(r', shown_as="(\w+)"', kind)[1] for _, kind in every_result()]
    assert sorted(kinds) == sorted(OUTPUTS)


def test_what_makes_an_output_is_there():
    for outputs in OUTPUTS.values():
        names = [outputs.text]
        for file in outputs.files:
            names += [*file.makers.values(), *filter(None, (file.computed, file.nothing, *(file.installed or ())[1:]))]
        assert all(callable(load_function(name)) for name in names)


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.name)
def test_each_option_goes_somewhere(question):
    """To the function of the command, to a file, or to what shows and ends it; nothing is dropped without a word."""
    files = OUTPUTS[question.name].files
    known = {
        *signature(getattr(hrsynth, question.name)).parameters,
        *(file.option for file in files),
        *(name for file in files for name in file.takes),
        *(option.name for option in (*SOURCE, *FIGURE, JSON, EXPLAIN)),
    }
    if question.shows is not None:
        known |= set(signature(question.shows).parameters)
    options = {option.name for option in app.commands[question.name].options}
    assert options <= known
    assert {name for file in files for name in (*file.needs, *file.takes)} <= options


@pytest.mark.some(1, 3)
@pytest.mark.parametrize("command", ASKED)
def test_a_result_is_printed_as_by_the_command_line(command: str, capsys: pytest.CaptureFixture[str]):
    found = answer(command)
    assert run_command([command, "rrrrr_m1", *ASKED[command][1]]) == 0
    assert str(found) == hrsynth.text(found) == capsys.readouterr().out.rstrip("\n")


@pytest.mark.parametrize(
    "command", [pytest.param(each, marks=pytest.mark.slow) if each == "select" else each for each in ASKED]
)
def test_a_result_is_one_line_at_a_prompt_and_marked_up_in_a_notebook(command: str):
    found = answer(command)
    assert repr(found).startswith(f"<{type(found).__name__}: rrrrr_m1")
    assert "\n" not in repr(found)
    assert len(repr(found)) < 300
    marked = found._repr_html_()
    assert marked == hrsynth.html(found)
    inside = re.sub("<u>(.)</u>", "\\1\u0332", marked.removesuffix("</pre>").split(">", 1)[1])
    assert html.unescape(inside) == str(found)
    assert isinstance(found.to_dict(), dict)  # type: ignore[attr-defined]


def test_parts_of_results_and_robots_are_shown_too():
    robot = load("quattro")
    found = hrsynth.derive(robot, observe=["1", "4"])
    for each, words in [(robot, "leg 4"), (found.equivalence, "passed at 20"), (found.verdict, "rank 4 of 4")]:
        assert words in str(each)
        assert "\n" not in repr(each)
        assert words in each._repr_html_()
    assert "\n" not in repr(found.setup)
    assert str(found.equivalence) in " ".join(str(found).split())


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe"), [("rrrrr_m1", None), ("quattro", ["1", "4"]), ("3rrr_m1", None)])
def test_a_derivation_lists_the_modes_that_the_command_lists(name: str, observe: list[str] | None):
    robot = load(name)
    mine, theirs = hrsynth.derive(robot, observe).modes(), hrsynth.modes(robot, observe)
    assert mine.to_dict() == theirs.to_dict()
    assert [repr(mode) for mode in mine.modes] == [repr(mode) for mode in theirs.modes]
    assert mine.modes[0].goal


def test_a_derivation_holds_the_directions_at_the_pose_it_is_given():
    found = hrsynth.derive(load("rrrrr_m1"))
    assert str(found.modes(at=GOAL).pose).startswith("x=0.05,y=0.3,")
    assert found.modes(at=GOAL, real=True).kind == "real"


@pytest.mark.some(1)
@pytest.mark.parametrize("command", ["modes", "servo", pytest.param("singularities", marks=pytest.mark.long)])
def test_pictures_of_results_are_shown_in_notebooks_and_saved(command: str, tmp_path):
    options = {"steps": 9} if command == "singularities" else {}
    picture = hrsynth.draw(answer(command), **options)
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.save(tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes() == picture.content
    assert picture._repr_svg_() is None
    with pytest.raises(BadRequest, match=r"p\.jpg"):
        picture.save(tmp_path / "p.jpg")


@pytest.mark.slow
def test_pictures_of_grids():
    robot = load("rrrrr_m1")
    grid = "x=-0.02:0.02:3,y=0.3:0.34:3"
    for found in (hrsynth.check(robot, grid=grid), hrsynth.accuracy(robot, cone="0.1deg", grid=grid)):
        assert hrsynth.draw(found)._repr_png_().startswith(b"\x89PNG")


def test_a_result_is_drawn_in_axes_of_a_figure_of_the_reader():
    """The curve in the axes holds the numbers of the grid, and the style of the figure is untouched."""
    import matplotlib
    from matplotlib.figure import Figure

    found, before = hrsynth.check("rrrrr_m1", grid="x=-0.02:0.02:5,y=0.3"), dict(matplotlib.rcParams)
    place, other = Figure().subplots(1, 2)
    hrsynth.draw(found, ax=place)
    drawn = [line.get_xydata() for line in place.lines if len(line.get_xydata()) == 5]
    values = found.grid.values("type2")  # type: ignore[union-attr]
    assert np.array_equal(drawn[0], np.column_stack([np.linspace(-0.02, 0.02, 5), values]))
    assert "rrrrr_m1" in place.get_title()
    assert place.get_legend() is None
    assert dict(matplotlib.rcParams) == before
    hrsynth.draw(hrsynth.check("rrrrr_m1", grid="x=-0.02:0.02:3,y=0.3:0.34:3"), ax=other)
    assert len(place.figure.axes) == 3  # with the scale of colours
    for ax, result, words in (
        ([place, other], found, "got 2, expected 1"),
        (place, hrsynth.modes("3rrr_m1"), "layout of its own"),
        (place, hrsynth.derive("3rrr_m1"), "not for this result"),
    ):
        with pytest.raises(BadRequest, match=words):
            hrsynth.draw(result, ax=ax)
    with pytest.raises(BadRequest, match="Save the figure"):
        hrsynth.draw(found, "map.png", ax=place)  # type: ignore[call-overload]


@pytest.mark.some(2)
@pytest.mark.parametrize(("name", "observe"), [("rrrrr_m1", None), ("quattro", ["1", "4"]), ("3ppr_m1", None)])
def test_a_derivation_is_drawn_as_two_schemes(name: str, observe: list[str] | None):
    found = hrsynth.derive(load(name), observe)
    picture = hrsynth.draw(found)
    root = ElementTree.fromstring(picture._repr_svg_())
    schemes = root.findall("{http://www.w3.org/2000/svg}svg")
    assert picture._repr_png_() is None
    assert len(schemes) == 1 + (found.hidden is not None)
    width, height = (float(root.get(name)) for name in ("width", "height"))
    for scheme in schemes:
        assert float(scheme.get("x")) + float(scheme.get("width")) <= width
        assert float(scheme.get("y")) + float(scheme.get("height")) <= height


def test_what_has_no_picture_is_refused():
    for found in (answer("legs"), answer("check"), answer("accuracy")):
        with pytest.raises(BadRequest, match="no figure"):
            hrsynth.draw(found)
    with pytest.raises(BadRequest, match="plane"):
        hrsynth.draw(answer("modes"), plane="z=0")


class Reach(Result):
    """An answer that says, draws and writes itself."""

    shown_as = "reach"

    def headline(self) -> str:
        return "reach: 1 m"

    def text(self) -> str:
        return "reaches\n1 m"

    def plot(self, axes) -> None:
        axes.plot([0, 1], [0, 1])

    def rows(self):
        return [("x", "y"), (0, 1.5)]


def reach(robot) -> Reach:
    return Reach()


def test_an_answer_may_say_draw_and_write_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """As a new question does that is declared in one module."""
    public = Result.public
    monkeypatch.setattr(Result, "public", staticmethod(lambda name: reach if name == "reach" else public(name)))
    (file,) = get_outputs("reach").files
    assert hrsynth.text(Reach()) == "reaches\n1 m"
    assert hrsynth.draw(Reach()).content.startswith(b"\x89PNG")
    hrsynth.draw(Reach(), tmp_path / "reach.pdf")
    assert (tmp_path / "reach.pdf").read_bytes().startswith(b"%PDF")
    assert file.content(Reach(), ".csv", {}) == (b"x,y\n0,1.5\n", {})
