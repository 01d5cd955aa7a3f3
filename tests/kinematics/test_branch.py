"""Steps follow the branch: walks stay in one operation mode, a zero configuration in several is refused."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.controllability import verdict_of
from hrsynth.analysis.setting import prepare, restricted
from hrsynth.catalog.geometry import mechanism
from hrsynth.catalog.words import parse
from hrsynth.errors import BranchPoint
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.relation import Question
from hrsynth.kinematics.sampling import draw, wander
from hrsynth.kinematics.twin import Twin
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.vectors import rotation_about

POD = "(Pk*-Utn-Unt)+(Pz*-2SSt)+(Pz*-Utn-S)+(Rt*-2SSt)"


def parallelogram(angle: float, normal: tuple[float, float, float] = (0, 0, 1)) -> Mechanism:
    """A four-bar with equal cranks and equal rails, its cranks at ``angle`` from the rails; the coupler translates, but
    where it is flat it can cross over and turns from there on."""
    turn = rotation_about(np.array([*normal], dtype=float), 0.4)
    tip = turn @ np.array([np.cos(angle), np.sin(angle), 0.0]) * 0.3
    rail = turn @ np.array([0.5, 0.0, 0.0])
    axis = turn @ np.array([0.0, 0.0, 1.0])
    builder = Builder("parallelogram")
    for name in ("base", "left", "right", "coupler"):
        builder.link(name)
    builder.joint("a", "R", "base", "left", (0, 0, 0), axis=axis, motor="m")
    builder.joint("b", "R", "left", "coupler", tip, axis=axis)
    builder.joint("c", "R", "base", "right", rail, axis=axis)
    builder.joint("d", "R", "right", "coupler", rail + tip, axis=axis, loop=True)
    builder.observe("1", "left", tip)
    builder.observe("2", "right", tip)
    return builder.build(platform="coupler")


@pytest.mark.parametrize("angle", [0.02, 0.1, 0.3, 1.2, np.pi - 0.05])
@pytest.mark.parametrize("normal", [(0, 0, 1), (0.48, 0.6, 0.64)])
def test_a_parallelogram_does_not_cross_over(angle: float, normal: tuple[float, float, float]) -> None:
    """The coupler never turns: not in samples, not on long walks towards the flat configurations."""
    robot = parallelogram(angle, normal)
    twin = Twin(robot)
    question = Question("coupler", None, "base", robot.observations)
    home = twin.pose(twin.q0, "coupler")[:3, :3]
    start = ClosedConfiguration.of(twin, twin.q0)
    drawn = draw(twin, question, 10)
    met = [*(member.configuration for member in drawn.members), *wander(start, 300, steps=60)]
    assert max(float(np.abs(at.pose("coupler")[:3, :3] - home).max()) for at in met) < 1e-8
    assert max(float(np.linalg.norm(twin.difference(start.q, at.q))) for at in met) > 0.1


@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_a_flat_parallelogram_belongs_to_two_modes(angle: float) -> None:
    """Both ways out are told, and no verdict is given."""
    robot = parallelogram(angle)
    with pytest.raises(BranchPoint) as caught:
        draw(Twin(robot), Question("coupler", None, "base", robot.observations), 5)
    assert len(caught.value.modes) == 2
    assert any("1T" in mode for mode in caught.value.modes)
    assert any("1R" in mode for mode in caught.value.modes)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize(("dimensions", "seed"), [(7, 0), (140, 1), (185, 3), (518, 1), (572, 0)])
def test_samples_of_a_pod_stay_in_its_operation_mode(dimensions: int, seed: int) -> None:
    """The rails of legs 2 and 3 are along z, so neither sees the platform, which only translates, move along z. In its
    other operation mode, which lies near, the platform turns and both together see all."""
    setting = prepare(mechanism(parse(POD), dimensions), seed=seed)
    segments = setting.segments
    assert [setting.mechanism.joints[f"joint_{leg}_1"].axis.tolist() for leg in (2, 3)] == [[0, 0, 1]] * 2
    for at in setting.configurations:
        R = at.pose("platform")[:3, :3]
        assert np.abs(R - setting.motion.home[:3, :3]).max() < 1e-7
    verdict = verdict_of(setting, ("2", "3"), restricted(setting.everything, segments[1:3]))
    assert (verdict.rank, verdict.dof) == (2, 3)
    assert [freedom.name for freedom in verdict.lost] == ["translation along z"]
