"""Generated code against the package's kinematics, closed forms and differences; what hand-written code gets wrong."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import warnings
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import hrsynth
from codegen.robots import (
    BARS,
    MAIN,
    OK,
    OUTSIDE,
    SINGULAR,
    answered,
    box_of,
    compiled,
    eigen,
    four_bar,
    geared_five_bar,
    inside,
    made,
    module_of,
    own_pose,
    start_carried_four_bar,
)
from hrsynth.analysis.branch.answer import Toggle
from hrsynth.codegen.branch_cells import TubedBranch
from hrsynth.codegen.export import ExportedCode, export
from hrsynth.codegen.languages import make_namespace
from hrsynth.errors import BadRequest, NoProvedCell
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Limits
from strategies import planar, random_rotation, transformed


@cache
def exported(robot: Mechanism, half: float, lang: str = "python") -> ExportedCode:
    return export(robot, lang, box_of(robot, half), jumps=True)


def assert_agrees(robot: Mechanism, found: ExportedCode, made: ModuleType, count: int) -> None:
    """The pose is that of Pinocchio's model, closed to the last digits; derivatives are those of differences; a pose
    leads back to its motors."""
    q = inside(found, count)
    status, _, R, p, rates = made.jacobians(q)
    assert np.all(status == made.OK)
    model = PinocchioModel(robot)
    for i in range(count):
        X = own_pose(model, dict(zip(found.proof.motors, q[i], strict=True)))
        np.testing.assert_allclose(R[i], X[:3, :3], atol=1e-12)
        np.testing.assert_allclose(p[i], X[:3, 3], atol=1e-12 * max(1.0, robot.length))
    h = 1e-6
    edge = np.all((q > made.LOWER + h) & (q < made.UPPER - h), axis=1)
    for k in range(made.MOTORS):
        step = h * np.eye(made.MOTORS)[k]
        sides = [made.forward(q + sign * step) for sign in (1, -1)]
        good = edge & (sides[0][0] == made.OK) & (sides[1][0] == made.OK)
        assert good.sum() > count // 2
        np.testing.assert_allclose(
            rates["passive"][good, :, k], ((sides[0][1] - sides[1][1]) / (2 * h))[good], atol=1e-6
        )
        np.testing.assert_allclose(
            rates["platform"][good, :3, k], ((sides[0][3] - sides[1][3]) / (2 * h))[good], atol=1e-6
        )
        turn = ((sides[0][2] - sides[1][2]) / (2 * h)) @ R.transpose(0, 2, 1)
        np.testing.assert_allclose(rates["platform"][good, 3:, k], turn[good][:, [2, 0, 1], [1, 2, 0]], atol=1e-6)
    np.testing.assert_allclose(
        rates["motors"] @ rates["platform"],
        np.broadcast_to(np.eye(made.MOTORS), (count, made.MOTORS, made.MOTORS)),
        atol=1e-6,
    )
    led, back = made.inverse(R, p, 0.9 * q)
    assert np.all(led == made.OK)
    again = made.forward(back)
    assert np.abs(again[3] - p).max() < 1e-11
    assert np.abs(again[2] - R).max() < 1e-11


def coupler(q: Array, start: float = 0.3) -> tuple[Array, Array]:
    """Of the four-bar, in closed form: the tip and the coupler's angle, on the branch of the zero configuration."""
    ground, crank, length, rocker = BARS
    A = crank * np.stack([np.cos(start + q), np.sin(start + q)], axis=-1)
    gap = np.array([ground, 0.0]) - A
    d = np.linalg.norm(gap, axis=-1)
    along = (length**2 - rocker**2 + d**2) / (2 * d)
    across = np.sqrt(length**2 - along**2)
    tip = A + (along / d)[:, None] * gap + (across / d)[:, None] * np.stack([-gap[:, 1], gap[:, 0]], axis=-1)
    return tip, np.arctan2(*(tip - A).T[::-1])


def test_a_four_bar_part_of_a_turn() -> None:
    robot = four_bar()
    found = exported(robot, 0.4)
    made = module_of(found.code)
    assert_agrees(robot, found, made, 12)
    # outside nothing is computed, and no number at all is no place inside
    status, x, R, p = made.forward([[0.5], [-0.4001], [np.nan], [np.inf], [0.0]])
    assert status.tolist() == [made.OUTSIDE] * 4 + [made.OK]
    assert not x[:4].any()
    assert not R[:4].any()
    assert not p[:4].any()


