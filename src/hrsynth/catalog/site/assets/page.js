"use strict";

const rows = [...document.querySelectorAll("#variants [data-name]")];

/** Mark the joints with a motor, in drawing and title. */
function mark(motors) {
  for (const joint of document.querySelectorAll("#real [data-joint]")) {
    const driven = joint.dataset.joint.split("\n").some((name) => motors.has(name));
    joint.parentNode.setAttribute("class", driven ? "motor" : "joint");
    const title = joint.querySelector("title");
    title.textContent = title.textContent.replace(", driven by a motor", "") + (driven ? ", driven by a motor" : "");
  }
}

/** Show the architecture that the address names: its motors, its notation, its file. */
function show() {
  const row = rows.find((each) => each.dataset.name === location.hash.slice(1)) ?? rows[0];
  for (const each of rows) {
    if (each === row) each.setAttribute("aria-current", "true");
    else each.removeAttribute("aria-current");
  }
  mark(new Set(row.dataset.motors.split(" ")));
  const word = row.querySelector("code").textContent;
  if (row.dataset.motors) {
    document.getElementById("notation").replaceChildren(...row.querySelector("a").cloneNode(true).childNodes);
  }
  document.getElementById("word").textContent = word;
  const said = document.querySelector("#real svg desc");
  if (said) said.textContent = `${word}: * marks a motor.`;
  for (const link of document.querySelectorAll("#file a")) {
    link.href = `../r/${row.dataset.name}.urdf`;
    link.textContent = `${row.dataset.name}.urdf`;
    document.querySelector("#file code").textContent = `hrsynth derive ${row.dataset.name}.urdf`;
  }
}

/** The list as it was left. */
function back() {
  try {
    document.getElementById("back").hash = sessionStorage.getItem("catalog") ?? "";
  } catch {
    // a browser that stores nothing: the whole list
  }
}

addEventListener("hashchange", show);
show();
back();
