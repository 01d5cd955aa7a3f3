"""Known names, the order of the list, and sentences for cures and rules."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.catalog import load
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import GROUPS
from hrsynth.catalog.known import find_alias, is_called, list_aliases, order, strip_marks
from hrsynth.catalog.site.sentences import RULES, describe_rules, describe_suggestion
from hrsynth.cli import run_command
from hrsynth.rewrite.rules import list_rules as known_rules

CATALOG = Path(__file__).resolve().parents[2] / "catalog"


def records(group: str) -> list[dict[str, object]]:
    return [dict(each) for each in load(CATALOG, group=group)]


@pytest.mark.slow
def test_every_known_robot_is_in_the_catalog_under_its_canonical_word():
    held = {strip_marks(str(each["key"])) for group in GROUPS for each in records(group) if "!" not in str(each["key"])}
    assert set(list_aliases()) <= held
    assert all(str(parse(word)) == word for word in list_aliases())


@pytest.mark.slow
@pytest.mark.parametrize("group", ["planar", "pods", "deltas"])
def test_names_are_found_without_reading_every_word(group: str):
    for each in records(group):
        name = find_alias(str(each["key"]))
        assert is_called(each, "robot") == (name is not None and "robot" in name), each["key"]
        assert is_called(each, "tripod") == (name is not None and "tripod" in name), each["key"]


@pytest.mark.some(0, 2)
@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("Delta", "3(Rt*-2SSt)"),
        ("3-RPS", "3(Rt-Pl*-S)"),
        ("stewart", "6(S-Pl*-S)"),
        ("Hexaglide", "6(Px*-Uyn-S)"),
        ("3-R*RR", "3(Rz*-Rz-Rz)"),
        ("'3(Rz-Rz*-Rz)'", "3(Rz-Rz*-Rz)"),
    ],
)
def test_show_takes_a_name_as_the_search_does(capsys, text: str, word: str):
    assert run_command(["catalog", "show", text.strip("'"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["entry"]["key"] == word
    assert (answer["note"] is None) == text.startswith("'")


@pytest.mark.slow
def test_what_cannot_be_asked_is_refused(capsys):
    for asked in (["show", "nonsense"], ["list", "--modes", "-1"], ["list", "--dof", "-1"]):
        assert run_command(["catalog", *asked]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_tripod_turns_about_two_axes_only_where_p_is_at_right_angles_to_r(seed: int):
    """Hunt's 3-RPS lets each ball move in a plane across the R axis: the three forces that hold the platform are level,
    so that it can rise, and two turns are left. With P oblique to R each ball is on a cone, and three turns are."""
    for word, turns in (("3(Rt-Pk*-S)", 2), ("3(Rt-Pl*-S)", 3)):
        twists = ObservedRobot.of(build_mechanism(parse(word), seed)).all_samples.members[0].relation.twists
        spins = np.linalg.svd(twists[3:])[1]
        assert np.sum(spins > 1e-6) == turns, (word, spins)


def test_a_name_holds_whatever_is_driven_or_watched():
    assert (find_alias("3(Rt*-Pl-S)") or "").startswith("3-RPS tripod")
    assert find_alias("3(Rt*-Pl-S)") == find_alias("3(Rt-Pl*-S)")
    assert find_alias("(Rz!-Rz-Rz*)+2(Rz*!-Rz-Rz)") == "planar 3-RRR robot"
    assert find_alias("3(Rz-Rz*-Ph)") is None


def test_known_robots_come_first_then_those_with_equal_legs():
    words = ("(Rz*-Rz-Rz)+2(Ph*-Rz-Rz)", "3(Ph*-Pj-Rz)", "3(Rz*-Rz-Rz)", "3(Ra*!-Rb-Ra-Ph)")
    facts = [{"key": word, "base_motors": True, "verdict": "controllable"} for word in words]
    facts[3]["refused"] = "for some reason"
    assert [each["key"] for each in sorted(facts, key=order)] == [words[k] for k in (2, 1, 0, 3)]


def test_every_rule_has_its_sentence():
    assert {rule.name for rule in known_rules()} <= set(RULES)
    said = list(describe_rules({"steps": ["motors off", "lift 1,2,3", "leg removal 2"]}))
    assert said[1].startswith("A virtual chain that constrains nothing is added to legs 1, 2 and 3;")
    assert said[2] == "Without leg 2 the platform and the observed legs move as before: removed."


@pytest.mark.parametrize("group", ["pods", "spatial"])
def test_every_cure_and_every_step_of_the_catalog_is_told_in_sentences(group: str):
    for each in records(group):
        for text in (*describe_rules(each), *filter(None, [describe_suggestion(each)])):
            assert re.fullmatch(r"[A-Z].*\.", text)
            assert "{" not in text
        assert (describe_suggestion(each) is None) == (not each.get("suggestion"))
        for part in re.findall(r"(?:link|rod|joint)_\w+", str(each.get("suggestion", ""))):
            assert f"({part})" in str(describe_suggestion(each))


def test_a_cure_names_what_is_measured_and_where():
    assert describe_suggestion({"dof": 3, "suggestion": "direction link_1_2 and encoder joint_3_1"}) == (
        "Measure the direction of the link after joint 2 of leg 1 (link_1_2) and the encoder of joint 1 of leg 3 "
        "(joint_3_1) as well: this shows all 3 dof."
    )