def sliding() -> Mechanism:
    """A platform on two chains of slides, which never turns."""
    b = Builder("slides")
    for name in ("base", "one", "plate", "two", "other"):
        b.link(name)
    b.joint("x", "P", "base", "one", (0, 0, 0), axis=(1, 0, 0), motor=True)
    b.joint("y", "P", "one", "plate", (0, 0.5, 0), axis=(0, 1, 0))
    b.joint("z", "P", "base", "two", (1, 0, 0), axis=(0.1, 1, 0), motor=True)
    b.joint("u", "P", "two", "other", (1, 0.5, 0), axis=(1, 0.2, 0))
    b.joint("end", "R", "plate", "other", (0.7, 0.5, 0), axis=(0, 0, 1), loop=True)
    return b.build(platform="plate")


@pytest.mark.slow
def test_a_robot_of_slides_alone_compiles(tmp_path: Path) -> None:
    """Nothing turns, so that some of its rates are zero; its place by linear equations."""
    robot = sliding()
    code = export(robot, "c++", {"x": (-0.3, 0.3), "z": (-0.3, 0.3)}, jumps=True).code
    q = np.array([[0.1, -0.2], [-0.3, 0.3]])
    rows = answered(compiled(tmp_path, code, MAIN, "-DNAME=slides"), q)
    assert np.all(rows[:, :2] == 0)
    along, across = np.array([1, 0.2]) / np.hypot(1, 0.2), np.array([0.1, 1]) / np.hypot(0.1, 1)
    for (x, z), row in zip(q, rows, strict=True):
        # x e_x + y e_y = z across + u along
        y, _ = np.linalg.solve(np.column_stack([[0, 1], -along]), z * across - [x, 0])
        assert np.any(np.abs(row[2:] - y) < 1e-14)


def test_a_motor_in_no_loop_keeps_to_what_is_asked() -> None:
    """What lies beyond its interval is refused, as it is for the motors of loops; so is what is beyond its limits."""
    b = start_carried_four_bar("carried")
    b.link("hand")
    b.joint("wrist", "R", "rocker", "hand", (1.1, 0.3, 0), axis=(0, 0, 1), motor=True)
    robot = b.build(platform="hand")
    robot = replace(robot, joints=robot.joints | {"wrist": replace(robot.joints["wrist"], limits=Limits(-0.5, 2.0))})
    found = export(robot, "python", {"rail": (-0.3, 0.2), "motor": (-0.1, 0.1), "wrist": (-1, 1)})
    assert found.free == (("rail", -0.3, 0.2), ("wrist", -0.5, 1.0))
    assert re.search(r"in no loop +rail -0.3 to 0.2\n +wrist -0.5 to 1\n", hrsynth.text(found))
    made = module_of(found.code)
    rows = [[0.2, 0, 1], [-0.3, 0.1, -0.5], [0.2001, 0, 0], [-0.31, 0, 0], [0, 0, 1.01], [0, 0, -0.51]]
    assert made.forward(rows)[0].tolist() == [made.OK] * 2 + [made.OUTSIDE] * 4


def test_a_motor_is_given_one_interval() -> None:
    with pytest.raises(BadRequest, match="motor motor is given twice"):
        hrsynth.branch(four_bar(), "motor=-0.1:0.1,motor=-0.2:0.2")


@pytest.mark.parametrize("size", [1000.0, 1e6])
def test_a_robot_in_large_numbers_is_answered_as_the_same_in_small_ones(size: float, tmp_path: Path) -> None:
    """Millimetres that a file takes for metres: as many cells are proved, and poses have their motors."""
    small, large = (exported(four_bar(bars=tuple(np.array(BARS) * each)), 0.4) for each in (1.0, size))
    assert large.cells == small.cells
    q = np.linspace(-0.399, 0.399, 41)
    tip, angle = coupler(q)
    motor = np.linspace(0.3, 0.3, 41) + q  # the crank's end is the origin of the coupler's frame
    X = np.stack([np.cos(motor) * BARS[1], np.sin(motor) * BARS[1], 0 * q], axis=-1)
    turn = angle - coupler(np.zeros(1))[1]
    R = np.zeros((41, 3, 3))
    R[:, 0, 0], R[:, 1, 1], R[:, 1, 0], R[:, 0, 1], R[:, 2, 2] = (
        np.cos(turn),
        np.cos(turn),
        np.sin(turn),
        -np.sin(turn),
        1.0,
    )
    np.testing.assert_allclose(np.linalg.norm(tip - X[:, :2], axis=1), BARS[2])
    made = module_of(large.code)
    assert np.all(made.forward(q[:, None])[0] == made.OK)
    status, back = made.inverse(R, size * X, 0.9 * q[:, None])
    assert np.all(status == made.OK)
    np.testing.assert_allclose(back[:, 0], q, atol=1e-11)


