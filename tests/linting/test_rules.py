"""Each rule finds its one defect and nothing else; mended, the file is the sound one; sound files raise no alarm."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

import hrsynth
from description.foreign.examples import FILES, URDF
from description.foreign.rounded import exported, of_hinges
from description.foreign.test_dialects import written
from hrsynth.description import list_robots, load, save
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.linting.elements import list_inertials
from hrsynth.linting.linted_file import LintedFile
from hrsynth.linting.rules import lint_rules
from hrsynth.mechanism.normal import reduce_to_normal_form
from linting.defects import CASES, Case, damaged, foreign, put, rounded, sound
from strategies import planar, random_rotation, transformed

ELSEWHERE = {
    "closure-misplaced",
    "closure-locks",
    "geometry-rounded",
    "constraint-redundant",
    "loop-mirrored",
    "frames-coincide",
    "zero-singular",
    "merged",
}
"""Rules whose files are made in a test of their own."""


def rules_in(path: Path, **given: object) -> Counter[str]:
    return Counter(each.rule for each in hrsynth.lint(path, **given).findings)


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the sound files are."""
    return tmp_path_factory.mktemp("sound")


@cache
def sound_file(robot: str, ending: str, shelf: Path) -> tuple[Path, Counter[str]]:
    """A sound file, and the rules that find something in it: notes alone."""
    path = shelf / f"{robot}_sound{ending}"
    path.write_text(sound(robot, ending, shelf))
    found = hrsynth.lint(path)
    assert not found.has_severity("warning")
    return path, Counter(each.rule for each in found.findings)


def files(case: Case, folder: Path, shelf: Path) -> tuple[Path, Path]:
    """The sound file and the damaged one."""
    one, _ = sound_file(case.robot, case.ending, shelf)
    two = folder / f"damaged{case.ending}"
    two.write_text(damaged(one.read_text(), case.damage))
    return one, two


def test_every_rule_has_a_case():
    compared = {name for name in lint_rules() if name.startswith("differs-")}
    assert set(lint_rules()) == {each.rule for each in CASES} | ELSEWHERE | compared


@pytest.mark.some(3)
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.rule}{case.ending}")
def test_a_rule_finds_its_defect_and_no_other(case: Case, tmp_path: Path, shelf: Path):
    _, two = files(case, tmp_path, shelf)
    _, before = sound_file(case.robot, case.ending, shelf)
    after = rules_in(two, **{} if case.program is None else {"program": case.program})
    if case.program is None:
        assert before[case.rule] == 0 or case.rule == "motor-unlimited"
    assert after[case.rule] > (0 if case.program else before[case.rule])
    new = {name for name in after if after[name] > before[name]}
    assert case.rule in new
    assert new <= {case.rule, *case.follows}


MENDED = [case for case in CASES if lint_rules()[case.rule].fixable]


@pytest.mark.some(1)
@pytest.mark.parametrize("case", MENDED, ids=lambda case: f"{case.rule}{case.ending}")
def test_what_is_mended_is_the_sound_file_again(case: Case, tmp_path: Path, shelf: Path):
    one, two = files(case, tmp_path, shelf)
    before = two.read_bytes()
    target = tmp_path / f"mended{case.ending}"
    found = hrsynth.lint(two, fix=True, output=target)
    assert case.rule not in {each.rule for each in found.findings}
    assert {each.rule for each in found.fixed} == {case.rule}
    assert Path(found.written or "") == target
    assert two.read_bytes() == before
    if case.geometry:
        robot = load(target)
        assert [text for text in robot.differences(load(one)) if "content of link" not in text] == []
    else:
        left = rules_in(target, compare=one)
        assert {name for name in left if name.startswith("differs")} <= {"differs-zero", "differs-limit"}


