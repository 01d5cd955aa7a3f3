"""Mobility of a mechanism at closed configurations near its zero: of all, with parts left out, with links locked.

Every count is a rank of the loops' constraints with its gap; it must be equal at several configurations, else it is
None.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..description.assembly.loops import LOOP_ASSEMBLY_TRIES_MAX, LoopAssembly, Values
from ..description.conversion import list_coupling_specs, list_joint_specs
from ..description.jointgraph import FrameSpec, JointSpec
from ..errors import HrsynthError
from ..geometry.vectors import Array, build_pose, invert_pose, transform
from ..mechanism.legs import decompose
from ..mechanism.model import JointType, Mechanism
from ..mechanism.normal import reduce_to_normal_form
from ..tolerances import CLOSURE_SOLVER_TOL, RANK_GAP_MIN

LINT_RANK_SAMPLES_COUNT = 3
"""Configurations near zero at which a rank must agree before lint reports it."""

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class NearbyFreedoms:
    """Mechanism at closed configurations near its zero one."""

    mechanism: Mechanism

    @cached_property
    def assembly(self) -> LoopAssembly:
        """Loop equations of the mechanism."""
        return LoopAssembly.of(self.mechanism)

    @cached_property
    def configurations(self) -> tuple[Values, ...]:
        """Closed values near zero along random motions; zero alone if nothing moves or closes."""
        zero = self.assembly.zero()
        if self.assembly.is_too_large:
            return ()
        found: list[Values] = []
        rng = np.random.default_rng(0)
        for _ in range(LOOP_ASSEMBLY_TRIES_MAX if self.assembly.kernel(zero).size else 0):
            there, residual = self.assembly.close(self.assembly.draw(zero, 0.15, rng))
            if residual <= 10 * CLOSURE_SOLVER_TOL:
                found.append(there)
            if len(found) == LINT_RANK_SAMPLES_COUNT:
                break
        return tuple(found) or (zero,)

    def count(self, without: Collection[str] = (), held: Collection[Pair] = ()) -> int | None:
        """Return the mobility without some closures (or couplings), and with pairs of links locked; None if it differs
        between the configurations, or a rank is unclear."""
        found = set(self._counts(without, held))
        return found.pop() if len(found) == 1 else None

    def _counts(self, without: Collection[str], held: Collection[Pair]) -> Iterator[int | None]:
        joints = [joint for joint in list_joint_specs(self.mechanism) if joint.name not in without]
        gears = [gear for gear in list_coupling_specs(self.mechanism) if gear.name not in without]
        for values in self.configurations:
            poses = self.assembly.poses(values)
            locks = [self._lock(f"held {number}", pair, poses) for number, pair in enumerate(held)]
            assembly = LoopAssembly(self.mechanism.base, [*joints, *locks], gears)
            rank = assembly.rank(values)
            yield assembly.model.nv - rank.value if rank.gap >= RANK_GAP_MIN else None

    @cached_property
    def point(self) -> Array | None:
        """Point of the platform, in its frame, if its rotation is not controlled (docs/pages/theory.md, section 1)."""
        try:
            return decompose(reduce_to_normal_form(self.mechanism).mechanism).point
        except HrsynthError:
            return None

    def _lock(self, name: str, pair: Pair, poses: dict[str, Array]) -> JointSpec:
        """Return the joint that locks two links; for a platform that is a point, that point."""
        one, two = pair
        at, kind = np.eye(4), JointType.FIXED
        if pair == (self.mechanism.base, self.mechanism.platform) and self.point is not None:
            at, kind = build_pose(transform(poses[two], self.point)), JointType.SPHERICAL
        ends = FrameSpec(one, invert_pose(poses[one]) @ at), FrameSpec(two, invert_pose(poses[two]) @ at)
        return JointSpec(name, kind, ends, in_tree=False)

    @property
    def closures(self) -> list[str]:
        """Joints that close loops, and couplings."""
        return [
            *(joint.name for joint in self.mechanism.joints.values() if not joint.in_tree),
            *(gear.name for gear in self.mechanism.couplings),
        ]

    def dead(self) -> Iterator[str]:
        """Yield closures and couplings that do not change the mobility, the last of the file first; each without those
        before it."""
        whole, gone = self.count(), list[str]()
        for name in reversed(self.closures) if whole is not None else ():
            if self.count([*gone, name]) == whole:
                gone.append(name)
                yield name

    def redundant(self, rows: Callable[[str], int]) -> dict[str, int]:
        """Return the number of a closure's constraints (it has ``rows`` of them) that are redundant with those before
        it."""
        gone = self.closures
        before, found = self.count(gone), dict[str, int]()
        for name in self.closures:
            gone = gone[1:]
            after = self.count(gone)
            if before is None or after is None:
                return {}
            if rows(name) > before - after:
                found[name] = rows(name) - (before - after)
            before = after
        return found

    def platform(self, held: Collection[Pair] = ()) -> int | None:
        """Return the platform dof with other links locked."""
        whole = self.count(held=held)
        rest = self.count(held=[*held, (self.mechanism.base, self.mechanism.platform)])
        return None if whole is None or rest is None else whole - rest
