"""What a page is for people who do not see it well, or use no mouse: names of its controls, contrast, focus, sizes."""

from __future__ import annotations

from typing import Any

CONTROLS = {"button", "checkbox", "radio", "slider", "combobox", "listbox", "tab", "link", "textbox", "spinbutton",
            "DisclosureTriangle", "tablist", "tabpanel", "radiogroup"}
"""Roles that need a name, as Chromium's tree of accessibility calls them."""
ENOUGH, ENOUGH_LARGE = 4.5, 3.0
"""Contrast of text, and of large text (WCAG 2.2, AA)."""
WORDS = r"""() => {
  const number = (text) => (text.match(/[\d.]+/g) || []).map(Number);
  const over = ([r, g, b, a = 1], under) => [r, g, b].map((value, i) => a * value + (1 - a) * under[i]);
  const ground = (node) => {
    const layers = [];
    for (let each = node; each; each = each.parentElement) {
      const style = getComputedStyle(each), colour = number(style.backgroundColor);
      const stops = style.backgroundImage.match(/rgba?\([^)]*\)/g);
      if (stops) layers.push(number(stops[stops.length - 1]));
      else if ((colour[3] ?? 1) > 0) layers.push(colour);
    }
    return layers.reverse().reduce((under, layer) => over(layer, under), [255, 255, 255]);
  };
  const light = (colour) => {
    const [r, g, b] = colour.map((value) => (value /= 255) <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    const parent = text.parentElement, style = getComputedStyle(parent);
    if (!text.textContent.trim() || !parent.checkVisibility({ checkVisibilityCSS: true, checkOpacity: true })) continue;
    if (["SCRIPT", "STYLE", "OPTION"].includes(parent.tagName)) continue;
    const under = ground(parent), ink = over(number(style.color), under);
    const [low, high] = [light(ink), light(under)].sort((a, b) => a - b);
    const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    found.push([text.textContent.trim().slice(0, 60), (high + 0.05) / (low + 0.05), large]);
  }
  return found;
}"""


def nameless(page: Any) -> list[str]:
    """Controls that a screen reader could not name, from the browser's own tree."""
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    return [str(node["role"]["value"]) for node in nodes if not node.get("ignored")
            and node["role"]["value"] in CONTROLS and not node.get("name", {}).get("value", "").strip()]


def faint(page: Any) -> list[str]:
    """Texts whose contrast to what lies behind them is too small."""
    return [f"{words}: {ratio:.2f}" for words, ratio, large in page.evaluate(WORDS)
            if ratio < (ENOUGH_LARGE if large else ENOUGH)]


def beyond(page: Any) -> list[str]:
    """Visible controls that reach beyond the window's sides, or lie upon each other in the panels."""
    found: list[str] = page.evaluate("""() => [...document.querySelectorAll("button, input, select, summary")]
      .filter((each) => each.checkVisibility() && each.getBoundingClientRect().width > 1)
      .filter((each) => { const box = each.getBoundingClientRect(); return box.left < -1 || box.right > innerWidth + 1; })
      .map((each) => each.outerHTML.slice(0, 120))""")
    return found


def focused(page: Any) -> tuple[str, bool]:
    """What has the focus, and whether that is seen: an outline or a shadow around it or its label."""
    name, seen = page.evaluate("""() => {
      const here = document.activeElement, near = [here, here.nextElementSibling, here.parentElement].filter(Boolean);
      return [here.id || here.getAttribute("aria-label") || here.textContent.trim().slice(0, 40) || here.tagName,
        near.some((each) => { const style = getComputedStyle(each);
          return style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2 && style.outlineColor !== "rgba(0, 0, 0, 0)"; })];
    }""")
    return str(name), bool(seen)
