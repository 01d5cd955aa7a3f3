"""Hostile and broken files: refused in one line, exit status 2, within 5 s and 1 GB; nothing fetched or written."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

from description.foreign.examples import FILES, MJCF, SDF, URDF
from hrsynth.description import load
from hrsynth.description.elements import FILE_DEFECTS_MAX
from hrsynth.description.xml import _find_comments as comments
from hrsynth.errors import HrsynthError, MissingExtra
from patience import allow

SECONDS, BYTES = 5, 1_000_000_000


def assert_refused(path: Path, *words: str) -> str:
    start = time.process_time()
    before = sorted(each.name for each in path.parent.iterdir())
    with pytest.raises(HrsynthError) as caught:
        load(path)
    assert time.process_time() - start < allow(SECONDS)
    assert sorted(each.name for each in path.parent.iterdir()) == before
    assert caught.value.exit_status == 2
    lines = caught.value.lines()
    assert all("\n" not in line and len(line) < 1000 for line in lines)
    assert all(word in lines[0] for word in words), lines[0]
    return lines[0]


def made(folder: Path, text: str | bytes, name: str = "robot.xml") -> Path:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / name


ONE = {"urdf": URDF["urdf+"], "mjcf": MJCF["connect"], "sdf": SDF["1.7"]}


@pytest.mark.parametrize("dialect", ONE)
def test_entities_are_not_expanded(dialect: str, tmp_path: Path):
    names = "abcdefghij"
    bomb = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in pairwise(names))
    for head in (
        f'<!DOCTYPE x [<!ENTITY a "ha">{bomb}]>',
        '<!DOCTYPE x SYSTEM "file:///etc/passwd">',
        '<!DOCTYPE x [<!ENTITY a SYSTEM "http://127.0.0.1:9/x">]>',
    ):
        assert_refused(
            made(tmp_path, head + ONE[dialect].replace("four_bar", "&a;", 1)),
            "a document type declaration",
            "not allowed",
        )


@pytest.mark.parametrize(
    ("dialect", "old", "new", "allowed"),
    [
        ("mjcf", r'(body\d=")([^"]+)"', r'\1nobody"', r"world, \w+"),
        ("sdf", r"(<child>)([^<]+)<", r"\1nobody<", r"\w+, \w+"),
    ],
)
def test_an_unknown_name_tells_those_that_there_are(dialect: str, old: str, new: str, allowed: str, tmp_path: Path):
    text, count = re.subn(old, new, ONE[dialect], count=1)
    assert count
    line = assert_refused(made(tmp_path, text), "unknown", "got nobody")
    assert re.search(f", expected {allowed}", line), line


def test_a_cut_settings_file_is_refused_with_what_is_wanted(tmp_path: Path):
    made(tmp_path, URDF["urdf+"], "robot.urdf")
    assert_refused(made(tmp_path, 'closed_loop: [["a", "b"', "robot.yaml"), "not YAML", "expected a whole YAML file")


@pytest.mark.parametrize("dialect", ONE)
def test_broken_text_is_refused_with_its_line(dialect: str, tmp_path: Path):
    text = ONE[dialect]
    assert_refused(made(tmp_path, text.encode("utf-16")), "not UTF-8", "a file in UTF-8")
    assert_refused(made(tmp_path, text.encode().replace(b"four_bar", b"four\xff", 1)), "not UTF-8")
    for cut in (10, 100, len(text) - 3):
        assert_refused(made(tmp_path, text[:cut]), "malformed XML")
    assert_refused(made(tmp_path, ""), "empty file")


@pytest.mark.parametrize("dialect", ONE)
@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e400", "1e10", "0x1", "1_0", "١"])
def test_numbers_are_numbers(dialect: str, number: str, tmp_path: Path):
    text = ONE[dialect].replace("0.0 0.0 0.0", f"0.0 {number} 0.0", 1)
    assert number in text
    assert_refused(made(tmp_path, text))


def test_deep_nesting_is_assert_refused(tmp_path: Path):
    deep = "<body><joint/>" * 5000 + "</body>" * 5000
    assert_refused(made(tmp_path, f"<mujoco><worldbody>{deep}</worldbody></mujoco>"), "malformed XML")
    assert_refused(made(tmp_path, '<sdf version="1.9">' + '<model name="m">' * 5000 + "</model>" * 5000 + "</sdf>"))
    assert_refused(made(tmp_path, "<mujoco>" + '<default class="a">' * 250 + "</default>" * 250 + "</mujoco>"))
    models = "".join(f'<model name="m{i}">' for i in range(100)) + "<link name='l'/>" + "</model>" * 100
    assert_refused(made(tmp_path, f'<sdf version="1.9">{models}</sdf>'))


LINK = "<link name='l{0}'/>"
CHAIN = LINK + "<joint name='j{0}' type='fixed'><parent link='l{1}'/><child link='l{0}'/></joint>"
MANY = {
    "urdf": ("<robot name='r'>{}</robot>", LINK, 600_000),
    "urdf chain": ("<robot name='r'><link name='l-1'/>{}</robot>", CHAIN, 100_000),
    "mjcf": ("<mujoco><worldbody>{}</worldbody></mujoco>", "<body><joint/></body>", 500_000),
    "sdf": ("<sdf version='1.9'><model name='m'>{}</model></sdf>", LINK, 500_000),
    "joints of one body": ("<mujoco><worldbody><body>{}</body></worldbody></mujoco>", "<joint type='slide'/>", 90_000),
    "joints of joints": (
        "<sdf version='1.9'><model name='m'><link name='j-1'/>{}</model></sdf>",
        "<joint name='j{0}' type='ball'><parent>world</parent><child>j{1}</child></joint>",
        30_000,
    ),
    "keyframes": (
        "<mujoco><worldbody><body><joint/></body></worldbody><keyframe>{}</keyframe></mujoco>",
        "<key qpos='0'/>",
        90_000,
    ),
    "defects": (
        "<mujoco><worldbody><body><joint/></body></worldbody><equality>{}</equality></mujoco>",
        "<connect body1='l{0}' body2='l{1}'/>",
        3_900,
    ),
    "unknown elements": ("<robot name='r'><link name='l'/>{}</robot>", "<a b='1'/>", 1_500_000),
    "just too many unknown ones": ("<robot name='r'><link name='l'/>{}</robot>", "<a b='1'/>", 100_000),
    "just too many": ("<robot name='r'><link name='l-1'/>{}</robot>", CHAIN, 2_001),
    "just not too many": ("<robot name='r'><link name='l-1'/>{}</robot>", CHAIN.replace("fixed", "continuous"), 990),
}


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=pytest.mark.slow) if number > 1 else each for number, each in enumerate(MANY)]
)
def test_a_million_links_are_refused_in_time_and_memory(name: str, tmp_path: Path):
    frame, part, count = MANY[name]
    path = made(tmp_path, frame.format("".join(part.format(i, i - 1) for i in range(count))))
    # VmHWM: ru_maxrss would count the memory of this process too, from which the other one is started
    told = tmp_path / "status"
    code = (
        f"import resource; resource.setrlimit(resource.RLIMIT_CPU, ({SECONDS}, {SECONDS}))\n"
        f"import atexit, pathlib as p\n"
        f"atexit.register(lambda: p.Path({str(told)!r}).write_text(p.Path('/proc/self/status').read_text()))\n"
        f"from hrsynth.description import load\nfrom hrsynth.cli import main\n"
        f"main(['convert', {str(path)!r}, {str(tmp_path / 'out.sdf')!r}])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    few = name == "just not too many"
    assert run.returncode == (0 if few else 2), run.stderr[-500:]
    assert (tmp_path / "out.sdf").exists() is few
    lines = {"just not too many": 2, "defects": FILE_DEFECTS_MAX // 2 + 1}.get(name, 1)  # most are met twice
    assert len(run.stderr.splitlines()) == lines  # that it is an open chain, and its platform
    (peak,) = re.findall(r"VmHWM:\s+(\d+) kB", told.read_text())
    assert 1_000_000 < int(peak) * 1024 < BYTES


TURN = "<origin xyz='0.1 0 0'/><axis xyz='0 0 1'/></joint>"


@pytest.mark.slow
def test_a_long_chain_is_refused_in_time_where_its_twin_would_be_too_large(tmp_path: Path):
    links = "".join(CHAIN.replace("fixed", "continuous").format(i, i - 1) for i in range(990)).replace("</joint>", TURN)
    path = made(tmp_path, f"<robot name='r'><link name='l-1'/>{links}</robot>", "robot.urdf")
    code = (
        f"import resource; resource.setrlimit(resource.RLIMIT_CPU, ({SECONDS}, {SECONDS}))\n"
        f"from hrsynth.cli import main\nmain(['check', {str(path)!r}])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 2, run.stderr[-500:]
    assert "joint coordinates: got 990, expected at most 256" in run.stderr.splitlines()[-1]


def test_includes_stay_in_their_folder_and_come_once(tmp_path: Path):
    (tmp_path / "secret.xml").write_text("<mujoco><worldbody><body name='s'><joint/></body></worldbody></mujoco>")
    folder = tmp_path / "model"
    (folder / "parts").mkdir(parents=True)
    arm = "<body name='arm'><joint name='j'/></body>"
    (folder / "parts" / "arm.xml").write_text(f"<mujocoinclude>{arm}</mujocoinclude>")
    main = "<mujoco><worldbody>{}</worldbody></mujoco>"
    robot = load(made(folder, main.format('<include file="parts/arm.xml"/>')))
    assert list(robot.joints) == ["j"]
    for name in ("../secret.xml", str(tmp_path / "secret.xml"), "", "parts", "none.xml", "\udcff", "a\0b"[:1]):
        assert_refused(made(folder, main.format(f'<include file="{name}"/>'.encode("utf-8", "replace").decode())))
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    assert_refused(made(folder, main.format('<include file="link.xml"/>')), "outside of the model's folder")
    assert_refused(made(folder, main.format('<include file="robot.xml"/>')), "repeated file")
    (folder / "parts" / "a.xml").write_text('<mujocoinclude><include file="parts/b.xml"/></mujocoinclude>')
    (folder / "parts" / "b.xml").write_text('<mujocoinclude><include file="parts/a.xml"/></mujocoinclude>')
    assert_refused(made(folder, main.format('<include file="parts/a.xml"/>')), "repeated file")


def test_sdf_includes_are_never_fetched(tmp_path: Path):
    text = SDF["1.7"].replace("</model>", "<include><uri>http://127.0.0.1:9/model</uri></include></model>")
    assert_refused(made(tmp_path, text, "robot.sdf"), "other files are not fetched")


@pytest.mark.parametrize(
    "frames",
    [
        '<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>',
        '<frame name="f"><pose relative_to="g"/></frame><frame name="g"><pose relative_to="f"/></frame>',
        '<frame name="f" attached_to="none"/>',
    ],
)
def test_frames_in_a_ring_or_nowhere(frames: str, tmp_path: Path):
    joint = '<joint name="j" type="revolute"><parent>f</parent><child>crank</child></joint>'
    assert_refused(made(tmp_path, SDF["1.7"].replace("</model>", frames + joint + "</model>"), "robot.sdf"))


@pytest.mark.parametrize(
    "yaml",
    [
        "a: &a [1]\nclosed_loop: [*a]",
        "closed_loop: " + "[" * 3000 + "]" * 3000,
        "closed_loop: !!python/object:os.system x",
        "closed_loop: 3",
        "closed_loop: [['one', 'none']]",
        "closed_loop: [['one', 'one']]",
        "closed_loop: [[1, 2]]",
        "name_mot: ['none']",
        "joint_name: ['a']\njoint_type: ['ODD']",
        "joint_name: ['a']",
        "closed_loop: ['one']",
        "closed_loop: [\x01]",
        "name_mot: {a: b}",
    ],
)
def test_yaml_is_data(yaml: str, tmp_path: Path):
    files = FILES["gepetto: 3d"]
    (tmp_path / "robot.yaml").write_text(yaml)
    assert_refused(made(tmp_path, files["robot.urdf"], "robot.urdf"))


@pytest.mark.parametrize(
    "yaml",
    [
        "!!bool x",
        "!!int ''",
        "!!float ''",
        "!!timestamp x",
        "!!binary 'é'",
        "!!str a",
        "! a",
        "!!set {a}",
        "!own a",
        '"\\UFFFFFFFF"',
        '"\\U00110000"',
    ],
)
def test_yaml_has_no_types(yaml: str, tmp_path: Path):
    made(tmp_path, FILES["gepetto: 3d"]["robot.urdf"], "robot.urdf")
    for text in (f"closed_loop: {yaml}", f"closed_loop: [[{yaml}]]", f"{yaml} : 1\ntype: [3d]"):
        assert_refused(made(tmp_path, text, "robot.yaml"), "YAML")


@pytest.mark.parametrize(
    "scalar",
    [
        "9" * 5000,
        ":".join("1" * 300_000),
        "-" + ":".join(["59"] * 3000) + ".5",
        "0b1",
        "2001-99-99",
        ".inf",
        "<<",
        "=",
        "yes",
    ],
)
def test_a_scalar_of_yaml_is_a_name(scalar: str, tmp_path: Path):
    made(tmp_path, FILES["gepetto: 3d"]["robot.urdf"], "robot.urdf")
    assert_refused(
        made(tmp_path, f"name_mot: [{scalar}]", "robot.yaml"),
        "name_mot: ",
        "is not a name" if len(scalar) > 200 else "no movable joint",
    )


def test_a_key_of_yaml_without_a_value_has_none(tmp_path: Path):
    files = FILES["gepetto: 3d"]
    made(tmp_path, files["robot.urdf"], "robot.urdf")
    for null in ("", "~", "null"):
        made(tmp_path, f"{files['robot.yaml']}\njoint_name: {null}\njoint_type: {null}\n", "robot.yaml")
        assert load(tmp_path).platform


@pytest.mark.parametrize("dialect", ONE)
def test_an_exponent_is_short(dialect: str, tmp_path: Path):
    for sign in ("", "-"):
        text, count = re.subn(r'(<pose>|(?:xyz|pos)=")[-.\d]+', rf"\g<1>0e{sign}{'9' * 5000}", ONE[dialect], count=1)
        assert count
        assert_refused(made(tmp_path, text, f"robot.{dialect}"), "finite numbers")


def test_a_group_of_shapes_is_a_number(tmp_path: Path):
    for group in ("9" * 5000, "\u0663", "1_0", "x", "", "-1e400"):
        text = MJCF["connect"].replace("<body ", f'<geom size="1" group="{group}"/><body ', 1)
        assert load(made(tmp_path, text)).platform


def test_what_is_no_robot_file_or_folder(tmp_path: Path):
    assert_refused(made(tmp_path, "<html/>", "page.xml"))
    assert_refused(made(tmp_path, "a: 1", "alone.yaml"), "no known format", "gepetto")
    assert_refused(made(tmp_path, "# loops\ntype: [3d]", "alone.yaml"), "no URDF files next to")
    for text, name in ((ONE["urdf"], "a.urdf"), (ONE["sdf"], "b.sdf")):
        made(tmp_path / "two" if (tmp_path / "two").is_dir() else _folder(tmp_path / "two"), text, name)
    with pytest.raises(HrsynthError, match="a folder with 2 robot files"):
        load(tmp_path / "two")


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


def test_a_xacro_file_without_the_package_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("hrsynth.description.formats.urdf.xacro.importlib.util.find_spec", lambda name: None)
    text = (
        ONE["urdf"]
        .replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"', 1)
        .replace("</robot>", '<xacro:property name="x" value="1"/></robot>')
    )
    with pytest.raises(MissingExtra, match=r'robot.xml: a xacro file needs .*pip install "hrsynth\[xacro\]"'):
        load(made(tmp_path, text))


def test_xacro_reads_nothing_elsewhere_and_comes_to_an_end(tmp_path: Path):
    pytest.importorskip("xacro")
    folder = _folder(tmp_path / "package")
    inner = _folder(folder / "urdf")
    head = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    (inner / "parts.xacro").write_text(head + '<xacro:property name="h" value="0.7"/></robot>')
    (tmp_path / "secret.xacro").write_text(head + "</robot>")
    tree = ONE["urdf"].split("\n", 1)[1].replace("</robot>", "")
    good = head + '<xacro:include filename="$(find package)/urdf/parts.xacro"/>' + tree + "</robot>"
    assert load(made(inner, good, "robot.xacro")).name == "r"
    for name in ("../../secret.xacro", str(tmp_path / "secret.xacro"), "$(find package)/../../secret.xacro"):
        other = good.replace("$(find package)/urdf/parts.xacro", name)
        assert_refused(made(inner, other, "robot.xacro"), "xacro refuses it")
    endless = head + '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/></robot>'
    assert_refused(made(inner, endless, "robot.xacro"), "xacro")
    assert_refused(made(inner, head + "${(9**9**9)}</robot>", "robot.xacro"), "xacro")


@pytest.mark.parametrize("dialect", ONE)
@pytest.mark.parametrize("before", ["", "<!-- a -- b -->"])
def test_no_instruction_or_comment_hides_a_declaration(dialect: str, before: str, tmp_path: Path):
    """What looks like a comment inside a processing instruction is none, and the other way round."""
    for start, end in (("<?x <!-- ?>", "<?y --> ?>"), ("<!-- <?x -->", "<!-- ?> -->"), ("<?x?><!-- ?> -->", "")):
        for body in ('<!DOCTYPE x [<!ENTITY a "four_bar">]>', '<!DOCTYPE x SYSTEM "file:///etc/passwd">'):
            text = before + start + body + end + ONE[dialect]
            assert_refused(made(tmp_path, text), "a document type declaration", "not allowed")
            if "ENTITY" in body:
                assert_refused(made(tmp_path, text.replace('"four_bar"', '"&a;"', 1)), "not allowed")


NAMES = {
    "open comments": '<robot name="a">' + "<!--        " * 95_000 + "</robot>",
    "open instructions": '<robot name="a">' + "<?a    " * 95_000 + "</robot>",
    "comments in comments": '<robot name="a">' + "<!-- <? --> ?>" * 40_000 + "<",
    "attributes": "<robot name='a'><link " + " ".join(f"a{k}='1'" for k in range(100_000)) + "/></robot>",
    "elements": "<robot name='a'>" + "".join(f"<lin{k}/>" for k in range(90_000)) + "</robot>",
    "attributes of many elements": "<robot name='a'><link name='b'/>"
    + "".join(f"<joint name='j{k}' abc{k}='1'/>" for k in range(40_000))
    + "</robot>",
    "defaults": "<mujoco><default>"
    + "".join(f"<t{k} a='1'/>" for k in range(900))
    + "".join(f"<default class='c{k}'>" + f"<geom a{k}='1'/>" for k in range(200))
    + "</default>" * 201
    + "</mujoco>",
}


@pytest.mark.some(3, 4)
@pytest.mark.parametrize("name", NAMES)
def test_what_compares_names_takes_its_time(name: str, tmp_path: Path):
    assert_refused(made(tmp_path, NAMES[name]))


@pytest.mark.parametrize(
    "text",
    [
        b"<a/>",
        b"<a><!-- b --></a>",
        b"<a><!-- <? --><?c <!-- ?></a>",
        b"<a><!--><b/>--></a>",
        b"<!-- a",
        b"<? <!-- ?> -->",
        b"<a><?b?><!--c--><!---->x<!-- ?> --></a>",
    ],
)
def test_comments_are_those_of_a_pattern(text: bytes):
    """The pattern takes quadratic time where an end is missing."""
    pattern = re.compile(rb"<!--.*?-->|<\?.*?\?>", re.DOTALL)
    assert list(comments(text)) == [match.span() for match in pattern.finditer(text)]
