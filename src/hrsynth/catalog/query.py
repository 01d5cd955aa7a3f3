"""Asking the catalog: all records of a store, by word, or those that fit what is asked for."""

from __future__ import annotations

import difflib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from ..budgets import MOST_READ_PARTS
from ..errors import BadRequest
from ..results import Value
from .architecture_key import SENSORS, parse
from .conditions import places, require_askable
from .jsonl import Record, leading_word, record
from .known import alias, is_called, order
from .store import DATABASES, ShippedCatalogs, Store, shipped_folder, store


class ReadRecords(Sequence[Record]):
    """The records of lines, each read when it is looked at first."""

    def __init__(self, lines: Sequence[str], source: str | None = None) -> None:
        self._lines, self._source = lines, source
        self._read: list[Record | None] = [None] * len(lines)
        self._parts = 0

    def __len__(self) -> int:
        return len(self._lines)

    def fitting(self, asked: Mapping[str, Any]) -> ReadRecords:
        """Those that fit what is asked for."""
        found = places(self._lines, asked, partial(record, file=self._source))
        return ReadRecords([self._lines[i] for i in found], self._source)

    def words(self) -> list[str]:
        """The words of all, none of which is read for that."""
        return [leading_word(each, self._source) for each in self._lines]

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        found = self._read[place]
        if found is None:
            line = self._lines[place]
            self._parts += 3 + sum(map(line.count, "[{,"))
            if self._parts > MOST_READ_PARTS:
                raise BadRequest(
                    f"{self._source or 'catalog'}: more than {MOST_READ_PARTS} JSON values",
                    remedy="Restrict the search, for example by group.",
                )
            found = self._read[place] = record(line, self._source)
        return found


@dataclass(frozen=True, eq=False, repr=False)
class Catalog(Value):
    """Records, by group and then by word."""

    records: Sequence[Record]

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
            raise BadRequest(f"key {name}: not in the catalog", remedy=f"Use {' or '.join(close)}." if close else "")
        return self.records[self._places[name]]

    def where(self, **asked: Any) -> Catalog:
        """The records that fit all given criteria (those that are not None); raises ``BadRequest`` for unknown ones.

        ``group``, ``dof``, ``motion`` ("3T", "2T1R"), ``verdict``, ``base_motors``, ``fewest`` (legs of the smallest
        set that sees all that can be seen), ``modes`` (complex ones of such a set) and ``sensor`` ("3point": what is
        seen of the platform instead of legs) must be equal. ``legs`` is their number, or a pattern of ``*`` and ``?``
        for the notation or for the chain of one leg, with or without motor marks. ``motors`` ("R", "P", "P+R" …) are
        the kinds of all driven joints, and ``driven`` says whether the motors determine all freedoms; of a published
        robot its first choice of motors that does counts. ``parallelograms``: whether a leg has one, or two equal rods.
        ``text`` must occur in some field, or in a name under which the robot is known. Several values in a tuple: any
        of them."""
        require_askable(asked)
        if isinstance(self.records, ReadRecords):
            return Catalog(self.records.fitting(asked))
        lines = [json.dumps(dict(each), separators=(",", ":"), default=str) for each in self.records]
        return Catalog([self.records[i] for i in places(lines, asked, json.loads)])

    @property
    def words(self) -> list[str]:
        """The words of all records, which are not read for that."""
        return (
            self.records.words()
            if isinstance(self.records, ReadRecords)
            else [str(each["key"]) for each in self.records]
        )

    def values(self, name: str) -> list[Any]:
        """The values of a field that records have, sorted."""
        return sorted(value for (value,) in self.count(name) if value is not None)

    def count(self, *fields: str) -> dict[tuple[Any, ...], int]:
        """How many records have which values of the fields, sorted by these; None where a record has no such field."""
        counts = Counter(tuple(each.get(name) for name in fields) for each in self.records)
        return dict(sorted(counts.items(), key=lambda item: [(value is None, str(value)) for value in item[0]]))

    @cached_property
    def _places(self) -> dict[str, int]:
        return {word: i for i, word in reversed(list(enumerate(self.words)))}


def load(path: str | Path | None = None, **asked: Any) -> Catalog:
    """The shipped catalog, or that of a folder or SQLite file; ``published``: the shipped one of published robots
    (studies/parroblib); ``all``: both. ``asked`` as for ``Catalog.where``.

    What is seen of platforms instead of legs (the group ``sensors``) is left out unless ``group`` or ``sensor`` asks
    for it. Of a SQLite file only the records that fit are read. Raises ``BadRequest`` if there is no catalog, or one of
    another version."""
    require_askable(asked)
    kept = _there(path)
    groups = _groups(kept, asked)
    return Catalog(ReadRecords(kept.lines(groups, asked), str(kept.path)))


def find_named(text: str, path: str | Path | None = None) -> list[Record]:
    """The records of robots that are called so, or whose legs are, those first that a list shows first: names that
    begin with the text before others. ``path`` as for :func:`load`."""
    called = (each for each in load(path, text=text) if is_called(each, text))
    found = {each["key"]: each for each in (*called, *load(path, legs=text))}.values()
    starts = f", {text}".casefold()
    return sorted(found, key=lambda each: (starts not in f", {alias(each['key'])}".casefold(), *order(each)))


def count(path: str | Path | None = None, **asked: Any) -> int:
    """How many records there are of the groups among which those lie that are ``asked`` for."""
    return sum(map(_there(path).count, covered(path, **asked)))


def covered(path: str | Path | None = None, **asked: Any) -> list[str]:
    """The names of the groups among which those lie that are ``asked`` for."""
    return _groups(_there(path), asked if asked.get("group") == SENSORS else {**asked, "group": None})


def groups_of(path: str | Path | None = None) -> list[str]:
    """The names of the groups that are there."""
    return _there(path).groups()


def values(name: str, path: str | Path | None = None) -> list[Any]:
    """The values of a field, one of ``FIELDS``, that records of all groups have, sorted."""
    return _there(path).values(name)


def _groups(kept: Store, asked: Mapping[str, Any]) -> list[str]:
    """The groups in which is what is asked for."""
    wanted = asked.get("group")
    return [
        name
        for name in kept.groups()
        if name in _tuple(wanted) or (wanted is None and (name == SENSORS) == (asked.get("sensor") is not None))
    ]


def _tuple(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)


def _there(path: str | Path | None) -> Store:
    """The store of a path, the shipped one where there is none; raises ``BadRequest`` where nothing is."""
    kept = shipped_folder() if path is None else store(path)
    if path is not None and not kept.path.exists() and not isinstance(kept, ShippedCatalogs):
        raise BadRequest(
            f"--catalog {path}: not found", remedy=f"Name a folder or a file that ends in {', '.join(DATABASES)}."
        )
    if not kept.groups():
        raise BadRequest(f"{kept.path}: no catalog", remedy="Build one with hrsynth catalog build.")
    return kept
