"""What is rounded is read as it was meant, or refused: the same robot, whatever dialect, decimals, joints and units."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.foreign.rounded import ENDINGS, exported, in_millimetres, of_hinges
from description.foreign.test_dialects import mobility
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load, save
from hrsynth.description.assembly.geometry_repair import nearest, snap_geometry
from hrsynth.description.numerals import Digits
from hrsynth.errors import BadRequest, LoopClosureFailure, RoundingLimitedRank, UndecidedStructure
from hrsynth.geometry.vectors import build_pose, normalise_vector, rotate_about_axis
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.tolerances import INCIDENCE_TOL
from strategies import transformed

SOME = ("3rps", "delta", "3upu", "3rrr_m1", "prrrp_m1")
DECIMALS = (14, 9, 7, 6, 5, 4, 3)


def answer(robot: Mechanism) -> tuple[object, ...]:
    """What must not depend on the digits."""
    found = ObservedRobot.of(robot, samples=3)
    return found.decomposition.architecture(), found.dof, found.mobility


def again(robot: Mechanism, path: Path, decimals: int, significant: bool = False) -> Mechanism:
    """The robot written with so many decimals, or significant digits, and read."""
    own = {} if path.suffix == ".urdf" else {"platform": robot.platform}
    return load(exported(robot, path, decimals, significant), **own)


def variants(robot: Mechanism) -> dict[str, Mechanism]:
    """Balls and U joints as such, as R in any directions, as R along the base's axes, as R with connectors that have a
    length; in metres and in millimetres."""
    found = {"plain": robot}
    if any(joint.type in (JointType.SPHERICAL, JointType.UNIVERSAL) for joint in robot.joints.values()):
        found |= {
            "hinges": of_hinges(robot),
            "aligned": of_hinges(robot, aligned=True),
            "connectors": of_hinges(robot, slid=0.2),
        }
    return found | {f"{name}, mm": in_millimetres(each) for name, each in found.items()}


@pytest.mark.some(2)
@pytest.mark.parametrize("decimals", [7, 5, 4])
@pytest.mark.parametrize(("name", "ending"), list(zip(SOME, (".urdf", ".xml", ".sdf", ".yaml", ".urdf"), strict=True)))
def test_a_rounded_robot_is_the_same(name: str, ending: str, decimals: int, tmp_path: Path):
    robot = of_hinges(load(name))
    assert answer(again(robot, tmp_path / f"robot{ending}", decimals)) == answer(load(name))


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("name", list_robots())
def test_every_rounded_robot_is_the_same_or_refused(name: str, tmp_path: Path):
    """With four decimals; connectors with a length, twice as many joints, may leave one file of a robot undecided."""
    meant, undecided = answer(load(name)), list[str]()
    for (variant, robot), (dialect, ending), decimals in product(variants(load(name)).items(), ENDINGS.items(), (4,)):
        folder = tmp_path / f"{variant} {dialect} {decimals}"
        folder.mkdir()
        try:
            assert answer(again(robot, folder / f"robot{ending}", decimals)) == meant, folder.name
        except UndecidedStructure:
            undecided.append(variant)
    assert len(undecided) <= 1
    assert all(variant.startswith("connectors") for variant in undecided)


@pytest.mark.some(0, 8)
@pytest.mark.parametrize("name", list_robots())
def test_a_usd_file_of_single_precision_is_the_same(name: str, tmp_path: Path):
    """As simulators write them: nothing beside the seven digits of single precision; and with four decimals."""
    pytest.importorskip("pxr")
    robot, meant = of_hinges(load(name)), answer(load(name))
    assert answer(again(robot, tmp_path / "four.usda", 4)) == meant
    path = tmp_path / "robot.usda"
    save(robot, path)
    path.write_text("\n".join(line for line in path.read_text().splitlines() if "hrsynth:local" not in line))
    assert answer(load(path, platform=robot.platform)) == meant


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize(("decimals", "significant"), [*((each, False) for each in DECIMALS), (6, True), (5, True)])
def test_the_whole_table(decimals: int, significant: bool, tmp_path: Path):
    """docs/pages/repair_a_file.md, "Rounded numbers": all down to five decimals, and with four all but one in a
    hundred; else refused. Of few significant digits a native file with few numbers does not tell: its loops are closed
    by moving joints."""
    count = refused = 0
    endings = ENDINGS | ({"usd": ".usda"} if importlib.util.find_spec("pxr") else {})
    for name in list_robots():
        meant = answer(load(name))
        for (variant, robot), (dialect, ending) in product(variants(load(name)).items(), endings.items()):
            folder = tmp_path / f"{name} {variant} {dialect}"
            folder.mkdir()
            count += 1
            try:
                found = again(robot, folder / f"robot{ending}", decimals, significant)
            except UndecidedStructure:
                refused += 1
                continue
            assert answer(found) == meant, folder.name
    assert refused <= (0.01 if significant else {4: 0.01, 3: 1.0}.get(decimals, 0.0)) * count


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", ["3puu", "3upu", "3rps", "6pus", "delta", "gough_stewart", "hexaglide"])
def test_axes_that_miss_each_other_by_far_make_no_ball(name: str, tmp_path: Path):
    """The R of balls and U joints pass each other at a twentieth of the robot's size: that robot, not a simpler one."""
    robot = of_hinges(load(name), apart=0.05)
    meant = answer(robot)
    for (dialect, ending), decimals in product(ENDINGS.items(), (9, 6, 5, 4)):
        assert answer(again(robot, tmp_path / f"{dialect}{ending}", decimals)) == meant, (dialect, decimals)


