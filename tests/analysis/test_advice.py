"""What is missing: the cures of robots that are known, and all of them against the oracle, by finite differences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache
from itertools import combinations
from math import comb

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import hrsynth
from hrsynth.analysis import advice as module
from hrsynth.analysis.advice import Advice, advise, list_candidates
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from hrsynth.description import load
from hrsynth.description.observation_text import split_offers
from hrsynth.errors import BadRequest, HrsynthError
from hrsynth.geometry.vectors import Array, normalise_vector
from hrsynth.mechanism import Mechanism, Observation
from hrsynth.mechanism.builder import Builder
from hrsynth.present.text import robots as text
from hrsynth.tolerances import RANK_GAP_MIN
from kinematics.robots import ROBOTS, setting_of
from oracle import NotAssembled, Oracle, Undecided
from strategies import parallel_robots, random_rotation, transformed

Set = frozenset[tuple[str, ...]]
STEP = 1e-5


@cache
def found(robot: str, observe: str = "all", camera: str | None = None) -> Advice:
    return advise(load(robot), observe, camera)


def kinds(answer: Advice) -> Counter[tuple[str, ...]]:
    return Counter(tuple(sorted(m.kind for m in each.measurements)) for each in answer.sets)


def singles(answer: Advice, kind: str) -> set[str]:
    assert answer.size == 1
    return {each.measurements[0].of for each in answer.sets if each.measurements[0].kind == kind}


# ---- by the oracle


def rate_rows(oracle: Oracle, state: Array, basis: Array, observations: Sequence[Observation]) -> list[Array]:
    """The rates of each observation along the columns of ``basis``, by differences of its value; SI."""
    ahead, behind = ([oracle.moved(state, s * column) for column in basis.T] for s in (STEP, -STEP))

    def value(each: Observation, at: Array) -> Array:
        return each.value(oracle.pose(at, each.seen_from or oracle.mechanism.reference), oracle.pose(at, each.link))

    return [
        np.array([(value(o, a) - value(o, b)) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)])
        .reshape(-1, o.size)
        .T
        for o in observations
    ]


class Independent:
    """What stays lost with any further measurements, by maximal coordinates in a random walk, or ``at_zero``."""

    def __init__(
        self, robot: Mechanism, observe: str | None, camera: str | None = None, seed: int = 1, *, at_zero: bool = False
    ) -> None:
        setup = ObservedRobot.of(robot, observe, camera, samples=1)
        self.everything = list_candidates(setup)
        oracle = Oracle(setup.mechanism)
        self.state = (
            np.array([link.pose for link in setup.mechanism.links.values()])
            if at_zero
            else list(oracle.random_walk(np.random.default_rng(seed), 2))[-1]
        )
        basis = oracle.kernel(self.state)[0]
        point = setup.decomposition.point
        twist = oracle.twist(basis, setup.mechanism.platform)
        if point is not None:
            arm = oracle.pose(self.state, setup.mechanism.platform)[:3, :3] @ point
            twist = twist[:3] + np.cross(twist[3:].T, arm).T
        self.twist = twist
        self.seen = np.vstack(rate_rows(oracle, self.state, basis, setup.observed))
        rows = rate_rows(oracle, self.state, basis, [each.observation for each in self.everything])
        self.rows = {name_of(each.observation): block for each, block in zip(self.everything, rows, strict=True)}

    def lost(self, added: Set) -> int:
        """dim {t : (t, 0) ∈ ρ}."""
        rows = np.vstack([self.seen, *(self.rows[name] for name in added)])
        return rank(np.vstack([rows, self.twist])) - rank(rows)

    def cures(self, size: int) -> set[Set]:
        """All sets of this many measurements with which nothing is lost."""
        return {frozenset(each) for each in combinations(self.rows, size) if self.lost(frozenset(each)) == 0}


def rank(rows: Array) -> int:
    return int(np.linalg.matrix_rank(rows, tol=1e-6))


def name_of(observation: Observation) -> tuple[str, ...]:
    return (type(observation).__name__, *observation.key)


def sets_of(answer: Advice) -> set[Set]:
    return {frozenset(name_of(m.observation) for m in each.measurements) for each in answer.sets}


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "observe", "camera"),
    [
        ("uranesx", "all", None),
        ("i4l", "all", None),
        ("i4l", "1", "platform"),
        ("prrrp_parallel", "all", None),
        ("prrrp_parallel_point", "all", None),
        ("3prp", "all", None),
        ("3rrp", "all", None),
        ("3ppr_m1", "all", None),
        ("rprpr_m1", "1", None),
        ("quattro", "1", None),
        ("quattro", "1,2", None),
        ("3rps", "1", None),
        ("3rrr_m1", "1", "platform"),
        ("hexaglide", "all", None),
        ("gough_stewart", "1", None),
    ],
)
def test_all_cures_and_only_those_are_found(robot: str, observe: str, camera: str | None) -> None:
    """Exhaustively: every smallest set that cures by the oracle is found, but for directions that tell what another
    one does; no smaller set cures."""
    answer = found(robot, observe, camera)
    oracle = Independent(load(robot), observe, camera)
    assert answer.complete
    assert oracle.lost(frozenset()) == answer.now.dof - answer.now.rank > 0
    for size in range(1, answer.size):
        assert not oracle.cures(size)
    cures, sets = oracle.cures(answer.size), sets_of(answer)
    assert sets
    assert sets <= cures
    listed = {name for each in sets for name in each}
    assert all(any(name not in listed and name[0] == "Direction" for name in each) for each in cures - sets)


@pytest.mark.parametrize(("robot", "observe", "fewer"), [("3rps", "1", 10), ("quattro", "1", 0), ("uranesx", "all", 0)])
def test_cures_that_are_none_at_zero_are_told(robot: str, observe: str, fewer: int) -> None:
    """Where the zero configuration is singular with a set, by the oracle there; what is asked next cures there too."""
    answer, oracle = found(robot, observe), Independent(load(robot), observe, at_zero=True)
    dof = answer.now.dof
    shown = [dof - oracle.lost(frozenset(name_of(m.observation) for m in each.measurements)) for each in answer.sets]
    assert [each.verdict.rank_at_zero for each in answer.sets] == [None if rank == dof else rank for rank in shown]
    assert sum(rank < dof for rank in shown) == fewer
    assert [each.to_dict().get("rank_at_zero", dof) for each in answer.sets] == shown
    said = text.format_advice(answer)
    assert ("at the zero configuration, a Type 2 singularity" in said) == (fewer > 0)
    assert not fewer or f"\n{fewer} of these have a lower rank" in said


@settings(max_examples=5, deadline=None, suppress_health_check=list(HealthCheck))
@given(parallel_robots(), st.integers(0, 2**16))
def test_advice_on_random_robots(robot: Mechanism, seed: int) -> None:
    """With one leg observed: the oracle sees as much with what is advised, less with one measurement less, and no more
    with everything there is."""
    try:
        answer = advise(robot, ["1"])
        oracle = Independent(robot, "1", seed=seed)
    except (HrsynthError, NotAssembled, Undecided):
        assume(False)
    assert oracle.lost(frozenset()) == answer.now.dof - answer.now.rank
    if answer.complete and not answer.nothing_missing:
        best = answer.sets[0].verdict.rank if answer.sets else answer.now.rank
        assert oracle.lost(frozenset(oracle.rows)) == answer.now.dof - best
    for each in list(sets_of(answer))[:20]:
        assert oracle.lost(each) == answer.now.dof - answer.sets[0].verdict.rank
        assert all(oracle.lost(each - {name}) > oracle.lost(each) for name in each)


# ---- robots that are known


@pytest.mark.some(3)
@pytest.mark.parametrize("robot", ["uranesx", "i4l", "prrrp_parallel", "prrrp_parallel_point", "hexaglide"])
def test_parallel_rails_need_one_rail_or_one_line(robot: str) -> None:
    """The rods' directions do not see the translation along the rails: the position of any one rod, or the encoder of
    any one rail, does."""
    answer = found(robot)
    setup = setting_of(robot)
    assert answer.now.verdict == PARTIAL
    assert [freedom.name.startswith("translation along") for freedom in answer.now.unobserved] == [True]
    rails = {j.name for j in setup.mechanism.joints_of(setup.mechanism.base) if j.type == "P"}
    assert singles(answer, "encoder") == rails
    assert singles(answer, "line") == {o.link for o in setup.observed}
    assert len(answer.sets) == len(answer.setup.observed) * 2
    assert all(m.actuated for each in answer.sets for m in each.measurements if m.kind == "encoder")


@pytest.mark.some(1)
@pytest.mark.parametrize(("robot", "size"), [("3prp", 2), ("3rrp", 2), ("3ppr_m2", 3)])
def test_blind_planar_robots(robot: str, size: int) -> None:
    """Directions that all turn as one (or not at all) leave two (three) freedoms: as many encoders or lines."""
    answer = found(robot)
    assert answer.size == size
    assert answer.has_sufficient_sets
    motors = {j.name for j in setting_of(robot).mechanism.joints.values() if j.is_actuated}
    driven = [each for each in answer.sets if {m.of for m in each.measurements} <= motors]
    assert len(driven) == comb(3, size)
    assert ("line",) * size in kinds(answer)
    if robot.startswith("3ppr"):
        assert answer.now.verdict == BLIND


def test_a_pod_with_one_leg_observed_needs_two_more() -> None:
    answer = found("gough_stewart", "1")
    assert {frozenset(m.of for m in each.measurements) for each in answer.sets} == set(
        map(frozenset, combinations("23456", 2))
    )
    assert kinds(answer) == {("leg", "leg"): 10}


def test_the_other_half_of_an_articulated_platform() -> None:
    """Legs 3 and 4, on the other half, are the cures; no single encoder is one."""
    assert singles(found("quattro", "1"), "leg") == {"3", "4"}
    assert kinds(found("quattro", "1")) == {("leg",): 2}


def test_the_directions_of_either_part_of_a_telescope_are_one() -> None:
    """Of links that only slide along each other one direction is offered; that of an observed one is not."""
    answer = found("3rpr_m1", "1")
    assert {m.of for each in answer.sets for m in each.measurements if m.kind == "leg"} == {"2", "3"}
    assert not any(m.kind == "direction" for each in answer.sets for m in each.measurements)


@pytest.mark.parametrize(
    ("robot", "observe"),
    [("quattro", "all"), ("quattro", "1,4"), ("delta", "1,2"), ("gough_stewart", "1,3,5"), ("rrrrr_m1", "all")],
)
def test_nothing_is_missing(robot: str, observe: str) -> None:
    answer = found(robot, observe)
    assert answer.nothing_missing
    assert answer.now.verdict == CONTROLLABLE
    assert not answer.sets
    record = answer.to_dict()
    assert record["nothing_missing"] is True
    assert (record["sets"], record["size"], record["tried"], record["complete"]) == ([], 0, 0, True)


# ---- laws


@pytest.mark.parametrize("robot", ["uranesx", "3prp", "i4l"])
def test_the_record(robot: str) -> None:
    answer = found(robot)
    record = answer.to_dict()
    assert record["nothing_missing"] is False
    assert record["rank"] + len(record["unobserved"]) == record["dof"]
    assert len(record["sets"]) == len(answer.sets) <= record["tried"]
    for each in record["sets"]:
        assert (each["verdict"], each["rank"]) == (CONTROLLABLE, record["dof"])
        assert each["gap"] > RANK_GAP_MIN
        assert len(each["measurements"]) == record["size"]
        for m in each["measurements"]:
            assert m["kind"] in ("leg", "direction", "line", "encoder")
            assert isinstance(m["actuated"], bool) if m["kind"] == "encoder" else m["link"]


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["uranesx", "3rrp", "i4l"])
def test_where_the_robot_stands_and_the_seed_do_not_matter(robot: str) -> None:
    rng = np.random.default_rng(4)
    tilted = transformed(load(robot), random_rotation(rng), rng.normal(size=3))
    assert sets_of(advise(tilted, seed=3)) == sets_of(found(robot))


def test_the_budget_is_kept_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no set within the budget cures, the best there are come back, and the answer says that it is not
    complete."""
    monkeypatch.setattr(module, "ADVICE_SET_SIZE_MAX", 2)
    answer = advise(load("3ppr_m1"))
    assert not answer.has_sufficient_sets
    assert not answer.complete
    assert answer.size == 2
    assert {each.verdict.rank for each in answer.sets} == {2}
    monkeypatch.setattr(module, "LARGEST_COUNT", 5)
    assert not advise(load("3prp")).complete


