"""Proved branch of a robot: cells of motor coordinates with affine tubes, their adjacency, and the ends of the
proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...equations.joint_equations import LoopSystem
from ...geometry.vectors import Array
from ...mechanism import Mechanism
from ...records import As, Number, Recorded, Shown, Table, recorded
from ...results import Result, Value

KEPT, PASSED, OPEN, UNSEEN = "kept", "passed", "undecided", "not looked at"
"""Verdict on a joint limit over the cells."""
BACK = "low and high of a box of all motors: no two motor positions in it give the same pose on the branch (proved)"


@dataclass(frozen=True, eq=False, repr=False)
class BranchCell(Value, all_recorded=True):
    """A cell low ≤ q ≤ high (n,) of a part's motors, and the tube |x − centre − slopes (q − middle)| ≤ radius (p,) of
    its passive coordinates that contains exactly one closure for every q of the cell (m, rad).

    The radius of a joint that only turns a rod is infinite where it is not proved to have one value.
    ``weakest`` is a lower bound over the tube of the smallest singular value of D_xG (characteristic lengths, radians;
    the smallest over its triangular blocks); ``neighbours`` are the numbers of the cells with a common face in which
    the closure is proved to be the same.
    """

    low: Annotated[Array, list[float]]
    high: Annotated[Array, list[float]]
    centre: Annotated[Array, list[float]]
    slopes: Annotated[Array, Table, "one row per passive coordinate, one column per motor"]
    radius: Annotated[Array, list[float | None], "null: not proved to have one value (a joint that turns a rod)"]
    smallest_singular_value: Annotated[
        float, "lower bound of the smallest singular value of the loop Jacobian over the tube"
    ]
    neighbours: Annotated[tuple[int, ...], "cells with a common face and the same closure there (proved)"] = ()

    @property
    def middle(self) -> Array:
        """The cell's middle (n,)."""
        return np.asarray((self.low + self.high) / 2)

    def has_motor_values(self, q: Array) -> bool:
        """Return True if motor coordinates (n,) lie in the cell."""
        return bool(np.all(self.low <= q) and np.all(q <= self.high))

    def at(self, q: Array) -> Array:
        """The middle of the tube (p,) for motor coordinates (n,): within ``radius`` of the closure."""
        return np.asarray(self.centre + self.slopes @ (q - self.middle))


@dataclass(frozen=True, eq=False, repr=False)
class Toggle(Value, all_recorded=True):
    """End of the proof, in floating point: motors ``q`` (n,) of a part at which the ``joints`` can move,
    numerically, while all motors are fixed (a determinant vanishes); ``loops`` are those that they close. Without
    joints: no such configuration was found, and the proof was given up for its ``reason``."""

    q: Annotated[Array, list[float], As("motors")]
    joints: tuple[str, ...]
    loops: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class BranchLimit(Value, all_recorded=True):
    """A joint without a motor, its limits (m, rad; both None: the cone of a ball), its least and largest coordinate in
    the proved cells to a tube's radius (None if its loop is cut there), and the verdict: ``kept`` (proved), ``passed``
    (proved: beyond them somewhere in the cells), ``undecided``, ``not looked at``."""

    joint: str
    lower: float | None
    upper: float | None
    least: Annotated[float | None, "null if its loop is cut there, or it is not proved to have one value"]
    most: float | None
    verdict: Annotated[str, Literal["kept", "passed", "undecided", "not looked at"], "kept and passed are proved"]

    @property
    def words(self) -> str:
        """The joint with its limits, and its range."""
        limits = self.joint if self.lower is None else f"{self.joint} {self.lower:.6g} to {self.upper:.6g}"
        return limits if self.least is None else f"{limits} (within {self.least:.4g} to {self.most:.4g})"


