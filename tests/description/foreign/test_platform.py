"""The platform that a file does not name: hints in order, never a sensor or a rod, said in every answer."""

from __future__ import annotations

import json
import warnings
from itertools import permutations
from pathlib import Path

import pytest

import hrsynth
from hrsynth.cli import run_command
from hrsynth.description import load
from hrsynth.errors import AssumedBase, AssumedPlatform, BadRequest
from hrsynth.mechanism import Mechanism


def joint(name: str, kind: str, parent: str, child: str, xyz: str = "0 0 0", axis: str = "0 1 0") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/><limit lower="-2" upper="2" effort="9" velocity="9"/></joint>'
    )


def robot(*joints: str, loops: str = "") -> str:
    links = {part.split('"')[0]: None for each in joints for part in each.split('link="')[1:]}
    parts = [*(f'<link name="{link}"/>' for link in links), *joints, loops]
    return f'<robot name="r">{"".join(parts)}</robot>'


def ankle(foot: str = "foot", rods: tuple[str, str] = ("rod_l", "rod_r"), kind: str = "spherical") -> str:
    """A leg of three turns whose foot two rods drive, through balls or hinges at their ends."""
    joints = [
        joint("hip", "revolute", "torso", "thigh"),
        joint("knee", "revolute", "thigh", "shank", "0 0 -0.4"),
        joint("pitch", "revolute", "shank", "cross", "0 0 -0.4"),
        joint("roll", "revolute", "cross", foot, axis="1 0 0"),
    ]
    loops = ""
    for side, rod in zip((0.05, -0.05), rods, strict=True):
        joints += [
            joint(f"motor_{rod}", "revolute", "shank", f"lever_{side}", f"0 {side} -0.1"),
            joint(f"upper_{rod}", kind, f"lever_{side}", rod, "-0.06 0 0"),
        ]
        loops += (
            f'<loop name="lower_{rod}" type="{kind}"><predecessor link="{rod}"><origin xyz="0 0 -0.3"/>'
            f'</predecessor><successor link="{foot}"><origin xyz="-0.06 {side} 0"/></successor>'
            '<axis xyz="0 1 0"/></loop>'
        )
    return robot(*joints, loops=loops)


def read(folder: Path, text: str, **given: str) -> Mechanism:
    path = folder / "robot.urdf"
    path.write_text(text)
    with warnings.catch_warnings():
        for kind in (AssumedBase, AssumedPlatform):
            warnings.simplefilter("ignore", kind)
        return load(path, **given)


NAMES = [("rod_a", "rod_b", "foot"), ("a", "b", "c"), ("foot_rod_l", "foot_rod_r", "y"), ("imu", "x", "y")]


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        *((names, "spherical") for names in (*permutations(NAMES[0]), *NAMES[1:])),
        *((names, "revolute") for names in NAMES),
    ],
)
def test_the_foot_that_two_rods_drive_is_the_platform(tmp_path: Path, names: tuple[str, str, str], kind: str):
    """Three ways lead to it from the shank; rods between balls are told by these, whatever their names."""
    found = read(tmp_path, ankle(names[2], names[:2], kind))
    assert found.platform == names[2]
    assert found.choice is not None
    assert found.choice.chosen == "assumption"


def test_a_name_that_contradicts_the_structure_is_asked_about(tmp_path: Path):
    with pytest.raises(BadRequest, match=r"--platform LINK, such as toe, c, "):
        hrsynth.observe(read(tmp_path, ankle("c", ("toe", "b"), "revolute")))


def test_the_last_linkage_of_a_leg_is_asked_about(tmp_path: Path):
    """One rod and an unnamed foot: nothing tells them apart."""
    last = (
        '<loop name="end" type="revolute"><predecessor link="b"><origin xyz="0 0 -0.3"/></predecessor>'
        '<successor link="a"><origin xyz="-0.06 0 0"/></successor><axis xyz="0 1 0"/></loop>'
    )
    joints = [
        joint("hip", "revolute", "torso", "shank"),
        joint("pitch", "revolute", "shank", "a", "0 0 -0.4"),
        joint("motor", "revolute", "shank", "lever", "0 0 -0.1"),
        joint("up", "revolute", "lever", "b", "-0.06 0 0"),
    ]
    with pytest.raises(BadRequest, match=r"--platform LINK, such as .*a"):
        hrsynth.observe(read(tmp_path, robot(*joints, loops=last)))
    named = [each.replace('"a"', '"sole"') for each in joints]
    assert read(tmp_path, robot(*named, loops=last.replace('"a"', '"sole"'))).platform == "sole"


AXES = ("1 0 0", "0 1 0", "0 0 1")


