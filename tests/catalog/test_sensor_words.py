"""Words whose platform is seen: canonical, the legs' mechanism, verdicts of the shipped group against plain screws."""

from __future__ import annotations

import json
import random

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from hrsynth.catalog import load
from hrsynth.catalog.architecture_key import ArchitectureKey, parse, parse_observations
from hrsynth.catalog.entry import build_entry
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import group, words
from hrsynth.catalog.jsonl import format_line
from hrsynth.cli import run_command
from hrsynth.cli.schema import build_schema
from hrsynth.errors import BadRequest
from hrsynth.geometry.so3 import convert_vectors_to_rotations
from hrsynth.geometry.vectors import build_pose
from hrsynth.mechanism import Observation
from hrsynth.mechanism.cameras import CameraObservation
from hrsynth.mechanism.normal import reduce_to_normal_form
from oracle import Oracle

LISTED = words("sensors")


def test_what_is_listed_is_canonical_and_belongs_there():
    for text in LISTED:
        assert str(parse(text)) == text
        assert group(parse(text)) == "sensors"
        assert str(parse(text).unmoved.driven.unseen) == str(parse(text.partition("@")[0]).unmoved.driven)
    assert str(parse("3(Rz*-Rz-Rz)@point+ inclination+point'+2point")) == "3(Rz*-Rz-Rz)@inclination+3point+point'"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("3(Rz*-Rz-Rz)@", "''"),
        ("3(Rz*-Rz-Rz)@3dot", "3dot"),
        ("3(Rz*-Rz-Rz)@0point", "0point"),
        ("3(Rz*!-Rz-Rz)@point", "!"),
        ("3(Rz*-Rz-Rz)@encoder", "encoder"),
        ("3(Rz*-Rz-Rz)@99point", "99point"),
    ],
)
def test_what_is_no_sight_is_refused(text: str, told: str):
    with pytest.raises(BadRequest) as caught:
        parse(text)
    assert "\n" not in str(caught.value)
    assert told in str(caught.value)


def test_sensors_do_not_change_the_mechanism():
    for text in random.Random(5).sample(LISTED, 6):
        word = parse(text)
        seen, plain = build_mechanism(word), build_mechanism(word.unseen)
        assert [each for each in seen.differences(plain) if "observ" not in each and "camera" not in each] == []
        assert seen.joints.keys() == plain.joints.keys()
        assert [o.kind for o in seen.observations] == [each.kind for each in word.seen]
        own = [
            each.camera.name
            for each, symbol in zip(seen.observations, word.seen, strict=True)
            if isinstance(each, CameraObservation) and each.camera is not None and symbol.own
        ]
        assert len(set(own)) == len(own) == sum(symbol.own for symbol in word.seen)


def _rank(rows: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(rows, tol=1e-8))


@pytest.mark.parametrize("text", random.Random(3).sample(LISTED, 12))
def test_screws_without_pinocchio_see_the_same(text: str):
    """At the zero configuration: twists of the platform in maximal coordinates, values a small step along each;
    the rank of the shipped record, of all that is seen and of the smallest sets."""
    found = load(group="sensors")[text]
    built = reduce_to_normal_form(build_mechanism(parse(text), found.get("attempt", 0))).mechanism
    oracle = Oracle(built)
    twists = oracle.relation(oracle.zero(), [], unit_length=1.0)
    X, base = built.links["platform"].pose, built.links["base"].pose
    step = 1e-6

    def slope(seen: Observation, t: np.ndarray) -> np.ndarray:
        ends = [
            build_pose(X[:3, 3] + sign * step * t[:3], convert_vectors_to_rotations(sign * step * t[3:]) @ X[:3, :3])
            for sign in (1, -1)
        ]
        pairs = [(end, base) if (seen.seen_from or "base") == "platform" else (base, end) for end in ends]
        one, other = (seen.value(*each) for each in pairs)
        return (one - other) / (2 * step)

    assert _rank(twists) == found["dof"]
    for labels in [None, *found["minimal"]]:
        seen = [o for o in built.observations if labels is None or o.leg in labels]
        rates = np.array([np.concatenate([slope(each, t) for each in seen]) for t in twists.T])
        assert int(np.linalg.matrix_rank(rates, tol=1e-5)) == found["rank"]


def test_known_answers():
    """Three image points: the danger cylinder, eight modes; fewer freedoms need fewer points; a yaw is never seen by an
    IMU alone."""
    catalog = load(group="sensors")
    three = catalog["6(Utn-Pl*-S)@3point"]
    assert three["verdict"] == "controllable"
    assert "danger cylinder" in three["condition"]
    assert (three["modes_bound"], three["hidden"]) == (8, "3-U*PS")
    assert catalog["6(Utn-Pl*-S)@2point"]["rank"] == 4
    assert catalog["6(Utn-Pl*-S)@inclination"]["rank"] == 2
    assert catalog["3(Rz*-Rz-Rz)@inclination"]["verdict"] == "uncontrollable"
    assert catalog["3(Rz*-Rz-Rz)@2point"]["verdict"] == "controllable"
    asked = load(sensor="3point")
    assert {each["key"].partition("@")[2] for each in asked} == {"3point"}
    assert {each["sensors"] for each in load(sensor="point+point+point")} == {"3point"}
    assert len(load(sensor="3point", verdict="controllable")) >= 5
    assert not any("@" in word for word in load().words)


def test_a_record_is_fresh():
    text = "3(Rz*-Rz-Rz)@2point"
    assert format_line(build_entry(text)) == format_line(load(group="sensors")[text])


def test_the_command_line_lists_and_shows_them(capsys: pytest.CaptureFixture[str]):
    def call(*words: str) -> tuple[int, str]:
        capsys.readouterr()
        return run_command(["catalog", *words]), capsys.readouterr().out

    listed = json.loads(call("list", "--sensor", "3point", "--verdict", "controllable", "--json")[1])
    assert listed["total"] == len(LISTED)
    assert all(each["sensors"] == "3point" for each in listed["entries"])
    Draft202012Validator(build_schema("catalog list")).validate(listed)
    shown = call("show", "6(Utn-Pl*-S)@3point")[1]
    assert "sensors: 3point" in shown
    assert "danger cylinder" in shown
    assert call("list", "--sensor", "3dot")[0] == call("site", "-o", "nowhere", "--group", "sensors")[0] == 2


def test_a_word_is_one_value():
    word = parse("3(Rz*-Rz-Rz)")
    assert ArchitectureKey.of(*map(list, word.bodies), seen=parse_observations("2point")) == parse(
        "3(Rz*-Rz-Rz)@2point"
    )
