"""The notebooks: each runs, matches its script, contains no outputs, and has solutions of its exercises."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import runpy
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = sorted((ROOT / "notebooks").glob("[0-9]*.py"), key=lambda path: int(path.stem.split("_")[0]))
FIRST = SCRIPTS[0]


def lessons() -> ModuleType:
    spec = importlib.util.spec_from_file_location("lessons", ROOT / "docs" / "lessons.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def cells(script: Path) -> list[str]:
    """Return the cells of a script, each with its head line."""
    return re.split(r"^(?=# %%)", script.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]


def test_every_notebook_has_its_script():
    assert {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")} == {path.stem for path in SCRIPTS}
    assert [path.name.split("_")[0] for path in SCRIPTS] == [str(number) for number in range(1, len(SCRIPTS) + 1)]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_notebook_contains_no_outputs(script: Path):
    for cell in json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_notebook_matches_its_script(script: Path):
    pytest.importorskip("jupytext")
    assert script.with_suffix(".ipynb").read_text(encoding="utf-8") == lessons().text(script), "make notebooks"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_every_exercise_has_its_solution(script: Path):
    prose = "".join(cell for cell in cells(script) if cell.startswith("# %% [markdown]"))
    exercises = re.findall(r"^# (\d)\. ", prose.split("# ## Exercises")[1].split("# ## Solutions")[0], re.MULTILINE)
    solutions = [cell for cell in cells(script) if 'tags=["solution"]' in cell.splitlines()[0]]
    answered = [re.search(r"^# (\d)\. ", cell, re.MULTILINE)[1] for cell in solutions]
    assert exercises == answered == ["1", "2", "3"]
    assert all("source_hidden" in cell.splitlines()[0] for cell in solutions)


@pytest.mark.slow
def test_the_first_notebook_runs_as_a_script(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """As plain Python, for which no Jupyter is needed."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names = runpy.run_path(str(FIRST))
    assert re.search(r"^outcome: .*mode 2,", capsys.readouterr().out, re.MULTILINE)
    assert len(names["found"].modes) == 2
    assert names["hidden"].equivalence.passed


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_notebook_runs(script: Path, monkeypatch: pytest.MonkeyPatch):
    """In Jupyter's kernel; the executed copy is stored for the site."""
    pytest.importorskip("nbclient")
    for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.setitem(os.environ, library, "1")
    run = lessons().executed(script)
    code = [cell for cell in run.cells if cell.cell_type == "code"]
    assert all(output.output_type != "error" for cell in code for output in cell.outputs)
    assert sum(bool(cell.outputs) for cell in code) > len(code) / 2
