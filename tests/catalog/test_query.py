"""Queries: what is found is what a plain reading of the records finds, from lines and from SQLite alike."""

from __future__ import annotations

import contextlib
import gzip
import json
import re
import sqlite3
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from catalog.stub import CHAINS, QUESTIONS, REFUSED, VERDICTS, WORKERS, entry, source, without_checksum
from hrsynth.catalog import Catalog, load
from hrsynth.catalog.architecture_key import ARCHITECTURE_KEY_VERSION, SENSORS
from hrsynth.catalog.build import build, check
from hrsynth.catalog.conditions import FIELDS, list_matching_lines
from hrsynth.catalog.jsonl import COUNTS, FLAGS, LISTS, Record, format_line, parse_record, parse_word
from hrsynth.catalog.jsonl import TEXTS as TEXT_FIELDS
from hrsynth.catalog.known import is_called
from hrsynth.catalog.query import list_field_values
from hrsynth.catalog.store import Database, Folder, locate_shipped_folder, write_tables
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest

ASKED = st.fixed_dictionaries(
    {},
    optional={
        "group": st.sampled_from(["c", "d", "e", ("c", "d")]),
        "dof": st.one_of(st.none(), st.integers(1, 7)),
        "motion": st.sampled_from(["2T", "3T", "3T1R", "3T2R", "6T"]),
        "verdict": st.sampled_from([*VERDICTS, VERDICTS[:2], "none"]),
        "base_motors": st.sampled_from([None, True, False]),
        "driven": st.sampled_from([None, True, False]),
        "motors": st.sampled_from(["R", "P+R"]),
        "parallelograms": st.sampled_from([None, True, False]),
        "fewest": st.integers(0, 6),
        "modes": st.integers(1, 9),
        "legs": st.one_of(
            st.integers(1, 7),
            st.sampled_from(["3", "?-R*", "*S", "6-UPS", "UPS", "R?R", "(c0?*)", "R-{*"]),
            st.sampled_from([f"4-{chain}" for chain in CHAINS]),
        ),
        "text": st.sampled_from(["ROTATION", "σ", "two lines", "(d", "nowhere", "", "['", "1\x1f"]),
    },
)


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("stores")
    build(folder / "lines", source=source((30, 20)))
    build(folder / "big.sqlite", source=source((30, 20)))
    return folder / "lines", folder / "big.sqlite"


def plainly(record: dict[str, Any], asked: dict[str, Any]) -> bool:
    """The meaning of a query, written down once more."""
    for name, value in asked.items():
        if value is None:
            continue
        values = value if isinstance(value, tuple) else (value,)
        if name == "text":
            held = " ".join(str(each) for each in record.values()).lower()
            met = any(each.lower() in held for each in values)
        elif name == "legs":
            met = any(plain_legs(record, str(each)) for each in values)
        elif name == "modes":
            met = record.get("modes_bound") in values
        elif name == "motors":  # words here have no letters of joints
            met = False
        elif name == "parallelograms":
            met = "refused" not in record and False in values
        else:
            met = name in record and record[name] in values
        if not met:
            return False
    return True


def plain_legs(record: dict[str, Any], wanted: str) -> bool:
    if wanted.isdigit():
        return record.get("legs") == int(wanted)
    pattern = "".join({"*": ".*", "?": "."}.get(letter, re.escape(letter)) for letter in wanted)
    notation = record.get("notation", "")
    chain = notation.split("-", 1)[-1]
    every = [form for name in (record["key"], notation, chain) for form in (name, name.replace("*", "")) if form]
    return any(re.fullmatch(pattern, form) for form in every)


@settings(max_examples=150, deadline=None)
@given(asked=ASKED)
def test_a_query_finds_what_a_plain_reading_finds(asked: dict[str, Any], stores: tuple[Path, Path]):
    lines, big = stores
    every = load(lines)
    wanted = [record["key"] for record in every if plainly(dict(record), asked)]
    assert [record["key"] for record in every.where(**asked)] == wanted
    assert [record["key"] for record in load(lines, **asked)] == wanted
    assert [record["key"] for record in load(big, **asked)] == wanted


ANY_FIELD = st.fixed_dictionaries(
    {},
    optional={
        "dof": st.sampled_from([2, 3, 3.0, 7]),
        "base_motors": st.sampled_from([True, False, 1, 0]),
        "verdict": st.sampled_from([*VERDICTS, ("controllable", "uncontrollable"), "no"]),
        "legs": st.sampled_from([3, "3", "4", "?-R*", "*RP*", (2, "3-*")]),
        "modes": st.sampled_from([6, "6", None]),
        "text": st.sampled_from(["hexaglide", "Delta", "RRR", "true", "1", "', '", " 2", "1, 2", "[", "lift 1", "ü"]),
    },
)


