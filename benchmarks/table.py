"""The table of benchmarks: each line a ratio against another's way, measured in the same run.

    python benchmarks/table.py [docs/pages/batches.md]

Times are the least processor time of several turns, ours and theirs in turn, on one core, after imports and after numba
has compiled. Both sides compute the same thing, which is checked. Without a file the table is printed.
"""

from __future__ import annotations

import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

import by_hand

from hrsynth.analysis.derive import derive
from hrsynth.analysis.setting import Setting, prepare
from hrsynth.description import load, shipped
from hrsynth.kinematics.batch.chain import exponentials
from hrsynth.kinematics.batch.engine import Batch
from hrsynth.kinematics.batch.spread import spreads
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.twin import Twin
from hrsynth.mechanism.vectors import Array

MARKS = re.compile(r"(<!-- generated: benchmarks -->\n).*?(<!-- end -->)", re.DOTALL)
SIDE, TURNS, CONE = 201, 5, 0.002
LOOPED = 300
"""Poses of the loop over Pinocchio, which is too slow for all."""
Row = tuple[str, str, str, str]
Run = Callable[[], object]


def main(arguments: Sequence[str]) -> None:
    rows = [("what", "ours", "theirs", "theirs / ours"), ("---", "---", "---", "---:"), *lines()]
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    if not arguments:
        print(table)
        return
    file = Path(arguments[0])
    text = file.read_text(encoding="utf-8")
    if not MARKS.search(text):
        raise SystemExit(f"{file}: no marks of the table")
    file.write_text(MARKS.sub(lambda match: match[1] + table + match[2], text), encoding="utf-8", newline="\n")


def lines() -> Iterator[Row]:
    yield from exact_maxima()
    yield from matrices()
    yield from modes()
    yield derivations()
    yield from growth()


def least(*runs: Run, turns: int = TURNS) -> list[float]:
    """The least processor time of each run (s), taken in turn."""
    best = [np.inf] * len(runs)
    for run in runs:
        run()
    for _ in range(turns):
        for i, run in enumerate(runs):
            start = time.process_time()
            run()
            best[i] = min(best[i], time.process_time() - start)
    return best


def compiled(robot: str) -> tuple[Setting, Batch]:
    setting = prepare(load(robot))
    assert setting.batch is not None
    return setting, setting.batch


def plane(batch: Batch, size: float, phi: float = 0.0, side: int = SIDE) -> Array:
    """A square of poses around home, turned by phi about z; (side², 4, 4)."""
    steps = np.linspace(-size, size, side)
    X = np.tile(batch.home, (side * side, 1, 1))
    X[:, 0, 3] += np.repeat(steps, side)
    X[:, 1, 3] += np.tile(steps, side)
    X[:, :3, :3] = exponentials(np.array([0.0, 0.0, phi])) @ X[:, :3, :3]
    return X


def same(ours: Array, theirs: Array, tolerance: float) -> None:
    worst = float(np.nanmax(np.abs(ours - theirs)) / np.nanmax(np.abs(theirs)))
    if not worst <= tolerance:
        raise SystemExit(f"the two sides differ by {worst:.2g}, allowed: {tolerance:.2g}")


def told(ours: str, what: str, mine: float, other: str, theirs: float, n: int, m: int | None = None) -> Row:
    rate, their_rate = n / mine, (m or n) / theirs
    return (what, f"{ours}: {spoken(rate)} poses/s", f"{other}: {spoken(their_rate)} poses/s",
            f"{rate / their_rate:.{0 if rate > 20 * their_rate else 1}f}")


def spoken(rate: float) -> str:
    return f"{rate / 1e6:.2f} M" if rate > 1e4 else f"{rate:.0f}"


