"""Generic zero configuration: one at which ρ is special, though the loops have the mobility of nearby ones, is
replaced.

ρ is the space of (t, u̇) that the loops allow (docs/pages/theory.md, section 2): t of the platform, u̇ of the default
segments of the legs. Samples decide here; later results are computed anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import HrsynthError
from ...geometry.ranks import Rank, compute_range_basis
from ...geometry.screws import compute_point_velocity
from ...geometry.vectors import Array, hat, transform
from ...mechanism.legs import decompose
from ...mechanism.model import Mechanism, Note
from ...mechanism.normal import reduce_to_normal_form
from ...mechanism.observations.direction import Direction
from ...mechanism.sensors import list_default_segments
from ...tolerances import CLOSURE_SOLVER_TOL, RANK_GAP_MIN
from ..keyframes import STAY
from .loops import LOOP_ASSEMBLY_TRIES_MAX, LoopAssembly, Values
from .zero_configuration import moves, with_zero_at

SPECIAL_ZERO_SAMPLES_COUNT = 4
"""Nearby configurations that must agree before a zero configuration is called special."""


@dataclass(frozen=True)
class _Ranks:
    """Mobility of the loops, dim ρ, the platform dof, and how many of these the legs determine: all together, then
    each."""

    freedoms: int
    dimension: int
    dof: int
    seen: tuple[int, ...]

    def beside(self, other: _Ranks, labels: tuple[str, ...]) -> str:
        """Return the first difference of two ranks as a text."""
        single = [f"leg {each} determines" for each in labels]
        names = [f"legs {', '.join(labels)} determine", *single] if len(labels) > 1 else single
        for name, one, two in zip(names, self.seen, other.seen, strict=True):
            if (one, self.dof) != (two, other.dof):
                return f"there {name} {one} of the {self.dof} platform dof, nearby {two}" + (
                    f" of {other.dof}" if self.dof != other.dof else ""
                )
        return f"there dim ρ of platform and segments is {self.dimension}, nearby {other.dimension}"


def with_generic_zero(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with a generic zero configuration nearby if its own is special; unchanged without loops or
    legs, or if nearby configurations differ in rank."""
    if all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    try:
        decomposition = decompose(reduce_to_normal_form(mechanism).mechanism)
    except HrsynthError:
        return mechanism  # analyses report what is wrong
    segments = [each for each in list_default_segments(decomposition).values() if isinstance(each, Direction)]
    if not segments:
        return mechanism
    assembly = LoopAssembly.of(mechanism)
    if assembly.is_too_large:
        return mechanism
    zero = assembly.zero()

    def ranks(values: Values) -> tuple[_Ranks, bool]:
        return _ranks(mechanism, decomposition.point, segments, assembly, values)

    here, _ = ranks(zero)
    found: list[tuple[float, float, Values]] = []
    generic: _Ranks | None = None
    rng = np.random.default_rng(0)
    for number in range(LOOP_ASSEMBLY_TRIES_MAX):
        there = _nearby(assembly, zero, (0.3, 0.15, 0.5)[number % 3], rng)
        if there is None:
            continue
        after, clear = ranks(there)
        if clear and (after == here or after.freedoms != here.freedoms or generic not in (None, after)):
            return mechanism
        if clear:
            generic = after
            found.append((_beyond_limits(mechanism, assembly, there), -assembly.rank(there).weakest, there))
        if len(found) == SPECIAL_ZERO_SAMPLES_COUNT:
            break
    if generic is None or len(found) < SPECIAL_ZERO_SAMPLES_COUNT:
        return mechanism
    there = min(found, key=lambda each: each[:2])[2]
    labels = tuple(dict.fromkeys(each.leg for each in segments))
    lost = here.dof - here.seen[0] > generic.dof - generic.seen[0]
    kind = "a Type 2 singularity of all legs together" if lost else "special"
    note = Note(
        "solved",
        f"the zero configuration is {kind} ({here.beside(generic, labels)}): moved by "
        f"{moves(assembly, there)} (--keyframe {STAY} keeps it)",
    )
    return replace(with_zero_at(mechanism, assembly, there), notes=(*mechanism.notes, note))


def _ranks(
    mechanism: Mechanism, point: Array | None, segments: list[Direction], assembly: LoopAssembly, values: Values
) -> tuple[_Ranks, bool]:
    """Return the ranks at closed values, and True if their gaps are clear."""
    poses = assembly.scaled_poses(values)
    X = poses[mechanism.platform]
    links = {mechanism.platform, mechanism.reference, *(each.link for each in segments)}
    V = assembly.velocities(values, links)
    platform = (
        V[mechanism.platform]
        if point is None
        else compute_point_velocity(V[mechanism.platform], transform(X, point / assembly.length))
    )
    rates = [
        -hat(poses[each.link][:3, :3] @ each.direction) @ (V[each.link] - V[mechanism.reference])[3:]
        for each in segments
    ]
    basis, whole = compute_range_basis(np.vstack([platform, *rates]))
    rows = len(platform)
    t, u = basis[:rows], basis[rows:]
    every: list[Rank] = [whole, compute_range_basis(t, 1.0)[1]]
    seen = []
    for part in [u, *(u[3 * k : 3 * k + 3] for k in range(len(segments)))] if len(segments) > 1 else [u]:
        together, alone = compute_range_basis(np.vstack([t, part]), 1.0)[1], compute_range_basis(part, 1.0)[1]
        seen.append(every[1].value - (together.value - alone.value))  # dof − dim {t : (t, 0) ∈ ρ}
        every += [together, alone]
    loops = assembly.rank(values)
    clear = all(each.gap >= RANK_GAP_MIN for each in (loops, *every))
    return _Ranks(assembly.freedoms(loops), whole.value, every[1].value, tuple(seen)), clear


def _nearby(assembly: LoopAssembly, zero: Values, size: float, rng: np.random.Generator) -> Values | None:
    """Return closed values a random step from zero, all joints moved; None if they do not close near the step's end."""
    ahead = assembly.draw(zero, size, rng)
    there, residual = assembly.close(ahead)
    if residual > 10 * CLOSURE_SOLVER_TOL or assembly.apart(ahead, there) > assembly.apart(ahead, zero) / 2:
        return None
    return assembly.step(there, np.zeros(assembly.size), size * rng.uniform(-1, 1, assembly.model.nv - assembly.size))


def _beyond_limits(mechanism: Mechanism, assembly: LoopAssembly, values: Values) -> float:
    """Return the total violation of the limits of one-dof tree joints (m, radians)."""
    total = 0.0
    for name, q in assembly.singles(values).items():
        limits = mechanism.joints[name].limits
        if limits is not None:
            total += max(
                0.0,
                0.0 if limits.lower is None else limits.lower - q,
                0.0 if limits.upper is None else q - limits.upper,
            )
    return total
