"""Rules of writing, counted: ``words.toml`` has what is still allowed, and its numbers only fall.

``python tests/test_words.py`` lowers the numbers; ``python tests/test_words.py FOLDER [RULE]`` lists what breaks a rule
in a folder of the package. Pages, README and help break none.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import hrsynth

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, PAGES = ROOT / "src" / "hrsynth", ROOT / "docs" / "pages"
ALLOWED = Path(__file__).with_name("words.toml")
WORDS = tomllib.loads(ALLOWED.read_text(encoding="utf-8"))
RETIRED = re.compile(rf"(?<![\w-])(?:{'|'.join(WORDS['retired'])})(?![\w-])", re.IGNORECASE)
VERBS = frozenset(" ".join(WORDS["verbs"]).split())
VAGUE = frozenset({"found", "each", "own", "told", "there", "one", "other"})
QUANTITY = re.compile(r"_(TOL|MAX|MIN|FRACTION|COUNT|M|RAD|S|BYTES)$")
CLAUSE = re.compile(r"(What|Where|Whether|How|Which|Those|That|Of|The same)\b")
TRUTH = ("is_", "has_", "can_", "may_")
GENERATED = {"claims.md", "closures.md", "costs.md", "lint_rules.md", "renames.md"}
HOW_TO = [
    "add",
    "analyze",
    "check",
    "choose",
    "compute",
    "control",
    "export",
    "find",
    "install",
    "plan",
    "poses",
    "prove",
    "read",
    "repair",
    "simulate",
    "track",
    "use",
]
PARAGRAPH, SENTENCE, TASK = 90, 25, 600
SINCE = "2026-11-29T17:25:00Z"
"""Commits from then on keep the rule."""

Breach = tuple[str, str, int, str]
"""Rule, folder, line, what breaks it, with its file."""


def prose_of(text: str) -> Iterator[tuple[int, str]]:
    """Yield texts, docstrings and comments of a module with their lines, without what is quoted as code."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.STRING, tokenize.COMMENT):
            words = re.sub(r"``[^`]*``|`[^`]*`|\{[^}]*\}|>>>.*", " ", token.string)
            if " " in words.strip():
                yield token.start[0], words


def is_truth(node: ast.FunctionDef) -> bool:
    """Return True if a function is annotated to return a bool."""
    return node.returns is not None and ast.unparse(node.returns) == "bool"


