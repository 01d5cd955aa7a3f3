"use strict";
/* Image of each camera, in its plane z = 1: x to the right, y down. */

class SightsPanel extends Panel {
  constructor(studio) {
    super(studio, "sights", "Images");
    this.root.hidden = true;
  }

  opened({ cameras = [], state }) {
    this.root.hidden = !cameras.length;
    this.pictures = cameras.map(({ name, half }) => {
      const canvas = element("canvas", { role: "img", width: 520, height: Math.round(520 * half[1] / half[0]) });
      this.body.append(element("figure", { className: "camera" }, canvas, element("figcaption", { textContent: `image of ${name}` })));
      return { name, canvas, scale: canvas.width / 2 / half[0] };
    });
    this.moved({ state });
  }

  moved({ state }) { this.pictures.forEach((each, i) => this.draw(each, (state.sights ?? []).filter(({ camera, image }) => camera === i && image.length))); }

  draw({ name, canvas, scale }, sights) {
    const { width, height } = canvas, pen = canvas.getContext("2d"), colour = Colours.of("observed");
    const place = ([x, y]) => [width / 2 + scale * x, height / 2 + scale * y];
    pen.clearRect(0, 0, width, height);
    Object.assign(pen, { strokeStyle: Colours.of("leg"), lineWidth: 1 });
    pen.strokeRect(width / 2 - 8, height / 2, 16, 0);
    pen.strokeRect(width / 2, height / 2 - 8, 0, 16);
    Object.assign(pen, { strokeStyle: colour, fillStyle: colour, lineWidth: 4, font: "22px system-ui, sans-serif" });
    for (const { name: what, image } of sights) for (const [i, stroke] of image.entries()) {
      const points = stroke.map(place), middle = points[Math.floor((points.length - 1) / 2)];
      pen.beginPath();
      if (points.length === 1) pen.arc(...middle, 7, 0, 7);
      points.forEach((each) => pen.lineTo(...each));
      points.length === 1 ? pen.fill() : pen.stroke();
      if (i === 0) pen.fillText(what, middle[0] + 12, middle[1] - 10);
    }
    canvas.setAttribute("aria-label", `Image of ${name}: ${sights.map(({ name: what }) => what).join(", ") || "no observation visible"}`);
  }
}
