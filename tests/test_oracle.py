"""The oracle checks itself: finite differences, textbook mobilities, and laws that need no engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hrsynth.geometry.vectors import Array, build_pose
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Joint, JointType, Link, Mechanism
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations.direction import Direction
from oracle import CLOSED, GAP, NotAssembled, Oracle, exponential, logarithm, same_relation, span
from strategies import (
    chains,
    deltas,
    mechanisms,
    parallel_robots,
    planar,
    planar_robots,
    pods,
    random_direction,
    random_normal,
    random_rotation,
    recut,
    renamed,
    reordered,
    split,
    transformed,
)

quick = settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
seeds = st.integers(0, 2**32 - 1)


def walked(mechanism: Mechanism, seed: int = 1, n: int = 1, size: float = 0.3) -> tuple[Oracle, list[Array]]:
    """An oracle and closed states away from zero."""
    oracle = Oracle(mechanism)
    return oracle, list(oracle.random_walk(np.random.default_rng(seed), n, size))


# --- rows --------------------------------------------------------------------------------------------------------


def pair(letter: str, rng: np.random.Generator, cosine: float = 0.0) -> Mechanism:
    """Two free links joined by one joint; ``cosine`` of a U's two axes."""
    builder = Builder(letter)
    builder.link("base")
    for name in ("a", "b"):
        builder.link(name, rng.normal(size=3), random_rotation(rng))
        if name == "a":
            builder.joint("float", "6", "base", name)
    first = random_direction(rng)
    second = cosine * first + np.sqrt(1 - cosine**2) * random_normal(rng, first)
    axes = dict(zip(("axis", "axis2"), (first, second)[: JointType(letter).axes], strict=False))
    builder.joint("tested", letter, "a", "b", rng.normal(size=3), **axes)  # type: ignore[arg-type]
    return builder.build(platform="b")


def freedoms(mechanism: Mechanism) -> Array:
    """The freedom twists of the joint ``tested`` at zero, (linear at the frame of b, angular), one a column."""
    joint = mechanism.joints["tested"]
    arm = mechanism.links["b"].pose[:3, 3] - joint.point

    def turn(axis: Array) -> Array:
        return np.concatenate((np.cross(axis, arm), axis))

    def slide(axis: Array) -> Array:
        return np.concatenate((axis, np.zeros(3)))

    letter, axes, all_samples = joint.type.value, joint.axes, list(np.eye(3))
    if letter == "E":
        first = np.linalg.svd(joint.axis[None])[2][1:]
        twists = [turn(joint.axis), *map(slide, first)]
    else:
        turns = {"R": axes, "C": axes, "U": axes, "S": all_samples, "6": all_samples}.get(letter, [])
        slides = {"P": axes, "C": axes, "6": all_samples}.get(letter, [])
        twists = [*map(turn, turns), *map(slide, slides)]
    return np.array(twists).reshape(-1, 6).T


@pytest.mark.parametrize("letter", [kind.value for kind in JointType])
def test_rows_are_the_derivative_of_the_residual(letter: str) -> None:
    rng = np.random.default_rng(ord(letter[0]))
    oracle, states = walked(pair(letter, rng), n=3, size=0.8)
    far = oracle.moved(states[-1], 0.2 * rng.normal(size=12))
    h = 1e-6
    for state in [oracle.zero(), *states, far]:
        ends = [[oracle.residual(oracle.moved(state, sign * h * e)) for sign in (1, -1)] for e in np.eye(12)]
        columns = [(ahead - behind) / (2 * h) for ahead, behind in ends]
        J = oracle.jacobian(state)
        assert J.shape == (len(oracle.rows), 12)
        assert np.allclose(J, np.array(columns).T, atol=1e-8)
    assert oracle.error(states[-1]) < CLOSED