def breaches(path: Path) -> Iterator[tuple[str, int, str]]:
    """Yield rule, line and name of what breaks a rule in a module."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    top = {id(node) for node in tree.body}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
            doc = ast.get_docstring(node) or ""
            if CLAUSE.match(doc) or doc.startswith(("Whether", "How many")):
                yield "clause", getattr(node, "lineno", 1), doc.partition("\n")[0]
        if isinstance(node, ast.FunctionDef):
            name = node.name.strip("_")
            if is_truth(node) and not name.startswith(TRUTH) and not node.name.startswith("__"):
                yield "truth", node.lineno, node.name
            elif id(node) in top and not is_truth(node) and name.partition("_")[0] not in VERBS:
                yield "verb", node.lineno, node.name
        if isinstance(node, ast.ClassDef) and re.search(r"(?:[^e]ed|ing)$", node.name):
            yield "noun", node.lineno, node.name
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in VAGUE:
            yield "vague", node.lineno, node.id
    for node in tree.body:
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        value: Any = getattr(node, "value", None)
        number = isinstance(value, ast.Constant) and isinstance(value.value, int | float)
        for target in targets:
            if number and isinstance(target, ast.Name) and target.id.isupper() and not QUANTITY.search(target.id):
                yield "quantity", node.lineno, target.id
    for line, words in prose_of(text):
        for found in RETIRED.finditer(words):
            yield "retired", line, found[0]
        if re.search(r", (?:found|allowed:)", words):
            yield "message", line, words.strip()[:80]


@cache
def every_breach() -> list[Breach]:
    """Return all breaches in the package."""
    listed: list[Breach] = []
    stems: dict[str, list[Path]] = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        folder = parts[0] if len(parts) > 1 else "top"
        listed += [(rule, folder, line, f"{Path(*parts)}: {what}") for rule, line, what in breaches(path)]
        if path.stem not in ("__init__", "__main__"):
            stems[path.stem].append(path)
    for stem, paths in stems.items():
        for path in paths[1:]:
            parts = path.relative_to(PACKAGE).parts
            listed.append(("module", parts[0] if len(parts) > 1 else "top", 1, f"{Path(*parts)}: {stem}"))
    return listed


def counts() -> dict[str, Counter[str]]:
    """Return the number of breaches by rule and folder."""
    numbers: dict[str, Counter[str]] = defaultdict(Counter)
    for rule, folder, _, _ in every_breach():
        numbers[rule][folder] += 1
    return numbers


def test_no_folder_breaks_a_rule_more_often_than_allowed():
    allowed = WORDS.get("allowed", {})
    over = [
        f"{rule} in {folder}: {number}, allowed {allowed.get(rule, {}).get(folder, 0)}"
        for rule, folders in counts().items()
        for folder, number in folders.items()
        if number > allowed.get(rule, {}).get(folder, 0)
    ]
    assert not over, "python tests/test_words.py FOLDER RULE lists them:\n" + "\n".join(over)


def plain_text(page: str) -> str:
    """Return a page without code, tables, headings, pictures, formulas and marks of the generator."""
    page = re.sub(r"<!-- generated.*?<!-- end -->|<!--.*?-->|^```.*?^```", "", page, flags=re.DOTALL | re.MULTILINE)
    page = re.sub(r"\$\$.*?\$\$|\$[^$\n]+\$", "x", page, flags=re.DOTALL)
    page = re.sub(r"!\[[^\]]*\]\([^)]*\)|<[^>]+>", "", page)
    page = re.sub(r"\]\([^)]*\)", "]", page)
    page = re.sub(r"^(?:\||#).*$", "", page, flags=re.MULTILINE)
    return re.sub(r"`[^`]*`", "code", page)


WRITTEN = sorted({*PAGES.rglob("*.md")} - {PAGES / name for name in GENERATED}) + [ROOT / "README.md"]


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_pages_have_short_paragraphs_and_sentences(path: Path):
    text = plain_text(path.read_text(encoding="utf-8"))
    paragraphs = [each for each in re.split(r"\n\s*\n|\n\s*(?=[-*] |\d+\. )", text) if each.strip()]
    assert [each[:60] for each in paragraphs if len(each.split()) > PARAGRAPH] == []
    sentences = [each for part in paragraphs for each in re.split(r"(?<=[.!?:;])\s", " ".join(part.split()))]
    assert [each for each in sentences if len(re.findall(r"[A-Za-z]\S*", each)) > SENTENCE] == []


@pytest.mark.parametrize(
    "path", [*WRITTEN, *(PAGES / name for name in sorted(GENERATED - {"renames.md"}))], ids=lambda path: path.name
)
def test_pages_use_the_words_of_the_glossary(path: Path):
    text = path.read_text(encoding="utf-8")
    text = re.sub(
        r"^```.*?^```|<!--.*?-->|`[^`]*`|\]\([^)]*\)|\([^)]*\.svg\)", " ", text, flags=re.DOTALL | re.MULTILINE
    )
    assert Counter(word.lower() for word in RETIRED.findall(text)) == {}


@pytest.mark.parametrize(
    "path", [path for path in WRITTEN if path.stem.partition("_")[0] in HOW_TO], ids=lambda path: path.name
)
def test_a_how_to_page_is_one_task_of_at_most_600_words(path: Path):
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"<!-- generated.*?<!-- end -->", "", text, flags=re.DOTALL)
    assert len(text.split()) <= TASK


def test_constants_that_docstrings_name_are_there():
    """A renamed constant takes its mentions along."""
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    known = {name for text in texts.values() for name in re.findall(r"(?<!`)\b[A-Z]\w*\b(?!`)", text)}
    named = [
        f"{path.relative_to(PACKAGE)}: {name}"
        for path, text in texts.items()
        for name in re.findall(r"``(?:\w+\.)*([A-Z][A-Z0-9]*_[A-Z0-9_]+)``", text)
        if name not in known
    ]
    assert named == []


PUBLIC = [name for name in hrsynth.__all__ if callable(getattr(hrsynth, name)) and not name.startswith("_")]


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_function_documents_what_it_takes_and_returns(name: str):
    function = getattr(hrsynth, name)
    doc = inspect.getdoc(function) or ""
    parts = dict(re.findall(r"^(\w+)\n-{3,}\n(.*?)(?=^\w+\n-{3,}\n|\Z)", doc, re.MULTILINE | re.DOTALL))
    section = parts.get("Parameters", "")
    headings = " ".join(re.findall(r"^\S.*$", section, re.MULTILINE))
    documented = set(re.findall(r"\w+", headings)) | set(re.findall(r"``(\w+)``", section))
    taken = {each for each in inspect.signature(function).parameters if each != "options"}
    assert taken - documented == set()
    assert "Returns" in parts or "Yields" in parts or inspect.signature(function).return_annotation in (None, "None")
    assert not CLAUSE.match(doc)


def test_subjects_of_commits_name_an_area_and_what_is_done():
    log = ["git", "log", "--no-merges", "--since", SINCE, "--format=%s"]
    done = subprocess.run(log, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("no history here")
    subjects = done.stdout.splitlines()
    assert [each for each in subjects if len(each) > 60 or not re.match(r"[a-z_., ]+: \w", each)] == []


def lower() -> None:
    """Write the numbers of today, where they are lower than those allowed."""
    numbers, allowed = counts(), WORDS.get("allowed", {})
    text = (
        ALLOWED.read_text(encoding="utf-8").partition("\n# allowed")[0].rstrip("\n")
        + "\n\n# allowed: rule, folder, number\n"
    )
    for rule in sorted(numbers):
        text += f"\n[allowed.{rule}]  # {sum(numbers[rule].values())}\n"
        for folder, number in sorted(numbers[rule].items()):
            text += f"{folder} = {min(number, allowed.get(rule, {}).get(folder, number))}\n"
    ALLOWED.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:]:
        for rule, folder, line, what in every_breach():
            if folder == sys.argv[1] and (len(sys.argv) < 3 or rule == sys.argv[2]):
                name, _, rest = what.partition(": ")
                print(f"{name}:{line}: {rule}: {rest}")
    else:
        lower()
