"""The table of what commands cost, on the page docs/pages/costs.md: ``python -m tables.costs``, from ``docs/``.

It is not among the tables that are made again each time: the figures are those of one machine, to one digit.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

from .markdown import rewrite, table

PAGE = Path(__file__).resolve().parents[1] / "pages" / "costs.md"
START = "<!-- generated: costs -->"
TIME_MAX_S = 120
"""Processor seconds after which a command is stopped; the table then has an inequality."""
ROBOTS = {
    "rrrrr_m1": ("0.02", "-0.02"),
    "quattro": ("0.05", "-0.05"),
    "gough_stewart": ("0.02", "-0.02"),
}
"""Robots, and x (m) of start and goal of their motions."""
COMMANDS = (
    "derive {robot}",
    "legs {robot}",
    "check {robot}",
    "advise {robot}",
    "modes {robot}",
    "accuracy {robot} --cone 0.1deg",
    "servo {robot} --start x={start} --goal x={goal}",
    "path {robot} --start x={start} --goal x={goal}",
    "singularities {robot}",
    "select {robot} --start x={start} --goal x={goal}",
    "branch {robot}",
    "export {robot}",
    "equilibria {robot}",
)
"""Command lines without limits of work, all legs observed."""


def make_table() -> str:
    """Return the Markdown table: processor seconds of each command on each robot, and the most memory."""
    return table(("command", *(f"`{name}`" for name in ROBOTS), "memory at most"), map(measure_row, COMMANDS), 1)


def measure_row(command: str) -> list[str]:
    """Return the row of a command."""
    costs = [measure(command.format(robot=robot, start=start, goal=goal)) for robot, (start, goal) in ROBOTS.items()]
    times = [f"> {TIME_MAX_S} s" if seconds is None else f"{round_to_digit(seconds)} s" for seconds, _ in costs]
    shown = command.partition(" {robot}")
    return [
        f"`{shown[0]}{shown[2].format(start='…', goal='…')}`",
        *times,
        f"{100 * round(max(m for _, m in costs) / 100)} MB",
    ]


def measure(command: str) -> tuple[float | None, float]:
    """Return processor time (s; None where it takes too long) and memory (MB) of a command, one thread."""
    limited = ["sh", "-c", f'ulimit -t {TIME_MAX_S}; exec "$@"', "sh"]
    process = subprocess.Popen(
        [*limited, sys.executable, "-m", "hrsynth", *shlex.split(command)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    _, status, used = os.wait4(process.pid, 0)
    print(f"{command}: {used.ru_utime + used.ru_stime:.2f} s, status {status}", file=sys.stderr)
    if status and (os.WIFEXITED(status) or used.ru_utime + used.ru_stime < 0.9 * TIME_MAX_S):
        raise SystemExit(f"hrsynth {command}: exit status {os.waitstatus_to_exitcode(status)}")
    return None if status else used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def round_to_digit(seconds: float) -> str:
    """Round seconds to one digit."""
    return f"{float(f'{seconds:.0e}'):g}"


if __name__ == "__main__":
    rewrite(PAGE, {START: make_table})
