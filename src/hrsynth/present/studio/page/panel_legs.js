"use strict";
/* Observed legs: the verdict, unobserved dof, the hidden robot, the smallest sets. */

class LegsPanel extends Panel {
  constructor(studio) {
    super(studio, "legs", "Legs");
    this.legs = element("fieldset", { className: "legs" });
    this.verdict = element("div", { className: "verdict", "aria-live": "polite" });
    this.lost = element("div", { className: "lost" });
    this.player = new Player((frame) => studio.draw(frame), { loop: true, reduced: studio.reduced });
    this.played = element("p", { className: "played" });
    this.hidden = element("div", { className: "hidden-robot" });
    this.sets = element("div", { className: "sets" });
    this.camera = element("div");
    this.body.append(this.legs, this.verdict, this.lost, this.player.root, this.played, this.hidden, this.sets, this.camera);
  }

  opened(scene) {
    this.legs.replaceChildren(element("legend", { textContent: "Observed legs" }), ...scene.legs.map((leg) => this.row(leg)));
    this.camera.replaceChildren(this.cameras(scene));
    for (const part of [this.verdict, this.lost, this.hidden, this.sets]) part.replaceChildren();
    this.stop();
    this.same.show(null);
    this.refresh();
  }

  row({ name, words, can, why, watched, link }) {
    const row = tick(name, watched, () => this.chosen());
    const input = row.querySelector("input");
    Object.assign(input, { value: name, disabled: !can });
    row.append(element("small", { textContent: can ? `${words}, observed at ${link}` : `${words}: ${why}` }));
    return row;
  }

  /* The link that carries the camera: a change opens the robot anew. */
  cameras({ machines: [{ links }] }) {
    const { studio } = this, [base, ...others] = links;
    return choice("The camera is on", [["", base], ...others.map((link) => [link, link])], studio.camera ?? "",
      (link) => studio.open(studio.robot, { watch: studio.seen, camera: link || null }));
  }

  boxes() { return [...this.legs.querySelectorAll("input")]; }

  /* A leg is ticked, or clicked in the 3D view. */
  chosen() {
    const names = this.boxes().filter(({ checked }) => checked).map(({ value }) => value);
    this.studio.rewatch(names);
  }

  toggle(name) {
    const box = this.boxes().find(({ value, disabled }) => value === name && !disabled);
    if (box) { box.checked = !box.checked; this.chosen(); }
  }

  rewatched(names) {
    this.boxes().forEach((box) => { box.checked = names.includes(box.value); });
    this.refresh();
  }

  /* The unobserved dof depend on the pose: requested when the panel is shown. */
  settled() {
    this.stale = true;
    this.entered();
  }

  async refresh() {
    this.stale = false;
    const found = await this.ask("watch", "Deriving the hidden robot");
    if (!found) return;
    this.found = found;
    this.studio.judge(found.error);
    this.tell(found);
    this.studio.rehide(found.hidden);
    this.entered();
    this.same.show(found);
  }

  tell({ verdict, rank, dof, here, lost, hidden_words: hidden, condition, sets, more_sets: more, error }) {
    const good = verdict.controllable;
    const line = (words, more = {}) => (words ? element("p", { textContent: words, ...more }) : null);
    this.verdict.className = `verdict ${!good ? "bad" : rank < dof ? "elsewhere" : "good"}`;
    this.verdict.replaceChildren(
      element("p", { className: "head" }, element("b", { textContent: verdict.words })), line(verdict.certainty.replace(`${verdict.words}, `, "")) ?? "",
      line(`At this pose ${rank} of ${dof} dof are observed${here ? `: ${here}` : ""}.`, { className: good && rank < dof ? "wrong" : "" }), ...[line(error?.words)].filter(Boolean));
    const head = lost.length ? [element("h3", { textContent: "Unobserved dof" })] : [];
    this.lost.replaceChildren(...head, ...lost.map(({ words }, i) =>
      element("div", { className: "row" }, element("span", { textContent: words }), button("Play", () => this.play(i), { "aria-label": `Play: ${words}` }))));
    this.hidden.replaceChildren(...(hidden ? [element("h3", { textContent: "Hidden robot" }), line(hidden)] : []),
      ...(condition ? [element("h3", { textContent: "Type 2 singularities" }), line(condition)] : []));
    this.sets.replaceChildren(...(sets?.length ? [element("h3", { textContent: "Smallest sets of legs" })] : []),
      ...(sets || []).map(({ legs, words }) => element("div", { className: "row" },
        button(legs.join(", "), () => this.studio.rewatch(legs), { "aria-label": `Observe ${legs.join(", ")}` }), element("span", { textContent: words }))),
      ...[line(more ? `and ${more} more; the command legs lists all` : "")].filter(Boolean));
  }

  async play(index) {
    this.stop();
    const found = await this.ask("play", "Moving along the unobserved twist", { lost: index, hidden: this.studio.sees });
    if (!found) return;
    this.played.textContent = found.words;
    this.player.load(found.frames, LegsPanel.SECONDS);
    this.player.play();
  }

  stop() {
    this.player.load([], 1);
    this.played.textContent = "";
    if (this.studio.state) this.studio.draw(this.studio.state);
  }

  entered() {
    if (!this.studio.isShown(this.key)) return;
    if (this.stale) this.refresh();
    this.studio.stage.lost(this.found?.lost || []);
    this.studio.stage.ellipsoid(this.found?.ellipsoid || null);
    this.studio.relegend();
  }

  left() {
    this.stop();
    this.studio.stage.lost([]);
    this.studio.stage.ellipsoid(null);
  }
}
LegsPanel.SECONDS = 3;  /* duration of the motion along an unobserved twist, back and forth */
