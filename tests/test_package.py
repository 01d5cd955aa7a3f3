"""The package by its public names: all there, the same objects as in their modules, and light until asked for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import hrsynth
from hrsynth.analysis import controllability
from hrsynth.analysis import derive as derivation
from hrsynth.description import load, save, shipped


def test_public_names_are_those_of_their_modules():
    assert (hrsynth.load, hrsynth.save, hrsynth.shipped) == (load, save, shipped)
    assert (hrsynth.derive, hrsynth.legs) == (derivation.derive, controllability.legs)
    assert set(hrsynth.__all__) <= set(dir(hrsynth))


def test_no_folder_hides_a_public_function():
    """A folder that is imported becomes an attribute of the package, whatever the function of its name."""
    below = {path.stem for path in Path(hrsynth.__file__).parent.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert below & set(hrsynth.__all__) == {"catalog"}


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = hrsynth.nothing
    with pytest.raises(ImportError):
        exec("from hrsynth import nothing")


def test_the_import_alone_brings_in_nothing():
    code = "import sys, hrsynth; hrsynth.__version__; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = run.stdout.split()
    assert "hrsynth" in loaded
    assert not {"numpy", "networkx", "lxml", "typer", "pinocchio", "hrsynth.description"} & set(loaded)


def test_the_names_survive_the_import_of_their_modules():
    code = "import hrsynth.analysis.derive; from hrsynth import derive, legs; print(derive.__name__, legs.__name__)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["derive", "legs"]


def test_a_derivation_of_a_native_file_imports_only_what_it_uses():
    code = "import sys, hrsynth; hrsynth.derive(hrsynth.load('3rpr_m1')); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    readers = {f"hrsynth.description.formats.{name}.read" for name in ("gepetto", "mjcf", "sdf", "urdf")}
    readers |= {"hrsynth.description.assembly.build"}
    writers = {f"hrsynth.description.formats.{name}.write" for name in ("gepetto", "mjcf", "sdf")}
    assert not {"networkx", "sympy", "scipy", "matplotlib", *readers, *writers} & set(run.stdout.split())
