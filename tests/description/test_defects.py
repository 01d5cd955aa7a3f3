"""Every defect of a robot file is found, with its line, and all of them at once."""

from __future__ import annotations

import contextlib
import time
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from description.samples import FOUR_BAR
from hrsynth.description import load, native
from hrsynth.errors import BadRobotFile, LoopClosureFailure
from patience import allow

UNIVERSAL = ('<loop name="d" type="revolute">', '<loop name="d" type="universal">')


def defects(text: str | bytes) -> list[tuple[int | None, str]]:
    with pytest.raises(BadRobotFile) as caught:
        native.parse(text, "robot.urdf")
    error = caught.value
    assert error.exit_status == 2
    assert all(line.startswith("robot.urdf") and "\n" not in line for line in error.lines())
    return [(defect.line, f"{defect.problem}, {defect.got}, {defect.expected}") for defect in error.defects]


def edited(*changes: tuple[str, str] | tuple[int, str]) -> str:
    """The sample with texts replaced, or with the line of a number replaced."""
    text = FOUR_BAR
    for old, new in changes:
        if isinstance(old, int):
            lines = text.split("\n")
            lines[old - 1] = new
            text = "\n".join(lines)
        else:
            assert old in text
            text = text.replace(old, new, 1)
    return text


# name: (changes, [(line, words of the message)])
DEFECTS: dict[str, tuple[list, list[tuple[int, str]]]] = {
    "malformed": (
        [(3, '  <link name="crank">')],
        [(41, "malformed XML, Opening and ending tag mismatch: link line 3 and robot")],
    ),
    "cut off": ([(19, "<joint")], [(20, "malformed XML")]),
    "two root elements": ([(42, "<robot/>")], [(42, "malformed XML")]),
    "other root": ([(1, '<model name="x">'), (41, "</model>")], [(1, "root element, model, robot")]),
    "no name": ([(1, "<robot>")], [(1, "<robot> without name")]),
    "empty name": (
        [(3, '<link name=" "/>'), (7, "")],
        [
            (3, "<link> without name"),
            (6, "joint without <parent>, a"),
            (8, "unknown link, crank"),
            (14, "unknown link, crank"),
            (39, "unknown link, crank"),
        ],
    ),
    "unknown joint type": ([(19, '<joint name="c" type="ball">')], [(19, "unknown joint type, ball, revolute, cont")]),
    "no joint type": ([(19, '<joint name="c">')], [(19, "<joint> without type")]),
    "unknown loop type": (
        [('<loop name="d" type="revolute">', '<loop name="d" type="screw">')],
        [(25, "unknown loop type, screw, revolute, continuous, prismatic, cylindrical, universal")],
    ),
    "joint of a missing parent": (
        [(14, '<parent link="cranc"/>')],
        [(14, "joint 'b': unknown link, cranc, an existing name, such as crank")],
    ),
    "joint of a missing child": (
        [(15, '<child link="zzz"/>')],
        [
            (4, "second root besides 'base': not the child of any joint, bar"),
            (15, "joint 'b': unknown link, zzz"),
        ],
    ),
    "joint without a child": ([(21, "")], [(5, "second root"), (19, "joint without <child>, c")]),
    "second origin": (
        [
            (
                18,
                '</joint><link name="e"/><joint name="g" type="fixed"><parent link="bar"/><child link="e"/>'
                "<origin/><origin/></joint>",
            )
        ],
        [(18, "second <origin> in <joint>, g")],
    ),
    "second link": ([(5, '<link name="rocker"/><link name="base"/>')], [(5, "second link of the same name, base")]),
    "second joint": (
        [(19, '<joint name="b" type="continuous">')],
        [(5, "second root"), (19, "second joint or loop of the same name (joint), b")],
    ),
    "loop with a joint's name": ([('<loop name="d"', '<loop name="b"')], [(25, "of the same name (loop), b")]),
    "zero axis": ([(10, '<axis xyz="0 0 0"/>')], [(10, "xyz of <axis>, 0 0 0, a non-zero vector")]),
    "tiny axis": ([(10, '<axis xyz="0 0 1e-300"/>')], [(10, "a non-zero vector")]),
    "nan": ([(16, '<origin xyz="0 0 nan"/>')], [(16, "xyz of <origin>, 0 0 nan, finite numbers")]),
    "inf": ([(16, '<origin xyz="0 0 -inf"/>')], [(16, "finite numbers")]),
    "overflow": ([(16, '<origin xyz="0 0 1e999"/>')], [(16, "numbers up to 1e+09")]),
    "too far": ([(16, '<origin xyz="0 0 1e10"/>')], [(16, "numbers up to 1e+09")]),
    "no number": ([(9, '<origin xyz="0 0 0" rpy="0 1_0 x"/>')], [(9, "rpy of <origin>, 0 1_0 x, finite numbers")]),
    "two numbers": ([(16, '<origin xyz="0 1"/>')], [(16, "xyz of <origin>, 0 1, 3 numbers")]),
    "no numbers": ([(16, '<origin xyz=""/>')], [(16, "3 numbers")]),
    "four numbers": ([(17, '<axis xyz="0 1 0 0"/>')], [(17, "xyz of <axis>, 0 1 0 0, 3 numbers")]),
    "two roots": ([(5, '<link name="rocker"/><link name="moon"/>')], [(5, "second root besides 'base'")]),
    "two parents": (
        [(18, '</joint><joint name="g" type="fixed"><parent link="rocker"/><child link="bar"/></joint>')],
        [(18, "joint 'g': its child already has a parent, through joint 'b' (a loop is written as")],
    ),
    "ring": ([(7, '<parent link="bar"/>')], [(13, "tree joints that form a cycle (a loop is written as <loop>), a b")]),
    "ring of all": (
        [(7, '<parent link="bar"/>'), (20, '<parent link="bar"/>'), (2, "")],
        [(13, "tree joints that form a cycle")],
    ),
    "joint to itself": ([(20, '<parent link="rocker"/>')], [(5, "second root"), (19, "'c' connects a link to itself")]),
    "no platform": ([(38, "")], [(37, "no <platform>")]),
    "no own element": ([(37, ""), (38, ""), (39, ""), (40, "")], [(1, "no <hrsynth> element")]),
    "two own elements": ([(40, "</hrsynth><hrsynth/>")], [(40, "second <hrsynth>")]),
    "two platforms": ([(39, '<platform link="crank"/>')], [(39, "second <platform>")]),
    "unknown platform": (
        [(38, '<platform link="bra"/>')],
        [(38, "platform: unknown link, bra, an existing name, such as bar")],
    ),
    "platform without link": ([(38, "<platform/>")], [(38, "<platform> without link")]),
    "platform is the base": ([(38, '<platform link="base"/>')], [(38, "the platform is the base, base")]),
    "platform elsewhere": (
        [(5, '<link name="rocker"/><link name="moon"/>'), (38, '<platform link="moon"/>')],
        [(5, "second root"), (38, "platform not connected to the base 'base', moon")],
    ),
    "unknown camera": ([(39, '<camera link="eye"/>')], [(39, "camera: unknown link, eye")]),
    "observe unknown": ([(39, '<observe leg="1" link="cramk" axis="0 0 1"/>')], [(39, "observe: unknown link, cramk")]),
    "observe zero": ([(39, '<observe leg="1" link="crank" axis="0 0 0"/>')], [(39, "axis of <observe>, 0 0 0, a non")]),
    "observe no axis": ([(39, '<observe leg="1" link="crank"/>')], [(39, "<observe> without axis")]),
    "observe no leg": ([(39, '<observe link="crank" axis="0 0 1"/>')], [(39, "<observe> without leg")]),
    "observe no link": ([(39, '<observe leg="1" axis="0 0 1"/>')], [(39, "<observe> without link")]),
    "unknown motor": ([(35, '<joint name="aa"/>')], [(35, "transmission of an unknown joint, aa, a")]),
    "motor of nothing": ([(35, "")], [(34, "transmission without <joint>, m")]),
    "motor without a name": ([(34, "<transmission>")], [(34, "<transmission> without name")]),
    "two motors": ([(35, '<joint name="a"/><joint name="a"/>')], [(35, "second transmission of a joint, a")]),
    "motor of a fixed joint": (
        [(19, '<joint name="c" type="fixed">'), (35, '<joint name="c"/>')],
        [(35, "transmission of a fixed joint, c")],
    ),
    "no axis2": ([UNIVERSAL], [(25, "universal loop without <axis2>, d")]),
    "zero axis2": ([UNIVERSAL, (32, '<axis xyz="0 1 0"/><axis2 xyz="0 0 0"/>')], [(32, "xyz of <axis2>, 0 0 0")]),
    "oblique axis2": (
        [UNIVERSAL, (32, '<axis xyz="0 1 0"/><axis2 xyz="0 3 4"/>')],
        [(25, "universal loop 'd': cosine between axis and axis2, 0.6, 0")],
    ),
    "loop without an end": ([(26, "<!--"), (28, "-->")], [(25, "loop without <predecessor>, d")]),
    "loop of a missing link": ([(29, '<successor link="bier">')], [(29, "loop 'd': unknown link, bier")]),
    "loop to itself": ([(29, '<successor link="rocker">')], [(25, "'d' connects a link to itself, rocker")]),
    "negative velocity": ([(11, '<limit velocity="-1"/>')], [(11, "velocity of <limit>, -1, a number of at least 0")]),
    "negative effort": ([(11, '<limit effort="-2"/>')], [(11, "effort of <limit>, -2")]),
    "crossed limits": ([(11, '<limit lower="1" upper="-1"/>')], [(11, "lower limit, 1, up to -1")]),
    "lower above zero": ([(11, '<limit lower="1"/>')], [(11, "lower limit, 1, up to 0")]),
    "limit not a number": (
        [(11, '<limit lower="a" effort="inf"/>')],
        [(11, "lower of <limit>, a, finite"), (11, "effort of <limit>, inf, finite")],
    ),
    "gear of a missing link": (
        [
            (
                34,
                '<coupling name="g"><predecessor link="crank"/><successor link="x"/>'
                '<ratio value="2"/></coupling><transmission name="m">',
            )
        ],
        [(34, "successor of a coupling: unknown link, x")],
    ),
    "gear without a ratio": (
        [
            (
                34,
                '<coupling name="g"><predecessor link="crank"/><successor link="bar"/></coupling>'
                '<coupling name="g"><predecessor link="crank"/><ratio value="1 2"/></coupling>'
                '<transmission name="m">',
            )
        ],
        [
            (34, "coupling without <ratio>, g"),
            (34, "second coupling of the same name, g"),
            (34, "coupling without <successor>, g"),
            (34, "value of <ratio>, 1 2, one number"),
        ],
    ),
    "gear of a link with itself": (
        [
            (
                34,
                '<coupling name="g"><predecessor link="crank"/><successor link="crank"/>'
                '<ratio value="2"/></coupling><transmission name="m">',
            )
        ],
        [(34, "successor of a coupling is its predecessor, crank, another link")],
    ),
    "gear that holds": (
        [
            (
                34,
                '<coupling name="g"><predecessor link="crank"/><successor link="bar"/>'
                '<ratio value="-0"/></coupling><transmission name="m">',
            )
        ],
        [(34, "ratio of a coupling would fix its second joint, -0, a number other than 0")],
    ),
    "gear of the base": (
        [
            (
                34,
                '<coupling name="g"><predecessor link="base"/><successor link="bar"/>'
                '<ratio value="2"/></coupling><transmission name="m">',
            )
        ],
        [(34, "coupling 'g': a link that no joint carries")],
    ),
    "document type": (
        [(1, '<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="&a;">')],
        [(1, "a document type declaration")],
    ),
}


