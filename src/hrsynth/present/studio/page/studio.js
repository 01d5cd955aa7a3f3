"use strict";
/* The page: robot, observed legs, configuration; panels request and show, the stage draws. */

const $ = (id) => document.getElementById(id);

class Studio {
  constructor() {
    this.reduced = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stage = new Stage($("pane"), { reduced: this.reduced, over: [$("tools"), $("now")] });
    this.stage.onpick = (kind, name) => { if (kind === "leg") this.panels.legs?.toggle(name); };
    const kept = $("kept"), to = { onstart: (said) => this.begin(said), onback: () => this.back(), onlost: (refused) => this.lost(refused) };
    this.link = kept ? new Kept(JSON.parse(kept.textContent), to) : new Link(to);
    this.pending = 0;
    this.opening = 1;  /* robots that are being read, and the connection */
    this.early = new Set();
    document.addEventListener("click", (event) => this.defer(event), true);
    this.tools();
    $("legend").open = !matchMedia("(max-width: 760px)").matches;
    document.addEventListener("keydown", (event) => { if (event.key === "Escape") this.stop(); });
  }

  begin({ start, panels, watch, camera, hidden }) {
    const kinds = panels ? [RobotPanel, MovePanel, LegsPanel, ModesPanel, PlanePanel, ServoPanel, ExportPanel] : [MovePanel, ModesPanel, SightsPanel];
    const made = kinds.map((Kind) => new Kind(this));
    this.panels = Object.fromEntries(made.map((panel) => [panel.key, panel]));
    document.body.classList.toggle("plain", !panels);
    if (panels) this.tabs = new Tabs($("panels"), made, (key, before) => { this.panels[before]?.left(); this.panels[key].entered(); this.keep(); });
    else $("panels").append(...made.map(({ root }) => root));
    this.show(start ? "move" : "robot");
    this.panels.robot?.fill();
    const wanted = this.tabs && Bookmark.read(location.hash);
    if (this.tabs) addEventListener("hashchange", () => this.restore(Bookmark.read(location.hash)));
    if (wanted) this.restore(wanted, () => start && this.open(start, { watch, camera, hidden }));
    else if (start) this.open(start, { watch, camera, hidden });
    else { this.kept(); this.ready(); }
    this.act();
  }

  /* Open what a link holds; `otherwise` where its robot is not opened. */
  async restore(wanted, otherwise = () => {}) {
    if (!wanted) return;
    const { source, options, panel, ...more } = wanted, { scene: before, panels, tabs: { chosen } } = this, { status } = panels.robot;
    await this.open({ source, options }, { ...more, link: true });
    const words = this.scene === before ? status.wrong.textContent : panel && !(panel in panels) ? `panel: got ${panel}, expected ${Object.keys(panels).join(", ")}` : "";
    if (this.scene === before) {
      status.clear();
      await otherwise();
    }
    this.show(panel in panels ? panel : this.scene ? chosen : "robot");
    if (words) this.notice(words);
    this.keep();
  }

  /* Request the scene of a robot; of a link without what is refused: its pose, its legs and camera, or both. */
  async request(asked, link) {
    const bare = { watch: null, camera: null };
    let refused = null;
    for (const less of link ? [{}, { here: null }, bare, { ...bare, here: null }] : [{}]) {
      const fields = { ...asked, ...less };
      const scene = await this.link.ask("open", fields).catch((error) => ({ failed: error.message, error }));
      if (scene?.failed) { refused ??= scene; continue; }
      this.notice(refused?.failed);
      return scene && { ...scene, asked: fields };
    }
    if (refused.error) throw refused.error;
    return refused;
  }

  /* One line on what is wrong with a link. */
  notice(words) {
    $("lost-link").hidden = !words;
    $("lost-link").textContent = words ? `The link is not restored as a whole. ${words}` : "";
  }

  /* The address holds what is shown. */
  keep() {
    if (this.tabs && this.scene) history.replaceState(null, "", Bookmark.of(this));
  }

  /* A click on what needs a robot waits while one is being read. */
  defer(event) {
    const what = event.target.closest(":is(#tools, .panel:not(.panel-robot) .body) :is(button, [type=checkbox], [type=radio])");
    const panel = Object.values(this.panels ?? {}).find(({ root }) => root.contains(what));
    if (!what || (!this.opening && (this.scene || !panel))) return;
    event.preventDefault();
    event.stopPropagation();
    if (!this.opening) return void panel.status.fail("No robot is open. Choose one in the panel Robot.");
    this.early.add(what);
    panel?.status.say("This starts once the robot is read.");
  }

  /* One robot less is being read: after the last one, what was clicked before acts. */
  act() {
    this.opening -= 1;
    if (this.opening) return;
    const clicked = [...this.early];
    this.early.clear();
    for (const panel of Object.values(this.panels)) if (clicked.some((what) => panel.root.contains(what))) panel.status.clear();
    for (const what of clicked) if (what.isConnected && !what.closest("[hidden]:not(.panel)")) what.click();
  }

