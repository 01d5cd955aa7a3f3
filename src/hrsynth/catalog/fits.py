"""Whether a record fits what is asked for, its line, and the rows of a SQLite file."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import translate
from functools import cache
from typing import Any, Protocol

import numpy as np

from ..errors import BadRequest
from .jsonl import FLAGS, Record, is_written, leading_word, written_text
from .known import is_called, kinds, kinds_called, known_as
from .search import Flags
from .words import LONGEST_COUNT, MOVED, count_equal, sights

ASKED = (
    "group",
    "dof",
    "motion",
    "verdict",
    "base_motors",
    "driven",
    "motors",
    "parallelograms",
    "fewest",
    "see",
    "modes",
    "legs",
    "text",
)
"""What can be asked for."""
TEXTS = ("notation", "hidden", "steps", "others")
"""Columns of a SQLite file in which a text is sought: fields, and all others together but the word, with the names
under which the robot is known."""
APART = "\x1f"
"""Between the texts of a record."""
FIELDS = ("group", "legs", "dof", "motion", "verdict", "base_motors", "fewest", "see", "modes_bound")
"""Fields of a record that have a column of their own in a SQLite file."""
MOST_TOLD = 100
"""Values about which the columns of a SQLite file are asked, at most."""


class Rows(Protocol):
    """The rows of a SQLite file, asked all together (:class:`.columns.Columns`)."""

    def having(self, name: str, test: Callable[[Any], bool]) -> Flags:
        """Those of records that have a field whose value meets a test."""

    def holding(self, text: str) -> Flags:
        """Those of records in which a casefolded text occurs in some field, or in a name."""

    def match(self, pattern: str) -> Flags:
        """Those of records whose word, notation, or chain of some leg fits a pattern."""


def require_askable(asked: Mapping[str, Any]) -> None:
    """Raise ``BadRequest`` for a name that cannot be asked for."""
    for name in asked:
        if name not in ASKED:
            raise BadRequest("the catalog cannot be asked for", name, ASKED)


@dataclass(frozen=True)
class RecordCondition:
    """What is asked for by one name, told once: of a record, of its line, and of all rows of a SQLite file."""

    holds: Callable[[Record], bool]
    rows: Callable[[Rows], Flags] | None
    """For which rows it holds; None where no column tells."""
    line: Callable[[str], bool] | None = None
    """Whether it may hold for the record of a line that is not read; None where that is not known."""


def conditions(asked: Mapping[str, Any]) -> dict[str, RecordCondition]:
    """The condition of each name for which something is asked; of several values in a tuple or list one has to be met.
    Raises ``BadRequest`` for a value that none can have."""
    return {
        name: _any_of([_condition(name, each) for each in (value if isinstance(value, tuple | list) else (value,))])
        for name, value in asked.items()
        if value is not None
    }


def fits(asked: Mapping[str, Any]) -> Callable[[Record], bool]:
    """Whether a record fits all that is asked for and not None."""
    every = conditions(asked).values()
    return lambda record: all(each.holds(record) for each in every)


def may_fit(asked: Mapping[str, Any]) -> Callable[[str], bool]:
    """Whether the line of a record may fit all that is asked for and not None, without reading it."""
    every = [each.line for each in conditions(asked).values() if each.line]
    return lambda line: not is_written(line) or all(told(line) for told in every)


def _any_of(every: Sequence[RecordCondition]) -> RecordCondition:
    if len(every) == 1:
        return every[0]
    lines = [each.line for each in every if each.line]
    rows = [each.rows for each in every if each.rows]
    return RecordCondition(
        lambda record: any(each.holds(record) for each in every),
        (lambda columns: np.any([told(columns) for told in rows], 0))
        if 0 < len(rows) == len(every) <= MOST_TOLD
        else None,
        (lambda line: any(told(line) for told in lines)) if len(lines) == len(every) else None,
    )


def _condition(name: str, value: Any) -> RecordCondition:
    """That of one value; one of NumPy counts as Python's."""
    return _condition_on(name, value.item() if hasattr(value, "item") else value)