@pytest.mark.parametrize("name", DEFECTS)
def test_every_defect_has_its_line(name: str):
    changes, expected = DEFECTS[name]
    found = defects(edited(*changes))
    assert [line for line, _ in found] == [line for line, _ in expected]
    for (_, message), (_, words) in zip(found, expected, strict=True):
        assert words in message


def test_no_loop_is_no_parallel_robot():
    lines = FOUR_BAR.split("\n")
    assert defects("\n".join(lines[:24] + lines[33:])) == [
        (1, 'no loop: not a parallel robot, None, a <loop>; for a serial arm or a free body <hrsynth serial="true">')
    ]


def test_all_defects_are_reported_at_once_in_the_order_of_their_lines():
    names = [
        "second link",
        "zero axis",
        "negative velocity",
        "nan",
        "unknown joint type",
        "loop of a missing link",
        "unknown motor",
        "unknown platform",
        "observe zero",
    ]
    changes = [change for name in names for change in DEFECTS[name][0]]
    expected = sorted(line for name in names for line, _ in DEFECTS[name][1])
    assert [line for line, _ in defects(edited(*changes))] == expected


def test_a_message_is_one_line_with_file_line_value_and_what_is_allowed():
    with pytest.raises(BadRobotFile) as caught:
        native.parse(edited((10, '<axis xyz="0&#10;0 0"/>')), "robots/x.urdf")
    assert caught.value.lines() == ["robots/x.urdf:10: xyz of <axis>: got 0 0 0, expected a non-zero vector"]


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("", 1, "empty file"),
        (b" \n\n", 1, "empty file"),
        (b"\0" * 100, 1, "malformed XML"),
        (FOUR_BAR.replace("crank", "kurbel-ü").encode("latin-1"), 3, "not UTF-8 text, 0xfc"),
        (FOUR_BAR.encode("utf-16"), 1, "not UTF-8 text, 0xff"),
        ("junk", 1, "malformed XML"),
        ("<robot", 1, "malformed XML"),
        ('<robot name="x"/>', 1, "no links"),
        ('<x:robot xmlns:x="urn:x" name="x"/>', 1, "root element, {urn:x}robot, robot"),
        ("<robot name='x'>" + "<a>" * 5000 + "</a>" * 5000 + "</robot>", 1, "malformed XML"),
        ('<?xml version="1.0" encoding="no-such"?><robot name="x"/>', 1, "malformed XML"),
    ],
)
def test_what_is_no_robot_at_all(text: str | bytes, line: int | None, what: str):
    found = defects(text)
    assert (line, True) in [(number, message.startswith(what)) for number, message in found]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.urdf", '<robot name="x"/>'),
        ("a.xml", "<mujoco/>"),
        ("a.sdf", '<sdf version="1.9"><model name="x"/></sdf>'),
        ("a.urdf", '<robot name="x"><hrsynth/></robot>'),
        ("a.xacro", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="leg" params="i"/></robot>'),
    ],
)
def test_a_file_without_links_is_told_what_to_name_instead(tmp_path: Path, name: str, text: str):
    if name.endswith(".xacro"):
        pytest.importorskip("xacro")
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(BadRobotFile, match=r"no (links|bodies).*of parts or macros, the file that includes it"):
        load(file)


