/* What is known of the map, at any moment. The map is cut into tiles, so that it may grow on every side and that going
   back to an earlier moment, or painting the map anew, touches no more than the tiles that differ.

   Cells are numbered as in the first frame of the mission; a frame that has grown has cells left of 0 or below. */

import { lastAt, Numbers } from "#log/history.js";

export const UNKNOWN = 255;
export const TILE = 64;
const RUNS_A_KEYFRAME = 8192;
const HALF = 1 << 15;

/** The key of a tile in a Map, and back. */
export function tileKey(tx, ty) {
  return (ty + HALF) * 2 * HALF + tx + HALF;
}
export function tileAt(key) {
  return [(key % (2 * HALF)) - HALF, Math.floor(key / (2 * HALF)) - HALF];
}

/** Tiles of terrain codes, row by row from the south; an unwritten tile is unknown. Copies share tiles until written. */
export class Tiles {
  constructor(tiles = new Map()) {
    this.tiles = tiles;
    this.own = new Set();
  }

  /** Hand out the tiles as they are; they are copied before they are written to again. */
  frozen() {
    this.own.clear();
    return new Map(this.tiles);
  }

  at(x, y) {
    const tile = this.tiles.get(tileKey(Math.floor(x / TILE), Math.floor(y / TILE)));
    return tile ? tile[(y & (TILE - 1)) * TILE + (x & (TILE - 1))] : UNKNOWN;
  }

  writable(key) {
    let tile = this.tiles.get(key);
    if (this.own.has(key)) return tile;
    tile = tile ? tile.slice() : new Uint8Array(TILE * TILE).fill(UNKNOWN);
    this.tiles.set(key, tile);
    this.own.add(key);
    return tile;
  }

  /** Write a run of cells in one row. Returns how many open cells there are more than before; calls `touched(key)`. */
  write(x, y, cells, code, touched) {
    const ty = Math.floor(y / TILE),
      row = (y & (TILE - 1)) * TILE;
    let more = isOpen(code) ? cells : 0;
    for (let at = x; at < x + cells;) {
      const tx = Math.floor(at / TILE),
        stop = Math.min(x + cells, (tx + 1) * TILE),
        key = tileKey(tx, ty);
      const tile = this.writable(key),
        from = row + at - tx * TILE,
        to = row + stop - tx * TILE;
      for (let i = from; i < to; i++) {
        if (isOpen(tile[i])) more--;
        tile[i] = code;
      }
      if (touched) touched(key);
      at = stop;
    }
    return more;
  }
}

/** Whether a cell is known and no obstacle. */
export function isOpen(code) {
  return code !== 0 && code !== UNKNOWN;
}

/** All that was seen, look by look, with the open area after each and a copy of the map every so often. */
export class Sightings {
  constructor(t) {
    this.runs = new Numbers(); // column, row, cells, code, four by four
    this.times = [];
    this.ends = [];
    this.robots = [];
    this.areaTimes = [t];
    this.areas = [0]; // in cells
    this.box = null;
    this.codes = new Set();
    this.head = new Tiles();
    this.keyframes = [new Map()];
    this.keyframeDone = [0];
    this.keyed = 0;
    this.open = 0;
  }

  /** Enter one look; `read(take)` gives its runs of cells to `take(column, row, cells, code)`. */
  add(t, robot, read) {
    read((x, y, cells, code) => {
      this.runs.push(x, y, cells, code);
      this.open += this.head.write(x, y, cells, code);
      this.codes.add(code);
      this.stretch(x, y, cells);
    });
    this.times.push(t);
    this.ends.push(this.runs.length);
    this.robots.push(robot);
    const last = this.areaTimes.length - 1;
    if (this.areaTimes[last] === t) this.areas[last] = this.open;
    else {
      this.areaTimes.push(t);
      this.areas.push(this.open);
    }
    if (this.runs.length - this.keyed < 4 * RUNS_A_KEYFRAME) return;
    this.keyed = this.runs.length;
    this.keyframes.push(this.head.frozen());
    this.keyframeDone.push(this.times.length);
  }

  stretch(x, y, cells) {
    const box = this.box || (this.box = { left: x, right: x, low: y, high: y });
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x + cells - 1);
    box.low = Math.min(box.low, y);
    box.high = Math.max(box.high, y);
  }

  /** Where the runs of look number `look` begin. */
  begin(look) {
    return look === 0 ? 0 : this.ends[look - 1];
  }

  /** Open cells known at t. */
  openAt(t) {
    const i = lastAt(this.areaTimes, t);
    return i < 0 ? 0 : this.areas[i];
  }
}

/** The map as known at a moment that moves. */
export class KnownMap {
  constructor(sightings) {
    this.sightings = sightings;
    this.map = new Tiles();
    this.done = 0;
  }

  at(x, y) {
    return this.map.at(x, y);
  }

  /** Go to t. Returns the keys of the tiles that are not as they were. */
  seek(t) {
    const { times, keyframeDone } = this.sightings,
      looks = lastAt(times, t) + 1,
      changed = new Set();
    const nearest = lastAt(keyframeDone, looks);
    if (looks < this.done || keyframeDone[nearest] > this.done) this.leap(nearest, changed);
    const touched = (key) => changed.add(key),
      runs = this.sightings.runs.array;
    for (; this.done < looks; this.done++) {
      const end = this.sightings.ends[this.done];
      for (let i = this.sightings.begin(this.done); i < end; i += 4) {
        this.map.write(runs[i], runs[i + 1], runs[i + 2], runs[i + 3], touched);
      }
    }
    return changed;
  }

  leap(keyframe, changed) {
    const before = this.map.tiles,
      now = this.sightings.keyframes[keyframe];
    for (const [key, tile] of now) if (before.get(key) !== tile) changed.add(key);
    for (const key of before.keys()) if (!now.has(key)) changed.add(key);
    this.map = new Tiles(new Map(now));
    this.done = this.sightings.keyframeDone[keyframe];
  }
}
