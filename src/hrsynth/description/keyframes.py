"""Keyframes that files name: those of MJCF, the state of an SDF world, group states of an SRDF file next to a robot.

A keyframe gives the values of tree joints, counted from the file's zero configuration, as in :mod:`.jointmotion`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..errors import BadRequest
from ..geometry.so3 import convert_from_quaternion
from ..geometry.vectors import Array, build_pose, freeze_array, invert_pose
from ..mechanism.model import JointType
from ..tolerances import VECTOR_LENGTH_MIN
from . import numerals, xml
from .jointgraph import JointGraph, JointSpec, Posture, join_names

SRDF = ".srdf"
STAY = "zero"
"""Keyframe that every file has, unless it names another one so."""


def read_joint_value(kind: JointType, numbers: Array | Sequence[float], *, scalar_first: bool = True) -> Array | None:
    """Return the value of a joint of this type from a file's numbers, None if their number is wrong.

    A rotation is one angle, or its cosine and sine; a spherical joint is a unit quaternion, a free joint a position and
    one (w x y z, or x y z w if its scalar is not first).
    """
    given = np.array(numbers, dtype=float)
    if kind in (JointType.SPHERICAL, JointType.FREE):
        shift = 0 if kind is JointType.SPHERICAL else 3
        size = float(np.linalg.norm(given[shift:]))
        if len(given) != shift + 4 or not size > VECTOR_LENGTH_MIN:
            return None
        q = given[shift:] / size
        return freeze_array(
            build_pose(
                given[:shift] if shift else np.zeros(3), convert_from_quaternion(q if scalar_first else np.roll(q, 1))
            )
        )
    if kind is JointType.REVOLUTE and len(given) == 2:
        given = np.array([np.arctan2(given[1], given[0])])
    return freeze_array(given) if len(given) == kind.freedoms else None


def find_keyframe(graph: JointGraph, wanted: str) -> Posture:
    """Return the keyframe of that name in the file or in the SRDF file next to it; of ``FILE.srdf:NAME`` in that file.
    Raises ``BadRequest`` with the known names."""
    if wanted in graph.postures or wanted == STAY:
        return graph.postures.get(wanted, {})
    stated, _, name = wanted.rpartition(":")
    states = _group_states(Path(stated)) if stated.endswith(SRDF) else _list_states(graph)
    name = name if stated.endswith(SRDF) else wanted
    if name not in states:
        known = [*graph.postures, *states]
        raise BadRequest(
            f"{graph.file}: no such keyframe",
            wanted,
            join_names(known) if known else "a file that has keyframes, or FILE.srdf:NAME",
        )
    return _read_group_state(graph, name, states[name])


def list_keyframes(graph: JointGraph) -> list[str]:
    """Return the names of the keyframes of a file and of the SRDF file next to it."""
    return [*graph.postures, *_list_states(graph)]


def _list_states(graph: JointGraph) -> dict[str, xml.Element]:
    """Return the group states of the SRDF file that belongs to a robot file by folder and name."""
    path = Path(graph.file)
    places = path.with_suffix(SRDF), path.parent.parent / "srdf" / (path.stem + SRDF)
    return next((_group_states(place) for place in places if place.is_file()), {})


def _group_states(path: Path) -> dict[str, xml.Element]:
    """Return the group states of an SRDF file by name; ``GROUP/NAME`` if groups share a name."""
    found: dict[str, xml.Element] = {}
    for state in xml.parse_document(xml.read_bytes(path), str(path)).findall("group_state"):
        name = state.get("name", "")
        found[f"{state.get('group')}/{name}" if name in found else name] = state
    return found


def _read_group_state(graph: JointGraph, name: str, state: xml.Element) -> Posture:
    """Return the values that a group state gives to joints of the file; others are noted."""
    found, ignored = dict[str, Array](), list[str]()
    for element in state.findall("joint"):
        title, words = element.get("name", ""), element.get("value", "")
        value = None
        if title in graph.joints:
            try:
                numbers = numerals.parse(words, len(words.split()))
                value = read_joint_value(graph.joints[title].kind, numbers, scalar_first=False)
            except ValueError:
                value = None
        if value is None:
            ignored.append(title)
        else:
            found[title] = value
    if ignored:
        graph.note(
            "ignored",
            f"the values of {join_names(ignored)} in the keyframe {name!r}: no such joints, "
            "or not as many numbers as they have coordinates",
        )
    return found


def convert_keyframe(joints: Iterable[JointSpec], zeros: Mapping[str, float], qpos: Array) -> Posture | None:
    """Return the keyframe of MuJoCo's coordinates, joint after joint: R and P count from ``zeros``, a spherical joint
    has 4 numbers, a free joint 7, its pose in the world. None if their number is wrong."""
    found, at = dict[str, Array](), 0
    for joint in joints:
        kind, name = joint.kind, joint.name
        count = {JointType.SPHERICAL: 4, JointType.FREE: 7}.get(kind, 1)
        value = read_joint_value(kind, list(qpos[at : at + count]))
        if value is None:
            return None
        if kind is JointType.FREE:
            value = freeze_array(invert_pose(joint.ends[0].X) @ value)
        found[name] = value if kind.freedoms > 1 else freeze_array(value - zeros[name])
        at += count
    return found if at == len(qpos) else None
