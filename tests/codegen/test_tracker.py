"""Trackers: what their code proves at run time, against steps followed in many small pieces and Pinocchio's model."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from codegen.robots import (
    BARS,
    FAR,
    FOLD,
    LIMIT,
    LINE,
    OK,
    answered,
    compiled,
    four_bar,
    made,
    start_carried_four_bar,
)
from codegen.robots import HEAD as COUNTED
from codegen.robots import Motors as MotorsAt
from codegen.test_export import coupler
from hrsynth.codegen.export import export
from hrsynth.codegen.trace import TracedFunction
from hrsynth.codegen.tracker import Tracker
from hrsynth.equations.loop_parts import split_loop_system
from hrsynth.equations.tape import Tape
from hrsynth.geometry.vectors import Array, build_plane_axes
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.model import JointType, Limits
from strategies import planar, random_rotation, transformed

STEPS = int(os.environ.get("HRSYNTH_STEPS", "3000"))
"""Random steps of each robot in the longest tests."""
HEAD = "#include <algorithm>\n#include <random>" + COUNTED
REPLAY = (
    HEAD
    + """
int main() {
  int n = 0;
  if (std::scanf("%d", &n) != 1) return 2;
  Eigen::internal::set_is_malloc_allowed(false);
  long made = 0;
  Branch branch;
  Motors first = Motors::Zero();
  if (branch.to(first) != Status::lost || branch.room() != 0.0) return 5;
  if (branch.start() != Status::ok) return 6;
  Branch odd;
  if (odd.start(Motors::Constant(NAN)) != Status::far || odd.at().passive != branch.at().passive) return 8;
  if (odd.start(first, Passive::Constant(INFINITY)) != Status::lost || odd.to(first) != Status::lost) return 9;
  for (int row = 0; row < n; ++row) {
    Motors q;
    for (int i = 0; i < MOTORS; ++i) {
      char word[64];
      if (std::scanf("%63s", word) != 1) return 3;
      q[i] = std::strtod(word, nullptr);
    }
    Solution ahead;
    Jacobians rates;
    rates.passive.setZero(); rates.platform.setZero();
    double room = -1.0;
    const long before = allocations;
    const Status seen = branch.peek(q, ahead, room);
    const Status status = branch.to(q);
    const Solution at = branch.at();
    const Status derived = branch.rates(rates);
    made += allocations - before;
    if (seen != status || room != branch.room() || ahead.passive != at.passive) return 7;
    std::printf("%d %d %.17g %.17g ", int(status), int(derived), room, branch.error());
    print(at.position); print(at.rotation); print(at.passive); print(rates.platform); print(rates.passive);
    std::printf("\\n");
  }
  return made == 0 ? 0 : 4;
}
"""
)
FOLLOW = Path(__file__).parent / "follow.cpp"
STEP = (
    HEAD
    + """
