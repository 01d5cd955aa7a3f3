"""Closed-loop files of public repositories, where a folder holds clones of them as OWNER/NAME: HRSYNTH_OTHERS.

Mobilities were counted by MuJoCo where it reads and closes a file (coordinates less the rank of its equalities'
Jacobian, at closed poses near zero), else by the tests' oracle.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.derive import derive
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.errors import BadRobotFile, LoopClosureFailure
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.normal import reduce_to_normal_form
from oracle import Oracle

OTHERS = Path(os.environ.get("HRSYNTH_OTHERS", "none"))
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not OTHERS.is_dir(), reason="HRSYNTH_OTHERS names no folder")]
GEPETTO, ONSHAPE = "Gepetto/example-parallel-robots/robots", "Rhoban/onshape-to-robot-examples"
REACHY = "pollen-robotics/reachy_mini/src/reachy_mini/descriptions/reachy_mini"
GRBDA = "ROAM-Lab-ND/generalized_rbda"
ANKLES = "feidedao/Parallel_Ankle_Joint"
CASSIE = "osudrl/cassie-mujoco-sim/model"

# file: what it does not say, mobility as written, freedoms of the platform, how many of them the directions do not show
READ: dict[str, tuple[dict[str, str], int, int, int]] = {
    f"{GEPETTO}/5bar_linkage_iso6d/robot.urdf": ({}, 2, 2, 0),
    f"{GEPETTO}/battobot_6d/robot.urdf": ({"platform": "foot_left"}, 12, 6, 4),
    f"{GEPETTO}/cassie_like/robot.urdf": ({}, 7, 5, 3),
    f"{GEPETTO}/digit_like_2legs/robot.urdf": ({"platform": "foot"}, 12, 6, 4),
    f"{GEPETTO}/digit_like_2legs_6D/robot.urdf": ({"platform": "toe_b_1/2"}, 12, 6, 4),
    f"{GEPETTO}/digit_like_2legs_old/robot.urdf": ({"platform": "foot"}, 12, 6, 4),
    f"{GEPETTO}/disney_like/robot.urdf": ({}, 9, 6, 3),
    f"{GEPETTO}/robot_delta/robot.urdf": ({}, 5, 2, 0),
    f"{GEPETTO}/talos_like/robot.urdf": ({}, 7, 6, 4),
    "Rhoban/placo-examples/models/planar-2dof/robot.urdf": ({}, 2, 2, 0),
    f"{ONSHAPE}/planar-2dof/robot.xml": ({"platform": "branch2"}, 2, 2, 0),
    f"{REACHY}/mjcf/reachy_mini.xml": ({"platform": "xl_330"}, 15, 6, 5),
    f"{REACHY}/urdf/robot.urdf": ({"platform": "xl_330"}, 15, 6, 5),
    f"{GRBDA}/Benchmarking/urdfs/parallel_chains/Implicit/depth5/loop_size5.urdf": ({"platform": "link_2_5"}, 9, 3, 3),
    f"{GRBDA}/Benchmarking/urdfs/parallel_chains/Implicit/depth10/loop_size9.urdf": (
        {"platform": "link_2_10"},
        19,
        3,
        3,
    ),
    f"{GRBDA}/Benchmarking/urdfs/variable_four_bar_urdf/four_bar_branch_2_3.urdf": ({"platform": "link_12"}, 6, 3, 2),
    f"{ANKLES}/2_g1_ankle/urdf/23urdf311.xml": ({}, 2, 2, 0),
    f"{ANKLES}/5_tiangong/urdf/TG10-00.xml": ({}, 4, 2, 0),
    f"{CASSIE}/cassie.xml": ({"base": "cassie-pelvis", "platform": "left-foot"}, 8, 5, 4),
    f"{CASSIE}/cassiepole.xml": ({"platform": "left-foot"}, 23, 6, 6),
    f"{CASSIE}/cassie_tray_box.xml": ({"platform": "left-foot"}, 28, 6, 6),
}
SPHERICAL = (
    "Rhoban/placo-examples/models/orbita/robot.urdf",
    "Rhoban/placo-examples/models/spm/robot.urdf",
    "Rhoban/placo-examples/models/spm/robot.xml",
    f"{ONSHAPE}/orbita_mujoco/robot.xml",
)
REFUSED: dict[str, tuple[dict[str, str], type[Exception], str]] = {
    f"{GEPETTO}/disney_robot/robot.urdf": ({}, BadRobotFile, "joint_name 'left_spherical_free_foot'"),
    f"{GEPETTO}/kangaroo_like/robot.urdf": ({"platform": "foot"}, LoopClosureFailure, "is open at"),
    f"{GEPETTO}/kangaroo_like_2legs/robot.urdf": ({"platform": "foot_left"}, LoopClosureFailure, "is open at"),
    f"{GEPETTO}/kangaroo_like_2leg/robot.urdf": ({"platform": "foot"}, LoopClosureFailure, "is open at"),
}


def path_of(name: str) -> Path:
    if not (OTHERS / name).is_file():
        pytest.skip(f"{name} is not here")
    return OTHERS / name


@pytest.mark.parametrize("name", READ)
def test_mobility_and_verdict_are_those_of_independent_counts(name: str):
    given, mobility, dof, lost = READ[name]
    robot = load(path_of(name), **given)
    setup = ObservedRobot.of(robot, samples=4)
    assert setup.mobility_as_written.total == mobility
    whole, normal = Oracle(robot), Oracle(reduce_to_normal_form(robot).mechanism)
    assert whole.mobility(whole.zero()) == mobility
    relation = normal.relation(normal.zero(), setup.observed)
    assert setup.dof == dof == _rank(relation[:6])
    verdict = derive(robot).verdict
    assert len(verdict.unobserved) == lost == relation.shape[1] - _rank(relation[6:])
    words = {0: "controllable", dof: "uncontrollable"}
    assert verdict.verdict == words.get(lost, "partially controllable")


@pytest.mark.parametrize("name", SPHERICAL)
def test_rounded_spherical_robots_have_three_freedoms(name: str):
    """None of their links has two joint centres, so that no segment of theirs can be watched."""
    robot = Oracle(load(path_of(name)))
    assert robot.mobility(robot.zero()) == 3


@pytest.mark.parametrize("name", [name for name in READ if name.startswith(ANKLES)])
def test_modes_of_ankles_are_listed(name: str):
    found = hrsynth.modes(load(path_of(name)), real=True)
    assert (found.found.complete, found.found.complex, len(found.modes)) == (True, 8, 4)


def _rank(rows: Array) -> int:
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > 1e-6))


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_told(name: str):
    given, error, words = REFUSED[name]
    with pytest.raises(error, match=words):
        load(path_of(name), **given)