@pytest.mark.some(17)
@pytest.mark.parametrize("name", list_robots())
def test_what_is_not_rounded_stays_as_it_is(name: str):
    robot = load(name)
    assert snap_geometry(robot, 0.0, INCIDENCE_TOL) is robot


@pytest.mark.some(2)
@pytest.mark.parametrize("decimals", [6, 4])
@pytest.mark.parametrize("name", ["linear_delta", "3ppr_m2"])
def test_a_tilted_robot_of_no_round_numbers_is_the_same(name: str, decimals: int, tmp_path: Path):
    """No axis along a base axis, no length of few digits: nothing is found by its numbers."""
    robot, X = load(name), build_pose((0.123, -0.377, 0.219), rotate_about_axis(normalise_vector([1.0, 2.0, 0.5]), 0.7))
    moved = {
        name: replace(link, pose=link.pose if name == robot.base else X @ link.pose)
        for name, link in robot.links.items()
    }
    joints = {
        name: replace(
            joint, point=X[:3, :3] @ joint.point + X[:3, 3], axes=tuple(X[:3, :3] @ axis for axis in joint.axes)
        )
        for name, joint in robot.joints.items()
    }
    tilted = of_hinges(replace(robot, links=moved, joints=joints))
    assert answer(again(tilted, tmp_path / "robot.sdf", decimals)) == answer(robot)


@pytest.mark.slow
def test_rounded_directions_of_observe_are_those_of_segments(tmp_path: Path):
    """Watched along its rods a Delta is watched along the rods that are read; lint writes these directions."""
    robot = load("delta")
    seen = ObservedRobot.of(robot, samples=3).observed
    path = exported(of_hinges(replace(robot, observations=tuple(seen))), tmp_path / "robot.urdf", 5)
    found = load(path)
    assert [note.text for note in found.notes if note.text.endswith("observed directions of leg 1, of leg 2, of leg 3")]
    balls = reduce_to_normal_form(found).mechanism
    for one, two in zip(found.observations, seen, strict=True):
        assert isinstance(one, Direction)
        assert isinstance(two, Direction)
        assert 1e-11 < np.linalg.norm(one.direction - two.direction) < 1e-4
        ends = [joint.point for joint in balls.joints_of(one.link)]
        rod = found.links[one.link].pose[:3, :3].T @ normalise_vector(ends[1] - ends[0])
        assert abs(one.direction @ rod) == pytest.approx(1.0, abs=1e-15)
    assert {each.rule for each in hrsynth.lint(path, fix=True).fixed} == {"geometry-rounded"}
    assert not load(path).notes


