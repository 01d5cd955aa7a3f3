"""The atlas: a table of equivalences, each entry with its reason, attacked by paths of its own and by brute force."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from analysis.aspects.certified import check_certified
from analysis.aspects.six_modes import determinants, six_modes, tips_at
from hrsynth.analysis.aspects import aspects as module
from hrsynth.analysis.aspects.aspects import AspectTable, aspects
from hrsynth.analysis.aspects.verdicts import SAME, SEPARATED, UNDECIDED
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest, PoseReachFailure
from hrsynth.families.planar import six_poses
from hrsynth.kinematics.configuration import measure
from hrsynth.mechanism import Limits

ROBOTS = [("quattro", "1,4"), ("gough_stewart", "1,3,5"), ("rrrrr_m1", None), ("delta", "1,2"), ("3prr_m1", None)]


@cache
def atlas_of(name: str, observe: str | None = None) -> AspectTable:
    return aspects(six_poses() if name == "six" else hrsynth.load(name), observe)


def check_table(found: AspectTable) -> None:
    """Each mode is in one aspect with itself; the table is symmetric; "same aspect" is an equivalence that "separated"
    respects, so no two modes are both; the number of aspects is what the table allows."""
    table, size = found.table, len(found.places)
    assert all(table[i][i] == SAME for i in range(size))
    assert all(table[i][j] == table[j][i] for i, j in combinations(range(size), 2))
    for i in range(size):
        for j in range(size):
            if table[i][j] == SAME:
                assert {table[i][k] for k in range(size) if table[j][k] == SAME} == {SAME}
                assert {table[i][k] for k in range(size) if table[j][k] == SEPARATED} <= {SEPARATED}
    few, many = found.count
    assert few <= many == len(found.groups)
    assert (few == many) or any(UNDECIDED in row for row in table)


@pytest.mark.some(2)
@pytest.mark.parametrize(("name", "observe"), ROBOTS)
def test_the_table_is_an_equivalence_with_reasons(name: str, observe: str | None):
    found = atlas_of(name, observe)
    check_table(found)
    assert found.table[0][1:] != [UNDECIDED] * (len(found.places) - 1)
    for pair in found.pairs:
        assert pair.reason
        assert (pair.answer is not None) or pair.via or pair.verdict == UNDECIDED
        if pair.answer is not None and pair.verdict == SAME:
            check_certified(found.aspects, pair.answer, 40)


@pytest.mark.parametrize(("name", "observe"), ROBOTS)
def test_signs_of_the_determinant_agree_with_the_table(name: str, observe: str | None):
    found = atlas_of(name, observe)
    numbers = [k for k, at in enumerate(found.places, 1) if at is not None]
    if not found.aspects.condition.signed:
        assert not any(SEPARATED in row for row in found.table)
        return
    signs = np.sign(
        found.aspects.condition.evaluate(found.aspects.structure.values_at([found.places[k - 1] for k in numbers]))
    )
    for (i, one), (j, other) in combinations(zip(numbers, signs, strict=True), 2):
        assert (found.verdict(i, j) == SEPARATED) == (one != other)


@pytest.mark.slow
def test_a_cuspidal_robot_goes_from_mode_to_mode_with_the_same_directions():
    """The six poses of 1992: three in each of two aspects; all along each path, looked at again by Pinocchio, loops
    close and the rank is full, and both ends have the same directions and are apart."""
    found = atlas_of("six")
    check_table(found)
    assert len(found.places) == found.listed.found.complex == 6
    assert found.count == (2, 2)
    assert sorted(map(len, found.groups)) == [3, 3]
    assert found.cuspidal is True
    paths = [pair.answer for pair in found.changes if pair.answer is not None]
    assert any(not answer.crossings for answer in paths)
    for answer in paths:
        check_certified(found.aspects, answer, 200)
        observation_model = found.aspects.setup.samples.observation_model
        seen = [
            np.array(
                measure(
                    end.configuration.model,
                    end.configuration.q,
                    observation_model.reference,
                    observation_model.observations,
                )[2]
            )
            for end in (answer.start, answer.goal)
        ]
        assert np.max(np.abs(seen[0] - seen[1])) < 1e-9
        link = found.aspects.motion.link
        assert np.max(np.abs(answer.start.configuration.pose(link) - answer.goal.configuration.pose(link))) > 0.01


@pytest.mark.slow
def test_limits_that_no_path_considers_are_named():
    """A limit on one side is not enclosed along a path: what leads from mode to mode may pass it."""
    robot = hrsynth.load("quattro")
    elbow = next(joint for joint in robot.joints.values() if joint.type.value == "R" and not joint.is_actuated)
    found = hrsynth.aspects(robot.changed(joints=[replace(elbow, limits=Limits(lower=-1.0))]), "1,4")
    paths = [pair.answer for pair in found.pairs if pair.verdict == SAME and pair.answer is not None]
    assert paths
    assert all(each.limits_ignored == (elbow.name,) for each in paths)
    assert str(found).rstrip().endswith(f"joint limits of {elbow.name}")
    assert "joint limits" not in str(atlas_of("quattro", "1,4"))


def test_the_shipped_quattro_changes_its_mode_without_a_singularity():
    found = atlas_of("quattro", "1,4")
    assert [pair.numbers for pair in found.changes] == [(2, 3)]
    assert found.table[3][:3] == [UNDECIDED] * 3
    assert all("mode 4: no" in pair.reason for pair in found.pairs if 4 in pair.numbers)


@pytest.mark.slow
def test_pairs_that_follow_from_others_agree_with_their_own_paths():
    """For random robots in tilted planes with six modes: what follows from other pairs, asked for directly, is never
    the opposite; nor is the sign of the determinant by lines along cranks, without the engine."""
    for instance, _ in zip(six_modes(5), range(2), strict=False):
        found = aspects(instance.robot)
        check_table(found)
        assert found.cuspidal
        p = np.array([at.pose(instance.robot.platform) for at in found.places])
        order = [int(np.argmin(np.abs(instance.poses - X).max(axis=(1, 2)))) for X in p]
        assert sorted(order) == list(range(6))
        signs = np.sign(determinants(instance, tips_at(instance, instance.poses), instance.ends))[order]
        for pair in found.pairs:
            i, j = (k - 1 for k in pair.numbers)
            assert (pair.verdict == SEPARATED) == (signs[i] != signs[j])
            own = found.aspects.join(found.places[i], found.places[j], seed=1)
            assert own.verdict in (pair.verdict, UNDECIDED)


@pytest.mark.slow
def test_a_mode_that_is_not_proved_shows_nothing():
    """Without enclosures, or where they are wider than the tube of the paths, no robot is called cuspidal."""
    found = atlas_of("six")
    for change in ({"proved": False, "goal": False}, {"shift": 1e-3}):
        modes = tuple(replace(mode, **change) for mode in found.listed.modes)
        assert replace(found, listed=replace(found.listed, modes=modes)).cuspidal is None


def test_intervals_that_are_used_up_leave_pairs_undecided(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "ASPECTS_INTERVALS_MAX", 1)
    found = aspects(six_poses())
    check_table(found)
    assert found.cuspidal is None
    assert found.count[1] > 2
    assert any("limit of intervals" in pair.reason for pair in found.pairs)


@pytest.mark.slow
def test_a_continuum_has_an_empty_table_and_no_picture(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = aspects(hrsynth.load("quattro"), "1")
    assert found.table == []
    assert found.cuspidal is None
    assert "continuous family" in str(found)
    with pytest.raises(BadRequest, match="continuous family"):
        hrsynth.draw(found)
    picture = tmp_path / "atlas.png"
    assert run_command(["aspects", "quattro", "--observe", "1", "-o", str(picture)]) == 0
    assert "is not drawn" in capsys.readouterr().err
    assert not picture.exists()


def test_json_is_the_contract(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    picture = tmp_path / "atlas.png"
    assert run_command(["aspects", "quattro", "--observe", "1,4", "--json", "-o", str(picture)]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["robot"], data["command"], data["cuspidal"]) == ("quattro", "aspects", True)
    assert data["table"][1] == [SEPARATED, SAME, SAME, UNDECIDED]
    assert data["aspects"] == {"least": 2, "most": 2, "modes": [[1], [2, 3]]}
    assert len(data["modes"]) == 4
    assert data["pairs"][3]["modes"] == [2, 3]
    assert data["pairs"][3]["path"]["margin"] > 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_pose_that_is_a_mode_is_reached_where_no_small_steps_lead():
    """Every mode that ``modes`` calls assembled is an end of a path, by its pose as it is printed."""
    robot = six_poses()
    found = atlas_of("six")
    assert {mode.assembly for mode in found.listed.modes} == {"yes"}
    for mode in found.listed.modes[1:]:
        by_pose = hrsynth.path(robot, start=str(found.listed.pose), goal=str(mode.pose))
        assert np.max(np.abs(by_pose.goal.configuration.pose("platform") - mode.configuration.pose("platform"))) < 1e-5


def test_what_is_no_mode_is_refused_as_before():
    with pytest.raises(PoseReachFailure, match="is not reached"):
        hrsynth.path(six_poses(), start="x=-0.064092", goal="x=0.01,y=0.5")
