"""Robots of macros, properties, includes and conditions: what they expand to, and where in their files a mistake is."""

from __future__ import annotations

import math
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hrsynth
from hrsynth.description import load, native
from hrsynth.description.formats.urdf.xacro import expand
from hrsynth.description.formats.urdf.xacro_process import CONSTANTS, MATH, PYTHON, VALUES, Expression
from hrsynth.description.meshes import locate_mesh
from hrsynth.errors import BadRequest, BadRobotFile, HrsynthError
from patience import allow

xacro = pytest.importorskip("xacro")

HEAD = '<robot name="arms" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
PARTS = (
    HEAD
    + """  <xacro:property name="crank" value="0.4"/>
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
)
MAIN = (
    HEAD
    + """  <xacro:include filename="parts.xacro"/>
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
)


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
    (tmp_path / "robot.urdf.xacro").write_text(
        plain.replace('xyz="-0.3 0 0"', 'xyz="${-0.6 / 2} 0 0"', 1).replace(
            "<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1
        )
    )
    (tmp_path / "plain.urdf").write_text(plain)
    assert load(tmp_path / "robot.urdf.xacro").differences(load(tmp_path / "plain.urdf")) == []


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ('parent link="base"', 'parent link="bass"', '<joint name="shoulder', "unknown link: got bass"),
        ('xyz="${x} 0 0"', 'xyz="${x} 0"', 'xyz="${x} 0"', "expected 3 numbers"),
        ('xyz="${1.5', 'xyz="a ${1.5', "<predecessor", "finite numbers"),
        ("${x / 2}", "${x / nothing}", "x / nothing", "name 'nothing' is not defined"),
        ("sqrt(0.36)", "sqrt(0.36", "<predecessor", "'(' was never closed"),
        ("sqrt(0.36)", "root(0.36)", "<predecessor", "name 'root' is not defined"),
        ('n="2" x="${w}"', 'n="2"', 'leg n="2"', "Undefined parameters [x] (in macro 'leg')"),
        ('"parts.xacro"', '"part.xacro"', "part.xacro", "No such file"),
        ('<link name="prox_${n}"/>', '<link name="prox_${n}">', "</xacro:macro>", "mismatched tag"),
        ("${w > 0}", "${w > 0", "<xacro:if", "xacro refuses it"),
    ],
)
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
    assert refused.value.lines()[0].startswith(f"{place_of(tmp_path, '<loop')}: loop 'end' is open")


def test_lint_tells_lines(tmp_path: Path):
    found = hrsynth.lint(written(tmp_path, 'parent link="base"', 'parent link="bass"')).findings
    assert {f"{each.file}:{each.line}" for each in found if "unknown link" in each.message} == {
        place_of(tmp_path, '<joint name="shoulder')
    }


NAMES = {**CONSTANTS, "x": 0.25, "n": 3, "side": "left", "legs": {"a": {"length": 2}, "b": [1, 2.5]}, "none": None}
FUNCTIONS = {**MATH, **PYTHON, **{f"math.{name}": call for name, call in MATH.items()}}
NUMBER = st.recursive(
    st.sampled_from(["x", "n", "2", "0.5", "-3", "pi", "legs['b'][1]", "legs['a']['length']", "len(side)"]),
    lambda part: st.one_of(
        st.tuples(part, st.sampled_from(["+", "-", "*", "/", "//", "%"]), part).map(lambda each: f"({' '.join(each)})"),
        st.tuples(part, st.sampled_from(["<", "<=", "==", "!="]), part, part, part).map(
            lambda each: f"({each[3]} if {each[0]} {each[1]} {each[2]} else {each[4]})"
        ),
        st.tuples(part, st.sampled_from(["and", "or"]), part).map(lambda each: f"({' '.join(each)})"),
        st.tuples(st.sampled_from(["cos", "abs", "float", "not"]), part).map(lambda each: f"({each[0]} ({each[1]}))"),
        st.tuples(part, part).map(lambda each: f"max({each[0]}, {each[1]})"),
        part.map(lambda each: f"[{each}, 1, {each}][-1]"),
    ),
    max_leaves=8,
)


def outcome(call, text: str):
    """A value, or the kind of error."""
    try:
        return call(text)
    except (ArithmeticError, ValueError) as error:
        return type(error).__name__


