"""The studio's page in a browser, with its server: all panels by mouse and by keys, at two sizes; what goes wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser import Tab
from description.foreign.examples import MJCF, SDF, URDF
from present.studio.audit import beyond, faint, focused, nameless

pytest.importorskip("starlette")
pytestmark = [pytest.mark.browser, pytest.mark.slow]

SIZES = {"wide": {"width": 1280, "height": 800}, "narrow": {"width": 390, "height": 844}}
PANELS = ("robot", "move", "legs", "modes", "plane", "servo", "export")
IDLE = "() => Object.values(studio.link.lanes).every(({ sent, waiting }) => !sent && !waiting.size)"
"""Whether the page waits for no answer."""
SLOW = 60_000
"""Longest time that an answer may take here (ms)."""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The page of a server that was opened with nothing."""
    from hrsynth.present.studio.server import studio

    server = studio(open_=False)
    yield server.address
    server.stop()


def enter(tab: Tab, address: str, size: str = "wide") -> Any:
    """The page, ready."""
    tab.page.set_viewport_size(SIZES[size])
    tab.open(address)
    tab.page.locator("body[data-ready=yes]").wait_for(timeout=SLOW)
    return tab.page


def opened(tab: Tab, address: str, name: str, size: str = "wide") -> Any:
    """The page with a robot of the gallery, its three sentences and its verdict there."""
    page = enter(tab, address, size)
    page.locator(f"[data-source='shipped:{name}']").click(timeout=SLOW)
    page.locator("#name", has_text=re.compile(f"^{name}$")).wait_for(timeout=SLOW)
    answered(page)
    return page


def answered(page: Any) -> None:
    """Wait until nothing is under way."""
    page.locator("#answer", has_text=re.compile(r"^(?!.*Computing which legs)")).wait_for(timeout=SLOW)
    until(page, IDLE)


