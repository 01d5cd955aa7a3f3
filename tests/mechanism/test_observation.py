"""What is measured: values and rates agree, encoders read the joints' coordinates, lines obey Plücker's laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from hrsynth.analysis.advice import list_candidates
from hrsynth.description import load
from hrsynth.geometry.vectors import Array, build_pose, find_perpendicular, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Direction, Joint, JointType, Observation
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.observations.encoder import AngleEncoder, SlideEncoder
from hrsynth.mechanism.observations.line import SpaceLine
from hrsynth.mechanism.sensors import locate_observed_line, make_encoders
from kinematics.robots import ROBOTS, setting_of, walked
from oracle import exponential
from strategies import random_direction, random_rotation, split

STEP = 1e-5


def kinds(rng: np.random.Generator) -> list[Observation]:
    """One observation of each class, with random geometry."""
    (u, a, m), p = (random_direction(rng) for _ in range(3)), rng.normal(size=3)
    start = random_rotation(rng) @ find_perpendicular(a)
    return [
        Direction("1", "l", u),
        SpaceLine("1", "l", at=p, axis=u),
        AngleEncoder("1", "l", "j", a, m, rng.normal(size=3), seen_from="c"),
        AngleEncoder("1", "l", "j", a, find_perpendicular(a), start, seen_from="c"),
        SlideEncoder("1", "l", "j", a, p, m, seen_from="c"),
    ]


def random_pose(rng: np.random.Generator) -> Array:
    return build_pose(rng.normal(size=3), random_rotation(rng))


def moved(X: Array, twist: Array, time: float) -> Array:
    return build_pose(X[:3, 3] + time * twist[:3], exponential(time * twist[3:]) @ X[:3, :3])


@pytest.mark.parametrize("seed", range(5))
def test_the_rate_is_the_derivative_of_the_value(seed: int) -> None:
    """For any motion of the two links, whether a joint allows it or not."""
    rng = np.random.default_rng(seed)
    X_c, X, (V_c, V) = random_pose(rng), random_pose(rng), rng.normal(size=(2, 6))
    for each in kinds(rng):
        ahead, behind = (each.value(moved(X_c, V_c, s), moved(X, V, s)) for s in (STEP, -STEP))
        rate = each.rate(X_c, X, V_c[:, None], V[:, None])
        assert ahead.shape == (each.size,)
        assert rate.shape == (each.size, 1)
        np.testing.assert_allclose(rate[:, 0], (ahead - behind) / (2 * STEP), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_together_is_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X_c, V_c = random_pose(rng), rng.normal(size=(6, 4))
    X, V = np.array([random_pose(rng) for _ in range(2)]), rng.normal(size=(2, 6, 4))
    for pair in zip(kinds(rng), kinds(rng), strict=True):
        values, rates = type(pair[0]).together(pair, X_c, X, V_c, V)
        np.testing.assert_allclose(values, np.concatenate([o.value(X_c, x) for o, x in zip(pair, X, strict=True)]))
        np.testing.assert_allclose(
            rates, np.vstack([o.rate(X_c, x, V_c, v) for o, x, v in zip(pair, X, V, strict=True)])
        )


def test_every_kind_has_a_key_of_its_own() -> None:
    for robot in ROBOTS:
        setup = setting_of(robot)
        keys = [o.key for o in setup.observed] + [each.observation.key for each in list_candidates(setup)]
        assert len(set(keys)) == len(keys)


# ---- encoders


@pytest.mark.some(33)
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("cut", ["normal form", "as written"])
def test_encoders_read_the_coordinates_of_the_twin(robot: str, cut: str) -> None:
    """Value and rate, of tree joints and of cut ones; lengths in characteristic lengths."""
    mechanism = setting_of(robot).mechanism if cut == "normal form" else load(robot)
    model = PinocchioModel(mechanism)
    at = walked(model, seed=1)
    kernel, _ = at.kernel()
    travelled = pin.difference(model.model, model.q0, at.q)
    number = 0
    for joint in mechanism.joints.values():
        found = make_encoders(mechanism, joint)
        assert len(found) == (0 if joint.type in ("S", "E", "F", "6") else joint.type.freedoms)
        if not found:
            continue
        _, _, values, rates = measure(model, at.q, mechanism.reference, found)
        for place, value, rate in zip(model.coordinates[joint.name], values, rates, strict=True):
            np.testing.assert_allclose(rate @ kernel, kernel[[place]], atol=1e-9)
            assert value[0] == pytest.approx(travelled[place], abs=1e-9)
            number += 1
    assert number > 0


@pytest.mark.parametrize("type", ["R", "P", "U", "C"])
def test_encoders_of_each_type_in_a_tilted_chain(type: str) -> None:
    """Also where the axes of a U are not perpendicular, and where the joint is turned around."""
    rng = np.random.default_rng(3)
    builder = Builder("chain")
    builder.link("base", rng.normal(size=3), random_rotation(rng))
    builder.link("a", rng.normal(size=3), random_rotation(rng))
    builder.link("b", rng.normal(size=3), random_rotation(rng))
    first = random_direction(rng)
    second = normalise_vector(first + 2 * random_direction(rng))
    builder.joint("turn", "S", "base", "a", rng.normal(size=3))
    builder.joint("j", type, "a", "b", rng.normal(size=3), axis=first, axis2=second if type == "U" else None)
    mechanism = builder.build(platform="b")
    for each in (mechanism, mechanism.changed(joints=[mechanism.joints["j"].turned()])):
        model = PinocchioModel(each)
        q = model.integrate(model.q0, rng.uniform(-1, 1, size=model.nv))
        found = make_encoders(each, each.joints["j"])
        _, _, values, rates = measure(model, q, "base", found)
        travelled = pin.difference(model.model, model.q0, q)
        places = model.coordinates["j"]
        assert len(found) == len(places) == JointType(type).freedoms
        np.testing.assert_allclose(np.concatenate(values), travelled[list(places)], atol=1e-12)
        np.testing.assert_allclose(np.vstack(rates), np.eye(model.nv)[list(places)], atol=1e-12)


@pytest.mark.some(11)
@pytest.mark.parametrize("robot", ROBOTS)
def test_rates_and_values_of_candidates_have_the_same_units(robot: str) -> None:
    """Whatever could be measured: its rate is the derivative of its value along any motion of the spanning tree, and
    lengths are relative to the twin's own."""
    setup = setting_of(robot, ("1",))
    mechanism = setup.mechanism
    observations = [each.observation for each in list_candidates(setup)]
    rng = np.random.default_rng(5)
    q_step = rng.normal(size=PinocchioModel(mechanism).nv)
    found = []
    for length in (mechanism.length, 1.0):
        model = PinocchioModel(mechanism, length)
        slides = [i for j in mechanism.joints.values() if j.type.has_translation for i in model.coordinates[j.name][:1]]
        step = q_step.copy()
        step[slides] /= length
        q = model.integrate(model.q0, 0.1 * step)
        ahead, behind = (
            measure(model, model.integrate(q, s * step), mechanism.reference, observations)[2] for s in (STEP, -STEP)
        )
        _, _, values, rates = measure(model, q, mechanism.reference, observations)
        for a, b, rate in zip(ahead, behind, rates, strict=True):
            np.testing.assert_allclose(rate @ step, (a - b) / (2 * STEP), rtol=1e-6, atol=1e-6)
        found.append([(o.dimension, value) for o, value in zip(observations, values, strict=True)])
    for (dimension, own), (_, metres) in zip(*found, strict=True):
        np.testing.assert_allclose(own * mechanism.length ** np.asarray(dimension, dtype=float), metres, atol=1e-9)


