"""Pattern of the wrench systems of a robot with locked legs, recognised over samples, never at one pose.

With what is measured held, leg i lets its end translate along V_i and turn about axes through a point B_i; what the
whole platform can still do must be in all of them (theory.md 7). This module finds V_i, B_i and their names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array, cross, freeze_array, hat
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked_twists import compute_twists_at_samples, split_together
from ..kinematics.velocity_relation import ObservationModel, compute_relation
from ..mechanism import JointType, Mechanism, Observation
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.observations.direction import Direction
from ..results import Value
from ..tolerances import RELATION_ANGLE_TOL
from .locked_leg_rank import may_gain_motion
from .locked_legs import (
    LockedLeg,
    build_virtual_legs,
    compute_forbidden_projectors,
    compute_rotation_projectors,
    list_observations,
)
from .named_vectors import (
    BodyPoint,
    BodyVector,
    NamedVector,
    Segment,
    Tangent,
    collect_poses,
    is_zero_everywhere,
    make_axis,
    make_centre,
)

CACHED_LOCKED_LEGS_COUNT = 64
"""Locked legs kept in the cache for other sets of legs of one robot."""

TURNING_MOTIONS = ("planar", "spatial")
"""Motions of a platform of which turns are a part."""
TURNING = (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.CYLINDRICAL)


@dataclass(frozen=True, eq=False, repr=False)
class ConstraintPattern(Value):
    """Motion of the platform, and what the locked legs allow of it. ``motion`` is ``translations`` (locked legs allow
    translations alone), ``planar``, ``spatial``, ``oriented`` (spatial, some legs constrain rotations), ``bodies`` (an
    articulated platform whose links translate, one along ``slide`` relative to the other) or ``other``."""

    motion: str
    base: str
    bodies: tuple[str, ...]
    """The links of the platform on which legs end."""
    legs: tuple[LockedLeg, ...] = ()
    plane: NamedVector | None = None
    """The normal of the plane in which everything moves, of ``translations`` that in which all tips move, or None."""
    flat: bool = True
    """For ``planar``: True if the lines along which the locked legs let their tips move are in that plane."""
    slide: NamedVector | None = None
    steady: Mapping[str, Array] = field(default_factory=dict)
    """For ``translations``: links of the named vectors that never rotate, with their rotations R_BL (3, 3)."""
    turning: bool = False
    """For ``translations``: True if the unlocked platform rotates; it may then be locked in another orientation."""

    def constant(self, vector: NamedVector | None) -> Array | None:
        """The direction (3,), in the base, of a vector that is fixed in a link that never turns; None of others."""
        if not isinstance(vector, BodyVector):
            return None
        R = np.eye(3) if vector.link == self.base else self.steady.get(vector.link)
        return None if R is None else R @ vector.direction

    @property
    def features(self) -> tuple[NamedVector, ...]:
        """All named vectors."""
        extra = tuple(f for f in (self.plane, self.slide) if f is not None)
        return tuple(f for leg in self.legs for f in leg.features) + extra

    def values_at(self, configurations: Sequence[ClosedConfiguration]) -> PatternValues:
        """The named vectors at several configurations."""
        return PatternValues(self, tuple(configurations))


@dataclass(frozen=True, eq=False, repr=False)
class PatternValues(Value):
    """A pattern at n configurations: its named vectors, (n, 3) each, and where its bodies are."""

    pattern: ConstraintPattern
    configurations: tuple[ClosedConfiguration, ...]

    @cached_property
    def _poses(self) -> dict[str, Array]:
        links = [link for feature in self.pattern.features for link in feature.links]
        return collect_poses(self.configurations, [*links, *self.pattern.bodies])

    @cached_property
    def values(self) -> dict[str, Array]:
        """The vectors by their symbols; points are measured from the first leg's tip."""
        features = self.pattern.features
        found = {feature.symbol: feature.value(self._poses) for feature in features}
        if self.pattern.legs:
            origin = found[self.pattern.legs[0].tip.symbol]
            found.update({f.symbol: found[f.symbol] - origin for f in features if isinstance(f, BodyPoint)})
        return found

    def allowances(self, leg: LockedLeg) -> Array:
        """Constraints of a locked leg on the platform links, (n, rows, 6 bodies), on the twists of their frames'
        origins: the tip's velocity across V_i, and the rotation where it allows none."""
        arms = leg.tip.value(self._poses) - self._poses[leg.body][:, :3, 3]
        across = compute_forbidden_projectors(leg, self.values)
        blocks = np.concatenate([across, -across @ hat(arms)], axis=2)
        turns = (
            np.broadcast_to(np.eye(3), (len(arms), 3, 3))
            if leg.turns == 0
            else compute_rotation_projectors(leg, self.values)
        )
        if turns is not None:
            blocks = np.concatenate([blocks, np.concatenate([np.zeros_like(turns), turns], axis=2)], axis=1)
        bodies = self.pattern.bodies
        found = np.zeros((len(arms), blocks.shape[1], 6 * len(bodies)))
        start = 6 * bodies.index(leg.body)
        found[:, :, start : start + 6] = blocks
        return found


