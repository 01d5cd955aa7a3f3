"""Accuracy of any observations: the pose at which measurements that are wrong are explained best, found again without
rates, ranks and bounds of the program."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import hrsynth
from hrsynth.analysis.accuracy.accuracy import compute_errors_at
from hrsynth.analysis.accuracy.measurement_bounds import MeasurementBounds
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.errors import BadRequest
from hrsynth.geometry.so3 import convert_rotations_to_vectors
from hrsynth.kinematics.chart import TangentChart
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.mechanism.noise import compute_noise_rates
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations import list_kinds

Array = NDArray[np.float64]

BODY = """<robot name="body"><link name="base"/><link name="platform"/>
  <joint name="free" type="floating"><parent link="base"/><child link="platform"/><origin xyz="0.1 0.05 1.2"/></joint>
  <hrsynth serial="true"><platform link="platform"/></hrsynth></robot>"""
EYE, NOISE = "eye=base@0.3,0.1,-0.4/0.1,0.05,0/800", "0.3px,1mm,0.1deg"
SPOTS = ["0.1,0,0", "-0.1,0.1,0", "0,0.1,0.1", "0.07,-0.1,0.05"]
POINTS = [f"point:platform@{at}" for at in SPOTS]
MORE = {
    "point": POINTS,
    "position": [f"position:platform@{at}" for at in SPOTS[:3]],
    "line": ["line:platform@0.1,0,0/1,0.2,0.1", "line:platform@0,0.1,0/0.1,1,0.3"],
    "image_line": [
        f"image_line:platform@{at}/{axis}"
        for at, axis in zip(SPOTS, ("1,0.2,0.1", "0.1,1,0.3", "0.3,0.1,1", "1,1,0.2"), strict=True)
    ],
    "edge": [
        f"edge:platform@{at}/{axis}/0.02"
        for at, axis in zip(SPOTS, ("1,0.2,0.1", "0.1,1,0.3", "0.3,0.1,1", "1,1,0.2"), strict=True)
    ],
    "edges": ["edges:platform@0.1,0,0/1,0.2,0.1/0.02", "edges:platform@0,0.1,0/0.1,1,0.3/0.02"],
    "circle": ["circle:platform@0.1,0,0/0.2,0.3,1", "point:platform@0,0.2,0"],
    "image_circle": ["image_circle:platform@0.1,0,0/0.6,0.3,1/0.1", "point:platform@0,0.2,0"],
    "depth, distance": [
        *(f"depth:platform@{at}" for at in SPOTS[:3]),
        *(f"distance:platform@{at}" for at in SPOTS[:3]),
        "inclination:platform",
    ],
    "direction": [*(f"direction:platform/{axis}" for axis in ("1,0,0", "0,1,0.2")), "position:platform@0.1,0,0"],
}
MORE["mixture"] = [each[0] for each in MORE.values()]


def robot(name: str, folder: Path) -> ObservedRobot:
    """An arm with a camera in its hand, robots of fewer freedoms, a body that nothing holds, with a set of ``MORE``."""
    if name == "arm":
        spots = ("0.5,0.1,0", "0.6,0.1,0.1", "0.5,0.3,0.1", "0.4,0.1,0.2")
        return ObservedRobot.of(
            "example:panda",
            camera="hand=panda_hand@0,0,-0.3/0,0,0/800",
            samples=3,
            sensor=[*(f"point:world@{at}" for at in spots), "distance:world@0.5,0.1,0"],
        )
    if name == "delta":
        return ObservedRobot.of(
            "delta", "1", EYE.replace("-0.4/", "-1.5/"), samples=3, sensor=[POINTS[0], "depth:platform@0.1,0,0"]
        )
    if name == "encoders":
        return ObservedRobot.of("3rrr_m1", "1", samples=3, sensor=["encoder:shoulder_1", "encoder:shoulder_2"])
    (folder / "body.urdf").write_text(BODY)
    return ObservedRobot.of(folder / "body.urdf", camera=EYE, sensor=MORE[name], samples=3)


def values(at: ClosedConfiguration, observed: tuple[Observation, ...], reference: str) -> list[Array]:
    return [o.value(at.pose(o.seen_from or reference), at.pose(o.link)) for o in observed]


def scales(setup: ObservedRobot) -> list[Array]:
    return [setup.all_samples.model.length ** np.broadcast_to(o.dimension, o.size) for o in setup.observed]


def explained(setup: ObservedRobot, at: ClosedConfiguration, wrong: list[Array]) -> ClosedConfiguration:
    """The configuration that explains values best: least squares of the errors that a loop feeds back, by Gauss and
    Newton with differences, over the motions of the loops."""
    observed, reference = setup.observed, setup.mechanism.reference
    chart = TangentChart.around(at, setup.samples.observation_model)
    unit = scales(setup)

    def errors(y: Array) -> Array:
        found = values(chart.at(y, at.q), observed, reference)
        return np.concatenate([o.error(v / u, w / u) for o, v, w, u in zip(observed, found, wrong, unit, strict=True)])

    y = np.zeros(chart.basis.shape[1])
    for _ in range(4):
        steps = 1e-5 * np.eye(len(y))
        slope = np.array([(errors(y + step) - errors(y - step)) / 2e-5 for step in steps]).T
        y = y - np.linalg.lstsq(slope, errors(y), rcond=1e-9)[0]
    return chart.at(y, at.q)


def moved(setup: ObservedRobot, at: ClosedConfiguration, there: ClosedConfiguration) -> tuple[Array, Array]:
    """The platform's displacement: of its point (m), its turn (rad)."""
    motion = setup.motion
    X, Y = (each.pose(motion.link) for each in (at, there))
    turn = convert_rotations_to_vectors(Y[:3, :3] @ X[:3, :3].T) if motion.body else np.zeros(3)
    return motion.position(Y) - motion.position(X), turn