def test_an_entity_bomb_is_refused_at_once():
    names = "abcdefghijklmnop"
    entities = "\n".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in pairwise(names))
    bomb = f'<?xml version="1.0"?>\n<!DOCTYPE robot [\n<!ENTITY a "ha">\n{entities}\n]>\n<robot name="&p;">&p;</robot>'
    start = time.perf_counter()
    assert defects(bomb) == [(2, "a document type declaration is not allowed, None, None")]
    assert time.perf_counter() - start < allow(1)


def test_a_comment_may_speak_of_declarations():
    assert native.parse(edited((2, '<link name="base"/><!-- <!DOCTYPE x> -->'))).base == "base"


@pytest.mark.parametrize("sign", ["&#10;", "&#x0A;", "&#013;", "&#xd;", "&#9;"])
def test_a_name_is_one_line(sign: str):
    text = FOUR_BAR.replace('"base"', f'"ba{sign}se"')
    found = native.parse(text.replace('<robot name="', f'<robot name="a{sign}'))
    assert (found.base, found.name[:2]) == ("ba se", "a ")
    kept = native.parse(FOUR_BAR.replace('"base"', '"ba&#160;se"'))
    assert kept.base == "ba\xa0se"


@pytest.mark.parametrize(
    ("changes", "residual"),
    [
        ([(30, '<origin xyz="2 0 1"/>')], 1.0),
        ([(9, '<origin rpy="0 0.1 0"/>')], 0.1),
        ([UNIVERSAL, (30, '<origin xyz="2 0 1"/>'), (32, '<axis xyz="0 1 0"/><axis2 xyz="0 1 0"/>')], 1.0),
        (
            [('<loop name="d" type="revolute">', '<loop name="d" type="prismatic">'), (30, '<origin rpy="3.1 0 0"/>')],
            3.1,
        ),
        ([(30, '<origin xyz="2 0 0" rpy="3.14159265358979 0 0"/>')], 3.1416),
    ],
)
def test_an_open_loop_is_named_with_its_residual(changes: list, residual: float):
    with pytest.raises(LoopClosureFailure) as caught:
        native.parse(edited(*changes), "robot.urdf")
    error = caught.value
    assert (error.exit_status, error.loop) == (3, "d")
    assert residual / 4 < error.residual < residual * 4
    assert "robot.urdf:25" in error.lines()[0]
    assert "--tolerance" not in error.lines()[0]  # no rounding opens a loop so far


