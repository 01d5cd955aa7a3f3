"""Robots of macros, properties, includes and conditions: what they expand to, and where in their files a mistake is."""

from __future__ import annotations

from pathlib import Path

import pytest

import hrsynth
from hrsynth.description import load, native
from hrsynth.errors import BadRobotFile, HrsynthError

xacro = pytest.importorskip("xacro")

HEAD = '<robot name="arms" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
PARTS = HEAD + """  <xacro:property name="crank" value="0.4"/>
  <xacro:macro name="leg" params="n x *axis">
    <link name="prox_${n}"/>
    <link name="dist_${n}"/>
    <joint name="shoulder_${n}" type="continuous"> <parent link="base"/> <child link="prox_${n}"/>
      <origin xyz="${x} 0 0"/>
      <xacro:insert_block name="axis"/> </joint>
    <joint name="elbow_${n}" type="continuous"> <parent link="prox_${n}"/> <child link="dist_${n}"/>
      <origin xyz="${x / 2} ${crank * cos(radians(30))} 0"/>
      <xacro:insert_block name="axis"/> </joint>
    <transmission name="motor_${n}"> <joint name="shoulder_${n}"/> </transmission>
  </xacro:macro>
</robot>
"""
MAIN = HEAD + """  <xacro:include filename="parts.xacro"/>
  <xacro:arg name="wide" default="0.3"/>
  <xacro:property name="w" value="$(arg wide)"/>
  <xacro:property name="tip" value="${sqrt(0.36)}"/>
  <link name="base"/>
  <xacro:leg n="1" x="${-w}"> <axis xyz="0 0 1"/> </xacro:leg>
  <xacro:leg n="2" x="${w}"> <axis xyz="0 0 1"/> </xacro:leg>
  <xacro:if value="${w > 0}">
    <loop name="end" type="revolute">
      <predecessor link="dist_1"> <origin xyz="${1.5 * w} ${tip - crank * cos(radians(30))} 0"/> </predecessor>
      <successor link="dist_2"> <origin xyz="${-1.5 * w} ${tip - crank * cos(radians(30))} 0"/> </successor>
      <axis xyz="0 0 1"/>
    </loop>
  </xacro:if>
  <xacro:unless value="${w > 0}"> <link name="nothing"/> </xacro:unless>
  <hrsynth> <platform link="dist_1"/> </hrsynth>
</robot>
"""


def written(folder: Path, old: str = "", new: str = "") -> Path:
    """The robot's two files, with one change in either of them."""
    assert not old or old in PARTS + MAIN
    (folder / "parts.xacro").write_text(PARTS.replace(old, new) if old else PARTS)
    (folder / "arms.xacro").write_text(MAIN.replace(old, new) if old else MAIN)
    return folder / "arms.xacro"


def place_of(folder: Path, text: str) -> str:
    """The file and the line in which a text stands first."""
    for path in (folder / "parts.xacro", folder / "arms.xacro"):
        before, found, _ = path.read_text().partition(text)
        if found:
            return f"{path}:{before.count(chr(10)) + 1}"
    raise AssertionError(text)


def test_it_is_the_robot_that_the_package_expands_it_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = written(tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plain.urdf").write_text(xacro.process_file(str(path)).toxml())
    robot = load(path)
    assert robot.differences(load(tmp_path / "plain.urdf")) == []
    text = native.write(robot)
    assert "places" not in text
    assert native.write(native.parse(text)) == text


def test_expressions_alone_are_expanded(tmp_path: Path):
    """A file without a macro or property that declares the prefix."""
    plain = native.write(load(written(tmp_path)))
    assert 'xyz="-0.3 0 0"' in plain
    (tmp_path / "robot.urdf.xacro").write_text(plain.replace('xyz="-0.3 0 0"', 'xyz="${-0.6 / 2} 0 0"', 1).replace(
        "<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1))
    (tmp_path / "plain.urdf").write_text(plain)
    assert load(tmp_path / "robot.urdf.xacro").differences(load(tmp_path / "plain.urdf")) == []


@pytest.mark.parametrize(("old", "new", "place", "words"), [
    ('parent link="base"', 'parent link="bass"', "<joint name=\"shoulder", "unknown link, found bass"),
    ('xyz="${x} 0 0"', 'xyz="${x} 0"', 'xyz="${x} 0"', "allowed: 3 numbers"),
    ('xyz="${1.5', 'xyz="a ${1.5', "<predecessor", "finite numbers"),
    ("${x / 2}", "${x / nothing}", "x / nothing", "name 'nothing' is not defined"),
    ("sqrt(0.36)", "sqrt(0.36", "<predecessor", "'(' was never closed"),
    ("sqrt(0.36)", "root(0.36)", "<predecessor", "name 'root' is not defined"),
    ('n="2" x="${w}"', 'n="2"', 'leg n="2"', "Undefined parameters [x] (in macro 'leg')"),
    ('"parts.xacro"', '"part.xacro"', "part.xacro", "No such file"),
    ('<link name="prox_${n}"/>', '<link name="prox_${n}">', "</xacro:macro>", "mismatched tag"),
    ("${w > 0}", "${w > 0", "<xacro:if", "xacro refuses it"),
])
def test_a_mistake_is_told_where_it_is(old: str, new: str, place: str, words: str, tmp_path: Path):
    path = written(tmp_path, old, new)
    with pytest.raises(BadRobotFile) as refused:
        load(path)
    line = refused.value.lines()[0]
    assert line.startswith(f"{place_of(tmp_path, place)}: ")
    assert words in line
    assert "\n" not in line


def test_an_open_loop_is_told_where_it_is(tmp_path: Path):
    path = written(tmp_path, "${1.5 * w}", "${2.5 * w}")
    with pytest.raises(HrsynthError) as refused:
        load(path)
    assert refused.value.lines()[0].startswith(f"{place_of(tmp_path, '<loop')}: the loop 'end' is open")


def test_lint_tells_lines(tmp_path: Path):
    found = hrsynth.lint(written(tmp_path, 'parent link="base"', 'parent link="bass"')).findings
    assert {f"{each.file}:{each.line}" for each in found if "unknown link" in each.message} == {
        place_of(tmp_path, '<joint name="shoulder')}
