"""The names under which robots are known, as data, and the order that they give: known robots first, then symmetric
ones."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from importlib import resources

from .architecture_key import parse
from .jsonl import Record


@cache
def aliases() -> dict[str, str]:
    """Names by word, without motors and marks of watched links."""
    text = resources.files("hrsynth.catalog").joinpath("aliases.toml").read_text(encoding="utf-8")
    return {word: each["names"] for each in tomllib.loads(text)["robot"] for word in each["words"]}


@cache
def alias(word: str) -> str | None:
    """Under which names a word's robot is known."""
    return aliases().get(bare(word))


@cache
def kinds_called(text: str) -> frozenset[frozenset[str]]:
    """The kinds of legs, without motors and marks, of robots in whose names a text occurs."""
    return frozenset(kinds(word) for word, names in aliases().items() if text.casefold() in names.casefold())


def kinds(word: str) -> frozenset[str]:
    """The legs of a word, without motors and marks of watched links, each once."""
    return frozenset(re.findall(r"\(([^()]*)\)", re.sub("[*!]", "", word)))


def equal_legs(word: str) -> bool:
    """Whether all legs of a word are of one chain, whatever is driven or observed."""
    return len(kinds(word)) < 2


def is_called(record: Record, text: str) -> bool:
    """Whether a text occurs in a name under which a record's robot is known; words with other legs are not read."""
    found = kinds_called(text)
    return bool(found) and kinds(record["key"]) in found and text.casefold() in known_as(record).casefold()


def known_as(record: Record) -> str:
    """The names under which a record's robot is known; words with legs that no known robot has are not read."""
    word = record["key"]
    return (alias(word) or "") if kinds(word) in kinds_called("") else ""


def bare(word: str) -> str:
    """A word without motors and marks of watched links."""
    return str(parse(word).unmoved.unmarked)


def order(record: Record) -> tuple[bool, bool, bool, bool, bool, bool]:
    """The place of a record in the list, smaller first: known by a name, with an answer, all legs equal, every default
    link watched, all motors on the base, controllable."""
    word = record["key"]
    legs = len(set(parse(word).legs))
    return (
        alias(word) is None,
        "refused" in record,
        legs > 1,
        "!" in word,
        not record.get("base_motors"),
        record.get("verdict") != "controllable",
    )