// Random steps: those that are proved are written, for `follow.cpp`, what became of all is printed.
int main(int, char**) {
  int tries = 0, seed = 0, told = 0;
  double reach = 0.0, size = 0.0;
  if (std::scanf("%d %d %lf %lf %d", &tries, &seed, &reach, &size, &told) != 5) return 2;
  std::mt19937 random(seed);
  std::uniform_real_distribution<> uniform(-1.0, 1.0);
  Branch home, branch;
  if (home.start() != Status::ok) return 3;
  FILE *const steps = std::fopen("steps", "wb"), *const jumps = std::fopen("jumps", "wb");
  Motors zero;
  for (int k = 0; k < MOTORS; ++k) zero[k] = detail::ZERO_Q[k] * detail::UNIT_Q[k];
  Motors at = zero;
  int counts[7] = {}, jumped = 0;
  for (int i = 0; i < tries; ++i) {
    if (i % 10 == 0) {
      branch = home;
      at = zero;
      Motors goal;
      for (int k = 0; k < MOTORS; ++k) goal[k] = reach * uniform(random) * detail::UNIT_Q[k];
      for (int k = 1; k <= 25; ++k) {
        const Motors next = zero + goal * (k / 25.0);
        const Status status = branch.to(next);
        if (status > Status::limit) break;
        at = next;
      }
    }
    Motors step;
    const double scale = size * std::pow(10.0, uniform(random));
    for (int k = 0; k < MOTORS; ++k) step[k] = scale * uniform(random) * detail::UNIT_Q[k];
    Branch moved = branch;
    const Status status = moved.to(at + step);
    ++counts[int(status)];
    const Solution start = branch.at(), found = moved.at();
    if (status > Status::line) {
      if (found.passive != start.passive) return 4;
      continue;
    }
    if (i % 10 == 0 && told-- > 0) {  // the first step from each place, as it is
      const Motors after = at + step;
      print(at); print(after); print(found.position); print(found.rotation);
      std::printf("\\n");
    }
    // the line; of a box two ways along its edges as well
    double record[1 + 2 * MOTORS + 2 * detail::UNKNOWNS] = {status == Status::ok ? 3.0 : 1.0};
    double *q = record + 1, *goal = q + MOTORS, *from = goal + MOTORS, *end = from + detail::UNKNOWNS;
    double plain[detail::UNKNOWNS];
    for (int k = 0; k < MOTORS; ++k) q[k] = at[k] / detail::UNIT_Q[k], goal[k] = (at[k] + step[k]) / detail::UNIT_Q[k];
    for (int j = 0; j < detail::UNKNOWNS; ++j) {
      plain[j] = from[j] = start.passive[j] / detail::UNIT_X[j];
      end[j] = found.passive[j] / detail::UNIT_X[j];
    }
    std::fwrite(record, sizeof record, 1, steps);
    // a plain solution from the same start may lie elsewhere: what is proved is worth something
    (void)CLOSE(goal, plain);
    double off = 0.0;
    for (int j = 0; j < detail::UNKNOWNS; ++j) off = std::max(off, std::abs(plain[j] - end[j]));
    if (off < 1e-6) continue;
    ++jumped;
    std::copy(plain, plain + detail::UNKNOWNS, end);
    record[0] = 1.0;
    std::fwrite(record, sizeof record, 1, jumps);
  }
  std::fclose(steps), std::fclose(jumps);
  std::printf("%d %d %d %d %d %d\\n", counts[0], counts[1], counts[3], counts[4], counts[5], jumped);
}
"""
)


def describe_loops(robot: Mechanism) -> str:
    """The transforms of a robot's joints, and the relations of those that its tree leaves out, for ``follow.cpp``; of
    the branch only the names of its coordinates, and which of them are constant."""
    proof, E = export(robot).proof, np.eye(3)
    tree, length, joints = proof.system.coordinates, proof.system.length, proof.robot.joints
    numbers = {name: k for k, name in enumerate((*proof.motors, *proof.passive))}
    kept = [i for i, each in enumerate(tree) if each.name in numbers]

    def find_body(i: int) -> int:
        while i >= 0 and i not in kept:
            i = tree[i].parent
        return kept.index(i) if i >= 0 else -1

    rows: list[list[Any]] = [[len(proof.motors), len(proof.passive), len(kept)]]
    for i in kept:
        joint = joints.get(tree[i].joint)
        point = tree[i].point if joint is None else joint.point / length
        rows.append(
            [numbers[tree[i].name], int(tree[i].slides), find_body(tree[i].parent), tree[i].zero, *tree[i].axis, *point]
        )
    relations: list[list[Any]] = []
    moved = {each.joint for each in tree}
    for joint in (each for each in joints.values() if each.name not in moved and each.type is not JointType.FREE):
        ends = [find_body(proof.system.body[link]) for link in joint.links]
        kind, axes = joint.type.value, joint.axes
        pairs: list[tuple[int, Array, Array]] = []
        if kind in "RSUF":
            pairs.append((0, E[0], E[0]))
        if kind == "U":
            pairs.append((1, axes[0], axes[1]))
        if kind in "RCPE":
            across = build_plane_axes(joint.axis)
            pairs += [(1, each, joint.axis) for each in across]
            pairs += [(2, each, each) for each in ([] if kind == "R" else [joint.axis] if kind == "E" else across)]
            pairs += [(1, *across)] * (kind == "P")
        if kind == "F":
            pairs += [(1, E[k - 1], E[k]) for k in range(3)]
        relations += [[number, *ends, *u, *v, *(joint.point / length)] for number, u, v in pairs]
    for coupling in proof.robot.couplings:
        both = coupling.driver, coupling.driven
        pair = [kept.index(next(i for i, each in enumerate(tree) if each.joint == name)) for name in both]
        units = [length if tree[kept[k]].slides else 1.0 for k in pair]
        relations.append([3, *pair, coupling.ratio * units[0] / units[1], *[0.0] * 8])
    return "\n".join(" ".join(repr(float(x)) for x in row) for row in (*rows, [len(relations)], *relations))


def exactly(function: TracedFunction, q: Any, x: Any) -> dict[str, dict[tuple[int, ...], Any]]:
    """What a function stores, with fifty digits."""
    names: dict[str, Any] = {"q": q, "x": x, "sin": mpmath.sin, "cos": mpmath.cos}
    names["linear"] = lambda sum_, *terms: sum_ + sum(x * c for x, c in zip(terms[::2], terms[1::2], strict=True))
    for name, text in function.statements:
        names[name] = eval(text, names)
    found: dict[str, dict[tuple[int, ...], Any]] = {}
    for array, place, value in function.stores:
        found.setdefault(array, {})[place] = names[value] if value in names else mpmath.mpf(float(value))
    return found


@cache
def tracker(robot: Mechanism | str) -> str:
    return export(robot).code


def namespace(code: str) -> str:
    return code.split("\nnamespace ")[1].split(" {")[0]


def replayed(folder: Path, robot: Mechanism | str, rows: Array) -> Array:
    """What a tracker answers to motors one after the other: status, that of the rates, room, error, position, rotation,
    passive joints, rates."""
    code = tracker(robot)
    return answered(compiled(folder, code, REPLAY, f"-DNAME={namespace(code)}"), rows)


def followed(
    folder: Path, robot: Mechanism, tries: int, reach: float, size: float, seed: int = 0, told: int = 0
) -> tuple[list[int], Array]:
    """Numbers of random steps that are proved for the box, for the line, refused (far, fold), lost; of the proved ones
    those that end elsewhere when they are followed in 500 pieces, those that could not be followed; and those at which
    plain Newton's method ends elsewhere. At most ``told`` proved steps: motors before and after, position, rotation."""
    code = tracker(robot)
    blocks = [
        f"detail::close<detail::track_{k}::{name}>(Q, X, inverse)"
        for k, part in enumerate(code.split("\nnamespace track_")[1:], 1)
        for name in re.findall(r"^struct (Block\d+)", part, re.MULTILINE)
    ]
    text = f"static double inverse[10000];\n#define CLOSE(Q, X) ({' && '.join(blocks)})\n"
    program = compiled(folder, code, text + STEP, f"-DNAME={namespace(code)}", "-O2")
    given = f"{tries} {seed} {reach} {size} {told}\n"
    done = subprocess.run([program], cwd=folder, input=given, capture_output=True, text=True, timeout=tries)
    assert done.returncode == 0, (done.returncode, done.stderr)
    *rows, counts = done.stdout.splitlines()
    *seen, jumped = map(int, counts.split())
    (folder / "loops").write_text(describe_loops(robot), encoding="utf-8")
    build = ["g++", "-std=c++17", "-O3", "-march=native", "-Wno-psabi", FOLLOW, "-o", "follow"]
    subprocess.run(build, cwd=folder, check=True, timeout=300)
    found = {}
    for name in ("steps", "jumps"):
        with (folder / name).open("rb") as steps:
            run = subprocess.run(
                ["./follow", "loops"], cwd=folder, stdin=steps, capture_output=True, text=True, timeout=tries
            )
        found[name] = [*map(int, run.stdout.split())]
    assert found["jumps"] == [jumped, jumped, 0]
    count, wrong, unsure = found["steps"]
    assert count == sum(seen[:2])
    return [*seen, wrong, unsure, jumped], np.array([[float(word) for word in row.split()] for row in rows])


