"""The server of the view: any coordinates together, loops closed, nothing else answered."""

from __future__ import annotations

import json
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator

import numpy as np
import pytest

from hrsynth.errors import BadRequest
from hrsynth.mechanism import JointType
from hrsynth.present.view.server import serve
from hrsynth.present.view.view import View
from present.views import miss, moved, seen, serving

pytest.importorskip("meshcat")

FIVE_BAR = "rrrrr_m1"


@pytest.fixture(params=[FIVE_BAR, pytest.param("quattro", marks=pytest.mark.slow)])
def found(request: pytest.FixtureRequest) -> View:
    return seen(request.param)


@pytest.fixture
def address(found: View) -> Iterator[str]:
    with serving(found) as told:
        yield told


def ask(address: str, body: object) -> dict:
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    with urllib.request.urlopen(urllib.request.Request(address + "pose", data), timeout=20) as reply:
        return json.load(reply)


def law_closed(found: View, state: dict) -> None:
    mechanism = found.setting.mechanism
    places = dict(zip(mechanism.links, np.array(state["real"]), strict=True))
    assert max(miss(joint, *(places[link] for link in joint.links)) for joint in mechanism.joints.values()
               if joint.type is not JointType.FREE) < 1e-6


def test_several_coordinates_at_once_with_closed_loops(found: View, address: str):
    home = np.array([slider.values[slider.home] for slider in found.sliders])
    wanted = home + [0.1 * (slider.values[-1] - slider.values[0]) for slider in found.sliders]
    reply = ask(address, {"values": wanted.tolist()})
    assert not reply["stopped"]
    law_closed(found, reply["state"])
    mechanism = found.setting.mechanism
    place = np.array(reply["state"]["real"][list(mechanism.links).index(mechanism.platform)])
    point = moved(place, mechanism.links[mechanism.platform].pose[:3, 3])
    for slider, value in zip(found.sliders, wanted, strict=True):
        if slider.name in "xyz":
            assert point["xyz".index(slider.name)] == pytest.approx(value, abs=1e-6)
    assert reply["state"]["hidden"]
    back = ask(address, {"values": home.tolist(), "home": True, "modes": True})
    assert np.array(back["state"]["real"]) == pytest.approx(found.home.places["real"], abs=1e-6)
    assert len(back["ghosts"]) == len(found.ghosts)


def test_beyond_the_workspace_it_stops_at_its_edge(found: View, address: str):
    reply = ask(address, {"values": [5.0] * len(found.sliders)})
    assert reply["stopped"]
    law_closed(found, reply["state"])


@pytest.mark.parametrize("body", [{"values": [0.1]}, {"values": ["a", "b"]}, {"values": [float("nan")] * 2}, {}, [1],
                                  b"no json", b"x" * 20_000])
@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_what_is_no_question_is_refused(found: View, address: str, body: object):
    with pytest.raises(urllib.error.HTTPError) as error:
        ask(address, body)
    with error.value:
        assert error.value.code == 400


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_only_the_page_can_be_read(found: View, address: str):
    with urllib.request.urlopen(address, timeout=20) as reply:
        assert reply.read().startswith(b"<!DOCTYPE html>")
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(address + "etc/passwd", timeout=20)
    with error.value:
        assert error.value.code == 404


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_a_port_that_is_taken_is_refused(found: View):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(BadRequest, match="cannot serve the view"):
            serve(found, taken.getsockname()[1], pytest.fail)
