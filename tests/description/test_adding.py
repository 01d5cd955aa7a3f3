"""The file format that docs/pages/adding.md adds, in the words of the page: found by itself, read, written, refused."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hrsynth.description import build_spanning_mechanism, formats, list_save_targets, load, save
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.mechanism.model import Limits

PAGE = Path(__file__).parents[2] / "docs" / "pages" / "adding.md"


@pytest.fixture
def sample(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The page's robot file, its dialect in place."""
    section = PAGE.read_text(encoding="utf-8").split("## A format")[1].split("\n## ")[0]
    text, module = re.findall(r"```(?:xml|python)\n(.*?)```", section, re.DOTALL)
    folder = tmp_path / "formats"
    folder.mkdir()
    (folder / "bars.py").write_text(module, encoding="utf-8")
    (tmp_path / "four_bar.bars").write_text(text)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(folder)])
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
    assert back.platform == there.platform
    for name, joint in there.joints.items():
        assert back.joints[name].links == joint.links
        assert back.joints[name].is_actuated is joint.is_actuated
        assert back.joints[name].point == pytest.approx(joint.point, abs=1e-12)


def test_what_its_writer_loses_is_told_or_refused(sample: Path):
    """The example's writer knows nothing of couplings, limits or observations: reading back tells them."""
    with pytest.raises(BadRequest, match="no plane linkage: joint: got"):
        save(load("3rps"), sample.with_name("out.bars"))
    robot = load(sample)
    a = replace(robot.joints["a"], limits=Limits(lower=-1.0, upper=1.0))
    bounded = replace(robot, joints=robot.joints | {"a": a})
    for lossy, word in ((bounded, "limits of joint a"), (replace(robot, platform="crank"), "platform: 'coupler'")):
        (told,) = save(lossy, sample.with_name("out.bars"))
        assert told.kind == "warning"
        assert f"read back, is another mechanism: {word}" in told.text
    assert save(robot, sample.with_name("out.bars")) == ()


def test_a_joint_that_ends_on_the_base_closes_a_loop(sample: Path):
    text = sample.read_text().replace('one="rocker" two="coupler"', 'one="coupler" two="rocker"')
    sample.write_text(text.replace('one="base" two="rocker"', 'one="rocker" two="base"'))
    assert [name for name, joint in load(sample).joints.items() if not joint.in_tree] == ["c"]


def test_a_joint_from_a_link_to_itself_has_its_line(sample: Path):
    sample.write_text(sample.read_text().replace('one="base" two="rocker"', 'one="base" two="base"'))
    with pytest.raises(BadRobotFile, match=r"four_bar.bars:4: joint 'c' connects a link to itself: got base"):
        load(sample)


@pytest.mark.parametrize("name", ["out.yaml.bars", "out.bars.yaml", "OUT.BARS.YAML"])
def test_the_longest_ending_of_a_name_decides(sample: Path, name: str):
    module: Any = sys.modules[f"{formats.__name__}.bars"] if formats.list_formats() else None
    assert module is not None
    longer = replace(module.DIALECT, endings=(".bars", ".bars.yaml"))
    module.DIALECT = longer
    formats.list_formats.cache_clear()
    assert list_save_targets(sample.with_name(name)) == (sample.with_name(name),)
    save(load(sample), sample.with_name(name))
    assert sample.with_name(name).read_text().lstrip().startswith(("<bars", "<?xml"))


def test_its_defects_have_their_lines(sample: Path):
    sample.write_text(sample.read_text().replace('one="base" two="rocker"', 'one="bose" two="rocker"'))
    with pytest.raises(BadRobotFile, match=r"four_bar.bars:4: revolute: unknown bar: got bose"):
        load(sample)


def test_without_its_file_it_is_unknown(tmp_path: Path):
    with pytest.raises(BadRequest, match="unknown format"):
        save(load("3rrr_m1"), tmp_path / "a.txt", "bars")
