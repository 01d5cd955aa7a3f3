"""The way back, from the platform to the motors: boxes in which no two motors have one pose, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.test_motor_branch import circles, followed, four_bar
from hrsynth import branch, load
from hrsynth.analysis.branch.answer import BranchProof
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from strategies import random_rotation

Z = np.array([0.0, 0.0, 1.0])


def rocker_driven(bars, angle, side, turn=None) -> Mechanism:
    """A four-bar whose platform is the rocker."""
    ground, crank, coupler, rocker = bars
    robot = four_bar(ground, crank, coupler, rocker, angle, turn, side)
    return Mechanism.of("rocker", robot.links.values(), robot.joints.values(), base="base", platform="rocker")


def rocker_angle(bars, angle, side, q):
    """The rocker's angle (n,), in closed form."""
    ground, crank, coupler, rocker = bars
    B, D = crank * np.stack([np.cos(angle + q), np.sin(angle + q)], axis=-1), np.array([ground, 0.0])
    d = D - B
    size = np.linalg.norm(d, axis=-1)
    along = (coupler**2 - rocker**2 + size**2) / (2 * size)
    across = side * np.sqrt(coupler**2 - along**2)
    C = B + (along / size)[:, None] * d + (across / size)[:, None] * np.stack([-d[:, 1], d[:, 0]], axis=-1)
    return np.unwrap(np.arctan2(*(C - D).T[::-1]))


def dead_points(bars, angle, side):
    """Crank angles at which the rocker turns round."""
    q = np.linspace(-np.pi, np.pi, 20001)
    return q[:-1][np.diff(np.sign(np.gradient(rocker_angle(bars, angle, side, q), q))) != 0]


def crank_rockers(rng, sides=(-1, 1)):
    """Bars of which the first can turn all round, and a start away from where the rocker turns round."""
    while True:
        bars = rng.uniform(0.3, 1.5, 4)
        crank = bars[1]
        angle, side = float(rng.uniform(-3, 3)), int(rng.choice(sides))
        if (
            crank == bars.min()
            and crank + bars.max() < bars.sum() - crank - bars.max() - 0.05
            and abs(dead_points(bars, angle, side)).min() > 0.1
        ):
            return tuple(bars.tolist()), angle, side


@pytest.mark.parametrize("seed", [3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1, 2, 4, 5))])
def test_a_rocker_leads_back_between_its_dead_points_alone(seed):
    """The rocker swings to and fro while the crank turns: the proved box ends before the rocker turns round, and not
    long before."""
    rng = np.random.default_rng(seed)
    bars, angle, side = crank_rockers(rng)
    proof = branch(rocker_driven(bars, angle, side, random_rotation(rng)))
    dead = dead_points(bars, angle, side)
    assert len(dead) == 2
    assert not proof.regular
    assert proof.injective_box is not None
    (low,), (high,) = proof.injective_box
    assert low < 0 < high
    assert not np.any((dead > low + 1e-3) & (dead < high - 1e-3))
    assert min(abs(dead - low)) < 0.2 or low < -3
    assert min(abs(dead - high)) < 0.2 or high > 3


@pytest.mark.slow
def test_on_another_branch_other_motors_in_the_box_give_the_same_pose():
    """Crank and rocker turn all round on either branch: the rods' circles meet in two places of the crank's pin."""
    bars, angle = (0.3, 1.0, 0.9, 1.1), 0.3
    proof = branch(rocker_driven(bars, angle, 1), {"a": (-1.0, 1.0)})
    assert proof.regular
    assert proof.injective_box is not None
    (low,), (high,) = proof.injective_box
    ground, crank, coupler, rocker = bars
    q = np.linspace(low, high, 101)
    turned = rocker_angle(bars, angle, 1, q)
    assert np.all(np.diff(turned) > 0) or np.all(np.diff(turned) < 0)
    C = rocker * np.stack([np.cos(turned), np.sin(turned), 0 * turned], axis=-1) + [ground, 0.0, 0.0]
    others = [
        np.array([np.arctan2(*circles(np.zeros(3), at, crank, coupler, side)[1::-1]) for at in C]) - angle
        for side in (1, -1)
    ]
    away = [np.abs((each - q + np.pi) % (2 * np.pi) - np.pi) for each in others]
    assert np.max(np.minimum(*away)) < 1e-9
    other = np.where(away[0] > away[1], *others)
    assert np.any((low < other) & (other < high) & (np.maximum(*away) > 0.1))
    assert "same platform pose on this branch, proved" in str(proof)


@pytest.mark.slow
def test_without_a_dead_point_the_whole_box_leads_back():
    bars, angle, side = crank_rockers(np.random.default_rng(1))
    low, high = (0.9 * dead_points(bars, angle, side)).tolist()
    proof = branch(rocker_driven(bars, angle, side), {"a": (low, high)})
    assert proof.regular
    assert proof.injective_box is not None
    np.testing.assert_array_equal(np.ravel(proof.injective_box), [low, high])


