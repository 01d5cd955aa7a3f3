"""Names mean nothing: a file in which a part is renamed is the same robot, whatever the new name looks like."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hrsynth.description import formats, load, save
from hrsynth.description.chains import BODY, CUT, END, SECOND, TIP, WELD
from hrsynth.errors import BadRequest
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form

ROBOT = "3upu"
NAME = r"\w+_\d\w*"
"""Names of parts of its legs."""
DIALECTS = {"native": ".urdf", "gepetto": ".yaml", "mjcf": ".xml", "sdf": ".sdf", "usd": ".usda"}
ENDS = ("__1", "__2", "__3", CUT, WELD, END, SECOND, TIP, BODY)


@cache
def texts(dialect: str) -> dict[str, str]:
    """The files of a robot with universal and spherical joints in its loops."""
    target = Path("robot").with_suffix(DIALECTS[dialect])
    chosen = formats.list_formats()[dialect]
    found = formats.get_writer(dialect)(load(ROBOT)).texts
    return {file.name: text for file, text in zip(chosen.files(target), found, strict=True)}


def answer(texts: dict[str, str], folder: Path, first: str) -> object:
    """What robot files are: the notation and the number of motors."""
    for name, text in texts.items():
        (folder / name).write_text(text)
    robot = load(folder / first)
    decomposition = decompose(reduce_to_normal_form(robot).mechanism)
    return str(decomposition.architecture()), sum(joint.is_actuated for joint in robot.joints.values())


def renamed(texts: dict[str, str], old: str, new: str) -> dict[str, str]:
    return {name: re.sub(rf"(?<!\w){re.escape(old)}(?!\w)", new, text) for name, text in texts.items()}


CASES = [
    pytest.param(dialect, end, id=f"{dialect}{end}", marks=[pytest.mark.slow] * (dialect == "usd"))
    for dialect in DIALECTS
    for end in ENDS
]


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
    for _ in range(3):
        old, stem = rng.choice(names), re.sub(r"__\w+$", "", rng.choice(names))
        if stem + end not in names:
            assert answer(renamed(files, old, stem + end), tmp_path, first) == whole, (old, stem + end)


@pytest.mark.parametrize("dialect", ["gepetto", "mjcf"])
def test_a_part_of_a_chain_may_lose_its_name(dialect: str, tmp_path: Path):
    files = texts(dialect)
    first = next(iter(files))
    names = sorted(name for name in set(re.findall(NAME, "".join(files.values()))) if re.search("_2__", name))
    assert len(names) >= 4
    for name in names:
        assert answer(renamed(files, name, "plain"), tmp_path, first) == ("3-UP\u0332U", 3), name


@pytest.mark.parametrize("name", ["body", "body_fixed", "arm_joint", "plain"])
def test_a_name_made_up_for_a_part_is_no_name_of_a_later_one(name: str, tmp_path: Path):
    text = (
        '<mujoco><worldbody><body name="base"><body name="arm"><joint/><joint pos="0 0 1" axis="1 0 0"/>'
        '<body><inertial pos="0 0 0" mass="1"/><body name="NAME"><joint name="NAME"/></body></body></body></body>'
        "</worldbody></mujoco>"
    ).replace("NAME", name)
    (tmp_path / "robot.xml").write_text(text)
    assert len(load(tmp_path / "robot.xml", platform=name).joints) == 4


def test_what_a_joint_is_written_as_takes_no_name_of_another(tmp_path: Path):
    robot = load(ROBOT)
    whole = next(joint for joint in robot.joints.values() if joint.in_tree and joint.type.freedoms == 2)
    other = next(joint for joint in robot.joints.values() if joint.in_tree and joint.type.freedoms == 1)
    joints = {name: joint for name, joint in robot.joints.items() if joint is not other}
    taken = replace(robot, joints={**joints, f"{whole.name}__2": replace(other, name=f"{whole.name}__2")})
    for dialect, ending in DIALECTS.items():
        if dialect in ("native", "gepetto", "mjcf"):
            with pytest.raises(BadRequest, match="is written in several parts, and one would be named"):
                save(taken, tmp_path / f"out{ending}")
    assert not any(tmp_path.iterdir())