@settings(deadline=None)
@given(ANY_FIELD)
@pytest.mark.slow
def test_lines_are_left_unread_only_where_they_do_not_fit(asked: dict[str, Any]):
    """Whatever is asked for, and however the file was written."""
    lines, spaced, records = zip(*_every_line(), strict=True)
    found = list(list_matching_lines(lines, asked, parse_record))
    assert found == list(list_matching_lines(spaced, asked, parse_record))
    if isinstance(text := asked.get("text"), str):
        held = [
            i
            for i, each in enumerate(records)
            if is_called(each, text) or any(text.casefold() in str(value).casefold() for value in each.values())
        ]
        others = list_matching_lines(lines, asked | {"text": None}, parse_record)
        assert found == [i for i in others if i in set(held)]


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("text", ["takeover", "hexaglide", "3-R", "lift 1,2", "['1'", "controllable", "(Rz"])
def test_a_text_is_found_in_lines_as_in_records(text: str):
    assert list(load(text=text)) == list(load().where(text=text))


@cache
def _every_line() -> list[tuple[str, str, Record]]:
    """Some lines, how another program may write them, and their records."""
    kept = locate_shipped_folder()
    lines = [line for group in kept.groups() for line in kept.lines([group], {})][::97]
    return [(line, json.dumps(parse_record(line)), parse_record(line)) for line in lines]


def test_sqlite_holds_the_same_records(stores: tuple[Path, Path]):
    lines, big = stores
    assert list(load(lines)) == list(load(big))
    assert len(load(big)) == 100
    assert sorted(file.name for file in big.parent.iterdir()) == ["big.sqlite", "lines"]


