"""The studio's answers: closed loops at every move, what is refused, and what agrees with the commands."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from hrsynth import check, load, observe, shipped
from hrsynth.errors import BadRequest, HrsynthError
from hrsynth.present.studio.desk import Desk

DESK = Desk()
CLOSED = 1e-9


def ask(what: str, robot: str, **fields: Any) -> dict[str, Any]:
    """An answer about a shipped robot, as it goes over the wire."""
    found = DESK.answer({"ask": what, "robot": {"source": f"shipped:{robot}"}, **fields})
    return json.loads(json.dumps(found, allow_nan=False))


def test_the_gallery_has_every_shipped_robot_with_a_picture():
    found = DESK.answer({"ask": "gallery"})
    assert [each["name"] for each in found["robots"]] == list(shipped())
    assert all(each["picture"].startswith("<svg") for each in found["robots"])
    assert found["files"] == []


@pytest.mark.parametrize("robot", ["rrrrr_m1", "3rps", pytest.param("quattro", marks=pytest.mark.slow)])
def test_every_slider_moves_its_own_coordinate_with_closed_loops(robot: str):
    scene = ask("open", robot)
    assert len(scene["sliders"]) == observe(load(robot)).dof
    home = [each["home"] for each in scene["sliders"]]
    assert scene["values"] == pytest.approx(home)
    for number, slider in enumerate(scene["sliders"]):
        assert slider["min"] < slider["home"] < slider["max"]
        wanted = [*home]
        wanted[number] += 0.1 * (slider["max"] - slider["home"])
        moved = ask("move", robot, values=wanted, hidden=True)
        assert moved["values"] == pytest.approx(wanted, abs=1e-6)
        assert not moved["stopped"]
        assert moved["residual"] < CLOSED
        assert moved["here"]["hidden"] is not None
        back = ask("move", robot, values=home, here=moved["here"], hidden=True)
        assert np.array(back["state"]["real"]) == pytest.approx(np.array(scene["state"]["real"]), abs=1e-6)


def test_a_platform_is_drawn_to_the_nearest_pose_that_it_can_have():
    scene = ask("open", "3rps")
    link = scene["machines"][0]["links"].index(observe(load("3rps")).mechanism.platform)
    place = [*scene["state"]["real"][link]]
    place[0] += 0.02
    place[2] += 0.03
    moved = ask("move", "3rps", platform=place)
    again = ask("move", "3rps", platform=place, here=moved["here"])
    reached = np.array(again["state"]["real"][link])
    assert reached[2] == pytest.approx(place[2], abs=0.01)
    assert again["stopped"]
    assert again["residual"] < CLOSED


def test_what_is_watched_is_what_check_says():
    found = ask("watch", "prrrp_parallel", watch=["1"])
    known = check("prrrp_parallel", ["1"]).postures[0]
    assert not found["verdict"]["controllable"]
    assert found["rank"] == known.hidden.rank
    assert [each["words"] for each in found["lost"]] == [each.name for each in known.hidden.lost]
    assert (found["error"]["mm"], found["error"]["step"]) == (None, 4)


@pytest.mark.parametrize("asked", [
    None, [], "open", {"ask": 3}, {"ask": "nothing"}, {"ask": "../move"}, {"ask": "open"},
    {"ask": "open", "robot": "delta"}, {"ask": "open", "robot": {"source": 3}},
    {"ask": "open", "robot": {"source": "file:/etc/passwd"}}, {"ask": "open", "robot": {"source": "folder:../x"}},
    {"ask": "open", "robot": {"source": "given"}}, {"ask": "open", "robot": {"source": "shipped:../delta"}},
])
def test_what_is_no_question_is_refused_in_a_line(asked: Any):
    with pytest.raises(BadRequest) as refused:
        DESK.answer(asked)
    assert len(refused.value.lines()) == 1


@pytest.mark.parametrize("fields", [
    {"here": 3}, {"here": {"q": [1.0]}}, {"here": {"q": None}}, {"values": [1.0]}, {"values": [1e400, 0.0]},
    {"values": ["0", 0.0]}, {"values": [0.0, 0.0], "platform": [0.0] * 7}, {"platform": [0.0] * 7},
    {"watch": "1"}, {"watch": ["9"]}, {"watch": [1]}, {"camera": "none"}, {"camera": 4}, {"hidden": "yes"},
    {"values": [1e8, 0.0]}, {"platform": [1e8, 0, 0, 0, 0, 0, 1]},
])
def test_a_wrong_field_is_refused(fields: dict[str, Any]):
    with pytest.raises(BadRequest) as refused:
        ask("move", "rrrrr_m1", **fields)
    assert len(refused.value.lines()) == 1


def test_where_the_loops_are_open_nothing_is_drawn():
    here = ask("move", "rrrrr_m1")["here"]
    q = np.array(here["q"])
    q[0] += 1e-6
    with pytest.raises(HrsynthError, match="not closed"):
        ask("move", "rrrrr_m1", here={**here, "q": q.tolist()})
