"""Several defects at once, in random robots: each is found, all are mended; damaged files raise nothing unforeseen."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from lxml import etree

import hrsynth
from description.foreign.fuzz import mutated, originals
from hrsynth.description import load, native
from hrsynth.errors import HrsynthError
from hrsynth.mechanism import Mechanism
from hrsynth.present.text.lint import format_github, format_sarif
from linting.defects import Damage, Root, again, both, damaged, inertial, limited, put
from strategies import delta_like, planar_robots, random_rotation, transformed


def hinge(root: Root, number: int) -> Root:
    """A hinge of the tree that has no limits and is no part of a chain."""
    hinges = [each for each in root.iter("joint") if each.get("type") == "continuous"]
    free = [each for each in hinges if "__" not in each.get("name", "")]
    assume(free)
    return free[number % len(free)]


def longer_axis(root: Root) -> None:
    axis = hinge(root, 0).find("axis")
    assert axis is not None
    axis.set("xyz", " ".join(str(3 * float(word)) for word in axis.get("xyz", "").split()))


DEFECTS: dict[str, Damage] = {
    "mass-negative": put("link/inertial/mass", value="-0.25"),
    "inertia-triangle": put("link/inertial/inertia", ixx="1"),
    "axis-length": longer_axis,
    "constraint-dead": again("loop", "again"),
    "link-unused": lambda root: root.append(etree.Element("link", name="spare")),
    "limits-order": lambda root: limited(hinge(root, 0), "urdf", 1.0, -1.0),
    "unit-limits": lambda root: limited(hinge(root, 1), "urdf", -90.0, 90.0),
    "limits-demanded": lambda root: hinge(root, 2).set("type", "revolute"),
}


def text_of(robot: Mechanism, seed: int) -> str:
    """The file of a robot in a tilted base, with a mass."""
    rng = np.random.default_rng(seed)
    root = etree.fromstring(native.write(transformed(robot, random_rotation(rng), rng.normal(size=3))).encode())
    root.findall("link")[1].insert(0, inertial("urdf"))
    return etree.tostring(root, encoding="unicode")


@pytest.mark.slow
@settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
@given(
    robot=st.one_of(planar_robots(("RRR", "RPR", "PRR", "RRP")), delta_like()),
    seed=st.integers(0, 99),
    chosen=st.lists(st.sampled_from(sorted(DEFECTS)), min_size=1, unique=True),
)
def test_all_defects_of_a_random_robot_are_found_and_mended(robot: Mechanism, seed: int, chosen: list[str]):
    text = text_of(robot, seed)
    order = [name for name in DEFECTS if name in chosen]
    with tempfile.TemporaryDirectory() as folder:
        one, two = Path(folder) / "sound.urdf", Path(folder) / "damaged.urdf"
        one.write_text(text)
        two.write_text(damaged(text, both(*(DEFECTS[name] for name in order))))
        assert not any(each.fixable for each in hrsynth.lint(one).findings)
        assert set(order) <= {each.rule for each in hrsynth.lint(two).findings}
        found = hrsynth.lint(two, fix=True)
        assert {each.rule for each in found.fixed} == set(order)
        assert not any(each.fixable for each in found.findings)
        differences = load(two).differences(load(one))
        assert [each for each in differences if "limits of joint" not in each and "content of link" not in each] == []


def outcome(files: dict[str, str], folder: Path, *, fix: bool) -> str:
    """What comes of looking at files; what they are after a mend has no mend left."""
    for name, text in files.items():
        (folder / name).write_bytes(text.encode("utf-8", "surrogatepass"))
    path = folder / next(iter(files))
    try:
        found = hrsynth.lint(path, fix=fix)
    except HrsynthError:
        return "refused"
    assert str(found)
    assert format_sarif(found)
    assert len(format_github(found).splitlines()) == len(found.findings)
    if fix:
        assert not any(each.fixable for each in found.findings)
    return "mended" if found.written else "read"


@pytest.mark.slow
@pytest.mark.parametrize("count", [60, pytest.param(2000, marks=pytest.mark.long)])
def test_damaged_files_are_looked_at_or_refused(count: int, tmp_path: Path):
    rng, base = random.Random(count), originals()
    seen = set()
    for number in range(count):
        files = dict(rng.choice(base))
        name = rng.choice(list(files))
        files[name] = mutated(files[name], rng)
        folder = tmp_path / str(number)
        folder.mkdir()
        seen.add(outcome(files, folder, fix=number % 2 == 0))
    assert {"read", "refused"} <= seen
