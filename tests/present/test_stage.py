"""The stage in a browser: what is clicked and dragged, what moves and what rests, complete legends, no WebGL."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from browser import Tab
from hrsynth.present.studio import saved as page
from present.views import moved, seen, turned

pytestmark = pytest.mark.browser

READY = "document.body.dataset.ready == 'yes'"
NAMES = "() => { Object.assign(window, { stage: studio.stage, scene: studio.scene }); }"
SIZE = {"width": 1200, "height": 800}
AT_REST = 700
"""Milliseconds in which a page at rest draws nothing."""
STILL = (
    "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame("
    "() => done(stage.drawn)))))"
)


@pytest.fixture
def open_page(tab: Tab, tmp_path: Path) -> Callable[..., Tab]:
    def opened(name: str, size: dict[str, int] = SIZE) -> Tab:
        file = tmp_path / f"{name}.html"
        file.write_bytes(page.static(seen(name)))
        tab.page.set_viewport_size(size)
        tab.open(file, READY)
        tab.page.evaluate(NAMES)
        return tab

    return opened


def on_page(tab: Tab, point: Any) -> tuple[float, float]:
    """Where a point of the base frame is seen (pixels of the page)."""
    return tuple(
        tab.page.evaluate(
            """p => {
      stage.world.updateMatrixWorld(true);
      const seen = new THREE.Vector3(...p).applyMatrix4(stage.sides.real.matrixWorld).project(stage.sight.camera);
      const box = stage.canvas.getBoundingClientRect();
      return [box.left + (1 + seen.x) / 2 * box.width, box.top + (1 - seen.y) / 2 * box.height]; }""",
            [float(v) for v in point],
        )
    )


def pane(tab: Tab) -> dict[str, float]:
    """Where the picture is on the page."""
    found = tab.page.locator("#pane").bounding_box()
    assert found is not None
    return found


def ask(tab: Tab, script: str) -> Any:
    return tab.page.evaluate(script)


def rest(tab: Tab) -> None:
    tab.page.evaluate(STILL)


def middle_of_arrow(name: str, number: int) -> tuple[str, np.ndarray]:
    arrow = seen(name).arrows[number]
    return arrow.leg, arrow.ends.mean(axis=0)


@pytest.mark.parametrize("name", ["3rrr_m1", "quattro"])
def test_a_leg_that_is_clicked_is_told(open_page, name: str):
    tab = open_page(name)
    ask(tab, "stage.ghosts([]); window.told = []; stage.onpick = (...what) => told.push(what); 0")
    for number in range(len(seen(name).arrows)):
        leg, point = middle_of_arrow(name, number)
        tab.page.mouse.click(*on_page(tab, point))
        assert ask(tab, "told.pop()") == ["leg", leg]
    box = pane(tab)
    tab.page.mouse.click(box["x"] + 8, box["y"] + box["height"] - 8)
    assert ask(tab, "told.length") == 0


def test_a_drag_of_the_view_picks_nothing_and_turns_it(open_page):
    tab = open_page("3rrr_m1")
    ask(tab, "stage.ghosts([]); window.told = []; stage.onpick = (...what) => told.push(what); 0")
    _, point = middle_of_arrow("3rrr_m1", 0)
    x, y = on_page(tab, point)
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 60, y + 30, steps=4)
    tab.page.mouse.up()
    assert ask(tab, "told.length") == 0
    assert np.hypot(*np.subtract(on_page(tab, point), (x, y))) > 5
    tab.page.locator("main canvas").press("Home")
    assert on_page(tab, point) == pytest.approx((x, y), abs=0.5)


def test_a_finger_picks_a_leg_beside_which_it_comes_down(browser: Any, tmp_path: Path):
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, device_scale_factor=2)
    tab = Tab.of(context.new_page())
    file = tmp_path / "page.html"
    file.write_bytes(page.static(seen("3rrr_m1")))
    tab.open(file, READY)
    ask(tab, NAMES)
    ask(tab, "stage.ghosts([]); window.told = []; stage.onpick = (...what) => told.push(what); 0")
    leg, point = middle_of_arrow("3rrr_m1", 0)
    x, y = on_page(tab, point)
    tab.page.touchscreen.tap(x + 7, y - 7)
    assert ask(tab, "told.pop()") == ["leg", leg]
    width, scale = ask(tab, "[stage.canvas.width, stage.canvas.width / stage.canvas.clientWidth]")
    assert (width, scale) == (780, 2), "sharp on a screen of two points a pixel"
    context.close()
    assert tab.complaints == []


def test_a_mode_that_is_clicked_is_told_by_its_label(open_page):
    tab = open_page("quattro")
    ask(tab, "stage.ghosts(scene.ghosts); window.told = []; stage.onghost = (label) => told.push(label); 0")
    names = ask(
        tab,
        """stage.parts.ghosts.children.map((group) => [...group.children].find((each) => each.isSprite))
                        .map((each) => [each.userData.pick.name, each.position.toArray()])""",
    )
    assert [name for name, _ in names] == [outline.label for outline in seen("quattro").mode_outlines]
    for name, point in names:
        tab.page.mouse.click(*on_page(tab, point))
        assert ask(tab, "told.pop()") == name


def test_the_mode_where_the_robot_is_has_no_outline(open_page):
    tab = open_page("quattro")
    here = "{label: '9', places: scene.state.real.map((place) => [...place]), reachable: true}"
    ask(tab, f"stage.ghosts([{here}, scene.ghosts[0]])")
    assert ask(tab, "stage.parts.ghosts.children.map(({ visible }) => visible)") == [False, True]
    ask(tab, "stage.state(scene.sliders[0].states[0])")
    assert ask(tab, "stage.parts.ghosts.children.map(({ visible }) => visible)") == [True, True]


def test_a_hidden_robot_of_unknown_place_is_not_shown_where_it_was(open_page):
    tab = open_page("quattro")
    shown = "['real', 'hidden'].map((key) => stage.machines[key].group.visible)"
    assert ask(tab, shown) == [True, True]
    ask(tab, "stage.state({ real: scene.sliders[0].states[0].real, error: scene.state.error })")
    assert ask(tab, shown) == [True, False]
    assert ask(tab, "stage.machines.real.looks.leg.opacity") == 1, "the real robot is no glass then"
    ask(tab, "stage.state(scene.state)")
    assert ask(tab, shown) == [True, True]


def test_nothing_is_drawn_while_nothing_changes(open_page):
    tab = open_page("3rrr_m1")
    before = ask(tab, STILL)
    tab.page.wait_for_timeout(AT_REST)
    assert ask(tab, "stage.drawn") == before
    ask(tab, "stage.lost([{twist: [0, 0, 0, 0, 0, 1], point: [0, 0, 0]}])")
    tab.page.wait_for_function(f"stage.drawn > {before + 5}", timeout=20_000)
    ask(tab, "stage.reduced = true")
    still = ask(tab, STILL)
    tab.page.wait_for_timeout(AT_REST)
    assert ask(tab, "stage.drawn") == still, "where motion is reduced it rests"


def test_an_arrow_of_a_lost_freedom_moves_as_its_twist_says(open_page):
    """The velocity of any point at the start is v + ω × (x − p), up to a factor: by differences of where it is carried,
    against NumPy."""
    tab, rng = open_page("rrrrr_m1"), np.random.default_rng(7)
    translation, turn = np.array([0.3, -0.2, 0.9, 0, 0, 0]), np.array([0.0, 0, 0, 0, 0, 1])
    for twist in (translation, turn, *rng.normal(size=(6, 6))):
        p, x = rng.normal(size=(2, 3))
        h = 1e-5
        ends = np.array(
            tab.page.evaluate(
                """([twist, point, x, h]) => {
          const motion = new Overlays.Motion({ twist, point }, 1);
          return [-h, h].map((by) => motion.carry(new THREE.Vector3(...x), by).toArray()); }""",
                [twist.tolist(), p.tolist(), x.tolist(), h],
            )
        )
        found, wanted = (ends[1] - ends[0]) / (2 * h), twist[:3] + np.cross(twist[3:], x - p)
        size = np.linalg.norm(twist[3:]) or np.linalg.norm(twist[:3])
        assert found == pytest.approx(wanted / size, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "modes"),
    [
        ("3rrr_m1", {"translate": 2, "rotate": 1}),
        ("rrrrr_m1", {"translate": 2}),
        ("delta", {"translate": 3}),
        ("3rps", {"translate": 1, "rotate": 2}),
        ("gough_stewart", {"translate": 3, "rotate": 3}),
    ],
)
def test_handles_are_those_of_the_platforms_freedoms(open_page, name: str, modes: dict[str, int]):
    tab = open_page(name)
    ask(tab, "stage.gizmo(true)")
    found = ask(
        tab,
        """Object.fromEntries(stage.handles.parts.map(({ mode, controls }) =>
                        [mode, [controls.showX, controls.showY, controls.showZ].filter(Boolean).length]))""",
    )
    assert found == modes
    ask(tab, "stage.gizmo(false)")
    assert ask(tab, "stage.handles") is None


def test_a_platform_that_is_dragged_tells_places_within_its_freedoms(open_page):
    tab, found = open_page("3rrr_m1"), seen("3rrr_m1")
    ask(tab, "stage.ghosts([]); window.places = []; stage.gizmo(true, null, (place) => places.push(place))")
    rest(tab)
    mechanism = found.setup.mechanism
    centre, L = mechanism.links[mechanism.platform].pose[:3, 3], mechanism.length
    step = 0.1 * L
    assert ask(tab, "stage.handles.parts[0].proxy.position.toArray()") == pytest.approx(centre, abs=1e-6)
    (x, y), (x1, y1) = on_page(tab, centre), on_page(tab, centre + [step, 0, 0])
    reach = 48 / np.hypot(x1 - x, y1 - y)
    x0, y0 = x + reach * (x1 - x), y + reach * (y1 - y)
    tab.page.mouse.move(x0, y0)
    tab.page.mouse.down()
    tab.page.mouse.move(x0 + (x1 - x), y0 + (y1 - y), steps=6)
    tab.page.mouse.up()
    places = np.array(ask(tab, "places"))
    assert len(places) >= 3, "each move is told"
    assert np.abs(places[:, 3:] - [0, 0, 0, 1]).max() < 1e-9
    assert np.abs(places[:, 1:3]).max() < 1e-9, "along x alone"
    assert 0.5 * step < places[-1, 0] < 2 * step
    assert ask(tab, "stage.sight.turned") is False, "the view has not turned with it"
    assert ask(tab, "stage.handles.parts[0].proxy.position.toArray()") == pytest.approx(centre, abs=1e-6), (
        "what was not answered is not kept"
    )


def test_a_ring_turns_the_platform_about_its_point(open_page):
    tab, found = open_page("3rrr_m1"), seen("3rrr_m1")
    mechanism = found.setup.mechanism
    centre = mechanism.links[mechanism.platform].pose[:3, 3]
    place = np.array(
        ask(
            tab,
            """(() => {
      stage.gizmo(true);
      const { proxy, at } = stage.handles.parts.find(({ mode }) => mode === "rotate");
      proxy.quaternion.premultiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 0, 1), 0.3));
      return stage.handles.dragged("rotate", proxy, at.turn); })()""",
        )
    )
    assert moved(place, centre) == pytest.approx(centre, abs=1e-9)
    assert turned(place, np.array([1.0, 0, 0])) == pytest.approx([np.cos(0.3), np.sin(0.3), 0], abs=1e-9)


PLANE = {
    "corners": [[-0.1, -0.1, 0.05], [0.1, -0.1, 0.05], [0.1, 0.1, 0.05], [-0.1, 0.1, 0.05]],
    "at": 0.05,
    "values": [[0.5, 2.0, None], [5.0, 20.0, 50.0]],
    "steps": [1, 3, 10, 30],
    "locus": [[[-0.1, 0, 0.05], [0, 0.05, 0.05], [0.1, 0, 0.05]]],
}


def test_a_plane_has_cells_of_the_scales_colours_and_is_drawn_along_its_normal(open_page):
    tab = open_page("delta")
    ask(tab, f"window.told = []; stage.plane({json.dumps(PLANE)}, (at) => told.push(at)); stage.fit()")
    cells = ask(tab, "[...stage.sheet.cells().image.data]")
    colours = ask(tab, "Colours.steps")
    rgba = np.array(cells).reshape(6, 4)
    assert rgba[2, 3] == 0, "what is not reached has no colour"
    shown = ["#" + bytes(row[:3].tolist()).hex() for row in rgba[[0, 1, 3, 4, 5]]]
    assert shown == colours
    assert {f"step{k}" for k in range(5)} <= {each["key"] for each in ask(tab, "stage.legend()")}
    rest(tab)
    grip, above = ask(tab, "stage.sheet.grip().toArray()"), 0.04
    (x, y), (x1, y1) = on_page(tab, grip), on_page(tab, np.add(grip, [0, 0, above]))
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    start = ask(tab, "performance.now()")
    for k in range(1, 11):
        tab.page.mouse.move(x + (x1 - x) * k / 10, y + (y1 - y) * k / 10)
    told, end = ask(tab, "[told.length, performance.now()]")
    tab.page.mouse.up()
    assert 1 <= told <= 1 + (end - start) / 120, "not every move is asked"
    assert ask(tab, "told.at(-1)") == pytest.approx(0.05 + above, abs=0.002)
    assert ask(tab, "stage.sheet.group.position.toArray()") == pytest.approx([0, 0, above], abs=0.002)


def test_a_plane_across_no_direction_has_no_handle_and_a_falling_scale_is_told(open_page):
    tab = open_page("3rrr_m1")
    record = {
        **PLANE,
        "normal": None,
        "falling": True,
        "steps": [0.01, 0.03, 0.1, 0.3],
        "values": [[0.005, 0.02], [0.05, 0.2], [0.5, None]],
    }
    ask(tab, f"stage.plane({json.dumps(record)})")
    rgba = np.array(ask(tab, "[...stage.sheet.cells().image.data]")).reshape(6, 4)
    shown = ["#" + bytes(row[:3].tolist()).hex() for row in rgba[:5]]
    assert shown == ask(tab, "Colours.steps")[::-1], "near a singularity is worst"
    legend = {each["key"]: each["words"] for each in ask(tab, "stage.legend()")}
    assert "distance on the plane more than 0.3" in legend["step0"]
    assert "distance on the plane up to 0.01" in legend["step4"]
    assert ask(tab, "stage.sheet.handle.length") == 0
    corners = np.array(ask(tab, "[...stage.sheet.group.children[0].geometry.attributes.position.array]")).reshape(4, 3)
    assert np.ptp(corners, axis=0)[:2] == pytest.approx([0.2 * 2, 0.2 * 1.5]), "cells lie about their values"


def test_an_ellipsoid_is_magnified_by_what_the_legend_says(open_page):
    tab = open_page("delta")
    axes = np.array([[2e-3, 1e-3, 0], [-0.5e-3, 1e-3, 0], [0, 0, 0]])
    ask(tab, f"stage.ellipsoid({{center: [0, 0, -0.6], axes: {axes.tolist()}}})")
    matrix = np.array(ask(tab, "stage.parts.ellipsoid.children[0].matrix.toArray()")).reshape(4, 4)
    factor = ask(tab, "stage.factor")
    assert matrix[:2, :3] == pytest.approx(factor * axes[:2], rel=1e-6)
    assert np.linalg.matrix_rank(matrix[:3, :3]) == 3
    assert matrix[3, :3] == pytest.approx([0, 0, -0.6])
    (words,) = [each["words"] for each in ask(tab, "stage.legend()") if each["key"] == "ellipsoid"]
    assert f"{factor} times" in words
    digits = f"{factor:.0f}".rstrip("0")
    assert digits in ("1", "2", "5")


def test_the_legend_holds_all_that_is_drawn_and_no_more(open_page):
    """Every colour of a material that is seen, against the table."""
    tab = open_page("quattro")
    scripts = [
        "stage.layout('overlay')",
        "stage.layout('real')",
        "stage.layout('hidden')",
        "stage.layout('beside')",
        "stage.watch(['1'])",
        "stage.goal(scene.state)",
        "stage.lost([{twist: [0, 0, 1, 0, 0, 0], point: [0, 0, 0]}])",
        "stage.ellipsoid({center: [0, 0, 0], axes: [[0.001, 0, 0], [0, 0.001, 0], [0, 0, 0.001]]})",
        "stage.ghosts([])",
    ]
    for script in scripts:
        ask(tab, script)
        drawn = set(
            ask(
                tab,
                """(() => { const found = new Set();
          const add = (each) => { if (each.isMesh) found.add("#" + each.material.color.getHexString()); };
          stage.world.traverseVisible(add);
          return [...found]; })()""",
            )
        )
        legend = {each["colour"]: each["key"] for each in ask(tab, "stage.legend()")}
        assert drawn <= legend.keys(), script
        extra = {key for colour, key in legend.items() if colour not in drawn}
        assert all(key.startswith("step") for key in extra), (script, extra)


def test_the_scale_says_its_thresholds_and_where_the_platform_is(open_page):
    tab, error = open_page("delta"), seen("delta").home.error
    assert error is not None
    legend = {each["key"]: each for each in ask(tab, "stage.legend()")}
    assert [key for key, each in legend.items() if each["now"]] == [f"step{error['step']}"]
    assert "1 to 3 mm per 0.1°" in legend["step1"]["words"]
    assert "singular" in legend["step4"]["words"]
    assert error["words"] in tab.page.locator("body").inner_text()
    ask(tab, "stage.state({ ...scene.state, error: { step: null } })")
    (now,) = [each["key"] for each in ask(tab, "stage.legend()") if each["now"]]
    assert now == "unknown"


@pytest.mark.parametrize("size", [SIZE, {"width": 390, "height": 844}])
def test_two_robots_beside_each_other_do_not_touch(open_page, size: dict[str, int]):
    tab = open_page("quattro", size)
    ask(tab, "stage.ghosts([]); stage.layout('beside')")
    boxes = ask(
        tab,
        """["real", "hidden"].map((key) => {
      const corners = Sight.corners([stage.machines[key].group]), { across, up } = stage.sight;
      return [Sight.span(corners, across), Sight.span(corners, up)]; })""",
    )
    (wide, high), (wide1, high1) = boxes
    across = pane(tab)["width"] >= pane(tab)["height"]
    apart = wide[1] < wide1[0] if across else high1[1] < high[0]
    assert apart, boxes
    rest(tab)
    box = tab.page.locator("main canvas").bounding_box()
    inside = ask(
        tab,
        """(() => Sight.corners([stage.sides.real, stage.sides.hidden, stage.names])
      .map((p) => p.project(stage.sight.camera)).every(({ x, y }) => Math.abs(x) < 1 && Math.abs(y) < 1))()""",
    )
    assert inside
    assert box["width"] == pane(tab)["width"]


def test_the_picture_is_a_png_as_large_as_the_pane(open_page):
    tab = open_page("3rrr_m1")
    size, kind, corner = ask(
        tab,
        """stage.picture().then(async (blob) => {
      const image = await createImageBitmap(blob), canvas = new OffscreenCanvas(image.width, image.height);
      canvas.getContext("2d").drawImage(image, 0, 0);
      const data = canvas.getContext("2d").getImageData(2, 2, 1, 1).data;
      return [[image.width, image.height], blob.type, [...data]]; })""",
    )
    assert (size, kind, corner) == (
        [round(pane(tab)["width"]), round(pane(tab)["height"])],
        "image/png",
        [245, 247, 250, 255],
    )


def test_without_webgl_one_line_says_so_and_the_words_stay(tab: Tab, tmp_path: Path):
    tab.page.add_init_script("""const own = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind.startsWith("webgl") ? null : own.call(this, kind, ...more); };""")
    file = tmp_path / "page.html"
    file.write_bytes(page.static(seen("quattro")))
    tab.open(file, READY)
    ask(tab, NAMES)
    assert "WebGL" in tab.page.locator(".stage [role=alert]").inner_text()
    tab.page.locator("aside input[type=range]").first.press("ArrowLeft")
    tab.page.get_by_role("button", name="Zero configuration").click()
    ask(tab, "stage.layout('beside'); stage.gizmo(true); stage.lost([{twist: [1, 0, 0, 0, 0, 0], point: [0, 0, 0]}])")
    assert ask(tab, "stage.picture()") is None
    assert "virtual actuator" in tab.page.locator("body").inner_text()


def test_a_graphics_card_that_goes_is_told_and_comes_back(open_page):
    tab = open_page("3rrr_m1")
    ask(tab, "window.card = stage.renderer.getContext().getExtension('WEBGL_lose_context'); card.loseContext()")
    tab.page.locator(".stage [role=alert]").wait_for()
    assert "graphics context" in tab.page.locator(".stage [role=alert]").inner_text()
    ask(tab, "card.restoreContext()")
    tab.page.wait_for_function("!document.querySelector('.stage [role=alert]')")
    rest(tab)
    picture = tab.picture()[: round(pane(tab)["height"]), : round(pane(tab)["width"])].astype(int)
    assert np.abs(picture - picture[:, :1]).max() > 50


def test_the_view_is_turned_and_fitted_by_keys(open_page):
    tab = open_page("delta")
    canvas, before = tab.page.locator("main canvas"), ask(tab, "stage.sight.camera.position.toArray()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        canvas.press(key)
        after = ask(tab, "stage.sight.camera.position.toArray()")
        assert after != pytest.approx(before, abs=1e-3)
    canvas.press("Home")
    assert ask(tab, "stage.sight.camera.position.toArray()") == pytest.approx(before, abs=1e-9)
    assert "arrow keys" in (canvas.get_attribute("aria-label") or "")


@pytest.mark.parametrize("size", [SIZE, {"width": 390, "height": 844}])
def test_what_lies_on_the_pane_covers_nothing_of_the_robot(open_page, size: dict[str, int]):
    tab = open_page("3rrr_m1", size)
    edges = """(() => { const seen = Sight.corners([stage.sides.real, stage.sides.hidden])
                          .map((p) => p.project(stage.sight.camera).y);
                        const height = stage.canvas.clientHeight;
                        return [(1 - Math.max(...seen)) / 2 * height, (1 + Math.min(...seen)) / 2 * height]; })()"""
    top, bottom = ask(tab, edges)
    ask(tab, "stage.over = []; stage.fit()")
    top, bottom = ask(tab, edges)
    assert top == pytest.approx(bottom, abs=0.1 * size["height"])
    ask(
        tab,
        """for (const [edge, height] of [["top", 80], ["bottom", 40]]) {
      const bar = document.createElement("div");
      bar.style.cssText = `position: absolute; ${edge}: 0; left: 0; width: 100%; height: ${height}px`;
      stage.parent.append(bar);
      stage.over.push(bar);
    }
    stage.fit()""",
    )
    top, bottom = ask(tab, edges)
    assert top > 80
    assert bottom > 40


def test_another_robot_takes_the_place_of_the_first_and_gives_back_what_it_held(open_page):
    tab = open_page("delta")
    ask(tab, "stage.ghosts(scene.ghosts)")
    rest(tab)
    held = ask(tab, "[stage.renderer.info.memory.geometries, stage.renderer.info.memory.textures]")
    for _ in range(4):
        ask(tab, "stage.lost([{twist: [0, 0, 1, 0, 0, 1], point: [0, 0, 0]}]); stage.plane(null)")
        ask(tab, f"stage.plane({json.dumps(PLANE)}); stage.goal(scene.state)")
        rest(tab)
        ask(tab, "stage.scene(scene); stage.ghosts(scene.ghosts); stage.reduced = true")
        rest(tab)
    assert ask(tab, "[stage.renderer.info.memory.geometries, stage.renderer.info.memory.textures]") == held
