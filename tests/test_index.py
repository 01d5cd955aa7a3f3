"""The index of the public functions is that of their declarations."""

from __future__ import annotations

import subprocess
import sys
from inspect import signature

import pytest

import hrsynth
from hrsynth.index import INDEX, STUB, format_index, format_stub, list_analyses, list_analysis_options
from hrsynth.options import NEEDED, list_options


def test_the_files_are_made_of_the_declarations():
    assert INDEX.read_text(encoding="utf-8") == format_index(), "run make index"
    assert STUB.read_text(encoding="utf-8") == format_stub(), "run make index"


@pytest.mark.parametrize("name", list_analyses())
def test_options_come_back_from_the_index_as_they_are_declared(name: str):
    function = getattr(hrsynth, name)
    assert list_analysis_options(name) == list(function.declaration.options) == list(list_options(function.__wrapped__))
    known = signature(function).parameters
    for option in list_analysis_options(name):
        default = known[option.name].default
        assert option.default == (NEEDED if default is known[option.name].empty else default or option.default)


def test_help_loads_nothing_that_computes():
    code = (
        "import sys; from hrsynth.cli import run_command; run_command(['check', '-h']); print('numpy' in sys.modules)"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.endswith("False\n")
