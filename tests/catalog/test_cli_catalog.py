"""`catalog` on the command line: JSON, text, robots written, refusals in one line."""

from __future__ import annotations

import json
import os
import re
import time
from collections import Counter
from pathlib import Path

import pytest

import hrsynth
from catalog.stub import WORKERS, source
from hrsynth.catalog import load
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.build import build
from hrsynth.catalog.drawing import draw_architecture
from hrsynth.cli import run_command
from hrsynth.cli.progress import Progress
from hrsynth.present.text.catalog import CATALOG_ENTRIES_PRINTED_MAX, format_entries
from hrsynth.present.text.tables import LINE


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    """The command line on the small catalog: status, output, errors."""
    monkeypatch.delenv("HRSYNTH_DEBUG", raising=False)
    monkeypatch.setattr("hrsynth.catalog.build.list_architectures", source)

    def call(*arguments: str | Path) -> tuple[int, str, str]:
        capsys.readouterr()
        return run_command(["catalog", *map(str, arguments)]), *capsys.readouterr()

    return call


def check_refused(answer: tuple[int, str, str], said: str, status: int = 2) -> None:
    found, out, err = answer
    assert (found, out) == (status, ""), err
    assert re.fullmatch(r"hrsynth: [^\n]*\n", err)
    assert said in err


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    build(tmp_path / "small", source=source())
    return tmp_path / "small"


def test_a_list_reads_only_the_entries_that_it_prints():
    class Read(list[dict[str, object]]):
        read = 0

        def __getitem__(self, place):
            found = super().__getitem__(place)
            self.read += len(found) if isinstance(place, slice) else 1
            return found

    records = Read([{"key": str(i), "refused": "so"} for i in range(1000)])
    told = format_entries(records, 2000).splitlines()
    assert [line.split()[0] for line in told[2:-2]] == [str(i) for i in range(CATALOG_ENTRIES_PRINTED_MAX)]
    assert told[-1].startswith("1000 of 2000 architectures, the first 100 shown")
    assert records.read == CATALOG_ENTRIES_PRINTED_MAX
    assert "shown" not in format_entries(records[:CATALOG_ENTRIES_PRINTED_MAX], 2000)


def test_why_a_word_is_refused_makes_no_column_wide():
    reason = "the mechanism cannot move " * 8
    seen = {
        "key": "a",
        "notation": "3-RRR",
        "dof": 3,
        "motion": "2T1R",
        "verdict": "controllable",
        "rank": 3,
        "fewest": 3,
    }
    told = format_entries([seen, {"key": "b", "notation": "3-PPP", "refused": reason}], 2).splitlines()
    assert max(map(len, told)) <= LINE
    assert "refused" in told[3]
    words = [*told[3].split()[3:], *" ".join(told[4:-2]).split()]
    assert " ".join(words) == reason.strip()


def test_build_writes_and_tells_what_it_did(run, tmp_path: Path):
    status, out, err = run("build", "-o", tmp_path / "new", "--limit", 30, "--json")
    data = json.loads(out)
    assert (status, err, data["command"], data["version"]) == (0, "", "catalog build", hrsynth.__version__)
    assert [(each["now"], each["file"] is None) for each in data["groups"]] == [(24, False), (6, True)]
    status, out, err = run("build", "-o", tmp_path / "new", "--workers", WORKERS)
    assert (status, err) == (0, "")
    assert [line.split()[:4] for line in out.splitlines()[2:]] == [["c", "24", "0", "24"], ["d", "18", "12", "6"]]
    assert len(load(tmp_path / "new")) == 42
    status, out, _ = run("build", "--check", "-o", tmp_path / "new")
    assert (status, out) == (0, "not stale\n")


