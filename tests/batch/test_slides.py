"""Links that slide on the platform: with their coordinates given, a batch says what the closed whole robot says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from batch.test_batch import CLOSE, shipped_batch
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.engine import Batch
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from strategies import random_rotation


def two_bars(rng: np.random.Generator, turned: bool) -> Mechanism:
    """A platform that turns in a plane and a bar that slides along it, each on two legs RRR; ``turned``: the file's P
    joint goes from the platform to the bar, else the other way."""
    tilt = random_rotation(rng)
    normal, way = tilt[:, 2], tilt @ np.array([np.cos(0.4), np.sin(0.4), 0.0])
    builder = Builder("two_bars")
    builder.link("base")
    for name in ("platform", "bar"):
        builder.link(name, 0.1 * rng.normal(size=3), random_rotation(rng))
    for number, (foot, side) in enumerate(zip(((-1, -1), (1, -1), (1, 1), (-1, 1)), (-1, -1, 1, 1), strict=True), 1):
        tip = np.array([0.3 * foot[0], 0.2 * side, 0.0]) + 0.05 * rng.normal(size=3) * [1, 1, 0]
        knee = np.array([0.9 * foot[0], 0.2 * foot[1], 0.0])
        points = [tilt @ each for each in (np.array([*foot, 0.0]), knee, tip)]
        links = ["base", f"lower_{number}", f"upper_{number}", "platform" if number < 3 else "bar"]
        for name in links[1:3]:
            builder.link(name, rng.normal(size=3), random_rotation(rng))
        for k, at in enumerate(points):
            builder.joint(
                f"joint_{number}_{k}",
                "R",
                links[k],
                links[k + 1],
                at,
                axis=normal,
                motor=k == 0,
                loop=k == 2 and number != 1,
            )
        builder.observe(str(number), links[2], points[2] - points[1])
    ends = ("platform", "bar") if turned else ("bar", "platform")
    builder.joint("guide", "P", *ends, tilt @ np.array([0.1, 0.0, 0.0]), axis=way)
    return builder.build(platform="platform")


def batch_of(robot: str) -> tuple[ObservedRobot, Batch]:
    if robot in ("bar", "bar, turned"):
        setup = ObservedRobot.of(two_bars(np.random.default_rng(7), robot == "bar, turned"), samples=4)
        assert setup.batch is not None
        return setup, setup.batch
    return shipped_batch(robot)


def slid(batch: Batch, at: ClosedConfiguration) -> list[float]:
    """The coordinates (m) of the batch's slides."""
    model = at.model
    return [float(model.difference(model.q0, at.q)[model.coordinates[name][0]]) * model.length for name in batch.slides]


@pytest.mark.parametrize("robot", ["i4l", "bar", "bar, turned"])
def test_with_its_slides_a_batch_is_the_closed_robot(robot: str) -> None:
    """Directions at configurations that Newton's method closes, and their rates in the motions that the loops allow,
    by Pinocchio: the legs on the link that slides depend on it, the others do not."""
    setup, batch = batch_of(robot)
    all_samples, (name,) = setup.all_samples, batch.slides
    observed, platform = all_samples.observation_model.observations[: setup.defaults], setup.mechanism.platform
    legs = [each.leg for each in observed]
    assert set(batch.sliding) == {leg for leg, form in batch.legs.items() if form is None} != set()
    walk = list(walk_randomly(all_samples.start, 8, seed=3, steps=4))
    X, s = np.array([at.pose(platform) for at in walk]), np.array([slid(batch, at) for at in walk])
    assert np.ptp(s) > 0.01 * batch.length
    found = batch.evaluate(X, legs, slides=s)
    assert found.reached.sum() >= 6
    d = batch.span.shape[1]
    for i, at in enumerate(walk):
        if not found.reached[i]:
            continue
        model, kernel = at.model, at.kernel()[0]
        u = np.array([at.pose(each.link)[:3, :3] @ each.direction for each in observed])  # type: ignore[attr-defined]
        assert np.max(np.abs(found.directions[i] - u)) < CLOSE
        moves = [model.velocity(at.q, each.link)[3:] @ kernel for each in observed]  # type: ignore[attr-defined]
        rates = np.concatenate([np.cross(w.T, axis).T for w, axis in zip(moves, u, strict=True)])
        own = model.velocity(at.q, platform) @ kernel
        own[:3] += np.cross(own[3:].T, X[i, :3, :3] @ batch.coordinates.point / batch.length).T
        own[:3] *= batch.length
        y = np.vstack([np.linalg.lstsq(batch.span, own, rcond=1e-9)[0], kernel[model.coordinates[name][0]]])
        assert np.max(np.abs(found.twists @ y - own)) < CLOSE
        assert np.max(np.abs(found.interaction_matrix[i] @ y - rates)) < CLOSE
        columns = found.interaction_matrix[i].reshape(len(legs), 3, d + 1)[:, :, d]
        assert [bool(np.any(column)) for column in columns] == [leg in batch.sliding for leg in legs]


