"""The pictures in ``docs/pictures``, each by the command that draws it.

``python docs/pictures.py [NAME ...]`` draws them again (default: all), as ``make pictures`` does. A picture of a page
is taken in a headless Chromium. A test compares the names with the folder.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs" / "pictures"
LARGEST = 300_000
"""Bytes of a picture above which its colours are made fewer."""
FAR = "--start x=0,y=0,z=-0.75,phi=0 --goal x=-0.2,y=0,z=-0.56,phi=0"
"""The displacement of MMT 5.1.3."""


@dataclass(frozen=True)
class Page:
    """A page that ``hrsynth COMMAND OPTION PATH`` writes, taken at ``width`` × ``height`` pixels; ``inner`` is the
    file in it where PATH is a folder."""

    command: str
    option: str
    width: int
    height: int
    inner: str = ""


@dataclass(frozen=True)
class SitePage:
    """A page of the site that ``make docs`` builds, taken at ``width`` × ``height`` pixels; ``lesson`` is the notebook
    that must have been run for it."""

    path: str
    width: int
    height: int
    lesson: str | None = None


def command(name: str) -> str:
    """What draws a picture, as it is typed."""
    what = PICTURES[name]
    if isinstance(what, SitePage):
        return "make docs"
    if isinstance(what, Page):
        return (
            f"hrsynth {what.command} {what.option} page.html"
            if not what.inner
            else (f"hrsynth {what.command} {what.option} pages")
        )
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


def report(command: str) -> Page:
    return Page(f"derive {command}", "--report", 1200, 1500)


def view(command: str) -> Page:
    return Page(f"view {command} --hidden", "--static", 1100, 760)


@dataclass(frozen=True)
class Family:
    """The answer of a ``command`` on a robot that is no shipped file, by its name in ``python -m hrsynth.families``."""

    command: str
    robot: str


@dataclass(frozen=True)
class Screen:
    """A panel of ``hrsynth studio`` for a robot of ``docs/panels.py``."""

    robot: str
    panel: str


@dataclass(frozen=True)
class Drawing:
    """A figure of ``docs/figures.py``, by its name there."""

    figure: str


PICTURES: dict[str, str | Page | SitePage | Family | Screen | Drawing] = {
    "accuracy_quattro.png": "accuracy quattro --observe 1,4 --cone 0.1deg --plane z=-0.7",
    "atlas_six_poses.png": Family("aspects", "six_poses"),
    "basins_quattro.png": "basins quattro --observe 1,4 --goal x=0,y=0,z=-0.7,phi=0 --plane z=-0.7,phi=0",
    "catalog.png": Page(
        "catalog site --group spatial --base-motors --verdict controllable --motion 3R", "-o", 1250, 1100, "index.html"
    ),
    "catalog_page.png": Page("catalog site --group planar --legs '3-R*RR'", "-o", 1250, 1100, "p/96081be379a6.html"),
    "derivation_quattro.svg": "quattro 1,4",
    "glossary_aspect.svg": Drawing("aspect"),
    "glossary_assembly_mode.svg": Drawing("assembly_mode"),
    "glossary_branch.svg": Drawing("branch"),
    "glossary_equilibrium.svg": Drawing("equilibrium"),
    "glossary_working_mode.svg": Drawing("working_mode"),
    "modes_3rrr.png": "modes 3rrr_m1",
    "modes_delta.png": "modes delta",
    "modes_delta_real.png": "modes delta --real",
    "modes_gough_stewart.png": "modes gough_stewart --observe 1,3,5 --at x=-0.03,y=-0.06,z=0.37,rpy=-0.1/0.5/0.1",
    "modes_hexa.png": "modes hexa --observe 1,3,5",
    "modes_quattro.png": "modes quattro --observe 1,4",
    "modes_rrrrr.png": "modes rrrrr_m1",
    "notebook.png": SitePage("notebooks/1_the_idea.html", 1250, 1500, "1_the_idea"),
    "report_3rrr_m1.png": report("3rrr_m1"),
    "report_gough_stewart.png": report("gough_stewart"),
    "report_quattro.png": report("quattro --observe 1,4"),
    "report_rrrrr_m1.png": report("rrrrr_m1"),
    "report_uranesx.png": report("uranesx"),
    "servo_3rpr.png": "servo 3rpr_m1 --start x=-0.08,y=-0.06,phi=-10deg --goal x=0.034,y=0.23,phi=23deg",
    "servo_quattro.gif": f"servo quattro --observe 1,4 {FAR} --dynamics --sense images",
    "servo_quattro.png": f"servo quattro --observe 1,4 {FAR}",
    "site.png": SitePage("index.html", 1250, 1250),
    "studio_legs.webp": Screen("quattro", "lost"),
    "studio_plane.webp": Screen("quattro", "plane"),
    "view_3rrr.png": view("3rrr_m1"),
    "view_gough_stewart.png": view("gough_stewart --observe 1,3,5"),
    "view_quattro.png": view("quattro --observe 1,4"),
    "view_rrrrr.png": view("rrrrr_m1"),
    "view_uranesx.png": view("uranesx"),
}
"""Each picture: what draws it with ``-o``, the page that it is of, or (the derivation) robot and legs."""


def draw(name: str) -> None:
    """Draw one picture again, small enough to be kept."""
    made(name)
    file = FOLDER / name
    if file.suffix == ".png" and file.stat().st_size > LARGEST:
        from PIL import Image

        Image.open(file).convert("RGB").quantize(256).save(file, optimize=True)


def made(name: str) -> None:
    """Draw one picture as it comes."""
    import hrsynth

    what, file = PICTURES[name], FOLDER / name
    if isinstance(what, Page):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / ("page.html" if not what.inner else "pages")
            _run(f"{what.command} {what.option} {page}")
            _take(page / what.inner, file, what)
    elif isinstance(what, SitePage):
        with tempfile.TemporaryDirectory() as folder:
            _build(what, Path(folder))
            _take(Path(folder) / what.path, file, what)
    elif isinstance(what, Family):
        from hrsynth.families.__main__ import main

        with tempfile.TemporaryDirectory() as folder:
            main(folder, what.robot)
            _run(f"{what.command} {folder}/{what.robot}.urdf -o {file}")
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
        _run(f"{what} -o {file}")


def _take(page: Path, file: Path, what: Page | SitePage) -> None:
    subprocess.run(
        [sys.executable, str(ROOT / "tests" / "browser.py"), str(page), str(file), str(what.width), str(what.height)],
        check=True,
    )


def _build(what: SitePage, folder: Path) -> None:
    """The site, of its notebooks the one that is wanted with outputs."""
    import lessons

    if what.lesson is not None:
        lessons.executed(lessons.FOLDER / f"{what.lesson}.py")
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)],
        check=True,
        cwd=ROOT,
        env={**os.environ, "HRSYNTH_DOCS_QUICK": "1", "NO_MKDOCS_2_WARNING": "1"},
    )


def _run(command: str) -> None:
    from hrsynth.cli import execute

    with contextlib.redirect_stdout(io.StringIO()) as output:
        status = execute(shlex.split(command))
    if status:
        raise SystemExit(f"hrsynth {command}: exit status {status}\n{output.getvalue()}")


if __name__ == "__main__":
    for each in sys.argv[1:] or PICTURES:
        draw(each)
