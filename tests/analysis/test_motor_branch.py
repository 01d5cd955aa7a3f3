"""The branch from motors to joints: what is proved holds along small steps of plain NumPy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from description.foreign.rounded import of_hinges
from hrsynth import branch, check, load, modes
from hrsynth.analysis.branch.answer import BranchProof
from hrsynth.analysis.branch.cells import _bound_smallest_value
from hrsynth.analysis.branch.growth import CellGrid, split_box
from hrsynth.errors import BadRequest, MotorsNotEnough
from hrsynth.families.delta import delta
from hrsynth.geometry.affine import AffineForms, make_affine
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Limits, Mechanism
from strategies import random_rotation, spherical

Z = np.array([0.0, 0.0, 1.0])


def circles(A, B, a, b, side):
    """The point at distances a and b from A and B."""
    d = B - A
    size = np.linalg.norm(d)
    along = (a * a - b * b + size * size) / (2 * size)
    return A + along * d / size + side * np.sqrt(a * a - along**2) * np.cross(Z, d / size)


def four_bar(ground=1.0, crank=0.5, coupler=1.2, rocker=0.8, angle=0.7, turn=None, side=1) -> Mechanism:
    """A crank that is driven, with its plane turned."""
    R = np.eye(3) if turn is None else turn
    A, D = np.zeros(3), np.array([ground, 0, 0])
    B = crank * np.array([np.cos(angle), np.sin(angle), 0])
    C = circles(B, D, coupler, rocker, side)
    b = Builder("four_bar")
    for name in ("base", "crank", "coupler", "rocker"):
        b.link(name)
    for name, one, other, at in (("a", "base", "crank", A), ("b", "crank", "coupler", B), ("d", "base", "rocker", D)):
        b.joint(name, "R", one, other, at=R @ at, axis=R @ Z, motor=name == "a")
    b.joint("c", "R", "coupler", "rocker", at=R @ C, axis=R @ Z, loop=True)
    return b.build(platform="coupler")


def screw_motion(coordinate, length, value):
    """The displacement (4, 4) of a coordinate, by the series of the exponential of its twist."""
    twist, a = np.zeros((4, 4)), coordinate.axis
    if coordinate.slides:
        twist[:3, 3] = a
    else:
        twist[:3, :3] = [[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]]
        twist[:3, 3] = -twist[:3, :3] @ coordinate.point * length
    X, term = np.eye(4), np.eye(4)
    for k in range(1, 30):
        term = term @ twist * value / k
        X = X + term
    return X


def misses(proof: BranchProof, values) -> np.ndarray:
    """How far each cut joint is from being assembled at values of all coordinates, from the joints' own geometry."""
    system, placed = proof.system, {-1: np.eye(4)}
    for i, (coordinate, value) in enumerate(zip(system.coordinates, values, strict=True)):
        placed[i] = placed[coordinate.parent] @ screw_motion(coordinate, system.length, value)
    found = []
    for loop in system.loops:
        joint = proof.robot.joints[loop.name]
        X, Y = (placed[system.body[link]] for link in joint.links)
        gap = (Y - X) @ [*joint.point, 1.0]
        letter = joint.type.value
        if letter in "RUS":
            found += [*gap[:3]]
        if letter in "RPC":
            a = joint.axes[0]
            found += [*np.cross(X[:3, :3] @ a, Y[:3, :3] @ a)]
        if letter in "PC":
            found += [*np.cross(X[:3, :3] @ joint.axes[0], gap[:3])]
        if letter == "P":
            found += [*(X[:3, :3] - Y[:3, :3]).ravel()]
        if letter == "U":
            found.append((X[:3, :3] @ joint.axes[0]) @ (Y[:3, :3] @ joint.axes[1]))
    for coupling in proof.robot.couplings:
        one, other = (
            next(i for i, c in enumerate(system.coordinates) if c.joint == name)
            for name in (coupling.driver, coupling.driven)
        )
        found.append(values[other] - coupling.ratio * values[one])
    return np.array(found)