@pytest.mark.parametrize(
    "rule",
    [
        "loop-open",
        pytest.param("constraint-dead", marks=pytest.mark.slow),
        pytest.param("unit-angles", marks=pytest.mark.slow),
    ],
)
def test_what_is_mended_hides_the_same_robot(rule: str, tmp_path: Path, shelf: Path):
    case = next(each for each in CASES if each.rule == rule)
    one, two = files(case, tmp_path, shelf)
    hrsynth.lint(two, fix=True)
    mended, before = (hrsynth.derive(path, "1,2,3") for path in (two, one))
    assert mended.hidden_architecture == before.hidden_architecture
    assert mended.verdict.verdict == before.verdict.verdict
    assert (mended.dof, mended.mobility) == (before.dof, before.mobility)
    assert mended.equivalence.passed


@pytest.mark.parametrize(
    "naming",
    [
        '<transmission name="m4"><joint name="wrist_2_again"/></transmission>',
        '<observe kind="encoder" joint="wrist_2_again"/>',
    ],
)
def test_what_another_element_names_is_not_taken_out(naming: str, tmp_path: Path, shelf: Path):
    """A dead closure with a motor or an encoder was removed, and the mended file was refused: they named nothing."""
    case = next(each for each in CASES if each.rule == "constraint-dead")
    _, two = files(case, tmp_path, shelf)
    text = two.read_text()
    two.write_text(
        text.replace("</hrsynth>", f"{naming}</hrsynth>")
        if "observe" in naming
        else text.replace("<hrsynth>", f"{naming}<hrsynth>")
    )
    found = hrsynth.lint(two, fix=True, output=tmp_path / "mended.urdf")
    assert "refused" not in {each.rule for each in found.findings}
    assert "constraint-dead" in {each.rule for each in found.findings}
    assert found.fixed == ()


def test_the_sound_limits_are_counted_from_the_new_zero(tmp_path: Path, shelf: Path):
    """A mend of an open loop moves the zero of joints: what the limits allow stays the same poses."""
    case = next(each for each in CASES if each.rule == "loop-open")
    _, two = files(case, tmp_path, shelf)
    before = load_tolerantly(two)
    hrsynth.lint(two, fix=True)
    after = load(two)
    for name, joint in before.joints.items():
        if joint.limits is not None and joint.limits.lower is not None:
            assert np.allclose(
                [after.joints[name].limits.lower, after.joints[name].limits.upper],
                [joint.limits.lower, joint.limits.upper],
            )


def test_a_mimic_follows_from_the_new_zero(tmp_path: Path):
    """Where the loop is closed at the new zero a mimic joint keeps its place and its ratio; soft limits move along."""
    path = tmp_path / "robot.urdf"
    path.write_text(
        """<robot name="r"><link name="base"/><link name="crank"/><link name="bar"/><link name="rocker"/>
        <link name="led"/>
        <joint name="a" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 1 0"/></joint>
        <joint name="b" type="continuous"><parent link="crank"/><child link="bar"/><origin xyz="0 0 1" rpy="0 0.1 0"/>
        <axis xyz="0 1 0"/><safety_controller soft_lower_limit="-0.5" soft_upper_limit="1.5" k_velocity="1"/>
        <calibration rising="0.25"/></joint>
        <joint name="c" type="continuous"><parent link="base"/><child link="rocker"/><origin xyz="2 0 0"/>
        <axis xyz="0 1 0"/></joint>
        <joint name="m" type="continuous"><parent link="rocker"/><child link="led"/><origin xyz="0 0 0.5"/>
        <axis xyz="0 1 0"/><mimic joint="c" multiplier="2" offset="0.3"/></joint>
        <loop name="d" type="revolute"><predecessor link="rocker"><origin xyz="0 0 1"/></predecessor>
        <successor link="bar"><origin xyz="2 0 0"/></successor><axis xyz="0 1 0"/></loop></robot>"""
    )
    before = load(path, platform="bar")
    assert [each.rule for each in hrsynth.lint(path, platform="bar", fix=True).fixed] == ["loop-open"]
    after = load(path, platform="bar")
    assert not [note for note in after.notes if note.kind == "solved"]
    assert after.differences(before) == []
    tree = etree.parse(path)
    ends = [float(tree.find("joint/safety_controller").get(f"soft_{end}_limit")) for end in ("lower", "upper")]
    old = np.arctan2(*before.links["crank"].pose[[0, 2], 2]), np.arctan2(*before.links["bar"].pose[[0, 2], 2])
    moved = old[1] - old[0] - 0.1
    assert abs(moved) > 1e-3
    assert ends == pytest.approx([-0.5 - moved, 1.5 - moved])
    assert float(tree.find("joint/calibration").get("rising")) == pytest.approx(0.25 - moved)


