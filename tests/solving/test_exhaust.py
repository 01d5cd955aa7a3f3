"""The box driver: with interval arithmetic by hand as judge no zero is lost, whatever the order, the batch, the budget
and the number of processes are."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.geometry.vectors import Array
from hrsynth.progress import on_progress
from hrsynth.solving.exhaust import AGAIN, SETTLED, Boxes, Exhaustion
from solving.product import FINEST, Product

ROOTS = st.lists(st.integers(-63, 63).map(lambda k: k / 8), min_size=1, max_size=3, unique=True)
BATCHES = st.sampled_from([None, 1, 3, 50])
WHOLE = np.zeros((1, 1)), np.full((1, 1), 8.0)


def spans(boxes: list[Boxes]) -> list[tuple[float, float]]:
    """Intervals, from the lowest on."""
    return sorted((m - h, m + h) for each in boxes for m, h in zip(each[0][:, 0], each[1][:, 0], strict=True))


def given_up(search: Exhaustion) -> list[tuple[float, float]]:
    assert all(np.all(each[-1] == FINEST) for each in search.given_up)
    return spans(search.given_up)


@given(ROOTS, BATCHES, st.integers(1, 400))
def test_no_point_is_lost_and_no_zero_is_settled(roots: list[float], batch: int | None, budget: int):
    """What is settled, given up or waits fills the interval once; where it is settled the sign is that of the factors
    at its middle."""
    judge = Product(roots)
    search = Exhaustion(judge, WHOLE, budget, batch).run()
    settled = [(x - r, x + r) for x, r, _ in judge.proved]
    pieces = sorted([*settled, *given_up(search), *spans([search.waiting])])
    assert (pieces[0][0], pieces[-1][1]) == (-8, 8)
    assert all(one[1] == other[0] for one, other in pairwise(pieces))
    assert all(not any(low <= root <= high for low, high in settled) for root in roots)
    assert all(positive == (np.prod([x - root for root in roots]) > 0) for x, _, positive in judge.proved)
    assert search.judged <= budget
    assert not search.is_settled
    if len(search.waiting[0]):
        assert search.judged == budget if batch else search.judged + len(search.waiting[0]) > budget


@given(ROOTS, BATCHES, BATCHES, st.lists(st.integers(0, 300), max_size=4))
def test_boxes_left_open_do_not_depend_on_the_order(roots: list[float], one: int | None, other: int | None, stops: Any):
    """Nor on how often the search is stopped and goes on."""
    straight = Exhaustion(Product(roots), WHOLE, 10_000, one).run()
    halting = Exhaustion(Product(roots), WHOLE, 10_000, other or 2, urgency=lambda x, r: np.abs(x[:, 0]) - r[:, 0])
    for stop in stops:
        halting.run(stop)
        assert halting.judged <= max(stops)
    halting.run()
    assert given_up(straight) == given_up(halting)
    assert straight.judged == halting.judged
    assert not len(straight.waiting[0])


def test_an_interval_without_zeros_is_settled():
    assert Exhaustion(Product([9.0]), WHOLE, 1).run().is_settled
    assert not Exhaustion(Product([9.0]), WHOLE, 0).run().is_settled


@given(st.integers(1, 60).map(lambda k: k / 8), BATCHES, st.floats(0, 2 * np.pi))
def test_what_narrows_a_box_is_kept(radius: float, batch: int | None, angle: float):
    """Boxes of the plane that a circle x² + y² = r² meets, first narrowed to |x|, |y| ≤ r: each point of it is in one,
    and all others are settled; a mark of each box's origin goes with its halves."""

    def judge(middle: Array, half: Array, mark: Array) -> Boxes:
        assert np.all(np.sign(middle[:, 0]) == mark)
        low, high = np.maximum(middle - half, -radius), np.minimum(middle + half, radius)
        here = np.all(low <= high, axis=1)
        low, high, old, mark = low[here], high[here], half[here], mark[here]
        near, far = np.maximum(np.maximum(low, -high), 0.0), np.maximum(np.abs(low), np.abs(high))
        away = ((near**2).sum(axis=1) > radius**2) | ((far**2).sum(axis=1) < radius**2)
        half = (high - low) / 2
        axis = np.where(half.max(axis=1) < 0.4, FINEST, half.argmax(axis=1))
        narrowed = np.any(half < old, axis=1)
        return (low + high) / 2, half, mark, np.where(away, SETTLED, np.where(narrowed, AGAIN, axis))

    start = np.array([[-4.0, 0.0], [4.0, 0.0]]), np.array([[4.0, 8.0], [4.0, 8.0]]), np.array([-1.0, 1.0])
    search = Exhaustion(judge, start, 100_000, batch).run()
    assert not len(search.waiting[0])
    middle, half, mark = (np.concatenate([each[k] for each in search.given_up]) for k in range(3))
    point = radius * np.array([np.cos(angle), np.sin(angle)])
    assert np.any(np.all(np.abs(middle - point) <= half + 1e-12, axis=1))
    assert np.all(np.abs(np.linalg.norm(middle, axis=1) - radius) <= np.linalg.norm(half, axis=1) + 1e-12)
    assert np.all(np.sign(middle[:, 0]) == mark)


