"""What ``load`` takes besides paths and names: open files, XML text, objects of yourdfpy; guesses are warnings."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

import hrsynth
from description.foreign.examples import FILES, MJCF, URDF
from hrsynth.description import list_robots, load
from hrsynth.errors import AssumedBase, AssumedPlatform, BadRequest, BadRobotFile, HrsynthError
from oracle import Oracle

ONE_FILE = {
    name: next(iter(files.values())) for name, files in FILES.items() if len(files) == 1 and "gepetto" not in name
}
WAYS: dict[str, Callable[[str, Path], Any]] = {
    "text": lambda text, _: text,
    "open text": lambda text, _: io.StringIO(text),
    "open bytes": lambda text, _: io.BytesIO(text.encode()),
    "open file": lambda _, path: path.open(encoding="utf-8"),
    "open binary file": lambda _, path: path.open("rb"),
}


@pytest.fixture(autouse=True)
def guesses_are_expected():
    with warnings.catch_warnings():
        for kind in (AssumedBase, AssumedPlatform):
            warnings.simplefilter("ignore", kind)
        yield


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", [*ONE_FILE, "native"])
def test_a_robot_is_the_same_however_it_is_given(tmp_path: Path, name: str, way: str):
    text = list_robots()["3rrr_m1"].read_text() if name == "native" else ONE_FILE[name]
    path = tmp_path / "robot.xml"
    path.write_text(text, encoding="utf-8")
    one, two = load(path), load(WAYS[way](text, path))
    assert one == two
    assert (two.file == str(path)) is ("file" in way)
    first, second = Oracle(one), Oracle(two)
    assert first.mobility(first.zero()) == second.mobility(second.zero())


def test_a_file_that_was_read_in_part_or_changed_is_what_is_left_of_it(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text("<!-- a comment -->\n" + URDF["urdf+"])
    with path.open() as stream:
        stream.readline()
        found = load(stream)
    assert (found.name, found.file) == ("four_bar", None)


def test_options_are_for_text_too_and_questions_take_it():
    found = load(URDF["urdf+"], platform="bar", motors="a")
    assert (found.platform, [joint.name for joint in found.joints.values() if joint.is_actuated]) == ("bar", ["a"])
    assert hrsynth.check(URDF["urdf+"]).setup.robot.name == "four_bar"


@pytest.mark.parametrize(
    "given",
    [
        3,
        None,
        b"<robot/>",
        ["<robot/>"],
        {"robot": 1},
        object(),
        "",
        "robot:\n  links: many " + "x" * 5000,
        "no_robot_of_this_name" * 50,
        io.StringIO("no robot at all " * 500),
        io.BytesIO(b"\x00\x01" * 500),
        "<robot><link name='a'>" + "x" * 5000,
        "<odd>" + "x" * 5000 + "</odd>",
        "<robot " + "y" * 5000 + "/>",
        "<robot name='r'><link name='" + "z" * 100 + "'/></robot>" + " " * 5000,
    ],
    ids=lambda given: str(given)[:12],
)
def test_anything_else_is_refused_in_one_short_line(given: Any):
    with pytest.raises(HrsynthError) as caught:
        load(given)
    for line in caught.value.lines():
        assert len(line) < 400
        assert "\n" not in line
        assert "/tmp" not in line
        assert not any(letter * 61 in line for letter in "xyz")


def test_the_line_of_text_is_told_and_files_beside_it_lie_nowhere():
    with pytest.raises(BadRobotFile, match=r"^the given text:3: unknown attribute of <axis>"):
        load(
            '<robot name="r">\n<link name="a"/><link name="b"/><joint name="j" type="revolute">\n<axis xyx="0 0 1"/>'
            '<parent link="a"/><child link="b"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
        )
    with pytest.raises(HrsynthError, match=r"nowhere, as no file is given|the given text") as caught:
        load(MJCF["connect"].replace("<worldbody>", '<include file="parts.xml"/><worldbody>'))
    assert "parts.xml" in str(caught.value)


TWO_ROOTS = (
    '<robot name="r"><link name="a"/><link name="b"/><link name="c"/><joint name="j" type="continuous">'
    '<parent link="a"/><child link="c"/></joint><joint name="k" type="continuous"><parent link="b"/>'
    '<child link="c"/><origin xyz="1 0 0"/></joint></robot>'
)


@pytest.mark.parametrize("ask", [load, hrsynth.check])
def test_a_guess_of_the_base_is_a_warning_at_the_line_that_asks(ask: Callable[[str], Any]):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with suppress(BadRequest):
            ask(TWO_ROOTS)
    found = [each for each in caught if each.category is AssumedBase]
    assert ["the base is link 'a'" in str(each.message) for each in found] == [True]
    assert found[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error", AssumedBase)
        load("3rrr_m1")


@pytest.mark.parametrize("ends", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_an_open_file_is_read_where_it_lies_whatever_ends_its_lines(tmp_path: Path, ends: bytes, mark: bytes):
    path = tmp_path / "robot.xml"
    path.write_bytes(mark + next(iter(ONE_FILE.values())).encode().replace(b"\n", ends))
    with path.open(encoding="utf-8-sig" if mark else "utf-8") as text, path.open("rb") as data:
        assert load(text).file == load(data).file == str(path)


def test_text_is_decoded_whatever_encoding_it_declares():
    text = "<?xml version='1.0' encoding='{}'?>" + URDF["urdf+"].replace("four_bar", "vierüber")
    for encoding in ("utf-8", "iso-8859-1", "utf-16"):
        assert load(text.format(encoding) if "{" not in URDF["urdf+"] else text).name == "vierüber"


def test_files_that_cannot_be_read_are_one_line(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text("<robot name='a'/>")
    stream = path.open()
    stream.close()
    named = io.StringIO("<robot name='a'/>")
    named.name = "x." + "y" * 300
    for given in (stream, path.open("ab"), named, "<robot name='\ud800'/>"):
        with pytest.raises(HrsynthError) as caught:
            load(given)
        assert len(caught.value.lines()) == 1
