"""The command line: the contract's JSON, exit status 0, 2 or 3, one line a defect, never a traceback."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.samples import FOUR_BAR
from description.test_defects import DEFECTS, edited
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.cli import run_command
from hrsynth.cli.analyses import QUESTIONS
from hrsynth.description import list_robots
from hrsynth.errors import BadRequest
from hrsynth.present.outputs import OUTPUTS

FIELDS = {
    "derive": {
        "observed",
        "notation",
        "dof",
        "mobility",
        "verdict",
        "unobserved",
        "unchecked_form",
        "steps",
        "equivalence",
        "hidden_file",
        "report_file",
        "architecture",
    },
    "legs": {"sets", "minimal"},
    "advise": {"verdict", "rank", "dof", "unobserved", "nothing_missing", "sets", "size", "tried", "complete"},
    "branch": {"motors", "passive", "fixed", "box", "tried", "parts"},
    "check": {"characteristic_length", "observed", "camera", "configurations", "redundant", "grid"},
    "singularities": {
        "measured",
        "dof",
        "verdict",
        "unobserved",
        "always",
        "never",
        "unexamined",
        "words",
        "expression",
        "where",
        "factors",
        "characteristic_length",
        "checked",
        "examples",
        "locus",
        "file",
    },
    "modes": {
        "kind",
        "at",
        "observed",
        "complex",
        "complete",
        "proof",
        "modes",
        "near_modes",
        "singular_solutions",
        "continuous_family",
    },
    "path": {"verdict", "certified", "path", "margin", "boxes", "start", "goal", "reason", "value", "point"},
    "servo": {
        "observed",
        "start",
        "goal",
        "gain",
        "sense",
        "noise",
        "outcome",
        "reason",
        "pose",
        "matched_mode",
        "modes",
        "type2",
        "notes",
        "spread",
        "error",
        "times",
        "poses",
        "file",
    },
    "accuracy": {"observed", "cones", "axes", "fixed", "reached", "position_mm", "orientation_deg", "checked"},
    "select": {"start", "goal", "cones", "best", "sets"},
    "view": {"observed", "dof", "shown", "sliders", "modes", "distance", "largest_distance", "notes", "file"},
    "robots": {"robots"},
    "convert": {"file", "files"},
}
VERDICTS = {"controllable", "partially controllable", "uncontrollable"}

# Bad input of the robot files: a sample of the reader's own tests, one a situation.
BAD = [
    "malformed",
    "two root elements",
    "unknown joint type",
    "unknown loop type",
    "joint of a missing child",
    "loop of a missing link",
    "zero axis",
    "zero axis2",
    "nan",
    "inf",
    "two roots",
    "no platform",
    "unknown platform",
    "platform elsewhere",
    "observe unknown",
    "unknown motor",
    "unknown camera",
]


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
        status = run_command([str(argument) for argument in arguments])
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
    return subprocess.run(
        [sys.executable, "-m", "hrsynth.cli", *arguments], capture_output=True, text=True, encoding="utf-8", **keywords
    )


def check_record(data: dict, command: str, robot: str | None) -> None:
    assert data["command"] == command
    assert data["version"] == hrsynth.__version__
    assert data.get("robot") == robot
    assert data.keys() >= FIELDS[command]


# ---- derive


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("name", "observe", "verdict"),
    [
        ("quattro_rigid", "1,4", "controllable"),
        ("3prp", "all", "partially controllable"),
        ("3ppr_m1", "all", "uncontrollable"),
        ("prrrp_parallel", "all", "partially controllable"),
    ],
)
def test_derive_json_is_the_contract_whatever_the_verdict(run, name: str, observe: str, verdict: str):
    data = run("derive", name, "--observe", observe, "--json").data
    check_record(data, "derive", name)
    assert data["verdict"] == verdict
    assert data["notation"].keys() == {"real", "hidden", "real_ascii", "hidden_ascii", "hidden_latex"}
    assert {"total", "internal", "as_written"} <= data["mobility"].keys()
    assert data["architecture"].keys() >= {"verdict", "exact"}
    assert data["equivalence"].keys() >= {"samples", "largest_angle", "smallest_gap", "passed"}
    assert data["equivalence"]["passed"] is True
    assert data["steps"]
    assert all(step.keys() >= {"rule", "leg", "accepted", "reason", "largest_angle"} for step in data["steps"])
    assert bool(data["unobserved"]) is (verdict != "controllable")
    assert all(len(lost["twist"]) == 6 and lost["name"] for lost in data["unobserved"])
    assert all(one.keys() == {"leg", "link", "kind", "camera", "at", "axis"} for one in data["observed"])
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
    assert max(map(len, answer.out.splitlines())) <= 100
    assert answer.err == ""


@pytest.mark.slow
def test_pairs_of_the_same_letters_are_told_apart_by_their_links(run):
    one, other = (run("derive", "quattro", "--observe", legs).out for legs in ("1,2", "1,4"))
    hidden = [line.split() for line in one.splitlines() if line.startswith("hidden robot")]
    assert hidden == [line.split() for line in other.splitlines() if line.startswith("hidden robot")]
    assert "plate_12: 1, 2; plate_34: 3, 4" in one
    assert "legs end on" not in run("derive", "quattro_rigid", "--observe", "1,4").out


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


WRITERS = {
    "accuracy": ["--cone", "0.1deg", "--grid", "x=0:0.1:2"],
    "check": ["--grid", "x=0:0.1:2"],
    "path": ["--start", "x=0", "--goal", "x=0"],
    "servo": ["--start", "x=0", "--goal", "x=0"],
    "equilibria": ["--goal", "x=0"],
    "basins": ["--goal", "x=0"],
}
OTHERS = (
    ["import", "3prp", "--yes", "-o", "{}.urdf"],
    ["convert", "3prp", "{}.xml"],
    ["convert", "3prp", "{}.yaml"],
    ["catalog", "show", "Delta", "-o", "{}.urdf"],
    ["lint", "3prp", "--fix", "-o", "{}.urdf"],
)


@pytest.mark.parametrize(
    "arguments",
    [
        [each.name, "3prp", *WRITERS.get(each.name, []), f"--{file.option}", "{}" + next(iter(file.makers), ".urdf")]
        for each in QUESTIONS
        for file in OUTPUTS[each.name].files
        if file.option
    ]
    + list(OTHERS),
    ids=" ".join,
)
def test_a_file_that_cannot_be_written_is_told_before_any_work(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
):
    """In one wording, whether its folder is missing, takes no such name, or a folder has its name."""

    def worked(*_: object, **__: object) -> None:
        pytest.fail("the work began")

    for module, work in (
        ("cli.analyses", "load_robot"),
        ("cli.files", "load_robot"),
        ("cli.importing", "_read"),
        ("cli.catalog", "_find_shown"),
        ("linting.lint", "LintedFile"),
    ):
        monkeypatch.setattr(import_module(f"hrsynth.{module}"), work, worked)
    *most, file = arguments
    taken = tmp_path / file.format("taken")
    taken.mkdir()
    for path, reason in (
        (tmp_path / "none" / file.format("x"), "no such folder"),
        (taken, "a directory"),
        (tmp_path / file.format("x" * 300), "its folder allows no such file"),
    ):
        (line,) = run(*most, path).refused()
        assert line.startswith(f"hrsynth: cannot write the file: {reason}"), line
    assert list(tmp_path.iterdir()) == [taken]


def test_all_mended_files_can_be_written_before_the_first_is(
    run, robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def refuse(path: Path) -> None:
        if path.name == "b.urdf":
            raise BadRequest("cannot write the file", str(path))

    monkeypatch.setattr(import_module("hrsynth.linting.lint"), "require_writable", refuse)
    broken = FOUR_BAR.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/>\n    <limit lower="1" upper="-1"/>', 1)
    files = [robot(broken, "a.urdf"), robot(broken, "b.urdf")]
    assert "b.urdf" in run("lint", "--fix", *files).refused()[0]
    assert all(file.read_text() == broken for file in files)
    monkeypatch.undo()
    run("lint", "--fix", *files)
    assert all(file.read_text() != broken for file in files)


def test_a_device_or_pipe_is_never_replaced(run, tmp_path: Path):
    pipe = tmp_path / "pipe.urdf"
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
    once = run("derive", "3rrr_m1", "--observe", "1,3", "--json").data
    assert run("derive", "3rrr_m1", "--observe", " 1, 3 ,1,dist_3", "--json").data == once
    assert run("derive", "3rrr_m1", "--observe", "dist_1,dist_3", "--json").data == once


def test_both_forms_are_certified(run):
    data = run("derive", "3rrr_m1", "--form", "general", "--json").data
    assert data["form"] == "general"
    assert data["equivalence"]["passed"] is True


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--observe", "9"], ["'9'", "legs 1, 2, 3"]),
        (["--observe", "1,,2"], ["empty name", "--observe 1,,2"]),
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
    ],
)
def test_arguments_that_do_not_fit(run, arguments: list[str], words: list[str]):
    lines = run("derive", "delta", *arguments).refused()
    assert len(lines) == 1
    assert all(word in lines[0] for word in words), lines


@pytest.mark.parametrize(
    "words",
    [
        "derive delta --seed ٣",
        "derive delta --seed 1_0",
        "accuracy delta --cone ١deg",
        "accuracy delta --cone 1=０.5deg",
        "advise delta --cost leg=٢",
        "check delta --at mode:٢",
        "check delta --grid x=0:1:٣",
        "servo delta --start z=-0.7 --goal z=-0.75 --noise ١deg",
        "servo delta --start z=-0.7 --goal z=-0.75 --depth constant:٢",
        "derive delta --close arm_1@٠,0,0:arm_2@0,0,0",
        "accuracy delta --plane z=-0.7 -o map.svg --width ٨cm",
    ],
)
def test_numbers_are_in_ascii_digits(run, words: str):
    assert len(run(*words.split()).refused()) == 1


SPHERICAL = """<robot name="spherical">
  <link name="base"/><link name="a"/><link name="b"/><link name="c"/>
  <joint name="1" type="continuous"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/></joint>
  <joint name="2" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>
  <joint name="3" type="continuous"><parent link="base"/><child link="c"/><axis xyz="0 0 1"/></joint>
  <loop name="4" type="revolute"><predecessor link="b"/><successor link="c"/><axis xyz="1 1 1"/></loop>
  <hrsynth><platform link="b"/></hrsynth>
