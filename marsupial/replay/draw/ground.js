/* The known map as pixels, a cell each, and in smaller sizes for views from afar. Only tiles that changed are painted.
   Beside other missions in one frame, cells that none of these knows at the moment may have colours of their own. */

import { isOpen, TILE, tileAt, UNKNOWN } from "#log/knownmap.js";

const LEVELS = 4; // 64 pixels a tile, 32, 16, 8
const EDGE = 8; // tiles that the canvas has to spare where the map is still growing

export class Ground {
  constructor(mission) {
    this.mission = mission;
    this.known = mission.knownMap();
    this.others = []; // what the missions know that this one is compared with
    this.levels = [];
    this.box = null; // in tiles
    this.images = Array.from({ length: LEVELS }, (_, k) => new ImageData(TILE >> k, TILE >> k));
    this.pixels = this.images.map((image) => new Uint32Array(image.data.buffer));
    this.palette = this.alone = new Uint32Array(256);
  }

  /** Take another palette (a colour as 32 bits for each terrain code), and one for cells that no other mission knows,
      and paint all anew. */
  restyle(palette, alone) {
    this.palette = palette;
    this.alone = alone;
    for (const { context, canvas } of this.levels) context.clearRect(0, 0, canvas.width, canvas.height);
    this.paintAll();
  }

  /** Compare with other missions from the next `seek` on. */
  compare(missions) {
    this.others = missions.map((one) => one.knownMap());
    this.paintAll();
  }

  paintAll() {
    for (const key of this.known.map.tiles.keys()) this.paint(key);
  }

  /** Bring the picture to t. Returns the keys of the tiles painted. */
  seek(t) {
    let changed = this.known.seek(t);
    for (const other of this.others) {
      for (const key of other.seek(t)) if (this.known.map.tiles.has(key)) changed.add(key);
    }
    if (this.outgrown()) {
      this.allot();
      changed = new Set(this.known.map.tiles.keys());
    }
    for (const key of changed) this.paint(key);
    return changed;
  }

  outgrown() {
    const box = this.mission.sightings.box,
      tiles = this.box;
    if (!box) return false;
    return (
      !tiles ||
      box.left < tiles.left * TILE ||
      box.low < tiles.low * TILE ||
      box.right >= (tiles.right + 1) * TILE ||
      box.high >= (tiles.high + 1) * TILE
    );
  }

  /** Make room for all that was ever seen, and a little more where the mission goes on. */
  allot() {
    const {
        sightings: { box },
        ended,
      } = this.mission,
      spare = ended ? 0 : EDGE,
      tile = (cell) => Math.floor(cell / TILE);
    this.box = {
      left: tile(box.left) - spare,
      right: tile(box.right) + spare,
      low: tile(box.low) - spare,
      high: tile(box.high) + spare,
    };
    this.levels = this.images.map((_, k) => {
      const canvas = document.createElement("canvas");
      canvas.width = (this.box.right - this.box.left + 1) * (TILE >> k);
      canvas.height = (this.box.high - this.box.low + 1) * (TILE >> k);
      return { canvas, context: canvas.getContext("2d") };
    });
  }

  paint(key) {
    const [tx, ty] = tileAt(key),
      tile = this.known.map.tiles.get(key),
      full = this.pixels[0];
    if (!tile) {
      this.levels.forEach(({ context }, k) => context.clearRect(...this.corner(tx, ty, k), TILE >> k, TILE >> k));
      return;
    }
    const others = this.others.map((other) => other.map.tiles.get(key)).filter(Boolean);
    const compared = this.others.length > 0;
    for (let row = 0, from = 0; row < TILE; row++) {
      for (let to = (TILE - 1 - row) * TILE, end = from + TILE; from < end; from++) {
        const alone = compared && others.every((other) => other[from] === UNKNOWN);
        full[to++] = (alone ? this.alone : this.palette)[tile[from]];
      }
    }
    for (let k = 1; k < LEVELS; k++) halve(this.pixels[k - 1], this.pixels[k], TILE >> k, this.palette[0]);
    this.levels.forEach(({ context }, k) => context.putImageData(this.images[k], ...this.corner(tx, ty, k)));
  }

  corner(tx, ty, k) {
    return [(tx - this.box.left) * (TILE >> k), (this.box.high - ty) * (TILE >> k)];
  }

  /** Draw the map: cell (x, y) has its middle at `left + (x + 0.5) scale`, `top - (y + 0.5) scale`; ratio: device pixels. */
  draw(g, left, top, scale, ratio) {
    if (!this.box) return;
    let k = 0;
    while (k < LEVELS - 1 && scale * ratio * 2 ** (k + 1) <= 1) k++;
    const { canvas } = this.levels[k],
      wide = scale * 2 ** k;
    g.imageSmoothingEnabled = scale * ratio < 1;
    g.imageSmoothingQuality = "low";
    g.drawImage(
      canvas,
      left + this.box.left * TILE * scale,
      top - (this.box.high + 1) * TILE * scale,
      canvas.width * wide,
      canvas.height * wide,
    );
  }

  /** Whether a cell is known, open and next to one that is not known. */
  isFrontier(x, y) {
    const at = (dx, dy) => this.known.at(x + dx, y + dy);
    return isOpen(at(0, 0)) && [at(1, 0), at(-1, 0), at(0, 1), at(0, -1)].includes(UNKNOWN);
  }

  /** Where a tile is drawn, in the units of `draw`: left, top, width, height. */
  place(key, left, top, scale) {
    const [tx, ty] = tileAt(key);
    return [left + tx * TILE * scale, top - (ty + 1) * TILE * scale, TILE * scale, TILE * scale];
  }
}

/** Half the size: each pixel the mean of four, or `wall` if one of them is, so that thin walls can be seen from afar. */
function halve(from, to, size, wall) {
  const mean = (a, b) => (a === wall || b === wall ? wall : ((((a ^ b) & 0xfefefefe) >>> 1) + (a & b)) >>> 0);
  for (let y = 0, i = 0; y < size; y++) {
    for (let x = 0, above = 4 * y * size; x < size; x++, above += 2) {
      to[i++] = mean(mean(from[above], from[above + 1]), mean(from[above + 2 * size], from[above + 2 * size + 1]));
    }
  }
}