  ready() { requestAnimationFrame(() => { document.body.dataset.ready = "yes"; }); }

  /* The connection is interrupted; it is back, with an empty folder for this tab. */
  lost(refused) {
    $("lost-link").hidden = false;
    $("lost-link").textContent = refused || "The connection to hrsynth is interrupted. Reconnecting … If you have stopped it, start it again and open the address that it prints.";
  }

  async back() {
    await this.panels.robot?.again();
    $("lost-link").hidden = true;
    this.say("Connected again.");
  }

  show(key) { if (this.tabs) this.tabs.choose(key); }

  isShown(key) { return this.tabs ? this.tabs.chosen === key : key in this.panels; }

  each(what, ...more) { Object.values(this.panels).forEach((panel) => panel[what](...more)); }

  say(words) { $("said").textContent = words; }

  /* Fields of each request. */
  asked() {
    return { robot: this.robot, watch: this.seen, camera: this.camera, here: this.here };
  }

  /* Observed legs in requests: by legs, or by the links that were named when the robot was opened. */
  get seen() {
    return this.named ?? this.watch?.map((name) => this.scene.legs.find((leg) => leg.name === name)?.ask ?? name);
  }

  /* Another robot; the one that is shown stays until the new one is read. */
  async open(robot, wanted = {}) {
    this.opening += 1;
    await this.read(robot, wanted);
    this.act();
  }

  async read(robot, { watch = null, camera = null, here = null, hidden = false, link = false }) {
    const given = { source: robot.source, options: robot.options || {} };
    const { status } = this.panels.robot || this.panels.move;
    const scene = await status.during(this.request({ robot: given, watch, camera, here }, link), "Reading the robot", () => this.link.cancel("open"));
    this.ready();
    if (!scene || scene.failed) { this.kept(); this.panels.robot?.failed(scene, given); return; }
    const { asked } = scene;
    Object.assign(this, { robot: given, camera: asked.camera, scene, named: asked.watch, here: scene.here ?? null });
    this.zero = asked.here ? null : String(scene.here?.q);
    this.watch = scene.legs.filter(({ watched }) => watched).map(({ name }) => name);
    this.values = scene.values ?? scene.sliders.map(({ home }) => home);
    this.motors = scene.motors;
    this.settled = String(this.values);
    clearTimeout(this.rest);
    $("name").textContent = scene.name;
    $("words").textContent = scene.words;
    document.title = `${scene.name} – hrsynth studio`;
    this.stage.scene(scene);
    this.stage.watch(this.watch);
    this.hasHidden(scene.machines.length > 1);
    this.draw((this.state = scene.state));
    this.each("opened", scene);
    this.stage.fit();
    this.relegend();
    this.say(`${scene.name} is open: ${scene.words}.`);
    this.keep();
    this.answer();
    this.link.ask("move", this.asked(), "first").catch(() => {});  /* the process that moves it reads the robot now */
    if (hidden) this.reveal();
    else if (scene.machines.length > 1) this.overlay();
  }

  /* The hidden robot over the real one, where no panel asks for it. */
  async reveal() {
    const found = await this.panels.move.ask("watch", "Deriving the hidden robot");
    if (!found?.hidden) return;
    this.rehide(found.hidden);
    this.overlay();
  }

  overlay() {
    this.layouts.querySelector("input[value=overlay]").checked = true;
    this.arrange("overlay");
  }

  /* A robot that could not be opened: the present one stays, with its panel. */
  kept() {
    if (this.scene) this.panels.robot?.opened(this.scene);
    else { this.show("robot"); $("answer").textContent = "Choose a robot, or drop a robot file onto the page."; }
  }

  /* The summary, on top. */
  async answer() {
    if (!this.panels.robot) return;
    const { robot } = this;
    $("answer").textContent = "Computing which legs to observe …";
    $("answer-actions").replaceChildren();
    const found = await this.link.ask("answer", { robot, camera: this.camera }).catch((error) => ({ sentences: [error.message] }));
    if (!found || robot !== this.robot) return;
    $("answer").textContent = found.sentences.join(" ");
    if (!found.watch?.length) return;
    const same = new Same();
    same.show(found);
    $("answer-actions").replaceChildren(button(`Observe ${found.watch.join(", ")}`, () => this.rewatch(found.watch), { className: "small" }), same.root);
  }

  /* Move the platform; each answer is drawn; without a move for a moment, it has settled. */
  async move(fields) {
    this.pending += 1;
    this.moving = true;
    const ask = () => ({ ...this.asked(), hidden: this.sees, ...fields });
    const robot = this.robot;
    const answer = await this.link.ask("move", ask).catch((error) => { this.panels.move.refused(error.message); return null; });
    this.pending -= 1;
    this.moving = this.pending > 0;
    if (!answer || robot !== this.robot) return;
    this.arrive(answer);
  }

