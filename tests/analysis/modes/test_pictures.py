"""Figures of assembly modes: modes are the common points of the loci, numbered as in the text; figures are fresh."""

from __future__ import annotations

import ast
import json
import re
import shlex
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.cli import run_command
from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest
from hrsynth.geometry.loci import Circle, Line, Point
from hrsynth.geometry.vectors import rotate_about_axis
from hrsynth.present.coupler import evaluate_curve, sweep_third_point, trace_coupler, trace_coupler_chains
from hrsynth.present.modes import MARKS, describe_scene, draw_modes, draw_modes_figure, require_scene
from hrsynth.present.scenes import CLOSES, GOAL, NEAR, OPEN, ModesScene, build_modes_scene
from hrsynth.present.sketch import Sketch
from hrsynth.present.text.poses import format_modes as text
from strategies import random_rotation, transformed

ROOT = Path(__file__).resolve().parents[3]
PICTURES = sorted((ROOT / "docs" / "pictures").iterdir())
KEPT = [file for file in PICTURES if file.name.startswith("modes_")]
ROBOTS = [
    ("rrrrr_m1", None, False),
    ("3rrr_m1", None, False),
    ("3prr_m1", None, False),
    ("3ppr_m1", None, True),
    ("gough_stewart", "1,3,5", False),
    ("quattro", "1,4", False),
    ("delta", None, False),
    ("3rps", None, True),
    ("prrrp_m1", None, True),
    ("linear_delta", None, False),
]
MANY = pytest.mark.parametrize(("name", "observe", "real"), ROBOTS)
rng_of = np.random.default_rng


@cache
def found(name: str, observe: str | None = None, real: bool = False) -> AssemblyModes:
    return modes(load(list_robots()[name]), observe, real=real)


@cache
def drawn(name: str, observe: str | None = None, real: bool = False) -> ModesScene:
    return build_modes_scene(found(name, observe, real))


def apart(point: np.ndarray, curve: np.ndarray, normal: np.ndarray | None) -> float:
    """From a point to the nearest triangle or segment of what is drawn (in a plane: seen along its normal)."""
    seen = np.eye(3) if normal is None else np.eye(3) - np.outer(normal, normal)
    curve, point = curve @ seen, seen @ point
    if curve.ndim == 2:
        starts, sides = curve[:-1], np.diff(curve, axis=0)
        t = np.clip(np.sum((point - starts) * sides, axis=1) / np.maximum(np.sum(sides**2, axis=1), 1e-300), 0, 1)
        return float(np.min(np.linalg.norm(starts + t[:, None] * sides - point, axis=1)))
    return float(np.min(np.linalg.norm(curve - point, axis=2)))


# ---- what is drawn


@pytest.mark.some(2)
@MANY
def test_modes_are_where_the_curves_meet(name: str, observe: str | None, real: bool):
    view, size = drawn(name, observe, real), found(name, observe, real).goal.model.length
    assert view.traces
    alone = [trace for trace in view.traces if not trace.moving]
    for placed in view.placed:
        for trace in alone:
            assert apart(placed.at, trace.points, view.normal) < 1e-3 * size, trace.words
        moving = [trace.points for trace in view.traces if trace.moving]
        cell = max((float(np.linalg.norm(np.diff(each, axis=0), axis=-1).max()) for each in moving), default=0.0)
        gaps = [apart(placed.at, each, view.normal) for each in moving]
        assert min(gaps, default=0.0) < (1e-3 * size if all(each.ndim == 2 for each in moving) else cell), gaps


@pytest.mark.some(3)
@MANY
def test_numbers_states_and_words_are_the_texts(name: str, observe: str | None, real: bool):
    result, view = found(name, observe, real), drawn(name, observe, real)
    said = text(result)
    assert [each.label for each in view.placed] == re.findall(r"^mode (\d+) ", said, re.MULTILINE)
    for placed, mode in zip(view.placed, result.modes, strict=True):
        assert placed.state == (GOAL if mode.goal else CLOSES if mode.reachable else OPEN)
        assert all(leg in placed.words for leg in mode.unclosed_legs)
        assert bool(placed.strokes) == (mode.configuration is not None)


