"""What leaves: no name steers a terminal or a page, streams that take nothing cost no answer, and a system without
POSIX loses only what needs it."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from hrsynth.characters import STEERING, escape_steering, name_steering, restore_steering
from hrsynth.cli import run_command
from hrsynth.present.studio.worker import answer_message

STEERED = re.compile(f"[{STEERING}]")
HOSTILE = "\x9b31mRED\x9b0m\u202egpj\u2066\u061c\u2028\u0085"
"""Colours, a text from right to left, ends of lines: as far as XML can hold them."""
CLI = Path(hrsynth.__file__).parent / "cli"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shipped robot, with names that steer a terminal."""
    file = tmp_path_factory.mktemp("hostile") / "robot.urdf"
    hrsynth.save(hrsynth.load("3rrr_m1"), file)
    text = re.sub(r'(<(?:link|joint|robot)\b[^>]*\bname|link|joint)="([^"]+)"', rf'\1="\2{HOSTILE}"', file.read_text())
    file.write_text(text)
    return file


ASKED = (
    ["check"],
    ["derive"],
    ["legs"],
    ["lint"],
    ["derive", "--json"],
    ["modes"],
    ["check", "--observe", "none"],
    ["lint", "--format", "github"],
    ["lint", "--format", "sarif"],
    ["check", "--platform", f"x{HOSTILE}"],
)


@pytest.mark.some(4)
@pytest.mark.parametrize("asked", ASKED, ids=" ".join)
def test_no_output_steers_a_terminal(asked: list[str], hostile: Path, capsys: pytest.CaptureFixture[str]):
    assert run_command([asked[0], str(hostile), *asked[1:]]) in (0, 1, 2)
    said = capsys.readouterr()
    assert not STEERED.search(said.out + said.err)
    assert "\\u202e" in said.out + said.err
    if "--json" in asked:
        assert HOSTILE[:9] in json.loads(said.out)["robot"]


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "asked",
    [["view", "--static", "page.html"], ["derive", "--report", "page.html"], ["modes", "-o", "page.svg"]],
    ids=" ".join,
)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_no_page_is_steered_by_a_name(asked: list[str], hostile: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert run_command([asked[0], str(hostile), *asked[1:]]) == 0
    page = Path(asked[-1]).read_text(encoding="utf-8")
    assert not STEERED.search(page)
    for data in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL):
        assert not STEERED.search(json.dumps(json.loads(data), ensure_ascii=False))


@settings(deadline=None, max_examples=50)
@given(
    st.recursive(
        st.text(st.one_of(st.characters(), st.sampled_from(HOSTILE + "\ud800\x1b\x7f")), max_size=9),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner),
    )
)
def test_escaped_json_is_the_same_json_and_pages_name_what_they_are_told(value: object):
    written = json.dumps(value, ensure_ascii=False, indent=2)
    assert not STEERED.search(escape_steering(written))
    assert json.loads(escape_steering(written)) == value
    assert not STEERED.search(name_steering(written))
    if "[U+" not in written:
        assert restore_steering(name_steering(written)) == written


def test_the_studio_names_them_and_takes_them_back():
    asked: list[str] = []

    def answer(told: dict) -> dict:
        asked.append(told["leg"])
        return {"leg": told["leg"]}

    sent = answer_message(SimpleNamespace(answer=answer), {"n": 1, "leg": HOSTILE}).decode()
    assert not STEERED.search(json.loads(sent)["answer"]["leg"])
    again = json.loads(restore_steering(json.dumps({"n": 1, "leg": json.loads(sent)["answer"]["leg"]})))
    answer_message(SimpleNamespace(answer=answer), again)
    assert asked == [HOSTILE, HOSTILE]


def test_all_output_of_the_command_line_leaves_at_one_place():
    for file in sorted(CLI.glob("*.py")):
        calls = [
            ast.unparse(node.func)
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.Call)
        ]
        writes = [each for each in calls if each == "print" or each.endswith(("stdout.write", "stderr.write"))]
        assert bool(writes) == (file.name == "colour.py"), (file.name, writes)


GOOD, WRONG = ["robots"], ["robots", "more"]
STREAMS = [
    ("", GOOD, 0),
    ("", WRONG, 2),
    ("2>&-", GOOD, 0),
    ("2>&-", WRONG, 2),
    ("2>/dev/full", GOOD, 0),
    ("2>/dev/full", WRONG, 2),
    (">&-", GOOD, 0),
    (">&-", WRONG, 2),
    (">/dev/full", GOOD, 2),
    (">/dev/full", WRONG, 2),
    (">&- 2>&-", GOOD, 0),
    (">&- 2>&-", WRONG, 2),
    (">/dev/full 2>/dev/full", GOOD, 2),
    (">/dev/full 2>&-", WRONG, 2),
    ("<&- >&- 2>&-", WRONG, 2),
    ("| true", GOOD, 0),
    ("2>&1 >/dev/null | true", WRONG, 2),
]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.some(3)
@pytest.mark.parametrize(("streams", "asked", "status"), STREAMS, ids=str)
def test_an_exit_status_does_not_depend_on_streams_that_take_nothing(streams: str, asked: list[str], status: int):
    command = f"set -o pipefail; {sys.executable} -m hrsynth {' '.join(asked)} {streams}"
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert run.returncode == status
    assert "Traceback" not in run.stderr + run.stdout
    assert "Exception ignored" not in run.stderr
    assert len(run.stderr.splitlines()) <= 1


@pytest.mark.slow
def test_a_file_does_not_take_the_place_of_a_closed_stream(tmp_path: Path):
    """What libraries print goes nowhere, not into the file that is written."""
    for streams in (">&-", "2>&-", ">&- 2>&-"):
        run = subprocess.run(
            ["bash", "-c", f"{sys.executable} -m hrsynth convert 3rrr_m1 robot.urdf {streams}"],
            cwd=tmp_path,
            check=False,
        )
        assert run.returncode == 0
        assert hrsynth.load(tmp_path / "robot.urdf").differences(hrsynth.load("3rrr_m1")) == []


ELSEWHERE = """
import os, signal, sys
sys.modules.update(dict.fromkeys(("fcntl", "resource", "termios", "pwd", "grp", "tty", "pty"), None))
for name in ("SIGHUP", "SIGCHLD", "SIGKILL", "SIGPIPE"):
    delattr(signal, name)
for name in ("fork", "killpg", "setsid", "setpgid"):
    delattr(os, name)
from hrsynth.cli import run_command
sys.exit(run_command(sys.argv[1:]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "needs"),
    [
        (["-h"], None),
        (["check", "3rrr_m1"], None),
        (["derive", "3rrr_m1", "-o", "hidden.urdf"], None),
        (["catalog", "list", "--legs", "3-R*RR"], None),
        (["view", "3rrr_m1", "--static", "view.html"], None),
        (["modes", "3rrr_m1"], None),
        (["catalog", "build", "sensors", "-o", "built", "--limit", "1"], "fcntl"),
        (["studio", "--no-browser"], "fcntl"),
    ],
    ids=str,
)
def test_without_posix_one_line_names_what_does_not_work(asked: list[str], needs: str | None, tmp_path: Path):
    run = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, *asked],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"NO_COLOR": "1"},
    )
    if needs is None:
        assert (run.returncode, run.stderr) == (0, "")
    else:
        (line,) = run.stderr.splitlines()
        assert "of POSIX systems. Use Linux" in line
        assert needs in line
        assert run.returncode == 3
