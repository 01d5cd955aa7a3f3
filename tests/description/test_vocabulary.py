"""Names of formats: what is valid is known, what is mistyped by one edit is refused or changes nothing."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from lxml import etree

from description.foreign.examples import FILES
from description.foreign.test_models import MODELS
from description.foreign.test_package_robots import FILES as PACKAGED
from hrsynth.cli import run_command
from hrsynth.description import formats, list_robots, load, save, xml
from hrsynth.description.vocabulary import Vocabulary, find_misspelt
from hrsynth.errors import BadRequest, BadRobotFile, HrsynthError

ROOTS = {"robot": "urdf", "mujoco": "mjcf", "sdf": "sdf", "gazebo": "sdf"}
ENDINGS = (".urdf", ".xml", ".sdf", ".yaml")
LETTERS = "abcdefghijklmnopqrstuvwxyz_-012XYZ"


def vocabulary(root: etree._Element) -> Vocabulary:
    return formats.get_vocabulary(ROOTS[str(root.tag)])


def document(file: Path) -> etree._Element | None:
    try:
        root = xml.parse_document(file.read_bytes(), str(file), [])
    except HrsynthError:
        return None
    return root if str(root.tag) in ROOTS else None


def real_files() -> list[Path]:
    models = [each for each in MODELS.rglob("*") if each.suffix in (".urdf", ".sdf", ".xml")] if MODELS.is_dir() else []
    return [*list_robots().values(), *sorted(models), *PACKAGED]


@pytest.mark.some(20)
@pytest.mark.parametrize("file", real_files(), ids=lambda path: path.name)
def test_every_name_of_a_real_file_is_known(file: Path):
    root = document(file)
    assert root is not None
    assert [(each.line, each.place, each.name) for each in vocabulary(root).unknown(root)] == []


@pytest.mark.parametrize("name", [name for name, text in FILES.items() if isinstance(text, str)])
def test_every_name_of_the_examples_of_all_formats_is_known(name: str):
    root = xml.parse_document(FILES[name], name, [])
    assert [(each.place, each.name) for each in vocabulary(root).unknown(root)] == []


@pytest.mark.parametrize("ending", [".xml", ".sdf", ".urdf"])
@pytest.mark.some(4)
@pytest.mark.parametrize("name", list_robots())
def test_every_name_that_is_written_is_known(name: str, ending: str, tmp_path: Path):
    save(load(name), tmp_path / f"robot{ending}")
    root = document(tmp_path / f"robot{ending}")
    assert root is not None
    assert list(vocabulary(root).unknown(root)) == []


def test_every_name_of_mujocos_schema_is_known():
    """Elements that are read have all attributes and children that MuJoCo's own schema gives them."""
    mujoco = pytest.importorskip("mujoco")
    known = formats.get_vocabulary("mjcf")
    rows, path, names = known.elements, list[str](), frozenset[str]()
    missing, seen, read = set[tuple[str, str]](), set[str](), False
    for line in mujoco.mj_printSchema(False, False).splitlines():
        head = re.match(r"( *)(\S+) \([^)]*\)(.*)", line)
        if head is not None:
            path = [*path[: len(head[1]) // 3], head[2].replace("(world)body", "body")]
            key = "/".join(path[-2:])
            read = all(
                each in rows or f"{above}/{each}" in rows for above, each in zip(["", *path], path, strict=False)
            )
            if read:
                seen.add(key)
                names = (rows.get(key) or rows[path[-1]]).attributes
            elif path[-2] in rows and path[-1] not in rows[path[-2]].children:
                missing.add((path[-2], path[-1]))
        if read:
            missing |= {(key, each) for each in (line if head is None else head[3]).split()} - {(key, n) for n in names}
    assert missing == set()
    assert {"body/joint", "equality/connect", "actuator/motor", "default/joint", "asset/mesh"} <= seen


@cache
def written(name: str, ending: str, folder: Path) -> tuple[bytes, list[tuple[int, str]]]:
    """A robot's file, and the attributes of its elements that are read: number of the element, name; those of one kind
    of element once."""
    target = folder / f"{name}{ending}"
    save(load(name), target)
    target = target.with_suffix(".urdf") if ending == ".yaml" else target
    root = document(target)
    assert root is not None
    rows = vocabulary(root).elements
    places = dict[tuple[str, str, str], tuple[int, str]]()
    for number, element in enumerate(root.iter("*")):
        above = element.getparent()
        key = f"{'' if above is None else above.tag}/{element.tag}"
        if key in rows or str(element.tag) in rows:
            for attribute in element.attrib:
                places.setdefault((key, element.get("type", ""), str(attribute)), (number, str(attribute)))
    return target.read_bytes(), list(places.values())


def mistype(data: st.DataObject, name: str) -> str:
    """A name with one edit."""
    kind, at = data.draw(st.sampled_from("idrtc")), data.draw(st.integers(0, len(name) - 1))
    letter = data.draw(st.sampled_from(LETTERS))
    before, own, after = name[:at], name[at], name[at + 1 :]
    return {
        "i": before + letter + own + after,
        "d": before + after,
        "r": before + letter + after,
        "t": before + after[:1] + own + after[1:],
        "c": name.swapcase(),
    }[kind]


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.some(4, 20)
@pytest.mark.parametrize("name", list_robots())
@settings(
    max_examples=15,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.filter_too_much],
)
@given(data=st.data())
def test_a_mistyped_attribute_is_refused_or_changes_nothing(
    name: str, ending: str, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
):
    folder = tmp_path_factory.getbasetemp() / f"mistyped{ending}"
    folder.mkdir(exist_ok=True)
    text, places = written(name, ending, folder)
    number, attribute = data.draw(st.sampled_from(places))
    wrong = mistype(data, attribute)
    root = etree.fromstring(text)
    element = list(root.iter("*"))[number]
    assume(re.fullmatch(r"[A-Za-z_][\w-]*", wrong) and wrong not in element.attrib)
    value = element.attrib.pop(attribute)
    element.set(wrong, value)
    path = folder / f"{name}{ending}"
    (path.with_suffix(".urdf") if ending == ".yaml" else path).write_bytes(etree.tostring(root))
    try:
        found = load(path)
    except (BadRobotFile, BadRequest):
        return
    finally:
        (path.with_suffix(".urdf") if ending == ".yaml" else path).write_bytes(text)
    assert load(path).differences(found) == [], (element.tag, attribute, wrong)


def test_a_mistyped_axis_is_refused_with_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    text = list_robots()["3rrr_m1"].read_text()
    path = tmp_path / "robot.urdf"
    path.write_text(text.replace('<axis xyz="0 0 1"', '<axis xyx="0 0 1"', 1))
    assert run_command(["check", str(path)]) == 2
    line = text.split("<axis")[0].count("\n") + 1
    assert capsys.readouterr().err == f"hrsynth: {path}:{line}: unknown attribute of <axis>: got xyx, expected xyz\n"


@pytest.mark.parametrize("wrong", ["closed_lop", "closedLoop", "closed-loop", "name_mto", "joint_names"])
def test_a_mistyped_key_beside_a_urdf_is_refused_with_its_line(wrong: str, tmp_path: Path):
    save(load("quattro"), tmp_path / "robot.yaml")
    path = tmp_path / "robot.yaml"
    text = path.read_text()
    (key,) = (key for key in ("closed_loop", "name_mot", "joint_name") if find_misspelt(wrong, [key]))
    text = text if f"{key}:" in text else f"{text}{key}: []\n"
    path.write_text(text.replace(f"{key}:", f"{wrong}:"))
    line = path.read_text().split(f"{wrong}:")[0].count("\n") + 1
    with pytest.raises(BadRobotFile) as caught:
        load(path)
    assert str(caught.value.defects[0]) == f"{path}:{line}: unknown key: got {wrong}, expected {key}"


def test_another_unknown_name_is_said_once_and_names_of_other_programs_are_not(tmp_path: Path, capsys):
    text = list_robots()["3rrr_m1"].read_text()
    path = tmp_path / "robot.urdf"
    more = '<hydraulics/><hydraulics/><v:pump xmlns:v="urn:v" nmae="a"/><gazebo><sensr nmae="a"/></gazebo>'
    text = text.replace("<axis xyz", '<axis v:xyx="1" xmlns:v="u" xyz')
    path.write_text(text.replace("<hrsynth>", f"{more}<hrsynth>"))
    assert run_command(["legs", str(path)]) == 0
    (said,) = capsys.readouterr().err.splitlines()
    line = text.split("<hrsynth>")[0].count("\n") + 1
    assert said == f"hrsynth: ignored: unknown element in <robot>: got <hydraulics> (line {line}, and more)"


@pytest.mark.parametrize(
    ("one", "two", "same"),
    [
        ("xyx", "xyz", True),
        ("xy", "xyz", True),
        ("xyzz", "xyz", True),
        ("xzy", "xyz", True),
        ("XYZ", "xyz", True),
        ("expressedIn", "expressed_in", True),
        ("max-velocity", "max_velocity", True),
        ("x", "xyz", False),
        ("zyx", "xyz", False),
        ("zxy", "xyz", False),
        ("pose", "pos", True),
        ("", "a", True),
        ("lower", "upper", False),
    ],
)
def test_one_edit_is_one_edit(one: str, two: str, same: bool):
    assert (find_misspelt(one, [two]) == (two,)) is same
    assert (find_misspelt(two, [one]) == (one,)) is same
