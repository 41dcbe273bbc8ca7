/* A map that is given as runs of cells, painted on a canvas with a point for each cell. */

import { packed, terrainColour } from "#draw/colours.js";
import { make } from "#draw/dom.js";

const UNKNOWN = 255;

/** Paint a map; `colourOf(code)` gives the colours of its cells, without it those of terrains. Cells that are in no run stay clear.
    `coarse`: so many cells a side become one point, an obstacle if one of them is, so that thin walls can be seen. */
export function painted({ width, height, runs }, colourOf = null, coarse = 1) {
  const wide = Math.ceil(width / coarse),
    canvas = make("canvas", { width: wide, height: Math.ceil(height / coarse) });
  const image = new ImageData(wide, canvas.height),
    pixels = new Uint32Array(image.data.buffer);
  const codes = [...new Set(runs.filter((_, i) => i % 3 === 2))]
      .sort((a, b) => a - b)
      .filter((code) => code !== UNKNOWN),
    terrains = codes.map((code) => ({ code }));
  const colours = new Map(
    terrains.map((terrain) => [
      terrain.code,
      packed(colourOf ? colourOf(terrain.code) : terrainColour(terrain, terrains)),
    ]),
  );
  for (let i = 0; i < runs.length; i += 3) {
    const colour = colours.get(runs[i + 2]) ?? 0,
      isWall = runs[i + 2] === 0,
      end = runs[i] + runs[i + 1];
    for (let k = runs[i], to; k < end; k = to) {
      // row by row
      const x = k % width,
        row = Math.floor(k / width);
      to = Math.min(end, (row + 1) * width);
      const line = Math.floor((height - 1 - row) / coarse) * wide,
        last = line + Math.floor((x + to - k - 1) / coarse);
      for (let at = line + Math.floor(x / coarse); at <= last; at++) if (isWall || !pixels[at]) pixels[at] = colour;
    }
  }
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}
