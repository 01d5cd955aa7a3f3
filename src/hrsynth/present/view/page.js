"use strict";
const scene = JSON.parse(document.getElementById("scene").textContent);
const $ = (id) => document.getElementById(id);

function element(kind, parent, text, fields = {}) {
  const made = Object.assign(document.createElement(kind), fields);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

const ASSEMBLY = { yes: "", no: " (cannot be assembled)", "beyond limits": " (only beyond limits)", "not found": " (assembly not found)" };
const written = (value, unit) => unit === "rad" ? `${(value * 180 / Math.PI).toFixed(1)}°` : `${value.toFixed(4)} m`;

/* What a camera sees, in its plane z = 1: x to the right, y down; its frame is that of its picture where its size is known. */
class Picture {
  constructor({ name, half }, number) {
    const figure = element("figure", $("pictures")), width = 260;
    this.canvas = element("canvas", figure, undefined, { width: 2 * width, height: Math.round(2 * width * half[1] / half[0]) });
    this.canvas.setAttribute("role", "img");
    element("figcaption", figure, `seen by ${name}`);
    Object.assign(this, { name, half, number });
  }

  show(sights) {
    const { width, height } = this.canvas, pen = this.canvas.getContext("2d"), scale = width / 2 / this.half[0];
    const own = sights.filter(({ camera, image }) => camera === this.number && image.length);
    const place = ([x, y]) => [width / 2 + scale * x, height / 2 + scale * y];
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = "silver";
    pen.lineWidth = 1;
    pen.strokeRect(width / 2 - 8, height / 2, 16, 0);
    pen.strokeRect(width / 2, height / 2 - 8, 0, 16);
    Object.assign(pen, { strokeStyle: Colours.of("watched"), fillStyle: Colours.of("watched"), lineWidth: 4, font: "22px system-ui, sans-serif" });
    for (const { name, image } of own) for (const [i, stroke] of image.entries()) {
      const points = stroke.map(place), middle = points[Math.floor((points.length - 1) / 2)];
      pen.beginPath();
      if (points.length === 1) pen.arc(...middle, 7, 0, 7);
      points.forEach((each) => pen.lineTo(...each));
      points.length === 1 ? pen.fill() : pen.stroke();
      if (i === 0) pen.fillText(name, middle[0] + 12, middle[1] - 10);
    }
    this.canvas.setAttribute("aria-label", `Picture of ${this.name}: ${own.map(({ name }) => name).join(", ") || "nothing of what is observed"}`);
  }
}

/* The sliders: stored configurations, one coordinate at a time. */
class Panel {
  constructor(stage) {
    this.stage = stage;
    this.pictures = scene.cameras.map((record, i) => new Picture(record, i));
    $("pictures").hidden = !this.pictures.length;
    stage.scene(scene);
    this.show(scene.home);
    this.values = scene.sliders.map((each) => each.values[each.home]);
    this.sliders = scene.sliders.map((record, i) => this.slider(record, i));
    element("button", $("sliders"), "Home", { type: "button", onclick: () => this.home() });
    this.toggles();
    this.modes(scene.ghosts);
    this.words();
  }

  slider(record, i) {
    const box = element("label", $("sliders"), undefined, { className: "slider" });
    element("span", box, record.name);
    const output = element("output", box, written(this.values[i], record.unit));
    const last = record.values.length - 1;
    const input = element("input", box, undefined, { type: "range", min: 0, max: last, step: 1, value: record.home });
    input.disabled = last === 0;
    input.oninput = () => this.pick(i, Number(input.value));
    return { record, input, output };
  }

  read(i, value) {
    this.values[i] = value;
    this.sliders[i].output.textContent = written(value, this.sliders[i].record.unit);
  }

  pick(i, number) {
    this.sliders.forEach(({ record, input }, k) => {
      if (k !== i) input.value = record.home;
      this.read(k, record.values[k === i ? number : record.home]);
    });
    const { record } = this.sliders[i];
    this.settle(record.states[number], number === record.home);
  }

  show(state) {
    this.stage.state(state);
    this.pictures.forEach((each) => each.show(state.sights ?? []));
    $("error").textContent = state.error?.words ?? "";
    $("now").textContent = state.distance === null ? "not known" : state.distance.toPrecision(3);
  }

  settle(state, home) {
    this.show(state);
    this.stale = !home;
    this.reveal();
  }

  reveal() {
    const here = !this.stale;
    this.stage.ghosts(here ? this.ghosts.filter((_, i) => this.chosen[i]) : []);
    this.stage.layout(this.layout());
    this.stage.directions(this.shown.arrows?.checked ?? true);
    $("status").textContent = !here && this.chosen.some(Boolean) ? "Other assembly modes are shown at home." : "";
    this.legend();
  }

  /* Choose among the other assembly modes; all of them are shown where they are few. */
  modes(ghosts) {
    $("modes").hidden = !ghosts.length;
    $("modes").querySelectorAll("label").forEach((row) => row.remove());
    this.chosen = ghosts.map(() => ghosts.length <= 4);
    ghosts.forEach((record, i) => {
      const row = element("label", $("modes"));
      const input = element("input", row, undefined, { type: "checkbox", checked: this.chosen[i] });
      element("b", row, record.label).style.background = Colours.of("mode");
      element("span", row, `${record.words}${ASSEMBLY[record.assembly]}`);
      input.onchange = () => { this.chosen[i] = input.checked; this.reveal(); };
    });
    this.ghosts = ghosts;
    this.reveal();
  }

  home() {
    scene.sliders.forEach((record, i) => { this.sliders[i].input.value = record.home; this.read(i, record.values[record.home]); });
    this.settle(scene.home, true);
  }

  toggles() {
    const both = scene.machines.length > 1;
    this.shown = {};
    for (const [key, text, there] of [["real", "real robot", both], ["hidden", "hidden robot", both],
                                      ["arrows", "watched directions", scene.arrows.length]]) if (there) {
      const box = element("label", $("toggles"));
      this.shown[key] = element("input", box, undefined, { type: "checkbox", checked: true, id: `show-${key}` });
      element("span", box, text);
      this.shown[key].onchange = () => this.reveal();
    }
    if (!both) return;
    const button = element("button", $("toggles"), "Side by side", { type: "button", ariaPressed: "false" });
    button.onclick = () => {
      button.ariaPressed = String(this.beside = !this.beside);
      this.reveal();
      this.stage.fit();
    };
  }

  layout() {
    const [real, hidden] = ["real", "hidden"].map((key) => this.shown[key]?.checked ?? key === "real");
    return real && hidden ? (this.beside ? "beside" : "overlay") : real ? "real" : hidden ? "hidden" : "none";
  }

  words() {
    scene.machines.forEach(({ key, words }) => element("b", element("div", $("words"), `${key} `), words));
    scene.notes.forEach((note) => element("p", $("notes"), note));
  }

  /* What each colour means, of all that is shown. */
  legend() {
    $("key").replaceChildren();
    for (const { key, colour, words, now } of this.stage.legend()) {
      const item = element("span", $("key"), undefined, { className: (now ? "now " : "") + (key.startsWith("step") ? "wide" : "") });
      element("i", item).style.background = colour;
      item.append(words);
    }
  }
}

const stage = new Stage($("pane"));
new Panel(stage);
requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(() => { document.body.dataset.ready = "yes"; })));
