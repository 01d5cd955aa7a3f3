"""Notebooks and their paired scripts: a script is the source, its notebook has no outputs.

``python docs/lessons.py`` writes each ``notebooks/*.ipynb`` from the ``.py`` of its name. An executed copy is kept in
``build/notebooks`` until the script or the package changes.
"""

from __future__ import annotations

import hashlib
import os
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "notebooks"
EXECUTED = ROOT / "build" / "notebooks"
TIMEOUT = 300
"""Longest time (s) of a cell, or of the start of the kernel."""
KERNEL = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}


def scripts() -> list[Path]:
    """Return the scripts in order."""
    return sorted(FOLDER.glob("[0-9]*.py"), key=lambda path: int(path.stem.split("_")[0]))


def notebook(script: Path) -> Any:
    """Return the notebook of a script: cells numbered, no outputs."""
    import jupytext

    made = jupytext.reads(script.read_text(encoding="utf-8"), fmt="py:percent")
    made.metadata = {
        "jupytext": {"formats": "ipynb,py:percent"},
        "kernelspec": dict(KERNEL),
        "language_info": {"name": "python"},
    }
    made.nbformat, made.nbformat_minor = 4, 5
    for number, cell in enumerate(made.cells, 1):
        cell["id"] = f"cell-{number:02d}"
    return made


def text(script: Path) -> str:
    """Return the content of the paired file ``.ipynb``."""
    import nbformat

    return nbformat.writes(notebook(script)) + "\n"


def pair() -> list[Path]:
    """Write every notebook from its script; return those that changed."""
    changed = []
    for script in scripts():
        file, wanted = script.with_suffix(".ipynb"), text(script)
        if not file.exists() or file.read_text(encoding="utf-8") != wanted:
            file.write_text(wanted, encoding="utf-8")
            changed.append(file)
    return changed


def kept(script: Path, folder: Path = EXECUTED) -> Path:
    """Return the path of the executed copy; it changes with the script and the package."""
    return folder / f"{script.stem}.{_state(script)}.ipynb"


def executed(script: Path, folder: Path = EXECUTED) -> Any:
    """Return the notebook with its outputs: the stored copy, or run now.

    Raises ``nbclient.exceptions.CellExecutionError`` if a cell fails.
    """
    import nbformat
    from nbclient import NotebookClient

    file = kept(script, folder)
    if file.exists():
        return nbformat.read(file, as_version=4)
    made = notebook(script)
    folder.mkdir(parents=True, exist_ok=True)
    NotebookClient(
        made,
        timeout=TIMEOUT,
        startup_timeout=TIMEOUT,
        coalesce_streams=True,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    ).execute(env={**os.environ, "HRSYNTH_PROGRESS": "0"})
    for old in folder.glob(f"{script.stem}.*.ipynb"):
        old.unlink(missing_ok=True)
    fresh = file.with_suffix(f".{os.getpid()}")
    nbformat.write(made, fresh)
    fresh.replace(file)
    return made


def _state(script: Path) -> str:
    return hashlib.sha256(script.read_bytes() + _package()).hexdigest()[:12]


@cache
def _package() -> bytes:
    """Return the hash of the package and its robots, on which outputs depend besides the script."""
    found = hashlib.sha256()
    for pattern in ("src/hrsynth/**/*.py", "robots/*.urdf"):
        for path in sorted(ROOT.glob(pattern)):
            found.update(path.read_bytes())
    return found.digest()


if __name__ == "__main__":
    for path in pair():
        print(path.relative_to(ROOT))