@pytest.mark.slow
def test_motors_of_a_pose_in_a_box_of_more_than_a_turn() -> None:
    """The crank's angle is that of its end, but for whole turns: the one nearest to the middle of the box."""
    found = export(four_bar(), "python", {"motor": (-2.5, 5.0)})
    assert found.closed
    made = module_of(found.code)
    q = np.linspace(-2.5, 5.0, 61)
    status, _, R, p = made.forward(q[:, None])
    assert np.all(status == made.OK)
    status, back = made.inverse(R, p)
    assert np.all(status == made.OK)
    turns = (back[:, 0] - q) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    assert np.all(np.abs(back[:, 0] - 1.25) <= np.pi + 1e-12)


def test_code_tells_where_motors_are_the_only_ones() -> None:
    found = exported(four_bar(), 0.4)
    assert found.proof.injective_box is not None
    made = module_of(found.code)
    (low,), (high,) = found.proof.injective_box
    assert made.unique([[low], [0.0], [high], [high + 1e-9], [np.nan]]).tolist() == [True, True, True, False, False]
    assert found.to_dict()["injective_box"] == [[low], [high]]


@pytest.mark.slow
@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("lower", "upper", "verdict"),
    [(-0.05, 0.1, "passed"), (-3.0, 3.0, "kept"), (-3.0, None, "kept"), (None, 0.1, "passed")],
)
def test_limits_of_joints_without_a_motor(lower: float | None, upper: float | None, verdict: str) -> None:
    """Against the knee's angles in small steps of the motor."""
    robot = four_bar()
    limited = robot.changed(
        joints=[
            replace(each, limits=Limits(lower, upper)) if each.name == "knee" else each
            for each in robot.joints.values()
        ]
    )
    found, box = exported(limited, 0.4), box_of(limited, 0.4)
    made = module_of(found.code)
    _, x, _, _ = made.forward(np.linspace(-0.4, 0.4, 2001)[:, None])
    knee = x[:, made.PASSIVE_NAMES.index("knee")]
    (limit,) = found.proof.limits
    assert limit.least is not None
    assert limit.most is not None
    assert limit.least - 1e-12 <= knee.min() < limit.least + 0.1
    assert limit.most - 0.1 < knee.max() <= limit.most + 1e-12
    inside = (lower is None or lower <= knee.min()) and (upper is None or knee.max() <= upper)
    assert limit.verdict == verdict == ("kept" if inside else "passed")
    for text in (found.code, str(found), str(hrsynth.branch(limited, box))):
        assert f"{'satisfied' if inside else 'exceeded'} in" in " ".join(text.split())
    assert "limits" not in f"{exported(robot, 0.4)}{hrsynth.branch(robot, box)}"
    assert found.to_dict()["limits"] == [limit.to_dict()]


@pytest.mark.slow
def test_motors_that_the_box_takes_beyond_their_limits_are_told() -> None:
    robot = four_bar()
    limited = robot.changed(
        joints=[replace(each, limits=Limits(-0.2, 0.3)) if each.is_actuated else each for each in robot.joints.values()]
    )
    wide, within = ({"motor": (-half, half)} for half in (0.25, 0.2))
    assert "motor -0.2 to 0.3 (within -0.25 to 0.25)" in export(limited, "python", wide).code
    assert "exceeded by the box, of motors: motor -0.2 to 0.3" in f"{hrsynth.branch(limited, wide)}"
    assert "exceeded" not in f"{hrsynth.branch(limited, within)}{hrsynth.branch(limited)}{hrsynth.branch(robot, wide)}"


