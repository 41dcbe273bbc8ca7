/* The colours of the palette (marsupial/replay/palette.py), which stand in the style of the page, light and dark. */

const FAMILIES = 8,
  SHADES = 3;
/* Hues of missions side by side, furthest apart first; those of the first two carriers are left to them. */
const SIDE_HUES = [4, 5, 7, 3, 6, 2];

/** A colour of the theme by its name in the style. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** The name of the colour of the i-th of some missions side by side. */
export function sideColour(i) {
  return `family-${SIDE_HUES[i]}-0`;
}

/** The colours by name, to be read once for each theme. */
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

/** How each robot looks: a hue for each carrier (or rover that starts on the ground), shades of it for its rovers. */
export function looks(mission) {
  const family = new Map(),
    aboard = new Map(),
    found = new Map();
  for (const robot of mission.robots) if (!robot.home) family.set(robot.name, family.size);
  for (const robot of mission.robots) {
    const head = robot.home || robot.name,
      number = family.get(head),
      nth = aboard.get(head) || 0;
    if (robot.home) aboard.set(head, nth + 1);
    found.set(robot.name, {
      hue: number % FAMILIES,
      shade: robot.home ? (nth % SHADES) + 1 : 0,
      dashed: number >= FAMILIES,
    });
  }
  return found;
}

/** The colour of each robot in the theme as it is. */
export function robotColours(mission) {
  return new Map([...looks(mission)].map(([name, { hue, shade }]) => [name, colour(`family-${hue}-${shade}`)]));
}

/** The colour of a terrain class; of classes but obstacle and floor, several have shades of the one for others. */
export function terrainColour(terrain, terrains) {
  if (terrain.code === 0) return colour("wall");
  if (terrain.code === 1) return colour("free");
  const others = terrains.filter((one) => one.code > 1).map((one) => one.code),
    k = others.indexOf(terrain.code);
  return k < 1 ? colour("other") : `color-mix(in srgb, ${colour("other")}, ${colour("wall")} ${Math.min(60, 18 * k)}%)`;
}

/** The colour of a terrain class where one of some missions side by side alone knows it, by the name of its colour. */
export function aloneColour(terrain, terrains, side) {
  return `color-mix(in srgb, ${terrainColour(terrain, terrains)}, ${colour(side)} 35%)`;
}

/** A CSS colour as 32 bits, as they stand in image data. */
export function packed(css) {
  const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  probe.fillStyle = css;
  probe.fillRect(0, 0, 1, 1);
  return new Uint32Array(probe.getImageData(0, 0, 1, 1).data.buffer)[0];
}
