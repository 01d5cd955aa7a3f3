"""The package by its public names: all there, the same objects as in their modules, and light until asked for."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import hrsynth
from hrsynth.analysis import controllability
from hrsynth.analysis import derive as derivation
from hrsynth.description import list_robots, load, save


def test_public_names_are_those_of_their_modules():
    assert (hrsynth.load, hrsynth.save, hrsynth.list_robots) == (load, save, list_robots)
    assert (hrsynth.derive, hrsynth.legs) == (derivation.derive, controllability.legs)
    assert set(hrsynth.__all__) <= set(dir(hrsynth))


def test_no_folder_hides_a_public_function():
    """A folder that is imported becomes an attribute of the package, whatever the function of its name."""
    below = {path.stem for path in Path(hrsynth.__file__).parent.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert below & set(hrsynth.__all__) == {"catalog"}


@pytest.mark.parametrize("name", ["main", "dev", "all"])
def test_a_lock_holds_all_that_its_packages_need(name: str):
    """With hashes pip installs nothing that is not listed: one package left out, and no set-up works."""
    text = (Path(__file__).parent.parent / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    pinned = {canonicalize_name(each) for each in re.findall(r"^([\w.-]+)==", text, re.MULTILINE)}
    missing = set()
    for package in pinned:
        try:
            needs = [Requirement(each) for each in metadata.requires(package) or ()]
        except metadata.PackageNotFoundError:
            continue
        missing |= {
            f"{package}: {each}"
            for each in needs
            if canonicalize_name(each.name) not in pinned
            and (each.marker is None or each.marker.evaluate({"extra": ""}))
        }
    assert len(pinned) > 30
    assert missing == set()


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = hrsynth.nothing  # type: ignore[attr-defined]
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
    readers |= {f"hrsynth.description.assembly.{name}" for name in ("build", "geometry_repair", "generic")}
    writers = {f"hrsynth.description.formats.{name}.write" for name in ("gepetto", "mjcf", "sdf")}
    assert not {"networkx", "sympy", "scipy", "matplotlib", *readers, *writers} & set(run.stdout.split())