@pytest.mark.slow
def test_limits_are_undecided_within_the_tube_alone() -> None:
    """A limit at the largest angle, by closed form: beyond what a tube bounds it is kept, below passed, between not
    decided."""
    robot = four_bar()
    (part,) = hrsynth.branch(robot, box_of(robot, 0.4)).parts
    k = part.passive.index("knee")
    top = [cell.centre[k] + np.abs(cell.slopes[k]) @ (cell.high - cell.low) / 2 for cell in part.cells]
    radius = [cell.radius[k] for cell in part.cells]

    def verdict(upper: float) -> str:
        limited = robot.changed(
            joints=[
                replace(each, limits=Limits(None, upper)) if each.name == "knee" else each
                for each in robot.joints.values()
            ]
        )
        (limit,) = hrsynth.branch(limited, box_of(limited, 0.4)).limits
        return limit.verdict

    most, least = max(np.add(top, radius)), max(np.subtract(top, radius))
    q = np.append(np.linspace(-0.4, 0.4, 10_001), 0.0)
    knee = coupler(q)[1] - q
    assert least - 1e-12 <= np.max(knee - knee[-1]) <= most + 1e-12
    assert [verdict(most + 1e-9), verdict((most + least) / 2), verdict(least - 1e-9)] == ["kept", "undecided", "passed"]


@pytest.mark.slow
def test_it_says_why_it_answers_in_no_more() -> None:
    bars = (1.0, 1.2, 0.5, 0.8)  # a crank that cannot turn all round: at its ends coupler and rocker are in line
    found = exported(four_bar(1.0, bars), 3.0)
    (part,) = found.proof.parts
    text = str(found)
    assert part.volume_fraction < 1
    assert [f"at {part.motors[0]}={end.q[0]:.4g}" in text for end in part.toggles] == [True] * len(part.toggles)
    assert "can move while all motors are fixed" in text
    assert "\nproof ends" not in str(exported(four_bar(), 0.4))


@pytest.mark.slow
def test_a_four_bar_stays_on_its_branch_all_round(tmp_path: Path) -> None:
    robot = four_bar()
    made = module_of(export(robot, "python").code)
    q = np.linspace(-np.pi, np.pi, 100_001)
    rng = np.random.default_rng(0)
    rng.shuffle(q)  # motors that jump far
    status, x, R, _ = made.forward(q[:, None])
    assert np.all(status == made.OK)
    _, angle = coupler(q)
    zero = coupler(np.zeros(1))[1][0]
    cosine, sine = np.cos(angle - zero), np.sin(angle - zero)
    assert np.abs(R[:, 0, 0] - cosine).max() < 1e-12
    assert np.abs(R[:, 1, 0] - sine).max() < 1e-12
    knee = x[:, made.PASSIVE_NAMES.index("knee")]
    np.testing.assert_allclose(np.cos(knee + q), cosine, atol=1e-12)
    np.testing.assert_allclose(np.sin(knee + q), sine, atol=1e-12)
    code = export(robot, jumps=True).code
    rows = answered(compiled(tmp_path, code, MAIN, "-DNAME=four_bar"), q[:, None])
    assert np.all(rows[:, 0] == 0)
    np.testing.assert_allclose(rows[:, 2:5], x, atol=1e-12)


@pytest.mark.slow
def test_code_in_cpp_neither_allocates_nor_differs(tmp_path: Path) -> None:
    robot = hrsynth.load("rrrrr_m1")
    found = exported(robot, 0.1, "c++")
    made = module_of(exported(robot, 0.1).code)
    q = np.vstack([inside(found, 300), [[0.2, 0.0], [np.nan, 0.0], [1e300, -1e300]]])
    rows = answered(compiled(tmp_path, found.code, MAIN, "-DNAME=rrrrr_m1"), q)
    status, x, R, p, rates = made.jacobians(q)
    np.testing.assert_array_equal(rows[:, 0] == 0, status == made.OK)
    assert set(rows[status == made.OUTSIDE, 0]) == {OUTSIDE}
    good = status == made.OK
    expected = np.hstack(
        [x, p, R.reshape(-1, 9), rates["platform"].reshape(len(q), -1), rates["passive"].reshape(len(q), -1), q]
    )
    assert good.sum() == 300
    assert np.all(rows[good, 1] == 0)
    np.testing.assert_allclose(rows[good, 2:], expected[good], atol=1e-11)


def test_a_time_limit_ends_with_the_cells_that_are_proved():
    short, long = (export("rrrrr_m1", jumps=True, max_cells=130, time_limit=limit) for limit in (0.0, None))
    assert 0 < short.proof.parts[0].volume_fraction < long.proof.parts[0].volume_fraction
    assert "--time-limit 0" in short.code
    assert "--time-limit" not in long.code


