"use strict";
/* The 3D scene of a robot: it draws what it is told, once for each change, and tells what is clicked or dragged.

   All places are displacements (x, y, z, qx, qy, qz, qw) of links from the zero configuration, in the base frame; m, rad. */
const Stage = (() => {
const { clear, label, turn, vector } = Solids;
const { Machine, Direction, outline } = Robots;
const { LostArrows, Plane, ellipsoid, sights } = Overlays;
const READABLE = 22, CLICK = 6, NEAR = { mouse: 7, pen: 10, touch: 18 }, ASK_EACH = 120, SAME = 1e-3;  /* px, px, px, ms, rad or characteristic lengths */
const NO_WEBGL = "The 3D view needs WebGL 2, which this browser does not provide: all text and numbers are still available.";
const LOST = "The graphics context was lost; the 3D view returns with it.";

return class Stage {
  /* `reduced`: nothing moves by itself; `over`: elements that lie on the pane's top or bottom, where nothing is to be seen. */
  constructor(parent, { reduced = false, over = [] } = {}) {
    this.parent = parent;
    this.over = over;
    this.reduced = reduced;
    this.onpick = this.onghost = this.onstate = () => {};
    this.machines = {};
    this.arrows = [];
    this.mode = "overlay";
    this.world = new THREE.Scene();
    this.sides = { real: new THREE.Group(), hidden: new THREE.Group() };
    this.parts = Object.fromEntries(["ghosts", "goal", "lost", "plane", "ellipsoid", "sights"].map((key) => [key, new THREE.Group()]));
    this.sides.real.add(...Object.values(this.parts));
    this.names = new THREE.Group();
    this.canvas = Object.assign(document.createElement("canvas"), { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.sight = new Sight(this.canvas, () => this.dirty());
    const lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    lamp.position.set(0.4, 0.6, 1);
    this.sky = new THREE.HemisphereLight(0xffffff, 0xc8ced6, 2.2);
    this.sight.camera.add(lamp);
    this.world.add(this.sky, this.sight.camera, this.sides.real, this.sides.hidden, this.names);
    parent.classList.add("stage");
    const fields = { canvas: this.canvas, antialias: true, alpha: true };
    const context = this.canvas.getContext("webgl2", fields);
    if (!context) return void this.tell(NO_WEBGL);
    parent.append(this.canvas);
    this.renderer = new THREE.WebGLRenderer({ ...fields, context });
    this.canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.tell(LOST); });
    this.canvas.addEventListener("webglcontextrestored", () => { this.tell(""); this.dirty(); });
    this.listen();
    new ResizeObserver(() => this.resize()).observe(parent);
  }

  /* One line in place of the 3D view. */
  tell(words) {
    this.line?.remove();
    if (words) this.parent.append(this.line = Object.assign(document.createElement("p"), { textContent: words, className: "broken" }));
    this.line?.setAttribute("role", "alert");
  }

  /* Show another robot; what was shown of the last one goes. */
  scene(record) {
    this.record = record;
    this.gizmo(false);
    this.pulled = this.sheet = this.arrowsOfLost = this.factor = null;
    Object.values(this.parts).forEach(clear);
    this.arrows.forEach(({ group }) => { clear(group); group.removeFromParent(); });
    const hidden = record.machines.find(({ key }) => key === "hidden");
    this.machine("real", record.machines.find(({ key }) => key === "real"));
    this.machine("hidden", hidden ?? null);
    this.arrows = record.arrows.flatMap((each) => ["real", "hidden"].map((side) => {
      const arrow = new Direction(each, record);
      arrow.side = side;
      this.sides[side].add(arrow.group);
      return arrow;
    }));
    this.canvas.setAttribute("aria-label", `3D view of ${record.name ?? "the robot"}; arrow keys rotate it, plus and minus zoom, Home shows all.`);
    if (record.state) this.state(record.state);
    this.sight.look(record.normal);
    this.layout(this.mode);
    this.fit();
  }

  /* The hidden robot (a record as of the scene's machines), null for none; it moves with the next state. */
  hidden(record) {
    this.machine("hidden", record);
    this.layout(this.mode);
  }

  machine(key, record) {
    this.machines[key]?.clear();
    this.machines[key]?.group.removeFromParent();
    this.machines[key] = record && new Machine(record, this.record.length);
    if (record) this.sides[key].add(this.machines[key].group);
  }

  /* Where all links are now, and the error there; a robot of which the state says nothing is not to be seen. */
  state(state) {
    this.now = state;
    for (const [key, machine] of Object.entries(this.machines)) {
      if (machine && state[key]) machine.move(state[key]);
      else if (machine) machine.places = null;
      machine?.step(state.error?.step);
    }
    this.arrows.forEach((each) => this.follow(each));
    clear(this.parts.sights);
    if (state.sights) this.parts.sights.add(...sights(state.sights, this.record.radius));
    this.steer();
    this.arrange();
  }

  /* An arrow goes with its link, on the side of the hidden robot where that has the link. */
  follow({ record, group, side }) {
    const { links } = this.machines.real.record, at = this.machines[side]?.record.links.indexOf(links[record.link]) ?? -1;
    const place = at < 0 ? null : this.machines[side].places?.[at];
    if (place) Solids.put(group, place);
    group.userData.there = Boolean(place);
  }

  /* "overlay" (the hidden robot within the real one, which is pale), "beside", "real" or "hidden". */
  layout(mode) {
    const fresh = mode !== this.mode;
    this.mode = mode;
    this.arrange();
    this.beside();
    if (fresh && !this.sight.turned) this.fit();
    this.dirty();
  }

  /* What is to be seen of the two robots. */
  arrange() {
    const { real, hidden } = this.machines, both = Boolean(hidden?.places);
    if (!real) return;
    this.mix = both ? this.mode : "real";
    real.group.visible = this.mix !== "hidden";
    if (hidden) hidden.group.visible = both && this.mix !== "real";
    real.pale(this.mix === "overlay" ? hidden : null);
    this.parts.ghosts.children.forEach((each) => { each.visible = !this.isHere(each.userData.places); });
    for (const { group, side } of this.arrows)
      group.visible = group.userData.there && (side === "real" || this.mix === "beside");
    this.dirty();
  }

  /* Two robots beside each other, or above where the pane is high, with their names. */
  beside() {
    clear(this.names);
    Object.values(this.sides).forEach((side) => side.position.set(0, 0, 0));
    if (this.mix !== "beside") return;
    const { across, up } = this.sight, wide = this.parent.clientWidth >= this.parent.clientHeight;
    const all = Sight.corners([this.machines.real.group, this.machines.hidden.group]), extent = [across, up].map((axis) => Sight.span(all, axis));
    const size = 0.05 * Math.max(...extent.map(([low, high]) => high - low));
    for (const [key, words, sign] of [["real", "real robot", wide ? -1 : 1], ["hidden", "hidden robot", wide ? 1 : -1]]) {
      const corners = Sight.corners([this.machines[key].group]), [left, right] = Sight.span(corners, across), [bottom, top] = Sight.span(corners, up);
      const [low, high] = wide ? [left, right] : [bottom - 2 * size, top], way = wide ? across : up;
      const shift = sign * (wide ? size : 0.3 * size) - (sign > 0 ? low : high), name = label(words, Colours.of("background"), size);
      this.sides[key].position.copy(way).multiplyScalar(shift);
      const middle = new THREE.Box3().setFromPoints(corners).getCenter(new THREE.Vector3());
      name.position.copy(middle).addScaledVector(up, bottom - middle.dot(up) - size).addScaledVector(across, (left + right) / 2 - middle.dot(across));
      name.position.add(this.sides[key].position);
      this.names.add(name);
    }
  }

  /* The observed legs by their names; the arrows of the others are pale. */
  watch(names) {
    this.arrows.forEach((each) => each.watch(names.includes(each.record.leg)));
    this.dirty();
  }

  /* Other assembly modes as outlines, without the one where the robot is; a click on one is told as its label. */
  ghosts(modes) {
    clear(this.parts.ghosts);
    const { real } = this.machines, size = 0.17 * this.record?.length;
    for (const { label: name, places, reachable } of modes) {
      const group = outline(real.record, places, Colours.of("mode"),
        { name, size, opacity: reachable === false ? 0.16 : 0.3, pick: { kind: "mode", name } });
      group.userData.places = places;
      this.parts.ghosts.add(group);
    }
    this.arrange();
  }

  /* Whether the robot stands as an outline shows it, as far as visible. */
  isHere(places) {
    const now = this.machines.real.places;
    return Boolean(now) && places.every((place, i) => !place
      || vector(place).distanceTo(vector(now[i])) < SAME * this.record.length && turn(place).angleTo(turn(now[i])) < SAME);
  }

  /* The outline of the robot at the goal of a run, null for none. */
  goal(state) {
    clear(this.parts.goal);
    if (state) this.parts.goal.add(outline(this.machines.real.record, state.real, Colours.of("goal"), { opacity: 0.4 }));
    this.dirty();
  }

  /* Unobserved twists as arrows that move back and forth, still if motion is reduced. */
  lost(records) {
    clear(this.parts.lost);
    this.arrowsOfLost = records.length ? new LostArrows(records, this.record) : null;
    if (this.arrowsOfLost) {
      this.parts.lost.add(this.arrowsOfLost.group);
      this.arrowsOfLost.swing(0);
    }
    this.dirty();
  }

  /* The ellipsoid of the error at the platform, magnified by `factor`, null for none. */
  ellipsoid(record) {
    clear(this.parts.ellipsoid);
    this.factor = null;
    if (record) {
      const { mesh, factor } = ellipsoid(record, this.record.length);
      this.factor = factor;
      this.parts.ellipsoid.add(mesh);
    }
    this.dirty();
  }

  /* A plane of values, null for none; its handle tells `ondrag` the value `at` (or the way, m) to which it is drawn. */
  plane(record, ondrag = () => {}) {
    clear(this.parts.plane);
    this.sheet = record && new Plane(record, this.record.radius);
    this.onplane = ondrag;
    if (this.sheet) this.parts.plane.add(this.sheet.group);
    if (this.pulled && this.sheet) this.sheet.slide(this.pulled.wanted);
    this.dirty();
  }

  /* Handles at the platform, of its freedoms; `ondrag` is told the place to which it is dragged. */
  gizmo(on, _, ondrag = () => {}) {
    this.handles?.clear();
    this.handles = null;
    const { real } = this.machines, freedoms = this.record?.freedoms;
    if (on && freedoms && this.renderer && real?.places) {
      this.handles = new Gizmo({ camera: this.sight.camera, canvas: this.canvas, world: this.sides.real, freedoms, ondrag,
        onchange: () => this.dirty(), onhold: (held) => this.sight.hold(held) });
      this.steer();
    }
    this.dirty();
  }

  /* The handles go with the platform. */
  steer() {
    if (!this.handles) return;
    const { record, places } = this.machines.real, { link, place } = record.frames[record.frames.length - 1];
    this.handles.place(places[link], place);
  }

  /* All that is seen now: its meaning, colour and words; `now` where the platform has that colour. */
  legend() {
    if (!this.record) return [];
    const shown = Object.values(this.machines).filter((each) => each?.group.visible);
    const roles = new Set(shown.flatMap((each) => [...each.roles()]));
    const keys = ["base", "leg", "joint", "motor", "virtual", "actuator"].filter((role) => roles.has(role));
    const seen = this.arrows.filter(({ group }) => group.visible);
    if (seen.some(({ watched }) => watched) || this.parts.sights.children.length) keys.push("observed");
    if (seen.some(({ watched }) => !watched)) keys.push("unobserved");
    if (this.parts.ghosts.children.some(({ visible }) => visible)) keys.push("mode");
    if (this.parts.goal.children.length) keys.push("goal");
    if (shown.length) keys.push("frame");
    if (this.factor) keys.push("ellipsoid");
    const step = Colours.step(this.now?.error?.step);
    const all = [0, 1, 2, 3, 4].map((k) => `step${k}`);
    const scale = this.sheet ? all : !roles.has("platform") ? this.arrowsOfLost ? ["step4"] : [] : step === "unknown" ? [] : all;
    if (roles.has("platform") && step === "unknown") scale.push("unknown");
    return [...keys, ...scale].map((key) => ({ key, colour: Colours.of(key), words: this.words(key), now: roles.has("platform") && key === step }));
  }

  /* Label of a colour: the scale with its thresholds, the ellipsoid with its magnification. */
  words(key) {
    const { names, edges, unit } = this.record.scale ?? {};
    if (key === "observed" && this.parts.sights.children.length) return "observations and cameras";
    if (key === "ellipsoid") return `${Colours.words(key)} for 0.1°${this.factor > 1 ? `, drawn ${this.factor} times as large` : ""}`;
    if (!names || !key.startsWith("step")) return Colours.words(key);
    const step = Number(key.slice(4)), sign = unit === "deg" ? "°" : ` ${unit}`, { falling, steps } = this.sheet?.record ?? {};
    const range = (k, e) => k === 0 ? `up to ${e[0]}` : k === e.length ? `more than ${e[k - 1]}` : `${e[k - 1]} to ${e[k]}`;
    return `${names[step]}: ${range(step, edges)}${sign} per 0.1°${step === edges.length ? ", or singular" : ""}`
      + (falling ? `; singularity distance on the plane ${range(steps.length - step, steps)}` : "");
  }

  /* The 3D view as a PNG blob, null without WebGL. */
  picture() {
    if (!this.renderer) return Promise.resolve(null);
    this.draw(Colours.of("background"));
    return new Promise((done) => { this.canvas.toBlob((blob) => { this.dirty(); done(blob); }, "image/png"); });
  }

  /* The camera to where everything is seen. */
  fit() {
    if (!this.record || !this.renderer) return;
    const pane = this.parent.getBoundingClientRect(), covered = { top: 0, bottom: 0 };
    for (const box of this.over.map((each) => each.getBoundingClientRect())) if (box.height) {
      const [above, below] = [box.bottom - pane.top, pane.bottom - box.top];
      if (above < below) covered.top = Math.max(covered.top, above);
      else covered.bottom = Math.max(covered.bottom, below);
    }
    this.sight.fit([this.sides.real, this.sides.hidden, this.names], covered.top, covered.bottom);
    this.dirty();
  }

  /* The pane has another size: all is seen again, unless somebody has turned the view. */
  resize() {
    const [width, height] = [this.parent.clientWidth, this.parent.clientHeight];
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.sight.pane(width, height);
    if (this.record && !this.sight.turned) { this.beside(); this.fit(); }
    this.dirty();
  }

  /* Draw once, with the browser's next frame. */
  dirty() {
    if (this.renderer && !this.asked) this.asked = requestAnimationFrame((time) => { this.asked = 0; this.draw(null, time); });
  }

  draw(ground = null, time = 0) {
    if (this.arrowsOfLost && !this.reduced) {
      this.arrowsOfLost.swing(time / 1000);
      if (!ground) this.dirty();
    }
    this.sight.enlarge(this.world, READABLE);
    this.world.background = ground && new THREE.Color(ground);
    this.renderer.render(this.world, this.sight.camera);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  listen() {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      down = event.isPrimary ? event : null;
      if (down && this.sheet && !this.sight.held && this.under(event)?.kind === "plane") this.pull(event);
    });
    this.canvas.addEventListener("pointercancel", () => { down = null; this.release(); });
    this.canvas.addEventListener("pointerup", (event) => {
      if (this.pulled) this.release();
      else if (down && !this.sight.held && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < CLICK) this.click(event);
      down = null;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (this.pulled && event.isPrimary) this.drawPlane(event);
      if (event.pointerType === "mouse" && !event.buttons) this.canvas.classList.toggle("clickable", Boolean(this.under(event)));
    });
    this.canvas.addEventListener("keydown", (event) => {
      if (event.key !== "Home") return;
      this.fit();
      event.preventDefault();
    });
    this.canvas.addEventListener("dblclick", () => this.fit());
  }

  click(event) {
    const found = this.under(event);
    if (found?.kind === "mode") this.onghost(found.name);
    else if (found?.kind === "leg") this.onpick(found.kind, found.name);
  }

  /* The plane is held by its handle: where along its normal, and what it is asked at. */
  pull(event) {
    const { sheet } = this, grip = sheet.grip(), along = sheet.along(this.sight.ray(event.clientX, event.clientY).ray, grip);
    if (along === null) return;
    this.pulled = { grip, along, at: sheet.record.at ?? 0, from: sheet.height(), wanted: sheet.height(), asked: 0 };
    this.sight.hold(true);
    this.canvas.setPointerCapture(event.pointerId);
  }

  drawPlane(event) {
    const { pulled, sheet } = this, along = sheet?.along(this.sight.ray(event.clientX, event.clientY).ray, pulled.grip);
    if (along === null || along === undefined) return;
    pulled.wanted = pulled.from + along - pulled.along;
    sheet.slide(pulled.wanted);
    this.dirty();
    if (performance.now() - pulled.asked < ASK_EACH) return;
    pulled.asked = performance.now();
    this.onplane(pulled.at + pulled.wanted - pulled.from);
  }

  release() {
    const { pulled } = this;
    if (!pulled) return;
    this.pulled = null;
    this.sight.hold(false);
    this.onplane(pulled.at + pulled.wanted - pulled.from);
  }

  /* What can be picked below the pointer, or close to it: a finger is not as sharp as a mouse. */
  under(event) {
    const near = NEAR[event.pointerType] ?? NEAR.mouse;
    const tries = [[0, 0], ...[0.5, 1].flatMap((r) => [...Array(8).keys()].map((k) => [r * near * Math.cos(k * Math.PI / 4), r * near * Math.sin(k * Math.PI / 4)]))];
    for (const [dx, dy] of tries) {
      const ray = this.sight.ray(event.clientX + dx, event.clientY + dy), hits = [];
      Object.values(this.sides).forEach((side) => side.traverseVisible((each) => { if (each.userData.pick) each.raycast(ray, hits); }));
      hits.sort((a, b) => Boolean(b.object.isSprite) - Boolean(a.object.isSprite) || a.distance - b.distance);
      if (hits.length) return hits[0].object.userData.pick;
    }
    return null;
  }

};
})();