@given(NUMBER)
def test_expressions_have_the_value_that_python_gives(text: str):
    mine = outcome(Expression(NAMES, FUNCTIONS).evaluate, text)
    assert repr(mine) == repr(outcome(lambda each: eval(each, {**FUNCTIONS, **NAMES, "math": math}), text))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("'leg_' + side", "leg_left"),
        ("'%s_%d' % (side, n)", "left_3"),
        ("side == 'left' and n in [1, 3]", True),
        ("legs.a.length", 2),
        ("side.upper()[0:2]", "LE"),
        ("math.sqrt(math.pi ** 2)", math.pi),
        ("1 < n < 4", True),
        ("none is None", True),
        ("'a,b'.split(',')[1]", "b"),
        ("dict(k=n)['k']", 3),
        ("list(map(float, '1 2'.split(' ')))", [1.0, 2.0]),
        ("list(range(2))", [0, 1]),
        ("2 ** 3 ** 2", 512),
    ],
)
def test_expressions_of_robot_files_are_evaluated(text: str, value: object):
    assert Expression(NAMES, FUNCTIONS).evaluate(text) == value


OBJECTS = "python.vars(python.type(python.type(0)))['__getattribute__'](python.type(0), '__base__')"
ESCAPES = {
    "an inner code object": "(lambda: [c for c in ().__class__.__base__.__subclasses__() if c.__name__ == "
    "'_wrap_close'][0].__init__.__globals__['system']('touch MADE'))()",
    "vars of a type": f"python.vars({OBJECTS})['__getattribute__'](xacro.load_yaml, '__globals__')['os']"
    ".system('touch MADE')",
    "a format": "'{0.__class__.__init__.__globals__}'.format(legs)",
    "a function as a value": "[xacro.load_yaml][0]('x')",
    "a type": "python.type(0)",
    "vars": "vars(math)",
    "a module": "math",
    "a namespace": "xacro",
    "hash": "python.hash",
    "a comprehension": "[c for c in 'ab']",
    "a lambda": "(lambda: 0)",
    "a walrus": "(a := 1)",
    "an f-string": "f'{side!r}'",
    "a starred": "max(*[1, 2])",
    "double stars": "dict(**legs)",
    "bytes": "b'a'",
    "a dunder": "side.__class__",
    "a generator": "sum(i for i in [1])",
    "await": "await side",
    "an item of a text": "side.real",
    "import": "__import__('os')",
    "a map of a method": "map(side.upper, [1])",
    "a map of what is not on the list": "map(eval, ['1'])",
    "eval": "eval('1')",
    "open": "open('MADE', 'w')",
    "getattr": "getattr(side, 'upper')",
}


@pytest.mark.parametrize("name", ESCAPES)
def test_what_is_not_on_the_list_is_refused(name: str):
    with pytest.raises((ValueError, NameError, TypeError, KeyError, SyntaxError)):
        Expression(NAMES, FUNCTIONS).evaluate(ESCAPES[name])


