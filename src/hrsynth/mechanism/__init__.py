"""Joint graphs: links, joints, normal form, legs, notation, screws."""

from .model import Coupling, Joint, JointType, Limits, Link, Mechanism, Motor, Note
from .observation import Observation
from .observations.direction import Direction

__all__ = ["Coupling", "Direction", "Joint", "JointType", "Limits", "Link", "Mechanism", "Motor", "Note", "Observation"]
