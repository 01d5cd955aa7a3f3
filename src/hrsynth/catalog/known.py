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
def list_aliases() -> dict[str, str]:
    """Return names by key, without motors and marks of observed links."""
    text = resources.files("hrsynth.catalog").joinpath("aliases.toml").read_text(encoding="utf-8")
    return {word: each["names"] for each in tomllib.loads(text)["robot"] for word in each["words"]}


@cache
def find_alias(word: str) -> str | None:
    """Under which names a word's robot is known."""
    return list_aliases().get(strip_marks(word))


@cache
def find_named_kinds(text: str) -> frozenset[frozenset[str]]:
    """The kinds of legs, without motors and marks, of robots in whose names a text occurs."""
    return frozenset(
        list_leg_kinds(word) for word, names in list_aliases().items() if text.casefold() in names.casefold()
    )


def list_leg_kinds(word: str) -> frozenset[str]:
    """Return the legs of a key, without motors and marks of observed links, each once."""
    return frozenset(re.findall(r"\(([^()]*)\)", re.sub("[*!]", "", word)))


def has_equal_legs(word: str) -> bool:
    """Return True if all legs of a key have one chain, regardless of motors and observed links."""
    return len(list_leg_kinds(word)) < 2


def is_called(record: Record, text: str) -> bool:
    """Return True if a text occurs in a name of an entry's robot; keys with other legs are not parsed."""
    found = find_named_kinds(text)
    return (
        bool(found)
        and list_leg_kinds(record["key"]) in found
        and text.casefold() in list_known_names(record).casefold()
    )


def list_known_names(record: Record) -> str:
    """The names under which a record's robot is known; words with legs that no known robot has are not read."""
    word = record["key"]
    return (find_alias(word) or "") if list_leg_kinds(word) in find_named_kinds("") else ""


def strip_marks(word: str) -> str:
    """Return a key without motors and marks of observed links."""
    return str(parse(word).unmoved.unmarked)


def order(record: Record) -> tuple[bool, bool, bool, bool, bool, bool]:
    """The place of a record in the list, smaller first: known by a name, with a verdict, all legs equal, every default
    link observed, all motors on the base, controllable."""
    word = record["key"]
    legs = len(set(parse(word).legs))
    return (
        find_alias(word) is None,
        "refused" in record,
        legs > 1,
        "!" in word,
        not record.get("base_motors"),
        record.get("verdict") != "controllable",
    )
