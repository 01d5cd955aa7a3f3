"""*Never* stands on axes that stay where they are; what is merely not found is called that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from analysis.singularity.found import found
from hrsynth.analysis.aspects.path import path
from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.condition_check import compute_smallest_value
from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.description import load
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array, freeze_array, invert_pose, normalise_vector
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from hrsynth.present.text.poses import format_singularity
from oracle import Oracle
from strategies import deltas


def mixed(seed: int, off: float | None) -> Mechanism:
    """A translating robot in a random base: leg 1 on a rail, the others cranks; ``off`` is the cosine between the rail
    and the axis of crank 2 (None: random)."""
    robot = deltas(["P", "R", "R"], ["2-SS"] * 3, np.random.default_rng(seed), True)
    rail, crank = robot.joints["motor_joint_1"], robot.joints["motor_joint_2"]
    if off is None:
        return robot
    across = np.cross(crank.axes[0], rail.axes[0])
    p = off * crank.axes[0] + np.sqrt(1 - off**2) * across / np.linalg.norm(across)
    return replace(robot, joints={**robot.joints, rail.name: replace(rail, axes=(freeze_array(p),))})


def told(robot: Mechanism) -> Singularity:
    return singularities(robot, ["1", "2"], points=60)


def tangents(answer: Singularity) -> tuple[Array, Array, Array]:
    """The rail's and the crank's axis, and the tangents (n, 3) of the crank's elbow on a walk, by link poses."""
    robot, start = answer.setup.mechanism, answer.setup.all_samples.start
    p, a = (robot.joints[f"motor_joint_{i}"].axes[0] for i in (1, 2))
    elbow, centre = robot.joints["elbow_2a"].point, robot.joints["motor_joint_2"].point
    arm = "arm_2"
    back = invert_pose(start.pose(arm)) @ np.append(elbow, 1.0)
    places = [(at.pose(arm) @ back)[:3] for at in walk_randomly(start, 80, seed=3)]
    tau = np.cross(a, np.array(places) - centre)
    return p, a, tau / np.linalg.norm(tau, axis=1, keepdims=True)


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("off", [None, 0.02])
def test_a_rail_that_is_not_normal_to_a_cranks_axis_is_never_parallel_to_its_tangent(seed: int, off: float | None):
    answer = told(mixed(seed, off))
    assert answer.words.startswith("never: ")
    assert answer.condition is not None
    assert answer.condition.never
    p, a, tau = tangents(answer)
    assert np.linalg.norm(np.cross(tau, p), axis=1).min() >= abs(p @ a) - 1e-9
    sizes = [
        compute_smallest_value(at, answer.observation_model)
        for at in walk_randomly(answer.setup.all_samples.start, 40, seed=5)
    ]
    assert min(sizes) > 0


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_rail_normal_to_the_axis_can_be_parallel(seed: int):
    answer = told(mixed(seed, 0.0))
    assert answer.condition is not None
    assert not answer.condition.never
    assert not answer.words.startswith("never")


@pytest.mark.slow
def test_near_misses_are_not_called_never():
    """A cosine of 1e-9 is rounding, one of 1e-3 is geometry."""
    answers = [told(mixed(0, off)).condition for off in (1e-9, 1e-3)]
    assert [each is not None and each.never for each in answers] == [False, True]


@pytest.mark.some(1)
@pytest.mark.parametrize(("robot", "legs"), [("orthoglide", "1,2"), ("quattro_rigid", "1,3")])
def test_robots_in_space_have_no_plane_of_motion(robot: str, legs: str):
    answer = found(robot, legs)
    assert answer.condition is not None
    assert answer.condition.where["n"] == "direction normal to the lines along which the tips move"


def test_planar_robots_have_one():
    answer = found("3rrr_m1")
    assert answer.condition is not None
    assert answer.condition.where["n"] == "normal of the plane of motion"


def test_what_is_not_found_is_not_said_not_to_be():
    answer = found("quattro_rigid", "1,3")
    assert answer.checked is not None
    text = format_singularity(replace(answer, examples=()))
    assert f"none found by {answer.checked.searches} searches, which does not exclude any" in text
    assert "no pose" not in text


def sliding_leg(random: np.random.Generator, k: int) -> tuple[Array, Array, Array, Array]:
    """Of the k-th of three legs about the vertical: foot and end of its rod, first axis at the foot, rail."""
    t = 2 * np.pi * k / 3
    b = np.array([0.5 * np.cos(t), 0.5 * np.sin(t), -0.1]) + random.normal(size=3) * 0.03
    c = np.array([0.08 * np.cos(t), 0.08 * np.sin(t), -0.4]) + random.normal(size=3) * 0.02
    a = normalise_vector(np.array([-np.sin(t), np.cos(t), 0.0]) + random.normal(size=3) * 0.35)
    return b, c, a, normalise_vector(np.array([np.cos(t), np.sin(t), -0.3]) + random.normal(size=3) * 0.2)