</robot>"""


@pytest.mark.parametrize(
    ("robot", "word"),
    [("rrrrr_m1", "PiR*"), ("gough_stewart", "U*PS"), ("3rps", "R*PS+2-RPS"), ("prrrp_parallel_point", "PR*R")],
)
def test_a_hidden_robot_of_one_leg_is_a_robot_again(run, tmp_path: Path, robot: str, word: str):
    """Its platform, which is watched, is in no leg then; it turns on one ball; it is a point on one R. What
    was watched is what its file watches."""
    hidden = tmp_path / "hidden.urdf"
    data = run("derive", robot, "--observe", "1", "-o", hidden, "--json").data
    second = run("derive", hidden, "-o", tmp_path / "its_own.urdf", "--json").data
    third = run("derive", tmp_path / "its_own.urdf", "--json").data
    assert second["notation"]["real_ascii"] == data["notation"]["hidden_ascii"] == word
    for later in (second, third):
        for told in ("dof", "verdict", "rank", "point_platform"):
            assert later[told] == data[told]
        for once, again in zip(data["unobserved"], later["unobserved"], strict=True):
            assert again["twist"] == pytest.approx(once["twist"], abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "cure"),
    [
        (["nowhere.urdf"], "the path of an existing file"),
        (["empty.urdf"], "a robot file"),
        (["cut.urdf"], "a whole XML document"),
        (["/dev/null"], "a robot file"),
        (["delta", "-o", "nowhere/x.urdf"], "a file in an existing folder"),
        (["delta", "--camera", "arm_1", "--camera", "base"], "others as NAME=LINK@x,y,z"),
        (["delta", "--unit", ""], "m, mm, cm, in"),
        (["delta", "--platform", ""], "rod_1a"),
        (["delta", "more"], "See hrsynth derive -h"),
        (["spherical.urdf"], "--sensor direction:LINK/dx,dy,dz"),
    ],
)
def test_a_refusal_says_what_to_do(
    run, robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], cure: str
):
    monkeypatch.chdir(tmp_path)
    for name, text in (("empty.urdf", ""), ("cut.urdf", FOUR_BAR[:500]), ("spherical.urdf", SPHERICAL)):
        robot(text, name)
    (line,) = run("derive", *arguments).refused()
    assert cure in re.split(r"expected |\. (?=[A-Z])", line, maxsplit=1)[1]


def test_a_spherical_robot_is_watched_by_directions_that_are_named(run, robot):
    data = run("derive", robot(SPHERICAL), "--sensor", "direction:a/0,1,0", "--json").data
    assert (data["dof"], data["verdict"]) == (1, "controllable")


@pytest.mark.parametrize("arguments", [["nothing"], ["derive"], ["convert", "delta"], ["--nothing"], ["robots", "x"]])
def test_no_such_command_or_too_few_arguments(run, arguments: list[str]):
    assert len(run(*arguments).refused()) == 1


# ---- check


def test_check_json_is_the_contract(run):
    data = run("check", "delta", "--observe", "1,2", "--at", "x=0.02,y=0.1,z=-0.62", "--at", "z=-0.65", "--json").data
    check_record(data, "check", "delta")
    assert [one["leg"] for one in data["observed"]] == ["1", "2"]
    first, second = data["configurations"]
    assert first.keys() == {
        "pose",
        "beyond_limits",
        "coordinates",
        "singular_spherical_joints",
        "mobility",
        "dof",
        "rank",
        "gap",
        "condition",
        "type1",
        "type2",
        "type3",
        "singularity_indices",
        "unobserved",
        "real",
        "constraint",
        "redundant",
        "distances",
    }
    assert [first["pose"][name] for name in "xyz"] == pytest.approx([0.02, 0.1, -0.62])
    assert second["pose"]["x"] == pytest.approx(0, abs=1e-8)
    assert first["pose"]["rpy"] == pytest.approx([0, 0, 0], abs=1e-8)
    assert first["mobility"] == {"total": 9, "internal": 6}
    assert (first["dof"], first["rank"]) == (3, 3)
    assert first["type1"] is first["type2"] is first["type3"] is False
    assert first["singularity_indices"] == {"RI": 0, "RO": 0, "II": 0, "IO": 0, "RPM": 0, "IIM": 0}
    assert first["real"].keys() == {"rank", "gap", "type1", "type2", "type3", "singularity_indices", "unobserved"}
    assert first["constraint"] == {"singular": False, "rank_lost": 0, "gained": []}
    assert first["distances"].keys() == {
        "type2",
        "type1",
        "constraints",
        "condition",
        "mm_per_degree",
        "degrees_per_degree",
    }
    assert data["redundant"] == []
    assert data["grid"] is None
    assert run("check", "3rrr_m1", "--json").data["redundant"] == [
        {"loop": "wrist_2", "rows": 3, "generic": True},
        {"loop": "wrist_3", "rows": 3, "generic": True},
    ]


@pytest.mark.parametrize(
    ("robot", "motion"),
    [
        ("3rrr_m1", "3 dof, 1 of which rotates it"),
        ("delta", "3 dof, none of which rotates it"),
        ("3rps", "3 dof, 2 of which rotate it"),
        ("quattro", "4 dof, 1 of which rotates it"),
        ("gough_stewart", "6 dof, 3 of which rotate it"),
    ],
)
def test_check_text_names_the_kind_of_motion(run, robot: str, motion: str):
    assert f"; the platform has {motion}\n" in run("check", robot).out


def test_check_text_names_the_singularity(run):
    answer = run("check", "rrrrr_m1", "--at", f"x=0,y={0.16 + 0.03**0.5!r}")
    assert (answer.status, answer.err) == (0, "")
    for line in (
        r"^pose +x=0,y=0.333205,",
        r"^mobility +2, of which 0 internal; the platform has 2 dof, 1 of which rotates it$",
        r"^hidden robot +the directions show 1 of 2: Type 2 singularity ",
        r"RI 0  RO 1  II 1  IO 0",
        r"^unobserved +translation along x\b",
        r"^real robot +the motors determine 2 of 2: regular ",
        r"^redundant +loop end: 3 of its constraints$",
    ):
        assert re.search(line, answer.out, re.MULTILINE), answer.out


@pytest.mark.slow
def test_check_writes_a_picture_or_a_table(run, tmp_path: Path):
    picture, table = tmp_path / "map.png", tmp_path / "map.csv"
    grid = ["--grid", f"x=-0.4:0.4:3,y=0.25:{2 * (0.16 + 0.03**0.5) - 0.25!r}:3"]
    data = run("check", "rrrrr_m1", *grid, "-o", picture, "--json").data
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert (data["grid"]["axes"], data["grid"]["x"]) == (["x", "y"], [-0.4, 0, 0.4])
    assert data["grid"]["state"] == [["unreachable"] * 3, ["regular", "type2", "unreachable"], ["unreachable"] * 3]
    answer = run("check", "rrrrr_m1", *grid, "-o", table)
    assert re.search(r"^grid +3 x × 3 y: 1 regular, 1 type2, 7 unreachable$", answer.out, re.MULTILINE)
    rows = [line.split(",") for line in table.read_text().splitlines()]
    assert rows[0][:5] == ["x", "y", "state", "type2", "type1"]
    assert [row[2] for row in rows[1:]] == [state for line in data["grid"]["state"] for state in line]
    assert float(rows[4][3]) == pytest.approx(data["grid"]["type2"][1][0])
    assert rows[5][3] == "0.0"
    assert rows[1][3] == ""
    for text in ("x=0:0.1:3", "x=0:0.02:2,y=0.2:0.22:2,z=0"):
        drawn = run(
            "check",
            "rrrrr_m1" if "z" not in text else "delta",
            "--grid",
            text.replace(",z=0", ",z=-0.6"),
            "-o",
            picture,
        )
        assert (drawn.status, drawn.err) == (0, "")
    assert run("check", "quattro", "--grid", "x=0:0.02:2,y=0:0.02:2,phi=0:5deg:2", "-o", picture).status == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map.csv", "map.png"]


@pytest.mark.some(6)
@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--at", "x=abc"], 2, ["x is not a number", "'abc'"]),
        (["--at", "w=1"], 2, ["unknown part", "x, y, z, phi, rpy"]),
        (["--at", ""], 2, ["name=value"]),
        (["--at", "phi=1deg"], 2, ["cannot change phi", "x, y, z"]),
        (["--at", "x=9"], 3, ["x=9", "is not reached", "leg ", " mm", "% of the path"]),
        (["--grid", "x=0"], 2, ["number of ranges"]),
        (["--grid", "phi=0:1:3"], 2, ["cannot change phi"]),
        (["-o", "map.png"], 2, ["--grid"]),
        (["--grid", "x=0:1:3", "-o", "map.gif"], 2, ["unknown extension", ".png, .pdf, .svg, .csv"]),
        (["--grid", "x=5:6:2", "-o", "map.png"], 3, ["no pose of the grid x=5:6:2 is reached"]),
        (["--observe", "9"], 2, ["legs 1, 2, 3"]),
        (["--camera", "moon"], 2, ["'moon'"]),
    ],
)
def test_check_refuses_in_one_line_and_writes_nothing(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], status: int, words: list[str]
):
    monkeypatch.chdir(tmp_path)
    (line,) = run("check", "delta", *arguments).refused(status)
    assert all(word in line for word in words), line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.some(1)
@pytest.mark.parametrize("asked", [["x=9", "x=0.01"], ["x=0.01", "x=9", "x=0.02", "y=-8"], ["x=9", "mode:2"]])
def test_check_tells_every_pose_and_ends_as_at_one_that_is_not_reached(run, asked: list[str]):
    arguments = ["check", "3rrr_m1", *(word for pose in asked for word in ("--at", pose))]
    far = [pose for pose in asked if pose in ("x=9", "y=-8", "mode:2")]
    answer, record = run(*arguments), run(*arguments, "--json")
    assert (answer.status, record.status, answer.err) == (3, 3, record.err)
    assert [re.search("the pose (.*?) is not reached", line)[1] for line in answer.err.splitlines()] == far
    if len(far) == len(asked):
        assert (answer.out, record.out) == ("", "")
        return
    near = [f"{each.postures[0].pose}" for each in (hrsynth.check("3rrr_m1", at=p) for p in asked if p not in far)]
    assert re.findall(r"^pose +(.*)$", answer.out, re.MULTILINE) == near + far
    assert len(re.findall(r"^not reached", answer.out, re.MULTILINE)) == len(far)
    data = json.loads(record.out)
    assert [each["pose"] for each in data["unreached"]] == far
    assert all(each["reason"] in record.err for each in data["unreached"])
    assert len(data["configurations"]) == len(near)


def test_check_without_an_interaction_matrix_draws_nothing(run, tmp_path: Path):
    (line,) = run("check", "i4l", "--grid", "x=0:0.01:2", "-o", tmp_path / "map.png").refused()
    assert "there is nothing to draw" in line
    assert list(tmp_path.iterdir()) == []


def test_check_answers_3_where_a_rank_is_not_clear(run, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("hrsynth.analysis.configuration_report.RANK_GAP_MIN", 1e30)
    asked = run("check", "3rrr_m1", "--at", "x=0.01")
    assert asked.status == 3
    assert "undecided (smallest rank gap" in asked.out
    assert re.fullmatch(r"hrsynth: 3rrr_m1 at x=.*: rank undecided: gap .*, needed .*\n", asked.err)
    assert run("check", "3rrr_m1", "--grid", "x=0:0.01:2").status == 0


def test_the_mobility_is_the_same_in_all_answers(monkeypatch: pytest.MonkeyPatch):
    """Null where the file's own mechanism cannot be sampled."""
    robot = hrsynth.observe("delta")
    for case in range(2):
        answers = [answer.to_dict()["mobility"] for answer in (hrsynth.check(robot), hrsynth.derive(robot))]
        assert answers[0] == answers[1]
        assert (answers[0]["as_written"] is None) == bool(case)
        monkeypatch.setattr(ObservedRobot, "mobility_as_written", property(lambda _: refuse()))


