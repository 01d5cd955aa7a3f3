"""Match of the joints and links of two files of one robot: by name, by place, by structure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ..geometry.vectors import Array, build_pose
from ..mechanism.model import Joint, JointType, Mechanism
from ..tolerances import EXACT_INCIDENCE_TOL, INCIDENCE_TOL, ROTATION_LEVER_MIN_FRACTION

ROBOT_DIFFERENCE_TOL = 1e-5
"""Relative difference (characteristic lengths, radians, masses) up to which two files describe one robot."""
CENTRE_ALIGNMENT_STEPS_MAX = 300
"""Largest number of steps that align revolute joint centres of two files along their axes."""
AXIS_SENSE_CHOICES_MAX = 6
"""Axes of a link up to which all signs in the other file are tried."""

_ALONG = (JointType.REVOLUTE, JointType.CYLINDRICAL)
_LINES = (*_ALONG, JointType.PRISMATIC)
_ACROSS = (JointType.PRISMATIC, JointType.PLANAR)


@dataclass(frozen=True, eq=False)
class LinkFit:
    """Rigid motion ``X`` (4, 4) that brings a link's joints in one robot to their places in the other, the residual
    (characteristic lengths, radians) at each joint, and True if it is the only one."""

    X: Array
    misses: Mapping[str, float]
    only: bool


@dataclass(frozen=True, eq=False)
class RobotMatch:
    """Joints and links of the robot ``one`` with those of ``other``."""

    one: Mechanism
    other: Mechanism

    @cached_property
    def joints(self) -> dict[str, str]:
        """Joint of one: joint of the other. Equal names first; then one of the same type in the same place; then the
        only ones of their kind by structure."""
        found = {name: name for name in self.one.joints if name in self.other.joints}
        found |= self._match_by_place(found)
        found |= self._match_by_structure(found)
        return found

    def _remaining(self, found: Mapping[str, str]) -> tuple[list[Joint], list[Joint]]:
        taken = set(found.values())
        return (
            [joint for name, joint in self.one.joints.items() if name not in found],
            [joint for name, joint in self.other.joints.items() if name not in taken],
        )

    def _match_by_place(self, found: Mapping[str, str]) -> dict[str, str]:
        mine, theirs = self._remaining(found)
        near = {}
        for joint in mine:
            same = [
                each.name
                for each in theirs
                if each.type is joint.type and _measure_miss(joint, each, np.eye(4), self.one.length) <= INCIDENCE_TOL
            ]
            if len(same) == 1:
                near[joint.name] = same[0]
        often = Counter(near.values())
        return {mine: yours for mine, yours in near.items() if often[yours] == 1}

    def _match_by_structure(self, found: Mapping[str, str]) -> dict[str, str]:
        mine, theirs = self._remaining(found)
        pairs = {name: number for number, pair in enumerate(found.items()) for name in [pair]}
        a = _label_joints(self.one, {pair[0]: number for pair, number in pairs.items()})
        b = _label_joints(self.other, {pair[1]: number for pair, number in pairs.items()})
        often, there = Counter(a.values()), Counter(b.values())
        by_colour = {b[joint.name]: joint.name for joint in theirs}
        return {
            joint.name: by_colour[a[joint.name]]
            for joint in mine
            if often[a[joint.name]] == 1 == there[a[joint.name]] and a[joint.name] in by_colour
        }

    @cached_property
    def links(self) -> dict[str, str]:
        """Link of one: the link of the other that carries most of its joints; among equals, the one with its name."""
        found = {}
        for link in self.one.links:
            votes: Counter[str] = Counter()
            for joint in self.one.joints_of(link):
                if joint.name in self.joints:
                    votes.update(self.other.joints[self.joints[joint.name]].links)
            if votes:
                found[link] = max(votes, key=lambda name: (votes[name], name == link))
            elif link in self.other.links:
                found[link] = link
        return found

    def _pairs(self, link: str) -> list[tuple[_JointOn, _JointOn]]:
        """Return the joints of a link in both robots, as it carries them."""
        return [
            (_join_to_link(joint, link), _join_to_link(other, self.links[link]))
            for joint in self.one.joints_of(link)
            if joint.name in self.joints
            and (other := self.other.joints[self.joints[joint.name]]).type is joint.type
            and self.links.get(link) in other.links
        ]

    def fit(self, link: str) -> LinkFit | None:
        """Return how the joints of a link agree in both robots, wherever the link is at zero; None without common
        joints."""
        pairs = self._pairs(link)
        if not pairs:
            return None
        upright = np.eye(3) if link == self.one.base else self._upright
        # axes have no sense of their own: as both files give them, as they lie in the robot as a whole, or any
        found = [_fit(pairs, self.one.length, signs) for signs in (None, upright)]
        best = min(max(each.misses.values()) for each in found)
        if (
            best > ROBOT_DIFFERENCE_TOL
            and (count := sum(len(mine.axes) for mine, _ in pairs)) <= AXIS_SENSE_CHOICES_MAX
        ):
            found += self._fits(pairs, product((1.0, -1.0), repeat=count))
            best = min(max(each.misses.values()) for each in found)
        good = [each for each in found if max(each.misses.values()) <= best + INCIDENCE_TOL * ROBOT_DIFFERENCE_TOL]
        return max(good, key=lambda each: float(np.trace(upright.T @ each.X[:3, :3])))

    def _fits(self, pairs: Sequence[tuple[_JointOn, _JointOn]], ways: Iterable[Sequence[float]]) -> list[LinkFit]:
        """Yield the fits with the other robot's axes in each of these senses."""
        return [_fit(list(_turn_senses(pairs, signs)), self.one.length, None) for signs in ways]

    def apart(self, hinge: str) -> float:
        """Return the shift (characteristic lengths) of a revolute joint's links along its axis between the robots. No
        link alone shows it, as the centre may be anywhere on the axis. 0 if the other joints do not determine it, or
        some fit agrees."""
        joint = self.one.joints[hinge]
        if joint.type is not JointType.REVOLUTE or hinge not in self.joints:
            return 0.0
        sides, gain = [], 1.0
        for link in joint.links:
            pairs = self._pairs(link)
            if hinge not in [mine.name for mine, _ in pairs]:
                return 0.0
            gain = max(gain, _bound_gain(hinge, pairs, self.one.length))
            count = sum(len(mine.axes) for mine, _ in pairs)
            ways = product((1.0, -1.0), repeat=count) if count <= AXIS_SENSE_CHOICES_MAX else [(1.0,) * count]
            mine, their = next(pair for pair in pairs if pair[0].name == hinge)
            sides.append(
                [
                    float((mine.point - fit.X[:3, :3] @ their.point - fit.X[:3, 3]) @ mine.axis)
                    for fit in self._fits(pairs, ways)
                    if max(fit.misses.values()) <= ROBOT_DIFFERENCE_TOL
                ]
            )
        found = min((abs(a - b) for a, b in product(*sides)), default=0.0) / self.one.length
        return found if found > ROBOT_DIFFERENCE_TOL * gain else 0.0

    @cached_property
    def _upright(self) -> Array:
        """Rotation of the other robot's base, (3, 3)."""
        found = self.fit(self.one.base)
        return np.eye(3) if found is None else found.X[:3, :3]


