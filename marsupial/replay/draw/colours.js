/* The colours of the palette (marsupial/replay/palette.py), which stand in the style of the page, light and dark. */

import { contextOf } from "#draw/dom.js";

export const FAMILIES = 8;
export const SHADES = 3;
/* Hues of missions side by side, furthest apart first; those of the first two carriers are left to them. */
const SIDE_HUES = [4, 5, 7, 3, 6, 2];

/** A colour of the theme by its name in the style.
    @type {(name: string) => string} */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** The name of the colour of the i-th of some missions side by side.
    @type {(i: number) => string} */
export function sideColour(i) {
  return `family-${SIDE_HUES[i]}-0`;
}

/** The colours by name, to be read once for each theme.
    @type {() => Ink} */
export function inks() {
  const names = [
    "page",
    "card",
    "line",
    "ink",
    "dim",
    "accent",
    "unknown",
    "free",
    "wall",
    "other",
    "frontier",
    "drive",
    "explore",
    "aboard",
    "dock",
    "undock",
    "wait",
    "bad",
  ];
  return Object.fromEntries(names.map((name) => [name, colour(name)]));
}

/** How each robot looks: a hue for each carrier (or rover that starts on the ground), shades of it for its rovers.
    @type {(crew: Crew) => Map<string, { hue: number, shade: number, dashed: boolean }>} */
export function looks({ robots }) {
  const family = new Map();
  const aboard = new Map();
  const found = new Map();
  for (const robot of robots) if (!robot.home) family.set(robot.name, family.size);
  for (const robot of robots) {
    const head = robot.home || robot.name;
    const number = family.get(head);
    const nth = aboard.get(head) || 0;
    if (robot.home) aboard.set(head, nth + 1);
    const shade = robot.home ? (nth % SHADES) + 1 : 0;
    found.set(robot.name, { hue: number % FAMILIES, shade, dashed: number >= FAMILIES });
  }
  return found;
}

/** The colour of each robot in the theme as it is.
    @type {(crew: Crew) => Colours} */
export function robotColours(crew) {
  return new Map([...looks(crew)].map(([name, { hue, shade }]) => [name, colour(`family-${hue}-${shade}`)]));
}

/** The colour of a robot.
    @type {(colours: Colours, name: string) => string} */
export function colourOf(colours, name) {
  return colours.get(name) ?? "";
}

/** The colour of a terrain class; of classes but obstacle and floor, several have shades of the one for others.
    @type {(code: number, codes: number[]) => string} */
export function terrainColour(code, codes) {
  if (code === 0) return colour("wall");
  if (code === 1) return colour("free");
  const k = codes.filter((one) => one > 1).indexOf(code);
  const other = colour("other");
  return k < 1 ? other : `color-mix(in srgb, ${other}, ${colour("wall")} ${Math.min(60, 18 * k)}%)`;
}

/** The colour of a terrain class where one of some missions side by side alone knows it, by the name of its colour.
    @type {(code: number, codes: number[], side: string) => string} */
export function aloneColour(code, codes, side) {
  return `color-mix(in srgb, ${terrainColour(code, codes)}, ${colour(side)} 35%)`;
}

/** A CSS colour as 32 bits, as they stand in image data.
    @type {(css: string) => number} */
export function packed(css) {
  const probe = contextOf(document.createElement("canvas"), { willReadFrequently: true });
  probe.fillStyle = css;
  probe.fillRect(0, 0, 1, 1);
  return new Uint32Array(probe.getImageData(0, 0, 1, 1).data.buffer)[0];
}
