"""Findings as text, GitHub annotations, SARIF and JSON; exit statuses; the page of rules."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import hrsynth
from description.foreign.examples import FILES
from hrsynth.cli import execute
from hrsynth.linting.findings import SEVERITIES
from hrsynth.linting.rules import lint_rules
from hrsynth.present.text.lint import github, sarif
from linting.defects import CASES, damaged, put, sound
from tables import lint_rules as page
from tables.markdown import block

ROOT = Path(__file__).resolve().parents[2]
TEXT = {"type": "object", "required": ["text"], "properties": {"text": {"type": "string", "minLength": 1}}}
LEVEL = {"enum": ["none", "note", "warning", "error"]}
LOCATIONS = {
    "type": "array",
    "items": {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "physicalLocation": {
                "type": "object",
                "required": ["artifactLocation"],
                "additionalProperties": False,
                "properties": {
                    "artifactLocation": {
                        "type": "object",
                        "required": ["uri"],
                        "properties": {"uri": {"type": "string", "pattern": "^(file:///)?[^ \\\\]*$"}},
                    },
                    "region": {"type": "object", "properties": {"startLine": {"type": "integer", "minimum": 1}}},
                },
            }
        },
    },
}
SARIF = {
    "type": "object",
    "required": ["version", "runs"],
    "additionalProperties": False,
    "properties": {
        "$schema": {"type": "string", "format": "uri"},
        "version": {"const": "2.1.0"},
        "runs": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "required": ["tool", "results"],
                "additionalProperties": False,
                "properties": {
                    "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                    "tool": {
                        "type": "object",
                        "required": ["driver"],
                        "additionalProperties": False,
                        "properties": {
                            "driver": {
                                "type": "object",
                                "required": ["name"],
                                "additionalProperties": False,
                                "properties": {
                                    "name": {"type": "string"},
                                    "version": {"type": "string"},
                                    "semanticVersion": {"type": "string"},
                                    "rules": {
                                        "type": "array",
                                        "uniqueItems": True,
                                        "items": {
                                            "type": "object",
                                            "required": ["id"],
                                            "additionalProperties": False,
                                            "properties": {
                                                "id": {"type": "string"},
                                                "shortDescription": TEXT,
                                                "fullDescription": TEXT,
                                                "help": TEXT,
                                                "defaultConfiguration": {
                                                    "type": "object",
                                                    "properties": {"level": LEVEL},
                                                },
                                            },
                                        },
                                    },
                                },
                            }
                        },
                    },
                    "results": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": ["message"],
                            "additionalProperties": False,
                            "properties": {
                                "ruleId": {"type": "string"},
                                "ruleIndex": {"type": "integer", "minimum": -1},
                                "level": LEVEL,
                                "message": TEXT,
                                "locations": LOCATIONS,
                            },
                        },
                    },
                    "invocations": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": ["executionSuccessful"],
                            "additionalProperties": False,
                            "properties": {
                                "executionSuccessful": {"type": "boolean"},
                                "toolExecutionNotifications": {
                                    "type": "array",
                                    "items": {
                                        "type": "object",
                                        "required": ["message"],
                                        "additionalProperties": False,
                                        "properties": {"message": TEXT, "level": LEVEL, "locations": LOCATIONS},
                                    },
                                },
                            },
                        },
                    },
                },
            },
        },
    },
}
"""What SARIF 2.1.0 says of the parts that are written."""


@pytest.fixture
def bad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("a b").mkdir()
    path = Path("a b") / "robot: 100%,\u00e9.urdf"
    path.write_text(damaged(sound(), CASES[0].damage))
    return path


def test_sarif_is_as_its_schema_says(bad: Path):
    found = hrsynth.lint([bad, "quattro"], ignore="guessed")
    log = json.loads(sarif(found))
    Draft202012Validator.check_schema(SARIF)
    assert [each.message for each in Draft202012Validator(SARIF).iter_errors(log)] == []
    (run,) = log["runs"]
    rules = run["tool"]["driver"]["rules"]
    assert "guessed" not in {each["id"] for each in rules}
    assert len(run["results"]) == len(found.findings)
    for result, finding in zip(run["results"], found.findings, strict=True):
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"] == finding.rule
        place = result["locations"][0]["physicalLocation"]
        assert place.get("region", {}).get("startLine") == finding.line
    assert run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == (
        "a%20b/robot%3A%20100%25%2C%C3%A9.urdf"
    )


def test_annotations_of_github_are_escaped(bad: Path):
    found = hrsynth.lint(bad)
    lines = github(found).splitlines()
    assert len(lines) == len(found.findings)
    shape = re.compile(r"::(error|warning|notice) file=[^,:]*(,line=\d+)?,title=[\w-]+::.+")
    assert all(shape.fullmatch(line) for line in lines)
    error = next(line for line in lines if line.startswith("::error"))
    assert "file=a b/robot%3A 100%25%2C\u00e9.urdf,line=" in error
    assert "title=limits-order::joint 'shoulder_1'" in error


def test_text_names_place_rule_and_mend(bad: Path):
    text = str(hrsynth.lint(bad))
    finding = next(each for each in hrsynth.lint(bad).findings if each.rule == "limits-order")
    assert f"{bad}:{finding.line}: error: {finding.message} [limits-order]\n" in text
    assert "    \u2192 exchange the two numbers (--fix applies it)" in text
    assert text.splitlines()[-1].startswith("1 file: 1 error, 0 warnings, ")
    element = bad.read_text().splitlines()[finding.line - 1]
    assert "<limit" in element


@pytest.mark.some(6)
@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ([], 1),
        (["--fail-on", "nothing"], 0),
        (["--ignore", "limits-order", "--ignore", "refused"], 0),
        (["--format", "sarif"], 1),
        (["--format", "xml"], 2),
        (["--json", "--format", "sarif"], 2),
        (["--fail-on", "x"], 2),
        (["--compare", "nothing.urdf"], 2),
        (["more.urdf"], 2),
        (["--ignore", "refused", "--fail-on", "note"], 1),
        (["-o", "x.urdf"], 2),
        (["--program", "x"], 2),
    ],
)
def test_the_exit_status_tells(bad: Path, capsys, arguments: list[str], status: int):
    assert execute(["lint", str(bad), *arguments]) == status
    printed = capsys.readouterr()
    assert (printed.out == "") is (status == 2 and arguments != ["more.urdf"])  # what can be read is told
    assert bool(printed.err) is (status == 2)
    assert "Traceback" not in printed.err


def test_what_can_be_read_is_told_where_other_files_cannot(bad: Path, tmp_path: Path, capsys):
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot\n")
    alone = hrsynth.lint([bad])
    found = hrsynth.lint([broken, bad, "more.urdf"])
    assert [each.to_dict() for each in found.findings] == [each.to_dict() for each in alone.findings]
    assert [each.file for each in found.unread] == [str(broken), "more.urdf"]
    assert found.headline() == f"{alone.headline()}; 2 more could not be read"
    assert execute(["lint", str(broken), str(bad)]) == 2
    printed = capsys.readouterr()
    assert printed.out.startswith(str(alone).rsplit("\n", 1)[0])
    assert printed.err == f"hrsynth: {broken}:2: {found.unread[0].text}\n"
    assert github(found).startswith(f"::error file={broken},line=2,title=unread::malformed XML")
    log = json.loads(sarif(found))
    assert [each.message for each in Draft202012Validator(SARIF).iter_errors(log)] == []
    assert not log["runs"][0]["invocations"][0]["executionSuccessful"]
    assert execute(["lint", str(broken), "more.urdf"]) == 2
    assert capsys.readouterr().out == ""


def test_a_refusal_in_another_file_on_the_same_line_is_told(tmp_path: Path):
    """An error of one file hides no refusal of a file that it includes."""
    pytest.importorskip("xacro")
    head = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    (tmp_path / "part.xacro").write_text(
        head
        + """<link name="tip"/>\n
        <joint name="b" type="helical"><parent link="arm"/><child link="tip"/><axis xyz="0 0 1"/></joint></robot>"""
    )
    (tmp_path / "robot.xacro").write_text(
        head
        + """<link name="base"/><link name="arm"/>
        <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
        <limit lower="1" upper="-1" effort="1" velocity="1"/></joint>
        <xacro:include filename="part.xacro"/></robot>"""
    )
    found = {(each.rule, Path(each.file).name, each.line) for each in hrsynth.lint(tmp_path / "robot.xacro").findings}
    assert {("limits-order", "robot.xacro", 4), ("refused", "part.xacro", 4)} <= found


def test_json_and_fix_on_the_command_line(bad: Path, capsys):
    assert execute(["lint", str(bad), "--fix", "-o", "mended.urdf", "--format", "json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["file"] == "mended.urdf"
    assert [(each["rule"], each["fixable"]) for each in record["mended"]] == [("limits-order", True)]
    assert record["counts"]["error"] == 0
    assert execute(["lint", str(bad), "--fix"]) == 0
    assert f"The fixed file is written to {bad}." in capsys.readouterr().out
    assert bad.read_text() == Path("mended.urdf").read_text()


def test_a_file_that_cannot_be_written_is_left_as_it_is(bad: Path, capsys):
    before = bad.read_bytes()
    assert execute(["lint", str(bad), "--fix", "-o", "no/such/folder.urdf"]) == 2
    assert capsys.readouterr().err.startswith("hrsynth: cannot write the file")
    assert bad.read_bytes() == before
    assert sorted(each.name for each in Path().rglob("*")) == ["a b", bad.name]


def test_the_page_of_rules_is_fresh():
    text = (ROOT / "docs" / "pages" / "lint_rules.md").read_text(encoding="utf-8")
    assert block(text, page.START) == page.table(), "the page is stale: make readme"


def test_every_rule_says_what_why_and_what_to_do():
    rules = lint_rules()
    assert len(rules) > 40
    for name, rule in rules.items():
        assert re.fullmatch(r"[a-z]+(-[a-z]+)*", name)
        assert rule.severity in SEVERITIES
        assert min(len(rule.title), len(rule.explanation), len(rule.advice)) > 5
        assert not rule.title.endswith(".")
        assert rule.explanation.endswith(".")


@pytest.mark.slow
def test_what_is_mended_only_where_a_rule_says_so(tmp_path: Path):
    """A finding comes with a mend only if its rule announces one."""
    path = tmp_path / "robot.urdf"
    for case in CASES:
        if case.ending == ".urdf" and case.robot == "3rrr_m1":
            path.write_text(damaged(sound(), case.damage))
            found = hrsynth.lint(path, ignore=("constraint-dead", "constraint-redundant", "motors-few", "motors-many"))
            assert all(lint_rules()[each.rule].fixable for each in found.findings if each.fixable)


def test_a_mend_of_a_file_that_xacro_made_is_left_to_its_source(tmp_path: Path):
    pytest.importorskip("xacro")
    path = tmp_path / "robot.urdf.xacro"
    text = damaged(sound(), put("link/inertial/mass", value="-1"))
    path.write_text(
        text.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1).replace(
            "</robot>", '<xacro:property name="x" value="1"/></robot>'
        )
    )
    found = hrsynth.lint(path, fix=True)
    negative = [each for each in found.findings if each.rule == "mass-negative"]
    (tmp_path / "plain.urdf").write_text(text)
    (plain,) = (each for each in hrsynth.lint(tmp_path / "plain.urdf").findings if each.rule == "mass-negative")
    assert [(each.line, each.fixable) for each in negative] == [(plain.line, False)]
    assert (found.written, found.mended) == (None, ())


@pytest.mark.parametrize("door", ["robot.yaml", ""])
def test_a_fix_follows_no_link_that_is_not_named(door: str, tmp_path: Path, capsys):
    files, folder, other = FILES["gepetto: 3d"], tmp_path / "robot", tmp_path / "other.urdf"
    folder.mkdir()
    text = files["robot.urdf"].replace('<link name="crank"', '<link nmae="x" name="crank"', 1)
    limit = '<joint name="a" type="revolute"><limit lower="1" upper="-1"/>'
    text = re.sub('<joint name="a" type="[a-z]+">', limit, text, count=1)
    assert limit in text
    (folder / "robot.yaml").write_text(files["robot.yaml"])
    other.write_text(text)
    (folder / "robot.urdf").symlink_to(other)
    assert execute(["lint", str(folder / door), "--fix"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(folder / "robot.urdf") in line
    assert other.read_text() == text
    assert (folder / "robot.urdf").is_symlink()
    assert execute(["lint", str(folder / door), "--fix", "-o", str(tmp_path / "mended.urdf")]) in (0, 1)
    assert other.read_text() == text
    execute(["lint", str(folder / "robot.urdf"), "--fix"])
    assert other.read_text() != text
