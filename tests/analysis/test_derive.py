"""From a robot to its certified hidden robot: what the papers state, and what must hold of every derivation."""

from __future__ import annotations

import io
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

import hrsynth
from hrsynth.analysis.derive import REWRITE_STEP_SAMPLES_COUNT, Derivation, derive
from hrsynth.analysis.observed import GENERIC_SAMPLES_COUNT
from hrsynth.analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism as catalog_mechanism
from hrsynth.description import load, native
from hrsynth.errors import BadRequest, NoEquivalentRobot
from hrsynth.kinematics.equivalence import EquivalenceCheck, check_equivalence
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism.model import JointType
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.rewrite.evidence import Evidence
from hrsynth.rewrite.strategy import SIMPLIFIED, RewriteTrace
from hrsynth.tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, RANK_GAP_MIN, RELATION_ANGLE_TOL
from kinematics.robots import ROBOTS, derived
from oracle import Oracle
from strategies import deltas

PLANE = ("translation along x", "translation along y", "rotation about the platform's z axis")


class Expected(NamedTuple):
    real: str
    hidden: str | None
    dof: int
    mobility: tuple[int, int]
    """Total and idle."""
    lost: tuple[str, ...] = ()


EXPECTED = {
    "rrrrr_m1": Expected("R*RRRR*", "PiR*RR*Pi", 2, (2, 0)),
    "rrrrr_m2": Expected("RR*RR*R", "PiR*RR*Pi", 2, (2, 0)),
    "rprpr_m1": Expected("R*PRPR*", "R*PRPR*", 2, (2, 0)),
    "rprpr_m2": Expected("RP*RP*R", "R*PRPR*", 2, (2, 0)),
    "prrrp_m1": Expected("P*RRRP*", "PR*RR*P", 2, (2, 0)),
    "prrrp_m2": Expected("PR*RR*P", "PR*RR*P", 2, (2, 0)),
    "prrrp_parallel": Expected("P*RRRP*", "PR*RR*P", 2, (2, 0), ("translation along y",)),
    "prrrp_parallel_point": Expected("P*RRRP*", "PR*RR*P", 2, (3, 1), ("translation along y",)),
    "3rrr_m1": Expected("3-R*RR", "3-PiR*R", 3, (3, 0)),
    "3rrr_m2": Expected("3-RR*R", "3-PiR*R", 3, (3, 0)),
    "3rpr_m1": Expected("3-R*PR", "3-R*PR", 3, (3, 0)),
    "3rpr_m2": Expected("3-RP*R", "3-R*PR", 3, (3, 0)),
    "3prr_m1": Expected("3-P*RR", "3-PR*R", 3, (3, 0)),
    "3prr_m2": Expected("3-PR*R", "3-PR*R", 3, (3, 0)),
    "3prp": Expected("3-P*RP", "3-PR*P", 3, (3, 0), PLANE[:2]),
    "3rrp": Expected("3-R*RP", "3-PiR*P", 3, (3, 0), PLANE[:2]),
    "3ppr_m1": Expected("3-P*PR", None, 3, (3, 0), PLANE),
    "3ppr_m2": Expected("3-PP*R", None, 3, (3, 0), PLANE),
    "gough_stewart": Expected("6-UP*S", "6-U*PS", 6, (6, 0)),
    "3upu": Expected("3-UP*U", "3-U*PU", 3, (3, 0)),
    "3rps": Expected("3-RP*S", "3-R*PS", 3, (3, 0)),
    "delta": Expected("3-R*-{2-SS}", "3-Pi-{2-U*S}", 3, (9, 6)),
    "quattro_rigid": Expected("4-R*-{2-SS}", "4-Pi-{2-U*S}", 3, (11, 8)),
    "quattro": Expected("4-R*-{2-SS}", "4-Pi-{2-U*S}", 4, (12, 8)),
    "orthoglide": Expected("3-P*-{2-SS}", "3-P-{2-U*S}", 3, (9, 6)),
    "linear_delta": Expected("3-P*-{2-SS}", "3-P-{2-U*S}", 3, (9, 6)),
    "uranesx": Expected("3-P*-{2-SS}", "3-P-{2-U*S}", 3, (9, 6), ("translation along z",)),
    "i4l": Expected("4-P*-{2-SS}", "4-P-{2-U*S}", 3, (12, 8), ("translation along x",)),
    "3ruu": Expected("3-R*UU", "3-PiU*U", 3, (3, 0)),
    "3puu": Expected("3-P*UU", "3-PU*U", 3, (3, 0)),
    "hexa": Expected("6-R*US", "6-PiU*S", 6, (6, 0)),
    "hexaglide": Expected("6-P*US", "6-PU*S", 6, (6, 0), ("translation along x",)),
    "6pus": Expected("6-P*US", "6-PU*S", 6, (6, 0)),
}


