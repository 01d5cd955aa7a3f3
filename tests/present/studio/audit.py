"""What a page is for people who do not see it well, or use no mouse: names of its controls, contrast, focus, sizes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

CONTROLS = {
    "button",
    "checkbox",
    "radio",
    "slider",
    "combobox",
    "listbox",
    "tab",
    "link",
    "textbox",
    "spinbutton",
    "DisclosureTriangle",
    "tablist",
    "tabpanel",
    "radiogroup",
}
"""Roles that need a name, as Chromium's tree of accessibility calls them."""
ENOUGH, ENOUGH_LARGE = 4.5, 3.0
"""Contrast of text, and of large text (WCAG 2.2, AA)."""
WORDS = (Path(__file__).parent / "contrast.js").read_text(encoding="utf-8")


def nameless(page: Any) -> list[str]:
    """Controls that a screen reader could not name, from the browser's own tree."""
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    return [
        str(node["role"]["value"])
        for node in nodes
        if not node.get("ignored")
        and node["role"]["value"] in CONTROLS
        and not node.get("name", {}).get("value", "").strip()
    ]


def faint(page: Any) -> list[str]:
    """Texts whose contrast to what lies behind them is too small."""
    return [
        f"{words}: {ratio:.2f}"
        for words, ratio, large in page.evaluate(WORDS)
        if ratio < (ENOUGH_LARGE if large else ENOUGH)
    ]


def beyond(page: Any) -> list[str]:
    """Visible controls that reach beyond the window's sides."""
    found: list[str] = page.evaluate("""() => [...document.querySelectorAll("button, input, select, summary")]
      .filter((each) => each.checkVisibility() && each.getBoundingClientRect().width > 1)
      .filter((each) => each.getBoundingClientRect().left < -1 || each.getBoundingClientRect().right > innerWidth + 1)
      .map((each) => each.outerHTML.slice(0, 120))""")
    return found


def focused(page: Any) -> tuple[str, bool]:
    """What has the focus, and whether that is seen: an outline around it or its label."""
    name, seen = page.evaluate("""() => {
      const here = document.activeElement, near = [here, here.nextElementSibling, here.parentElement].filter(Boolean);
      const styles = near.map((each) => getComputedStyle(each));
      return [here.id || here.getAttribute("aria-label") || here.textContent.trim().slice(0, 40) || here.tagName,
        styles.some(({ outlineStyle, outlineWidth }) => outlineStyle !== "none" && parseFloat(outlineWidth) >= 2)];
    }""")
    return str(name), bool(seen)
