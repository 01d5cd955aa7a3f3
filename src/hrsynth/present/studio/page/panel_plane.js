"use strict";
/* Accuracy and singularities on a plane through the workspace, which is moved along its normal. */

class PlanePanel extends Panel {
  constructor(studio) {
    super(studio, "plane", "Plane");
    this.kind = "accuracy";
    this.controls = element("div", { className: "fields" });
    this.words = element("p");
    this.scale = element("ul", { className: "scale", "aria-label": "Thresholds" });
    this.body.append(this.controls, element("div", { className: "row" }, button("Draw the plane", () => this.refresh())), this.words, this.scale);
  }

  opened(scene) {
    this.record = null;
    this.words.textContent = "";
    this.scale.replaceChildren();
    this.same.show(null);
    const ways = scene.sliders.filter(({ unit }) => unit !== "rad");
    const across = ways.length >= 2 ? ways : scene.sliders;
    const pairs = across.flatMap((one, i) => across.slice(i + 1).map((other) => [one.name + other.name, `${one.label} and ${other.label}`]));
    this.of = pairs.at(0)?.[0];
    this.ways = across;
    this.layout(pairs);
    this.draw();
  }

  layout(pairs) {
    this.controls.replaceChildren(
      choice("Shown", [["accuracy", "error of the platform (mm per 0.1°)"], ["distance", "distance to a singularity"]], this.kind, (kind) => { this.kind = kind; this.refresh(); }),
      choice("Plane of", pairs, this.of, (of) => { this.of = of; this.layout(pairs); this.refresh(); }));
    const third = this.ways.find(({ name }) => !this.of?.includes(name));
    this.at = null;
    if (!third) return;
    const value = this.studio.values[this.studio.scene.sliders.indexOf(third)];
    this.at = new Slider({ ...third, label: `At ${third.label}`, value }, () => {}, () => this.refresh());
    this.controls.append(this.at.root);
  }

  async refresh() {
    const fields = { kind: this.kind, of: this.of, at: this.at?.value ?? null, size: PlanePanel.SIZE };
    const found = await this.ask("plane", "Computing the plane", fields);
    if (!found) return;
    this.record = found;
    this.words.textContent = found.words;
    this.same.show(found);
    this.draw();
  }

  /* The stage tells where the plane was dragged to. */
  draw() {
    if (!this.studio.isShown(this.key)) return;
    this.studio.stage.plane(this.record, (at) => { this.at?.read(at); this.refresh(); });
    this.studio.relegend();
  }

  entered() { this.draw(); }

  left() { this.studio.stage.plane(null); }
}
PlanePanel.SIZE = 24;  /* points along each side */
