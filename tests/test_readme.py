"""The README and the pages: generated tables are up to date, commands print the shown lines with their numbers."""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from hrsynth.cli import run_command
from hrsynth.description import list_robots
from tables import catalog, closures, observation_kinds, replays, robots
from tables.markdown import block, line, replace_between
from tables.printed_runs import REPLAYS, SIMULATED

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "pages"
README, ROBOTS, PAPERS, CATALOG = (
    file.read_text(encoding="utf-8")
    for file in (
        ROOT / "README.md",
        ROOT / "robots" / "README.md",
        PAGES / "papers.md",
        PAGES / "find_an_architecture.md",
    )
)
LONGEST = 8_000
"""Bytes of the README at most."""
SHOWN = "\n".join(file.read_text(encoding="utf-8") for file in (ROOT / "README.md", *sorted(PAGES.glob("*.md"))))
NUMBER = r"-?\d+\.?\d*(?:e[-+]\d+)?"
ROUNDING, CLEAR = 1e-8, 1e6
"""Numbers with an exponent that differ between machines: rounding errors below, clear rank gaps above."""


def lines() -> dict[str, str]:
    rows = block(ROBOTS, robots.START).splitlines()[2:]
    return {re.match(r"\| `(\w+)` \|", row)[1]: row for row in rows}


def test_the_table_has_every_shipped_robot_in_order():
    assert list(lines()) == list(list_robots())
    assert block(ROBOTS, robots.START).splitlines()[:2] == robots.table([]).splitlines()


@pytest.mark.some(1, 7)
@pytest.mark.parametrize("name", sorted(list_robots(), key="3prp".__ne__))
def test_the_row_of_a_robot_is_fresh(name: str):
    assert lines()[name] == line(robots.row(name)), "the page is stale: make readme"


@pytest.mark.some(1)
@pytest.mark.parametrize("replay", [SIMULATED[5], SIMULATED[0]], ids=lambda each: each.source)
def test_some_replays_are_fresh(replay):
    assert line(replays.row(replay)) in block(PAPERS, replays.START).splitlines(), "the page is stale: make readme"


def test_the_table_has_every_replay():
    assert len(block(PAPERS, replays.START).splitlines()) == 2 + len(REPLAYS)


@pytest.mark.long
def test_the_replays_are_fresh():
    pytest.importorskip("mujoco")
    assert block(PAPERS, replays.START) == replays.table(), "the page is stale: make readme"


def test_the_table_of_kinds_is_fresh():
    page = (PAGES / "observations.md").read_text(encoding="utf-8")
    assert block(page, observation_kinds.START) == observation_kinds.table(), "the page is stale: make readme"


def test_the_tables_of_closures_are_fresh():
    page = (PAGES / "closures.md").read_text(encoding="utf-8")
    for start, made in ((closures.START, closures.table()), (closures.WRITTEN_START, closures.written_table())):
        assert block(page, start) == made, "the page is stale: make readme"


@pytest.mark.slow
def test_the_table_of_the_catalog_is_fresh():
    assert block(CATALOG, catalog.START) == catalog.table(), "the page is stale: make readme"


def test_the_text_outside_the_marks_is_kept():
    assert replace_between(ROBOTS, block(ROBOTS, robots.START), robots.START) == ROBOTS
    other = replace_between(ROBOTS, "none at all\n", robots.START)
    assert block(other, robots.START) == "none at all\n"
    assert replace_between(other, block(ROBOTS, robots.START), robots.START) == ROBOTS
    with pytest.raises(ValueError, match="generated: robots"):
        replace_between("# without marks\n", "nothing\n", robots.START)


def test_the_readme_is_short():
    assert len(README.encode()) <= LONGEST


def test_the_python_example_runs_and_prints_the_shown_lines():
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]
    shown = re.findall(r"# → (.*)", code)
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(compile(code, "README.md", "exec"), {})
    assert output.getvalue().splitlines() == shown


@pytest.mark.slow
def test_the_programs_of_the_pages_have_the_types_that_they_use(tmp_path: Path):
    """What a type checker of a reader's editor finds in them: nothing is of type None or lacks what is asked of it."""
    files = dict[str, str]()
    for page in (ROOT / "README.md", *sorted(PAGES.rglob("*.md"))):
        code = "\n".join(re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE))
        if code and "from ." not in code:  # a program, not a part of the package
            files[f"page_{page.stem.lower()}"] = code
    assert len(files) > 10
    for name, code in files.items():
        (tmp_path / f"{name}.py").write_text(code)
    (tmp_path / "mypy.ini").write_text(
        "[mypy]\ncheck_untyped_defs = True\nfollow_imports = silent\nignore_missing_imports = True\n"
    )
    paths = [str(tmp_path / f"{name}.py") for name in files]
    told = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", str(tmp_path / "mypy.ini"), *paths],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stdout


