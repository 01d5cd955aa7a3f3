"""Records of a setup: what is observed and why, mobility, operation modes, joint limits that are ignored.

Each constant is a member of the records of several results, which all have a ``setup``.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..errors import HrsynthError
from ..mechanism.observation import ObservationRecord
from ..mechanism.pose import Pose
from ..mechanism.sensors import explain_default
from ..records import As, Shown
from .observed import Mobility, ObservedRobot


class MobilityWritten(NamedTuple):
    """Mobility in normal form and as the file describes the mechanism."""

    total: int
    internal: int
    as_written: Annotated[Mobility | None, "null if the mechanism of the file could not be sampled"]


class ObservedAxis(ObservationRecord):
    """Observation, its axis in the frame of its link, and the reason for the choice."""

    reason: str


class OperationModeRecord(NamedTuple):
    """Motion of the platform in an operation mode."""

    dof: int
    motion: str
    mobility: int


class OtherMode(NamedTuple):
    """Another operation mode that was found, the observed rank there, and a pose in it."""

    dof: int
    motion: str
    mobility: int
    words: str
    pose: Pose


def compute_mobility_as_written(setup: ObservedRobot) -> Mobility | None:
    """Return the mobility as the file describes the mechanism; None if no samples of it can be computed."""
    try:
        return setup.mobility_as_written
    except HrsynthError:
        return None


def list_observed_axes(setup: ObservedRobot) -> list[ObservedAxis]:
    """Return the observations with the reasons for them."""
    return [{**o.to_dict(), "reason": explain_default(setup.decomposition, o)} for o in setup.observed]


def list_other_modes(setup: ObservedRobot) -> list[OtherMode]:
    """Return the other operation modes that were found."""
    samples = setup.all_samples
    labels, platform = [o.leg for o in samples.observation_model.observations], samples.observation_model.platform
    return [
        OtherMode(
            mode.signature.dof,
            mode.signature.motion,
            mode.signature.mobility,
            mode.beside(samples.signature, labels),
            Pose.of(mode.at.pose(platform)),
        )
        for mode in samples.other_modes
    ]


def describe_other_modes(setup: ObservedRobot) -> list[str]:
    """Return the motion of the platform, the observed rank and a pose of each other operation mode."""
    return [f"{mode.words}, at {mode.pose}" for mode in list_other_modes(setup)]


def _build_operation_mode(setup: ObservedRobot) -> OperationModeRecord:
    signature = setup.all_samples.signature
    return OperationModeRecord(signature.dof, signature.motion, signature.mobility)


MOBILITY = Shown(
    MobilityWritten,
    lambda self: MobilityWritten(
        self.setup.mobility.total, self.setup.mobility.internal, compute_mobility_as_written(self.setup)
    ),
    As("mobility"),
)
"""Mobility of the robot."""
OBSERVATIONS = Shown(list[ObservedAxis], lambda self: list_observed_axes(self.setup))
"""Observations and the reasons for them."""
OPERATION_MODE = Shown(OperationModeRecord, lambda self: _build_operation_mode(self.setup))
"""Operation mode of the samples."""
OTHER_MODES = Shown(list[OtherMode], lambda self: list_other_modes(self.setup))
"""Other operation modes that were found."""
LIMITS_IGNORED = Shown(
    list[str],
    lambda self: self.setup.limits_ignored,
    "joints whose limits are ignored because they are parts of composite joints",
)
"""Joints without limits in the normal form."""
