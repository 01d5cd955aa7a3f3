"""Words: canonical, stable, and refused in one line where they say nothing."""

import math
import random
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.catalog.architecture_key import COMPOSITE, ArchitectureKey, LegKey, parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import GROUPS, group, words
from hrsynth.errors import BadRequest
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form


@cache
def listed() -> dict[str, list[str]]:
    return {name: words(name) for name in GROUPS}


@cache
def some(name: str) -> list[str]:
    return random.Random(3).sample(listed()[name], 40)


SMALL_FIRST = [pytest.param(name, marks=pytest.mark.slow) if name in ("planar", "mixed") else name for name in GROUPS]
"""The groups, the largest left to the slow tests."""
ANY = st.deferred(lambda: st.sampled_from([word for name in GROUPS for word in listed()[name]]))


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("name", SMALL_FIRST)
def test_what_is_listed_is_canonical_and_belongs_there(name):
    for text in listed()[name]:
        assert str(parse(text)) == text
        assert group(parse(text)) == name


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL_FIRST)
def test_a_motor_changes_no_leg_s_label(name):
    for word in map(parse, listed()[name]):
        assert (
            tuple(leg.unmoved for leg in word.legs)
            == word.unmoved.legs
            == tuple(leg.unmoved for leg in word.driven.legs)
        )


@pytest.mark.slow
def test_groups_are_as_large_as_their_grammar_says():
    """Sets of k of n legs are (n + k - 1) over k: 11 planar ones, 28 with a parallelogram, 76 that translate, 26
    spherical ones. With a slide first, the rails of a set may be parallel as well."""
    counts = {name: len(found) for name, found in listed().items()}
    planar = [word for word in map(parse, listed()["planar"]) if "Px" not in str(word) and word == word.driven]
    assert len([word for word in planar if len(word.legs) == 4]) == math.comb(11 + 3, 4)
    assert len([word for word in planar if len(word.legs) == 3]) == math.comb(11 + 28 + 2, 3)
    assert counts["mixed"] > math.comb(76 + 2, 3) - 76 + math.comb(26 + 2, 3) - 26
    assert counts["schoenflies"] == 290
    assert min(count for name, count in counts.items() if name != "schoenflies") >= 900, counts


@pytest.mark.slow
@settings(max_examples=200)
@given(ANY, st.randoms(use_true_random=False))
def test_order_of_legs_and_choice_of_names_do_not_count(text, rng):
    word = parse(text)
    bodies = []
    for body in word.bodies:
        renamed = [_renamed(leg, rng) for leg in body]
        rng.shuffle(renamed)
        bodies.append(renamed)
    rng.shuffle(bodies)
    assert str(ArchitectureKey.of(*bodies, platform=word.platform)) == text
    assert parse(str(word)) == word


def _renamed(leg, rng):
    for kind in ("hjm", "abc"):
        to = "".join(rng.sample(kind, 3))
        leg = LegKey(
            tuple(
                joint.__class__(joint.letter, joint.axes.translate(str.maketrans(kind, to)), joint.motor, joint.watched)
                for joint in leg.joints
            )
        )
    return leg


@pytest.mark.some(60)
@pytest.mark.parametrize("name", GROUPS)
@pytest.mark.parametrize("number", range(40))
def test_a_mechanism_has_the_joints_of_its_word(name, number):
    word = parse(some(name)[number])
    drawn = build_mechanism(word)
    decomposition = decompose(reduce_to_normal_form(drawn).mechanism)
    assert decomposition.labels == tuple(str(k + 1) for k in range(len(word.legs)))
    assert sum(joint.is_actuated for joint in drawn.joints.values()) == sum(
        j.motor for leg in word.legs for j in leg.joints
    )
    for number, leg in enumerate(word.legs, start=1):
        chain = [drawn.joints[name].type.value for name in drawn.joints if name.startswith(f"joint_{number}_")]
        assert chain == [joint.letter for joint in leg.joints if joint.letter not in COMPOSITE]


def test_the_same_word_has_the_same_geometry_whatever_is_driven():
    one, other = build_mechanism(parse("3(Rz*-Rz-Rz)")), build_mechanism(parse("3(Rz-Rz*-Rz)"))
    assert [d for d in one.differences(other) if not d.startswith("is_actuated")] == []
    assert build_mechanism(parse("3(Rz*-Rz-Rz)"), attempt=1).differences(one)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("3(Rz*-Qz-Rz)", "Qz"),
        ("3(Rz*-Rzz-Rz)", "Rzz"),
        ("3(Rz*-Rv-Rz)", "v"),
        ("3(Rz*-S*)", "S*"),
        ("3(Rz)", "one joint"),
        ("(Rz*-Rz-Rz)", "number of legs"),
        ("13(Rz*-Rz-Rz)", "13"),
        ("ball:3(Rz*-Rz-Rz)", "ball"),
        ("3Rz", "3Rz"),
        ("bar:4(Rt*-2SSt)", "platform links"),
        ("3(Rz!-Rz!-Rz)", "observed"),
        ("3(Rz-Rz-Rz!)", "platform"),
        ("", "''"),
        ("3(Rn*-S)", "Rn"),
        ("3()", "3()"),
        ("3(Rz*-2SSt*)", "2SSt*"),
        ("0(Rz-Rz)+2(Rz-Rz)", "0"),
        ("3(Pin-Rz-Rz)", "Pin"),
    ],
)
def test_what_is_no_word_is_refused(text, told):
    with pytest.raises(BadRequest) as caught:
        parse(text)
    assert "\n" not in str(caught.value)
    assert told in str(caught.value) or told == "''"


def test_axes_of_a_u_must_be_at_right_angles():
    with pytest.raises(BadRequest, match="right angles"):
        build_mechanism(parse("3(Uxk-Pl*-S)"))
    with pytest.raises(BadRequest, match="other than n or q"):
        build_mechanism(parse("3(Unq-Pl*-S)"))