def two_rods(foot: str, charm: bool = False) -> Mechanism:
    """A platform on two rods with ball ends: nothing sees it turn about the line of these. A ``charm`` hangs on it, and
    moves nothing else."""
    rng = np.random.default_rng(8)
    builder = Builder("two_rods")
    builder.link("base")
    builder.link("platform", (0.0, 0.1, 1.0), random_rotation(rng))
    for number, side in ((1, -1.0), (2, 1.0)):
        A, B = np.array([side, 0.2, 0.1]), np.array([0.4 * side, 0.0, 0.9])
        first = normalise_vector(np.cross(B - A, (1.0, 2.0, 0.5)))
        above = "base"
        if foot == "PU":
            above = f"carriage_{number}"
            builder.link(above, A)
            builder.joint(f"rail_{number}", "P", "base", above, A, axis=(0.3, side, 0.2), motor=True)
        builder.link(f"rod_{number}", A)
        builder.joint(
            f"foot_{number}",
            "U",
            above,
            f"rod_{number}",
            A,
            axis=first,
            axis2=np.cross(first, B - A),
            motor=foot == "U",
        )
        builder.joint(f"tip_{number}", "S", f"rod_{number}", "platform", B, loop=number == 2)
    if charm:
        builder.link("charm", (0.1, 0.2, 1.2))
        builder.joint("hook", "R", "platform", "charm", (0.0, 0.1, 1.0), axis=(1.0, 0.3, 0.2))
    return builder.build(platform="platform")