@pytest.mark.slow
def test_a_crank_that_is_the_platform_leads_back_everywhere():
    """After a whole turn it is where it was; a little less and each pose has one angle."""
    robot = four_bar()
    own = Mechanism.of("crank", robot.links.values(), robot.joints.values(), base="base", platform="crank")
    whole = branch(own)
    assert whole.regular
    assert whole.injective_box is not None
    assert whole.injective_box[1][0] - whole.injective_box[0][0] < 2 * np.pi
    part = branch(own, "a=-3.1:3.1")
    assert part.injective_box is not None
    np.testing.assert_array_equal(np.ravel(part.injective_box), [-3.1, 3.1])


def chained(bars, angle, other_bars, other_angle, turn) -> Mechanism:
    """A four-bar whose rocker carries another one across, whose rocker is the platform: two loops, a motor each."""
    b = Builder("chained")
    for name in ("base", "crank", "coupler", "rocker", "crank2", "coupler2", "rocker2"):
        b.link(name)
    across = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for end, base, (ground, crank, coupler, rocker), start, R, at in (
        ("", "base", bars, angle, turn, np.zeros(3)),
        ("2", "rocker", other_bars, other_angle, turn @ across, turn @ np.array([0.4, 0.2, 0.7])),
    ):
        B, D = crank * np.array([np.cos(start), np.sin(start), 0]), np.array([ground, 0, 0])
        C = circles(B, D, coupler, rocker, 1)
        b.joint(f"a{end}", "R", base, f"crank{end}", at=R @ np.zeros(3) + at, axis=R @ Z, motor=True)
        b.joint(f"b{end}", "R", f"crank{end}", f"coupler{end}", at=R @ B + at, axis=R @ Z)
        b.joint(f"d{end}", "R", base, f"rocker{end}", at=R @ D + at, axis=R @ Z)
        b.joint(f"c{end}", "R", f"coupler{end}", f"rocker{end}", at=R @ C + at, axis=R @ Z, loop=True)
    return b.build(platform="rocker2")


@pytest.mark.slow
def test_loops_one_after_the_other():
    """Both rockers must be between their dead points."""
    rng = np.random.default_rng(3)
    (bars, angle, _), (others, start, _) = crank_rockers(rng, [1]), crank_rockers(rng, [1])
    proof = branch(chained(bars, angle, others, start, random_rotation(rng)))
    assert len(proof.parts) == 2
    assert proof.injective_box is not None
    for k, (each, begin) in enumerate(((bars, angle), (others, start))):
        dead = dead_points(each, begin, 1)
        assert not np.any((dead > proof.injective_box[0][k] + 1e-3) & (dead < proof.injective_box[1][k] - 1e-3))
        assert proof.injective_box[0][k] < -0.1 * min(abs(dead))


def test_a_motor_that_the_platform_does_not_feel_is_not_led_back_to():
    """A rocker that only carries the other loop's base: its own platform is the first one's."""
    rng = np.random.default_rng(4)
    (bars, angle, _), (others, start, _) = crank_rockers(rng, [1]), crank_rockers(rng, [1])
    robot = chained(bars, angle, others, start, np.eye(3))
    proof = branch(
        Mechanism.of("first", robot.links.values(), robot.joints.values(), base="base", platform="rocker"),
        "a=-0.1:0.1,a2=-0.1:0.1",
    )
    assert proof.parts[1].volume_fraction == 1.0
    assert proof.injective_box is None
    assert not proof.regular


@pytest.mark.parametrize(
    ("name", "half"),
    [
        ("rrrrr_m1", 0.1),
        pytest.param("delta", 0.04, marks=pytest.mark.long),
        pytest.param("gough_stewart", 0.001, marks=pytest.mark.long),
    ],
)
def test_motors_of_shipped_robots_are_functions_of_the_pose(name, half):
    """Poses of different motors differ, by small steps of plain NumPy."""
    robot = load(name)
    proof = branch(robot, {joint.name: (-half, half) for joint in robot.joints.values() if joint.is_actuated})
    assert proof.regular
    assert proof.injective_box is not None
    np.testing.assert_array_equal(proof.injective_box, proof.proved)
    rng = np.random.default_rng(0)
    q = [rng.uniform(*proof.injective_box) for _ in range(6)]
    poses = [pose_at(proof, each) for each in q]
    for k, (one, pose) in enumerate(zip(q, poses, strict=True)):
        for other, seen in zip(q[:k], poses, strict=False):
            assert np.linalg.norm(pose - seen) > 0.05 * np.linalg.norm(one - other)


def pose_at(proof: BranchProof, q):
    """The platform's pose, its lengths in characteristic lengths."""
    values = np.zeros(len(proof.system.names))
    for now in followed(proof, q, values, 5):
        values = now
    X = proof.system.pose(proof.robot.platform, values / proof.system.units)
    return np.concatenate([X[:3, :3].ravel(), X[:3, 3] / proof.system.length])