def _condition_on(name: str, value: Any) -> RecordCondition:
    of_texts = name in ("legs", "see", "text", "motors")
    if of_texts and not isinstance(value, str) and (name, type(value)) != ("legs", int):
        raise BadRequest(f"the catalog cannot be asked for {name}", value, "a text, or a number of legs")
    match name:
        case "legs" if isinstance(value, str) and not (value.isdecimal() and len(value) <= LONGEST_COUNT):
            matches = re.compile(translate(plain_brackets(value))).match

            def is_one(*names: str) -> bool:
                return any(name == value or matches(name) for name in names)

            @cache
            def has_chain(notation: str) -> bool:
                return is_one(*chains({"notation": notation}))

            def has_legs(word: str, notation: str) -> bool:
                return has_chain(notation) or is_one(word, word.replace("*", ""))

            return RecordCondition(
                lambda record: has_legs(record["word"], str(record.get("notation", ""))),
                lambda rows: rows.match(value),
                lambda line: "\\" in line or has_legs(leading_word(line), written_text(line, "notation")),
            )
        case "text":
            text = value.casefold()
            # lists and quotes are not written as they are read
            plain = re.fullmatch(r"[a-z0-9*+!.{|}()-]+( +[a-z0-9*+!.{|}()-]+)*", text) is not None
            return RecordCondition(
                lambda record: is_called(record, text) or any(text in str(each).casefold() for each in record.values()),
                None if APART in text else lambda rows: rows.holding(text),
                (
                    lambda line: (
                        text in line.casefold()
                        or (bool(kinds_called(text)) and kinds(leading_word(line)) in kinds_called(text))
                    )
                )
                if plain
                else None,
            )
        case "motors" | "parallelograms":
            read = driven_kinds if name == "motors" else has_parallelograms
            value = "+".join(_motor_letters(value)) if name == "motors" else value
            return RecordCondition(
                lambda record: "refused" not in record and read(record) == value,
                None,
                lambda line: '"choices":' in line or "\\" in line or read({"word": leading_word(line)}) == value,
            )
        case "legs":
            value = int(value)
        case "see":
            value = count_equal(sights(value))
        case "modes":
            name = "modes_bound"
    # 1 is True and 3.0 is 3: these are not so written
    exact = isinstance(value, str) or (
        isinstance(value, int) and abs(value) < 2**63 and isinstance(value, bool) == (name in FLAGS)
    )
    part = f"{json.dumps(name)}:{json.dumps(value)}" if exact else ""
    return RecordCondition(
        lambda record: name in record and bool(record[name] == value),
        (lambda rows: rows.having(name, lambda found: bool(found == value))) if name in FIELDS else None,
        (lambda line: part in line) if exact else None,
    )


def driven_kinds(record: Record) -> str:
    """The kinds of driven joints ("R", "P+R"), as a word marks them; of a published robot those of the first choice of
    motors that determines all freedoms, or else of the first."""
    choices = record.get("choices")
    if not choices:
        return "+".join(sorted(set(re.findall(r"([RPCU])[a-z]*\*", record["word"]))))
    chosen = next((each for each in choices if each["rank"] == record["dof"]), choices[0])
    chain = re.match(r"P[0-9]+?([RP]+)", record["word"])
    kinds = chain[1] if chain else ""
    return "+".join(sorted({kinds[j - 1] for leg in chosen["joints"] for j in leg if 0 < j <= len(kinds)}))


def has_parallelograms(record: Record) -> bool:
    """Whether a leg has a parallelogram, or two equal parallel rods."""
    return re.search("Pi|2SS|2US", record["word"]) is not None


def _motor_letters(text: str) -> list[str]:
    letters = sorted(set(text.split("+")))
    if not set(letters) <= set(MOVED):
        raise BadRequest("the catalog cannot be asked for motors", text, f"{', '.join(MOVED)}, or several joined by +")
    return letters


def chains(record: Record) -> set[str]:
    """The names by which legs are found beside the word: notation and each leg's chain, with and without the marks of
    motors."""
    notation = str(record.get("notation", ""))
    found = {notation, *(re.sub(r"^[0-9]+-", "", term) for term in re.split(r"\+(?![^{]*})", notation))}
    return {name for each in found if each for name in (each, each.replace("*", ""))}


def plain_brackets(pattern: str) -> str:
    """A pattern in which brackets stand for themselves."""
    return pattern.replace("[", "[[]")


def texts(record: Record) -> dict[str, str]:
    """Where a text is sought beside the word, casefolded."""
    fields = TEXTS[:-1]
    found = {field: str(record.get(field, "")).casefold() for field in fields}
    others = [str(value) for name, value in record.items() if name not in ("word", *fields)]
    return found | {TEXTS[-1]: APART.join([*others, known_as(record)]).casefold()}
