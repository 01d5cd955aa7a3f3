"""Queries of the catalog: entries by key, or those that fit criteria."""

from __future__ import annotations

import difflib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from ..errors import BadRequest
from ..results import Value
from .architecture_key import SENSORS, parse
from .conditions import list_matching_lines, require_askable
from .jsonl import Record, parse_record, read_leading_word
from .known import find_alias, is_called, order
from .store import DATABASES, ShippedCatalogs, Store, locate_shipped_folder, store

CATALOG_JSON_PARTS_MAX = 7_000_000
"""Lists, objects and commas in all entries read, plus three per entry: each takes up to two hundred bytes."""


class ReadRecords(Sequence[Record]):
    """Entries of lines, each parsed at first access."""

    def __init__(self, lines: Sequence[str], source: str | None = None) -> None:
        self._lines, self._source = lines, source
        self._read: list[Record | None] = [None] * len(lines)
        self._parts = 0

    def __len__(self) -> int:
        return len(self._lines)

    def fitting(self, asked: Mapping[str, Any]) -> ReadRecords:
        """Return the entries that fit criteria."""
        found = list_matching_lines(self._lines, asked, partial(parse_record, file=self._source))
        return ReadRecords([self._lines[i] for i in found], self._source)

    def words(self) -> list[str]:
        """Return the keys of all entries without parsing them."""
        return [read_leading_word(each, self._source) for each in self._lines]

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        found = self._read[place]
        if found is None:
            line = self._lines[place]
            self._parts += 3 + sum(map(line.count, "[{,"))
            if self._parts > CATALOG_JSON_PARTS_MAX:
                raise BadRequest(
                    f"{self._source or 'catalog'}: more than {CATALOG_JSON_PARTS_MAX} JSON values",
                    remedy="Restrict the search, for example by group.",
                )
            found = self._read[place] = parse_record(line, self._source)
        return found


