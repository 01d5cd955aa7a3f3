"""Draw figures of the glossary and of a tracked branch, each computed from the geometry of the five-bar ``rrrrr_m1``.

``python docs/figures.py [NAME ...]`` draws them (default: all). Angles are in radians, lengths in metres, directions
are given by their angles with the x axis.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

import hrsynth
from hrsynth.present.palette import PAGE, SERIES, get_colour, make_tint

Array = NDArray[np.float64]
FOLDER = Path(__file__).resolve().parent / "pictures"
OBSERVED, LEG, MODE, GOAL, TYPE2 = (get_colour(meaning) for meaning in ("observed", "leg", "mode", "goal", "actuator"))
ROBOT = hrsynth.load("rrrrr_m1")
A, B, C = (
    np.array([ROBOT.joints[name].point[:2] for name in names])
    for names in (("shoulder_1", "shoulder_2"), ("elbow_1", "elbow_2"), ("end",))
)
CRANK, ROD = np.linalg.norm(B - A, axis=1), np.linalg.norm(C - B, axis=1)
HOME = np.arctan2(*(B - A).T[::-1])
"""Angles of the cranks in the zero configuration."""
WORKING = (1, -1)
"""Signs of the working mode of the zero configuration: on which side of the line from A to the tip each elbow lies."""
BOX = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7}
DESIRED_POSE = np.array([0.02, 0.3])


def rotate_quarter(v: Array) -> Array:
    return np.stack([-v[..., 1], v[..., 0]], -1)


def intersect_circles(p: Array, r: float, q: Array, s: float, sign: int) -> Array:
    """Intersect two circles with centres p, q; nan where they do not meet."""
    d = np.linalg.norm(q - p, axis=-1, keepdims=True)
    along = (d**2 + r**2 - s**2) / (2 * d)
    with np.errstate(invalid="ignore"):
        height = np.sqrt(r**2 - along**2)
    return p + (along * (q - p) + sign * height * rotate_quarter(q - p)) / d


def solve_elbows(tip: Array, signs: tuple[int, int]) -> Array:
    """Compute the elbows B1, B2 (first axis) for a tip and a working mode."""
    return np.stack([intersect_circles(A[i], CRANK[i], tip, ROD[i], signs[i]) for i in (0, 1)])


def solve_tip(motors: Array) -> tuple[Array, Array]:
    """Compute elbows and tip for motor angles (last axis) in the assembly mode of the zero configuration."""
    elbows = np.stack(
        [A[i] + CRANK[i] * np.stack([np.cos(motors[..., i]), np.sin(motors[..., i])], -1) for i in (0, 1)]
    )
    return elbows, intersect_circles(elbows[0], ROD[0], elbows[1], ROD[1], 1)


def directions(elbows: Array, tip: Array) -> Array:
    v = tip - elbows
    return np.stack([np.arctan2(v[i, ..., 1], v[i, ..., 0]) for i in (0, 1)], -1)


DESIRED = directions(solve_elbows(DESIRED_POSE, WORKING), DESIRED_POSE)


def error(motors: Array) -> Array:
    """Compute the error e of the servo loop, sin(direction - desired direction) of both rods."""
    return np.sin(directions(*solve_tip(motors)) - DESIRED)


def error_jacobian(motors: Array, h: float = 1e-6) -> Array:
    return np.stack([(error(motors + h * s) - error(motors - h * s)) / (2 * h) for s in np.eye(2)], -1)


def run_loop(motors: Array, steps: int = 1500) -> Array:
    """Integrate the law that makes e decay, in steps of at most 0.01 rad, damped near Type 2 singularities."""
    path = [motors]
    for _ in range(steps):
        J = error_jacobian(path[-1])
        step = -0.05 * np.linalg.solve(J.T @ J + 1e-3 * np.eye(2), J.T @ error(path[-1]))
        path.append(path[-1] + step * min(1, 0.01 / max(np.linalg.norm(step), 1e-12)))
    return np.array(path)


def find_equilibria(starts: Array) -> list[tuple[Array, Array]]:
    """Find zeros of the gradient of E by Newton's method: motor angles, eigenvalues of the Hessian."""
    equilibria: list[tuple[Array, Array]] = []
    gradient = lambda q: error_jacobian(q).T @ error(q)  # noqa: E731
    for q in starts:
        for _ in range(40):
            H = np.stack([(gradient(q + 1e-5 * s) - gradient(q - 1e-5 * s)) / 2e-5 for s in np.eye(2)], -1)
            step = np.linalg.solve(H, gradient(q)) if np.isfinite(H).all() else q * np.nan
            q = q - step * min(1, 0.3 / max(np.linalg.norm(step), 1e-12))
            if not np.linalg.norm(step) > 1e-9:
                break
        q = (q + np.pi) % (2 * np.pi) - np.pi
        if np.linalg.norm(step) < 1e-8 and all(np.linalg.norm(q - known) > 1e-3 for known, _ in equilibria):
            equilibria.append((q, np.linalg.eigvalsh((H + H.T) / 2)))
    return equilibria