def followed(proof: BranchProof, motors, values, steps):
    """Values of all coordinates along a straight way of the motors, closed again after each small step by Newton's
    method with differences."""
    names = proof.system.names
    driven, free = ([names.index(name) for name in each] for each in (proof.motors, proof.passive))
    start = values[driven].copy()
    for k in range(1, steps + 1):
        values = values.copy()
        values[driven] = start + (motors - start) * k / steps
        for _ in range(8):
            miss = misses(proof, values)
            if np.linalg.norm(miss) < 1e-12:
                break
            J = np.array([(misses(proof, values + 1e-6 * e) - miss) / 1e-6 for e in np.eye(len(values))[free]]).T
            values[free] -= np.linalg.lstsq(J, miss, rcond=1e-7)[0]
        assert np.linalg.norm(miss) < 1e-9
        yield values


def obeys(proof: BranchProof, rng, ways: int, steps: int) -> int:
    """Along random ways in the proved boxes the tubes of all cells hold the closure; the number of points looked at."""
    names, count = proof.system.names, 0
    values = np.zeros(len(names))
    for _ in range(ways):
        goal = np.zeros(len(proof.motors))
        for part in proof.parts:
            goal[[proof.motors.index(name) for name in part.motors]] = rng.uniform(*part.proved)
        for now in followed(proof, goal, values, steps):
            values = now
            for part in proof.parts:
                q, x = (now[[names.index(name) for name in each]] for each in (part.motors, part.passive))
                cell = part.find(q)
                assert cell is not None
                assert np.all(np.abs(x - cell.at(q)) <= cell.radius + 1e-9)
                count += 1
    return count


def connected(part) -> bool:
    """Whether all cells hang together by faces."""
    seen, pending = {0}, [0]
    while pending:
        for other in part.cells[pending.pop()].neighbours:
            if other not in seen:
                seen.add(other)
                pending.append(other)
    return len(seen) == len(part.cells)


@pytest.mark.parametrize("seed", range(3))
def test_forms_enclose(seed):
    """Products, sums and sines of affine forms hold the values at all symbols."""
    rng = np.random.default_rng(seed)

    def form() -> AffineForms:
        return make_affine(rng.normal(size=50), 0.3 * rng.normal(size=(50, 3)), 0.1 * np.abs(rng.normal(size=50)))

    a, b, c = form(), form(), form()
    sine, cosine = (a + b).sines()
    made = a * b - c * c * a + sine * c - cosine * cosine * 2.0
    for _ in range(100):
        e = rng.choice([-1.0, 1.0, rng.uniform(-1, 1)], size=3)
        x, y, z = (
            each.v[0] + np.tensordot(e, each.v[1:], 1) + each.r * rng.choice([-1, 0.3, 1], size=50)
            for each in (a, b, c)
        )
        value = x * y - z * z * x + np.sin(x + y) * z - 2 * np.cos(x + y) ** 2
        assert np.all(np.abs(value - made.v[0] - np.tensordot(e, made.v[1:], 1)) <= made.r)


@pytest.mark.slow
def test_a_crank_stays_on_its_branch_over_a_whole_turn():
    """Bars 1, 0.5, 1.2, 0.8: one branch all round, which comes back to itself; no tube holds the other closure."""
    robot = four_bar()
    (part,) = branch(robot).parts
    assert part.volume_fraction == part.box_fraction == 1.0
    assert part.turns == (("a", True),)
    assert connected(part)
    d, b = part.passive.index("d"), part.passive.index("b")
    home = np.array([0.5 * np.cos(0.7), 0.5 * np.sin(0.7), 0])
    D = np.array([1.0, 0, 0])

    def angles(q, side):
        B = 0.5 * np.array([np.cos(0.7 + q), np.sin(0.7 + q), 0])
        C = circles(B, D, 1.2, 0.8, side)
        return np.arctan2(*(C - D)[1::-1]), np.arctan2(*(C - B)[1::-1]) - q

    zero = angles(0.0, 1)
    assert np.linalg.norm(home) == pytest.approx(0.5)
    for q in np.linspace(-np.pi, np.pi, 3001):
        cell = part.find([q])
        for side, inside in ((1, True), (-1, False)):
            off = np.zeros(2)
            off[[d, b]] = np.array(angles(q, side)) - zero
            off -= cell.at(np.array([q]))
            off -= 2 * np.pi * np.round(off / (2 * np.pi))
            assert bool(np.all(np.abs(off) <= cell.radius + 1e-9)) is inside