def list_leg_ends(decomposition: LegDecomposition) -> tuple[str, ...]:
    """The links of the platform on which legs end."""
    return tuple(dict.fromkeys(leg.platform_link for leg in decomposition.legs))


def list_placing_links(decomposition: LegDecomposition) -> tuple[str, ...]:
    """Links that define the platform pose: those on which legs end, and the controlled one where these allow several
    poses."""
    return (
        list_leg_ends(decomposition)
        if decomposition.is_platform_decided
        else (*list_leg_ends(decomposition), decomposition.mechanism.platform)
    )


def recognise(
    decomposition: LegDecomposition,
    observation_model: ObservationModel,
    samples: Sequence[ClosedConfiguration],
    *,
    everywhere: bool = True,
) -> ConstraintPattern:
    """The pattern at the samples; ``motion`` is ``other`` where it is none of the known ones, or, unless it need not
    hold ``everywhere``, where a locked leg may allow its end more at special poses."""
    other = ConstraintPattern("other", decomposition.mechanism.base, list_leg_ends(decomposition))
    base, bodies = decomposition.mechanism.base, list_leg_ends(decomposition)
    motions = _compute_motions(decomposition, observation_model, samples)
    by_platform = list_observations(observation_model, base, bodies)
    locks: dict[str, list[Observation]] = {leg.label: [] for leg in decomposition.legs}
    for each in observation_model.observations:
        if each not in by_platform:
            leg = _find_leg(each, decomposition, observation_model)
            if leg is None:
                return other
            locks[leg].append(each)
    translating = len(bodies) == 1 and is_zero_everywhere(motions[:, 3:])
    held = {
        leg.label: _build_locked_leg(
            decomposition,
            leg,
            tuple(locks[leg.label]),
            observation_model.reference,
            tuple(samples),
            everywhere,
            translating,
        )
        for leg in decomposition.legs
    }
    alone = motions.shape[1:] == (6, 6) and not any(locks.values())
    if decomposition.mechanism.couplings and not alone:
        return other
    virtual = build_virtual_legs(
        by_platform, observation_model.reference, bodies, 1 if alone else len(held) + 1, samples
    )
    seen = [leg for label, leg in held.items() if locks[label]]
    if virtual is None or None in seen or not (seen or virtual):
        return other
    legs = (*(leg for leg in seen if leg is not None), *virtual)
    every = None if None in held.values() else (*(leg for leg in held.values() if leg is not None), *virtual)
    other = replace(other, legs=legs)
    if decomposition.point is not None:
        velocities = [compute_relation(at, observation_model.of_platform).twists for at in samples]
        found: ConstraintPattern | None = _match_translations(decomposition, every, legs, velocities, samples)
    elif len(other.bodies) == 1:
        found = _match_one_body(decomposition, every, legs, motions, samples)
    else:
        found = _match_two_bodies(decomposition, legs, motions, samples)
    if (
        found is not None
        and found.plane is not None
        and found.motion == "planar"
        and not all(
            _can_rotate_about(
                found.plane,
                own,
                compute_twists_at_samples(samples, leg, locks[leg.label], observation_model.reference),
                samples,
            )
            for leg in decomposition.legs
            if locks[leg.label] and (own := held[leg.label]) is not None and own.turns < 3
        )
    ):
        return other
    # where the turns of all legs are alike, a leg whose tip may move anywhere holds nothing
    binding = (
        ()
        if found is None
        else tuple(
            leg
            for leg in found.legs
            if not leg.is_tip_free
            or (found.motion in TURNING_MOTIONS and leg.turning is not None)
            or (found.motion == "oriented" and leg.turns < 3)
        )
    )
    return replace(found, legs=binding) if found is not None and binding else other


