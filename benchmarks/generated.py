"""Lines of the table: generated code for controllers, against MuJoCo and Pinocchio with the same result."""

from __future__ import annotations

import shutil
import subprocess
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np
from measure import Row, least

from hrsynth.codegen.export import export
from hrsynth.description import load
from hrsynth.description.formats.mjcf.write import write
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Mechanism

POSES = 2000
"""Motor coordinates of the comparison."""
ROBOTS = {"rrrrr_m1": 0.05, "3rrr_m1": 0.02}
"""Robots, and half the width of their boxes (rad)."""
EIGEN = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include" / "eigen3"
OURS = """
#include "robot.hpp"
#include <chrono>
#include <cstdio>
using namespace ROBOT;
int main() {
  static double rows[POSES][MOTORS];
  for (auto& row : rows) for (double& q : row) if (std::scanf("%lf", &q) != 1) return 2;
  Solution at;
  Jacobians rates;
  double best[2] = {1e9, 1e9};
  for (int turn = 0; turn < 20; ++turn)
    for (int both = 0; both < 2; ++both) {
      const auto start = std::chrono::steady_clock::now();
      for (auto& row : rows) {
        const Motors q = Eigen::Map<const Motors>(row);
        if ((both ? jacobians(q, at, rates) : forward(q, at)) != Status::ok) return 3;
      }
      const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (spent < best[both]) best[both] = spent;
    }
  std::printf("%.9g %.9g %.17g %.17g %.17g\\n", best[0] / POSES, best[1] / POSES, at.position[0], at.position[1],
              at.position[2]);
}
"""
THEIRS = """
#include <mujoco/mujoco.h>
#include <Eigen/Dense>
#include <chrono>
#include <cstdio>
#include <vector>
int main(int, char** names) {
  char error[500];
  mjModel* m = mj_loadXML("robot.xml", nullptr, error, 500);
  if (!m) { std::fprintf(stderr, "%s\\n", error); return 2; }
  m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_LIMIT;
  m->opt.jacobian = mjJAC_DENSE;
  mjData* d = mj_makeData(m);
  std::vector<int> motors, passive;
  for (int k = 0; k < MOTORS; ++k) motors.push_back(m->jnt_dofadr[mj_name2id(m, mjOBJ_JOINT, names[k + 2])]);
  for (int i = 0; i < m->nv; ++i) {
    bool driven = false;
    for (int k : motors) driven = driven || k == i;
    if (!driven) passive.push_back(i);
  }
  static double rows[POSES][MOTORS];
  for (auto& row : rows) for (double& q : row) if (std::scanf("%lf", &q) != 1) return 2;
  std::vector<double> step(m->nv);
  double best = 1e9;
  for (int turn = 0; turn < 5; ++turn) {
    const auto start = std::chrono::steady_clock::now();
    for (auto& row : rows) {
      mju_copy(d->qpos, m->qpos0, m->nq);
      for (int k = 0; k < MOTORS; ++k) d->qpos[m->jnt_qposadr[m->dof_jntid[motors[k]]]] += row[k];
      double size = 1;
      for (int k = 0; k < 30 && size > 1e-12; ++k) {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_makeConstraint(m, d);
        Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> J(d->efc_J, d->nefc, m->nv);
        Eigen::Map<const Eigen::VectorXd> r(d->efc_pos, d->nefc);
        Eigen::MatrixXd A(d->nefc, passive.size());
        for (std::size_t i = 0; i < passive.size(); ++i) A.col(i) = J.col(passive[i]);
        const Eigen::VectorXd x = A.completeOrthogonalDecomposition().solve(-r);
        std::fill(step.begin(), step.end(), 0.0);
        for (std::size_t i = 0; i < passive.size(); ++i) step[passive[i]] = x[i];
        mj_integratePos(m, d->qpos, step.data(), 1);
        size = x.cwiseAbs().maxCoeff();
      }
      mj_kinematics(m, d);
    }
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (spent < best) best = spent;
  }
  const double* p = d->xpos + 3 * mj_name2id(m, mjOBJ_BODY, names[1]);
  std::printf("%.9g %.17g %.17g %.17g\\n", best / POSES, p[0], p[1], p[2]);
}
"""


