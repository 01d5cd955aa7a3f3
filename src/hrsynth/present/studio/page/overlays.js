"use strict";
/* Overlays of a robot: unobserved twists as moving arrows, the error ellipsoid, a plane of values with its locus. */
const Overlays = (() => {
const { BEHIND, arrow, bent, cylinder, label, material, stretch, vector } = Solids;
const SWING = 0.2, TURN = 0.42, PERIOD = 2.6;  /* characteristic lengths, rad, s */
const NEAR_AXIS = 1.5;  /* characteristic lengths from the point within which an axis is drawn at itself */

/* The motion that a twist (v, w) of a point begins: along a line, about an axis, or both at once. */
class Motion {
  constructor({ twist, point }, length) {
    const v = vector(twist), w = vector(twist.slice(3));
    Object.assign(this, { point: vector(point), length, turns: w.length() * length > 1e-6 * v.length() });
    this.axis = (this.turns ? w : v).clone().normalize();
    if (!this.turns) return;
    const square = w.lengthSq();
    this.pitch = Math.abs(v.dot(w)) > 1e-6 * length * square ? v.dot(w) / square : 0;
    this.foot = w.clone().cross(v).divideScalar(square).add(this.point);
    this.arm = this.point.clone().sub(this.foot);
    this.near = this.arm.length() < NEAR_AXIS * length;
  }

  /* Where a point comes to when the motion goes on by an angle (rad) or a way (m). */
  carry(point, by) {
    if (!this.turns) return point.clone().addScaledVector(this.axis, by);
    return point.clone().sub(this.foot).applyAxisAngle(this.axis, by).add(this.foot).addScaledVector(this.axis, this.pitch * by);
  }

  /* The arrow's course, from 0 to 1: it is long enough to be seen, and ends before it closes. */
  course() {
    const { length } = this;
    if (!this.turns) return (t) => this.carry(this.point, 0.75 * length * t);
    const rise = this.pitch ? 0.9 * length / Math.abs(this.pitch) : Infinity, spoke = 0.36 * length;
    if (!this.near) {
      const angle = Math.min(0.9 * length / this.arm.length(), rise);
      return (t) => this.carry(this.point, angle * (t - 0.5));
    }
    const angle = Math.min(this.pitch ? 3 * Math.PI : 1.6 * Math.PI, rise), side = new THREE.Vector3(1, 0, 0);
    if (Math.abs(this.axis.x) > 0.9) side.set(0, 1, 0);
    const start = side.cross(this.axis).normalize().multiplyScalar(spoke).add(this.foot);
    return (t) => this.carry(start, angle * (t - 0.5));
  }

  /* How far it swings to each side. */
  swing() {
    if (!this.turns) return SWING * this.length;
    return this.near ? TURN : SWING * this.length / this.arm.length();
  }
}

/* The arrows of unobserved twists; `swing` moves them back and forth. */
class LostArrows {
  constructor(records, { length, radius }) {
    this.group = new THREE.Group();
    this.moving = records.map((record, i) => {
      const motion = new Motion(record, length), group = new THREE.Group(), colour = Colours.of("step4");
      const look = material(colour, { emissive: colour, emissiveIntensity: 0.25 }), course = motion.course();
      group.add(...bent(course, 0.9 * radius, look));
      if (motion.turns && motion.near) group.add(...axis(motion, 0.25 * radius, look));
      if (records.length > 1) {
        const name = label(String(i + 1), colour, 0.13 * length);
        name.position.copy(course(0));
        group.add(name);
      }
      group.matrixAutoUpdate = false;
      this.group.add(group);
      return { motion, group };
    });
  }

  swing(seconds) {
    const phase = Math.sin(2 * Math.PI * seconds / PERIOD);
    for (const { motion, group } of this.moving) {
      const by = motion.swing() * phase;
      if (motion.turns) group.matrix.makeRotationAxis(motion.axis, by);
      else group.matrix.identity();
      group.matrix.setPosition(motion.carry(new THREE.Vector3(), by));
      group.matrixWorldNeedsUpdate = true;
    }
  }
}

/* The axis of a turn, as a thin rod. */
function axis({ foot, axis: along, length }, radius, look) {
  return bent((t) => foot.clone().addScaledVector(along, 1.1 * length * (t - 0.5)), radius, look).slice(0, 1);
}

/* The ellipsoid of the platform's errors for 0.1°, and how many times it is drawn too large: 1, 2, 5, 10, … */
function ellipsoid({ center, axes }, length) {
  const half = axes.map(vector), most = Math.max(...half.map((each) => each.length()));
  const wanted = 0.3 * length / most, ten = 10 ** Math.floor(Math.log10(wanted));
  const factor = Math.max(1, ten * [5, 2, 1].find((each) => each * ten <= wanted * (1 + 1e-9)));
  half.forEach((each) => each.multiplyScalar(factor));
  const thin = 0.02 * most * factor;
  for (const [i, each] of half.entries()) if (each.length() < thin) {
    const [one, other] = [half[(i + 1) % 3], half[(i + 2) % 3]];
    each.copy(one).cross(other);
    if (each.length() < 1e-12) each.set(1, 0, 0).cross(one.length() ? one : other);
    if (each.length() < 1e-12) each.set(0, 1, 0).cross(one.length() ? one : other);
    each.setLength(thin);
  }
  const look = material(Colours.of("ellipsoid"), { ...BEHIND, opacity: 0.45, side: THREE.FrontSide });
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(1, 40, 28), look);
  mesh.matrixAutoUpdate = false;
  mesh.matrix.makeBasis(...half).setPosition(vector(center));
  return { mesh, factor };
}

/* A plane of values: `corners` c0 to c3 round it, `values` by rows from the side c0 c1 to the side c3 c2; cells of the
   scale's colours about where the values are, none where a value is null; the locus as lines; a handle to draw it along
   `normal`, the way of the third coordinate, none where that is null. */
class Plane {
  constructor(record, radius) {
    this.record = record;
    this.group = new THREE.Group();
    const c = record.corners.map(vector), across = c[1].clone().sub(c[0]), up = c[3].clone().sub(c[0]);
    const [rows, columns] = [record.values.length, record.values[0].length];
    this.corner = c[0].clone();
    this.normal = record.normal ? vector(record.normal) : across.clone().cross(up).normalize();
    [[-1, -1], [1, -1], [1, 1], [-1, 1]].forEach(([i, j], k) => c[k].addScaledVector(across, i / (2 * Math.max(1, columns - 1)))
      .addScaledVector(up, j / (2 * Math.max(1, rows - 1))));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(c.flatMap((p) => p.toArray()), 3));
    geometry.setAttribute("uv", new THREE.Float32BufferAttribute([0, 0, 1, 0, 1, 1, 0, 1], 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const look = new THREE.MeshBasicMaterial({ map: this.cells(), ...BEHIND, opacity: 0.8, side: THREE.DoubleSide });
    const frame = material(Colours.of("frame"));
    this.group.add(new THREE.Mesh(geometry, look), line([...c, c[0]], 0.3 * radius, frame));
    const end = this.normal.clone().multiplyScalar(8 * radius), middle = c[1].clone().lerp(c[2], 0.5);
    this.handle = record.normal === null ? [] : [1, -1].flatMap((way) => arrow(middle, middle.clone().addScaledVector(end, way), 0.8 * radius, frame));
    this.handle.forEach((each) => { each.userData.pick = { kind: "plane", name: "plane" }; });
    this.handle.forEach((each) => this.group.add(each));
    const rim = new THREE.MeshBasicMaterial({ color: Colours.of("background"), side: THREE.BackSide });
    const locus = material(Colours.of("step4"));
    for (const way of record.locus ?? []) {
      const points = way.map(vector);
      this.group.add(line(points, 0.85 * radius, rim), line(points, 0.45 * radius, locus));
    }
  }

  cells() {
    const { values, steps, falling } = this.record, [rows, columns] = [values.length, values[0].length];
    const data = new Uint8Array(4 * rows * columns);
    values.flat().forEach((value, k) => {
      if (value === null) return;
      const colour = Colours.steps[Colours.rank(value, steps, falling)];
      data.set([...[1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16)), 255], 4 * k);
    });
    const map = new THREE.DataTexture(data, columns, rows);
    Object.assign(map, { colorSpace: THREE.SRGBColorSpace, needsUpdate: true });
    return map;
  }

  /* How far out along its normal it lies (m), as computed; there it is shown at another height until the answer comes. */
  height() {
    return this.normal.dot(this.corner);
  }

  slide(height) {
    this.group.position.copy(this.normal).multiplyScalar(height - this.height());
  }

  /* A point of the handle. */
  grip() {
    return this.handle[0].getWorldPosition(new THREE.Vector3());
  }

  /* How far along the normal a ray is nearest to the line through a point. */
  along({ origin, direction }, point) {
    const d = origin.clone().sub(point), across = this.normal.dot(direction), square = 1 - across * across;
    return square < 1e-4 ? null : (d.dot(this.normal) - across * d.dot(direction)) / square;
  }
}

/* A line through points, as thick as a rod. */
function line(points, radius, look) {
  const group = new THREE.Group();
  points.slice(1).forEach((p, i) => group.add(stretch(new THREE.Mesh(cylinder(radius), look), points[i], p)));
  return group;
}

/* Observations, as each kind draws itself: lines, and see-through polygons that the view does not fit itself to. */
function sights(records, radius) {
  const look = material(Colours.of("observed"));
  const sheer = new THREE.MeshBasicMaterial({ color: Colours.of("observed"), ...BEHIND, opacity: 0.22, side: THREE.DoubleSide });
  return records.flatMap(({ lines, areas }) => [
    ...lines.map((each) => each.length > 1 ? line(each.map(vector), 0.3 * radius, look) : new THREE.Group()),
    ...areas.map((each) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(each.flat(), 3));
      geometry.setIndex(each.slice(2).flatMap((_, i) => [0, i + 1, i + 2]));
      return new THREE.Mesh(geometry, sheer);
    })]);
}

return { LostArrows, Motion, Plane, ellipsoid, sights };
})();
