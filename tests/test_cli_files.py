"""Files that commands write: a sentence for each, figures in any format, width and font, and a bar while it lasts."""

from __future__ import annotations

import os
import pty
import re
import struct
import subprocess
import sys
import time
import xml.etree.ElementTree as Xml
from pathlib import Path

import numpy as np
import pytest

from hrsynth.cli import run_command
from hrsynth.cli.progress import Progress
from hrsynth.present.outputs import FIGURES, OUTPUTS

GRID = ["--grid", "x=0:0.02:2,y=0.2:0.24:2"]
DRAWN = {
    "check": ["check", "rrrrr_m1", *GRID],
    "modes": ["modes", "3rrr_m1"],
    "aspects": ["aspects", "3rrr_m1", "--observe", "2,1,3"],
    "accuracy": ["accuracy", "rrrrr_m1", "--cone", "0.1deg", *GRID],
    "equilibria": ["equilibria", "prrrp_m1", "--goal", "mode:1"],
    "basins": ["basins", "rrrrr_m1", "--goal", "x=0.02,y=0.24", "--grid", "x=0.01:0.02:2,y=0.24", "--jobs", "1"],
    "servo": ["servo", "rrrrr_m1", "--start", "x=0,y=0.2", "--goal", "x=0.02,y=0.22"],
    "singularities": ["singularities", "rrrrr_m1", "--points", "5", "--steps", "5"],
}
FILES = {
    **{name: [([*asked, "-o", f"{name}.svg"], [f"{name}.svg"])] for name, asked in DRAWN.items()},
    "derive": [
        (["derive", "3rrr_m1", "-o", "h.urdf"], ["h.urdf"]),
        (["derive", "3rrr_m1", "-o", "h.yaml"], ["h.yaml", "h.urdf"]),
    ],
    "convert": [(["convert", "3rrr_m1", "c.xml"], ["c.xml"]), (["convert", "3rrr_m1", "c.yaml"], ["c.yaml", "c.urdf"])],
    "catalog show": [(["catalog", "show", "3(Rz*-Rz-Rz)", "-o", "s.urdf"], ["s.urdf"])],
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_drawing_command_is_among_them():
    assert {name for name, each in OUTPUTS.items() if any(file.drawn for file in each.files)} == DRAWN.keys()


@pytest.mark.some(1, 4)
@pytest.mark.parametrize(
    ("arguments", "files"), [each for group in FILES.values() for each in group], ids=lambda each: " ".join(each)
)
def test_one_sentence_names_what_is_written(here: Path, capsys, arguments: list[str], files: list[str]):
    assert run_command(arguments) == 0
    out = capsys.readouterr().out
    assert sorted(path.name for path in here.iterdir()) == sorted(files)
    sentences = [line for line in out.splitlines() if "is written to" in line]
    assert len(sentences) == 1
    assert re.fullmatch(
        rf"[A-Z3][\w\- ()*]+ is written to {re.escape(files[-1])}( and .*)?\.|"
        rf".* is written to .*",
        sentences[0],
    )
    assert all(sentences[0].count(name) == 1 for name in files)


@pytest.mark.some(1, 3)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in ("singularities", "equilibria"))) for name in DRAWN]
)
def test_figures_are_written_as_wide_as_asked(here: Path, capsys, name: str):
    widths = {"120mm": 120 / 25.4, "11.5cm": 11.5 / 2.54, "4.5in": 4.5}
    for ending, (width, inches) in zip(FIGURES, widths.items(), strict=True):
        file = here / f"figure{ending}"
        assert run_command([*DRAWN[name], "-o", str(file), "--width", width, "--font", "serif"]) == 0
        assert width_of(file) == pytest.approx(inches, abs=0.02), (ending, width)
    assert capsys.readouterr().err == ""