@pytest.mark.slow
def test_the_proof_ends_where_the_loop_toggles():
    """No crank: it turns as far as coupler and rocker are in line, and these are named."""
    (part,) = branch(four_bar(1.0, 0.9, 0.6, 0.8, 1.2)).parts
    ends = [np.arccos((1 + 0.81 - reach**2) / 1.8) - 1.2 for reach in (0.2, 1.4)]
    named = [each for each in part.toggles if each.joints]
    assert named
    for each in named:
        assert set(each.joints) == {"b", "d"} or set(each.joints) == {"d", "b"}
        assert min(abs(each.q[0] - end) for end in ends) < 1e-2
    assert ends[0] < part.proved[0][0] < 0 < part.proved[1][0] < ends[1]
    assert part.proved[0][0] - ends[0] < 0.05
    assert not part.turns


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_tubes_hold_what_small_steps_find_in_random_four_bars(seed):
    rng = np.random.default_rng(seed)
    while True:
        bars, angle = rng.uniform(0.3, 1.5, 4), rng.uniform(-3, 3)
        B = bars[1] * np.array([np.cos(angle), np.sin(angle)])
        reach = np.hypot(*(B - [bars[0], 0]))
        if abs(bars[2] - bars[3]) + 0.1 < reach < bars[2] + bars[3] - 0.1:
            break
    ground, crank, coupler, rocker = bars.tolist()
    proof = branch(four_bar(ground, crank, coupler, rocker, angle, random_rotation(rng), rng.choice([-1, 1])))
    assert proof.parts[0].cells
    assert connected(proof.parts[0])
    assert obeys(proof, rng, 3, 40) == 120


SLOW = pytest.mark.slow


@pytest.mark.some(1, 2)
@pytest.mark.parametrize(
    ("name", "half"),
    [
        ("rrrrr_m1", 0.15),
        ("3rrr_m1", 0.1),
        ("3ppr_m1", 0.01),
        pytest.param("3prr_m1", 0.02, marks=SLOW),
        pytest.param("delta", 0.04, marks=SLOW),
        pytest.param("3rps", 0.01, marks=SLOW),
        pytest.param("gough_stewart", 0.002, marks=SLOW),
        pytest.param("quattro", 0.001, marks=SLOW),
    ],
)
def test_tubes_hold_what_small_steps_find(name, half):
    robot = load(name)
    box = {joint.name: (-half, half) for joint in robot.joints.values() if joint.is_actuated}
    proof = branch(robot, box, max_cells=100)
    assert proof.parts[0].volume_fraction == 1.0
    assert obeys(proof, np.random.default_rng(1), 3, 6) == 18


@pytest.mark.long
@pytest.mark.parametrize(("name", "least", "max_cells"), [("quattro", 0.009, 100), ("hexa", 0.004, 100)])
def test_a_box_much_too_large_is_proved_about_zero(name, least, max_cells):
    """Whole turns of four and six motors: cells no larger than the one about zero that is proved, most of which are."""
    proof = branch(name, max_cells=max_cells)
    (part,) = proof.parts
    assert len(part.cells) > max_cells // 2
    assert np.all(np.abs(part.proved) >= least)
    assert connected(part)
    assert obeys(proof, np.random.default_rng(2), 3, 10) == 30


