"use strict";
/* Base of all panels: a heading, a line for progress and errors, the command and the Python line. */

class Panel {
  constructor(studio, key, title) {
    Object.assign(this, { studio, key, title });
    this.body = element("div", { className: "body" });
    this.status = new Status();
    this.same = new Same();
    this.root = element("section", { className: `panel panel-${key}` },
      element("h2", { textContent: title }), this.body, this.status.root, this.same.root);
  }

  /* Request an analysis of the robot as it stands; null without a result, or if other legs are observed meanwhile. */
  async ask(kind, words, fields = {}, channel = kind) {
    const { studio } = this, { robot, watch } = studio;
    const answer = await this.status.during(studio.link.ask(kind, { ...studio.asked(), ...fields }, channel), words,
      () => studio.link.cancel(channel));
    return robot === studio.robot && watch === studio.watch ? answer : null;
  }

  /* Events: panel shown or left; another robot; another pose; other observed legs; motion ended; Escape. */
  entered() {}
  left() {}
  opened() {}
  moved() {}
  rewatched() {}
  settled() {}
  stop() {}
}
