"""What the view shows, as plain data: closed loops at every slider, joints drawn once, rods between joint centres."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from hrsynth import check, load, modes, view
from hrsynth.description import list_robots
from hrsynth.geometry.vectors import unit
from hrsynth.mechanism import JointType
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.present.view.view import View
from present.views import mechanism_of, miss, moved, seen, states, turned

CLOSED, DRAWN = 1e-6, 1e-6
"""Metres, and sines of angles, that joints may be open in the data; that drawn points may be off."""
QUICK = ("rrrrr_m1", "quattro")
OTHERS = [name for name in list_robots() if name not in QUICK]
ROBOTS = [
    *QUICK,
    *(pytest.param(name, marks=pytest.mark.long if k % 4 else pytest.mark.slow) for k, name in enumerate(OTHERS)),
]
"""Of the others a quarter is slow, the same in all laws: what is seen of a robot is computed once."""


def law_joints_hold(found: View) -> None:
    for machine in found.machines:
        mechanism, place = mechanism_of(found, machine), {name: i for i, name in enumerate(machine.links)}
        for state in states(found):
            places = state.places[machine.key]
            worst = max(
                miss(joint, places[place[joint.predecessor]], places[place[joint.successor]])
                for joint in mechanism.joints.values()
                if joint.type is not JointType.FREE
            )
            assert worst < CLOSED, (machine.key, worst)


@pytest.mark.some(0, 5)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "quattro" else name for name in ROBOTS]
)
def test_all_loops_are_closed_at_every_position_of_every_slider(name: str):
    found = seen(name)
    assert len(found.sliders) == found.setup.dof
    assert all(len(slider.values) > 10 for slider in found.sliders)
    law_joints_hold(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_a_slider_moves_one_coordinate_and_keeps_the_others(name: str):
    found = seen(name)
    link = list(found.setup.mechanism.links).index(found.setup.mechanism.platform)
    start = found.setup.mechanism.links[found.setup.mechanism.platform].pose[:3, 3]
    shown = {slider.name for slider in found.sliders}
    for slider in found.sliders:
        assert np.all(np.diff(slider.values) > 0)
        assert slider.states[slider.home].places["real"] == pytest.approx(found.home.places["real"])
        for value, state in zip(slider.values, slider.states, strict=True):
            place = state.places["real"][link]
            angle = 2 * np.arctan2(np.linalg.norm(place[3:6]), place[6])
            axis = place[3:6] / max(np.linalg.norm(place[3:6]), 1e-12)
            point = moved(place, start) if found.setup.decomposition.point is None else None
            for k, each in enumerate("xyz"):
                if point is not None and each in shown:
                    assert point[k] == pytest.approx(value if slider.name == each else start[k], abs=DRAWN)
                if "phi" in shown:
                    wanted = value if slider.name == "phi" else 0.0
                    assert angle * axis[k] == pytest.approx(wanted * found.setup.motion.normal[k], abs=DRAWN)
                if f"turn about {each}" in shown:
                    wanted = value if slider.name == f"turn about {each}" else 0.0
                    assert angle * axis[k] == pytest.approx(wanted, abs=DRAWN)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_the_hidden_robot_shows_the_same_directions_and_platform(name: str):
    found = seen(name)
    if len(found.machines) == 1:
        assert "every observed direction is constant: there is no hidden robot" in found.notes
        return
    real, hidden = (list(machine.links) for machine in found.machines)
    for state in states(found):
        for seen_by in found.setup.observed:
            if not isinstance(seen_by, Direction) or seen_by.link not in hidden:
                continue
            d = found.setup.mechanism.links[seen_by.link].pose[:3, :3] @ seen_by.direction
            u, v = (
                turned(state.places[key][links.index(seen_by.link)], d)
                for key, links in (("real", real), ("hidden", hidden))
            )
            assert u == pytest.approx(v, abs=DRAWN)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_every_joint_is_drawn_once_and_every_rod_ends_in_joint_centres(name: str):
    found = seen(name)
    for machine in found.machines:
        mechanism = mechanism_of(found, machine)
        drawn = Counter(shape.joint for shape in machine.shapes if shape.joint is not None)
        assert drawn == Counter(joint.name for joint in mechanism.joints.values() if joint.type is not JointType.FREE)
        for shape in machine.shapes:
            if shape.kind != "rod":
                continue
            real = found.setup.mechanism
            joints = [*mechanism.joints_of(shape.link)]
            joints += real.joints_of(shape.link) if shape.link in real.links else []
            for end in shape.points:
                assert min(np.linalg.norm(joint.point - end) for joint in joints) < DRAWN
        for link in mechanism.links:
            centres = {tuple(np.round(joint.point, 6)) for joint in mechanism.joints_of(link)}
            rods = [shape for shape in machine.shapes if (shape.kind, shape.link) == ("rod", link)]
            ends = {tuple(np.round(point, 6)) for rod in rods for point in rod.points}
            assert len(centres) == 1 or len(ends) >= len(centres), link


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_virtual_actuators_are_marked_and_motors_are_not_in_the_hidden_robot(name: str):
    found = seen(name)
    for machine in found.machines:
        driven = {joint.name for joint in mechanism_of(found, machine).joints.values() if joint.actuated}
        role = "motor" if machine.key == "real" else "actuator"
        assert {shape.joint for shape in machine.shapes if shape.role in ("motor", "actuator")} == driven
        assert all(shape.role == role for shape in machine.shapes if shape.joint in driven)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_every_observed_leg_has_its_arrow_along_what_is_observed(name: str):
    found = seen(name)
    assert [arrow.leg for arrow in found.arrows] == list(found.setup.labels)
    for arrow, observed in zip(found.arrows, found.setup.observed, strict=True):
        assert isinstance(observed, Direction)
        d = found.setup.mechanism.links[observed.link].pose[:3, :3] @ observed.direction
        assert unit(arrow.ends[1] - arrow.ends[0]) == pytest.approx(d, abs=DRAWN)
        assert arrow.link == observed.link


@pytest.mark.parametrize("name", ROBOTS)
def test_there_is_a_ghost_for_each_mode_but_the_pose_itself(name: str):
    found = seen(name)
    listed = modes(load(name), list(found.setup.labels))
    if listed.found.continuous_family is not None:
        assert not found.mode_outlines
        assert any("continuum" in note for note in found.notes)
        return
    assert len(found.mode_outlines) == len(listed.modes) - 1
    for outline in found.mode_outlines:
        for observed in found.setup.observed if outline.reachable else ():
            assert isinstance(observed, Direction)
            place = outline.places[list(found.setup.mechanism.links).index(observed.link)]
            d = found.setup.mechanism.links[observed.link].pose[:3, :3] @ observed.direction
            assert turned(place, d) == pytest.approx(d, abs=1e-5)


@pytest.mark.slow
def test_the_turn_of_a_planar_robots_mode_is_told_as_phi():
    found = seen("3rrr_m1")
    listed = modes(load("3rrr_m1"))
    (mode,) = [each for each in listed.modes if not each.goal][:1]
    link, home = found.setup.motion.link, found.setup.motion.home
    turn = mode.configuration.pose(link)[:3, :3] @ home[:3, :3].T
    degrees = np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))
    assert found.mode_outlines[0].words.endswith(f", phi {round(degrees, 1):g}°")


@pytest.mark.parametrize("name", ["prrrp_m1", pytest.param("uranesx", marks=pytest.mark.slow)])
def test_rails_are_as_long_as_their_carriages_go(name: str):
    found = seen(name)
    for machine in found.machines:
        mechanism = mechanism_of(found, machine)
        rails = [shape for shape in machine.shapes if shape.kind == "rail"]
        guides = [joint for joint in mechanism.joints.values() if joint.type.slides and mechanism.base in joint.links]
        assert len(rails) == len(guides) == len(found.setup.decomposition.legs)
        for rail, joint in zip(rails, guides, strict=True):
            link, way = machine.links.index(joint.other(mechanism.base)), unit(rail.points[1] - rail.points[0])
            places = [moved(state.places[machine.key][link], joint.point) for state in states(found)]
            parts = [(p - rail.points[0]) @ way / np.linalg.norm(rail.points[1] - rail.points[0]) for p in places]
            assert 0 < min(parts) < 0.2
            assert 0.8 < max(parts) < 1


def test_the_distance_is_that_of_check():
    found = seen("rrrrr_m1")
    slider = found.sliders[0]
    pose = f"x={slider.values[3]},y={found.sliders[1].values[found.sliders[1].home]}"
    checked = check(load("rrrrr_m1"), at=[pose]).postures[0]
    assert slider.states[3].distance == pytest.approx(checked.distances.type2, rel=1e-5)
    assert found.largest == max(state.distance for state in states(found))


@pytest.mark.slow
def test_without_hidden_only_the_real_robot_is_shown():
    found = view(load("rrrrr_m1"), ["1"])
    assert [machine.key for machine in found.machines] == ["real"]
    assert [arrow.leg for arrow in found.arrows] == ["1"]
    law_joints_hold(found)
