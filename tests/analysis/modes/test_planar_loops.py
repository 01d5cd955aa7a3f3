"""Modes of planar mechanisms from their joints: the same as by tips on curves, and geared ones as by a polynomial."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np
import pytest

import hrsynth
from analysis.modes.gears import closings, five_bar, linkage
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.mode_search import search
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.analysis.modes.natural_modes import solve_natural
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.constraints.pattern import list_leg_ends, list_placing_links
from hrsynth.description import list_robots, load
from hrsynth.errors import ExternalSolverFailure, UnsupportedLocus
from hrsynth.geometry.vectors import compare_poses
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

QUICK = {"rrrrr_m1", "3rrr_m1", "3rpr_m2", "3prp", "prrrp_m1", "rprpr_m2"}


@cache
def planar() -> list[str]:
    """The shipped robots whose joints turn about one direction and slide across it."""
    found = []
    for name, path in list_robots().items():
        joints = load(path).joints.values()
        axes = [joint.axis for joint in joints if joint.type.value == "R"]
        if axes and all(
            joint.type.value in "RP" and abs(abs(joint.axis @ axes[0]) - (joint.type.value == "R")) < 1e-9
            for joint in joints
        ):
            found.append(name)
    return found


def measured(found: AssemblyModes) -> MeasuredRobot:
    return MeasuredRobot.of(found.setup, found.kind == "real")


@pytest.mark.some(2)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow]) for name in planar()]
)
def test_natural_coordinates_and_tips_agree(name: str, real: bool):
    """The general way shares neither unknowns nor solver with the others."""
    listed = hrsynth.modes(name, real=real)
    if listed.found.continuous_family is not None:
        with pytest.raises((UnsupportedLocus, ExternalSolverFailure)):
            solve_natural(measured(listed), listed.goal)
        return
    made, found = solve_natural(measured(listed), listed.goal)
    assert listed.found.complete
    assert found.complete
    assert found.complex == listed.found.complex
    assert len(found.modes) == len(listed.modes) + len(listed.antipodal)
    length = listed.goal.model.length
    for mode in listed.modes:
        assert mode.bodies is not None
        assert (
            min(
                max(
                    compare_poses(X, made.bodies(each.q)[body], length, listed.setup.decomposition.point)
                    for body, X in mode.bodies.items()
                )
                for each in found.modes
            )
            < 1e-9
        )


def test_there_are_planar_robots():
    assert len(planar()) > 15
    assert QUICK.issubset(planar())


@pytest.mark.some(1, 9)
@pytest.mark.parametrize("ratio", ["1", "2", "-1", "-2", "1/2", "-3/2", "4"])
@pytest.mark.parametrize("seed", range(5))
def test_geared_five_bars(ratio: str, seed: int):
    """Of the crank's and the driven bar's turns q and p the closings are 2 max(p, q), and 2 (p + q) where they turn
    against each other."""
    k = Fraction(ratio)
    mechanism, points = five_bar(float(k), seed, 1 if seed % 2 else -1)
    found = hrsynth.modes(mechanism, "1")
    count, turns = closings(k, points)
    assert count == 2 * (max(k.numerator, k.denominator) if k > 0 else abs(k.numerator) + k.denominator)
    assert (found.found.complete, found.found.complex, len(found.modes)) == (True, count, len(turns))
    assert found.modes[0].goal
    for mode in found.modes:
        assert mode.proved
        assert mode.radius < 1e-8
        assert mode.configuration is not None
        assert np.linalg.norm(mode.configuration.model.residual(mode.configuration.q)) < 1e-9  # its gears too
        R = mode.configuration.pose("floating")[:3, :3] @ found.goal.pose("floating")[:3, :3].T
        assert np.abs(np.exp(1j * np.arctan2(R[1, 0], R[0, 0])) - np.exp(1j * turns)).min() < 1e-8
    real = hrsynth.modes(mechanism, real=True)
    assert (real.found.complete, real.found.complex) == (True, 2)


@pytest.mark.some(1)
@pytest.mark.parametrize("ratio", [2.0, -1.0])
def test_a_search_finds_only_closings_that_are_listed(ratio: float):
    listed = hrsynth.modes(five_bar(ratio, 3)[0], "1")
    found = search(listed.goal, measured(listed).observation_model, list_leg_ends(listed.setup.decomposition))
    assert len(found.modes) > 1
    for mode in found.modes:
        assert (
            min(
                max(np.abs(X - each.bodies[body]).max() for body, X in mode.bodies.items())
                for each in listed.modes
                if each.bodies
            )
            < 1e-6
        )


def test_more_than_needed_is_measured():
    """The floating bar is seen too: all other closings are excluded."""
    found = hrsynth.modes(five_bar(-1.0)[0], "all")
    assert found.found.complete
    assert (len(found.modes), found.found.complex, found.modes[0].goal) == (1, 1, True)


STEPHENSON = [(0, 0), (0.2, 0.6), (1.1, 0.9), (1.2, 0), (0.8, 1.4), (2.0, 1.5), (2.1, 0.1)]
LINKS = {"base": [0, 3, 6], "a": [0, 1], "coupler": [1, 2, 4], "b": [2, 3], "c": [4, 5], "d": [5, 6]}


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("motor", "platform", "count"),
    [("j0", "coupler", 2), ("j6", "coupler", 6), ("j3", "coupler", 2), ("j0", "c", 4)],
)
def test_a_six_bar_of_two_loops(motor: str, platform: str, count: int):
    """Stephenson's: with the motor in the four-bar that has two closings, whatever the other loop, with it in the other
    one, coupler curve and circle meet in six; the last bar has two places for each of the four-bar's."""
    found = hrsynth.modes(linkage(STEPHENSON, LINKS, platform, motor), real=True)
    assert (found.found.complete, found.found.complex) == (True, count)
    assert all(mode.proved for mode in found.modes)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("word", "count"), [("(Rz!-Rz*-Ph)+(Rz!-Rz-Rz*)+(Rz!-Rz*-Rz)", 6), ("(Ph*-Rz-Pj)+(Ph-Rz-Rz*)+(Rz-Ph*-Pj)", 4)]
)
def test_loops_are_told_so_that_their_degrees_are_low(word: str, count: int):
    """A tip on a line of the platform, two on circles: 6, as a coupler curve meets a circle; lines alone leave 4."""
    found = hrsynth.modes(build_mechanism(parse(word)), real=True)
    assert (found.found.complete, found.found.complex) == (True, count)
    others = search(found.goal, measured(found).observation_model, list_leg_ends(found.setup.decomposition))
    for mode in others.modes:
        assert (
            min(
                max(np.abs(X - each.bodies[body]).max() for body, X in mode.bodies.items())
                for each in found.modes
                if each.bodies
            )
            < 1e-6
        )