@pytest.mark.parametrize("form", ["${%s}", "$(eval %s)"])
@pytest.mark.some(6)
@pytest.mark.parametrize("name", ESCAPES)
def test_opening_a_file_runs_nothing(name: str, form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    value = (form % ESCAPES[name]).replace("'", "&apos;").replace("<", "&lt;")
    path = tmp_path / "robot.urdf"
    path.write_text(HEAD + f'<link name="base"/><link name="b"/><link name="a{value}"/></robot>')
    with pytest.raises(BadRobotFile) as refused:
        load(path)
    assert refused.value.lines()[0].startswith(f"{path}:2: xacro refuses it: ")
    assert {each.name for each in tmp_path.iterdir()} == {"robot.urdf"}


ATOMS = st.sampled_from(["x", "legs", "side", "math", "max", "str", "1", "''", "None"])


@given(
    st.recursive(
        ATOMS,
        lambda part: st.one_of(
            part.map(lambda each: f"({each}).upper"),
            st.tuples(part, part).map(lambda each: f"{each[0]}[{each[1]}]"),
            st.tuples(part, part).map(lambda each: f"{each[0]}({each[1]})"),
            part.map(lambda each: f"{each}.__class__"),
            st.tuples(part, part).map(lambda each: f"({each[0]} + {each[1]})"),
            part.map(lambda each: f"dict(k={each})"),
        ),
    )
)
def test_no_expression_has_an_object_of_python_as_its_value(text: str):
    try:
        found = Expression(NAMES, FUNCTIONS).evaluate(text)
    except (ValueError, NameError, TypeError, KeyError, IndexError, SyntaxError):
        return
    pending = [found]
    while pending:
        each = pending.pop()
        assert type(each) in VALUES
        if isinstance(each, dict):
            pending += [*each.keys(), *each.values()]
        elif isinstance(each, list | tuple):
            pending += each


LARGE = {
    "a power": "${9 ** 9 ** 9}",
    "a text": "${'a' * 10 ** 12}",
    "a list": "${list(range(10 ** 12))}",
    "a width": "${'%999999999999d' % 1}",
    "a factorial": "${factorial(10 ** 9)}",
    "a long name": "${'a' * 10 ** 8}",
    "signs": "${" + "-" * 5000 + "1}",
    "parentheses": "${" + "(" * 5000 + "1" + ")" * 5000 + "}",
    "another file": "${xacro.load_yaml('/etc/passwd')}",
    "a file above": "${xacro.load_yaml('../settings.yaml')}",
}


@pytest.mark.some(3, 8)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "a factorial" else name for name in LARGE]
)
def test_large_values_and_other_files_are_refused_in_time(name: str, tmp_path: Path):
    folder = tmp_path / "robot"
    folder.mkdir()
    (tmp_path / "settings.yaml").write_text("a: 1\n")
    (folder / "robot.urdf").write_text(HEAD + f'<link name="a{LARGE[name]}"/></robot>')
    start = time.monotonic()
    with pytest.raises(BadRobotFile) as refused:
        load(folder / "robot.urdf")
    assert time.monotonic() - start < allow(20)
    assert len(refused.value.lines()[0]) < 1000


def test_the_environment_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("HRSYNTH_SECRET", "secret")
    (tmp_path / "robot.urdf").write_text(
        HEAD + '<link name="a$(optenv HRSYNTH_SECRET none)b$(env HRSYNTH_SECRET)"/></robot>'
    )
    assert expand(tmp_path / "robot.urdf")[0][0].get("name") == "anoneb"


def test_settings_of_the_own_folder_are_read(tmp_path: Path):
    path = written(tmp_path, '"crank" value="0.4"', '"crank" value="${xacro.load_yaml(\'arms.yaml\').crank[0]}"')
    (tmp_path / "arms.yaml").write_text("crank: [0.4]\n")
    assert load(path).differences(load(written(tmp_path))) == []


def test_a_document_type_of_an_included_file_is_refused(tmp_path: Path):
    path = written(tmp_path)
    (tmp_path / "parts.xacro").write_text('<!DOCTYPE robot [<!ENTITY a "b">]>\n' + PARTS)
    with pytest.raises(BadRobotFile, match="document type declaration"):
        load(path)


def test_a_package_ends_where_it_says_so(tmp_path: Path):
    """``$(find …)`` reaches the folder of the package, else the folder above; links and patterns lead nowhere."""
    inner = tmp_path / "outer" / "package" / "urdf" / "arms"
    inner.mkdir(parents=True)
    path = inner / "robot.urdf"
    places = {"arms": inner, "urdf": inner.parent, "package": inner.parents[1], "outer": inner.parents[2]}
    for name, folder in places.items():
        (folder / f"{name}.yaml").write_text(f"name: {name}\n")
    (inner / "link.yaml").symlink_to(tmp_path / "outer" / "outer.yaml")
    (inner / "linked").symlink_to(tmp_path / "outer")
    (tmp_path / "outer" / "beside").symlink_to(tmp_path)
    (tmp_path / "secret.yaml").write_text("name: secret\n")

    def reads(spec: str) -> bool:
        path.write_text(HEAD + f"<link name=\"a${{load_yaml('{spec}').name}}\"/></robot>")
        try:
            return expand(path)[0][0].get("name") != ""
        except BadRobotFile:
            return False

    assert [reads(f"$(find {name})/{name}.yaml") for name in places] == [True, True, False, False]
    (inner.parents[1] / "package.xml").write_text("<package/>")
    assert [reads(f"$(find {name})/{name}.yaml") for name in places] == [True, True, True, False]
    assert reads("../urdf.yaml")
    outside = (
        "$(find package)/../outer.yaml",
        "$(find beside)/secret.yaml",
        "$(find etc)/hostname",
        "../../../outer.yaml",
    )
    assert not any(map(reads, (*outside, "link.yaml", "linked/outer.yaml", "link*/outer.yaml")))


