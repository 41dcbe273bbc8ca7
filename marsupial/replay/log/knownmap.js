/* What is known of the map, at any moment. The map is cut into tiles, so that it may grow on every side and that going
   back to an earlier moment, or painting the map anew, touches no more than the tiles that differ.

   Cells are numbered as in the first frame of the mission; a frame that has grown has cells left of 0 or below. */

import { lastAt, Numbers } from "#log/history.js";

export const UNKNOWN = 255;
export const TILE = 64;
const RUNS_A_KEYFRAME = 4096;
const HALF = 1 << 15;

/** The key of a tile in a Map.
    @type {(tx: number, ty: number) => number} */
function tileKey(tx, ty) {
  return (ty + HALF) * 2 * HALF + tx + HALF;
}

/** Column and row of the tile with a key.
    @type {(key: number) => Cell} */
export function tileAt(key) {
  return [(key % (2 * HALF)) - HALF, Math.floor(key / (2 * HALF)) - HALF];
}

/** Whether a cell is known and no obstacle.
    @type {(code: number) => boolean} */
export function isOpen(code) {
  return code !== 0 && code !== UNKNOWN;
}

/** Tiles of terrain codes, row by row from the south; an unwritten tile is unknown. Copies share tiles until they are
    written to. */
class Tiles {
  /** @param {Map<number, Uint8Array<ArrayBuffer>>} tiles */
  constructor(tiles = new Map()) {
    this.tiles = tiles;
    /** @type {Set<number>} */
    this.own = new Set();
  }

  /** Hand out the tiles as they are; they are copied before they are written to again. */
  frozen() {
    this.own.clear();
    return new Map(this.tiles);
  }

  /** @type {(x: number, y: number) => number} */
  at(x, y) {
    const tile = this.tiles.get(tileKey(Math.floor(x / TILE), Math.floor(y / TILE)));
    return tile ? tile[(y & (TILE - 1)) * TILE + (x & (TILE - 1))] : UNKNOWN;
  }

  /** @param {number} key */
  writable(key) {
    const tile = this.tiles.get(key);
    if (tile && this.own.has(key)) return tile;
    const own = tile ? tile.slice() : new Uint8Array(TILE * TILE).fill(UNKNOWN);
    this.tiles.set(key, own);
    this.own.add(key);
    return own;
  }

  /** Write a run of cells in one row. Returns how many open cells there are more than before; calls `touched`.
      @type {(x: number, y: number, cells: number, code: number, touched?: (key: number) => void) => number} */
  write(x, y, cells, code, touched) {
    const ty = Math.floor(y / TILE);
    const row = (y & (TILE - 1)) * TILE;
    let more = isOpen(code) ? cells : 0;
    for (let at = x; at < x + cells;) {
      const tx = Math.floor(at / TILE);
      const stop = Math.min(x + cells, (tx + 1) * TILE);
      const key = tileKey(tx, ty);
      const tile = this.writable(key);
      const to = row + stop - tx * TILE;
      for (let i = row + at - tx * TILE; i < to; i++) {
        if (isOpen(tile[i])) more--;
        tile[i] = code;
      }
      if (touched) touched(key);
      at = stop;
    }
    return more;
  }
}

/** All that was seen, look by look, with the open area after each and a copy of the map every so often. */
export class Sightings {
  /** @param {number} t */
  constructor(t) {
    this.runs = new Numbers(); // column, row, cells, code, four by four
    /** @type {number[]} */
    this.times = [];
    /** @type {number[]} */
    this.ends = [];
    /** @type {string[]} */
    this.robots = [];
    this.areaTimes = [t];
    this.areas = [0]; // in cells
    /** @type {Extent | null} */
    this.box = null;
    /** @type {Set<number>} */
    this.codes = new Set();
    this.head = new Tiles();
    this.keyframes = [this.head.frozen()];
    this.keyframeDone = [0];
    this.keyed = 0;
    this.open = 0;
  }

