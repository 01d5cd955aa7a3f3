"""Names mean nothing: a file in which a part is renamed is the same robot, whatever the new name looks like."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hrsynth.description import formats, load, save
from hrsynth.description.chains import BODY, CUT, END, SECOND, TIP, WELD
from hrsynth.errors import BadRequest, HrsynthError
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import normal_form

ROBOT = "3rps"
NAME = r"\w+_\d\w*"
"""Names of parts of its legs."""
DIALECTS = {"native": ".urdf", "gepetto": ".yaml", "mjcf": ".xml", "sdf": ".sdf", "usd": ".usda"}
ENDS = ("__1", "__2", "__3", CUT, WELD, END, SECOND, TIP, BODY)


@cache
def texts(dialect: str) -> dict[str, str]:
    """The files of a robot with universal and spherical joints in its loops."""
    target = Path("robot").with_suffix(DIALECTS[dialect])
    chosen = formats.dialects()[dialect]
    found = formats.writer(dialect)(load(ROBOT)).texts
    return {file.name: text for file, text in zip(chosen.files(target), found, strict=True)}


def answer(texts: dict[str, str], folder: Path, first: str) -> object:
    """What robot files are: notation, motors, freedoms of what hangs on nothing; or what is wrong with them."""
    for name, text in texts.items():
        (folder / name).write_text(text)
    try:
        robot = load(folder / first)
    except HrsynthError as error:
        assert error.exit_status == 2
        return type(error)
    anatomy = decompose(normal_form(robot).mechanism)
    return str(anatomy.architecture()), sum(joint.actuated for joint in robot.joints.values())


def renamed(texts: dict[str, str], old: str, new: str) -> dict[str, str]:
    return {name: re.sub(rf"(?<!\w){re.escape(old)}(?!\w)", new, text) for name, text in texts.items()}


CASES = [pytest.param(dialect, end, id=f"{dialect}{end}", marks=[pytest.mark.slow] * (dialect == "usd"))
         for dialect in DIALECTS for end in ENDS]


@pytest.mark.some(12)
@pytest.mark.parametrize(("dialect", "end"), CASES)
def test_a_renamed_part_changes_nothing(dialect: str, end: str, tmp_path: Path):
    """Parts whose new names end like those that writers give to what they add, after any other name of the file."""
    if dialect == "usd":
        pytest.importorskip("pxr")
    files = texts(dialect)
    first = next(iter(files))
    whole = answer(files, tmp_path, first)
    assert isinstance(whole, tuple)
    names = sorted(set(re.findall(NAME, "".join(files.values()))))
    rng = np.random.default_rng(len(end) * 100 + ord(end[2]))
    for _ in range(4):
        old, stem = rng.choice([name for name in names if "_" in name]), re.sub(r"__\w+$", "", rng.choice(names))
        if stem + end in names:
            continue
        plain = answer(renamed(files, old, "plain"), tmp_path, first)
        assert answer(renamed(files, old, stem + end), tmp_path, first) == plain, (old, stem + end)