REACH = {
    "rrrrr_m1": (0.8, 0.1),
    "four_bar": (3.0, 0.3),
    "geared": (1.0, 0.2),
    "3rrr_m1": (0.5, 0.05),
    "3rps": (0.3, 0.05),
    "screw": (3.0, 3.0),
    "3prp": (0.5, 0.5),
    "delta": (0.8, 0.05),
    "quattro": (0.2, 0.005),
    "gough_stewart": (0.2, 0.01),
    "ankle": (1.0, 0.1),
    "delta_cad": (0.8, 0.1),
    "hexa": (0.3, 0.004),
    "6pus": (0.2, 0.004),
}
"""Ranges of motors and sizes of steps (rad, characteristic lengths)."""


def check_soundness(folder: Path, robot: Mechanism, tries: int, reach: float, size: float, seed: int) -> int:
    """All random steps that are proved end where many small pieces lead, in whatever order the motors move."""
    counts, told = followed(folder, robot, tries, reach, size, seed, max(2, tries // 1000))
    box, line, far, fold, lost, wrong, unsure, jumped = counts
    print(f"{robot.name}: {counts}, {len(told)} by Pinocchio's model")
    assert box + line + far + fold + lost == tries
    assert (lost, wrong, unsure) == (0, 0, 0)
    assert box > tries / 10
    assert far + fold > 0
    check_ends(robot, told)
    return jumped


def check_ends(robot: Mechanism, told: Array) -> None:
    """Pinocchio's model, led along the line in 500 pieces from where it is led from zero, has the same pose."""
    model, names = PinocchioModel(robot), export(robot).proof.motors
    m = len(names)
    for row in told:
        q = model.q0
        for start, end, pieces in ((np.zeros(m), row[:m], 500), (row[:m], row[m : 2 * m], 500)):
            for part in np.linspace(0.0, 1.0, pieces + 1)[1:]:
                motors = MotorsAt(dict(zip(names, start + part * (end - start), strict=True)))
                q, left = solve(model, q, motors, tolerance=1e-12, iterations=60)
                assert left < 1e-11
        X = model.pose(q, robot.platform)
        np.testing.assert_allclose(row[2 * m : 2 * m + 3], X[:3, 3], atol=1e-9 * robot.length)
        np.testing.assert_allclose(row[2 * m + 3 :].reshape(3, 3), X[:3, :3], atol=1e-9)
    assert len(told) > 0


def test_proved_steps_end_where_small_ones_lead(tmp_path: Path) -> None:
    """Where plain Newton's method from the same closure ends elsewhere."""
    assert check_soundness(tmp_path, made("rrrrr_m1"), 300, *REACH["rrrrr_m1"], 1) > 0


@pytest.mark.long
@pytest.mark.timeout(20 * STEPS)
@pytest.mark.parametrize("name", sorted(REACH))
def test_proved_steps_of_many_robots(name: str, tmp_path: Path) -> None:
    check_soundness(tmp_path, made(name), STEPS, *REACH[name], 2)


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(8))
def test_proved_steps_of_random_four_bars(seed: int, tmp_path: Path) -> None:
    """Cranks that turn all round, and such that fold."""
    rng = np.random.default_rng(seed)
    bars = rng.uniform(0.5, 1.2, 4)
    while not sum(sorted(bars)[:3]) > 1.2 * max(bars):
        bars = rng.uniform(0.5, 1.2, 4)
    start = next(
        each
        for each in rng.uniform(0, 2 * np.pi, 1000)
        if abs(bars[2] - bars[3]) + 0.1
        < np.hypot(bars[0] - bars[1] * np.cos(each), bars[1] * np.sin(each))
        < bars[2] + bars[3] - 0.1
    )
    robot = four_bar(start, tuple(bars), float(rng.choice([-1, 1])))
    check_soundness(tmp_path, robot, 1500, 3.0, 0.5, seed)


@pytest.mark.long
@pytest.mark.timeout(20 * STEPS)
@pytest.mark.parametrize("seed", range(6))
def test_proved_steps_of_random_platforms(seed: int, tmp_path: Path) -> None:
    """Planar platforms on three random legs, in tilted bases."""
    rng = np.random.default_rng(seed)
    robot = transformed(planar(["RRR"] * 3, rng, [{0}] * 3), random_rotation(rng), rng.normal(size=3))
    check_soundness(tmp_path, robot, STEPS // 2, 0.5, 0.05, seed)


def test_the_page_s_loop_turns_back_before_a_toggle(tmp_path: Path) -> None:
    """It slows down as room falls, and every answer is proved; the rods are in line where the circles of the elbows
    touch, further than it goes, and where it turns and when it is at zero again are as the page says."""
    page = (Path(__file__).parents[2] / "docs" / "pages" / "export_a_controller.md").read_text(encoding="utf-8")
    program = compiled(tmp_path, tracker("rrrrr_m1"), page.split("```cpp\n")[1].split("```")[0])
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    _, status, motor, room, speed = np.array([line.split() for line in out.splitlines()], dtype=float).T
    assert set(status) == {OK}
    turn = int(np.argmax(motor))
    assert np.all(np.diff(room[: turn + 1]) <= 1e-3)
    assert room[0] == 1
    assert abs(speed[turn]) < 0.1
    assert np.abs(speed).max() <= 2
    assert motor[-1] <= 0
    robot = made("rrrrr_m1")
    shoulder, left, right, tip = (robot.joints[name].point[:2] for name in ("shoulder_1", "elbow_1", "elbow_2", "end"))
    angles = np.linspace(0.0, 1.0, 100001)
    x, y = left - shoulder
    elbows = shoulder + np.stack([x * np.cos(angles) - y * np.sin(angles), x * np.sin(angles) + y * np.cos(angles)], -1)
    reach = np.linalg.norm(tip - left) + np.linalg.norm(tip - right)
    toggle = angles[np.argmax(np.linalg.norm(elbows - right, axis=1) > reach)]
    assert f"toggle at {toggle:.3f} rad" in page.replace("\n", " ")
    assert f"turns back at {motor.max():.4f} rad" in page.replace("\n", " ")
    assert motor.max() < toggle
    assert f"at zero again after {len(motor) / 1000:.1f} s" in page.replace("\n", " ")


def check_poses(folder: Path, robot: Mechanism, half: float, count: int) -> None:
    """Answers along a curve of motors are those of Pinocchio's model, rates those of differences."""
    found = export(robot)
    code, names, model = found.code, found.proof.motors, PinocchioModel(robot)
    units = np.array([robot.length if robot.joints[name].type.has_translation else 1.0 for name in names])
    m, t = len(names), np.linspace(0.0, 1.0, count + 1)[1:]
    q = half * units * np.sin(2 * np.pi * t[:, None] * np.sqrt([2, 3, 5, 7, 11, 13][:m]))
    h = 1e-6 * units
    aside = np.concatenate(
        [q[:-1], *(q[-1] + sign * h[k] * np.eye(m)[[k]] for k in range(m) for sign in (1, -1)), q[-1:]]
    )
    rows = replayed(folder, robot, aside)
    assert np.all(rows[:, 0] <= LINE)
    assert np.all(rows[:, 3] < 1e-10)
    here = model.q0
    for row, motors in zip(rows[: count - 1], q, strict=False):
        here, left = solve(model, here, MotorsAt(dict(zip(names, motors, strict=True))), tolerance=1e-14, iterations=60)
        assert left < 1e-12
        X = model.pose(here, robot.platform)
        np.testing.assert_allclose(row[4:7], X[:3, 3], atol=1e-10 * robot.length)
        np.testing.assert_allclose(row[7:16].reshape(3, 3), X[:3, :3], atol=1e-10)
    passive = int(code.split("PASSIVE = ")[1].split(",")[0])
    sides, last = rows[count - 1 : -1], rows[-1]
    rates = last[16 + passive : 16 + passive + 6 * m].reshape(6, m)
    joints = last[16 + passive + 6 * m :].reshape(passive, m)
    for k in range(m):
        up, down = sides[2 * k], sides[2 * k + 1]
        np.testing.assert_allclose(rates[:3, k], (up - down)[4:7] / (2 * h[k]), atol=1e-5)
        np.testing.assert_allclose(joints[:, k], (up - down)[16 : 16 + passive] / (2 * h[k]), atol=1e-5 / min(units))
        turn = ((up - down)[7:16].reshape(3, 3) / (2 * h[k])) @ last[7:16].reshape(3, 3).T
        np.testing.assert_allclose(rates[3:, k], turn[[2, 0, 1], [1, 2, 0]], atol=1e-5 / min(units))


def test_poses_of_a_five_bar(tmp_path: Path) -> None:
    check_poses(tmp_path, made("rrrrr_m1"), 0.15, 100)


@pytest.mark.slow
@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["delta", "geared", "3rps", "screw", "3rrr_m1", "gough_stewart", "quattro", "3prp"])
def test_poses_of_many_robots(name: str, tmp_path: Path) -> None:
    check_poses(tmp_path, made(name), REACH[name][0] / 8, 60)


def two_loops() -> Mechanism:
    """A four-bar on the rocker of another one on a cart."""
    b = start_carried_four_bar("two_loops")
    for link in ("arm", "hand", "finger"):
        b.link(link)
    b.joint("second", "R", "rocker", "arm", (1.1, 0.3, 0), axis=(0, 0, 1), motor=True)
    b.joint("elbow", "R", "arm", "hand", (1.0, 0.8, 0), axis=(0, 0, 1))
    b.joint("swing", "R", "rocker", "finger", (1.9, 0.4, 0), axis=(0, 0, 1))
    b.joint("end", "R", "hand", "finger", (2.0, 1.0, 0), axis=(0, 0, 1), loop=True)
    return b.build(platform="hand")


@pytest.mark.slow
def test_poses_of_two_loops_and_a_motor_in_none(tmp_path: Path) -> None:
    robot = two_loops()
    assert tracker(robot).count("struct Part {") == 2
    (tmp_path / "sound").mkdir()
    check_poses(tmp_path, robot, 0.2, 60)
    check_soundness(tmp_path / "sound", robot, 300, 0.5, 0.2, 3)


def check_errors(folder: Path, name: str, count: int) -> None:
    """Answers are within the proved error of the closure with fifty digits, and not by far."""
    robot = made(name)
    found = export(robot)
    system = found.proof.system
    parts = split_loop_system(system)[0]
    formulas = Tracker.of(system, parts)
    unknowns = sorted(i for part in parts for i in part.unknowns)
    units_q, units_x = (system.units[list(places)] for places in (system.driven, unknowns))
    rng = np.random.default_rng(5)
    steps = REACH[name][1] * rng.uniform(-1, 1, (count, len(units_q)))
    q = units_q * np.cumsum(steps * np.sign(rng.uniform(-1, 1, (count, 1))), axis=0) / 4
    for row, motors in zip(replayed(folder, robot, q), q, strict=True):
        if row[0] > LINE:
            continue
        with mpmath.workdps(50):
            at = [mpmath.mpf(float(each)) for each in motors / units_q]
            answer = [mpmath.mpf(float(each)) for each in row[16 : 16 + len(unknowns)] / units_x]
            x = list(answer)
            for block in (block for part in formulas.parts for block in part.blocks):
                for _ in range(5):
                    values, slopes = exactly(block.values, at, x), exactly(block.slopes, at, x)
                    J = mpmath.matrix(block.count, len(block.unknowns))
                    for place, value in slopes["J"].items():
                        J[place] = value
                    G = mpmath.matrix([values["G"].get((i,), 0) for i in range(block.count)])
                    step = mpmath.lu_solve(J, G)
                    for i, move in zip(block.unknowns, step, strict=True):
                        x[i] -= move
                # the equations of a rod, in rounded numbers, have no zero but for this rounding
                assert max(map(abs, step)) < 1e-30
                assert max(map(abs, exactly(block.values, at, x)["G"].values())) < 1e-15
            off = max(abs(a - b) for a, b in zip(x, answer, strict=True))
        # motors and joints are read in metres, one rounding from the units in which they are proved
        assert off <= row[3] + 4e-16
        assert row[3] < 1e-11


@pytest.mark.slow
@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["rrrrr_m1", "four_bar", "3rrr_m1", "3rps", "delta"])
def test_answers_are_within_the_proved_error(name: str, tmp_path: Path) -> None:
    check_errors(tmp_path, name, 12)