def certified(derivation: Derivation) -> None:
    """The certificate passed, with evidence."""
    certificate = derivation.equivalence
    assert certificate.passed
    assert certificate.samples == GENERIC_SAMPLES_COUNT
    assert certificate.largest_angle < RELATION_ANGLE_TOL
    assert certificate.residual < HIDDEN_ROBOT_RESIDUAL_TOL
    assert certificate.smallest_gap > RANK_GAP_MIN
    assert derivation.verdict.gap > RANK_GAP_MIN
    assert derivation.verdict.rank + len(derivation.verdict.unobserved) == derivation.dof


def emitted(derivation: Derivation) -> None:
    """The hidden robot is a file that others can load, of the real robot's links where they are kept."""
    hidden, setup = derivation.hidden, derivation.setup
    assert hidden is not None
    text = native.write(hidden)
    again = native.parse(text)
    assert again.differences(hidden) == []
    assert hidden.differences(again) == []
    robot_model = PinocchioModel(again)
    assert np.linalg.norm(robot_model.residual(robot_model.q0)) < 1e-12
    assert Oracle(again).error(Oracle(again).zero()) < 1e-11

    model = pin.buildModelFromXML(text)
    assert model.nv == sum(j.type.freedoms for j in hidden.joints.values() if j.in_tree)
    tree = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, build_scene_graph=True)
    assert tree.base_link == hidden.base
    assert hidden.links.keys() <= tree.link_map.keys()
    assert len(tree.robot.joints) == len(tree.robot.links) - 1
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for name, link in hidden.links.items():
        np.testing.assert_allclose(data.oMf[model.getFrameId(name)].homogeneous, link.pose, atol=1e-9)

    real = setup.mechanism
    assert hidden.name == f"{setup.robot.name}_hidden"
    assert (hidden.base, hidden.platform, hidden.reference) == (real.base, real.platform, real.reference)
    for name in hidden.links.keys() & real.links.keys():
        np.testing.assert_array_equal(hidden.links[name].pose, real.links[name].pose)
    assert hidden.platform in real.links
    actuated = [joint for joint in hidden.joints.values() if joint.is_actuated]
    assert actuated
    assert all(joint.name not in setup.robot.joints for joint in actuated)
    assert all(joint.name not in real.joints for joint in actuated)
    assert {joint.type for joint in actuated} <= {JointType.REVOLUTE, JointType.UNIVERSAL}
    assert [(o.leg, o.link) for o in hidden.observations] == [(o.leg, o.link) for o in setup.observed]
    assert {o.leg for o in hidden.observations} <= set(setup.decomposition.labels)
    for mine, theirs in zip(hidden.observations, setup.observed, strict=True):
        assert isinstance(mine, Direction)
        assert isinstance(theirs, Direction)
        assert mine.link in real.links
        np.testing.assert_array_equal(mine.direction, theirs.direction)


def test_every_robot_is_expected() -> None:
    assert set(EXPECTED) == set(ROBOTS)


@pytest.mark.some(2, 8)
@pytest.mark.parametrize("robot", ROBOTS)
def test_all_legs_observed(robot: str) -> None:
    derivation, expected = derived(robot), EXPECTED[robot]
    assert derivation.architecture.ascii == expected.real
    assert derivation.dof == expected.dof
    assert (derivation.mobility.total, derivation.mobility.internal) == expected.mobility
    certified(derivation)
    lost = len(expected.lost)
    assert derivation.verdict.verdict == (CONTROLLABLE if not lost else BLIND if lost == expected.dof else PARTIAL)
    assert tuple(freedom.name for freedom in derivation.verdict.unobserved) == expected.lost
    if expected.hidden is None:
        assert derivation.hidden is None
        assert derivation.hidden_architecture is None
        assert derivation.unchecked is None
        assert "vanishes" in derivation.equivalence.reason
        return
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == expected.hidden
    assert derivation.equivalence.reason == ""
    assert derivation.unchecked is not None
    assert derivation.unchecked.equivalent
    assert derivation.unchecked.hidden == derivation.hidden_architecture
    emitted(derivation)


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["uranesx", "i4l", "hexaglide", "prrrp_parallel", "prrrp_parallel_point"])
def test_translations_along_the_slides_are_lost(robot: str) -> None:
    """Parallel P joints next to the base: no direction changes when all of them move alike (MMT 4.2.3)."""
    derivation = derived(robot)
    rails = [j.axis for j in derivation.setup.mechanism.joints.values() if j.is_actuated]
    (lost,) = derivation.verdict.unobserved
    assert lost.twist.shape == (6,)
    np.testing.assert_allclose(lost.twist[3:], 0, atol=1e-12)
    for axis in rails:
        assert np.linalg.norm(np.cross(lost.twist[:3], axis)) < 1e-9