  arrive(answer) {
    Object.assign(this, { here: answer.here, values: answer.values, motors: answer.motors, state: answer.state });
    this.draw(answer.state);
    this.each("moved", answer);
    clearTimeout(this.rest);
    if (!this.moving) this.rest = setTimeout(() => this.settle(), Studio.REST);
  }

  /* Settled at another pose: results that depend on it are requested anew. */
  settle() {
    this.keep();
    if (String(this.values) === this.settled) return;
    this.settled = String(this.values);
    this.each("settled");
  }

  /* Go to a known configuration, animated unless motion is reduced. */
  async fly(places, here) {
    this.here = here;
    if (places && !this.reduced) await this.glide(this.state, { ...this.state, real: places });
    this.move({ here });
  }

  glide(from, to) {
    const began = performance.now();
    return new Promise((done) => {
      const step = (now) => {
        const part = Math.min(1, Math.max(0, now - began) / Studio.FLIGHT);
        this.stage.state({ ...to, real: to.real.map((place, i) => between(from.real[i], place, part)) });
        if (part < 1) requestAnimationFrame(step);
        else done();
      };
      requestAnimationFrame(step);
    });
  }

  rewatch(names) {
    Object.assign(this, { watch: names, named: null });
    this.stage.watch(names);
    this.judge(null);
    this.keep();
    this.each("rewatched", names);
  }

  /* Error of the platform here: unknown for other legs until it is requested. */
  judge(error) {
    this.state = { ...this.state, error };
    this.draw(this.state);
  }

  draw(state) {
    this.stage.state(state);
    const beyond = state.beyond?.length ? `beyond joint limits: ${state.beyond.join(", ")}` : "";
    const away = this.tabs || state.distance === null ? "" : `smallest singular value of Mᵀ ${state.distance?.toPrecision(3)}`;
    $("now").textContent = [state.error?.words, away, beyond].filter(Boolean).join("; ");
    $("now").hidden = !$("now").textContent;
    if (this.step !== state.error?.step) this.relegend();
    this.step = state.error?.step;
  }

  tools() {
    const layouts = [["real", "Robot"], ["hidden", "Hidden robot"], ["overlay", "Both, overlaid"], ["beside", "Side by side"]];
    this.layouts = radios("Shown", layouts, "real", (layout) => this.arrange(layout));
    $("tools").append(this.layouts, button("Fit", () => this.stage.fit(), { "aria-label": "Fit the robot into the view" }));
    this.hasHidden(false);
  }

  /* Another hidden robot (null: none): its configuration is unknown. */
  rehide(record) {
    this.state = { ...this.state, hidden: null };
    this.stage.hidden(record);
    this.hasHidden(Boolean(record));
  }

  /* Enable the layouts with a hidden robot if there is one; the choice stays. */
  hasHidden(there) {
    this.layouts.querySelectorAll("input").forEach((input) => { input.disabled = !there && input.value !== "real"; });
    if (there && this.sees) this.arrange(this.layout);
    else if (!there) this.stage.layout("real");
  }

  /* The hidden robot's poses come with the next state; then the view is fitted. */
  async arrange(layout) {
    this.layout = layout;
    this.sees = layout !== "real";
    if (this.sees) await this.move({});
    this.stage.layout(this.layout);
    this.stage.fit();
    this.relegend();
  }

  /* Fit the view to what was added or removed, unless it was rotated by hand. */
  refit() {
    if (!this.stage.sight?.turned) this.stage.fit();
    this.relegend();
  }

  relegend() {
    const entries = this.stage.legend().map(({ colour, words, now }) => {
      const swatch = element("i", { "aria-hidden": "true" });
      swatch.style.background = colour;
      return element("li", { "aria-current": now ? "true" : null }, swatch, now ? `${words} (here)` : words);
    });
    $("legend").querySelector("ul").replaceChildren(...entries);
    $("legend").hidden = !entries.length;
  }

  /* Escape: playback stops, the request of the visible panel is cancelled. */
  stop() {
    for (const panel of Object.values(this.panels || {})) if (this.isShown(panel.key)) {
      panel.stop();
      if (!panel.status.stop.hidden) panel.status.stop.click();
    }
  }
}
Studio.REST = 300;    /* ms without a move after which the robot has settled */
Studio.FLIGHT = 600;  /* ms of a flight to another mode */

/* A displacement (position, quaternion) between two others. */
function between(from, to, part) {
  const near = from.slice(3).reduce((sum, value, i) => sum + value * to[3 + i], 0) < 0 ? -1 : 1;
  const mixed = from.map((value, i) => (1 - part) * value + part * (i < 3 ? to[i] : near * to[i]));
  const size = Math.hypot(...mixed.slice(3));
  return mixed.map((value, i) => (i < 3 ? value : value / size));
}

try {
  window.studio = new Studio();
} catch (error) {
  $("pane").append(element("p", { className: "broken", textContent: `The 3D view needs WebGL: ${error.message}` }));
}
