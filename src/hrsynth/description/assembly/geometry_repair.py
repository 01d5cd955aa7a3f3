"""Geometry repair: relations that hold to the digits of a file are made exact with the least change.

Printed digits and CAD leave axes parallel to 1e-6, S of three axes that do not meet, rods equal to 1e-7 m. Such noise
opens loops, changes ranks (a loop with redundant constraints becomes rigid) and hides the type of joints. Of all
mechanisms with the relations that hold within a tolerance, the nearest one replaces the file's:
min ‖x − x₀‖ subject to f(x) = 0, by Gauss-Newton on the constraints with a pull back along their tangent space.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...errors import BadMechanism, NoResult, RoundingLimitedRank, UndecidedRank, UndecidedStructure
from ...geometry.ranks import decompose_matrix
from ...geometry.vectors import Array, normalise_vector
from ...mechanism.model import JointType, Mechanism, Note
from ...mechanism.normal import reduce_to_normal_form
from ...mechanism.observations.direction import SeenAxis
from ...solving.gauss_newton import DampingFactor, Residual, descend
from ...tolerances import (
    EXACT_INCIDENCE_TOL,
    GEOMETRY_DIFFERENCE_TOL,
    INCIDENCE_TOL_MAX,
    RANK_CUTOFF_FRACTION,
    RANK_GAP_MIN,
    TOLERANCE_AMBIGUITY_FRACTION,
)
from ..jointgraph import join_names
from ..tree import build_spanning_mechanism
from .loops import LoopAssembly
from .repair_relations import (
    AXIS_MEETING_SINE_MIN,
    Bodies,
    JointCoordinates,
    RepairRelation,
    list_axis_relations,
    list_centre_relations,
    list_definitions,
)

TOLERANCE_HALVINGS_MAX = 5
"""Halvings of the snapping tolerance while relations contradict each other."""
FILE_INCIDENCE_JOINTS_MAX = 120
"""Joints of a foreign file above which rounded incidences are not searched."""

CONTRADICTION = "relations that contradict each other"
DAMPING = DampingFactor(start=1.0, eased=1.0, least=1.0, most=1e2)


@dataclass(frozen=True, eq=False)
class RepairedGeometry:
    """Mechanism with exact ``relations``: those that held only nearly, the largest shift of a centre (m) and rotation
    of an axis (rad), its normal form before the last of them, and its coordinates."""

    mechanism: Mechanism
    normal: Mechanism | None = None
    x: Array | None = None
    relations: frozenset[tuple[str, tuple[str, ...]]] = frozenset()
    mended: tuple[RepairRelation, ...] = ()
    shift: float = 0.0
    turn: float = 0.0

    @property
    def worst(self) -> float:
        """Largest repaired defect."""
        return max((relation.defect for relation in self.mended), default=0.0)

    def notes(self, tolerance: float, length: float, gap: float) -> list[Note]:
        """Return the notes on the repair, relation by relation; ``gap`` is the rank gap of the loops as written."""
        change = max(self.shift / length, self.turn)
        found = [
            Note(
                "merged",
                f"{len(self.mended)} relations of joints that hold to {tolerance:.1g} (characteristic "
                f"lengths, radians; the worst to {self.worst:.1e}) are made exact, largest change "
                f"{change:.1e}; centres moved by up to {1e3 * self.shift:.2g} mm, axes turned by up to "
                f"{np.rad2deg(self.turn):.2g} deg; rank gap of the loops as written "
                f"{gap:.1e} (--tolerance changes this, --as-written keeps the numbers)",
                count=len(self.mended),
                change=change,
            )
        ]
        kinds: dict[str, dict[tuple[str, ...], None]] = defaultdict(dict)
        for relation in self.mended:
            kinds[relation.kind][relation.of] = None
        found += [
            Note("merged", f"made to be {kind}: " + "; ".join(join_names(names, 40) for names in groups), count=0)
            for kind, groups in kinds.items()
        ]
        return found


def snap_geometry(mechanism: Mechanism, residual: float, tolerance: float, possible: float = 0.0) -> Mechanism:
    """Return the mechanism, its loops open by ``residual``, with relations that hold to ``tolerance`` made exact;
    ``possible`` is one that the numbers allow, but do not show.

    Raises
    ------
    UndecidedStructure
        For a result that depends on small changes of the tolerance.
    UndecidedRank
        For loops without a rank gap after the repair.
    RoundingLimitedRank
        For loops whose rank depends on the closure residual alone.
    """
    try:
        reduce_to_normal_form(mechanism)
    except BadMechanism:  # a platform that cannot move is reported by analyses of its motion
        return mechanism
    fine = tolerance
    for _ in range(TOLERANCE_HALVINGS_MAX):
        ideal = nearest(mechanism, fine)
        if ideal is not None:
            break
        fine /= 2.0
    else:
        raise UndecidedStructure(str(mechanism.file), tolerance, _structure(mechanism), CONTRADICTION)
    if fine < tolerance and ideal.worst > fine / TOLERANCE_AMBIGUITY_FRACTION:
        raise UndecidedStructure(str(mechanism.file), fine, _structure(ideal.mechanism), CONTRADICTION)
    coarse = (
        nearest(mechanism, max(TOLERANCE_AMBIGUITY_FRACTION * tolerance, possible), ideal)
        if fine == tolerance
        else None
    )
    if coarse is not None and coarse is not ideal:
        one, two = _structure(ideal.mechanism), _structure(coarse.mechanism)
        if one != two:
            raise UndecidedStructure(str(mechanism.file), tolerance, one, two)
    meant = LoopAssembly.of(ideal.mechanism)
    rank, firm = (
        meant.rank(meant.zero()),
        meant.rank(meant.zero(), max(RANK_CUTOFF_FRACTION, TOLERANCE_AMBIGUITY_FRACTION * residual)),
    )
    if rank.gap < RANK_GAP_MIN:
        raise UndecidedRank(f"{mechanism.file}: loops with rounded numbers", rank.gap, RANK_GAP_MIN)
    if firm.value != rank.value:
        wider = _find_wider_tolerance(mechanism, residual, tolerance)
        raise RoundingLimitedRank(str(mechanism.file), rank.value - firm.value, residual, wider)
    if ideal.mended:
        written = LoopAssembly.of(mechanism)
        gap = written.rank(written.zero(), max(RANK_CUTOFF_FRACTION, TOLERANCE_AMBIGUITY_FRACTION * tolerance)).gap
        found, notes = build_spanning_mechanism(ideal.mechanism), ideal.notes(tolerance, mechanism.length, gap)
    else:
        found, notes = (
            mechanism,
            []
            if residual <= GEOMETRY_DIFFERENCE_TOL
            else [
                Note(
                    "merged",
                    f"the loops are open by up to {residual:.2g} (characteristic lengths, radians; "
                    f"{1e3 * residual * mechanism.length:.2g} mm) at zero, within the tolerance of {tolerance:.1g}: "
                    "the joints that close them are centred",
                    change=residual,
                )
            ],
        )
    return _idealise_directions(replace(found, notes=(*mechanism.notes, *notes)) if notes else found, tolerance)


def _find_wider_tolerance(mechanism: Mechanism, residual: float, tolerance: float) -> float | None:
    """Return a larger tolerance, a power of ten, at which the rank of the loops is decided; None if there is none."""
    wider = 10.0 ** (math.floor(math.log10(tolerance) + 1e-9) + 1)
    if wider > INCIDENCE_TOL_MAX:
        return None
    try:
        snap_geometry(mechanism, residual, wider)
    except RoundingLimitedRank as refused:
        return refused.tolerance
    except NoResult:
        return _find_wider_tolerance(mechanism, residual, wider)
    return wider


def _idealise_directions(mechanism: Mechanism, tolerance: float) -> Mechanism:
    """Return the mechanism with nearly exact observed directions put along segments and axes of their links, or normal
    to axes."""
    found, told = list(mechanism.observations), []
    if not found or tolerance <= EXACT_INCIDENCE_TOL:
        return mechanism
    bodies = Bodies(reduce_to_normal_form(mechanism).mechanism)
    for number, seen in enumerate(found):
        if isinstance(seen, SeenAxis) and seen.link in bodies.of:
            R = mechanism.links[seen.link].pose[:3, :3]
            meant = R.T @ _direction(bodies, seen.link, R @ seen.direction, mechanism.length, tolerance)
            if np.linalg.norm(meant - seen.direction) > EXACT_INCIDENCE_TOL:
                found[number] = replace(seen, direction=meant)
                told.append(f"of leg {seen.leg}")
    note = Note("merged", f"made to be along segments or axes: observed directions {', '.join(told)}")
    return replace(mechanism, observations=tuple(found), notes=(*mechanism.notes, note)) if told else mechanism


def _direction(bodies: Bodies, link: str, d: Array, length: float, tolerance: float) -> Array:
    """Return the segment of joint centres or the axis of a link that is nearest to a direction, within the tolerance,
    its sense kept; else the direction normal to the axes to which it nearly is normal."""
    joints = bodies.on[bodies.of[link]]
    axes = [axis for joint in joints for axis in joint.axes]
    centres = [joint.point for joint in joints if joint.type is not JointType.PRISMATIC]
    lines = [(axis, tolerance) for axis in axes]
    for one, two in combinations(centres, 2):
        size = float(np.linalg.norm(two - one)) / length
        if size > tolerance / AXIS_MEETING_SINE_MIN:
            lines.append((normalise_vector(two - one), tolerance * max(1.0, 1.0 / size)))
    misses = [float(np.linalg.norm(np.cross(d, line))) / within for line, within in lines]
    if min(misses, default=np.inf) <= 1.0:
        line, _ = lines[int(np.argmin(misses))]
        return np.asarray(np.copysign(1.0, d @ line) * line)
    square = [axis for axis in axes if abs(float(d @ axis)) <= tolerance]
    _, s, Vt = decompose_matrix(np.array(square).reshape(-1, 3))
    across = Vt[s > AXIS_MEETING_SINE_MIN]
    return normalise_vector(d - across.T @ (across @ d))


def nearest(mechanism: Mechanism, tolerance: float, known: RepairedGeometry | None = None) -> RepairedGeometry | None:
    """Return the nearest mechanism with all relations that hold to ``tolerance``; None if they contradict each other;
    ``known`` if it has the same ones."""
    if not 1 < len(mechanism.joints) <= FILE_INCIDENCE_JOINTS_MAX or tolerance <= EXACT_INCIDENCE_TOL:
        return RepairedGeometry(mechanism)
    bodies = Bodies(mechanism)
    at = JointCoordinates(mechanism, bodies, tolerance)
    always = list(list_definitions(at))
    held = [*always, *(each for each in list_axis_relations(at, bodies) if each.defect <= tolerance)]
    if known is not None and known.x is not None and known.normal is not None and _names(held) <= known.relations:
        x, normal = known.x, known.normal
    else:
        x, miss = _project(at, held)
        if miss > EXACT_INCIDENCE_TOL:
            return None
        normal = reduce_to_normal_form(at.mechanism_of(x)).mechanism
    held += [each for each in list_centre_relations(at, normal, x) if each.defect <= tolerance]
    if known is not None and _names(held) == known.relations:
        return known
    x, miss = _project(at, held)
    if miss > EXACT_INCIDENCE_TOL:
        return None
    mended = tuple(each for each in held if each.defect > EXACT_INCIDENCE_TOL)
    found = at.mechanism_of(x)
    pairs = [(mechanism.joints[name], joint) for name, joint in found.joints.items()]
    return RepairedGeometry(
        found if mended else mechanism,
        normal,
        x,
        frozenset(_names(held)),
        mended,
        max(float(np.linalg.norm(a.point - b.point)) for a, b in pairs),
        max(
            (float(np.linalg.norm(a - b)) for old, new in pairs for a, b in zip(old.axes, new.axes, strict=True)),
            default=0.0,
        ),
    )


def _names(relations: Sequence[RepairRelation]) -> set[tuple[str, tuple[str, ...]]]:
    return {(each.kind, each.of) for each in relations}


def _project(at: JointCoordinates, relations: Sequence[RepairRelation]) -> tuple[Array, float]:
    """Return the nearest coordinates at which all relations hold, and the largest remaining defect; spherical joints
    alone may have no relation."""
    start, weights = at.start, at.scale
    if not relations:
        return start, 0.0

    def evaluate(x: Array) -> tuple[Array, Array]:
        return (
            np.concatenate([each.value(x) for each in relations]),
            np.vstack([each.gradient(x) for each in relations]),
        )

    def advance(x: Array, here: Residual, factor: float) -> Array:
        # rows that depend on each other at the solution differ by the residual before it: they are not followed
        U, s, Vt = decompose_matrix(here.J / weights)
        kept = s > max(30 * float(np.max(np.abs(here.error))), 1e-9) * s[0]
        V = Vt[kept].T
        back = weights * (start - x)
        step = back - V @ (V.T @ back) - V @ ((U.T @ here.error)[kept] / s[kept])
        return np.asarray(x + step / weights / factor)

    x, left = descend(start, evaluate, advance, DAMPING, 15, lambda here: bool(np.max(np.abs(here.error)) <= 1e-15))
    return x, float(np.max(np.abs(left.error), initial=0.0))


def _structure(mechanism: Mechanism) -> str:
    """Return the joints of the normal form and the mobility, which distinguish two structures."""
    assembly = LoopAssembly.of(mechanism)
    free = assembly.model.nv - assembly.rank(assembly.zero()).value
    types = sorted(str(joint.type) for joint in reduce_to_normal_form(mechanism).mechanism.joints.values())
    counts = ", ".join(f"{types.count(each)} {each}" for each in dict.fromkeys(types))
    return f"joints {counts}; mobility {free}"
