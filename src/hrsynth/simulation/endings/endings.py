"""All poses at which a loop can rest: the goal, its modes, antipodal poses, and critical poses of the error; which of
them attract (docs/pages/theory.md, section 11)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from ...analysis.asked import configurations_at
from ...analysis.aspects.leg_forms import LegPattern, pattern
from ...analysis.aspects.path_segments import path_coordinates
from ...analysis.aspects.vector_expressions import NoLegForm
from ...analysis.modes.modes import AssemblyModes, modes
from ...analysis.observed import LegsLike, ObservedRobot, RobotLike
from ...analysis.posture import ConfigurationAnalysis
from ...analysis.question import question
from ...constraints.pattern import attached
from ...errors import HrsynthError, LoopsNotClosed
from ...geometry.affine import affine
from ...geometry.vectors import Array, pose_difference, transform
from ...kinematics.assembly import ASSEMBLED, BEYOND, of_links
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import outside
from ...mechanism.pose import Pose, PoseLike, asked_pose
from ...progress import tell
from ...results import Result, Value
from ...tolerances import DAMPED, SAME_ENDING, VANISHED
from ..ending import ANTIPODAL, BOUNDARY, GOAL, MODE, rest
from ..law import FixedDirections, Law, directions
from ..servo import require_regular, require_seen
from .carried import SweptChains
from .enclosure import EnclosedPoint, enclosed
from .error import RestSystem
from .search import NEARBY, Critical, CriticalPoints, critical_points, descend, in_mode, walked

CRITICAL = "critical"
STABLE, SADDLE, UNSTABLE, UNDECIDED = "stable", "saddle", "unstable", "undecided"


@dataclass(frozen=True, eq=False, repr=False)
class RestPoint:
    """A pose at which the loop rests: ``kind`` goal, mode, antipodal or critical (‖e‖ = ``error`` > 0 and no command),
    ``stability`` stable (it attracts), saddle, unstable (nothing is drawn to it) or undecided; ``curvatures`` are the
    eigenvalues of the Hessian of ½ ‖e‖² along the motions of the loops (characteristic lengths, radians), ascending.

    Exactly one rest lies within ``shift`` (m) and ``turn`` (rad) of ``pose``, infinite where it was only found;
    ``decided``: whether the signs of the curvatures are proved. ``reversed``
    names legs whose direction is opposite to the desired one, ``across`` those at right angles to it. ``singular`` says
    why fewer velocities are seen there than at other poses, None where all are; ``boundary`` whether that is a leg's
    reach. ``assembly`` is ``beyond limits`` where joints (``beyond``) are outside their limits, else ``yes``;
    ``other_legs`` are in another working mode than at the goal (None where that is not known); in so many working
    modes (``ways``) it was found, from so many starts (``met``).
    """

    pose: Pose
    kind: str
    stability: str
    error: float
    curvatures: tuple[float, ...]
    configuration: ClosedConfiguration
    shift: float = np.inf
    turn: float = np.inf
    decided: bool = False
    reversed: tuple[str, ...] = ()
    across: tuple[str, ...] = ()
    singular: str | None = None
    boundary: bool = False
    beyond: tuple[str, ...] = ()
    other_legs: tuple[str, ...] | None = None
    met: int = 0
    ways: int = 1

    @property
    def proved(self) -> bool:
        """Whether it is enclosed."""
        return bool(np.isfinite(self.shift))

    @property
    def assembly(self) -> str:
        """Whether the whole robot can be there."""
        return BEYOND if self.beyond else ASSEMBLED

    @property
    def stable(self) -> bool | None:
        """Whether it attracts; None where that is not decided."""
        return None if self.stability == UNDECIDED else self.stability == STABLE

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.kind}, {self.stability}, {self.pose}>"

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"pose": self.pose.to_dict(), "kind": self.kind, "stable": self.stable, "stability": self.stability,
                "error": self.error, "curvatures": list(self.curvatures), "proved": self.proved,
                "decided": self.decided,
                "radius_m": self.shift if self.proved else None, "radius_rad": self.turn if self.proved else None,
                "reversed": list(self.reversed), "across": list(self.across), "singular": self.singular,
                "boundary": self.boundary, "assembly": self.assembly, "beyond": list(self.beyond),
                "other_legs": None if self.other_legs is None else list(self.other_legs), "met": self.met,
                "ways": self.ways}


@dataclass(frozen=True, eq=False, repr=False)
class SignedModes(Value):
    """The poses at which the error vanishes with the directions of the legs ``reversed`` opposite to the desired ones:
    the list of all modes with these, None where it could not be made."""

    reversed: tuple[str, ...]
    listed: AssemblyModes | None

    @property
    def complete(self) -> bool:
        """Whether the list is proved to be all."""
        return self.listed is not None and self.listed.found.complete

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        known = self.listed
        return {"reversed": list(self.reversed), "modes": None if known is None else len(known.modes),
                "complex": None if known is None or known.found.continuum else known.found.complex,
                "complete": self.complete}


@dataclass(frozen=True, eq=False, repr=False)
class Endings(Result, shown_as="endings"):
    """All that was found of where the loop can rest with the directions of one pose, the goal: ``rests`` one by one,
    the goal first, then those that attract; ``continua``: one rest each of those that fill curves or surfaces.
    ``lists`` are those of the modes and of the antipodal poses of each combination of signs that was met; equations of
    the loops ``measured`` are met as well as numbers tell and not enclosed; ``search`` says how rests were sought.
    """

    setting: ObservedRobot
    goal: ClosedConfiguration
    pose: Pose
    desired: Array
    rests: tuple[RestPoint, ...]
    continua: tuple[RestPoint, ...]
    lists: tuple[SignedModes, ...]
    measured: tuple[str, ...]
    search: CriticalPoints

    @property
    def complete(self) -> bool:
        """Whether these are proved to be all: never yet."""
        return False

    @property
    def starts(self) -> int:
        """How many starts were led to rests."""
        return self.search.starts

    @property
    def endings(self) -> tuple[RestPoint, ...]:
        """The rests at which all velocities are seen."""
        return tuple(each for each in self.rests if each.singular is None)

    @property
    def singular(self) -> tuple[RestPoint, ...]:
        """The rests of the damped law at which fewer are: there the law without damping is not continuous."""
        return tuple(each for each in self.rests if each.singular is not None)

    @property
    def attracting(self) -> tuple[RestPoint, ...]:
        """The rests that attract."""
        return tuple(each for each in self.rests if each.stable)

    def headline(self) -> str:
        """The robot and how many rests there are."""
        return (f"{self.setting.headline()}: {len(self.rests)} poses at which the loop to {self.pose} can rest, "
                f"{len(self.attracting)} of them attract")

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        return {"at": self.pose.to_dict(), **self.setting.to_dict(), "complex": self.lists[0].to_dict()["complex"],
                "complete": self.complete, "signs": [each.to_dict() for each in self.lists],
                "proof": self.search.words, "starts": self.starts, "attracting": len(self.attracting),
                "measured": list(self.measured),
                "endings": [each.to_dict() for each in self.endings],
                "singular": [each.to_dict() for each in self.singular],
                "continua": [each.to_dict() for each in self.continua]}


@question()
def endings(robot: RobotLike, observe: LegsLike = None, camera: str | None = None, *, at: PoseLike, seed: int = 0
            ) -> Endings:
    """All poses at which the loop can rest that servoes the directions which are observed at ``at``: the goal, modes
    and antipodal poses, where the error vanishes, and critical poses, where it does not; which of them attract.

    ``observe`` and ``camera`` as for ``derive``. The law rests exactly at the critical points of ½ ‖e‖² on the closed
    loops (theory.md 11). These are sought from random walks on the branch of the zero configuration.

    Raises ``BadRequest`` for names that there are not, legs that do not see the platform, a singular goal;
    ``PoseNotReached`` for a pose out of reach.

    >>> hrsynth.endings("rrrrr_m1", at="x=0,y=0.25").attracting[0].kind
    'goal'
    """
    setting = ObservedRobot.of(robot, observe, camera, seed=seed).by_segments("endings")
    asked = asked_pose(at)
    setting = setting.telling([asked])
    require_seen(setting)
    (goal,) = configurations_at(setting, [asked])
    require_regular(ConfigurationAnalysis.of(setting), "goal", goal)
    tell("rests")
    return RestSearch.of(setting, goal).answer(seed)


@dataclass(frozen=True, eq=False)
class RestSearch:
    """What the rests of a loop are sought with."""

    setting: ObservedRobot
    goal: ClosedConfiguration
    system: RestSystem
    law: Law
    desired: Array

    @classmethod
    def of(cls, setting: ObservedRobot, goal: ClosedConfiguration) -> RestSearch:
        """That of a goal."""
        question = setting.samples.question
        system = RestSystem.of(goal, question, setting.configurations)
        return cls(setting, goal, system, Law(question, setting.dof, 1.0), directions(goal, question)[0])

    def answer(self, seed: int = 0, *, minima: bool = False, rounds: Iterable[Array] | None = None) -> Endings:
        """The rests that were found; ``minima`` and ``rounds`` as for :func:`.critical_points`, of minima alone neither
        lists nor enclosures."""
        setting, motion = self.setting, self.setting.motion
        found = critical_points(self.system, setting, self.goal, seed, minima=minima, rounds=rounds)
        isolated = self._in_mode(found.isolated)
        lists = [] if minima else self._lists(isolated)
        isolated += [each for one in lists for each in self._listed(one, isolated, found.idle)]
        tell("enclosures")
        boxes = ([None] * len(isolated) if minima else
                 enclosed(self.system, [each.point for each in isolated], found.idle))
        rests = _ways([each for one, box in zip(isolated, boxes, strict=True)
                       if (each := self.read(one, box)) is not None], self)
        continua = [each for one in self._in_mode(found.continua) if (each := self.read(one)) is not None]
        measured = tuple(dict.fromkeys(name for box in boxes if box for name in box.measured))
        order = {GOAL: 0, MODE: 1, ANTIPODAL: 2, CRITICAL: 3}
        rests.sort(key=lambda each: (order[each.kind], not each.stable, each.error))
        return Endings(setting, self.goal, motion.pose(self.goal.pose(motion.link)), self.desired, tuple(rests),
                       tuple(continua), tuple(lists), measured, found)

    def _lists(self, found: Sequence[Critical]) -> list[SignedModes]:
        """The lists of modes of those combinations of signs at which the error was found to vanish, that of the goal
        first."""
        known: dict[tuple[str, ...], AssemblyModes | None] = {}
        for at in (self.goal, *(self._placed(each.point.q) for each in found if each.point.vanishes)):
            if at is not None and (reversed_ := self._reversed(at)) not in known:
                try:
                    known[reversed_] = modes(self.setting, at=at)
                except HrsynthError:
                    known[reversed_] = None
        return [SignedModes(*each) for each in known.items()]

    def _listed(self, given: SignedModes, found: Sequence[Critical], idle: int) -> list[Critical]:
        """The modes of a list that are none of those that were found."""
        if given.listed is None:
            return []
        places = [each.configuration for each in given.listed.modes if each.configuration is not None]
        old = [at for each in found if each.point.vanishes and (at := self._placed(each.point.q))]
        new = [at for at in places if not any(self.alike(at, each) and self._reversed(each) == given.reversed
                                              for each in old)]
        if not new:
            return []
        q = np.array([self.system.system.read(at.pose) for at in new])
        return [Critical(each, 0) for each in descend(self.system, q, np.zeros(len(q), dtype=np.intp), idle)]

    def _placed(self, q: Array) -> ClosedConfiguration | None:
        """The robot at coordinates (N,); None where its loops do not close."""
        try:
            return of_links(self.goal.twin, partial(self.system.system.pose, values=q.tolist()))
        except LoopsNotClosed:
            return None

    def _reversed(self, at: ClosedConfiguration) -> tuple[str, ...]:
        """The legs whose direction is opposite to the desired one, as far as it is along it."""
        cosines = np.sum(directions(at, self.law.question)[0] * self.desired, axis=1)
        return tuple(o.leg for o, c in zip(self.law.question.observations, cosines, strict=True) if c < VANISHED - 1)

    def alike(self, at: ClosedConfiguration, other: ClosedConfiguration) -> bool:
        """Whether the platform is at the same pose."""
        return all(pose_difference(at.pose(body), other.pose(body), self.goal.twin.length) <= SAME_ENDING
                   for body in attached(self.setting.anatomy))

    def read(self, found: Critical, box: EnclosedPoint | None = None) -> RestPoint | None:
        """A critical point as a pose of the robot; None where its loops do not close."""
        motion, point = self.setting.motion, found.point
        at = self._placed(point.q)
        if at is None:
            return None
        command = self.law.at(at, FixedDirections(self.desired)(0.0))
        if command.pull > SAME_ENDING:
            return None
        u = command.directions
        cosines = np.sum(u * self.desired, axis=1)
        labels = [o.leg for o in self.law.question.observations]
        error = command.size
        reversed_ = self._reversed(at)
        across = tuple(label for label, c in zip(labels, cosines, strict=True) if abs(c) < VANISHED)
        kind, singular, boundary = CRITICAL, None, False
        if error < VANISHED:
            kind = ANTIPODAL if reversed_ else GOAL if self.alike(at, self.goal) else MODE
        elif float(command.values[-1]) < DAMPED:
            why = rest(self.setting, at, command)
            singular, boundary = why.reason, why.name == BOUNDARY
        X = at.pose(motion.link)
        shift, turn = (np.inf, np.inf) if box is None else self._radius(box, X)
        state = stability(point.curvatures if box is None or box.index is None else box.signs(len(point.curvatures)))
        return RestPoint(motion.pose(X), kind, state, error, tuple(map(float, point.curvatures)), at, shift, turn,
                         box is not None and box.index is not None, reversed=reversed_, across=across,
                         singular=singular,
                         boundary=boundary, beyond=tuple(outside(at.twin, at.q)),
                         other_legs=self._other_legs(at), met=found.met)

    def _radius(self, box: EnclosedPoint, X: Array) -> tuple[float, float]:
        """How far the platform can be from its pose X (4, 4) over a box (m, rad)."""
        loops, motion = self.system.system, self.setting.motion
        forms = [affine(np.array([x]), np.zeros((1, 0)), np.array([r])) for x, r in zip(box.q, box.radius, strict=True)]
        carrier, chain = SweptChains(loops, forms), loops.way(loops.body[motion.link])
        zero = loops.mechanism.links[motion.link].pose
        told = [transform(X, motion.point) / loops.length, *X[:3, :3].T]
        vectors = [carrier.point(chain, transform(zero, motion.point) / loops.length),
                   *(carrier.direction(chain, axis) for axis in zero[:3, :3].T)]
        off = [float(np.linalg.norm((each.value - at).size)) for each, at in zip(vectors, told, strict=True)]
        # |ΔR| = 2 √2 sin(θ / 2) ≥ 2 √2 θ / π
        return off[0] * loops.length, float(np.pi / np.sqrt(8) * np.linalg.norm(off[1:])) if motion.body else 0.0

    @cached_property
    def _forms(self) -> LegPattern | None:
        """The closed forms of the legs, which tell their working modes; None where there are none."""
        setting = self.setting
        members = (setting.everything.start, *setting.configurations)
        for each in path_coordinates(setting.anatomy, setting.samples.question, setting.dof, members):
            try:
                return pattern(setting.anatomy, (), each, members)
            except NoLegForm:
                continue
        return None

    def _other_legs(self, at: ClosedConfiguration) -> tuple[str, ...] | None:
        """The legs that are in another working mode than at the goal; None where that is not known."""
        if self._forms is None:
            return None
        try:
            with np.errstate(invalid="ignore"):
                one, other = (self._forms.forms(each) for each in (self.goal, at))
        except NoLegForm:
            return None
        return tuple(dict.fromkeys(str(limb.label) for limb, a, b in zip(one.limbs, one.modes, other.modes,
                                                                        strict=True) if a != b))

    def _in_mode(self, found: Sequence[Critical]) -> list[Critical]:
        """Those near which configurations are of the operation mode of the zero configuration."""
        q = np.array([each.point.q for each in found]).reshape(len(found), self.system.size[0])
        nearby = walked(self.system, q, np.random.default_rng(0), 2, NEARBY) if found else q
        return [each for each, good in zip(found, in_mode(self.system, self.setting, nearby), strict=True) if good]


def _ways(rests: Sequence[RestPoint], search: RestSearch) -> list[RestPoint]:
    """Rests at one pose with the same measured directions as one: of the enclosed ones, if there are any, that in the
    working modes nearest to the goal's (where loops are singular, coordinates are known to half their digits), with how
    many there are."""
    setting = search.setting
    segments = [directions(each.configuration, setting.everything.question)[0] for each in rests]
    home = directions(search.goal, setting.everything.question)[0]
    groups: list[list[int]] = []
    for k, each in enumerate(rests):
        seen = directions(each.configuration, search.law.question)[0]
        own = next((group for group in groups if search.alike(rests[group[0]].configuration, each.configuration)
                    and np.abs(directions(rests[group[0]].configuration, search.law.question)[0] - seen).max()
                    < SAME_ENDING), None)
        if own is None:
            groups.append([k])
        else:
            own.append(k)
    best = [min(group, key=lambda k: (not rests[k].proved, float(np.linalg.norm(segments[k] - home))))
            for group in groups]
    return [replace(rests[k], ways=len(group), met=sum(rests[i].met for i in group))
            for k, group in zip(best, groups, strict=True)]


def stability(curvatures: Sequence[float] | Array) -> str:
    """What the eigenvalues of a Hessian say."""
    values = np.asarray(curvatures)
    if np.any(values < -SAME_ENDING):
        return SADDLE if np.any(values > SAME_ENDING) else UNSTABLE
    return STABLE if np.all(values > SAME_ENDING) else UNDECIDED
