"""What is told of the poses at which a loop can rest."""

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
from ...tolerances import SAME_ENDING
from ..law import Measures
from .exhaustive_search import SubdivisionResult, join_boxes
from .search import CriticalPoints

CRITICAL = "critical"
Stability = Literal["stable", "saddle", "unstable", "undecided"]
STABLE, SADDLE, UNSTABLE, UNDECIDED = "stable", "saddle", "unstable", "undecided"
MOST_JOINED, PLACES_TOLD = 5000, 4
"""Open boxes that are told place by place, at most, and how many places."""


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(OfConfiguration, Record):
    """A pose at which the loop rests: ``kind`` goal, mode, antipodal or critical (‖e‖ = ``error`` > 0 and no command),
    ``stability`` stable (it attracts), saddle, unstable (nothing is drawn to it) or undecided; ``curvatures`` are the
    eigenvalues of the Hessian of ½ ‖e‖² along the motions of the loops (characteristic lengths, radians), ascending.

    It is the only one in a box of joint coordinates, which is within ``shift`` (m) and ``turn`` (rad) of ``pose``,
    infinite if it was only found; others may have the same pose in other working modes.
    ``decided``: whether the signs of the curvatures are proved. ``reversed`` names legs whose direction is opposite to
    the desired one, ``across`` those at right angles to it. ``singular`` says why fewer velocities are seen there than
    at other poses, None if all are; ``boundary`` whether that is a leg's reach. Linearised, the loop without damping
    has the eigenvalues −gain · ``rates``, each enclosed, 1 at all poses where the error vanishes (empty if that is not
    proved, or fewer velocities are seen). ``side`` says on which side of the Type 2 locus of the hidden robot the pose
    lies, ``goal`` on that of the goal, ``other`` in another aspect, None if the condition has no sign, or vanishes.

    ``assembly`` is ``beyond limits`` if joints (``beyond``) are outside their limits, otherwise ``yes``; ``other_legs``
    are in another working mode than at the goal (None if that is not known); ``ways`` is the number of working modes in
    which it was found, ``met`` the number of starts that led to it.
    """

    pose: Recorded[Pose]
    kind: Annotated[str, Literal["goal", "mode", "antipodal", "critical"]]
    stability: Annotated[str, Stability]
    error: Recorded[float]
    curvatures: Annotated[tuple[float, ...], "eigenvalues of the Hessian of ½ ‖e‖²"]
    configuration: ClosedConfiguration
    shift: Annotated[float, Number, As("radius_m")] = np.inf
    turn: Annotated[float, Number, As("radius_rad")] = np.inf
    decided: Recorded[bool] = False
    convergence_rates: Annotated[
        tuple[tuple[float, float], ...], "intervals of those of the linearised loop, times −1 / gain"
    ] = ()
    side: Annotated[str | None, Literal["goal", "other"] | None, "of the Type 2 locus"] = None
    reversed: Recorded[tuple[str, ...]] = ()
    orthogonal_legs: Recorded[tuple[str, ...]] = ()
    singular: Recorded[str | None] = None
    boundary: Recorded[bool] = False
    beyond_limits: Recorded[tuple[str, ...]] = ()
    legs_in_other_mode: Recorded[tuple[str, ...] | None] = None
    hits: Annotated[int, "how many starts led to it"] = 0
    working_modes: Recorded[int] = 1

    @property
    @recorded()
    def proved(self) -> bool:
        """Whether it is enclosed."""
        return bool(np.isfinite(self.shift))

    @property
    @recorded(Literal["yes", "beyond limits"])
    def assembly(self) -> str:
        """Whether the whole robot can be there."""
        return BEYOND if self.beyond_limits else ASSEMBLED

    @property
    @recorded()
    def stable(self) -> bool | None:
        """Whether it attracts; None if that is not decided."""
        return None if self.stability == UNDECIDED else self.stability == STABLE

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.kind}, {self.stability}, {self.pose}>"