def test_degrees_beside_radians_are_told_and_left(tmp_path: Path, shelf: Path):
    """Of 3.1416 and 90 in one element one is wrong: nobody knows which way."""
    case = next(each for each in CASES if each.rule == "unit-angles")
    one, _ = files(case, tmp_path, shelf)
    for tag, values in (("origin", {"rpy": "3.1416 0 90"}), ("limit", {"lower": "-1.5708", "upper": "90"})):
        path = tmp_path / f"{tag}.urdf"
        tree = etree.fromstring(one.read_bytes())
        element = next(tree.iter(tag))
        element.attrib.update(values)
        path.write_bytes(etree.tostring(tree))
        found = [each for each in hrsynth.lint(path, fix=True).findings if each.rule in ("unit-angles", "unit-limits")]
        assert [each.fixable for each in found] == [False]
        assert all(text in path.read_text() for text in values.values())


@pytest.mark.parametrize(("other", "mended"), [("0", True), ("1.5", False)])
def test_small_limits_beside_degrees_are_degrees_where_all_are_whole(tmp_path: Path, other: str, mended: bool):
    path = tmp_path / "robot.urdf"
    joints = "".join(
        f"""<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="base"/><child link="l{k}"/>
        <limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint>"""
        for k, (low, high) in enumerate([("-5", "5"), ("-90", "45"), (other, "30")])
    )
    path.write_text(f"""<robot name="r"><link name="base"/>{joints}</robot>""")
    hrsynth.lint(path, fix=True)
    lower, upper = ([float(each.get(end)) for each in etree.parse(path).iter("limit")] for end in ("lower", "upper"))
    assert (lower[0], upper[0]) == pytest.approx(np.radians([-5, 5]) if mended else [-5, 5])
    assert (lower[1], upper[1]) == pytest.approx(np.radians([-90, 45]))


def load_tolerantly(path: Path):
    found = LintedFile(path).mechanism
    assert found is not None
    return found


def test_an_inertia_is_mended_to_the_nearest_of_a_body(tmp_path: Path, shelf: Path):
    """Principal moments a ≥ b + c become those of a plate: the second moments that were not negative stay."""
    case = next(each for each in CASES if each.rule == "inertia-triangle" and each.ending == ".urdf")
    _, two = files(case, tmp_path, shelf)
    (before,) = [each for each in list_inertials(LintedFile(two)) if each.inertia[2, 2] == 0.09]
    hrsynth.lint(two, fix=True)
    (after,) = [each for each in list_inertials(LintedFile(two)) if each.link == before.link]
    for inertia, lowest in ((before.inertia, -0.05), (after.inertia, 0.0)):
        moments = np.sort(np.linalg.eigvalsh(inertia))
        assert moments[0] + moments[1] - moments[2] == pytest.approx(2 * lowest * 0.4, abs=0.005)
    kept = [
        np.sort(np.linalg.eigvalsh(np.trace(each.inertia) / 2 * np.eye(3) - each.inertia))[1:]
        for each in (before, after)
    ]
    assert kept[1] == pytest.approx(kept[0], rel=1e-5)