@settings(deadline=None)
@given(data=st.data(), n=st.integers(1, 4), most=st.integers(1, 100))
def test_a_lattice_fills_the_box_about_its_start(data, n, most):
    """Equal cells but for those that the box ends, at most so many, and what lies beyond: disjoint, and in all the box,
    in whole numbers; the start is in the first, in its middle where the box does not end it."""

    def some(low, high):
        return np.array([data.draw(st.floats(low, high)) for _ in range(n)])

    low, high, half = -some(0, 5), some(0.1, 5), some(1e-4, 2)
    grid = CellGrid(low, high)
    cells = split_box(grid, np.zeros(n), half, most)
    corners = np.array([(cell.low, cell.high) for cell in cells])
    assert sum(math.prod((b - a).tolist()) for a, b in corners) == 2 ** (40 * n)
    inner = np.minimum(corners[:, None, 1], corners[None, :, 1]) - np.maximum(corners[:, None, 0], corners[None, :, 0])
    assert np.all(np.any(inner <= 0, axis=-1) | np.eye(len(cells), dtype=bool))
    assert sum(not cell.beyond for cell in cells) <= most
    for k, cell in enumerate(cells):
        a, b = grid.point(cell.low), grid.point(cell.high)
        if not cell.beyond:
            assert np.all(b - a <= 2 * half + 1e-9)
            free = (cell.low > 0) & (cell.high < 2**40)
            assert np.all(np.abs(b - a - 2 * half)[free] <= 1e-9)
        if k == 0:
            assert not cell.beyond
            assert np.allclose(a, np.maximum(-half, low), atol=1e-9)
            assert np.allclose(b, np.minimum(half, high), atol=1e-9)


def test_motors_that_do_not_make_a_function_are_refused():
    with pytest.raises(BadRequest, match="motor coordinates are independent at zero"):
        branch("quattro_rigid")
    robot = load("rrrrr_m1")
    idle = Mechanism.of(
        "one",
        robot.links.values(),
        [
            joint
            if joint.name != "shoulder_2"
            else type(joint)(joint.name, joint.type, *joint.links, joint.point, joint.axes)
            for joint in robot.joints.values()
        ],
        platform=robot.platform,
        base=robot.base,
    )
    with pytest.raises(MotorsNotEnough):
        branch(idle)
    with pytest.raises(BadRequest, match="shoulder_9"):
        branch(robot, {"shoulder_9": (-1, 1)})
    with pytest.raises(BadRequest, match="got 'nowhere', expected"):
        branch("rrrrr_m1", box="nowhere=-1:1")
    with pytest.raises(BadRequest, match="got '1:2', expected low < high"):
        branch("rrrrr_m1", box="shoulder_1=1:2")
    with pytest.raises(BadRequest, match="low < high"):
        branch(robot, "shoulder_1=1:2")
    with pytest.raises(BadRequest, match="at most 1000 rad wide"):
        branch("rrrrr_m1", {"shoulder_1": (-1e9, 1e9)})


def test_a_motor_may_be_called_anything_but_a_comma():
    """The last sign = parts a motor from its interval."""
    robot = four_bar()
    named = Mechanism.of(
        "named",
        robot.links.values(),
        [replace(joint, name="crank=a:b") if joint.name == "a" else joint for joint in robot.joints.values()],
        platform=robot.platform,
        base=robot.base,
    )
    found = branch(named, "crank=a:b=-0.01:0.02")
    assert np.array(found.parts[0].requested_box).ravel() == pytest.approx([-0.01, 0.02])


def test_limits_that_limit_nothing_are_a_whole_turn():
    """As some exporters write for a joint without limits."""
    robot = four_bar(coupler=5.0, rocker=5.0)
    wide = robot.changed(
        joints=[replace(joint, limits=Limits(-1e9, 1e9)) for joint in robot.joints.values() if joint.is_actuated]
    )
    found = branch(wide, max_cells=2)
    assert found.box == "a full turn"
    assert np.array(found.parts[0].requested_box).ravel() == pytest.approx([-np.pi, np.pi])


