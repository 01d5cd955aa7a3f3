"""The site: built strictly, without network, with a page for every notebook, folder and public name."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import hrsynth
from browser import Tab
from hrsynth.cli import run_command

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs"))
PAGES = sorted((ROOT / "docs" / "pages").rglob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_paths_on_pages_exist(page: Path):
    """Paths of the project in code style."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"`((?:src|docs|tests|notebooks|robots|catalog|studies)/[\w/.]*)`", text)
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_ten_numbers_have_their_commands():
    text = (ROOT / "docs" / "pages" / "how_sure.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^\| \d+\. .* \| `(?:make|python) [^|]*\|$", text, re.MULTILINE)) == 10
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert [name for name in re.findall(r"`make (\w+)", text) if f"\n{name}:" not in makefile] == []
    modules = re.findall(r"`python -m ([\w.]+)", text)
    assert [name for name in modules if not (ROOT / "tests" / f"{name.replace('.', '/')}.py").exists()] == []


def test_the_architecture_page_lists_every_folder():
    text = (ROOT / "docs" / "pages" / "architecture.md").read_text(encoding="utf-8")
    folders = {path.name for path in (ROOT / "src" / "hrsynth").iterdir() if (path / "__init__.py").exists()}
    assert {name for name in folders if f"`{name}/`" not in text} == set()


def test_every_figure_has_its_command_and_is_shown():
    import pictures

    kept = {path.name for path in (ROOT / "docs" / "pictures").iterdir()}
    assert kept == set(pictures.PICTURES)
    shown = "\n".join(page.read_text(encoding="utf-8") for page in (*PAGES, ROOT / "README.md"))
    assert [name for name in kept if f"pictures/{name}" not in shown] == []


EXAMPLES = sorted(
    {
        line
        for page in PAGES
        for line in re.findall(r"`hrsynth ([^`]*\bexample:[^`]*)`", page.read_text(encoding="utf-8"))
    }
)


@pytest.mark.slow
@pytest.mark.parametrize("line", EXAMPLES)
def test_commands_on_robots_of_example_robot_data_work(line: str, capsys):
    assert run_command(shlex.split(line)) == 0, capsys.readouterr().err


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site; notebooks without a stored executed copy have no outputs."""
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    run = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "HRSYNTH_DOCS_QUICK": "1", "NO_MKDOCS_2_WARNING": "1"},
    )
    assert run.returncode == 0, run.stderr
    return folder


@pytest.mark.slow
def test_the_site_is_built_strictly_and_needs_no_network(site: Path):
    built = {str(path.relative_to(site)): path.read_text(encoding="utf-8") for path in site.rglob("*.html")}
    fetched = r'<(?:script|img|iframe)[^>]+src="https?:|<link[^>]+rel="(?:stylesheet|preload)"[^>]+href="https?:'
    assert [name for name, text in built.items() if re.search(fetched, text)] == []
    for script in sorted((ROOT / "notebooks").glob("[0-9]*.py")):
        assert built[f"notebooks/{script.stem}.html"].count("<pre") > 5
    public = built["reference/index.html"]
    names = [name for name in hrsynth.__all__ if name not in ("__version__", "catalog")]
    assert [name for name in names if f"{name}</span>" not in public] == []


@pytest.mark.slow
def test_it_starts_with_the_moving_robot_and_three_doors_and_shows_every_figure_with_its_command(site: Path):
    start = (site / "index.html").read_text(encoding="utf-8")
    assert 'src="pictures/servo_quattro.gif"' in start
    assert re.findall(r"<h3[^>]*>(For \w+)", start) == ["For students", "For teachers", "For engineers"]
    gallery = (site / "gallery.html").read_text(encoding="utf-8")
    kept = [path.name for path in (ROOT / "docs" / "pictures").iterdir()]
    assert sorted(re.findall(r'<img[^>]*src="pictures/([^"]*)"', gallery)) == sorted(kept)
    assert gallery.count("<figcaption") == len(kept)


@pytest.mark.slow
def test_a_page_of_the_reference_begins_with_what_a_user_calls(site: Path):
    for folder, name in (("analysis", "derive"), ("simulation", "servo"), ("selection", "select")):
        page = (site / "reference" / f"{folder}.html").read_text(encoding="utf-8")
        assert page.index(f"hrsynth.{name}</code>") < page.index("<h2")
        assert f'href="index.html#hrsynth.{folder}' in page


@pytest.mark.slow
def test_formulas_are_set_and_code_is_left_alone(site: Path):
    import hooks

    set_ = hooks.typeset("a $x_1^2$ b `$x$`\n\n$$\n\\frac{a}{b}\n$$\n\n```\n$ hrsynth\n```\n$HOME and 3 $ or 4 $")
    assert set_.count("<svg") == set_.count("</svg>") == 2
    assert "<style" not in set_
    assert 'aria-label="x_1^2"' in set_
    assert all(each in set_ for each in ("`$x$`", "$ hrsynth", "$HOME and 3 $ or 4 $"))
    left = [
        name
        for name in site.rglob("*.html")
        if re.search(
            r"\$\$|\$\\", re.sub(r"<(pre|code|script).*?</\1>", "", name.read_text(encoding="utf-8"), flags=re.DOTALL)
        )
    ]
    assert left == []


@pytest.mark.browser
def test_search_works_from_disk(site: Path, tab: Tab):
    for page in ("index.html", "notebooks/1_the_idea.html"):
        tab.open(site / page)
        tab.page.locator(".md-search__input").click()
        tab.page.keyboard.type("singular", delay=20)
        tab.page.wait_for_function("document.querySelectorAll('.md-search-result__item').length >= 5")
        assert "singular" in tab.page.locator(".md-search-result__item").first.inner_text().lower()


@pytest.mark.browser
def test_tables_fit_their_pages(site: Path, tab: Tab):
    wide = """[...document.querySelectorAll('.md-content table')].some(each => each.getBoundingClientRect().width
        > each.closest('.md-content__inner').getBoundingClientRect().width + 1)"""
    for page in sorted({*site.glob("*.html")} - {site / "404.html"}):
        tab.open(page)
        tab.page.wait_for_load_state("networkidle")
        assert not tab.page.evaluate(wide), page.name