def refuse() -> None:
    raise BadRequest("robot", "", "one that can be sampled")


# ---- advise


def test_advise_json_is_the_contract(run):
    data = run("advise", "uranesx", "--json").data
    check_record(data, "advise", "uranesx")
    assert (data["verdict"], data["rank"], data["dof"]) == ("partially controllable", 2, 3)
    assert [lost["name"] for lost in data["unobserved"]] == ["translation along z"]
    assert (data["nothing_missing"], data["size"], data["complete"]) == (False, 1, True)
    assert len(data["sets"]) == 6
    for each in data["sets"]:
        assert each["verdict"] == "controllable"
        assert each["gap"] > 1e3
        (added,) = each["measurements"]
        assert added["kind"] in ("encoder", "line")
        assert added["of"] in {"guide_1", "guide_2", "guide_3", "rod_1a", "rod_2a", "rod_3a"}


def test_advise_json_has_the_place_and_axis_of_all_but_encoders():
    """A record and its link are enough to observe the same again."""
    found = hrsynth.advise("uranesx")
    offered = hrsynth.advise("quattro", "1", candidate_sensor="point:platform,inclination")
    kinds = set()
    for each in (measurement for answer in (found, offered) for one in answer.sets for measurement in one.measurements):
        record, seen = each.to_dict(), each.observation
        kinds.add(each.kind)
        if each.kind == "encoder":
            assert "at" not in record
        else:
            assert (record["at"] is not None) == (seen.kind in ("line", "point"))
            assert (record["axis"] is not None) == (seen.kind != "point")
            assert record["axis"] is None or np.linalg.norm(record["axis"]) == pytest.approx(1)
    assert kinds >= {"line", "encoder", "leg", "offered"}


