"use strict";
/* Connection of a saved page: it answers from stored configurations, in which one coordinate of the platform differs
   from the zero configuration. `here` is the value of a slider, null at the zero configuration. */

class Kept {
  constructor(record, { onstart }) {
    this.record = record;
    this.values = record.sliders.map(({ home }) => home);
    queueMicrotask(() => onstart({ start: { source: "kept" }, panels: false, watch: null, camera: null, hidden: false }));
  }

  async ask(kind, fields) { return this[kind](typeof fields === "function" ? fields() : fields); }

  cancel() {}

  open() { return this.record; }

  modes() { return { modes: this.record.ghosts, words: "" }; }

  /* Only the slider that was moved keeps its value: all others return to the zero configuration. */
  move({ values, here }) {
    const { sliders, state } = this.record, moved = values ? values.findIndex((value, i) => value !== this.values[i]) : -1;
    const gone = moved >= 0 && { slider: moved, value: sliders[moved].values.indexOf(values[moved]) };
    const at = moved < 0 ? here : values[moved] === sliders[moved].home ? null : gone;
    this.values = sliders.map((slider, i) => at?.slider === i ? slider.values[at.value] : slider.home);
    return { state: at ? sliders[at.slider].states[at.value] : state, here: at, values: this.values, stopped: false };
  }
}
