"""Every word of certainty that the program prints: what it stands for, by which computation, on which assumptions, and
the test that would fail if it were false.

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
    """One word or phrase: ``texts`` are patterns of the texts that say it, ``test`` is ``file::function``."""

    phrase: str
    command: str
    means: str
    computation: str
    assumes: str
    test: str
    texts: tuple[str, ...]


@dataclass(frozen=True)
class NoClaim:
    """Texts with such a word that claim nothing of a robot, and why not."""

    why: str
    texts: tuple[str, ...]


def _rows(kind: str) -> list[dict[str, Any]]:
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return [{**row, "texts": tuple(row["texts"])} for row in table[kind]]


CLAIMS = tuple(Claim(**row) for row in _rows("claim"))
"""What is claimed, in the order of the page."""
NO_CLAIMS = tuple(NoClaim(**row) for row in _rows("no_claim"))


def page() -> str:
    """The page of claims, Markdown."""
    lines = [
        "# What each word of certainty stands for",
        "",
        "Each word of certainty that the program prints stands in this table, which is made from the project's own "
        "(`docs/tables/claims.toml`). A test fails if a text holds such a word and is not listed there. What is "
        "not in this table is not claimed.",
        "",
    ]
    for claim in CLAIMS:
        lines += [
            f"## {claim.phrase}",
            "",
            f"`{claim.command}`" if " " not in claim.command else claim.command,
            "",
            f"* **Stands for:** {claim.means}.",
            f"* **Computed by:** {claim.computation}.",
            f"* **Assumes:** {claim.assumes}.",
            f"* **Would fail:** `{claim.test}`.",
            "",
        ]
    return "\n".join(lines)