# --- some of the legs --------------------------------------------------------------------------------------------


def subsets(labels: str, sizes: tuple[int, ...] | None = None) -> list[tuple[str, ...]]:
    return [each for size in sizes or range(1, len(labels) + 1) for each in combinations(labels, size)]


SUBSETS = [
    *(("quattro", each) for each in subsets("1234", (1, 2, 3))),
    *(("quattro_rigid", each) for each in subsets("1234", (1, 2, 3))),
    *(("delta", each) for each in subsets("123", (1, 2))),
    *(("orthoglide", each) for each in subsets("123", (1, 2))),
]
PODS = [("gough_stewart", each) for each in subsets("123456", (2, 3))]
PAIRS = ("2-Pi-{2-U*U}", "2-P-{2-U*U}")
RANKS = {"quattro": (2, 4), "quattro_rigid": (2, 3), "delta": (2, 3), "orthoglide": (2, 3)}


def name(case: object) -> str:
    return "".join(case) if isinstance(case, tuple) else str(case)


@pytest.mark.some(1, 10)
@pytest.mark.parametrize(("robot", "legs"), SUBSETS, ids=name)
def test_every_set_of_legs_is_certified(robot: str, legs: tuple[str, ...]) -> None:
    derivation = derived(robot, legs)
    certified(derivation)
    emitted(derivation)
    one, best = RANKS[robot]
    halves = {"12": 3, "34": 3} if robot == "quattro" else {}
    assert derivation.verdict.rank == (one if len(legs) == 1 else halves.get("".join(legs), best))
    assert derivation.verdict.verdict == (CONTROLLABLE if derivation.verdict.rank == derivation.dof else PARTIAL)
    unchecked = derivation.unchecked
    assert unchecked is not None
    assert unchecked.equivalent or unchecked.gains or unchecked.loses or unchecked.reason
    hidden = derivation.hidden_architecture
    assert hidden is not None
    if len(legs) == 2 and derivation.verdict.verdict == CONTROLLABLE and robot != "quattro_rigid":
        assert hidden.ascii in PAIRS


@pytest.mark.some(0, 9)
@pytest.mark.parametrize(("robot", "legs"), PODS, ids=name)
def test_pairs_and_triples_of_a_pod_are_certified(robot: str, legs: tuple[str, ...]) -> None:
    derivation = derived(robot, legs)
    certified(derivation)
    emitted(derivation)
    hidden = derivation.hidden_architecture
    assert hidden is not None
    if len(legs) == 3:
        assert derivation.verdict.verdict == CONTROLLABLE
        assert hidden.ascii == "3-U*PS"
        return
    assert derivation.verdict.verdict == PARTIAL
    assert derivation.verdict.rank == 4
    assert f"rotation about the line B{legs[0]} B{legs[1]}" in [each.name for each in derivation.verdict.unobserved]
    assert hidden.ascii.startswith("2-U*PS")


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs", "hidden"),
    [
        ("gough_stewart", ("1", "2", "3"), "3-U*PS"),
        ("gough_stewart", ("2", "4", "6"), "3-U*PS"),
        ("quattro", ("1", "4"), "2-Pi-{2-U*U}"),
        ("quattro", ("2", "3"), "2-Pi-{2-U*U}"),
        ("delta", ("1", "3"), "2-Pi-{2-U*U}"),
        ("linear_delta", ("1", "2"), "2-P-{2-U*U}"),
        ("orthoglide", ("2", "3"), "2-P-{2-U*U}"),
    ],
)
def test_architectures_of_the_papers(robot: str, legs: tuple[str, ...], hidden: str) -> None:
    derivation = derived(robot, legs)
    certified(derivation)
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == hidden
    assert derivation.verdict.verdict == CONTROLLABLE
    assert derivation.unchecked is not None
    assert derivation.unchecked.equivalent
    removed = set(derivation.setup.decomposition.labels) - set(legs)
    assert {step.leg for step in derivation.steps if step.rule == "leg removal" and step.accepted} >= removed


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"),
    [
        ("quattro", ("1", "4")),
        ("3rps", ("1", "2")),
        ("3rrr_m1", ("1", "2", "3")),
        ("hexa", ("1", "2", "3")),
        ("orthoglide", ("2", "3")),
    ],
)
def test_steps_are_those_that_are_taken_one_by_one(robot: str, legs: tuple[str, ...]) -> None:
    """The result alone is compared while a hidden robot is found; each step's own angle is measured afterwards."""
    found = derived(robot, legs)
    samples = found.setup.samples
    checked = SIMPLIFIED(
        RewriteTrace.of(
            Evidence(found.setup.decomposition, samples),
            lambda mechanism, bodies: check_equivalence(
                samples, mechanism, count=REWRITE_STEP_SAMPLES_COUNT, bodies=bodies, complete=False
            ),
        )
    )
    assert found.steps == checked.steps
    assert any(step.accepted and step.largest_angle is None and step.rule == "lift" for step in found.taken)


