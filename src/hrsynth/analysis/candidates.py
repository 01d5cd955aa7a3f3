"""What could be measured besides what is: candidates for advice, by structure alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..errors import HrsynthError
from ..mechanism import Direction, JointType, Observation
from ..mechanism.legs import LegDecomposition, observation_of
from ..mechanism.sensors import encoders, line_position
from .observed import ObservedRobot

AXES = {JointType.UNIVERSAL: ("first", "second"), JointType.CYLINDRICAL: ("slide", "turn")}
"""The names of the coordinates of joints that have two."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measurement that could be added.

    ``kind`` is leg (its default segment), direction (of another link), line (the position of a line whose direction is
    observed) or encoder; ``of`` names the leg, the link or the joint. An encoder says which coordinate of the joint it
    reads where there are two, and whether a motor drives the joint.
    """

    kind: str
    of: str
    observation: Observation
    leg: str | None
    axis: str | None = None
    actuated: bool | None = None

    @property
    def name(self) -> str:
        """The name in words: a star marks a joint with a motor."""
        star = "*" if self.actuated else ""
        return f"{self.of}{star}" + (f" ({self.axis})" if self.axis else "")

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        record: dict[str, Any] = {"kind": self.kind, "of": self.of, "leg": self.leg}
        if self.kind == "encoder":
            return {**record, "axis": self.axis, "actuated": self.actuated}
        return {**record, "link": self.observation.link}


def candidates(setting: ObservedRobot) -> tuple[Measurement, ...]:
    """Everything that could be added: legs, directions of other links, positions of observed lines, encoders."""
    return (*_legs(setting), *_directions(setting), *_lines(setting), *_encoders(setting.anatomy))


def _legs(setting: ObservedRobot) -> Iterator[Measurement]:
    for segment in setting.segments:
        if segment.leg not in setting.labels:
            yield Measurement("leg", segment.leg, segment, segment.leg)


def _directions(setting: ObservedRobot) -> Iterator[Measurement]:
    """Segments of all legs but the observed ones and those that a leg is; links without a direction are left out."""
    taken = {o.key for o in setting.observed} | {each.observation.key for each in _legs(setting)}
    for leg in setting.anatomy.legs:
        ends = (setting.mechanism.platform,) if leg.takes_platform else ()
        for link in (*leg.links, *ends):
            if (leg.label, link) in taken:
                continue
            try:
                yield Measurement("direction", link, observation_of(setting.anatomy, link), leg.label)
            except HrsynthError:
                continue


def _lines(setting: ObservedRobot) -> Iterator[Measurement]:
    for seen in setting.observed:
        if isinstance(seen, Direction):
            yield Measurement("line", seen.link, line_position(setting.anatomy, seen), seen.leg)


def _encoders(anatomy: LegDecomposition) -> Iterator[Measurement]:
    """Encoders on all joints of the normal form, those with motors first; joints between links of an articulated
    platform are of no leg."""
    owner = {joint: leg.label for leg in anatomy.legs for joint in leg.joints}
    for joint in sorted(anatomy.mechanism.joints.values(), key=lambda joint: not joint.actuated):
        leg = owner.get(joint.name)
        for number, encoder in enumerate(encoders(anatomy.mechanism, joint, leg or "")):
            axis = AXES[joint.type][number] if joint.type in AXES else None
            yield Measurement("encoder", joint.name, encoder, leg, axis, joint.actuated)