def generated() -> Iterator[Row]:
    """Motors to the platform's pose, from the same start each time, to 1e-12."""
    mujoco = find_mujoco()
    if mujoco is None:
        return
    for name, half in ROBOTS.items():
        robot = load(name)
        motors = [joint.name for joint in robot.joints.values() if joint.is_actuated]
        box = dict.fromkeys(motors, (-half, half))
        rows = np.random.default_rng(0).uniform(-half, half, (POSES, len(motors)))
        given = write_rows(rows)
        with TemporaryDirectory() as folder:
            here = Path(folder)
            write_robot(here, robot, export(robot, box=box, jumps=True).code)
            ours = build(here, OURS, [f"-DROBOT={name_space(name)}", "-DNDEBUG"], [], given)
            found = build(here, THEIRS, [f"-DMOTORS={len(motors)}", *mujoco], [robot.platform, *motors], given)
        (forward, both, *p), (theirs, *other) = ours, found
        if not np.allclose(p, other, atol=1e-9):
            raise SystemExit(f"{name}: platforms at {p} and {other}")
        what = f"motors to platform, {name}, one at a time"
        yield (
            what,
            f"generated C++: {1e6 * forward:.2f} µs (with Jacobians {1e6 * both:.2f} µs)",
            f"MuJoCo on the written MJCF, Newton's method with Eigen: {1e6 * theirs:.1f} µs",
            f"{theirs / forward:.0f}",
        )
        made = ModuleType("made")
        exec(export(robot, "python", box).code, made.__dict__)
        model = PinocchioModel(robot)
        few = rows[:200]
        batch, loop = least(
            lambda q=rows, made=made: made.forward(q),
            lambda q=few, model=model, motors=motors: [_pinocchio(model, motors, each) for each in q],
        )
        gap = max(np.abs(made.forward(each)[3] - _pinocchio(model, motors, each)).max() for each in few[:20])
        if not gap < 1e-9:
            raise SystemExit(f"{name}: platforms differ by {gap:.2g} m")
        yield (
            f"motors to platform, {name}, {POSES} together",
            f"generated NumPy: {1e6 * batch / POSES:.1f} µs a pose",
            f"a loop over Pinocchio from Python: {1e6 * loop / len(few):.0f} µs",
            f"{loop / len(few) / (batch / POSES):.0f}",
        )


def write_rows(rows: Array) -> str:
    """Motor coordinates as the programs read them."""
    return "\n".join(" ".join(map(repr, map(float, row))) for row in rows)


def write_robot(folder: Path, robot: Mechanism, code: str) -> None:
    """Generated code, and the robot for MuJoCo."""
    (folder / "robot.hpp").write_text(code)
    (folder / "robot.xml").write_text(write(robot).texts[0])


def find_mujoco() -> list[str] | None:
    """How a compiler is told of MuJoCo; None where it, Eigen or the compiler is missing."""
    packages = Path(sysconfig.get_paths()["purelib"])
    libraries = sorted((packages / "mujoco").glob("libmujoco.so*"))
    if shutil.which("g++") is None or not EIGEN.exists() or not libraries:
        return None
    return [f"-isystem{packages / 'mujoco' / 'include'}", str(libraries[0]), f"-Wl,-rpath,{packages / 'mujoco'}"]


def build(folder: Path, text: str, flags: list[str], arguments: list[str], given: str = "") -> list[float]:
    """What a program prints, compiled in a folder."""
    (folder / "main.cpp").write_text(text)
    first = ["g++", "-std=c++17", "-O3", "-march=native", f"-DPOSES={POSES}", f"-isystem{EIGEN}", "main.cpp"]
    subprocess.run([*first, *flags, "-o", "main"], cwd=folder, check=True)
    done = subprocess.run(["./main", *arguments], cwd=folder, input=given, capture_output=True, text=True, check=True)
    return [float(x) for x in done.stdout.split()]


def name_space(robot: str) -> str:
    return f"_{robot}" if robot[0].isdigit() else robot


def _pinocchio(model: PinocchioModel, motors: list[str], values: Array) -> Array:
    """The platform's position (3,) by Newton's method on Pinocchio's constraints, from zero."""
    driven = [i for name in motors for i in model.coordinates[name]]
    passive = [i for i in range(model.nv) if i not in driven]
    step = np.zeros(model.nv)
    step[driven] = values
    q = model.integrate(model.q0, step)
    for _ in range(30):
        x = np.linalg.lstsq(model.jacobian(q)[:, passive], -model.residual(q), rcond=1e-9)[0]
        step = np.zeros(model.nv)
        step[passive] = x
        q = model.integrate(q, step)
        if np.abs(x).max() <= 1e-12:
            break
    return np.asarray(model.pose(q, model.mechanism.platform)[:3, 3])
