"""3T1R robots with serial legs: the grammar is all that twists allow, and the verdicts are those of twists."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from hrsynth.catalog import load
from hrsynth.catalog.architecture_key import LegKey, parse
from hrsynth.catalog.groups import words
from hrsynth.catalog.groups.schoenflies import list_sequences
from hrsynth.geometry.vectors import Array
from oracle import exponential

WAYS = np.eye(6)[:, [0, 1, 2, 5]]
"""Three translations and the turn about z."""
TARGET = np.array([0.03, -0.02, 0.02, 0.1])
ZERO, REACHED, STEPS, DRAWS = 1e-7, 1e-9, 6, 4


def placed(letters: str, rng: np.random.Generator) -> list[tuple[Array, Array | None]]:
    """The axis of each joint and a point on it, None for a P; h is one horizontal direction."""
    turn = rng.uniform(0, np.pi)
    axes = {"z": np.array([0.0, 0.0, 1.0]), "h": np.array([np.cos(turn), np.sin(turn), 0.0])}
    return [(axes[letter], rng.normal(size=3)) if letter in axes else (rng.normal(size=3), None) for letter in letters]


def moved(joints: list[tuple[Array, Array | None]], values: Array) -> tuple[Array, Array, Array]:
    """Rotation and place of the end, and the twists (6, n) of the joints: the velocity at the origin, then the turn."""
    turned, at, twists = np.eye(3), np.zeros(3), list[Array]()
    for (axis, point), value in zip(joints, values, strict=True):
        here = turned @ axis
        if point is None:
            twists.append(np.append(here, np.zeros(3)))
            at = at + value * here
        else:
            twists.append(np.append(np.cross(at + turned @ point, here), here))
            turn = exponential(value * axis)
            at, turned = at + turned @ (point - turn @ point), turned @ turn
    return turned, at, np.array(twists).T


def is_a_leg(letters: str, rng: np.random.Generator) -> bool:
    """Whether the end can be led a finite way, by all translations and a turn about z, while it can make these from
    each configuration, every joint moves then, and none moves while the end rests."""
    joints, values = placed(letters, rng), np.zeros(len(letters))
    for share in (0.0, 1.0):
        for _ in range(STEPS):
            turned, at, twists = moved(joints, values)
            left = turned.T @ exponential(share * TARGET[3] * WAYS[3:, 3])
            spin = turned @ [left[2, 1] - left[1, 2], left[0, 2] - left[2, 0], left[1, 0] - left[0, 1]] / 2
            error = np.append(share * TARGET[:3] - at - np.cross(spin, at), spin)
            if np.abs(error).max() < REACHED:
                break
            values = values + np.linalg.lstsq(twists, error, rcond=ZERO)[0]
        else:
            return False
        rates = np.linalg.lstsq(twists, WAYS, rcond=ZERO)[0]
        if (
            np.linalg.matrix_rank(twists, ZERO) < len(letters)
            or np.abs(twists @ rates - WAYS).max() > ZERO
            or np.abs(rates).max(axis=1).min() < ZERO
        ):
            return False
    return True


@cache
def legs_by_twists() -> frozenset[str]:
    """The legs among all chains of up to five joints; some dimensions of a leg may not reach the target."""
    rng = np.random.default_rng(5)
    chains = ["".join(letters) for count in range(1, 6) for letters in product("zhP", repeat=count)]
    assert len(chains) == 363
    return frozenset(letters for letters in chains if any(is_a_leg(letters, rng) for _ in range(DRAWS)))


def joints_of(letters: str) -> list[list[str]]:
    """The letters cut into joints of one, and of two for a U, in every way."""
    if not letters:
        return [[]]
    sizes = (1, 2) if letters[:2] in ("zh", "hz") else (1,)
    return [[letters[:size], *rest] for size in sizes for rest in joints_of(letters[size:])]


def test_the_group_has_each_leg_that_twists_allow() -> None:
    """Each observed link: all but those that a P parts from the one before it. Each U but one on the base."""
    assert set(list_sequences()) == legs_by_twists()
    cuts = [cut for letters in legs_by_twists() for cut in joints_of(letters) if len(cut[0]) == 1]
    listed = [parse(word).legs[0] for word in words("schoenflies")]
    assert {"-".join(cut) for cut in cuts} == {"-".join(letters_of(leg)) for leg in listed}
    assert sum(1 + sum(joint != "P" for joint in cut[1:-1]) for cut in cuts) == len(listed) == len(set(listed))


def letters_of(leg: LegKey) -> list[str]:
    return [joint.letter if joint.letter == "P" else joint.axes for joint in leg.joints]


def observed(leg: LegKey) -> int:
    """The joint after which the observed link follows: at the word's mark, else the link before the first P between two
    moving links, else the last link."""
    letters = letters_of(leg)
    inner = [i for i in range(1, len(letters) - 1) if letters[i] == "P"]
    return leg.observed if leg.observed is not None else inner[0] - 1 if inner else len(letters) - 2


def test_records_are_those_of_twists() -> None:
    """What four directions see of the four freedoms, and how many legs see as much, for legs drawn at random."""
    rng = np.random.default_rng(6)
    records = list(load(group="schoenflies"))
    assert records
    for record in records:
        leg = parse(record["key"]).legs[0]
        letters, count = "".join(letters_of(leg)), sum(map(len, letters_of(leg)[: observed(leg) + 1]))
        seen = []
        for _ in range(4):
            twists = moved(placed(letters, rng), np.zeros(len(letters)))[2]
            rates = np.linalg.lstsq(twists, WAYS, rcond=ZERO)[0]
            seen.append(np.cross(twists[3:, :count] @ rates[:count], rng.normal(size=3), axis=0))
        ranks = [int(np.linalg.matrix_rank(np.vstack(seen[:size]), ZERO)) for size in range(1, 5)]
        fewest = 1 + ranks.index(ranks[-1]) if ranks[-1] else 0
        assert (record["rank"], record["fewest"]) == (ranks[-1], fewest), record["key"]
        assert (record["motion"], record["mobility"], record["internal"]) == ("3T1R", 4, 0)
