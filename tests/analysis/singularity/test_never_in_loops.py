"""*Never* of legs with loops, and of what else than directions is observed of a leg's link."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.linalg import null_space

from analysis.singularity.test_never import singular_place, sliding_leg, sliding_platform, text
from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.geometry.vectors import Array, normalise_vector


def joint(name: str, kind: str, parent: str, child: str, at: Array, axis: Array) -> str:
    return (
        f'<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{text(at)}"/><axis xyz="{text(axis)}"/></joint>'
    )


def loop(name: str, one: str, at: Array, two: str, there: Array, axis: Array) -> str:
    return (
        f'<loop name="{name}" type="revolute"><predecessor link="{one}"><origin xyz="{text(at)}"/></predecessor>'
        f'<successor link="{two}"><origin xyz="{text(there)}"/></successor><axis xyz="{text(axis)}"/></loop>'
    )


def parallelograms(watched: float) -> tuple[str, Array, list[Array], list[Array]]:
    """A 3-P-R-Pi-R that translates, as text; leg 1 is watched along a direction of a rod at an angle to the rod."""
    random = np.random.default_rng(0)
    rows, rails, firsts, rods, ends, home = [], [], [], [], [], np.zeros(3)
    zero = np.zeros(3)
    for k in range(3):
        b, c, a, rail = sliding_leg(random, k)
        rod, second = c - b, normalise_vector(np.cross(a, c - b))
        w = 0.06 * a + 0.01 * normalise_vector(np.cross(second, a))
        rows += [
            joint(f"g{k}", "prismatic", "base", f"s{k}", b, rail),
            joint(f"e{k}", "continuous", f"s{k}", f"h{k}", zero, a),
            joint(f"p{k}", "continuous", f"h{k}", f"r{k}", w, second),
            joint(f"o{k}", "continuous", f"h{k}", f"q{k}", -w, second),
            joint(f"n{k}", "continuous", f"r{k}", f"f{k}", rod, second),
            loop(f"m{k}", f"q{k}", rod, f"f{k}", -2 * w, second),
        ]
        if k == 0:
            home = c
            rows.append(joint("w0", "continuous", "f0", "top", -w, a))
        else:
            rows.append(loop(f"w{k}", f"f{k}", -w, "top", c - home, a))
        rails.append(rail)
        firsts.append(a)
        rods.append(rod)
        ends.append(
            normalise_vector(rod) if k else normalise_vector(normalise_vector(rod) + watched * a * np.sign(a @ rod))
        )
    seen = "".join(f'<observe leg="{k + 1}" link="r{k}" axis="{text(u)}"/>' for k, u in enumerate(ends))
    file = f'<robot name="pi"><link name="base"/>{"".join(rows)}<hrsynth><platform link="top"/>{seen}</hrsynth></robot>'
    return file, ends[0], rails, [firsts[0], rods[0], home]


def told(tmp_path: Path, file: str, *asked: object, **more: object) -> tuple[str, Singularity]:
    (tmp_path / "robot.urdf").write_text(file)
    robot = str(tmp_path / "robot.urdf")
    return robot, singularities(robot, *asked, points=60, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("watched", [0.0, 0.8])
@pytest.mark.slow
def test_a_rod_of_a_parallelogram_that_turns_about_what_is_watched_is_seen(watched: float, tmp_path: Path):
    file, u, rails, leg = parallelograms(watched)
    robot, answer = told(tmp_path, file, "1,2")
    assert answer.condition is not None
    assert answer.condition.never == (watched == 0.0)
    if watched:
        x = singular_place(u, rails, leg)
        place = ",".join(f"{name}={value:.15g}" for name, value in zip("xyz", x, strict=True))
        (there,) = check(robot, "1,2", at=place).to_dict()["configurations"]
        assert there["type2"]
        assert there["dof"] == 3


A, B, C, D = np.array([[0.0, 0, 0], [0.1, 0.28, 0], [0.37, 0.13, 0], [0.35, -0.02, 0]])
Q, E = D + [0.25, 0.5, 0], D + [0.6, 0, 0]
Z = np.array([0.0, 0, 1])


def four_bar(watched: str) -> str:
    """A point on two rails: on the slide of the first a crank AB moves a rocker DC, which carries the point."""
    zero = np.zeros(3)
    rows = [
        joint("g1", "prismatic", "base", "s1", A, np.array([1, 0.2, 0])),
        joint("a", "continuous", "s1", "crank", zero, Z),
        joint("b", "continuous", "crank", "bar", B - A, Z),
        joint("d", "continuous", "s1", "rocker", D - A, Z),
        loop("c", "bar", C - B, "rocker", C - D, Z),
        joint("q1", "continuous", "rocker", "top", Q - D, Z),
        joint("g2", "prismatic", "base", "s2", E, np.array([0.3, 1, 0])),
        joint("e", "continuous", "s2", "rod", zero, Z),
        loop("q2", "rod", Q - E, "top", zero, Z),
    ]
    return (
        f'<robot name="four"><link name="base"/>{"".join(rows)}'
        f'<transmission name="t1"><joint name="a"/></transmission>'
        f'<transmission name="t2"><joint name="e"/></transmission><hrsynth><platform link="top"/>'
        f'<observe leg="1" link="{watched}" axis="{text(normalise_vector(B - A))}"/>'
        f'<observe leg="2" link="rod" axis="{text(normalise_vector(Q - E))}"/></hrsynth></robot>'
    )


def still_crank() -> float:
    """How far the crank turns for one turn of the rocker where bar and rocker are in line."""
    r, s, t, base = (float(np.linalg.norm(v)) for v in (B - A, C - B, C - D, D - A))
    reach = s + t
    angle = np.arccos((r**2 + base**2 - reach**2) / (2 * r * base))
    along = (D - A) / base
    tip = A + r * (np.cos(angle) * along + np.sin(angle) * np.cross(Z, along))
    bend = tip + (D - tip) * s / reach
    # rates of crank, bar, rocker: both ways to C
    closing = np.column_stack([np.cross(Z, tip - A), np.cross(Z, bend - tip), -np.cross(Z, bend - D)])
    rates = null_space(closing[:2])[:, 0]
    return abs(float(rates[0] / rates[2]))


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.slow
def test_a_crank_at_rest_lets_its_rocker_move_at_a_dead_point(real: bool, tmp_path: Path):
    assert still_crank() < 1e-9
    _, answer = told(tmp_path, four_bar("crank"), real=real)
    assert answer.condition is not None
    assert not answer.condition.never


@pytest.mark.parametrize("sensor", ["inclination:r0/0.3,0.5,0.8", "position:r0@0.1,0.2,0.3"])
@pytest.mark.slow
def test_other_observations_of_a_legs_link_may_fail_at_special_poses(sensor: str, tmp_path: Path):
    """The rod of a U joint turns about the vertical where this lies in the plane of the joint's axes."""
    _, answer = told(tmp_path, sliding_platform(0.0)[0], "2", sensor=[sensor])
    assert answer.condition is not None
    assert not answer.condition.never


