"""Rows of the table: assembly modes, loop Jacobian, derivations, exact verdicts and entries of the catalog."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from measure import Row, alone, least, spent

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from hrsynth.analysis.derive import derive
from hrsynth.analysis.exact import get_architecture
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.catalog import load as load_catalog
from hrsynth.catalog import store
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.build import remove_motors
from hrsynth.catalog.entry import build_entry
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import GROUPS
from hrsynth.catalog.query import count
from hrsynth.description import list_robots, load
from hrsynth.description.formats.mjcf.write import write
from hrsynth.errors import HrsynthError
from hrsynth.geometry.ranks import compute_kernel_basis, compute_largest_angle, compute_range_basis
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.locked_twists import set_zero
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.present.text.catalog import format_entries

SYSTEMS, PLATFORMS, EXTERNAL = 12, 20, 3
"""Instances of each family of assembly modes, of platforms with 40 poses, and how many of them msolve is given."""
EVALUATIONS = 2000
"""Evaluations of the loops' Jacobian in a turn, each at a configuration of its own."""
AROUND = 0.1
"""How far these are from the zero configuration (rad, m)."""
GROWTH = (500, 1600, 5000)
"""Keys of the catalog that are computed in one build."""
LIMIT = 0.3
"""Longest time of a query of a SQLite file (s)."""
EXACT, WHOLE, CORES = 12, 3, 2
"""Keys of each group of the catalog: for the exact verdict on each core, and for the whole entry; cores."""


def modes() -> Iterator[Row]:
    """All assembly modes with proof, against Newton's method from 100 starts, which proves nothing, and msolve."""
    from analysis.modes.draws import FAMILIES
    from analysis.modes.laws import installed
    from analysis.modes.newton import solutions
    from hrsynth.solving.platform.solve import solve, solve_by_msolve

    for name in ("spatial, three lines", "spatial, three circles", "planar, three circles"):
        systems = [FAMILIES[name].draw(np.random.default_rng(seed)).system for seed in range(SYSTEMS)]
        what = f"all assembly modes with proof: {name}"
        ours, theirs = least(
            lambda s=systems: [solve(each) for each in s],
            lambda s=systems: [solutions(each, 100, np.random.default_rng(0), real=True, rounds=30) for each in s],
            turns=2,
        )
        yield (
            what,
            f"{1e3 * ours / SYSTEMS:.1f} ms",
            f"Newton, 100 starts, without proof: {1e3 * theirs / SYSTEMS:.1f} ms",
            f"{theirs / ours:.0f}",
        )
        if not installed():
            continue
        few = systems[:EXTERNAL]
        for each in few:
            counts = len(solve(each).modes), len(solve_by_msolve(each).modes)
            if counts[0] != counts[1]:
                raise SystemExit(f"{name}: {counts[0]} modes of ours, {counts[1]} of msolve")
        ours, theirs = least(
            lambda s=few: [solve(each) for each in s], lambda s=few: [solve_by_msolve(each) for each in s], turns=1
        )
        yield (
            what,
            f"{1e3 * ours / EXTERNAL:.1f} ms",
            f"msolve, with the same proof: {1e3 * theirs / EXTERNAL:.0f} ms",
            f"{theirs / ours:.0f}",
        )


def platforms() -> Iterator[Row]:
    """All 40 poses of six-legged platforms with their motors fixed, proved, against msolve, enclosed and proved too."""
    from analysis.modes.draws import dietmaier, spatial
    from analysis.modes.laws import installed
    from hrsynth.solving.platform.solve import solve, solve_by_msolve

    generic = [spatial(np.random.default_rng(seed), "SSSSSS").system for seed in range(PLATFORMS)]
    for what, systems in (("Dietmaier's platform", [dietmaier()]), (f"{PLATFORMS} generic platforms", generic)):
        found = [solve(each, near=False) for each in systems]
        if not all((each.complex, each.complete) == (40, True) for each in found):
            raise SystemExit(f"{what}: not all 40 poses were proved")
        few = systems[:EXTERNAL] if installed() else []
        ours, theirs = least(
            lambda s=systems: [solve(each, near=False) for each in s],
            lambda s=few: [solve_by_msolve(each, near=False) for each in s],
            turns=1,
        )
        each, other = 1e3 * ours / len(systems), 1e3 * theirs / max(1, len(few))
        against = (f"msolve, with the same proof: {other:.0f} ms", f"{other / each:.0f}") if few else ("–", "–")
        yield (f"all 40 poses with proof, motors fixed: {what}", f"{each:.0f} ms each", *against)


