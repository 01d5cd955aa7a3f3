"""Architectures are printed and parsed, both ways."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.notation import Architecture, Letter, Style, Word, parse

KNOWN = (
    "4-R*-{2-SS}",
    "R*RR+2-P*RR",
    "{RR|Pi-U*R}-S",
    "2-Pi-{2-U*U}",
    "{R-PP}-U*U",
    "3-PiR*R",
    "PR*RR*P",
    "2-{R-PP}-{2-U*S}+2-R-{2-SS}",
    "{RR-PPP}-U*S",
    "3-UP-{S|RU*}",
    "C*S",
    "6-UP*S",
)

letters = st.builds(Letter, st.sampled_from(["R", "P", "U", "S", "C", "E", "Pi"]), st.booleans())
words = st.lists(letters, min_size=1, max_size=6).map(lambda items: Word(tuple(items)))


@pytest.mark.parametrize("text", KNOWN)
def test_what_is_printed_is_parsed_back(text: str) -> None:
    found = parse(text)
    assert found.ascii == text
    assert parse(found.unicode) == found


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(words, min_size=1, max_size=5))
def test_sums_of_random_legs_survive_both_styles(legs: list[Word]) -> None:
    architecture = Architecture.of(legs)
    assert parse(architecture.ascii) == architecture
    assert parse(architecture.unicode) == architecture
    assert sum(count for count, _ in architecture.terms) == len(legs)


@given(words)
def test_reading_a_leg_from_the_other_end_twice_changes_nothing(word: Word) -> None:
    assert word.reversed().reversed() == word


def test_a_motor_is_underlined() -> None:
    assert parse("3-PiR*R").unicode == "3-ΠR\u0332R"
    assert parse("3-PiR*R").text(Style.LATEX) == r"3-\Pi\underline{\mathrm{R}}\mathrm{R}"


@pytest.mark.parametrize(
    "text", ["", "3-", "3-Q", "R+", "{RR", "{}", "0-RR", "{2-}", "R**R", "{R}", "RR}", "-", "R 3", "{R|}"]
)
def test_what_is_no_architecture_is_refused_with_its_place(text: str) -> None:
    with pytest.raises(BadRequest, match="cannot be read"):
        parse(text)


@pytest.mark.parametrize("name", list_robots())
def test_every_shipped_robot_prints_the_architecture_of_its_table(name: str) -> None:
    from hrsynth.families.table import ROBOTS

    architecture = decompose(reduce_to_normal_form(load(name)).mechanism).architecture()
    assert architecture.ascii == next(robot.architecture for robot in ROBOTS if robot.name == name)
    assert parse(architecture.ascii) == architecture
