"""Special relations of geometry: those that persist in motion are found, and only those."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from hrsynth.description import list_robots, load
from hrsynth.geometry.incidences import Incidence
from hrsynth.geometry.vectors import Array, invert_pose, normalise_vector
from hrsynth.mechanism import Direction, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.incidences import Incidences
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.screws import build_constraint_matrix
from mechanism.relating import observed, recognised, segments, walked
from oracle import Oracle
from strategies import deltas, planar, pods, random_rotation, spherical, transformed

Rng = np.random.Generator


class Here:
    """Directions and centres of relations at one configuration, worked out joint by joint."""

    def __init__(self, mechanism: Mechanism, relations: Incidences, state: Array) -> None:
        self.mechanism = mechanism
        moved = {name: state[i] @ invert_pose(link.pose) for i, (name, link) in enumerate(mechanism.links.items())}
        self.classes: dict[int, list[Array]] = {}
        self.centres: dict[int, Array] = {}
        self.seen = []
        for name, joint in mechanism.joints.items():
            for axis, link, number in zip(joint.axes, joint.links, relations.axes[name], strict=False):
                self.classes.setdefault(number, []).append(moved[link][:3, :3] @ axis)
            if name in relations.centres:
                X = moved[joint.successor]
                self.centres[relations.centres[name]] = (X[:3, :3] @ joint.point + X[:3, 3]) / mechanism.length
        for observation, sight in zip(segments(mechanism), relations.sights, strict=True):
            u = state[list(mechanism.links).index(observation.link), :3, :3] @ observation.direction
            self.seen.append(u)
            if sight.kind == "class":
                self.classes.setdefault(sight.classes[0], []).append(u)

    def misses(self, relations: Incidences) -> Iterator[float]:
        """By how much each relation fails."""
        axis = {number: directions[0] for number, directions in self.classes.items()}
        for directions in self.classes.values():
            yield from (float(np.linalg.norm(np.cross(each, directions[0]))) for each in directions)
        for number, conditions in enumerate(relations.tower):
            for by in conditions:
                assert max(by) < number
                normal = axis[by[0]] if len(by) == 1 else np.cross(axis[by[0]], axis[by[1]])
                yield abs(float(normal @ axis[number]))
        for incidence in relations.incidences:
            if all(number in self.centres for number, _ in incidence.terms):
                yield self._miss(incidence, axis)
        for sight, u in zip(relations.sights, self.seen, strict=True):
            if sight.kind in ("between", "foot"):
                j, k = sight.points
                along = self.centres[k] - self.centres[j]
                for c in sight.classes:
                    along = along - axis[c] * (axis[c] @ along)
                yield float(np.linalg.norm(np.cross(normalise_vector(along), u)))

    def _miss(self, incidence: Incidence, axis: dict[int, Array]) -> float:
        vector = sum((sign * self.centres[number] for number, sign in incidence.terms), np.zeros(3))
        by = [axis[c] for c in incidence.classes]
        match incidence.kind:
            case "zero":
                return float(np.linalg.norm(vector))
            case "parallel":
                return float(np.linalg.norm(np.cross(vector, by[0])))
            case _:
                return abs(float(vector @ by[0]))


@pytest.mark.some(6)
@pytest.mark.parametrize("name", list_robots())
def test_relations_hold_wherever_the_robot_goes(name: str) -> None:
    """What holds at three configurations holds at others on another path."""
    robot = observed(load(name))
    relations = recognised(robot, walked(robot, 2, seed=1))
    for state in walked(robot, 2, seed=2):
        assert max(Here(robot, relations, state).misses(relations), default=0.0) < 1e-8


@pytest.mark.some(8)
@pytest.mark.parametrize("name", list_robots())
def test_the_constraints_in_screws_are_those_of_the_oracle(name: str) -> None:
    """The kernel of A, built from centres and axes where the robot is, is T_qC."""
    robot = reduce_to_normal_form(load(name)).mechanism
    oracle, state = Oracle(robot), walked(robot, 1, seed=3)[-1]
    moved = {link: state[i] @ invert_pose(robot.links[link].pose) for i, link in enumerate(robot.links)}
    place = {link: i for i, link in enumerate(n for n in robot.links if n != robot.base)}
    A = build_constraint_matrix(
        list(robot.joints.values()),
        place,
        lambda joint: (
            (moved[joint.predecessor] @ [*joint.point, 1.0])[:3] / robot.length,
            [moved[link][:3, :3] @ axis for axis, link in zip(joint.axes, joint.links, strict=False)],
        ),
    )
    values = np.linalg.svd(A, compute_uv=False)
    assert A.shape[1] - int(np.sum(values > 1e-8 * values[0])) == oracle.mobility(state)


def test_all_axes_of_a_planar_robot_are_one_class() -> None:
    for seed in range(3):
        robot = planar(["RRR", "RRR", "RRR"], np.random.default_rng(seed), [{0}] * 3)
        relations = recognised(robot, walked(robot, 2, seed))
        assert {axes for axes in relations.axes.values()} == {(0,)}
        assert [sight.kind for sight in relations.sights] == ["between"] * 3
        assert {(each.kind, each.classes) for each in relations.incidences} == {("normal", (0,))}


def test_axes_that_meet_in_one_point() -> None:
    """All axes of a spherical robot run through one more centre; two axes that meet are nothing special."""
    robot = spherical(np.random.default_rng(3))
    relations = recognised(robot, walked(robot, 2, seed=3))
    assert relations.count == 10
    through = [each for each in relations.incidences if each.kind == "parallel" and each.terms[0][0] == 9]
    assert {each.terms[1][0] for each in through} == set(range(9))
    robot = observed(load("delta"))
    assert recognised(robot, walked(robot, 2, seed=3)).count == len(recognised(robot, walked(robot, 2, 3)).centres)


def lifted(robot: Mechanism, rng: Rng) -> Mechanism:
    """The same robot with every R centre slid along its axis."""
    joints = [
        joint
        if joint.type.value != "R"
        else type(joint)(
            joint.name,
            joint.type,
            joint.predecessor,
            joint.successor,
            joint.point + rng.uniform(-1, 1) * joint.axis,
            joint.axes,
            joint.motor,
        )
        for joint in robot.joints.values()
    ]
    return robot.changed(joints=joints)


def test_observed_segments_of_links_at_any_height() -> None:
    """A segment between two parallel R runs along their common perpendicular."""
    rng = np.random.default_rng(0)
    robot = lifted(planar(["RRR", "RRR", "RRR"], rng, [{0}] * 3), rng)
    relations = recognised(robot, walked(robot, 2, seed=0))
    assert [sight.kind for sight in relations.sights] == ["foot"] * 3


@pytest.mark.parametrize("aligned", [True, False])
def test_spatial_parallelograms(aligned: bool) -> None:
    """Where the side keeps parallel to the base's R both ends of the rods are the same distance apart."""
    robot = deltas(["R"] * 3, ["2-SS"] * 3, np.random.default_rng(4), aligned)
    relations = recognised(robot, walked(robot, 2, seed=4))
    equal = [each for each in relations.incidences if len(each.terms) == 4]
    along = [each for each in relations.incidences if each.kind == "parallel"]
    assert len(equal) == (3 if aligned else 0)
    assert bool(along) == aligned
    assert all(sight.kind == "between" for sight in relations.sights)