def jacobians() -> Iterator[Row]:
    """The Jacobian of the loops of one configuration, in an array of its own: poses, joints' screws and loops are
    brought up to date on both sides at a new configuration each time, nothing else (no contacts, no limits). MuJoCo's
    call makes the loops' errors as well, and at its zero configuration it leaves out sines and products."""
    try:
        import mujoco
    except ImportError:
        return
    for robot in ("quattro", "gough_stewart", "delta"):
        here = set_zero(ObservedRobot.of(load(robot), samples=3).configurations[0])
        robot_model = PinocchioModel(here)
        model = mujoco.MjModel.from_xml_string(write(here).texts[0])
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        data = mujoco.MjData(model)

        qpos = data.qpos

        def theirs(q: Array, model: Any = model, data: Any = data, qpos: Array = qpos) -> Array:
            qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_makeConstraint(model, data)
            return np.array(data.efc_J).reshape(-1, model.nv)

        V = np.zeros((6, model.nv))
        J = theirs(model.qpos0)
        mujoco.mj_jacBody(model, data, V[:3], V[3:], model.body(here.platform).id)
        own = (
            robot_model.velocity(robot_model.q0, here.platform)
            @ compute_kernel_basis(robot_model.jacobian(robot_model.q0))[0]
        )
        other = V @ compute_kernel_basis(J)[0]
        own[:3] *= robot_model.length
        angle = compute_largest_angle(compute_range_basis(own, 1.0)[0], compute_range_basis(other, 1.0)[0])
        if not angle < 1e-5:
            raise SystemExit(f"{robot}: the platform's twists differ by {angle:.2g} rad")
        rng = np.random.default_rng(0)
        places = [
            robot_model.integrate(robot_model.q0, AROUND * rng.normal(size=robot_model.nv)) for _ in range(EVALUATIONS)
        ]
        others = [model.qpos0.copy() for _ in places]
        for q in others:
            mujoco.mj_integratePos(model, q, rng.normal(size=model.nv), AROUND)
        mine, other_time = least(
            lambda model=model, places=places: deque(map(model.jacobian, places), 0),
            lambda theirs=theirs, others=others: deque(map(theirs, others), 0),
        )
        yield (
            f"the loop Jacobian of one configuration, {robot}",
            f"{1e6 * mine / EVALUATIONS:.1f} µs ({' × '.join(map(str, robot_model.jacobian(robot_model.q0).shape))})",
            f"MuJoCo on the written MJCF: {1e6 * other_time / EVALUATIONS:.1f} µs ({' × '.join(map(str, J.shape))})",
            f"{other_time / mine:.1f}",
        )