@pytest.mark.some(3)
@MANY
def test_strokes_keep_their_lengths_and_the_base_its_place(name: str, observe: str | None, real: bool):
    """Links are rigid: each polygon is congruent at all modes; each leg begins at the base."""
    result, view = found(name, observe, real), drawn(name, observe, real)
    slides = sum(joint.type.has_translation for joint in result.goal.model.mechanism.joints.values())
    shapes = [
        sorted(
            round(float(np.linalg.norm(np.diff(ring, axis=0), axis=1).sum()), 6)
            for ring in (*placed.platform, *placed.strokes[: len(placed.strokes) - slides])
        )
        for placed in view.placed
        if placed.strokes
    ]
    for shape in shapes if not slides else ():
        assert shape == pytest.approx(shapes[0], abs=1e-6)
    for placed in view.placed:
        assert [len(ring) for ring in placed.platform] == [len(ring) for ring in view.placed[0].platform]
        if placed.strokes:
            touched = np.vstack([*placed.strokes, *placed.platform])
            assert max(np.min(np.linalg.norm(touched - at, axis=1)) for at in view.ground) < 1e-6


def test_a_robot_that_does_not_close_is_drawn_as_its_platform_alone():
    view = drawn("quattro", "1,4")
    (alone,) = [each for each in view.placed if each.state == OPEN]
    assert (alone.strokes, alone.words) == ((), "not assembled: legs 2, 3")
    assert len(alone.platform) == 2


@pytest.mark.some(2)
@pytest.mark.parametrize(("name", "observe"), [("3rrr_m1", None), ("rrrrr_m1", None), ("gough_stewart", "1,3,5")])
def test_a_tilted_robot_is_drawn_tilted(name: str, observe: str | None):
    rng = rng_of(5)
    R, p = random_rotation(rng), rng.normal(size=3)
    moved = build_modes_scene(modes(transformed(load(list_robots()[name]), R, p), observe))
    view = drawn(name, observe)
    spots = sorted(np.round(R @ each.at + p, 6).tolist() for each in view.placed)
    assert sorted(np.round(each.at, 6).tolist() for each in moved.placed) == pytest.approx(np.array(spots), abs=2e-6)
    assert (moved.normal is None) == (view.normal is None)
    if view.normal is not None:
        assert abs(float(moved.normal @ R @ view.normal)) == pytest.approx(1.0, abs=1e-9)


def test_where_tips_are_on_surfaces_or_unknown_the_platforms_are_drawn():
    result = found("gough_stewart", "1,3,5")
    other = replace(result.found, modes=tuple(replace(mode, legs=()) for mode in result.found.modes))
    view = build_modes_scene(replace(result, found=other))
    assert view.traces == ()
    assert np.allclose(view.placed[0].at, [result.pose.x, result.pose.y, result.pose.z], atol=1e-9)


def test_near_modes_have_their_own_mark():
    result = found("gough_stewart", "1,3,5")
    near = replace(result, modes=result.modes[:1], near_modes=result.modes[1:])
    assert [(each.label, each.state) for each in build_modes_scene(near).placed] == [("1", GOAL), ("near 1", NEAR)]
    assert len({mark for mark, _, _ in MARKS.values()}) == len(MARKS)


# ---- coupler curves, against distances


