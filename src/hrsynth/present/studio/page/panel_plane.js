"use strict";
/* Accuracy and singularities on a plane through the workspace, movable along its normal. */

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
    this.stale = false;
    this.forget();
    const ways = scene.sliders.filter(({ unit }) => unit !== "rad");
    const across = ways.length >= 2 ? ways : scene.sliders;
    const pairs = across.flatMap((one, i) => across.slice(i + 1).map((other) => [one.name + other.name, `${one.label} and ${other.label}`]));
    this.of = pairs.at(0)?.[0];
    this.ways = across;
    this.layout(pairs);
  }

  forget() {
    this.record = this.seen = null;
    this.words.textContent = "";
    this.scale.replaceChildren();
    this.same.show(null);
    this.draw();
  }

  /* Other legs, other values. */
  rewatched() { this.anew(this.record); }

  /* The coordinates that the plane neither spans nor is moved along are fixed at the present pose. */
  settled() { this.anew(this.record && String(this.record.held) !== String(this.held())); }

  /* A plane of other legs or of another pose is removed, and requested again when the panel is shown. */
  anew(needed) {
    if (!needed) return;
    this.forget();
    this.stale = true;
    if (this.studio.isShown(this.key)) this.entered();
  }

  held() {
    const third = this.ways.find(({ name }) => !this.of?.includes(name))?.name;
    return this.studio.scene.sliders.flatMap(({ name }, i) => (this.of?.includes(name) || name === third ? [] : [this.studio.values[i].toFixed(6)]));
  }

  layout(pairs) {
    this.controls.replaceChildren(
      choice("Shown", [["accuracy", "error of the platform per 0.1°"], ["distance", "singularity distance (smallest singular value of Mᵀ)"]], this.kind, (kind) => { this.kind = kind; this.forget(); this.refresh(); }),
      choice("Plane of", pairs, this.of, (of) => { this.of = of; this.layout(pairs); this.forget(); this.refresh(); }));
    const third = this.ways.find(({ name }) => !this.of?.includes(name));
    this.at = null;
    if (!third) return;
    const value = this.studio.values[this.studio.scene.sliders.indexOf(third)];
    this.at = new Slider({ ...third, label: `At ${third.label}`, value }, () => {}, () => this.refresh());
    this.controls.append(this.at.root);
  }

  async refresh() {
    this.stale = false;
    const held = this.held(), fields = { kind: this.kind, of: this.of, at: this.at?.value ?? null, size: PlanePanel.SIZE };
    const found = await this.ask("plane", "Computing the plane", fields);
    if (!found) return;
    found.falling = fields.kind === "distance";
    this.record = { ...found, at: fields.at, held };
    this.thresholds(found);
    this.words.textContent = found.words;
    this.same.show(found);
    this.draw();
    if (fields.of !== this.seen) this.studio.refit();
    this.seen = fields.of;
  }

  /* The values of the plane's colours. */
  thresholds({ steps, unit, falling }) {
    const edges = falling ? [...steps].reverse() : steps, last = edges.length, sign = unit === "deg" ? "°" : unit && ` ${unit}`;
    const range = (k) => falling ? (k === 0 ? `more than ${edges[0]}` : k === last ? `up to ${edges[last - 1]}: singular, or nearly` : `${edges[k]} to ${edges[k - 1]}`)
      : (k === 0 ? `up to ${edges[0]}${sign}` : k === last ? `more than ${edges[last - 1]}${sign}, or singular` : `${edges[k - 1]} to ${edges[k]}${sign}`);
    this.scale.replaceChildren(...Colours.steps.map((colour, k) => {
      const swatch = element("i", { "aria-hidden": "true" });
      swatch.style.background = colour;
      return element("li", {}, swatch, range(k));
    }));
  }

  /* The stage reports the new position of the plane. */
  draw() {
    if (!this.studio.isShown(this.key)) return;
    this.studio.stage.plane(this.record, (at) => { this.at?.read(at); this.refresh(); });
    this.studio.relegend();
  }

  entered() {
    this.draw();
    if (this.stale) this.refresh();
    else if (this.record) this.studio.refit();
  }

  left() {
    this.studio.stage.plane(null);
    this.studio.refit();
  }
}
PlanePanel.SIZE = 24;  /* points along each side */
