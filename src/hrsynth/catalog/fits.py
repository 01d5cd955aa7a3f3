"""Whether a record fits what is asked for, and a row of a SQLite file."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import translate
from functools import cache
from typing import Any

from ..errors import BadRequest
from .jsonl import Record, is_written, leading_word, written_text
from .known import called, is_called, kinds, known_as
from .words import LONGEST_COUNT, counted, sights

ASKED = ("group", "dof", "motion", "verdict", "base_motors", "fewest", "see", "modes", "legs", "text")
"""What can be asked for."""
TEXTS = ("notation", "hidden", "steps", "others")
"""Whose texts are kept once each in a SQLite file: fields of many values, and all others together but the word, with
the names under which the robot is known."""
APART = "\x1f"
"""Between the texts of a record."""
COLUMNS = {"legs": "INTEGER", "dof": "INTEGER", "motion": "TEXT", "verdict": "TEXT", "base_motors": "INTEGER",
           "fewest": "INTEGER", "see": "TEXT", "modes_bound": "INTEGER"}
"""Fields of a record that have a column and an index in a SQLite file."""
MOST_TOLD, LONGEST_TOLD = 100, 10_000
"""Values and letters about which a SQLite file is asked, at most."""


def require_askable(asked: Mapping[str, Any]) -> None:
    """Raise ``BadRequest`` for a name that cannot be asked for."""
    for name in asked:
        if name not in ASKED:
            raise BadRequest("the catalog cannot be asked for", name, ASKED)


@dataclass(frozen=True)
class RecordCondition:
    """What is asked for by one name, told once: of a record, of its line, and of a row of a SQLite file."""

    holds: Callable[[Record], bool]
    row: str | None
    """With a mark for each of the values; None where no row tells."""
    values: tuple[Any, ...]
    line: Callable[[str], bool] | None = None
    """Whether it may hold for the record of a line that is not read; None where that is not known."""


def conditions(asked: Mapping[str, Any]) -> dict[str, RecordCondition]:
    """The condition of each name for which something is asked; of several values in a tuple or list one has to be met.
    Raises ``BadRequest`` for a value that none can have."""
    return {name: _any_of([_condition(name, each) for each in (value if isinstance(value, tuple | list) else (value,))])
            for name, value in asked.items() if value is not None}


def fits(asked: Mapping[str, Any]) -> Callable[[Record], bool]:
    """Whether a record fits all that is asked for and not None."""
    every = conditions(asked).values()
    return lambda record: all(each.holds(record) for each in every)


def may_fit(asked: Mapping[str, Any]) -> Callable[[str], bool]:
    """Whether the line of a record may fit all that is asked for and not None, without reading it."""
    every = [each.line for each in conditions(asked).values() if each.line]
    return lambda line: all(told(line) for told in every) or not is_written(line)


def _any_of(every: Sequence[RecordCondition]) -> RecordCondition:
    if len(every) == 1:
        return every[0]
    lines = [each.line for each in every if each.line]
    rows = [each.row for each in every if each.row is not None]
    return RecordCondition(lambda record: any(each.holds(record) for each in every),
                           f"({' OR '.join(rows) or '0'})" if len(rows) == len(every) <= MOST_TOLD else None,
                           tuple(value for each in every for value in each.values),
                           (lambda line: any(told(line) for told in lines)) if len(lines) == len(every) else None)


def _condition(name: str, value: Any) -> RecordCondition:
    """That of one value; one of NumPy counts as Python's."""
    found = _told(name, value.item() if hasattr(value, "item") else value)
    return found if all(map(_sqlite_can_tell, found.values)) else replace(found, row=None)


def _sqlite_can_tell(value: Any) -> bool:
    """Whether SQLite takes a value for what it is; it ends a text at a NUL."""
    if not isinstance(value, str):
        return isinstance(value, float) or (isinstance(value, int) and abs(value) < 2**63)
    return len(value) <= LONGEST_TOLD and not re.search("[\0\ud800-\udfff]", value)


def _told(name: str, value: Any) -> RecordCondition:
    if name in ("legs", "see", "text") and not isinstance(value, str) and (name, type(value)) != ("legs", int):
        raise BadRequest(f"the catalog cannot be asked for {name}", value, "a text, or a number of legs")
    match name:
        case "legs" if isinstance(value, str) and not (value.isdecimal() and len(value) <= LONGEST_COUNT):
            pattern = plain_brackets(value)
            matches = re.compile(translate(pattern)).match

            def is_one(*names: str) -> bool:
                return any(name == value or matches(name) for name in names)

            @cache
            def has_chain(notation: str) -> bool:
                return is_one(*chains({"notation": notation}))

            def has_legs(word: str, notation: str) -> bool:
                return has_chain(notation) or is_one(word, word.replace("*", ""))

            return RecordCondition(
                lambda record: has_legs(record["word"], str(record.get("notation", ""))),
                "(chains IN (SELECT chains FROM called WHERE name IN (SELECT id FROM names WHERE text GLOB ?)) "
                "OR word GLOB ? OR bare GLOB ?)", (pattern,) * 3,
                lambda line: "\\" in line or has_legs(leading_word(line), written_text(line, "notation")))
        case "text":
            text = value.casefold()
            # lists and quotes are not written as they are read
            plain = re.fullmatch(r"[a-z0-9*+!.{|}()-]+( +[a-z0-9*+!.{|}()-]+)*", text) is not None
            return RecordCondition(
                lambda record: is_called(record, text) or any(text in str(each).casefold() for each in record.values()),
                None if APART in text else "(" + " OR ".join(
                    f"text_{field} IN (SELECT id FROM texts WHERE field = '{field}' AND instr(text, ?))"
                    for field in TEXTS) + " OR word LIKE ? ESCAPE '!')",
                (*(text,) * len(TEXTS), "%" + re.sub("[!%_]", r"!\g<0>", text) + "%"),
                (lambda line: text in line.casefold() or (
                    bool(called(text)) and kinds(leading_word(line)) in called(text))) if plain else None)
        case "legs":
            value = int(value)
        case "see":
            value = counted(sights(value))
        case "modes":
            name = "modes_bound"
    # 1 is True and 3.0 is 3: these are not so written
    exact = isinstance(value, str) or (isinstance(value, int) and abs(value) < 2**63 and isinstance(
        value, bool) == (name == "base_motors"))
    part = f"{json.dumps(name)}:{json.dumps(value)}" if exact else ""
    # a column of numbers takes a text that looks like one for it
    is_told = not (isinstance(value, str) and COLUMNS.get(name) == "INTEGER")
    return RecordCondition(
        lambda record: name in record and bool(record[name] == value),
        f'"{name}" = ?' if is_told else None, (value,), (lambda line: part in line) if exact else None)


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