@pytest.mark.some(20)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kinds", ["CC", "LL", "LC", "CL", "PC", "CP", "PL"])
def test_a_bar_keeps_its_length_and_its_ends_their_curves(kinds: str, seed: int):
    rng = rng_of(seed)
    made: dict[str, Any] = {
        "C": lambda: Circle(rng.normal(size=3), rng.normal(size=3), rng.uniform(0.3, 1.5)),
        "L": lambda: Line(rng.normal(size=3), rng.normal(size=3)),
        "P": lambda: Point(rng.normal(size=3)),
    }
    curves = [made[kind]() for kind in kinds]
    ends = [curve.at(rng.uniform(-2, 2)) for curve in curves]
    length = float(np.linalg.norm(ends[1] - ends[0]))
    found = trace_coupler_chains(curves[0], curves[1], length, 181)
    for one, other in found:
        assert np.allclose(np.linalg.norm(other - one, axis=1), length, atol=1e-6)
        assert max(np.linalg.norm(curves[0].miss(tip)) for tip in one) < 1e-9
        assert max(np.linalg.norm(curves[1].miss(tip)) for tip in other) < 1e-9
    nearest = min(np.linalg.norm(np.hstack([one, other]) - np.hstack(ends), axis=1).min() for one, other in found)
    assert nearest < 0.1, "the place from which the length was taken is not on any branch"


def test_a_traced_point_keeps_its_triangle():
    rng = rng_of(2)
    triangle = rng.normal(size=(3, 3))
    triangle[:, 2] = 0.0
    n = np.array([0.0, 0.0, 1.0])
    turn = rotate_about_axis(n, 0.7)
    pair = tuple((turn @ triangle[k] + [0.2, 0.1, 0.0])[None] for k in (0, 1))
    assert np.allclose(trace_coupler(pair, triangle, n), turn @ triangle[2] + [0.2, 0.1, 0.0])
    surface = sweep_third_point(pair, triangle, 40)
    for k in (0, 1):
        sides = np.linalg.norm(surface - pair[k], axis=2)
        assert np.allclose(sides, np.linalg.norm(triangle[2] - triangle[k]))
    assert np.allclose(evaluate_curve(Line(np.zeros(3), n), np.array([2.0])), [[0, 0, 2.0]])


# ---- the page


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "observe"),
    [
        ("3rrr_m1", None),
        ("gough_stewart", "1,3,5"),
        ("quattro", "1,4"),
        pytest.param("hexa", "1,3,5", marks=pytest.mark.slow),
    ],
)
def test_numbers_do_not_cover_each_other_and_nothing_leaves_the_page(name: str, observe: str | None):
    result = found(name, observe)
    page = draw_modes_figure(result, drawn(name, observe))
    page.canvas.draw()
    main = page.axes[0]
    boxes = [label.get_window_extent() for label in main.texts]
    assert [label.get_text() for label in main.texts] == [each.label for each in drawn(name, observe).placed]
    assert not [1 for i, one in enumerate(boxes) for other in boxes[:i] if one.overlaps(other)]
    whole = page.bbox
    parts = [
        *boxes,
        *(label.get_window_extent() for label in page.texts),
        page.legends[0].get_window_extent(),
        page._suptitle.get_window_extent(),
        main.xaxis.label.get_window_extent(),
        main.yaxis.label.get_window_extent(),
    ]
    for box in parts:
        assert whole.x0 <= box.x0 <= box.x1 <= whole.x1, box
        assert whole.y0 <= box.y0 <= box.y1 <= whole.y1, box
    cells = [label.get_window_extent() for label in page.texts[: len(page.axes) - 1]]
    assert not [1 for i, one in enumerate(cells) for other in cells[:i] if one.overlaps(other)]


def test_numbers_of_a_crowd_keep_out_of_each_other():
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    angles = np.linspace(0, 2 * np.pi, 14, endpoint=False)
    spots = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    page = Figure(figsize=(5, 5))
    FigureCanvasAgg(page)
    sketch = Sketch.of(np.array([0.0, 0.0, 1.0]), spots, [])
    place = sketch.place(page, (0.1, 0.1, 0.8, 0.8), 4.0 * spots)
    sketch.numbers(place, spots, [str(k) for k in range(14)], ["black"] * 14, [spots])
    page.canvas.draw()
    boxes = [label.get_window_extent() for label in place.texts]
    assert not [1 for i, one in enumerate(boxes) for other in boxes[:i] if one.overlaps(other)]


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe"), [("3rrr_m1", None), ("quattro", "1,4")])
def test_scales_are_equal(name: str, observe: str | None):
    page = draw_modes_figure(found(name, observe), drawn(name, observe))
    page.canvas.draw()
    for place in page.axes:
        if drawn(name, observe).normal is not None:
            (x, y), (u, v) = place.transData.transform([(0, 0), (1, 1)])
            assert u - x == pytest.approx(v - y, rel=1e-6)
        else:
            ranges = [np.ptp(limits) for limits in (place.get_xlim(), place.get_ylim(), place.get_zlim())]
            assert np.ptp(place._box_aspect / ranges) < 1e-9 * np.max(place._box_aspect / ranges)