def test_advise_json_where_nothing_is_missing(run):
    data = run("advise", "quattro", "--observe", "1,4", "--json").data
    check_record(data, "advise", "quattro")
    assert (data["verdict"], data["nothing_missing"], data["sets"], data["size"]) == ("controllable", True, [], 0)
    assert run("advise", "quattro", "--observe", "1,4").out.endswith("\nNo measurement is missing\n")


@pytest.mark.parametrize(
    ("arguments", "lines"),
    [
        (
            ["uranesx"],
            [
                r"^verdict +partially controllable \(rank 2 of 3\)$",
                r"^unobserved at zero +translation along z$",
                r"^Controllable \(rank 3 of 3\) with one more measurement, 6 ways",
                r"^  position of an observed line: any of rod_1a, rod_2a, rod_3a$",
                r"^  encoder on a joint: any of guide_1\*, guide_2\*, guide_3\*$",
                r"^\* a joint with a motor$",
            ],
        ),
        (
            ["gough_stewart", "--observe", "1"],
            [r"with 2 more measurements, 10 ways", r"^  leg .*: any 2 of 2, 3, 4, 5, 6$"],
        ),
        (
            ["3prp"],
            [r"^  position of an observed line and encoder on a joint:$", r"^    \{dist_1, guide_2\*\}  [^:]* more "],
        ),
        (["3puu", "--observe", "1", "--camera", "platform"], [r"encoder .*\w \(first axis\)"]),
    ],
)
def test_advise_text_groups_the_cures(run, arguments: list[str], lines: list[str]):
    answer = run("advise", *arguments)
    assert (answer.status, answer.err) == (0, "")
    for line in lines:
        assert re.search(line, answer.out, re.MULTILINE), answer.out


