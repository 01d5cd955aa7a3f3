"use strict";
/* Where a scene is looked at from: the first view, all of it, turned by pointer and keys. */
const Sight = (() => {
const { vector } = Solids;
const HALF = 13 * Math.PI / 180, ROOM = 0.55;  /* rad; half of the pane's size, and a margin */

return class Sight {
  /* `onchange` after each move of the camera. */
  constructor(canvas, onchange) {
    Object.assign(this, { canvas, onchange, turned: false, held: false, size: [1, 1], shift: 0 });
    this.camera = new THREE.PerspectiveCamera(2 * HALF * 180 / Math.PI, 1, 0.01, 100);
    this.look(null);
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /* Axes of the first view: a plane of motion (its normal) from before it, a robot in space from its side and a little above. */
  look(normal) {
    const n = normal && vector(normal), up = new THREE.Vector3(0, 0, 1);
    let from = new THREE.Vector3(0.6, -1.6, 0.62);
    if (n) {
      if (n.z < -0.1 || (n.z <= 0.1 && n.y > 0)) n.negate();
      if (n.z > 0.95) up.set(0, 1, 0);
      up.addScaledVector(n, -up.dot(n)).normalize();
      from = n.clone().addScaledVector(up, n.z > 0.7 ? -0.4 : 0.25);
    }
    from.normalize();
    const across = up.clone().cross(from).normalize();
    Object.assign(this, { from, across, pole: up, up: from.clone().cross(across) });
  }

  /* To where objects fill the pane, but for so many pixels at its top and bottom. */
  fit(objects, top = 0, bottom = 0) {
    const { camera } = this, axes = [this.across, this.up, this.from], corners = Sight.corners(objects);
    const ends = axes.map((axis) => Sight.span(corners, axis)), target = new THREE.Vector3();
    axes.forEach((axis, i) => target.addScaledVector(axis, (ends[i][0] + ends[i][1]) / 2));
    const [width, height, depth] = ends.map(([low, high]) => high - low);
    const free = Math.max(0.3, 1 - (top + bottom) / this.size[1]);
    const away = ROOM * Math.max(height / free, width / camera.aspect, 1e-6) / Math.tan(HALF) + 0.5 * depth;
    this.shift = (bottom - top) / 2;
    this.pane(...this.size);
    camera.up.copy(this.pole);
    this.controls?.dispose();
    this.controls = new THREE.OrbitControls(camera, this.canvas);
    let touched = false;
    this.controls.addEventListener("start", () => { touched = true; });
    this.controls.addEventListener("end", () => { touched = false; });
    this.controls.addEventListener("change", () => { this.turned ||= touched; this.onchange(); });
    this.controls.target.copy(target);
    camera.position.copy(target).addScaledVector(this.from, away);
    Object.assign(camera, { near: 0.01 * away, far: 100 * away });
    camera.updateProjectionMatrix();
    this.controls.update();
    this.turned = false;
    this.hold(this.held);
  }

  /* Something in the scene is dragged: the view stays. */
  hold(held) {
    this.held = held;
    if (this.controls) this.controls.enabled = !held;
  }

  pane(width, height) {
    this.size = [width, height];
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, this.shift, width, height);
  }

  /* Make the labels of a scene at least so many pixels high, however small it is drawn. */
  enlarge(scene, least) {
    const { camera, size: [, height] } = this, place = new THREE.Vector3();
    camera.updateMatrixWorld();
    scene.traverseVisible((mesh) => {
      if (!mesh.isSprite) return;
      const own = (mesh.userData.size ??= mesh.scale.clone());
      const away = -mesh.getWorldPosition(place).applyMatrix4(camera.matrixWorldInverse).z;
      mesh.scale.copy(own).multiplyScalar(Math.max(1, 2 * least * away * Math.tan(HALF) / (height * own.y)));
    });
  }

  /* The ray from the camera through a point of the page. */
  ray(x, y) {
    const box = this.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * (x - box.left) / box.width - 1, 1 - 2 * (y - box.top) / box.height), this.camera);
    return ray;
  }

  /* Arrow keys turn the view by 10°, plus and minus go nearer and away. */
  key(event) {
    if (!this.controls || this.held || event.ctrlKey || event.metaKey || event.altKey) return;
    const { camera } = this, step = Math.PI / 18, away = camera.position.clone().sub(this.controls.target);
    const across = camera.up.clone().cross(away).normalize(), angle = away.angleTo(camera.up);
    const tilt = (by) => { if (angle + by > 0.05 && angle + by < Math.PI - 0.05) away.applyAxisAngle(across, by); };
    const keys = {
      ArrowLeft: () => away.applyAxisAngle(camera.up, -step), ArrowRight: () => away.applyAxisAngle(camera.up, step),
      ArrowUp: () => tilt(-step), ArrowDown: () => tilt(step), "+": () => away.multiplyScalar(0.85), "-": () => away.multiplyScalar(1 / 0.85),
    };
    if (!keys[event.key]) return;
    keys[event.key]();
    this.turned = true;
    camera.position.copy(this.controls.target).add(away);
    this.controls.update();
    event.preventDefault();
    this.onchange();
  }

  /* Corners of the boxes round all that is drawn of objects, in the world. */
  static corners(objects) {
    const found = [];
    objects.forEach((object) => {
      object.updateWorldMatrix(true, true);
      object.traverseVisible((mesh) => {
        if (mesh.isSprite) {
          const middle = new THREE.Vector3().setFromMatrixPosition(mesh.matrixWorld), half = 0.5 * (mesh.userData.size ?? mesh.scale).x;
          [0, 1, 2].forEach((i) => [-half, half].forEach((by) => found.push(middle.clone().setComponent(i, middle.getComponent(i) + by))));
        }
        if (!mesh.isMesh || mesh.userData.free) return;
        if (!mesh.geometry.boundingBox) mesh.geometry.computeBoundingBox();
        const { min, max } = mesh.geometry.boundingBox;
        for (let i = 0; i < 8; i += 1)
          found.push(new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z).applyMatrix4(mesh.matrixWorld));
      });
    });
    return found.length ? found : [new THREE.Vector3()];
  }

  /* How far points reach along an axis. */
  static span(points, axis) {
    return points.reduce(([low, high], p) => [Math.min(low, p.dot(axis)), Math.max(high, p.dot(axis))], [Infinity, -Infinity]);
  }
};
})();
