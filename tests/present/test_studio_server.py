"""The studio's server: its own page is answered, nothing else; limits; processes that come and go with their tab."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hrsynth.errors import BadRequest, MissingExtra
from hrsynth.present.studio import server as serving
from hrsynth.present.studio import tabs, uploads
from hrsynth.present.studio.server import StudioServer
from hrsynth.present.studio.tabs import StartupState
from patience import allow
from present.studio_client import (
    Page,
    alive,
    body_of,
    opened,
    origin_of,
    port_of,
    posted,
    read_all,
    said,
    soon,
    status_of,
)

pytest.importorskip("uvicorn")
websockets = pytest.importorskip("websockets")

DESK = "present.studio_desk:StandIn"
HERE, OWN = ["127.0.0.1:PORT"], ["http://127.0.0.1:PORT"]
ELSEWHERE = [
    "",
    "evil.example",
    "evil.example:PORT",
    "127.0.0.1",
    "127.0.0.1:1",
    "127.0.0.1:PORT.evil.example",
    "127.0.0.1:PORT@evil.example",
    "localhost",
    "localhost.:PORT",
    "0.0.0.0:PORT",
    "127.0.0.2:PORT",
    "[::]:PORT",
    "127.0.0.1:0PORT",
    "127.1:PORT",
    "LOCALHOST.evil:PORT",
    "127.0.0.1:PORT, 127.0.0.1:PORT",
    "127.0.0.1:PORT\xff",
]
FOREIGN = [
    "null",
    "",
    "http://evil.example",
    "https://127.0.0.1:PORT",
    "http://127.0.0.1",
    "http://127.0.0.1:1",
    "http://127.0.0.1:PORT/",
    "http://127.0.0.1:PORT.evil.example",
    "http://127.0.0.1:PORT@evil.example",
    "file://",
    "127.0.0.1:PORT",
    "http://evil.example http://127.0.0.1:PORT",
    "*",
    "http://localhost:PORT",
]
SOCKET = [
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
]


@pytest.fixture(scope="module")
def server() -> Iterator[StudioServer]:
    made = StudioServer(StartupState(), desk=DESK)
    yield made
    made.stop()


@pytest.fixture
def page(server: StudioServer) -> Iterator[Page]:
    with opened(server) as found:
        yield found


def wanted(server: StudioServer, kind: str, hosts: list[str], origins: list[str]) -> bytes:
    """What is answered to the page, a file of it, a file that is dropped in, the opening of a socket."""
    heads = {
        "page": "GET /SECRET/",
        "file": "GET /SECRET/studio.js",
        "upload": "POST /SECRET/upload?tab=x&name=a.urdf",
        "socket": "GET /SECRET/live",
    }
    more = {"socket": SOCKET, "upload": ["Content-Length: 2"]}.get(kind, [])
    return said(
        server,
        [
            f"{heads[kind]} HTTP/1.1",
            *(f"Host: {each}" for each in hosts),
            *(f"Origin: {each}" for each in origins),
            *more,
        ],
        b"ab" if kind == "upload" else b"",
    )


def law_refused(answer: bytes, *statuses: int) -> None:
    """Refused, with nothing told of what is there."""
    assert status_of(answer) in statuses, answer[:200]
    assert body_of(answer) == b"" or (status_of(answer) == 400 and len(body_of(answer)) < 200)


PASSED = {"page": 200, "file": 200, "upload": 404, "socket": 101}


@pytest.mark.parametrize("kind", PASSED)
def test_the_page_itself_is_answered(server: StudioServer, kind: str):
    for name in ("127.0.0.1:PORT", "localhost:PORT", "[::1]:PORT"):
        assert status_of(wanted(server, kind, [name], [f"http://{name}"])) == PASSED[kind]
    for kind in ("page", "file"):
        assert status_of(wanted(server, kind, HERE, [])) == 200


@pytest.mark.parametrize("kind", PASSED)
def test_a_foreign_host_name_is_refused(server: StudioServer, kind: str):
    for host in ELSEWHERE:
        law_refused(wanted(server, kind, [host], [f"http://{host}"]), 400, 403)
        law_refused(wanted(server, kind, [host], OWN), 400, 403)
    for hosts in ([], HERE * 2, [*HERE, "evil.example"], ["evil.example", *HERE]):
        law_refused(wanted(server, kind, hosts, OWN), 400, 403)
    law_refused(said(server, ["GET /SECRET/ HTTP/1.0"]), 403)
    law_refused(said(server, ["GET http://evil.example/SECRET/ HTTP/1.1", "Host: evil.example"]), 403)
    law_refused(said(server, ["GET http://127.0.0.1:PORT/SECRET/ HTTP/1.1", "Host: 127.0.0.1:PORT"]), 404)


@pytest.mark.parametrize("kind", PASSED)
def test_another_origins_page_is_refused(server: StudioServer, kind: str):
    for origin in FOREIGN:
        law_refused(wanted(server, kind, HERE, [origin]), 400, 403)
    for origins in (
        [] if kind in ("upload", "socket") else ["null"],
        OWN * 2,
        [*OWN, "null"],
        ["http://evil.example", *OWN],
    ):
        law_refused(wanted(server, kind, HERE, origins), 400, 403)
    for method in ("OPTIONS", "PUT", "DELETE", "PATCH", "TRACE", "POST"):
        answer = said(server, [f"{method} /SECRET/ HTTP/1.1", "Host: 127.0.0.1:PORT", "Origin: http://evil.example"])
        law_refused(answer, 403)


def test_who_does_not_know_the_secret_is_refused(server: StudioServer):
    secret = server.guard.secret
    for wrong in (
        "",
        secret[:-1],
        secret + "x",
        secret.swapcase(),
        secret[::-1],
        "x" * 10_000,
        f"/{secret}",
        f"x/../{secret}",
        f"%{ord(secret[0]):02x}{secret[1:]}",
        f"{secret}%00",
    ):
        law_refused(said(server, [f"GET /{wrong}/ HTTP/1.1", "Host: 127.0.0.1:PORT"]), 404)
        assert status_of(
            said(
                server,
                [f"GET /{wrong}/live HTTP/1.1", "Host: 127.0.0.1:PORT", "Origin: http://127.0.0.1:PORT", *SOCKET],
            )
        ) in (0, 404)
    law_refused(said(server, [f"GET /{secret} HTTP/1.1", "Host: 127.0.0.1:PORT"]), 303)
    assert len(secret) >= 40
    assert secret not in (server.guard.door(), StudioServer.__doc__)


def test_the_door_for_the_browser_opens_once(server: StudioServer):
    door = server.guard.door()
    first, second = (said(server, [f"GET /{door}/ HTTP/1.1", "Host: 127.0.0.1:PORT"]) for _ in range(2))
    assert status_of(first) == 303
    assert f"location: /{server.guard.secret}/\r\n".encode() in first
    law_refused(second, 404)
    law_refused(said(server, [f"GET /{server.guard.door()}/ HTTP/1.1", "Host: evil.example"]), 403)


@pytest.mark.parametrize(
    "path",
    [
        "../server.py",
        "..%2fserver.py",
        "%2e%2e/server.py",
        "%2e%2e%2f%2e%2e%2fworker.py",
        "..\\server.py",
        "..%5cserver.py",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "//etc/passwd",
        "studio.html/../../server.py",
        "studio.html%00.js",
        "server.py",
        ".",
        "..",
        "./studio.html",
        "%2e/studio.html",
        "file:///etc/passwd",
        "studio",
        "STUDIO.HTML.js",
        "a" * 5000,
        "%ff%fe",
        "%",
        "upload",
        "live",
    ],
)
def test_no_path_leads_out_of_the_pages_folder(server: StudioServer, path: str):
    answer = said(server, [f"GET /SECRET/{path} HTTP/1.1", "Host: 127.0.0.1:PORT"])
    assert status_of(answer) in (400, 403, 404, 405)
    assert b"import" not in body_of(answer)
    assert b"root:" not in body_of(answer)


def test_a_link_in_the_pages_folder_is_not_followed(server: StudioServer, tmp_path: Path, monkeypatch):
    (tmp_path / "own.js").write_text("1")
    (tmp_path / "link.js").symlink_to("/etc/passwd")
    monkeypatch.setattr(serving, "PAGE", tmp_path)
    assert body_of(said(server, ["GET /SECRET/own.js HTTP/1.1", "Host: 127.0.0.1:PORT"])) == b"1"
    law_refused(said(server, ["GET /SECRET/link.js HTTP/1.1", "Host: 127.0.0.1:PORT"]), 404)


def test_every_answer_has_the_strict_policy(server: StudioServer):
    for path in ("", "studio.js", "nothing.js"):
        answer = said(server, [f"GET /SECRET/{path} HTTP/1.1", "Host: 127.0.0.1:PORT"])
        head = answer.partition(b"\r\n\r\n")[0].decode().lower()
        fields = dict(line.split(": ", 1) for line in head.splitlines()[1:])
        policy = dict(part.strip().split(" ", 1) for part in fields["content-security-policy"].split(";"))
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == policy["style-src"] == "'self'"
        assert policy["connect-src"] == f"'self' ws://127.0.0.1:{port_of(server)}"
        assert policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == "'none'"
        assert "unsafe" not in fields["content-security-policy"]
        assert (fields["x-content-type-options"], fields["referrer-policy"], fields["cache-control"]) == (
            "nosniff",
            "no-referrer",
            "no-store",
        )
        assert "server" not in fields


def test_the_page_has_no_scripts_or_styles_inside():
    for file in serving.PAGE.glob("*.html"):
        text = file.read_text()
        assert re.findall(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=|javascript:|https?://", text) == []


def test_it_listens_on_this_machine_alone():
    with serving.bound(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"


def test_a_port_that_is_taken_is_refused(server: StudioServer):
    for port in (port_of(server), 70_000, -1):
        with pytest.raises(BadRequest, match="cannot serve the page"):
            StudioServer(StartupState(), port, desk=DESK)


def test_without_its_libraries_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    with pytest.raises(MissingExtra, match=re.escape('pip install "hrsynth[studio]"')):
        StudioServer(StartupState(), desk=DESK)


def test_two_tabs_have_processes_and_files_of_their_own(server: StudioServer):
    with opened(server) as one, opened(server) as other:
        assert one.start["tab"] != other.start["tab"]
        found = [page.ask(kind)["answer"] for page in (one, other) for kind in ("move", "open")]
        assert len({each["process"] for each in found}) == 4
        assert found[0]["uploads"] == found[1]["uploads"] != found[2]["uploads"] == found[3]["uploads"]
        assert status_of(posted(server, one.start["tab"], "a.urdf", b"first")) == 200
        assert status_of(posted(server, other.start["tab"], "a.urdf", b"second")) == 200
        assert [page.ask("read", name="a.urdf")["answer"]["text"] for page in (one, other)] == ["first", "second"]
        number = other.send("sleep", seconds=60)
        assert one.ask("open")["answer"]["process"] == found[1]["process"]
        other.line.send(json.dumps({"ask": "cancel", "of": number}))  # without a number of its own
        assert other.heard()["kind"] == "Cancelled"


def test_more_tabs_than_are_served_are_told(server: StudioServer, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(tabs, "STUDIO_TABS_MAX", 1)
    with opened(server) as first:
        assert "tab" in first.start
        with pytest.raises(websockets.ConnectionClosed, match="1 tabs are open"), opened(server):
            pass
    assert soon(lambda: not server_tabs(server))


def server_tabs(server: StudioServer) -> list[str]:
    return os.listdir(server.folder.name)


@pytest.mark.slow
def test_a_tab_that_goes_away_in_the_middle_takes_all_with_it(server: StudioServer):
    with opened(server) as page:
        processes = [page.ask(kind)["answer"]["process"] for kind in ("move", "open")]
        child = page.ask("start")["answer"]["child"]
        assert status_of(posted(server, page.start["tab"], "a.urdf", b"x")) == 200
        page.send("busy")
        time.sleep(0.2)
        page.line.socket.close()
    for process in (*processes, child):
        assert soon(lambda process=process: not alive(process))
    assert soon(lambda: server_tabs(server) == [])


def test_a_move_never_waits_for_another_question(page: Page):
    page.ask("move")
    sleeping = page.send("sleep", seconds=60)
    begin = time.monotonic()
    for _ in range(20):
        assert "answer" in page.ask("move")
    assert time.monotonic() - begin < allow(5)
    page.send("cancel", of=sleeping)
    assert page.heard()["n"] == sleeping


def test_a_question_that_takes_too_long_is_given_up(server: StudioServer, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(tabs, "REQUEST_TIMEOUT_S", 0.3)
    with opened(server) as page:
        before = page.ask("open")["answer"]["process"]
        for kind in ("busy", "sleep"):
            answer = page.ask(kind, seconds=60)
            assert (answer["kind"], answer["error"]) == (
                "TooSlow",
                "the analysis took longer than 0.3 seconds and was cancelled",
            )
        after = page.ask("open")["answer"]["process"]
        assert before != after
        assert soon(lambda: not alive(before))


def test_what_fails_is_one_line_and_the_next_is_answered(page: Page):
    process = page.ask("open")["answer"]["process"]
    for kind, fields, told, name in (
        ("refuse", {}, "nothing fits: got 7, expected less", "BadRequest"),
        ("defect", {}, "a defect of hrsynth itself, please report it: ZeroDivisionError: by zero", "Defect"),
        ("nan", {}, "a defect of hrsynth itself", "Defect"),
        ("eat", {"bytes": 10**11}, "more memory than the limit (4 GB)", "MemoryError"),
        ("echo", {"text": "x", "times": 70_000_000}, "bytes, at most", "TooLarge"),
    ):
        answer = page.ask(kind, **fields)
        assert told in answer["error"]
        assert answer["kind"] == name
        assert "\n" not in answer["error"]
    assert page.ask("open")["answer"]["process"] == process
    assert page.ask("end")["kind"] == "Ended"
    assert page.ask("open")["answer"]["process"] != process


def test_a_cancelled_question_leaves_the_others(page: Page):
    first = page.send("sleep", seconds=60)
    waiting, last = page.send("sleep", seconds=60), page.send("open")
    page.send("cancel", of=waiting)
    page.send("cancel", of=first)
    page.line.send(json.dumps({"ask": "cancel", "of": -1}))
    page.send("cancel", of=last + 100)
    answers = {each["n"]: each for each in (page.heard() for _ in range(3))}
    assert [answers[each].get("kind") for each in (first, waiting, last)] == ["Cancelled", "Cancelled", None]


def test_a_process_that_ended_at_rest_is_replaced(page: Page):
    for kind in ("move", "open"):
        process = page.ask(kind)["answer"]["process"]
        os.kill(process, signal.SIGKILL)
        assert soon(lambda process=process: not alive(process))
        time.sleep(0.2)
        assert page.ask(kind)["answer"]["process"] != process


@pytest.mark.parametrize(
    "message",
    [
        "",
        "x",
        "[]",
        "7",
        "null",
        '"x"',
        "{}",
        '{"n": 1}',
        '{"ask": "open"}',
        '{"n": "1", "ask": "open"}',
        '{"n": 1.5, "ask": "open"}',
        '{"n": 1, "ask": 7}',
        '{"n": true, "ask": "open"}',
        '{"n": 1, "ask": "cancel"}',
        '{"ask": "cancel", "of": "x"}',
        '{"ask": ["open"], "n": 1}',
        '{"n": 1, "ask": "open"',
        "[" * 100_000,
        '{"n": 1, "ask": "open", "x": ' + '{"a":' * 20_000 + "1" + "}" * 20_001,
        '{"n": ' + "9" * 5000 + ', "ask": "open"}',
        '{"n": NaN, "ask": "open"}',
        '{"n": 1, "ask": "open", "x": Infinity}',
        b"\x00\x01",
        '{"n": 1, "ask": "\\ud800"}x',
    ],
    ids=lambda text: repr(text)[:40],
)
def test_what_is_no_message_is_refused(page: Page, message: str | bytes):
    page.line.send(message)
    answer = page.heard()
    assert answer["kind"] == "Unknown"
    assert "\n" not in answer["error"]
    assert "answer" in page.ask("open")


def test_a_message_that_is_too_large_ends_the_tab(server: StudioServer):
    with opened(server) as page:
        assert "answer" in page.ask("echo", text="x" * 250_000)
        page.line.send(json.dumps({"n": 9, "ask": "echo", "text": "x" * 2**18}))
        with pytest.raises(websockets.ConnectionClosed) as closed:
            page.heard()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1009


@pytest.mark.slow
def test_too_many_questions_at_once_are_refused(page: Page, monkeypatch: pytest.MonkeyPatch):
    from hrsynth.present.studio import processes

    monkeypatch.setattr(processes, "STUDIO_WAITING_REQUESTS_MAX", 3)
    numbers = [page.send("sleep", seconds=0.5) for _ in range(10)]
    kinds = {each["n"]: each.get("kind") for each in (page.heard() for _ in numbers)}
    assert [*kinds.values()].count("TooMany") >= 5
    assert kinds[numbers[0]] is None


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../x.urdf",
        "..%2Fx.urdf",
        "%2Fetc%2Fpasswd",
        "a%2Fb.urdf",
        "a%5Cb.urdf",
        ".hidden",
        "-rf",
        "a%00.urdf",
        "a%0A.urdf",
        "x.",
        "x%20",
        "~",
        "a:b",
        "a%2F..%2F..%2Fb",
        "%E2%80%AEx.urdf",
        "%ff",
        "a" * 201,
        "%C3%A9" * 101,
        "a*",
    ],
)
def test_names_that_lead_elsewhere_are_refused(server: StudioServer, page: Page, name: str):
    answer = posted(server, page.start["tab"], name, b"x")
    assert status_of(answer) == 400
    assert json.loads(body_of(answer))["kind"] == "BadRequest"
    folder = Path(server.folder.name)
    assert [each for each in folder.rglob("*") if each.is_file()] == []


def test_a_file_is_whole_and_replaced_as_a_whole(server: StudioServer, page: Page):
    tab = page.start["tab"]
    for text in ("one", "another"):
        answer = posted(server, tab, "R%C3%B6bot%20(1).urdf", text.encode())
        assert json.loads(body_of(answer)) == {"file": "Röbot (1).urdf"}
        assert page.ask("read", name="Röbot (1).urdf")["answer"]["text"] == text
    chunks = b"3\r\nabc\r\n2\r\nde\r\n0\r\n\r\n"
    assert status_of(posted(server, tab, "b.xml", chunks, "Transfer-Encoding: chunked")) == 200
    assert page.ask("read", name="b.xml")["answer"]["text"] == "abcde"
    assert status_of(posted(server, "other", "c.xml", b"x")) == 404


@pytest.mark.parametrize("size", ["1000000000", "20000001", "9" * 30, "-1", "+5", "1_0", "1e1", "0x10", " "])
def test_a_file_of_a_gigabyte_is_refused_before_it_comes(server: StudioServer, page: Page, size: str):
    begin = time.monotonic()
    answer = posted(server, page.start["tab"], "big.stl", b"x" * 1000, f"Content-Length: {size}")
    assert status_of(answer) in (400, 413)
    assert time.monotonic() - begin < allow(5)
    assert os.listdir(Path(server.folder.name, page.start["tab"])) == []


def test_a_file_without_a_length_is_counted_while_it_comes(
    server: StudioServer, page: Page, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(uploads, "UPLOAD_MAX_BYTES", 100_000)
    tab, sent = page.start["tab"], 0
    head = (
        f"POST /{server.guard.secret}/upload?tab={tab}&name=big.stl HTTP/1.1\r\n"
        f"Host: 127.0.0.1:{port_of(server)}\r\nOrigin: {origin_of(server)}\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as line:
        line.sendall(head.encode())
        try:
            while sent < 10**9:
                line.sendall(b"10000\r\n" + b"x" * 0x10000 + b"\r\n")
                sent += 0x10000
        except OSError:
            pass
        answer = read_all(line)
    assert sent < 10**8
    assert status_of(answer) in (413, 0)  # 0 where the system drops the answer with the rest
    assert soon(lambda: os.listdir(Path(server.folder.name, tab)) == [])
    assert "answer" in page.ask("open")


def test_no_more_files_than_a_tab_may_have(server: StudioServer, page: Page, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(uploads, "UPLOADED_FILES_MAX", 2)
    names = ["a", "b", "a", "c", "b"]
    assert [status_of(posted(server, page.start["tab"], name, b"x")) for name in names] == [200, 200, 200, 400, 200]


def test_a_file_that_breaks_off_is_not_kept(server: StudioServer, page: Page):
    assert status_of(posted(server, page.start["tab"], "half.urdf", b"x", "Content-Length: 100")) in (0, 400, 500)
    assert soon(lambda: os.listdir(Path(server.folder.name, page.start["tab"])) == [])


def test_slow_senders_are_given_up(
    server: StudioServer, page: Page, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    for module in (serving, uploads):
        monkeypatch.setattr(module, "SENDER_TIMEOUT_S", 0.2)
    tab, port = page.start["tab"], port_of(server)
    whole = (
        f"POST /{server.guard.secret}/upload?tab={tab}&name=a.urdf HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
        f"Origin: http://127.0.0.1:{port}\r\nContent-Length: 100\r\n\r\n"
    )
    for text in ("", "GET /", whole[:60], whole + "ab"):
        with socket.create_connection(("127.0.0.1", port), timeout=5) as line:
            line.sendall(text.encode())
            assert status_of(read_all(line)) in (0, 408)
    assert os.listdir(Path(server.folder.name, tab)) == []
    assert "answer" in page.ask("open")  # who has come in time stays
    assert capfd.readouterr() == ("", "")


def test_odd_bytes_are_refused_without_a_word(server: StudioServer, capfd: pytest.CaptureFixture[str]):
    for text in (
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"GET /\xff\xfe HTTP/1.1\r\n\r\n",
        b"\r\n" * 1000,
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"x" * 100_000,
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 20_000 + b"\r\n",
    ):
        with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as line:
            try:
                line.sendall(text)
                line.shutdown(socket.SHUT_WR)
            except OSError:
                pass
            assert status_of(read_all(line)) in (0, 400, 403, 404)
    assert capfd.readouterr() == ("", "")


def test_a_socket_of_another_page_is_refused_by_a_client_too(server: StudioServer):
    for origin in (None, "null", "http://evil.example"):
        with pytest.raises(websockets.InvalidStatus) as refused, opened(server, origin):
            pass
        assert refused.value.response.status_code == 403


def test_the_first_message_says_what_was_opened(tmp_path: Path):
    first = {"watch": ["1"], "camera": None}
    made = StudioServer(
        StartupState(tmp_path, {"robot": "3rrr_m1", "options": {}}, first=first, panels=False), desk=DESK
    )
    try:
        with opened(made) as page:
            assert {**page.start, "tab": ""} == {
                "start": {"source": "given", "options": {}},
                "tab": "",
                **first,
                "folder": True,
                "panels": False,
            }
            found = page.ask("open")["answer"]
            assert (found["folder"], found["given"]) == (str(tmp_path), {"robot": "3rrr_m1", "options": {}})
            assert re.fullmatch(r"<StudioServer: http://127\.0\.0\.1:\d+/[\w-]+/>", repr(made))
            process = found["process"]
    finally:
        made.stop()
    assert soon(lambda: not alive(process) and not Path(made.folder.name).exists())


@pytest.mark.slow
def test_thousands_of_questions_and_many_tabs_leave_nothing(server: StudioServer):
    """Memory of the server, of what forks and of what answers; open files."""

    def size(process: int | str) -> float:
        found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process}/status").read_text())
        assert found
        return int(found[1]) / 1024

    def files() -> int:
        return len(os.listdir("/proc/self/fd")) + len(os.listdir(f"/proc/{server.forks.process.pid}/fd"))

    if not Path("/proc/self/status").is_file():
        pytest.skip("no /proc here")
    assert soon(lambda: server_tabs(server) == [])
    with opened(server) as page:
        before = files()
        processes = [os.getpid(), server.forks.process.pid, page.ask("move")["answer"]["process"]]
        for number in range(3000):
            page.ask("move" if number % 2 else "echo", text="x" * 2000)
            if number == 500:
                at_first = [size(each) for each in processes]
        assert all(size(each) < first + 3 for each, first in zip(processes, at_first, strict=True))
    for _ in range(20):
        with opened(server) as page:
            page.ask("move")
    assert soon(lambda: files() < before)


def test_processes_come_back_where_their_source_was_ended():
    made = StudioServer(StartupState(), desk=DESK)
    try:
        with opened(made) as page:
            first = page.ask("open")["answer"]["process"]
            made.forks.process.kill()
            made.forks.process.wait()
            page.send("end")
            page.heard()
            assert page.ask("open")["answer"]["process"] != first
    finally:
        made.stop()


@pytest.mark.browser
def test_a_browser_keeps_another_pages_script_out(server: StudioServer, page: Page, browser: Any):
    """A page of another origin in the same browser, which even knows the secret: no answer, no file, no frame."""
    from http.server import BaseHTTPRequestHandler, HTTPServer
    from threading import Thread

    class Other(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!DOCTYPE html><title>other</title>")

        def log_message(self, format: str, *args: object) -> None:
            pass

    other = HTTPServer(("127.0.0.1", 0), Other)
    Thread(target=other.serve_forever, daemon=True).start()
    tab = browser.new_page()
    try:
        tab.goto(f"http://127.0.0.1:{other.server_port}/")
        found = tab.evaluate(
            """async ([address, tab]) => {
            const socket = await new Promise((done) => {
                const line = new WebSocket(address.replace("http", "ws") + "live");
                line.onopen = () => done("open");
                line.onerror = () => done("refused");
            });
            const tried = async (path, more) => fetch(address + path, more).then((r) => r.text(), () => "refused");
            const script = await new Promise((done) => {
                const made = document.createElement("script");
                made.onload = () => done("run"); made.onerror = () => done("refused");
                made.src = address + "studio.js"; document.head.append(made);
            });
            return [socket, script, await tried(""), await tried("", { mode: "no-cors" }),
                    await tried(`upload?tab=${tab}&name=a.urdf`, { method: "POST", body: "x" }),
                    await tried(`upload?tab=${tab}&name=b.urdf`, { method: "POST", body: "x", mode: "no-cors" })];
        }""",
            [server.address, page.start["tab"]],
        )
        assert [each or "refused" for each in found] == ["refused"] * len(found)
        assert os.listdir(Path(server.folder.name, page.start["tab"])) == []
    finally:
        tab.close()
        other.shutdown()
        other.server_close()
