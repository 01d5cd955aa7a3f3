"""Motors off: every real actuator becomes passive.

R̲ –  →  R –        (MMT 3.1, 4.2; always)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...mechanism import Joint
from ..evidence import Evidence
from ..rule import Match, Rule, Stage, list_leg_place
from ..state import State


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[list[Joint]]]:
    """Yield all motors of all legs at once."""
    driven = [joint for joint in state.mechanism.joints.values() if joint.is_actuated]
    count = sum(joint.type.freedoms for joint in driven)
    yield Match(
        driven,
        "the robot has no motors"
        if not count
        else "1 real motor becomes passive"
        if count == 1
        else f"{count} real motors become passive",
    )


def apply(state: State, driven: list[Joint]) -> State:
    """Return the state without motors."""
    return replace(state, mechanism=state.mechanism.changed(joints=[replace(joint, motor=None) for joint in driven]))


RULE = Rule("motors off", "MMT 3.1, 4.2", Stage.MOTORS, find, apply, list_leg_place, always=True)