def exact_maxima() -> Iterator[Row]:
    setting, batch = compiled("quattro")
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
    question = replace(setting.everything.question, observations=tuple(
        o for o in setting.everything.question.observations if o.leg in legs))
    assert setting.placer is not None
    some = [at for at in setting.placer.configurations(X[:: len(X) // LOOPED]) if at is not None]
    twin = Twin(setting.mechanism)
    basis = batch.stage.twists

    def loop() -> None:
        found = []
        for at in some:
            here = ClosedConfiguration(twin, at.q, at.residual)
            rows, loops = question.rows(here), twin.jacobian(at.q)
            wanted = np.vstack([np.zeros((len(loops), basis.shape[1])), basis])
            rates = np.linalg.lstsq(np.vstack([loops, rows[:6]]), wanted, rcond=1e-9)[0]
            found.append(rows[6:] @ rates)
        spreads(np.array(found).transpose(1, 2, 0), basis, np.full(2, CONE))

    (looped,) = least(loop, turns=3)
    what = "Mᵀ and both exact error maxima, quattro, two legs, 40,401 poses"
    linear = "NumPy for this robot, `linalg`"
    mine = "NumPy for this robot, our own method"
    yield told("numba", what, numba, linear, by, len(X))
    yield told("NumPy", what, plain, linear, by, len(X))
    yield told("numba", what, numba, mine, own, len(X))
    yield told("NumPy", what, plain, mine, own, len(X))
    yield told("numba", what, numba, "a loop over Pinocchio", looped, len(X), len(some))
    yield told("NumPy", what, plain, "a loop over Pinocchio", looped, len(X), len(some))


def matrices() -> Iterator[Row]:
    """Mᵀ alone, against NumPy for each robot."""
    cases = (("quattro_rigid", 0.2, ("1", "3"), rigid), ("gough_stewart", 0.1, ("1", "3", "5"), pods),
             ("orthoglide", 0.1, ("1", "2"), glide), ("3rrr_m1", 0.05, ("1", "2", "3"), planar))
    for robot, size, legs, hand in cases:
        setting, batch = compiled(robot)
        X = plane(batch, size, 0.1 if batch.stage.spins.shape[1] else 0.0)
        theirs = hand(setting, X, legs)
        M = batch.evaluate(X, legs, compiled=True).matrix
        same(np.linalg.norm(M, axis=(1, 2)), np.linalg.norm(theirs() * units(batch, theirs()), axis=(1, 2)), 1e-9)
        numba, plain, by = least(lambda b=batch, X=X, legs=legs: b.evaluate(X, legs, compiled=True),
                                 lambda b=batch, X=X, legs=legs: b.evaluate(X, legs, compiled=False), theirs)
        what = f"Mᵀ alone, {robot}, {len(legs)} legs"
        yield told("numba", what, numba, "NumPy for this robot", by, len(X))
        yield told("NumPy", what, plain, "NumPy for this robot", by, len(X))


def units(batch: Batch, M: Array) -> Array:
    """Columns per metre become columns per characteristic length."""
    shifts = batch.stage.shifts.shape[1]
    return np.where(np.arange(M.shape[2]) < shifts, batch.length, 1.0)


def rigid(setting: Setting, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    x, y, z = np.ascontiguousarray(X[:, :3, 3].T)
    return lambda: by_hand.quattro_rigid(x, y, z, (int(legs[0]) - 1, int(legs[1]) - 1))


def pods(setting: Setting, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    joints, home = setting.mechanism.joints, setting.motion.home
    base = np.array([joints[f"shoulder_{leg}"].point for leg in legs])
    tips = (np.array([joints[f"wrist_{leg}"].point for leg in legs]) - home[:3, 3]) @ home[:3, :3]
    p, R = np.ascontiguousarray(X[:, :3, 3]), np.ascontiguousarray(X[:, :3, :3])
    return lambda: by_hand.pods(p, R, base, tips)


def glide(setting: Setting, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    P = np.ascontiguousarray(X[:, :3, 3])
    return lambda: by_hand.orthoglide(P, 0.31, 0.04, tuple(int(leg) - 1 for leg in legs))


def planar(setting: Setting, X: Array, legs: tuple[str, ...]) -> Callable[[], Array]:
    mechanism, home = setting.mechanism, setting.motion.home
    chains = [[mechanism.joints[name].point for name in setting.anatomy.leg(leg).joints] for leg in legs]
    base, elbows, ends = (np.array([chain[i] for chain in chains]) for i in range(3))
    tips = ((ends - home[:3, 3]) @ home[:3, :3])[:, :2]
    cranks, rods = np.linalg.norm(elbows - base, axis=1), np.linalg.norm(ends - elbows, axis=1)
    sides = np.sign(np.cross(ends - base, elbows - base)[:, 2])
    p = np.ascontiguousarray(X[:, :2, 3])
    phi = np.arctan2(X[:, 1, 0], X[:, 0, 0])
    return lambda: by_hand.planar(p, phi, base[:, :2], tips, cranks, rods, sides)


def modes() -> Iterator[Row]:
    """All assembly modes with proof, against Newton's method from 100 starts, which proves nothing."""
    from analysis.modes.draws import FAMILIES
    from analysis.modes.newton import solutions
    from hrsynth.analysis.modes.solve import solve

    for name in ("spatial, three lines", "spatial, three circles", "planar, three circles"):
        systems = [FAMILIES[name].draw(np.random.default_rng(seed)).system for seed in range(12)]
        ours, theirs = least(lambda s=systems: [solve(each) for each in s],
                             lambda s=systems: [solutions(each, 100, np.random.default_rng(0), real=True, rounds=30)
                                                for each in s], turns=2)
        yield (f"all assembly modes with proof: {name}", f"{1e3 * ours / 12:.1f} ms",
               f"Newton, 100 starts, without proof: {1e3 * theirs / 12:.1f} ms", f"{theirs / ours:.0f}")


def derivations() -> Row:
    spent = []
    for robot in shipped():
        mechanism = load(robot)
        start = time.process_time()
        derive(mechanism)
        spent.append((time.process_time() - start, robot))
    spent.sort()
    middle, slowest = spent[len(spent) // 2][0], spent[-1]
    return ("the hidden robot with its certificate, each shipped robot, all legs watched",
            f"median {middle:.2f} s, slowest {slowest[0]:.2f} s ({slowest[1]})", "nobody's", "–")


def growth() -> Iterator[Row]:
    _, batch = compiled("hexa")
    X = plane(batch, 0.1)
    times = []
    for count in range(2, 7):
        legs = [str(i + 1) for i in range(count)]
        times.append(least(lambda legs=legs: batch.evaluate(X, legs, compiled=True), turns=3)[0])
    yield ("Mᵀ, hexa, 40,401 poses, 2 to 6 legs", ", ".join(f"{1e3 * each:.0f} ms" for each in times), "–", "–")
    cells = [subprocess.run([sys.executable, __file__, "--sweep", str(10**power)], capture_output=True, text=True,
                            check=True).stdout.strip() for power in range(3, 7)]
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
    if sys.argv[1:2] == ["--sweep"]:
        swept(int(sys.argv[2]))
    else:
        main(sys.argv[1:])
