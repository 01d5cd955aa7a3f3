"""What a person types in Python: examples in every help, wrong keywords told, one question however legs are written,
pictures in any kind of file."""

from __future__ import annotations

import doctest
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import hrsynth
from hrsynth.errors import BadRequest, InvalidCertificate

FUNCTIONS = sorted({*hrsynth.__all__} - {"__version__", "catalog"})
SLOW = {"aspects", "draw", "select"}


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in FUNCTIONS]
)
def test_help_has_an_example_that_works(name: str):
    if (needed := {"studio": "uvicorn", "to_pandas": "pandas"}.get(name)) is not None:
        pytest.importorskip(needed)
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(hrsynth, name), name, globs={"hrsynth": hrsynth})
    assert f"hrsynth.{name}(" in example.docstring
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0


@pytest.mark.parametrize(
    ("ask", "near"),
    [
        (lambda wrong: hrsynth.derive("3rrr_m1", **wrong("observed")), "observe"),
        (lambda wrong: hrsynth.select("3rrr_m1", start="x=0", goal="x=0", **wrong("run")), "runs"),
        (lambda wrong: hrsynth.observe("3rrr_m1", **wrong("leg")), "legs"),
        (lambda wrong: hrsynth.servo("3rrr_m1", start="x=0", goal="x=0", **wrong("gian")), "gain"),
        (lambda wrong: hrsynth.map_robots("check", ["3rrr_m1"], jobs=1, **wrong("camra")), "camera"),
        (lambda wrong: hrsynth.draw(hrsynth.modes("rrrrr_m1"), **wrong("widht")), "width"),
        (lambda wrong: hrsynth.load("3rrr_m1", **wrong("platfrom")), "platform"),
        (lambda wrong: hrsynth.save("3rrr_m1", "x.xml", **wrong("mesh")), "meshes"),
        (lambda wrong: hrsynth.lint("3rrr_m1", **wrong("compar")), "compare"),
        (lambda wrong: hrsynth.lint("3rrr_m1", **wrong("platfrom")), "platform"),
    ],
)
def test_a_wrong_keyword_is_told_with_the_nearest_and_all(ask: Any, near: str):
    given: list[str] = []

    def wrong(name: str) -> dict[str, int]:
        given.append(name)
        return {name: 1}

    with pytest.raises(TypeError, match="did you mean") as told:
        ask(wrong)
    said = str(told.value)
    assert re.search(rf"has no {given[0]!r}, did you mean {near!r}; it takes .*\b{near}\b", said), said


@pytest.mark.parametrize(
    ("ask", "allowed"),
    [
        (lambda: hrsynth.load(5), "a path, the name of a shipped robot"),
        (lambda: hrsynth.lint(5), "a path, the name of a shipped robot"),
        (lambda: hrsynth.lint(hrsynth.load("3rrr_m1")), "a path, the name of a shipped robot"),
        (lambda: hrsynth.save("3rrr_m1", "x.xml", meshes="move"), "keep, copy"),
        (lambda: hrsynth.branch("rrrrr_m1", [1, 2]), "hip=-1:1"),
        (lambda: hrsynth.branch("rrrrr_m1", "shoulder_1"), "^--box: got 'shoulder_1', expected low:high"),
        (lambda: hrsynth.draw(5), "draw: not a result"),
        (lambda: hrsynth.check("rrrrr_m1", seed="a"), "seed: got 'a', expected an integer"),
        (lambda: hrsynth.check("rrrrr_m1", seed=-1), "at least 0"),
        (lambda: hrsynth.observe("rrrrr_m1", seed=-1), "at least 0"),
        (lambda: hrsynth.branch("rrrrr_m1", max_cells=1.5), "max_cells: got 1.5, expected an integer"),
        (lambda: hrsynth.modes("rrrrr_m1", real="maybe"), "True or False"),
        (lambda: hrsynth.modes("rrrrr_m1", time_limit=True), "time_limit: got True, expected a number"),
        (lambda: hrsynth.advise("rrrrr_m1", cost={"encoder": 1}), "a text"),
        (lambda: hrsynth.accuracy("rrrrr_m1", cone=[1]), "more than 0 and less than 90deg"),
        (lambda: hrsynth.accuracy("rrrrr_m1", cone=0.01, noise=3), "a text such as 0.1deg"),
        (lambda: hrsynth.servo("rrrrr_m1", start="x=0", goal="x=0", gain="x"), "a number"),
        (lambda: hrsynth.servo("rrrrr_m1", start="x=0", goal="x=0", noise=3), "a text such as 0.1deg"),
        (lambda: hrsynth.singularities("rrrrr_m1", points=0), "points: got 0, expected an integer, at least 1"),
        (lambda: hrsynth.modes("rrrrr_m1", time_limit=-1), "time_limit: got -1, expected a number, at least 0"),
        (
            lambda: hrsynth.modes("rrrrr_m1", time_limit=math.nan),
            "time_limit: got nan, expected a number, at least 0",
        ),
        (lambda: hrsynth.singularities("rrrrr_m1", points=10**8), "an integer, at least 1, at most 1e"),
        (
            lambda: hrsynth.accuracy("rrrrr_m1", cone=0.01, plane="", steps=1),
            "^steps: got 1, .* at least 5, at most 300",
        ),
        (lambda: hrsynth.basins("rrrrr_m1", goal="x=0", steps=301), "^steps: got 301, .* at least 2, at most 300"),
        (lambda: hrsynth.basins("rrrrr_m1", goal="x=0", jobs=0), "^jobs: got 0, .* at least 1$"),
        (lambda: hrsynth.equilibria("rrrrr_m1", goal="x=0", max_boxes=0), "^max_boxes: got 0, .* at least 1$"),
        (lambda: hrsynth.servo("rrrrr_m1", start="x=0", goal="x=0", gain=1e7), "^gain: .* at most 1e"),
        (lambda: hrsynth.select("rrrrr_m1", start="x=0", goal="x=0", examine=0), "^examine: got 0, .* at least 1$"),
        (lambda: hrsynth.draw(hrsynth.singularities("rrrrr_m1", points=5), steps=1), "^steps: got 1, .* at least 5"),
        (lambda: hrsynth.verify(None), "a file: expected its path"),
        (lambda: hrsynth.save("rrrrr_m1", None), "a file: expected its path"),
        (lambda: hrsynth.draw(hrsynth.derive("rrrrr_m1"), 3), "a file: got 3, expected its path"),
        (lambda: hrsynth.accuracy("rrrrr_m1", cone=0.01, grid="x=0:0.1:2,y=0", into=3), "a file: got 3"),
        (
            lambda: hrsynth.check("rrrrr_m1", grid={"x": (0, 0.1, 2)}),
            "^a grid: got .*, expected a text such as x=-0.3",
        ),
        (lambda: hrsynth.accuracy("rrrrr_m1", cone=0.01, grid=["x=0:0.1:2"]), "^a grid: got .*, expected a text"),
        (lambda: hrsynth.load("rrrrr_m1", motors=[1]), "^names: got .*, expected texts in"),  # type: ignore[list-item]
        (lambda: hrsynth.load("rrrrr_m1", motors=1), "^names: got 1, expected texts in a list"),
        (lambda: hrsynth.load("rrrrr_m1", close=[("a", "b")]), "^names: got"),  # type: ignore[list-item]
        (lambda: hrsynth.load("rrrrr_m1", tolerance="x"), "^tolerance: got 'x', expected 1e-11"),
        (lambda: hrsynth.studio(3, open_=False), "a robot's file: got 3"),
    ],
)
def test_a_value_of_another_kind_is_told_with_what_is_allowed(ask: Any, allowed: str):
    with pytest.raises(BadRequest, match=allowed):
        ask()


