"use strict";
/* Panels as tabs: arrows, Home and End go from tab to tab. */

class Tabs {
  constructor(parent, panels, onchosen) {
    this.panels = panels;
    this.onchosen = onchosen;
    this.list = element("div", { role: "tablist", "aria-label": "Panels", className: "tabs" });
    parent.append(this.list, ...panels.map(({ root }) => root));
    this.tabs = panels.map((panel) => {
      const tab = button(panel.title, () => this.choose(panel.key), { role: "tab", id: `tab-${panel.key}`, "aria-controls": `panel-${panel.key}` });
      Object.assign(panel.root, { id: `panel-${panel.key}` });
      panel.root.setAttribute("role", "tabpanel");
      panel.root.setAttribute("aria-labelledby", tab.id);
      this.list.append(tab);
      return tab;
    });
    this.list.onkeydown = (event) => this.pressed(event);
  }

  choose(key) {
    this.panels.forEach((panel, i) => {
      const chosen = panel.key === key;
      this.tabs[i].setAttribute("aria-selected", chosen);
      this.tabs[i].tabIndex = chosen ? 0 : -1;
      panel.root.hidden = !chosen;
    });
    if (key !== this.chosen) { this.before = this.chosen; this.chosen = key; this.onchosen(key, this.before); }
  }

  pressed(event) {
    const at = this.panels.findIndex(({ key }) => key === this.chosen), last = this.panels.length - 1;
    const to = { ArrowRight: at === last ? 0 : at + 1, ArrowLeft: at === 0 ? last : at - 1, Home: 0, End: last }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this.choose(this.panels[to].key);
    this.tabs[to].focus();
  }
}
