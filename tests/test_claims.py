"""No word of certainty without its reason: each text that holds one is in the table of claims, and it has a test."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from hrsynth.cli.schema import build_schema, list_json_commands
from hrsynth.index import list_analyses
from tables import claims
from tables.claims import CERTAIN, CLAIMS, NO_CLAIMS

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "hrsynth"


@cache
def texts() -> tuple[tuple[str, str], ...]:
    """Where each text of the code with a word of certainty stands, and the text: all strings but docstrings, and what
    templates and scripts of pages show."""
    found = []
    for file in sorted(PACKAGE.rglob("*.py")):
        found += [(f"{file.relative_to(ROOT)}:{line}", text) for line, text in strings(file.read_text("utf-8"))]
    found += [(f"hrsynth {name} -h", each["help"]) for name, each in list_analyses().items()]
    found += [
        (f"hrsynth schema {name}", words) for name in list_json_commands() for words in descriptions(build_schema(name))
    ]
    for ending in ("html", "j2", "js"):
        for file in sorted(PACKAGE.rglob(f"*.{ending}")):
            if not file.name.endswith(".min.js"):  # a library of others
                found += [
                    (f"{file.relative_to(ROOT)}:{number}", line)
                    for number, line in enumerate(visible(file.read_text("utf-8")).splitlines(), 1)
                ]
    return tuple((where, text) for where, text in found if CERTAIN.search(text))


def descriptions(part: Any) -> Iterator[str]:
    """What a schema says of its fields."""
    for each in part.get("properties", {}).values():
        yield from [each["description"]] if "description" in each else []
    for each in part.get("$defs", {}).values():
        yield from descriptions(each)


def strings(source: str) -> Iterator[tuple[int, str]]:
    """The strings of a module that are no docstrings."""
    alone = set[int]()
    for node in ast.walk(ast.parse(source)):  # what holds a node comes before it
        if isinstance(node, ast.Expr):
            alone.add(id(node.value))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in alone:
            yield node.lineno, node.value


def visible(page: str) -> str:
    """A template without comments and styles, of its expressions and tags the texts alone, as many lines as before."""

    def blank(match: re.Match[str]) -> str:
        return "\n" * match[0].count("\n")

    page = re.sub(r"/\*.*?\*/|<!--.*?-->|\{#.*?#\}|<style.*?</style>", blank, page, flags=re.DOTALL)
    page = re.sub(r"\{\{.*?\}\}|\{%.*?%\}", lambda match: " ".join(re.findall(r'"[^"]*"', match[0])), page)
    page = re.sub(r"^\s*//.*$", "", page, flags=re.MULTILINE)
    return re.sub(r"print-color-adjust: exact|\blegs\.complete\b|\brow\.exact\b|\brow\.proved\b", "", page)


def patterns() -> dict[str, tuple[str, ...]]:
    return {claim.phrase: claim.texts for claim in CLAIMS} | {each.why: each.texts for each in NO_CLAIMS}


def test_every_word_of_certainty_is_in_the_table():
    known = re.compile("|".join(f"(?:{text})" for group in patterns().values() for text in group), re.IGNORECASE)
    loose = [f"{where}: {text!r}" for where, text in texts() if not known.search(text)]
    assert not loose, "not in docs/tables/claims.toml:\n" + "\n".join(loose)


@pytest.mark.parametrize("phrase", patterns())
def test_no_row_is_stale(phrase: str):
    shown = [text for _, text in texts()]
    stale = [each for each in patterns()[phrase] if not any(re.search(each, text, re.IGNORECASE) for text in shown)]
    assert stale == []


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.phrase)
def test_a_claim_is_complete_and_has_its_test(claim: claims.Claim):
    assert all((claim.phrase, claim.command, claim.means, claim.computation, claim.assumes, claim.texts))
    file, _, name = claim.test.partition("::")
    tree = ast.parse((ROOT / file).read_text("utf-8"))
    assert name in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}, claim.test


def test_the_page_is_fresh():
    assert (ROOT / "docs" / "pages" / "claims.md").read_text("utf-8") == claims.page(), "stale: make readme"
