"""The curves of held tips: found for the papers' robots, each tip on its curve; refused on surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.modes.curves import Circle, Line, Point
from hrsynth.analysis.modes.tips import confinement
from hrsynth.analysis.setting import prepare
from hrsynth.analysis.singularity.singular import motors
from hrsynth.analysis.singularity.structure import recognise
from hrsynth.description import load, shipped
from hrsynth.errors import NotConfined

HIDDEN = {"3rrr_m1": Circle, "3rpr_m2": Line, "3prr_m1": Line, "gough_stewart": Line, "hexa": Circle, "6pus": Line,
          "delta": Circle, "orthoglide": Line, "quattro": Circle, "quattro_rigid": Circle, "3rps": Line, "3upu": Line,
          "rrrrr_m1": Circle, "rprpr_m1": Line, "prrrp_m1": Line}
REAL = {"3rrr_m1": {Circle}, "3rpr_m2": {Circle}, "3rps": {Circle}, "rrrrr_m1": {Point, Circle}}


def confined(name: str, *, real: bool = False, member: int = 1):
    setting = prepare(load(shipped()[name]))
    question = motors(setting) if real else setting.samples.question
    configurations = [each.configuration for each in setting.samples.members]
    structure = recognise(setting.anatomy, question, configurations)
    return confinement(setting.anatomy, question, structure, configurations[member])


def missed(found) -> float:
    """How far the tips are from their curves at the goal, in characteristic lengths."""
    poses = {body: found.goal.pose(body) for body in found.bodies}
    points = [(tip, poses[tip.body] @ np.append(tip.place, 1.0)) for tip in found.tips]
    return max(float(np.linalg.norm(tip.curve.miss(B[:3]))) for tip, B in points) / found.goal.twin.length


@pytest.mark.parametrize("name", HIDDEN)
def test_tips_of_hidden_robots_lie_on_their_curves(name: str):
    found = confined(name)
    assert {type(tip.curve) for tip in found.tips} == {HIDDEN[name]}
    assert missed(found) < 1e-9


@pytest.mark.parametrize("name", REAL)
def test_tips_with_the_motors_held(name: str):
    found = confined(name, real=True)
    assert {type(tip.curve) for tip in found.tips} == REAL[name]
    assert missed(found) < 1e-9


def test_circles_have_the_length_of_the_cranks():
    """The tip of a held crank and rod moves on a circle with the crank's radius."""
    found = confined("3rrr_m1")
    joints = found.goal.twin.mechanism.joints
    for tip in found.tips:
        crank = np.linalg.norm(joints[f"elbow_{tip.leg}"].point - joints[f"shoulder_{tip.leg}"].point)
        assert tip.curve.radius == pytest.approx(crank, abs=1e-9)


@pytest.mark.parametrize("name", ["3prp", "3ppr_m1", "i4l"])
def test_tips_on_surfaces_are_refused(name: str):
    with pytest.raises(NotConfined, match="cannot be listed"):
        confined(name)