def _can_rotate_about(
    normal: NamedVector, leg: LockedLeg, systems: Sequence[Array], samples: Sequence[ClosedConfiguration]
) -> bool:
    """Return True if a locked leg, which allows these twists (6, k), lets its end rotate about the normal through its
    tip."""
    poses = collect_poses(samples, [*normal.links, *leg.tip.links])
    n, B = normal.value(poses), leg.tip.value(poses)
    turns = np.hstack([cross(B, n), n])
    return all(is_zero_everywhere(t - T @ (T.T @ t)) for t, T in zip(turns, systems, strict=True))


def _find_leg(seen: Observation, decomposition: LegDecomposition, observation_model: ObservationModel) -> str | None:
    """The label of the leg of which an observation is: that it bears, or of the one in which it lies."""
    if seen.leg in decomposition.labels:
        return seen.leg
    inside = {seen.link, seen.seen_from or observation_model.reference} - {
        decomposition.mechanism.base,
        *list_leg_ends(decomposition),
    }
    return next((leg.label for leg in decomposition.legs if inside and inside <= set(leg.links)), None)


def _match_one_body(
    decomposition: LegDecomposition,
    every: tuple[LockedLeg, ...] | None,
    legs: tuple[LockedLeg, ...],
    motions: Array,
    samples: Sequence[ClosedConfiguration],
) -> ConstraintPattern | None:
    """Return the pattern of one platform link: of the observed ``legs``, or of ``every`` leg; None where one has
    none."""
    base, bodies = decomposition.mechanism.base, list_leg_ends(decomposition)
    own = [leg for leg in legs if not leg.virtual]
    if len(own) < len(decomposition.legs) and motions.shape[2] < (2 if own else 3):  # the other legs hold as well
        return None
    if is_zero_everywhere(motions[:, 3:]):
        return _match_translations(decomposition, every, legs, list(motions[:, :3]), samples)
    if any(leg.turns == 0 and not leg.spins for leg in legs):
        return None if every is None else replace(_build_translating(decomposition, every, samples), turning=True)
    if any(leg.turns < 3 and leg.spins for leg in legs):
        return None
    normal = _find_plane_normal(motions)
    if normal is not None and all(leg.line is not None or leg.virtual for leg in legs):
        flat = all(
            is_zero_everywhere(leg.line.value(collect_poses(samples, leg.line.links)) @ normal)
            for leg in legs
            if leg.line is not None
        )
        return ConstraintPattern(
            "planar", base, bodies, legs, plane=_make_normal(decomposition.mechanism, normal), flat=flat
        )
    if every is not None and all(leg.turns == 1 and leg.normal is None and not leg.virtual for leg in every):
        plane = _find_common_plane(decomposition.mechanism, every, samples)
        return None if plane is None else ConstraintPattern("planar", base, bodies, every, plane=plane)
    if motions.shape[2] == 6 and all(leg.turns == 3 or leg.virtual for leg in legs):
        return ConstraintPattern("spatial", base, bodies, legs)
    if every is not None and all(leg.turns >= 2 or leg.virtual for leg in every):
        motion = "spatial" if all(leg.turns == 3 or leg.virtual for leg in every) else "oriented"
        return ConstraintPattern(motion, base, bodies, every)
    return None


def _match_translations(
    decomposition: LegDecomposition,
    every: tuple[LockedLeg, ...] | None,
    legs: tuple[LockedLeg, ...],
    motions: Sequence[Array],
    samples: Sequence[ClosedConfiguration],
) -> ConstraintPattern | None:
    """Return the pattern of translations with the bases (3, d): of the observed ``legs`` if these allow the tips only
    such, else of ``every`` leg, since the others constrain as well; None where one of them has none."""
    if len(motions) == len(samples) and all(_is_confined_to(leg, motions, samples) for leg in legs):
        return _build_translating(decomposition, legs, samples)
    return None if every is None else _build_translating(decomposition, every, samples)


