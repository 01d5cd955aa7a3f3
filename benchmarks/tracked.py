"""The table of trackers: how far they reach, and what a proof costs beside Newton's method without one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from generated import POSES, THEIRS, build, find_mujoco, name_space, write_robot, write_rows

from hrsynth.codegen.export import export
from hrsynth.description import load

ROBOTS = {
    "rrrrr_m1": 1.0,
    "3rrr_m1": 1.0,
    "3rps": 0.5,
    "delta": 1.0,
    "quattro": 0.4,
    "hexa": 0.5,
    "6pus": 0.5,
    "gough_stewart": 0.5,
}
"""Robots, and half the width of the boxes of their motors (rad, characteristic lengths)."""
STEP = 0.01
"""Largest step of a motor where times are measured (rad, characteristic lengths)."""
PROGRAM = """
#include "robot.hpp"
#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>
using namespace ROBOT;
using Block = detail::track_1::Block1;
std::mt19937 engine(0);
Motors draw(double size) {
  Motors q;
  std::uniform_real_distribution<> uniform(-size, size);
  for (int k = 0; k < MOTORS; ++k) q[k] = uniform(engine) * detail::UNIT_Q[k];
  return q;
}
void read(const Branch& at, const Motors& q, double* own, double* x) {
  const Solution here = at.at();
  for (int k = 0; k < MOTORS; ++k) own[k] = q[k] / detail::UNIT_Q[k];
  for (int i = 0; i < detail::UNKNOWNS; ++i) x[i] = here.passive[i] / detail::UNIT_X[i];
}
double least(const Branch& at, const Motors& q) {  // singular value of the first block's equations
  double own[MOTORS], x[detail::UNKNOWNS], J[Block::P * Block::E] = {};
  read(at, q, own, x);
  Block::slopes(own, x, J);
  return Eigen::Map<Eigen::Matrix<double, Block::P, Block::E>>(J).jacobiSvd().singularValues().minCoeff();
}
void tell(std::vector<double>& all, std::initializer_list<double> parts) {
  std::sort(all.begin(), all.end());
  for (double part : parts) std::printf("%.9g ", all.empty() ? 0.0 : all[std::size_t(part * (all.size() - 1))]);
}
template <class F>
double fastest(F work) {
  double best = 1e9;
  for (int turn = 0; turn < 30; ++turn) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 50; ++i) work(i);
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / 50);
  }
  return best;
}
int main(int, char** given) {
  const double half = std::atof(given[1]), small = std::atof(given[2]);
  Branch home;
  if (home.start() != Status::ok) return 2;
  std::vector<double> steps, singular;
  int reached = 0;
  for (int goal = 0; goal < GOALS; ++goal) {
    Branch at = home;
    const Motors end = draw(half);
    Motors q = Motors::Zero();
    Status status = Status::ok;
    const int pieces = std::ceil(half / small);
    for (int k = 1; k <= pieces && status <= Status::limit; ++k) {
      const Motors next = end * (double(k) / pieces);
      status = at.to(next);
      if (status <= Status::limit) q = next;
    }
    if (status <= Status::limit) ++reached;
    else singular.push_back(least(at, q));
    const Motors way = draw(1.0);
    double good = 0.0, size = 4.0;
    for (int k = 0; k < 24; ++k, size *= 0.5) {  // the largest box of one step, by bisection
      Branch ahead = at;
      ahead.to(q + (good + size) * way);
      if (ahead.room() > 0.0) good += size;
    }
    double most = 0.0;
    for (int k = 0; k < MOTORS; ++k) most = std::max(most, std::abs(way[k] / detail::UNIT_Q[k]));
    steps.push_back(good * most);
  }
  std::vector<Motors> near;
  for (int i = 0; i < 50; ++i) near.push_back(draw(small));
  const double proved = fastest([&](int i) {
    Branch at = home;
    if (at.to(near[i]) > Status::limit) std::abort();
  });
  const double plain = fastest([&](int i) {
    double own[MOTORS], x[detail::UNKNOWNS], from[MOTORS], Y[10000];
    read(home, Motors::Zero(), from, x);
    for (int k = 0; k < MOTORS; ++k) own[k] = near[i][k] / detail::UNIT_Q[k];
    if (!(CLOSE)) std::abort();
  });
  std::printf("%.9g ", double(reached) / GOALS);
  tell(steps, {0.0, 0.05, 0.5, 0.95});
  std::printf("%.9g %.9g ", proved, plain);
  tell(singular, {0.0, 0.5});
  std::printf("%d\\n", int(singular.size()));
}
"""
HEADER = (
    "robot, half of the box",
    "reached",
    "largest proved box, 0, 5, 50, 95 %",
    "`to`",
    "Newton",
    "`to` / Newton",
    "MuJoCo / `to`",
    "least singular value at refusal, least, median (goals)",
)


def _write_newton(code: str) -> str:
    """Newton's method in C++ for one block of equations after another."""
    blocks = re.findall(r"^struct (Block\d+)", code.split("\nnamespace track_")[1], re.MULTILINE)
    return "&&".join(f"detail::close<detail::track_1::{block}>(own,x,Y)" for block in blocks)


def tracked() -> Iterator[tuple[str, ...]]:
    """Rows of the table: random goals on straight lines from zero."""
    mujoco = find_mujoco()
    if mujoco is None:
        return
    for name, half in ROBOTS.items():
        robot = load(name)
        motors = [joint.name for joint in robot.joints.values() if joint.is_actuated]
        with TemporaryDirectory() as folder:
            here = Path(folder)
            code = export(robot).code
            write_robot(here, robot, code)
            own = [f"-DROBOT={name_space(name)}", f"-DCLOSE={_write_newton(code)}", "-DNDEBUG", "-DGOALS=300", "-O2"]
            found = build(here, PROGRAM, own, [str(half), str(STEP)])
            units = [robot.length if robot.joints[each].type.has_translation else 1.0 for each in motors]
            rows = STEP * np.random.default_rng(0).uniform(-1, 1, (POSES, len(motors))) * units
            flags = [f"-DMOTORS={len(motors)}", *mujoco]
            theirs = build(here, THEIRS, flags, [robot.platform, *motors], write_rows(rows))[0]
        reached, *steps, proved, plain, least, median, refused = found
        yield (
            f"{name}, {half:g}",
            f"{100 * reached:.0f} %",
            ", ".join(f"{each:.2g}" for each in steps),
            f"{1e6 * proved:.1f} µs",
            f"{1e6 * plain:.1f} µs",
            f"{proved / plain:.1f}",
            f"{theirs / proved:.1f}",
            f"{least:.1g}, {median:.1g} ({refused:.0f})" if refused else "–",
        )