@pytest.mark.parametrize("seed", range(5))
def test_gathered_sums_are_the_same_functions(seed: int) -> None:
    """Random formulas, their values with fifty digits, and nothing but sums, products, sines and cosines."""
    rng, tape = np.random.default_rng(seed), Tape([])
    made: list[Any] = [tape.load(k) for k in range(3)]
    for _ in range(40):
        x, y = (made[k] for k in rng.integers(max(0, len(made) - 9), len(made), 2))
        c = float(rng.choice([-1.0, 0.5, 1.3]))
        made.append([x + y, x - y, x * y, c - x, x * c, y + c, x.sin(), 1.0 - (y * c).cos()][rng.integers(8)])
    stores = [("G", (k,), value) for k, value in enumerate(made[-5:])]
    plain, gathered = (TracedFunction.of(tape, ["q[0]", "q[1]", "x[0]"], stores, each) for each in (False, True))
    with mpmath.workdps(50):
        at = [mpmath.mpf(float(value)) for value in rng.normal(size=3)]
        values, sums = (exactly(function, at[:2], at[2:])["G"] for function in (plain, gathered))
        assert all(abs(sums.get(k, 0) - values[k]) <= 1e-12 * (1 + abs(values[k])) for k in values)
    assert all(re.fullmatch(r"t\d+ \* t\d+|[qx]\[.*|(sin|cos|linear)\(.*", text) for _, text in gathered.statements)
    assert len(gathered.statements) < len(plain.statements)


