"""Schemes: every joint stands there once, in its right colour, and no line runs through a box."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from lxml import etree

import strategies
from hrsynth.analysis.derive import derive
from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.sensors import choose_default_segment
from hrsynth.present.drawings import svg
from hrsynth.present.drawings.plan import Layout, plan
from hrsynth.present.drawings.schematic import draw_leg_svg, draw_robot_svg

FEW = ("rrrrr_m1", "quattro", "uranesx")


def real(name: str) -> tuple[Mechanism, set[str]]:
    """A robot in normal form and the links of its default observations."""
    mechanism = reduce_to_normal_form(load(name)).mechanism
    decomposition = decompose(mechanism)
    return mechanism, {choose_default_segment(decomposition, leg).link for leg in decomposition.legs}


def driven(mechanism: Mechanism) -> set[str]:
    return {joint.name for joint in mechanism.joints.values() if joint.is_actuated}


def read(text: str) -> Any:
    root = etree.fromstring(text.encode())
    for element in root.iter():
        element.tag = etree.QName(element).localname
    return root


def joints_in(root: Any, kind: str | None = None) -> list[str]:
    """The joints of all elements that stand for any, or of those inside a group of a kind."""
    where = ".//*[@data-joint]" if kind is None else f".//g[@class='{kind}']//*[@data-joint]"
    return [name for element in root.xpath(where) for name in element.get("data-joint").split("\n")]


def assert_whole(text: str, mechanism: Mechanism, observed: set[str], virtual: set[str]) -> None:
    """Well-formed, named, every joint once and in its colour, every observed link coloured."""
    root = read(text)
    assert root[0].tag == "title"
    assert root[1].tag == "desc"
    assert Counter(joints_in(root)) == dict.fromkeys(mechanism.joints, 1)
    seen = root.xpath(".//g[@class='observed']//*[@data-link]")
    assert {element.get("data-link") for element in seen} == observed
    links = Counter(element.get("data-link") for element in root.xpath(".//*[@data-link]"))
    assert set(links.values()) == {1}
    assert {mechanism.base, mechanism.platform} <= set(links) <= set(mechanism.links)
    assert_coloured(root, mechanism, virtual)
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")


def assert_coloured(root: Any, mechanism: Mechanism, virtual: set[str]) -> None:
    motors, others = joints_in(root, "motor"), joints_in(root, "joint")
    assert driven(mechanism) - virtual <= set(motors)
    assert set(joints_in(root, "virtual")) == virtual
    assert not driven(mechanism) & set(others)
    for group in root.xpath(".//g[@class='motor']"):
        assert svg.FILLS["motor"] in [element.get("fill") for element in group.iter()]


def runs(found: Layout) -> Iterator[tuple[int, float, float]]:
    """Lane, start and end of each straight piece."""
    for net in found.nets:
        for way in net.ways:
            for (x, lane), (u, _) in pairwise(way):
                yield lane, min(x, u), max(x, u)


def assert_free(found: Layout) -> None:
    """Boxes stand apart, no line runs through one, no two links share a piece of a lane or bar, bars meet no box."""
    places = [(spot.x, spot.lane) for spot in found.spots]
    assert len(set(places)) == len(places)
    pieces = sorted(runs(found))
    for lane, start, end in pieces:
        assert not any(at == lane and start < x < end for x, at in places)
    for (lane, _, end), (other, start, _) in pairwise(pieces):
        assert lane != other or end <= start
    bars = [net.bar for net in found.nets if net.bar is not None]
    for x, first, last in bars:
        assert not any(abs(x - at) < 0.25 and first <= lane <= last for at, lane in places)
    for (x, _, last), (u, start, _) in pairwise(sorted(bars)):
        assert x != u or last < start


@pytest.mark.some(33)
@pytest.mark.parametrize("name", list_robots())
def test_every_joint_of_a_robot_stands_once_and_motors_are_marked(name: str) -> None:
    mechanism, observed = real(name)
    assert_whole(draw_robot_svg(mechanism, observed=observed), mechanism, observed, set())
    assert_free(plan(mechanism, observed=observed))


@pytest.mark.some(2, 16)
@pytest.mark.parametrize("form", ["simplified", "general"])
@pytest.mark.parametrize(
    "name", [*FEW, *(pytest.param(n, marks=pytest.mark.slow) for n in list_robots() if n not in FEW)]
)
def test_virtual_actuators_of_hidden_robots_are_coloured(name: str, form: str) -> None:
    hidden = derive(load(name), form=form).hidden
    if hidden is None:
        assert name.startswith("3ppr")
        return
    observed, virtual = {o.link for o in hidden.observations}, driven(hidden)
    assert_whole(draw_robot_svg(hidden, virtual=virtual), hidden, observed, virtual)
    assert_free(plan(hidden, virtual=virtual))


@settings(max_examples=60, deadline=None)
@given(strategies.mechanisms())
def test_any_mechanism_can_be_drawn(mechanism: Mechanism) -> None:
    assert_whole(draw_robot_svg(mechanism, observed=()), mechanism, set(), set())
    assert_free(plan(mechanism, observed=()))


@pytest.mark.parametrize("name", ["quattro", "rrrrr_m1", "gough_stewart"])
def test_a_leg_alone_holds_its_own_joints(name: str) -> None:
    mechanism, observed = real(name)
    for leg in decompose(mechanism).legs:
        assert sorted(joints_in(read(draw_leg_svg(mechanism, leg.label, observed=observed)))) == sorted(leg.joints)
    with pytest.raises(BadRequest, match="unknown leg: got '9'"):
        draw_leg_svg(mechanism, "9")


@pytest.mark.parametrize("name", ["quattro", "gough_stewart", "orthoglide"])
def test_legs_are_rows_from_the_base_to_the_platform(name: str) -> None:
    mechanism, _ = real(name)
    decomposition, found = decompose(mechanism), plan(mechanism)
    assert sorted(row.label for row in found.rows if row.label) == sorted(decomposition.labels)
    for net in found.nets:
        if net.link == mechanism.base:
            assert net.bar is not None
            assert net.bar[0] == 0
    for number, row in enumerate(found.rows):
        boxes = [spot.box for spot in found.spots if spot.row == number]
        own = {name for box in boxes for name in box.joints}
        assert row.label is None or own == set(decomposition.leg(row.label).joints)
        assert all(row.start < spot.x < row.end for spot in found.spots if spot.row == number)


def test_parallelograms_are_one_box_unless_a_crank_is_observed() -> None:
    hidden = derive(load("rrrrr_m1")).hidden
    assert hidden is not None
    letters = [spot.box.letter for spot in plan(hidden).spots]
    assert letters.count("Π") == 2
    assert plan(hidden, observed=["crank_1"]).spots != plan(hidden).spots
    assert [spot.box.letter for spot in plan(hidden, observed=["crank_1"]).spots].count("Π") == 1


def test_what_is_in_no_leg_makes_one_group_of_all() -> None:
    mechanism, observed = real("gough_stewart")
    one, two = (next(o for o in sorted(observed) if str(n) in o) for n in (1, 2))
    slide = next(j for j in mechanism.joints.values() if one in j.links)
    bridge = type(slide)("bridge", JointType.SPHERICAL, one, two, slide.point)
    bridged = mechanism.changed(joints=[bridge])
    assert_whole(draw_robot_svg(bridged, observed=()), bridged, set(), set())
    assert_free(plan(bridged, observed=()))


def test_virtual_chains_from_a_camera_on_a_leg_are_told_apart() -> None:
    hidden = derive(load("delta"), ["1", "2"], camera="arm_3").hidden
    assert hidden is not None
    found = plan(hidden, virtual=driven(hidden))
    assert [row.label for row in found.rows] == [None]
    assert_whole(draw_robot_svg(hidden, virtual=driven(hidden)), hidden, {"rod_1a", "rod_2a"}, driven(hidden))
    assert_free(found)
