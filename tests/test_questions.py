"""How questions are asked in Python: robots, legs and poses in every form, errors that name what is allowed,
results that are cached."""

from __future__ import annotations

import inspect
import pydoc
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hrsynth
from hrsynth.errors import BadRequest, HrsynthError, MissingExtra
from hrsynth.mechanism.pose import Pose, convert_to_pose, parse_pose, parse_poses

TURNED = "x=0.01,y=0.02,z=-0.75,rpy=0/0/0.2"
FUNCTIONS = (
    "accuracy",
    "advise",
    "check",
    "derive",
    "legs",
    "modes",
    "observe",
    "path",
    "select",
    "servo",
    "singularities",
    "view",
)


def matrix(pose: Pose) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = pose.rotation, (pose.x, pose.y, pose.z)
    return X


def test_a_pose_is_taken_in_every_form():
    told = Pose.parse(TURNED)
    X = matrix(told)
    for given in (
        told,
        TURNED,
        {"x": 0.01, "y": "0.02", "z": -0.75, "rpy": [0, 0, 0.2]},
        told.to_dict(),
        {"x": 0.01, "y": 0.02, "z": -0.75, "rpy": "0/0/0.2", "phi": None},
        [0.01, 0.02, -0.75, 0, 0, 0.2],
        np.array([0.01, 0.02, -0.75, 0, 0, 0.2]),
        X,
        X.tolist(),
        pin.SE3(X),
    ):
        found = convert_to_pose(given)
        assert list(found.given) == list(told.given)
        np.testing.assert_allclose(
            np.hstack(list(found.given.values())), np.hstack(list(told.given.values())), atol=1e-15
        )
    assert convert_to_pose({"phi": "10deg"}).phi == pytest.approx(np.radians(10))
    assert convert_to_pose((1, 2, 3)) == Pose(1.0, 2.0, 3.0)
    assert convert_to_pose({"x": np.float64(0.1) + 0.2}).x == 0.1 + 0.2


def test_any_rotation_is_read_from_its_matrix():
    for seed in range(200):
        R = pin.SE3.Random().rotation if seed else np.diag([1.0, -1.0, -1.0])
        X = np.eye(4)
        X[:3, :3] = R
        np.testing.assert_allclose(convert_to_pose(X).rotation, R, atol=1e-12)


@pytest.mark.parametrize(
    ("given", "count"),
    [
        (None, 0),
        ((), 0),
        ("x=0", 1),
        ("mode:2", 1),
        ([0, 0, 1], 1),
        (np.zeros(3), 1),
        ({"x": 0}, 1),
        (np.eye(4), 1),
        (np.eye(4).tolist(), 1),
        (pin.SE3.Identity(), 1),
        (["x=0", "mode:3", [0, 0, 1]], 3),
        (np.zeros((5, 3)), 5),
        (np.zeros((4, 6)), 4),
        (np.array([np.eye(4)] * 3), 3),
        ([pin.SE3.Identity()] * 2, 2),
        ([{"x": 0}] * 3, 3),
        ([Pose(x=0.0)] * 3, 3),
        ((Pose(x=float(k)) for k in range(6)), 6),
    ],
)
def test_one_pose_and_several_are_told_apart(given, count):
    assert len(parse_poses(given)) == count


