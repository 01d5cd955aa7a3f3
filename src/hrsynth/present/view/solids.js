"use strict";
const { THREE } = MeshCat;

const COLOURS = { base: 0x8794a5, leg: 0x6d7f96, platform: 0x98a2ae, virtual: 0xa98be0, joint: 0x2f3b4a,
                  motor: 0xf08a24, actuator: 0xd81b7a, arrow: 0x1463e0, pale: 0x9aa5b1 };
const GHOSTS = [0x1a9c8c, 0xb8742a, 0x7a9a1f, 0xa8503a, 0x2f7fa8, 0x4f8a4c, 0x7d6b5a];
const STRONG = { motor: 1.3, actuator: 1.45 };
const STOPS = [[0, 0xc81e2c], [0.2, 0xee7d2f], [0.4, 0xf3c44a], [0.7, 0x63b86f], [1, 0x14795a]];

const BEHIND = { transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 };

const vector = (p) => new THREE.Vector3(p[0], p[1], p[2]);

function material(colour, more = {}) {
  return new THREE.MeshPhongMaterial({ color: colour, shininess: 35, specular: 0x222222, side: THREE.DoubleSide, ...more });
}

function scaleColour(part) {
  const t = Math.min(1, Math.max(0, part));
  const k = Math.max(1, STOPS.findIndex(([end]) => t <= end));
  const [[low, from], [high, to]] = [STOPS[k - 1], STOPS[k]];
  return new THREE.Color(from).lerp(new THREE.Color(to), (t - low) / (high - low));
}

/* A mesh made along y with length 1, put between two points. */
function stretch(mesh, from, to) {
  const way = to.clone().sub(from), length = way.length();
  mesh.visible = length > 1e-9;
  if (!mesh.visible) return mesh;
  mesh.position.copy(from).addScaledVector(way, 0.5);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
  mesh.scale.set(1, length, 1);
  return mesh;
}

const cylinder = (radius, to = radius) => new THREE.CylinderGeometry(to, radius, 1, 24);

function fan(points, faces) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points.flat(), 3));
  geometry.setIndex(faces.flat());
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

/* The geometries of a shape, each with the points between which it is stretched, if any. */
function pieces(shape) {
  const p = shape.points.map(vector), s = shape.size * (STRONG[shape.role] || 1);
  const middle = p[0].clone().lerp(p[Math.min(1, p.length - 1)], 0.5);
  if (STRONG[shape.role]) p.forEach((end) => end.lerp(middle, 1 - STRONG[shape.role]));
  switch (shape.kind) {
    case "rod": case "rail": case "span": case "hinge": case "disc":
      return [[cylinder(s), p[0], p[1]]];
    case "slider":
      return [[new THREE.BoxGeometry(2 * s, 1, 2 * s), p[0], p[1]]];
    case "ball":
      return [[new THREE.SphereGeometry(s, 28, 20), p[0]]];
    case "cross":
      return [[cylinder(s), p[0], p[1]], [cylinder(s), p[2], p[3]],
              [new THREE.SphereGeometry(1.5 * s, 24, 16), middle]];
    case "plate": {
      const hub = shape.points[0].map((_, i) => shape.points.reduce((sum, each) => sum + each[i], 0) / p.length);
      return [[fan([hub, ...shape.points], p.map((_, i) => [0, i + 1, (i + 1) % p.length + 1]))]];
    }
    case "mesh":
      return [[fan(shape.points, shape.faces)]];
  }
  throw new Error(`no such shape: ${shape.kind}`);
}

/* Meshes of a shape in the frame of its link. */
function solids(shape, look) {
  return pieces(shape).map(([geometry, from, to]) => {
    const mesh = new THREE.Mesh(geometry, look);
    if (to) stretch(mesh, from, to);
    else if (from) mesh.position.copy(from);
    return mesh;
  });
}

function arrow(from, to, radius, look) {
  const neck = from.clone().lerp(to, 1 - Math.min(0.4, 6 * radius / from.distanceTo(to)));
  const head = stretch(new THREE.Mesh(cylinder(2.3 * radius, 0.001), look), neck, to);
  return [stretch(new THREE.Mesh(cylinder(radius), look), from, neck), head];
}

function label(text, colour, size) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.width = canvas.height = 128;
  pen.fillStyle = "#" + new THREE.Color(colour).getHexString();
  pen.beginPath(); pen.arc(64, 64, 58, 0, 7); pen.fill();
  pen.lineWidth = 6; pen.strokeStyle = "#fff"; pen.stroke();
  pen.fillStyle = "#fff"; pen.textAlign = "center"; pen.textBaseline = "middle";
  pen.font = `bold ${text.length > 2 ? 44 : 72}px system-ui, "DejaVu Sans", sans-serif`;
  pen.fillText(text, 64, 68, 100);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthTest: false }));
  sprite.scale.setScalar(size);
  sprite.renderOrder = 10;
  return sprite;
}

function triad(place, size) {
  const group = new THREE.Group();
  [0xd64545, 0x3a9d4a, 0x2f6fd6].forEach((colour, i) => {
    const end = new THREE.Vector3().setComponent(i, size);
    group.add(...arrow(new THREE.Vector3(), end, 0.02 * size, material(colour)));
  });
  put(group, place);
  return group;
}

function put(object, place) {
  object.position.set(place[0], place[1], place[2]);
  object.quaternion.set(place[3], place[4], place[5], place[6]);
}
