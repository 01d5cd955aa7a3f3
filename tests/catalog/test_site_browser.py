"""The site in a browser, from files: filter, search, sort, open a page, choose motors; nothing complains."""

from __future__ import annotations

from pathlib import Path

import pytest

from browser import Tab
from hrsynth.catalog import Catalog
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.entry import build_entry
from hrsynth.catalog.jsonl import format_line, parse_record
from hrsynth.catalog.site import index, write_site
from hrsynth.catalog.site.structures import group_structures, hash_name
from hrsynth.present.palette import get_colour, make_tint

pytestmark = pytest.mark.browser
READY = "document.readyState == 'complete'"
LISTED = "document.querySelectorAll('#list tbody tr').length"


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    words = ("3(Rz*-Rz-Rz)", "3(Rz-Rz*-Rz)", "(Rz!-Rz-Rz*)+2(Rz*!-Rz-Rz)", "2(Rt*-2SSt)", "3(Ra*!-Rb-Ra-Ph)")
    folder = tmp_path_factory.mktemp("pages") / "site"
    write_site(Catalog(tuple(parse_record(format_line(build_entry(word))) for word in words)), folder)
    return folder


def rows(tab: Tab) -> list[str]:
    """The words that are listed."""
    return tab.page.locator("#list tbody code").all_inner_texts()


def test_filters_search_and_sort_are_kept_in_the_address(tab: Tab, target: Path):
    tab.open(target / "index.html", f"{LISTED} == 5")
    assert tab.page.locator("#count").inner_text() == "5 of 5 architectures"
    tab.page.get_by_label("Verdict").select_option("null")
    assert rows(tab) == ["3(Ra*!-Rb-Ra-Ph)"]
    tab.page.get_by_role("button", name="Clear").click()
    tab.page.get_by_label("Group").select_option("planar")
    tab.page.get_by_label("Search").fill("3-R̲RR Π")
    tab.page.wait_for_function(f"{LISTED} == 1")
    assert rows(tab) == ["3(Rz*-Rz-Rz)"]
    assert "group=planar" in tab.page.url
    tab.page.get_by_label("Search").fill("")
    tab.page.wait_for_function(f"{LISTED} == 3")
    tab.page.get_by_role("button", name="robot", exact=True).click()
    up = rows(tab)
    tab.page.get_by_role("button", name="robot", exact=False).first.click()
    assert rows(tab) == up[::-1]
    assert tab.page.locator("th[aria-sort=descending]").inner_text().startswith("robot")
    tab.page.reload()
    assert rows(tab) == up[::-1]


def test_a_page_shows_the_motors_of_the_architecture_that_was_chosen(tab: Tab, target: Path):
    tab.open(target / "index.html", f"{LISTED} == 5")
    tab.page.get_by_label("Motors").select_option("0")
    link = tab.page.locator("#list tbody tr", has_text="3(Rz-Rz*-Rz)").get_by_role("link")
    link.focus()
    tab.page.keyboard.press("Enter")
    tab.page.wait_for_function("document.getElementById('word')?.textContent == '3(Rz-Rz*-Rz)'")
    moved = tab.page.locator("#real .motor [data-joint]")
    assert [joint.get_attribute("data-joint") for joint in moved.all()] == [f"joint_{k}_2" for k in (1, 2, 3)]
    assert (
        moved.first.evaluate("each => getComputedStyle(each).fill")
        == f"rgb{tuple(bytes.fromhex(make_tint(get_colour('motor'))[1:]))}"
    )
    assert tab.page.locator("#file a").get_attribute("href") == f"../r/{hash_name('3(Rz-Rz*-Rz)')}.urdf"
    tab.page.locator("#variants").get_by_role("link", name="3-RRR").first.click()
    tab.page.wait_for_function("document.getElementById('word').textContent == '3(Rz*-Rz-Rz)'")
    assert moved.first.get_attribute("data-joint") == "joint_1_1"
    tab.page.get_by_role("link", name="All architectures").click()
    tab.page.wait_for_function(f"{LISTED} == 2")


def test_a_narrow_window_needs_no_scrolling_to_the_side(tab: Tab, target: Path):
    tab.page.set_viewport_size({"width": 360, "height": 700})
    for file in (target / "index.html", *sorted((target / "p").iterdir())):
        tab.open(file, READY)
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= 360, file


def test_twelve_thousand_records_are_filtered_within_a_moment(tab: Tab, target: Path, tmp_path: Path):
    known = group_structures(parse_record(format_line(build_entry(word))) for word in ("3(Rz*-Rz-Rz)", "2(Rt*-2SSt)"))
    (tmp_path / "p").mkdir()
    index.write(tmp_path, known * 6000)
    tab.open(tmp_path / "index.html", f"{LISTED} == 50")
    took = tab.page.evaluate("""() => {
        const select = document.querySelector('[name=group]');
        const start = performance.now();
        select.value = 'deltas';
        select.dispatchEvent(new Event('change'));
        return performance.now() - start;
    }""")
    assert tab.page.locator("#count").inner_text() == "6,000 of 12,000 architectures"
    assert took < 1000
    tab.page.get_by_role("button", name="Next").click()
    assert tab.page.locator("#place").inner_text() == "page 2 of 120"


def test_a_search_finds_what_is_on_the_screen_and_known_names(tab: Tab, tmp_path: Path):
    known = {
        "3(Rt-Pl*-S)": "3-RP*S",
        "3(Rt*-2SSt)": "3-R*-{2-SS}",
        "6(Utn-Pl*-S)": "6-UP*S",
        "(Ph*-Pj-Rz)+2(Rz*-Rz-Rz)": "P*PR+2-R*RR",
    }
    facts = [
        {"key": word, "group": "none", "legs": len(parse(word).legs), "notation": notation}
        for word, notation in known.items()
    ]
    index.write(tmp_path, group_structures(facts))
    tab.open(tmp_path / "index.html", f"{LISTED} == 4")
    assert rows(tab)[-1] == "(Ph*-Pj-Rz)+2(Rz*-Rz-Rz)"
    for asked, found in (
        ("3-RPS", 0),
        ("delta", 1),
        ("RPS", 0),
        ("2-SS", 1),
        ("3-RP*S", 0),
        ("refused 6-UPS", 2),
        ("Delta", 1),
        ("Stewart", 2),
    ):
        tab.page.get_by_label("Search").fill(asked)
        tab.page.wait_for_function(f"new URLSearchParams(location.hash.slice(1)).get('q') == {asked!r}")
        assert rows(tab) == [facts[found]["key"]], asked
    tab.page.get_by_text("Explanations").click()
    assert tab.page.get_by_text("2T1R are two translations").is_visible()


def test_rows_have_drawings_and_a_page_shows_its_robot(tab: Tab, target: Path):
    tab.open(target / "index.html", f"{LISTED} == 5")
    tab.page.wait_for_function("[...document.images].every(i => i.complete && i.naturalWidth > 50)")
    assert tab.page.locator("#list tbody img").count() == 5
    assert "controllable" in (tab.page.locator("#list td[data-field=verdict]").first.get_attribute("class") or "")
    tab.page.locator("#list tbody a").first.click()
    tab.page.wait_for_function("document.querySelector('.hero svg') !== null")
    assert tab.page.locator(".hero svg path").count() > 5
    assert tab.page.locator("script").count() == 1, "small and still"
