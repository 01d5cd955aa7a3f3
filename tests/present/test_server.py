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
from hrsynth.present.view.server import Handler, Server, Session, serve
from hrsynth.present.view.view import View, view
from present.views import miss, moved, seen, serving
from strategies import planar

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
    question = urllib.request.Request(address + "pose", data, {"Origin": address.removesuffix("/")})
    with urllib.request.urlopen(question, timeout=20) as reply:
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
    assert len(back["ghosts"]) == len(found.mode_outlines)


def test_a_tilted_planar_robot_turns_by_the_angle_that_its_slider_shows():
    """As the page without a server has it, and as the server answers."""
    found = view(planar(["RPR"] * 3, np.random.default_rng(1), [{1}] * 3))
    link = list(found.setting.mechanism.links).index(found.setting.mechanism.platform)
    slider = found.scene()["sliders"][2]
    assert (slider["name"], slider["unit"]) == ("phi", "rad")
    normal = found.setting.motion.normal
    session, home = Session(found), [each.values[each.home] for each in found.sliders]
    shown = list(zip(slider["values"], slider["states"], strict=True))
    for value in (0.4, -0.3, 0.4 - 2 * np.pi):
        reply = session.answer({"values": [*home[:2], value]})
        assert not reply["stopped"]
        shown.append((value, reply["state"]))
    for value, state in shown:
        x, y, z, w = state["real"][link][3:]
        turn = 2 * np.arctan2([x, y, z] @ normal, w) - value
        assert (turn + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0, abs=1e-5)


def test_beyond_the_workspace_it_stops_at_its_edge(found: View, address: str):
    reply = ask(address, {"values": [5.0] * len(found.sliders)})
    assert reply["stopped"]
    law_closed(found, reply["state"])


@pytest.mark.parametrize("body", [{"values": [0.1]}, {"values": ["a", "b"]}, {"values": [float("nan")] * 2},
                                  {"values": [1e300, 0.0]}, {"values": [0.0, -1e6]}, {}, [1],
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


QUESTION = json.dumps({"values": [0.02, 0.24]})


def sent(address: str, lines: list[str], body: str = "") -> int:
    """The status of the answer to a request written by hand; 0 where there is none."""
    port = address.removesuffix("/").rpartition(":")[2]
    text = "\r\n".join(lines).replace("PORT", port) + "\r\n\r\n" + body
    with socket.create_connection(("127.0.0.1", int(port)), timeout=20) as line:
        line.sendall(text.encode())
        line.shutdown(socket.SHUT_WR)
        reply = line.makefile("rb").read()
    return int(reply.split()[1]) if reply.startswith(b"HTTP/") else 0


def posted(address: str, hosts: list[str], origins: list[str], body: str = QUESTION, size: str | None = None) -> int:
    return sent(address, ["POST /pose HTTP/1.1", *(f"Host: {each}" for each in hosts),
                          *(f"Origin: {each}" for each in origins), f"Content-Length: {size or len(body)}"], body)


HERE, OWN = ["127.0.0.1:PORT"], ["http://127.0.0.1:PORT"]
ELSEWHERE = ["", "evil.example", "evil.example:PORT", "127.0.0.1", "127.0.0.1:1", "127.0.0.1:PORT.evil.example",
             "127.0.0.1:PORT@evil.example", "localhost", "localhost.:PORT", "0.0.0.0:PORT", "127.0.0.2:PORT",
             "[::]:PORT", "127.0.0.1:0PORT", "127.1:PORT", "LOCALHOST.evil:PORT", "127.0.0.1:PORT, 127.0.0.1:PORT"]
FOREIGN = ["null", "", "http://evil.example", "https://127.0.0.1:PORT", "http://127.0.0.1", "http://127.0.0.1:1",
           "http://127.0.0.1:PORT/", "http://127.0.0.1:PORT.evil.example", "http://127.0.0.1:PORT@evil.example",
           "file://", "127.0.0.1:PORT", "http://evil.example http://127.0.0.1:PORT", "*"]


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_the_page_itself_is_answered(found: View, address: str):
    for name in ("127.0.0.1:PORT", "localhost:PORT", "[::1]:PORT"):
        assert sent(address, ["GET / HTTP/1.1", f"Host: {name}"]) == 200
        assert posted(address, [name], [f"http://{name}"]) == 200


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_other_names_of_this_machine_and_other_pages_are_refused(found: View, address: str):
    """A foreign name that leads here, and requests of a foreign page, whatever they look like."""
    for host in ELSEWHERE:
        assert sent(address, ["GET / HTTP/1.1", f"Host: {host}"]) == 403, host
        assert posted(address, [host], OWN) == 403, host
    for hosts in ([], HERE * 2, [*HERE, "evil.example"], ["evil.example", *HERE]):
        assert sent(address, ["GET / HTTP/1.1", *(f"Host: {each}" for each in hosts)]) == 403, hosts
        assert posted(address, hosts, OWN) == 403, hosts
    assert sent(address, ["GET / HTTP/1.0"]) == 403
    assert sent(address, ["GET http://evil.example/ HTTP/1.1", "Host: evil.example"]) == 403
    for origin in FOREIGN:
        assert posted(address, HERE, [origin]) == 403, origin
    for origins in ([], OWN * 2, [*OWN, "null"], ["http://evil.example", *OWN]):
        assert posted(address, HERE, origins) == 403, origins
    for method in ("OPTIONS", "PUT", "DELETE", "HEAD"):
        assert sent(address, [f"{method} /pose HTTP/1.1", "Host: 127.0.0.1:PORT", "Origin: http://evil.example"]) == 403


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
@pytest.mark.parametrize("size", ["-1", "+5", "1_0", "٣", "1e1", "10001", "99999999999999999999", ""])
def test_a_size_that_is_none_or_too_large_is_refused(found: View, address: str, size: str):
    assert posted(address, HERE, OWN, size=size or " ") == 400


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_a_question_that_does_not_end_is_given_up(found: View, address: str, monkeypatch: pytest.MonkeyPatch,
                                                   capfd: pytest.CaptureFixture[str]):
    monkeypatch.setattr(Handler, "timeout", 0.2)
    port = int(address.removesuffix("/").rpartition(":")[2])
    for text in ("GET /", f"POST /pose HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n"
                          "Content-Length: 100\r\n\r\n{"):
        with socket.create_connection(("127.0.0.1", port), timeout=20) as line:
            line.sendall(text.encode())
            assert b"200" not in line.makefile("rb").read()
    assert sent(address, ["GET / HTTP/1.1", "Host: 127.0.0.1:PORT"]) == 200
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_it_listens_on_this_machine_alone(found: View):
    server = Server(found, 0)
    with server:
        assert server.socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize("found", [FIVE_BAR], indirect=True)
def test_a_port_that_is_taken_is_refused(found: View):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(BadRequest, match="cannot serve the view"):
            serve(found, taken.getsockname()[1], pytest.fail)