def test_a_mirrored_closure_is_found_and_turned(tmp_path: Path):
    text = URDF["constraint"]
    good = tmp_path / "good.urdf"
    good.write_text(text)
    axis = "child_axis"
    bad = tmp_path / "bad.urdf"
    values = [float(word) for word in text.split(f'<{axis} xyz="')[1].split('"')[0].split()]
    bad.write_text(damaged(text, put(f"constraint/{axis}", xyz=" ".join(str(-value) for value in values))))
    assert rules_in(good)["loop-mirrored"] == 0
    assert rules_in(bad)["loop-mirrored"] == 1
    found = hrsynth.lint(bad, fix=True)
    assert [each.rule for each in found.fixed] == ["loop-mirrored"]
    assert load(bad).differences(load(good)) == []


@pytest.mark.parametrize("seed", range(4))
def test_an_anchor_typed_in_world_numbers_is_told_with_its_distance(seed: int, tmp_path: Path):
    """Of a four-bar far from the world's origin; by arithmetic. Typed in the frame of its body it raises no alarm."""
    A, B, C, D = np.array([[0, 0], [0.05, 0.09], [0.27, 0.12], [0.24, 0]]) + np.random.default_rng(seed).uniform(
        0.4, 0.8, (1, 2)
    )
    words = {
        name: f"{float(x)!r} 0 {float(z)!r}"
        for name, (x, z) in {"A": A, "B": B - A, "C": C, "D": D, "BC": C - B}.items()
    }
    for name, alarms in (("BC", 0), ("C", 1)):
        path = tmp_path / f"{name}.xml"
        path.write_text(
            f'''<mujoco><worldbody><body name="crank" pos="{words["A"]}"><joint name="a" axis="0 1 0"/>
            <geom size="0.004"/><body name="rod" pos="{words["B"]}"><joint name="b" axis="0 1 0"/><geom size="0.004"/>
            </body></body><body name="rocker" pos="{words["D"]}"><joint name="d" axis="0 1 0"/><geom size="0.004"/>
            </body></worldbody><equality>
            <connect name="pin" body1="rod" body2="rocker" anchor="{words[name]}"/></equality></mujoco>'''
        )
        found = [each for each in hrsynth.lint(path, platform="rod").findings if each.rule == "closure-misplaced"]
        assert len(found) == alarms
        for each in found:
            distance = min(np.linalg.norm(C), np.linalg.norm(B + C - D)) - 0.004
            assert each.line == 5
            assert f"the point of 'pin' is {distance:.3g} m or more from both of its links" in each.message


def test_redundant_constraints_are_named_and_counted(tmp_path: Path):
    """A planar loop closed by a hinge has 3 constraints too many, six balls have none."""
    found = [each for each in hrsynth.lint("3rrr_m1").findings if each.rule == "constraint-redundant"]
    assert [each.message for each in found] == [
        f"3 of the 5 constraints of 'wrist_{leg}' are redundant with those of earlier loops" for leg in (2, 3)
    ]
    assert rules_in(list_robots()["gough_stewart"])["constraint-redundant"] == 0


