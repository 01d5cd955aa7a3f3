"""What is computed of a published robot beside what its table says, and every disagreement settled.

A choice of motors loses as many freedoms as the platform keeps with these motors held. The tables count those of the
stated motion; where the platform has others, both figures are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .exact import ModularRanks, by_legs, exact
from .prime_field import NotExact
from .study import Studied, motor_choices
from .tables import Held, MotorChoice, PublishedRobot

MORE, SHAKY, UNMOVED = "more dof", "more dof to first order", "not found to move so"
UNCOUNTED, LARGER, SMALLER = "dof that are not counted", "loses more", "loses less"
FEWER, FURTHER = "fewer choices work", "more choices work"
CLASSES = {
    MORE: "the platform can leave the stated motion: it has more dof than the table states",
    SHAKY: "the same to first order everywhere in the stated motion, but it was not followed out of it",
    UNMOVED: "no configuration with the stated motion was found at random dimensions",
    UNCOUNTED: "the loss that is stated counts the stated motion only: the platform keeps other dof",
    LARGER: "with these motors held the platform keeps more of the stated motion than the table states",
    SMALLER: "it keeps less: the motors determine more than the table states",
    FEWER: "fewer choices of motors hold the stated motion than the table states",
    FURTHER: "more choices of motors hold the stated motion than the table states",
}
"""The kinds of disagreement."""
MODULAR, LEGS, SYMMETRIC = "modulo primes", "modulo primes, leg by leg", "modulo primes, symmetric"
NUMBERS, OPEN = "numbers", "open"
SETTLED = {
    MODULAR: "our figure, by ranks at a random closed configuration modulo two primes",
    LEGS: "our figure, by ranks of the single legs modulo two primes: all translations, and the turns that all have "
    "in common; of a loss: the platform has more dof than there are motors",
    SYMMETRIC: "our figure, by the same ranks at a symmetric configuration; losses can only be smaller elsewhere",
    NUMBERS: "our figure, by ranks of numbers with their gap, at two configurations of generic dimensions",
    OPEN: "not settled",
}
"""By what a disagreement is settled."""


@dataclass(frozen=True)
class TableDisagreement:
    """One figure in which a table and the computation differ: of which robot or choice of motors, where it is written,
    both figures, which kind it is and by what it is settled."""

    robot: str
    group: str
    at: str
    kind: str
    theirs: str
    ours: str
    settled: str

    def to_dict(self) -> dict[str, str]:
        return dict(vars(self))


def compare_robot(robot: PublishedRobot, studies: Sequence[tuple[str, Studied]], seed: int) -> dict[str, Any]:
    """The record of a robot whose free angles were studied as its choices of motors say."""
    by = dict(studies)
    moving = next((each for _, each in studies if each.moves), studies[0][1])
    judge = _Judge(robot, seed)
    found, choices = list[TableDisagreement](), list[dict[str, Any]]()
    where = f"{robot.file}:{robot.line}"
    if not moving.moves:
        found.append(
            TableDisagreement(
                robot.name,
                robot.group,
                where,
                UNMOVED,
                robot.group,
                ", ".join(f"{t}T{r}R" for t, r in moving.others) or "nothing",
                OPEN,
            )
        )
    elif moving.finite is not None and moving.motion is not None:
        ours = "{}T{}R".format(*moving.motion)
        kind = MORE if moving.finite else SHAKY
        found.append(TableDisagreement(robot.name, robot.group, where, kind, robot.group, ours, judge.motion(moving)))
    for drive in robot.drives:
        study = by.get(drive.angles, moving)
        record: dict[str, Any] = {"name": f"A{drive.number}", "theirs": drive.loss, "ours": None, "stated": None}
        if study.moves:
            motors = study.motors[drive.driven]
            record |= {"ours": motors.left, "stated": motors.stated}
            found += _loss(robot, drive, study, judge)
        choices.append(record)
    counts = _working(robot, by, moving)
    if counts["theirs"] is not None and counts["stated"] is not None and counts["theirs"] != counts["stated"]:
        kind = FEWER if counts["stated"] < counts["theirs"] else FURTHER
        found.append(
            TableDisagreement(
                robot.name,
                robot.group,
                where,
                kind,
                str(counts["theirs"]),
                str(counts["stated"]),
                judge.reason_of_count(moving, kind),
            )
        )
    return {
        "robot": robot.name,
        "group": robot.group,
        "at": where,
        "moves": moving.moves,
        "motion": "{}T{}R".format(*moving.motion) if moving.motion else None,
        "finite": moving.finite,
        "idle": moving.idle,
        "angles": moving.letters,
        "related": moving.related,
        "gap": moving.gap,
        "watching": None if moving.watched is None else {**vars(moving.watched), "dof": sum(moving.motion or ())},
        "choices": choices,
        "working": counts,
        "exact": judge.record(moving) if found else None,
        "disagreements": [each.to_dict() for each in found],
    }


def _loss(robot: PublishedRobot, drive: MotorChoice, study: Studied, judge: _Judge) -> list[TableDisagreement]:
    """Whether the table's loss of rank of one choice of motors is ours."""
    motors = study.motors[drive.driven]
    if drive.loss is None or drive.loss == motors.left:
        return []
    name, where = f"{robot.name}A{drive.number}", f"{drive.file}:{drive.line}"
    kind = UNCOUNTED if motors.stated <= drive.loss < motors.left else LARGER if drive.loss < motors.left else SMALLER
    return [
        TableDisagreement(
            name,
            robot.group,
            where,
            kind,
            str(drive.loss),
            f"{motors.left} ({motors.stated} stated)" if motors.left != motors.stated else str(motors.left),
            judge.loss(study, drive.driven, kind),
        )
    ]


