"""YAML of any format: read without trust, with lines; its formats are told apart by their keys."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from description.foreign.examples import FILES
from hrsynth.description import load
from hrsynth.description.file_format import RobotFile
from hrsynth.description.yaml_file import YamlReader, get_line, read_yaml
from hrsynth.errors import BadRobotFile

NAMES = st.text("abcdefg", min_size=1, max_size=5)


@given(data=st.dictionaries(NAMES, st.lists(NAMES, min_size=1, max_size=3), min_size=1, max_size=5), flow=st.booleans())
def test_what_is_written_is_read_and_each_text_has_its_line(
    tmp_path_factory: pytest.TempPathFactory, data: dict[str, list[str]], flow: bool
):
    path = tmp_path_factory.mktemp("yaml") / "a.yaml"
    path.write_text(yaml.safe_dump(data, default_flow_style=flow, sort_keys=False))
    lines, back = path.read_text().splitlines(), read_yaml(path)
    assert back == data
    for key, values in back.items():
        assert all(str(each) in lines[(get_line(each) or 0) - 1] for each in (key, *values))
        assert get_line(values) == values[0].line


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: &x [1]\nb: *x", 2, "aliases"),
        ("a: 1\nb: !!int 2", 2, "tags"),
        ("a: " + "[" * 7 + "]" * 7, 1, "deep nesting"),
        ("a:\n- " + "\n- ".join("b" * 20_000), None, "too many entries"),
        ("a: 1\nc:\n  b: 1\n  b: 2", 3, "given twice"),
        ("a: 1\nb: [", 2, "not YAML"),
    ],
)
def test_what_could_harm_is_refused_with_its_line(tmp_path: Path, text: str, line: int | None, words: str):
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(BadRobotFile, match=words) as caught:
        read_yaml(tmp_path / "a.yaml")
    assert line in (None, caught.value.defects[0].line)


def test_a_reader_collects_defects_with_lines(tmp_path: Path):
    (tmp_path / "a.yaml").write_text("a: [1, x]\nb: {c: 1}\nd: e\nf: [2, 3]\n")
    said = read_yaml(tmp_path / "a.yaml")
    reader = YamlReader(str(tmp_path / "a.yaml"))
    assert list(reader.numbers(said["f"], (0, 0), "f")) == [2, 3]
    reader.numbers(said["a"], (0, 0), "a")
    reader.mapping(said["b"], "b", ("d",))
    reader.sequence(said["d"], "d")
    reader.name(said["f"], "f")
    with pytest.raises(BadRobotFile) as caught:
        reader.require_sound()
    assert [each.line for each in caught.value.defects] == [1, 2, 3, 4]


@pytest.mark.parametrize("start", ["", "# a comment\n\n", "---\n", "{ ", '"'])
def test_a_key_is_found_where_it_is_not_indented(start: str):
    end = {"{ ": "}", '"': ""}.get(start, "")
    key = 'bars"' if start == '"' else "bars"
    assert RobotFile(Path("a"), None, data=f"{start}{key}: 1{end}".encode()).has_key("base", "bars")
    assert not RobotFile(Path("a"), None, data=f"{start}x: 1\n  bars: 2".encode()).has_key("bars")


def test_yaml_of_no_format_is_no_malformed_xml(tmp_path: Path):
    for text in ("# a comment\nlinks: [a]", "links: {type: 1}", "- closed_loop"):
        (tmp_path / "a.yaml").write_text(text)
        with pytest.raises(BadRobotFile, match=r"no known format: expected XML, or a file of .*gepetto"):
            load(tmp_path / "a.yaml")


def test_defects_of_gepettos_lists_are_told_together_with_their_lines(tmp_path: Path):
    (tmp_path / "robot.urdf").write_text(FILES["gepetto: 3d"]["robot.urdf"])
    (tmp_path / "robot.yaml").write_text(
        "closed_loop:\n- [base, nowhere]\n- [base]\ntype: [3d, '4']\nname_mot: [none]\n"
    )
    with pytest.raises(BadRobotFile) as caught:
        load(tmp_path / "robot.yaml")
    assert [each.line for each in caught.value.defects] == [2, 3, 4, 5]
