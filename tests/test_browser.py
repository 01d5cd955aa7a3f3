"""The browser itself: it shows pages and WebGL, and hears what is wrong in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from browser import Tab

pytestmark = pytest.mark.browser

PAGE = "<!DOCTYPE html><title>t</title><link rel=icon href=data:,><style>body{{background:#f00}}</style>{}"
TRIANGLE = """<canvas id=c width=300 height=300></canvas><script>
const gl = document.getElementById('c').getContext('webgl');
gl.clearColor(0, 0, 1, 1); gl.clear(gl.COLOR_BUFFER_BIT);
</script>"""


def write(folder: Path, body: str) -> Path:
    file = folder / "page.html"
    file.write_text(PAGE.format(body))
    return file


def test_a_page_is_seen_with_its_canvas(tab: Tab, tmp_path: Path):
    tab.open(write(tmp_path, TRIANGLE), "document.readyState == 'complete'")
    seen = tab.picture(tmp_path / "seen.png")
    assert (seen[-1, -1] == (255, 0, 0)).all()
    assert np.all(seen == (0, 0, 255), axis=2).sum() > 80_000
    assert (tmp_path / "seen.png").stat().st_size > 0


@pytest.mark.parametrize(
    ("body", "heard"),
    [
        ("<script>console.error('so it is')</script>", "console: so it is"),
        ("<script>nothing.at.all</script>", "uncaught: nothing is not defined"),
        ("<img src=missing.png>", "not loaded: file://"),
        ("<img src=http://robots.invalid/a.png>", "asks the network for http://robots.invalid/a.png"),
    ],
)
def test_what_is_wrong_in_a_page_is_heard(tab: Tab, tmp_path: Path, body: str, heard: str):
    tab.open(write(tmp_path, body), "document.readyState == 'complete'")
    found, tab.complaints[:] = list(tab.complaints), []
    assert any(each.startswith(heard) for each in found), found