@pytest.mark.parametrize("robot", ["quattro", "3prp", "gough_stewart"])
def test_what_is_measured_does_not_depend_on_what_else_is_asked(robot: str) -> None:
    """Each candidate alone, and all together with poses of no link, of one and of all (of one twice)."""
    mechanism = setting_of(robot, ("1",)).mechanism
    observations = [each.observation for each in list_candidates(setting_of(robot, ("1",)))]
    assert {each.turns_only for each in observations} == {True, False}
    q = walked(PinocchioModel(mechanism)).q
    alone = [measure(PinocchioModel(mechanism), q, mechanism.reference, [each]) for each in observations]
    links = tuple(mechanism.links)
    for asked in ((), (mechanism.platform,), (*links, mechanism.platform)):
        model = PinocchioModel(mechanism)
        for _ in range(2):
            X, V, values, rates = measure(model, q, mechanism.reference, observations, asked)
            for link, pose_, velocity in zip(asked, X, V, strict=True):
                np.testing.assert_array_equal(pose_, model.poses(q, (link,))[0])
                np.testing.assert_array_equal(velocity, model.velocity(q, link))
            for (_, _, (value,), (rate,)), other, moving in zip(alone, values, rates, strict=True):
                np.testing.assert_allclose(other, value, rtol=0, atol=1e-13)
                np.testing.assert_allclose(moving, rate, rtol=0, atol=1e-13)