def until(page: Any, condition: str) -> None:
    """Wait until a condition holds; the page's policy forbids Playwright's own way."""
    for _ in range(SLOW // 50):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(condition)


def show(page: Any, key: str) -> Any:
    """A panel, looked at."""
    page.locator(f"#tab-{key}").click()
    return page.locator(f"#panel-{key}")


def said(panel: Any) -> str:
    """The error that a panel shows."""
    return " ".join(panel.locator("[role=alert]").all_inner_texts()).strip()


def here(page: Any) -> Any:
    """The configuration that the page is at."""
    return page.evaluate("() => studio.here")


@pytest.mark.parametrize("size", SIZES)
def test_all_panels_can_be_read_and_used_by_everybody(size: str, tab: Tab, address: str):
    page = opened(tab, address, "quattro", size)
    for key in PANELS:
        panel = show(page, key)
        answered(page)
        for summary in page.locator("details:not([open]) > summary").all():
            if summary.is_visible():
                summary.click()
        assert (said(panel), nameless(page), faint(page), beyond(page)) == ("", [], [], []), key
        scene, box = page.locator("#sight").bounding_box(), panel.bounding_box()
        beside, above = scene["x"] + scene["width"] <= box["x"] + 1, scene["y"] + scene["height"] <= box["y"] + 1
        assert beside if size == "wide" else above
        assert scene["height"] > 200


def test_what_cannot_be_read_is_noticed(tab: Tab, tmp_path: Path):
    page = tmp_path / "page.html"
    page.write_text("<body><button></button><p style='color: #999'>words</p><input style='margin-left: 3000px'>")
    tab.open(page)
    assert nameless(tab.page) == ["button", "textbox"]
    assert len(faint(tab.page)) == len(beyond(tab.page)) == 1


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("size", SIZES)
def test_legs_are_ticked_and_what_follows_is_told(size: str, tab: Tab, address: str):
    page = opened(tab, address, "quattro", size)
    panel = show(page, "legs")
    answered(page)
    assert "✗" not in panel.locator(".verdict").inner_text()
    for box in panel.get_by_role("checkbox").all()[1:]:
        box.uncheck()
    answered(page)
    assert panel.locator(".verdict.bad").count() == 1
    assert panel.locator(".lost button").count() >= 1
    panel.locator(".lost button").first.click()
    answered(page)
    assert said(panel) == ""
    assert panel.locator(".player button").inner_text() == "Pause"
    page.keyboard.press("Escape")
    assert panel.locator(".player").is_hidden()
    panel.locator(".sets button").first.click()
    answered(page)
    assert panel.locator(".verdict.good").count() == 1


def test_the_error_that_is_shown_is_that_of_the_legs_that_are_watched(tab: Tab, address: str):
    page = opened(tab, address, "delta")
    panel = show(page, "legs")
    for name in ("1", "2"):
        panel.locator(f"input[value='{name}']").click()
        answered(page)
        told = panel.locator(".verdict").inner_text()
        assert page.locator("#now").inner_text() in told
        assert page.evaluate("studio.state.error.step") == page.evaluate("studio.panels.legs.found.error.step")
    assert "unbounded" in page.locator("#now").inner_text()


@pytest.mark.parametrize("name", ["rrrrr_m1", "quattro"])
def test_another_hidden_robot_is_not_drawn_where_the_one_before_was(name: str, tab: Tab, address: str):
    """Its places come with the next state that is asked for; until then the page knows none."""
    page = opened(tab, address, name)
    panel = show(page, "legs")
    answered(page)
    page.get_by_role("radio", name="Side by side").check()
    answered(page)
    for box in panel.get_by_role("checkbox").all()[1:]:
        box.uncheck()
    answered(page)
    page.get_by_role("radio", name="Robot", exact=True).check()
    panel.locator(".sets button").first.click()
    answered(page)
    assert page.evaluate("studio.state.hidden") is None
    show(page, "modes")
    page.get_by_role("radio", name="Side by side").check()
    answered(page)
    assert page.evaluate("studio.state.hidden.length === studio.stage.machines.hidden.links.length")
    assert tab.complaints == []


def drawn(page: Any) -> Any:
    """The values of the plane that is drawn."""
    return page.evaluate("() => studio.panels.plane.record?.values ?? null")


def test_a_plane_is_of_the_legs_that_are_watched_and_of_the_pose(tab: Tab, address: str):
    page = opened(tab, address, "quattro")
    panel = show(page, "plane")
    panel.get_by_role("button", name="Draw the plane").click()
    answered(page)
    first = drawn(page)
    show(page, "legs").locator("input[value='2']").click()
    answered(page)
    show(page, "plane")
    answered(page)
    second = drawn(page)
    assert second not in (None, first)
    assert "--observe 1,3,4" in panel.locator(".same code").first.text_content()
    show(page, "move").get_by_role("slider").last.focus()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    answered(page)
    page.wait_for_timeout(500)
    show(page, "plane")
    answered(page)
    assert drawn(page) not in (None, first, second)


def test_an_answer_for_other_legs_is_not_shown(tab: Tab, address: str):
    held: list[Any] = []

    def between(route: Any) -> None:
        server = route.connect_to_server()
        route.on_message(
            lambda message: held.append((server, message)) if '"modes"' in message else server.send(message)
        )
        server.on_message(route.send)

    tab.page.route_web_socket(re.compile("/live$"), between)
    page = opened(tab, address, "delta")
    show(page, "modes")
    page.wait_for_timeout(200)
    show(page, "legs").locator("input[value='3']").click()
    for server, message in held:
        server.send(message)
    answered(page)
    assert page.locator("#panel-modes .modes li").count() == 0


def test_at_a_singular_pose_nothing_says_that_all_is_well(tab: Tab, address: str):
    """At the one nearest to home: farther away sliders may come to a pose with a leg in its other working mode."""
    from hrsynth import singularities

    poses = [example.to_dict()["pose"] for example in singularities("rrrrr_m1", points=200).examples]
    page = opened(tab, address, "rrrrr_m1")
    panel = show(page, "legs")
    answered(page)
    assert panel.locator(".verdict.good").count() == 1
    x, y = page.evaluate("() => studio.values")
    there = min(poses, key=lambda pose: (pose["x"] - x) ** 2 + (pose["y"] - y) ** 2)
    page.evaluate("(values) => studio.move({ values })", [there["x"], there["y"]])
    panel.locator(".verdict.elsewhere").wait_for(timeout=SLOW)
    assert "At this pose 1 of 2" in panel.locator(".verdict .wrong").inner_text()
    assert panel.locator(".verdict.good").count() == 0


def test_smallest_sets_that_are_not_listed_are_counted(tab: Tab, address: str):
    page = opened(tab, address, "gough_stewart")
    panel = show(page, "legs")
    answered(page)
    assert panel.locator(".sets button").count() == 10
    assert "and 10 more" in panel.locator(".sets").inner_text()


def test_sliders_move_the_robot_and_home_brings_it_back(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    panel = show(page, "move")
    sliders = panel.get_by_role("slider")
    assert sliders.count() == 3
    home = page.evaluate("() => studio.values")
    for index in range(3):
        sliders.nth(index).focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        answered(page)
        values = page.evaluate("() => studio.values")
        assert values[index] > home[index]
    panel.get_by_role("button", name="Zero configuration").click()
    answered(page)
    assert page.evaluate("() => studio.values") == pytest.approx(home, abs=1e-6)


def test_a_slider_moves_its_own_freedom_alone(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    home = page.evaluate("() => studio.values")
    show(page, "move").get_by_role("slider").last.focus()
    page.keyboard.press("ArrowRight")
    answered(page)
    values = page.evaluate("() => studio.values")
    assert values[:2] == pytest.approx(home[:2], abs=1e-6)
    assert values[2] > home[2]


def test_numbers_are_typed_beside_the_sliders(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    panel = show(page, "move")
    x, _, phi = panel.locator(".typed:visible").all()
    first = panel.locator(".slider").first
    home = page.evaluate("() => studio.values")
    x.fill("0.0123")
    x.press("Enter")
    answered(page)
    phi.fill("-5 deg")
    phi.blur()
    answered(page)
    assert page.evaluate("() => studio.values") == pytest.approx([0.0123, home[1], -math.radians(5)], abs=1e-6)
    assert (x.input_value(), phi.input_value()) == ("0.0123\xa0m", "-5.0°")
    for text, got in (("9", "x: got 9, expected a number from -"), ("far", "got far"), ("", "got nothing")):
        x.fill(text)
        x.press("Enter")
        line = first.locator("[role=alert]")
        assert got in line.inner_text()
        assert "\n" not in line.inner_text()
        assert line.bounding_box()["y"] - x.bounding_box()["y"] < 80
        assert x.get_attribute("aria-invalid") == "true"
    assert page.evaluate("() => studio.values")[0] == pytest.approx(0.0123, abs=1e-6)
    panel.get_by_role("button", name="Zero configuration").click()
    answered(page)
    assert said(first) == ""


def test_a_motor_moves_the_robot_until_its_line_stops(tab: Tab, address: str):
    from hrsynth import check
    from hrsynth.errors import PoseReachFailure

    page = opened(tab, address, "quattro")
    panel = show(page, "move")
    panel.get_by_role("radio", name="Motors").check()
    sliders = panel.locator(".slider:visible")
    assert sliders.locator("label").all_inner_texts() == [f"shoulder_{i}" for i in (1, 2, 3, 4)]
    second = sliders.nth(1)
    second.locator(".typed").fill("10")
    second.locator(".typed").press("Enter")
    answered(page)
    reached = check("quattro", at={"motors": {"shoulder_2": math.radians(10)}}).to_dict()["configurations"][0]["pose"]
    there = page.evaluate("() => studio.values")
    assert there[:3] == pytest.approx([reached[name] for name in "xyz"], abs=1e-6)
    first = sliders.first
    first.locator(".typed").fill("170")
    first.locator(".typed").press("Enter")
    answered(page)
    with pytest.raises(PoseReachFailure) as stopped:
        check("quattro", at={"motors": [math.radians(170), math.radians(10), 0, 0]})
    assert said(first) == str(stopped.value)
    assert first.locator(".typed").input_value() == "0.0°"
    assert page.evaluate("() => studio.values") == there
    first.get_by_role("slider").focus()
    page.keyboard.press("ArrowRight")
    answered(page)
    assert said(first) == ""
    assert page.evaluate("() => studio.motors[0]") > 0


def test_a_mode_is_flown_to_and_back(tab: Tab, address: str):
    page = opened(tab, address, "rrrrr_m1")
    before = page.evaluate("() => studio.values")
    panel = show(page, "modes")
    answered(page)
    panel.locator(".modes button:enabled").last.click()
    until(page, f"() => studio.values.some((value, i) => Math.abs(value - {before}[i]) > 1e-3)")
    answered(page)
    panel.get_by_role("button", name="Group by aspect").click()
    answered(page)
    assert panel.locator(".modes button").all_inner_texts() == ["mode 1, aspect 1", "mode 2, aspect 2"]
    assert panel.locator(".modes [aria-current=true] button").inner_text() == "mode 2, aspect 2"
    assert "separated (proved)" in panel.inner_text()
    panel.get_by_role("button", name="Back to the previous pose").click()
    answered(page)
    assert page.evaluate("() => studio.values") == pytest.approx(before, abs=1e-6)


def test_labels_in_the_3d_view_can_be_read_in_a_small_pane(tab: Tab, address: str):
    """And the legend has no goal where none is drawn."""
    page = opened(tab, address, "quattro", "narrow")
    show(page, "servo").get_by_role("button", name="Set here: the goal").click()
    show(page, "modes")
    answered(page)
    page.wait_for_timeout(500)
    heights = page.evaluate("""() => {
      const found = [], { sight, world, canvas } = studio.stage;
      world.traverseVisible((mesh) => {
        if (!mesh.isSprite) return;
        const place = mesh.getWorldPosition(new THREE.Vector3()).applyMatrix4(sight.camera.matrixWorldInverse);
        const [low, high] = [-0.5, 0.5].map((by) => place.clone().add(new THREE.Vector3(0, by * mesh.scale.y, 0))
          .applyMatrix4(sight.camera.projectionMatrix).y);
        found.push((high - low) / 2 * canvas.clientHeight);
      });
      return found;
    }""")
    assert len(heights) > 6
    assert min(heights) > 21
    assert "goal" not in page.locator("#legend").text_content()


def test_a_run_is_set_played_and_scrubbed(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    show(page, "move").get_by_role("slider").first.focus()
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    answered(page)
    panel = show(page, "servo")
    assert panel.get_by_role("button", name="Run").is_disabled()
    panel.get_by_role("button", name="Set here: the goal").click()
    panel.get_by_role("button", name="Run").click()
    answered(page)
    assert said(panel) == ""
    assert panel.locator("svg .leg").count() == panel.locator("svg .desired").count() == 3
    assert re.search(" --start .* --goal ", panel.locator(".same code").first.text_content())
    panel.get_by_role("button", name="Pause").click()
    first = panel.locator("svg .leg").first.get_attribute("x2")
    panel.get_by_role("slider").fill("0")
    assert panel.locator("svg .leg").first.get_attribute("x2") != first


def test_keys_are_enough(tab: Tab, address: str):
    page = enter(tab, address)
    page.locator("[data-source='shipped:3rrr_m1']").wait_for(timeout=SLOW)
    page.keyboard.press("Tab")
    assert focused(page)[0] == "To the panels"
    page.keyboard.press("Enter")
    order = []
    for _ in range(60):
        page.keyboard.press("Tab")
        name, seen = focused(page)
        order.append(name)
        assert seen, f"{name} does not show that it has the focus"
        if page.evaluate("() => document.activeElement.dataset.source") == "shipped:3rrr_m1":
            break
    assert order[0] == "tab-robot"
    page.keyboard.press("Enter")
    page.locator("#name", has_text="3rrr_m1").wait_for(timeout=SLOW)
    page.locator("#tab-robot").focus()
    for key in (*PANELS[1:], "robot"):
        page.keyboard.press("ArrowRight")
        assert focused(page) == (f"tab-{key}", True)
        assert page.locator(f"#panel-{key}").is_visible()
    page.keyboard.press("ArrowRight")
    answered(page)
    for _ in range(3):  # the coordinates, the number, the slider
        page.keyboard.press("Tab")
    before = here(page)
    page.keyboard.press("ArrowRight")
    answered(page)
    assert here(page) != before
    for _ in range(3):
        page.keyboard.press("Shift+Tab")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    answered(page)
    assert page.evaluate("() => studio.watch") == ["2", "3"]


def test_with_reduced_motion_nothing_moves_by_itself(tab: Tab, address: str):
    tab.page.emulate_media(reduced_motion="reduce")
    page = opened(tab, address, "quattro")
    panel = show(page, "legs")
    for box in panel.get_by_role("checkbox").all()[1:]:
        box.uncheck()
    answered(page)
    panel.locator(".lost button").first.click()
    answered(page)
    page.wait_for_timeout(500)
    drawn = page.evaluate("() => studio.stage.drawn")
    page.wait_for_timeout(700)
    assert page.evaluate("() => studio.stage.drawn") == drawn
    assert panel.locator(".player button").is_hidden()
    slider = panel.locator(".player").get_by_role("slider")
    assert slider.input_value() == "0"
    slider.focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(200)
    assert page.evaluate("() => studio.stage.drawn") > drawn


def test_each_tab_has_a_robot_of_its_own(tab: Tab, address: str, browser: Any):
    other = Tab.of(browser.new_page())
    one, two = opened(tab, address, "3rrr_m1"), opened(other, address, "rrrrr_m1")
    show(one, "move").get_by_role("slider").first.focus()
    kept = here(two)
    one.keyboard.press("ArrowRight")
    answered(one)
    assert (one.locator("#name").inner_text(), two.locator("#name").inner_text()) == ("3rrr_m1", "rrrrr_m1")
    assert here(two) == kept
    two.close()
    assert other.complaints == []


def drop(page: Any, **files: str) -> None:
    """Choose files in the page."""
    page.locator("input[type=file]").set_input_files(
        [
            {"name": name.replace("__", "."), "mimeType": "text/xml", "buffer": text.encode()}
            for name, text in files.items()
        ]
    )


DIALECTS = {
    **{f"urdf_{k}": (f"four_{i}.urdf", text) for i, (k, text) in enumerate(URDF.items())},
    **{f"mjcf_{k}": (f"four_{i}.xml", text) for i, (k, text) in enumerate(MJCF.items())},
    **{f"sdf_{k}": (f"four_{i}.sdf", text) for i, (k, text) in enumerate(SDF.items())},
}


def test_files_of_all_dialects_are_dropped_in(tab: Tab, address: str):
    page = enter(tab, address)
    for name, text in DIALECTS.values():
        drop(page, **{name.replace(".", "__"): text})
        page.locator(f"[data-source='file:{name}'][aria-current=true]").wait_for(timeout=SLOW)
        assert said(page.locator("#panel-robot")) == ""


def test_what_was_guessed_can_be_chosen_anew(tab: Tab, address: str):
    page = enter(tab, address)
    drop(page, four__urdf=next(iter(URDF.values())))
    field = page.locator(".guesses select").first
    field.wait_for(timeout=SLOW)
    answered(page)
    values = field.locator("option").evaluate_all("(all) => all.map(({ value }) => value)")
    other = next(value for value in values if value != field.input_value())
    field.select_option(other)
    answered(page)
    assert page.locator(".guesses select").first.input_value() == other or said(page.locator("#panel-robot"))


def test_a_file_that_is_no_robot_is_one_line_and_the_robot_stays(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    panel = show(page, "robot")
    drop(page, bad__urdf="<robot name='bad'><link/></robot>")
    panel.locator("[role=alert]:not(:empty)").wait_for(timeout=SLOW)
    assert "\n" not in said(panel)
    assert "bad.urdf" in said(panel)
    assert page.locator("#name").inner_text() == "3rrr_m1"
    tab.complaints.clear()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("where", ["#pane canvas", "#panel-robot .gallery"])
def test_the_error_of_a_dropped_file_stands_where_it_was_dropped(size: str, where: str, tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1", size)
    show(page, "robot")
    page.locator("#panel-robot").evaluate("(panel) => panel.scrollTo(0, panel.scrollHeight)")
    page.locator(where).evaluate("""(place) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File(["<robot name='bad'><link/></robot>"], "bad.urdf"));
      place.dispatchEvent(new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer }));
    }""")
    line = page.locator("[role=alert]:not(:empty)")
    line.wait_for(timeout=SLOW)
    assert line.inner_text().count("bad.urdf") == 1
    box, pane, panel = (
        page.locator(each).bounding_box() for each in ("[role=alert]:not(:empty)", "#pane", "#panel-robot")
    )
    inside = pane if "canvas" in where else panel
    assert inside["y"] <= box["y"]
    assert box["y"] + box["height"] <= inside["y"] + inside["height"]
    assert inside["x"] <= box["x"]
    assert box["x"] + box["width"] <= inside["x"] + inside["width"]


def test_a_file_is_named_as_it_is_called_and_long_words_are_in_sight(tab: Tab, address: str):
    page = enter(tab, address)
    drop(page, bad__urdf="<robot name='bad'><link/></robot>")
    panel = page.locator("#panel-robot")
    panel.locator("[role=alert]:not(:empty)").wait_for(timeout=SLOW)
    assert said(panel).startswith("bad.urdf:")
    name = f"four {'x' * 150}.urdf"
    drop(page, **{name.replace(".", "__"): next(iter(URDF.values()))})
    page.locator(f"[data-source='file:{name}'][aria-current=true]").wait_for(timeout=SLOW)
    assert beyond(page) == []
    assert panel.evaluate("(panel) => panel.scrollWidth <= panel.clientWidth")
    show(page, "legs")
    answered(page)
    assert page.locator("#panel-legs .same code").first.text_content().startswith(f"hrsynth derive '{name}'")
    page.evaluate(
        "() => studio.draw({ ...studio.state, beyond: ['a_joint_of_a_long_name', 'another_one'].concat("
        "Array(6).fill('and_one_more_joint')) })"
    )
    told, legend = (page.locator(each).bounding_box() for each in ("#now", "#legend ul"))
    assert told["y"] + told["height"] <= legend["y"] + 1


def test_what_is_shown_can_be_copied_and_saved(tab: Tab, address: str):
    page = opened(tab, address, "3rrr_m1")
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    for key in ("legs", "modes"):
        panel = show(page, key)
        answered(page)
        panel.locator(".same summary").click()
        for words, start in (("Copy the command", "hrsynth "), ("Copy the Python line", "hrsynth.")):
            panel.get_by_role("button", name=words).click()
            page.wait_for_timeout(100)
            assert start in page.evaluate("() => navigator.clipboard.readText()")
    panel = show(page, "export")
    for offer in panel.locator(".offers button").all():
        with page.expect_download(timeout=SLOW) as told:
            offer.click()
        assert Path(told.value.path()).stat().st_size > 100


def test_a_slow_ask_says_so_and_is_cancelled_and_a_newer_one_replaces_it(tab: Tab, address: str):
    held: list[str] = []

    def between(route: Any) -> None:
        server = route.connect_to_server()
        route.on_message(
            lambda message: (
                held.append(message) if '"modes"' in message or '"cancel"' in message else server.send(message)
            )
        )
        server.on_message(route.send)

    tab.page.route_web_socket(re.compile("/live$"), between)
    page = opened(tab, address, "3rrr_m1")
    panel = show(page, "modes")
    panel.get_by_text("Listing the modes").wait_for()
    panel.get_by_role("button", name="Find modes").click()
    panel.get_by_role("button", name="Cancel").click()
    assert [re.search('"ask":"(.*?)"', message)[1] for message in held] == ["modes", "cancel"]
    show(page, "legs").get_by_role("checkbox").first.uncheck()
    answered(page)
    assert page.locator("#panel-legs .verdict").inner_text()


def hold(page: Any, kind: str) -> list[Any]:
    """Hold the requests of a kind; calling what is listed sends them."""
    held: list[Any] = []

    def between(route: Any) -> None:
        server = route.connect_to_server()
        route.on_message(
            lambda message: (
                held.append(lambda: server.send(message)) if f'"{kind}"' in message else server.send(message)
            )
        )
        server.on_message(route.send)

    page.route_web_socket(re.compile("/live$"), between)
    return held


def release(page: Any, held: list[Any]) -> None:
    """Send the one request that is held, once it is there."""
    until(page, "() => studio.link.lanes.desk.sent?.kind === 'open'")
    page.wait_for_timeout(100)
    (send,) = held
    send()


@pytest.fixture(scope="module")
def quattro() -> Iterator[str]:
    """The page of a server that was opened with a robot."""
    from hrsynth.present.studio.server import studio

    server = studio("quattro", open_=False)
    yield server.address
    server.stop()


def test_a_plane_requested_before_the_robot_is_read_is_drawn(tab: Tab, quattro: str):
    held = hold(tab.page, "open")
    tab.open(quattro)
    panel = show(tab.page, "plane")
    panel.get_by_role("button", name="Draw the plane").dblclick()
    assert "once the robot is read" in panel.locator("[role=status]").first.inner_text()
    release(tab.page, held)
    until(tab.page, "() => studio.panels.plane.record")
    answered(tab.page)
    assert said(panel) == ""


def test_every_button_clicked_before_the_robot_is_read_acts_once(tab: Tab, quattro: str):
    held = hold(tab.page, "open")
    tab.open(quattro)
    tab.page.locator("#tab-move").wait_for(timeout=SLOW)
    tab.page.evaluate("""() => { window.acted = [];
      for (const each of document.querySelectorAll("#tools button, .panel:not(.panel-robot) .body button"))
        each.onclick = () => acted.push(each.textContent); }""")
    clicked = []
    for key in PANELS[1:]:
        for each in show(tab.page, key).locator(".body button:enabled").all():
            if each.is_visible():
                clicked.append(each.inner_text())
                each.click()
    tab.page.get_by_role("button", name="Fit").click()
    assert {"Draw the plane", "Zero configuration", "Find modes of this pose", "Report"} <= {*clicked}
    assert tab.page.evaluate("acted") == []
    release(tab.page, held)
    answered(tab.page)
    assert tab.page.evaluate("acted") == [*clicked, "Fit"]


def test_without_a_robot_a_click_is_answered_in_one_line(tab: Tab, address: str):
    page = enter(tab, address)
    panel = show(page, "plane")
    panel.get_by_role("button", name="Draw the plane").click()
    assert said(panel) == "No robot is open. Choose one in the panel Robot."


def look(page: Any) -> Any:
    """Robot, legs, configuration and panel of the page."""
    return page.evaluate("() => [studio.scene.name, studio.watch, studio.here.q, studio.tabs.chosen]")


def test_a_link_restores_robot_legs_pose_and_panel(tab: Tab, address: str, quattro: str, browser: Any):
    page = opened(tab, address, "delta")
    show(page, "legs").locator("input[value='2']").click()
    answered(page)
    x = show(page, "move").locator(".typed:visible").first
    x.fill("0.0321")
    x.press("Enter")
    answered(page)
    show(page, "legs")
    page.wait_for_timeout(500)
    there, link = look(page), page.evaluate("location.hash")
    assert there[:2] == ["delta", ["1", "3"]]
    assert there[3] == "legs"
    other = Tab.of(browser.new_page())  # another run of the program, which was started with another robot
    other.open(quattro + link)
    until(other.page, "() => window.studio?.scene")
    answered(other.page)
    assert look(other.page) == there
    assert other.page.evaluate("studio.values[0]") == pytest.approx(0.0321)
    assert other.page.locator("#lost-link").is_hidden()
    show(other.page, "plane").get_by_role("button", name="Draw the plane").click()
    answered(other.page)
    panel = show(other.page, "export")
    panel.locator("summary", has_text="Link").click()
    sent = panel.locator(".line code", has_text="#robot").inner_text()
    other.page.close()
    assert other.complaints == []
    page.locator("#tab-robot").click()
    page.locator("[data-source='shipped:3rrr_m1']").click()
    answered(page)
    field = page.get_by_label("Open a link")
    field.fill(f"http://127.0.0.1:1/secret/{sent}")
    field.press("Enter")
    until(page, "() => studio.scene.name === 'delta'")
    answered(page)
    assert look(page) == [*there[:3], "plane"]


@pytest.mark.parametrize(
    ("link", "words", "kept"),
    [
        ("#robot=shipped:nobody&panel=legs", "no such shipped robot: got 'nobody'", ("quattro", 4, "legs")),
        ("#legs=1", "source of a robot", ("quattro", 4, "move")),
        ("#robot=shipped:delta&legs=1,9&panel=legs", "9", ("delta", 3, "legs")),
        ("#robot=shipped:delta&legs=1,2&pose=1,2&panel=modes", "coordinates", ("delta", 2, "modes")),
        ("#robot=shipped:delta&legs=1&pose=1,a", "coordinates", ("delta", 1, "move")),
        ("#robot=shipped:delta&legs=1&panel=door", "panel: got door", ("delta", 1, "move")),
        ("#robot=shipped:delta&options=%7B", "options of a robot", ("quattro", 4, "move")),
        ("#robot=given:other.urdf", "the robot of the command line: got 'quattro'", ("quattro", 4, "move")),
    ],
)
def test_of_a_wrong_link_one_line_is_shown_and_the_rest_is_restored(
    tab: Tab, quattro: str, link: str, words: str, kept: tuple[str, int, str]
):
    tab.open(quattro + link)
    until(tab.page, "() => window.studio?.scene")
    answered(tab.page)
    line = tab.page.locator("#lost-link")
    line.wait_for()
    assert words in line.inner_text()
    assert "\n" not in line.inner_text()
    name, legs, _, panel = look(tab.page)
    assert (name, len(legs), panel) == kept
    assert said(tab.page.locator(f"#panel-{panel}")) == ""


def test_a_lost_connection_is_told_and_mended(tab: Tab, address: str):
    open_: list[Any] = []

    def between(route: Any) -> None:
        server = route.connect_to_server()
        route.on_message(server.send)
        server.on_message(route.send)
        open_.append(route)

    tab.page.route_web_socket(re.compile("/live$"), between)
    page = enter(tab, address)
    drop(page, four__urdf=next(iter(URDF.values())))
    page.locator("[data-source='file:four.urdf'][aria-current=true]").wait_for(timeout=SLOW)
    answered(page)
    open_[0].close()
    page.locator("#lost-link").wait_for(state="visible")
    page.locator("#lost-link").wait_for(state="hidden", timeout=SLOW)
    assert len(open_) == 2
    show(page, "move").get_by_role("slider").first.focus()
    before = here(page)
    page.keyboard.press("ArrowRight")
    answered(page)
    assert here(page) != before


def test_the_end_of_the_server_is_told(tab: Tab):
    from hrsynth.present.studio.server import studio

    server = studio(open_=False)
    page = enter(tab, server.address)
    server.stop()
    page.locator("#lost-link", has_text="start it again").wait_for(timeout=SLOW)
    page.wait_for_timeout(1000)
    assert all("WebSocket" in complaint for complaint in tab.complaints)
    tab.complaints.clear()
