"""The command line: the contract's JSON, exit status 0, 2 or 3, one line a defect, never a traceback."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hrsynth
from description.samples import FOUR_BAR
from description.test_defects import DEFECTS, edited
from hrsynth.cli import _run
from hrsynth.description import shipped

FIELDS = {
    "derive": {"observed", "notation", "dof", "mobility", "verdict", "lost", "paper_form", "steps", "certificate",
               "hidden_file", "architecture"},
    "legs": {"sets", "minimal"},
    "robots": {"robots"},
    "convert": {"file"},
}
VERDICTS = {"controllable", "partially controllable", "uncontrollable"}

# Bad input of the robot files: a sample of the reader's own tests, one a situation.
BAD = ["malformed", "two root elements", "unknown joint type", "unknown loop type", "joint of a missing child",
       "loop of a missing link", "zero axis", "zero axis2", "nan", "inf", "two roots", "no platform", "no own element",
       "unknown platform", "platform elsewhere", "observe unknown", "unknown motor", "unknown camera"]


class Answer:
    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err

    @property
    def data(self) -> dict:
        assert self.status == 0, self.err
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))

    def refused(self, status: int = 2) -> list[str]:
        """The lines of a refusal: on standard error alone, each the program's own."""
        assert self.status == status, (self.out, self.err)
        assert self.out == ""
        lines = self.err.splitlines()
        assert lines
        assert all(line.startswith("hrsynth: ") and "Traceback" not in line for line in lines), self.err
        return lines


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("HRSYNTH_DEBUG", raising=False)

    def call(*arguments: str | Path) -> Answer:
        capfd.readouterr()
        status = _run([str(argument) for argument in arguments])
        return Answer(status, *capfd.readouterr())

    return call


@pytest.fixture
def robot(tmp_path: Path):
    def write(text: str | bytes, name: str = "robot.urdf") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def process(*arguments: str, **keywords) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "hrsynth.cli", *arguments], capture_output=True, text=True,
                          encoding="utf-8", **keywords)


def check_record(data: dict, command: str, robot: str | None) -> None:
    assert data["command"] == command
    assert data["version"] == hrsynth.__version__
    assert data.get("robot") == robot
    assert data.keys() >= FIELDS[command]


# ---- derive


@pytest.mark.parametrize(("name", "observe", "verdict"), [
    ("quattro_rigid", "1,4", "controllable"), ("3prp", "all", "partially controllable"),
    ("3ppr_m1", "all", "uncontrollable"), ("prrrp_parallel", "all", "partially controllable")])
def test_derive_json_is_the_contract_whatever_the_verdict(run, name: str, observe: str, verdict: str):
    data = run("derive", name, "--observe", observe, "--json").data
    check_record(data, "derive", name)
    assert data["verdict"] == verdict
    assert data["notation"].keys() == {"real", "hidden", "real_ascii", "hidden_ascii", "hidden_latex"}
    assert {"total", "idle", "as_written"} <= data["mobility"].keys()
    assert data["architecture"].keys() >= {"verdict", "exact"}
    assert data["certificate"].keys() >= {"samples", "largest_angle", "smallest_gap", "passed"}
    assert data["certificate"]["passed"] is True
    assert data["steps"]
    assert all(step.keys() >= {"rule", "leg", "accepted", "reason", "largest_angle"} for step in data["steps"])
    assert bool(data["lost"]) is (verdict != "controllable")
    assert all(len(lost["twist"]) == 6 and lost["name"] for lost in data["lost"])
    assert all(one.keys() == {"leg", "link"} for one in data["observed"])
    blind = verdict == "uncontrollable"
    assert (data["notation"]["hidden"] is None) is blind
    assert (data["notation"]["hidden_ascii"] is None) is blind
    assert (data["notation"]["hidden_latex"] is None) is blind
    assert data["hidden_file"] is None


