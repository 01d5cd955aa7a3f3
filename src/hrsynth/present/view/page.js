const scene = JSON.parse(document.getElementById("scene").textContent);
const $ = (id) => document.getElementById(id);
const { length, radius } = scene;

function element(kind, parent, text, fields = {}) {
  const made = Object.assign(document.createElement(kind), fields);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

/* A machine: one group a link, moved by the states; spans follow two links. */
class Machine {
  constructor(record) {
    this.record = record;
    this.group = new THREE.Group();
    this.links = record.links.map(() => new THREE.Group());
    this.group.add(...this.links);
    this.platform = material(COLOURS.platform);
    this.plain = {};
    this.spans = [];
    for (const shape of record.shapes) this.add(shape);
    for (const { link, place } of record.frames) this.links[link].add(triad(place, 0.3 * length));
  }

  look(shape) {
    if (shape.role === "platform") return this.platform;
    const clear = shape.role === "base" && shape.kind === "plate";
    const key = shape.role + (clear ? " plate" : "");
    this.plain[key] ||= material(COLOURS[shape.role], clear ? { ...BEHIND, opacity: 0.22, polygonOffsetUnits: 8 } : {});
    return this.plain[key];
  }

  add(shape) {
    const meshes = solids(shape, this.look(shape));
    if (shape.kind === "span") {
      const holder = new THREE.Group();
      holder.add(meshes[0]);
      this.spans.push({ holder, mesh: meshes[0], shape });
      this.group.add(holder);
    } else this.links[shape.link].add(...meshes);
  }

  move(places) {
    this.links.forEach((group, i) => put(group, places[i]));
    for (const { mesh, shape } of this.spans)
      stretch(mesh, moved(shape.points[0], places[shape.link]), moved(shape.points[1], places[shape.other]));
  }
}

function moved(point, place) {
  return vector(point).applyQuaternion(new THREE.Quaternion(...place.slice(3))).add(vector(place));
}

/* The real robot at another assembly mode, its rods and plates: all of them, or those of its platform alone. */
function ghost(record, number) {
  const group = new THREE.Group(), colour = GHOSTS[number % GHOSTS.length];
  const look = material(colour, { ...BEHIND, opacity: record.reachable ? 0.26 : 0.16 });
  const corners = [];
  for (const shape of scene.machines[0].shapes) {
    const place = record.places[shape.link], other = record.places[shape.other ?? shape.link];
    if (!place || !other || shape.role === "base" || !["rod", "plate", "span", "mesh"].includes(shape.kind)) continue;
    const last = shape.points.length - 1;
    const points = shape.points.map((p, i) => moved(p, shape.other !== undefined && i === last ? other : place));
    group.add(...solids({ ...shape, size: 0.75 * shape.size, points: points.map((p) => p.toArray()) }, look));
    if (shape.role === "platform") corners.push(...points);
  }
  const name = label(record.label, colour, 0.19 * length);
  corners.forEach((p) => name.position.addScaledVector(p, 1 / corners.length));
  group.add(name);
  return group;
}

class Page {
  constructor(pane) {
    this.viewer = new MeshCat.Viewer(pane);
    const resize = this.viewer.set_3d_pane_size;
    this.viewer.set_3d_pane_size = () => resize.call(this.viewer, pane.offsetWidth, pane.offsetHeight);
    ["Lights", "Grid", "Axes"].forEach((path) => this.viewer.set_property([path], "visible", false));
    this.viewer.hide_background();
    this.machines = scene.machines.map((record) => new Machine(record));
    this.arrows = scene.arrows.map((record) => this.arrow(record));
    this.ghosts = new THREE.Group();
    this.root = new THREE.Group();
    this.root.add(...this.machines.map((each) => each.group), ...this.arrows.map((each) => each.group), this.ghosts);
    this.viewer.set_object(["robot"], this.root);
    this.light();
    this.haunt(scene.ghosts.length <= 4 ? scene.ghosts : []);
    this.show(scene.home);
    this.aim();
  }

  light() {
    const sky = new THREE.HemisphereLight(0xffffff, 0xaab4c0, 0.75);
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.55);
    this.viewer.set_object(["light"], sky);
    this.viewer.set_object(["lamp"], this.lamp);
  }

  arrow(record) {
    const group = new THREE.Group(), ends = record.ends.map(vector);
    group.add(...arrow(ends[0], ends[1], 1.9 * radius, material(COLOURS.arrow, { emissive: 0x062050 })));
    const name = label(record.leg, COLOURS.arrow, 0.14 * length);
    name.position.copy(ends[1]).lerp(ends[0], 0.85);
    group.add(name);
    return { group, link: record.link };
  }

  haunt(ghosts) {
    this.ghosts.clear();
    ghosts.forEach((record, i) => this.ghosts.add(ghost(record, i)));
    this.viewer.set_dirty();
  }

  show(state) {
    for (const machine of this.machines) if (state[machine.record.key]) machine.move(state[machine.record.key]);
    for (const { group, link } of this.arrows) put(group, state.real[link]);
    const known = state.distance !== null && scene.largest > 0;
    const part = known ? state.distance / scene.largest : 0;
    const colour = state.distance === null ? new THREE.Color(COLOURS.platform) : scaleColour(part);
    for (const machine of this.machines) machine.platform.color = colour;
    $("scale").hidden = state.distance === null;
    $("mark").style.left = `${100 * Math.min(1, part)}%`;
    $("now").textContent = state.distance === null ? "" : state.distance.toPrecision(3);
    this.viewer.set_dirty();
  }

  /* With the hidden robot in sight, of the real one only what it does not share is drawn, pale. */
  reveal(shown) {
    const [real, hidden] = this.machines;
    real.group.visible = shown.real;
    if (hidden) hidden.group.visible = shown.hidden;
    const both = Boolean(hidden && shown.hidden), links = real.record.links;
    const shared = links.map((link) => both && hidden.record.links.includes(link));
    this.pale ||= material(COLOURS.pale, { ...BEHIND, opacity: 0.3 });
    real.links.forEach((group, i) => { group.visible = !shared[i]; });
    real.spans.forEach(({ holder, shape }) => { holder.visible = !(shared[shape.link] && shared[shape.other]); });
    real.group.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.userData.look ||= mesh.material;
      mesh.material = both ? this.pale : mesh.userData.look;
    });
    this.arrows.forEach(({ group }) => { group.visible = shown.arrows; });
    this.ghosts.children.forEach((group, i) => { group.visible = shown.ghosts[i]; });
    this.viewer.set_dirty();
  }

  /* From where everything is seen: a plane of motion from before it, a robot in space from its side and a little above. */
  aim() {
    const n = scene.normal, half = Math.PI * 13 / 180;
    const from = n ? vector(n).add(Math.abs(n[2]) > 0.9 ? new THREE.Vector3(0, -0.4, 0) : new THREE.Vector3(0.1, 0, 0.4))
      : new THREE.Vector3(0.6, -1.6, 0.62);
    from.set(from.x, from.z, -from.y).normalize();
    const [across, up] = [new THREE.Vector3(0, 1, 0).cross(from).normalize(), new THREE.Vector3()];
    up.crossVectors(from, across);
    const ends = [across, up, from].map(() => [Infinity, -Infinity]);
    for (const p of this.extent()) [across, up, from].forEach((axis, i) => {
      ends[i] = [Math.min(ends[i][0], p.dot(axis)), Math.max(ends[i][1], p.dot(axis))];
    });
    const size = ends.map(([low, high]) => high - low), target = new THREE.Vector3();
    [across, up, from].forEach((axis, i) => target.addScaledVector(axis, (ends[i][0] + ends[i][1]) / 2));
    const wide = $("pane").offsetWidth / $("pane").offsetHeight;
    const away = 0.535 * Math.max(size[1], size[0] / wide) / Math.tan(half) + 0.5 * size[2];
    const camera = new THREE.PerspectiveCamera(2 * 13, wide, 0.01 * away, 100 * away);
    camera.position.copy(target).addScaledVector(from, away);
    this.viewer.controls.dispose();
    this.viewer.set_camera(camera);
    this.viewer.controls.target.copy(target);
    this.viewer.controls.update();
    this.viewer.set_3d_pane_size();
    this.lamp.position.set(2, -3, 4);
  }

  /* Corners of all that is drawn, as the camera's world has them. */
  extent() {
    const found = [];
    this.root.updateWorldMatrix(true, true);
    this.root.traverse((mesh) => {
      if (!mesh.isMesh || !mesh.visible) return;
      mesh.geometry.computeBoundingBox();
      const { min, max } = mesh.geometry.boundingBox;
      for (let i = 0; i < 8; i += 1)
        found.push(new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z).applyMatrix4(mesh.matrixWorld));
    });
    return found;
  }
}