@pytest.mark.parametrize("letter", [kind.value for kind in JointType])
def test_rows_are_the_wrenches_reciprocal_to_the_freedoms(letter: str) -> None:
    mechanism = pair(letter, np.random.default_rng(3))
    oracle, S = Oracle(mechanism), freedoms(mechanism)
    J = oracle.jacobian(oracle.zero())
    count = JointType(letter).freedoms
    assert S.shape == (6, count)
    assert np.allclose(J[:, 6:] @ S, 0, atol=1e-12)
    assert J.shape[0] == 6 - count
    assert np.linalg.matrix_rank(J) == 6 - count
    assert oracle.mobility(oracle.zero()) == 6 + count


def test_a_skew_universal_joint_keeps_its_angle() -> None:
    oracle, (state,) = walked(pair("U", np.random.default_rng(5), cosine=0.4), size=1.0)
    first, second = oracle.mechanism.joints["tested"].axes
    turned = [
        oracle.pose(state, name)[:3, :3] @ oracle.mechanism.links[name].pose[:3, :3].T @ axis
        for name, axis in (("a", first), ("b", second))
    ]
    assert oracle.mobility(state) == 8
    assert turned[0] @ turned[1] == pytest.approx(0.4, abs=1e-10)


@pytest.mark.parametrize("letter", ["R", "P", "C", "E", "F"])
def test_an_axis_turned_round_is_not_closed(letter: str) -> None:
    mechanism = pair(letter, np.random.default_rng(7))
    oracle, joint = Oracle(mechanism), mechanism.joints["tested"]
    state = oracle.zero()
    axis = joint.axis if joint.axes else np.array([0.0, 0.0, 1.0])
    half = exponential(np.pi * random_normal(np.random.default_rng(8), axis))
    b = oracle.index["b"]
    state[b, :3, :3] = half @ state[b, :3, :3]
    state[b, :3, 3] = joint.point + half @ (state[b, :3, 3] - joint.point)
    assert oracle.error(state) == float("inf")
    with pytest.raises(NotAssembled):
        oracle.close(state, pins={"a": oracle.pose(state, "a"), "b": oracle.pose(state, "b")})


# --- mobilities --------------------------------------------------------------------------------------------------


def polygon(n: int, rng: np.random.Generator) -> Mechanism:
    """A planar loop of ``n`` bars."""
    builder, tilt = Builder(f"{n}-bar"), random_rotation(rng)
    for k in range(n):
        builder.link(f"bar_{k}", rng.normal(size=3) if k else np.zeros(3), random_rotation(rng) if k else None)
    for k in range(n):
        angle, radius = 2 * np.pi * k / n, rng.uniform(0.7, 1.3)
        builder.joint(
            f"pin_{k}",
            "R",
            f"bar_{k}",
            f"bar_{(k + 1) % n}",
            loop=k == n - 1,
            axis=tilt[:, 2],
            at=tilt @ (radius * np.array([np.cos(angle), np.sin(angle), 0.0])),
        )
    return builder.build(platform=f"bar_{n // 2}")


def rod() -> Mechanism:
    """A fixed rod between two balls, and one between two cranks (RSSR)."""
    builder = Builder("rods")
    for name in ("base", "fixed", "crank", "coupler", "rocker"):
        builder.link(name)
    builder.joint("s1", "S", "base", "fixed", (0, 0, 0))
    builder.joint("s2", "S", "fixed", "base", (0, 0, 1), loop=True)
    builder.joint("r1", "R", "base", "crank", (1, 0, 0), axis=(0, 0.2, 1))
    builder.joint("s3", "S", "crank", "coupler", (1.5, 0.3, 0.1))
    builder.joint("s4", "S", "coupler", "rocker", (2.5, 1.3, 0.9))
    builder.joint("r2", "R", "rocker", "base", (3, 0, 0), axis=(0.3, 1, 0.1), loop=True)
    return builder.build(platform="rocker")


def classic_delta() -> Mechanism:
    """The Delta: three R bases, parallelograms with their sides parallel to the R axes."""
    return deltas("RRR", ["2-SS"] * 3, np.random.default_rng(11), aligned=True)