@pytest.mark.slow
@pytest.mark.parametrize("name", ["delta", "quattro", "3rps", "3upu"])
def test_rounded_observe_elements_hide_the_same_robot(name: str, tmp_path: Path):
    robot = load(name)
    meant = hrsynth.derive(robot, "all")
    watched = of_hinges(replace(robot, observations=tuple(ObservedRobot.of(robot, samples=3).observed)))
    for decimals in (7, 4):
        found = hrsynth.derive(load(exported(watched, tmp_path / "robot.urdf", decimals)))
        assert (found.hidden_architecture, found.mobility) == (meant.hidden_architecture, meant.mobility)


def test_watched_directions_are_square_to_axes_or_as_they_are(tmp_path: Path):
    """No segment: in the plane where that is meant, else untouched."""
    robot, X = load("3rrr_m1"), build_pose((0.1, 0.2, 0.3), rotate_about_axis(normalise_vector([1.0, 2.0, 0.5]), 0.7))
    moved = transformed(robot, X[:3, :3], X[:3, 3])
    link = moved.links[robot.platform].pose[:3, :3]
    normal = link.T @ next(iter(moved.joints.values())).axis
    flat = normalise_vector(np.cross(normal, [0.3, 0.5, 0.1]))
    seen = [
        Direction("1", robot.platform, flat),
        Direction("2", robot.platform, normalise_vector(flat + 0.01 * normal)),
    ]
    found = load(exported(replace(moved, observations=tuple(seen)), tmp_path / "robot.urdf", 5))
    axis = next(iter(found.joints.values())).axis
    R = found.links[robot.platform].pose[:3, :3]
    cosines = [R @ each.direction @ axis for each in found.observations if isinstance(each, Direction)]
    assert abs(cosines[0]) < 1e-12
    assert cosines[1] == pytest.approx(0.01, abs=2e-5)


def test_what_was_made_exact_is_exact_and_told(tmp_path: Path):
    robot = again(of_hinges(load("delta")), tmp_path / "robot.xml", 4)
    balls = [j for j in reduce_to_normal_form(robot).mechanism.joints.values() if j.type is JointType.SPHERICAL]
    assert len(balls) == 12
    (told,) = [note.text for note in robot.notes if "are made exact" in note.text]
    shift = float(told.split("moved by up to ")[1].split(" mm")[0])
    assert 0 < shift < 0.5
    kinds = [note.text.removeprefix("made to be ").split(":")[0] for note in robot.notes if "made to be" in note.text]
    assert {"perpendicular", "in line with an axis"} <= set(kinds)
    exact = nearest(robot, INCIDENCE_TOL)
    assert exact is not None
    assert exact.mended == ()


def test_the_nearest_mechanism_is_not_farther_than_the_one_that_was_rounded(tmp_path: Path):
    """Least squares: centres of the balls move less, in the mean, than rounding moved them."""
    robot = load("delta")
    path = exported(robot, tmp_path / "robot.sdf", 4)
    found, written = load(path, platform="platform"), load(path, platform="platform", tolerance=1.1e-11)
    names = [name for name, joint in robot.joints.items() if joint.type is JointType.SPHERICAL]

    def apart(one: Mechanism, other: Mechanism) -> float:
        return float(np.sum([np.sum((one.joints[n].point - other.joints[n].point) ** 2) for n in names]))

    assert 0 < apart(found, written) <= apart(robot, written)


def test_two_structures_equally_near_are_refused_with_advice(tmp_path: Path):
    """A U whose axes miss each other by somewhat more than the decimals explain."""
    robot = of_hinges(load("3upu"))
    name = next(name for name in robot.joints if name.endswith("hinge1"))
    joint = robot.joints[name]
    other = next(j for j in robot.joints.values() if j.name == name.replace("hinge1", "hinge0"))
    shifted = joint.point + 3.5e-4 * np.cross(joint.axis, other.axis)
    path = exported(robot.changed(joints=[replace(joint, point=shifted)]), tmp_path / "robot.xml", 4)
    with pytest.raises(UndecidedStructure, match=r"--tolerance, or --as-written") as caught:
        load(path, platform=robot.platform)
    assert caught.value.exit_status == 3
    assert "6 U" in str(caught.value)
    coarse = reduce_to_normal_form(load(path, platform=robot.platform, tolerance=5e-3)).mechanism
    assert sum(j.type is JointType.UNIVERSAL for j in coarse.joints.values()) == 6


