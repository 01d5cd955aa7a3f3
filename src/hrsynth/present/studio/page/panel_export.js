"use strict";
/* Export: the page, the image, the report, the figure, the robot file. */

class ExportPanel extends Panel {
  constructor(studio) {
    super(studio, "export", "Export");
    const offers = [["page", "Page", "the robot in 3D with sliders, one file that needs no network"],
      ["report", "Report", "the derivation step by step, for reading and printing"],
      ["figure", "Figure", "robot and hidden robot side by side, for a paper"],
      ["robot", "Robot file", "the robot as read, in the format of hrsynth"]];
    this.body.append(element("ul", { className: "offers" },
      this.offer("Image", "the present 3D view (PNG)", () => this.picture()),
      ...offers.map(([kind, name, words]) => this.offer(name, words, () => this.fetch(kind, name)))));
    this.link = new Same("Link to this robot with its legs and pose", [["link", "link"]]);
    this.body.append(this.link.root);
  }

  /* The link leads to the panel before this one. */
  entered() { if (this.studio.scene) this.link.show({ link: Bookmark.of(this.studio, this.studio.tabs.before ?? "move") }); }

  settled() { this.entered(); }

  rewatched() { this.entered(); }

  offer(name, words, onclick) {
    return element("li", { className: "row" }, button(name, onclick, { "aria-label": `Save: ${name}` }), element("span", { textContent: words }));
  }

  opened(scene) {
    this.same.show(scene);
    this.entered();
  }

  async picture() {
    const blob = await this.studio.stage.picture();
    this.save(blob, `${this.studio.scene.name}.png`);
  }

  async fetch(kind, name) {
    const found = await this.ask("export", `Making the ${name.toLowerCase()}`, { kind });
    if (!found) return;
    const bytes = Uint8Array.from(atob(found.base64), (c) => c.charCodeAt(0));
    this.save(new Blob([bytes], { type: found.type }), found.name);
    if (found.command) this.same.show(found);
  }

  save(blob, name) {
    const address = URL.createObjectURL(blob);
    const link = element("a", { href: address, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
    this.status.say(`Saved as ${name}.`);
  }
}
