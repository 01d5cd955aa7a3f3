"""The README: its table of robots is what the program says today, and its example runs."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest

from hrsynth.catalog import readme as catalog
from hrsynth.cli import execute
from hrsynth.description import shipped
from hrsynth.families.replays import REPLAYS, SIMULATED
from hrsynth.present import readme, replays

README = Path(__file__).resolve().parent.parent / "README.md"
TEXT = README.read_text(encoding="utf-8")
PAPERS = (README.parent / "docs" / "pages" / "papers.md").read_text(encoding="utf-8")


def lines() -> dict[str, str]:
    rows = readme.block(TEXT).splitlines()[2:]
    return {re.match(r"\| `(\w+)` \|", row)[1]: row for row in rows}


def test_the_table_has_every_shipped_robot_in_order():
    assert list(lines()) == list(shipped())


@pytest.mark.parametrize("name", ["3prp", "3ppr_m1", "prrrp_parallel", "delta", "3upu"])
def test_some_rows_are_fresh(name: str):
    assert lines()[name] == readme.row(name), "the README is stale: make readme"


@pytest.mark.slow
def test_the_table_is_fresh():
    assert readme.block(TEXT) == readme.table(), "the README is stale: make readme"


@pytest.mark.parametrize("replay", [SIMULATED[0], SIMULATED[5]], ids=lambda each: each.source)
def test_some_replays_are_fresh(replay):
    assert replays.row(replay) in readme.block(PAPERS, replays.START).splitlines(), "the README is stale: make readme"


def test_the_table_has_every_replay():
    assert len(readme.block(PAPERS, replays.START).splitlines()) == 2 + len(REPLAYS)


@pytest.mark.long
def test_the_replays_are_fresh():
    pytest.importorskip("mujoco")
    assert readme.block(PAPERS, replays.START) == replays.table(), "the README is stale: make readme"


def test_the_table_of_the_catalog_is_fresh():
    assert readme.block(TEXT, catalog.START) == catalog.table(), "the README is stale: make readme"


def test_the_text_outside_the_marks_is_kept():
    assert readme.replaced(TEXT, readme.block(TEXT)) == TEXT
    other = readme.replaced(TEXT, "none at all\n")
    assert readme.block(other) == "none at all\n"
    assert readme.replaced(other, readme.block(TEXT)) == TEXT
    with pytest.raises(ValueError, match="generated: robots"):
        readme.replaced("# without marks\n", "nothing\n")


def test_the_python_example_runs_and_prints_what_it_says():
    code = re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)[1]
    said = re.findall(r"# → (.*)", code)
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(compile(code, str(README), "exec"), {})
    assert output.getvalue().splitlines() == said


@pytest.mark.parametrize("command", re.findall(r"\$ hrsynth (\w.*)", TEXT))
def test_the_commands_print_what_the_readme_shows(command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path,
                                                  monkeypatch: pytest.MonkeyPatch):
    """Line by line, decimal numbers and widths left out of it; the README may leave lines out."""
    if command.startswith("view "):
        pytest.importorskip("meshcat")
    monkeypatch.chdir(tmp_path)
    assert execute(shlex.split(command)) == 0
    printed = {_plain(line) for line in capsys.readouterr().out.splitlines()}
    shown = re.search(re.escape(f"$ hrsynth {command}\n") + r"(.*?)\n(?:```|\n?\$ )", TEXT, re.DOTALL)[1]
    missing = [line for line in shown.splitlines() if line.strip() not in ("", "…") and _plain(line) not in printed]
    assert not missing


def _plain(line: str) -> str:
    line = re.sub(r"-?\d+\.\d+(e[-+]\d+)?|\(\d+ discarded\)", "#", line)
    return re.sub(r"-{3,}", "---", re.sub(r" +", " ", line)).rstrip()
