"""What a file says of a joint graph before anything is checked or put together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..geometry.vectors import Array, frozen
from ..mechanism.model import JointType, Limits, Motor

ORIGIN = frozen(np.eye(4))


@dataclass(frozen=True, eq=False)
class End:
    """One end of a joint: the link, the joint's frame in it (4, 4), the line."""

    link: str | None
    X: Array = field(default_factory=lambda: ORIGIN)
    line: int | None = None


@dataclass(frozen=True, eq=False)
class Edge:
    """A joint as a file gives it; ``type`` None for an unknown type. The first axis is fixed in the predecessor's joint
    frame (R, P, C, E: the same vector in both), the second (U) in the successor's."""

    name: str
    type: JointType | None
    ends: tuple[End, End]
    axes: tuple[Array, ...] = ()
    limits: Limits | None = None
    xml: tuple[str, ...] = ()
    line: int | None = None
    motor: Motor | None = None
    in_tree: bool = True

    @property
    def links(self) -> tuple[str, str]:
        """Predecessor and successor."""
        return str(self.ends[0].link), str(self.ends[1].link)
