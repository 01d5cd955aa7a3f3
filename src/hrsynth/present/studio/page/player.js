"use strict";
/* Frames that are played, paused and scrubbed. With reduced motion nothing runs by itself: the slider shows them. */

class Player {
  /* `show(frame, index)` draws one; `loop`: forth and back again until it is stopped. */
  constructor(show, { words = "Play", loop = false, reduced = false } = {}) {
    Object.assign(this, { show, words, loop, reduced, frames: [], at: 0 });
    this.toggle = button(words, () => (this.running ? this.pause() : this.play()));
    this.scrub = new Slider({ label: "Frame", unit: "", min: 0, max: 0, value: 0 }, (index) => { this.pause(); this.go(index); });
    this.root = element("div", { className: "player" }, this.toggle, this.scrub.root);
    this.root.hidden = true;
  }

  /* `seconds`: how long all of it takes. */
  load(frames, seconds) {
    this.pause();
    this.frames = frames;
    this.pace = frames.length / seconds;
    this.root.hidden = frames.length < 2;
    this.scrub.input.max = Math.max(0, frames.length - 1);
    this.toggle.hidden = this.reduced;
    if (frames.length) this.go(0);
  }

  go(index) {
    this.at = index;
    this.scrub.read(index);
    this.show(this.frames[index], index);
  }

  play() {
    if (this.reduced || this.frames.length < 2) return;
    this.running = true;
    this.toggle.textContent = "Pause";
    const first = this.at >= this.frames.length - 1 ? 0 : this.at, began = performance.now();
    const run = (now) => {
      if (!this.running) return;
      const place = first + Math.floor(this.pace * Math.max(0, now - began) / 1000), last = this.frames.length - 1;
      const index = this.loop ? place % (last + 1) : Math.min(place, last);
      if (index !== this.at) this.go(index);
      if (!this.loop && index === last) this.pause();
      else requestAnimationFrame(run);
    };
    requestAnimationFrame(run);
  }

  pause() {
    this.running = false;
    this.toggle.textContent = this.words;
  }
}
