"""Structures: architectures that differ by their motors alone have one hidden robot, one verdict, and one page."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from ..architecture_key import parse
from ..jsonl import Record, format_line

STRUCTURE_NAME_DIGITS_COUNT = 12
"""Digits of a name: two of a million words are alike with a probability of 2e-3."""


def hash_name(word: str) -> str:
    """The name of a word in addresses: the same for ever, and for any spelling of files."""
    return sha256(word.encode()).hexdigest()[:STRUCTURE_NAME_DIGITS_COUNT]


OF_MOTORS = frozenset({"key", "notation", "motors", "motor_rank", "driven", "base_motors"})
"""Fields of a record that depend on its motors."""


@dataclass(frozen=True)
class Structure:
    """A word without motors (with motors, where these change what is known), the records of its architectures, and its
    kin: words and verdicts of the structures that differ from it by the observed segments alone."""

    word: str
    records: tuple[Record, ...]
    kin: tuple[tuple[str, str], ...] = ()

    @property
    def name(self) -> str:
        """Its name in addresses."""
        return hash_name(self.word)

    @property
    def fact(self) -> Record:
        """The record of what all its architectures have in common."""
        return self.records[0]

    def pack(self) -> str:
        """As text that can be sent to another process."""
        return json.dumps({"key": self.word, "kin": self.kin, "records": [format_line(each) for each in self.records]})

    @classmethod
    def unpack(cls, text: str) -> Structure:
        """Decode the text of ``pack``."""
        found: dict[str, Any] = json.loads(text)
        return cls(
            found["key"],
            tuple(json.loads(each) for each in found["records"]),
            tuple((word, verdict) for word, verdict in found["kin"]),
        )


def group_structures(records: Iterable[Record]) -> tuple[Structure, ...]:
    """The structures of records, sorted by word; their records by word too, those with all motors on the base first."""
    alike: dict[str, dict[str, list[Record]]] = {}
    for each in sorted(records, key=lambda record: (not record.get("base_motors"), record["key"])):
        common = format_line({**each, **dict.fromkeys(OF_MOTORS), "key": ""})
        alike.setdefault(str(parse(each["key"]).unmoved), {}).setdefault(common, []).append(each)
    own: dict[str, list[Record]] = {}
    alike_unseen: dict[str, list[str]] = {}
    for unmoved, parts in alike.items():
        for part in parts.values():
            word = part[0]["key"] if unmoved in own else unmoved
            own[word] = part
            alike_unseen.setdefault(str(parse(unmoved).unmarked), []).append(word)
    kin = {word: words for words in alike_unseen.values() for word in words}
    return tuple(
        Structure(
            word,
            tuple(own[word]),
            tuple((other, own[other][0].get("verdict", "refused")) for other in sorted(kin[word]) if other != word),
        )
        for word in sorted(own)
    )