@dataclass(frozen=True, eq=False, repr=False)
class BranchPart(Value):
    """Motors and the passive coordinates that follow from them alone, with the cells in which that is proved; ``cells``
    are connected to the zero configuration, which the first contains. ``asked``, ``proved``: boxes, low and high (n,)
    each; ``share``: volume of all cells, as a share of the requested box; ``box_fraction`` that of ``proved``, the
    largest box about the zero configuration that was found in their union. ``turns``: for each motor whose box is a
    whole turn proved from end to end, whether the closure at the end is that of the beginning."""

    motors: Recorded[tuple[str, ...]]
    passive: Recorded[tuple[str, ...]]
    q0: Annotated[Array, list[float]]
    x0: Annotated[Array, list[float]]
    requested_box: Annotated[tuple[Array, Array], Table, "low and high of the requested box"]
    proved: Annotated[
        tuple[Array, Array], Table, "low and high of a box about the zero configuration in the union of the cells"
    ]
    volume_fraction: Annotated[float, "volume of all cells, as a fraction of the box"]
    box_fraction: Recorded[float]
    cells: Recorded[tuple[BranchCell, ...]]
    toggles: Recorded[tuple[Toggle, ...]]
    turns: tuple[tuple[str, bool], ...]
    closed_to: Annotated[float, "residual bound of the redundant equations (characteristic lengths, radians)"]
    """Bound of the redundant equations, over all tubes; 0 if they are proved to hold."""
    redundant: Recorded[str]
    """Reason why the redundant equations hold; empty without any."""

    @property
    def in_cells(self) -> str:
        """Number of cells in words."""
        return f"{len(self.cells)} cell" + "s" * (len(self.cells) != 1)

    @property
    def percent(self) -> str:
        """The share in per cent, never rounded up to all of it."""
        return "100" if self.volume_fraction == 1.0 else f"{min(100 * self.volume_fraction, 99.9):.3g}"

    @property
    def unsure(self) -> tuple[str, ...]:
        """The coordinates that are not proved to have one value in all cells: of joints that only turn rods."""
        sure = np.all([np.isfinite(cell.radius) for cell in self.cells], axis=0)
        return tuple(name for name, each in zip(self.passive, sure, strict=True) if not each) if self.cells else ()

    def place(self, q: Array) -> str:
        """Motor coordinates (n,) in words."""
        return ", ".join(f"{name}={value:.4g}" for name, value in zip(self.motors, q, strict=True))

    def find(self, q: Sequence[float] | Array) -> BranchCell | None:
        """The cell that contains motor coordinates (n,), in the order of ``motors``; None outside of what is proved."""
        at = np.asarray(q, dtype=float)
        return next((cell for cell in self.cells if cell.has_motor_values(at)), None)

    turns_record = Shown(
        dict[str, bool],
        lambda self: dict(self.turns),
        As("turns"),
        "true if the closure after a full turn is that before it",
    )


class MotorBeyond(NamedTuple):
    """A motor that the proved cells take beyond its limits in the file, these, and its range in the cells (m, rad)."""

    motor: str
    lower: Number
    upper: Number
    least: float
    most: float


