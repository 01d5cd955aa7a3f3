/* What the 3D pages take of three.js: `make three` bundles it into one file. */
export * from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { TransformControls } from "three/addons/controls/TransformControls.js";
