"""Entries as lines: a head with versions and group, then a line of compact ASCII JSON per entry."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

from ..errors import BadRequest
from .architecture_key import ARCHITECTURE_KEY_VERSION

CATALOG_LINE_CHARACTERS_MAX = 100_000
"""Largest line of the catalog, and text in a SQLite file (characters)."""

Record = Mapping[str, Any]
"""Entry of one architecture; a missing field is unknown or does not apply."""

CHECKSUM = "crc32"
"""What the head of a file that is not packed calls the checksum of all lines behind it."""
LINE_START, _GROUP = '{"key":"', '","group":"'

JOURNAL_FORMAT_VERSION = 2
"""Version of the lines and the journal."""
REBUILD = "Build it again with hrsynth catalog build."
"""Remedy for a file that is damaged or of another version."""

TEXTS = (
    "key",
    "group",
    "notation",
    "hidden",
    "motion",
    "verdict",
    "condition",
    "modes_proof",
    "suggestion",
    "sensors",
    "refused",
)
COUNTS = (
    "legs",
    "dof",
    "mobility",
    "internal",
    "rank",
    "instances",
    "confirmed",
    "fewest",
    "motors",
    "motor_rank",
    "attempt",
    "modes_bound",
    "modes_seen",
)
FLAGS = ("exact", "driven", "base_motors")
LISTS = ("unobserved", "steps", "modes_legs")
"""Fields of a record by the kind of their values: texts, whole numbers, true or false, lists of texts."""
NEEDED = (
    "notation",
    "motion",
    "verdict",
    "legs",
    "dof",
    "mobility",
    "internal",
    "rank",
    "instances",
    "fewest",
    "motors",
    "exact",
    "base_motors",
)
"""Fields of a record that is not refused."""


def format_line(entry: Record) -> str:
    """A record as one line without its end: ``key`` and ``group`` first, then fields by name, none that is None."""
    first = {name: entry[name] for name in ("key", "group")}
    rest = {name: entry[name] for name in sorted(entry) if name not in first and entry[name] is not None}
    return json.dumps(first | rest, separators=(",", ":"), allow_nan=False)


def format_head(group: str, **more: object) -> str:
    """Return the first line of a file or journal."""
    return json.dumps(
        {"format": JOURNAL_FORMAT_VERSION, "catalog": ARCHITECTURE_KEY_VERSION, "group": group, **more},
        separators=(",", ":"),
    )


def read_head(text: str | bytes, file: str, otherwise: str, value: str | None, *needed: str) -> Mapping[str, Any]:
    """Read a file's first line; raises ``BadRequest`` for another version or no head."""
    try:
        known = _parse_json(text)
        versions, *_ = (known["format"], known["catalog"]), *(known[name] for name in needed)
    except (ValueError, TypeError, KeyError):
        raise BadRequest(f"{otherwise}: its first line is not a header", value, remedy=REBUILD) from None
    require_version(versions, file)
    return dict(known)


def _parse_json(text: str | bytes) -> Any:
    """Parse a line; raises ``ValueError`` also for one that is too long or nested too deeply."""
    if len(text) > CATALOG_LINE_CHARACTERS_MAX:
        raise ValueError("too long")
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def parse_record(text: str, file: str | None = None) -> Record:
    """The record of a line, each of its fields of the kind that all others rely on; raises ``BadRequest``, which names
    the file, where it is none."""
    try:
        found = _parse_json(text)
        wrong = _find_wrong_field(found) if isinstance(found, dict) else "a JSON object with a key"
    except ValueError:
        wrong = "a JSON object with a key"
    if wrong:
        raise BadRequest(
            "not a catalog entry" if file is None else f"{file}: not a catalog entry", text[:60], wrong, remedy=REBUILD
        )
    return dict(found)


