"""Reports in the browser: no complaint, nothing asked for, figures of some size, nothing wider than the page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from browser import Tab
from hrsynth.cli import run_command

pytestmark = pytest.mark.browser

FIVE = [("quattro", "1,4"), ("rrrrr_m1", "all"), ("3rrr_m1", "all"), ("gough_stewart", "all"), ("uranesx", "all")]
PICTURES = "[...document.images].every(i => i.complete && i.naturalWidth > 100)"
DRAWN = "[...document.querySelectorAll('figure svg')].every(s => s.getBoundingClientRect().width > 100)"
WIDE = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(("name", "legs"), FIVE, ids=[name for name, _ in FIVE])
def test_a_report_is_shown(tab: Tab, tmp_path: Path, name: str, legs: str):
    page = tmp_path / "report.html"
    assert run_command(["derive", name, "--observe", legs, "--report", str(page)]) == 0
    tab.open(page, "document.readyState == 'complete'")
    for law in (PICTURES, DRAWN, WIDE):
        assert tab.page.evaluate(law), law
    seen = tab.picture()
    assert len(np.unique(seen.reshape(-1, 3), axis=0)) > 50
    assert 0.02 < np.mean(seen.min(axis=2) < 200) < 0.5
    assert tab.page.evaluate("document.querySelectorAll('math').length") == (0 if name == "uranesx" else 1)


def test_a_report_is_read_on_a_small_screen_and_on_paper(tab: Tab, tmp_path: Path):
    page = tmp_path / "report.html"
    assert run_command(["derive", "uranesx", "--report", str(page)]) == 0
    tab.page.set_viewport_size({"width": 400, "height": 800})
    tab.open(page, "document.readyState == 'complete'")
    assert tab.page.evaluate(WIDE)
    tab.page.emulate_media(media="print")
    assert tab.page.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
    assert tab.page.pdf(format="A4")[:5] == b"%PDF-"


PRINTED = {"width": 695, "height": 1024}
"""What an A4 page has inside its margins of 13 mm (CSS pixels)."""


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(("name", "legs"), FIVE, ids=[name for name, _ in FIVE])
def test_a_report_prints_on_eight_full_pages(tab: Tab, tmp_path: Path, name: str, legs: str):
    """All of it is printed, the folded parts too; so pages that the height of what is printed fills are full."""
    page = tmp_path / "report.html"
    assert run_command(["derive", name, "--observe", legs, "--report", str(page)]) == 0
    tab.page.set_viewport_size(PRINTED)
    tab.open(page, "document.readyState == 'complete'")
    tab.page.emulate_media(media="print")
    shown = "[...document.querySelectorAll('details table')].every(t => t.getBoundingClientRect().height > 50)"
    assert tab.page.evaluate(shown)
    tall = tab.page.evaluate("document.body.getBoundingClientRect().height")
    count = len(re.findall(rb"/Type\s*/Page\b", tab.page.pdf(format="A4")))
    assert 2 <= count <= 8
    assert tall > 0.8 * (count - 0.5) * PRINTED["height"]