@pytest.mark.parametrize("page", ["use_pinocchio.md", "poses_by_joints.md"])
def test_the_program_of_a_page_runs_and_prints_the_shown_lines(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    code = "\n".join(re.findall(r"```python\n(.*?)```", (PAGES / page).read_text("utf-8"), re.DOTALL))
    shown = re.findall(r"# → (.*)", code)
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(compile(code, page, "exec"), {})
    assert all(itertools.starmap(_alike, zip(shown, output.getvalue().splitlines(), strict=True)))


@pytest.mark.slow
def test_the_tutorial_of_an_own_file_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    page = (PAGES / "own_file.md").read_text(encoding="utf-8")
    Path("arm.urdf").write_text(re.search(r"```xml\n(.*?)```", page, re.DOTALL)[1], encoding="utf-8")
    commands = re.findall(r"^hrsynth (.*)", page, re.MULTILINE)
    assert len(commands) > 8
    assert [command for command in commands if run_command(shlex.split(command))] == []


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(each, marks=[pytest.mark.long] * each.startswith("basins"))
        for each in dict.fromkeys(re.findall(r"\$ hrsynth (\w.*)", SHOWN))
    ],
)
def test_the_commands_print_what_is_shown(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Line by line, with its numbers; a page can omit lines."""
    monkeypatch.chdir(tmp_path)
    assert run_command(shlex.split(command)) == 0
    printed = capsys.readouterr().out
    for shown in re.findall(re.escape(f"$ hrsynth {command}\n") + r"(.*?)\n(?:```|\n?\$ )", SHOWN, re.DOTALL):
        assert _list_missing(shown, printed) == []


@pytest.mark.slow
@pytest.mark.parametrize("page", sorted((PAGES / "machines").glob("*.md")), ids=lambda page: page.stem)
def test_the_page_of_a_machine_runs_as_it_is_shown(
    page: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Its program and its commands in order, in one folder; a shown error is the exit status 3."""
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(code, page.name, "exec"), {})
    runs = re.findall(r"^\$ hrsynth (.*)\n((?:(?!\$ |```).*\n)+)", text, re.MULTILINE)
    assert len(runs) == text.count("$ hrsynth ") > 5
    for command, shown in runs:
        assert run_command(shlex.split(command)) == (3 if shown.startswith("hrsynth: ") else 0), command
        assert _list_missing(shown, "".join(capsys.readouterr())) == [], command


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("at 0.0698 m", "at 0.0698 m", True),
        ("at 0.0698 m", "at 0.0697 m", True),
        ("at 0.0698 m", "at 0.0688 m", False),
        ("to 3.5e-13", "to 1.2e-14", True),
        ("to 3.5e-13", "to 3.5e-05", False),
        ("gap 7.5e+11", "gap 2.1e+12", True),
        ("gap 7.5e+11", "gap 7.5e+02", False),
        ("3 legs", "4 legs", False),
        ("x  3", "x 3", True),
        ("x 3", "y 3", False),
    ],
)
def test_lines_are_compared_with_their_numbers(shown: str, printed: str, same: bool):
    assert _alike(shown, printed) is same


def _list_missing(shown: str, printed: str) -> list[str]:
    """Return the shown lines that are not printed."""
    lines = [line for line in shown.splitlines() if line.strip() not in ("", "…")]
    return [line for line in lines if not any(_alike(line, other) for other in printed.splitlines())]


def _alike(shown: str, printed: str) -> bool:
    """Return True if words and numbers agree: to one unit in the last shown digit, spaces and rules of any length."""
    if _words(shown) != _words(printed):
        return False
    return all(_near(a, b) for a, b in zip(re.findall(NUMBER, shown), re.findall(NUMBER, printed), strict=True))


def _words(line: str) -> str:
    return re.sub(r"-{3,}", "---", re.sub(r" +", " ", re.sub(NUMBER, "#", line))).rstrip()


def _near(shown: str, printed: str) -> bool:
    a, b = float(shown), float(printed)
    if "e" in shown and (max(abs(a), abs(b)) < ROUNDING or min(a, b) > CLEAR):
        return True
    digits, _, power = shown.partition("e")
    unit = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
    return shown == printed or ("." in shown and abs(a - b) <= 1.01 * unit)
