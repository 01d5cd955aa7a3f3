"""Questions of a designer, each one command over all that is shipped: a plain count of the lines gives the answer."""

from __future__ import annotations

import gzip
import json
import re
import shlex
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from hrsynth.catalog import load
from hrsynth.catalog.store import ALL, Database, locate_shipped_folder, store
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest

JOINT = re.compile(r"(2SS|2US|Pi|R|P|C|U|S)[a-z]*([*]?)!?")
QUESTIONS: dict[str, tuple[str, dict[str, Any], int]] = {
    "3T1R, R motors at the base, two legs observed": (
        "--motion 3T1R --motors R --base-motors --verdict controllable --fewest 2",
        {"motion": "3T1R", "motors": {"R"}, "base_motors": True, "verdict": "controllable", "fewest": 2},
        17,
    ),
    "the same whose motors determine all freedoms, without parallelograms": (
        "--motion 3T1R --motors R --base-motors --verdict controllable --fewest 2 --driven --no-parallelograms",
        {
            "motion": "3T1R",
            "motors": {"R"},
            "base_motors": True,
            "verdict": "controllable",
            "fewest": 2,
            "driven": True,
            "parallelograms": False,
        },
        9,
    ),
    "translations by linear motors at the base": (
        "--motion 3T --motors P --base-motors --driven --no-parallelograms --verdict controllable",
        {
            "motion": "3T",
            "motors": {"P"},
            "base_motors": True,
            "driven": True,
            "parallelograms": False,
            "verdict": "controllable",
        },
        401,
    ),
    "planar robots with moving R motors": (
        "--motion 2T1R --motors R --moving-motors --legs 3 --fewest 3",
        {"motion": "2T1R", "motors": {"R"}, "base_motors": False, "legs": 3, "fewest": 3},
        2663,
    ),
    "both kinds of motors, parallelograms, not controllable": (
        "--motion 3T --motors P+R --parallelograms --verdict 'partially controllable'",
        {"motion": "3T", "motors": {"P", "R"}, "parallelograms": True, "verdict": "partially controllable"},
        979,
    ),
}
"""Options, what they mean of :func:`convert_to_json`, and how many there are."""


@cache
def plain() -> tuple[dict[str, Any], ...]:
    """All lines but those of sensors, with what a designer asks for, read from words and choices of motors."""
    folder, found = locate_shipped_folder().path, []
    for file in [*folder.glob("*.jsonl*"), *(folder / "published").glob("*.jsonl*")]:
        text = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
        found += [_with_motors(json.loads(line)) for line in text.splitlines()[1:] if b'"refused"' not in line]
    return tuple(each for each in found if each["group"] != "sensors")


def _with_motors(record: dict[str, Any]) -> dict[str, Any]:
    if "choices" not in record:
        joints = [
            JOINT.fullmatch(part) for leg in re.findall(r"[(]([^()]*)[)]", record["key"]) for part in leg.split("-")
        ]
        return record | {
            "motors": {each[1] for each in joints if each and each[2]},
            "parallelograms": any(each is None or each[1] in ("Pi", "2SS", "2US") for each in joints),
        }
    letters = record["key"].lstrip("P").lstrip("0123456789")
    working = [each for each in record["choices"] if each["rank"] == record["dof"]] or record["choices"]
    return record | {"motors": {letters[j - 1] for leg in working[0]["joints"] for j in leg}, "parallelograms": False}


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
def test_a_question_is_answered_as_a_plain_count_answers_it(question: str, capsys: pytest.CaptureFixture[str]):
    options, asked, count = QUESTIONS[question]
    assert run_command(["catalog", "list", *shlex.split(options), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    wanted = [each["key"] for each in plain() if all(each[name] == value for name, value in asked.items())]
    assert sorted(each["key"] for each in told["entries"]) == sorted(wanted)
    assert len(wanted) == count
    assert {each["group"] for each in plain()} == set(told["groups"])
    assert told["total"] == sum(store(ALL).count(name) for name in told["groups"])


def test_sqlite_files_answer_as_lines_do(tmp_path: Path):
    groups = [name for name in ("deltas", "3T1R") if name in store(ALL).groups()]
    file, lines = tmp_path / "some.sqlite", store(ALL)
    for name in groups:
        Database(file).write(name, lines.lines([name], {})[::5])
    for asked in (
        {"motors": "R", "driven": True},
        {"motors": ("P", "P+R"), "base_motors": False},
        {"parallelograms": False, "motion": "3T1R"},
        {"driven": False, "parallelograms": True},
    ):
        assert [each["key"] for each in load(file, **asked)] == [each["key"] for each in load(file).where(**asked)]


@pytest.mark.parametrize(
    ("option", "value", "known"),
    [
        ("--text", "", "a name or a text"),
        ("--text", "  ", "a name or a text"),
        ("--motors", "X", "R, P, C, U"),
        ("--motors", "", "R, P, C, U"),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in [("--text", "Quatro", "Quattro"), ("--motion", "SCARA", "3T1R"), ("--modes", "9999", "1, 2, 4")]
        ),
    ],
)
def test_a_search_that_cannot_be_understood_is_refused(
    option: str, value: str, known: str, capsys: pytest.CaptureFixture[str]
):
    assert run_command(["catalog", "list", f"{option}={value}"]) == 2
    said = capsys.readouterr()
    assert (said.out, len(said.err.splitlines())) == ("", 1)
    assert known in said.err


def test_motors_of_no_kind_are_refused():
    with pytest.raises(BadRequest, match="R, P, C, U"):
        load(ALL, motors="R+")