def draw_robot(axes: Axes, tip: Array, elbows: Array, strength: float = 1.0) -> None:
    """Draw cranks, rods (the observed segments) and tip."""
    for i in (0, 1):
        axes.plot(*np.array([A[i], elbows[i]]).T, color=make_tint(LEG, strength), lw=4, solid_capstyle="round")
        axes.plot(*np.array([elbows[i], tip]).T, color=make_tint(OBSERVED, strength), lw=2.5, solid_capstyle="round")
        axes.plot(*elbows[i], "o", color="white", mec=make_tint(LEG, strength), ms=5)
    axes.plot(*A.T, "s", color=PAGE["ink"], ms=6)


def label(axes: Axes, text: str, at: Array, offset: tuple[float, float], color: str = PAGE["ink"]) -> None:
    axes.annotate(text, at, offset, textcoords="offset points", color=color, fontsize=9, va="center", bbox=BOX)


def assembly_mode(axes: Axes) -> None:
    """Two poses with the same directions of both rods: the tip lies on two circles, one for each leg."""
    poses = [np.array([mode.pose.x, mode.pose.y]) for mode in hrsynth.modes(ROBOT, at="x=0.02,y=0.3").modes]
    u = ROD[:, None] * np.stack([np.cos(DESIRED), np.sin(DESIRED)], -1)
    for i in (0, 1):
        axes.add_patch(plt.Circle(A[i] + u[i], CRANK[i], fill=False, ls=":", lw=1, ec=PAGE["soft"]))
    for pose, strength in zip(poses, (1.0, 0.5), strict=True):
        draw_robot(axes, pose, pose - u, strength)
    axes.plot(*poses[0], "*", color=GOAL, ms=13)
    axes.plot(*poses[1], "D", color=MODE, ms=7)
    label(axes, "goal", poses[0], (10, 4))
    label(axes, "other assembly\nmode", poses[1], (10, -14))


def working_mode(axes: Axes) -> None:
    """Two working modes at one pose: leg 2 has its elbow on either side."""
    tip = np.array([0.0, 0.22])
    for signs, strength in (((1, 1), 0.5), (WORKING, 1.0)):
        draw_robot(axes, tip, solve_elbows(tip, signs), strength)
        label(axes, f"sign {signs[1]:+d}".replace("-", "\N{MINUS SIGN}"), solve_elbows(tip, signs)[1], (8, 0))
    axes.plot(*tip, "o", color=PAGE["ink"], ms=8)
    label(axes, "same pose", tip, (8, 8))


