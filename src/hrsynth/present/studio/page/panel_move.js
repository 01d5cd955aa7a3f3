"use strict";
/* Motion of the platform: a slider for each dof, or dragging in the 3D view. */

class MovePanel extends Panel {
  constructor(studio) {
    super(studio, "move", "Move");
    this.sliders = [];
    this.list = element("div", { className: "sliders" });
    this.notes = element("ul", { className: "notes" });
    this.drag = tick("Drag the platform in the 3D view", false, (on) => this.grip(on));
    this.body.append(this.list, element("div", { className: "row" }, button("Zero configuration", () => this.home()), this.drag), this.notes);
  }

  opened(scene) {
    this.list.replaceChildren();
    this.sliders = scene.sliders.map((record) => {
      const slider = new Slider({ ...record, value: record.home }, () => this.send());
      this.list.append(slider.root);
      return slider;
    });
    this.drag.querySelector("input").checked = false;
    this.drag.hidden = Boolean(scene.kept);
    this.notes.replaceChildren(...(this.studio.tabs ? [] : scene.notes).map((textContent) => element("li", { textContent })));
    this.grip(false);
    this.status.clear();
    this.same.show(scene);
  }

  send() { this.studio.move({ values: this.sliders.map(({ value }) => value) }); }

  home() { this.studio.move({ here: null }); }

  grip(on) {
    this.dragging = on;
    this.studio.stage.gizmo(on, this.studio.state, (place) => this.studio.move({ platform: place }));
  }

  /* A slider that is dragged keeps its value; afterwards all show the reached values. */
  moved(answer) {
    if (this.studio.moving) return;
    this.sliders.forEach((slider, i) => slider.read(this.studio.values[i]));
    if (answer.stopped) this.status.say("Limit reached: no further motion in this direction.");
    else this.status.clear();
    if (answer.command) this.same.show(answer);
  }
}
