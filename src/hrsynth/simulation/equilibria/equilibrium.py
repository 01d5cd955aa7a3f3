"""Results of a search for equilibria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...analysis.modes.modes import AssemblyModes
from ...analysis.observed import ObservedRobot
from ...geometry.vectors import Array
from ...kinematics.assembly import ASSEMBLED, BEYOND
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import OfConfiguration
from ...mechanism.pose import Pose
from ...records import FLAT, As, Number, Record, Recorded, Shown, recorded
from ...results import Result, Value
from ...tolerances import CRITICAL_POINT_DISTANCE_TOL
from ..law import Measures
from .exhaustive_search import SubdivisionResult, join_boxes
from .search import CriticalPoints

CRITICAL = "critical"
Stability = Literal["stable", "saddle", "unstable", "undecided"]
STABLE, SADDLE, UNSTABLE, UNDECIDED = "stable", "saddle", "unstable", "undecided"
MOST_JOINED, PLACES_TOLD = 5000, 4
"""Largest number of undecided boxes that are grouped by place, and largest number of places."""


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(OfConfiguration, Record):
    """Equilibrium of the servo loop: ``kind`` goal, assembly mode, antipodal or critical (‖e‖ = ``error`` > 0 and no
    command); ``stability`` stable (attracting), saddle, unstable (repelling) or undecided. ``curvatures`` are the
    eigenvalues of the Hessian of ½ ‖e‖² along the motions of the loops (characteristic lengths, radians), ascending.

    It is the only one in a box of joint coordinates, within ``shift`` (m) and ``turn`` (rad) of ``pose``; these are
    infinite if it was only found. Others may have the same pose in other working modes. ``decided``: the signs of the
    curvatures are proved. ``reversed`` are legs whose direction is opposite to the desired one, ``orthogonal_legs``
    those at a right angle to it. ``singular`` is the reason why fewer velocities are measured there than at other
    poses, None if all are; ``boundary``: that reason is a leg's reach. The linearised loop without damping has the
    eigenvalues −gain · ``convergence_rates``, each enclosed, 1 at all poses where the error vanishes (empty if not
    proved, or if fewer velocities are measured). ``side`` is the side of the Type 2 locus of the hidden robot: ``goal``
    that of the goal, ``other`` another aspect, None if the condition has no sign, or vanishes.

    ``assembly`` is ``beyond limits`` if joints (``beyond_limits``) are outside their limits, else ``yes``;
    ``legs_in_other_mode`` are in another working mode than at the goal (None if unknown); ``working_modes`` is the
    number of working modes in which it was found, ``hits`` the number of starts that led to it.
    """

    pose: Recorded[Pose]
    kind: Annotated[str, Literal["goal", "assembly mode", "antipodal", "critical"]]
    stability: Annotated[str, Stability]
    error: Recorded[float]
    curvatures: Annotated[tuple[float, ...], "eigenvalues of the Hessian of ½ ‖e‖²"]
    configuration: ClosedConfiguration
    shift: Annotated[float, Number, As("radius_m")] = np.inf
    turn: Annotated[float, Number, As("radius_rad")] = np.inf
    decided: Recorded[bool] = False
    convergence_rates: Annotated[
        tuple[tuple[float, float], ...], "intervals of the linearised loop's eigenvalues, times −1 / gain"
    ] = ()
    side: Annotated[str | None, Literal["goal", "other"] | None, "side of the Type 2 locus"] = None
    reversed: Recorded[tuple[str, ...]] = ()
    orthogonal_legs: Recorded[tuple[str, ...]] = ()
    singular: Recorded[str | None] = None
    boundary: Recorded[bool] = False
    beyond_limits: Recorded[tuple[str, ...]] = ()
    legs_in_other_mode: Recorded[tuple[str, ...] | None] = None
    hits: Annotated[int, "number of starts that led to it"] = 0
    working_modes: Recorded[int] = 1

    @property
    @recorded()
    def proved(self) -> bool:
        """True if it is enclosed."""
        return bool(np.isfinite(self.shift))

    @property
    @recorded(Literal["yes", "beyond limits"])
    def assembly(self) -> str:
        """Assembly of the whole robot there."""
        return BEYOND if self.beyond_limits else ASSEMBLED

    @property
    @recorded()
    def stable(self) -> bool | None:
        """True if it is stable; null if that is not decided."""
        return None if self.stability == UNDECIDED else self.stability == STABLE

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.kind}, {self.stability}, {self.pose}>"


@dataclass(frozen=True, eq=False, repr=False)
class SignedModes(Value):
    """Poses with zero error, the directions of the legs ``reversed`` opposite to the desired ones: the list of all
    modes with these, None if it could not be computed or none was met; ``boxes`` is the number of such poses proved
    by boxes, None if they prove nothing, in ``turns`` rotations of a platform that translates (lists of modes cover
    that of the goal)."""

    reversed: Recorded[tuple[str, ...]]
    listed: AssemblyModes | None
    boxes: Recorded[int | None] = None
    turns: int = 1

    @property
    @recorded()
    def complete(self) -> bool:
        """True if the list is proved to be all."""
        return self.boxes is not None or (self.listed is not None and self.listed.found.complete)

    @property
    def is_proved_empty(self) -> bool:
        """Return True if boxes prove that no pose has zero error with exactly these legs reversed (a translating
        platform: in the rotations searched)."""
        return self.boxes == 0

    modes = Shown(int | None, lambda self: self.boxes if self.listed is None else len(self.listed.modes))

    @property
    @recorded()
    def complex(self) -> int | None:
        """Number of such poses, complex ones included; null if unknown."""
        return None if self.listed is None or self.listed.found.continuous_family else self.listed.found.complex


@dataclass(frozen=True, eq=False, repr=False)
class ProvedCriticalPoint(Value, all_recorded=True):
    """Pose about which boxes prove exactly one critical point of E, ‖e‖ in ``error``, that is not in the list of
    equilibria: the robot was not closed there, or the computed command does not vanish, as where joints lock or nearly
    do. So it may be no equilibrium. ``pose`` contains only the point from which boxes count if the platform's rotation
    follows from it."""

    pose: Pose
    stability: Annotated[str, Stability]
    error: tuple[float, float]


class LockedRegion(NamedTuple):
    """Position ``p`` (m) of the platform's point near which legs may lock each other; nothing was searched within this
    distance of it."""

    p: Annotated[Array, list[float]]
    within_m: float


@dataclass(frozen=True, eq=False, repr=False)
class CompletenessReport(Value):
    """Completeness of a list of equilibria by boxes of platform poses: result of the subdivision
    (:class:`SubdivisionResult`), its critical points that are not in the list (``only_proved``), and the number of
    isolated equilibria in its box that are not among its critical points (``only_found``). ``within`` (m) is the extent
    of the box about the goal if the legs do not bound it, else None; sliding rods that are ``shorter`` (m) were not
    searched for, None if there are none. ``turned`` equilibria of the list are at poses at which a platform that only
    translates has another rotation, which were not searched, and ``outside_searched`` equilibria of the list in all lie
    where nothing was searched."""

    result: Annotated[SubdivisionResult, FLAT]
    only_proved: Recorded[tuple[ProvedCriticalPoint, ...]]
    only_found: Recorded[int]
    within: Annotated[float | None, As("within_m"), "extent of the box about the goal; null if the legs bound it"]
    shorter: Annotated[
        float | None, As("shorter_m"), "length of sliding rods below which nothing was searched; null if none"
    ] = None
    rotated_outside: Recorded[int] = 0
    outside_searched: Recorded[int] = 0

    @property
    @recorded()
    def crossings(self) -> int:
        """Number of points of a platform on struts at which equilibria form curves, because the joints of two legs
        lock."""
        return 0 if self.result.struts is None else self.result.struts.crossings

    @property
    @recorded()
    def unstretched(self) -> tuple[str, ...] | None:
        """Unobserved legs, if equilibria were searched only while none of them is stretched; null if they were searched
        everywhere."""
        return None if self.result.loop is None else tuple(str(each.label) for each in self.result.loop.idle)

    @property
    @recorded()
    def orthogonal_directions(self) -> int | None:
        """Number of observed directions at right angles to the desired ones at which equilibria were not searched."""
        return None if self.result.loop is None else self.result.loop.flat

    @property
    @recorded()
    def complete(self) -> bool:
        """True if the list and ``only_proved`` hold all equilibria in the box."""
        return self.result.is_complete and not self.only_found

    @property
    def reason(self) -> str:
        """Reason for incompleteness, if known; else empty."""
        cover = self.result
        if cover.reason:
            return cover.reason
        if cover.open:
            more = f"; {cover.boxes:,} were processed; increase --max-boxes" if cover.spent else ""
            return f"{len(cover.open):,} boxes, {cover.share:.2g} of all, are undecided{self._where()}{more}"
        if self.only_found:
            return f"{self.only_found} of the list are not among those proved by boxes"
        return ""

    @property
    @recorded()
    def locked(self) -> tuple[LockedRegion, ...]:
        """Points (m) near which legs may lock each other, with the distance within which nothing was searched."""
        error = self.result.error
        if error is None:
            return ()
        k = error.shifts.shape[1]
        return tuple(
            LockedRegion(self._point(middle[:k]), error.length * float(np.linalg.norm(half[:k])))
            for middle, half in self.result.locked
        )

    def _where(self) -> str:
        """Return the place of the undecided boxes, in words."""
        cover = self.result
        if cover.error is None:
            return ""
        k = cover.error.shifts.shape[1]
        corners = np.array(cover.open)[:, :, :k]
        if not np.isfinite(corners).all():
            return ", some arbitrarily far away"
        places = [np.array(each) for each in join_boxes(corners)] if len(corners) <= MOST_JOINED else []
        if not 0 < len(places) <= PLACES_TOLD:
            places = [np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])]
        told = [
            (
                f"{cover.error.length * float(np.ptp(each, axis=0).max()):.3g} m about "
                f"({', '.join(f'{x:.3g}' for x in self._point(each.mean(axis=0)))})"
            )
            for each in places
        ]
        return f", in {' and '.join(told)}"

    def _point(self, x: Array) -> Array:
        """Return the position (m) of the platform's point at coordinates about the goal."""
        error = self.result.error
        assert error is not None
        return np.asarray(error.length * (error.p + error.shifts @ x))

    proved = Shown(int, lambda self: len(self.result.found), "number of critical points")
    open = Shown(int, lambda self: len(self.result.open), "number of undecided boxes")
    turns = Shown(int, lambda self: len(self.result.turns), "number of rotations of a platform that only translates")
    reason_record = Shown(str | None, lambda self: self.reason or None, As("reason"))


