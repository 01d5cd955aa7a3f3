"use strict";
/* Small pieces of a page. Nothing here writes markup: text is always text. */

/* An element with its fields, attributes (`aria-…`, `data-…`, `role`, `for`) and children. */
function element(kind, fields = {}, ...children) {
  const made = document.createElement(kind);
  for (const [name, value] of Object.entries(fields)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.includes("-") || name === "role" || name === "for") made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

function button(words, onclick, fields = {}) {
  return element("button", { type: "button", textContent: words, onclick, ...fields });
}

let ids = 0;
const fresh = (stem) => `${stem}-${(ids += 1)}`;

/* A choice with its label; `options` are [value, words]. */
function choice(words, options, chosen, onchange) {
  const id = fresh("choice");
  const list = element("select", { id }, ...options.map(([value, text]) => element("option", { value, textContent: text })));
  list.value = chosen;
  list.onchange = () => onchange(list.value);
  return element("div", { className: "field" }, element("label", { for: id, textContent: words }), list);
}

/* Radio buttons that exclude each other; `options` are [value, words]. */
function radios(words, options, chosen, onchange) {
  const name = fresh("radios");
  const group = element("fieldset", { className: "radios" }, element("legend", { textContent: words }));
  for (const [value, text] of options) {
    const input = element("input", { type: "radio", name, value, checked: value === chosen });
    input.onchange = () => onchange(value);
    group.append(element("label", {}, input, element("span", { textContent: text })));
  }
  return group;
}

/* A switch: a box to tick with its words. */
function tick(words, checked, onchange) {
  const input = element("input", { type: "checkbox", checked });
  input.onchange = () => onchange(input.checked);
  return element("label", { className: "tick" }, input, element("span", { textContent: words }));
}

/* A number in the unit that people read: degrees for radians. */
function written(value, unit) {
  if (value === null || value === undefined) return "";
  const words = unit === "rad" ? `${(value * 180 / Math.PI).toFixed(1)}°` : `${value.toFixed(4)}\u00a0${unit}`;
  return words.replace(/^-(?=0\.0+[^0-9])/, "");
}

/* The number that a text gives, as `written` writes it; NaN for any other text. */
function parsed(text, unit) {
  const number = text.trim().replace("−", "-").replace(unit === "rad" ? /\s*(°|deg)$/ : /\s*m$/, "");
  return number === "" ? NaN : Number(number) * (unit === "rad" ? Math.PI / 180 : 1);
}

/* A slider with its label and its value, one of `values` if there are any; any other value with a unit can be typed.
   `read` sets it without a call of `onmove`. */
class Slider {
  constructor({ label, unit, min, max, value, steps = 200, values }, onmove, onset = () => {}) {
    Object.assign(this, { label, unit, min, max, values });
    const id = fresh("slider"), typed = unit && !values;
    this.input = element("input", { type: "range", id });
    Object.assign(this.input, values ? { max: values.length - 1 } : { min, max, step: unit ? (max - min) / steps || 1e-6 : 1 });
    this.output = typed ? element("input", { type: "text", className: "typed", "aria-label": `${label}: value`, autocomplete: "off", spellcheck: false, size: 9 })
      : element("output", { for: id });
    this.wrong = typed ? element("p", { role: "alert", className: "wrong", id: fresh("wrong") }) : null;
    this.root = element("div", { className: "slider" }, element("label", { for: id, textContent: label }), this.output, this.input, this.wrong);
    this.input.oninput = () => { const at = Number(this.input.value); this.told(values ? values[at] : at); onmove(this.value); };
    this.input.onchange = () => onset(this.value);
    this.output.oninput = () => { this.typing = true; };
    this.output.onchange = () => { if (this.take()) { onmove(this.value); onset(this.value); } };
    this.read(value);
  }

  /* Take the typed number, an end of the range where it is written like that; in one line why not. */
  take() {
    const { label, unit, min, max, output } = this, text = output.value.trim(), value = parsed(text, unit);
    const inside = [min, max].find((end) => written(value, unit) === written(end, unit)) ?? (value >= min && value <= max ? value : NaN);
    if (Number.isNaN(inside)) this.fail(`${label}: got ${text || "nothing"}, expected a number from ${written(min, unit)} to ${written(max, unit)}`);
    else { this.typing = false; this.read(inside); }
    return !Number.isNaN(inside);
  }

  /* One line below it. */
  fail(words) {
    if (!this.wrong) return;
    this.wrong.textContent = words;
    this.output.setAttribute("aria-invalid", Boolean(words));
    this.output.setAttribute("aria-describedby", this.wrong.id);
  }

  read(value) {
    this.input.value = this.values ? this.values.indexOf(value) : value;
    this.told(value);
  }

  /* The value itself: what was read may lie between the steps of the input. A text that is being typed stays. */
  told(value) {
    this.value = value;
    const words = this.unit ? written(value, this.unit) : String(value);
    this.input.setAttribute("aria-valuetext", words);
    if (this.typing && document.activeElement === this.output) return;
    this.typing = false;
    this.output.value = words;
    this.fail("");
  }
}

/* Texts by their keys and names, each with a button that copies it: the command and the Python line that give the same. */
class Same {
  constructor(title = "Command and Python line", rows = [["command", "command"], ["python", "Python line"]]) {
    this.root = element("details", { className: "same", hidden: true }, element("summary", { textContent: title }));
    this.rows = rows.map(([key, name]) => this.row(key, name));
  }

  row(key, name) {
    const code = element("code"), copied = element("span", { className: "copied", role: "status" });
    const copy = button("Copy", () => this.copy(code, copied), { "aria-label": `Copy the ${name}` });
    const root = element("div", { className: "line" }, code, copy, copied);
    this.root.append(root);
    return { key, code, root };
  }

  async copy(code, copied) {
    const done = await navigator.clipboard.writeText(code.textContent).then(() => true, () => false);
    if (!done) getSelection().selectAllChildren(code);
    copied.textContent = done ? "Copied." : "Marked: copy it with Ctrl+C.";
    setTimeout(() => { copied.textContent = ""; }, 2500);
  }

  show(answer) {
    for (const { key, code, root } of this.rows) {
      code.textContent = answer?.[key] || "";
      root.hidden = !answer?.[key];
    }
    this.root.hidden = this.rows.every(({ root }) => root.hidden);
  }
}

/* One line for progress, with a button that cancels, or for an error. */
class Status {
  constructor() {
    this.words = element("span", { role: "status" });
    this.wrong = element("span", { role: "alert", className: "wrong" });
    this.stop = button("Cancel", () => this.ondrop?.(), { hidden: true, className: "small" });
    this.root = element("p", { className: "status" }, this.words, this.wrong, this.stop);
  }

  /* Show `words` while a promise is pending, once that takes a moment; the promise's error is shown and swallowed. */
  async during(promise, words, ondrop) {
    const turn = (this.turn = {});
    const started = performance.now();
    this.clear();
    this.ondrop = ondrop;
    const told = () => {
      if (this.turn !== turn) return;
      const seconds = Math.round((performance.now() - started) / 1000);
      this.words.textContent = seconds < 2 ? `${words} …` : `${words} … ${seconds} s`;
      this.stop.hidden = !ondrop;
    };
    const clock = [setTimeout(told, Status.QUIET), setInterval(told, Status.TICK)];
    const over = () => { clock.forEach(clearTimeout); if (this.turn === turn) this.clear(); };
    try {
      const answer = await promise;
      over();
      return answer;
    } catch (error) {
      over();
      if (this.turn === turn) this.fail(error.message);
      return null;
    }
  }

  clear() {
    this.words.textContent = this.wrong.textContent = "";
    this.stop.hidden = true;
  }

  say(words) {
    this.clear();
    this.words.textContent = words;
  }

  fail(words) {
    this.clear();
    this.wrong.textContent = words;
  }
}
Status.QUIET = 300;   /* ms after which an ask is slow */
Status.TICK = 2000;   /* ms between two words on how long it takes */
