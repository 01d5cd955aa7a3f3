"""The pages of the reference that are made while the site is built: all commands and all errors are on them."""

from __future__ import annotations

import re

import pytest

import hrsynth
from hrsynth import errors
from hrsynth.cli import app
from tables import commands, costs
from tables import errors as errors_page
from tables.markdown import block


def test_every_command_is_on_the_page_with_its_help():
    page = commands.build_page()
    for entry in commands.walk(app):
        assert f"\n\n```text\nUsage: {entry.path} " in page
    assert page.count("## ") == sum(1 for _ in commands.walk(app))


def test_every_error_is_on_the_page_with_its_exit_status():
    page = errors_page.build_page()
    titles = re.split(r"^## ", page, flags=re.MULTILINE)
    for kind in errors_page.list_classes(errors.HrsynthError):
        assert f"| `{kind.__name__}` | {errors_page.first_sentence(kind)} |" in next(
            text for text in titles if f"(exit status {kind.exit_status})" in text
        )


def test_the_example_of_the_page_of_errors_prints_what_it_shows(capsys: pytest.CaptureFixture[str]):
    code = re.search(r"```python\n(.*?)```", errors_page.build_page(), re.DOTALL)[1]
    exec(compile(code, "errors.md", "exec"), {"hrsynth": hrsynth})
    assert capsys.readouterr().out.splitlines() == re.findall(r"# → (.*)", code)


def test_the_table_of_costs_has_each_command():
    rows = block(costs.PAGE.read_text(encoding="utf-8"), costs.START).splitlines()[2:]
    assert [row.partition("`")[2].split(" ")[0].split("`")[0] for row in rows] == [
        command.split(" ")[0] for command in costs.COMMANDS
    ]
