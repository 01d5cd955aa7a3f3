"""The JSON of every command is what its type says: schemas are made of types, real answers held against them."""

from __future__ import annotations

import json
import shlex
from copy import deepcopy
from functools import wraps
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import hrsynth
from hrsynth.cli import run_command
from hrsynth.cli.schema import build_schema, format_schema_page, list_json_commands
from hrsynth.index import list_analyses
from hrsynth.present.outputs import list_file_fields
from hrsynth.results import Result

QUICK = {
    "derive": [
        "quattro --observe 1,4",
        "3ppr_m1",
        "uranesx --observe 1,2 --form general",
        "quattro --observe 1,4 -o hidden.urdf",
    ],
    "legs": ["3rrr_m1", "uranesx"],
    "check": [
        "delta --at x=0.02,y=0.1,z=-0.62",
        "gough_stewart --grid x=0:0.01:2,rpy=0/0/0",
        "i4l",
        "rrrrr_m1 --at x=0,y=0.3332050807568877 --grid x=-0.4:0.4:3,y=0.25:0.41:3 -o map.csv",
    ],
    "singularities": ["rrrrr_m1 --points 30", "uranesx --points 5", "hexaglide --points 5"],
    "advise": ["uranesx", "quattro --observe 1,4", "gough_stewart --observe 1", "i4l --observe 1,2"],
    "branch": ["rrrrr_m1 --box shoulder_1=-0.05:0.05,shoulder_2=-0.05:0.05"],
    "modes": [
        "3rrr_m1",
        "delta --observe 1",
        "3rps",
        "quattro --observe 1,3 --at x=0.05,y=0.1,z=-0.7,phi=10deg",
        "3rrr_m1 --real --at x=0.02,phi=5deg",
    ],
    "aspects": ["3rrr_m1 --observe 2,1,3"],
    "path": ["quattro --observe 1,4 --start x=0.05 --goal x=-0.05,phi=20deg", "3rps --start z=0.5 --goal z=0.51"],
    "equilibria": ["rrrrr_m1 --goal x=0,y=0.2", "rprpr_m1 --goal x=0 --complete"],
    "servo": [
        "rrrrr_m1 --start x=0,y=0.2 --goal x=0.02,y=0.22",
        "rrrrr_m1 --start x=0,y=0.2 --goal x=0.02,y=0.22 --noise 0.1deg --time 3",
    ],
    "basins": ["3rrr_m1 --goal x=0,y=0,phi=0 --grid x=-0.01:0.01:2,y=0,phi=0 --jobs 1"],
    "accuracy": [
        "delta --cone 0.1deg --at x=0.1",
        "rrrrr_m1 --cone 0.1deg --at x=0,y=0.3332050807568877",
        "rrrrr_m1 --cone 0.1deg --grid x=0:0.02:2,y=0.2:0.22:2 --nonlinear 4",
        "3rrr_m1 --cone 0.1deg --grid x=0:0.02:2,y=0:0.02:2 -o sweep.npy",
    ],
    "select": ["rrrrr_m1 --start x=0.05 --goal x=-0.01,y=0.03 --runs 1 --visible-from auto"],
    "export": [
        "prrrp_m1 -o tracker.hpp",
        "prrrp_m1 --jumps --box guide_1=-0.001:0.001,guide_2=-0.001:0.001 -o code.hpp",
        "prrrp_m1 --lang python --box guide_1=-0.001:0.001,guide_2=-0.001:0.001 -o code.py",
    ],
    "view": ["rrrrr_m1 --static view.html"],
    "verify": ["c.json"],
    "lint": ["quattro --program mujoco --fail-on nothing", "delta --compare 3rrr_m1 --fail-on nothing"],
    "robots": ["", "--examples"],
    "convert": ["delta d.yaml", "3rrr_m1 r.sdf"],
    "import": ["delta -o d.urdf"],
    "catalog build": ["--check --sample 1 planar"],
    "catalog list": ["--legs 3 --dof 2", "--text 'no confirmed'"],
    "catalog show": ["'3(Rz*-Rz-Rz)'"],
    "catalog site": ["-o site --text '3(Rz*-Rz-Rz)'"],
}
"""Commands whose answers have every part of the records in them, quick ones."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answered(capsys: pytest.CaptureFixture[str], text: str) -> dict:
    capsys.readouterr()
    assert run_command([*shlex.split(text), "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def wrong(command: str, record: dict) -> list[str]:
    found = Draft202012Validator(build_schema(command)).iter_errors(record)
    return [f"{'/'.join(map(str, each.absolute_path))}: {each.message[:200]}" for each in found]


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "command",
    [pytest.param(each, marks=[pytest.mark.slow] * each.startswith("catalog")) for each in list_json_commands()],
)
def test_every_answer_is_what_its_schema_says(here: Path, capsys, command: str):
    if command == "verify":
        assert run_command(["modes", "3rrr_m1", "--certificate", "c.json"]) == 0
    for arguments in QUICK[command]:
        record = answered(capsys, f"{command} {arguments}")
        assert (record["command"], record["version"]) == (command, hrsynth.__version__)
        assert wrong(command, record) == [], arguments


@pytest.mark.some(4)
@pytest.mark.parametrize("command", [*list_analyses(), "lint"])
def test_the_json_of_a_result_is_that_of_its_command(here: Path, capsys, command: str, monkeypatch: pytest.MonkeyPatch):
    """Of every command whose files are not written."""
    found: list[Result] = []
    answer = getattr(hrsynth, command)

    @wraps(answer)
    def kept(*args: Any, **given: Any) -> Result:
        found.append(answer(*args, **given))
        return found[-1]

    monkeypatch.setattr(hrsynth, command, kept)
    for arguments in QUICK[command]:
        record = answered(capsys, f"{command} {arguments}")
        record |= dict.fromkeys(each for each in list_file_fields(command) if isinstance(record[each], str))
        assert found[-1].to_json() == json.dumps(record, ensure_ascii=False, indent=2)


def test_every_command_with_json_is_tried():
    assert {*list_json_commands()} == {*QUICK}


def test_a_schema_refuses_what_is_wrong(here: Path, capsys):
    good = answered(capsys, "check rrrrr_m1")
    for path in (["robot"], ["configurations", 0, "pose", "x"], ["configurations", 0, "singularity_indices", "RI"]):
        less, odd, more = (deepcopy(good) for _ in range(3))
        for record in (less, odd, more):
            inner = record
            for part in path[:-1]:
                inner = inner[part]
            if record is less:
                del inner[path[-1]]
            elif record is odd:
                inner[path[-1]] = ["odd"]
            else:
                inner["more"] = 1
        assert [bool(wrong("check", each)) for each in (good, less, odd, more)] == [False, True, True, True]


def test_schemas_are_sound_printed_and_on_their_page(capsys):
    shown = format_schema_page()
    for command in list_json_commands():
        Draft202012Validator.check_schema(build_schema(command))
        capsys.readouterr()
        assert run_command(["schema", *command.split()]) == 0
        assert json.loads(capsys.readouterr().out) == build_schema(command)
        assert f'??? abstract "{command}"' in shown
    assert run_command(["schema", "nothing"]) == 2
    assert "catalog list" in capsys.readouterr().err