def shocks(blur: MeasurementBounds, setup: ObservedRobot, at: ClosedConfiguration, way: Array) -> Array:
    """The random vectors (k, 2, 3) of a way (balls, 3)."""
    found = np.zeros((len(setup.observed), 2, 3))
    for (i, number), each in zip(blur.at(at, setup.samples.observation_model).balls, way, strict=True):
        found[i, number] = each / (blur.cones[i] or 1.0)
    return found


def sensed(setup: ObservedRobot, blur: MeasurementBounds, at: ClosedConfiguration, given: Array) -> list[Array]:
    """What the simulated sensors give for random vectors."""
    true = values(at, setup.observed, setup.mechanism.reference)
    every = enumerate(zip(setup.observed, true, given, strict=True))
    return [o.sense(value, shock, blur.own(i, o)) for i, (o, value, shock) in every]


SLOW = pytest.mark.slow


@pytest.mark.some(1, 4)
@pytest.mark.parametrize(
    "name",
    [*(pytest.param(name, marks=SLOW) for name in (*MORE, "delta", "arm") if name != "point"), "point", "encoders"],
)
def test_no_wrong_measurement_does_worse_and_the_told_one_does_it(name: str, tmp_path: Path) -> None:
    """The law: to first order the largest error over all noise is the told one, between its bounds."""
    setup = robot(name, tmp_path)
    at = setup.all_samples.start
    units = sorted(frozenset().union(*(o.found_by for o in setup.observed)))
    noise = ",".join({"px": "0.003px", "m": "0.01mm", "rad": "0.001deg"}[unit] for unit in units)
    blur = MeasurementBounds.of(None, noise, setup.observed)
    errors = compute_errors_at(setup, blur, at)
    rng = np.random.default_rng(2)
    tries = rng.normal(size=(12, len(setup.observed), 2, 3))
    tries /= np.linalg.norm(tries, axis=3, keepdims=True)
    off = [moved(setup, at, explained(setup, at, sensed(setup, blur, at, each))) for each in tries]
    for part, told in enumerate((errors.position, errors.orientation)):
        sizes = [float(np.linalg.norm(each[part])) for each in off]
        assert max(sizes) <= told.largest * (1 + 1e-3) + 1e-12
        if told.errors is None:
            assert max(sizes) < 1e-9
            continue
        worst = shocks(blur, setup, at, told.errors)
        reached = moved(setup, at, explained(setup, at, sensed(setup, blur, at, worst)))[part]
        assert told.largest * (1 - told.gap - 2e-3) <= np.linalg.norm(reached) <= told.largest * (1 + 1e-3)
        assert told.direction is not None
        assert abs(reached @ told.direction) == pytest.approx(np.linalg.norm(reached), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["point", "mixture"])
def test_a_loop_whose_sensors_are_wrong_all_along_comes_to_rest_within_the_bound(name: str, tmp_path: Path) -> None:
    setup, pose = robot(name, tmp_path), "x=0.1,y=0.05,z=1.2,rpy=0/0/0"
    start = "x=0.12,y=0.03,z=1.25,rpy=0.02/0.01/0.03"
    noise = "0.3px" if name == "point" else NOISE
    (errors,) = hrsynth.accuracy(setup, noise=noise, at=pose).poses
    for seed in range(3):
        found = hrsynth.servo(setup, start=start, goal=pose, noise=noise, bias=True, seed=seed)
        X = found.run.last.pose("platform")
        off = float(np.linalg.norm(X[:3, 3] - np.array([0.1, 0.05, 1.2])))
        assert 0.01 * errors.position.largest < off < errors.position.largest * 1.02
        turn = float(np.linalg.norm(convert_rotations_to_vectors(X[:3, :3])))
        assert 0.01 * errors.orientation.largest < turn < errors.orientation.largest * 1.02


