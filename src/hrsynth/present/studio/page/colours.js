"use strict";
/* One meaning a colour: what it is called in the legend, and the colour. Told apart by all kinds of colour-blind eyes:
   a test reads this table as JSON and simulates them (Machado 2009). */
const COLOURS = {
  "base": ["base", "#cdc9d4"],
  "leg": ["leg", "#9e9aa2"],
  "joint": ["passive joint", "#2a3747"],
  "motor": ["motor", "#08594c"],
  "virtual": ["virtual link", "#ada4ff"],
  "actuator": ["virtual actuator", "#cd139b"],
  "watched": ["watched direction", "#3d6ae9"],
  "unwatched": ["direction that is not watched", "#b7d0ff"],
  "mode": ["another assembly mode", "#05b2ca"],
  "goal": ["goal", "#723f11"],
  "ellipsoid": ["error of the platform's point", "#6334b5"],
  "frame": ["frame of base and platform, handles", "#000000"],
  "unknown": ["platform: error not known", "#747278"],
  "step0": ["error very small", "#8ad7ac"],
  "step1": ["error small", "#f1df50"],
  "step2": ["error middling", "#ed953c"],
  "step3": ["error large", "#e04c3c"],
  "step4": ["a freedom is lost, or nearly", "#5f1223"],
  "background": ["background", "#f5f7fa"]
};

const Colours = {
  steps: [0, 1, 2, 3, 4].map((step) => COLOURS[`step${step}`][1]),
  of: (meaning) => COLOURS[meaning][1],
  words: (meaning) => COLOURS[meaning][0],
  /* The meaning of an error's step 0 to 4; of none, that it is not known. */
  step: (step) => Number.isInteger(step) && step >= 0 ? `step${Math.min(4, step)}` : "unknown",
  /* The number of the named thresholds below a value, 0 to 4; more is worse, or with `falling` less is. */
  rank: (value, edges, falling = false) => edges.filter((edge) => falling ? value <= edge : value > edge).length,
  /* Black or white, which can be read better on a colour: at least 4.5 to 1 (WCAG 2.2, relative luminance). */
  ink(colour) {
    const parts = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16) / 255);
    const [r, g, b] = parts.map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.179 ? "#000000" : "#ffffff";
  },
};
