"""One question over many robots, legs and poses: in order, in several processes, each error with what was asked."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import hrsynth
from hrsynth.errors import BadRequest, HrsynthError, PoseReachFailure

ROBOTS, LEGS = ["3rrr_m1", "3rpr_m1"], [[1, 2], "1,3"]
POSES = [[0, 0, 0], [9, 0, 0], {"x": 0.02, "y": 0, "phi": 0.01}]


def one_by_one() -> list[object]:
    found: list[object] = []
    for robot in ROBOTS:
        for legs in LEGS:
            for pose in POSES:
                try:
                    found.append(hrsynth.check(robot, legs, at=pose))
                except HrsynthError as error:
                    found.append(error)
    return found


def same(one: object, other: object) -> bool:
    return str(one) == str(other) if isinstance(one, Exception) else one == other


@pytest.mark.slow
def test_answers_are_those_of_the_questions_one_by_one_in_their_order():
    expected = one_by_one()
    for jobs in (1, 2):
        found = hrsynth.map_robots(hrsynth.check, ROBOTS, legs=LEGS, poses=POSES, jobs=jobs, errors="keep")
        assert len(found) == len(expected) == 12
        assert all(map(same, found, expected)), jobs
        assert sum(isinstance(each, PoseReachFailure) for each in found) == 2


@pytest.mark.slow
def test_an_error_ends_all_and_says_what_was_asked():
    for jobs in (1, 2):
        with pytest.raises(PoseReachFailure) as caught:
            hrsynth.map_robots("check", ROBOTS, poses=POSES, jobs=jobs)
        (note,) = caught.value.__notes__
        assert note.startswith("request: robot <Mechanism: 3rrr_m1")
        assert "at x=9,y=0,z=0" in note
        assert caught.value.exit_status == 3


@pytest.mark.slow
def test_a_defect_in_a_worker_is_told_with_what_was_asked():
    with pytest.raises(ZeroDivisionError) as caught:
        hrsynth.map_robots(lambda robot: 1 / 0, ["quattro"] * 3, jobs=2, errors="keep")
    assert "quattro" in caught.value.__notes__[0]


def test_a_robot_that_cannot_be_read_is_an_error_in_the_place_of_its_answers():
    for question in ("derive", lambda robot, observe: robot.name):
        robots: list = ["rrrrr_m1", "nope", 5]
        found = hrsynth.map_robots(question, robots, legs=["1", "2"], jobs=1, errors="keep")
        assert [isinstance(each, BadRequest) for each in found] == [False, False, True, True, True, True]
        assert [each.__notes__[0].startswith("request: robot 'nope', observe") for each in found[2:4]] == [True, True]
    with pytest.raises(BadRequest, match="nope"):
        hrsynth.map_robots("derive", ["rrrrr_m1", "nope"], jobs=1)


def test_any_function_is_asked_and_any_question():
    robots = ["3rrr_m1", "3rpr_m1"]
    assert hrsynth.map_robots(lambda robot, observe: observe, robots, legs=[1, [2, 3]], jobs=2) == 2 * [
        ("1",),
        ("2", "3"),
    ]
    assert hrsynth.map_robots(lambda robot, observe: observe, robots[0], legs="1,3", jobs=1) == [("1", "3")]
    found = hrsynth.map_robots("path", robots[:1], poses=[[0.01, 0, 0]], start="x=0,y=0,phi=0", jobs=1)
    assert found == [hrsynth.path("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.01,y=0,z=0")]
    assert hrsynth.map_robots("derive", "3rrr_m1", form="general", jobs=1) == [
        hrsynth.derive("3rrr_m1", form="general")
    ]
    assert hrsynth.map_robots("derive", []) == []
    assert hrsynth.map_robots("check", robots, poses=[]) == []


@pytest.mark.parametrize(
    ("question", "robots", "options", "expected"),
    [
        ("chek", "quattro", {}, "its name, such as check"),
        ("draw", "quattro", {}, "such as check"),
        (3, "quattro", {}, "such as check"),
        ("check", "quattro", {"jobs": 0}, "1 or more"),
        ("check", "quattro", {"jobs": 1.5}, "1 or more"),
        ("check", "quattro", {"errors": "hide"}, "raise, keep"),
        ("advise", "quattro", {"poses": [[0, 0, 0]]}, "at or goal"),
        ("check", ["qattro"], {}, "quattro"),
        ("check", "quattro", {"poses": [3]}, "4 × 4"),
        ("check", "quattro", {"legs": [1.5]}, "label"),
        ("check", [None], {}, "the path of a robot file"),
    ],
)
def test_what_cannot_be_asked_is_refused_before_the_work(question, robots, options, expected):
    with pytest.raises(BadRequest, match=expected):
        hrsynth.map_robots(question, robots, **options)


@pytest.mark.slow
def test_a_script_needs_no_guard(tmp_path):
    """Workers do not run the script again."""
    script = tmp_path / "study.py"
    script.write_text(
        "import hrsynth\n"
        "found = hrsynth.map_robots('check', ['3rrr_m1', '3rpr_m1'], poses=[[0.01, 0, 0], [0, 0, 0]], jobs=2)\n"
        "print(len(found), *(each.postures[0].hidden.state for each in found))\n"
    )
    run = subprocess.run(
        [sys.executable, script],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": str(Path(hrsynth.__file__).parents[1]), "OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"},
    )
    assert run.stdout.split()[0] == "4"
    assert len(run.stdout.splitlines()) == 1


@pytest.mark.slow
def test_joblib_does_as_well():
    """Questions and answers go to processes and back without this function too."""
    from joblib import Parallel, delayed

    poses = [[0.01, 0, 0], [0.02, 0, 0]]
    found = Parallel(n_jobs=2)(delayed(hrsynth.check)("3rrr_m1", at=pose) for pose in poses)
    assert found == [hrsynth.check("3rrr_m1", at=pose) for pose in poses]
