"""Joints that act as one become one; what only looks like it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import strategies
from hrsynth.description import list_robots, load
from hrsynth.errors import BadMechanism
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.normal import reduce_to_normal_form


def chain(*joints: tuple[str, tuple[float, ...], tuple[float, ...]], motors: tuple[int, ...] = ()) -> Mechanism:
    """base – joints (type, centre, axis) – tip, and a second way from base to tip so that nothing else merges."""
    b = Builder("chain")
    b.link("base")
    names = ["base", *[f"link_{i}" for i in range(1, len(joints))], "tip"]
    for i, (kind, centre, axis) in enumerate(joints):
        b.link(names[i + 1], at=centre)
        b.joint(f"joint_{i}", kind, names[i], names[i + 1], at=centre, axis=axis or None, motor=i in motors)
    b.joint("loop", "S", "base", "tip", at=(1, 1, 1), loop=True)
    return b.build("tip")


def types(mechanism: Mechanism) -> str:
    """The joint types that are left, the loop's S apart."""
    joints = reduce_to_normal_form(mechanism).mechanism.joints
    return "".join(joint.type.value for name, joint in joints.items() if name != "loop")


X, Y, Z, AT = (1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0.0, 0, 0)


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        ([("R", AT, X), ("R", AT, Y)], "U"),
        ([("R", AT, X), ("R", AT, (1, 1, 0))], "RR"),
        ([("R", AT, X), ("R", (0, 0, 0.1), Y)], "RR"),
        ([("R", AT, X), ("R", (0.5, 0, 0), X)], "R"),
        ([("R", AT, X), ("R", (0, 0.5, 0), X)], "RR"),
        ([("R", AT, X), ("R", AT, Y), ("R", AT, Z)], "S"),
        ([("R", AT, X), ("R", AT, (1, 1, 0)), ("R", AT, (1, 1, 1))], "S"),
        ([("R", AT, X), ("R", AT, Y), ("R", AT, (1, 1, 0))], "RU"),
        ([("R", AT, X), ("R", AT, Y), ("R", (0.2, 0.1, 0), Z)], "UR"),
        ([("P", AT, X), ("P", AT, X)], "P"),
        ([("P", AT, X), ("P", AT, Y)], "PP"),
        ([("R", AT, X), ("F", (0, 1, 0), ()), ("R", AT, Y)], "U"),
    ],
)
def test_merging_goes_by_geometry(joints: list, expected: str) -> None:
    found = types(chain(*joints))
    assert sorted(found) == sorted(expected)


@pytest.mark.parametrize(
    ("joints", "moved"),
    [
        ([("R", AT, X), ("R", AT, Y)], 0.0),
        ([("R", AT, X), ("R", (0, 0, 1e-9), Y)], 1e-9),
        ([("R", AT, X), ("R", (0.5, 3e-9, 0), X)], 3e-9),
        ([("R", AT, X), ("R", AT, Y), ("R", (0, 0, 2e-9), Z)], 0.0),
        ([("R", AT, X), ("R", AT, Y), ("R", (2e-9, 0, 0), Z)], 2e-9),
    ],
)
def test_what_merging_moves_is_told(joints: list, moved: float) -> None:
    """Of a chain about the origin: the sum of how far each axis is from the joint that takes its place."""
    found = reduce_to_normal_form(chain(*joints)).moved
    assert moved - 1e-15 <= found <= 2 * moved + 1e-15


def test_a_driven_and_a_passive_joint_stay_two() -> None:
    assert types(chain(("R", AT, X), ("R", AT, Y), motors=(0,))) == "RR"
    assert types(chain(("R", AT, X), ("R", AT, Y), motors=(0, 1))) == "U"


def test_observed_links_cameras_and_platforms_never_disappear() -> None:
    from dataclasses import replace

    mechanism = chain(("R", AT, X), ("R", AT, Y))
    assert "link_1" not in reduce_to_normal_form(mechanism).mechanism.links
    for kept in (replace(mechanism, camera="link_1"), replace(mechanism, platform="link_1")):
        assert "link_1" in reduce_to_normal_form(kept).mechanism.links


def test_a_platform_fixed_to_the_base_is_refused() -> None:
    b = Builder("stiff")
    b.link("base")
    b.link("plate", at=(0, 0, 1))
    b.joint("weld", "F", "base", "plate")
    with pytest.raises(BadMechanism, match="fixed to the base"):
        reduce_to_normal_form(b.build("plate"))


@pytest.mark.some(16)
@pytest.mark.parametrize("name", list_robots())
def test_what_is_split_comes_together_again(name: str) -> None:
    robot = reduce_to_normal_form(load(name)).mechanism
    parts = reduce_to_normal_form(strategies.split(load(name), np.random.default_rng(0))).mechanism
    assert sorted(j.type.value for j in parts.joints.values()) == sorted(j.type.value for j in robot.joints.values())
    assert len(parts.links) == len(robot.links)


@pytest.mark.parametrize("name", list_robots())
def test_a_normal_form_is_its_own(name: str) -> None:
    once = reduce_to_normal_form(load(name)).mechanism
    assert reduce_to_normal_form(once).mechanism.differences(once) == []


def test_couplings_mean_joints_and_go_with_them() -> None:
    """Whatever other joint carries the same link; only what a tree can count is coupled."""
    b = Builder("screw")
    for name in ("base", "crank", "nut"):
        b.link(name)
    b.joint("turn", "R", "base", "crank", axis=Z)
    b.joint("slide", "P", "base", "nut", axis=Z)
    b.joint("other", "R", "crank", "nut", axis=X)
    b.coupling("thread", "turn", "slide", 0.02)
    screw = b.build("nut")
    assert screw.coupled_joints == {"turn", "slide"}
    assert screw.changed(remove_joints=["other"]).couplings == screw.couplings
    assert screw.changed(remove_joints=["slide"]).couplings == ()
    for changed in (replace(screw.joints["slide"], in_tree=False), replace(screw.joints["slide"], type="C")):
        with pytest.raises(BadMechanism, match="slide"):
            screw.changed(joints=[changed])