def derivations() -> Row:
    spent = []
    for robot in list_robots():
        mechanism = load(robot)
        start = time.process_time()
        derive(mechanism)
        spent.append((time.process_time() - start, robot))
    spent.sort()
    middle, slowest = spent[len(spent) // 2][0], spent[-1]
    return (
        "the hidden robot with its equivalence check, each shipped robot, all legs observed",
        f"median {middle:.2f} s, slowest {slowest[0]:.2f} s ({slowest[1]})",
        "nobody's",
        "–",
    )


def catalog() -> Iterator[Row]:
    """Exact verdicts of keys of all groups for given configurations, and whole entries."""
    halves = [
        subprocess.Popen([sys.executable, __file__, str(seed)], stdout=subprocess.PIPE, text=True)
        for seed in range(CORES)
    ]
    rates = [float(half.communicate()[0]) for half in halves]
    yield (
        f"exact verdicts of {CORES * EXACT * len(GROUPS)} architectures of all groups of the catalog, their "
        "configurations given",
        f"{sum(rates):.0f} a second on {CORES} cores, by the clock",
        "nobody's",
        "–",
    )
    words = [word for group in _chosen(0) for word in group[:WHOLE]]
    start = spent()
    refused = sum("refused" in build_entry(word) for word in words)
    rate = len(words) / (spent() - start)
    yield (
        f"whole entries of {len(words)} keys ({refused} refused), drawing, derivation and confirmation included",
        f"{rate:.1f} a second on one core",
        "nobody's",
        "–",
    )
    with TemporaryDirectory() as folder:
        cells = [
            "{:.0f} s, {:.0f} MB".format(
                *alone(
                    [
                        sys.executable,
                        "-m",
                        "hrsynth.cli",
                        "catalog",
                        "build",
                        "planar",
                        "-o",
                        f"{folder}/{count}",
                        "--limit",
                        str(count),
                    ]
                )
            )
            for count in GROWTH
        ]
        yield measure_queries(Path(folder) / "all.sqlite")
    yield f"catalog build planar, the first {', '.join(f'{count:,}' for count in GROWTH)}", "; ".join(cells), "–", "–"


def measure_queries(file: Path) -> Row:
    """Queries of ``catalog list`` on the shipped records in a SQLite file that is written here: time until the printed
    lines are ready."""
    from catalog.stub import QUESTIONS

    kept = store.locate_shipped_folder()
    store.write_tables(file, {group: kept.lines([group], {}) for group in kept.groups()})

    def query(path: Path | None, options: dict[str, Any]) -> str:
        return format_entries(load_catalog(path, **options).records, count(path, **options))

    every = sorted(
        ((least(partial(query, file, options), turns=3)[0], options) for options in QUESTIONS), key=lambda each: each[0]
    )
    ours, options = every[-1]
    (theirs,) = least(partial(query, None, options), turns=1)
    if query(file, options) != query(None, options):
        raise SystemExit(f"{options}: the SQLite file and the lines differ")
    return (
        f"{len(every)} queries of catalog list on {sum(map(kept.count, kept.groups())):,} records in a SQLite "
        f"file; the slowest is {options}",
        f"median {1e3 * every[len(every) // 2][0]:.0f} ms, slowest {1e3 * ours:.0f} ms, "
        f"{sum(each <= LIMIT for each, _ in every)} within {1e3 * LIMIT:.0f} ms",
        f"the slowest by reading all lines: {1e3 * theirs:.0f} ms",
        f"{theirs / ours:.0f}",
    )


def verdicts(seed: int) -> float:
    """Exact verdicts a second, by the clock, of architectures of all groups."""
    settings = [setup for words in _chosen(seed) for setup in _prepared(words)]
    clock = time.perf_counter
    (exact,) = least(lambda: [get_architecture(each).verdict(each.observed) for each in settings], turns=3, clock=clock)
    return len(settings) / exact


def _chosen(seed: int) -> list[list[str]]:
    """Random keys of each group, more than needed."""
    rng = random.Random(seed)
    return [rng.sample(sorted({remove_motors(word) for word in make()}), 3 * EXACT) for make in GROUPS.values()]


def _prepared(words: list[str]) -> Iterator[ObservedRobot]:
    """The first ``EXACT`` of the keys whose robots move."""
    found = 0
    for word in words:
        try:
            setup = ObservedRobot.of(build_mechanism(parse(word).driven), samples=10)
        except HrsynthError:
            continue
        if setup.dof and found < EXACT:
            found += 1
            yield setup


if __name__ == "__main__":
    print(verdicts(int(sys.argv[1])))