@pytest.mark.some(1)
@pytest.mark.parametrize("decimals", [5, 6])
@pytest.mark.parametrize("native", [True, False])
def test_rounded_geometry_is_found_and_written_as_it_is_meant(decimals: int, native: bool, tmp_path: Path):
    """A planar robot in a tilted base, its parallel axes printed with few digits: mended, they are parallel again."""
    rng = np.random.default_rng(1)
    made = transformed(planar(("RRR", "RRR", "RRR"), rng, [(0,)] * 3), random_rotation(rng), rng.normal(size=3))
    one, two = tmp_path / "sound.urdf", tmp_path / "rounded.urdf"
    save(made, one)
    damage = rounded(decimals) if native else foreign(rounded(decimals))
    two.write_text(damaged(one.read_text(), damage))
    found = hrsynth.lint(two, platform=None if native else made.platform)
    assert {each.rule for each in found.findings if each.fixable} == {"geometry-rounded"}
    mended = hrsynth.lint(two, fix=True, platform=None if native else made.platform)
    assert not {"geometry-rounded", "refused", "loop-open"} & {each.rule for each in mended.findings}
    before, after = load(one), load(two, platform=made.platform) if not native else load(two)
    assert not [note for note in after.notes if "relations" in note.text]
    axes = np.array([joint.axis for joint in after.joints.values() if joint.axes])
    assert np.max(np.abs(np.cross(axes, axes[0]))) < 1e-12
    for name, joint in before.joints.items():
        assert np.linalg.norm(after.joints[name].point - joint.point) < 30 * 10.0**-decimals


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["3rps", "3rrr_m1", pytest.param("delta", marks=pytest.mark.slow)])
def test_rounded_loops_are_not_closed_by_moving_joints(name: str, tmp_path: Path):
    """Four decimals open loops by more than noise: numbers are made exact, no joint moves; the robot is the same, also
    for readers that take the numbers as they are."""
    path = exported(of_hinges(load(name)), tmp_path / "robot.urdf", 4)
    before = load(path)
    found = hrsynth.lint(path, fix=True)
    assert {each.rule for each in found.fixed} == {"geometry-rounded"}
    after = load(path, as_written=True)
    assert [text for text in after.differences(before, 1e-9) if not text.startswith("pose of link")] == []
    assert reduce_to_normal_form(after).mechanism.joints.keys() == reduce_to_normal_form(before).mechanism.joints.keys()


def test_a_file_that_is_near_to_two_robots_is_left_to_a_person(tmp_path: Path):
    path = exported(of_hinges(load("3upu"), slid=0.2), tmp_path / "robot.urdf", 3)
    text = path.read_bytes()
    found = hrsynth.lint(path, fix=True)
    assert [each.rule for each in found.findings if each.severity == "error"] == ["refused"]
    assert not found.fixed
    assert path.read_bytes() == text


def test_frames_that_nobody_closes_are_told(tmp_path: Path):
    text = URDF["onshape"].replace("closing_", "tip_of_")
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    found = [each for each in hrsynth.lint(path).findings if each.rule == "frames-coincide"]
    assert len(found) == 1
    assert "--close tip_of_" in (found[0].advice or "")
    given = (found[0].advice or "").split("--close ")[1]
    assert rules_in(path, close=given)["loop-none"] == 0


def arm(*joints: str) -> str:
    """A serial arm of joints, each as its type, the place of its frame and its axis."""
    links = "".join(f'<link name="l{number}"/>' for number in range(len(joints) + 1))
    return (
        f'<robot name="arm">{links}'
        + "".join(
            f'<joint name="q{number}" type="{kind}"><parent link="l{number}"/><child link="l{number + 1}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
            for number, (kind, place, axis) in enumerate(each.split("; ") for each in joints)
        )
        + "</robot>"
    )


