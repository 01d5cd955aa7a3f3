"""The Type 2 singularities of a hidden robot: the condition, checked against the rank, with poses that satisfy it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import BadRequest
from ...kinematics.configuration import ClosedConfiguration, closed
from ...kinematics.parts import PlatformMotion
from ...kinematics.ranks import range_basis
from ...kinematics.relation import Question, relation
from ...mechanism import Mechanism
from ...mechanism.pose import Pose
from ...mechanism.sensors import encoders
from ...mechanism.vectors import Array
from ...tolerances import SOLVED
from ..controllability import Verdict, verdict_of
from ..freedoms import Freedom, name_freedoms
from ..setting import Setting, prepare
from .agreement import Agreement, agreement, weakest
from .condition import Condition, always, condition
from .locus import Asked, Locus, locus
from .structure import Structure, recognise

POINTS = 10_000
"""Random poses at which words, expression and rank are compared."""
EXAMPLES = 3
STEPS = 51
"""Poses a side of a drawn plane."""
NEARBY = 0.01
"""How far from a singular pose its neighbours are looked at (m)."""


@dataclass(frozen=True, eq=False)
class Example:
    """A singular pose constructed from the condition: the freedoms lost there, Pinocchio's smallest singular value
    there, and the largest a centimetre away."""

    configuration: ClosedConfiguration
    pose: Pose
    lost: tuple[Freedom, ...]
    sigma: float
    nearby: float

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"pose": self.pose.to_dict(), "lost": [f.to_dict() for f in self.lost], "singular_value": self.sigma,
                "singular_value_nearby": self.nearby}


@dataclass(frozen=True, eq=False)
class Singularity:
    """Where a robot loses a freedom of its platform to what is measured: the watched directions, or its own motors."""

    setting: Setting
    question: Question
    real: bool
    verdict: Verdict
    structure: Structure
    condition: Condition | None
    """None where a freedom is lost everywhere."""
    words: str
    checked: Agreement | None
    examples: tuple[Example, ...]

    @property
    def always(self) -> bool:
        """Whether a freedom is lost everywhere: partial controllability."""
        return self.condition is None

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        found = self.condition
        measured = [o.link for o in self.question.observations]
        checked = {"points": 0, "disagreements": 0} if self.checked is None else self.checked.to_dict()
        return {
            "measured": {"kind": "motors" if self.real else "directions",
                         "of": [getattr(o, "joint", link) for o, link in
                                zip(self.question.observations, measured, strict=True)]},
            "dof": self.verdict.dof, "verdict": self.verdict.verdict,
            "lost": [freedom.to_dict() for freedom in self.verdict.lost],
            "always": self.always, "never": found is not None and found.never,
            "words": self.words, "expression": "0" if found is None else str(found.expression),
            "where": {} if found is None else dict(found.where),
            "factors": [] if found is None else list(found.factors),
            "characteristic_length": self.setting.mechanism.length,
            "checked": checked, "examples": [each.to_dict() for each in self.examples],
        }


def singular(robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
             real: bool = False, points: int = POINTS, seed: int = 0,
             progress: Callable[[str], None] | None = None) -> Singularity:
    """The Type 2 condition of the hidden robot (``real``: of the real robot with its own motors), theory 4; MMT 3.3.

    Words, expression and rank are compared at ``points`` random reachable poses and at singular poses constructed from
    the expression; raises ``Disagreement`` where they do not agree, ``BadRequest`` where a robot has no motor.
    """
    def tell(text: str) -> None:
        if progress is not None:
            progress(text)

    tell("sampling")
    setting = prepare(robot, observe, camera, seed=seed)
    question = motors(setting) if real else setting.samples.question
    samples = setting.samples
    if real:
        samples = replace(samples, question=question, members=tuple(
            replace(m, relation=relation(m.configuration, question)) for m in samples.members))
    labels = tuple(dict.fromkeys(o.leg for o in question.observations))
    verdict = verdict_of(setting, labels, samples)
    configurations = [member.configuration for member in samples.members]
    tell("pattern of the legs' wrenches")
    structure = recognise(setting.anatomy, question, configurations)
    if verdict.rank < verdict.dof:
        words = always(structure, [freedom.name for freedom in verdict.lost])
        return Singularity(setting, question, real, verdict, structure, None, words, None, ())
    found = condition(structure, question)
    checked = agreement(samples.start, question, structure, found, points, seed=seed,
                        progress=lambda: tell("random poses"), placer=setting.placer)
    tell("singular poses")
    motion = PlatformMotion.of([samples.start, *configurations], question)
    examples = tuple(_example(setting, question, motion, at) for at in checked.on_locus[:EXAMPLES])
    return Singularity(setting, question, real, verdict, structure, found, found.words, checked, examples)


def drawn(robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
          plane: Pose | str | None = None, steps: int = STEPS, seed: int = 0,
          progress: Callable[[str], None] | None = None) -> Locus:
    """Where the hidden and the real robot (with its own motors) lose a freedom over a plane of poses.

    ``plane`` fixes parts of the pose so that two are left; a robot that is only partially controllable has no locus
    (``BadRequest``). Raises ``PlaneNotMet`` where no pose of the plane is reached.
    """
    def tell() -> None:
        if progress is not None:
            progress("poses of the plane")

    setting = prepare(robot, observe, camera, seed=seed)
    question, samples = setting.samples.question, setting.samples
    configurations = [member.configuration for member in samples.members]
    motion = PlatformMotion.of([samples.start, *configurations], question)
    if verdict_of(setting, tuple(dict.fromkeys(o.leg for o in setting.observed)), samples).rank < setting.dof:
        raise BadRequest(f"{robot.name} has no locus: a freedom is lost at every pose", None,
                         "legs that make it controllable")

    def asked(question: Question) -> Asked:
        structure = recognise(setting.anatomy, question, configurations)
        return question, structure, condition(structure, question)

    real = None
    if any(joint.actuated for joint in setting.mechanism.joints.values()):
        driven = motors(setting)
        if max(relation(at, driven).rank for at in configurations) == setting.dof:
            real = asked(driven)
    wanted = Pose.parse(plane) if isinstance(plane, str) else plane
    return locus(samples.start, motion, wanted, steps, asked(question), real, tell, setting.placer)


def motors(setting: Setting) -> Question:
    """The question that a robot's own motors answer: their coordinates, as encoders would give them."""
    mechanism, anatomy = setting.mechanism, setting.anatomy
    of = {name: leg.label for leg in anatomy.legs for name in leg.joints}
    driven = [joint for joint in mechanism.joints.values() if joint.actuated]
    if not driven:
        raise BadRequest(f"{mechanism.name} has no motor", None, "a transmission on a joint")
    found = tuple(each for joint in driven for each in encoders(mechanism, joint, of.get(joint.name, "")))
    return replace(setting.samples.question, observations=found)