def floating(order: str, legs: int, driven: str = "", centre: str = "0 0 0") -> str:
    """A trunk with an IMU and legs of two joints, on three slides and three turns in some order."""
    links, joints, left = ["odom", *(f"f{k}" for k in range(5)), "trunk"], [], {"P": [*AXES], "R": [*AXES]}
    for k, letter in enumerate(order):
        kind = "prismatic" if letter == "P" else "revolute"
        at = centre if letter == "R" and k == order.rindex("R") else "0 0 0"
        joints.append(joint(f"float_{k}", kind, links[k], links[k + 1], at, left[letter].pop()))
    joints.append(joint("fix", "fixed", "trunk", "imu", "0 0 0.1"))
    for leg in range(legs):
        joints += [
            joint(f"hip_{leg}", "revolute", "trunk", f"upper_{leg}", f"0 {leg} 0"),
            joint(f"knee_{leg}", "revolute", f"upper_{leg}", f"lower_{leg}", "0 0 -0.4"),
        ]
    motor = f'<transmission name="m"><joint name="{driven}"/></transmission>' if driven else ""
    return robot(*joints, loops=motor)


@pytest.mark.parametrize("order", ["PPPRRR", "RRRPPP", "PRPRPR"])
def test_six_freedoms_that_place_a_base_are_no_leg_and_a_sensor_is_no_platform(tmp_path: Path, order: str):
    with pytest.raises(BadRequest, match=r"such as lower_0, lower_1$"):
        hrsynth.observe(read(tmp_path, floating(order, 2)))
    found = read(tmp_path, floating(order, 2), platform="lower_1")
    assert (found.base, len(found.joints)) == ("trunk", 5)
    assert any("'trunk' floats on the joints float_0" in note.text for note in found.notes)


@pytest.mark.parametrize(
    "text",
    [
        floating("PPPRRR", 2, driven="float_2"),
        floating("PPPRRR", 2, centre="0 0 0.1"),
        floating("PPPRRR", 1),
        floating("PPPRRR", 2).replace('<axis xyz="0 0 1"', '<axis xyz="0 1 0"'),
    ],
)
def test_a_gantry_is_kept(tmp_path: Path, text: str):
    """Driven, with turns about several points, with one arm, or short of a direction."""
    found = read(tmp_path, text, platform="lower_0")
    assert found.base == "odom"


def test_a_base_that_is_asked_for_is_kept(tmp_path: Path):
    found = read(tmp_path, floating("PPPRRR", 2), base="odom", platform="lower_0")
    assert found.base == "odom"


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    path = tmp_path / "bar.urdf"
    loop = (
        '<loop name="d" type="revolute"><predecessor link="bar"><origin xyz="0.5 0 0"/></predecessor><successor '
        'link="rocker"><origin xyz="0 0 0.2"/></successor><axis xyz="0 1 0"/></loop>'
    )
    path.write_text(
        robot(
            joint("a", "revolute", "base", "crank"),
            joint("b", "revolute", "crank", "bar", "0.1 0 0.2"),
            joint("c", "revolute", "base", "rocker", "0.6 0 0"),
            loops=loop,
        )
    )
    return path


@pytest.mark.parametrize(("given", "chosen"), [((), "assumption"), (("--platform", "bar"), "option"), (None, "file")])
def test_every_answer_names_the_platform_and_what_chose_it(
    bar: Path, given: tuple[str, ...] | None, chosen: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
):
    robot = [str(bar), *(given or ())]
    if given is None:
        robot = [str(tmp_path / "own.urdf")]
        assert run_command(["convert", str(bar), robot[0]]) == 0
    for command in (["check"], ["legs"], ["convert", "-o", str(tmp_path / "other.urdf")]):
        capsys.readouterr()
        assert run_command([command[0], *robot, *command[1:], "--json"]) == 0
        out, err = capsys.readouterr()
        said = json.loads(out)["platform"]
        assert (said["link"], said["chosen"]) == ("bar", chosen)
        assert ("assumption: the platform is link 'bar'" in err) is (chosen == "assumption")
        assert "Warning" not in err
        assert run_command([command[0], *robot, *command[1:]]) == 0
        words = ("assumed: " if chosen == "assumption" else "") + said["reason"]
        assert f"bar ({words})" in capsys.readouterr().out


def test_a_guess_is_a_warning_in_python_at_the_line_that_asks(bar: Path):
    with pytest.warns(AssumedPlatform, match="the platform is link 'bar', assumed: the farthest") as caught:
        found = hrsynth.check(bar)
    assert [each.filename for each in caught] == [__file__]
    assert "platform: bar (assumed: the farthest from the base)" in hrsynth.text(found)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hrsynth.load(bar, platform="bar")
        hrsynth.load("3rrr_m1")