def test_one_leg_of_a_delta_needs_another() -> None:
    """The unchecked form frees the platform: it may turn; a real leg has to stay."""
    derivation = derived("delta", ("1",))
    certified(derivation)
    emitted(derivation)
    unchecked = derivation.unchecked
    assert unchecked is not None
    assert not unchecked.equivalent
    assert unchecked.hidden.ascii == "Pi-{2-U*U}"
    assert unchecked.largest_angle > RELATION_ANGLE_TOL
    assert len(unchecked.gains) == 1
    assert unchecked.gains[0].name.startswith("rotation about")
    assert np.linalg.norm(unchecked.gains[0].twist[3:]) == pytest.approx(1)
    assert unchecked.loses == ()
    assert unchecked.reason
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == "Pi-{2-U*U}+R-{2-SS}"
    assert [step.leg for step in derivation.steps if step.rule == "keep"] == ["3"]
    kept = derivation.hidden
    assert kept is not None
    assert {"arm_3", "rod_3a", "rod_3b"} <= kept.links.keys()
    assert not {"arm_2", "rod_2a", "rod_2b"} & kept.links.keys()


def test_of_proposals_that_were_taken_back_the_first_is_printed() -> None:
    """All are in the record; the text says how many more there were, and has each attempt that counted."""
    derivation = derived("delta", ("1",))
    proposals = [step for step in derivation.steps if step.rule == "end change" and step.discarded]
    printed = str(derivation).splitlines()
    assert len(proposals) > 3
    assert all(not step.accepted and "(discarded: legs remain)" in step.reason for step in proposals)
    assert sum("discarded: legs remain" in line for line in printed) < len(proposals)
    assert [line.split()[2:4] for line in printed if line.startswith("end change")] == [
        ["all", "no"],
        ["all", "no"],
        ["all", "yes"],
    ]
    assert f"{len(proposals) - 1} more proposals, also discarded" in " ".join(" ".join(printed).split())
    assert any(line.startswith("keep ") for line in printed)


def test_two_legs_of_3upu_need_the_third() -> None:
    derivation = derived("3upu", ("1", "2"))
    certified(derivation)
    emitted(derivation)
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == "2-U*PU+UPU"
    unchecked = derivation.unchecked
    assert unchecked is not None
    assert not unchecked.equivalent
    assert unchecked.hidden.ascii == "2-U*PU"
    assert [freedom.name.split(" about ")[0] for freedom in unchecked.gains] == ["rotation"]
    assert unchecked.loses == ()
    keep = [step for step in derivation.steps if step.rule == "keep"]
    assert [step.leg for step in keep] == ["3"]
    refused = [step for step in derivation.steps if step.rule == "leg removal" and not step.accepted]
    assert refused
    assert all("refused" in step.reason for step in refused)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("seed", [0, 3])
def test_unobserved_legs_near_a_fold(seed: int) -> None:
    """A sample at which the robot cannot follow itself, for want of the directions of the other legs, is no sample."""
    robot = deltas(["R", "R", "P"], ["2-SS"] * 3, np.random.default_rng([seed, 17]), False)
    derivation = derive(robot, ["1", "2"])
    assert derivation.hidden is not None
    certified(derivation)