def _fit(pairs: Sequence[tuple[_JointOn, _JointOn]], length: float, upright: Array | None) -> LinkFit:
    """Return the best fit of a link's joints; the centre of a revolute or prismatic joint may be any point of its
    axis."""
    shift, X, only = np.zeros(len(pairs)), np.eye(4), False
    for _ in range(CENTRE_ALIGNMENT_STEPS_MAX):
        points = [
            (mine.point, their.point + s * _get_slide_axis(their))
            for (mine, their), s in zip(pairs, shift, strict=True)
        ]
        axes = [(mine, their) for pair in pairs for mine, their in zip(pair[0].axes, pair[1].axes, strict=True)]
        X, only = _fit_motion(points, axes, length, upright)
        before = shift.copy()
        for number, (mine, their) in enumerate(pairs):
            if their.type in _LINES:
                moved = X[:3, :3] @ their.point + X[:3, 3]
                shift[number] = float((mine.point - moved) @ (X[:3, :3] @ their.axis))
        if np.max(np.abs(shift - before)) <= EXACT_INCIDENCE_TOL * length:
            break
    return LinkFit(
        X,
        {
            mine.name: max(_measure_miss(mine, their, X, length), abs(mine.cosine - their.cosine))
            for mine, their in pairs
        },
        only,
    )


@dataclass(frozen=True, eq=False)
class _JointOn:
    """Joint as a link carries it: of a U joint the axis that is fixed in the link, and the angle to the other one as
    its cosine without sign, as the axes have no sense."""

    name: str
    type: JointType
    point: Array
    axes: tuple[Array, ...]
    cosine: float = 0.0

    @property
    def axis(self) -> Array:
        """The only axis."""
        return self.axes[0]


def _join_to_link(joint: Joint, link: str) -> _JointOn:
    if joint.type is not JointType.UNIVERSAL:
        return _JointOn(joint.name, joint.type, joint.point, joint.axes)
    own = joint.axes[joint.links.index(link)]
    return _JointOn(joint.name, joint.type, joint.point, (own,), abs(float(joint.axes[0] @ joint.axes[1])))