def _is_confined_to(leg: LockedLeg, motions: Sequence[Array], samples: Sequence[ClosedConfiguration]) -> bool:
    """Return True if a leg lets its tip move in these directions (3, d) alone, at all samples."""
    poses = collect_poses(samples, [link for feature in leg.features for link in feature.links])
    across = compute_forbidden_projectors(leg, {feature.symbol: feature.value(poses) for feature in leg.features})
    return all(
        is_zero_everywhere((np.eye(3) - F @ F.T) @ (np.eye(3) - N)) for F, N in zip(motions, across, strict=True)
    )


def _build_translating(
    decomposition: LegDecomposition, legs: tuple[LockedLeg, ...], samples: Sequence[ClosedConfiguration]
) -> ConstraintPattern:
    lines = [leg.line for leg in legs if leg.line is not None]
    plane = None
    if lines and len(lines) == sum(not leg.is_tip_free for leg in legs):
        poses = collect_poses(samples, [link for line in lines for link in line.links])
        _, s, Vt = np.linalg.svd(np.concatenate([line.value(poses) for line in lines]))
        if s[1] > RELATION_ANGLE_TOL * s[0] > s[2]:
            plane = _make_normal(
                decomposition.mechanism, Vt[2], "direction normal to the lines along which the tips move"
            )
    found = ConstraintPattern(
        "translations", decomposition.mechanism.base, list_leg_ends(decomposition), legs, plane=plane
    )
    turns = {
        link: X[:, :3, :3]
        for link, X in collect_poses(samples, [link for each in found.features for link in each.links]).items()
    }
    return replace(
        found, steady={link: freeze_array(R[0]) for link, R in turns.items() if is_zero_everywhere(R - R[0])}
    )


def _match_two_bodies(
    decomposition: LegDecomposition, legs: tuple[LockedLeg, ...], motions: Array, samples: Sequence[ClosedConfiguration]
) -> ConstraintPattern | None:
    """Pattern of two links that only translate, the second along one direction relative to the first. The controlled
    link must be fixed with them, which fails if it is joined by loops with dead points."""
    bodies = list_leg_ends(decomposition)
    still = motions[:, [3, 4, 5, 9, 10, 11]]
    if (
        not decomposition.is_platform_decided
        or len(bodies) != 2
        or motions.shape[2] != 4
        or not is_zero_everywhere(still)
    ):
        return None
    relative = [compute_range_basis(F[6:9] - F[:3], 1.0)[0] for F in motions]
    if any(each.shape[1] != 1 for each in relative):
        return None
    directions = np.array([each[:, 0] for each in relative])
    inner = [j for j in decomposition.mechanism.joints.values() if set(j.links) <= set(decomposition.platform)]
    named = [
        *(make_axis(decomposition.mechanism, j, "e") for j in inner if j.type is JointType.PRISMATIC),
        *_list_tangents(decomposition, [j.name for j in inner], "e"),
    ]
    slide = next((f for f in named if _is_parallel_feature(f, directions, samples)), None)
    if slide is None:
        return None
    return ConstraintPattern("bodies", decomposition.mechanism.base, list_leg_ends(decomposition), legs, slide=slide)


def _compute_motions(
    decomposition: LegDecomposition, observation_model: ObservationModel, samples: Sequence[ClosedConfiguration]
) -> Array:
    """Bases (n, 6 bodies, d) of the motions of the platform links with nothing locked; they differ in number where the
    samples are not alike, then the largest are kept."""
    asked = replace(observation_model, bodies=list_leg_ends(decomposition), observations=())
    found = [compute_relation(at, asked).basis[asked.twist_rows :] for at in samples]
    bases = [compute_range_basis(each, 1.0)[0] for each in found]
    most = max(basis.shape[1] for basis in bases)
    return np.array([basis for basis in bases if basis.shape[1] == most])