KNOWN: dict[str, tuple[Callable[[], Mechanism], int, int]] = {
    "four-bar": (lambda: polygon(4, np.random.default_rng(1)), 1, 1),
    "five-bar": (lambda: polygon(5, np.random.default_rng(2)), 2, 2),
    "point five-bar": (lambda: planar(["RRR", "RRR"], np.random.default_rng(2), [{0}, {0}], point=True), 3, 3),
    "3-RRR": (lambda: planar(["RRR"] * 3, np.random.default_rng(3), [{0}] * 3), 3, 3),
    "RPR, PRR, PRP": (lambda: planar(["RPR", "PRR", "PRP"], np.random.default_rng(4), [{0}] * 3), 3, 3),
    "idle rods": (rod, 3, 1),
    "delta": (classic_delta, 9, 3),
    "rigid quattro": (lambda: deltas("RRRR", ["2-SS"] * 4, np.random.default_rng(12), aligned=True), 11, 3),
    "linear delta": (lambda: deltas("PPP", ["2-SS"] * 3, np.random.default_rng(13), aligned=False), 9, 3),
    "3-RUU": (lambda: deltas("RRR", ["UU"] * 3, np.random.default_rng(14), aligned=True), 3, 3),
    "3-UPS": (lambda: pods(["UPS"] * 3, np.random.default_rng(15)), 6, 6),
    "3-RPS": (lambda: pods(["RPS"] * 3, np.random.default_rng(16), square=True), 3, 3),
    "3-UPU": (lambda: pods(["UPU"] * 3, np.random.default_rng(17)), 3, 3),
    "6-UPS": (lambda: pods(["UPS"] * 6, np.random.default_rng(18)), 6, 6),
    "6-SPS": (lambda: pods(["SPS"] * 6, np.random.default_rng(19)), 12, 6),
}


@pytest.mark.some(8)
@pytest.mark.parametrize("name", KNOWN)
def test_known_mobilities_last_along_a_walk(name: str) -> None:
    make, mobility, moving = KNOWN[name]
    oracle, states = walked(make(), n=3, size=0.25)
    assert oracle.error(oracle.zero()) < 1e-13
    for state in states:
        assert oracle.error(state) < CLOSED
        assert oracle.kernel(state)[1] > GAP
        assert oracle.mobility(state) == mobility
        assert oracle.relation(state).shape[1] == moving
    turned = [np.linalg.norm(state - oracle.zero()) for state in states]
    assert min(turned) > 0.05


def test_the_delta_translates_and_its_rods_spin() -> None:
    oracle, (state,) = walked(classic_delta())
    t = oracle.relation(state, observations=())
    assert np.allclose(t[3:], 0, atol=1e-9)
    K, _ = oracle.kernel(state)
    rods = [name for name in oracle.index if name.startswith("rod")]
    idle = K @ np.linalg.svd(np.vstack([oracle.twist(K, name) for name in oracle.index if name not in rods]))[2][3:].T
    assert idle.shape[1] == 6
    for name in rods:
        u = np.linalg.svd(oracle.twist(idle, name)[3:])
        assert u[1][1] < 1e-9 < u[1][0]


# --- relation ----------------------------------------------------------------------------------------------------


def test_the_relation_of_a_pod_is_the_graph_of_the_printed_matrix() -> None:
    """u_dot = (1 - u u^T) (v + omega x b) / r for rods from the base to points b of the platform."""
    oracle, (state,) = walked(pods(["UPS"] * 4, np.random.default_rng(21)))
    X, zero = oracle.pose(state, "platform"), oracle.mechanism.links["platform"].pose
    columns = []
    for twist in np.eye(6):
        v, omega = oracle.length * twist[:3], twist[3:]
        rates = []
        for number in range(1, 5):
            foot = oracle.mechanism.joints[f"foot_{number}"].point
            arm = X[:3, :3] @ zero[:3, :3].T @ (oracle.mechanism.joints[f"tip_{number}"].point - zero[:3, 3])
            along = X[:3, 3] + arm - foot
            r, u = np.linalg.norm(along), along / np.linalg.norm(along)
            rates.append((np.eye(3) - np.outer(u, u)) @ (v + np.cross(omega, arm)) / r)
        columns.append(np.concatenate((twist, *rates)))
    assert same_relation(oracle.relation(state), span(np.array(columns).T)) < 1e-9


