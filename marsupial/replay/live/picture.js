/* A map that is given as runs of cells, painted on a canvas with a point for each cell. */

import { packed, terrainColour } from "#draw/colours.js";
import { contextOf, make } from "#draw/dom.js";
import { UNKNOWN } from "#log/knownmap.js";

/** Paint a map; `colourOf` gives the colours of its cells, without it those of terrains. Cells that are in no run stay
    clear. `coarse`: so many cells a side become one point, an obstacle if one of them is, so that thin walls can be
    seen.
    @type {(map: CellMap, colourOf?: ((code: number) => string) | null, coarse?: number) => HTMLCanvasElement} */
export function painted({ width, height, runs }, colourOf = null, coarse = 1) {
  const wide = Math.ceil(width / coarse);
  const canvas = make("canvas", { width: wide, height: Math.ceil(height / coarse) });
  const image = new ImageData(wide, canvas.height);
  const pixels = new Uint32Array(image.data.buffer);
  const codes = codesOf(runs)
    .filter((code) => code !== UNKNOWN)
    .sort((a, b) => a - b);
  const colours = new Map(codes.map((code) => [code, packed(colourOf ? colourOf(code) : terrainColour(code, codes))]));
  for (let i = 0; i < runs.length; i += 3) {
    const colour = colours.get(runs[i + 2]) ?? 0;
    const isWall = runs[i + 2] === 0;
    const end = runs[i] + runs[i + 1];
    for (let k = runs[i]; k < end;) {
      const x = k % width;
      const row = Math.floor(k / width);
      const to = Math.min(end, (row + 1) * width);
      const line = Math.floor((height - 1 - row) / coarse) * wide;
      const last = line + Math.floor((x + to - k - 1) / coarse);
      for (let at = line + Math.floor(x / coarse); at <= last; at++) if (isWall || !pixels[at]) pixels[at] = colour;
      k = to;
    }
  }
  contextOf(canvas).putImageData(image, 0, 0);
  return canvas;
}

/** The terrain codes in runs of cells.
    @type {(runs: number[]) => number[]} */
export function codesOf(runs) {
  return [...new Set(runs.filter((_value, i) => i % 3 === 2))];
}
