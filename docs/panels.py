"""Screens of the studio: one panel for ``docs/pictures.py``, or all panels of a robot on one sheet to compare versions.

``python docs/panels.py delta sheet.webp`` draws a sheet: wide windows above, those of a telephone below."""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parent.parent / "tests"
sys.path.insert(0, str(TESTS))

WIDE, NARROW = (1280, 800), (390, 844)
"""Windows (pixels)."""
COLUMNS, WIDTH = 4, 2400
"""Wide screens in a row, and the width of a sheet (pixels)."""
SLOW = 120_000
"""Longest time of a result (ms)."""
BUSY = "() => Object.values(studio.link.lanes).some(({ sent, waiting }) => sent || waiting.size)"


def tilted(name: str, folder: Path) -> Path:
    """Write a shipped robot on a tilted base."""
    from description.samples import moved
    from hrsynth import load, save
    from hrsynth.geometry.vectors import build_pose, rotate_about_axis

    file = folder / f"{name}_tilted.urdf"
    save(moved(load(name), build_pose(np.array([0.1, 0.0, 0.2]), rotate_about_axis([1.0, -0.4, 0.2], 0.7))), file)
    return file


def ankle(folder: Path) -> Path:
    """Write a humanoid's ankle: a U joint and two legs."""
    from analysis.modes import ankles
    from hrsynth import save

    file = folder / "ankle.urdf"
    save(ankles.ankle("RSU", 3)[0], file)
    return file


def meshed(folder: Path) -> Path:
    """Write a five-bar as MuJoCo file, with a mesh for each moving link."""
    import trimesh

    from hrsynth import load, save
    from hrsynth.description import list_robots

    robot = load("rrrrr_m1")
    text = list_robots()[robot.name].read_text(encoding="utf-8").replace('name="rrrrr_m1"', 'name="five_bar"')
    for name, link in robot.links.items():
        ends = [(np.linalg.inv(link.pose) @ [*joint.point, 1])[:3] for joint in robot.joints_of(name)]
        if name == robot.base or len(ends) < 2:
            continue
        part = trimesh.creation.cylinder(0.012, segment=np.array(ends[:2])) + trimesh.creation.box(
            (0.05, 0.05, 0.03), trimesh.transformations.translation_matrix(np.mean(ends, axis=0))
        )
        part.export(folder / f"{name}.stl")
        visual = f'<visual><geometry><mesh filename="{name}.stl"/></geometry></visual>'
        text = text.replace(f'<link name="{name}"/>', f'<link name="{name}">{visual}</link>')
    native = folder / "five_bar.urdf"
    native.write_text(text, encoding="utf-8")
    save(load(native), folder / "five_bar.xml")
    return folder / "five_bar.xml"


ROBOTS: dict[str, Callable[[Path], str | Path]] = {
    "delta": lambda _: "delta",
    "quattro": lambda _: "quattro",
    "3rrr_tilted": lambda folder: tilted("3rrr_m1", folder),
    "gough_stewart": lambda _: "gough_stewart",
    "ankle": ankle,
    "five_bar_meshes": meshed,
}
"""Robots by the names of their sheets."""


def screen(name: str, key: str, file: Path) -> None:
    """Draw one panel of a robot."""
    from PIL import Image

    from browser import Tab, running
    from hrsynth.present.studio.server import studio

    with tempfile.TemporaryDirectory() as folder, running() as browser:
        server = studio(ROBOTS[name](Path(folder)), open_=False)
        width, height = WIDE
        tab = Tab.of(browser.new_page(viewport={"width": width, "height": height}, reduced_motion="reduce"))
        tab.open(server.address)
        next(each for each in shown(tab.page) if each == key)
        Image.fromarray(tab.picture()).save(file, quality=80, method=6)
        server.stop()


def sheet(name: str, file: Path) -> None:
    """Draw the sheet of one robot."""
    from PIL import Image

    from browser import Tab, running
    from hrsynth.present.studio.server import studio

    with tempfile.TemporaryDirectory() as folder, running() as browser:
        server = studio(ROBOTS[name](Path(folder)), open_=False)
        rows = []
        for width, height in (WIDE, NARROW):
            tab = Tab.of(browser.new_page(viewport={"width": width, "height": height}, reduced_motion="reduce"))
            tab.open(server.address)
            rows.append([Image.fromarray(tab.picture()) for _ in shown(tab.page)])
            if tab.complaints:
                raise SystemExit(f"{name}: {tab.complaints}")
            tab.page.close()
        server.stop()
    wide, narrow = rows
    tiles = [(screen, WIDTH // COLUMNS) for screen in wide] + [(screen, WIDTH // len(narrow)) for screen in narrow]
    made = Image.new("RGB", (WIDTH, 10_000), "#5a6672")
    x = y = 0
    for tile, width in tiles:
        height = round(tile.height * width / tile.width)
        made.paste(tile.resize((width - 4, height - 4), Image.Resampling.LANCZOS), (x, y))
        x += width
        if x + width > WIDTH:
            x, y = 0, y + height
    made.crop((0, 0, WIDTH, y)).save(file, quality=80, method=6)


def shown(page: Any) -> Iterator[str]:
    """Show one panel after the other."""
    page.locator("body[data-ready=yes]").wait_for(timeout=SLOW)
    page.locator("#answer", has_text=re.compile(r"^(?!.*Computing which legs)")).wait_for(timeout=SLOW)
    settled(page)
    yield panel(page, "robot")
    panel(page, "move")
    slider = page.locator("#panel-move").get_by_role("slider").first
    slider.focus()
    for _ in range(12):
        slider.press("ArrowRight")
    page.get_by_label("Drag the platform in the 3D view").check()
    settled(page)
    yield "move"
    page.get_by_label("Drag the platform in the 3D view").uncheck()
    page.get_by_role("radio", name="Side by side").check()
    yield panel(page, "legs")
    boxes = page.locator(".legs input:checked")
    while boxes.count() > 1:
        boxes.last.uncheck()
    page.get_by_role("radio", name="Robot", exact=True).check()
    settled(page)
    yield "unobserved"
    page.locator(".sets button").first.click()
    settled(page)
    yield panel(page, "modes")
    panel(page, "plane")
    page.get_by_role("button", name="Draw the plane").click()
    settled(page)
    yield "plane"
    panel(page, "servo")
    page.get_by_role("button", name="Set here: the goal").click()
    page.get_by_role("button", name="Run").click()
    settled(page)
    yield "servo"
    yield panel(page, "export")


def panel(page: Any, key: str) -> str:
    """Open a panel and wait for its result."""
    page.locator(f"#tab-{key}").click()
    settled(page)
    return key


def settled(page: Any) -> None:
    """Wait until all is computed and drawn."""
    page.wait_for_timeout(400)
    for _ in range(SLOW // 100):
        if not page.evaluate(BUSY):
            break
        page.wait_for_timeout(100)
    page.wait_for_timeout(300)


if __name__ == "__main__":
    sheet(sys.argv[1], Path(sys.argv[2]))
