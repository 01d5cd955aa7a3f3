"use strict";
/* Shapes of links and joints as solids, arrows, names and frames: nothing here knows of states. */
const Solids = (() => {
const STRONG = { motor: 1.3, actuator: 1.45 };
const BEHIND = { transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 };
const UP = new THREE.Vector3(0, 1, 0);

const vector = (p) => new THREE.Vector3(p[0], p[1], p[2]);
const turn = (place) => new THREE.Quaternion(place[3], place[4], place[5], place[6]);
const moved = (point, place) => vector(point).applyQuaternion(turn(place)).add(vector(place));

function material(colour, more = {}) {
  return new THREE.MeshPhongMaterial({ color: colour, shininess: 30, specular: 0x1a1a1a, side: THREE.DoubleSide, ...more });
}

function put(object, place) {
  object.position.copy(vector(place));
  object.quaternion.copy(turn(place));
}

/* A mesh made along y with length 1, put between two points. */
function stretch(mesh, from, to) {
  const way = to.clone().sub(from), length = way.length();
  mesh.position.copy(from).addScaledVector(way, 0.5);
  mesh.scale.setScalar(0);
  if (length < 1e-9) return mesh;
  mesh.quaternion.setFromUnitVectors(UP, way.normalize());
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
  const head = stretch(new THREE.Mesh(cylinder(2.3 * radius, 0.001 * radius), look), neck, to);
  return [stretch(new THREE.Mesh(cylinder(radius), look), from, neck), head];
}

/* An arrow along a curve, given as a function of 0 to 1: straight, bent or wound. */
function bent(curve, radius, look) {
  const path = new THREE.Curve();
  path.getPoint = (t, into = new THREE.Vector3()) => into.copy(curve(0.88 * t));
  const shaft = new THREE.Mesh(new THREE.TubeGeometry(path, 96, radius, 12), look);
  return [shaft, stretch(new THREE.Mesh(cylinder(2.6 * radius, 0.001 * radius), look), curve(0.86), curve(1))];
}

/* A name on a coloured ground that always looks at the camera; a short one in a disc, a longer one in a pill. */
function label(text, colour, size) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d"), short = [...text].length <= 2;
  const font = `bold ${short ? 72 : 60}px system-ui, "DejaVu Sans", sans-serif`;
  pen.font = font;
  const width = short ? 128 : Math.min(1024, Math.ceil(pen.measureText(text).width) + 84);
  Object.assign(canvas, { width, height: 128 });
  pen.fillStyle = colour;
  pen.strokeStyle = Colours.ink(colour);
  pen.lineWidth = 5;
  pen.beginPath();
  if (short) pen.arc(64, 64, 58, 0, 7);
  else pen.roundRect(6, 14, canvas.width - 12, 100, 50);
  pen.fill();
  pen.stroke();
  pen.fillStyle = Colours.ink(colour);
  pen.font = font;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, canvas.width / 2, 68, canvas.width - 24);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false, toneMapped: false }));
  sprite.scale.set(size * canvas.width / 128, size, 1);
  sprite.renderOrder = 10;
  return sprite;
}

/* A frame: three arrows of one colour with the letters of their axes. */
function triad(place, size, look) {
  const group = new THREE.Group();
  [..."xyz"].forEach((letter, i) => {
    const end = new THREE.Vector3().setComponent(i, size);
    const name = letters(letter, 0.34 * size);
    name.position.copy(end).multiplyScalar(1.16);
    group.add(...arrow(new THREE.Vector3(), end, 0.016 * size, look), name);
  });
  put(group, place);
  return group;
}

function letters(text, size) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.width = canvas.height = 64;
  pen.font = 'bold 50px system-ui, "DejaVu Sans", sans-serif';
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 8;
  pen.strokeStyle = Colours.of("background");
  pen.strokeText(text, 32, 34);
  pen.fillStyle = Colours.of("frame");
  pen.fillText(text, 32, 34);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthTest: false }));
  sprite.scale.setScalar(size);
  sprite.renderOrder = 9;
  return sprite;
}

/* Give back what a group holds on the graphics card, and empty it. */
function clear(group) {
  group.traverse((each) => {
    each.geometry?.dispose();
    for (const look of [each.material].flat().filter(Boolean)) { look.map?.dispose(); look.dispose(); }
  });
  group.clear();
}

return { BEHIND, vector, turn, moved, material, put, stretch, cylinder, solids, arrow, bent, label, triad, clear };
})();