def test_steps_that_nothing_proves_change_nothing(tmp_path: Path) -> None:
    """No numbers, whole turns, steps across a fold; up to it short steps are proved, and room falls to nothing."""
    bars = (1.0, 1.2, 0.5, 0.8)  # a crank that cannot turn all round
    robot = four_bar(1.0, bars)
    # the crank's ends are where coupler and rocker are in line: ground² + crank² − 2 ground crank cos = (sum)²
    ground, crank, coupler_, rocker = bars
    end = np.arccos((ground**2 + crank**2 - (coupler_ + rocker) ** 2) / (2 * ground * crank)) - 1.0
    slow = end * (1 - 0.8 ** np.arange(1, 60))
    away = [0.0, np.nan, np.inf, -np.inf, 1e308, 2 * np.pi, -2 * np.pi, 1.1 * end, 40.0]
    rows = replayed(tmp_path, robot, np.array([*away, *slow, end + 1e-3, end + 0.3, slow[-1]])[:, None])
    assert rows[0, 0] == OK
    refused = rows[1 : len(away)]
    assert set(refused[:, 0]) <= {FAR, FOLD}
    assert np.all(refused[:, 2] == 0)
    assert np.all(refused[:, 4:16] == rows[0, 4:16])
    led = rows[len(away) : -3]
    assert np.all(led[:10, 0] <= LINE)
    assert np.all(rows[-3:-1, 0] >= FAR)
    assert np.all(rows[-3:-1, 4:16] == led[-1, 4:16])
    assert rows[-1, 0] <= FOLD
    proved = led[led[:, 0] == OK]
    assert proved[0, 2] > 0


