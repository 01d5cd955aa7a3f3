"use strict";
/* Choice of the robot: the gallery, the files of the folder, dropped files; assumptions of reading them. */

class RobotPanel extends Panel {
  constructor(studio) {
    super(studio, "robot", "Robot");
    this.guesses = element("details", { className: "guesses", hidden: true });
    this.notes = element("ul", { className: "notes" });
    this.files = element("div", { className: "files" });
    this.gallery = element("ul", { className: "gallery", "aria-label": "Shipped robots" });
    this.mine = new Map();
    const input = element("input", { type: "file", multiple: true, id: fresh("file") });
    input.onchange = () => { this.drop.after(this.status.root); this.take([...input.files]); input.value = ""; };
    this.drop = element("div", { className: "drop" },
      element("label", { for: input.id, textContent: "Drop a robot file here, with its meshes if it has any, or choose one" }), input);
    const link = element("input", { type: "text", id: fresh("link"), autocomplete: "off", placeholder: "#robot=…" });
    link.onchange = () => { if (link.value) this.studio.restore(Bookmark.read(link.value) ?? { source: link.value }); };
    this.sent = element("div", { className: "field" }, element("label", { for: link.id, textContent: "Open a link" }), link);
    this.body.append(this.drop, this.status.root, this.files, this.sent, this.guesses, this.notes, element("h3", { textContent: "Shipped robots" }), this.gallery);
    for (const [name, over] of [["dragover", true], ["dragleave", false], ["drop", false]])
      document.addEventListener(name, (event) => this.dragged(event, over));
  }

  /* A file may be dropped anywhere on the page; what becomes of it is shown there: in the 3D view, or below the place for files. */
  dragged(event, over) {
    if (![...(event.dataTransfer?.types || [])].includes("Files")) return;
    event.preventDefault();
    this.drop.classList.toggle("over", over && event.relatedTarget !== null);
    if (event.type !== "drop") return;
    this.studio.show("robot");
    if ($("sight").contains(event.target)) $("sight").append(this.status.root);
    else this.drop.after(this.status.root);
    this.drop.scrollIntoView({ block: "nearest" });
    this.take([...event.dataTransfer.files]);
  }

  /* The gallery, and the files of the folder. */
  async fill() {
    const found = await this.ask("gallery", "Searching for robots");
    if (!found) return;
    this.gallery.replaceChildren(...found.robots.map((robot) => this.card(robot)));
    this.folder = found.files;
    this.list();
  }

  card({ source, name, title, words, picture }) {
    const image = element("img", { alt: "", src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(picture)}` });
    const card = button("", () => this.studio.open({ source, options: {} }), { className: "card", "data-source": source });
    card.append(image, element("b", { textContent: title || name }), element("span", { textContent: words }));
    return element("li", {}, card);
  }

  list() {
    const files = [...[...this.mine.keys()].filter(RobotPanel.isRobot).map((name) => [`file:${name}`, name]),
      ...(this.folder || []).map((name) => [`folder:${name}`, name])];
    this.files.replaceChildren(...files.map(([source, name]) =>
      button(name, () => this.studio.open({ source, options: {} }), { className: "file", "data-source": source })));
    this.mark();
  }

  mark() {
    for (const each of this.root.querySelectorAll("[data-source]"))
      each.setAttribute("aria-current", each.dataset.source === this.studio.robot?.source);
  }

  /* Upload files, and open the first that may be a robot. */
  async take(files) {
    const names = [];
    for (const file of files) {
      const name = await this.status.during(this.studio.link.upload(file), `Uploading ${file.name}`);
      if (!name) return;
      this.mine.set(name, file);
      names.push(name);
    }
    this.list();
    const robots = names.filter(RobotPanel.isRobot), robot = robots.find((name) => !/ya?ml$/i.test(name)) ?? robots[0];
    if (robot) await this.studio.open({ source: `file:${robot}`, options: {} });
    else if (names.length) this.status.say(`${names.join(", ")}: stored for the robot file that names ${names.length > 1 ? "them" : "it"}.`);
  }

  /* After an interruption the server has a new folder for this tab: dropped files are sent again. */
  async again() {
    for (const file of this.mine.values()) await this.studio.link.upload(file).catch((error) => this.status.fail(error.message));
  }

  opened(scene) {
    this.guessed(scene, this.studio.robot);
    this.notes.replaceChildren(...(scene.notes || []).map((note) => element("li", { textContent: note })));
    this.same.show(scene);
    this.mark();
  }

  /* A file that makes no robot: the reason, and the assumptions that can be changed. */
  failed(record, robot) {
    if (!record) return;
    this.studio.show("robot");
    this.guessed(record, robot);
    this.status.fail(`${record.name}: ${record.failed}`);
  }

  /* The assumptions of reading a file: open if the file was just added. */
  guessed({ guesses, dialect, failed }, robot) {
    this.guesses.hidden = !guesses?.length;
    this.guesses.open = Boolean(failed) || /^(file|folder):/.test(robot.source);
    this.guesses.replaceChildren(element("summary", { textContent: `Assumptions of reading the file (${dialect})` }),
      element("p", { textContent: "Change an entry that is wrong; the robot is then read again." }),
      ...(guesses || []).map((guess) => this.guess(guess, robot)));
  }

  /* An assumption: another choice opens the robot anew. */
  guess({ name, found, why, candidates }, robot) {
    const id = fresh("why"), now = JSON.stringify(found);
    const words = (value) => (value === true ? "yes" : value === false ? "no" : Array.isArray(value) ? value.join(", ") || "none" : String(value));
    const options = [...new Map([found, ...(candidates || [])].map((value) => [JSON.stringify(value), words(value)]))];
    const field = choice(name.replaceAll("_", " "), options, now, (value) =>
      this.studio.open({ source: robot.source, options: { ...robot.options, [name]: JSON.parse(value) } }));
    field.querySelector("select").setAttribute("aria-describedby", id);
    field.append(element("small", { id, textContent: why }));
    return field;
  }
}
RobotPanel.isRobot = (name) => /\.(urdf|xacro|xml|mjcf|sdf|world|usd[acz]?|ya?ml)$/i.test(name);