FOLDERS = {"a": "a", "b": "b-main", "c": "c"}
"""Folders of the packages in a workspace; ``c`` is named by its folder alone."""
RESTS = "x.yaml", "urdf/x.yaml", "urdf/kit/x.yaml"


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """Folder of packages: every file says its path. The folder ``b`` is another package."""
    for name, folder in FOLDERS.items():
        for rest in RESTS:
            path = tmp_path / folder / rest
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"name: {folder}/{rest}\n")
        if name != "c":
            (tmp_path / folder / "package.xml").write_text(
                f"<?xml version='1.0'?><package format='2'><!-- <name>c</name> --><name> {name} </name></package>"
            )
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "package.xml").write_text("<package><name>other</name></package>")
    return tmp_path


@pytest.mark.parametrize("inner", ["urdf/kit", "urdf", "."])
def test_a_path_in_a_package_names_exactly_one_file(workspace: Path, inner: str):
    path = workspace / "a" / inner / "robot.urdf"
    asked = [(name, rest) for name in FOLDERS for rest in RESTS]
    links = (f"<link name=\"${{load_yaml('$(find {name})/{rest}').name}}\"/>" for name, rest in asked)
    path.write_text(HEAD + "".join(links) + "</robot>")
    said = [link.get("name") for link in expand(path)[0]]
    assert said == [f"{FOLDERS[name]}/{rest}" for name, rest in asked]