def test_what_is_left_out_is_told_with_the_function():
    with pytest.raises(TypeError, match=r"^path: .*'goal'; it takes robot, .*goal"):
        hrsynth.path("3rrr_m1", start="x=0")  # type: ignore[call-arg]
    with pytest.raises(BadRequest, match=r"the measurement bounds are missing\. Give --cone 0.1deg"):
        hrsynth.accuracy("3rrr_m1")


def test_legs_in_any_form_are_one_question():
    for forms in (("1,2", "1, 2", ["1", "2"], [1, 2], (1, "2"), {1, 2}), (None, "all", ["all"])):
        answers = {id(hrsynth.derive("rrrrr_m1", form)) for form in forms}
        assert len(answers) == 1, forms


def test_a_certificate_is_about_its_robot_alone():
    record = hrsynth.certificate(hrsynth.modes("rrrrr_m1"))
    hrsynth.verify(record, "rrrrr_m1")
    for other in ("delta", "3rrr_m1"):
        with pytest.raises(InvalidCertificate, match=f"it is not for {other}"):
            hrsynth.verify(record, other)


@pytest.mark.slow
def test_a_family_is_written_with_a_sentence_a_file(tmp_path: Path):
    ask = [sys.executable, "-m", "hrsynth.families", str(tmp_path)]
    done = subprocess.run([*ask, "bennett", "six_poses"], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        f"The robot {name} is written to {tmp_path}/{name}.urdf." for name in ("bennett", "six_poses")
    ]
    wrong = subprocess.run([*ask, "nothing"], capture_output=True, text=True)
    assert (wrong.returncode, len(wrong.stderr.splitlines())) == (2, 1)


@pytest.mark.slow
def test_a_picture_is_written_in_any_kind_of_file(tmp_path: Path):
    found = hrsynth.modes("rrrrr_m1")
    picture = hrsynth.draw(found, tmp_path / "a.pdf", width="88mm", font="serif 8pt")
    assert (tmp_path / "a.pdf").read_bytes() == picture.content
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) [\d.]+ \]", picture.content)
    assert box is not None
    assert float(box[1]) * 25.4 / 72 == pytest.approx(88, abs=0.01)
    picture.save(tmp_path / "b.svg")
    assert b'width="249.4488' in (tmp_path / "b.svg").read_bytes()
    picture.save(tmp_path / "c.png")
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")
    for wrong in ("d.jpg", "d"):
        with pytest.raises(BadRequest, match=r"\.png, \.pdf, \.svg"):
            hrsynth.draw(found, tmp_path / wrong)
    with pytest.raises(BadRequest, match="aspects"):
        hrsynth.draw(hrsynth.legs("rrrrr_m1"))
    assert {file.name for file in tmp_path.iterdir()} == {"a.pdf", "b.svg", "c.png"}
