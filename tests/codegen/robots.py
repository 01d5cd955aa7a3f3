"""Robots for generated code, their code loaded or compiled, and the package's own way from motors to poses."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np
import pytest

import hrsynth
from description.foreign.rounded import exported, of_hinges
from hrsynth.codegen.export import ExportedCode
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from strategies import random_rotation, transformed

OK, LINE, LIMIT, FAR, FOLD, LOST, SINGULAR, OUTSIDE, UNDECIDED, UNREACHED = range(10)
"""Statuses of generated C++."""
BARS = (1.0, 0.5, 1.2, 0.8)
"""A crank that turns all round."""
HEAD = """
#define EIGEN_RUNTIME_NO_MALLOC
#include "robot.hpp"
#include <cstdio>
#include <cstdlib>
#include <new>
static long allocations = 0;
void* operator new(std::size_t size) { ++allocations; return std::malloc(size); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
using namespace NAME;
template <class M> void print(const M& m) {
  for (int i = 0; i < m.rows(); ++i)
    for (int k = 0; k < m.cols(); ++k) std::printf("%.17g ", m(i, k));
}
"""
"""Allocations are counted, matrices printed; NAME is the code's namespace."""
MAIN = (
    HEAD
    + """
int main() {
  int n = 0;
  if (std::scanf("%d", &n) != 1) return 2;
  Eigen::internal::set_is_malloc_allowed(false);
  long made = 0;
  for (int row = 0; row < n; ++row) {
    Motors q;
    for (int i = 0; i < MOTORS; ++i) if (std::scanf("%lf", &q[i]) != 1) return 3;
    Solution at;
    Jacobians rates;
    at.passive.setZero(); at.rotation.setZero(); at.position.setZero();
    rates.passive.setZero(); rates.platform.setZero(); rates.motors.setZero();
    const long before = allocations;
    const Status status = jacobians(q, at, rates);
    Motors back = q * 0.9;
    const Status led = status <= Status::limit ? inverse(at.rotation, at.position, back) : status;
    made += allocations - before;
    std::printf("%d %d ", int(status), int(led));
    print(at.passive); print(at.position); print(at.rotation); print(rates.platform); print(rates.passive); print(back);
    std::printf("\\n");
  }
  return made == 0 ? 0 : 4;
}
"""
)
FLAGS = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-fno-exceptions"]


def four_bar(start: float = 0.3, bars: tuple[float, ...] = BARS, side: float = 1.0) -> Mechanism:
    """Ground along x, the crank at the origin with a motor, at the angle ``start``; the platform is the coupler."""
    ground, crank, coupler, rocker = bars
    A, B = np.array([np.cos(start), np.sin(start), 0]) * crank, np.array([ground, 0, 0])
    gap = B - A
    d = np.linalg.norm(gap)
    along = (coupler**2 - rocker**2 + d**2) / (2 * d)
    C = A + along * gap / d + side * np.sqrt(coupler**2 - along**2) * np.array([-gap[1], gap[0], 0]) / d
    b = Builder("four_bar")
    for name, at in (("base", (0, 0, 0)), ("crank", (0, 0, 0)), ("coupler", A), ("rocker", B)):
        b.link(name, at=at)
    b.joint("motor", "R", "base", "crank", (0, 0, 0), axis=(0, 0, 1), motor=True)
    b.joint("knee", "R", "crank", "coupler", A, axis=(0, 0, 1))
    b.joint("pivot", "R", "base", "rocker", B, axis=(0, 0, 1))
    b.joint("tip", "R", "coupler", "rocker", C, axis=(0, 0, 1), loop=True)
    return b.build(platform="coupler")


def geared_five_bar() -> Mechanism:
    """A five-bar of one motor: a gear leads the other crank."""
    b = Builder("geared")
    for name in ("base", "one", "two", "left", "right"):
        b.link(name)
    for name, near, far, at in (
        ("motor", "base", "one", (0, 0, 0)),
        ("far", "base", "two", (1, 0, 0)),
        ("knee", "one", "left", (-0.3, 0.6, 0)),
        ("elbow", "two", "right", (1.2, 0.5, 0)),
    ):
        b.joint(name, "R", near, far, at, axis=(0, 0, 1), motor=name == "motor")
    b.joint("tip", "R", "left", "right", (0.4, 1.3, 0), axis=(0, 0, 1), loop=True)
    b.coupling("gear", "motor", "far", -0.7)
    return b.build(platform="left")


def screw_lever() -> Mechanism:
    """A spindle whose nut (20 mm a radian) pushes a lever."""
    b = Builder("screw")
    for name in ("base", "spindle", "nut", "rod", "lever"):
        b.link(name)
    b.joint("motor", "R", "base", "spindle", (0, 0, 0), axis=(1, 0, 0), motor=True)
    b.joint("slide", "P", "base", "nut", (0.1, 0, 0), axis=(1, 0, 0))
    b.joint("pin", "R", "nut", "rod", (0.3, 0, 0), axis=(0, 0, 1))
    b.joint("pivot", "R", "base", "lever", (1, 0, 0), axis=(0, 0, 1))
    b.joint("end", "R", "rod", "lever", (0.8, 0.7, 0), axis=(0, 0, 1), loop=True)
    b.coupling("thread", "motor", "slide", 0.02)
    return b.build(platform="lever")


def made(name: str) -> Mechanism:
    """A robot; those that are not shipped in a tilted base; ``delta_cad`` with balls of three R and six decimals."""
    own = {"four_bar": four_bar, "geared": geared_five_bar, "screw": screw_lever, "ankle": partial(ankle, 0)}
    if name == "delta_cad":
        with TemporaryDirectory() as folder:
            hinged = of_hinges(hrsynth.load("delta"), aligned=True)
            return hrsynth.load(exported(hinged, Path(folder) / "delta.urdf", 6))
    if name not in own:
        return hrsynth.load(name)
    rng = np.random.default_rng(0)
    return transformed(own[name](), random_rotation(rng), rng.normal(size=3))


def start_carried_four_bar(name: str) -> Builder:
    """A four-bar on a cart with a motor, to which more is added."""
    b = Builder(name)
    for link in ("base", "cart", "crank", "coupler", "rocker"):
        b.link(link)
    b.joint("rail", "P", "base", "cart", (0, 0, 0), axis=(1, 0, 0), motor=True)
    b.joint("motor", "R", "cart", "crank", (0, 0, 0), axis=(0, 0, 1), motor=True)
    b.joint("knee", "R", "crank", "coupler", (0.2, 0.5, 0), axis=(0, 0, 1))
    b.joint("pivot", "R", "cart", "rocker", (1, 0, 0), axis=(0, 0, 1))
    b.joint("tip", "R", "coupler", "rocker", (1.2, 0.9, 0), axis=(0, 0, 1), loop=True)
    return b


def box_of(robot: Mechanism, half: float) -> dict[str, tuple[float, float]]:
    """A box of motors, half as wide as ``half`` rad or half characteristic lengths."""
    return {
        name: ((-half, half) if not joint.type.has_translation else (-half * robot.length, half * robot.length))
        for name, joint in robot.joints.items()
        if joint.is_actuated
    }


def inside(found: ExportedCode, count: int, seed: int = 0) -> Array:
    """Random motors in the proved box."""
    rng = np.random.default_rng(seed)
    q = np.zeros((count, len(found.proof.motors)))
    for part in found.proof.parts:
        q[:, [found.proof.motors.index(name) for name in part.motors]] = rng.uniform(
            *part.proved, (count, len(part.motors))
        )
    return q


@dataclass(frozen=True)
class Motors:
    """A task: motors at given coordinates."""

    values: Mapping[str, float]

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Error and Jacobian."""
        step = model.difference(model.q0, q)
        J, error = np.zeros((len(self.values), model.nv)), np.zeros(len(self.values))
        for k, (name, value) in enumerate(self.values.items()):
            unit = model.length if model.mechanism.joints[name].type.has_translation else 1.0
            (i,) = model.coordinates[name]
            J[k, i], error[k] = 1.0, step[i] - value / unit
        return error, J


def own_pose(model: PinocchioModel, motors: Mapping[str, float], steps: int = 6) -> Array:
    """The platform's pose (4, 4) by Pinocchio's model of the robot, led from zero in small steps."""
    q = model.q0
    for s in np.linspace(0, 1, steps + 1)[1:]:
        q, left = solve(
            model, q, Motors({name: s * value for name, value in motors.items()}), tolerance=1e-14, iterations=60
        )
        assert left < 1e-12
    return model.pose(q, model.mechanism.platform)


def module_of(code: str) -> ModuleType:
    """A generated module, run."""
    made = ModuleType("generated")
    exec(compile(code, "generated.py", "exec"), made.__dict__)
    return made


@cache
def eigen() -> Path:
    """The folder of Eigen's headers; the test is skipped where there is none or no compiler."""
    found = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include" / "eigen3"
    if shutil.which("g++") is None or not (found / "Eigen" / "Core").exists():
        pytest.skip("needs g++ and Eigen's headers (the wheel cmeel-eigen)")
    return found


def compiled(folder: Path, code: str, main: str, *flags: str) -> Path:
    """A program ``main`` with a generated header ``robot.hpp``, compiled; what the compiler says is an error."""
    include = eigen()
    (folder / "robot.hpp").write_text(code, encoding="utf-8")
    (folder / "main.cpp").write_text(main, encoding="utf-8")
    done = subprocess.run(
        ["g++", *FLAGS, *flags, f"-isystem{include}", "main.cpp", "-o", "main"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[:3000]
    return folder / "main"


def answered(program: Path, rows: Array) -> Array:
    """What a program prints for rows of numbers that it reads."""
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in rows)
    done = subprocess.run([program], input=f"{len(rows)}\n{text}\n", capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, (done.returncode, done.stderr[:2000], sys.platform)
    return np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()])


def ankle(seed: int) -> Mechanism:
    """A foot on a universal joint, moved by two cranks with rods, of random dimensions."""
    rng = np.random.default_rng(seed)
    b = Builder("ankle")
    for name in ("shank", "cross", "foot"):
        b.link(name)
    b.joint("pitch", "R", "shank", "cross", axis=(0, 1, 0))
    b.joint("roll", "R", "cross", "foot", axis=(1, 0, 0))
    for side, y, z in (("left", 1.0, 0.26), ("right", -1.0, 0.19)):
        hip, ball = (
            np.array(at) * rng.uniform(0.9, 1.1, 3) for at in ((-0.01, 0.045 * y, z), (-0.05, 0.04 * y, -0.01))
        )
        end = hip - np.array([0.045 * rng.uniform(0.9, 1.1), 0, 0])
        b.link(f"{side}_crank")
        b.link(f"{side}_rod")
        b.joint(f"{side}_motor", "R", "shank", f"{side}_crank", hip, axis=(0, 1, 0), motor=True)
        b.joint(f"{side}_top", "U", f"{side}_crank", f"{side}_rod", end, axis=(1, 0, 0), axis2=(0, 1, 0))
        b.joint(f"{side}_ball", "S", f"{side}_rod", "foot", ball, loop=True)
    return b.build(platform="foot")
