"""Records as lines: a head that says what they are, then a line of JSON each, as short as it can be and ASCII."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from ..budgets import LARGEST_RECORD
from ..errors import BadRequest
from .words import VERSION

Record = Mapping[str, Any]
"""What the catalog says of one architecture; a field that is missing is not known or does not apply."""

_LINE_START, _GROUP = '{"word":"', '","group":"'

FORMAT = 1
"""Version of the lines, the journal and the tables."""


def line(entry: Record) -> str:
    """A record as one line without its end: ``word`` and ``group`` first, then fields by name, none that is None."""
    first = {name: entry[name] for name in ("word", "group")}
    rest = {name: entry[name] for name in sorted(entry) if name not in first and entry[name] is not None}
    return json.dumps(first | rest, separators=(",", ":"), allow_nan=False)


def head(group: str, count: int | None = None) -> str:
    """The first line of a file; a journal's says no count."""
    counted = {} if count is None else {"count": count}
    return json.dumps({"format": FORMAT, "catalog": VERSION, "group": group, **counted}, separators=(",", ":"))


def read_head(text: str | bytes, file: str, otherwise: str, value: str | None, *needed: str) -> Mapping[str, Any]:
    """What a file's first line says; raises ``BadRequest`` for another version, and in these words for no head."""
    try:
        known = _loads(text)
        versions, *_ = (known["format"], known["catalog"]), *(known[name] for name in needed)
    except (ValueError, TypeError, KeyError):
        raise BadRequest(f"{otherwise}: its first line is not a header", value) from None
    require_version(versions, file)
    return dict(known)


def _loads(text: str | bytes) -> Any:
    """What a line holds; raises ``ValueError`` also for one that is too long or nested too deeply."""
    if len(text) > LARGEST_RECORD:
        raise ValueError("too long")
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def record(text: str) -> Record:
    """The record of a line; raises ``BadRequest`` where it holds none."""
    try:
        found = _loads(text)
        if isinstance(found["word"], str):
            return dict(found)
    except (ValueError, TypeError, KeyError):
        pass
    raise BadRequest("not a record of the catalog", text[:60], "an object of JSON with a word")


def word_of(text: str) -> str:
    """The word of a record's line."""
    return str(record(text)["word"])


def is_written(text: str) -> bool:
    """Whether a line is as :func:`line` writes it, and what is asked for would stand in it letter by letter."""
    return text.startswith(_LINE_START) and _GROUP in text and '": ' not in text and "\\u" not in text


def leading_word(text: str) -> str:
    """The word with which a line begins that :func:`line` wrote."""
    end = text.find('"', len(_LINE_START)) if text.startswith(_LINE_START) else -1
    return text[len(_LINE_START):end] if end > 0 else word_of(text)


def written_text(text: str, name: str) -> str:
    """The text of a field, without escaped letters, in a line that :func:`line` wrote; empty where there is none."""
    return text.partition(f'"{name}":"')[2].partition('"')[0]


def encode_lines(group: str, lines: Iterable[str]) -> bytes:
    """The bytes of a group's file, sorted by word, whatever the order of the lines."""
    ordered = sorted(lines, key=leading_word)
    return "".join(f"{each}\n" for each in [head(group, len(ordered)), *ordered]).encode("ascii")


def head_count(first: str | bytes, file: str) -> int:
    """The number of records that a file's first line says; raises ``BadRequest`` where it says none."""
    count = read_head(first, file, f"{file}: not a catalog file", None, "count")["count"]
    if not isinstance(count, int):
        raise BadRequest(f"{file}: number of records", count, "a whole number")
    return count


def decode_lines(content: bytes, file: str) -> list[str]:
    """The lines of a group's file; raises ``BadRequest`` for another version, a file cut off or of something else."""
    count, found = head_count(content.partition(b"\n")[0], file), content.count(b"\n") - 1
    if found != count or not content.endswith(b"\n"):
        raise BadRequest(f"{file}: truncated, records", found, str(count))
    try:
        return content.decode("ascii").split("\n")[1:-1]
    except UnicodeDecodeError:
        raise BadRequest(f"{file}: not a catalog file: not ASCII") from None


def require_version(found: tuple[object, object], file: str) -> None:
    """Raise ``BadRequest`` where a file is of another version of the format or of the catalog."""
    if found != (FORMAT, VERSION):
        raise BadRequest(f"{file}: a catalog of another version", "format {}, words {}".format(*found),
                         f"format {FORMAT}, words {VERSION}; build it again")