@dataclass(frozen=True, eq=False, repr=False)
class Equilibria(Result, shown_as="equilibria"):
    """Equilibria of the servo loop with the measured values of one pose, the goal.

    Attributes
    ----------
    points
        Isolated equilibria, the goal first, then stable ones.
    families
        One equilibrium of each continuous family.
    lists
        Assembly modes and antipodal poses of each combination of signs, those that were met first.
    measured
        Loops with equations that hold only to rounding and are not enclosed.
    search
        Statistics of the search.
    subdivision
        Completeness by subdivision; None if not requested.
    depth
        Depth in images that the law assumes. Unless it is ``exact``, ``curvatures`` are real parts of eigenvalues of
        the linearised loop over −gain.
    """

    setup: Annotated[ObservedRobot, FLAT]
    goal: ClosedConfiguration
    pose: Annotated[Pose, As("at")]
    desired: Measures
    points: tuple[Equilibrium, ...]
    families: Annotated[tuple[Equilibrium, ...], "one equilibrium of each continuous family"]
    lists: Annotated[tuple[SignedModes, ...], As("signs")]
    measured: Recorded[tuple[str, ...]]
    search: CriticalPoints
    subdivision: Recorded[CompletenessReport | None] = None
    depth: Recorded[str] = "exact"

    @property
    @recorded()
    def complete(self) -> bool:
        """True if these, and those in ``subdivision.only_proved``, are proved to be all: in all working modes of the
        observed legs, within the searched box."""
        return self.subdivision is not None and self.subdivision.complete

    @property
    @recorded()
    def starts(self) -> int:
        """Number of starts."""
        return self.search.starts

    @property
    @recorded()
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """Equilibria at which all velocities are measured."""
        return tuple(each for each in self.points if each.singular is None)

    @property
    @recorded()
    def singular(self) -> tuple[Equilibrium, ...]:
        """Equilibria of the damped law at which fewer velocities are measured: there the law without damping is not
        continuous."""
        return tuple(each for each in self.points if each.singular is not None)

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """Stable equilibria."""
        return tuple(each for each in self.points if each.stable)

    def headline(self) -> str:
        """Return the robot and the number of equilibria."""
        return (
            f"{self.setup.headline()}: {len(self.points)} equilibria of the loop to {self.pose}, "
            f"{len(self.stable)} of them stable"
        )

    complex = Shown(int | None, lambda self: self.lists[0].complex)
    proof = Shown(str, lambda self: self.search.words)
    stable_record = Shown(int, lambda self: len(self.stable), As("stable"))


def stability(curvatures: Sequence[float] | Array, least: float = CRITICAL_POINT_DISTANCE_TOL) -> str:
    """Return the stability that the eigenvalues of a Hessian decide; small ones leave it undecided."""
    values = np.asarray(curvatures)
    if np.any(values < -least):
        return SADDLE if np.any(values > least) else UNSTABLE
    return STABLE if np.all(values > least) else UNDECIDED