@pytest.mark.slow
@pytest.mark.parametrize("flipped", [False, True])
def test_a_joint_that_is_idle_at_zero_alone_closes_no_loop(flipped):
    """A U joint with one axis along its rod at zero, and a knee that is tilted: the ball leaves the plane, so that the
    coordinate held at zero would leave the loop open by millimetres."""
    b = Builder("tilted_knee")
    for name in ("base", "crank", "arm", "rod"):
        b.link(name)
    rod, tilt = np.array([0, 1.0, 0]), 0.3
    b.joint("m", "R", "base", "crank", axis=Z, motor=True)
    b.joint("knee", "R", "crank", "arm", (1, 0.3, 0), axis=(np.sin(tilt), 0, np.cos(tilt)))
    b.joint("u", "U", "base", "rod", (0.4, -0.7, 0), axis=Z if flipped else rod, axis2=rod if flipped else Z)
    b.joint("s", "S", "rod", "arm", (0.4, 0.3, 0), loop=True)
    for platform in ("crank", "arm"):
        (part,) = branch(b.build(platform=platform), "m=-0.3:0.3").parts
        assert not part.cells


def test_a_truss_on_the_way_stays_as_it_is():
    """Three bars that no motor moves, on the rocker: the motor's loop is the only part."""
    robot = four_bar()
    b = Builder("truss")
    for name in (*robot.links, "one", "two"):
        b.link(name)
    for joint in robot.joints.values():
        b.joint(joint.name, "R", *joint.links, at=joint.point, axis=Z, motor=joint.is_actuated, loop=not joint.in_tree)
    b.joint("t1", "R", "rocker", "one", (1.2, 0.2, 0), axis=Z)
    b.joint("t2", "R", "rocker", "two", (1.4, 0.5, 0), axis=Z)
    b.joint("t3", "R", "one", "two", (1.5, 0.1, 0), axis=Z, loop=True)
    proof = branch(b.build(platform="one"), "a=-0.1:0.1")
    assert [part.motors for part in proof.parts] == [("a",)]
    assert {"t1", "t2"} <= set(proof.fixed)
    assert proof.parts[0].volume_fraction == 1.0
    assert obeys(proof, np.random.default_rng(0), 2, 5) == 10


@pytest.mark.some(1)
@pytest.mark.parametrize("ratio", [-1.0, 0.5, 0.1, 7.0])
def test_a_gear_comes_back_after_whole_turns_alone(ratio):
    """A platform that a motor carries itself; x = ratio q is affine, so that its tube is as thin as tubes are."""
    b = Builder("gear")
    for name in ("base", "one", "two"):
        b.link(name)
    b.joint("m", "R", "base", "one", axis=Z, motor=True)
    b.joint("p", "R", "base", "two", (1, 0, 0), axis=Z)
    b.coupling("g", "m", "p", ratio)
    for platform in ("one", "two"):
        (part,) = branch(b.build(platform=platform)).parts
        assert part.volume_fraction == 1.0
        assert part.turns == (("m", ratio == round(ratio)),)


def test_motors_that_a_box_takes_beyond_their_limits_are_in_the_record():
    robot = four_bar()
    limited = replace(robot, joints=robot.joints | {"a": replace(robot.joints["a"], limits=Limits(-0.05, None))})
    found = branch(limited, {"a": (-0.1, 0.1)})
    low, high = (
        pick(each)
        for pick, each in (
            (min, [cell.low[0] for cell in found.parts[0].cells]),
            (max, [cell.high[0] for cell in found.parts[0].cells]),
        )
    )
    assert found.to_dict()["motors_beyond"] == [
        {"motor": "a", "lower": -0.05, "upper": None, "least": low, "most": high}
    ]
    assert branch(robot, {"a": (-0.1, 0.1)}).to_dict()["motors_beyond"] == []