def test_advise_tries_what_is_offered(run):
    """Three rays that do not meet in a point hold a body; with one image point two more are needed, of any offered."""
    words = ["gough_stewart", "--camera", "eye=base@0.3,0.1,0", "--sensor", "point:platform@0.1,0,0"]
    data = run("advise", *words, "--candidate-sensor", "point:platform", "--json").data
    check_record(data, "advise", "gough_stewart")
    offered = {m["of"] for each in data["sets"] for m in each["measurements"] if m["kind"] == "offered"}
    assert len(offered) == 4
    pairs = [each for each in data["sets"] if {m["kind"] for m in each["measurements"]} == {"offered"}]
    assert len(pairs) == 6
    chosen = [text for m in pairs[0]["measurements"] for text in ("--sensor", m["of"])]
    assert run("derive", *words, *chosen, "--json").data["verdict"] == "controllable"
    assert run("advise", *words, "--candidate-sensor", "point:platform@0,0.1,0", "--json").data["sets"]
    assert (
        "--candidate-sensor encoder:base: encoders are always tried on all joints"
        in run("advise", "delta", "--candidate-sensor", "encoder:base").refused()[0]
    )
    assert "--candidate-sensor point:moon@" in run("advise", "delta", "--candidate-sensor", "point:moon").refused()[0]


def test_advise_names_the_joints_of_the_file(run):
    """Two R that meet count as a U; an encoder is on one of the two, which `--sensor encoder:NAME` reads as well."""
    data = run(
        "advise", "example:panda", "--camera", "hand=panda_hand", "--sensor", "point:world@0.5,0.1,0", "--json"
    ).data
    joints = {m["of"] for each in data["sets"] for m in each["measurements"] if m["kind"] == "encoder"}
    assert joints <= {f"panda_joint{number}" for number in range(1, 8)}
    assert "panda_joint6" in joints
    assert all(m["axis"] is None for each in data["sets"] for m in each["measurements"] if m["kind"] == "encoder")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--observe", "9"], ["'9'", "legs 1, 2, 3"]),
        (["--observe", ""], ["empty name"]),
        (["--camera", "moon"], ["camera", "'moon'"]),
        (["--seed", "-1"], ["seed", "0"]),
    ],
)
def test_advise_refuses_what_does_not_fit(run, arguments: list[str], words: list[str]):
    (line,) = run("advise", "delta", *arguments).refused()
    assert all(word in line for word in words), line


# ---- singular


def test_singular_json_is_the_contract(run):
    data = run("singularities", "quattro_rigid", "--observe", "1,3", "--points", "40", "--json").data
    check_record(data, "singularities", "quattro_rigid")
    assert data["always"] is False
    assert data["words"] == "the tangents τ1, τ3 are parallel"
    assert data["expression"] == "det(n, tau1, tau3)"
    assert data["where"].keys() == {"n", "tau1", "tau3"}
    assert (data["checked"]["points"], data["checked"]["disagreements"]) == (40, 0)
    assert data["measured"] == {"kind": "directions", "of": ["rod_1a", "rod_3a"]}
    assert data["locus"] is data["file"] is None


def test_singular_json_has_singular_poses(run):
    examples = run("singularities", "rrrrr_m1", "--points", "100", "--json").data["examples"]
    assert examples
    for each in examples:
        assert each["pose"].keys() >= {"x", "y", "z"}
        assert each["singular_value"] < 1e-9 < 1e-3 < each["singular_value_nearby"]
        assert [lost["name"][:12] for lost in each["unobserved"]] == ["translation "]


def test_singular_json_where_a_freedom_is_always_lost(run):
    data = run("singularities", "uranesx", "--json").data
    check_record(data, "singularities", "uranesx")
    assert data["always"] is True
    assert data["words"].startswith("always: 1 of 3 dof never observed: translation along z")
    assert (data["expression"], data["verdict"]) == ("0", "partially controllable")
    assert data["checked"] == {"points": 0, "disagreements": 0}


def test_singular_of_the_real_robot(run):
    data = run("singularities", "rrrrr_m1", "--real", "--points", "30", "--json").data
    assert data["measured"]["kind"] == "motors"
    assert data["words"] == "the line B1B2 is normal to τ2"


def test_singular_text(run):
    answer = run("singularities", "rrrrr_m1", "--points", "100")
    assert (answer.status, answer.err) == (0, "")
    for line in (
        r"^Type 2 +the tangents τ1, τ2 are parallel$",
        r"^expression +det\(n, tau1, tau2\) = 0$",
        r"^checked +100 random poses and \d+ on the locus, 0 disagreements",
        r"^singular at +x=",
    ):
        assert re.search(line, answer.out, re.MULTILINE), answer.out


@pytest.mark.slow
def test_singular_draws_the_locus(run, tmp_path: Path):
    picture = tmp_path / "locus.png"
    data = run(
        "singularities", "3rrr_m1", "--points", "30", "--plane", "phi=0", "--steps", "9", "-o", picture, "--json"
    ).data
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert data["file"] == str(picture)
    assert data["locus"]["axes"].keys() == {"x", "y"}
    assert len(data["locus"]["hidden"]["type2"]) == 9
    assert 0 < data["locus"]["reached"] < 81
    assert list(tmp_path.iterdir()) == [picture]


