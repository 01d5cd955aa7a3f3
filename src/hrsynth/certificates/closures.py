"""The whole robot at its modes, for certificates: joints, what is held, and where the links are at each mode.

Links are displaced by D (3, 4) since the zero configuration, all lengths in characteristic lengths, base axes: a joint
has one point and one set of axes for both of its links, and closes at D₁, D₂ where these put them alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.measured import MeasuredRobot
from ..analysis.modes.modes import AssemblyModes
from ..constraints.pattern import list_leg_ends
from ..geometry.vectors import Array, invert_pose
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.observations.direction import Direction
from ..mechanism.observations.encoder import Encoder
from ..solving.platform.quadrics import UNIT, WorkingFrame
from ..solving.platform.solve import SystemMode
from ..tolerances import CLOSURE_RESIDUAL_TOL


def write_numbers(values: Any) -> Any:
    """Floats and fractions as the checker reads them."""
    if isinstance(values, Fraction | float | np.floating):
        return str(Fraction(values) if isinstance(values, Fraction) else Fraction(float(values)))
    return [write_numbers(each) for each in values]


@dataclass(frozen=True, eq=False)
class ClosedRobot:
    """A robot with the closed configurations of its modes; ``record``: its joints and what is held."""

    found: AssemblyModes
    record: dict[str, Any]

    @classmethod
    def of(cls, found: AssemblyModes) -> ClosedRobot | None:
        """None where a joint or a measurement is of a kind that the checker does not know."""
        mechanism = found.setup.mechanism
        held = list(_held_measurements(found))
        kinds = {joint.type for joint in mechanism.joints.values()}
        if mechanism.couplings or not held or None in held or JointType.FREE in kinds or found.model is None:
            return None
        length = found.goal.model.length
        joints = [
            [
                joint.type.value,
                joint.predecessor,
                joint.successor,
                *write_numbers([[*joint.point / length, 1.0], *([*axis, 0.0] for axis in joint.axes)]),
            ]
            for joint in mechanism.joints.values()
        ]
        return cls(found, {"joints": joints, "held": held})

    def bodies(self, mode: SystemMode) -> dict[str, Array]:
        """The poses (4, 4) of the bodies on which legs end at a mode of the list's own system."""
        assert self.found.model is not None
        return self.found.model.bodies(mode.q)

    def at(self, bodies: Mapping[str, Array]) -> ClosedConfiguration | None:
        """The configuration with bodies there; None where the robot was not found closed."""
        return next(
            (
                each.configuration
                for each in self.found.modes
                if each.bodies is not None
                and all(np.abs(X - each.bodies[body]).max() <= CLOSURE_RESIDUAL_TOL for body, X in bodies.items())
            ),
            None,
        )

    def links(self, at: ClosedConfiguration) -> dict[str, Any]:
        """The displacements of all links."""
        mechanism = self.found.setup.mechanism
        return {link: write_numbers(displacement(mechanism, at, link)) for link in mechanism.links}

    def places(
        self,
        bodies: Sequence[int],
        frame: WorkingFrame,
        at: ClosedConfiguration,
        tips: Sequence[Any],
        arrows: int,
        hub: Sequence[Any],
    ) -> dict[str, Any]:
        """A system's frame, and its tips as points or, the last, arrows of the robot's links, by where they are at a
        configuration in working coordinates."""
        names = (
            list_leg_ends(self.found.setup.decomposition) if self.found.confined is None else self.found.confined.bodies
        )
        length, found = at.model.length, []
        for k, (body, tip) in enumerate(zip(bodies, tips, strict=True)):
            link, point = names[body], float(k < len(tips) - arrows)
            there = np.array(tip, dtype=float) - (1.0 - point) * np.array(hub, dtype=float)[: len(tip)]
            D = displacement(self.found.setup.mechanism, at, link)
            v = (point * frame.origin + frame.size * there @ frame.R) / length - point * D[:, 3]
            found.append([link, [*write_numbers(D[:, :3].T @ v), str(int(point))]])
        return {"frame": write_numbers([frame.origin / length, *frame.R, [frame.size / length]]), "tips": found}


def displacement(mechanism: Mechanism, at: ClosedConfiguration, link: str) -> Array:
    """D of a link since the zero configuration of a mechanism, shape (3, 4)."""
    X = at.pose(link) @ invert_pose(mechanism.links[link].pose)
    return np.column_stack([X[:3, :3], X[:3, 3] / at.model.length])


def _held_measurements(found: AssemblyModes) -> Iterator[list[Any] | None]:
    """Yield the measured values: a link's directions and points, the link from which they are observed, and their
    values at the goal; None of another kind."""
    setup, at = found.setup, found.goal
    measured = MeasuredRobot.of(setup, found.kind == "real")
    observations, mechanism = measured.observation_model.observations, setup.mechanism
    for each in observations:
        if isinstance(each, Direction):
            d = mechanism.links[each.link].pose[:3, :3] @ each.direction
            yield _seen_values(
                mechanism, at, each.link, each.seen_from or measured.observation_model.reference, [*d, 0.0]
            )
        elif isinstance(each, Encoder):
            joint = mechanism.joints[each.joint]
            if sum(isinstance(o, Encoder) and o.joint == each.joint for o in observations) < joint.type.freedoms:
                yield None
            else:
                yield from _locked_joints(mechanism, at, joint)
        else:
            yield None


def _locked_joints(mechanism: Mechanism, at: ClosedConfiguration, joint: Joint) -> Iterator[list[Any]]:
    for x in ([1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [*joint.point / at.model.length, 1.0]):
        yield _seen_values(mechanism, at, joint.successor, joint.predecessor, x)


def _seen_values(mechanism: Mechanism, at: ClosedConfiguration, link: str, other: str, x: Sequence[float]) -> list[Any]:
    D, E = displacement(mechanism, at, link), displacement(mechanism, at, other)
    return [link, other, write_numbers(x), write_numbers(E[:, :3].T @ (D @ x - x[3] * E[:, 3]))]


def round_numbers(x: Any) -> Any:
    """Numbers to one part in 2⁻⁵², as fractions."""
    if np.ndim(x) == 0:
        return Fraction(round(float(x) * UNIT), UNIT)
    return [round_numbers(each) for each in x]