def test_a_robot_without_motors_is_refused_as_everywhere() -> None:
    robot = load("rrrrr_m1")
    still = replace(robot, joints={name: replace(joint, motor=None) for name, joint in robot.joints.items()})
    said = []
    for ask in (lambda: branch(still), lambda: modes(still, real=True)):
        with pytest.raises(BadRequest, match=r"no motor\. Name one or more with --motors") as refused:
            ask()
        said.append(str(refused.value))
    assert said[0] == said[1]


def test_the_smallest_singular_value_is_bounded_whatever_the_tubes_widths():
    """Of matrices A with |1 − Y A| ≤ M, where M r < r for radii r of very different sizes."""
    rng = np.random.default_rng(0)
    Y, r = rng.normal(size=(200, 4, 4)), 10.0 ** rng.uniform(-9, 0, (200, 4))
    M = rng.uniform(0, 0.2, (200, 4, 4)) * np.minimum(1.0, r[:, :, None] / r[:, None, :])
    E = M * rng.uniform(-1, 1, M.shape)
    exact = np.linalg.svd(np.linalg.solve(Y, np.eye(4) - E), compute_uv=False)[:, -1]
    bound = _bound_smallest_value(Y, M, r)
    assert np.all(bound <= exact)
    assert np.median(bound / exact) > 0.3


def test_a_thin_box_has_the_bound_of_the_loops_at_its_middle():
    robot = spherical(np.random.default_rng(0))
    least = [
        min(
            cell.smallest_singular_value
            for part in branch(robot, box={f"joint_{k}_1": (-w, w) for k, w in enumerate((0.01, *widths), 1)}).parts
            for cell in part.cells
        )
        for widths in ((0.01, 0.01), (1e-9, 1e-9))
    ]
    assert least[0] > 0.1
    assert least[1] >= 0.9 * least[0]


def plain_delta() -> Mechanism:
    return delta(base_radius=0.2, platform_radius=0.06, proximal=0.3, distal=0.65, half_width=0.045, home=HOME)


HOME = (0.0, 0.0, -0.3 * math.sin(0.4) - math.sqrt(0.65**2 - (0.14 + 0.3 * math.cos(0.4)) ** 2))


def platforms(q: np.ndarray, side: float) -> np.ndarray:
    """Places (n, 3) of a Delta's platform, where three spheres about its elbows meet, below or above these."""
    angles = np.array([0, 2, 4]) * np.pi / 3
    radial = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    turned = (0.4 - q)[..., None]
    one, two, three = np.moveaxis((0.14 + 0.3 * np.cos(turned)) * radial - 0.3 * np.sin(turned) * Z, 1, 0)
    u, v = two - one, three - one
    n = np.cross(u, v)
    nn, uu, vv = ((each * each).sum(-1, keepdims=True) for each in (n, u, v))
    middle = (np.cross(n, u) * vv + np.cross(v, n) * uu) / (2 * nn)
    height = np.sqrt((0.65**2 - (middle * middle).sum(-1, keepdims=True)) / nn)
    return one + middle - side * height * n * np.sign(n[:, 2:])


