"""A view in a notebook: the page in a frame; as a file; served while other things are done."""

from __future__ import annotations

import html
import re
import urllib.error
import urllib.request
from pathlib import Path

import pytest

import hrsynth
from browser import Tab
from hrsynth.errors import BadRequest


@pytest.fixture(scope="module")
def found():
    return hrsynth.view("3rrr_m1", hidden=True)


@pytest.mark.slow
def test_a_notebook_holds_the_page_itself(found, tmp_path):
    shown = found._repr_html_()
    (inner,) = re.findall(r'srcdoc="([^"]*)"', shown)
    found.save(tmp_path / "view.html")
    assert html.unescape(inner) == (tmp_path / "view.html").read_text(encoding="utf-8")
    assert shown.startswith("<iframe ")
    assert shown.endswith("</iframe>")


def test_a_view_is_written_as_a_page_alone(found, tmp_path):
    with pytest.raises(BadRequest, match="html"):
        found.save(tmp_path / "view.png")
    with pytest.raises(BadRequest, match="folder"):
        found.save(tmp_path / "none" / "view.html")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_view_is_served_until_it_is_stopped(found):
    pytest.importorskip("uvicorn")
    server = found.serve(open_=False)
    assert server.address in repr(server)
    with urllib.request.urlopen(server.address, timeout=10) as reply:
        assert reply.read().startswith(b"<!DOCTYPE html>")
    with pytest.raises(BadRequest, match="free port"):
        found.serve(int(server.root.strip("/").rpartition(":")[2]), open_=False)
    server.stop()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(server.address, timeout=2)


@pytest.mark.browser
def test_the_frame_moves_in_a_browser(found, tab: Tab, tmp_path: Path):
    (tmp_path / "cell.html").write_text(f"<!DOCTYPE html><body>{found._repr_html_()}", encoding="utf-8")
    tab.open(tmp_path / "cell.html", "document.querySelector('iframe').contentDocument.body?.dataset.ready === 'yes'")
    frame = tab.page.frames[1]
    before = frame.evaluate("document.getElementById('now').textContent")
    frame.evaluate("""() => { const slider = document.querySelector('.sliders input');
                              slider.value = slider.max; slider.dispatchEvent(new Event('input')); }""")
    frame.wait_for_function("before => document.getElementById('now').textContent !== before", arg=before)
    assert tab.complaints == []