def sliding_platform(watched: float) -> tuple[str, Array, list[Array], list[Array]]:
    """A 3-PUU that translates, as text; leg 1 is watched along a direction of its rod at an angle to the rod, normal to
    the U joint's second axis. With it that direction, and rails, first axes and rods of the legs."""
    random, rows, ends = np.random.default_rng(0), [], []
    rails, firsts, rods = [], [], []
    for k in range(3):
        b, c, a, rail = sliding_leg(random, k)
        rod, second = c - b, normalise_vector(np.cross(a, c - b))
        for kind, name, parent, child, at, axis in (
            ("prismatic", "g", "base", "s", b, rail),
            ("continuous", "e{}__1", "s", "h", 0 * b, a),
            ("continuous", "e{}__2", "h", "r", 0 * b, second),
        ):
            rows.append(
                f'<joint name="{name.format(k) if "{" in name else name + str(k)}" type="{kind}">'
                f'<parent link="{parent if parent == "base" else parent + str(k)}"/><child link="{child}{k}"/>'
                f'<origin xyz="{text(at)}"/><axis xyz="{text(axis)}"/></joint>'
            )
        rows += [f'<link name="{each}{k}"/>' for each in "shr"]
        rows.append(f'<transmission name="m{k}"><joint name="g{k}"/></transmission>')
        if k == 0:
            home = c
            rows.append(
                f'<link name="w"/><joint name="w__1" type="continuous"><parent link="r0"/><child link="w"/>'
                f'<origin xyz="{text(rod)}"/><axis xyz="{text(second)}"/></joint><link name="top"/>'
                f'<joint name="w__2" type="continuous"><parent link="w"/><child link="top"/>'
                f'<axis xyz="{text(a)}"/></joint>'
            )
        else:
            rows.append(
                f'<loop name="w{k}" type="universal"><predecessor link="r{k}"><origin xyz="{text(rod)}"/>'
                f'</predecessor><successor link="top"><origin xyz="{text(c - home)}"/></successor>'
                f'<axis xyz="{text(second)}"/><axis2 xyz="{text(a)}"/></loop>'
            )
        rails.append(rail)
        firsts.append(a)
        rods.append(rod)
        ends.append(
            normalise_vector(rod) if k else normalise_vector(normalise_vector(rod) + watched * a * np.sign(a @ rod))
        )
    seen = "".join(f'<observe leg="{k + 1}" link="r{k}" axis="{text(u)}"/>' for k, u in enumerate(ends))
    told = f'<hrsynth><platform link="top"/>{seen}</hrsynth>'
    file = f'<robot name="puu"><link name="base"/>{"".join(rows)}{told}</robot>'
    return file, ends[0], rails, [firsts[0], rods[0], home]


def text(numbers: Array) -> str:
    return " ".join(f"{x:.17g}" for x in numbers)


def singular_place(u: Array, rails: list[Array], leg: list[Array]) -> Array:
    """Where (3,) the platform is when u lies along the first axis of leg 1's U joint, and its rod
    can then turn its end along the rail of leg 2 but for a motion of its own slide."""
    a, rod, home = leg
    b = normalise_vector(np.cross(a, rod))
    goal = a * np.sign(u @ a)
    folded = Rotation.from_rotvec(b * np.arctan2(np.cross(u, goal) @ b, u @ goal)).apply(rod)
    n = np.cross(rails[0], rails[1])

    def across(angle: float) -> float:
        return float(np.cross(a, Rotation.from_rotvec(a * angle).apply(folded)) @ n)

    angle = brentq(across, -0.8, 0.2, xtol=1e-15)
    return np.asarray(home + Rotation.from_rotvec(a * angle).apply(folded) - rod - 0.2 * rails[0])


@pytest.mark.some(1)
@pytest.mark.parametrize("watched", [0.0, 0.8])
def test_a_u_joint_that_turns_about_what_is_watched_is_seen(watched: float, tmp_path: Path):
    """Leg 1 then lets its end turn about that direction besides; where the rod itself is watched this moves nothing."""
    file, u, rails, leg = sliding_platform(watched)
    (tmp_path / "puu.urdf").write_text(file)
    robot = str(tmp_path / "puu.urdf")
    answer = singularities(robot, "1,2", points=60)
    assert answer.condition is not None
    assert answer.condition.never == (watched == 0.0)
    if not watched:
        return
    x = singular_place(u, rails, leg)
    place = ",".join(f"{name}={value:.15g}" for name, value in zip("xyz", x, strict=True))
    (there,) = check(robot, "1,2", at=place).to_dict()["configurations"]
    assert there["type2"]
    assert there["dof"] == 3
    near = ",".join(f"{name}={value:.15g}" for name, value in zip("xyz", x + [0, 0.03, 0], strict=True))
    assert not path(robot, "1,2", start=near, goal=place).certified


@pytest.mark.parametrize(("name", "legs"), [("linear_delta", "1, 2, 3"), ("3puu", ""), ("prrrp_m1", "")])
def test_legs_that_may_fold_are_named_where_never_is_said(name: str, legs: str):
    told = " ".join(format_singularity(found(name, None)).split())
    assert "never" in told
    flat = f"a loop inside a leg ({legs}) is flat, and those beyond, at which it has another assembly mode"
    assert (flat in told) == bool(legs)