def test_check_tells_what_is_stale_with_status_3(run, folder: Path):
    file = folder / "c.jsonl"
    file.write_text(file.read_text().replace('"mobility"', '"Mobility"'))
    (folder / "d.jsonl").unlink()
    status, out, err = run("build", "--check", "--sample", 9, "-o", folder)
    assert (status, out, len(err.splitlines())) == (3, "", 2)
    assert all(re.match(r"hrsynth: [cd]: ", line) for line in err.splitlines())
    status, out, err = run("build", "c", "--check", "-o", folder, "--json")
    assert status == 3
    assert [f"hrsynth: {each}" for each in json.loads(out)["stale"]] == err.splitlines()


def test_list_finds_what_python_finds(run, folder: Path):
    for options, asked in [
        ([], {}),
        (["--dof", 3], {"dof": 3}),
        (["--legs", "?-R*", "--base-motors"], {"legs": "?-R*", "base_motors": True}),
        (["--verdict", "controllable", "--moving-motors"], {"verdict": "controllable", "base_motors": False}),
        (["--text", "two lines"], {"text": "two lines"}),
        (["--legs", "3"], {"legs": 3}),
        (["--group", "d", "--fewest", 2, "--motion", "3T"], {"group": "d", "fewest": 2, "motion": "3T"}),
    ]:
        wanted = load(folder, **asked)
        status, out, err = run("list", "--catalog", folder, *options, "--json")
        data = json.loads(out)
        assert (status, err, data["command"], data["total"]) == (0, "", "catalog list", 42)
        assert data["entries"] == list(wanted)
        status, out, _ = run("list", "--catalog", folder, *options)
        assert status == 0
        assert out.splitlines()[-1] == f"{len(wanted)} of 42 architectures in the groups c, d"
        assert len(out.splitlines()) == (len(wanted) + 4 if len(wanted) else 1)


def test_show_draws_and_writes_a_robot(run, tmp_path: Path):
    store = tmp_path / "real"
    word = "3(Rz*-Rz-Rz)"
    facts = {
        "key": word,
        "group": "g",
        "notation": "3-R*RR",
        "hidden": "3-PiR*R",
        "legs": 3,
        "dof": 3,
        "motion": "2T1R",
        "mobility": 3,
        "internal": 0,
        "verdict": "controllable",
        "rank": 3,
        "exact": True,
        "instances": 1,
        "motors": 3,
        "base_motors": True,
        "fewest": 3,
        "minimal": [["1", "2", "3"]],
        "unobserved": [],
        "modes_bound": 6,
        "modes_seen": 2,
        "condition": "the lines meet in a point",
    }
    build(store, source=hrsynth.catalog.build.WordSource({"g": lambda: [word]}, lambda _: facts))
    file = tmp_path / "robot.urdf"
    status, out, err = run("show", "(Rz*-Rz-Rz)+2(Rz*-Rz-Rz)", "--catalog", store, "-o", file)
    assert (status, err) == (0, "")
    for line in (
        r"3\(Rz\*-Rz-Rz\)   3-R\*RR",
        r"legs 1, 2, 3  base ── Rz\* ── Rz ══ Rz ── platform",
        r"dof +3, 2T1R \(mobility 3, of which 0 internal\)",
        r"verdict +controllable \(rank 3 of 3\)",
        r"exact +proved",
        r"legs needed +\{1, 2, 3\}",
        r"modes +2 real found of 6 complex; near modes not counted",
        rf"The robot is written to {re.escape(str(file))}\.",
    ):
        assert re.search(f"^{line}$", out, re.MULTILINE), out
    robot = hrsynth.load(file)
    assert len(robot.joints) == 9
    data = json.loads(run("show", word, "--catalog", store, "--json")[1])
    assert (data["command"], data["note"], data["file"]) == ("catalog show", None, None)
    assert data["entry"] == facts


PLATES = "bar:(Pk*-2SSt)+(Rt*-2SSt)|(Pk*-2SSt)+(Rt*-2SSt)"