def describe_platform_motion(
    decomposition: LegDecomposition, observation_model: ObservationModel, samples: Sequence[ClosedConfiguration]
) -> tuple[str, Array | None]:
    """Motion of a platform of one link with nothing locked: ``translations``, ``planar`` with the normal, or
    ``spatial``."""
    motions = _compute_motions(decomposition, observation_model, samples)
    if is_zero_everywhere(motions[:, 3:]):
        return "translations", None
    normal = _find_plane_normal(motions)
    return ("spatial", None) if normal is None else ("planar", normal)


def _find_common_plane(
    mechanism: Mechanism, legs: Sequence[LockedLeg], samples: Sequence[ClosedConfiguration]
) -> NamedVector | None:
    """The constant direction about which all legs turn and across which all tips move."""
    joints = [j for j in mechanism.joints.values() if j.type is JointType.REVOLUTE]
    axes = [make_axis(mechanism, joint, "n") for joint in joints]
    values = np.concatenate([axis.value(collect_poses(samples, axis.links)) for axis in axes])
    lines = [leg.line for leg in legs if leg.line is not None]
    paths = [line.value(collect_poses(samples, line.links)) for line in lines]
    if not is_zero_everywhere(cross(values, values[0])) or any(
        not is_zero_everywhere(path @ values[0]) for path in paths
    ):
        return None
    return _make_normal(mechanism, values[0])


def _find_plane_normal(motions: Array) -> Array | None:
    """The constant normal of planar motions (n, 6, 3): two translations normal to it, one rotation about it."""
    if motions.shape[2] != 3:
        return None
    turns = np.concatenate([F[3:].T for F in motions])
    _, s, Vt = np.linalg.svd(turns)
    normal: Array = Vt[0]
    flat = max(float(np.max(np.abs(normal @ F[:3]))) for F in motions)
    return normal if s[1] < RELATION_ANGLE_TOL and flat < RELATION_ANGLE_TOL else None


def _make_normal(mechanism: Mechanism, normal: Array, meaning: str = "normal of the plane of motion") -> BodyVector:
    """A constant direction, of the sense in which its largest component is positive."""
    sense = np.sign(normal[np.argmax(np.abs(normal))])
    direction = mechanism.links[mechanism.base].pose[:3, :3].T @ (normal * sense)
    return BodyVector("n", meaning, mechanism.base, freeze_array(direction))


@lru_cache(maxsize=CACHED_LOCKED_LEGS_COUNT)
def _build_locked_leg(
    decomposition: LegDecomposition,
    leg: Leg,
    locks: tuple[Observation, ...],
    reference: str,
    samples: tuple[ClosedConfiguration, ...],
    everywhere: bool,
    translating: bool,
) -> LockedLeg | None:
    """Pattern of the leg with these observations locked, alike at all samples (``everywhere``: all poses), or None."""
    try:
        systems = compute_twists_at_samples(samples, leg, locks, reference)
    except ValueError:
        return None
    symbol = leg.label if leg.label.isalnum() else str(decomposition.labels.index(leg.label) + 1)
    for spot in _list_tips(decomposition, leg, symbol, samples[0].model.length):
        points = spot.value(collect_poses(samples, spot.links))
        parts = split_together(systems, list(points))
        first = parts[0]
        shape = (first.translations.shape[1], first.rotations.shape[1])
        if not all(p.whole and (p.translations.shape[1], p.rotations.shape[1]) == shape for p in parts):
            continue
        line = normal = None
        if shape[0] == 1:
            line = _name_vector(
                decomposition, leg, locks, symbol, np.array([p.translations[:, 0] for p in parts]), samples
            )
        elif shape[0] == 2:
            across = np.array([cross(p.translations[:, 0], p.translations[:, 1]) for p in parts])
            normal = _name_vector(decomposition, leg, locks, symbol, across, samples)
        if shape[0] in (1, 2) and line is None and normal is None:
            return None
        more = may_gain_motion(leg, locks, reference, points, samples, translating) if everywhere else ""
        if more == "tip":
            continue
        return LockedLeg(
            leg.label,
            leg.platform_link,
            spot,
            line,
            normal,
            shape[0] == 0,
            shape[1],
            spins=bool(more),
            held_by=tuple(dict.fromkeys(lock.leg for lock in locks)),
        )
    return None