def _find_wrong_field(found: dict[str, Any]) -> str:
    """Return the first defect of an entry, empty if there is none."""
    for name in ("key", "group", *(() if "refused" in found else NEEDED)):
        if name not in found:
            return f"a JSON object with a {name}"
    for names, kind, said in ((TEXTS, str, "a text"), (COUNTS, int, "an integer"), (FLAGS, bool, "true or false")):
        for name in names:
            if name in found and type(found[name]) is not kind:
                return f"{name}: {said}"
    for name in LISTS:
        if not _is_list_of(found.get(name, []), str):
            return f"{name}: a list of texts"
    if not (_is_list_of(legs := found.get("minimal", []), list) and all(_is_list_of(each, str) for each in legs)):
        return "minimal: a list of lists of texts"
    if not (_is_list_of(choices := found.get("choices", []), dict) and all(map(_is_choice, choices))):
        return "choices: a list of objects with joints and rank"
    for name in found.keys() - {*LISTS, "minimal", "choices"}:
        if isinstance(found[name], list | dict):
            return f"{name[:60]}: no list and no object"
    if "modes_bound" in found and "modes_seen" not in found:
        return "modes_seen with modes_bound"
    return ""


def _is_list_of(values: Any, kind: type) -> bool:
    """Return True for a list of values of a kind."""
    return type(values) is list and all(type(each) is kind for each in values)


def _is_choice(each: dict[str, Any]) -> bool:
    legs: Any = each.get("joints")
    return (
        type(each.get("rank")) is int
        and _is_list_of(legs, list)
        and legs != []
        and all(_is_list_of(joints, int) for joints in legs)
        and not any(isinstance(value, list | dict) for name, value in each.items() if name != "joints")
    )


def parse_word(text: str, file: str | None = None) -> str:
    """The word of a record's line."""
    return str(parse_record(text, file)["key"])


def is_written(text: str) -> bool:
    """Return True if a line has the form of :func:`get_line`, without escapes."""
    return text.startswith(LINE_START) and _GROUP in text and '": ' not in text and "\\u" not in text


def read_leading_word(text: str, file: str | None = None) -> str:
    """The word with which a line begins that :func:`get_line` wrote, else that of its record."""
    end = text.find('"', len(LINE_START)) if text.startswith(LINE_START) else -1
    return text[len(LINE_START) : end] if end > 0 else parse_word(text, file)


def encode_lines(group: str, lines: Iterable[str], *, checksum: bool = True) -> bytes:
    """The bytes of a group's file, sorted by word, whatever the order of the lines; their ``checksum`` stands in the
    head, but for a file that is packed: gzip has its own."""
    ordered = sorted(lines, key=read_leading_word)
    content = "".join(f"{each}\n" for each in ordered).encode("ascii")
    crc = {CHECKSUM: _compute_checksum(content)} if checksum else {}
    return format_head(group, count=len(ordered), **crc).encode("ascii") + b"\n" + content


def _compute_checksum(content: bytes) -> str:
    return f"{zlib.crc32(content):08x}"


def read_head_count(first: bytes, file: str) -> int:
    """Return the number of entries in a file's first line; raises ``BadRequest`` without one."""
    return int(_read_count(first, file)["count"])


def _read_count(first: bytes, file: str) -> Mapping[str, Any]:
    told = read_head(first, file, f"{file}: not a catalog file", None, "count")
    if type(told["count"]) is not int:
        raise BadRequest(f"{file}: number of entries", told["count"], "an integer", remedy=REBUILD)
    return told


def decode_lines(content: bytes, file: str) -> list[str]:
    """The lines of a group's file; raises ``BadRequest`` for another version, a file that is damaged, cut off or of
    something else."""
    first, _, rest = content.partition(b"\n")
    told, found = _read_count(first, file), rest.count(b"\n")
    if CHECKSUM in told and told[CHECKSUM] != (crc := _compute_checksum(rest)) and found >= told["count"]:
        raise BadRequest(f"{file}: damaged, checksum", crc, str(told[CHECKSUM]), remedy=REBUILD)
    if found != told["count"] or not content.endswith(b"\n"):
        raise BadRequest(f"{file}: truncated, entries", found, str(told["count"]), remedy=REBUILD)
    return rest.decode("ascii", "replace").split("\n")[:-1]


def require_version(found: tuple[object, object], file: str, wanted: int = JOURNAL_FORMAT_VERSION) -> None:
    """Raise ``BadRequest`` where a file is of another version of the format than ``wanted`` or of the catalog."""
    if found != (wanted, ARCHITECTURE_KEY_VERSION):
        raise BadRequest(
            f"{file}: a catalog of another version",
            "format {}, keys {}".format(*found),
            f"format {wanted}, keys {ARCHITECTURE_KEY_VERSION}",
            remedy=REBUILD,
        )
