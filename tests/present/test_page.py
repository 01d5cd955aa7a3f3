"""The view's page and its server: five robots in a browser, sliders that move them, no network, no complaint."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from browser import Tab
from hrsynth.present.studio import saved as page
from present.studio_client import soon
from present.views import FIVE, seen, serving

READY = "document.body.dataset.ready == 'yes'"
SIZE = {"width": 900, "height": 600}
EMPTY = 12
"""Difference of a colour from that of its neighbour below within which nothing is drawn."""


def drawn(tab: Tab) -> np.ndarray:
    """The picture of the robot, once it is at rest."""
    tab.page.add_style_tag(content="#tools { visibility: hidden } #foot { display: none }")
    tab.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    tab.page.wait_for_timeout(100)
    box = {key: round(value) for key, value in tab.page.locator("#pane").bounding_box().items()}
    rows, columns = slice(box["y"], box["y"] + box["height"]), slice(box["x"], box["x"] + box["width"])
    return tab.picture()[rows, columns].astype(int)


def filled(picture: np.ndarray) -> float:
    """The part of a picture that is no plain background: the background is the same all along a row."""
    return float((np.abs(picture - picture[:, :1]).max(axis=2) > EMPTY).mean())


def changed(one: np.ndarray, other: np.ndarray) -> float:
    """The part of two pictures that differs."""
    return float((np.abs(one - other).max(axis=2) > EMPTY).mean())


def push(tab: Tab, number: int, key: str, times: int = 4) -> None:
    """Move a slider by its keys."""
    slider = tab.page.locator("aside input[type=range]").nth(number)
    slider.focus()
    for _ in range(times):
        slider.press(key)


@pytest.mark.some(0, 2)
@pytest.mark.browser
@pytest.mark.parametrize("name", FIVE)
def test_the_page_of_a_robot_shows_it_and_its_sliders_move_it(name: str, tab: Tab, tmp_path: Path):
    file = tmp_path / "view.html"
    file.write_bytes(page.render_static_page(seen(name)))
    tab.page.set_viewport_size(SIZE)
    tab.open(file, READY)
    home = drawn(tab)
    assert 0.03 < filled(home) < 0.6
    assert filled(home[:40]) + filled(home[-40:]) < 0.15, "the robot fits the picture"
    sliders = tab.page.locator("aside input[type=range]")
    assert sliders.count() == seen(name).setup.dof
    before = home
    for number in range(sliders.count()):
        push(tab, number, "ArrowLeft")
        there = drawn(tab)
        assert changed(before, there) > 0.003
        others = [k for k in range(sliders.count()) if k != number]
        assert all(sliders.nth(k).input_value() == str(seen(name).sliders[k].home) for k in others)
        before = there
    tab.page.get_by_role("button", name="Zero configuration").click()
    assert changed(home, drawn(tab)) == 0


@pytest.mark.browser
def test_either_robot_is_shown_alone_or_both_with_the_other_modes(tab: Tab, tmp_path: Path):
    file = tmp_path / "view.html"
    file.write_bytes(page.render_static_page(seen("quattro")))
    tab.page.set_viewport_size(SIZE)
    tab.open(file, READY)
    before = drawn(tab)
    assert tab.page.locator(".modes li").count() == len(seen("quattro").mode_outlines)
    assert tab.page.evaluate("() => studio.stage.parts.ghosts.children.length") == 0
    tab.page.get_by_role("checkbox", name="Draw their outlines").check()
    assert tab.page.evaluate("() => studio.stage.parts.ghosts.children.length") == len(seen("quattro").mode_outlines)
    for layout in ("real", "hidden", "beside", "overlay"):
        tab.page.evaluate("(value) => document.querySelector(`input[value=${value}]`).click()", layout)
        after = drawn(tab)
        assert changed(before, after) > 0.002
        before = after


@pytest.mark.browser
def test_the_panel_says_what_is_shown_and_fits_a_narrow_window(tab: Tab, tmp_path: Path):
    file = tmp_path / "view.html"
    file.write_bytes(page.render_static_page(seen("uranesx")))
    tab.page.set_viewport_size(SIZE)
    tab.open(file, READY)
    text = tab.page.locator("body").inner_text()
    assert all(machine.words in text for machine in seen("uranesx").machines)
    assert all(note in text for note in seen("uranesx").notes)
    assert "virtual actuator" in text
    tab.page.set_viewport_size({"width": 420, "height": 800})
    drawn(tab)
    canvas, panel = (tab.page.locator(part).bounding_box() for part in ("main canvas", "aside"))
    assert canvas["y"] + canvas["height"] <= panel["y"] + 1
    assert canvas["width"] == panel["width"] == 420
    assert "motor" in text


@pytest.fixture
def address() -> Iterator[str]:
    """A server of the five-bar's view."""
    pytest.importorskip("uvicorn")
    with serving(seen("rrrrr_m1")) as server:
        yield server.address


@pytest.mark.browser
def test_with_a_server_sliders_move_the_robot_together(address: str, tab: Tab):
    tab.page.set_viewport_size(SIZE)
    tab.open(address)
    known = tab.page.evaluate
    assert soon(lambda: known("() => window.studio?.layout === 'overlay' && Boolean(studio.state.hidden)"), 60)
    home = known("() => studio.values")
    for number, key in enumerate(("PageUp", "PageDown")):
        push(tab, number, key, 2)
        assert soon(
            lambda number=number: known(f"() => studio.moving || studio.values[{number}]") not in (True, home[number])
        )
    one, other = (b - a for a, b in zip(home, known("() => studio.values"), strict=True))
    assert one > 0 > other
    assert tab.page.get_by_role("tab").count() == 0
    tab.page.get_by_role("button", name="Zero configuration").click()
    assert soon(lambda: known("() => !studio.moving && studio.values") == pytest.approx(home))


def test_the_page_is_whole_and_asks_for_nothing():
    text = page.render_saved_page(seen("rrrrr_m1"))
    outside = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"(src|href)\s*=\s*[\"'](?!data:|#)", outside)
    assert text.count("<script") == 3
    assert "Three.js Authors" in text
    assert "The MIT License" in text


def test_a_name_cannot_break_the_page():
    from dataclasses import replace

    found = seen("rrrrr_m1")
    robot = replace(found.setup.robot, name="</script><b>&")
    text = page.render_saved_page(replace(found, setup=replace(found.setup, robot=robot), notes=("</script><b>",)))
    assert "</script><b>" not in text
    assert text.count("</script>") == 3


@pytest.mark.slow
def test_an_interrupt_ends_the_server_quietly():
    pytest.importorskip("uvicorn")
    command = [sys.executable, "-m", "hrsynth.cli", "view", "rrrrr_m1", "--no-open"]
    # a test run that was put into the background ignores interrupts, and its children with it
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    )
    signal.signal(signal.SIGINT, before)
    assert process.stdout is not None
    lines = []
    while "Ctrl-C" not in (line := process.stdout.readline()):
        assert line, process.communicate()[1]
        lines.append(line)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (0, "", "")
    assert any(line.startswith("sliders") for line in lines)