def test_derive_text_has_the_hidden_robot_and_the_verdict(run):
    answer = run("derive", "quattro_rigid", "--observe", "1,4")
    assert answer.status == 0
    assert re.search(r"^hidden robot +2-Π-\{2-U̲U\}$", answer.out, re.MULTILINE)
    assert re.search(r"^verdict +controllable$", answer.out, re.MULTILINE)
    assert answer.err == ""


@pytest.mark.parametrize(("name", "legs"), [("delta", "all"), ("quattro", "1,4"), ("3rrr_m1", "all")])
def test_the_written_file_is_a_robot_again(run, tmp_path: Path, name: str, legs: str):
    hidden, again, copy = (tmp_path / f"{each}.urdf" for each in ("hidden", "again", "copy"))
    data = run("derive", name, "--observe", legs, "-o", hidden, "--json").data
    assert data["hidden_file"] == str(hidden)
    assert run("convert", hidden, again).status == 0
    assert run("convert", again, copy).status == 0
    assert again.read_bytes() == copy.read_bytes() == hidden.read_bytes()
    second = run("derive", hidden, "--json").data
    assert second["verdict"] == data["verdict"]
    assert second["dof"] == data["dof"]
    assert second["notation"]["real_ascii"] == data["notation"]["hidden_ascii"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again.urdf", "copy.urdf", "hidden.urdf"]


def test_a_file_that_cannot_be_written_leaves_nothing(run, tmp_path: Path):
    lines = run("derive", "3prp", "-o", tmp_path / "none" / "hidden.urdf").refused()
    assert "cannot write the file" in lines[0]
    assert "cannot write" in run("derive", "3prp", "-o", tmp_path).refused()[0]
    assert "cannot write" in run("convert", "3prp", "").refused()[0]
    assert list(tmp_path.iterdir()) == []


def test_a_device_or_pipe_is_never_replaced(run, tmp_path: Path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "not a regular file" in run("convert", "3prp", pipe).refused()[0]
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_leave_to_write(run, tmp_path: Path):
    tmp_path.chmod(0o555)
    assert "cannot write" in run("derive", "3prp", "-o", tmp_path / "hidden.urdf").refused()[0]
    tmp_path.chmod(0o755)
    assert list(tmp_path.iterdir()) == []


def test_a_refused_derivation_keeps_the_old_file(run, robot, tmp_path: Path):
    old = robot("old", "hidden.urdf")
    run("derive", robot(edited(*DEFECTS["nan"][0])), "-o", old).refused()
    run("derive", "3prp", "--observe", "9", "-o", old).refused()
    assert old.read_text() == "old"


def test_a_blind_robot_writes_nothing_and_says_so(run, tmp_path: Path):
    answer = run("derive", "3ppr_m1", "-o", tmp_path / "hidden.urdf", "--json")
    assert answer.data["hidden_file"] is None
    assert answer.err.startswith("hrsynth: nothing was written")
    assert list(tmp_path.iterdir()) == []


def test_observe_takes_labels_links_duplicates_and_spaces(run):
    once = run("derive", "quattro_rigid", "--observe", "1,4", "--json").data
    assert run("derive", "quattro_rigid", "--observe", " 1, 4 ,1,rod_4a", "--json").data == once
    assert run("derive", "quattro_rigid", "--observe", "rod_1a,rod_4a", "--json").data == once


def test_both_forms_are_certified(run):
    data = run("derive", "3rrr_m1", "--form", "general", "--json").data
    assert data["form"] == "general"
    assert data["certificate"]["passed"] is True


@pytest.mark.parametrize(("arguments", "words"), [
    (["--observe", "9"], ["'9'", "legs 1, 2, 3"]),
    (["--observe", "1,,2"], ["empty name", "'1,,2'"]),
    (["--observe", ""], ["empty name"]),
    (["--observe", "base"], ["base"]),
    (["--observe", "platform"], ["platform"]),
    (["--observe", "1,all"], ["'all'"]),
    (["--camera", "moon"], ["camera", "'moon'", "platform"]),
    (["--form", "pretty"], ["'pretty'", "simplified, general"]),
    (["--seed", "x"], ["seed", "integer"]),
    (["--seed", "-1"], ["seed", "0"]),
    (["--nothing"], ["--nothing"]),
    (["more"], ["more"]),
])
def test_arguments_that_do_not_fit(run, arguments: list[str], words: list[str]):
    lines = run("derive", "delta", *arguments).refused()
    assert len(lines) == 1
    assert all(word in lines[0] for word in words), lines


@pytest.mark.parametrize("arguments", [["nothing"], ["derive"], ["convert", "delta"], ["--nothing"], ["robots", "x"]])
def test_no_such_command_or_too_few_arguments(run, arguments: list[str]):
    assert len(run(*arguments).refused()) == 1


# ---- legs, robots, convert


def test_legs_json(run):
    data = run("legs", "quattro", "--json").data
    check_record(data, "legs", "quattro")
    assert len(data["sets"]) == 2**4 - 1
    assert all(one.keys() >= {"legs", "verdict", "rank", "lost"} for one in data["sets"])
    assert {one["verdict"] for one in data["sets"]} <= VERDICTS
    best = max(one["rank"] for one in data["sets"])
    sizes = {len(one["legs"]) for one in data["sets"] if one["rank"] == best}
    smallest = [one["legs"] for one in data["sets"] if one["rank"] == best and len(one["legs"]) == min(sizes)]
    assert data["minimal"] == smallest == [["1", "3"], ["1", "4"], ["2", "3"], ["2", "4"]]


def test_robots_json_names_every_file(run):
    data = run("robots", "--json").data
    check_record(data, "robots", None)
    assert [one["name"] for one in data["robots"]] == list(shipped())
    assert all(Path(one["file"]).is_file() for one in data["robots"])
    text = run("robots").out
    for one in data["robots"]:
        assert one.keys() >= {"name", "file", "architecture_ascii", "dof"}
        assert one["name"] in text
    assert re.search(r"^gough_stewart +6-UP̲S +6", text, re.MULTILINE)


@pytest.mark.parametrize("name", ["quattro", "3upu", "i4l", "prrrp_parallel_point"])
def test_convert_is_stable(run, tmp_path: Path, name: str):
    first, second = tmp_path / "first.urdf", tmp_path / "second.urdf"
    data = run("convert", name, first, "--json").data
    check_record(data, "convert", name)
    assert data["file"] == str(first)
    assert run("convert", first, second).status == 0
    assert first.read_bytes() == second.read_bytes() == shipped()[name].read_bytes()


def test_convert_onto_itself_keeps_the_robot(run, robot):
    file = robot(FOUR_BAR)
    assert run("convert", file, file).status == 0
    once = file.read_bytes()
    assert run("convert", file, file).status == 0
    assert file.read_bytes() == once


# ---- bad files


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("command", ["derive", "legs", "convert"])
def test_every_defect_is_one_line_with_its_place(run, robot, tmp_path: Path, command: str, name: str):
    changes, expected = DEFECTS[name]
    file = robot(edited(*changes))
    out = [tmp_path / "out.urdf"] if command == "convert" else []
    lines = run(command, file, *out).refused()
    assert len(lines) == len(expected)
    for text, (number, words) in zip(lines, expected, strict=True):
        assert text.startswith(f"hrsynth: {file}:{number}: ")
        assert words.split(",")[0] in text
    assert sorted(tmp_path.iterdir()) == [file]


def test_no_loop(run, robot):
    lines = FOUR_BAR.split("\n")
    file = robot("\n".join(lines[:24] + lines[33:]))
    assert run("derive", file).refused() == [f"hrsynth: {file}:1: no loop: not a parallel robot"]


def test_a_loop_that_cannot_be_closed_is_named_with_its_residual(run, robot):
    end = '<origin xyz="2 0 0"/>\n    </successor>'
    file = robot(FOUR_BAR.replace(end, end.replace("2 0 0", "2.5 0 0")))
    (line,) = run("derive", file).refused(3)
    assert line.startswith(f"hrsynth: {file}:25: ")
    assert "'d'" in line
    assert float(re.search(r"residual ([-+.e\d]+) ", line)[1]) > 0.1


def with_observes(*observes: tuple[str, str]) -> tuple[str, int]:
    """A shipped robot with these (leg, link) observed, one a line; the line of the last."""
    text = shipped()["delta"].read_text(encoding="utf-8")
    place = text.index("<platform")
    lines = [f'<observe leg="{leg}" link="{link}" axis="0 0 1"/>\n' for leg, link in observes]
    return text[:place] + "\n" + "".join(lines) + text[place:], text.count("\n", 0, place) + 1 + len(lines)


@pytest.mark.parametrize("observes", [
    [("1", "rod_1a"), ("1", "rod_2a")],
    [("1", "rod_1a"), ("2", "base")],
    [("1", "rod_1a"), ("2", "platform")],
])
def test_observe_elements_that_contradict_the_legs(run, robot, observes: list[tuple[str, str]]):
    text, number = with_observes(*observes)
    file = robot(text)
    for command in ("derive", "legs"):
        lines = run(command, file).refused()
        assert len(lines) == 1
        assert lines[0].startswith(f"hrsynth: {file}:{number}: ")


def test_files_that_are_none(run, robot, tmp_path: Path):
    sparse = tmp_path / "junk.urdf"
    with open(sparse, "wb") as stream:
        stream.truncate(200_000_000)
    assert "a directory" in run("derive", tmp_path).refused()[0]
    assert "no such file" in run("derive", tmp_path / "none.urdf").refused()[0]
    assert "too large" in run("derive", sparse).refused()[0]
    assert "empty file" in run("derive", robot("", "empty.urdf")).refused()[0]
    assert "empty file" in run("derive", robot(" \n\n", "blank.urdf")).refused()[0]
    assert "not UTF-8" in run("derive", robot(b"<robot name='\xff'/>", "bytes.urdf")).refused()[0]
    assert ":1: " in run("derive", robot(b"\0" * 1000, "zeros.urdf")).refused()[0]
    assert run("derive", robot("x", "odd\nname.urdf")).refused()


def test_a_name_that_is_no_robot_is_told_the_nearest(run):
    (line,) = run("derive", "orthoglyde").refused()
    assert "'orthoglyde'" in line
    assert "orthoglide" in line
    assert run("legs", "").refused()


# ---- the process


def test_help_and_version(run):
    assert run("--version").out == f"hrsynth {hrsynth.__version__}\n"
    shown = run("--help")
    assert shown.status == 0
    assert run().out == shown.out
    assert all(command in shown.out for command in FIELDS)
    assert all(run(command, "--help").status == 0 for command in FIELDS)


def test_the_exit_status_of_the_process(tmp_path: Path):
    done = process("derive", "3prp")
    assert (done.returncode, done.stderr) == (0, "")
    refused = process("derive", str(tmp_path))
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr.count("\n") == 1
    assert "Traceback" not in refused.stderr


def test_a_terminal_without_utf8_is_no_defect():
    done = process("robots", env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
    assert done.returncode == 0
    assert "6-UP̲S" in done.stdout


def test_a_reader_that_stops_early_is_no_defect():
    command = f"{sys.executable} -m hrsynth.cli derive 3prp --json | head -c 1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("{", "")
    closed = f"{sys.executable} -m hrsynth.cli robots | true"
    done = subprocess.run(["bash", "-c", closed], capture_output=True, text=True)
    assert done.stderr == ""


def test_the_command_line_is_light_to_import():
    code = "import sys, hrsynth.cli; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "hrsynth.cli" in loaded
    assert not {"numpy", "networkx", "lxml", "pinocchio", "rich.progress"} & set(loaded)
