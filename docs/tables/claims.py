"""Words of certainty that the program prints: meaning, computation, assumptions, and the test that would fail if the
claim were false.

A test (``tests/test_claims.py``) goes through all texts in
the code and all templates of pages: one that holds a word of certainty (:data:`CERTAIN`) and is covered neither by a
row ``claim`` of ``claims.toml`` nor by one of ``no_claim`` fails, as does a row that no text needs.

To print a new one: write what computes it, its test, and then its row there.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CERTAIN = re.compile(
    r"\b(prove[ns]?|proved|proofs?|certif\w+|complete\w*|cannot|never|always|exact\w*|enclose[sd]?|"
    r"enclosures?|guarantee\w*|impossible|unique\w*|rigorous\w*|isolated|necessarily|separated|"
    r"same aspect|only beyond|upper bounds?|controllable|uncontrollable)\b|^(rigid|flexible)$",
    re.IGNORECASE,
)
"""The words that make a text a claim."""


@dataclass(frozen=True)
class Claim:
    """One word or phrase: ``texts`` are patterns of the texts that print it, ``test`` is ``file::function``."""

    phrase: str
    command: str
    means: str
    computation: str
    assumes: str
    test: str
    texts: tuple[str, ...]


@dataclass(frozen=True)
class NoClaim:
    """Texts with such a word that claim nothing about a robot, with the reason."""

    why: str
    texts: tuple[str, ...]


def _rows(kind: str) -> list[dict[str, Any]]:
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return [{**row, "texts": tuple(row["texts"])} for row in table[kind]]


CLAIMS = tuple(Claim(**row) for row in _rows("claim"))
"""Claims in the order of the page."""
NO_CLAIMS = tuple(NoClaim(**row) for row in _rows("no_claim"))


HEAD = (
    "# Claims: what each word of certainty means",
    "",
    "Each word of certainty that the program prints is in this list; what is not in it is not claimed. Each row names "
    "the test that would fail if the claim were false.",
    "",
    "All rows assume that the file's numbers are the robot's geometry. *Ranks* stands for: numerical, no proof; the "
    "configurations are generic, and a rank gap of at least 1000 decides the rank.",
    "",
    "The list is made from `docs/tables/claims.toml`. A test fails if a text with such a word is not listed there.",
)
"""The lines before the claims."""


def indent_lines(text: str) -> str:
    """Return a text whose further lines are items of an inner list."""
    first, *items = text.split("\n")
    return "\n".join([first, *(f"    * {item}" for item in items)])


def page() -> str:
    """Return the page of claims in Markdown."""
    lines = [*HEAD, ""]
    for claim in CLAIMS:
        lines += [
            f"## {claim.phrase}",
            "",
            f"`{claim.command}`" if " " not in claim.command else claim.command,
            "",
            f"* **Means:** {indent_lines(claim.means)}.",
            f"* **Computed by:** {indent_lines(claim.computation)}.",
            f"* **Assumes:** {indent_lines(claim.assumes)}.",
            f"* **Test:** `{claim.test}`.",
            "",
        ]
    return "\n".join(lines)