@pytest.mark.parametrize("charm", [False, True])
def test_nothing_helps(charm: bool) -> None:
    """What no leg, link, line or encoder sees: no set at all, and the search is complete; an encoder that sees what
    moves no platform is no help."""
    answer = advise(two_rods("U", charm))
    assert (answer.now.verdict, answer.now.rank, answer.now.dof) == (PARTIAL, 3, 4)
    assert [freedom.name for freedom in answer.now.unobserved] == ["rotation about the line B1 B2"]
    assert not answer.sets
    assert not answer.has_sufficient_sets
    assert not answer.nothing_missing
    assert answer.complete
    assert text.format_advice(answer).endswith("\nNo set of legs, links, lines and encoders has a higher rank")


def test_some_of_it_helps() -> None:
    """The rails' encoders (or the rods' lines) see one of the two lost freedoms; the other stays."""
    answer = advise(two_rods("PU"))
    assert (answer.now.rank, answer.now.dof) == (4, 6)
    assert (answer.size, answer.has_sufficient_sets, answer.complete) == (1, False, True)
    assert {each.verdict.rank for each in answer.sets} == {5}
    assert singles(answer, "encoder") == {"rail_1", "rail_2"}
    assert singles(answer, "line") == {"rod_1", "rod_2"}
    assert text.format_advice(answer).endswith("\nNo set of legs, links, lines and encoders has a higher rank")


