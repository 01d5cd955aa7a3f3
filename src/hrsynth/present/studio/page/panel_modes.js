"use strict";
/* The other poses at which the watched legs look the same: listed, drawn as outlines, flown to. */

class ModesPanel extends Panel {
  constructor(studio) {
    super(studio, "modes", "Modes");
    this.find = button("Find them from here", () => this.refresh());
    this.words = element("p");
    this.list = element("ol", { className: "modes" });
    this.back = button("Back to where I was", () => this.return(), { hidden: true });
    this.body.append(element("p", { textContent: "Poses that look the same to the camera: the controller may end at any of them." }),
      element("div", { className: "row" }, this.find, this.back), this.words, this.list);
    this.outlines = [];
  }

  opened() { this.anew(); }

  rewatched() { this.anew(); }

  anew() {
    this.forget();
    if (this.studio.isShown(this.key)) this.entered();
  }

  /* Other poses from here are other modes: those that are listed belong to where they were asked. */
  settled() {
    const away = this.origin?.some((value, i) => Math.abs(value - this.studio.values[i]) > 1e-6);
    if (away && !this.flown) this.words.textContent = "These belong to an earlier pose. Find them again.";
  }

  forget() {
    this.outlines = [];
    this.origin = this.flown = null;
    this.words.textContent = "";
    this.list.replaceChildren();
    this.same.show(null);
    this.back.hidden = true;
    this.draw();
  }

  async refresh() {
    const origin = this.studio.values;
    const found = await this.ask("modes", "Listing the modes");
    if (!found) return;
    this.forget();
    this.origin = origin;
    this.outlines = found.modes;
    this.words.textContent = found.words;
    this.list.replaceChildren(...found.modes.map((mode) => this.row(mode)));
    this.same.show(found);
    this.draw();
    this.studio.say(`${found.modes.length} modes. ${found.words}`);
  }

  row(mode) {
    const row = element("li", {}, button(mode.label, () => this.fly(mode), { disabled: !mode.here, "aria-label": `Fly to ${mode.label}: ${mode.words}` }),
      element("span", { textContent: mode.words }));
    row.dataset.label = mode.label;
    return row;
  }

  fly(mode) {
    this.flown ||= { here: this.studio.here };
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