def aspect(axes: Axes) -> None:
    """Poses of one working mode, by the sign of the determinant of the interaction matrix."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 301), np.linspace(-0.36, 0.36, 361))
    tips = np.stack([x, y], -1)
    crank = solve_elbows(tips, WORKING) - A[:, None, None]
    determinant = crank[0, ..., 0] * crank[1, ..., 1] - crank[0, ..., 1] * crank[1, ..., 0]
    axes.contourf(x, y, determinant, [-1, 0, 1], colors=[make_tint(SERIES[0], 0.3), make_tint(SERIES[4], 0.4)])
    axes.contour(x, y, determinant, [0], colors=TYPE2, linewidths=2)
    label(axes, "aspect 1", np.array([-0.05, 0.2]), (0, 0))
    label(axes, "aspect 2", np.array([-0.05, -0.12]), (0, 0))
    label(axes, "aspect 3", np.array([0.03, 0.345]), (16, 0))
    label(axes, "Type 2", np.array([0.14, 0.0]), (0, -12), TYPE2)


def equilibrium(axes: Axes) -> None:
    """The equilibria of the loop over the motor angles, with level curves of E = |e|^2 / 2 and runs."""
    low, high = -0.75 * np.pi, 1.25 * np.pi
    q = np.stack(np.meshgrid(np.linspace(low, high, 121), np.linspace(low, high, 121)), -1)
    axes.contourf(*np.degrees(np.moveaxis(q, -1, 0)), 0.5 * (error(q) ** 2).sum(-1), 10, cmap="Greys_r", alpha=0.5)
    for start in ((-40.0, 150.0), (30.0, 215.0), (150.0, 120.0), (60.0, 0.0), (-40.0, 60.0), (-80.0, -20.0)):
        axes.plot(*np.degrees(run_loop(np.radians(start))[::20]).T, color=PAGE["ink"], lw=1.2)
        axes.plot(*start, "o", color="white", mec=PAGE["ink"], ms=4)
    for shift in (-180, 0, 180):
        axes.plot([-135, 225], [-135 + shift, 225 + shift], color=TYPE2, lw=1)
    label(axes, "Type 2", np.array([60.0, -120.0]), (6, 0), TYPE2)
    for point, curvatures in find_equilibria(np.random.default_rng(0).uniform(low, high, (300, 2))):
        at = np.degrees((point - low) % (2 * np.pi) + low)
        if np.linalg.norm(error(point)) < 1e-6:
            goal = np.allclose(solve_tip(point)[1], DESIRED_POSE, atol=1e-6)
            axes.plot(*at, "*" if goal else "D", color=GOAL if goal else MODE, ms=13 if goal else 7)
            label(axes, "goal" if goal else "assembly mode", at, (8, -6))
        elif curvatures[0] > 0:
            axes.plot(*at, "o", color=SERIES[1], ms=8)
            label(axes, "stable, nonzero error", at, (-66, 13))
        elif curvatures[1] > 0:
            axes.plot(*at, "x", color=PAGE["ink"], ms=7, mew=2)
            if np.linalg.norm(error(point)) < 0.9:
                label(axes, "saddle", at, (5, -11))
    axes.set(xlabel="motor 1 (degrees)", ylabel="motor 2 (degrees)", xlim=(-135, 225), ylim=(-135, 225))
    axes.set(xticks=[-90, 0, 90, 180], yticks=[-90, 0, 90, 180])


def branch(axes: Axes) -> None:
    """Closed configurations with motor 2 fixed, by motor 1 and the direction of rod 1: two curves that do not meet."""
    motors = np.stack([np.linspace(-np.pi, np.pi, 361), np.full(361, np.radians(160))], -1)
    elbows, above = solve_tip(motors)
    below = intersect_circles(elbows[0], ROD[0], elbows[1], ROD[1], -1)
    rods = [np.degrees(np.unwrap(directions(elbows, tip)[:, 0])) for tip in (above, below)]
    axes.plot(np.degrees(motors[:, 0]), rods[0], color=PAGE["ink"], lw=2)
    axes.plot(np.degrees(motors[:, 0]), rods[1], color=LEG, lw=2)
    axes.plot(0, rods[0][180], "o", color="white", mec=PAGE["ink"], mew=1.5, ms=7)
    label(axes, "zero configuration", np.array([0, rods[0][180]]), (6, -10))
    label(axes, "branch", np.array([-170, rods[0][10]]), (0, 24))
    label(axes, "not joined to zero", np.array([-170, rods[1][10]]), (0, 24), PAGE["soft"])
    axes.set(xlabel="motor 1 (degrees)", ylabel="direction of rod 1 (degrees)", xticks=[-180, -90, 0, 90, 180])


def toggle(axes: Axes) -> None:
    """The loop of the page on trackers: motor 1, room and speed against time, and the five-bar where it turns back."""
    page = (FOLDER.parent / "pages" / "export_a_controller.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "robot.hpp").write_text(hrsynth.export(ROBOT).code, encoding="utf-8")
        (here / "main.cpp").write_text(page.split("```cpp\n")[1].split("```")[0], encoding="utf-8")
        eigen = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include" / "eigen3"
        subprocess.run(["g++", "-std=c++17", f"-isystem{eigen}", "main.cpp", "-o", "main"], cwd=here, check=True)
        out = subprocess.run([here / "main"], capture_output=True, text=True, check=True).stdout
    cycle, _, motor, room, speed = np.array([line.split() for line in out.splitlines()], dtype=float).T
    for values, text, at, colour in (
        (10 * motor, "motor 1 (0.1 rad)", 270, PAGE["ink"]),
        (room, "room", 250, GOAL),
        (speed, "speed (rad/s)", 30, OBSERVED),
    ):
        axes.plot(cycle, values, color=colour)
        label(axes, text, np.array([cycle[at], values[at]]), (4, 8), colour)
    turns = np.stack([np.linspace(0, 1, 1001), np.zeros(1001)], -1)
    gap = np.linalg.norm(np.subtract(*solve_tip(HOME + turns)[0]), axis=-1)
    end = 10 * turns[np.argmax(gap > ROD.sum()), 0]
    axes.axhline(end, color=TYPE2, lw=1, ls="--")
    label(axes, "toggle", np.array([0, end]), (0, 8), TYPE2)
    axes.set(xlabel="time (ms)", ylim=(-2.5, 10), yticks=range(-2, 5))
    inset = axes.inset_axes((0.2, 0.6, 0.6, 0.4))
    elbows, tip = solve_tip(HOME + np.array([motor.max(), 0.0]))
    draw_robot(inset, *reversed(solve_tip(HOME)), 0.3)
    draw_robot(inset, tip, elbows)
    inset.set(aspect="equal")
    inset.axis("off")


FIGURES: dict[str, Callable[[Axes], None]] = {
    figure.__name__: figure for figure in (assembly_mode, working_mode, aspect, equilibrium, branch, toggle)
}


def draw(name: str) -> None:
    """Draw one figure to ``docs/pictures/glossary_NAME.svg``, or ``track_toggle.svg``."""
    with plt.style.context("hrsynth.present.style"), plt.rc_context({"svg.hashsalt": name}):
        figure, axes = plt.subplots(figsize=(3.6, 3.3), layout="constrained")
        FIGURES[name](axes)
        if not axes.get_xlabel():
            axes.set(aspect="equal", xticks=[], yticks=[])
            axes.axis("off")
        figure.savefig(FOLDER / f"{'track' if name == 'toggle' else 'glossary'}_{name}.svg", metadata={"Date": None})
        plt.close(figure)


if __name__ == "__main__":
    for name in sys.argv[1:] or FIGURES:
        draw(name)
