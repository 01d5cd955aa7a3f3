"""Lines of the table: Mᵀ and error maxima of many poses against NumPy written for one robot, and how they grow.

    python benchmarks/sweeps.py POSES

prints the time and the memory of one sweep.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import by_hand
import numpy as np
from measure import Row, Run, compare, compiled, least, plane, same, threads

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.engine import Batch
from hrsynth.batch.error_bounds import bound_errors
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel

CONE = 0.002
LOOPED = 300
"""Poses of the loop over Pinocchio, which is too slow for all."""


def exact_maxima() -> Iterator[Row]:
    setup, batch = compiled("quattro")
    phi = 0.2
    X = plane(batch, 0.25, phi)
    x, y, z = np.ascontiguousarray(X[:, :3, 3].T)
    angles, legs = np.full(len(X), phi), ("1", "4")

    def hand() -> tuple[Array, Array]:
        return by_hand.maxima(by_hand.quattro(x, y, z, angles, (0, 3)), CONE)

    def tuned() -> tuple[Array, Array]:
        return by_hand.maxima_tuned(by_hand.quattro(x, y, z, angles, (0, 3)), CONE)

    def ours(quick: bool) -> Run:
        return lambda: batch.evaluate(X, legs, CONE, compiled=quick)

    found = batch.evaluate(X, legs, CONE, compiled=True)
    assert found.position is not None
    assert found.orientation is not None
    for theirs in (hand(), tuned()):
        same(found.position.largest, theirs[0], 1e-4)
        same(found.orientation.largest, theirs[1], 1e-4)
    numba, plain, by, own = least(ours(True), ours(False), hand, tuned)
    question = replace(
        setup.all_samples.observation_model,
        observations=tuple(o for o in setup.all_samples.observation_model.observations if o.leg in legs),
    )
    assert setup.placer is not None
    some = [at for at in setup.placer.configurations(X[:: len(X) // LOOPED]) if at is not None]
    model = PinocchioModel(setup.mechanism)
    basis = batch.coordinates.twists

    def loop() -> None:
        found = []
        for at in some:
            here = ClosedConfiguration(model, at.q, at.residual)
            rows, loops = question.rows(here), model.jacobian(at.q)
            wanted = np.vstack([np.zeros((len(loops), basis.shape[1])), basis])
            rates = np.linalg.lstsq(np.vstack([loops, rows[:6]]), wanted, rcond=1e-9)[0]
            found.append(rows[6:] @ rates)
        bound_errors(np.array(found).transpose(1, 2, 0), basis, np.full(2, CONE))

    (looped,) = least(loop, turns=3)
    what = "Mᵀ and both exact error maxima, quattro, two legs, 40,401 poses"
    linear = "NumPy for this robot, `linalg`"
    mine = "NumPy for this robot, eigenvalues in closed form"
    yield compare("numba", what, numba, linear, by, len(X))
    yield compare("NumPy", what, plain, linear, by, len(X))
    yield compare("numba", what, numba, mine, own, len(X))
    yield compare("NumPy", what, plain, mine, own, len(X))
    yield compare("numba", what, numba, "a loop over Pinocchio", looped, len(X), len(some))
    yield compare("NumPy", what, plain, "a loop over Pinocchio", looped, len(X), len(some))
    with threads(cores := len(os.sched_getaffinity(0))):
        numba, own = least(ours(True), tuned, clock=time.perf_counter)
    yield compare(f"numba, {cores} threads, by the clock", what, numba, mine, own, len(X))


def matrices() -> Iterator[Row]:
    """Mᵀ alone, against NumPy for each robot."""
    cases = (
        ("quattro_rigid", 0.2, ("1", "3"), rigid),
        ("gough_stewart", 0.1, ("1", "3", "5"), pods),
        ("orthoglide", 0.1, ("1", "2"), glide),
        ("3rrr_m1", 0.05, ("1", "2", "3"), planar),
    )
    for robot, size, legs, hand in cases:
        setup, batch = compiled(robot)
        X = plane(batch, size, 0.1 if batch.coordinates.rotations.shape[1] else 0.0)
        theirs = hand(setup, X, legs)
        M = batch.evaluate(X, legs, compiled=True).interaction_matrix
        same(np.linalg.norm(M, axis=(1, 2)), np.linalg.norm(theirs() * units(batch, theirs()), axis=(1, 2)), 1e-9)
        numba, plain, by = least(
            lambda b=batch, X=X, legs=legs: b.evaluate(X, legs, compiled=True),
            lambda b=batch, X=X, legs=legs: b.evaluate(X, legs, compiled=False),
            theirs,
        )
        what = f"Mᵀ alone, {robot}, {len(legs)} legs"
        yield compare("numba", what, numba, "NumPy for this robot", by, len(X))
        yield compare("NumPy", what, plain, "NumPy for this robot", by, len(X))


def units(batch: Batch, M: Array) -> Array:
    """Columns per metre become columns per characteristic length."""
    shifts = batch.coordinates.translations.shape[1]
    return np.where(np.arange(M.shape[2]) < shifts, batch.length, 1.0)


def rigid(setup: ObservedRobot, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    x, y, z = np.ascontiguousarray(X[:, :3, 3].T)
    return lambda: by_hand.quattro_rigid(x, y, z, (int(legs[0]) - 1, int(legs[1]) - 1))


def pods(setup: ObservedRobot, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    joints, home = setup.mechanism.joints, setup.motion.home
    base = np.array([joints[f"shoulder_{leg}"].point for leg in legs])
    tips = (np.array([joints[f"wrist_{leg}"].point for leg in legs]) - home[:3, 3]) @ home[:3, :3]
    p, R = np.ascontiguousarray(X[:, :3, 3]), np.ascontiguousarray(X[:, :3, :3])
    return lambda: by_hand.pods(p, R, base, tips)


def glide(setup: ObservedRobot, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    P = np.ascontiguousarray(X[:, :3, 3])
    return lambda: by_hand.orthoglide(P, 0.31, 0.04, tuple(int(leg) - 1 for leg in legs))


def planar(setup: ObservedRobot, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    mechanism, home = setup.mechanism, setup.motion.home
    chains = [[mechanism.joints[name].point for name in setup.decomposition.leg(leg).joints] for leg in legs]
    base, elbows, ends = (np.array([chain[i] for chain in chains]) for i in range(3))
    tips = ((ends - home[:3, 3]) @ home[:3, :3])[:, :2]
    cranks, rods = np.linalg.norm(elbows - base, axis=1), np.linalg.norm(ends - elbows, axis=1)
    sides = np.sign(np.cross(ends - base, elbows - base)[:, 2])
    p = np.ascontiguousarray(X[:, :2, 3])
    phi = np.arctan2(X[:, 1, 0], X[:, 0, 0])
    return lambda: by_hand.planar(p, phi, base[:, :2], tips, cranks, rods, sides)


def other_twists() -> Iterator[Row]:
    """Robots whose platform has other twists at each pose, or carries a link that slides on it, beside one whose twists
    are the same everywhere."""
    _, six = compiled("gough_stewart")
    X = plane(six, 0.1)
    for robot in ("3rps", "rrrrr_m1", "rprpr_m1", "prrrp_m1", "i4l"):
        setup, batch = compiled(robot)
        walk = [at.pose(setup.mechanism.platform) for at in setup.configurations]
        poses = np.resize(np.array(walk), X.shape)
        slides = None
        if batch.slides:
            far = [
                [
                    at.model.difference(at.model.q0, at.q)[at.model.coordinates[name][0]] * at.model.length
                    for name in batch.slides
                ]
                for at in setup.configurations
            ]
            slides = np.resize(np.array(far), (len(X), len(batch.slides)))
        given = {"slides": slides, "compiled": False}
        found = batch.evaluate(poses, **given)
        assert found.reached[: len(walk)].all()
        u = np.array(
            [[at.pose(each.link)[:3, :3] @ each.direction for each in setup.segments] for at in setup.configurations]
        )
        same(found.directions[: len(walk)], u, 1e-9)
        ours, theirs = least(
            lambda poses=poses, batch=batch, given=given: batch.evaluate(poses, **given),
            lambda: six.evaluate(X, compiled=False),
        )
        why = (
            "on whose platform a link slides, its coordinate given"
            if batch.slides
            else ("whose platform has other twists at each pose")
        )
        yield compare(
            "NumPy",
            f"Mᵀ alone, all legs, {robot}, {why}",
            ours,
            "the Gough-Stewart platform, six legs, NumPy",
            theirs,
            len(X),
        )


def growth() -> Iterator[Row]:
    _, batch = compiled("hexa")
    X = plane(batch, 0.1)
    times = []
    for count in range(2, 7):
        legs = [str(i + 1) for i in range(count)]
        times.append(least(lambda legs=legs: batch.evaluate(X, legs, compiled=True), turns=3)[0])
    yield ("Mᵀ, hexa, 40,401 poses, 2 to 6 legs", ", ".join(f"{1e3 * each:.0f} ms" for each in times), "–", "–")
    cells = [
        subprocess.run(
            [sys.executable, __file__, str(10**power)], capture_output=True, text=True, check=True
        ).stdout.strip()
        for power in range(3, 7)
    ]
    yield "Mᵀ and both exact error maxima, quattro, two legs, 10³, 10⁴, 10⁵, 10⁶ poses", "; ".join(cells), "–", "–"


def swept(count: int) -> None:
    """One sweep of ``count`` poses in parts, with the most memory that it took."""
    _, batch = compiled("quattro")
    rng = np.random.default_rng(0)

    def parts() -> Iterator[Array]:
        for start in range(0, count, 100_000):
            X = np.tile(batch.home, (min(100_000, count - start), 1, 1))
            X[:, :3, 3] += rng.uniform(-0.2, 0.2, (len(X), 3))
            yield X

    start = time.process_time()
    reached = sum(int(each.reached.sum()) for each in batch.sweep(parts(), ["1", "4"], CONE))
    spent = time.process_time() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{spent:.2f} s, {memory:.0f} MB" if reached else "nothing reached")


if __name__ == "__main__":
    swept(int(sys.argv[1]))
