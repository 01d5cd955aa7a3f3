"""What is built: the groups of words, the record of a word, and which words share their work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from ..errors import BadRequest, HrsynthError
from .jsonl import line

Group = Callable[[], Iterable[str]]
Made = list[tuple[str, str]]
"""Words with the lines of their records."""


class Stopped(Exception):
    """A record that cannot be made, or those who make them are gone: why."""


@dataclass(frozen=True)
class Source:
    """Groups of canonical words; ``entry`` gives the record of one, and can be sent to other processes.

    Words of the same ``kin`` share most of their work, so they are made one after the other in one process.
    """

    groups: Mapping[str, Group]
    entry: Callable[[str], dict[str, Any]]
    kin: Callable[[str], str] = str

    def chosen(self, names: Sequence[str]) -> list[str]:
        """The groups of these names, all if there are none; raises ``BadRequest``."""
        for name in names:
            if name not in self.groups:
                raise BadRequest("unknown group", name, list(self.groups))
        return list(dict.fromkeys(names)) or list(self.groups)

    def words(self, group: str) -> list[str]:
        """The words of a group, sorted."""
        return sorted(set(self.groups[group]()))

    def chunks(self, words: Iterable[str], size: int) -> Iterator[list[str]]:
        """The words in parts of at least ``size`` (but for the last); kin stay together."""
        chunk: list[str] = []
        for _, kin in groupby(sorted((self.kin(word), word) for word in words), key=lambda pair: pair[0]):
            chunk += [word for _, word in kin]
            if len(chunk) >= size:
                yield chunk
                chunk = []
        if chunk:
            yield chunk


def architectures() -> Source:
    """The catalog itself."""
    from .entry import entry
    from .groups import GROUPS

    return Source(GROUPS, entry, unmoved)


def unmoved(word: str) -> str:
    """The word without its motors: what a hidden robot is found from."""
    from .words import parse

    return str(parse(word).unmoved)


def made(entry: Callable[[str], dict[str, Any]], group: str, words: Iterable[str]) -> Made:
    """The records of words; one that is refused says why, in one line. Raises ``Stopped`` for a defect of our own."""
    return [(word, line({**_record(entry, word), "word": word, "group": group})) for word in words]


def _record(entry: Callable[[str], dict[str, Any]], word: str) -> dict[str, Any]:
    try:
        return entry(word)
    except HrsynthError as error:
        return {"refused": "; ".join(error.lines())}
    except Exception as error:
        what = " ".join(f"{type(error).__name__}: {error}".split())
        raise Stopped(f"{word}: a defect of hrsynth itself, please report it: {what}") from error