def test_geometry_near_a_parallelogram_is_refused_with_the_tolerance_that_decides(tmp_path: Path):
    """Three parallel rods of nearly the same length: a structure that moves to first order. Screws of three parallel
    forces have rank two, so a plate that equal ones carry has one freedom."""
    rng, refused = np.random.default_rng(3), dict[Path, RoundingLimitedRank]()
    for number in range(6):
        angle, lengths = rng.uniform(0.4, 1.2), 0.04 * (1 + np.array([0.0, 1e-3, -1e-3]))
        along = np.array([np.cos(angle), np.sin(angle)])
        at = np.array([[0.0, 0.0], [0.03, 0.004], [-0.03, 0.009]])
        forces = np.array([[*along, x * along[1] - y * along[0]] for x, y in at])
        assert np.linalg.matrix_rank(forces, 1e-9) == 2
        tips = at + lengths[:, None] * along
        sites, rods, connects = "", "", ""
        for k in range(1, 3):
            x, z = tips[k] - tips[0]
            for name, y in (("one", 0), ("two", 0.1)):
                sites += f'<site name="{name}{k}" pos="{at[k][0]:.7f} {y} {at[k][1]:.7f}"/>'
            rods += f'<body pos="{x:.7f} 0 {z:.7f}"><joint name="rod{k}" axis="0 1 0"/><geom size=".01"/>'
            for name, y in (("one", 0), ("two", 0.1)):
                rods += (
                    f'<site name="end_{name}{k}" pos="{at[k][0] - tips[k][0]:.7f} {y} {at[k][1] - tips[k][1]:.7f}"/>'
                )
                connects += f'<connect site1="end_{name}{k}" site2="{name}{k}"/>'
            rods += "</body>"
        path = tmp_path / f"plate{number}.xml"
        path.write_text(
            f'<mujoco><worldbody>{sites}<body name="rod0"><joint name="foot" axis="0 1 0"/><geom size=".01"/>'
            f'<body name="plate" pos="{tips[0][0]:.7f} 0 {tips[0][1]:.7f}"><joint name="head" axis="0 1 0"/>'
            f'<geom size=".01"/>{rods}</body></body></worldbody><equality>{connects}</equality></mujoco>'
        )
        try:
            load(path, platform="plate")
        except RoundingLimitedRank as error:
            refused[path] = error
    assert len(refused) > 2  # of others the digits decide
    for path, error in refused.items():
        assert f"--tolerance {error.tolerance:g}" in str(error)
        assert mobility(load(path, platform="plate", tolerance=error.tolerance)) == 3 - 2


def test_as_written_nothing_is_made_exact(tmp_path: Path):
    path = exported(of_hinges(load("delta")), tmp_path / "robot.xml", 5)
    robot = load(path, platform="platform", as_written=True)
    assert not any("made exact" in note.text for note in robot.notes)
    path = exported(load("delta"), tmp_path / "robot.urdf", 5)
    with pytest.raises(LoopClosureFailure, match=r"--tolerance 0\.0\d* if its numbers are rounded"):
        load(path, as_written=True)
    assert answer(load(path)) == answer(load("delta"))


@pytest.mark.parametrize("tolerance", [-1.0, 0.0, 0.5, float("nan")])
def test_a_tolerance_has_a_range(tolerance: float):
    with pytest.raises(BadRequest, match="tolerance"):
        load("delta", tolerance=tolerance)