@dataclass(frozen=True, eq=False, repr=False)
class SignedModes(Value):
    """The poses at which the error vanishes with the directions of the legs ``reversed`` opposite to the desired ones:
    the list of all modes with these, None if it could not be made or none was met; ``boxes``: how many such poses boxes
    prove, None if they prove nothing, in ``turns`` turns of a platform that translates (lists of modes cover that of
    the goal)."""

    reversed: Recorded[tuple[str, ...]]
    listed: AssemblyModes | None
    boxes: Recorded[int | None] = None
    turns: int = 1

    @property
    @recorded()
    def complete(self) -> bool:
        """Whether the list is proved to be all."""
        return self.boxes is not None or (self.listed is not None and self.listed.found.complete)

    @property
    def empty(self) -> bool:
        """Whether it is proved that there is no such pose."""
        return self.boxes == 0

    modes = Shown(int | None, lambda self: self.boxes if self.listed is None else len(self.listed.modes))

    @property
    @recorded()
    def complex(self) -> int | None:
        """How many such poses there are, complex ones included; None where that is not known."""
        return None if self.listed is None or self.listed.found.continuous_family else self.listed.found.complex


@dataclass(frozen=True, eq=False, repr=False)
class ProvedCriticalPoint(Value, all_recorded=True):
    """A pose about which boxes prove exactly one critical point of E, ‖e‖ in ``error``, that is no rest of the list:
    the robot was not closed there, or the command as it is computed does not vanish, as where joints lock or nearly
    do; so whether the loop rests there is not said. ``pose`` is that of the point alone from which boxes count if the
    platform's turn follows from it."""

    pose: Pose
    stability: Annotated[str, Stability]
    error: tuple[float, float]


class LockedRegion(NamedTuple):
    """A place ``p`` (m) of the platform's point at which legs may lock each other; nothing was searched within this
    distance of it."""

    p: Annotated[Array, list[float]]
    within_m: float


@dataclass(frozen=True, eq=False, repr=False)
class CompletenessReport(Value):
    """Whether the rests are all, by boxes of platform poses: what subdivision found (:class:`SubdivisionResult`), those
    of its critical points that are not rests of the list (``alone``), and how many isolated rests in its box are not
    among its critical points (``strangers``); ``within`` (m) is how far the box reaches from the goal if the legs do
    not bound it, otherwise None; sliding rods that are ``shorter`` (m) were not searched for, None if there are none;
    ``turned`` rests of the list are at poses at which a platform that only translates is turned differently, which were
    not searched either, and ``apart`` rests of the list in all lie where nothing was searched."""

    result: Annotated[SubdivisionResult, FLAT]
    only_proved: Recorded[tuple[ProvedCriticalPoint, ...]]
    only_found: Recorded[int]
    within: Annotated[float | None, As("within_m"), "of the goal, null if the legs bound the box"]
    shorter: Annotated[float | None, As("shorter_m"), "null if no rod slides"] = None
    rotated_outside: Recorded[int] = 0
    outside_searched: Recorded[int] = 0

    @property
    @recorded()
    def crossings(self) -> int:
        """The number of points of a platform on struts at which rests fill curves, because two legs' joints lock."""
        return 0 if self.result.struts is None else self.result.struts.crossings

    @property
    @recorded()
    def unstretched(self) -> tuple[str, ...] | None:
        """The legs that are not watched, if rests were searched for only while none of them is stretched; None if they
        were searched for everywhere."""
        return None if self.result.loop is None else tuple(str(each.label) for each in self.result.loop.idle)

    @property
    @recorded()
    def orthogonal_directions(self) -> int | None:
        """The number of watched directions at right angles to the desired ones at which rests were not searched for."""
        return None if self.result.loop is None else self.result.loop.flat

    @property
    @recorded()
    def complete(self) -> bool:
        """Whether the list and what is told ``alone`` hold all rests in the box."""
        return self.result.complete and not self.only_found

    @property
    def reason(self) -> str:
        """Why it does not, as far as known."""
        cover = self.result
        if cover.reason:
            return cover.reason
        if cover.open:
            more = f"; {cover.boxes:,} were looked at, more with --max-boxes" if cover.spent else ""
            return f"{len(cover.open):,} boxes, {cover.share:.2g} of all, are left open{self._where()}{more}"
        if self.only_found:
            return f"{self.only_found} of the list are not among those that boxes prove"
        return ""

    @property
    @recorded()
    def locked(self) -> tuple[LockedRegion, ...]:
        """The points (m) near which legs may lock each other, and the distance from them within which nothing was
        searched."""
        error = self.result.error
        if error is None:
            return ()
        k = error.shifts.shape[1]
        return tuple(
            LockedRegion(self._point(middle[:k]), error.length * float(np.linalg.norm(half[:k])))
            for middle, half in self.result.locked
        )

    def _where(self) -> str:
        """Where the open boxes lie."""
        cover = self.result
        if cover.error is None:
            return ""
        k = cover.error.shifts.shape[1]
        corners = np.array(cover.open)[:, :, :k]
        if not np.isfinite(corners).all():
            return ", some however far away"
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
        """Where coordinates about the goal put the platform's point (m)."""
        error = self.result.error
        assert error is not None
        return np.asarray(error.length * (error.p + error.shifts @ x))

    proved = Shown(int, lambda self: len(self.result.found), "critical poses")
    open = Shown(int, lambda self: len(self.result.open), "boxes")
    turns = Shown(int, lambda self: len(self.result.turns), "of a platform that only translates")
    reason_record = Shown(str | None, lambda self: self.reason or None, As("reason"))