def _turn_senses(
    pairs: Sequence[tuple[_JointOn, _JointOn]], signs: Iterable[float]
) -> Iterator[tuple[_JointOn, _JointOn]]:
    """Return the pairs with the other robot's axes in these senses."""
    given = iter(signs)
    for mine, their in pairs:
        yield mine, replace(their, axes=tuple(next(given) * axis for axis in their.axes))


def _bound_gain(hinge: str, pairs: Sequence[tuple[_JointOn, _JointOn]], length: float) -> float:
    """Return by how much more than its residual a link may be shifted along the axis of one of its revolute joints;
    infinite if its joints do not determine that."""
    rows, asked = [], np.zeros(6)
    for mine, _ in pairs:

        def moved(along: Array, point: Array = mine.point) -> Array:
            return np.concatenate([along, np.cross(point / length, along)])

        if mine.name == hinge:
            asked = moved(mine.axis)
        across = np.linalg.svd(mine.axis[None])[2][1:] if mine.axes else np.eye(3)
        points = {JointType.PLANAR: [mine.axis] if mine.axes else []}.get(
            mine.type, list(across) if mine.type in _LINES else list(np.eye(3))
        )
        rows += [moved(each) for each in points]
        rows += [np.concatenate([np.zeros(3), each]) for each in across if mine.axes]
    found = np.linalg.lstsq(np.array(rows).T, asked, rcond=ROTATION_LEVER_MIN_FRACTION)[0]
    left = float(np.linalg.norm(asked - found @ np.array(rows)))
    return np.inf if left > ROTATION_LEVER_MIN_FRACTION**2 else 2.0 * float(np.sum(np.abs(found)))


def _get_slide_axis(joint: _JointOn) -> Array:
    return np.asarray(joint.axis if joint.type in _LINES else np.zeros(3))


def _fit_motion(
    points: Sequence[tuple[Array, Array]], axes: Sequence[tuple[Array, Array]], length: float, upright: Array | None
) -> tuple[Array, bool]:
    """Return the rigid motion that brings the second of each pair nearest to the first (Kabsch), and True if it is
    unique. Axes have their sense after the rotation ``upright``, or their own at first."""
    mine, theirs = (np.array([pair[k] for pair in points]) for k in (0, 1))
    H = (theirs - theirs.mean(axis=0)).T @ (mine - mine.mean(axis=0)) / length**2
    R = upright if upright is not None else _fit_rotation(H + sum((np.outer(b, a) for a, b in axes), np.zeros((3, 3))))
    H = H + sum((np.outer(b if a @ R @ b >= 0 else -b, a) for a, b in axes), np.zeros((3, 3)))
    R = _fit_rotation(H)
    sizes = np.linalg.svd(H, compute_uv=False)
    return build_pose(mine.mean(axis=0) - R @ theirs.mean(axis=0), R), bool(sizes[1] > ROTATION_LEVER_MIN_FRACTION**2)


def _fit_rotation(H: Array) -> Array:
    U, _, Vt = np.linalg.svd(H)
    D = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(Vt.T @ U.T)))])
    return np.asarray(Vt.T @ D @ U.T)


def _measure_miss(mine: Joint | _JointOn, their: Joint | _JointOn, X: Array, length: float) -> float:
    """Return the difference of a joint and another robot's joint moved by X: axes as lines without sense."""
    gap = mine.point - (X[:3, :3] @ their.point + X[:3, 3])
    axes = [X[:3, :3] @ axis for axis in their.axes]
    if mine.type in _ALONG:
        gap = gap - (gap @ mine.axis) * mine.axis
    elif mine.type in _ACROSS:
        gap = (gap @ mine.axis) * mine.axis if mine.type is JointType.PLANAR else np.zeros(3)
    turns = [float(np.linalg.norm(np.cross(a, b))) for a, b in zip(mine.axes, axes, strict=True)]
    return max([float(np.linalg.norm(gap)) / length, *turns])


def _label_joints(robot: Mechanism, known: Mapping[str, int]) -> dict[str, int]:
    """Return colours of joints by type and neighbours, refined until no colour splits; ``known`` ones are distinct."""
    colours: dict[str, int] = {name: hash((joint.type, known.get(name))) for name, joint in robot.joints.items()}
    ends = {link: hash((link == robot.base, link == robot.platform)) for link in robot.links}
    for _ in range(len(robot.links)):
        ends = {
            link: hash((ends[link], tuple(sorted(colours[joint.name] for joint in robot.joints_of(link)))))
            for link in robot.links
        }
        after = {
            name: hash((colours[name], tuple(sorted(ends[link] for link in joint.links))))
            for name, joint in robot.joints.items()
        }
        done = len(set(after.values())) == len(set(colours.values()))
        colours = after
        if done:
            break
    return colours