@pytest.mark.slow
@pytest.mark.parametrize("word", [PLATES, "4(Px*-Uyn-Uny)", "(Ph*-Pj-Ra-Ra)+(Ph*-Pj-Ra-Ra-Rb)+(Ph*-Pj-Ra-Rb-Ra)"])
def test_each_smallest_set_has_the_hidden_robot_of_its_legs(run, word: str, tmp_path: Path):
    """It is what `derive` finds in the robot file; the sets are those of `legs`, none where nothing is observed."""
    file = tmp_path / "robot.urdf"
    data = json.loads(run("show", word, "-o", file, "--json")[1])
    alone = [
        (each["legs"], hrsynth.derive(file, observe=each["legs"]).hidden_architecture.ascii)
        for each in data["smallest"]
    ]
    assert [(each["legs"], each["hidden"]) for each in data["smallest"]] == alone
    assert all(each["problem"] is None for each in data["smallest"])
    for each in data["smallest"]:
        counted = each["legs"] == data["entry"].get("modes_legs")
        assert each["near_matches"] == (len(hrsynth.modes(file, observe=each["legs"]).near_modes) if counted else None)
    sets, told = [each["legs"] for each in data["smallest"]], hrsynth.legs(file).minimal
    assert sets == data["entry"]["minimal"]
    assert set(map(tuple, sets)) <= set(told)
    assert bool(told) == (data["entry"]["rank"] > 0)
    assert data["entry"]["fewest"] == (len(told[0]) if told else 0)


def test_plates_are_told_apart_by_the_hidden_robots_of_pairs(run):
    shown = run("show", PLATES)[1]
    assert re.search(r"^hidden robots  \{1, 3\}: 2-P-\{2-U\*U\}; .*\{2, 4\}: 2-Pi-\{2-U\*U\}$", shown, re.MULTILINE)
    assert re.search(r"^modes .*; near modes found: \d+$", shown, re.MULTILINE)


def test_no_robot_of_a_refused_architecture_is_written(run, tmp_path: Path):
    file = tmp_path / "robot.urdf"
    check_refused(run("show", "2(Px*-2SSy)", "-o", file), "2(Px*-2SSy): refused: no confirmed")
    assert not file.exists()


def test_show_studies_what_is_not_in_the_catalog(run, folder: Path):
    status, out, _ = run("show", "3(Rz*-Rz-Rz)", "--catalog", folder, "--json")
    assert status == 0
    assert json.loads(out)["note"] == "not in the catalog, analysed now"


@pytest.mark.parametrize(
    ("word", "legs"),
    [
        ("2(Rt*-2SSt)+(Pz*-2SSt)", ["base ── Rt* ══ 2SSt ══ platform", "base ── Pz* ══ 2SSt ══ platform"]),
        ("3(Rz*!-Rz-Rz)", ["base ── Rz* ══ Rz ── Rz ── platform"]),
        ("3(Rz-Rz*-Rz)+(Rz-Rz-Rz)", ["base ── Rz ── Rz ══ Rz ── platform", "base ── Rz ── Rz* ══ Rz ── platform"]),
        ("6(Utn-Pl*-S)", ["base ── Utn ══ Pl* ── S ── platform"]),
    ],
)
def test_drawings_show_motors_and_watched_links(word: str, legs: list[str]):
    """P joints do not turn what is watched: either side of one is the same direction."""
    drawn = [
        re.sub(r" ══ Pl\* ── | ── Pl\* ══ ", " ══ Pl* ── ", line)
        for line in draw_architecture(parse(word)).splitlines()
    ]
    assert sorted(line.split("  ", 1)[1].strip() for line in drawn) == sorted(legs)
    labels = Counter(label for line in drawn for label in re.findall(r"\d+", line.split("base")[0]))
    assert labels == Counter(str(i + 1) for i in range(len(parse(word).legs)))


