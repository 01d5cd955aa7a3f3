"use strict";
/* What all panels share: a heading, a line for what is under way or wrong, the command and the Python line. */

class Panel {
  constructor(studio, key, title) {
    Object.assign(this, { studio, key, title });
    this.body = element("div", { className: "body" });
    this.status = new Status();
    this.same = new Same();
    this.root = element("section", { className: `panel panel-${key}` },
      element("h2", { textContent: title }), this.body, this.status.root, this.same.root);
  }

  /* Ask about the robot as it stands; null where nothing came of it, or where meanwhile other legs are watched. */
  async ask(kind, words, fields = {}, channel = kind) {
    const { studio } = this, { robot, watch } = studio;
    const answer = await this.status.during(studio.link.ask(kind, { ...studio.asked(), ...fields }, channel), words,
      () => studio.link.cancel(channel));
    return robot === studio.robot && watch === studio.watch ? answer : null;
  }

  /* The panel is looked at or no longer; another robot; another place; other legs; at rest; Escape. */
  entered() {}
  left() {}
  opened() {}
  moved() {}
  rewatched() {}
  settled() {}
  stop() {}
}
