"""The help, the names of options and the completion of shells: what a person meets before any answer."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hrsynth
from hrsynth.cli import app, run_command
from hrsynth.cli.analyses import QUESTIONS
from hrsynth.cli.completion import list_completions
from hrsynth.description import list_robots
from hrsynth.options import OBSERVATION, OUTPUT, OVERRIDES

ROOT: Any = app
LEAVES = [(name,) for name, each in ROOT.commands.items() if not hasattr(each, "commands")] + [
    (name, inner) for name, each in ROOT.commands.items() for inner in getattr(each, "commands", {})
]


def called(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run_command(list(arguments)) == 0
    return capsys.readouterr().out


def command(path: tuple[str, ...]):
    found = ROOT
    for name in path:
        found = found.commands[name]
    return found


@pytest.mark.parametrize("path", LEAVES, ids=" ".join)
def test_help_shows_every_option_in_its_group_and_its_examples(capsys, path: tuple[str, ...]):
    shown = called(capsys, *path, "-h")
    assert shown == called(capsys, *path, "--help")
    assert shown.startswith(f"Usage: hrsynth {' '.join(path)} ")
    blocks = dict(re.findall(r"^(\S.*):\n((?:  .*\n)+)", shown, re.MULTILINE))
    assert "-h, --help" in blocks[OUTPUT]
    for option in command(path).options:
        block = blocks["Arguments" if option.argument else option.group]
        assert re.search(rf"^  {re.escape(option.shown)}(  |$)", block, re.MULTILINE)
        assert " ".join(option.told.split()) in " ".join(block.split())
    assert "..." not in re.sub(r"\[\w+\]\.\.\.", "", shown)
    assert blocks.get("Examples", "").count(f"hrsynth {' '.join(path)}") == len(command(path).examples)


def test_every_question_has_examples_and_its_options_in_groups(capsys):
    for question in QUESTIONS:
        shown = called(capsys, question.name, "-h")
        watched = (OBSERVATION,) * (question.name != "branch")  # which has to do with motors alone
        assert all(f"\n{title}:\n" in shown for title in (*watched, OUTPUT, OVERRIDES, "Examples"))


@pytest.mark.parametrize("width", ["50", "80", "200"])
def test_summaries_are_whole_at_any_width(capsys, monkeypatch: pytest.MonkeyPatch, width: str):
    monkeypatch.setenv("COLUMNS", width)
    shown = " ".join(called(capsys, "-h").split())
    assert all(" ".join((each.help or "?").split()) in shown for each in ROOT.commands.values())
    assert shown == " ".join(called(capsys).split())


LONGEST = {("select", "quattro"), ("basins", "quattro"), ("equilibria", "quattro")}
"""Examples that take a minute; the first notebooks, the pages and smaller robots ask the same."""


def examples() -> Iterator[tuple[str, ...]]:
    for path in LEAVES:
        for text in command(path).examples:
            yield *path, *shlex.split(text.partition(" >")[0])


@pytest.mark.parametrize("arguments", list(examples()), ids=" ".join)
def test_examples_are_commands(arguments: tuple[str, ...]):
    """Every option of an example is read with its type."""
    path = next(path for path in LEAVES if arguments[: len(path)] == path)
    read = command(path).values(list(arguments[len(path) :]))
    assert set(read) == {each.name for each in command(path).options}


@pytest.mark.parametrize(
    "words",
    [
        ["quattro", "--observe", "1,4", "-o", "a.urdf", "--seed", "3", "--close", "a:b", "--close", "-c:d", "--json"],
        ["-oa.urdf", "--close=a:b", "--seed=3", "--observe=1,4", "--json", "--close=-c:d", "quattro"],
        ["-o=a.urdf", "--close=a:b", "--seed=3", "--observe=1,4", "--json", "--close=-c:d", "quattro"],
        [
            "--json",
            "--output=a.urdf",
            "--close",
            "a:b",
            "--seed",
            "4",
            "--close=-c:d",
            "--seed=3",
            "--observe",
            "1,4",
            "--",
            "quattro",
        ],
    ],
    ids=" ".join,
)
def test_options_stand_anywhere_and_their_values_in_any_form(words: list[str]):
    """Of what is given twice the last counts, of what can be repeated all; a value may begin with a dash."""
    read = command(("derive",)).values(words)
    given = {
        "robot": "quattro",
        "observe": "1,4",
        "output": "a.urdf",
        "seed": 3,
        "close": ["a:b", "-c:d"],
        "json": True,
    }
    assert read == {each.name: each.default for each in command(("derive",)).options} | given
    assert command(("derive",)).values([*words[:-1], "-h"]) is None or "--" in words


def test_a_flag_can_be_denied_and_words_that_repeat_are_all_taken():
    assert [command(("view",)).values(["delta", *more])["open_"] for more in ([], ["--no-open"], ["--open"])] == [
        True,
        False,
        True,
    ]
    assert command(("lint",)).values(["a", "--fix", "b", "--", "-c"])["files"] == ["a", "b", "-c"]
    assert command(("lint",)).values(["--fix", "--", "-c", "--"])["files"] == ["-c", "--"]
    assert (
        command(("legs",)).values(["a", "--observe", "--", "--camera=--", "--close", "-h"]).items()
        >= {"observe": "--", "camera": ["--"], "close": ["-h"]}.items()
    )


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("derive", "derive: ROBOT missing"),
        ("accuracy delta", "bounds are missing. Give --cone 0.1deg for directions, or"),
        ("catalog site", "catalog site: -o, --output DIR missing"),
        ("derive quattro --observ 1", "derive has no option --observ. Try --observe"),
        ("derive quattro -x", "derive has no option -x. Try --arg, --as-written"),
        ("derive quattro --nope", "derive has no option --nope. Try --arg, --as-written, --at"),
        ("-x", "unknown option: got '-x', expected -h, --help"),
        ("derive quattro --seed x", "--seed: got 'x', expected an integer, at least 0"),
        ("derive quattro --seed 1.5", "--seed: got '1.5'"),
        ("derive quattro --seed=-1", "--seed: got '-1'"),
        ("servo delta --gain 1e9", "--gain: got '1e9', expected a number, at most 1e+06"),
        ("modes delta --time-limit nan", "--time-limit: got 'nan'"),
        ("derive quattro a b", "a b: unexpected argument. See hrsynth derive -h"),
        ("derive quattro --at", "--at: expected one argument: expected POSE"),
        ("derive quattro -o --observe 1,4", "-o: no value. Give FILE, or write -o=--observe"),
        ("legs delta --observe --at 1", "--observe: no value. Give LEGS, or write --observe=--at"),
        ("derive quattro --observe 1 --observe 4", "--observe: repeated. Write --observe 1,4."),
        ("derive quattro --json=3", "--json: ignored explicit argument '3'"),
        *[
            (f"derive quattro --seed{between}--", "--seed: got '--', expected an integer, at least 0")
            for between in " ="
        ],
        ("nope", "unknown command: got 'nope', expected derive"),
        ("catalog nope", "unknown command: got 'nope'"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(capsys, words: str, told: str):
    assert run_command(words.split()) == 2
    shown = capsys.readouterr()
    assert told in shown.err
    assert shown.out == ""
    assert shown.err.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(each, marks=[pytest.mark.long] * (each[:2] in LONGEST))
        for each in examples()
        if each[0] not in ("view", "studio", "catalog") and not any(part.endswith(".urdf") for part in each[1:2])
    ],
    ids=" ".join,
)
def test_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys, arguments: tuple[str, ...]):
    monkeypatch.chdir(tmp_path)
    if "c.json" in arguments and arguments[0] == "verify":  # the file that the example of modes writes
        assert run_command(["modes", "quattro", "--observe", "1,4", "--certificate", "c.json"]) == 0
    if "leg.xml" in arguments:
        assert run_command(["convert", "3rrr_m1", "leg.xml"]) == 0
    assert run_command(list(arguments)) == 0, capsys.readouterr().err
    assert capsys.readouterr().err == ""


def test_python_m_hrsynth_is_the_command_line():
    done = [
        subprocess.run([sys.executable, "-m", module, "-h"], capture_output=True, text=True)
        for module in ("hrsynth", "hrsynth.cli")
    ]
    assert [each.returncode for each in done] == [0, 0]
    assert done[0].stdout == done[1].stdout
    assert done[0].stdout.startswith("Usage: hrsynth ")


def test_the_old_names_of_start_and_goal_are_no_options(capsys):
    for old in ("--from", "--to"):
        assert run_command(["path", "rrrrr_m1", "--start", "x=0.05", old, "x=0.01"]) == 2
        assert f"path has no option {old}. " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        (["der"], ["derive"]),
        (["catalog", "s"], ["show", "site"]),
        (["derive", "quattro", "--form", ""], ["simplified", "general"]),
        (["derive", "quattro", "--rep"], ["--report"]),
        (["servo", "delta", "--sense", "e"], ["exact", "edges"]),
        (["derive", "quattro", "-o", ""], []),
        (["view", "delta", "--no"], ["--no-open"]),
        (["--v"], ["--version"]),
        (["completion", ""], ["bash", "zsh", "fish"]),
        (["derive", "quattro", "--json", "--observe", "1", "--j"], ["--json"]),
        (["nothing", "x"], []),
    ],
)
def test_completion_knows_commands_options_and_words(typed: list[str], expected: list[str]):
    assert list_completions(ROOT, typed) == expected


def test_completion_knows_robots_and_every_option():
    assert (
        list_completions(ROOT, ["derive", ""]) == list_completions(ROOT, ["lint", "a.urdf", ""]) == list(list_robots())
    )
    for path in LEAVES:
        offered = list_completions(ROOT, [*path, "--"])
        known = {part for each in command(path).options for name in each.names for part in name.split("/")}
        assert {*offered} - {"--help"} == {name for name in known if name.startswith("--")}


def test_completion_knows_the_examples_once_they_are_begun():
    known = [f"example:{name}" for name in hrsynth.list_examples()]
    assert (
        list_completions(ROOT, ["derive", "exa"])
        == list_completions(ROOT, ["verify", "c.json", "--robot", "example:"])
        == known
    )
    assert list_completions(ROOT, ["derive", "example:cassie"])[0].startswith("example:cassie")


def test_bash_replaces_what_stands_after_the_colon(capsys, tmp_path: Path):
    """Bash takes ``example:cas`` as three words and puts what is offered in the place of the last."""
    if shutil.which("bash") is None:
        pytest.skip("no bash here")
    offered = "example:cassie example:cast"
    (tmp_path / "hrsynth").write_text(f'#!/bin/sh\n[ "$5" = example:cas ] && printf "%s\\n" {offered}\n')
    (tmp_path / "hrsynth").chmod(0o755)
    (tmp_path / "script").write_text(called(capsys, "completion", "bash"))
    line = "hrsynth derive example:cas"
    asked = f'source {tmp_path}/script; COMP_WORDBREAKS=" :="; COMP_LINE="{line}"; COMP_POINT={len(line)}; _hrsynth; '
    done = subprocess.run(
        ["bash", "-c", asked + 'echo "${COMPREPLY[@]}"'],
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
    )
    assert done.stdout.split() == ["cassie", "cast"], done.stderr


INTERACTIVE = {
    "bash": 'source {script}; COMP_LINE="hrsynth derive qua"; COMP_POINT=18; _hrsynth; echo "${{COMPREPLY[@]}}"',
    "zsh": "autoload -Uz compinit; compinit -u -D; compadd() {{ print -r -- ${{(P)@[-1]}} }}; _files() {{ : }}; "
    "source {script}; words=(hrsynth derive qua); CURRENT=3; _hrsynth",
    "fish": 'source {script}; complete -C "hrsynth derive qua"',
}


@pytest.mark.parametrize("shell", INTERACTIVE)
def test_a_shell_completes_with_its_script(capsys, tmp_path: Path, shell: str):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    program = tmp_path / "hrsynth"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m hrsynth "$@"\n')
    program.chmod(0o755)
    script = tmp_path / f"completion.{shell}"
    script.write_text(called(capsys, "completion", shell))
    done = subprocess.run(
        [shell, "-c", INTERACTIVE[shell].format(script=script)],
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "HOME": str(tmp_path)},
    )
    assert done.stdout.split() == ["quattro", "quattro_rigid"], done.stderr


@pytest.mark.some(1)
@pytest.mark.parametrize(("more", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)])
def test_colour_is_for_terminals_whose_user_wants_it(more: dict[str, str], coloured: bool, capsys):
    assert run_command(["legs", "3rrr_m1"]) == 0
    plain = capsys.readouterr().out
    assert "\x1b" not in plain
    main, end = pty.openpty()
    env = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TERM")}
    done = subprocess.run(
        [sys.executable, "-m", "hrsynth", "legs", "3rrr_m1"],
        stdout=end,
        stderr=subprocess.DEVNULL,
        env={**env, "TERM": "xterm", **more},
    )
    os.close(end)
    shown = b""
    with contextlib.suppress(OSError):
        while part := os.read(main, 65536):
            shown += part
    text = shown.decode().replace("\r\n", "\n")
    assert done.returncode == 0
    assert ("\x1b[" in text) is coloured
    assert ("\x1b[32mcontrollable\x1b[0m" in text) is coloured
    assert re.sub(r"\x1b\[\d*m", "", text) == plain


def test_groups_of_commands_have_examples_too(capsys):
    assert run_command(["catalog", "-h"]) == 0
    assert "Examples:\n  hrsynth catalog list --legs 3-R*RR --verdict controllable\n" in capsys.readouterr().out


def test_a_command_without_a_record_is_told_from_no_command(capsys):
    assert run_command(["schema", "studio"]) == 2
    assert "command without JSON: got 'studio'" in capsys.readouterr().err
    assert run_command(["schema", "stodio"]) == 2
    assert "unknown command: got 'stodio'" in capsys.readouterr().err