@pytest.mark.parametrize(
    ("half", "count"), [(0.2, 500), pytest.param(0.8, 10000, marks=pytest.mark.long)], ids=["part", "most"]
)
def test_a_delta_is_where_three_spheres_meet(half, count):
    """With balls, and with three R for each: the same cells, and in their tubes the platform below the elbows alone."""
    box = {f"shoulder_{k}": (-half, half) for k in (1, 2, 3)}
    one, other = (branch(each, box, max_cells=3000).parts[0] for each in (plain_delta(), of_hinges(plain_delta())))
    assert one.volume_fraction == other.volume_fraction == 1.0
    assert len(one.cells) == len(other.cells)
    q = np.random.default_rng(3).uniform(-half, half, (count, 3))
    for part in (one, other):
        slides = [part.passive.index(f"platform.{k}") for k in (1, 2, 3)]
        below, above = (platforms(q, side) - HOME for side in (1.0, -1.0))
        for at, is_here, is_elsewhere in zip(q, below, above, strict=True):
            cell = part.find(at)
            assert cell is not None
            assert np.all(np.abs(is_here - cell.at(at)[slides]) <= cell.radius[slides] + 1e-12)
            assert np.any(np.abs(is_elsewhere - cell.at(at)[slides]) > cell.radius[slides])


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
def test_tilted_robots_of_hinges_follow_small_steps(seed):
    """Balls as three R, the robot in any direction: closures followed by small steps lie in the tubes of all joints."""
    rng = np.random.default_rng(seed)
    X = np.eye(4)
    X[:3, :3] = random_rotation(rng)
    robot = plain_delta()
    turned = replace(
        robot,
        links={name: replace(link, pose=X @ link.pose) for name, link in robot.links.items()},
        joints={
            name: replace(joint, point=X[:3, :3] @ joint.point, axes=tuple(X[:3, :3] @ axis for axis in joint.axes))
            for name, joint in robot.joints.items()
        },
    )
    proof = branch(of_hinges(turned), {f"shoulder_{k}": (-0.02, 0.02) for k in (1, 2, 3)}, max_cells=10)
    (part,) = proof.parts
    assert part.volume_fraction == 1.0
    assert part.unsure == ()
    assert obeys(proof, rng, 1, 3) == 3


def test_a_time_limit_ends_with_what_is_proved():
    """The first cells count; the limits of cells alone give more."""
    short, long = (branch("rrrrr_m1", max_cells=130, time_limit=limit).parts[0] for limit in (0.0, None))
    assert 0.0 < short.volume_fraction < long.volume_fraction
    assert connected(short)


def follow(robot: Mechanism, places: np.ndarray) -> np.ndarray:
    """The elbows at motors (n, 2) by small Newton steps of Pinocchio's loops from zero, not by the proof."""
    found = check(robot, at=[{"motors": q} for q in places.tolist()]).postures
    return np.array([[each.coordinates.joints[name] for name in ("elbow_1", "elbow_2")] for each in found])


@pytest.mark.slow
@pytest.mark.parametrize(("low", "high"), [(-0.1, 0.12), (-0.02, 0.3)])
def test_the_safe_box_keeps_limits_up_to_one_of_them(low: float, high: float):
    """Corners and random motors of the box are within the limits; a little beyond a side a joint passes one."""
    free = load("rrrrr_m1")
    elbows = [replace(free.joints[name], limits=Limits(low, high)) for name in ("elbow_1", "elbow_2")]
    found = branch(free.changed(joints=elbows), {"shoulder_1": (-0.3, 0.3), "shoulder_2": (-0.3, 0.3)})
    box, whole = np.array(found.safe_box), np.array(found.proved)
    assert np.all((whole[0] <= box[0]) & (box[0] < 0) & (box[1] > 0) & (box[1] <= whole[1]))
    corners = np.array(np.meshgrid(*box.T)).reshape(2, -1).T
    values = follow(free, np.concatenate([corners, np.random.default_rng(0).uniform(*box, (20, 2))]))
    assert np.all((values >= low - 1e-9) & (values <= high + 1e-9))
    stopped = [side for side in np.ndindex(2, 2) if box[side] != whole[side]]
    assert stopped
    for side, k in stopped:
        beyond = corners.copy()
        beyond[:, k] = box[side, k] + (-1, 1)[side] * 0.02
        values = follow(free, beyond)
        assert values.min() < low or values.max() > high


def test_without_limits_the_safe_box_is_the_proved_one():
    found = branch("rrrrr_m1", {"shoulder_1": (-0.1, 0.1), "shoulder_2": (-0.1, 0.1)})
    np.testing.assert_array_equal(found.safe_box, found.proved)
    assert found.to_dict()["safe_box"] == [[-0.1, -0.1], [0.1, 0.1]]
