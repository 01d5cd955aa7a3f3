"use strict";
/* Robots of solids: one group a link, moved by a state's places; spans follow two links. */
const Robots = (() => {
const { BEHIND, clear, cylinder, label, material, moved, put, solids, stretch, triad, vector, arrow } = Solids;
const GLASS = 0.22, PALE = 0.28;

class Machine {
  constructor(record, length) {
    this.record = record;
    this.group = new THREE.Group();
    this.links = record.links.map(() => new THREE.Group());
    this.looks = {};
    this.spans = [];
    this.other = null;
    this.group.add(...this.links);
    for (const shape of record.shapes) this.add(shape);
    for (const { link, place } of record.frames) this.links[link].add(triad(place, 0.3 * length, this.look("frame")));
    this.step(undefined);
  }

  look(role, glass = false) {
    const key = role + (glass ? " glass" : "");
    const colour = Colours.of(role === "platform" ? "unknown" : role);
    return this.looks[key] ||= material(colour, glass ? { ...BEHIND, opacity: GLASS, polygonOffsetUnits: 8 } : {});
  }

  add(shape) {
    const meshes = solids(shape, this.look(shape.role, shape.role === "base" && shape.kind === "plate"));
    const leg = this.record.legs?.[shape.link] ?? this.record.legs?.[shape.other];
    const pick = leg ? { kind: "leg", name: leg } : null;
    meshes.forEach((mesh) => Object.assign(mesh.userData, { role: shape.role, pick }));
    if (shape.kind === "span") {
      const holder = new THREE.Group();
      holder.add(meshes[0]);
      this.spans.push({ holder, mesh: meshes[0], shape });
      this.group.add(holder);
    } else this.links[shape.link].add(...meshes);
  }

  move(places) {
    this.places = places;
    this.links.forEach((group, i) => put(group, places[i]));
    for (const { mesh, shape } of this.spans)
      stretch(mesh, moved(shape.points[0], places[shape.link]), moved(shape.points[1], places[shape.other]));
  }

  /* Colour the platform by the step of its error. */
  step(step) {
    this.looks.platform?.color.set(Colours.of(Colours.step(step)));
  }

  /* As glass, in its own colours, without the links that another machine draws too, save their motors; or as it is. */
  pale(other) {
    if (other === this.other) return;
    this.other = other;
    const shared = this.record.links.map((link) => Boolean(other?.record.links.includes(link)));
    this.links.forEach((group, i) => group.children.forEach((each) => { each.visible = !shared[i] || each.userData.role === "motor"; }));
    this.spans.forEach(({ holder, shape }) => { holder.visible = !(shared[shape.link] && shared[shape.other]); });
    for (const [key, look] of Object.entries(this.looks)) if (!key.endsWith("glass")) {
      look.setValues({ transparent: Boolean(other), depthWrite: !other, opacity: other ? PALE : 1 });
      look.needsUpdate = true;
    }
  }

  /* What is to be seen of it. */
  roles() {
    const found = new Set();
    this.group.traverseVisible(({ userData }) => { if (userData.role) found.add(userData.role); });
    return found;
  }

  clear() {
    clear(this.group);
  }
}

/* The real robot elsewhere, without its base: rods and plates as glass; a link of unknown place is left out. */
function outline(record, places, colour, { opacity = 0.3, name = null, size = 0, pick = null } = {}) {
  const group = new THREE.Group(), look = material(colour, { ...BEHIND, opacity }), corners = [];
  for (const shape of record.shapes) {
    const place = places[shape.link], other = places[shape.other ?? shape.link];
    if (!place || !other || shape.role === "base" || !["rod", "plate", "span", "mesh"].includes(shape.kind)) continue;
    const last = shape.points.length - 1;
    const points = shape.points.map((p, i) => moved(p, shape.other !== undefined && i === last ? other : place));
    group.add(...solids({ ...shape, size: 0.75 * shape.size, points: points.map((p) => p.toArray()) }, look));
    if (shape.role === "platform") corners.push(...points);
  }
  if (name) {
    const sprite = label(name, colour, size);
    corners.forEach((p) => sprite.position.addScaledVector(p, 1 / corners.length));
    group.add(sprite);
  }
  if (pick) group.children.forEach((each) => { each.userData.pick = pick; });
  return group;
}

/* The arrow of a leg's direction, with the leg's name: strong if it is observed. It follows its link. */
class Direction {
  constructor(record, { length, radius }) {
    this.record = record;
    this.group = new THREE.Group();
    this.make = (watched) => {
      const ends = record.ends.map(vector), colour = Colours.of(watched ? "observed" : "unobserved");
      const name = label(record.leg, colour, (watched ? 0.14 : 0.11) * length);
      name.position.copy(ends[1]).lerp(ends[0], 0.85);
      const look = material(colour, watched ? {} : { transparent: true, opacity: 0.75 });
      this.group.add(...arrow(ends[0], ends[1], (watched ? 1.9 : 1.2) * radius, look), name);
      this.group.children.forEach((each) => { each.userData.pick = { kind: "leg", name: record.leg }; });
    };
    this.watch(true);
  }

  watch(watched) {
    if (this.watched === watched) return;
    this.watched = watched;
    clear(this.group);
    this.make(watched);
  }
}

return { Machine, Direction, outline };
})();
