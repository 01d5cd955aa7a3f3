"use strict";

const PAGE = 50;
const FACETS = ["group", "legs", "dof", "motion", "verdict", "fewest", "base"];
const BASE = { 1: "on the base", 0: "some move" };
const HEADS = [
  ["order", "drawing"],
  ["notation", "robot"], ["hidden", "hidden robot"], ["dof", "dof"], ["verdict", "verdict"],
  ["fewest", "legs needed"], ["base", "motors"], ["group", "group"],
];
const TEXTS = ["alias", "group", "motion", "verdict", "notation", "hidden", "condition", "suggestion", "refused", "steps", "unobserved"];
const count = CATALOG.key.length;
const form = document.getElementById("filters");
const element = (id) => document.getElementById(id);
const said = (number) => number.toLocaleString("en");

/** A field of a record; null if it has none. */
function value(field, i) {
  const column = CATALOG[field];
  return Array.isArray(column) ? column[i] : column.values[column.at[i]] ?? null;
}

/** Searched text in small letters: stored fields and shown cells, in which a line marks a motor. */
const haystack = CATALOG.key.map((word, i) => {
  const shown = [value("notation", i), value("hidden", i)].map((own) => (own ?? "").replaceAll("*", ""));
  const cells = [`${value("fewest", i)} of ${value("legs", i)}`, BASE[value("base", i)] ?? "", value("verdict", i) ?? "refused"];
  return [word, ...TEXTS.map((field) => value(field, i) ?? ""), ...shown, ...cells].join("\n").toLowerCase();
});

let state = { q: "", sort: "", page: 1 };

/** Read the filters of the address. */
function read() {
  const asked = new URLSearchParams(location.hash.slice(1));
  state = { q: asked.get("q") ?? "", sort: asked.get("sort") ?? "", page: Math.max(1, Number(asked.get("page")) || 1) };
  for (const field of FACETS) state[field] = asked.get(field) ?? "";
}

/** Write the filters to the address. */
function write() {
  const asked = new URLSearchParams();
  for (const [name, given] of Object.entries(state)) {
    if (given !== "" && !(name === "page" && given === 1)) asked.set(name, given);
  }
  history.replaceState(null, "", asked.size ? `#${asked}` : location.pathname + location.search);
  try {
    sessionStorage.setItem("catalog", location.hash);
  } catch {
    // a browser that stores nothing: a page then leads back to the whole list
  }
}

/** The records that fit the search, and for each the filters that it does not fit. */
function fitting() {
  const words = state.q.toLowerCase().replaceAll("π", "pi").replace(/(.)\u0332/gu, "$1*").split(/\s+/).filter(Boolean);
  const asked = FACETS.filter((field) => state[field] !== "");
  const found = [];
  const counts = Object.fromEntries(FACETS.map((field) => [field, new Map()]));
  for (let i = 0; i < count; i++) {
    if (!words.every((word) => haystack[i].includes(word))) continue;
    const against = asked.filter((field) => String(value(field, i)) !== state[field]);
    if (against.length === 0) found.push(i);
    for (const field of FACETS) {
      if (against.length === 0 || (against.length === 1 && against[0] === field)) {
        const own = String(value(field, i));
        counts[field].set(own, (counts[field].get(own) ?? 0) + 1);
      }
    }
  }
  return { found, counts };
}

/** The order of two values; what is not known comes last. */
function compare(a, b) {
  if (a === null || b === null) return (a === null) - (b === null);
  return typeof a === "number" ? a - b : a < b ? -1 : a > b ? 1 : 0;
}

function sorted(found) {
  const down = state.sort.startsWith("-");
  const field = state.sort.replace("-", "");
  if (!HEADS.some(([name]) => name === field)) return found.sort((i, j) => CATALOG.order[i] - CATALOG.order[j]);
  return found.sort((i, j) => {
    const [a, b] = [value(field, i), value(field, j)];
    const order = compare(a, b);
    return (down && a !== null && b !== null ? -order : order) || CATALOG.order[i] - CATALOG.order[j];
  });
}

/** The text of an architecture with lines under its motors. */
function notation(text) {
  const nodes = text.replaceAll("Pi", "Π").split(/(.)\*/u).map((part, i) => {
    if (i % 2 === 0) return document.createTextNode(part);
    const motor = document.createElement("u");
    motor.textContent = part;
    return motor;
  });
  const whole = document.createElement("span");
  whole.append(...nodes);
  return whole;
}