def width_of(file: Path) -> float:
    """The width of a figure (inches): 150 dots an inch, or 72 points."""
    content = file.read_bytes()
    if file.suffix == ".png":
        return struct.unpack(">I", content[16:20])[0] / 150
    if file.suffix == ".pdf":
        return float(re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", content)[1]) / 72
    return float(Xml.fromstring(content).get("width").removesuffix("pt")) / 72


@pytest.mark.slow
def test_a_figure_has_the_font_that_is_asked_for(here: Path):
    for font, inside in (("serif", b"Serif"), ("DejaVu Sans Mono 11pt", b"SansMono")):
        file = here / "figure.pdf"
        assert run_command([*DRAWN["check"], "-o", str(file), "--font", font]) == 0
        assert re.search(rb"/BaseFont /\S*" + inside, file.read_bytes())


@pytest.mark.slow
def test_the_same_figure_twice_is_the_same_file(here: Path):
    for ending in FIGURES:
        assert (
            run_command([*DRAWN["check"], "-o", f"a{ending}"])
            == run_command([*DRAWN["check"], "-o", f"b{ending}"])
            == 0
        )
        assert (here / f"a{ending}").read_bytes() == (here / f"b{ending}").read_bytes()


def test_maps_show_the_robot_to_scale(here: Path):
    """The strokes of the robot in an SVG are where its joints are, on the scale of the axes."""
    from matplotlib.figure import Figure

    import hrsynth
    from hrsynth.present.maps import MapPlane

    found = hrsynth.check("rrrrr_m1", grid="x=0:0.02:2,y=0.2:0.22:2")
    start = found.setup.all_samples.start
    plane = MapPlane.of(found.grid.grid.axes, found.setup.motion, 0.3, 2.0)
    figure = Figure()
    place = figure.subplots()
    (entry,) = plane.robot(figure, start)
    (strokes,) = place.collections
    points = {
        (round(float(x), 6), round(float(y), 6)) for path in strokes.get_paths() for x, y in np.asarray(path.vertices)
    }
    mechanism = start.model.mechanism
    centres = {(round(float(p[0]), 6), round(float(p[1]), 6)) for p in (j.point for j in mechanism.joints.values())}
    assert points == centres
    assert entry.get_label() == "robot at its zero pose"
    assert not MapPlane.of(
        (("x", found.grid.grid.axes[0][1]), ("phi", found.grid.grid.axes[0][1])), found.setup.motion, 0.3, 2.0
    ).robot(figure, start)


def test_a_robot_without_strokes_is_not_in_the_legend(tmp_path: Path):
    """Of a body that nothing holds there is only its one joint."""
    from matplotlib.figure import Figure

    import hrsynth
    from hrsynth.present.maps import MapPlane

    file = tmp_path / "free.urdf"
    file.write_text("""<robot name="free"><link name="world"/><link name="body"/>
      <joint name="free" type="floating"><parent link="world"/><child link="body"/></joint></robot>""")
    setup = hrsynth.observe(
        hrsynth.load(file),
        camera="eye=body",
        sensor=[f"point:world@{at}" for at in ("0.3,0,1", "-0.15,0.25,1", "-0.15,-0.25,1")],
    )
    values = np.array([0.0, 1.0])
    plane = MapPlane.of((("x", values), ("y", values)), setup.motion, 0.3, 2.0)
    figure = Figure()
    place = figure.subplots()
    assert not plane.robot(figure, setup.all_samples.start)
    assert not place.collections


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--width", "88"], ["'88'", "88mm"]),
        (["--width", "1mm"], ["1in to 40in"]),
        (["--width", "nanmm"], ["nanmm"]),
        (["--width", "1e9mm"], ["1e9mm"]),
        (["--font", "Nonexistent"], ["Nonexistent", "serif"]),
        (["--font", "400pt"], ["400pt", "40pt"]),
        (["--width", "40mm", "--font", "12pt"], ["does not fit", "12pt", "mm"]),
    ],
)
def test_a_figure_that_cannot_be_is_refused(here: Path, capsys, arguments: list[str], words: list[str]):
    assert run_command([*DRAWN["check"], "-o", "map.png", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert all(word in line for word in words), line
    assert list(here.iterdir()) == []


def test_width_and_font_are_of_figures(here: Path, capsys):
    for more in ([], ["-o", "map.csv"]):
        assert run_command([*DRAWN["check"], *more, "--width", "88mm"]) == 2
        assert "--output with .png, .pdf, .svg" in capsys.readouterr().err
    assert list(here.iterdir()) == []


def parts(terminal: int) -> str:
    """What a closed terminal still has to say."""
    try:
        return os.read(terminal, 65536).decode(errors="replace")
    except OSError:
        return ""


@pytest.mark.slow
def test_a_long_silence_has_its_bar():
    """Work that tells nothing shows a bar after a second all the same, on a terminal; else nothing, but for a line
    now and then of what takes longer still."""
    code = (
        "import time\nfrom hrsynth.cli.progress import Progress\n"
        "with Progress(wait=0.2) as bar:\n    bar.tell('thinking')\n    time.sleep(1.5)\nprint('done')"
    )
    main, end = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=end, text=True, env={**os.environ, "TERM": "xterm"}
    )
    os.close(end)
    shown = "".join(iter(lambda: parts(main), ""))
    assert done.stdout == "done\n"
    assert "thinking" in shown
    assert re.search(r"step 1 \d:\d\d:\d\d", re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown))
    quiet = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (quiet.stdout, quiet.stderr) == ("done\n", "")
    code = "import hrsynth.cli.progress as progress\nprogress.PROGRESS_LINE_INTERVAL_S = 0.3\n" + code
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert told.stdout == "done\n"
    assert 1 <= len(told.stderr.splitlines()) <= 3
    assert all(re.fullmatch(r"hrsynth: thinking, step 1, \d s", line) for line in told.stderr.splitlines())


def test_short_work_has_no_bar(monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress(wait=0.5) as bar:
        bar.tell("nothing")
    time.sleep(0.7)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("text", ["x=1_0", "x=１", "x=0x1", "x=1e", "x=", "phi=1_0deg", "x=١"])
def test_only_plain_numbers_are_numbers(capsys, text: str):
    assert run_command(["check", "3rrr_m1", "--at", text]) == 2
    assert "is not a number" in capsys.readouterr().err


def test_an_output_that_takes_nothing_is_told_in_one_line():
    program = [sys.executable, "-m", "hrsynth", "robots"]
    if Path("/dev/full").exists():
        with open("/dev/full", "w") as full:
            done = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True)
        assert (done.returncode, done.stderr) == (
            2,
            "hrsynth: cannot write to standard output: No space left on device. Free space, or write elsewhere.\n",
        )
    closed = subprocess.run(["sh", "-c", 'exec "$@" >&-', "sh", *program], stderr=subprocess.PIPE, text=True)
    assert (closed.returncode, closed.stderr) == (0, "")
