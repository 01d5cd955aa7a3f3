"""Plots: one style, round ticks, degrees at angles, a tilted plane of motion along its own axes."""

from __future__ import annotations

import ast
import io
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.mechanism.pose import Grid
from hrsynth.present import maps, palette, plots
from hrsynth.present.figure_format import PNG, print_figure, wrap_labels
from hrsynth.present.plots import MapPlane, format_ticks, round_ticks
from hrsynth.present.view.view import find_plane_normal
from strategies import random_rotation, transformed

PRESENT = Path(hrsynth.__file__).parent / "present"


@pytest.mark.parametrize("seed", range(200))
def test_ticks_are_round_inside_the_scale_and_neither_few_nor_many(seed: int):
    rng = np.random.default_rng(seed)
    low = 10.0 ** rng.uniform(-6, 4)
    high = low * 10.0 ** rng.uniform(np.log10(1.3), 8)
    ticks = round_ticks(low, high)
    assert 2 <= len(ticks) <= 10
    assert np.all((ticks >= low * (1 - 1e-9)) & (ticks <= high * (1 + 1e-9)))
    assert np.all(np.diff(ticks) > 0)
    for tick, words in zip(ticks, format_ticks(ticks), strict=True):
        assert float(words) == pytest.approx(tick, rel=1e-2)
        assert len(words.strip("0.").replace(".", "")) <= 3 or "e" in words


def test_every_function_that_makes_a_figure_draws_in_the_one_style():
    for file in {*PRESENT.glob("*.py")} - {PRESENT / "plots.py", PRESENT / "figure_format.py"}:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        assert "rcParams" not in file.read_text(encoding="utf-8"), file.name
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and "png(" in (text := ast.unparse(node)) and "-> bytes" in text:
                assert any("styled" in ast.unparse(each) for each in node.decorator_list), (file.name, node.name)


def test_notebooks_can_use_the_style():
    import matplotlib.style

    with matplotlib.style.context(plots.STYLE):
        cycle = [each["color"].lstrip("#").upper() for each in matplotlib.rcParams["axes.prop_cycle"]]
    assert cycle == [colour.lstrip("#").upper() for colour in palette.SERIES]


def test_notebooks_that_plot_use_it():
    for script in (Path(hrsynth.__file__).parents[2] / "notebooks").glob("[0-9]*.py"):
        text = script.read_text(encoding="utf-8")
        assert ("pyplot" in text) == (f'plt.style.use("{plots.STYLE}")' in text), script.name


def test_what_is_held_is_said_in_metres_and_degrees():
    figure, _ = plots.make_panels(1, 1, 3, 3)
    plots.draw_heading(figure, "title", Grid.parse("x=0:1:2,z=-0.7,phi=30deg"))
    assert figure.get_suptitle() == "title\nz = -0.7 m, φ = 30°"


@pytest.mark.some(3)
@pytest.mark.parametrize("seed", range(6))
def test_a_tilted_plane_of_motion_is_drawn_in_true_scale(seed: int):
    """Places of the map are as far apart as the platforms that they stand for, however the base is tilted."""
    rng = np.random.default_rng(seed)
    robot = transformed(load("3rrr_m1"), random_rotation(rng), rng.normal(scale=0.3, size=3))
    motion = ObservedRobot.of(robot).motion
    normal = find_plane_normal(motion)
    assert normal is not None
    names = [name for name, _ in sorted(zip("xyz", np.abs(normal), strict=True), key=lambda each: each[1])][:2]
    drawn = MapPlane.of([(name, np.linspace(0, 1, 5)) for name in names], motion, 0.1, 9)
    moved = motion.translations @ rng.normal(size=(motion.translations.shape[1], 8))
    moved[:, -1] = 0
    at = motion.position(motion.home)[:, None] + moved
    seen = np.array(drawn.spots(at[["xyz".index(name) for name in names]].T))
    np.testing.assert_allclose(np.linalg.norm(seen.T - seen.T[-1], axis=1), np.linalg.norm(moved, axis=0), atol=1e-9)
    assert drawn.labels[0].startswith("along (")


def test_beyond_a_tilted_grid_nothing_is_said():
    """What is not reached is hatched inside of the grid alone: of what lies beside it nothing was asked."""
    rng = np.random.default_rng(3)
    motion = ObservedRobot.of(transformed(load("3rpr_m1"), random_rotation(rng), np.zeros(3))).motion
    drawn = MapPlane.of([("x", np.linspace(0, 1, 5)), ("y", np.linspace(0, 1, 5))], motion, 0.1, 9)
    _, (place,) = plots.make_panels(1, 1, 3, 3)
    drawn.cells(place, np.full((5, 5), np.nan))
    (hatched,) = [patch for patch in place.patches if patch.get_hatch()]
    corners = hatched.get_path().vertices[:4]
    cells = np.stack(drawn.at(*np.meshgrid([-0.125, 1.125], [-0.125, 1.125], indexing="ij")), axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(sorted(map(tuple, corners)), sorted(map(tuple, cells)), atol=1e-12)
    assert not place.patch.get_hatch()


def test_a_level_plane_keeps_the_parts_of_its_poses():
    motion = ObservedRobot.of(load("quattro"), "1,4").motion
    drawn = MapPlane.of([("x", np.linspace(0, 1, 5)), ("y", np.linspace(0, 2, 5))], motion, 0.1, 9)
    assert (drawn.labels, drawn.tall) == (("x", "y"), 2.0)
    np.testing.assert_array_equal(drawn.at(np.array([3.0]), np.array([4.0])), [[3.0], [4.0]])


def test_legends_stand_beside_the_axes():
    import matplotlib.figure

    drawn: list[matplotlib.figure.Figure] = []

    def kept(figure: matplotlib.figure.Figure, _: plots.Paper) -> bytes:
        drawn.append(figure)
        return b""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(maps, "print_figure", kept)
        found = hrsynth.check(load("3rrr_m1"), grid="x=-0.2:0.2:9,y=-0.2:0.2:9,phi=0")
        maps.draw_distance_map(found)
    (figure,) = drawn
    figure.savefig(io.BytesIO())
    (beside,) = figure.legends
    assert beside.get_window_extent().x0 >= max(axes.get_window_extent().x1 for axes in figure.axes)


@pytest.mark.parametrize("name", [r"$\frac{1$", "$a^{b$", "$$", "a $ b", "$" + r"\sqrt{" * 6 + "$", "机器人"])
def test_a_name_is_drawn_as_it_is(name: str, recwarn: pytest.WarningsRecorder):
    @plots.in_style
    def drawn(text: str) -> bytes:
        figure, (axes,) = plots.make_panels(1, 1, 16.0, 5.0)
        figure.suptitle(text)
        axes.set_xlabel(text)
        axes.plot([0, 1], label=text)
        axes.legend()
        wrap_labels(figure)
        shown = {each.get_text() for each in (figure._suptitle, axes.xaxis.label)}
        assert {each.replace("\n", " ") for each in shown} == {text}
        return print_figure(figure, PNG)

    assert drawn(name) != drawn("x")
    assert not recwarn.list