def test_slides_that_are_coupled():
    """Two carriages on one rail, the second twice as fast, joined by two bars: with a bar's direction held their
    distance is what it was, and so is all else; with both held by the motor the bars have two closings."""
    points, links = (
        [(0, 0), (1.5, 0), (0, 0.2), (1.5, 0.2), (0.6, 1.1)],
        {"base": [0, 1], "left": [0, 2], "right": [1, 3], "one": [2, 4], "other": [3, 4]},
    )
    mechanism = linkage(points, links, "other", "j0", {0: (1, 0), 1: (1, 0)}, [("j0", "j1", 2.0)])
    found = hrsynth.modes(mechanism, real=True)
    assert (found.found.complete, found.found.complex, len(found.modes)) == (True, 2, 2)


def test_ratios_that_are_not_supported_say_so():
    for ratio, reason in ((np.sqrt(2.0), "is not a quotient of whole"), (7.0, "is not a quotient of whole")):
        observed = hrsynth.observe(five_bar(ratio)[0], "1")
        with pytest.raises(UnsupportedLocus, match=reason):
            solve_natural(MeasuredRobot.of(observed), observed.all_samples.start)
        assert not hrsynth.modes(observed).found.complete


def carried(platform: str) -> Mechanism:
    """A four-bar whose coupler carries a tool by two cranks of its own, the first one driven."""
    b = Builder("carried")
    joints = {
        "a": ("base", "one", (0, 0)),
        "b": ("one", "bar", (0.1, 0.5)),
        "c": ("base", "two", (0.7, 0.05)),
        "d": ("two", "bar", (0.62, 0.48)),
        "e": ("bar", "first", (0.3, 0.6)),
        "f": ("bar", "second", (0.5, 0.62)),
        "g": ("first", "tool", (0.35, 0.9)),
        "h": ("second", "tool", (0.58, 0.83)),
    }
    b.link("base")
    for name, (one, other, at) in joints.items():
        if name not in "dh":
            b.link(other, at=(*at, 0))
        b.joint(name, "R", one, other, at=(*at, 0), axis=(0, 0, 1), motor=name in "ae", loop=name in "dh")
    return b.build(platform=platform)