def _working(robot: PublishedRobot, by: dict[str, Studied], moving: Studied) -> dict[str, int | None]:
    """How many of the choices that the tables try hold the platform, and its stated motion."""
    if not moving.moves:
        return {"theirs": robot.working, "ours": None, "stated": None}
    listed = {drive.driven: by.get(drive.angles, moving) for drive in robot.drives}
    motors = [
        study.motors[driven]
        for joint in robot.tried
        for driven in [((joint,),) * robot.legs]
        for study in [listed.get(driven, moving)]
        if study.moves
    ]
    return {
        "theirs": robot.working,
        "ours": sum(each.left == 0 for each in motors),
        "stated": sum(each.stated == 0 for each in motors),
    }


class _Judge:
    """Exact ranks of one robot, each computed when it is asked for."""

    def __init__(self, robot: PublishedRobot, seed: int) -> None:
        self.robot, self.seed = robot, seed
        self._known: dict[str, tuple[ModularRanks, ...] | str] = {}

    def ranks(self, study: Studied) -> tuple[ModularRanks, ...] | str:
        """The ranks modulo the primes, or why there are none."""
        if study.letters not in self._known:
            try:
                self._known[study.letters] = exact(self.robot, study.letters, motor_choices(self.robot), self.seed)
            except NotExact as reason:
                self._known[study.letters] = str(reason)
        return self._known[study.letters]

    def motion(self, study: Studied) -> str:
        """By what the platform's freedoms are settled."""
        ranks = self.ranks(study)
        if study.motion is None:
            return NUMBERS
        try:
            if by_legs(self.robot, study.letters, self.seed) == study.motion:
                return LEGS
        except NotExact:
            pass
        if isinstance(ranks, str):
            return NUMBERS
        same = (ranks[0].dof, ranks[0].translations) == (sum(study.motion), study.motion[0])
        return NUMBERS if not same else SYMMETRIC if ranks[0].orbit else MODULAR

    def loss(self, study: Studied, driven: Held, kind: str) -> str:
        """By what a loss of rank is settled: a symmetric configuration can show only that it is no larger."""
        motors = study.motors[driven]
        spare = sum(study.motion or ()) - sum(map(len, driven))
        if kind == UNCOUNTED and motors.left == spare and self.motion(study) == LEGS:
            return LEGS
        ranks = self.ranks(study)
        if isinstance(ranks, str):
            return NUMBERS
        if ranks[0].left[driven] != (motors.left, motors.stated):
            return NUMBERS
        return MODULAR if not ranks[0].orbit else SYMMETRIC

    def reason_of_count(self, study: Studied, kind: str) -> str:
        """By what a number of working choices is settled."""
        settled = {self.loss(study, ((joint,),) * self.robot.legs, kind) for joint in self.robot.tried}
        return next(each for each in (NUMBERS, SYMMETRIC, MODULAR) if each in settled)

    def record(self, study: Studied) -> dict[str, Any] | str:
        """The certificate: prime, ranks, the configuration."""
        ranks = self.ranks(study) if study.moves else "it was not found to move as stated"
        if isinstance(ranks, str):
            return ranks
        return {
            "repeats_after": ranks[0].orbit,
            "angles": study.letters,
            "instances": [
                {
                    "prime": each.prime,
                    "dof": each.dof,
                    "translations": each.translations,
                    "stated": each.stated,
                    "idle": each.idle,
                    "left": {
                        "".join(str(j + 1) for j in driven[0]): list(value) for driven, value in each.left.items()
                    },
                    **each.instance,
                }
                for each in ranks
            ],
        }