@pytest.mark.parametrize(
    ("kind", "origin"),
    [
        ("prismatic", '<origin xyz="2 7 0"/>'),
        ("cylindrical", '<origin xyz="2 -3 0" rpy="0 1 0"/>'),
        ("continuous", '<origin xyz="2 0 0" rpy="0 2 0"/>'),
        ("spherical", '<origin xyz="2 0 0" rpy="1 2 3"/>'),
        ("planar", '<origin xyz="9 0 9" rpy="0 2 0"/>'),
        ("fixed", '<origin xyz="2 0 0"/>'),
    ],
)
def test_a_loop_is_closed_wherever_its_joint_may_be(kind: str, origin: str):
    text = edited(('<loop name="d" type="revolute">', f'<loop name="d" type="{kind}">'), (30, origin))
    assert native.parse(text).joints["d"].in_tree is False


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_but_never_breaks(data: st.DataObject):
    words = ['"', "<", ">", "/", "0", "nan", "1e308", "-1e9", "base", "bar", "link", "loop", "fixed", "universal", "&"]
    text = FOUR_BAR
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        text = text[:at] + data.draw(st.sampled_from(words)) + text[at + data.draw(st.integers(0, 8)) :]
    with contextlib.suppress(BadRobotFile, LoopClosureFailure):
        robot = native.parse(text, "x")
        again = native.parse(native.write(robot))
        assert again.platform == robot.platform


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("<observe", "<observ", "unknown element in <hrsynth>: got <observ>"),
        ("<platform", '<loop name="z"/><platform', "unknown element in <hrsynth>: got <loop>"),
        ("</joint>", '<mimic joint="a"/></joint>', "<mimic>: the native format has <coupling> instead"),
    ],
)
def test_what_would_change_the_robot_is_not_passed_over(old: str, new: str, what: str) -> None:
    text = FOUR_BAR if old in FOUR_BAR else FOUR_BAR.replace("</hrsynth>", '<observe leg="1" link="bar"/></hrsynth>')
    with pytest.raises(BadRobotFile) as caught:
        native.parse(text.replace(old, new, 1))
    assert any(what in line for line in caught.value.lines())


@pytest.mark.parametrize("label", ["all", "1,2"])
def test_a_label_that_no_list_of_legs_could_name_is_refused(label: str) -> None:
    text = FOUR_BAR
    if "<observe" not in text:
        text = text.replace("</hrsynth>", '<observe leg="1" link="bar"/></hrsynth>')
    with pytest.raises(BadRobotFile, match="not usable in a list"):
        native.parse(text.replace('leg="1"', f'leg="{label}"'))