REFLECTED = np.diag([1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    "given",
    [
        3,
        1.5,
        [1],
        [1, 2, 3, 4],
        np.zeros((4, 4)),
        REFLECTED,
        2 * np.eye(4),
        object(),
        {1: 2},
        {"x": "wide"},
        {"x": [1, 2]},
        {"rpy": 3},
        {"rpy": [1, 2]},
        {},
        b"x=0",
        [None],
        np.zeros((2, 2, 2)),
        [np.nan, 0, 0],
        {"x": np.inf},
        "x",
        "mode:0",
        {"x": None},
        {"x": 1, "phi": 0, "rpy": [0, 0, 0]},
        np.array("x=0"),
        {"x": {}},
    ],
)
def test_what_is_no_pose_is_refused_in_one_line(given):
    with pytest.raises(BadRequest) as caught:
        hrsynth.check("3rrr_m1", at=given)
    (line,) = caught.value.lines()
    assert "\n" not in str(caught.value)
    assert caught.value.expected, line
    assert len(line) < 600


def test_a_robot_takes_back_the_pose_of_each_of_its_configurations():
    """As text, matrix, SE3: planar, spatial, point platforms, tilted bases."""
    for name in ("3rrr_m1", "rrrrr_m1", "quattro_rigid", "delta", "gough_stewart", "3rps", "orthoglide"):
        seen = hrsynth.observe(name)
        at = seen.configurations[0]
        X = at.pose(seen.motion.link)
        for given in (pin.SE3(X), X, X.tolist(), str(seen.motion.pose(X)), seen.motion.pose(X).to_dict()):
            (found,) = hrsynth.check(seen, at=given).postures
            np.testing.assert_allclose(found.configuration.pose(seen.motion.link), X, atol=1e-5)


@pytest.mark.parametrize(
    "given", [[1, 4], (1, "4"), "1,4", " 1 , 4", np.array([1, 4]), {4, 1}, ["1", "4"], (k for k in (1, 4))]
)
def test_legs_are_taken_in_every_form(given):
    assert hrsynth.observe("quattro", given).labels == ("1", "4")


def test_one_leg_and_all_legs():
    assert hrsynth.observe("quattro", 2).labels == hrsynth.observe("quattro", "2").labels == ("2",)
    assert hrsynth.observe("quattro", "all") == hrsynth.observe("quattro")
    assert hrsynth.observe("quattro", ["rod_1b", 2]).labels == ("1", "2")


@pytest.mark.parametrize(
    ("given", "word"),
    [
        (1.0, "expected .*label"),
        (True, "expected .*label"),
        ([None], "expected .*label"),
        (7, "expected .*legs 1, 2, 3, 4"),
        ([], "Give leg labels"),
        ("", "expected .*legs 1"),
        (object(), "expected .*label"),
        ([[1, 4]], "expected .*label"),
        (b"1", "expected .*legs 1"),
    ],
)
def test_what_are_no_legs_is_refused(given, word):
    with pytest.raises(BadRequest, match=word):
        hrsynth.observe("quattro", given)


def test_a_robot_is_taken_by_value_name_path_and_as_observed(tmp_path):
    robot = hrsynth.load("3rrr_m1")
    hrsynth.save("3rrr_m1", tmp_path / "mine.urdf")
    found = [
        hrsynth.legs(each)
        for each in (robot, "3rrr_m1", tmp_path / "mine.urdf", str(tmp_path / "mine.urdf"), hrsynth.observe("3rrr_m1"))
    ]
    assert all(each == found[0] for each in found)
    assert hrsynth.load(robot) is robot
    with pytest.raises(BadRequest, match="already read"):
        hrsynth.load(robot, platform="base")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_refuses_what_is_no_robot(name):
    ways = {each: {"start": "x=0", "goal": "x=0"} for each in ("path", "servo", "select")}
    needed = {"accuracy": {"cone": "0.1deg"}, **ways}
    for given in (None, 3, ["quattro"], "qattro", "no/such/file.urdf"):
        with pytest.raises(HrsynthError) as caught:
            getattr(hrsynth, name)(given, **needed.get(name, {}))
        assert len(caught.value.lines()) == 1


def test_other_names_are_refused_with_the_nearest():
    accuracy: Any = hrsynth.accuracy
    known = accuracy("3rrr_m1", cone="0.1deg")
    assert accuracy("3rrr_m1", cone={1: "0.1deg", "2": np.radians(0.1), 3: "0.1deg"}) == known
    for function, ends in ((accuracy, {}), (hrsynth.select, {"start": "x=0", "goal": "x=0.01"})):
        with pytest.raises(TypeError, match=f"{function.__name__} has no 'cones', did you mean 'cone'"):
            function("3rrr_m1", cones="0.1deg", **ends)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_help_shows_every_option(name):
    function = getattr(hrsynth, name)
    known = inspect.signature(function)
    assert next(iter(known.parameters)) == "robot"
    assert not any(each.kind in (each.VAR_KEYWORD, each.VAR_POSITIONAL) for each in known.parameters.values())
    assert function.__doc__
    assert function.__name__ == name


def test_options_have_one_name_in_python_and_on_the_command_line():
    from hrsynth.cli import app
    from hrsynth.index import list_analyses

    compared = 0
    for command in list_analyses():
        known = inspect.signature(getattr(hrsynth, command)).parameters
        for option in app.commands[command].options:
            if option.name in known and not option.argument:
                compared += 1
                flags = option.flags or (f"--{option.name.replace('_', '-')}",)
                assert f"--{option.name.replace('_', '-')}" in flags, (command, option.name)
    assert compared > 40


def test_help_of_the_package_shows_each_function_with_its_options():
    text = pydoc.plain(pydoc.render_doc(hrsynth))
    for name in hrsynth.__all__:
        if inspect.isfunction(getattr(hrsynth, name)):
            assert f"    {name}(" in text, name
    assert "    check(robot: 'RobotLike', observe: 'LegsLike' = None" in text


class TestMemory:
    def test_the_same_question_is_answered_once(self):
        hrsynth.clear_cache()
        robot = hrsynth.load("3rrr_m1")
        first = hrsynth.derive(robot, [1, 2])
        assert hrsynth.derive(robot, [1, 2]) is first
        assert hrsynth.derive("3rrr_m1", [1, 2], seed=0) is first
        assert hrsynth.derive(hrsynth.load("3rrr_m1"), observe=[1, 2]) is first
        assert hrsynth.derive(robot, [1, 3]) is not first
        assert hrsynth.derive(robot, [1, 2], seed=1) is not first
        assert hrsynth.check(robot, at=[0.01, 0, 0]) is hrsynth.check(robot, at=[0.01, 0, 0])
        hrsynth.clear_cache()
        assert hrsynth.derive(robot, [1, 2]) is not first
        assert hrsynth.derive(robot, [1, 2]) == first

    def test_another_robot_of_the_same_name_is_another_question(self):
        from dataclasses import replace

        robot = hrsynth.load("3rrr_m1")
        joint = list(robot.joints.values())[-1]
        other = robot.changed(joints=[replace(joint, point=joint.point + [0.01, 0, 0])])
        one, two = (hrsynth.check(each, at="x=0.01,y=0,phi=0") for each in (robot, other))
        assert one != two

    def test_the_file_belongs_to_the_question(self, tmp_path):
        """An equal robot in another file: messages and meshes are that file's."""
        hrsynth.save("3rrr_m1", tmp_path / "other.urdf")
        assert hrsynth.legs("3rrr_m1").setup.robot.file != hrsynth.legs(tmp_path / "other.urdf").setup.robot.file
        assert hrsynth.legs(tmp_path / "other.urdf").setup.robot.file == str(tmp_path / "other.urdf")

    def test_what_went_on_without_a_package_is_asked_again(self):
        """The package may be there the next time."""
        from hrsynth.analysis.result_cache import ResultCache

        def asked(missing: bool) -> str:
            if missing:
                with suppress(MissingExtra):
                    raise MissingExtra("listing", "solve")
            return "without" if missing else "with"

        cache = ResultCache(3)
        found = [cache.get("modes", lambda missing=missing: asked(missing)) for missing in (True, False, True)]
        assert found == ["without", "with", "with"]

    def test_only_so_much_is_kept(self):
        from hrsynth.analysis.result_cache import ResultCache

        cache = ResultCache(3)
        for k in (*range(5), 3):
            cache.get(k, lambda k=k: object())
        assert list(cache.kept) == [2, 4, 3]

    def test_all_legs_with_a_sensor_are_another_result_than_the_sensor_alone(self):
        for observe in ("all", None):
            options = {} if observe is None else {"observe": observe}
            seen = hrsynth.derive("3rpr_m1", sensor="encoder:slide_1", **options).setup.observed
            assert (len(seen) > 1) is (observe is not None)


class TestErrors:
    @pytest.mark.parametrize(
        "ask",
        [
            lambda: hrsynth.check("3rrr_m1", at="x=9"),
            lambda: hrsynth.check("3rrr_m1", at="z=9"),
            lambda: hrsynth.load("nothing"),
            lambda: hrsynth.load(Path(__file__)),
            lambda: hrsynth.check("3rrr_m1", "9"),
            lambda: hrsynth.accuracy("3rrr_m1", "1", cone="0.1deg"),
            lambda: hrsynth.accuracy("3rrr_m1", cone="0.1deg", grid="x=8:9:3,y=0,phi=0"),
        ],
    )
    def test_an_error_is_pickled_whole(self, ask):
        import pickle

        with pytest.raises(HrsynthError) as caught:
            ask()
        error = caught.value
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert (str(again), again.lines(), again.exit_status) == (str(error), error.lines(), error.exit_status)
        assert vars(again).keys() == vars(error).keys()


class TestExamples:
    @pytest.mark.slow
    def test_robots_of_the_package_are_read_by_name(self):
        names = hrsynth.list_examples()
        assert len(names) > 60
        assert all(path.is_file() for path in names.values())
        robot = hrsynth.load("example:cassie", base="pelvis", platform="left-tarsus")
        assert robot.name == "cassie"
        assert hrsynth.legs("example:panda").robot == "panda"
        with pytest.raises(BadRequest, match="platform LINK"):
            hrsynth.derive("example:cassie")

    def test_a_name_that_there_is_not_is_refused_with_those_near(self):
        with pytest.raises(BadRequest, match="such as cassie"):
            hrsynth.load("example:casie")
        with pytest.raises(BadRequest, match="robots --examples"):
            hrsynth.load("example:")

    def test_a_file_of_that_name_comes_first(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        hrsynth.save("3rrr_m1", tmp_path / "example:cassie.urdf")
        assert hrsynth.load("example:cassie.urdf").name == hrsynth.load("3rrr_m1").name


def test_a_mode_is_a_pose_too():
    assert str(parse_pose("mode:3")) == "mode:3"
