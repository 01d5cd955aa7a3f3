"use strict";
/* The other poses at which the watched legs look the same: listed, drawn as outlines, flown to. */

class ModesPanel extends Panel {
  constructor(studio) {
    super(studio, "modes", "Modes");
    this.find = button("Find them from here", () => this.refresh());
    this.words = element("p");
    this.list = element("ol", { className: "modes" });
    this.back = button("Back to where I was", () => this.return(), { hidden: true });
    this.join = button("Which of them lie in one aspect?", () => this.group(), { hidden: true });
    this.aspects = element("div", { "aria-live": "polite" });
    this.body.append(element("p", { textContent: "Poses that look the same to the camera: the controller may end at any of them." }),
      element("div", { className: "row" }, this.find, this.back), this.words, this.list, this.join, this.aspects);
    this.outlines = [];
  }

  opened({ kept }) {
    this.find.hidden = this.kept = Boolean(kept);
    this.anew();
  }

  rewatched() { this.anew(); }

  anew() {
    this.forget();
    if (this.studio.isShown(this.key)) this.entered();
  }

  /* A page that was saved knows those of home, and shows them there. */
  moved({ here }) {
    if (!this.kept) return;
    this.words.textContent = here ? "They are shown at home." : "";
    this.studio.stage.ghosts(here ? [] : this.outlines);
    this.studio.relegend();
  }

  /* Other poses from here are other modes: those that are listed belong to where they were asked. */
  settled() {
    if (this.kept) return;
    const away = (values) => values?.some((value, i) => Math.abs(value - this.studio.values[i]) > 1e-6);
    if (this.flown) this.flown.to ??= this.studio.values;
    if (this.flown ? away(this.flown.to) : away(this.origin)) this.words.textContent = "These belong to an earlier pose. Find them again.";
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
    const found = await this.ask("aspects", "Looking for paths without singularity", { here: this.start });
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

  draw() {
    if (!this.studio.isShown(this.key)) return;
    this.studio.stage.ghosts(this.outlines);
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
