"""Draw the pictures in ``docs/pictures``, each with its command.

``python docs/pictures.py [NAME ...]`` draws them (default: all), as ``make pictures`` does. Pictures of pages are taken
in a headless Chromium. A test compares the names with the folder.
"""

from __future__ import annotations

import contextlib
import io
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs" / "pictures"
SIZE_MAX_BYTES = 300_000
"""Size of a picture above which its colours are reduced to 256."""
MOTION = "--start x=0,y=0,z=-0.75,phi=0 --goal x=-0.2,y=0,z=-0.56,phi=0"
"""Start and goal of MMT 5.1.3."""


@dataclass(frozen=True)
class Page:
    """Page that ``hrsynth COMMAND OPTION PATH`` writes; ``inner`` is the file in it if PATH is a folder."""

    command: str
    option: str
    width: int
    height: int
    inner: str = ""


@dataclass(frozen=True)
class Family:
    """Result of a ``command`` on a robot that is not shipped, by its name in ``python -m hrsynth.families``."""

    command: str
    robot: str


@dataclass(frozen=True)
class Screen:
    """Panel of ``hrsynth studio`` for a robot of ``docs/panels.py``."""

    robot: str
    panel: str


@dataclass(frozen=True)
class Drawing:
    """Figure of ``docs/figures.py``, by its name there."""

    figure: str


def command(name: str) -> str:
    """Return the command that draws a picture, as a user types it."""
    what = PICTURES[name]
    if isinstance(what, Page):
        return f"hrsynth {what.command} {what.option} {'pages' if what.inner else 'page.html'}"
    if isinstance(what, Family):
        return f"hrsynth {what.command} {what.robot}.urdf -o {name}"
    if isinstance(what, Screen):
        return f"hrsynth studio {what.robot}"
    if isinstance(what, Drawing):
        return f"python docs/figures.py {what.figure}"
    if name.startswith("derivation_"):
        robot, legs = what.split()
        return f'hrsynth.draw(hrsynth.derive("{robot}", observe="{legs}"))'
    return f"hrsynth {what} -o {name}"


PICTURES: dict[str, str | Page | Family | Screen | Drawing] = {
    "accuracy_quattro.png": "accuracy quattro --observe 1,4 --cone 0.1deg --plane z=-0.7",
    "aspects_six_poses.png": Family("aspects", "six_poses"),
    "basins_quattro.png": "basins quattro --observe 1,4 --goal x=0,y=0,z=-0.7,phi=0 --plane z=-0.7,phi=0",
    "catalog_entry.png": Page("catalog site --group planar --legs '3-R*RR'", "-o", 1250, 1100, "p/96081be379a6.html"),
    "derivation_quattro.svg": "quattro 1,4",
    "glossary_aspect.svg": Drawing("aspect"),
    "glossary_assembly_mode.svg": Drawing("assembly_mode"),
    "glossary_branch.svg": Drawing("branch"),
    "glossary_equilibrium.svg": Drawing("equilibrium"),
    "glossary_working_mode.svg": Drawing("working_mode"),
    "modes_quattro.png": "modes quattro --observe 1,4",
    "report_quattro.png": Page("derive quattro --observe 1,4", "--report", 1200, 1500),
    "servo_quattro.gif": f"servo quattro --observe 1,4 {MOTION} --dynamics --sense images",
    "studio_legs.webp": Screen("quattro", "unobserved"),
    "track_toggle.svg": Drawing("toggle"),
}
"""Sources of the pictures: arguments of ``hrsynth … -o``, a page, or (the derivation) robot and legs."""


def draw(name: str) -> None:
    """Draw one picture and reduce its size."""
    draw_full(name)
    file = FOLDER / name
    if file.suffix == ".png" and file.stat().st_size > SIZE_MAX_BYTES:
        from PIL import Image

        Image.open(file).convert("RGB").quantize(256).save(file, optimize=True)


def draw_full(name: str) -> None:
    """Draw one picture in full colours."""
    import hrsynth

    what, file = PICTURES[name], FOLDER / name
    if isinstance(what, Page):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / ("page.html" if not what.inner else "pages")
            run_command(f"{what.command} {what.option} {page}")
            take_screenshot(page / what.inner, file, what)
    elif isinstance(what, Family):
        from hrsynth.families.__main__ import main

        with tempfile.TemporaryDirectory() as folder:
            main(folder, what.robot)
            run_command(f"{what.command} {folder}/{what.robot}.urdf -o {file}")
    elif isinstance(what, Screen):
        import panels

        panels.screen(what.robot, what.panel, file)
    elif isinstance(what, Drawing):
        import figures

        figures.draw(what.figure)
    elif name.startswith("derivation_"):
        robot, legs = what.split()
        hrsynth.draw(hrsynth.derive(hrsynth.load(robot), legs.split(","))).save(str(file))
    else:
        run_command(f"{what} -o {file}")


def take_screenshot(page: Path, file: Path, what: Page) -> None:
    subprocess.run(
        [sys.executable, str(ROOT / "tests" / "browser.py"), str(page), str(file), str(what.width), str(what.height)],
        check=True,
    )


def run_command(command: str) -> None:
    from hrsynth.cli import run_command

    with contextlib.redirect_stdout(io.StringIO()) as output:
        status = run_command(shlex.split(command))
    if status:
        raise SystemExit(f"hrsynth {command}: exit status {status}\n{output.getvalue()}")


if __name__ == "__main__":
    for each in sys.argv[1:] or PICTURES:
        draw(each)