@pytest.mark.parametrize(("decimals", "expected"), [(14, 0.0), (9, 1e-9), (6, 1e-6), (3, 1e-3), (2, 0.0)])
def test_a_file_tells_its_last_decimal(decimals: int, expected: float):
    digits = Digits()
    for number in np.random.default_rng(decimals).uniform(-1, 1, 100):
        digits.read(f"{number:.{decimals}f}".rstrip("0") + " 0.5 0")
    assert digits.last_place == pytest.approx(expected)


@pytest.mark.parametrize(("digits", "expected"), [(4, 1e-3), (6, 1e-5), (7, 1e-6)])
def test_a_file_tells_its_last_significant_digit(digits: int, expected: float):
    """As %.6g writes: the largest numbers, of one to ten, have the coarsest last digit."""
    read = Digits()
    for number in np.random.default_rng(digits).uniform(-1, 1, 100) * 10.0 ** np.arange(-2, 2).repeat(25):
        read.read(f"{number:.{digits}g}")
    assert read.last_place == pytest.approx(expected)


@pytest.mark.parametrize(
    ("angle", "rounded"),
    [(np.pi / 2, False), (1.5708, True), (2.0944, True), (0.3, False), (1.57, True), (0.0, False), (1.0, False)],
)
def test_a_file_tells_that_its_angles_are_rounded(angle: float, rounded: bool):
    digits = Digits()
    digits.angles(np.array([0.0, angle, 0.0]))
    assert digits.rounded is rounded


def test_small_features_that_are_typed_stay(tmp_path: Path):
    """A native file of three decimals that closes exactly is not rounded: axes 2 mm apart are meant."""
    text = '<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>'
    joint = (
        '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>'
        '<axis xyz="{}"/></joint>'
    ).format
    text += joint("p", "base", "a", "0.125 0 0", "0 0 1") + joint("q", "a", "b", "0.002 0.375 0", "0 0 1")
    text += joint("r", "base", "c", "0.625 0.125 0.375", "0 0 1")
    text += (
        '<loop name="s" type="revolute"><predecessor link="b"><origin xyz="0.498 -0.125 0"/></predecessor>'
        '<successor link="c"><origin xyz="0 0.125 -0.375"/></successor><axis xyz="0 0 1"/></loop>'
        '<hrsynth><platform link="b"/></hrsynth></robot>'
    )
    (tmp_path / "typed.urdf").write_text(text)
    robot = load(tmp_path / "typed.urdf")
    assert robot.notes == ()
    assert robot.joints["q"].point.tolist() == [0.127, 0.375, 0.0]
    save(robot, tmp_path / "again.urdf")
    assert load(tmp_path / "again.urdf").differences(robot) == []


def test_a_platform_on_balls_alone_has_no_axes_to_mend(tmp_path: Path):
    """Five rods between balls, as a suspension of a wheel: no relation of axes holds, as there are none."""
    feet = [(-0.4, 0.1, 0.02), (0.3, -0.35, -0.05), (0.45, 0.2, 0.01), (-0.1, 0.4, 0.03), (-0.25, -0.3, 0.04)]
    tips = [(-0.2, 0.15, 0.6), (0.1, -0.25, 0.55), (0.25, 0.1, 0.62), (-0.05, 0.2, 0.58), (-0.15, -0.1, 0.64)]
    text = '<sdf version="1.9"><model name="five rods"><link name="base"/><link name="hub"/>'
    for i, (foot, tip) in enumerate(zip(feet, tips, strict=True)):
        text += (
            f'<link name="rod{i}"><pose>{" ".join(map(str, foot))} 0 0 0</pose></link>'
            f'<joint name="a{i}" type="ball"><parent>base</parent><child>rod{i}</child></joint>'
            f'<joint name="b{i}" type="ball"><pose>{" ".join(map(str, tip))} 0 0 0</pose><parent>rod{i}</parent>'
            "<child>hub</child></joint>"
        )
    file = tmp_path / "rods.sdf"
    file.write_text(text + "</model></sdf>")
    found = ObservedRobot.of(load(file, platform="hub"))
    assert str(found.decomposition.architecture()) == "5-SS"
    assert (found.dof, found.mobility.total) == (1, 6)