@pytest.mark.parametrize("square", [True, False])
def test_the_axes_of_universal_joints_are_perpendicular(square: bool) -> None:
    """The U's two axes are, always; the rod is normal to its inner axis only where it is built so."""
    robot = pods(["UPS"] * 6, np.random.default_rng(5), square)
    relations = recognised(robot, walked(robot, 2, seed=5))
    for number in range(1, 7):
        first, second = relations.axes[f"foot_{number}"]
        (rod,) = relations.axes[f"slide_{number}"]

        def meet(a: int, b: int) -> bool:
            return (min(a, b),) in relations.tower[max(a, b)]

        assert meet(first, second)
        assert meet(second, rod) == square
        assert not meet(first, rod)
    ends = [each for each in relations.incidences if each.kind == "parallel"]
    assert len(ends) == 6


def chain() -> Mechanism:
    """Three R in a chain, the first and the last parallel at zero."""
    builder = Builder("chain")
    for name, at in (("base", 0), ("one", 1), ("two", 2), ("hand", 3)):
        builder.link(name, at=(at, 0, 0))
    for number, (a, b, axis) in enumerate(
        (("base", "one", (0, 0, 1)), ("one", "two", (0, 1, 0)), ("two", "hand", (0, 0, 1)))
    ):
        builder.joint(f"turn_{number}", "R", a, b, (number, 0, 0), axis=axis)
    builder.observe("1", "hand", (0.3, 0.4, 0.5))
    return builder.build(platform="hand")


def test_what_holds_at_zero_alone_is_no_relation() -> None:
    robot = chain()
    still = recognised(robot, walked(robot, 0, seed=0))
    moving = recognised(robot, walked(robot, 3, seed=0))
    assert still.axes["turn_0"] == still.axes["turn_2"]
    assert len({axes for axes in moving.axes.values()}) == 3
    fixed = [set(by) | {number} for number, conditions in enumerate(moving.tower) for by in conditions]
    first, second, third = (moving.axes[f"turn_{i}"][0] for i in range(3))
    assert {first, second} in fixed
    assert {second, third} in fixed
    assert {first, third} not in fixed


def test_the_segment_between_skew_axes() -> None:
    """It runs along their common perpendicular, wherever the centres are on the axes."""
    robot = chain()
    turn = robot.joints["turn_1"]
    frame = robot.links["one"].pose[:3, :3]
    robot = robot.changed(
        joints=[replace(turn, point=turn.point + 0.3 * turn.axis)],
        observations=(Direction("1", "one", frame.T @ np.array([1.0, 0.0, 0.0])),),
    )
    low = replace(robot.joints["turn_0"], point=robot.joints["turn_0"].point + np.array([0, 0, 0.2]))
    found = recognised(robot.changed(joints=[low]), walked(robot, 2, seed=0))
    assert [sight.kind for sight in found.sights] == ["normal"]


def test_relations_do_not_depend_on_the_base() -> None:
    rng = np.random.default_rng(7)
    robot = observed(load("quattro"))
    turned = transformed(robot, random_rotation(rng), rng.normal(size=3))
    one, two = (recognised(each, walked(each, 2, seed=1)) for each in (robot, turned))
    assert one.axes == two.axes
    assert one.sights == two.sights
    assert Counter(one.incidences) == Counter(two.incidences)