def test_a_four_bar_goes_all_round(tmp_path: Path) -> None:
    """After many turns, to and fro, it is where the closed form says."""
    q = 5 * np.pi * np.sin(np.linspace(0, 2 * np.pi, 2000))
    rows = replayed(tmp_path, four_bar(), q[:, None])
    assert np.all(rows[:, 0] <= LINE)
    angle = coupler(q)[1] - coupler(np.zeros(1))[1]
    np.testing.assert_allclose(rows[:, 7], np.cos(angle), atol=1e-11)
    np.testing.assert_allclose(rows[:, 10], np.sin(angle), atol=1e-11)


def test_limits_are_answered_and_told(tmp_path: Path) -> None:
    """Of the motor, of a joint of the tree, and of the R at which the loop is cut."""
    robot = four_bar()
    q = np.linspace(0.0, 2.0, 41)
    tip = coupler(q)[1] - np.arctan2(*(coupler(q)[0] - np.array([BARS[0], 0])).T[::-1])
    knee = coupler(q)[1] - q
    free = replayed(tmp_path, robot, q[:, None])
    for name, values in (("motor", q), ("knee", knee - knee[0]), ("tip", -(tip - tip[0]))):
        low, high = sorted((-0.2 if values[-1] > 0 else 0.2, values[20]))
        limited = robot.changed(
            joints=[
                *(
                    replace(each, limits=Limits(low, high)) if each.name == name else each
                    for each in robot.joints.values()
                )
            ]
        )
        (tmp_path / name).mkdir()
        rows = replayed(tmp_path / name, limited, q[:, None])
        beyond = (values < low - 1e-9) | (values > high + 1e-9)
        assert beyond.any()
        assert np.all(
            (rows[:, 0] == LIMIT)[np.abs(values - values[20]) > 1e-9] == beyond[np.abs(values - values[20]) > 1e-9]
        )
        np.testing.assert_allclose(rows[:, 4:16], free[:, 4:16], atol=1e-12)


JUMP = (
    COUNTED
    + """
int main() {
  Branch branch;
  const Motors there = 0.9 * Motors::Map(UPPER), near = there * 0.98, away = 1.1 * there / 0.9;
  if (branch.jump(away) != Status::outside || branch.to(there) != Status::lost) return 1;
  if (branch.jump(there) != Status::ok || !(branch.error() < 1e-12)) return 2;
  const Solution at = branch.at();
  if (branch.jump(away) != Status::outside || branch.at().passive != at.passive) return 3;
  if (branch.to(near) != Status::ok) return 4;
  Solution pose;
  if (forward(near, pose) != Status::ok || (pose.passive - branch.at().passive).norm() > 1e-12) return 5;
  if (branch.start(there) > Status::line || (branch.at().passive - at.passive).norm() > 1e-12) return 6;
}
"""
)


def test_a_branch_jumps_into_cells_alone(tmp_path: Path) -> None:
    """There it is where the straight line from zero leads; elsewhere nothing changes."""
    robot = four_bar()
    code = export(robot, box="motor=-0.4:0.4", jumps=True).code
    program = compiled(tmp_path, code, JUMP, "-DNAME=four_bar")
    assert subprocess.run([program]).returncode == 0
