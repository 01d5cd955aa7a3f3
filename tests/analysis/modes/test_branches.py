"""Held legs with several branches: no mode of a robot lies outside a list that is said to be complete."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.modes.drives import closings, driven
from analysis.modes.pods import displacements, pods
from hrsynth.analysis.loci.loci_from_joints import derive_reaches
from hrsynth.analysis.loci.locked_chain import Chain, ChainBody, LocusDerivationFailure
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.geometry.loci import Line
from hrsynth.geometry.vectors import Array, cross, find_perpendicular, normalise_vector
from hrsynth.mechanism.builder import Builder
from strategies import ring

SAME = 1e-6
"""Distance (m, pure numbers) at which two poses are one."""

KINDS = {
    ("RRPS", "RRPS", "RRPS"): 64,
    ("PRRS", "PRRS", "PRRS"): 64,
    ("RPRS", "RPRS", "RUS"): 48,
    ("UPS", "UPS", "UPS"): 64,
    ("RRPS", "RUS", "PUS"): 24,
    ("RRS", "RRS", "RRS"): 1,
}
"""Words of legs, and how many complex modes there are with all of them watched."""


def check(words: tuple[str, ...], seed: int, complex_count: int | None, starts: int = 100) -> AssemblyModes:
    """Every pose that is found by brute force is listed, at most as many times as the list is long."""
    robot, legs = pods(words, seed)
    found = modes(robot, ",".join(str(k) for k in range(1, len(words) + 1)))
    assert found.found.complete
    assert complex_count in (None, found.found.complex)
    met = {nearest(found, D) for D in displacements(legs, starts, seed)}
    assert met
    assert None not in met
    assert found.modes[0].goal
    assert not any(found.modes[k].unclosed_legs for k in met if k is not None)
    return found


def nearest(found: AssemblyModes, D: Array) -> int | None:
    """The place of the mode to which the platform is displaced, or None."""
    X = D @ found.setup.mechanism.links["platform"].pose
    apart = [float(np.abs(X - mode.bodies["platform"]).max()) for mode in found.modes if mode.bodies is not None]
    return int(np.argmin(apart)) if min(apart) < SAME else None


@pytest.mark.some(1, 2)
@pytest.mark.parametrize("words", KINDS, ids="+".join)
def test_all_branches_of_random_legs_are_listed(words: tuple[str, ...]):
    """An offset U holds a direction in two ways, a skew pair RR in two; each way has its own line, circle or point."""
    check(words, 0, KINDS[words])


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("words", KINDS, ids="+".join)
def test_all_branches_of_many_random_legs_are_listed(words: tuple[str, ...]):
    for seed in range(1, 9):
        check(words, seed, KINDS[words], 200)


def test_a_word_of_the_catalog_has_all_its_modes():
    """3-RRPS with oblique axes: eight choices of branches, of degree 8 each."""
    found = modes(build_mechanism(parse("3(Ra*-Rb-Pl*-S)")))
    assert (found.found.complex, len(found.modes), found.found.complete) == (64, 8, True)
    assert all(mode.reachable for mode in found.modes)


@pytest.mark.slow
def test_a_hexapod_with_offset_joints_has_eight_branches():
    robot, legs = pods(["RRPS"] * 6, 1)
    found = modes(robot, "1,2,3")
    assert found.found.complete
    assert found.found.complex == 64
    assert len(found.modes) == len(set(map(str, found.modes))) > 8
    met = {nearest(found, D) for D in displacements(legs[:3], 100)}
    assert set() < met <= set(range(len(found.modes)))


def test_legs_that_rest_leave_the_pose_itself():
    """3-RRS with skew axes: with the directions held no tip moves."""
    found = check(("RRS", "RRS", "RRS"), 3, 1)
    assert [mode.goal for mode in found.modes] == [True]


@pytest.mark.some(1)
@pytest.mark.parametrize(("drive", "seed"), [("four-bar", 0), ("strut", 1), ("ball rod", 2)])
def test_a_held_drive_leaves_two_angles(drive: str, seed: int):
    check_driven(drive, seed, 12)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("drive", ["four-bar", "strut", "ball rod"])
def test_many_held_drives_leave_two_angles(drive: str):
    for seed in range(10, 20):
        check_driven(drive, seed, 60)


def check_driven(drive: str, seed: int, starts: int) -> None:
    """3-RRR, one leg driven through a loop, its motors held: two branches of degree 6, and no pose outside the list."""
    robot = driven(drive, seed)
    found = modes(robot, real=True)
    assert (found.found.complex, found.found.complete) == (12, True)
    met = [
        min(float(np.abs(X - mode.bodies["platform"]).max()) for mode in found.modes if mode.bodies is not None)
        for X in closings(robot, starts, seed)
    ]
    assert met
    assert max(met) < SAME


def test_a_list_is_not_called_all_where_a_leg_is_not_understood():
    """A coupler on balls that is watched: its leg keeps the curve that its moves show, and the proof says why. Natural
    coordinates need no such curve."""
    robot = driven("ball rod", 2, watched="coupler")
    found = modes(robot)
    assert found.found.complete
    assert found.found.bound == "combinations"
    few = modes(robot, time_limit=1.0)
    assert not few.found.complete
    assert few.found.bound == "none"
    assert "coupler" in few.found.proof


def offset_u(offset: float) -> Chain:
    """Two oblique axes that miss each other by an offset, and a slide along the watched direction."""
    a, b, d = normalise_vector([0, 0.3, 1]), normalise_vector([1, 0.2, -0.1]), normalise_vector([0.3, 0.5, 0.8])
    off = offset * normalise_vector(np.cross(a, b))
    bodies = (
        ChainBody(None, np.zeros(3)),
        ChainBody(a, np.zeros(3), off),
        ChainBody(b, off, 0.9 * d, (d,), observed=(d,)),
    )
    return Chain(bodies, False, 1.0)


def test_an_offset_parts_the_two_lines_of_a_u():
    """None: one line; a millimetre: two, which the other solution of the direction parts; between: no answer."""
    assert len(derive_reaches(offset_u(0.0))[0]) == 1
    for offset in (1e-3, 0.1):
        (one, gain), (other, more) = derive_reaches(offset_u(offset))[0]
        assert isinstance(one, Line)
        assert isinstance(other, Line)
        assert gain == 1.0 < more
        assert 1e-3 * offset < np.linalg.norm(one.miss(other.centre)) < 3 * offset
    with pytest.raises(LocusDerivationFailure, match="differ by only"):
        derive_reaches(offset_u(1e-8))


@pytest.mark.slow
def test_a_u_joint_that_carries_the_platform_holds_it_turned_by_half_a_turn_too():
    """Direction and length of a leg U-P are measured: about its direction, normal to the U's second axis, the platform
    can be turned by half a turn."""
    rng, b = np.random.default_rng(1), Builder("half_a_turn")
    u = normalise_vector(np.array([0.1, 0.2, 1.5]))
    first = normalise_vector(cross(u, rng.normal(size=3)))
    b.link("base")
    b.link("tube")
    b.link("plate", at=u)
    b.joint("u", "U", "base", "tube", axis=first, axis2=cross(u, first))
    b.joint("p", "P", "tube", "plate", at=u, axis=u)
    for k, A in enumerate(ring(rng, 3, 1.2)):
        B = 1.5 * u + 0.4 * A
        along = normalise_vector(B - A)
        b.link(f"cylinder_{k}", at=A)
        b.link(f"rod_{k}", at=B)
        b.joint(
            f"u_{k}", "U", "base", f"cylinder_{k}", at=A, axis=(e := find_perpendicular(along)), axis2=cross(along, e)
        )
        b.joint(f"p_{k}", "P", f"cylinder_{k}", f"rod_{k}", at=(A + B) / 2, axis=along, motor=True)
        b.joint(f"s_{k}", "S", f"rod_{k}", "plate", at=B, loop=True)
    b.observe("1", "tube", u)
    found = modes(b.build(platform="plate"), "1", sensor=["encoder:p"])
    turned = [mode.bodies["plate"][:3, :3] for mode in found.modes]
    assert [mode.assembly for mode in found.modes] == ["yes", "yes"]
    assert min(np.abs(R - (2 * np.outer(u, u) - np.eye(3))).max() for R in turned) < 1e-9