@pytest.mark.some(3)
@pytest.mark.parametrize(
    ("robot", "arguments", "status", "words"),
    [
        ("delta", ["-o", "x.txt"], 2, ["unknown extension", "'x.txt'", ".png"]),
        ("delta", ["--plane", "z=-0.6"], 2, ["no figure is written", "-o FILE.png"]),
        ("delta", ["--plane", "phi=0", "-o", "x.png"], 2, ["cannot change phi", "x, y, z"]),
        ("delta", ["--plane", "z=5", "-o", "x.png"], 3, ["no pose of the plane z=5 is reached"]),
        ("hexaglide", ["-o", "x.png"], 2, ["has no singularity locus"]),
        ("delta", ["--observe", "9"], 2, ["legs 1, 2, 3"]),
        ("delta", ["--camera", "moon"], 2, ["'moon'"]),
    ],
)
def test_singular_refuses_in_one_line_and_writes_nothing(
    run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    robot: str,
    arguments: list[str],
    status: int,
    words: list[str],
):
    monkeypatch.chdir(tmp_path)
    (line,) = run("singularities", robot, "--points", "5", *arguments).refused(status)
    assert all(word in line for word in words), line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--plane", "q=1"], 2, ["unknown part", "'q'"]),
        (
            ["--plane", "phi=0,x=0"],
            2,
            ["must be free, here y.", "fewer fixed parts", "--grid y=-0.1:0.1:9 of check, accuracy"],
        ),
        (["--plane", "x=9"], 3, ["no pose of the plane x=9 is reached"]),
        (["--observe", "1"], 2, ["has no singularity locus", "legs that make it controllable"]),
    ],
)
def test_singular_refuses_a_plane_before_it_computes(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], status: int, words: list[str]
):
    monkeypatch.setattr(
        hrsynth, "singularities", lambda *_, **__: pytest.fail("computed before the plane was looked at")
    )
    (line,) = run("singularities", "3rrr_m1", *arguments, "-o", tmp_path / "x.png").refused(status)
    assert all(word in line for word in words), line


@pytest.mark.parametrize(
    "words", [["singularities", "-o", "x.png"], ["accuracy", "--cone", "1deg", "--plane", "y=0"]], ids=" ".join
)
def test_a_robot_of_one_freedom_has_no_plane(
    run, robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str]
):
    """Though its platform moves along x and along z: on a curve."""
    monkeypatch.chdir(tmp_path)
    (line,) = run(words[0], robot(FOUR_BAR), *words[1:]).refused()
    assert "--plane: two parts of the pose of four_bar must be free, here x and z, which depend on each other" in line
    assert "--grid x=-0.1:0.1:9" in line


@pytest.mark.slow
def test_singular_answers_3_where_condition_and_rank_disagree(run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("hrsynth.analysis.singularity.condition_check.RANK_CUTOFF_FRACTION", 1e-30)
    picture = tmp_path / "locus.png"
    (line,) = run("singularities", "rrrrr_m1", "--points", "100", "--steps", "5", "-o", picture).refused(3)
    assert "condition and rank disagree" in line
    assert not picture.exists()


# ---- path


@pytest.mark.parametrize(
    ("arguments", "verdict"),
    [
        (["rrrrr_m1", "--start", "x=0.05", "--goal", "x=-0.01,y=0.03"], "same aspect"),
        (["3prr_m1", "--start", "x=0,y=0", "--goal", "x=0.0585,y=0.073,phi=-88deg"], "separated"),
        (["3rrr_m1", "--start", "x=0,y=0", "--goal", "mode:2"], "separated"),
        (["3rps", "--start", "z=0.5", "--goal", "z=0.51"], "undecided"),
    ],
)
def test_path_json_is_the_contract_whatever_the_verdict(run, arguments: list[str], verdict: str):
    data = run("path", *arguments, "--json").data
    check_record(data, "path", arguments[0])
    assert data["verdict"] == verdict
    assert data["certified"] is (verdict != "undecided")
    ends = [data["start"], data["goal"]]
    assert [data["path"][0], data["path"][-1]] == [end["pose"] for end in ends]
    assert (ends[0]["value"] * ends[1]["value"] > 0) is (verdict != "separated")
    assert data["reason"]
    if data["certified"]:
        assert 0 < data["margin"] <= min(abs(end["value"]) for end in ends)
        assert data["boxes"] > 0
    else:
        assert data["margin"] is None


@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["delta", "linear_delta", "quattro_rigid", "rrrrr_m1"])
def test_path_of_too_few_legs_is_undecided(run, name: str):
    data = run("path", name, "--observe", "1", "--start", "x=0.01", "--goal", "x=0.02", "--json").data
    assert data["verdict"] == "undecided"
    assert "every pose is singular" in data["reason"]


def test_path_text_has_the_verdict_the_path_and_what_is_not_proved(run):
    answer = run("path", "quattro", "--observe", "1,4", "--start", "x=0.05", "--goal", "x=-0.05,phi=20deg")
    assert (answer.status, answer.err) == (0, "")
    assert re.search(r"^verdict +same aspect \(proved\)$", answer.out, re.MULTILINE)
    assert re.search(r"^path +x=0.05,", answer.out, re.MULTILINE)
    assert re.search(r"^not proved +collisions", answer.out, re.MULTILINE)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--start", "x=0", "--goal", "x=9"], 3, ["x=9", "is not reached"]),
        (["--start", "x=0", "--goal", "w=9"], 2, ["unknown part", "'w'"]),
        (["--start", "x=0", "--goal", "z=0.1"], 2, ["cannot change z"]),
        (["--start", "x=0", "--goal", "x=0.01", "--observe", "7"], 2, ["unknown leg or link", "'7'"]),
        (["--start", "x=0"], 2, ["--goal"]),
        (["--start", "x=0", "--goal", "x=0", "--as-written", "--tolerance", "1e-3"], 2, ["Omit one"]),
    ],
)
def test_path_refuses_what_does_not_fit(run, arguments: list[str], status: int, words: list[str]):
    (line,) = run("path", "3rrr_m1", *arguments).refused(status)
    assert all(word in line for word in words)


def test_path_to_where_it_starts_says_so(run):
    for start, goal, same in (("mode:2", "mode:2", True), ("x=0.01", "x=0.01", True), ("x=0.01", "x=0.02", False)):
        told = run("path", "3rrr_m1", "--start", start, "--goal", goal).out
        assert ("start and goal are the same pose" in told) is same


# ---- modes


