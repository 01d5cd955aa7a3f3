"""The file format that docs/pages/adding.md adds, in the words of the page: found by itself, read, written, refused."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from hrsynth.description import build_spanning_mechanism, formats, load, save
from hrsynth.errors import BadRequest, BadRobotFile

PAGE = Path(__file__).parents[2] / "docs" / "pages" / "adding.md"


@pytest.fixture
def sample(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The page's robot file, its dialect in place."""
    section = PAGE.read_text(encoding="utf-8").split("## A format")[1].split("\n## ")[0]
    text, *modules = re.findall(r"```(?:xml|python)\n(.*?)```", section, re.DOTALL)
    folder = tmp_path / "formats" / "bars"
    folder.mkdir(parents=True)
    for name, source in zip(("__init__", "read", "write"), modules, strict=True):
        (folder / f"{name}.py").write_text(source, encoding="utf-8")
    (tmp_path / "four_bar.bars").write_text(text)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(folder.parent)])
    formats.list_formats.cache_clear()
    yield tmp_path / "four_bar.bars"
    formats.list_formats.cache_clear()
    for name in [name for name in sys.modules if name.startswith(f"{formats.__name__}.bars")]:
        del sys.modules[name]


def test_the_dialect_of_the_page_is_read_and_written(sample: Path):
    robot = load(sample)
    assert robot.platform == "coupler"
    assert [str(joint.type) for joint in robot.joints.values()] == ["R"] * 4
    assert [name for name, joint in robot.joints.items() if joint.is_actuated] == ["a"]
    assert save(load("3rrr_m1"), sample.with_name("out.bars")) == ()
    back, there = load(sample.with_name("out.bars")), build_spanning_mechanism(load("3rrr_m1"))
    assert {name: joint.links for name, joint in back.joints.items()} == {
        name: joint.links for name, joint in there.joints.items()
    }
    for name, joint in there.joints.items():
        assert back.joints[name].point == pytest.approx(joint.point, abs=1e-12)


def test_its_defects_have_their_lines(sample: Path):
    sample.write_text(sample.read_text().replace('one="base" two="rocker"', 'one="bose" two="rocker"'))
    with pytest.raises(BadRobotFile, match=r"four_bar.bars:4: revolute: unknown bar: got bose"):
        load(sample)


def test_without_its_folder_it_is_unknown(tmp_path: Path):
    with pytest.raises(BadRequest, match="unknown format"):
        save(load("3rrr_m1"), tmp_path / "a.txt", "bars")
