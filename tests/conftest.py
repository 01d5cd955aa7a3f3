"""Small matrices are fastest on one thread; the workers of pytest-xdist share the cores. Answers are asked anew in each
test: what one patches is seen."""

import gc
import os
import sys
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

pytest_plugins = ["browser"]

gc.set_threshold(50_000, 20, 50)  # little of what tests make is a circle: to look for some takes a tenth of the time
for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(library, "1")
if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl")  # read when mujoco is imported, whatever file of tests does so first

# no law is about time: on a busy machine an example may take long, or be long in the making
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.fixture(autouse=True, scope="session")
def robots_observed_once() -> None:
    """What a robot was sampled at is kept for all files of a process: of the last 32 a third was drawn again."""
    from hrsynth.analysis import observed

    observed._build_observed_robot = lru_cache(maxsize=300)(observed._build_observed_robot.__wrapped__)


@pytest.fixture(autouse=True)
def nothing_answered_before():
    from hrsynth.analysis.result_cache import clear_results

    clear_results()


@pytest.fixture(autouse=True)
def nothing_said_after_half_a_minute(monkeypatch: pytest.MonkeyPatch):
    """On a busy machine commands tell on standard error what they are at; what they answer is the same."""
    monkeypatch.setattr("hrsynth.cli.progress.PROGRESS_LINE_INTERVAL_S", 1e6)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a law marked ``some(n, m)`` n members, spread over all, are quick, m others slow and the rest long; without m
    all others are slow."""
    laws: dict[tuple[str, int], list[pytest.Function]] = {}
    for item in items:
        mark = item.get_closest_marker("some")
        if mark and isinstance(item, pytest.Function) and not item.get_closest_marker("long"):
            laws.setdefault((item.nodeid.partition("[")[0], *mark.args), []).append(item)
    for (_, count, *slow), members in laws.items():
        free = [item for item in members if not item.get_closest_marker("slow")]
        quick = {free[round(k * (len(free) - 1) / max(count - 1, 1))] for k in range(count)} if free else set()
        others = [item for item in members if item not in quick]
        kept = set(diverse(others, max(*slow, 1))) if slow else set(others)
        for item in others:
            item.add_marker("slow" if item in kept else "long")


def diverse(members: list[Any], count: int) -> list[Any]:
    """So many members, each of the values (of its parameters) that were taken least, spread over all."""
    left = [members[k] for k in sorted(range(len(members)), key=lambda k: k * 0.6180339887 % 1)]
    taken, seen = list[Any](), Counter[tuple[str, int]]()
    while left and len(taken) < count:
        best = min(left, key=lambda item: sum(seen[value] for value in item.callspec.indices.items()))
        left.remove(best)
        taken.append(best)
        seen.update(best.callspec.indices.items())
    return taken


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    """Nothing that is collected is garbage: to look for some takes a third of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
