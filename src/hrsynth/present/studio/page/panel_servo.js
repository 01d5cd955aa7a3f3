"use strict";
/* A servo run from a start to a goal, played, with the camera image beside it. */

class ServoPanel extends Panel {
  constructor(studio) {
    super(studio, "servo", "Servo");
    this.ends = { start: null, goal: null };
    this.places = element("div", { className: "ends" });
    this.run = button("Run", () => this.go(), { className: "main", disabled: true });
    this.player = new Player((frame, index) => this.frame(frame, index), { reduced: studio.reduced });
    this.picture = new CameraPicture();
    this.words = element("p", { "aria-live": "polite" });
    this.now = element("p", { className: "numbers" });
    this.body.append(element("p", { textContent: "Move the platform (or fly to a mode), then set start and goal of the run." }),
      this.places, element("div", { className: "row" }, this.run), this.words, this.player.root, this.now, this.picture.root);
  }

  opened() {
    this.ends = { start: null, goal: null };
    this.clear();
    this.offer();
  }

  rewatched() { this.clear(); }

  clear() {
    this.player.load([], 1);
    this.picture.clear();
    this.words.textContent = this.now.textContent = "";
    this.same.show(null);
  }

  offer() {
    this.places.replaceChildren(...["start", "goal"].map((key) => this.end(key)));
    this.run.disabled = !this.ends.goal;
  }

  end(key) {
    const kept = this.ends[key], sliders = this.studio.scene.sliders;
    const said = kept ? sliders.map(({ label, unit }, i) => `${label}\u00a0${written(kept.values[i], unit)}`).join(", ") : key === "start" ? "zero configuration" : "not set";
    const root = element("div", { className: "row" }, element("span", { textContent: `${key === "start" ? "Start" : "Goal"}: ${said}` }),
      button("Set here", () => this.set(key), { "aria-label": `Set here: the ${key}` }));
    if (kept) root.append(button("Go there", () => this.studio.fly(null, kept.here), { "aria-label": `Go there: the ${key}` }));
    return root;
  }

  set(key) {
    const { here, values, state } = this.studio;
    this.ends[key] = { here, values: values.slice(), state };
    this.offer();
    if (key === "goal") this.entered();
    this.studio.say(`The ${key} is set.`);
  }

  async go() {
    this.clear();
    const found = await this.ask("servo", "Simulating the loop", { here: this.ends.start?.here ?? null, goal: this.ends.goal.values, end: this.ends.goal.here, hidden: this.studio.sees });
    if (!found) return;
    this.found = found;
    this.words.textContent = found.words;
    this.words.className = found.kind === "goal" ? "good" : "";
    this.picture.load(found);
    this.player.load(found.frames, ServoPanel.SECONDS);
    this.same.show(found);
    this.player.play();
  }

  frame(frame, index) {
    this.studio.draw(frame);
    this.picture.show(frame, index);
    if (index === this.player.frames.length - 1) this.studio.refit();
    this.now.textContent = `${frame.t.toFixed(2)} s, error ${Number(frame.e).toPrecision(2)}`;
  }

  stop() {
    this.player.pause();
    if (this.studio.state) this.studio.draw(this.studio.state);
  }

  entered() { this.studio.stage.goal(this.ends.goal?.state ?? null); this.studio.relegend(); }

  left() {
    this.stop();
    this.studio.stage.goal(null);
    this.studio.relegend();
  }
}
ServoPanel.SECONDS = 5;

/* Camera image: the observed legs as lines, their desired position dashed. */
class CameraPicture {
  constructor() {
    this.svg = document.createElementNS(CameraPicture.SVG, "svg");
    this.svg.setAttribute("role", "img");
    this.svg.setAttribute("aria-label", "Camera image: observed legs solid, at the goal dashed");
    this.root = element("figure", { className: "camera", hidden: true }, this.svg,
      element("figcaption", { textContent: "Camera image. Dashed: observed legs at the goal." }));
  }

  clear() { this.root.hidden = true; }

  load({ frames, desired }) {
    const all = [...frames.flatMap(({ image }) => image), ...(desired || [])].filter(Boolean).flat();
    this.root.hidden = !all.length;
    if (!all.length) return;
    const [u, v] = [0, 1].map((i) => all.map((p) => p[i]));
    const [left, right, top, bottom] = [Math.min(...u), Math.max(...u), Math.min(...v), Math.max(...v)];
    const size = Math.max(right - left, bottom - top, 1e-6), edge = 0.08 * size;
    this.svg.setAttribute("viewBox", [left - edge, top - edge, right - left + 2 * edge, bottom - top + 2 * edge].join(" "));
    this.goal = this.lines(desired || [], "desired", size);
    this.legs = this.lines(frames[0].image, "leg", size);
    this.svg.replaceChildren(...this.goal, ...this.legs);
  }

  lines(ends, kind, size) {
    return ends.map((pair) => {
      const line = document.createElementNS(CameraPicture.SVG, "line");
      line.setAttribute("class", kind);
      line.setAttribute("stroke-width", 0.012 * size);
      if (kind === "desired") line.setAttribute("stroke-dasharray", `${0.03 * size} ${0.02 * size}`);
      this.put(line, pair);
      return line;
    });
  }

  put(line, pair) {
    line.classList.toggle("gone", !pair);
    if (!pair) return;
    ["x1", "y1", "x2", "y2"].forEach((name, i) => line.setAttribute(name, pair.flat()[i]));
  }

  show({ image }) { this.legs?.forEach((line, i) => this.put(line, image[i])); }
}
CameraPicture.SVG = "http://www.w3.org/2000/svg";
