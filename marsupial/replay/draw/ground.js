/* The known map as pixels, a cell each, and in smaller sizes for views from afar. Only tiles that changed are painted.
   Beside other missions in one frame, cells that none of these knows at the moment may have colours of their own. */

import { contextOf } from "#draw/dom.js";
import { isOpen, TILE, tileAt, UNKNOWN } from "#log/knownmap.js";

const LEVELS = 4; // 64 pixels a tile, 32, 16, 8
const EDGE = 8; // tiles that the canvas has to spare where the map is still growing

export class Ground {
  /** @param {Mission} mission */
  constructor(mission) {
    this.mission = mission;
    this.known = mission.knownMap();
    /** @type {KnownMap[]} */
    this.others = []; // what the missions know that this one is compared with
    /** @type {Context[]} */
    this.levels = [];
    /** @type {Extent | null} */
    this.box = null; // in tiles
    this.images = Array.from({ length: LEVELS }, (_none, k) => new ImageData(TILE >> k, TILE >> k));
    this.pixels = this.images.map((image) => new Uint32Array(image.data.buffer));
    this.palette = new Uint32Array(256);
    this.alone = this.palette;
    /** @type {Map<number, number>} */
    this.aloneIn = new Map(); // open cells in each tile that none of the others knows
  }

  /** How many open cells are known here and by none of the others. */
  get aloneCells() {
    return [...this.aloneIn.values()].reduce((sum, cells) => sum + cells, 0);
  }

  /** Whether a cell is known here and by none of the others.
      @type {(x: number, y: number) => boolean} */
  isAlone(x, y) {
    const compared = this.others.length > 0 && this.known.at(x, y) !== UNKNOWN;
    return compared && this.others.every((other) => other.at(x, y) === UNKNOWN);
  }

  /** Take another palette (a colour as 32 bits for each terrain code), and one for cells that no other mission knows,
      and paint all anew.
      @type {(palette: Uint32Array<ArrayBuffer>, alone: Uint32Array<ArrayBuffer>) => void} */
  restyle(palette, alone) {
    this.palette = palette;
    this.alone = alone;
    for (const g of this.levels) g.clearRect(0, 0, g.canvas.width, g.canvas.height);
    this.paintAll();
  }

  /** Compare with what other missions know.
      @type {(others: KnownMap[]) => void} */
  compare(others) {
    this.others = others;
    this.aloneIn.clear();
    this.paintAll();
  }

  paintAll() {
    for (const key of this.known.map.tiles.keys()) this.paint(key);
  }

  /** Bring the picture to the moment that what is known here, and by the others, was brought to. Returns the keys of
      the tiles painted.
      @type {() => Set<number>} */
  renew() {
    let changed = new Set(this.known.changed);
    for (const other of this.others) {
      for (const key of other.changed) if (this.known.map.tiles.has(key)) changed.add(key);
    }
    const { box } = this.mission.sightings;
    if (box && this.outgrown(box)) {
      this.allot(box);
      changed = new Set(this.known.map.tiles.keys());
    }
    for (const key of changed) this.paint(key);
    return changed;
  }

  /** @type {(box: Extent) => boolean} */
  outgrown(box) {
    const tiles = this.box;
    if (!tiles) return true;
    const isLeft = box.left < tiles.left * TILE || box.low < tiles.low * TILE;
    return isLeft || box.right >= (tiles.right + 1) * TILE || box.high >= (tiles.high + 1) * TILE;
  }

  /** Make room for all that was ever seen, and a little more where the mission goes on.
      @type {(box: Extent) => void} */
  allot({ left, right, low, high }) {
    const spare = this.mission.ended ? 0 : EDGE;
    /** @type {(cell: number) => number} */
    const tile = (cell) => Math.floor(cell / TILE);
    const box = {
      left: tile(left) - spare,
      right: tile(right) + spare,
      low: tile(low) - spare,
      high: tile(high) + spare,
    };
    this.box = box;
    this.levels = this.images.map((_image, k) => {
      const canvas = document.createElement("canvas");
      canvas.width = (box.right - box.left + 1) * (TILE >> k);
      canvas.height = (box.high - box.low + 1) * (TILE >> k);
      return contextOf(canvas);
    });
  }

  /** @type {(key: number) => void} */
  paint(key) {
    const tile = this.known.map.tiles.get(key);
    if (!tile) {
      this.aloneIn.delete(key);
      this.levels.forEach((g, k) => g.clearRect(...this.corner(key, k), TILE >> k, TILE >> k));
      return;
    }
    const others = this.others.flatMap((other) => other.map.tiles.get(key) ?? []);
    const compared = this.others.length > 0;
    const [full] = this.pixels;
    let open = 0;
    for (let row = 0, from = 0; row < TILE; row++) {
      for (let to = (TILE - 1 - row) * TILE, end = from + TILE; from < end; from++) {
        let alone = compared;
        for (let k = 0; alone && k < others.length; k++) alone = others[k][from] === UNKNOWN;
        if (alone && isOpen(tile[from])) open++;
        full[to++] = (alone ? this.alone : this.palette)[tile[from]];
      }
    }
    this.aloneIn.set(key, open);
    for (let k = 1; k < LEVELS; k++) halve(this.pixels[k - 1], this.pixels[k], TILE >> k, this.palette[0]);
    this.levels.forEach((g, k) => g.putImageData(this.images[k], ...this.corner(key, k)));
  }

  /** The upper left pixel of a tile on a level.
      @type {(key: number, k: number) => Point} */
  corner(key, k) {
    const [tx, ty] = tileAt(key);
    return this.box ? [(tx - this.box.left) * (TILE >> k), (this.box.high - ty) * (TILE >> k)] : [0, 0];
  }

  /** Draw the map: cell (x, y) has its middle at `left + (x + 0.5) scale`, `top - (y + 0.5) scale`; ratio: device
      pixels.
      @type {(g: Context, left: number, top: number, scale: number, ratio: number) => void} */
  draw(g, left, top, scale, ratio) {
    if (!this.box) return;
    let k = 0;
    while (k < LEVELS - 1 && scale * ratio * 2 ** (k + 1) <= 1) k++;
    const { canvas } = this.levels[k];
    const wide = scale * 2 ** k;
    g.imageSmoothingEnabled = scale * ratio < 1;
    g.imageSmoothingQuality = "low";
    const [x, y] = [left + this.box.left * TILE * scale, top - (this.box.high + 1) * TILE * scale];
    g.drawImage(canvas, x, y, canvas.width * wide, canvas.height * wide);
  }

  /** Where a tile is drawn, in the units of `draw`.
      @type {(key: number, left: number, top: number, scale: number) => Box} */
  place(key, left, top, scale) {
    const [tx, ty] = tileAt(key);
    return [left + tx * TILE * scale, top - (ty + 1) * TILE * scale, TILE * scale, TILE * scale];
  }
}

/** Half the size: each pixel the mean of four, or `wall` if one of them is, so that thin walls can be seen.
    @type {(from: Uint32Array, to: Uint32Array, size: number, wall: number) => void} */
function halve(from, to, size, wall) {
  /** @type {(a: number, b: number) => number} */
  const mean = (a, b) => (a === wall || b === wall ? wall : ((((a ^ b) & 0xfefefefe) >>> 1) + (a & b)) >>> 0);
  for (let y = 0, i = 0; y < size; y++) {
    for (let x = 0, above = 4 * y * size; x < size; x++, above += 2) {
      const below = above + 2 * size;
      to[i++] = mean(mean(from[above], from[above + 1]), mean(from[below], from[below + 1]));
    }
  }
}