def test_nothing_is_answered_without_a_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where even the lift is refused no leg is called blind."""
    refused = EquivalenceCheck(3, 0, 1.0, 1e9, 0.0, False, "refused")
    monkeypatch.setattr("hrsynth.analysis.derive.check_equivalence", lambda *args, **options: refused)
    with pytest.raises(NoEquivalentRobot) as caught:
        derive(load("3rrr_m1"))
    assert caught.value.exit_status == 3


# --- other segments, other cameras, other forms ------------------------------------------------------------------


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "observe", "camera"),
    [
        ("gough_stewart", ("1", "2", "3"), "platform"),
        ("delta", None, "platform"),
        ("delta", None, "arm_1"),
        ("delta", ("1", "2"), "rod_3a"),
        ("3rrr_m1", None, "platform"),
    ],
)
def test_a_camera_on_any_link(robot: str, observe: tuple[str, ...] | None, camera: str) -> None:
    derivation = derived(robot, observe, camera)
    certified(derivation)
    emitted(derivation)
    assert derivation.hidden is not None
    assert derivation.hidden.reference == camera
    assert derivation.to_dict()["camera"] == camera


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "observe"),
    [
        ("delta", ("arm_1", "rod_2a")),
        ("delta", ("rod_1b", "2")),
        ("delta", ("arm_1", "arm_2", "arm_3")),
        ("quattro", ("rod_1a", "rod_1b", "4")),
        ("3rrr_m1", ("1", "2", "3")),
        ("delta", ("arm_1", "rod_1a", "2")),
    ],
)
def test_other_segments(robot: str, observe: tuple[str, ...]) -> None:
    derivation = derived(robot, observe)
    certified(derivation)
    emitted(derivation)
    links = {o.link for o in derivation.setup.observed}
    assert {each for each in observe if not each.isdigit()} <= links
    assert len(links) == len(observe)


@pytest.mark.some(1)
@pytest.mark.parametrize("observe", ["link_2_1,link_2_2", "link_2_2,link_2_1", "link_1_1,link_1_2,link_2_1,3"])
@pytest.mark.parametrize("form", ["simplified", "general"])
def test_two_links_that_a_slide_joins_are_both_watched(observe: str, form: str) -> None:
    """They have one direction and one joint before them, which is taken over once; the second adds nothing."""
    robot = catalog_mechanism(parse("3(Ra*-Ph-Ra-Ra)"))
    found = derive(robot, observe, form=form)
    certified(found)
    fewer = [name for name in observe.split(",") if not name.endswith("_2")]
    assert found.verdict.rank == derive(robot, fewer, form=form).verdict.rank


def test_encoders_made_visible() -> None:
    """Where the arms of a Delta are observed its hidden robot is the Delta itself: the angles of its motors."""
    derivation = derived("delta", ("arm_1", "arm_2", "arm_3"))
    assert derivation.verdict.verdict == CONTROLLABLE
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == "3-R*-{2-SS}"


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "hidden"),
    [
        ("delta", "3-{R-PP}-{2-U*S}"),
        ("3rrr_m1", "3-{R-PP}-R*R"),
        ("quattro", "4-{R-PP}-{2-U*S}"),
        ("3upu", "3-U*PU"),
        ("orthoglide", "3-P-{2-U*S}"),
    ],
)
def test_the_general_form(robot: str, hidden: str) -> None:
    derivation = derived(robot, None, None, "general")
    certified(derivation)
    emitted(derivation)
    assert derivation.form == "general"
    assert derivation.unchecked is None
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == hidden


def test_the_general_form_keeps_the_legs_that_are_not_observed() -> None:
    derivation = derived("quattro", ("1", "4"), None, "general")
    certified(derivation)
    assert derivation.hidden_architecture is not None
    assert derivation.hidden_architecture.ascii == "2-{R-PP}-{2-U*S}+2-R-{2-SS}"


def test_the_same_seed_gives_the_same_answer() -> None:
    one = derive(load("3rrr_m1"), ["1", "2"], seed=4)
    hrsynth.clear_cache()
    two = derive(load("3rrr_m1"), ["1", "2"], seed=4)
    assert one is not two
    assert one.to_dict() == two.to_dict()
    assert one.hidden is not None
    assert two.hidden is not None
    assert native.write(one.hidden) == native.write(two.hidden)


def test_progress_is_told() -> None:
    told: list[str] = []
    with hrsynth.on_progress(told.append):
        derive(load("rrrrr_m1"))
    assert {"sampling", "certificate", "the unchecked form"} <= set(told)


@pytest.mark.parametrize(
    ("observe", "camera", "form", "value", "allowed"),
    [
        (["9"], None, "simplified", "9", "1, 2, 3"),
        (["1", "nothing"], None, "simplified", "nothing", "rod_1a"),
        (["base"], None, "simplified", "base", "arm_1"),
        (["platform"], None, "simplified", "platform", "arm_1"),
        (None, "nothing", "simplified", "nothing", "platform"),
        (None, None, "plain", "plain", "simplified, general"),
    ],
)
def test_bad_requests(observe: list[str] | None, camera: str | None, form: str, value: str, allowed: str) -> None:
    with pytest.raises(BadRequest) as caught:
        derive(load("delta"), observe, camera, form=form)
    assert caught.value.exit_status == 2
    assert caught.value.got == value
    assert allowed in str(caught.value)
    assert len(caught.value.lines()) == 1


def test_the_record() -> None:
    record = derived("delta", ("1",)).to_dict()
    seen = derived("delta", ("1",)).setup.observed[0]
    assert isinstance(seen, Direction)
    axis = seen.direction.tolist()
    assert record["observed"] == [
        {"leg": "1", "link": "rod_1a", "kind": "direction", "camera": None, "at": None, "axis": axis}
    ]
    assert record["camera"] == "base"
    assert record["verdict"] == PARTIAL
    assert record["dof"] == record["rank"] + len(record["unobserved"])
    assert record["mobility"]["total"] == 9
    assert record["mobility"]["internal"] == 6
    assert record["equivalence"]["passed"] is True
    assert record["notation"]["real_ascii"] == "3-R*-{2-SS}"
    assert record["unchecked_form"]["equivalent"] is False
    assert all(len(freedom["twist"]) == 6 for freedom in record["unobserved"])
    assert {step["rule"] for step in record["steps"]} >= {
        "motors off",
        "lift",
        "joint substitution",
        "leg removal",
        "keep",
    }


@pytest.mark.some(1)
@pytest.mark.parametrize(("form", "expected"), [("general", "{R-PP}-R*RR*-{R-PP}"), ("simplified", "PiR*RR*Pi")])
def test_a_second_attempt_keeps_to_the_form_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch, form: str, expected: str
) -> None:
    answers = iter([False])
    monkeypatch.setattr(RewriteTrace, "has_virtual_motors_only", property(lambda self: next(answers, True)))
    found = derive(load("rrrrr_m1"), form=form)
    assert next(answers, None) is None
    assert found.hidden_architecture is not None
    assert found.hidden_architecture.ascii == expected


def test_a_zero_configuration_that_shows_fewer_freedoms_is_named():
    """How fast the watched rods of a 3-RRR turn, by hand: of the platform's three freedoms they show two there."""
    assert derived("3rrr_m1").verdict.rank_at_zero is None
    assert "rank_at_zero" not in derived("3rrr_m1").to_dict()
    checked = hrsynth.singularities("3rrr_m1", points=5).checked
    assert checked is not None
    at = checked.on_locus[0]
    robot = at.model.mechanism

    def place(joint: str) -> np.ndarray:
        link = robot.joints[joint].predecessor
        X = at.pose(link) @ np.linalg.inv(robot.links[link].pose)
        return (X @ np.append(robot.joints[joint].point, 1))[:2]

    def across(v: np.ndarray) -> np.ndarray:
        return np.array([-v[1], v[0]])

    rates = []
    for k in "123":
        foot, elbow, tip = place(f"shoulder_{k}"), place(f"elbow_{k}"), place(f"wrist_{k}")
        moves = np.column_stack([np.eye(2), across(tip)])
        rates.append(np.linalg.solve(np.column_stack([across(elbow - foot), across(tip - elbow)]), moves)[1])
    values = np.linalg.svd(np.array(rates), compute_uv=False)
    assert values[2] < 1e-9 * values[0] < values[1]
    found = derive("3rrr_m1", at=at.pose("platform"))
    assert found.verdict.verdict == CONTROLLABLE
    assert found.verdict.rank_at_zero == found.to_dict()["rank_at_zero"] == 2
    assert "only 2 of 3 dof observed: the zero configuration is a Type 2 singularity" in hrsynth.text(found)