@pytest.mark.parametrize("name", ["3-RRR", "delta", "3-RPS", "3-UPU"])
@pytest.mark.parametrize("camera", [None, "platform"])
def test_finite_motions_follow_the_relation(name: str, camera: str | None) -> None:
    mechanism = replace(KNOWN[name][0](), camera=camera)
    fixed = Direction("base", mechanism.base, np.array([1.0, 2.0, 3.0]))
    observations: tuple[Observation, ...] = (*mechanism.observations, fixed)
    oracle, (state,) = walked(mechanism)
    rho = oracle.relation(state, observations)
    K, _ = oracle.kernel(state)
    h = 1e-4
    for velocity in h * K.T:
        ahead, behind = oracle.step(state, velocity), oracle.step(state, -velocity)
        X_a, X_b = oracle.pose(ahead, "platform"), oracle.pose(behind, "platform")
        change = np.concatenate(
            (
                (X_a - X_b)[:3, 3] / oracle.length,
                logarithm(X_a[:3, :3] @ X_b[:3, :3].T),
                np.ravel(oracle.directions(ahead, observations) - oracle.directions(behind, observations)),
            )
        ) / (2 * h)
        assert np.linalg.norm(change - rho @ (rho.T @ change)) < 1e-5


def test_unit_length_and_point_only_choose_the_rows() -> None:
    oracle, (state,) = walked(planar(["RRR", "PRR"], np.random.default_rng(31), [{0}, {0}], point=True))
    whole, point = oracle.relation(state), oracle.relation(state, point_only=True)
    assert whole.shape == (12, 3)
    assert point.shape == (9, 2)
    metres = oracle.relation(state, unit_length=1.0)
    scale = np.concatenate((np.full(3, oracle.length), np.ones(9)))
    assert same_relation(metres, span(scale[:, None] * whole)) < 1e-9
    assert same_relation(metres, whole) > 1e-3


def test_same_relation_is_the_largest_principal_angle() -> None:
    A, B = np.eye(4)[:, :2], np.eye(4)[:, :2].copy()
    for angle in (1e-9, 0.3, np.pi / 2):
        B[:, 1] = [0, np.cos(angle), np.sin(angle), 0]
        assert same_relation(A, B) == pytest.approx(angle, rel=1e-6)
    assert same_relation(A, A @ np.array([[0.6, -0.8], [0.8, 0.6]])) < 1e-15
    assert same_relation(A, A[:, :1]) == np.pi / 2
    assert same_relation(A[:, :0], A[:, :0]) == 0


# --- assembly ----------------------------------------------------------------------------------------------------


def test_closing_reaches_a_pinned_pose() -> None:
    oracle, (state,) = walked(KNOWN["6-UPS"][0](), size=0.5)
    target = oracle.pose(state, "platform")
    closed = oracle.close(oracle.zero(), pins={"platform": target})
    assert np.allclose(oracle.pose(closed, "platform"), target, atol=1e-10)
    assert oracle.error(closed) < CLOSED
    there = oracle.close(oracle.zero(), pins={"platform": target[:3, 3]})
    assert np.allclose(oracle.pose(there, "platform")[:3, 3], target[:3, 3], atol=1e-10)
    with pytest.raises(NotAssembled):
        Oracle(classic_delta()).close(Oracle(classic_delta()).zero(), pins={"platform": np.full(3, 10.0)})