@pytest.mark.parametrize("has", ["lines beside columns", "lines apart", "columns as arrays"])
def test_sqlite_files_of_older_versions_are_refused(has: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """In one line, which says what to do."""
    file = tmp_path / "older.sqlite"
    with contextlib.closing(sqlite3.connect(file)) as older:
        older.execute("CREATE TABLE versions (format INTEGER, catalog INTEGER)")
        older.execute("INSERT INTO versions VALUES (1, 1)")
        match has:
            case "lines beside columns":
                older.execute('CREATE TABLE records ("group", word, dof, line, PRIMARY KEY ("group", word))')
            case "lines apart":
                older.execute('CREATE TABLE records ("group", word, dof, PRIMARY KEY ("group", word))')
                older.execute("CREATE TABLE lines (record INTEGER PRIMARY KEY, line TEXT)")
            case _:
                older.execute("CREATE TABLE groups (name TEXT PRIMARY KEY, count INTEGER) WITHOUT ROWID")
                older.execute("CREATE TABLE lines (record INTEGER PRIMARY KEY, line TEXT)")
                older.execute("CREATE TABLE columns (name TEXT PRIMARY KEY, letters BLOB)")
        older.commit()
    for arguments in (["list"], ["list", "--dof", "3"], ["show", "Delta"], ["build", "planar", "--check"]):
        where = "-o" if "build" in arguments else "--catalog"
        assert run_command(["catalog", *arguments, where, str(file)]) == (3 if "build" in arguments else 2)
        (said,) = capsys.readouterr().err.splitlines()
        assert "another version: got 'format 1, keys 1', expected format 3, keys 1" in said


@pytest.mark.parametrize("name", FIELDS)
def test_values_of_a_field_are_those_of_all_records(name: str, stores: tuple[Path, Path]):
    lines, big = stores
    assert list_field_values(name, big) == list_field_values(name, lines) == load(lines).values(name)
    assert list_field_values(name, big) or name == "sensors"


@pytest.mark.parametrize(
    "change",
    [
        "DROP TABLE lines",
        "DROP TABLE texts",
        "DROP TABLE chains",
        "ALTER TABLE records RENAME COLUMN dof TO freedoms",
        "DELETE FROM lines",
        "UPDATE lines SET line = x'00'",
        "UPDATE lines SET line = 'no record'",
        "UPDATE groups SET name = 3 WHERE name = 'd'",
        "DELETE FROM groups WHERE name = 'd'",
    ],
)
def test_a_file_whose_tables_are_spoilt_is_told(change: str, stores: tuple[Path, Path], tmp_path: Path, capsys):
    file = tmp_path / "spoilt.sqlite"
    file.write_bytes(stores[1].read_bytes())
    with contextlib.closing(sqlite3.connect(file)) as opened:
        opened.execute(change)
        opened.commit()
    said = set()
    for asked in ([], ["--dof", "3"], ["--text", "lines"], ["--legs", "?-R*"]):
        status = run_command(["catalog", "list", *asked, "--catalog", str(file)])
        errors = capsys.readouterr().err
        assert len(errors.splitlines()) == (status == 2)
        assert "spoilt.sqlite: not a " in errors or status == 0
        said.add(status)
    assert 2 in said


ODD = [
    {"dof": "3"},
    {"dof": " 3"},
    {"modes": "4"},
    {"base_motors": "1"},
    {"dof": np.int64(3)},
    {"base_motors": np.True_},
    {"text": "\0"},
    {"text": "\0r"},
    {"legs": "*\0"},
    {"legs": "3-R*\0RR"},
    {"dof": 10**19},
    {"legs": "9" * 5000},
    {"modes": 10**5000},
    {"text": "\udcff"},
    {"motion": "\udcff"},
    {"text": "%" * 30_000},
    {"legs": "*" * 60_000},
    {"dof": tuple(range(1100))},
    {"dof": [3, 4]},
    {"legs": np.int64(3)},
    {"text": "strasse"},
    {"text": ""},
]
"""What SQLite takes for something else, or cannot be told."""


@pytest.mark.parametrize("asked", ODD, ids=range(len(ODD)))
def test_odd_questions_have_the_same_answer_everywhere(asked: dict[str, Any], stores: tuple[Path, Path]):
    lines, big = stores
    fit = [each for each in load(lines).where(**asked)]
    assert list(load(big, **asked)) == list(load(lines, **asked)) == fit


@pytest.mark.parametrize(
    "asked",
    [
        {"legs": 3.5},
        {"legs": b"3"},
        {"sensor": 3},
        {"text": 3},
        {"sensor": "9" * 5000 + "point"},
        {"motors": "X"},
        {"motors": ""},
    ],
    ids=range(7),
)
def test_what_no_record_can_have_is_refused(asked: dict[str, Any], stores: tuple[Path, Path]):
    for file in stores:
        with pytest.raises(BadRequest):
            load(file, **asked)


@pytest.mark.parametrize("line", ['{"key":"abc', '{"key":3}', "[]"])
def test_lines_that_are_cut_are_told(line: str, tmp_path: Path):
    text = f'{{"format":2,"catalog":{ARCHITECTURE_KEY_VERSION},"group":"g","count":1}}\n{line}\n'
    (tmp_path / "g.jsonl").write_text(text)
    with pytest.raises(BadRequest, match="not a catalog entry"):
        len(load(tmp_path).where(dof=3))


FIELDS_OF_A_RECORD = (*TEXT_FIELDS, *COUNTS, *FLAGS, *LISTS, "minimal", "choices")
OTHERS: tuple[Any, ...] = ("a", 3, 3.5, True, None, [], ["a"], [3], [["a"]], {}, [{}], {"a": {}})
"""Values of every kind."""


def commands(folder: Path, word: str) -> list[list[str]]:
    """What reads records."""
    return [
        ["catalog", "list", *asked, "--catalog", str(folder)]
        for asked in ([], ["--legs", "3"], ["--legs", "*R*"], ["--text", "x"], ["--modes", "1"], ["--motion", "3T"])
    ] + [["catalog", "show", word, "--catalog", str(folder)]]


@pytest.mark.some(6)
@pytest.mark.parametrize("field", FIELDS_OF_A_RECORD)
def test_a_record_with_a_field_of_another_kind_or_without_it_is_one_line(field: str, tmp_path: Path, capsys):
    """Never a defect; whatever its kind, a field either is refused or read."""
    word = "3(Rz*-Rz-Rz)"
    whole = dict(load(group="planar")[word])
    for value in ("gone", *OTHERS):
        odd = {name: each for name, each in whole.items() if (name, value) != (field, "gone")}
        odd |= {} if value == "gone" else {field: value}
        (tmp_path / "planar.jsonl").write_text(
            f'{{"format":2,"catalog":{ARCHITECTURE_KEY_VERSION},"group":"planar","count":1}}\n{json.dumps(odd)}\n'
        )
        for arguments in commands(tmp_path, word):
            status = run_command(arguments)
            said = capsys.readouterr()
            assert status == (2 if said.err else 0), (field, value, said)
            assert len(said.err.splitlines()) <= 1, (field, value, said)
    with pytest.raises(BadRequest, match=rf"planar|{re.escape(str(tmp_path))}"):
        list(load(tmp_path))


ODD_FILES = {
    "deep": b'{"key":' + 100_000 * b"[" + 100_000 * b"]" + b"}",
    "deep head": b"",
    "not UTF-8": b"\xff\xfe{}",
    "a list": b"[]",
    "empty line": b"",
    "a number": b"9" * 5000,
    "zeros": b"\0" * 40,
    "a surrogate": b'{"key":"\\ud800","group":"g"}',
}


@pytest.mark.some(5)
@pytest.mark.parametrize("name", ["empty", "a folder", "cut", "no gzip", *ODD_FILES])
def test_an_odd_file_is_one_line(name: str, tmp_path: Path, capsys):
    head = f'{{"format":2,"catalog":{ARCHITECTURE_KEY_VERSION},"group":"g","count":1}}\n'.encode()
    file = tmp_path / "g.jsonl"
    match name:
        case "empty":
            file.touch()
        case "a folder":
            file.mkdir()
        case "cut" | "no gzip":
            data = gzip.compress(head + format_line({**entry("(c00)"), "group": "g"}).encode() + b"\n")
            (tmp_path / "g.jsonl.gz").write_bytes(data[: len(data) - 9] if name == "cut" else head)
        case "deep head":
            file.write_bytes(100_000 * b"[" + b"\n")
        case _:
            file.write_bytes(head + ODD_FILES[name] + b"\n")
    for arguments in (
        *commands(tmp_path, "3(Rz*-Rz-Rz)"),
        ["catalog", "build", "planar", "--check", "-o", str(tmp_path)],
        ["catalog", "site", "--catalog", str(tmp_path), "-o", str(tmp_path / "site")],
    ):
        status = run_command(arguments)
        said = capsys.readouterr()
        if "show" not in arguments or status:  # it may be of another group
            assert (status, len(said.err.splitlines())) == (3 if "--check" in arguments else 2, 1), (arguments, said)
            assert str(tmp_path) in said.err
        assert "defect of hrsynth" not in said.err


def test_a_line_with_other_spaces_or_letters_is_read(tmp_path: Path):
    one, other = (
        format_line({**entry("(c00)"), "key": word, "group": "g", "dof": 3, "verdict": verdict, "suggestion": cure})
        for word, verdict, cure in (("a", "controllable", None), ("b", "no", "Straße"))
    )
    assert "Stra\\u00dfe" in other
    one = one.replace('"dof":', ' "dof": ').replace("controllable", "controll\\u0061ble")
    (tmp_path / "g.jsonl").write_text(
        f'{{"format":2,"catalog":{ARCHITECTURE_KEY_VERSION},"group":"g","count":2}}\n{one}\n{other}\n'
    )
    assert len(load(tmp_path, dof=3)) == 2
    assert [each["key"] for each in load(tmp_path, verdict="controllable")] == ["a"]
    assert [each["key"] for each in load(tmp_path, text="strasse")] == ["b"]


@pytest.mark.parametrize("every", [pytest.param(7, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.long)])
def test_sqlite_answers_as_the_lines_do(every: int, tmp_path: Path):
    """What may be asked about the shipped catalog, or every seventh record of it; how long it takes stands in
    ``benchmarks/others.py``."""
    kept, folder, file = locate_shipped_folder(), Folder(tmp_path / "lines"), tmp_path / "all.sqlite"
    folder.path.mkdir()
    groups = {group: kept.lines([group], {})[::every] for group in kept.groups()}
    write_tables(file, groups)
    for group, some in groups.items():
        folder.write(group, some)
    lines = {parse_word(line): line for some in groups.values() for line in some}
    names = [group for group in kept.groups() if group != SENSORS]
    for asked in (*QUESTIONS, {"text": "lift 1"}):
        found = Database(file).lines(names if asked.get("sensor") is None else [SENSORS], asked)
        words = load(folder.path, **asked).words
        assert list(found) == [lines[word] for word in words], asked
        assert load(file, **asked).words == words, asked


def test_sqlite_has_the_same_bytes_however_it_was_built(stores: tuple[Path, Path], tmp_path: Path):
    other = tmp_path / "big.sqlite"
    build(other, source=source((30, 20)), limit=13)
    build(other, ["d"], source=source((30, 20)))
    build(other, source=source((30, 20)), workers=WORKERS)
    assert other.read_bytes() == stores[1].read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["big.sqlite"]


def test_a_catalog_is_a_collection(stores: tuple[Path, Path]):
    every = load(stores[0])
    assert len(list(every)) == len(every) == 100
    words = [(record["group"], record["key"]) for record in every]
    assert words == sorted(words)
    assert every["(c05*)"]["key"] == "(c05*)"
    assert "(c05*)" in every
    assert every[REFUSED]["refused"] == f"{REFUSED}: refused on two lines"
    counts = every.count("group", "verdict")
    assert sum(counts.values()) == 100
    for (group, verdict), number in counts.items():
        fit = every.where(group=group, verdict=verdict) if verdict else every.where(text="refused on")
        assert len(fit) == number
    assert list(every.where(dof=3).where(verdict="controllable")) == list(every.where(verdict="controllable", dof=3))


def test_words_are_found_however_they_are_spelt():
    catalog = Catalog(({"key": "2(Rz*-Rz-Rz)", "group": "planar"},))
    assert catalog["(Rz*-Rz-Rz)+(Rz*-Rz-Rz)"] is catalog.records[0]
    with pytest.raises(BadRequest, match=r"key 3\(Rz\*-Rz-Rz\): not in the catalog. Use 2\(Rz\*-Rz-Rz\)"):
        _ = catalog["3(Rz*-Rz-Rz)"]
    with pytest.raises(BadRequest, match="unknown joint"):
        _ = catalog["3(Qz*-Rz-Rz)"]


def test_the_package_has_its_catalog():
    assert hrsynth.catalog.load is load


def test_what_cannot_be_asked_or_read_is_refused(stores: tuple[Path, Path], tmp_path: Path):
    lines, big = stores
    with pytest.raises(BadRequest, match="unknown criterion: got 'colour'"):
        load(lines, colour="red")
    with pytest.raises(BadRequest, match="nowhere: not found"):
        load(tmp_path / "nowhere")
    with pytest.raises(BadRequest, match="no catalog"):
        load(tmp_path)
    text = tmp_path / "text.sqlite"
    text.write_text("no database, but long enough to be looked at as one" * 20)
    with pytest.raises(BadRequest, match="not a catalog file"):
        load(text)
    with pytest.raises(BadRequest, match="not a catalog file"):
        build(text, source=source())
    newer = tmp_path / "newer.sqlite"
    newer.write_bytes(big.read_bytes())
    with sqlite3.connect(newer) as file:
        file.execute("UPDATE versions SET format = 7")
    for refuse in (load, lambda path: build(path, source=source())):
        with pytest.raises(BadRequest, match="another version: got 'format 7, keys 1', expected format 3, keys 1"):
            refuse(newer)


def test_a_fresh_catalog_is_not_stale(stores: tuple[Path, Path]):
    for path in stores:
        assert check(path, source=source((30, 20))) == ()
        assert check(path, source=source((30, 20)), sample=3, workers=WORKERS) == ()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"internal":0', '"internal":1', "c: 59 of 60 compared with other records today, the first (c00)"),
        ('"catalog":1', '"catalog":8', "another version"),
        ('"count":60', '"count":61', "truncated, entries: got 60, expected 61"),
        ('{"key":"(c01)"', '{"key":"(b01)"', "c: 1 missing, the first (c01)"),
        ('{"key":"(c01)"', '{"key":"(b01)"', "c: 1 no longer of the group, the first (b01)"),
        ('{"key":"(c01)"', '{"key":"(c90)"', "is not sorted"),
        ('{"key":"(c01)"', '{"keys":"(c01)"', "not a catalog entry"),
        ('{"key":"(c01)"', '"key":"(c01)"', "not a catalog entry"),
    ],
)
def test_what_is_stale_is_told(old: str, new: str, said: str, stores: tuple[Path, Path], tmp_path: Path):
    for file in stores[0].iterdir():
        text = without_checksum(file.read_text())
        (tmp_path / file.name).write_text(text.replace(old, new, -1 if "internal" in old else 1))
    stale = check(tmp_path, ["c"], source=source((30, 20)))
    assert any(said in each for each in stale), stale
    assert all("\n" not in each for each in stale)


def test_a_missing_group_is_stale(stores: tuple[Path, Path], tmp_path: Path):
    assert [each[:2] for each in check(tmp_path, source=source((30, 20)))] == ["c:", "d:"]
    (tmp_path / "c.jsonl").write_bytes((stores[0] / "c.jsonl").read_bytes())
    assert len(check(tmp_path, source=source((30, 20)))) == 1
    assert check(tmp_path, source=source((31, 20)), sample=0) == (
        "c: 2 missing, the first (c30)",
        check(tmp_path, ["d"], source=source((30, 20)))[0],
    )
    build(tmp_path / "one.sqlite", ["c"], source=source((30, 20)))
    assert check(tmp_path / "one.sqlite", source=source((30, 20))) == (f"d: not in {tmp_path / 'one.sqlite'}",)
