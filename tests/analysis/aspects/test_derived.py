"""What a path is certified on is read from the file's joints; what is fitted to samples is never called certified."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from hrsynth.analysis.aspects.leg_forms import LegPattern
from hrsynth.analysis.aspects.path import PathPlanner, is_connected_path
from hrsynth.analysis.aspects.verdicts import SAME, SEPARATED
from hrsynth.closed_forms.legs import ClosedFormLeg
from hrsynth.description import load
from hrsynth.geometry.balls import enclose_intervals
from hrsynth.kinematics.walking import walk_randomly
from strategies import deltas, planar, pods

SHIPPED = (
    "3rrr_m1",
    "3rpr_m1",
    "3prr_m1",
    "rrrrr_m1",
    "rprpr_m1",
    "prrrp_m1",
    "gough_stewart",
    "quattro",
    "quattro_rigid",
    "delta",
    "hexa",
    "3puu",
    "3ruu",
    "orthoglide",
    "uranesx",
)
RANDOM = ("RRR", "RPR", "PRR", "five-bar", "UPS", "R2-SS")


@cache
def aspects_of(name: str) -> PathPlanner:
    rng = np.random.default_rng(len(name))
    if name in ("RRR", "RPR", "PRR"):
        return PathPlanner.of(planar([name] * 3, rng, [{0}] * 3))
    if name == "five-bar":
        return PathPlanner.of(planar(["RRR"] * 2, rng, [{0}] * 2, point=True))
    if name == "UPS":
        return PathPlanner.of(pods(["UPS"] * 6, rng, True), ["1", "2", "3"])
    return PathPlanner.of(deltas(["R"] * 3, ["2-SS"] * 3, rng, True) if name == "R2-SS" else load(name))


def known(aspects: PathPlanner) -> LegPattern:
    assert isinstance(aspects.pattern, LegPattern)
    return aspects.pattern


@pytest.mark.some(2)
@pytest.mark.parametrize("name", [*SHIPPED, *RANDOM])
def test_forms_are_read_from_the_joints_and_hold_at_other_poses(name: str):
    """No form is fitted; at configurations that no form was compared with, tips and what limbs carry are where the
    links are."""
    aspects = aspects_of(name)
    pattern = known(aspects)
    assert pattern.fitted == ()
    for at in walk_randomly(aspects.setup.samples.start, 5, 77):
        p, R = pattern.coordinates.of([at])
        chart = pattern.forms(at)
        for limb, feature in zip(chart.subchains, pattern.carried, strict=True):
            poses = {link: _scaled(at.pose(link), at.model.length) for link in feature.links}
            assert limb.solve(limb.tip.value(p, R), limb.mode)[1] == pytest.approx(feature.value(poses), abs=1e-7)


def _scaled(X: np.ndarray, length: float) -> np.ndarray:
    scaled = X[None].copy()
    scaled[:, :3, 3] /= length
    return scaled


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["RRR", "gough_stewart", "quattro"])
def test_what_is_fitted_is_not_certified(name: str):
    free = aspects_of(name)
    aspects = PathPlanner(free.setup, free.motion, free.structure, free.condition, free.lost)
    pattern = known(free)
    fitted = replace(pattern, subchains=tuple(replace(limb, fitted=limb.label == "2") for limb in pattern.subchains))
    aspects.__dict__["pattern"] = fitted
    met = set()
    for start, goal in pairwise(list(walk_randomly(free.setup.samples.start, 12, 3))):
        told, less = free.join(start, goal), aspects.join(start, goal)
        assert told.verdict == less.verdict
        assert not less.certified
        if told.certified:
            met.add(told.verdict)
            assert "fitted to samples: leg 2" in less.reason
            assert "fitted" not in told.reason
    assert met & {SAME, SEPARATED}


def test_ways_with_a_gap_lead_nowhere():
    """A path must begin and end at the poses asked for, in their working modes, without a gap between its parts."""
    aspects, joined = aspects_of("RRR"), 0
    for start, goal in pairwise(list(walk_randomly(aspects.setup.samples.start, 8, 5))):
        answer = aspects.join(start, goal)
        if answer.verdict != SAME:
            continue
        joined += 1
        readings = [aspects.enclosure(start), aspects.enclosure(goal)]
        p, R = known(aspects).coordinates.of([start, goal])
        ends = (p[0], R[0]), (p[1], R[1])
        assert is_connected_path(answer.segments, *ends, readings)
        assert not is_connected_path(answer.segments, ends[0], (p[1] + 1e-9, R[1]), readings)
        assert not is_connected_path(answer.segments[1:], *ends, readings)
        other = replace(readings[1], forms=readings[1].forms.flipped(0))
        assert not is_connected_path(answer.segments, *ends, [readings[0], other])
    assert joined


@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["RRR", "PRR", "RPR", "gough_stewart", "delta"])
def test_balls_hold_limbs_whose_numbers_were_rounded(name: str):
    """The reserve and what is carried, of limbs with numbers moved by less than 1e-10, lie in the balls."""
    aspects, rng = aspects_of(name), np.random.default_rng(0)
    start = aspects.setup.samples.start
    p, R = known(aspects).coordinates.of([start])
    for limb in aspects.enclosure(start).forms.subchains:
        tip = limb.tip.value(np.array([enclose_intervals(row, row) for row in p]), R.astype(object))
        reserve, carried = limb.solve(tip, limb.mode)
        for _ in range(20):
            near = _moved(limb, rng)
            exact, end = near.solve(near.tip.value(p, R), near.mode)
            assert all(x.overlaps(x * 0 + float(y)) for x, y in zip(np.ravel(reserve), np.ravel(exact), strict=True))
            assert all(x.overlaps(x * 0 + float(y)) for x, y in zip(np.ravel(carried), np.ravel(end), strict=True))


def _moved(limb: ClosedFormLeg, rng: np.random.Generator) -> ClosedFormLeg:
    def off(value):
        return value if value is None else value + 1e-10 * rng.uniform(-1, 1, np.shape(value))

    names = [name for name in ("centre", "axis", "radius", "rod", "aside") if hasattr(limb, name)]
    tip = replace(limb.tip, turned=off(limb.tip.turned), constant=off(limb.tip.constant))
    return replace(limb, tip=tip, **{name: off(getattr(limb, name)) for name in names})
