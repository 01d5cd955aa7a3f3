"""Held legs by screws: the interaction matrix as Pinocchio has it, twist systems as the oracle has them, and walks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from analysis.modes.gears import five_bar
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.ranks import compute_kernel_basis, compute_range_basis
from hrsynth.geometry.vectors import Array, hat, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import compute_interaction, compute_leg_twists, split
from hrsynth.kinematics.velocity_relation import ObservationModel, compute_relation
from hrsynth.kinematics.walking import WALK_SINGULAR_VALUE_MIN_FRACTION, walk_randomly
from hrsynth.mechanism.legs import Leg
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.tolerances import CLOSURE_RESIDUAL_TOL
from kinematics.robots import ROBOTS, setting_of, state_of
from oracle import Oracle, Rows, rows_of


def by_pinocchio(at: ClosedConfiguration, observation_model: ObservationModel) -> Array:
    """Singular values of Mᵀ from the relation: the pairs (t, u̇) solved for u̇, what moves with t = 0 left out."""
    found = compute_relation(at, observation_model)
    still, _ = compute_kernel_basis(found.twist_part, 1.0)
    hidden, _ = compute_range_basis(found.rates @ still, 1.0)
    M = found.rates @ np.linalg.pinv(found.twist_part, rcond=1e-9) @ found.twists
    return np.linalg.svd(M - hidden @ (hidden.T @ M), compute_uv=False)


@pytest.mark.some(10)
@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_interaction_matrix_is_that_of_the_engine(robot: str, carried: bool) -> None:
    platform = setting_of(robot).mechanism.platform
    samples = setting_of(robot, None, platform if carried else None).samples
    assert samples.observation_model.reference == (platform if carried else setting_of(robot).mechanism.base)
    for member in samples.members:
        M = compute_interaction(member.configuration, samples.observation_model)
        assert M.shape == (sum(samples.observation_model.sizes), member.relation.dof.value)
        wanted = by_pinocchio(member.configuration, samples.observation_model)
        np.testing.assert_allclose(np.linalg.svd(M, compute_uv=False), wanted, atol=1e-8)


def by_oracle(at: ClosedConfiguration, leg: Leg, locks: list[Direction]) -> Array:
    """A basis of the leg's twists in maximal coordinates: its joints' constraints alone, directions held."""
    mechanism, oracle = at.model.mechanism, Oracle(at.model.mechanism)
    state, rows = state_of(at.model, at.q), Rows()
    for name in leg.joints:
        joint = mechanism.joints[name]
        i, j = (oracle.index[link] for link in joint.links)
        rows += rows_of(joint, i, j, mechanism.links[joint.predecessor].pose, mechanism.links[joint.successor].pose)
    links = [link for link in dict.fromkeys((*leg.links, leg.platform_link)) if link != mechanism.base]
    numbers = [oracle.index[link] for link in links]
    J = rows.evaluate(state)[1][:, numbers].reshape(len(rows), 6 * len(numbers))
    held = [J]
    for lock in locks:
        block = np.zeros((3, J.shape[1]))
        start = 6 * links.index(lock.link)
        block[:, start + 3 : start + 6] = hat(at.pose(lock.link)[:3, :3] @ lock.direction)
        held.append(block)
    units = np.tile([at.model.length] * 3 + [1.0] * 3, len(links))
    _, values, right = np.linalg.svd(np.vstack(held) * units)
    kernel = right[int(np.sum(values > 1e-9 * values[0])) :].T
    end = kernel[6 * links.index(leg.platform_link) :][:6].copy()
    end[:3] += hat(at.pose(leg.platform_link)[:3, 3] / at.model.length) @ end[3:]
    U, sizes, _ = np.linalg.svd(end)
    return np.asarray(U[:, : int(np.sum(sizes > 1e-8))])


@pytest.mark.some(6)
@pytest.mark.parametrize(
    "robot",
    [
        "3rrr_m1",
        "3prr_m1",
        "delta",
        "orthoglide",
        "3upu",
        "3rps",
        "gough_stewart",
        "hexa",
        "quattro",
        "quattro_rigid",
        "3ruu",
    ],
)
def test_a_held_leg_allows_what_the_oracle_says(robot: str) -> None:
    setup = setting_of(robot)
    samples = setup.samples
    for member in samples.members:
        for leg in setup.decomposition.legs:
            for held in (True, False):
                locks = [o for o in samples.observation_model.observations if held and o.leg == leg.label]
                T = compute_leg_twists(member.configuration, leg, locks, samples.observation_model.reference)
                wanted = by_oracle(member.configuration, leg, locks)
                assert T.shape == wanted.shape
                assert np.linalg.norm(T - wanted @ (wanted.T @ T)) < 1e-7


def test_what_is_seen_from_outside_a_leg_cannot_be_held_in_it() -> None:
    setup = setting_of("delta")
    leg, (at, *_) = setup.decomposition.legs[0], [member.configuration for member in setup.samples.members]
    locks = [setup.samples.observation_model.observations[0]]
    with pytest.raises(ValueError, match=setup.decomposition.legs[1].links[0]):
        compute_leg_twists(at, leg, locks, setup.decomposition.legs[1].links[0])


def system(point: Array, translations: list[Array], rotations: list[Array], screws: list[Array]) -> Array:
    """An orthonormal basis of a twist system given at a point, moved to the origin and mixed."""
    columns = [np.concatenate([v, np.zeros(3)]) for v in translations]
    columns += [np.concatenate([np.cross(point, w), w]) for w in rotations]
    columns += [np.concatenate([np.cross(point, w) + 0.7 * w, w]) for w in screws]
    return compute_range_basis(np.column_stack(columns), 1.0)[0]


@pytest.mark.parametrize(
    ("translations", "rotations", "screws"),
    [(1, 3, 0), (2, 1, 0), (0, 2, 0), (1, 0, 0), (3, 3, 0), (0, 3, 0), (0, 0, 1), (1, 1, 1), (0, 1, 1)],
)
def test_split(translations: int, rotations: int, screws: int) -> None:
    rng = np.random.default_rng(translations + 4 * rotations + 16 * screws)
    point = rng.normal(size=3)
    V, W, S = (list(rng.normal(size=(n, 3))) for n in (translations, rotations, screws))
    T = system(point, V, W, S)
    parts = split(T, point)
    assert parts.translations.shape == (3, translations)
    assert parts.rotations.shape == (3, rotations)
    assert parts.whole is (screws == 0)
    for basis, vectors in ((parts.translations, V), (parts.rotations, W)):
        np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)
        for vector in vectors:
            assert np.linalg.norm(normalise_vector(vector) - basis @ (basis.T @ normalise_vector(vector))) < 1e-9
    if rotations and not translations:
        assert not split(T, point + rng.normal(size=3)).whole


@pytest.mark.parametrize("robot", ["3rrr_m1", "delta", "quattro", "gough_stewart", "prrrp_parallel_point"])
def test_wander(robot: str) -> None:
    """Closed, off the start, in small steps, on the branch; the same for a seed, another for another."""
    samples = setting_of(robot).samples
    met = list(walk_randomly(samples.start, 30, seed=3))
    assert len(met) == 30
    model, generic = samples.model, samples.mobility
    weakest = WALK_SINGULAR_VALUE_MIN_FRACTION * samples.start.kernel()[1].weakest
    for at in met:
        assert at.residual <= CLOSURE_RESIDUAL_TOL
        assert at.kernel()[0].shape[1] == generic
        assert at.kernel()[1].weakest >= weakest
    steps = [np.linalg.norm(model.difference(a.q, b.q)) for a, b in pairwise([samples.start, *met])]
    assert min(steps) > 1e-3
    assert np.median(steps) < 0.5
    platform = [at.pose(model.mechanism.platform) for at in met]
    assert max(np.linalg.norm(X - samples.start.pose(model.mechanism.platform)) for X in platform) > 0.1 * model.length
    again = [at.q for at in walk_randomly(samples.start, 30, seed=3)]
    assert all(np.array_equal(a.q, q) for a, q in zip(met, again, strict=True))
    assert not np.array_equal(met[0].q, next(walk_randomly(samples.start, 1, seed=4)).q)


@pytest.mark.parametrize(("ratio", "seed"), [(2.0, 3), (-1.5, 1), (0.5, 2)])
def test_gears_are_among_the_screws(ratio: float, seed: int) -> None:
    """What is observed of a geared five-bar sees as much by the screws of all joints as by the engine's Jacobians."""
    setup = ObservedRobot.of(five_bar(ratio, seed)[0])
    for at in setup.configurations[:5]:
        seen = by_pinocchio(at, setup.samples.observation_model)
        assert np.allclose(
            np.linalg.svd(compute_interaction(at, setup.samples.observation_model), compute_uv=False), seen, atol=1e-9
        )
        assert seen[-1] > 1e-3
