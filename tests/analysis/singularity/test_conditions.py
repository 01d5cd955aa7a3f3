"""Words and expressions of every shipped robot, and of the leg choices that the theory treats by name."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from analysis.singularity.found import found
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.constraints.condition import _derive_general
from hrsynth.constraints.vector_algebra import load_products, make_vector
from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import invert_pose
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.present.show import text


def planar(kind: str) -> tuple[str, str, str]:
    names = [f"{kind}{i}" for i in "123"]
    a, b, c = ("tau" + name[1:] if kind == "τ" else name for name in names)
    return (
        "planar",
        f"the lines through B1, B2, B3, normal to {', '.join(names)}, meet in a point or are parallel",
        f"det(n, {a}, {b})*dot(B3, {c}) - det(n, {a}, {c})*dot(B2, {b}) + det(n, {b}, {c})*dot(B1, {a})",
    )


def spatial(kind: str, tip: str = "B") -> tuple[str, str, str]:
    names = [f"{kind}{i}" for i in "123"]
    a, b, c = ("tau" + name[1:] if kind == "τ" else name for name in names)
    P, Q, R = (f"{tip}{i}" for i in "123")
    forth = f"dot({a}, -{P} + {Q})*dot({b}, -{Q} + {R})*dot({c}, {P} - {R})"
    back = f"dot({a}, {P} - {R})*dot({b}, -{P} + {Q})*dot({c}, -{Q} + {R})"
    words = (
        f"the planes through {P}, {Q}, {R} normal to {', '.join(names)}, and the plane {P}{Q}{R}, "
        "meet in a point (which may lie at infinity)"
    )
    return "spatial", words, f"{forth} - {back}"


def parallel(kind: str, legs: str, words: str) -> tuple[str, str, str]:
    names = [("tau" if kind == "τ" else kind) + i for i in legs]
    pairs = [f"cross({a}, {b})" for i, a in enumerate(names) for b in names[i + 1 :]]
    return "translations", words, " + ".join(f"dot({pair}, {pair})" for pair in pairs)


def lines(kind: str, legs: str) -> str:
    return ", ".join(kind + i for i in legs)


def always(motion: str, freedoms: str, dof: int, because: str = "") -> tuple[str, str, str]:
    count = freedoms.count(";") + 1
    reason = f", because the P axes {because} are parallel" if because else ""
    return (
        motion,
        (f"always: {count} of {dof} dof never observed: {freedoms} (at the zero configuration){reason}"),
        "0",
    )


def gram(motion: str, words: str, legs: str) -> tuple[str, str, str]:
    return motion, words, f"Determinant({' + '.join(f'J{i}.T*N{i}*J{i}' for i in legs)})"


def flat(kind: str, noun: str) -> tuple[str, str, str]:
    symbol = "tau" if kind == "τ" else kind
    return "translations", f"the {noun} {kind}1, {kind}2 are parallel", f"det(n, {symbol}1, {symbol}2)"


BLIND = always("other", "translation along x; translation along y; rotation about the platform's z axis", 3)
PLANE = always("translations", "translation along x; translation along y", 3)
RAILS = parallel("p", "123", "never: the P axes p1, p2, p3 are constant and not all parallel")
TWO_RAILS = ("translations", "never: the P axes p1, p2 are constant and not parallel", "det(n, p1, p2)")
TANGENTS = parallel("τ", "123", "the tangents τ1, τ2, τ3 are all parallel")
SIX = "some motion of the platform moves every tip Bi along {}i (i = 1, 2, 3, 4, 5, 6)"
HALVES = "the platform's halves can translate, one along e relative to the other, and move every tip Bi along τi"

WHOLE = {
    "3ppr_m1": BLIND,
    "3ppr_m2": BLIND,
    "3prp": PLANE,
    "3rrp": PLANE,
    "3prr_m1": planar("p"),
    "3prr_m2": planar("p"),
    "3rpr_m1": planar("u"),
    "3rpr_m2": planar("u"),
    "3rrr_m1": planar("τ"),
    "3rrr_m2": planar("τ"),
    "3puu": RAILS,
    "linear_delta": RAILS,
    "orthoglide": RAILS,
    "delta": TANGENTS,
    "3ruu": TANGENTS,
    "3upu": parallel("u", "123", "the observed directions u1, u2, u3 are all parallel"),
    "3rps": spatial("u"),
    "6pus": gram("spatial", SIX.format("p"), "123456"),
    "hexa": gram("spatial", SIX.format("τ"), "123456"),
    "gough_stewart": gram("spatial", SIX.format("u"), "123456"),
    "hexaglide": always("spatial", "translation along x", 6, lines("p", "123456")),
    "i4l": always("bodies", "translation along x", 3, lines("p", "1234")),
    "uranesx": always("translations", "translation along z", 3, lines("p", "123")),
    "prrrp_parallel": always("translations", "translation along y", 2, lines("p", "12")),
    "prrrp_parallel_point": always("translations", "translation along y", 2, lines("p", "12")),
    "prrrp_m1": TWO_RAILS,
    "prrrp_m2": TWO_RAILS,
    "quattro": gram("bodies", f"{HALVES} (i = 1, 2, 3, 4)", "1234"),
    "quattro_rigid": parallel("τ", "1234", "the tangents τ1, τ2, τ3, τ4 are all parallel"),
    "rprpr_m1": flat("u", "watched directions"),
    "rprpr_m2": flat("u", "watched directions"),
    "rrrrr_m1": flat("τ", "tangents"),
    "rrrrr_m2": flat("τ", "tangents"),
}


def split_platform(i: str, j: str) -> tuple[str, str, str]:
    words = (
        f"the tangents τ{i}, τ{j} and the direction e, in which the platform's halves move on each other, are "
        "parallel to one plane"
    )
    return "bodies", words, f"det(e, tau{i}, tau{j})"


SOME = {
    ("gough_stewart", "1,2,3"): spatial("u"),
    ("hexa", "1,2,3"): spatial("τ"),
    ("6pus", "1,2,3"): spatial("p"),
    ("hexaglide", "1,2,3"): always("spatial", "translation along x", 6, lines("p", "123")),
    ("delta", "1,2"): parallel("τ", "12", "the tangents τ1, τ2 are parallel"),
    ("quattro", "1,4"): split_platform("1", "4"),
    ("quattro", "1,3"): split_platform("1", "3"),
    **{
        ("quattro_rigid", f"{i},{j}"): parallel("τ", i + j, f"the tangents τ{i}, τ{j} are parallel")
        for i, j in ("12", "14", "23", "34")
    },
    **{
        ("quattro_rigid", f"{i},{j}"): (
            "translations",
            f"the tangents τ{i}, τ{j} are parallel",
            f"det(n, tau{i}, tau{j})",
        )
        for i, j in ("13", "24")
    },
}

REAL = {
    "3rrr_m1": planar("τ"),
    "3rrr_m2": planar("τ"),
    "3rps": spatial("τ"),
    "delta": ("translations", "the directions r1, r2, r3 are parallel to one plane", "det(r1, r2, r3)"),
    "rrrrr_m1": ("planar", "the line B1B2 is normal to τ2", "dot(tau2, -B1 + B2)"),
    "gough_stewart": (
        "spatial",
        f"the lines through {lines('B', '123456')} along {lines('p', '123456')} belong to one linear complex",
        "Determinant(L)",
    ),
}

CASES = {
    **{(name, None, False): each for name, each in WHOLE.items()},
    **{(name, legs, False): each for (name, legs), each in SOME.items()},
    **{(name, None, True): each for name, each in REAL.items()},
}
HEAVY = {"6pus", "hexa", "gough_stewart", "quattro"}
"""Many watched legs: seconds of search for a singular pose."""


def test_the_table_has_every_shipped_robot() -> None:
    assert set(WHOLE) == set(list_robots())


@pytest.mark.some(2, 6)
@pytest.mark.parametrize(
    ("robot", "legs", "real"),
    [
        pytest.param(*case, marks=pytest.mark.slow if case[0] in HEAVY and case[1:] == (None, False) else ())
        for case in CASES
    ],
)
def test_words_and_expression(robot: str, legs: str | None, real: bool) -> None:
    motion, words, expression = CASES[robot, legs, real]
    answer = found(robot, legs, real=real)
    record = answer.to_dict()
    assert answer.pattern.motion == motion
    assert answer.words == words
    assert record["expression"] == expression
    assert record["always"] is words.startswith("always") is (answer.checked is None)
    assert record["never"] is words.startswith("never")
    assert (answer.verdict.rank < answer.verdict.dof) is record["always"]
    if answer.condition is not None:
        assert {str(symbol) for symbol in answer.condition.expression.free_symbols} <= set(record["where"])


def test_with_the_camera_on_the_platform_the_tips_are_the_lower_joints() -> None:
    """docs/pages/theory.md, section 7: the planes go through A_i, and A1A2A3 is the fourth."""
    answer = found("gough_stewart", "1,2,3", camera="platform")
    assert (answer.pattern.motion, answer.words, str(answer.condition.expression)) == spatial("u", "A")
    mechanism = load("gough_stewart")
    for leg in answer.pattern.legs:
        foot = next(joint for joint in mechanism.joints_of(mechanism.base) if joint.name.endswith(leg.label))
        place = invert_pose(mechanism.links[leg.tip.link].pose) @ np.append(foot.point, 1)
        np.testing.assert_allclose(leg.tip.place * mechanism.length, place[:3], atol=1e-12)


def test_signs_come_with_the_order_of_a_triple_product() -> None:
    _, cross, det = load_products()
    a, b, c = map(make_vector, "abc")
    assert det(a, b, c) == det(b, c, a) == det(c, a, b) == -det(b, a, c) == -det(a, c, b) == -det(c, b, a)
    assert cross(a, b) != cross(b, a)


def test_a_condition_without_named_wrenches_defines_its_symbols_and_tells_no_angle():
    """Of a robot whose legs have no named wrenches; with names the angle is told."""
    answer = found("3rrr_m1")
    general = replace(answer, condition=_derive_general(answer.observation_model))
    assert "named wrenches" in text(answer)
    assert "named wrenches" not in text(general)
    for meaning in general.condition.where.values():
        assert set(re.findall(r"\b[A-Z]\b", meaning)) <= general.condition.where.keys(), meaning
    used = " ".join([str(general.condition.expression), *general.condition.where.values()])
    assert general.condition.where.keys() <= set(re.findall(r"\b[A-Za-z]\b", used))


@pytest.mark.slow
def test_a_line_and_a_plane_are_told_by_their_vectors():
    """A translating platform slides along a seen vertical line; its seen distance stays where it is at the camera's
    height."""
    sensor = ["line:platform@0,0,0/0,0,1", "distance:platform@0.1,0,0"]
    answer = singularities("3upu", camera="eye=base@0.3,0,0.3", sensor=sensor, points=100)
    assert answer.words == "z4 is parallel to the plane normal to r5"
    assert answer.examples
    for each in answer.examples:
        assert abs(each.pose.to_dict()["z"] - 0.3) < 1e-6
    both = singularities("3upu", "1", sensor=sensor, points=100)
    assert both.words == "the observed directions u1 and the z axes z4 are parallel, also to the plane normal to r5"


@pytest.mark.some(2, 2)
@pytest.mark.parametrize(
    ("robot", "legs", "moves"),
    [("3rrr_m1", "1,2", True), ("uranesx", "1,2", False), ("3rps", "1,2", True), ("delta", "1", True)],
)
def test_as_many_freedoms_are_lost_everywhere_but_not_the_named_ones(robot: str, legs: str, moves: bool) -> None:
    """At configurations of another walk: what is named is lost at the zero configuration, where the words put it."""
    answer = found(robot, legs)
    count, named = len(answer.verdict.unobserved), np.column_stack([each.twist for each in answer.verdict.unobserved])
    assert answer.words.startswith(f"always: {count} of {answer.verdict.dof} dof never observed: ")
    assert "(at the zero configuration)" in answer.words
    start, scale = answer.setup.all_samples.start, np.repeat([1 / answer.setup.mechanism.length, 1.0], 3)[:, None]
    seen = []
    for at in (start, *walk_randomly(start, 12, seed=8)):
        lost = compute_relation(at, answer.observation_model).unobserved_twists
        lost = np.vstack([lost, np.zeros((6 - len(lost), lost.shape[1]))])
        assert lost.shape[1] >= count
        scaled = scale * named
        seen.append(float(np.linalg.norm(scaled - lost @ (np.linalg.pinv(lost) @ scaled)) / np.linalg.norm(scaled)))
    assert seen[0] < 1e-7
    assert (max(seen) > 1e-3) is moves
