"""What the page on all verdicts says: its tables are those of the catalog, its theorem that of twists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from hrsynth.catalog.architecture_key import ArchitectureKey, JointSymbol, LegKey, parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups.spatial import is_translational_leg, list_translational_legs
from tables import architectures as says


@pytest.mark.slow
def test_the_tables_are_those_of_the_catalog() -> None:
    text = says.PAGE.read_text(encoding="utf-8")
    assert says.written(text, hrsynth.catalog.load()) == text, "the page is stale: make readme"


@pytest.mark.slow
def test_every_record_agrees_with_each_rule() -> None:
    lines = says.rules(hrsynth.catalog.load()).splitlines()[2:]
    assert len(lines) == 4
    for line in lines:
        some, _, every = line.split("|")[2].split()
        assert some == every != "0"


def _leg(letters: str, after: int, rail: bool) -> LegKey:
    axes = iter("xj" if rail else "hj")
    return LegKey(
        tuple(
            JointSymbol(letter, "z" if letter == "R" else next(axes), watched=i == after)
            for i, letter in enumerate(letters)
        )
    )


@st.composite
def planar_legs(draw: st.DrawFn) -> LegKey:
    letters = draw(st.sampled_from(["RRR", "RRP", "RPR", "PRR", "PPR", "PRP", "RPP"]))
    return _leg(letters, draw(st.sampled_from([0, 1])), letters[0] == "P" and draw(st.booleans()))


def left_free(leg: LegKey, rng: np.random.Generator) -> np.ndarray:
    """A basis (3, k) of the platform's twists (ω, vx, vy) while the link after the mark keeps its direction."""
    twists = []
    for joint in leg.joints:
        x, y = rng.normal(size=2)
        twists.append([1.0, y, -x] if joint.letter == "R" else [0.0, 1.0, 0.0] if joint.axes == "x" else [0.0, x, y])
    angle = np.array([[float(joint.letter == "R" and i <= leg.observed) for i, joint in enumerate(leg.joints)]])
    free = np.linalg.svd(angle)[2][np.linalg.matrix_rank(angle) :].T
    return np.array(twists).T @ free


@settings(max_examples=300, deadline=None)
@given(st.lists(planar_legs(), min_size=2, max_size=6), st.integers(0, 2**32 - 1))
def test_the_theorem_on_planar_robots_is_that_of_their_twists(legs: list[LegKey], seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = [np.linalg.svd(basis)[0][:, basis.shape[1] :].T for basis in (left_free(leg, rng) for leg in legs)]
    assert np.linalg.matrix_rank(np.vstack(seen), tol=1e-7) == says.planar_rank(ArchitectureKey("", (tuple(legs),)))


TRANSLATING = [chain for chain in list_translational_legs() if is_translational_leg(chain)]


@st.composite
def translating_legs(draw: st.DrawFn) -> LegKey:
    chain = draw(st.sampled_from(TRANSLATING))
    after = draw(st.integers(0, len(chain.joints) - 2))
    return LegKey(tuple(replace(joint, watched=i == after) for i, joint in enumerate(chain.joints)))


def seen_of_translations(leg: LegKey, rng: np.random.Generator) -> np.ndarray:
    """The rates (3, 3) of the watched direction for the platform's three translations, from the twists of the joints:
    a slide that no turned link carries is normal to z."""
    turning = {name: rng.normal(size=3) for name in "ab"}
    axes, twists = [joint.axes if joint.letter == "R" else "" for joint in leg.joints], []
    for i, axis in enumerate(axes):
        carried = any(0 < axes[:i].count(name) < axes.count(name) for name in "ab")
        way = rng.normal(size=3) * ([1, 1, 1] if carried else [1, 1, 0])
        twists.append([*np.cross(rng.normal(size=3), turning[axis]), *turning[axis]] if axis else [*way, 0, 0, 0])
    rates = np.linalg.lstsq(np.array(twists).T, np.eye(6, 3))[0]
    assert np.allclose(np.array(twists).T @ rates, np.eye(6, 3))
    spin = sum(
        (np.outer(turning[axis], rates[i]) for i, axis in enumerate(axes[: leg.observed + 1]) if axis), np.zeros((3, 3))
    )
    return np.cross(spin, rng.normal(size=3), axis=0)


@settings(max_examples=100, deadline=None)
@given(st.lists(translating_legs(), min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_the_theorem_on_translations_is_that_of_their_twists(legs: list[LegKey], seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = np.vstack([seen_of_translations(leg, rng) for leg in legs])
    assert np.linalg.matrix_rank(seen, tol=1e-7) == says.translation_rank(ArchitectureKey("", (tuple(legs),)))


def test_legs_translate_that_leave_all_translations_and_nothing_idle() -> None:
    """The letters say what the rank of the leg's twists says."""
    rng = np.random.default_rng(2)
    for chain in list_translational_legs():
        turning = {name: rng.normal(size=3) for name in "ab"}
        T = np.array(
            [
                [*np.cross(rng.normal(size=3), turning[joint.axes]), *turning[joint.axes]]
                if joint.letter == "R"
                else [*rng.normal(size=3), 0, 0, 0]
                for joint in chain.joints
            ]
        ).T
        rank, turns = (np.linalg.matrix_rank(each, tol=1e-9) for each in (T, T[3:]))
        assert is_translational_leg(chain) == (rank == len(chain.joints) and rank - turns == 3)


@pytest.mark.some(1)
@pytest.mark.parametrize("word", ["3(Rz*-Rz-Rz)", "3(Rz*!-Rz-Rz)", "3(Px*-Rz-Rz)", "3(Px*!-Rz-Rz)", "3(Px*-Rz!-Ph)"])
def test_the_rule_is_what_derive_finds(word: str) -> None:
    robot = build_mechanism(parse(word))
    assert hrsynth.derive(robot).verdict.rank == says.planar_rank(parse(word))


@pytest.mark.parametrize(
    "word", ["3(Rz*-Rz-Rz)", "3(Ph-Rz*-Pj)", "3(Piz!-Rz*-Rz)", "3(Ra-Ra-Ra-Rb-Rb)", "2(Pk*-2SSt)", "3(Ph!-Rz*-Pj)"]
)
def test_the_observed_link_is_that_of_the_robot(word: str) -> None:
    """The mark of a word whose link is not told is that of the link that is watched."""
    for leg in parse(word).legs:
        told = LegKey(
            tuple(JointSymbol(j.letter, j.axes, j.motor, i == says.mark(leg)) for i, j in enumerate(leg.joints))
        )
        assert told.canonical == leg.canonical
