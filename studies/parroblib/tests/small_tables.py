"""Small tables of symmetric robots in the form that the study reads, written for the tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

CHAINS: Mapping[str, Sequence[str]] = {
    "S3RRR1": ("R 0 0 q d1", "R 0 a2 q d2", "R 0 a3 q d3"),
    "S3PRP1": ("P pi/2 0 0 q", "R -pi/2 a2 q d2", "P pi/2 a3 0 q", "-pi/2"),
    "S4PRRR1": ("P 0 0 theta1 q", "R 0 a2 q d2", "R 0 a3 q d3", "R 0 a4 q d4"),
    "S5RRPRR1": ("R 0 0 q d1", "R pi/2 a2 q d2", "P 0 a3 theta3 q", "R 0 a4 q d4", "R pi/2 a5 q d5"),
    "S6RRPRRR1": ("R 0 0 q 0", "R pi/2 0 q 0", "P pi/2 0 0 q", "R 0 0 q 0", "R pi/2 0 q 0", "R pi/2 0 q 0"),
}
"""Chains, α a θ d of each joint, then the turn of the end about x if there is one: two planar ones, a slide with three
turns about its line, turns about two directions, U-P-S."""
ROBOTS: Mapping[str, Sequence[str]] = {
    "2T1R": ("P3RRR1G1P1 S3RRR1", "P3PRP1G1P1 S3PRP1"),
    "3T0R": ("P3PRRR1G2P2 S4PRRR1", "P3RRPRR1G1P1 S5RRPRR1"),
    "3T3R": ("P6RRPRRR1G2P1 S6RRPRRR1", "P6RRPRRR1G6P1 S6RRPRRR1"),
}
MOTORS = (
    "sym_2T1R P3RRR1G1P1A1 100 0",
    "sym_2T1R P3PRP1G1P1A1 100 0",
    "sym_2T1R P3PRP1G1P1A2 010 0",
    "sym_3T0R P3PRRR1G2P2A1 1000 1 a",
    "sym_3T0R P3RRPRR1G1P1A1 00100 0 a",
    "sym_3T3R P6RRPRRR1G2P1A1 001000 1",
    "sym_3T3R P6RRPRRR1G6P1A1 001000 0",
)
"""Choices of motors: those of a leg, the loss of rank, what free angles are. That of P3PRP1G1P1A2 is wrong: the turning
joints all turn as the platform does. P3RRPRR1G1P1 turns about the vertical too."""
TRIED = {"2T1R": ("S3RRR1;3;1;1;0;2", "S3PRP1;3;1;1;0;1"), "3T0R": ("S4PRRR1;3;2;2;0;0",)}


def chain(name: str, joints: Sequence[str]) -> str:
    """A row of a table of chains."""
    cells = []
    end = "0" if " " in joints[-1] else joints[-1]
    for i, joint in enumerate((each for each in joints if " " in each), 1):
        kind, *values = joint.split()
        values = [f"q{i}" if each == "q" else each for each in values]
        cells += [kind, "0", "0", *values, "0"]
    return ";".join([name, *cells, end, "0", "0", "1", "1", "1"])


def write(folder: Path) -> Path:
    """The tables, in a new folder."""
    for name in ("chains", "robots", "synthesis"):
        (folder / name).mkdir(parents=True)
    for name, joints in CHAINS.items():
        (folder / "chains" / f"{name[:-1]}.csv").write_text(f"Name;Joint 1\n;Type;beta\n{chain(name, joints)}\n")
    for group, robots in ROBOTS.items():
        rows = [f"{robot.replace(' ', ';')};?" for robot in robots]
        (folder / "robots" / f"sym_{group}_list.csv").write_text("\n".join(["Name;Chain;Joints", *rows]) + "\n")
    (folder / "robots" / "actuation.csv").write_text("\n".join(map(_motors, MOTORS)) + "\n")
    for group, tried in TRIED.items():
        (folder / "synthesis" / f"{group}.csv").write_text("\n".join(["Chain;Legs;G;P;Status;Number", *tried]) + "\n")
    return folder


def _motors(row: str) -> str:
    group, name, driven, loss, *angles = row.split()
    return ";".join([group, name, *list(driven) * int(name[1]), loss, "".join(angles)])
