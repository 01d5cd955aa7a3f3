"use strict";
/* Handles to drag a platform by: arrows along which it moves and rings about which it turns, of its own dof only. */
const Gizmo = (() => {
const { moved, turn, vector } = Solids;

/* Three axes (a right-handed frame), those of the freedoms first; world axes where they are freedoms. */
function frame(rows) {
  const world = [...Array(3).keys()].map((i) => new THREE.Vector3().setComponent(i, 1)), span = rows.map(vector);
  const within = (axis) => span.reduce((sum, each) => sum.addScaledVector(each, each.dot(axis)), new THREE.Vector3());
  const found = [];
  const candidates = world.map((each) => [each, within(each)]).sort((a, b) => b[1].length() - a[1].length());
  for (const [, each] of candidates) {
    const rest = each.clone();
    found.forEach((other) => rest.addScaledVector(other, -rest.dot(other)));
    if (found.length < rows.length && rest.length() > 1e-3) found.push(rest.normalize());
  }
  const count = found.length;
  if (count === 1) found.push(world[Math.abs(found[0].x) < 0.9 ? 0 : 1].clone().cross(found[0]).normalize());
  if (count === 0) found.push(world[0], world[1]);
  if (found.length === 2) found.push(found[0].clone().cross(found[1]));
  const M = new THREE.Matrix4().makeBasis(...found);
  if (M.determinant() < 0) M.makeBasis(found[0], found[1], found[2].negate());
  return { count, turn: new THREE.Quaternion().setFromRotationMatrix(M) };
}

return class Gizmo {
  /* `freedoms` holds the directions in which the platform moves and about which it turns, by rows. */
  constructor({ camera, canvas, world, freedoms, ondrag, onchange, onhold }) {
    this.world = world;
    this.parts = [["translate", freedoms.translations, 0.75], ["rotate", freedoms.rotations, 1.05]]
      .filter(([, rows]) => rows.length).map(([mode, rows, size]) => {
        const at = frame(rows), proxy = new THREE.Object3D(), controls = new THREE.TransformControls(camera, canvas);
        const [black, held] = [Colours.of("frame"), Colours.of("unknown")];
        controls.setColors(black, black, black, held);
        Object.assign(controls, { mode, size, space: "local", showX: true, showY: at.count > 1, showZ: at.count > 2 });
        controls.attach(proxy);
        controls.addEventListener("change", onchange);
        controls.addEventListener("dragging-changed", ({ value }) => { this.dragging = value; onhold(value); if (!value) this.place(this.now); });
        controls.addEventListener("objectChange", () => ondrag(this.dragged(mode, proxy, at.turn)));
        world.add(proxy, controls.getHelper());
        return { mode, proxy, controls, at };
      });
  }

  /* To where the platform is, its point at home at `point`; not while it is held. */
  place(place, point = this.point) {
    [this.now, this.point] = [place, point];
    if (this.dragging) return;
    this.start = place;
    for (const { proxy, at } of this.parts) {
      proxy.position.copy(moved(point, place));
      proxy.quaternion.copy(at.turn);
    }
  }

  /* The platform's displacement that is meant. */
  dragged(mode, proxy, home) {
    const q = turn(this.start);
    if (mode === "rotate") q.premultiply(proxy.quaternion.clone().multiply(home.clone().invert()));
    const t = proxy.position.clone().sub(vector(this.point).applyQuaternion(q));
    return [...t.toArray(), q.x, q.y, q.z, q.w];
  }

  clear() {
    for (const { proxy, controls } of this.parts) {
      this.world.remove(proxy, controls.getHelper());
      controls.dispose();
    }
  }
};
})();
