"""Criteria of entries as SQL, for SQLite files and for lines in memory."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from ..errors import BadRequest
from .architecture_key import LONGEST_COUNT, MOVED, count_equal, parse_observations
from .jsonl import (
    CATALOG_LINE_CHARACTERS_MAX,
    FLAGS,
    LINE_START,
    REBUILD,
    Record,
    is_written,
    parse_record,
    read_leading_word,
)
from .known import find_named_kinds, list_known_names, list_leg_kinds

FIELDS = (
    "key",
    "group",
    "notation",
    "legs",
    "dof",
    "motion",
    "verdict",
    "base_motors",
    "driven",
    "fewest",
    "sensors",
    "modes_bound",
)
"""Fields of a record that have a column of their own."""
COLUMNS: Mapping[str, str] = {
    **{name: f"json_extract(line, '$.{name}')" for name in FIELDS},
    "drives": """iif(json_type(line, '$.refused') IS NULL, driven_kinds(json_extract(line, '$.key'),
        json_extract(line, '$.choices'), json_extract(line, '$.dof')), NULL)""",
    "parallelograms": """iif(json_type(line, '$.refused') IS NULL,
        max(instr(json_extract(line, '$.key'), 'Pi'), instr(json_extract(line, '$.key'), '2SS'),
            instr(json_extract(line, '$.key'), '2US')) > 0, NULL)""",
    "text_id": "text_id(line)",
}
"""The columns of the table of records, and how each comes from a record's line. ``drives``: the kinds of driven joints;
``parallelograms``: whether a leg has one, or two equal parallel rods; ``text_id``: the row of its text in the table
``texts``."""
BETWEEN = "\uffff"
"""Separator of texts, which no search text contains."""
SQLITE_PATTERN_MAX_BYTES = 50_000
"""Bytes of a pattern, above which SQLite takes none."""


LineTest = Callable[[str], bool]


@dataclass(frozen=True)
class RecordCondition:
    """Criterion of one name."""

    where: str
    """In SQL, ``{0}`` for the value."""
    read: Callable[[Any], Any]
    """Converter of the value for SQL: None if no entry has it. Raises ``BadRequest`` for an impossible value."""
    hint: Callable[[Any], LineTest] | None = None
    """Quick test of a line; None if all lines may fit."""


def _normalise_value(value: Any) -> Any:
    """Return a value that a field may have, else None."""
    if isinstance(value, str):
        return None if re.search("[\ud800-\udfff]", value) else value
    fits = isinstance(value, float) or (isinstance(value, int) and abs(value) < 2**63)
    return value if fits else None


def _escape_letters(text: str) -> str:
    letters = sorted(set(text.split("+")))
    if not set(letters) <= set(MOVED):
        raise BadRequest("motors", text, MOVED, remedy="Join several by +.")
    return "+".join(letters)


def _convert_pattern(text: str) -> str | None:
    """A pattern of ``*`` and ``?``, in which brackets stand for themselves."""
    found = _normalise_value(re.sub(r"\*+", "*", text).replace("[", "[[]"))
    return None if found is None or "\0" in found or len(found.encode()) > SQLITE_PATTERN_MAX_BYTES else found


def _normalise_text(text: str) -> bytes | None:
    """Return a text as it is searched."""
    return None if BETWEEN in text else text.casefold().encode("utf-8", "surrogatepass")


def _match_field(name: str, read: Callable[[Any], Any] = _normalise_value) -> RecordCondition:
    """Make the criterion that a field has a value; 1 equals True, and 3 equals 3.0, though written differently."""
    exact = (str, bool if name in FLAGS else int)

    def hint(value: Any) -> LineTest:
        part = f'"{name}":{json.dumps(value)}' if type(value) in exact else ""
        return lambda line: part in line

    return RecordCondition(f'"{name}" = {{0}}', read, hint)


def _make_line_test(sought: bytes | None) -> LineTest:
    """Make the test that a text may occur in a line, or in a name of its robot."""
    text = (sought or b"").decode("utf-8", "surrogatepass")
    called = find_named_kinds(text)
    if not re.fullmatch(r"[a-z0-9*+!.{|}()-]+( +[a-z0-9*+!.{|}()-]+)*", text):
        return lambda line: True
    return lambda line: text in line.casefold() or (bool(called) and list_leg_kinds(read_leading_word(line)) in called)


CONDITIONS: Mapping[str, RecordCondition] = {
    "group": _match_field("group"),
    "dof": _match_field("dof"),
    "motion": _match_field("motion"),
    "verdict": _match_field("verdict"),
    "base_motors": _match_field("base_motors"),
    "driven": _match_field("driven"),
    "motors": RecordCondition("drives = {0}", _escape_letters),
    "parallelograms": RecordCondition("parallelograms = {0}", _normalise_value),
    "fewest": _match_field("fewest"),
    "sensor": _match_field("sensors", lambda text: count_equal(parse_observations(text))),
    "modes": _match_field("modes_bound"),
    "legs": _match_field("legs", lambda number: _normalise_value(int(number))),
    "text": RecordCondition(
        "(text_id IN (SELECT text_id FROM texts WHERE instr(text, {0})) OR instr(lower(key), {0}))",
        _normalise_text,
        _make_line_test,
    ),
}
"""Criteria by name."""
LEG_PATTERN = RecordCondition(
    """(key GLOB {0} OR replace(key, '*', '') GLOB {0}
        OR notation IN (SELECT notation FROM chains WHERE chain GLOB {0}))""",
    _convert_pattern,
)
"""Criterion ``legs`` with a pattern."""


def require_askable(asked: Mapping[str, Any]) -> None:
    """Raise ``BadRequest`` for an unknown criterion."""
    for name in asked:
        if name not in CONDITIONS:
            raise BadRequest("unknown criterion", name, tuple(CONDITIONS))


@dataclass(frozen=True)
class RecordQuestion:
    """All given criteria as SQL with their values."""

    where: str
    values: Sequence[Any]
    hints: Sequence[LineTest]
    """Quick tests of lines, one per value."""

    @classmethod
    def of(cls, *asked: tuple[str, Any]) -> RecordQuestion:
        """Combine criteria; of several values in a tuple or list one must fit. Raises ``BadRequest`` for an impossible
        value."""
        clauses, values, hints = list[str](), list[Any](), list[LineTest]()
        for name, value in asked:
            terms = []
            for each in value if isinstance(value, tuple | list) else () if value is None else (value,):
                condition, told = _build_condition(name, each.item() if hasattr(each, "item") else each)
                values.append(told)
                hints += [condition.hint(told)] if condition.hint else []
                terms.append(condition.where.format(f"?{len(values)}"))
            if value is not None:
                clauses.append(_join_alternatives(terms))
        return cls(" AND ".join(clauses), values, hints)

    def columns(self) -> list[str]:
        """The columns that are looked at."""
        return [name for name in COLUMNS if re.search(rf"\b{name}\b", self.where)]

    def rows(self, file: sqlite3.Connection) -> list[int]:
        """The numbers of the records that fit, in order."""
        asked = f"SELECT record FROM records WHERE {self.where or 1} ORDER BY record"
        return [row for (row,) in file.execute(asked, self.values)]


def _build_condition(name: str, value: Any) -> tuple[RecordCondition, Any]:
    """Return the criterion of one value, and the value for SQL."""
    of_texts = name in ("legs", "sensor", "text", "motors")
    if of_texts and not isinstance(value, str) and (name, type(value)) != ("legs", int):
        raise BadRequest(name, value, "an integer or a text" if name == "legs" else "a text")
    counted = name != "legs" or isinstance(value, int) or (value.isdecimal() and len(value) <= LONGEST_COUNT)
    condition = CONDITIONS[name] if counted else LEG_PATTERN
    return condition, condition.read(value)


def _join_alternatives(terms: Sequence[str]) -> str:
    """One of these; SQLite takes no deep nesting."""
    if len(terms) < 3:
        return f"({' OR '.join(terms or ['key IS 0'])})"
    half = len(terms) // 2
    return f"({_join_alternatives(terms[:half])} OR {_join_alternatives(terms[half:])})"


def fill(
    file: sqlite3.Connection,
    lines: Sequence[str],
    columns: Sequence[str] = tuple(COLUMNS),
    read: Callable[[str], Record] = parse_record,
) -> None:
    """Make the tables of records, with these columns: the same bytes for the same lines. Raises what ``read`` raises
    for a line that is no record."""
    texts: dict[bytes, int] = {}
    file.create_function("driven_kinds", 3, list_motor_kinds, deterministic=True)
    file.create_function("chains_of", 1, list_chain_names, deterministic=True)
    file.create_function("text_id", 1, lambda line: texts.setdefault(_collect_texts(read(line)), len(texts)))
    names = ", ".join(f'"{name}"' for name in columns)
    told = ", ".join(COLUMNS[name] for name in columns)
    file.execute(f"CREATE TABLE records (record INTEGER PRIMARY KEY, {names})")
    file.execute("CREATE TABLE texts (text_id INTEGER PRIMARY KEY, text)")
    file.execute("CREATE TABLE chains (notation, chain)")
    try:
        file.executemany(
            f"INSERT INTO records ({names}) SELECT {told} FROM (SELECT ? AS line)", zip(lines, strict=True)
        )
    except sqlite3.Error:
        for line in lines:
            read(line)
        raise
    file.executemany("INSERT INTO texts VALUES (?, ?)", ((number, text) for text, number in texts.items()))
    if "notation" in columns:
        file.execute(
            """INSERT INTO chains SELECT notation, value FROM (SELECT DISTINCT notation FROM records ORDER BY 1),
            json_each(chains_of(notation))"""
        )


def list_matching_lines(lines: Sequence[str], asked: Mapping[str, Any], read: Callable[[str], Record]) -> Sequence[int]:
    """Return the indices of the lines that fit: quick tests first, then one criterion after the other. Entries are read
    for texts only; raises what ``read`` raises for lines that are no entries."""
    questions = [RecordQuestion.of((name, asked[name])) for name in CONDITIONS if asked.get(name) is not None]
    hinted = [each.hints for each in questions if len(each.hints) == len(each.values)]

    def may_fit(line: str) -> bool:
        return not is_written(line) or all(any(may(line) for may in hints) for hints in hinted)

    left: Sequence[int] = [i for i, line in enumerate(lines) if may_fit(line)] if hinted else range(len(lines))
    for question in questions:
        left = [left[i] for i in _select_lines([lines[i] for i in left], question, read)]
    return left


def _select_lines(lines: Sequence[str], question: RecordQuestion, read: Callable[[str], Record]) -> Sequence[int]:
    for line in lines:
        if not line.startswith(LINE_START):
            read(line)
    try:
        with closing(sqlite3.connect(":memory:")) as memory:
            memory.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, CATALOG_LINE_CHARACTERS_MAX)
            fill(memory, lines, question.columns(), read)
            return [row - 1 for row in question.rows(memory)]
    except sqlite3.Error as error:
        raise BadRequest("not a catalog entry", str(error)[:60], remedy=REBUILD) from None


def _collect_texts(found: Record) -> bytes:
    """All texts of a record, with the names under which its robot is known; a word is sought apart, but for one with
    letters of which SQLite knows no small ones."""
    values = [str(value) for name, value in found.items() if name != "key" or not value.isascii()]
    return BETWEEN.join([*values, list_known_names(found)]).casefold().encode("utf-8", "surrogatepass")


def list_motor_kinds(word: str, choices: str | None, dof: int) -> str:
    """Return the kinds of actuated joints ("R", "P+R") marked in a key; of a published robot those of the first choice
    of motors that determines all dof, else of the first choice."""
    listed = json.loads(choices or "[]")
    if not listed:
        return "+".join(sorted(set(re.findall(r"([RPCU])[a-z]*\*", word))))
    chosen = next((each for each in listed if each["rank"] == dof), listed[0])
    chain = re.match(r"P[0-9]+?([RP]+)", word)
    letters = chain[1] if chain else ""
    return "+".join(sorted({letters[j - 1] for leg in chosen["joints"] for j in leg if 0 < j <= len(letters)}))


def list_chain_names(notation: str | None) -> str:
    """The names by which legs are found beside the word, as a list of JSON: notation and each leg's chain, with and
    without the marks of motors."""
    text = notation or ""
    found = {text, *(re.sub(r"^[0-9]+-", "", term) for term in re.split(r"\+(?![^{]*})", text))}
    return json.dumps(sorted({name for each in found if each for name in (each, each.replace("*", ""))}))
