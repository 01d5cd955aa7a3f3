"use strict";
/* Robot, legs, camera, pose and panel as the part of an address after its #. */
const Bookmark = {
  /* That of the page as it stands; at the zero configuration without a pose. */
  of({ scene, seen, camera, here, zero, tabs }, panel = tabs.chosen) {
    const { source, options } = scene.link, fields = new URLSearchParams({ robot: source, legs: seen.join(","), panel });
    if (Object.keys(options).length) fields.set("options", JSON.stringify(options));
    if (camera) fields.set("camera", camera);
    if (here && String(here.q) !== zero) fields.set("pose", here.q.join(","));
    return `#${fields}`.replaceAll("%2C", ",").replaceAll("%3A", ":");
  },

  /* What an address, or its part after #, holds; null for other parts of the page. */
  read(address) {
    const part = address.slice(address.indexOf("#") + 1), fields = new URLSearchParams(part);
    if (!part.includes("=")) return null;
    const [legs, pose, options] = ["legs", "pose", "options"].map((name) => fields.get(name));
    return { source: fields.get("robot") ?? "", options: Bookmark.json(options), panel: fields.get("panel"), camera: fields.get("camera"),
      watch: legs === null ? null : legs.split(",").filter(Boolean),
      here: pose === null ? null : { q: pose.split(",").map((number) => (number.trim() ? Number(number) : NaN)), hidden: null } };
  },

  /* The value that a text holds; a wrong text is refused by the program. */
  json(text) { try { return JSON.parse(text) ?? {}; } catch { return text; } },
};