@pytest.mark.parametrize(("robot", "observe"), [("3rrp", "all"), ("gough_stewart", "1")])
def test_in_small_batches_too(monkeypatch: pytest.MonkeyPatch, robot: str, observe: str) -> None:
    monkeypatch.setattr(module, "ADVICE_BATCH_COUNT", 7)
    answer = advise(load(robot), observe)
    assert (sets_of(answer), answer.tried) == (sets_of(found(robot, observe)), found(robot, observe).tried)


@pytest.mark.parametrize("robot", ["3prp", "gough_stewart", "quattro", "3upu"])
def test_motors_come_first(robot: str) -> None:
    """Legs, directions, lines, then encoders, those on joints with motors before the others."""
    all_samples = list_candidates(setting_of(robot, ("1",)))
    order = [("leg", "direction", "line", "encoder").index(each.kind) - bool(each.actuated) / 2 for each in all_samples]
    assert order == sorted(order)
    assert "1" not in {each.of for each in all_samples if each.kind == "leg"}


def test_progress_and_the_public_name() -> None:
    told: list[str] = []
    assert hrsynth.advise is advise
    with hrsynth.on_progress(told.append):
        advise(load("3prp"))
    assert {"sampling", "sets of 1", "sets of 2", "verification"} == set(told)


@pytest.mark.parametrize(("observe", "camera", "value"), [("9", None, "9"), ("1", "moon", "moon")])
def test_unknown_names(observe: str, camera: str | None, value: str) -> None:
    with pytest.raises(BadRequest) as caught:
        advise(load("delta"), observe, camera)
    assert caught.value.got == value


