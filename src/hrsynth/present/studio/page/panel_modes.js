"use strict";
/* Assembly modes: listed, drawn as outlines, flown to. */

class ModesPanel extends Panel {
  constructor(studio) {
    super(studio, "modes", "Modes");
    this.find = button("Find modes of this pose", () => this.refresh());
    this.drawn = tick("Draw their outlines", false, () => this.draw());
    this.words = element("p");
    this.list = element("ol", { className: "modes" });
    this.back = button("Back to the previous pose", () => this.return(), { hidden: true });
    this.join = button("Group by aspect", () => this.group(), { hidden: true });
    this.aspects = element("div", { "aria-live": "polite" });
    this.body.append(element("p", { textContent: "Poses with the same observed directions: the loop may stop at any of them. In the camera image their legs lie elsewhere: only the directions are the same." }),
      element("div", { className: "row" }, this.find, this.drawn, this.back), this.words, this.list, this.join, this.aspects);
    this.outlines = [];
  }

  opened({ kept }) {
    this.find.hidden = this.kept = Boolean(kept);
    this.drawn.hidden = Boolean(this.studio.tabs);
    this.drawn.querySelector("input").checked = false;
    this.anew();
  }

  rewatched() { this.anew(); }

  anew() {
    this.forget();
    if (this.studio.isShown(this.key)) this.entered();
  }

  /* A saved page has the modes of the zero configuration, and shows them there. */
  moved({ here }) {
    if (!this.kept) return;
    this.words.textContent = here ? "Shown at the zero configuration only." : "";
    this.studio.stage.ghosts(here ? [] : this.ghosts);
    this.studio.relegend();
  }

  /* Another pose has other modes: a list belongs to the pose of its request. */
  settled() {
    if (this.kept) return;
    const away = (values) => values?.some((value, i) => Math.abs(value - this.studio.values[i]) > 1e-6);
    if (this.flown) this.flown.to ??= this.studio.values;
    if (this.flown ? away(this.flown.to) : away(this.origin)) this.words.textContent = "These modes belong to an earlier pose. Find them again.";
  }

  forget() {
    this.outlines = [];
    this.origin = this.flown = this.start = null;
    this.words.textContent = "";
    this.list.replaceChildren();
    this.aspects.replaceChildren();
    this.join.hidden = true;
    this.same.show(null);
    this.back.hidden = true;
    this.draw();
  }

  async refresh() {
    const { values: origin, here: start } = this.studio;
    const found = await this.ask("modes", "Listing the modes");
    if (!found) return;
    this.forget();
    Object.assign(this, { origin, start, outlines: found.modes });
    this.join.hidden = this.kept || found.modes.length < 2;
    this.words.textContent = found.words;
    this.list.replaceChildren(...found.modes.map((mode) => this.row(mode)));
    this.same.show(found);
    this.draw();
    this.studio.say(`${found.modes.length} modes. ${found.words}`);
  }

  /* Modes in one aspect: a path without singularity leads from one to the other. */
  async group() {
    const found = await this.ask("aspects", "Searching for paths without singularity", { here: this.start });
    if (!found) return;
    const current = this.list.querySelector("[aria-current=true]")?.dataset.label?.replace(/,.*/, "");
    this.outlines = this.outlines.map((mode, i) => {
      const label = mode.label.replace(/,.*/, "");
      return { ...mode, label: found.aspect[i] ? `${label}, aspect ${found.aspect[i]}` : label };
    });
    this.list.replaceChildren(...this.outlines.map((mode) => this.row(mode)));
    this.mark(this.outlines.find(({ label }) => current && label.replace(/,.*/, "") === current)?.label ?? null);
    this.aspects.replaceChildren(...[found.words, ...found.pairs].map((textContent) => element("p", { textContent })));
    this.same.show(found);
    this.draw();
  }

  row(mode) {
    const row = element("li", {}, button(mode.label, () => this.fly(mode), { disabled: !mode.here, "aria-label": `Fly to ${mode.label}: ${mode.words}` }),
      element("span", { textContent: mode.words }));
    row.dataset.label = mode.label;
    return row;
  }

  fly(mode) {
    this.flown = { here: this.studio.here, ...this.flown, to: null };
    this.back.hidden = false;
    this.mark(mode.label);
    this.studio.fly(mode.places, mode.here);
    this.studio.say(`Now at ${mode.label}. ${mode.words}`);
  }

  return() {
    const { here } = this.flown;
    this.flown = null;
    this.back.hidden = true;
    this.mark(null);
    this.studio.fly(null, here);
  }

  mark(label) {
    for (const row of this.list.children) row.setAttribute("aria-current", row.dataset.label === label);
  }

  /* A view without panels draws outlines on request only. */
  get ghosts() { return this.studio.tabs || this.drawn.querySelector("input").checked ? this.outlines : []; }

  draw() {
    if (!this.studio.isShown(this.key)) return;
    this.studio.stage.ghosts(this.ghosts);
    this.studio.stage.onghost = (label) => { const mode = this.outlines.find((each) => each.label === label); if (mode?.here) this.fly(mode); };
    this.studio.refit();
  }

  entered() {
    this.draw();
    if (!this.outlines.length && this.studio.scene) this.refresh();
  }

  left() {
    this.studio.stage.ghosts([]);
    this.studio.refit();
  }
}