def test_a_tool_that_cranks_on_the_platform_carry_has_both_its_places():
    """Two places for each one of the coupler: the tool turned about G so that H is mirrored at the line from F to G."""
    bars, tools = (hrsynth.modes(carried(platform), real=True) for platform in ("bar", "tool"))
    assert bars.found.complete
    assert tools.found.complete
    assert len(tools.modes) == 2 * len(bars.modes) == 4
    at = [mode.configuration for mode in tools.modes]
    for mode in bars.modes:
        assert mode.configuration is not None
        bar = mode.configuration.pose("bar")
        F, G = (bar @ [*point, 0, 1] for point in ([0.4, 0.12], [0.25, 0.4]))
        H = np.array(
            [
                [*(there.pose("tool") @ [0.23, -0.07, 0, 1])]
                for there in at
                if there is not None and compare_poses(there.pose("bar"), bar, 1.0) < 1e-9
            ]
        )
        assert len(H) == 2
        along = (G - F) / np.linalg.norm(G - F)
        assert H[1] == pytest.approx(2 * (F + (H[0] - F) @ along * along) - H[0], abs=1e-9)
        assert np.linalg.norm(H[0] - H[1]) > 0.01


def on_three_legs() -> Mechanism:
    """A plate on three RRR legs carries a tool by two cranks, the first of which is driven as the legs' are."""
    b = Builder("on_three_legs")
    legs = [
        ((0, 0), (0.02, 0.35), (0.35, 0.3)),
        ((1, 0.02), (1.03, 0.38), (0.66, 0.33)),
        ((0.48, 0.97), (0.75, 0.93), (0.5, 0.6)),
    ]
    b.link("base")
    for k, (A, M, B) in enumerate(legs, 1):
        b.link(f"prox_{k}", at=(*A, 0))
        b.link(f"dist_{k}", at=(*M, 0))
        if k == 1:
            b.link("plate", at=(*B, 0))
        for name, one, other, at in (
            ("a", "base", f"prox_{k}", A),
            ("m", f"prox_{k}", f"dist_{k}", M),
            ("b", f"dist_{k}", "plate", B),
        ):
            b.joint(
                f"{name}_{k}",
                "R",
                one,
                other,
                at=(*at, 0),
                axis=(0, 0, 1),
                motor=name == "a",
                loop=name == "b" and k > 1,
            )
    for name, F, G in (("first", (0.4, 0.4), (0.42, 0.72)), ("second", (0.6, 0.42), (0.68, 0.7))):
        b.link(name, at=(*F, 0))
        if name == "first":
            b.link("tool", at=(*G, 0))
        b.joint(f"{name}_f", "R", "plate", name, at=(*F, 0), axis=(0, 0, 1), motor=name == "first")
        b.joint(f"{name}_g", "R", name, "tool", at=(*G, 0), axis=(0, 0, 1), loop=name == "second")
    return b.build(platform="tool")


def test_measurements_of_one_freedom_hold_it_once():
    """Both cranks of the four-bar and the driven crank of the tool are measured: of the four-bar's two places one fits,
    the tool has two, which a search finds."""
    listed = hrsynth.modes(carried("tool"), sensor=[f"encoder:{joint}" for joint in "ace"])
    assert listed.found.complete
    assert len(listed.modes) == 2
    found = search(listed.goal, measured(listed).observation_model, list_placing_links(listed.setup.decomposition))
    assert len(found.modes) == 2
    for one in found.modes:
        assert (
            min(
                compare_poses(one.bodies["tool"], each.configuration.pose("tool"), 1.0)
                for each in listed.modes
                if each.configuration
            )
            < 1e-6
        )


@pytest.mark.slow
def test_a_tool_rests_at_both_its_places():
    found = hrsynth.equilibria(carried("tool"), sensor=[f"encoder:{joint}" for joint in "ace"], goal="x=0.35,y=0.9")
    assert sorted(rest.kind for rest in found.points if rest.error < 1e-9) == ["assembly mode", "goal"]