  /** Enter one look, in a frame that is `width` cells wide and in which the first one lies at `shift`.
      @type {(line: LookLine, width: number, shift: Cell) => void} */
  add({ t_ms, robot, cells }, width, [dx, dy]) {
    for (let i = 0, at = 0; i < cells.length; i += 3) {
      at += cells[i];
      for (let end = at + cells[i + 1]; at < end;) {
        const row = Math.floor(at / width);
        const stop = Math.min(end, (row + 1) * width);
        this.enter(at - row * width - dx, row - dy, stop - at, cells[i + 2]);
        at = stop;
      }
    }
    this.times.push(t_ms);
    this.ends.push(this.runs.length);
    this.robots.push(robot);
    const last = this.areaTimes.length - 1;
    if (this.areaTimes[last] === t_ms) this.areas[last] = this.open;
    else {
      this.areaTimes.push(t_ms);
      this.areas.push(this.open);
    }
    if (this.runs.length - this.keyed < 4 * RUNS_A_KEYFRAME) return;
    this.keyed = this.runs.length;
    this.keyframes.push(this.head.frozen());
    this.keyframeDone.push(this.times.length);
  }

  /** Enter a run of cells in one row.
      @type {(x: number, y: number, cells: number, code: number) => void} */
  enter(x, y, cells, code) {
    this.runs.push(x, y, cells, code);
    this.open += this.head.write(x, y, cells, code);
    this.codes.add(code);
    this.stretch(x, y, cells);
  }

  /** @type {(x: number, y: number, cells: number) => void} */
  stretch(x, y, cells) {
    this.box ??= { left: x, right: x, low: y, high: y };
    const { box } = this;
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x + cells - 1);
    box.low = Math.min(box.low, y);
    box.high = Math.max(box.high, y);
  }

  /** Where the runs of look number `look` begin.
      @type {(look: number) => number} */
  begin(look) {
    return look === 0 ? 0 : this.ends[look - 1];
  }

  /** Open cells known at t.
      @type {(t: number) => number} */
  openAt(t) {
    const i = lastAt(this.areaTimes, t);
    return i < 0 ? 0 : this.areas[i];
  }
}

/** The map as known at a moment that moves. */
export class KnownMap {
  /** @param {Sightings} sightings */
  constructor(sightings) {
    this.sightings = sightings;
    this.map = new Tiles();
    this.done = 0;
    /** @type {Set<number>} */
    this.changed = new Set(); // keys of the tiles that the last `seek` changed
  }

  /** @type {(x: number, y: number) => number} */
  at(x, y) {
    return this.map.at(x, y);
  }

  /** Whether a cell is known, open and next to one that is not known.
      @type {(x: number, y: number) => boolean} */
  isFrontier(x, y) {
    if (!isOpen(this.at(x, y))) return false;
    return [this.at(x + 1, y), this.at(x - 1, y), this.at(x, y + 1), this.at(x, y - 1)].includes(UNKNOWN);
  }

  /** @type {(t: number) => void} */
  seek(t) {
    const { times, keyframeDone } = this.sightings;
    const looks = lastAt(times, t) + 1;
    const changed = new Set();
    const nearest = lastAt(keyframeDone, looks);
    if (looks < this.done || keyframeDone[nearest] > this.done) this.leap(nearest, changed);
    /** @type {(key: number) => void} */
    const touched = (key) => changed.add(key);
    const runs = this.sightings.runs.array;
    for (; this.done < looks; this.done++) {
      const end = this.sightings.ends[this.done];
      for (let i = this.sightings.begin(this.done); i < end; i += 4) {
        this.map.write(runs[i], runs[i + 1], runs[i + 2], runs[i + 3], touched);
      }
    }
    this.changed = changed;
  }

  /** @type {(keyframe: number, changed: Set<number>) => void} */
  leap(keyframe, changed) {
    const before = this.map.tiles;
    const now = this.sightings.keyframes[keyframe];
    for (const [key, tile] of now) if (before.get(key) !== tile) changed.add(key);
    for (const key of before.keys()) if (!now.has(key)) changed.add(key);
    this.map = new Tiles(new Map(now));
    this.done = this.sightings.keyframeDone[keyframe];
  }
}