@pytest.mark.parametrize(
    ("name", "camera"), [("3-RRR", None), ("delta", None), ("3-UPS", "platform"), ("rigid quattro", None)]
)
def test_the_same_robot_written_otherwise_is_assembled_at_the_same_directions(name: str, camera: str | None) -> None:
    rng = np.random.default_rng(41)
    real = replace(KNOWN[name][0](), camera=camera)
    other = real
    for _ in range(3):
        other = split(other, rng)
    oracle, model = Oracle(real), Oracle(other)
    start = model.zero()
    for state in oracle.random_walk(rng, 3, 0.25):
        start = model.assemble(oracle.pose(state, "platform"), oracle.directions(state), start)
        assert model.error(start) < CLOSED
        assert np.allclose(model.directions(start), oracle.directions(state), atol=1e-10)
        assert np.allclose(model.pose(start, "platform"), oracle.pose(state, "platform"), atol=1e-10)
        rho = model.relation(start, unit_length=oracle.length)
        assert same_relation(oracle.relation(state), rho) < 1e-8


def lifted(mechanism: Mechanism) -> Mechanism:
    """The mechanism with a chain reference - PPP - U - R(d) - link beside each observed direction."""
    rng = np.random.default_rng(0)
    for each in mechanism.observations:
        assert isinstance(each, Direction)
        link = mechanism.links[each.link]
        d, at = link.pose[:3, :3] @ each.direction, link.pose[:3, 3]
        second = random_normal(rng, d)
        names = [f"virtual_{each.leg}_{k}" for k in range(1, 6)]
        ends = [mechanism.reference, *names[:4], each.link]
        axes = [*((axis,) for axis in np.eye(3)), (random_normal(rng, second), second), (d,)]
        joints = [
            Joint(name, JointType(letter), ends[k], ends[k + 1], at, axes[k], in_tree=k < 4)
            for k, (name, letter) in enumerate(zip(names, "PPPUR", strict=True))
        ]
        mechanism = mechanism.changed(links=[Link(name, build_pose(at)) for name in names[:4]], joints=joints)
    return mechanism


@pytest.mark.parametrize("name", ["3-RRR", "delta", "3-RPS"])
@pytest.mark.parametrize("camera", [None, "platform"])
def test_chains_with_six_freedoms_change_nothing(name: str, camera: str | None) -> None:
    real = replace(KNOWN[name][0](), camera=camera)
    oracle, model = Oracle(real), Oracle(lifted(real))
    start = model.zero()
    for state in oracle.random_walk(np.random.default_rng(42), 2, 0.2):
        start = model.assemble(oracle.pose(state, "platform"), oracle.directions(state), start)
        assert model.mobility(start) == oracle.mobility(state)
        assert same_relation(oracle.relation(state), model.relation(start, unit_length=oracle.length)) < 1e-8


def test_directions_that_contradict_the_pose_are_not_assembled() -> None:
    oracle, (state,) = walked(KNOWN["6-UPS"][0]())
    directions = oracle.directions(state)
    directions[0] = exponential(np.array([0.0, 0.1, 0.1])) @ directions[0]
    with pytest.raises(NotAssembled):
        oracle.assemble(oracle.pose(state, "platform"), directions, state)


# --- generated mechanisms ----------------------------------------------------------------------------------------


def is_well_cut(mechanism: Mechanism) -> bool:
    """Whether the tree joints span all links and point away from the base."""
    tree: nx.MultiDiGraph[str] = nx.MultiDiGraph([joint.links for joint in mechanism.joints.values() if joint.in_tree])
    return set(tree) == set(mechanism.links) and nx.is_arborescence(tree) and tree.in_degree(mechanism.base) == 0


@quick
@given(mechanisms())
def test_generated_mechanisms_are_assembled_at_zero_and_move(mechanism: Mechanism) -> None:
    oracle = Oracle(mechanism)
    assert is_well_cut(mechanism)
    assert oracle.error(oracle.zero()) < 1e-12
    if any(joint.type.freedoms for joint in mechanism.joints.values()):
        (state,) = oracle.random_walk(np.random.default_rng(0), 1, 0.1)
        assert oracle.error(state) < CLOSED
        assert oracle.mobility(state) > 0