@pytest.mark.parametrize(
    ("variable", "root", "found"),
    [
        ("AMENT_PREFIX_PATH", "", True),
        ("AMENT_PREFIX_PATH", "share", False),
        ("ROS_PACKAGE_PATH", "share/d", True),
        ("ROS_PACKAGE_PATH", "share", True),
        ("ROS_PACKAGE_PATH", "", True),
        ("ROBOT_DESCRIPTIONS_CACHE", "", True),
    ],
)
def test_an_installed_package_is_found(
    workspace: Path, variable: str, root: str, found: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Files that it names and its meshes; a link out of it leads nowhere."""
    installed = tmp_path / "installed" / "share" / "d"
    (installed / "meshes").mkdir(parents=True)
    (installed / "x.xacro").write_text(HEAD + '<link name="inside"/></robot>')
    (installed / "meshes" / "near.stl").write_text("solid")
    (tmp_path / "far.stl").write_text("solid")
    (installed / "meshes" / "far.stl").symlink_to(tmp_path / "far.stl")
    path = workspace / "a" / "urdf" / "robot.urdf"
    path.write_text(HEAD + '<xacro:include filename="$(find d)/x.xacro"/></robot>')
    for name in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH", "ROBOT_DESCRIPTIONS_CACHE"):
        monkeypatch.setenv(name, "")
    with pytest.raises(BadRobotFile, match=r"no package 'd': .*nor in ROS_PACKAGE_PATH"):
        expand(path)
    monkeypatch.setenv(variable, str(tmp_path / "installed" / root))
    mesh = locate_mesh("package://d/meshes/near.stl", path.parent)
    assert mesh == (installed / "meshes" / "near.stl" if found else None)
    assert locate_mesh("package://d/meshes/far.stl", path.parent) is None
    assert locate_mesh("package://d/../../../far.stl", path.parent) is None
    if found:
        assert [link.get("name") for link in expand(path)[0]] == ["inside"]
    else:
        with pytest.raises(BadRobotFile, match="no package 'd'"):
            expand(path)


@pytest.mark.parametrize("folder", ["a", "b-main"])
def test_an_absent_package_or_file_is_refused_by_name(workspace: Path, folder: str):
    path = workspace / folder / "urdf" / "robot.urdf"
    path.write_text(HEAD + '\n<xacro:include filename="$(find d)/urdf/x.xacro"/></robot>')
    with pytest.raises(BadRobotFile, match=rf"robot.urdf:3: .*no package 'd': .* up to {folder}/, nor beside"):
        expand(path)
    path.write_text(HEAD + '<xacro:include filename="$(find a)/kit/x.yaml"/></robot>')
    with pytest.raises(BadRobotFile, match=r"No such file or directory: .*/a/kit/x.yaml"):
        expand(path)


def test_a_copy_out_of_a_package_is_read_and_told(tmp_path: Path):
    """Without a manifest the package is not known: the files beside the file are taken, which is told."""
    text = MAIN.replace('"parts.xacro"', '"$(find arms_description)/urdf/parts.xacro"')
    meant = load(written(tmp_path))
    (tmp_path / "arms.xacro").write_text(text)
    robot = load(tmp_path / "arms.xacro")
    assert robot.differences(meant) == []
    (told,) = {note.text for note in robot.notes} - {note.text for note in meant.notes}
    assert "the package 'arms_description', which is not here," in told
    (tmp_path / "package.xml").write_text("<package><name>other</name></package>")
    with pytest.raises(BadRobotFile, match="no package 'arms_description'"):
        load(tmp_path / "arms.xacro")
    (tmp_path / "package.xml").unlink()
    (tmp_path / "arms.xacro").write_text(MAIN.replace('"parts.xacro"', '"$(find arms_description)/urdf/arms.xacro"'))
    with pytest.raises(BadRobotFile, match="no package 'arms_description'"):
        load(tmp_path / "arms.xacro")


def test_a_path_without_package_starts_at_the_file_that_says_it(workspace: Path):
    for folder, name in (("a", "near"), ("b-main", "far")):
        (workspace / folder / "urdf" / "parts.xacro").write_text(HEAD + f'<link name="{name}"/></robot>')
    (workspace / "b-main" / "urdf" / "all.xacro").write_text(HEAD + '<xacro:include filename="parts.xacro"/></robot>')
    path = workspace / "a" / "urdf" / "robot.urdf"
    path.write_text(HEAD + '<xacro:include filename="$(find b)/urdf/all.xacro"/></robot>')
    assert [link.get("name") for link in expand(path)[0]] == ["far"]


def test_what_the_package_warns_of_is_not_collected(tmp_path: Path):
    name = "n" * 200_000
    path = tmp_path / "robot.urdf"
    path.write_text(
        HEAD + f'<xacro:macro name="{name}" params="k"><xacro:property name="pi" value="1"/>'
        f'<xacro:if value="${{k}}"><xacro:{name} k="${{k - 1}}"/></xacro:if></xacro:macro>'
        f'<xacro:{name} k="20"/><link name="a"/></robot>'
    )
    assert expand(path)[0][0].get("name") == "a"


@pytest.mark.parametrize("args", [{"wide": 0.45}, ["wide:=0.45"], "wide:=0.45"])
def test_an_argument_replaces_the_default(tmp_path: Path, args: object):
    robot = load(written(tmp_path), args=args)
    meant = load(written(tmp_path, 'default="0.3"', 'default="0.45"'))
    assert robot.differences(meant) == []
    assert robot.differences(load(written(tmp_path, 'default="0.3"', 'default="0.3"'))) != []
    with pytest.raises(BadRequest, match=r"declares no such argument: got 'wid', expected wide"):
        load(written(tmp_path), args={"wid": 0.4})
    with pytest.raises(BadRequest, match=r"--arg: got 'wide=0.4', expected NAME:=VALUE"):
        load(written(tmp_path), args=["wide=0.4"])


@pytest.mark.parametrize("value", [True, "true", "1"])
def test_arguments_of_an_open_file_are_told_and_may_close_it(tmp_path: Path, value: object):
    declared = MAIN.replace(
        '<xacro:arg name="wide"', '<xacro:arg name="loops" default="false"/>\n<xacro:arg name="wide"'
    )
    text = declared.replace('"${w > 0}"', '"$(arg loops)"', 1).replace("<xacro:unless", "<xacro:if", 1)
    text = text.replace('"${w > 0}"> <link name="nothing"/> </xacro:unless>', '"false"/>').replace("<hrsynth>", "<!--")
    (tmp_path / "arms.xacro").write_text(text.replace("</hrsynth>", "-->"))
    (tmp_path / "parts.xacro").write_text(PARTS)
    path = tmp_path / "arms.xacro"
    told = [note.text for note in load(path, platform="dist_1").notes if note.kind == "open"]
    assert any("now loops:=false, wide:=0.3 (--arg NAME:=VALUE" in each for each in told)
    robot = load(path, platform="dist_1", args={"loops": value})
    assert robot.joints["end"].links == ("dist_1", "dist_2")
    assert hrsynth.check(robot).setup.mobility.total == 2
    assert not any("--arg" in note.text for note in robot.notes)
    assert hrsynth.lint(path, args={"loops": value}, platform="dist_1").counts["error"] == 0