const ASSEMBLY = { yes: "", no: " (cannot be assembled)", "beyond limits": " (only beyond limits)", "not found": " (assembly not found)" };
const written = (value, unit) => unit === "rad" ? `${(value * 180 / Math.PI).toFixed(1)}°` : `${value.toFixed(4)} m`;

/* The sliders: stored configurations, one coordinate at a time, or any of them solved by the server. */
class Panel {
  constructor(page) {
    this.page = page;
    this.values = scene.sliders.map((each) => each.values[each.home]);
    this.sliders = scene.sliders.map((record, i) => this.slider(record, i));
    element("button", $("sliders"), "Home", { type: "button", onclick: () => this.home() });
    this.shown = { real: true, hidden: true, arrows: true };
    this.toggles();
    this.modes(scene.ghosts);
    this.words();
  }

  slider(record, i) {
    const box = element("label", $("sliders"), undefined, { className: "slider" });
    element("span", box, record.name);
    const output = element("output", box, written(this.values[i], record.unit));
    const last = record.values.length - 1, ends = [record.values[0], record.values[last]];
    const input = element("input", box, undefined, scene.live
      ? { type: "range", min: ends[0], max: ends[1], step: (ends[1] - ends[0]) / 400 || 1, value: this.values[i] }
      : { type: "range", min: 0, max: last, step: 1, value: record.home });
    input.disabled = last === 0;
    input.oninput = () => scene.live ? this.send(i, Number(input.value)) : this.pick(i, Number(input.value));
    if (scene.live) input.onchange = () => this.send(i, Number(input.value), true);
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

  settle(state, home) {
    this.page.show(state);
    this.stale = !home;
    this.reveal();
  }

  reveal(fresh = true) {
    const ghosts = this.chosen.map((wanted) => wanted && fresh && !this.stale);
    this.page.reveal({ ...this.shown, ghosts });
    $("status").textContent = this.stale && this.chosen.some(Boolean) ? "Other assembly modes are shown at home." : "";
  }

  /* Choose among the other assembly modes; all of them are shown where they are few. */
  modes(ghosts) {
    $("modes").hidden = !ghosts.length;
    $("modes").querySelectorAll("label").forEach((row) => row.remove());
    this.chosen = ghosts.map(() => ghosts.length <= 4);
    ghosts.forEach((record, i) => {
      const row = element("label", $("modes"));
      const input = element("input", row, undefined, { type: "checkbox", checked: this.chosen[i] });
      element("b", row, record.label).style.background = "#" + new THREE.Color(GHOSTS[i % GHOSTS.length]).getHexString();
      element("span", row, `${record.words}${ASSEMBLY[record.assembly]}`);
      input.onchange = () => { this.chosen[i] = input.checked; this.reveal(); };
    });
    this.page.haunt(ghosts);
    this.reveal();
  }

  home() {
    scene.sliders.forEach((record, i) => { this.sliders[i].input.value = scene.live ? record.values[record.home] : record.home; this.read(i, record.values[record.home]); });
    if (scene.live) this.send(null);
    else this.settle(scene.home, true);
  }

  /* One question at a time; of what was asked meanwhile the last is asked next. Modes are asked for at rest. */
  async send(i, value, modes = false) {
    if (i !== null) this.read(i, value);
    this.next = { values: this.values.slice(), home: i === null, modes: modes || i === null };
    if (this.busy) return;
    this.busy = true;
    while (this.next) {
      const asked = this.next;
      this.next = null;
      const found = await fetch("pose", { method: "POST", body: JSON.stringify(asked) }).then((reply) => reply.json(), () => null);
      if (found) this.answered(found);
      $("status").textContent = !found ? "The server has ended." : found.stopped ? "The robot goes no further that way." : "";
    }
    this.busy = false;
  }

  answered({ state, ghosts }) {
    this.page.show(state);
    if (ghosts) this.modes(ghosts);
    else this.reveal(false);
  }

  toggles() {
    const offers = [["real", "real robot", scene.machines.length > 1], ["hidden", "hidden robot", scene.machines.length > 1],
                    ["arrows", "observed directions", scene.arrows.length]];
    for (const [key, text, there] of offers) if (there) {
      const box = element("label", $("toggles"));
      const input = element("input", box, undefined, { type: "checkbox", checked: true, id: `show-${key}` });
      element("span", box, text);
      input.onchange = () => { this.shown[key] = input.checked; this.reveal(); };
    }
  }

  words() {
    scene.machines.forEach(({ key, words }) => element("b", element("div", $("words"), `${key} `), words));
    const roles = new Set(scene.machines.flatMap(({ shapes }) => shapes.map(({ role }) => role)));
    if (scene.arrows.length) roles.add("arrow");
    const keys = { motor: "motor", joint: "passive joint", actuator: "virtual actuator", virtual: "virtual link", arrow: "observed direction" };
    for (const [role, text] of Object.entries(keys)) if (roles.has(role)) {
      const item = element("span", $("key"));
      element("i", item).style.background = "#" + new THREE.Color(COLOURS[role]).getHexString();
      item.append(text);
    }
    $("bar").style.background = `linear-gradient(90deg, ${STOPS.map(([t, c]) => `#${new THREE.Color(c).getHexString()} ${100 * t}%`)})`;
    $("far").textContent = scene.largest === null ? "" : scene.largest.toPrecision(3);
    scene.notes.forEach((note) => element("p", $("notes"), note));
  }
}

try {
  new Panel(new Page($("pane")));
} catch (error) {
  element("div", $("pane"), `The view needs WebGL: ${error.message}`, { className: "broken" });
}
requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(() => { document.body.dataset.ready = "yes"; })));