@pytest.mark.some(0, 16)
@pytest.mark.parametrize("camera", [None, "platform"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot_with_one_leg_observed(robot: str, camera: str | None) -> None:
    if camera is not None and camera not in load(robot).links:
        pytest.skip("the platform has another name")
    answer = found(robot, "1", camera)
    oracle = Independent(load(robot), "1", camera)
    assert answer.has_sufficient_sets
    assert answer.complete
    rng = np.random.default_rng(0)
    names = list(oracle.rows)
    for each in sets_of(answer):
        assert oracle.lost(each) == 0
    for size in range(1, answer.size):
        for _ in range(200):
            fewer = frozenset(names[k] for k in rng.choice(len(names), size, replace=False))
            assert oracle.lost(fewer) > 0


# ---- prices


def rank_of(robot: str, watched: list[str], sensor: list[str]) -> int:
    return hrsynth.derive(robot, watched, "eye=base@0.3,0.1,0" if sensor else None, sensor=sensor or None).verdict.rank


@pytest.mark.some(1)
@pytest.mark.parametrize("cost", ["leg=0.9,point=0.7,direction=9,encoder=9,line=9", "point=1.5,encoder=4,leg=2", ""])
def test_no_set_that_sees_as_much_is_cheaper(cost: str) -> None:
    """Told sets see all and cost the same; of legs and points each cheaper set, asked by itself, sees less."""
    places = ["0.1,0,0", "-0.1,0.1,0", "0,-0.1,0.1"]
    candidate_sensor = ",".join(f"point:platform@{place}" for place in places)
    told = hrsynth.advise("gough_stewart", ["1"], "eye=base@0.3,0.1,0", candidate_sensor=candidate_sensor, cost=cost)
    costs = {kind: float(number) for kind, _, number in (part.partition("=") for part in cost.split(",") if part)}
    assert told.has_sufficient_sets
    paid = {each.cost for each in told.sets}
    assert max(paid) - min(paid) < 1e-9
    for each in told.sets[:3]:
        words = [costs.get("point" if m.kind == "offered" else m.kind, 1.0) for m in each.measurements]
        assert each.cost == pytest.approx(sum(words))
    for legs in range(3):
        for points in range(len(places) + 1):
            cost = legs * costs.get("leg", 1.0) + points * costs.get("point", 1.0)
            if cost < min(paid) - 1e-9:
                watched = [str(k) for k in range(1, 2 + legs)]
                sensor = [f"point:platform@{place}" for place in places[:points]]
                assert rank_of("gough_stewart", watched, sensor) < 6, (legs, points)


@pytest.mark.parametrize(
    ("cost", "said"),
    [
        ("thing=2", "kind of observation"),
        ("point=0", "a positive number"),
        ("point=1,point=2", "given twice"),
        ("point", "a positive number"),
        ("leg=nan", "a positive number"),
    ],
)
def test_prices_that_are_none_are_refused(cost: str, said: str) -> None:
    with pytest.raises(BadRequest, match=said):
        hrsynth.advise("delta", ["1"], cost=cost)


def test_offers_are_parted_at_kinds_alone() -> None:
    assert split_offers("point:arm/plate@0.1,0,0,eye=line:plate@1,2,3/0,0,1,inclination,distance:base") == [
        "point:arm/plate@0.1,0,0",
        "eye=line:plate@1,2,3/0,0,1",
        "inclination:plate",
        "distance:base",
    ]
    assert split_offers("encoder") == ["encoder"]