@pytest.mark.slow
def test_the_same_bytes_each_time(tmp_path: Path) -> None:
    hrsynth.save(four_bar(), tmp_path / "four_bar.urdf")
    script = (
        "import sys; from hrsynth.codegen.export import export; "
        "sys.stdout.write(export(sys.argv[1], box='motor=-0.1:0.1', jumps=True).code)"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", script, str(tmp_path / "four_bar.urdf")],
            capture_output=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(texts) == 1
    (text,) = texts
    assert re.search(r"hrsynth export four_bar.urdf --lang c\+\+ .*--box motor=-0.1:0.1 --jumps\n", text)
    assert str(tmp_path) not in text


def test_what_is_refused() -> None:
    with pytest.raises(BadRequest, match=r"--lang"):
        export(four_bar(), "fortran")
    with pytest.raises(BadRequest):
        export(four_bar(), box="wheel=-1:1", jumps=True)
    for cells in ({"box": "motor=-1:1"}, {"max_cells": 3}, {"time_limit": 1.0}):
        with pytest.raises(BadRequest, match=r"--box, --max-cells, --time-limit: .*Add --jumps\."):
            export(four_bar(), **cells)
    b = Builder("pendulum")
    b.link("base")
    b.link("bob", at=(0, 0, -1))
    b.joint("hinge", "R", "base", "bob", axis=(0, 1, 0), motor=True)
    for jumps in (False, True):
        with pytest.raises(BadRequest, match="move no kinematic loop"):
            export(b.build(platform="bob"), jumps=jumps)


def test_what_is_watched_is_refused_before_the_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    from hrsynth.description.observation_text import add_observations, parse_sensor

    monkeypatch.setattr("hrsynth.codegen.export.prove_branch", lambda *_: pytest.fail("the proof has begun"))
    robot = four_bar()
    for wrong, match in (
        ({"observe": "nine"}, "leg or link of four_bar: got 'nine'"),
        ({"camera": "eye=base"}, "--camera eye: no observation uses this camera of four_bar"),
    ):
        with pytest.raises(BadRequest, match=match):
            export(robot, **wrong)
    with pytest.raises(BadRequest, match=r"directions of segments only: got 'observation point_1 \(point\)'"):
        export(add_observations(robot, [parse_sensor(f"point:{robot.platform}@0,0,0.1", [])]))


SMALL = {"3rrr_m1": 0.02, "3prr_m1": 0.02, "rrrrr_m2": 0.05, "prrrp_m1": 0.05, "3rps": 0.01, "3rpr_m1": 0.02}
"""Shipped robots, with boxes whose proof is quick."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_shipped_robots(name: str) -> None:
    robot = hrsynth.load(name)
    found = exported(robot, SMALL[name])
    assert_agrees(robot, found, module_of(found.code), 20)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_robots_in_tilted_bases(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = transformed(planar(["RRR"] * 3, rng, [{0}] * 3), random_rotation(rng), rng.normal(size=3))
    found = exported(robot, 0.01)
    assert_agrees(robot, found, module_of(found.code), 10)


@pytest.mark.slow
def test_the_page_s_loop_runs(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "pages" / "export_for_jumps.md").read_text(encoding="utf-8")
    loop = page.split("```cpp\n")[1].split("```")[0]
    assert sum(bool(line.strip()) for line in loop.splitlines()) < 25
    robot = hrsynth.load("rrrrr_m1")
    box = re.search(r"--box (\S+)", page)
    assert box is not None
    program = compiled(tmp_path, export(robot, box=box[1], jumps=True).code, loop)
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    moved = [float(x) for x in out.split()] - robot.links[robot.platform].pose[:2, 3]
    np.testing.assert_allclose(moved, [0.02 * 0.099, 0.01 * 0.099], atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".xml", ".sdf", ".urdf"])
def test_files_of_other_dialects(tmp_path: Path, ending: str) -> None:
    robot = hrsynth.load("rrrrr_m1")
    hrsynth.save(robot, tmp_path / f"five_bar{ending}")
    motors = [name for name, joint in robot.joints.items() if joint.is_actuated]
    again = hrsynth.load(tmp_path / f"five_bar{ending}", platform=robot.platform, motors=motors)
    one, other = (exported(each, 0.1) for each in (robot, again))
    assert one.proof.motors == other.proof.motors
    q = inside(one, 50)
    (_, _, R, p), (status, _, R_again, p_again) = (module_of(each.code).forward(q) for each in (one, other))
    assert np.all(status == 0)
    np.testing.assert_allclose(R_again, R, atol=1e-9)
    np.testing.assert_allclose(p_again, p, atol=1e-9)


@pytest.mark.slow
def test_a_compiler_that_drops_checks_or_changes_sums_is_refused(tmp_path: Path) -> None:
    """With -ffast-math what is no number may pass the comparisons that refuse it; where sums and quotients are not
    those that are written, the bounds of rounding do not hold."""
    header = tmp_path / "robot.hpp"
    header.write_text(exported(four_bar(), 0.4, "c++").code, encoding="utf-8")
    command = ["g++", "-E", f"-isystem{eigen()}", str(header)]
    assert subprocess.run(command, capture_output=True).returncode == 0
    for flags in (
        "-ffast-math",
        "-Ofast",
        "-ffinite-math-only",
        "-freciprocal-math",
        "-funsafe-math-optimizations",
        "-fassociative-math -fno-signed-zeros -fno-trapping-math",
    ):
        done = subprocess.run([*command, *flags.split()], capture_output=True, text=True)
        assert done.returncode != 0, flags
        assert "#error" in done.stderr


ODD = {
    "class": "class_",
    "9 lives": "_9_lives",
    "std": "std_",
    "": "robot",
    "a-b.é": "a_b__",
    "NULL": "NULL_",
    "gamma": "gamma_",
    "y0": "y0_",
    "link": "link_",
    "size_t": "size_t_",
    "CHAR_BIT": "CHAR_BIT_",
    "lgamma_r": "lgamma_r_",
    "pthread_self": "pthread_self_",
    "sched_yield": "sched_yield_",
    "rand_r": "rand_r_",
    "getc_unlocked": "getc_unlocked_",
    "__linux__": "__linux___",
    "arm_r": "arm_r",
    "Motors": "Motors_",
    "# coding: utf-7": "__coding__utf_7",
    "r\n#error \\": "r__error__",
}
"""Names of robots, and their namespaces."""


def oddly_named(name: str) -> Mechanism:
    robot = four_bar()
    names = {key: f'{key} "*/ ???/ q\n\\' for key in robot.joints}
    joints = {names[key]: replace(joint, name=names[key]) for key, joint in robot.joints.items()}
    return replace(robot, name=name, joints=joints)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ODD)
def test_names_are_no_code(name: str, tmp_path: Path) -> None:
    """What a file calls its robot and joints ends no comment and no string; the names come through."""
    robot = oddly_named(name)
    code = export(robot, "python", box_of(robot, 0.1)).code
    path = tmp_path / "module.py"
    path.write_text(code, encoding="utf-8")
    made: dict[str, Any] = {}
    exec(compile(path.read_bytes(), str(path), "exec"), made)
    assert made["MOTOR_NAMES"] == ['motor "*/ ???/ q\n\\']
    assert made["forward"](np.zeros((1, 1)))[0].tolist() == [made["OK"]]
    assert make_namespace(name) == ODD[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["class", "", "NULL", "Motors", "gamma", "r\n#error \\"])
def test_names_are_no_code_in_cpp(name: str, tmp_path: Path) -> None:
    robot = oddly_named(name)
    code = export(robot, "c++", box_of(robot, 0.1), jumps=True).code
    own = make_namespace(robot.name)
    main = (
        f'#include "robot.hpp"\n#include <cstdio>\nusing namespace {own};\n'
        "int main() { return int(unique(Motors::Zero())) + std::puts(MOTOR_NAMES[0]) < 0; }"
    )
    found = subprocess.run([compiled(tmp_path, code, main)], capture_output=True, text=True, check=True)
    assert found.stdout == 'motor "*/ ???/ q\n\\\n'


@pytest.mark.slow
def test_no_name_of_the_c_library_is_a_namespace(tmp_path: Path) -> None:
    """None of its names, types and macros is what a robot's namespace is called."""
    names = set(
        " ".join(
            path.read_text(encoding="utf-8", errors="replace")
            for path in (
                Path("/usr/include/math.h"),
                Path("/usr/include/stdio.h"),
                Path("/usr/include/stdlib.h"),
                Path("/usr/include/unistd.h"),
                Path("/usr/include/time.h"),
                Path("/usr/include/string.h"),
                Path("/usr/include/pthread.h"),
                Path("/usr/include/sched.h"),
                Path("/usr/include/signal.h"),
                Path("/usr/include/wchar.h"),
            )
            if path.exists()
        )
        .replace("(", " ( ")
        .split()
    )
    names = sorted(
        {each for each in names if re.fullmatch("[a-z][a-z0-9_]*", each) and not re.search("f[0-9]+x?$", each)}
        | {"gamma", "y0", "int8_t", "FILE", "INT_MAX", "CHAR_BIT", "FE_INVALID"}
    )
    lines = [f"namespace {make_namespace(each)} {{}}" for each in names]
    (tmp_path / "main.cpp").write_text(
        "\n".join(["#include <Eigen/Core>", "#include <cstdio>", "#include <ctime>", "#include <iostream>", *lines])
    )
    done = subprocess.run(
        ["g++", "-std=c++17", "-fsyntax-only", f"-isystem{eigen()}", "main.cpp"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[:2000]
    assert [make_namespace(each) for each in ("delta", "MYROBOT", "EXO_2", "irb_140t")] == [
        "delta",
        "MYROBOT",
        "EXO_2",
        "irb_140t",
    ]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e308])
def test_poses_that_are_none_are_answered_without_a_warning(value: float) -> None:
    robot = geared_five_bar()  # whose inverse is Newton's method
    made = module_of(export(robot, "python", box_of(robot, 0.1)).code)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert made.forward(np.full((1, 1), value))[0] == [made.OUTSIDE]
        assert made.inverse(np.full((1, 3, 3), value), np.full((1, 3), value), np.zeros((1, 1)))[0] != [made.OK]


def test_why_nothing_is_proved_is_said_once_with_the_nearest_place():
    proof = hrsynth.branch("rrrrr_m1", "shoulder_1=-0.01:0.01,shoulder_2=-0.01:0.01")
    (part,) = proof.parts
    ends = tuple(
        Toggle(np.array(q), (), (), reason)
        for q, reason in (([2.0, 0.0], "it toggles"), ([0.0, 0.5], "it toggles"), ([1.0, 1.0], "it is too small"))
    )
    with pytest.raises(
        NoProvedCell,
        match=re.escape(
            "it toggles (at shoulder_1=0, shoulder_2=0.5); it is too small (at shoulder_1=1, shoulder_2=1). Try"
        ),
    ):
        TubedBranch.of(replace(proof, parts=(replace(part, cells=(), toggles=ends),)))


@pytest.mark.slow
def test_axes_that_are_parallel_but_for_rounding() -> None:
    """Loops that close to less than the program asks for are open: it says that it finds out."""
    robot, rng = four_bar(), np.random.default_rng(0)

    def off(axis: Array) -> Array:
        axis = axis + 1e-9 * rng.normal(size=3)
        return np.asarray(axis / np.linalg.norm(axis))

    robot = replace(
        robot, joints={name: replace(joint, axes=tuple(map(off, joint.axes))) for name, joint in robot.joints.items()}
    )
    found = exported(robot, 0.05)
    assert "Tested, not proved: 3 more equations of the loops hold." in found.code
    program = module_of(found.code)
    assert set(program.forward(np.linspace(*found.proof.proved, 50))[0]) <= {program.OK, program.UNDECIDED}


@pytest.mark.slow
def test_faces_of_cells_are_answered(tmp_path: Path) -> None:
    """Where a branch fills a part of its box alone, all closed cells are answered."""
    robot = made("geared")
    found = export(robot, "python")
    assert found.proof.parts[0].volume_fraction < 0.9
    rng, q = np.random.default_rng(0), []
    for cell in found.proof.parts[0].cells:
        for axis, end in product(range(len(cell.low)), (cell.low, cell.high)):
            at = rng.uniform(cell.low, cell.high, (3, len(cell.low)))
            at[:, axis] = end[axis]
            q.append(at)
    program = module_of(found.code)
    status, x, *_ = program.forward(np.vstack(q))
    assert set(status) == {program.OK}
    name = re.search(r"\nnamespace (\w+) {", code := export(robot, jumps=True).code)
    assert name is not None
    rows = answered(compiled(tmp_path, code, MAIN, f"-DNAME={name[1]}"), np.vstack(q))
    assert set(rows[:, 0]) <= {OK, SINGULAR}
    np.testing.assert_allclose(rows[:, 2 : 2 + x.shape[1]], x, atol=1e-11)
