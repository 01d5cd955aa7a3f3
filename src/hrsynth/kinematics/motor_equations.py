"""As many equations as passive coordinates: what the motors' coordinates decide (docs/pages/theory.md, section 12).

q are the motors' coordinates, x the passive ones that the loops decide, G(q, x) = 0 as many of the loops' equations;
idle coordinates (rods that spin between two balls) are held at 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import NoMotorMap
from ..geometry.ranks import kernel_basis
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..results import Value
from ..tolerances import RANK_CUTOFF
from .loop_equations import LoopEquations, Row


@dataclass(frozen=True, eq=False, repr=False)
class MotorEquations(Value):
    """The loops' equations with the places of q, of x and of the idle coordinates among all, and of G's rows among the
    equations; the other equations are met where G's are, as long as the loops' rank is that of the zero
    configuration."""

    equations: LoopEquations
    motors: tuple[int, ...]
    passive: tuple[int, ...]
    idle: tuple[int, ...]
    rows: tuple[int, ...]

    @classmethod
    def of(cls, mechanism: Mechanism) -> MotorEquations:
        """Rows and idle coordinates by pivoting at the zero configuration; raises ``NoMotorMap`` where the motors
        depend on each other there, or do not determine the platform."""
        from scipy.linalg import qr

        equations = LoopEquations.of(mechanism)
        coordinates = equations.coordinates
        motors = tuple(i for i, each in enumerate(coordinates) if each.actuated)
        missed = [joint.name for joint in mechanism.joints.values()
                  if joint.actuated and joint.name not in {coordinates[i].joint for i in motors}]
        if not motors or missed:
            raise NoMotorMap(mechanism.name, f"motors of loops that no tree holds: {', '.join(missed)}" if missed else
                             "it has no motors")
        others = [i for i in range(len(coordinates)) if i not in motors]
        units = np.array([mechanism.length if each.slides else 1.0 for each in coordinates])
        J, V = _derivatives(equations)
        J, V = J * units, V * units
        scale = float(np.linalg.norm(J, 2)) if J.size else 1.0
        J_x = J[:, others]
        every, passive = (kernel_basis(each, scale)[1] for each in (J, J_x))
        what = f"{mechanism.name}: the rank of its loops at zero"
        count = passive.decided(what)
        if every.decided(what) > count:
            raise NoMotorMap(mechanism.name, f"its {len(motors)} motors' coordinates depend on each other at the zero "
                             "configuration, or it is a dead point: leave motors out (--motors), or start elsewhere")
        free = kernel_basis(J_x, scale)[0]
        if np.linalg.norm(V[:, others] @ free) > RANK_CUTOFF * max(1.0, float(np.linalg.norm(V))):
            raise NoMotorMap(mechanism.name, "it can move while they are held, at the zero configuration")
        columns = qr(J_x, pivoting=True, mode="r")[1][:count] if count else []
        kept = qr(J_x[:, columns].T, pivoting=True, mode="r")[1][:count] if count else []
        chosen = {others[i] for i in columns}
        return cls(equations, motors, tuple(i for i in others if i in chosen),
                   tuple(i for i in others if i not in chosen), tuple(sorted(int(i) for i in kept)))

    @cached_property
    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of the motors' and of the passive coordinates."""
        table = self.equations.coordinates
        return tuple(table[i].name for i in self.motors), tuple(table[i].name for i in self.passive)

    def values(self, q: object, x: object) -> list[object]:
        """All coordinates from components of q and x."""
        found: list[object] = [0.0] * len(self.equations.coordinates)
        for places, components in ((self.motors, q), (self.passive, x)):
            for place, value in zip(places, components, strict=True):  # type: ignore[call-overload]
                found[place] = value
        return found

    def system(self, q: object, x: object) -> list[Row]:
        """G with its derivatives, on components of q and x."""
        found = self.equations.rows(self.values(q, x))
        return [found[i] for i in self.rows]

    def evaluate(self, q: Array, x: Array) -> tuple[Array, Array, Array]:
        """G (p,), D_xG (p, p) and D_qG (p, m) at numbers."""
        rows = self.system(list(q), list(x))
        J = np.array([[slopes.get(i, 0.0) for i in range(len(self.equations.coordinates))] for _, slopes in rows],
                     dtype=float).reshape(len(rows), -1)
        return np.array([float(value) for value, _ in rows]), J[:, self.passive], J[:, self.motors]  # type: ignore[arg-type]


def _derivatives(equations: LoopEquations) -> tuple[Array, Array]:
    """At zero: the derivative of all equations, and the platform's velocities, by all coordinates; lengths in
    characteristic lengths."""
    count = len(equations.coordinates)
    values = [0.0] * count
    at = equations.moved(values)
    rows = equations.rows(values)
    J = np.array([[slopes.get(i, 0.0) for i in range(count)] for _, slopes in rows], dtype=float).reshape(-1, count)
    platform = equations.carriers[equations.mechanism.platform]
    x = equations.pose(at, equations.mechanism.platform)[1]
    V = np.zeros((6, count))
    for i, twist in equations.velocity(at, platform, x).items():
        V[:, i] = np.concatenate(twist)
    V[:3] /= equations.mechanism.length
    return J, V