@dataclass(frozen=True, eq=False, repr=False)
class Equilibria(Result, shown_as="equilibria"):
    """All that was found of where the loop can rest with the directions of one pose, the goal: ``rests`` one by one,
    the goal first, then those that attract; ``continua``: one rest from each family that fills a curve or surface.
    ``lists`` are those of the modes and of the antipodal poses of each combination of signs, those that were met first;
    the equations of the loops ``measured`` are met only as well as numbers tell and are not enclosed; ``search`` says
    how rests were sought, ``cover`` whether they are all (None if that was not asked). ``depth`` is how the law knows
    depths in images; if it assumes them, ``curvatures`` are real parts of eigenvalues of the linearised loop over
    −gain."""

    setup: Annotated[ObservedRobot, FLAT]
    goal: ClosedConfiguration
    pose: Annotated[Pose, As("at")]
    desired: Measures
    points: tuple[Equilibrium, ...]
    families: Annotated[tuple[Equilibrium, ...], "one from each family that fills a curve or surface"]
    lists: Annotated[tuple[SignedModes, ...], As("signs")]
    measured: Recorded[tuple[str, ...]]
    search: CriticalPoints
    subdivision: Recorded[CompletenessReport | None] = None
    depth: Recorded[str] = "exact"

    @property
    @recorded()
    def complete(self) -> bool:
        """Whether these, and those that ``cover`` tells ``alone``, are proved to be all: in all working modes of the
        watched legs, within ``cover``'s box."""
        return self.subdivision is not None and self.subdivision.complete

    @property
    @recorded()
    def starts(self) -> int:
        """How many starts were led to rests."""
        return self.search.starts

    @property
    @recorded()
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """The rests at which all velocities are seen."""
        return tuple(each for each in self.points if each.singular is None)

    @property
    @recorded()
    def singular(self) -> tuple[Equilibrium, ...]:
        """The rests of the damped law at which fewer velocities are seen: there the law without damping is not
        continuous."""
        return tuple(each for each in self.points if each.singular is not None)

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """The rests that attract."""
        return tuple(each for each in self.points if each.stable)

    def headline(self) -> str:
        """The robot and how many rests there are."""
        return (
            f"{self.setup.headline()}: {len(self.points)} poses at which the loop to {self.pose} can rest, "
            f"{len(self.stable)} of them attract"
        )

    complex = Shown(int | None, lambda self: self.lists[0].complex)
    proof = Shown(str, lambda self: self.search.words)
    attracting_record = Shown(int, lambda self: len(self.stable), As("attracting"))


def stability(curvatures: Sequence[float] | Array, least: float = SAME_ENDING) -> str:
    """What the eigenvalues of a Hessian say; small ones say nothing."""
    values = np.asarray(curvatures)
    if np.any(values < -least):
        return SADDLE if np.any(values > least) else UNSTABLE
    return STABLE if np.all(values > least) else UNDECIDED