SLIDING = ("continuous; 0 0 0.2; 0 0 1", "prismatic; 0 0 0; 0 0 1", "continuous; 0 0 0; 0 1 0")


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        ((*SLIDING, "continuous; 0.3 0 0; 0 1 0"), False),
        (SLIDING, False),
        (
            (
                "continuous; 0 0 0; 0 1 0",
                "continuous; 0 0 1; 0 1 0",
                "continuous; 1 0 0; 0 1 0",
                "fixed; -1 0 -1; 0 1 0",
            ),
            True,
        ),
    ],
)
def test_frames_of_consecutive_joints_may_coincide(tmp_path: Path, joints: tuple[str, ...], told: bool):
    """A slide at zero brings the joints at its ends together; a four-bar that comes back to its base is told."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm(*joints))
    assert (rules_in(path)["frames-coincide"] > 0) == told


@pytest.mark.parametrize(
    ("change", "line", "says", "severity"),
    [
        (
            ("<transmission name", "<tranmission name", "</transmission>", "</tranmission>"),
            "<transmission name",
            "element in <robot>: got <tranmission>, similar to <transmission>",
            "error",
        ),
        (
            ("<transmission name", "<tranmision name", "</transmission>", "</tranmision>"),
            "<transmission name",
            "element in <robot>: got <tranmision>, similar to <transmission>",
            "warning",
        ),
        (('<axis xyz="0 0 1"', '<axis xzy="0 0 1"'), "<axis", "attribute of <axis>: got xzy, similar to xyz", "error"),
        (('<axis xyz="0 0 1"', '<Axis xyz="0 0 1"'), "<axis", "similar to <axis>", "error"),
        (
            ('<predecessor link="dist_2">\n      <origin xyz', '<predecessor link="dist_2">\n      <origin xy'),
            '<predecessor link="dist_2">',
            "attribute of <origin>: got xy, similar to xyz",
            "error",
        ),
        (("<hrsynth>", "<hydraulics/>\n<hrsynth>"), "<hrsynth>", "element in <robot>: got <hydraulics>", "note"),
        (("<hrsynth>", '<w:thing xmlns:w="urn:w"/>\n<hrsynth>'), "", "", ""),
    ],
)
def test_what_a_format_lacks_is_named_with_its_line(
    tmp_path: Path, change: tuple[str, ...], line: str, says: str, severity: str
):
    text = list_robots()["3rrr_m1"].read_text()
    assert rules_in(list_robots()["3rrr_m1"])["element-unknown"] == 0
    path = tmp_path / "robot.urdf"
    for old, new in zip(change[::2], change[1::2], strict=True):
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    found = [each for each in hrsynth.lint(path).findings if each.rule == "element-unknown"]
    assert len(found) == (1 if says else 0)
    for each in found:
        assert says in each.message
        assert each.severity == severity
        first = list_robots()["3rrr_m1"].read_text().split(line)[0].count("\n") + 1
        assert each.line == first + ("predecessor" in line)


def test_a_singular_zero_pose_and_what_is_read_otherwise_are_told(tmp_path: Path):
    flat = (
        '<robot name="flat">'
        + "".join(f'<link name="{name}"/>' for name in ("base", "a", "b", "c"))
        + "".join(
            f'<joint name="{name}" type="continuous"><parent link="{one}"/><child link="{two}"/><origin xyz="{x} 0 0"/>'
            '<axis xyz="0 0 1"/></joint>'
            for name, one, two, x in (("p", "base", "a", 0), ("q", "a", "b", 1), ("r", "base", "c", 2))
        )
        + '<loop name="s" type="spherical"><predecessor link="b"><origin xyz="2 0 0"/></predecessor>'
        '<successor link="c"><origin xyz="1 0 0"/></successor></loop></robot>'
    )
    path = tmp_path / "flat.urdf"
    path.write_text(flat)
    found = rules_in(path)
    assert found["zero-singular"] == 1
    assert found["merged"] >= 1


@pytest.mark.parametrize(
    ("robot", "open_on_purpose"),
    [
        ('<joint name="f" type="floating"><parent link="base"/><child link="hand"/></joint>', True),
        ('<joint name="f" type="continuous"><parent link="base"/><child link="hand"/></joint>', False),
    ],
)
@pytest.mark.parametrize("seen", [False, True])
def test_what_is_open_on_purpose_is_not_told_to_close(tmp_path: Path, robot: str, open_on_purpose: bool, seen: bool):
    """A free body, and whatever a camera looks at."""
    eye = (
        '<camera name="eye" link="base"><origin xyz="0 0 -1"/></camera>'
        '<observe kind="point" camera="eye" link="hand" at="0 0 0"/>'
    )
    path = tmp_path / "robot.urdf"
    path.write_text(
        f'<robot name="body"><link name="base"/><link name="hand"/>{robot}<hrsynth serial="true">'
        f'<platform link="hand"/>{eye * seen}</hrsynth></robot>'
    )
    found = rules_in(path)
    assert found["refused"] == 0
    expected = 0 if open_on_purpose or seen else 1
    assert (found["loop-none"], found["motor-none"]) == (expected, expected)


SOME = ("3rps", "rrrrr_m1")
NAMES = [name if name in SOME else pytest.param(name, marks=pytest.mark.slow) for name in list_robots()]


@pytest.mark.some(3, 12)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("ending", ["", ".xml", ".sdf", ".yaml"])
def test_shipped_robots_raise_no_alarm_in_any_dialect(name: str, ending: str, tmp_path: Path):
    path: str | Path = name
    if ending:
        path = tmp_path / f"robot{ending}"
        save(load(name), path)
    found = hrsynth.lint(path, compare=name)
    loud = [each for each in found.findings if each.severity != "note"]
    assert [each.rule for each in loud] == ["motors-many"] * (name == "quattro_rigid")  # four motors, three freedoms
    assert not any(each.fixable for each in found.findings)


@pytest.mark.some(7)
@pytest.mark.parametrize("name", FILES)
def test_the_same_four_bar_in_every_dialect_is_the_same(name: str, tmp_path: Path):
    (tmp_path / "other").mkdir()
    path = written(tmp_path, FILES[name])
    other = written(tmp_path / "other", FILES["urdf: urdf+"])
    found = hrsynth.lint(path, compare=other)
    really = {"differs-motor"} if name.startswith("sdf") else {"differs-limit"} if "classes" in name else set()
    assert {each.rule for each in found.findings if each.rank} == really


def test_nothing_is_written_where_nothing_is_mended_or_the_request_is_wrong(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(sound())
    before = path.stat().st_mtime_ns
    assert hrsynth.lint(path, fix=True).written is None
    assert path.stat().st_mtime_ns == before
    for wrong in ({"output": tmp_path / "o.urdf"}, {"ignore": "nothing"}, {"program": "nothing"}):
        with pytest.raises(BadRequest):
            hrsynth.lint(path, **wrong)
    with pytest.raises(BadRequest):
        hrsynth.lint([path, path], fix=True, output=tmp_path / "o.urdf")
    with pytest.raises(BadRequest):
        hrsynth.lint([])
    assert sorted(each.name for each in tmp_path.iterdir()) == ["robot.urdf"]


def test_all_files_that_cannot_be_opened_are_named(tmp_path: Path):
    (tmp_path / "a.urdf").write_text("<robot")
    (tmp_path / "c.urdf").write_text(sound())
    with pytest.raises(BadRobotFile) as caught:
        hrsynth.lint([tmp_path / name for name in ("a.urdf", "b.urdf")])
    assert {Path(each.file).name for each in caught.value.defects} == {"a.urdf", "b.urdf"}
    found = hrsynth.lint([tmp_path / name for name in ("a.urdf", "b.urdf", "c.urdf")])
    assert found.unread == caught.value.defects
    assert [Path(each).name for each in found.files] == ["c.urdf"]


def test_comments_and_unknown_elements_stay_where_something_is_mended(tmp_path: Path):
    text = (
        '<?xml version="1.0"?>\n<!-- made by hand -->\n'
        + damaged(sound(), CASES[0].damage).replace("<loop", "<!-- here --><vendor key='v'>text</vendor>\n  <loop", 1)
        + "\n"
    )
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    hrsynth.lint(path, fix=True)
    after = path.read_text()
    changed = [(one, two) for one, two in zip(text.splitlines(), after.splitlines(), strict=True) if one != two]
    assert [one.replace('"', "'") for one, _ in changed if "limit" not in one] == [
        two.replace('"', "'") for _, two in changed if "limit" not in two
    ]
    assert len([one for one, _ in changed if "limit" in one]) == 1