@dataclass(frozen=True, eq=False, repr=False)
class BranchProof(Result, shown_as="branch"):
    """Proved branch of the zero configuration: q ↦ x from motors to passive coordinates, part by part.

    All coordinates count from the zero of the file.

    Parameters
    ----------
    robot
        Mechanism as read.
    system
        Coordinates (name, axis, point, parent: the tree in order) and loop equations, in units of ``system.length`` m.
    motors, passive
        Names of the motor coordinates and of the passive coordinates that follow from them.
    fixed
        Names of the coordinates of internal motions, which are constant.
    parts
        Parts of the loops with their cells (m, rad).
    injective_box
        Box of all motors (m, rad), low and high (n,) each, in which no two motor positions give the same pose (proved);
        None without a proof.
    regular
        True if the proved box is proved to contain no Type 1 singularity.
    box
        Origin of the box: the limits of the file, the caller, a default.
    tried
        Number of cells that were tried.
    limits
        Limits of the joints without a motor.
    safe_box
        Box of all motors (m, rad), low and high (n,) each, with all examined joints within their limits (proved).
    """

    robot: Mechanism
    system: LoopSystem
    motors: Recorded[tuple[str, ...]]
    passive: Recorded[tuple[str, ...]]
    fixed: Recorded[tuple[str, ...]]
    parts: Recorded[tuple[BranchPart, ...]]
    injective_box: Annotated[tuple[Array, Array] | None, Table | None, f"{BACK}, or null"]
    """Box of all motors (m, rad), low and high (n,) each, about the zero configuration, in which different motor values
    are proved to give different poses; None without a proof."""
    regular: Annotated[bool, "true if the proved box has no Type 1 singularity (proved)"]
    """True if the proved box is proved to contain no Type 1 singularity."""
    box: Recorded[str]
    """Origin of the box: the limits of the file, the caller, a default."""
    tried: Recorded[int]
    """Cells that were tried."""
    limits: Recorded[tuple[BranchLimit, ...]]
    """The limits of joints without a motor."""
    safe_box: Annotated[
        tuple[Array, Array] | None,
        Table | None,
        "low and high of a box of all motors about the zero configuration within the limits of all joints examined "
        "(proved), or null",
    ] = None
    """Box of all motors (m, rad), low and high (n,) each, in the proved box (where that may have Type 1 singularities:
    in the injective box), in which all examined joints are proved to be within their limits."""

    @property
    def setup(self) -> Mechanism:
        """The robot: what is compared besides the record."""
        return self.robot

    @property
    def fixed_at(self) -> dict[str, float]:
        """Constant values of the coordinates of internal motions (m, rad)."""
        system = self.system
        every = dict(zip(system.names, (system.zero * system.units).tolist(), strict=True))
        return {name: every[name] for name in self.fixed}

    @property
    def proved(self) -> tuple[Array, Array]:
        """The boxes of all parts together, low and high in the order of ``motors``; infinite for motors in no loop."""
        found = np.full((2, len(self.motors)), np.inf) * [[-1], [1]]
        for part in self.parts:
            found[:, [self.motors.index(name) for name in part.motors]] = part.proved
        return found[0], found[1]

    def limits_in_words(self) -> list[str]:
        """Results for the limits of joints without a motor."""
        says = {
            KEPT: "satisfied in all proved cells (proved)",
            PASSED: "exceeded in the proved cells",
            OPEN: "not proved to be satisfied",
            UNSEEN: "not examined (S joints, and joints at which loops are cut)",
        }
        told = {verdict: [each.words for each in self.limits if each.verdict == verdict] for verdict in says}
        return [f"{says[verdict]}: {', '.join(names)}" for verdict, names in told.items() if names]

    def motors_beyond(self) -> list[str]:
        """The motors that the cells take beyond the file's limits, with these."""
        return [
            f"{name} {lower:.6g} to {upper:.6g} (within {low:.4g} to {high:.4g})"
            for name, lower, upper, low, high in self.beyond
        ]

    @property
    @recorded(As("motors_beyond"))
    def beyond(self) -> list[MotorBeyond]:
        """The motors that the cells take beyond the file's limits."""
        reach: dict[str, tuple[float, float]] = {}
        for part in (each for each in self.parts if each.cells):
            low = np.min([each.low for each in part.cells], axis=0)
            high = np.max([each.high for each in part.cells], axis=0)
            reach |= dict(zip(part.motors, zip(low.tolist(), high.tolist(), strict=True), strict=True))
        limited = self.robot.filed
        return [
            MotorBeyond(name, *limited[name], low, high)
            for name, (low, high) in reach.items()
            if name in limited and (low < limited[name][0] or high > limited[name][1])
        ]

    def headline(self) -> str:
        """The robot, and how much of the box is proved."""
        return f"{self.robot.name}, {len(self.motors)} motors, {len(self.passive)} passive coordinates: " + "; ".join(
            f"{', '.join(each.motors)}: {each.percent} % of the box proved, {each.in_cells}" for each in self.parts
        )
