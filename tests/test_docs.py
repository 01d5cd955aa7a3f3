"""The site: it is built strictly, needs no network, and has a page for every notebook, folder and public name."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hrsynth

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted((ROOT / "docs" / "pages").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_what_a_page_names_is_there(page: Path):
    """Paths of the project in code style."""
    named = re.findall(r"`((?:src|docs|tests|notebooks|robots|catalog)/[\w/.]*)`", page.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_architecture_page_tells_of_every_folder():
    text = (ROOT / "docs" / "pages" / "architecture.md").read_text(encoding="utf-8")
    folders = {path.name for path in (ROOT / "src" / "hrsynth").iterdir() if (path / "__init__.py").exists()}
    assert {name for name in folders if f"`{name}/`" not in text} == set()


def test_every_picture_has_its_command_and_is_shown():
    sys.path.insert(0, str(ROOT / "docs"))
    import pictures

    kept = {path.name for path in (ROOT / "docs" / "pictures").iterdir()}
    assert kept == set(pictures.PICTURES)
    shown = "\n".join(page.read_text(encoding="utf-8") for page in (*PAGES, ROOT / "README.md"))
    assert [name for name in kept if f"pictures/{name}" not in shown] == []


@pytest.mark.slow
def test_the_site_is_built_strictly_and_needs_no_network(tmp_path: Path):
    pytest.importorskip("mkdocs")
    run = subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)], cwd=ROOT,
                         capture_output=True, text=True, check=False,
                         env={**os.environ, "HRSYNTH_DOCS_QUICK": "1", "NO_MKDOCS_2_WARNING": "1"})
    assert run.returncode == 0, run.stderr
    built = {str(path.relative_to(tmp_path)): path.read_text(encoding="utf-8") for path in tmp_path.rglob("*.html")}
    fetched = r'<(?:script|img|iframe)[^>]+src="https?:|<link[^>]+rel="(?:stylesheet|preload)"[^>]+href="https?:'
    assert [name for name, text in built.items() if re.search(fetched, text)] == []
    for script in sorted((ROOT / "notebooks").glob("[0-9]*.py")):
        assert built[f"notebooks/{script.stem}.html"].count("<pre") > 5
    public = built["reference/index.html"]
    names = [name for name in hrsynth.__all__ if name not in ("__version__", "catalog")]
    assert [name for name in names if f"{name}</span>" not in public] == []
