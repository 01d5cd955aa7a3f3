"use strict";
/* The 3D scene of a robot: it draws what it is told, once for each change, and tells what is clicked or dragged.

   All places are displacements (x, y, z, qx, qy, qz, qw) of links from the zero configuration, in the base frame; m, rad. */
const Stage = (() => {
const { clear, label, vector } = Solids;
const { Machine, Direction, outline } = Robots;
const HALF = 13 * Math.PI / 180, CLICK = 6, NEAR = { mouse: 7, pen: 10, touch: 18 };
const NO_WEBGL = "The 3D picture needs WebGL 2, which this browser does not give: all words and numbers are still there.";
const LOST = "The graphics card has gone; the picture comes back with it.";

return class Stage {
  constructor(parent, { reduced = false } = {}) {
    this.parent = parent;
    this.reduced = reduced;
    this.onpick = this.onghost = this.onstate = () => {};
    this.machines = {};
    this.arrows = [];
    this.mode = "overlay";
    this.world = new THREE.Scene();
    this.sides = { real: new THREE.Group(), hidden: new THREE.Group() };
    this.parts = Object.fromEntries(["ghosts", "goal", "lost", "plane", "ellipsoid"].map((key) => [key, new THREE.Group()]));
    this.sides.real.add(...Object.values(this.parts));
    this.names = new THREE.Group();
    this.camera = new THREE.PerspectiveCamera(2 * 13, 1, 0.01, 100);
    const lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    lamp.position.set(0.4, 0.6, 1);
    this.sky = new THREE.HemisphereLight(0xffffff, 0xc8ced6, 2.2);
    this.camera.add(lamp);
    this.world.add(this.sky, this.camera, this.sides.real, this.sides.hidden, this.names);
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
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

  /* One line where the picture would be. */
  tell(words) {
    this.line?.remove();
    if (words) this.parent.append(this.line = Object.assign(document.createElement("p"), { textContent: words, className: "broken" }));
    this.line?.setAttribute("role", "alert");
  }

  /* Show another robot; what was shown of the last one goes. */
  scene(record) {
    this.record = record;
    Object.keys(this.parts).forEach((key) => clear(this.parts[key]));
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
    this.canvas.setAttribute("aria-label", `Picture of ${record.name ?? "the robot"}; arrow keys turn it, plus and minus move closer and away, Home shows all.`);
    if (record.home ?? record.state) this.state(record.home ?? record.state);
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

  /* Where all links are now, and the error there. */
  state(state) {
    this.now = state;
    for (const [key, machine] of Object.entries(this.machines)) {
      if (machine && state[key]) machine.move(state[key]);
      machine?.step(state.error?.step);
    }
    this.arrows.forEach((each) => this.follow(each));
    this.arrange();
  }

  /* An arrow goes with its link, on the side of the hidden robot where that has the link. */
  follow({ record, group, side }) {
    const { links } = this.machines.real.record, at = this.machines[side]?.record.links.indexOf(links[record.link]) ?? -1;
    const place = at < 0 ? null : this.machines[side].places?.[at];
    if (place) Solids.put(group, place);
    group.userData.there = Boolean(place);
  }

  /* "overlay" (the hidden robot within the real one, which is pale), "beside", "real", "hidden" or "none". */
  layout(mode) {
    this.mode = mode;
    this.arrange();
    this.beside();
    this.dirty();
  }

  /* What is to be seen of the two robots. */
  arrange() {
    const { real, hidden } = this.machines, both = Boolean(hidden?.places);
    if (!real) return;
    this.mix = both || this.mode === "none" ? this.mode : "real";
    real.group.visible = !["hidden", "none"].includes(this.mix);
    if (hidden) hidden.group.visible = both && !["real", "none"].includes(this.mix);
    real.pale(this.mix === "overlay" ? hidden : null);
    for (const { group, side } of this.arrows)
      group.visible = this.arrowed !== false && group.userData.there && (side === "real" || this.mix === "beside");
    this.dirty();
  }

  /* Whether the arrows of the directions are drawn at all. */
  directions(on) {
    this.arrowed = on;
    this.arrange();
  }

  /* Two robots beside each other, or above where the pane is high, with their names. */
  beside() {
    clear(this.names);
    Object.values(this.sides).forEach((side) => side.position.set(0, 0, 0));
    if (this.mix !== "beside") return;
    const { across, up } = this.axes(), wide = this.parent.clientWidth >= this.parent.clientHeight, way = wide ? across : up;
    const [low, high] = this.span([this.machines.real.group, this.machines.hidden.group], way);
    const words = { real: "real robot", hidden: "hidden robot" }, size = 0.13 * this.record.length;
    for (const [key, sign] of [["real", wide ? -1 : 1], ["hidden", wide ? 1 : -1]]) {
      const side = this.sides[key], [bottom] = this.span([this.machines[key].group], up);
      const [left, right] = this.span([this.machines[key].group], across);
      side.position.copy(way).multiplyScalar(0.56 * sign * (high - low) + (wide ? 0 : 0.8 * sign * size));
      const name = label(words[key], Colours.of("background"), size), middle = this.middle([this.machines[key].group]);
      name.position.copy(middle).addScaledVector(up, bottom - middle.dot(up) - 0.9 * size).addScaledVector(across, (left + right) / 2 - middle.dot(across));
      name.position.add(side.position);
      this.names.add(name);
    }
  }

  /* The watched legs by their names; the arrows of the others are pale. */
  watch(names) {
    this.arrows.forEach((each) => each.watch(names.includes(each.record.leg)));
    this.dirty();
  }

  /* Other assembly modes as outlines; a click on one is told as its label. */
  ghosts(modes) {
    clear(this.parts.ghosts);
    const { real } = this.machines, size = 0.17 * this.record.length;
    for (const { label: name, places, reachable } of modes)
      this.parts.ghosts.add(outline(real.record, places, Colours.of("mode"),
        { name, size, opacity: reachable === false ? 0.16 : 0.3, pick: { kind: "mode", name } }));
    this.dirty();
  }

  /* The outline of the robot at the goal of a run, null for none. */
  goal(state) {
    clear(this.parts.goal);
    if (state) this.parts.goal.add(outline(this.machines.real.record, state.real, Colours.of("goal"), { opacity: 0.4 }));
    this.dirty();
  }

  /* All that is seen now: its meaning, colour and words; `now` where the platform has that colour. */
  legend() {
    if (!this.record) return [];
    const shown = Object.values(this.machines).filter((each) => each?.group.visible);
    const roles = new Set(shown.flatMap((each) => [...each.roles()]));
    const keys = ["base", "leg", "joint", "motor", "virtual", "actuator"].filter((role) => roles.has(role));
    const seen = this.arrows.filter(({ group }) => group.visible);
    if (seen.some(({ watched }) => watched)) keys.push("watched");
    if (seen.some(({ watched }) => !watched)) keys.push("unwatched");
    if (this.parts.ghosts.children.length) keys.push("mode");
    if (this.parts.goal.children.length) keys.push("goal");
    if (shown.length) keys.push("frame");
    const step = Colours.step(this.now?.error?.step);
    const scale = !roles.has("platform") ? [] : step === "unknown" ? ["unknown"] : [0, 1, 2, 3, 4].map((k) => `step${k}`);
    const words = (key) => this.record.scale?.[Number(key.slice(4))]?.words ?? Colours.words(key);
    return [...keys.map((key) => ({ key, colour: Colours.of(key), words: Colours.words(key), now: false })),
            ...scale.map((key) => ({ key, colour: Colours.of(key), words: key === "unknown" ? Colours.words(key) : words(key), now: key === step }))];
  }

  /* The picture as a PNG blob, null where there is no WebGL. */
  picture() {
    if (!this.renderer) return Promise.resolve(null);
    this.draw(Colours.of("background"));
    return new Promise((done) => { this.canvas.toBlob((blob) => { this.dirty(); done(blob); }, "image/png"); });
  }

  /* Axes of the first view: a plane of motion from before it, a robot in space from its side and a little above. */
  axes() {
    const n = this.record.normal && vector(this.record.normal), up = new THREE.Vector3(0, 0, 1);
    let from = new THREE.Vector3(0.6, -1.6, 0.62);
    if (n) {
      if (n.z < -0.1 || (n.z <= 0.1 && n.y > 0)) n.negate();
      if (n.z > 0.95) up.set(0, 1, 0);
      up.addScaledVector(n, -up.dot(n)).normalize();
      from = n.clone().addScaledVector(up, n.z > 0.7 ? -0.4 : 0.25);
    }
    from.normalize();
    const across = up.clone().cross(from).normalize();
    return { from, across, pole: up.clone(), up: from.clone().cross(across) };
  }

  /* The camera to where everything is seen. */
  fit() {
    if (!this.record || !this.renderer) return;
    const { from, across, up, pole } = this.axes(), away = this.away([this.sides.real, this.sides.hidden, this.names], across, up, from);
    this.camera.up.copy(pole);
    this.controls?.dispose();
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.dirty());
    this.controls.addEventListener("start", () => { this.turned = true; });
    this.controls.target.copy(away.target);
    this.camera.position.copy(away.target).addScaledVector(from, away.distance);
    Object.assign(this.camera, { near: 0.01 * away.distance, far: 100 * away.distance });
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.turned = false;
    this.dirty();
  }

  /* From how far and around which point objects fill the pane. */
  away(objects, across, up, from) {
    const ends = [across, up, from].map((axis) => this.span(objects, axis)), target = new THREE.Vector3();
    [across, up, from].forEach((axis, i) => target.addScaledVector(axis, (ends[i][0] + ends[i][1]) / 2));
    const [width, height, depth] = ends.map(([low, high]) => high - low);
    const wide = this.parent.clientWidth / Math.max(1, this.parent.clientHeight);
    return { target, distance: 0.55 * Math.max(height, width / wide, 1e-6) / Math.tan(HALF) + 0.5 * depth };
  }

  /* How far objects reach along an axis. */
  span(objects, axis) {
    return this.corners(objects).reduce(([low, high], p) => [Math.min(low, p.dot(axis)), Math.max(high, p.dot(axis))], [Infinity, -Infinity]);
  }

  middle(objects) {
    return new THREE.Box3().setFromPoints(this.corners(objects)).getCenter(new THREE.Vector3());
  }

  /* Corners of all that is drawn of objects, in the world. */
  corners(objects) {
    const found = [];
    this.world.updateMatrixWorld(true);
    objects.forEach((object) => object.traverseVisible((mesh) => {
      if (mesh.isSprite) found.push(new THREE.Vector3().setFromMatrixPosition(mesh.matrixWorld));
      if (!mesh.isMesh) return;
      if (!mesh.geometry.boundingBox) mesh.geometry.computeBoundingBox();
      const { min, max } = mesh.geometry.boundingBox;
      for (let i = 0; i < 8; i += 1)
        found.push(new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z).applyMatrix4(mesh.matrixWorld));
    }));
    return found.length ? found : [new THREE.Vector3()];
  }

  /* The pane has another size: all is seen again, unless somebody has turned the view. */
  resize() {
    const [width, height] = [this.parent.clientWidth, this.parent.clientHeight];
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.record && !this.turned) { this.beside(); this.fit(); }
    this.dirty();
  }

  /* Draw once, with the browser's next picture. */
  dirty() {
    if (this.renderer && !this.asked) this.asked = requestAnimationFrame((time) => { this.asked = 0; this.draw(null, time); });
  }

  draw(ground = null) {
    this.world.background = ground && new THREE.Color(ground);
    this.renderer.render(this.world, this.camera);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  listen() {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => { down = event.isPrimary ? event : null; });
    this.canvas.addEventListener("pointerup", (event) => {
      if (down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < CLICK) this.click(event);
      down = null;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType === "mouse" && !event.buttons) this.canvas.classList.toggle("clickable", Boolean(this.under(event)));
    });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("dblclick", () => this.fit());
  }

  click(event) {
    const found = this.under(event);
    if (found?.kind === "mode") this.onghost(found.name);
    else if (found) this.onpick(found.kind, found.name);
  }

  /* What can be picked below the pointer, or close to it: a finger is not as sharp as a mouse. */
  under(event) {
    const box = this.canvas.getBoundingClientRect(), near = NEAR[event.pointerType] ?? NEAR.mouse, ray = new THREE.Raycaster();
    const tries = [[0, 0], ...[0.5, 1].flatMap((r) => [...Array(8).keys()].map((k) => [r * near * Math.cos(k * Math.PI / 4), r * near * Math.sin(k * Math.PI / 4)]))];
    for (const [dx, dy] of tries) {
      const x = 2 * (event.clientX + dx - box.left) / box.width - 1, y = 1 - 2 * (event.clientY + dy - box.top) / box.height;
      ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
      const hits = [];
      Object.values(this.sides).forEach((side) => side.traverseVisible((each) => { if (each.userData.pick) each.raycast(ray, hits); }));
      hits.sort((a, b) => Boolean(b.object.isSprite) - Boolean(a.object.isSprite) || a.distance - b.distance);
      if (hits.length) return hits[0].object.userData.pick;
    }
    return null;
  }

  /* Arrow keys turn the view by 10°, plus and minus go nearer and away, Home shows all. */
  key(event) {
    if (!this.controls) return;
    const step = Math.PI / 18, away = this.camera.position.clone().sub(this.controls.target);
    const across = this.camera.up.clone().cross(away).normalize(), angle = away.angleTo(this.camera.up);
    const tilt = (by) => { if (angle + by > 0.05 && angle + by < Math.PI - 0.05) away.applyAxisAngle(across, by); };
    const keys = {
      ArrowLeft: () => away.applyAxisAngle(this.camera.up, -step), ArrowRight: () => away.applyAxisAngle(this.camera.up, step),
      ArrowUp: () => tilt(-step), ArrowDown: () => tilt(step), "+": () => away.multiplyScalar(0.85), "-": () => away.multiplyScalar(1 / 0.85),
    };
    if (event.key === "Home") this.fit();
    else if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    else {
      keys[event.key]();
      this.turned = true;
      this.camera.position.copy(this.controls.target).add(away);
      this.controls.update();
    }
    event.preventDefault();
    this.dirty();
  }
};
})();