@given(ROOTS, st.integers(1, 5))
def test_the_most_urgent_boxes_come_first(roots: list[float], batch: int):
    """The least lower bound of (x − a)² + … leads to a box that holds the minimum, the mean of the roots."""
    met = list[float]()

    def bound(middle: Array, half: Array) -> Array:
        apart = np.abs(middle - np.array(roots))
        return np.asarray((np.maximum(apart - half, 0.0) ** 2).sum(axis=1))

    def judge(middle: Array, half: Array) -> Boxes:
        met.append(float(bound(middle, half).min()))
        assert np.sort(bound(*search.waiting))[: len(middle)].tolist() == bound(middle, half).tolist()
        return middle, half, np.where(half[:, 0] < 1e-3, FINEST, 0)

    search = Exhaustion(judge, WHOLE, 10_000, batch, urgency=bound)
    while not any(len(each[0]) for each in search.given_up):
        search.run(search.judged + 1)
    (middle, half, _), best = search.given_up[-1], sum(roots) / len(roots)
    least = sum((best - root) ** 2 for root in roots)
    assert met == sorted(met)
    assert bound(middle, half)[0] <= least <= sum((middle[0, 0] - root) ** 2 for root in roots) + 1e-9


def test_boxes_that_do_not_concern_are_not_judged():
    seen = list[Array]()

    def judge(middle: Array, half: Array) -> Boxes:
        seen.append(middle[:, 0])
        return middle, half, np.where(half[:, 0] <= 1.0, SETTLED, 0)

    search = Exhaustion(judge, WHOLE, 100, concerns=lambda x, r: np.asarray(x[:, 0] + r[:, 0] > 3)).run()
    assert search.is_settled
    assert np.concatenate(seen).tolist() == [0, 4, 2, 6, 5, 3, 7]
    assert search.judged == 7


def few_alone(judge: Product, budget: int, jobs: int) -> Exhaustion:
    """A search in which few boxes are judged before the others are shared."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("SERIAL_BOXES_COUNT", 8), ("BOX_PARTS", 3), ("BOXES_A_PART", 10)):
            patch.setattr(f"hrsynth.solving.exhaust.{name}", value)
        return Exhaustion(judge, WHOLE, budget, 4).run_shared(jobs)


@given(ROOTS, st.integers(1, 400))
def test_shared_boxes_are_those_of_one_search(roots: list[float], budget: int):
    alone, shared = Product(roots), Product(roots)
    one, other = Exhaustion(alone, WHOLE, 10_000, 4).run(), few_alone(shared, 10_000, 1)
    assert given_up(one) == given_up(other)
    assert sorted(alone.proved) == sorted(shared.proved)
    assert one.judged == other.judged
    few = few_alone(Product(roots), budget, 1)
    assert few.judged == min(budget, one.judged)
    assert len(few.waiting[0]) > 0 or budget >= one.judged


def test_nothing_depends_on_the_number_of_processes():
    judges = [Product([-3.25, 0.5, 1.125]) for _ in range(2)]
    one, two = (few_alone(judge, 10_000, jobs) for judge, jobs in zip(judges, (1, 2), strict=True))
    assert judges[0].proved == judges[1].proved
    assert [[part.tolist() for part in each] for each in one.given_up] == [
        [part.tolist() for part in each] for each in two.given_up
    ]


def test_progress_tells_what_is_settled_and_what_waits():
    """Half of what is left is settled each time; without a name there is nothing to tell."""

    def judge(middle: Array, half: Array) -> Boxes:
        return middle[-1:], half[-1:], np.zeros(1, dtype=np.intp)

    told = list[str]()
    with on_progress(told.append):
        Exhaustion(judge, WHOLE, 12, 12, stage="halves").run()
        Exhaustion(judge, WHOLE, 12, 12).run()
    assert told[:3] == [
        "halves: 0 % of the space settled, 0 processed of at most 12, 1 waiting",
        "halves: 0 % of the space settled, 1 processed of at most 12, 2 waiting",
        "halves: 50 % of the space settled, 3 processed of at most 12, 2 waiting",
    ]
    assert len(told) == 7
