"""The command line over files of other tools: options, remarks on standard error, conversions."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import hrsynth
from description.foreign.examples import FILES
from description.foreign.test_dialects import written
from description.foreign.test_traps import bars, origin
from hrsynth.cli import run_command
from hrsynth.description import native

COMMANDS = ("derive", "legs", "check", "singularities", "advise", "modes", "path", "convert")


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str]):
    def run(*arguments: object) -> tuple[int, str, list[str]]:
        capfd.readouterr()
        status = run_command([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return status, out, err.splitlines()

    return run


def test_check_tells_what_was_guessed_and_json_stays_clean(call, tmp_path: Path):
    path = written(tmp_path, FILES["sdf: 1.7"])
    status, out, remarks = call("check", path, "--json")
    assert status == 0
    assert json.loads(out)["configurations"][0]["mobility"] == {"total": 1, "internal": 0}
    guess, motors = remarks
    assert motors == "hrsynth: no joint has a motor: try --motors a,c (the joints at the base)"
    assert guess.startswith(
        "hrsynth: assumption: the platform is link 'bar', the farthest from the base (--platform LINK"
    )
    status, out, remarks = call("check", path, "--platform", "bar", "--motors", "a", "--observe", "crank", "--json")
    assert (status, remarks) == (0, [])
    assert json.loads(out)["configurations"][0]["real"] is not None


@pytest.mark.parametrize("command", ["check", "legs", "derive"])
def test_json_has_the_notes_that_are_printed(call, command: str, tmp_path: Path):
    """What was ignored or assumed is in the record of a robot, not on standard error alone; none is no member."""
    texts = {name: text.replace("</model>", '<link name="spare"/></model>') for name, text in FILES["sdf: 1.7"].items()}
    path = written(tmp_path, texts)
    _, out, remarks = call(command, path, "--json")
    notes = json.loads(out)["notes"]
    assert any(note.startswith("ignored: ") and "spare" in note for note in notes)
    assert notes == [line.removeprefix("hrsynth: ") for line in remarks[: len(notes)]]
    assert "notes" not in json.loads(call(command, "3rps", "--json")[1])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_what_a_file_does_not_say(call, command: str):
    status, out, _ = call(command, "--help")
    assert status == 0
    for option in ("--base", "--platform", "--motors", "--close", "--freeze"):
        assert option in out


def test_closures_parts_and_frozen_joints_from_the_command_line(call, tmp_path: Path):
    links = [("p", "one", "base", origin(0)), ("q", "two", "one", origin(1)), ("r", "three", "two", origin(1))]
    chain = bars(links, "")
    path = written(tmp_path, {"robot.urdf": chain})
    status, out, remarks = call("check", path, "--base", "one", "--platform", "three", "--json")
    assert status == 0
    assert json.loads(out)["configurations"][0]["dof"] == 2
    assert remarks == [
        "hrsynth: open: no element of the file closes a loop: it is read as an open chain",
        "hrsynth: ignored: 1 links that are not between 'one' and 'three': base",
        "hrsynth: no joint has a motor: try --motors q,r (all joints: no loop is closed)",
    ]
    status, out, _ = call("check", path, "--freeze", "p", "--json")
    assert json.loads(out)["configurations"][0]["dof"] == 2


@pytest.mark.parametrize(
    "arguments",
    [("--platform", "none"), ("--base", "none"), ("--motors", "none"), ("--close", "x"), ("--freeze", "none")],
)
def test_wrong_names_are_refused_in_one_line(call, arguments: tuple[str, str], tmp_path: Path):
    status, out, lines = call("check", written(tmp_path, FILES["mjcf: connect"]), *arguments)
    assert (status, out, len(lines)) == (2, "", 1)
    assert lines[0].startswith("hrsynth: ")


def test_convert_goes_between_all_dialects(call, tmp_path: Path):
    source = written(tmp_path, FILES["urdf: urdf+"])
    before = source
    for name in ("a.xml", "b.sdf", "c.yaml", "d.urdf"):
        status, out, _ = call("convert", before, tmp_path / name, "--platform", "bar", "--json")
        assert status == 0
        assert json.loads(out)["joints"] == 4
        before = tmp_path / name
    assert (tmp_path / "c.urdf").is_file()
    assert call("check", tmp_path / "d.urdf")[2] == []
    status, _, lines = call("convert", source, tmp_path / "e.xml", "--to", "step")
    assert (status, len([line for line in lines if "unknown format" in line])) == (2, 1)
    assert not (tmp_path / "e.xml").exists()


def test_changes_of_a_rounded_file_are_one_line_and_listed_on_request(call, tmp_path: Path):
    """The line has the count and the largest change of the notes that Python and ``lint`` have."""
    text = native.write(hrsynth.load("quattro"))
    rounded = re.sub(r"-?\d\.\d{6,}(e-\d+)?", lambda number: f"{float(number[0]):.5f}", text)
    path = written(tmp_path, {"robot.urdf": rounded})
    merged = [note for note in hrsynth.load(path).notes if note.kind == "merged"]
    assert len(merged) > 1
    (line,) = [each for each in call("check", path)[2] if "merged" in each]
    (relations,) = re.findall(r"(\d+) relations of joints", merged[0].text)
    (change,) = re.findall(r"largest change (\S+);", merged[0].text)
    assert f"merged: {relations} elements or relations" in line
    assert f"the largest change is {change} " in line
    every = [each for each in call("check", path, "--explain")[2] if "merged" in each]
    assert every == [f"hrsynth: {note}" for note in merged]
    linted = call("lint", path)[1]
    assert all(note.text in linted for note in merged)
