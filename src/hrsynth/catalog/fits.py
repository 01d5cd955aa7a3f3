"""Whether a record fits what is asked for."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

from ..errors import BadRequest
from .jsonl import Record
from .words import counted, sights

EXACT = ("group", "dof", "motion", "verdict", "base_motors", "fewest", "see")
"""Fields that have to be equal to what is asked for."""
ASKED = (*EXACT, "modes", "legs", "text")
"""What can be asked for."""


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
    return any(name == value or fnmatchcase(name, plain_brackets(value)) for name in names(record))


def names(record: Record) -> set[str]:
    """The names by which legs are found: word, notation and each leg's chain, with and without the marks of motors."""
    notation = str(record.get("notation", ""))
    found = {str(record["word"]), notation}
    for term in re.split(r"\+(?![^{]*})", notation):
        found.add(re.sub(r"^[0-9]+-", "", term))
    return {name for each in found if each for name in (each, each.replace("*", ""))}


def plain_brackets(pattern: str) -> str:
    """A pattern in which brackets stand for themselves."""
    return pattern.replace("[", "[[]")


def texts(record: Record) -> list[str]:
    """Where a text is sought: the values of all fields, and the names under which the robot is known, casefolded."""
    from .site.known import known_as

    return [str(each).casefold() for each in (*record.values(), known_as(record))]