@quick
@given(chains())
def test_a_chain_has_the_freedoms_of_its_joints(mechanism: Mechanism) -> None:
    oracle = Oracle(mechanism)
    assert oracle.mobility(oracle.zero()) == sum(joint.type.freedoms for joint in mechanism.joints.values())


@quick
@given(planar_robots(point=None))
def test_planar_robots_stay_in_their_plane(mechanism: Mechanism) -> None:
    oracle, (state,) = walked(mechanism, size=0.1)
    normal = next(joint.axis for joint in mechanism.joints.values() if joint.type is JointType.REVOLUTE)
    assert oracle.mobility(state) == 3
    K, _ = oracle.kernel(state)
    for name in mechanism.links:
        v, omega = np.split(oracle.twist(K, name), 2)
        assert np.allclose(normal @ v, 0, atol=1e-9)
        assert np.allclose(np.cross(normal, omega, axisb=0), 0, atol=1e-9)


@quick
@given(parallel_robots(), seeds)
def test_moving_the_geometry_moves_the_relation(mechanism: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    R, p = random_rotation(rng), rng.normal(size=3)
    observations = (*mechanism.observations, Direction("base", mechanism.base, random_direction(rng)))
    mechanism = replace(mechanism, observations=observations, camera="platform")
    moved = transformed(mechanism, R, p)
    oracle, (state,) = walked(mechanism, size=0.2)
    model = Oracle(moved)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    there = np.array(
        [X_BL if name == mechanism.base else X @ X_BL for name, X_BL in zip(mechanism.links, state, strict=True)]
    )
    assert model.error(there) < CLOSED
    turn = np.kron(np.eye(2), R)
    rho, rho_moved = oracle.relation(state), model.relation(there)
    assert moved.length == pytest.approx(mechanism.length)
    assert same_relation(np.vstack((turn @ rho[:6], rho[6:])), rho_moved) < 1e-7


@quick
@given(parallel_robots(), seeds)
def test_names_order_and_cut_do_not_change_the_relation(mechanism: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    oracle, (state,) = walked(mechanism, size=0.2)
    rho = oracle.relation(state)
    new_names = renamed(mechanism, rng)
    assert not set(new_names.links) & set(mechanism.links)
    assert not set(new_names.joints) & set(mechanism.joints)
    assert same_relation(Oracle(new_names).relation(state), rho) < 1e-8

    other = recut(mechanism, rng)
    assert is_well_cut(other)
    assert Oracle(other).error(state) < CLOSED
    assert same_relation(Oracle(other).relation(state), rho) < 1e-8

    shuffled = reordered(mechanism, rng)
    assert sorted(shuffled.joints) == sorted(mechanism.joints)
    model = Oracle(shuffled)
    there = np.array([oracle.pose(state, name) for name in shuffled.links])
    legs = [each.leg for each in mechanism.observations]
    rows = [*range(6)] + [6 + 3 * legs.index(each.leg) + k for each in shuffled.observations for k in range(3)]
    assert same_relation(model.relation(there), rho[rows]) < 1e-8


@quick
@given(parallel_robots(), seeds, st.sampled_from(["spherical", "universal", "link", "coaxial"]))
def test_a_split_keeps_the_relation(mechanism: Mechanism, seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    other = split(mechanism, rng, (kind,))
    assert is_well_cut(other)
    oracle, model = Oracle(mechanism), Oracle(other)
    added = kind == "coaxial" and other is not mechanism
    assert model.error(model.zero()) < 1e-12
    assert model.mobility(model.zero()) == oracle.mobility(oracle.zero()) + added
    rho = oracle.relation(oracle.zero())
    assert same_relation(rho, model.relation(model.zero(), unit_length=oracle.length)) < 1e-8