@dataclass(frozen=True, eq=False, repr=False)
class Catalog(Value):
    """Entries of architectures, by group and then by key."""

    records: Sequence[Record]

    def __iter__(self) -> Iterator[Record]:
        return iter(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def __contains__(self, word: object) -> bool:
        return word in self._places

    def __getitem__(self, word: str) -> Record:
        """Return the entry of a key in any spelling; raises ``BadRequest`` with similar keys."""
        name = word if word in self._places else str(parse(word))
        if name not in self._places:
            close = difflib.get_close_matches(name, self._places, n=3, cutoff=0.4)
            raise BadRequest(f"key {name}: not in the catalog", remedy=f"Use {' or '.join(close)}." if close else "")
        return self.records[self._places[name]]

    def where(self, **asked: Any) -> Catalog:
        """Return the entries that fit all given criteria.

        Parameters
        ----------
        **asked
            Criteria; of several values in a tuple one must fit, None is ignored. Equal to a field: ``group``, ``dof``,
            ``motion`` ("3T", "2T1R"), ``verdict``, ``base_motors``, ``fewest`` (size of the smallest set of legs with
            the largest rank), ``modes`` (complex ones of such a set), ``driven`` (the motors determine all dof),
            ``sensor`` ("3point": observations of the platform instead of legs). ``legs``: their number, or a pattern of
            ``*`` and ``?`` for the notation or the chain of one leg. ``motors``: kinds of all actuated joints ("R",
            "P+R"). ``parallelograms``: True if a leg has one, or two equal rods. ``text``: part of a field or name.

        Returns
        -------
        Catalog
            The entries that fit, in the same order.

        Raises
        ------
        BadRequest
            For an unknown criterion or an impossible value.

        Examples
        --------
        >>> len(hrsynth.catalog.load(group="schoenflies").where(verdict="controllable", fewest=2))
        15
        """
        require_askable(asked)
        if isinstance(self.records, ReadRecords):
            return Catalog(self.records.fitting(asked))
        lines = [json.dumps(dict(each), separators=(",", ":"), default=str) for each in self.records]
        return Catalog([self.records[i] for i in list_matching_lines(lines, asked, json.loads)])

    @property
    def words(self) -> list[str]:
        """Keys of all entries."""
        return (
            self.records.words()
            if isinstance(self.records, ReadRecords)
            else [str(each["key"]) for each in self.records]
        )

    def values(self, name: str) -> list[Any]:
        """Return the values of a field, sorted."""
        return sorted(value for (value,) in self.count(name) if value is not None)

    def count(self, *fields: str) -> dict[tuple[Any, ...], int]:
        """Count the entries by the values of fields, sorted; None for a missing field."""
        counts = Counter(tuple(each.get(name) for name in fields) for each in self.records)
        return dict(sorted(counts.items(), key=lambda item: [(value is None, str(value)) for value in item[0]]))

    @cached_property
    def _places(self) -> dict[str, int]:
        return {word: i for i, word in reversed(list(enumerate(self.words)))}


def load(path: str | Path | None = None, **asked: Any) -> Catalog:
    """Load a catalog of architectures.

    Parameters
    ----------
    path : str or Path, optional
        Folder or SQLite file. Default: the shipped catalog of architectures; ``published``: that of published robots;
        ``all``: both.
    **asked
        Criteria of :meth:`Catalog.where`.

    Returns
    -------
    Catalog
        Entries by key, as mappings. Keys with sensors (group ``sensors``) are left out unless ``group`` or ``sensor``
        selects them.

    Raises
    ------
    BadRequest
        If there is no catalog, or one of another version.

    Notes
    -----
    Only matching entries of a SQLite file are read.

    Examples
    --------
    >>> hrsynth.catalog.load(group="planar")["3(Rz*-Rz-Rz)"]["verdict"]
    'controllable'
    """
    require_askable(asked)
    kept = _open_store(path)
    groups = _choose_groups(kept, asked)
    return Catalog(ReadRecords(kept.lines(groups, asked), str(kept.path)))


def find_named(text: str, path: str | Path | None = None) -> list[Record]:
    """Return the entries of robots with a name or legs, in the order of lists: names that begin with the text first.
    ``path`` as for :func:`load`."""
    called = (each for each in load(path, text=text) if is_called(each, text))
    found = {each["key"]: each for each in (*called, *load(path, legs=text))}.values()
    starts = f", {text}".casefold()
    return sorted(found, key=lambda each: (starts not in f", {find_alias(each['key'])}".casefold(), *order(each)))


def count(path: str | Path | None = None, **asked: Any) -> int:
    """Count the entries of the groups that are searched for criteria."""
    return sum(map(_open_store(path).count, list_covered_groups(path, **asked)))


def list_covered_groups(path: str | Path | None = None, **asked: Any) -> list[str]:
    """Return the names of the groups that are searched for criteria."""
    return _choose_groups(_open_store(path), asked if asked.get("group") == SENSORS else {**asked, "group": None})


def list_groups(path: str | Path | None = None) -> list[str]:
    """Return the names of the stored groups."""
    return _open_store(path).groups()


def list_field_values(name: str, path: str | Path | None = None) -> list[Any]:
    """Return the values of a field, one of ``FIELDS``, in the entries of all groups, sorted."""
    return _open_store(path).values(name)


def _choose_groups(kept: Store, asked: Mapping[str, Any]) -> list[str]:
    """Return the groups that are searched for criteria."""
    wanted = asked.get("group")
    return [
        name
        for name in kept.groups()
        if name in _convert_to_tuple(wanted)
        or (wanted is None and (name == SENSORS) == (asked.get("sensor") is not None))
    ]


def _convert_to_tuple(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)


def _open_store(path: str | Path | None) -> Store:
    """Return the store of a path, by default the shipped one; raises ``BadRequest`` if there is none."""
    kept = locate_shipped_folder() if path is None else store(path)
    if path is not None and not kept.path.exists() and not isinstance(kept, ShippedCatalogs):
        raise BadRequest(
            f"--catalog {path}: not found", remedy=f"Name a folder or a file that ends in {', '.join(DATABASES)}."
        )
    if not kept.groups():
        raise BadRequest(f"{kept.path}: no catalog", remedy="Build one with hrsynth catalog build.")
    return kept
