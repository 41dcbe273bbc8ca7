/* A map that is given as runs of cells, painted on a canvas with a point for each cell. */

import { packed, terrainColour } from "./colours.js";
import { make } from "./dom.js";

const UNKNOWN = 255;

/** Paint a map; `colourOf(code)` gives the colours of its cells, without it those of terrains. Cells that are in no run stay clear. */
export function painted({ width, height, runs }, colourOf = null) {
  const canvas = make("canvas", { width, height }), image = new ImageData(width, height), pixels = new Uint32Array(image.data.buffer);
  const codes = [...new Set(runs.filter((_, i) => i % 3 === 2))].sort((a, b) => a - b).filter((code) => code !== UNKNOWN), terrains = codes.map((code) => ({ code }));
  const colours = new Map(terrains.map((terrain) => [terrain.code, packed(colourOf ? colourOf(terrain.code) : terrainColour(terrain, terrains))]));
  for (let i = 0; i < runs.length; i += 3) {
    for (let k = runs[i]; k < runs[i] + runs[i + 1]; k++) pixels[(height - 1 - Math.floor(k / width)) * width + k % width] = colours.get(runs[i + 2]) ?? 0;
  }
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}
