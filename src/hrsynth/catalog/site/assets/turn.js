"use strict";

const SPACE = "http://www.w3.org/2000/svg";
const SIZE = 320;
const STROKES = { base: ["var(--edge)", 2], leg: ["var(--soft)", 3], platform: ["var(--ink)", 3.4], seen: ["var(--watched)", 4.6] };
const FILLS = { base: "var(--ground)", platform: "var(--line)" };
const stage = document.getElementById("stage");

/** A robot in space that is drawn again whenever it is turned. */
function turning() {
  const { axes, marks } = JSON.parse(document.getElementById("robot").textContent);
  let [right, up, eye] = axes;
  let motors = null;

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const mix = (a, s, b, t) => a.map((own, i) => s * own + t * b[i]);

  /** Turn what is seen, to the right and downwards (radians). */
  function turn(across, down) {
    const [c, s, d, e] = [Math.cos(across), Math.sin(across), Math.cos(down), Math.sin(down)];
    [right, eye] = [mix(right, c, eye, s), mix(eye, c, right, -s)];
    [up, eye] = [mix(up, d, eye, -e), mix(eye, d, up, e)];
    draw();
  }

  function shape(name, settings) {
    const made = document.createElementNS(SPACE, name);
    for (const [key, own] of Object.entries(settings)) {
      if (["stroke", "fill"].includes(key)) made.style.setProperty(key, own);
      else made.setAttribute(key, own);
    }
    return made;
  }

  /** A mark on the page, a pale line about strokes so that what is nearer stands out. */
  function drawn([kind, role, , joint], points) {
    const d = `M${points.map((point) => `${point[0].toFixed(1)} ${point[1].toFixed(1)}`).join("L")}`;
    const driven = motors === null ? role === "motor" : motors.has(joint);
    const fill = driven ? "var(--motor)" : "var(--face)";
    const line = (stroke, width) => shape("path", { d, stroke, "stroke-width": width, fill: "none" });
    if (kind === "area") {
      const [stroke, width] = STROKES[role] ?? STROKES.leg;
      return [shape("path", { d: `${d}Z`, stroke, "stroke-width": width, fill: FILLS[role] ?? "var(--face)", "fill-opacity": 0.75 })];
    }
    if (kind === "line") {
      const [stroke, width] = STROKES[role] ?? STROKES.leg;
      return [line("var(--face)", width + 3), line(stroke, width)];
    }
    if (kind === "sleeve") return [line("var(--ink)", 13), line(fill, 10)];
    const [[cx, cy]] = points;
    return [shape("circle", { cx, cy, r: driven ? 5.5 : 3.6, fill, stroke: "var(--ink)", "stroke-width": 1.4 })];
  }

  function draw() {
    const seen = marks.map((mark) => mark[2].map((point) => [dot(point, right), dot(point, up), dot(point, eye)]));
    const depth = seen.map((points, i) => points.reduce((sum, point) => sum + point[2], 0) / points.length
      + (["dot", "sleeve"].includes(marks[i][0]) ? 0.02 : 0) - (marks[i][0] === "area" ? 10 : 0));
    const whole = shape("svg", { viewBox: `${-SIZE / 2} ${-SIZE / 2} ${SIZE} ${SIZE}` });
    for (const i of [...marks.keys()].sort((a, b) => depth[a] - depth[b])) {
      whole.append(...drawn(marks[i], seen[i].map(([x, y]) => [0.94 * SIZE * x, -0.94 * SIZE * y])));
    }
    stage.replaceChildren(whole);
  }

  stage.addEventListener("pointerdown", (event) => stage.setPointerCapture(event.pointerId));
  stage.addEventListener("pointermove", (event) => {
    if (event.buttons) turn(-0.01 * event.movementX, 0.01 * event.movementY);
  });
  stage.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (!way) return;
    event.preventDefault();
    turn(...way);
  });
  draw();
  return (names) => {
    motors = names;
    draw();
  };
}

const drive = stage ? turning() : () => {};