@pytest.mark.parametrize("robot", ["i4l", "bar"])
def test_what_the_pose_alone_says_is_the_same(robot: str) -> None:
    """Without slides nothing changes; too far a slide is out of reach; error maxima take the slide as unknown."""
    _, batch = batch_of(robot)
    own = [leg for leg, form in batch.legs.items() if form is not None]
    X, s = np.repeat(batch.home[None], 3, axis=0), np.array([[0.0], [0.01 * batch.length], [100 * batch.length]])
    alone, both = batch.evaluate(X, own), batch.evaluate(X, own, slides=s)
    assert alone.reached.tolist() == [True] * 3
    assert both.reached.tolist() == [True, True, False]
    np.testing.assert_array_equal(both.directions[:2], alone.directions[:2])
    np.testing.assert_array_equal(both.interaction_matrix[:2, :, :-1], alone.interaction_matrix[:2])
    assert not np.any(both.interaction_matrix[:2, :, -1])
    assert not batch.is_complete
    with pytest.raises(BadRequest, match="unknown leg of the batch"):
        batch.evaluate(X, next(iter(batch.sliding)))
    for wrong in (s[:, 0], s[:2], np.hstack([s, s])):
        with pytest.raises(BadRequest, match="coordinates of slides"):
            batch.evaluate(X, slides=wrong)
    assert replace(batch, sliding={}).slides == ()
    with pytest.raises(BadRequest, match="nothing slides"):
        shipped_batch("quattro")[1].evaluate(X, slides=s)


def test_error_maxima_take_slides_as_unknown() -> None:
    """No error of platform and slide that small cones allow is larger than the maximum, and some nearly are."""
    _, batch = batch_of("bar")
    cone = 1e-3
    found = batch.evaluate(batch.home[None], cones=cone, slides=[[0.0]])
    assert found.position is not None
    M, rng = found.interaction_matrix[0], np.random.default_rng(0)
    tried = rng.normal(size=(20_000, M.shape[1]))
    sizes = np.linalg.norm((tried @ M.T).reshape(len(tried), -1, 3), axis=2).max(axis=1)
    errors = np.linalg.norm(tried @ found.twists[:3].T, axis=1) * 2 * np.sin(cone / 2) / sizes
    assert 0.8 < errors.max() / found.position.largest[0] < 1 + 1e-3


def numbers(batch: Batch, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(2)
    X = np.repeat(batch.home[None], count, axis=0)
    X[:, :3, 3] += (
        0.02
        * batch.length
        * rng.normal(size=(count, 3))
        @ (batch.coordinates.translations @ batch.coordinates.translations.T)
    )
    return X, 0.02 * batch.length * rng.normal(size=(count, 1))


@pytest.mark.slow
def test_numba_says_the_same_of_slides() -> None:
    pytest.importorskip("numba")
    _, batch = batch_of("i4l")
    X, s = numbers(batch, 300)
    one, two = (batch.evaluate(X, slides=s, compiled=each) for each in (False, True))
    np.testing.assert_array_equal(one.reached, two.reached)
    np.testing.assert_allclose(one.interaction_matrix, two.interaction_matrix, rtol=0, atol=1e-12)