@pytest.mark.parametrize(
    ("arguments", "count", "real"),
    [
        (["3rrr_m1"], 6, 2),
        (["3rps"], 8, 8),
        (["quattro", "--observe", "1,3", "--at", "x=0.05,y=0.1,z=-0.7"], 4, 4),
        (["3rrr_m1", "--real", "--at", "x=0.02,phi=5deg"], 6, 2),
    ],
)
def test_modes_json_is_the_contract(run, arguments: list[str], count: int, real: int):
    data = run("modes", *arguments, "--json").data
    check_record(data, "modes", arguments[0])
    assert (data["complex"], data["complete"], len(data["modes"])) == (count, True, real)
    for mode in data["modes"]:
        assert mode.keys() >= {"pose", "radius", "residual", "goal", "reachable", "type2_distance"}
        assert 0 <= mode["radius"] < 1e-9
        assert 0 <= mode["residual"] < 1e-9
        assert (mode["type2_distance"] is None) is bool(mode["unclosed_legs"])
        if mode["goal"]:
            assert mode["reachable"]
            assert mode["pose"]["x"] == pytest.approx(data["at"]["x"], abs=1e-9)
    assert sum(mode["goal"] for mode in data["modes"]) == 1


def test_modes_of_too_few_legs_are_a_continuum(run, tmp_path: Path):
    data = run("modes", "delta", "--observe", "1", "--json").data
    assert (data["continuous_family"], data["modes"], data["complete"], data["complex"]) == (1, [], False, None)
    picture = tmp_path / "modes.png"
    answer = run("modes", "delta", "--observe", "1", "-o", picture)
    assert answer.status == 0
    assert "a continuous family of dimension 1" in answer.out
    assert "is not drawn" in answer.err
    assert not picture.exists()


def test_modes_text_numbers_them_and_says_what_is_proved(run):
    answer = run("modes", "3rrr_m1")
    assert (answer.status, answer.err) == (0, "")
    said = r"^modes +2 real of 6 complex, proved to be all among poses in the plane of motion$"
    assert re.search(said, answer.out, re.MULTILINE)
    assert len(re.findall(r"^mode \d", answer.out, re.MULTILINE)) == 2
    assert answer.out.count("(the given pose)") == 1


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["3rrr_m1", "--at", "x=9"], 3, ["x=9", "is not reached"]),
        (["3rrr_m1", "--at", "w=9"], 2, ["unknown part", "'w'"]),
        (["3rrr_m1", "--observe", "7"], 2, ["unknown leg or link", "'7'"]),
        (["3rrr_m1", "-o", "modes.txt"], 2, ["modes.txt", ".png"]),
        (["3rrr_m1", "--real", "--observe", "1"], 2, ["--real: cannot be combined with --observe", "Omit one"]),
    ],
)
def test_modes_refuses_what_does_not_fit(run, arguments: list[str], status: int, words: list[str]):
    (line,) = run("modes", *arguments).refused(status)
    assert all(word in line for word in words)


# ---- servo


def test_servo_json_is_the_contract(run, tmp_path: Path):
    picture = tmp_path / "run.png"
    data = run("servo", "rrrrr_m1", "--start", "x=0,y=0.2", "--goal", "x=0.02,y=0.22", "-o", picture, "--json").data
    check_record(data, "servo", "rrrrr_m1")
    assert (data["outcome"], data["matched_mode"], data["noise"]) == ("goal", None, None)
    assert data["pose"]["x"] == pytest.approx(0.02, abs=1e-8)
    assert len(data["times"]) == len(data["poses"]) == len(data["error"])
    assert all(len(errors) == len(data["observed"]) for errors in data["error"])
    assert data["times"] == sorted(data["times"])
    assert data["error"][0][0] > 1e-3 > 1e-9 > data["error"][-1][0]
    assert data["type2"]["smallest"] > 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_servo_text_names_the_mode_and_how_far_it_is(run):
    answer = run(
        "servo",
        "quattro_rigid",
        "--observe",
        "1,2",
        "--start",
        "x=0.1,y=0.04,z=-0.93",
        "--goal",
        "x=0,y=-0.25,z=-0.7",
        "--gain",
        "5",
    )
    assert (answer.status, answer.err) == (0, "")
    assert re.search(r"^outcome +assembly mode after", answer.out, re.MULTILINE)
    assert "its assembly mode 2 of 2" in answer.out
    assert "mm and 0 deg from the goal" in answer.out
    assert answer.out.count("(the goal)") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--goal", "x=0.1", "--observe", "1"], ["do not determine", "hrsynth legs"]),
        (["--goal", "x=0.1", "--observe", "7"], ["unknown leg or link", "'7'"]),
        (["--goal", "x=0.1", "--noise", "90deg"], ["noise", "90deg", "below 90deg"]),
        (["--goal", "x=0.1", "--noise", "1px"], ["1px", "0.1deg"]),
        (["--goal", "x=0.1", "--sense", "edges", "--noise", "1deg"], ["1deg", "pixels"]),
        (["--goal", "x=0.1", "--sense", "touch"], ["touch", "exact, edges, images"]),
        (["--goal", "x=0.1", "--gain", "0"], ["gain", "positive"]),
        (["--goal", "x=0.1", "--time", "nan"], ["time", "positive"]),
        (["--goal", "x=0.1", "-o", "run.txt"], ["run.txt", ".png"]),
    ],
)
def test_servo_refuses_what_does_not_fit(run, arguments: list[str], words: list[str]):
    (line,) = run("servo", "delta", "--start", "x=0,y=0", *arguments).refused(2)
    assert all(word in line for word in words)


@pytest.mark.some(1, 6)
@pytest.mark.parametrize(
    "arguments",
    [
        ["derive", "--at", "x=9"],
        ["legs", "--at", "x=9"],
        ["check", "--at", "x=9"],
        ["check", "--grid", "x=8:9:2"],
        ["modes", "--at", "x=9"],
        ["path", "--start", "x=0", "--goal", "x=9"],
        ["path", "--start", "x=9", "--goal", "x=0"],
        ["servo", "--start", "x=0", "--goal", "x=9"],
        ["servo", "--start", "x=9", "--goal", "x=0"],
        ["accuracy", "--cone", "1deg", "--at", "x=9"],
        ["accuracy", "--cone", "1deg", "--grid", "x=8:9:2,y=0,z=-0.6"],
        ["accuracy", "--cone", "1deg", "--plane", "z=9"],
        ["select", "--start", "x=0", "--goal", "x=9"],
        ["singularities", "--points", "5", "--plane", "z=9", "-o", "locus.png"],
    ],
    ids=" ".join,
)
def test_a_pose_that_is_not_reached_ends_with_3(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
):
    monkeypatch.chdir(tmp_path)
    (line,) = run(arguments[0], "delta", *arguments[1:]).refused(3)
    assert "is reached" in line or "is not reached" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("module", "arguments"), [("mujoco", ["--dynamics"]), ("cv2", ["--sense", "images"])])