def _example(setting: Setting, question: Question, motion: PlatformMotion, at: ClosedConfiguration) -> Example:
    X = at.pose(question.platform)
    found = relation(at, question)
    twists = np.zeros((6, found.lost.shape[1]))
    twists[: found.lost.shape[0]] = found.lost
    twists[:3] *= at.twin.length
    lost = name_freedoms(twists, setting.anatomy, position=X[:3, 3])
    nearby = max((weakest(other, question) for other in neighbours(at, question, NEARBY)), default=0.0)
    return Example(at, motion.pose(X), lost, weakest(at, question), nearby)


def neighbours(at: ClosedConfiguration, question: Question, distance: float) -> list[ClosedConfiguration]:
    """Configurations whose platform is ``distance`` (m; of its turn, times the characteristic length) away, to both
    sides in each of its freedoms."""
    kernel, _ = at.kernel()
    image = question.rows(at)[: question.twist_rows] @ kernel
    moves, _ = range_basis(image, 1.0)
    motion: Array = kernel @ np.linalg.lstsq(image, moves, rcond=1e-9)[0]
    found = []
    for column in (*motion.T, *-motion.T):
        q, residual = closed(at.twin, at.twin.moved(at.q, column * distance / at.twin.length), tolerance=SOLVED)
        if residual <= 10 * SOLVED:
            found.append(ClosedConfiguration.of(at.twin, q))
    return found
