/* Which part of the map is looked at: cells to points of the canvas and back, by zooming, panning and following.
   Missions in one frame share a camera, so that the same place is at the same point in each of their panes. */

const CLOSEST = 200;
const FURTHEST = 0.02; // points of the page a cell
const FOLLOWED = 14; // points a metre, at least, when a robot is followed
const MARGIN = 12; // points between what is fitted and the edge
/** A map below what covers the canvas is in the middle: it is preferred if it has this share of the size beside it. */
const BELOW = 0.8;

/** Whether a cell of one mission is the same place in all of them.
    @type {(missions: Mission[]) => boolean} */
export function shareFrame(missions) {
  const frames = missions.map(({ start: { scenario, resolution_m, origin_m } }) =>
    JSON.stringify([scenario, resolution_m, origin_m]),
  );
  return new Set(frames).size === 1;
}

export class Camera {
  /** @param {Mission[]} missions */
  constructor(missions) {
    this.missions = missions;
    /** @type {Map<object, Size & { covers: Box[] }>} */
    this.stages = new Map(); // of each canvas
    this.size = { width: 1, height: 1 };
    this.left = 0;
    this.top = 0;
    /** @type {Box[]} */
    this.covers = [
      [0, 0, 0, 0],
      [1, 0, 0, 0],
    ];
    /** @type {Robot | null} */
    this.followed = null; // a robot of one of the missions
    /** @type {{ scale: number, left: number, top: number, fitted: boolean } | null} */
    this.before = null; // what was looked at before that
    this.scale = 1;
    this.fitted = true;
    this.version = 0; // goes up whenever anything is to be drawn elsewhere
  }

  /** Show all that is ever known. */
  fit() {
    const height = Math.min(this.size.height, ...[...this.stages.values()].map((one) => one.height));
    const [[before, above, wide, high], [width]] = this.covers;
    const [{ start }] = this.missions;
    const seen = this.missions.flatMap(({ sightings }) => sightings.box ?? []);
    const whole = { left: 0, right: start.width - 1, low: 0, high: start.height - 1 };
    const [west, low, across, up] = around((seen.length ? seen : [whole]).map(boxOf));
    /** @type {(corner: Point) => number} */
    const scaleAt = ([x, y]) =>
      Math.max(FURTHEST, Math.min((width - x - 2 * MARGIN) / across, (height - y - 2 * MARGIN) / up));
    /** @type {Point[]} */
    const [below, beside] = [
      [0, above + high],
      [before + wide, 0],
    ];
    const [left, top] = scaleAt(below) >= BELOW * scaleAt(beside) ? below : beside;
    this.scale = scaleAt([left, top]);
    this.left = (left + width - across * this.scale) / 2 - west * this.scale;
    this.top = (top + height + up * this.scale) / 2 + low * this.scale;
    this.fitted = true;
    this.version++;
  }

  /** Take the size of a canvas. `covers` are boxes that stand on it, at the top: the map is fitted below the first or
      beside it, left of the second, and no name is written under them. Of several canvases all covers count, and the
      map is fitted into the lowest one: a form may stand above it.
      @type {(canvas: object, width: number, height: number, covers: Box[]) => void} */
  resize(canvas, width, height, covers) {
    this.stages.set(canvas, { width, height, covers });
    const stages = [...this.stages.values()];
    const size = {
      width: Math.max(...stages.map((one) => one.width)),
      height: Math.max(...stages.map((one) => one.height)),
    };
    const dx = (size.width - this.size.width) / 2;
    const dy = (size.height - this.size.height) / 2;
    this.size = size;
    this.covers = stages[0].covers.map((_cover, k) => around(stages.map((one) => one.covers[k])));
    if (this.fitted) this.fit();
    else this.pan(dx, dy);
  }

  /** Come closer to a point of the canvas, which stays where it is.
      @type {(factor: number, x?: number, y?: number) => void} */
  zoom(factor, x = this.size.width / 2, y = this.size.height / 2) {
    const scale = Math.min(CLOSEST, Math.max(FURTHEST, this.scale * factor));
    this.left = x - ((x - this.left) * scale) / this.scale;
    this.top = y - ((y - this.top) * scale) / this.scale;
    this.scale = scale;
    this.fitted = false;
    this.version++;
  }

  /** @type {(dx: number, dy: number) => void} */
  pan(dx, dy) {
    this.left += dx;
    this.top += dy;
    this.fitted = false;
    this.version++;
  }

  /** Keep a robot in the middle; null: no more, and go `back` to what was looked at before.
      @type {(robot: Robot | null, back: boolean) => void} */
  follow(robot, back) {
    const { scale, left, top, fitted } = this;
    if (robot && !this.followed) this.before = { scale, left, top, fitted };
    this.followed = robot;
    if (robot || !back || !this.before) return;
    if (this.before.fitted) this.fit();
    else Object.assign(this, this.before);
    this.version++;
  }

  /** Put a place in the middle, from near enough to see it.
      @type {(x: number, y: number) => void} */
  centre(x, y) {
    this.scale = Math.max(this.scale, FOLLOWED * this.missions[0].resolution);
    const { width, height } = this.size;
    const left = width / 2 - (x + 0.5) * this.scale;
    const top = height / 2 + (y + 0.5) * this.scale;
    if (Math.abs(left - this.left) < 0.25 && Math.abs(top - this.top) < 0.25) return;
    this.left = left;
    this.top = top;
    this.fitted = false;
    this.version++;
  }

  /** The point of the canvas of a place in cells.
      @type {(x: number, y: number) => Point} */
  point(x, y) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  /** The place in cells of a point of the canvas; whole numbers are the middles of cells.
      @type {(px: number, py: number) => Cell} */
  place(px, py) {
    return [(px - this.left) / this.scale - 0.5, (this.top - py) / this.scale - 0.5];
  }

  /** @type {(px: number, py: number) => Cell} */
  cell(px, py) {
    return [Math.floor((px - this.left) / this.scale), Math.floor((this.top - py) / this.scale)];
  }
}

/** @type {(extent: Extent) => Box} */
function boxOf({ left, right, low, high }) {
  return [left, low, right - left + 1, high - low + 1];
}

/** The least box around some.
    @type {(boxes: Box[]) => Box} */
function around(boxes) {
  const left = Math.min(...boxes.map(([x]) => x));
  const top = Math.min(...boxes.map(([, y]) => y));
  const right = Math.max(...boxes.map(([x, , wide]) => x + wide));
  const bottom = Math.max(...boxes.map(([, y, , high]) => y + high));
  return [left, top, right - left, bottom - top];
}
