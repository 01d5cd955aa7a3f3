"""Asking the catalog: all records of a store, by word, or those that fit what is asked for."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

from ..errors import BadRequest
from ..results import Value
from .jsonl import Record, record
from .store import DATABASES, Store, shipped, store
from .words import SENSORS, counted, parse, sights

EXACT = ("group", "dof", "motion", "verdict", "base_motors", "fewest", "see")
"""Fields that have to be equal to what is asked for."""
ASKED = (*EXACT, "modes", "legs", "text")
"""What can be asked for."""


@dataclass(frozen=True, eq=False, repr=False)
class Catalog(Value):
    """Records, by group and then by word."""

    records: tuple[Record, ...]

    def __iter__(self) -> Iterator[Record]:
        return iter(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def __contains__(self, word: object) -> bool:
        return word in self._places

    def __getitem__(self, word: str) -> Record:
        """The record of an architecture, its word spelt in any way; raises ``BadRequest`` with words close to it."""
        name = word if word in self._places else str(parse(word))
        if name not in self._places:
            close = difflib.get_close_matches(name, self._places, n=3, cutoff=0.4)
            raise BadRequest("not in the catalog", name, f"{', '.join(close)} …" if close else None)
        return self.records[self._places[name]]

    def where(self, **asked: Any) -> Catalog:
        """The records that fit all that is asked for and not None; raises ``BadRequest`` for what cannot be asked.

        ``group``, ``dof``, ``motion`` ("3T", "2T1R"), ``verdict``, ``base_motors``, ``fewest`` (legs of the smallest
        set that sees all that can be seen), ``modes`` (complex ones of such a set) and ``see`` ("3point": what is seen
        of the platform instead of legs) have to be equal. ``legs`` is
        their number, or a pattern of ``*`` and ``?`` for the notation or for the chain of one leg, with or without the
        marks of motors. ``text`` has to occur in some field, or in a name
        under which the robot is known. Several values in a tuple: one of them.
        """
        require_askable(asked)
        return Catalog(tuple(each for each in self.records if fits(each, asked)))

    def named(self, text: str) -> list[Record]:
        """The records of robots that are called so, or whose legs are, those first that a list shows first: names that
        begin with the text before others."""
        from .site.known import alias, is_called, order

        found = [each for each in self if is_called(each, text) or fits(each, {"legs": text})]
        starts = f", {text}".casefold()
        return sorted(found, key=lambda each: (starts not in f", {alias(each['word'])}".casefold(), *order(each)))

    def count(self, *fields: str) -> dict[tuple[Any, ...], int]:
        """How many records have which values of the fields, sorted by these; None where a record has no such field."""
        counts = Counter(tuple(each.get(name) for name in fields) for each in self.records)
        return dict(sorted(counts.items(), key=lambda item: [(value is None, str(value)) for value in item[0]]))

    @cached_property
    def _places(self) -> dict[str, int]:
        return {str(each["word"]): i for i, each in reversed(list(enumerate(self.records)))}


def load(path: str | Path | None = None, **asked: Any) -> Catalog:
    """The shipped catalog, or that of a folder or SQLite file; ``published``: the shipped one of published robots
    (docs/pages/audit.md). ``asked`` as for ``Catalog.where``.

    What is seen of platforms instead of legs (the group ``sensors``) is left out unless ``group`` or ``see`` asks for
    it.
    Of a SQLite file only the records that fit are read. Raises ``BadRequest`` where there is none or one of
    another version.
    """
    require_askable(asked)
    kept = shipped() if path is None else store(path)
    _require_there(kept, path)
    exactly = {name: value for name, value in asked.items()
               if name in EXACT and value is not None and not isinstance(value, tuple)}
    wanted = asked.get("group")
    groups = [name for name in kept.groups() if name in _tuple(wanted) or (
        wanted is None and (name == SENSORS) == (asked.get("see") is not None))]
    return Catalog(tuple(record(line) for name in groups for line in kept.lines(name, exactly))).where(**asked)


def _tuple(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)


def _require_there(kept: Store, path: str | Path | None) -> None:
    if path is not None and not kept.path.exists():
        raise BadRequest("no such catalog", str(path), f"a folder, or a file that ends in {', '.join(DATABASES)}")
    if not kept.groups():
        raise BadRequest("nothing in the catalog", str(kept.path), "one that was built by hrsynth catalog build")


def require_askable(asked: Mapping[str, Any]) -> None:
    """Raise ``BadRequest`` for a name that cannot be asked for."""
    for name in asked:
        if name not in ASKED:
            raise BadRequest("the catalog cannot be asked for", name, ASKED)


def fits(record: Record, asked: Mapping[str, Any]) -> bool:
    """Whether a record fits all that is asked for and not None."""
    return all(_one(record, name, value) for name, value in asked.items() if value is not None)


def _one(record: Record, name: str, value: Any) -> bool:
    if isinstance(value, tuple):
        return any(_one(record, name, each) for each in value)
    match name:
        case "legs":
            return _legs(record, value)
        case "see":
            return bool(record.get("see") == counted(sights(value)))
        case "modes":
            return bool(record.get("modes_bound") == value)
        case "text":
            from .site.known import is_called

            return is_called(record, str(value)) or any(
                str(value).casefold() in str(each).casefold() for each in record.values())
        case _:
            return name in record and bool(record[name] == value)


def _legs(record: Record, value: int | str) -> bool:
    """Whether a robot has so many legs, or its notation, its word or a leg's chain the pattern."""
    if isinstance(value, int) or value.isdecimal():
        return bool(record.get("legs") == int(value))
    return any(name == value or fnmatchcase(name, _plain_brackets(value)) for name in names(record))


def names(record: Record) -> set[str]:
    """The names by which legs are found: word, notation and each leg's chain, with and without the marks of motors."""
    notation = str(record.get("notation", ""))
    found = {str(record["word"]), notation}
    for term in re.split(r"\+(?![^{]*})", notation):
        found.add(re.sub(r"^[0-9]+-", "", term))
    return {name for each in found if each for name in (each, each.replace("*", ""))}


def _plain_brackets(pattern: str) -> str:
    """A pattern in which brackets stand for themselves."""
    return pattern.replace("[", "[[]")
