"""Whatever is asked, the answer is plain data or an error in a line: no field is trusted."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

from hrsynth import list_robots
from hrsynth.errors import BadRequest, HrsynthError
from hrsynth.present.studio.analysis_service import AnalysisService, list_request_names

ROBOT = "rrrrr_m1"
JUNK: list[Any] = [
    None,
    True,
    False,
    0,
    -1,
    2.5,
    float("nan"),
    float("inf"),
    -1e308,
    10**400,
    "",
    "1",
    "x" * 1000,
    "\0",
    "../x",
    [],
    [None],
    [[]],
    ["1"],
    ["1", "1"],
    ["1", 2],
    [0.0] * 2,
    [0.0] * 7,
    [1e308] * 2,
    [float("nan")] * 2,
    {},
    {"q": []},
    {"q": {}},
    {"q": [0.0] * 50, "hidden": None},
    {"q": None, "hidden": 3},
    "mode:2",
    "page",
    "accuracy",
    "xy",
    "phi",
]
FIELDS = {
    "open": ("watch", "camera", "here", "robot"),
    "move": ("values", "platform", "motors", "hidden", "here", "watch"),
    "watch": ("watch", "camera", "here"),
    "play": ("lost", "hidden", "here", "watch"),
    "answer": ("camera",),
    "modes": ("here", "watch", "camera"),
    "aspects": ("here", "watch"),
    "plane": ("kind", "of", "at", "here", "watch"),
    "servo": ("goal", "end", "here", "watch"),
    "export": ("kind", "watch"),
    "gallery": ("robot",),
}
QUICK: dict[str, dict[str, Any]] = {"plane": {"size": 2}, "export": {"kind": "robot"}}
LONG = ("aspects", "plane", "servo", "export", "open")
OPTIONS = ("base", "platform", "motors", "close", "freeze", "keyframe", "unit", "tolerance", "as_written", "observe")


def law_plain_or_refused(desk: AnalysisService, asked: Any) -> None:
    found, refused = answered(desk, asked)
    assert all("\n" not in line and len(line) < 3000 for line in refused)
    assert refused or isinstance(found, dict)
    json.dumps(found, allow_nan=False)


def answered(desk: AnalysisService, asked: Any) -> tuple[dict[str, Any] | None, list[str]]:
    """The answer, or the lines in which it is refused."""
    try:
        return desk.answer(asked), []
    except HrsynthError as error:
        return None, error.lines()


def test_the_fuzz_knows_every_question():
    assert tuple(sorted(FIELDS)) == list_request_names()


@pytest.mark.some(1, 4)
@pytest.mark.parametrize(
    "what", [pytest.param(what, marks=pytest.mark.slow) if what in LONG else what for what in sorted(FIELDS)]
)
def test_no_field_of_any_question_is_trusted(what: str):
    desk = AnalysisService()
    base: dict[str, Any] = {"ask": what, "robot": {"source": f"shipped:{ROBOT}"}, **QUICK.get(what, {})}
    for name in FIELDS[what]:
        for junk in JUNK:
            law_plain_or_refused(desk, {**base, name: junk})


def test_no_option_of_a_robot_is_trusted():
    source = {"source": f"shipped:{ROBOT}"}
    for junk in JUNK:
        options = [junk, *({name: junk} for name in OPTIONS)]
        for robot in ({"source": junk}, *({**source, "options": each} for each in options)):
            law_plain_or_refused(AnalysisService(), {"ask": "move", "robot": robot})


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["3rps", "rrrrr_m1"])
def test_a_configuration_that_was_tampered_with_is_refused_or_closed(robot: str):
    rng = random.Random(0)
    source = {"source": f"shipped:{robot}"}
    here = AnalysisService().answer({"ask": "move", "robot": source, "hidden": True})["here"]
    for _ in range(40):
        q, hidden = [*here["q"]], [*here["hidden"]["q"]]
        for values in (q, hidden):
            if rng.random() < 0.7:
                values[rng.randrange(len(values))] += rng.choice([1e-12, 1e-9, 1e-6, 0.1, 3.0, 1e5, float("nan")])
        there = {"q": q, "hidden": {**here["hidden"], "q": hidden}}
        found, refused = answered(AnalysisService(), {"ask": "move", "robot": source, "hidden": True, "here": there})
        assert len(refused) == 1 if found is None else found["residual"] < 1e-9


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A folder with a robot, beside one that is none of its business."""
    folder = tmp_path / "mine"
    (folder / "deep").mkdir(parents=True)
    text = list_robots()[ROBOT].read_bytes()
    for place in (folder / "own.urdf", folder / "deep" / "below.urdf", tmp_path / "other.urdf"):
        place.write_bytes(text)
    (folder / "link.urdf").symlink_to(tmp_path / "other.urdf")
    (folder / "loop").symlink_to(folder / "loop")
    return folder


@pytest.mark.parametrize("kind", ["folder", "file"])
def test_nothing_outside_of_the_folder_is_read(tree: Path, kind: str):
    desk = AnalysisService(**{"folder" if kind == "folder" else "uploads": tree})
    for name in ("own.urdf", "deep/below.urdf"):
        assert desk.answer({"ask": "open", "robot": {"source": f"{kind}:{name}"}})["name"] == ROBOT
    for name in (
        "../other.urdf",
        "link.urdf",
        "loop",
        "",
        ".",
        "..",
        "deep/../../other.urdf",
        str(tree / "../other.urdf"),
        "/etc/passwd",
        "none.urdf",
    ):
        with pytest.raises(BadRequest, match="no such file"):
            desk.answer({"ask": "open", "robot": {"source": f"{kind}:{name}"}})
    if kind == "folder":
        assert desk.answer({"ask": "gallery"})["files"] == ["own.urdf"]


def test_a_file_that_is_written_again_is_read_again(tree: Path):
    desk, robot = AnalysisService(folder=tree), {"source": "folder:own.urdf"}
    assert desk.answer({"ask": "open", "robot": robot})["name"] == ROBOT
    (tree / "own.urdf").write_bytes(list_robots()["prrrp_m1"].read_bytes())
    assert desk.answer({"ask": "open", "robot": robot})["name"] == "prrrp_m1"


def test_the_robot_of_the_command_line_has_its_options_and_the_pages():
    desk = AnalysisService(given={"robot": ROBOT, "options": {"as_written": True}})
    found = desk.answer({"ask": "open", "robot": {"source": "given", "options": {}}})
    assert found["command"] == f"hrsynth derive {ROBOT} --as-written"