/** Content of a cell. */
function content(field, i) {
  const own = value(field, i);
  switch (field) {
    case "order": {
      if (!CATALOG.drawn?.[CATALOG.page[i]]) return [];
      const image = document.createElement("img");
      Object.assign(image, { src: `d/${CATALOG.pages[CATALOG.page[i]]}.svg`, alt: "", width: 104, height: 78, loading: "lazy" });
      return [image];
    }
    case "notation": {
      const link = document.createElement("a");
      link.href = `p/${CATALOG.pages[CATALOG.page[i]]}.html#${CATALOG.name[i]}`;
      link.append(own ? notation(own) : "not drawn");
      const word = document.createElement("code");
      word.textContent = CATALOG.key[i];
      const known = document.createElement("small");
      known.textContent = value("alias", i) ?? "";
      return [link, known, word];
    }
    case "hidden": return own === null ? [] : [notation(own)];
    case "dof": return own === null ? [] : [`${own} (${value("motion", i)})`];
    case "verdict": return [own ?? "refused"];
    case "fewest": return own ? [`${own} of ${value("legs", i)}`] : [];
    case "base": return own === null ? [] : [BASE[own]];
    default: return [own];
  }
}

function row(i) {
  const made = document.createElement("tr");
  for (const [field, head] of HEADS) {
    const cell = document.createElement("td");
    cell.dataset.field = field;
    if (!["notation", "order"].includes(field)) cell.dataset.head = head;
    if (field === "verdict") cell.className = (value(field, i) ?? "refused").split(" ")[0];
    cell.append(...content(field, i));
    made.append(cell);
  }
  return made;
}

/** The choices of each filter, with how many records each would leave. */
function choices(counts) {
  for (const field of FACETS) {
    const options = [new Option("any", "")];
    const column = CATALOG[field];
    const known = Array.isArray(column) ? [...new Set(column)].filter((own) => own !== null).sort(compare) : column.values;
    for (const own of known) {
      options.push(new Option(`${field === "base" ? BASE[own] : own} (${said(counts[field].get(String(own)) ?? 0)})`, own));
    }
    if (field === "verdict" && CATALOG.refused.values.length) {
      options.push(new Option(`refused (${said(counts[field].get("null") ?? 0)})`, "null"));
    }
    form.elements[field].replaceChildren(...options);
    form.elements[field].value = state[field];
  }
}

/** Mark the sorting heading, for screen readers too. */
function headings() {
  for (const head of document.querySelectorAll("#list th")) {
    const [field, down] = [state.sort.replace("-", ""), state.sort.startsWith("-")];
    const own = head.dataset.field === field;
    if (own) head.setAttribute("aria-sort", down ? "descending" : "ascending");
    else head.removeAttribute("aria-sort");
    head.querySelector("span").textContent = own ? (down ? " ▼" : " ▲") : "";
  }
}

function draw() {
  const { found, counts } = fitting();
  const pages = Math.max(1, Math.ceil(found.length / PAGE));
  state.page = Math.min(state.page, pages);
  const start = (state.page - 1) * PAGE;
  document.querySelector("#list tbody").replaceChildren(...sorted(found).slice(start, start + PAGE).map(row));
  choices(counts);
  headings();
  element("count").textContent = `${said(found.length)} of ${said(count)} architectures`;
  element("place").textContent = `page ${said(state.page)} of ${said(pages)}`;
  element("before").disabled = state.page === 1;
  element("after").disabled = state.page === pages;
  write();
}

function change(given) {
  Object.assign(state, { page: 1 }, given);
  draw();
}

function turn(by) {
  change({ page: state.page + by });
  element("list").scrollIntoView();
}

function start() {
  for (const [field, head] of HEADS) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(head, document.createElement("span"));
    button.addEventListener("click", () => change({ sort: state.sort === field ? `-${field}` : field }));
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.dataset.field = field;
    cell.append(button);
    document.querySelector("#list thead tr").append(cell);
  }
  let waiting = 0;
  form.q.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => change({ q: form.q.value.trim() }), 120);
  });
  for (const field of FACETS) form.elements[field].addEventListener("change", (event) => change({ [field]: event.target.value }));
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => change(Object.fromEntries([["q", ""], ["sort", ""], ...FACETS.map((field) => [field, ""])])));
  element("before").addEventListener("click", () => turn(-1));
  element("after").addEventListener("click", () => turn(1));
  addEventListener("hashchange", open);
  open();
}

function open() {
  read();
  form.q.value = state.q;
  draw();
}

start();
