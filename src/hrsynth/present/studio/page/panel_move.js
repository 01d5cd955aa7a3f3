"use strict";
/* Motion of the platform: a slider for each dof, or for each motor, or dragging in the 3D view. */

class MovePanel extends Panel {
  constructor(studio) {
    super(studio, "move", "Move");
    this.sliders = this.motors = [];
    this.choice = radios("Coordinates", [["pose", "Pose"], ["motors", "Motors"]], "pose", (kind) => this.choose(kind));
    this.list = element("div", { className: "sliders" });
    this.driven = element("div", { className: "sliders", hidden: true });
    this.notes = element("ul", { className: "notes" });
    this.drag = tick("Drag the platform in the 3D view", false, (on) => this.grip(on));
    this.body.append(this.choice, this.list, this.driven, element("div", { className: "row" }, button("Zero configuration", () => this.home()), this.drag), this.notes);
  }

  opened(scene) {
    this.sliders = this.fill(this.list, scene.sliders, () => ({ values: this.sliders.map(({ value }) => value) }));
    this.motors = this.fill(this.driven, scene.motor_sliders ?? [], () => ({ motors: this.motors.map(({ value }) => value) }));
    this.choice.hidden = !this.motors.length;
    if (!this.motors.length) this.choose("pose");
    this.drag.querySelector("input").checked = false;
    this.drag.hidden = Boolean(scene.kept);
    this.notes.replaceChildren(...(this.studio.tabs ? [] : scene.notes).map((textContent) => element("li", { textContent })));
    this.grip(false);
    this.status.clear();
    this.scene = scene;
    this.moved(this.studio);
  }

  fill(list, records, fields) {
    const made = records.map((record) => {
      const slider = new Slider({ ...record, value: record.home }, () => { this.last = slider; this.studio.move(fields()); });
      return slider;
    });
    list.replaceChildren(...made.map(({ root }) => root));
    return made;
  }

  choose(kind) {
    this.choice.querySelector(`[value=${kind}]`).checked = true;
    this.list.hidden = kind !== "pose";
    this.driven.hidden = kind === "pose";
  }

  home() { this.studio.move({ here: null }); }

  grip(on) {
    this.dragging = on;
    this.studio.stage.gizmo(on, this.studio.state, (place) => this.studio.move({ platform: place }));
  }

  /* A slider that is dragged keeps its value; afterwards all show the reached values. */
  moved(answer) {
    if (this.studio.moving) return;
    this.show(answer);
    if (answer.stopped) this.status.say("Limit reached: no further motion in this direction.");
    else this.status.clear();
    this.same.show(answer.command ? answer : this.scene);
  }

  show({ values, motors }) {
    this.sliders.forEach((slider, i) => slider.read(values[i]));
    this.motors.forEach((slider, i) => slider.read(motors[i]));
  }

  /* The robot stays where it is; the reason stands at the motor that was moved. */
  refused(words) {
    if (!this.motors.includes(this.last)) return void this.status.fail(words);
    this.show(this.studio);
    this.last.fail(words);
  }
}