def test_a_split_universal_joint_has_the_encoders_of_its_halves() -> None:
    """Two R in the place of a U read what its two encoders read."""
    rng = np.random.default_rng(2)
    whole = setting_of("3upu").mechanism
    halves = split(whole, rng, kinds=("universal",))
    (gone,) = set(whole.joints) - set(halves.joints)
    parts = [name for name in halves.joints if name.startswith(gone + "__")]
    rows = []
    for mechanism, names in ((whole, [gone]), (halves, parts)):
        model = PinocchioModel(mechanism, whole.length)
        found = [each for name in names for each in make_encoders(mechanism, mechanism.joints[name])]
        assert len(found) == 2
        _, V, _, rates = measure(model, model.q0, mechanism.reference, found, tuple(whole.links))
        kernel, _ = ClosedConfiguration.of(model, model.q0).kernel()
        rows.append(np.vstack([*V, *rates]) @ kernel)
    ranks = [np.linalg.matrix_rank(each, tol=1e-8) for each in (*rows, np.hstack(rows))]
    assert ranks[0] == ranks[1] == ranks[2] > 0


# ---- lines


@pytest.mark.parametrize("seed", range(4))
def test_a_moment_is_that_of_the_line_not_of_its_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X_c, X, V_c, V = random_pose(rng), random_pose(rng), rng.normal(size=(6, 12)), rng.normal(size=(6, 12))
    u, p = random_direction(rng), rng.normal(size=3)
    line, again = SpaceLine("1", "l", at=p, axis=u), SpaceLine("1", "l", at=p + rng.normal() * u, axis=u)
    h = line.value(X_c, X)[3:]
    seen = Direction("1", "l", u)
    assert abs(h @ seen.value(X_c, X)) < 1e-12
    np.testing.assert_allclose(again.value(X_c, X)[3:], h, atol=1e-12)
    np.testing.assert_allclose(again.rate(X_c, X, V_c, V), line.rate(X_c, X, V_c, V), atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_with_its_direction_a_moment_tells_the_same_about_any_origin(seed: int) -> None:
    """About an origin at o the moment is h − o × u, with the same information; alone it depends on the origin."""
    rng = np.random.default_rng(seed)
    X_c, X, V_c, V = random_pose(rng), random_pose(rng), rng.normal(size=(6, 12)), rng.normal(size=(6, 12))
    o = rng.normal(size=3)
    X_o = X_c @ build_pose(o)
    V_o = np.vstack([V_c[:3] + np.cross(V_c[3:].T, X_c[:3, :3] @ o).T, V_c[3:]])
    u, p = random_direction(rng), rng.normal(size=3)
    seen, line = Direction("1", "l", u), SpaceLine("1", "l", at=p, axis=u)
    h, h_o = line.value(X_c, X)[3:], line.value(X_o, X)[3:]
    np.testing.assert_allclose(h_o, h - np.cross(o, seen.value(X_c, X)), atol=1e-12)
    du = seen.rate(X_c, X, V_c, V)
    dh, dh_o = line.rate(X_c, X, V_c, V)[3:], line.rate(X_o, X, V_o, V)[3:]
    rank = np.linalg.matrix_rank
    assert rank(np.vstack([du, dh])) == rank(np.vstack([du, dh, dh_o])) == rank(np.vstack([du, dh_o])) == 4
    assert rank(np.vstack([dh, dh_o])) > rank(dh)


@pytest.mark.parametrize("robot", ["3rrr_m1", "gough_stewart", "hexaglide", "delta", "rrrrr_m1", "3prp"])
def test_an_observed_line_is_that_of_the_segment(robot: str) -> None:
    """The line lies along the direction; where the segment is binary it meets the centres or axes of both joints."""
    setup = setting_of(robot)
    mechanism = setup.mechanism
    for seen in setup.observed:
        assert isinstance(seen, Direction)
        line = locate_observed_line(setup.decomposition, seen)
        assert line.key != seen.key
        X = mechanism.links[seen.link].pose
        u, p = X[:3, :3] @ line.axis, X[:3, :3] @ line.at + X[:3, 3]
        np.testing.assert_allclose(line.axis, seen.direction)
        still = [j for j in mechanism.joints_of(seen.link) if not j.type.has_translation]
        assert len(still) > 0
        for joint in still:
            assert gap(joint, p, u) < 1e-7 * mechanism.length


def gap(joint: Joint, p: Array, u: Array) -> float:
    """The distance of a line from a joint's centre, or from its axis where it is an R."""
    arm = joint.point - p
    if joint.type != "R":
        return float(np.linalg.norm(np.cross(arm, u)))
    normal = np.cross(joint.axis, u)
    return float(abs(arm @ normal) / np.linalg.norm(normal))


def test_a_line_keeps_the_link_it_is_seen_from() -> None:
    setup = setting_of("delta")
    seen = replace(setup.observed[0], seen_from="platform")
    assert isinstance(seen, Direction)
    assert locate_observed_line(setup.decomposition, seen).seen_from == "platform"