def couples(at: Array) -> Array:
    """Of the 3-UPU, shifted from its zero configuration: the moments (3, 3), one a leg, that its U joints hold."""
    robot, held = load("3upu"), []
    for k in "123":
        foot, tip = robot.joints[f"shoulder_{k}"], robot.joints[f"wrist_{k}"].point + at
        held.append(normalise_vector(np.cross(foot.axes[0], np.cross(foot.axes[0], tip - foot.point))))
    return np.array(held)


def test_never_does_not_speak_of_constraint_singularities() -> None:
    """Where the three moments are dependent the 3-UPU can turn about the seen point, which rests."""
    answer = singularities("3upu", sensor=["position:platform@0,0,0"], points=60)
    assert answer.condition is not None
    assert answer.condition.never
    assert any("constraint singularities" in each for each in answer.unexamined)
    assert "constraint singularities" in format_singularity(answer)
    draws = 0.5 * np.random.default_rng(0).normal(size=(500, 3))
    home, here = np.linalg.det(couples(np.zeros(3))), sorted(draws, key=lambda x: float(np.linalg.norm(x)))
    ray = next(x for x in here if np.linalg.det(couples(x)) * home < 0)
    place = load("3upu").links["platform"].pose[:3, 3] + ray * brentq(lambda t: np.linalg.det(couples(t * ray)), 0, 1)
    at = ",".join(f"{name}={value:.15g}" for name, value in zip("xyz", place, strict=True))
    (there,) = check("3upu", sensor=["position:platform@0,0,0"], at=at).to_dict()["configurations"]
    assert there["dof"] == 4
    assert there["rank"] == 3


def test_constraint_singularities_are_not_named_where_legs_cannot_turn_the_platform() -> None:
    """A 3-PRRR: each leg turns the platform about its own direction alone, and these are different."""
    made = Builder("cartesian")
    for link in ("base", "platform", *(f"{part}{k}" for k in range(3) for part in "sud")):
        made.link(link)
    random = np.random.default_rng(1)
    for k in range(3):
        a, places = normalise_vector(np.eye(3)[k] + 0.2 * random.normal(size=3)), random.normal(size=(4, 3))
        bodies = ("base", f"s{k}", f"u{k}", f"d{k}", "platform")
        for n, kind in enumerate("PRRR"):
            made.joint(
                f"{kind}{n}_{k}", kind, bodies[n], bodies[n + 1], places[n], axis=a, motor=n == 0, loop=n == 3 and k > 0
            )
    answer = singularities(made.build("platform"), sensor=["position:platform@0,0,0"], points=60)
    assert answer.condition is not None
    assert answer.condition.never
    assert answer.unexamined == ()


@pytest.mark.parametrize("up", [0.0, 0.5])
def test_what_is_fixed_in_a_platform_that_translates_is_constant(up: float) -> None:
    """Depth and a line of the platform: a translation keeps both where it is along the line and in a plane z = const.,
    so there is none at all if the line is not in such a plane, and one everywhere else."""
    axis = normalise_vector(np.array([1.0, 0.3, up]))
    seen = ["depth:platform@0.1,0,0", f"line:platform@0.1,0.1,0/{text(axis).replace(' ', ',')}"]
    answer = singularities(build_mechanism(parse("3(Pk*-Ra-Ra-Ra)"), 0), sensor=seen, points=30)
    z = answer.setup.mechanism.links["platform"].pose[:3, :3] @ axis @ np.array([0.0, 0.0, 1.0])
    assert (abs(z) > 0.1) == (up > 0.0)
    assert answer.always == (up == 0.0)
    assert (answer.condition is not None and answer.condition.never) == (up > 0.0)
    if up:
        sizes = [
            compute_smallest_value(at, answer.observation_model)
            for at in walk_randomly(answer.setup.all_samples.start, 30, seed=5)
        ]
        assert min(sizes) > 1e-3


def test_a_platform_that_rests_is_refused_in_a_line() -> None:
    """A triangle of three bars with a four-bar beside it: segments move, the platform does not (by the oracle)."""
    made = Builder("truss")
    for link in ("base", "a", "platform", "b", "c", "d"):
        made.link(link)
    for name, one, other, at in (
        ("1", "base", "a", (0, 0, 0)),
        ("2", "a", "platform", (0.3, 1, 0)),
        ("3", "platform", "base", (1, 0, 0)),
        ("4", "a", "b", (-0.5, 1.2, 0)),
        ("5", "b", "c", (-1.3, 1.4, 0)),
        ("6", "c", "d", (-1.6, 0.5, 0)),
        ("7", "d", "base", (-1.1, 0.1, 0)),
    ):
        made.joint(name, "R", one, other, at, axis=(0, 0, 1), loop=name in "37")
    made.observe("1", "b", (1, 0, 0))
    robot = made.build("platform")
    oracle = Oracle(robot)
    basis = oracle.relation(np.array([each.pose for each in robot.links.values()]), list(robot.observations))
    assert basis.shape[1] == 1  # b turns
    assert np.abs(basis[:6]).max() < 1e-9
    with pytest.raises(BadRequest, match="cannot move"):
        singularities(robot, points=20)