def test_servo_names_the_extra_that_is_missing(run, monkeypatch: pytest.MonkeyPatch, module: str, arguments: list[str]):
    monkeypatch.setitem(sys.modules, module, None)
    (line,) = run("servo", "delta", "--start", "x=0,y=0", "--goal", "x=0.05,y=0", *arguments).refused(3)
    assert "hrsynth[bench]" in line


# ---- legs, robots, convert


def test_legs_json(run):
    data = run("legs", "quattro", "--json").data
    check_record(data, "legs", "quattro")
    assert len(data["sets"]) == 2**4 - 1
    assert all(one.keys() >= {"legs", "verdict", "rank", "unobserved"} for one in data["sets"])
    assert {one["verdict"] for one in data["sets"]} <= VERDICTS
    best = max(one["rank"] for one in data["sets"])
    sizes = {len(one["legs"]) for one in data["sets"] if one["rank"] == best}
    smallest = [one["legs"] for one in data["sets"] if one["rank"] == best and len(one["legs"]) == min(sizes)]
    assert data["minimal"] == smallest == [["1", "3"], ["1", "4"], ["2", "3"], ["2", "4"]]


def test_robots_json_names_every_file(run):
    data = run("robots", "--json").data
    check_record(data, "robots", None)
    assert [one["name"] for one in data["robots"]] == list(list_robots())
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
    assert first.read_bytes() == second.read_bytes() == list_robots()[name].read_bytes()


def test_nothing_is_written_over_the_file_that_is_read(run, robot):
    file = robot(FOUR_BAR)
    once = file.read_bytes()
    link = file.with_name("link.urdf")
    link.symlink_to(file)
    for arguments in (
        ("convert", file, file),
        ("convert", file, link),
        ("convert", link, file),
        ("convert", file.with_name("..") / file.parent.name / file.name, file),
        ("convert", file, file, "--to", "sdf"),
        ("derive", file, "-o", file),
    ):
        assert "it is the input file" in run(*arguments).refused()[0]
    assert file.read_bytes() == once


def test_every_written_file_is_told_and_none_beside_is_replaced(run, robot):
    file = robot(FOUR_BAR)
    once = file.read_bytes()
    settings = file.with_suffix(".yaml")
    assert len(run("convert", file, settings).refused()) == 1
    assert run("convert", "3prp", settings).refused()[0].count(str(file)) == 1
    assert not settings.exists()
    assert file.read_bytes() == once
    other = file.with_name("other.yaml")
    files = [str(other.with_suffix(".urdf")), str(other)]
    for _ in range(2):
        assert run("convert", file, other, "--json").data["files"] == files
        assert all(name in run("convert", file, other).out for name in files)
    assert "with other content" in run("convert", "3prp", other).refused()[0]


def test_an_ending_of_no_dialect_is_refused(run, tmp_path: Path):
    for name in ("x.foo", "x"):
        said = run("convert", "3prp", tmp_path / name).refused()[0]
        assert all(ending in said for ending in (".urdf", ".xml", ".sdf", ".yaml", ".usd"))
    assert list(tmp_path.iterdir()) == []
    assert run("convert", "3prp", tmp_path / "x.foo", "--to", "native").status == 0


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
    assert run("derive", file).refused() == [
        f"hrsynth: {file}:1: no loop: not a parallel robot: expected a <loop>; for a serial arm or a free body "
        '<hrsynth serial="true">'
    ]


def test_a_loop_that_cannot_be_closed_is_named_with_its_residual(run, robot):
    end = '<origin xyz="2 0 0"/>\n    </successor>'
    file = robot(FOUR_BAR.replace(end, end.replace("2 0 0", "2.5 0 0")))
    (line,) = run("derive", file).refused(3)
    assert line.startswith(f"hrsynth: {file}:25: ")
    assert "'d'" in line
    assert float(re.search(r"residual ([-+.e\d]+) ", line)[1]) > 0.1


def with_observes(*observes: tuple[str, str]) -> tuple[str, int]:
    """A shipped robot with these (leg, link) observed, one a line; the line of the last."""
    text = list_robots()["delta"].read_text(encoding="utf-8")
    place = text.index("<platform")
    lines = [f'<observe leg="{leg}" link="{link}" axis="0 0 1"/>\n' for leg, link in observes]
    return text[:place] + "\n" + "".join(lines) + text[place:], text.count("\n", 0, place) + 1 + len(lines)


@pytest.mark.parametrize(
    "observes",
    [
        [("1", "rod_1a"), ("1", "rod_2a")],
        [("1", "rod_1a"), ("2", "base")],
        [("1", "rod_1a"), ("2", "platform")],
    ],
)
def test_observe_elements_that_contradict_the_legs(run, robot, observes: list[tuple[str, str]]):
    text, number = with_observes(*observes)
    file = robot(text)
    for command in ("derive", "legs"):
        lines = run(command, file).refused()
        assert len(lines) == 1
        assert lines[0].startswith(f"hrsynth: {file}:{number}: ")


def test_files_that_are_none(run, robot, tmp_path: Path):
    assert "a folder with no robot file" in run("derive", tmp_path).refused()[0]
    sparse = tmp_path / "junk.urdf"
    with open(sparse, "wb") as stream:
        stream.truncate(200_000_000)
    assert "no such file" in run("derive", tmp_path / "none.urdf").refused()[0]
    assert "a robot's file: got ''" in run("derive", "").refused()[0]
    assert "no such movable joint" in run("derive", robot(FOUR_BAR), "--motors", "").refused()[0]
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
    done = process("robots")
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
    command = f"{sys.executable} -m hrsynth.cli robots --json | head -c 1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("{", "")
    closed = f"{sys.executable} -m hrsynth.cli robots | true"
    done = subprocess.run(["bash", "-c", closed], capture_output=True, text=True)
    assert done.stderr == ""


def test_the_command_line_is_light_to_import():
    code = "import sys, hrsynth.cli; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "hrsynth.cli" in loaded
    assert not {"numpy", "networkx", "lxml", "pinocchio"} & set(loaded)