@pytest.mark.slow
def test_samples_of_true_errors_approach_the_maxima(tmp_path: Path) -> None:
    found = hrsynth.accuracy(robot("mixture", tmp_path), noise="0.03px,0.1mm,0.01deg", nonlinear=6)
    (errors,), (true,) = found.poses, found.sampled
    assert true is not None
    assert not true.missed
    for reached, told in ((true.position, errors.position), (true.orientation, errors.orientation)):
        assert (1 - told.gap - 1e-2) * told.largest < reached < told.largest * 1.01


def test_cones_of_directions_are_their_noise(tmp_path: Path) -> None:
    """Said in two ways; and besides other kinds, whose amounts they leave alone."""
    assert (
        hrsynth.accuracy("quattro", "1,4", cone="0.1deg").to_dict()
        == hrsynth.accuracy("quattro", "1,4", noise="0.1deg").to_dict()
    )
    setup = robot("direction", tmp_path)
    one, other = (
        hrsynth.accuracy(setup, **given).poses[0]
        for given in ({"noise": "1mm,0.1deg"}, {"noise": "1mm", "cone": "0.1deg"})
    )
    assert one.position.to_dict() == other.position.to_dict()
    assert one.orientation.to_dict() == other.orientation.to_dict()


def test_a_grid_is_its_single_poses_and_leaves_out_what_is_behind_the_camera(tmp_path: Path) -> None:
    setup = robot("point", tmp_path)
    found = hrsynth.accuracy(setup, noise="0.3px", grid="z=-1:1.4:7")
    assert found.field is not None
    assert found.field.reached.tolist() == [False] * 2 + [True] * 5
    single = hrsynth.accuracy(setup, noise="0.3px", at="z=1.4").poses[0]
    assert single.position.largest == pytest.approx(found.field.position[-1], rel=1e-6)
    with pytest.raises(BadRequest, match="not in front of its camera"):
        hrsynth.accuracy(setup, noise="0.3px", at="z=-1")


@pytest.mark.parametrize(
    ("name", "given", "word"),
    [
        ("point", {}, "the measurement bounds are missing"),
        ("point", {"cone": "0.1deg"}, "applies to directions only"),
        (
            "direction",
            {"cone": "0.1deg"},
            r"--cone bounds directions only; observation \S+ \(position\) has no bound. Add --noise",
        ),
        ("point", {"noise": "1mm"}, "in lengths"),
        ("point", {"noise": "0.3km"}, "not a number"),
    ],
)
def test_what_is_no_amount_is_refused_in_a_line(name: str, given: dict[str, str], word: str, tmp_path: Path) -> None:
    with pytest.raises(BadRequest, match=word) as caught:
        hrsynth.accuracy(robot(name, tmp_path), **given)
    assert len(caught.value.lines()) == 1


@pytest.mark.some(4)
@pytest.mark.parametrize("kind", sorted(set(list_kinds()) - {"encoder"}))
def test_what_a_sensor_makes_of_noise_to_first_order(kind: str, tmp_path: Path) -> None:
    """The images of the unit balls are what the simulated sensor gives, but for the square of the noise."""
    setup = next(
        robot(name, tmp_path) for name, sensor in MORE.items() if any(each.startswith(f"{kind}:") for each in sensor)
    )
    at, rng = setup.all_samples.start, np.random.default_rng(1)
    amounts = {"px": 0.3, "m": 1e-3, "rad": 1e-3}
    seen = next(o for o in setup.observed if o.kind == kind)
    own = {unit: amounts[unit] for unit in seen.found_by}
    (value,) = values(at, (seen,), setup.mechanism.reference)
    for _ in range(20):
        given = rng.normal(size=(2, 3))
        given /= np.linalg.norm(given, axis=1, keepdims=True)
        off = [
            np.linalg.norm(
                seen.sense(value, part * given, own)
                - value
                - sum(A @ (part * s) for A, s in zip(compute_noise_rates(seen, value, own), given, strict=False))
            )
            for part in (1.0, 0.1)
        ]
        assert off[0] < 1e-4
        assert off[1] < 0.011 * off[0] + 1e-11
