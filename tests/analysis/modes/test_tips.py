"""Where held tips can be: found for the papers' robots, each tip on its curve or surface; refused where it is none."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.modes.laws import needs_msolve
from hrsynth.analysis.loci.tips import derive_tip_loci
from hrsynth.analysis.modes.tip_systems import build_model
from hrsynth.analysis.observed import ObservedRobot, build_motor_model
from hrsynth.constraints.pattern import recognise
from hrsynth.description import list_robots, load
from hrsynth.errors import UnsupportedLocus
from hrsynth.geometry.loci import Circle, Line, Plane, Point, Sphere
from hrsynth.kinematics.locked_twists import locate_joint
from hrsynth.mechanism.legs import decompose
from hrsynth.solving.platform.solve import solve

HIDDEN = {
    "3rrr_m1": Circle,
    "3rpr_m2": Line,
    "3prr_m1": Line,
    "gough_stewart": Line,
    "hexa": Circle,
    "6pus": Line,
    "delta": Circle,
    "orthoglide": Line,
    "quattro": Circle,
    "quattro_rigid": Circle,
    "3rps": Line,
    "3upu": Line,
    "rrrrr_m1": Circle,
    "rprpr_m1": Line,
    "prrrp_m1": Line,
}
REAL = {"3rrr_m1": {Circle}, "3rpr_m2": {Circle}, "3rps": {Circle}, "rrrrr_m1": {Point, Circle}}
RODS = (
    "delta",
    "linear_delta",
    "orthoglide",
    "uranesx",
    "3upu",
    "3puu",
    "3ruu",
    "quattro",
    "quattro_rigid",
    "gough_stewart",
    "hexa",
    "hexaglide",
    "6pus",
)
"""Real robots whose tips stay on spheres with the motors held."""


def confined(name: str, *, real: bool = False, member: int = 1):
    setup = ObservedRobot.of(load(list_robots()[name]))
    observation_model = build_motor_model(setup) if real else setup.samples.observation_model
    configurations = [each.configuration for each in setup.samples.members]
    pattern = recognise(setup.decomposition, observation_model, configurations)
    return derive_tip_loci(setup.decomposition, observation_model, pattern, configurations[member])


def missed(found) -> float:
    """How far the tips are from their curves at the goal, in characteristic lengths."""
    poses = {body: found.goal.pose(body) for body in found.bodies}
    points = [(tip, poses[tip.body] @ np.append(tip.place, 1.0)) for tip in found.tips]
    return max(float(np.linalg.norm(tip.curve.miss(B[:3]))) for tip, B in points) / found.goal.model.length


@pytest.mark.some(2)
@pytest.mark.parametrize("name", HIDDEN)
def test_tips_of_hidden_robots_lie_on_their_curves(name: str):
    found = confined(name)
    assert {type(tip.curve) for tip in found.tips} == {HIDDEN[name]}
    assert missed(found) < 1e-9


@pytest.mark.some(3)
@pytest.mark.parametrize("name", [*REAL, *RODS])
def test_tips_with_the_motors_held(name: str):
    found = confined(name, real=True)
    assert {type(tip.curve) for tip in found.tips} == REAL.get(name, {Sphere})
    assert missed(found) < 1e-9


def test_circles_have_the_length_of_the_cranks():
    """The tip of a held crank and rod moves on a circle with the crank's radius."""
    found = confined("3rrr_m1")
    joints = found.goal.model.mechanism.joints
    for tip in found.tips:
        crank = np.linalg.norm(joints[f"elbow_{tip.leg}"].point - joints[f"shoulder_{tip.leg}"].point)
        assert tip.curve.radius == pytest.approx(crank, abs=1e-9)


def test_spheres_have_the_length_of_the_rods():
    """With its motor held the tip of a leg U-P-S keeps its distance from the U."""
    found = confined("gough_stewart", real=True)
    ends = {leg.label: leg.joints for leg in decompose(found.goal.model.mechanism).legs}
    poses = {body: found.goal.pose(body) for body in found.bodies}
    for tip in found.tips:
        centres = [locate_joint(found.goal, found.goal.model.mechanism.joints[name])[0] for name in ends[tip.leg]]
        rod = max(np.linalg.norm(a - b) for a in centres for b in centres) * found.goal.model.length
        assert tip.curve.radius == pytest.approx(rod, abs=1e-9)
        end = (poses[tip.body] @ np.append(tip.place, 1.0))[:3]
        assert np.linalg.norm(end - tip.curve.centre) == pytest.approx(rod)


@pytest.mark.parametrize("name", ["3prp", "3rrp"])
def test_tips_that_two_slides_carry_stay_in_a_plane(name: str):
    found = confined(name)
    assert {type(tip.curve) for tip in found.tips} == {Plane}
    assert missed(found) < 1e-9


@pytest.mark.parametrize(("name", "real"), [("3ppr_m1", False), ("3prp", True)])
def test_tips_without_a_place_are_refused(name: str, real: bool):
    with pytest.raises(UnsupportedLocus, match="cannot be listed"):
        confined(name, real=real)


def test_bodies_on_a_slide_have_lines_and_spheres():
    for real, kind in ((False, Line), (True, Sphere)):
        found = confined("i4l", real=real)
        assert {type(tip.curve) for tip in found.tips} == {kind}
        assert isinstance(found.slide, Line)
        assert missed(found) < 1e-9


@pytest.mark.parametrize(("name", "complex_count"), [("delta", 2), ("orthoglide", 2), ("3upu", 2), ("3rps", 16)])
def test_real_robots_have_their_known_number_of_modes(name: str, complex_count: int):
    check_real_robot(name, complex_count)


def check_real_robot(name: str, complex_count: int) -> None:
    """Complete, of that number, and the pose itself among them."""
    system = build_model(confined(name, real=True))
    modes = solve(system.system)
    assert modes.complete
    assert modes.complex == complex_count
    home = system.system.pose(system.home)
    assert min(np.abs(mode.pose - home).max() for mode in modes.modes) < 1e-10


@needs_msolve
@pytest.mark.parametrize(("name", "complex_count"), [("quattro", 8), pytest.param("hexa", 40, marks=pytest.mark.slow)])
def test_real_robots_with_rods_have_their_known_number_of_modes(name: str, complex_count: int):
    check_real_robot(name, complex_count)