def test_the_inclination_of_a_legs_link_is_compared_with_the_rank():
    """Words and rank of a leg whose observation bears another name than the leg."""
    answer = singularities("prrrp_m1", "1", sensor=["inclination:dist_2/1,0,0"], points=60)
    assert answer.condition is not None
    assert answer.condition.never
    assert answer.checked is not None
    assert answer.checked.largest_angle < 1e-9


@pytest.mark.slow
def test_a_second_direction_of_a_leg_may_fail_where_the_first_holds(tmp_path: Path):
    """An arm and the rod on its U joint are watched: with the arm at rest the rod turns about the direction that is
    seen of it where that lies along the joint's first axis."""
    file, _, _, (a, _, _) = sliding_platform(0.8)
    tree = ElementTree.fromstring(file)
    slide, bend = (next(each for each in tree.iter("joint") if each.get("name") == name) for name in ("g0", "e0__1"))
    arm = 0.3 * normalise_vector(np.cross(a, Z))
    slide.set("type", "continuous")
    (foot, turn), elbow = (next(slide.iter(each)) for each in ("origin", "axis")), next(bend.iter("origin"))
    foot.set("xyz", text(np.array([float(x) for x in foot.attrib["xyz"].split()]) - arm))
    turn.set("xyz", text(a))
    elbow.set("xyz", text(arm))
    next(tree.iter("hrsynth")).append(
        ElementTree.Element("observe", leg="1", link="s0", axis=text(normalise_vector(arm)))
    )
    _, answer = told(tmp_path, ElementTree.tostring(tree, "unicode"), "s0,r0")
    assert answer.condition is not None
    assert not answer.condition.never
