"use strict";
/* The palette, COLOURS: label in the legend and colour of each meaning. */
const Colours = {
  steps: [0, 1, 2, 3, 4].map((step) => COLOURS[`step${step}`][1]),
  of: (meaning) => COLOURS[meaning][1],
  words: (meaning) => COLOURS[meaning][0],
  /* The meaning of step 0 to 4 of an error; of none: unknown. */
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