def _list_tips(decomposition: LegDecomposition, leg: Leg, symbol: str, length: float) -> Iterator[BodyPoint]:
    """Points at which the leg may come apart: its joints on the platform first, then the others, inwards."""
    mechanism = decomposition.mechanism
    joints = [mechanism.joints[name] for name in leg.joints]
    if decomposition.point is not None:
        yield BodyPoint(
            f"B{symbol}", "the platform's point", mechanism.platform, freeze_array(decomposition.point / length)
        )
    for joint in joints:
        if leg.platform_link in joint.links:
            yield make_centre(mechanism, joint, leg.platform_link, f"B{symbol}", length)
    for joint in reversed(joints):
        if leg.platform_link not in joint.links:
            yield make_centre(mechanism, joint, joint.predecessor, f"A{symbol}", length)


def _name_vector(
    decomposition: LegDecomposition,
    leg: Leg,
    locks: Sequence[Observation],
    symbol: str,
    values: Array,
    samples: Sequence[ClosedConfiguration],
) -> NamedVector | None:
    """The first vector with a name that is parallel to ``values`` (n, 3) at all samples."""
    mechanism = decomposition.mechanism
    candidates: list[NamedVector] = []
    for lock in locks:
        if isinstance(lock, Direction):
            candidates.append(
                BodyVector(
                    f"u{symbol}", f"direction observed in leg {leg.label} ({lock.link})", lock.link, lock.direction
                )
            )
    joints = [mechanism.joints[name] for name in leg.joints]
    candidates += [make_axis(mechanism, j, f"p{symbol}") for j in joints if j.type.has_translation]
    candidates += _list_segments(decomposition, leg.joints, f"r{symbol}")
    candidates += _list_tangents(decomposition, leg.joints, f"tau{symbol}")
    candidates += [
        make_axis(mechanism, j, f"a{symbol}", which)
        for j in joints
        if not j.type.has_translation
        for which in range(len(j.axes))
    ]
    return next((f for f in candidates if _is_parallel_feature(f, values, samples)), None)


def _list_tangents(decomposition: LegDecomposition, names: Sequence[str], symbol: str) -> Iterator[Tangent]:
    """Tangents of the paths of joint centres about R axes, for some joints; those on one link first."""
    mechanism, length = decomposition.mechanism, decomposition.mechanism.length
    joints = [mechanism.joints[name] for name in names]
    pairs = [
        (axis, which, end)
        for axis in joints
        if axis.type in TURNING
        for which in range(len(axis.axes))
        for end in joints
        if end is not axis
    ]
    pairs.sort(key=lambda pair: not set(pair[0].links) & set(pair[2].links))
    for axis, which, end in pairs:
        link = next((link for link in axis.links if link in end.links), end.predecessor)
        yield Tangent(
            symbol,
            f"tangent {axis.name} × ({end.name} − {axis.name})",
            make_axis(mechanism, axis, "a", which),
            make_centre(mechanism, axis, axis.links[which], "P", length),
            make_centre(mechanism, end, link, "Q", length),
        )


def _list_segments(decomposition: LegDecomposition, names: Sequence[str], symbol: str) -> Iterator[Segment]:
    """Directions from joint centre to joint centre of the links of a leg."""
    mechanism, length = decomposition.mechanism, decomposition.mechanism.length
    joints = [mechanism.joints[name] for name in names]
    for one, two in combinations(joints, 2):
        for link in sorted(set(one.links) & set(two.links) - {mechanism.base}):
            yield Segment(
                symbol,
                f"direction from {one.name} to {two.name}",
                make_centre(mechanism, one, link, "P", length),
                make_centre(mechanism, two, link, "Q", length),
            )


def _is_parallel_feature(feature: NamedVector, values: Array, samples: Sequence[ClosedConfiguration]) -> bool:
    """Return True if a feature is parallel to vectors (n, 3) at all samples."""
    found = feature.value(collect_poses(samples, feature.links))
    if np.min(np.linalg.norm(found, axis=1)) < RELATION_ANGLE_TOL:
        return False
    return bool(np.max(np.linalg.norm(cross(found, values), axis=1)) < RELATION_ANGLE_TOL)