def two_segments() -> Mechanism:
    """A crank carries the platform by two unequal bars, both named as segments of their leg; a slide holds it too."""
    b = Builder("two_segments")
    joints = {
        "a": ("base", "crank", (0, 0)),
        "b": ("crank", "one", (0, 0.4)),
        "c": ("crank", "two", (0.15, 0.38)),
        "d": ("one", "plate", (0.3, 0.75)),
        "e": ("two", "plate", (0.47, 0.68)),
        "f": ("base", "tube", (0.9, 0.05)),
        "g": ("tube", "rod", (0.8, 0.3)),
        "h": ("rod", "plate", (0.6, 0.7)),
    }
    b.link("base")
    for name, (one, other, at) in joints.items():
        if name not in "eh":
            b.link(other, at=(*at, 0))
        b.joint(
            name,
            "P" if name == "g" else "R",
            one,
            other,
            at=(*at, 0),
            motor=name in "ag",
            loop=name in "eh",
            axis=(-0.3, 0.65, 0) if name == "g" else (0, 0, 1),
        )
    for leg, link, along in (("1", "one", (0.3, 0.35)), ("1", "two", (0.32, 0.3)), ("2", "rod", (-0.3, 0.65))):
        b.observe(leg, link, (*along, 0))
    return b.build(platform="plate")


@pytest.mark.slow
@pytest.mark.parametrize("observe", [None, "1,2", "one,two,rod"])
def test_two_segments_of_a_leg_are_both_watched(observe: str | None):
    """With each one of them there are two modes, of which the other one's direction excludes the second."""
    found = hrsynth.modes(two_segments(), observe)
    assert [each.link for each in found.setup.observed] == ["one", "two", "rod"]
    assert (found.found.complete, len(found.modes)) == (True, 1)
    assert (
        len(search(found.goal, measured(found).observation_model, list_placing_links(found.setup.decomposition)).modes)
        == 1
    )


@pytest.mark.parametrize("link", ["one", "two"])
def test_one_segment_of_two_has_other_modes(link: str):
    found = hrsynth.modes(two_segments(), f"{link},rod")
    assert (found.found.complete, len(found.modes)) == (True, 2)


def test_a_platform_that_all_conditions_hold_linearly_has_one_place():
    """A parallelogram whose crank is held: the platform only translates, and its point is told outright."""
    corners, links = (
        [(0, 0), (0.2, 0.6), (1.2, 0.6), (1.0, 0)],
        {"base": [0, 3], "a": [0, 1], "platform": [1, 2], "b": [2, 3]},
    )
    found = hrsynth.modes(linkage(corners, links, "platform", "j0"), real=True)
    assert len(found.modes) == 1
    assert "at most 1 pose by conditions that are all linear, 1 enclosed" in found.found.proof


def test_a_platform_on_the_crank_that_a_four_bar_turns_has_four_places():
    """The crank AB is held, and the platform hangs on it at H. A slide through H leads to G on the rocker: for each of
    the two places of the four-bar's coupler the platform points to G or away from it."""
    b, (A, B, C, D, H, G) = (
        Builder("on_the_crank"),
        np.array([(0.73, -0.05), (0.0, 0.0), (-2.24, -0.08), (0.26, -2.18), (-1.48, 1.42), (1.86, 1.87)]),
    )
    joints = {
        "a": ("R", "base", "crank", A),
        "b": ("R", "crank", "coupler", B),
        "c": ("R", "coupler", "rocker", C),
        "d": ("R", "rocker", "base", D),
        "e": ("R", "rocker", "tube", G),
        "f": ("P", "tube", "plate", (G + H) / 2),
        "g": ("R", "plate", "crank", H),
    }
    b.link("base")
    for name, (kind, one, other, at) in joints.items():
        if name not in "dg":
            b.link(other, at=(*at, 0))
        b.joint(
            name,
            kind,
            one,
            other,
            at=(*at, 0),
            axis=(0, 0, 1) if kind == "R" else (*(H - G), 0),
            motor=name == "a",
            loop=name in "dg",
        )
    found = hrsynth.modes(b.build(platform="plate"), real=True)
    along = (D - B) / np.linalg.norm(D - B)
    mirrored = B + 2 * (C - B) @ along * along - (C - B)  # the other place of C; G is carried by the rocker CD
    turn = complex(*(mirrored - D)) / complex(*(C - D))
    there = complex(*D) + turn * complex(*(G - D))
    towards = [complex(*G) - complex(*H), there - complex(*H)]
    units = [each / abs(each) for each in towards]
    wanted = [sense * each / units[0] for each in units for sense in (1, -1)]
    turns = [complex(X[0, 0], X[1, 0]) for mode in found.modes for X in [mode.bodies["plate"]]]
    assert (found.found.complete, found.found.complex, len(found.modes)) == (True, 4, 4)
    assert max(min(abs(each - turn) for turn in turns) for each in wanted) < 1e-8
