"""Legs of a U joint, a slide and a U joint (struts): where their joints lock, and the rotations at which a platform on
them translates.

Outer axes a (in the base) and a′ (in the platform) are parallel where the platform translates, inner ones b are
parallel, at right angles to a and to the rod. So the rod has the direction of its tip, except along a: there b may have
any direction at right angles to a, and no joint moves the tip along b. With the turn q about a and the rod at the angle
ε to it, E = E₀(s) + ε w · n(q) + O(ε²), n(q) at right angles to a. Such a place is an equilibrium where E₀ is critical
along the line of tips s a, and w · n(q) = 0. The Hessian by ε and q has the determinant −|w|², so none of them is
stable. Where two lines meet E is critical along curves: both rods turn about theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from ...analysis.observed import ObservedRobot
from ...closed_forms.platform_points import PlatformPoint
from ...geometry import lines
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import JointType
from ...results import Value
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL, SLIDING_ROD_LENGTH_MIN
from .joint_error import JointError, rodless
from .pose_error import ObservedDirection, PoseError

SHORT_ROD_BOX_FRACTION = 0.1
"""Fraction of the least distance of two base points up to which boxes around a short rod extend."""

Line = tuple[Array, Array]


@dataclass(frozen=True, eq=False, repr=False)
class Struts(Value):
    """The error of a platform that translates on struts alone: ``axes`` (legs, 3) are their outer ones; ``turns``
    (k, 3, 3) are all rotations from the goal's at which each leg's are parallel, the goal's first."""

    error: PoseError
    axes: Array
    turns: tuple[Array, ...]

    @classmethod
    def of(cls, setup: ObservedRobot, goal: ClosedConfiguration, error: PoseError) -> Struts | None:
        """None where a leg is something else, axes are not as they are to be, or two legs lock along one line."""
        mechanism, axes = setup.mechanism, list[Array]()
        if error.shifts.shape[1] != 3 or error.turns.shape[1] or len(error.limbs) != len(setup.decomposition.legs):
            return None
        for limb, leg in zip(error.limbs, setup.decomposition.legs, strict=True):
            joints = [mechanism.joints[name] for name in leg.joints]
            ends = [each for each in joints if each.type is JointType.UNIVERSAL]
            slides = [each for each in joints if each.type is JointType.PRISMATIC]
            if (len(joints), len(ends), len(slides)) != (3, 2, 1) or not (
                limb.slides and limb.axis is None and str(limb.label) == leg.label
            ):
                return None
            ends.sort(key=lambda each: mechanism.base not in each.links)
            outer, inner = zip(
                *(each.axes[:: 1 if each.predecessor in (mechanism.base, leg.platform_link) else -1] for each in ends),
                strict=True,
            )
            square = [slides[0].axis @ inner[0], *(a @ b for a, b in zip(outer, inner, strict=True))]
            turn = goal.pose(leg.platform_link)[:3, :3] @ mechanism.links[leg.platform_link].pose[:3, :3].T
            off = [np.cross(inner[0], inner[1]), np.cross(outer[0], turn @ outer[1])]
            if np.abs(square).max() > EXACT_INCIDENCE_TOL or np.abs(off).max() > HIDDEN_ROBOT_RESIDUAL_TOL:
                return None
            axes.append(outer[0])
        found = np.array(axes)
        struts = cls(error, found, tuple(parallel(found)))
        return None if any(map(has_coincident_lines, struts.lines)) else struts

    def turned(self, turn: Array) -> PoseError:
        """The error with the platform turned."""
        error = self.error
        offsets = [turn @ (limb.tip.constant + error.R @ limb.tip.turned) for limb in error.limbs]
        return replace(
            error,
            R=turn @ error.R,
            limbs=tuple(
                replace(limb, tip=PlatformPoint(True, np.zeros(3), offset))
                for limb, offset in zip(error.limbs, offsets, strict=True)
            ),
        )

    def whole(self) -> list[JointError]:
        """The error at all turns; a rod counts as short by how far apart the tips are at which rods have no length."""
        found = []
        for error in map(self.turned, self.turns):
            gap = min((float(np.linalg.norm(a - b)) for a, b in combinations(rodless(error), 2)), default=1.0)
            found.append(JointError.of(error, self.error, max(SHORT_ROD_BOX_FRACTION * gap, SLIDING_ROD_LENGTH_MIN)))
        return found

    def locked_errors(self) -> list[JointError]:
        """The error on the lines on which a rod lies along its leg's outer axes, at all turns."""
        found = []
        for error, i in product(map(self.turned, self.turns), range(len(self.axes))):
            axis = self.axes[i]
            seen = (
                ObservedDirection(each.leg, each.sense, None, PlatformPoint(False, np.zeros(3), each.sense * axis))
                if each.limb == i
                else each
                if each.limb is None
                else replace(each, limb=each.limb - (each.limb > i))
                for each in error.seen
            )
            line = replace(
                error,
                p=rodless(error)[i],
                shifts=axis[:, None],
                limbs=(*error.limbs[:i], *error.limbs[i + 1 :]),
                seen=tuple(seen),
            )
            found.append(JointError.of(line, self.error, 0.0))
        return found

    @property
    def lines(self) -> list[list[Line]]:
        """These lines at each turn, a point and a direction of each."""
        return [list(zip(rodless(error), self.axes, strict=True)) for error in map(self.turned, self.turns)]

    @property
    def crossings(self) -> int:
        """At how many points of the platform, at all turns, such lines meet."""
        return sum(len(meetings(each)) for each in self.lines)


def meetings(every: Sequence[Line]) -> list[Array]:
    """The points at which lines that are not parallel meet, each once."""
    found: list[Array] = []
    for pair in combinations(every, 2):
        point = lines.find_meeting_point(list(pair), HIDDEN_ROBOT_RESIDUAL_TOL)
        if point is not None and all(np.linalg.norm(point - other) > HIDDEN_ROBOT_RESIDUAL_TOL for other in found):
            found.append(point)
    return found


def has_coincident_lines(every: Sequence[Line]) -> bool:
    """Return True if two lines are one: two legs lock all along it, not only at points."""
    return any(
        lines.is_parallel(a, b) and lines.measure_line_distance(p, q, b) <= HIDDEN_ROBOT_RESIDUAL_TOL
        for (p, a), (q, b) in combinations(every, 2)
    )


def parallel(axes: Array) -> Iterator[Array]:
    """All rotations (3, 3) that carry each of some axes (n, 3) along itself, either way, the unit first; that alone
    where all are parallel, which leaves it any turn."""
    yield np.eye(3)
    if np.linalg.matrix_rank(axes, HIDDEN_ROBOT_RESIDUAL_TOL) < 2:
        return
    for signs in product((1.0, -1.0), repeat=len(axes)):
        wanted = np.array(signs)[:, None] * axes
        U, _, V = np.linalg.svd(wanted.T @ axes)
        turn = U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V
        if (
            np.abs(axes @ turn.T - wanted).max() < HIDDEN_ROBOT_RESIDUAL_TOL
            and np.trace(turn) < 3 - HIDDEN_ROBOT_RESIDUAL_TOL
        ):
            yield turn