# ---- files


@pytest.mark.parametrize("path", ["x.tiff", "x", "nowhere/x.png"])
def test_bad_files_are_refused_before_any_work(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ObservedRobot, "of", lambda *a, **k: pytest.fail("work was begun"))
    assert run_command(["modes", "rrrrr_m1", "-o", path]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe"), [("quattro", "1,2"), ("i4l", None)])
def test_a_continuum_is_not_drawn(name: str, observe: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(BadRequest, match=r"nothing to draw: .*continuous family"):
        require_scene(found(name, observe))
    arguments = [] if observe is None else ["--observe", observe]
    assert run_command(["modes", name, *arguments, "-o", str(tmp_path / "x.png")]) == 0
    out, err = capsys.readouterr()
    assert "a continuous family of dimension" in out
    assert "is not drawn" in err
    assert list(tmp_path.iterdir()) == []


def test_the_command_draws_and_the_file_says_what_it_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "x.png"
    assert run_command(["modes", "3rrr_m1", "-o", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == str(file)
    assert held(file) == json.loads(json.dumps(describe_scene(found("3rrr_m1"), drawn("3rrr_m1"))))


def held(file: Path) -> dict:
    with Image.open(file) as image:
        return json.loads(image.info["Description"])


def test_two_pictures_of_the_same_are_the_same():
    assert draw_modes(found("rrrrr_m1")) == draw_modes(found("rrrrr_m1"))


# ---- figures of the pages


def numbers(record: object) -> list[float]:
    if isinstance(record, dict):
        return [value for each in record.values() for value in numbers(each)]
    if isinstance(record, list):
        return [value for each in record for value in numbers(each)]
    return [record] if isinstance(record, float) else []


def words(record: object) -> object:
    if isinstance(record, dict):
        return {key: words(value) for key, value in record.items() if key != "at" or not isinstance(value, str)}
    if isinstance(record, list):
        return [words(each) for each in record]
    return None if isinstance(record, float) else record


def commands() -> dict[str, str]:
    """The table of ``docs/pictures.py``."""
    table = next(
        node.value
        for node in ast.parse((ROOT / "docs" / "pictures.py").read_text("utf-8")).body
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "PICTURES"
    )
    assert isinstance(table, ast.Dict)
    return {
        ast.literal_eval(name): ast.literal_eval(what)
        for name, what in zip(table.keys, table.values, strict=True)
        if isinstance(what, ast.Constant)
    }


def test_a_page_has_a_figure_of_modes():
    assert KEPT


@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_figures_of_pages_are_fresh_and_small(file: Path):
    """Drawn again with its command, the figure has the same numbers."""
    _, robot, *options = shlex.split(commands()[file.name])
    valued = [option for option in options if option != "--real"]
    given = dict(zip(valued[::2], valued[1::2], strict=True))
    result = modes(load(list_robots()[robot]), given.get("--observe"), at=given.get("--at"), real="--real" in options)
    fresh, kept = json.loads(json.dumps(describe_scene(result, require_scene(result)))), held(file)
    assert words(fresh) == words(kept), "stale: make pictures"
    assert numbers(fresh) == pytest.approx(numbers(kept), abs=1e-6 * result.goal.model.length), "stale: make pictures"
    assert file.stat().st_size < 150_000