def test_bad_input_is_one_line(run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    check_refused(run("build"), "build needs --output")
    package = Path(hrsynth.__file__).parent
    check_refused(run("build", "-o", package / "catalog" / "new"), "inside the installed package")
    check_refused(run("build", "nothing", "-o", tmp_path / "new"), "unknown group: got 'nothing', expected c, d")
    check_refused(run("build", "-o", tmp_path / "new", "--sample", 3), "--sample without --check")
    check_refused(run("build", "-o", folder, "--check", "--anew"), "--anew with --check")
    check_refused(run("build", "-o", tmp_path / "new", "--workers", 0), "--workers")
    check_refused(run("build", "-o", tmp_path / "no" / "where"), "No such file or directory")
    check_refused(run("list", "--catalog", tmp_path / "nowhere"), "not found")
    check_refused(run("list", "--dof", "many"), "--dof")
    for legs in ("banana", "9", "", "3-r*"):
        check_refused(run("list", "--catalog", folder, "--legs", legs), "--legs: no such entry")
        check_refused(
            run("site", "-o", tmp_path / "site", "--catalog", folder, "--legs", legs), "--legs: no such entry"
        )
    check_refused(run("list", "--catalog", folder, "--motion", "9T"), "--motion: no such entry")
    check_refused(run("list", "--catalog", folder, "--dof", 9), "--dof: no such entry")
    check_refused(run("show", "", "--catalog", folder), "no architecture of the catalog")
    check_refused(run("show", "nope", "--catalog", folder), "hrsynth catalog list --text nope")
    check_refused(run("show", "no pe", "--catalog", folder), "hrsynth catalog list --text 'no pe'")
    check_refused(run("show", "3(Qz*-Rz-Rz)"), "unknown joint")
    check_refused(run("show", "3(Rz*-Rz-Rz)", "-o", tmp_path / "robot.doc"), "robot.doc")
    check_refused(run("show", "3()", "--catalog", folder), "unknown joint")
    (folder / "c.jsonl").write_text((folder / "c.jsonl").read_text().replace('"catalog":1', '"catalog":0'))
    check_refused(run("list", "--catalog", folder), "another version")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["small"]


def test_what_is_seen_is_no_name_to_search_for(run, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("hrsynth.catalog.query.find_named", None)
    check_refused(run("show", "3(Rz*-Rz-Rz)@nosuch"), "of a kind, such as 3point")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_one_line(run, tmp_path: Path):
    (tmp_path / "locked").mkdir(mode=0o500)
    check_refused(run("build", "-o", tmp_path / "locked"), "Permission denied")


def test_without_a_command_it_tells_which_there_are(run):
    status, out, err = run()
    assert (status, err) == (0, "")
    assert all(f"\n  {command}" in out for command in ("build", "list", "show"))


def test_the_meter_tells_the_time_left_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress(wait=-1.0, counted=True) as meter:
        meter.count("c", 2, 10)
        meter.count("d", 0, 5)
        for done in range(3, 11):
            meter.count("c", done, 10)
            time.sleep(0.03)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", capsys.readouterr().err)
    assert re.search(r"c .*\b10/15\b.*\b0:00:0[01]\b.* left", shown), shown
    with Progress(counted=True) as meter:
        meter.count("c", 2, 10)
    assert capsys.readouterr().err == ""


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("option", "value", "allowed"), [("--verdict", "contrlable", "uncontrollable"), ("--group", "foo", "planar")]
)
def test_what_no_architecture_has_is_refused(option: str, value: str, allowed: str, capsys: pytest.CaptureFixture[str]):
    assert run_command(["catalog", "list", option, value]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert value in said.err
    assert allowed in said.err


@pytest.mark.slow
def test_published_robots_are_listed_and_shown(run, tmp_path: Path):
    status, out, _ = run("list", "--catalog", "published", "--group", "2T1R", "--verdict", "controllable")
    assert status == 0
    assert "P3RRR1G1P1" in out
    assert "of 8780 architectures" in out
    status, out, _ = run("show", "P3RRR1G1P1")
    assert status == 0
    assert re.search(r"motor choices +joint 1 of each leg: 3", out)
    check_refused(run("show", "P3RRR1G1P1", "-o", tmp_path / "robot.urdf"), "studies/parroblib")
