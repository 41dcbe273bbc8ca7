/* Which part of the map is looked at: cells to points of the canvas and back, by zooming, panning and following.
   Missions in one frame share a camera, so that the same place is at the same point in each of their panes. */

const CLOSEST = 200,
  FURTHEST = 0.02; // points of the page a cell
const FOLLOWED = 14; // points a metre, at least, when a robot is followed
const MARGIN = 12; // points between what is fitted and the edge
const BELOW = 0.8; // as a share of the size that it has beside what covers the map, a map below it is as good: it is in the middle

/** Whether a cell of one mission is the same place in all of them. */
export function shareFrame(missions) {
  const frame = ({ start: { scenario, resolution_m, origin_m } }) => JSON.stringify([scenario, resolution_m, origin_m]);
  return new Set(missions.map(frame)).size === 1;
}

export class Camera {
  constructor(missions) {
    this.missions = missions;
    this.stages = new Map(); // [width, height, covers] of each canvas
    this.size = { width: 1, height: 1 };
    this.left = this.top = 0;
    this.covers = [
      [0, 0, 0, 0],
      [1, 0, 0, 0],
    ];
    this.followed = null; // a robot of one of the missions
    this.scale = 1;
    this.fitted = true;
    this.version = 0; // goes up whenever anything is to be drawn elsewhere
  }

  /** Show all that is ever known. */
  fit() {
    const {
      size: { height },
      covers: [[before, above, wide, high], [width]],
      missions: [{ start }],
    } = this;
    const seen = this.missions.map(({ sightings }) => sightings.box).filter(Boolean);
    const boxes = seen.length ? seen : [{ left: 0, right: start.width - 1, low: 0, high: start.height - 1 }];
    const [west, low, across, up] = around(
      boxes.map((box) => [box.left, box.low, box.right - box.left + 1, box.high - box.low + 1]),
    );
    const scale = ([left, top]) =>
      Math.max(FURTHEST, Math.min((width - left - 2 * MARGIN) / across, (height - top - 2 * MARGIN) / up));
    const below = [0, above + high],
      beside = [before + wide, 0],
      [left, top] = scale(below) >= BELOW * scale(beside) ? below : beside;
    this.scale = scale([left, top]);
    this.left = (left + width - across * this.scale) / 2 - west * this.scale;
    this.top = (top + height + up * this.scale) / 2 + low * this.scale;
    this.fitted = true;
    this.version++;
  }

  /** Take the size of a canvas. `covers` are boxes (left, top, width, height) that stand on it, at the top: the map is
      fitted below the first or beside it, left of the second, and no name is written under them. Of several canvases,
      which are of one size but for rounding, all covers count. */
  resize(canvas, ...stage) {
    this.stages.set(canvas, stage);
    const stages = [...this.stages.values()];
    const [width, height] = [0, 1].map((k) => Math.max(...stages.map((one) => one[k])));
    const dx = (width - this.size.width) / 2,
      dy = (height - this.size.height) / 2;
    this.size = { width, height };
    this.covers = stages[0][2].map((_, k) => around(stages.map(([, , covers]) => covers[k])));
    if (this.fitted) this.fit();
    else this.pan(dx, dy);
  }

  /** Come closer to a point of the canvas, which stays where it is. */
  zoom(factor, x = this.size.width / 2, y = this.size.height / 2) {
    const scale = Math.min(CLOSEST, Math.max(FURTHEST, this.scale * factor));
    this.left = x - ((x - this.left) * scale) / this.scale;
    this.top = y - ((y - this.top) * scale) / this.scale;
    this.scale = scale;
    this.fitted = false;
    this.version++;
  }

  pan(dx, dy) {
    this.left += dx;
    this.top += dy;
    this.fitted = false;
    this.version++;
  }

  /** Put a place in the middle, from near enough to see it. */
  centre(x, y) {
    this.scale = Math.max(this.scale, FOLLOWED * this.missions[0].resolution);
    const { width, height } = this.size,
      left = width / 2 - (x + 0.5) * this.scale,
      top = height / 2 + (y + 0.5) * this.scale;
    if (Math.abs(left - this.left) < 0.25 && Math.abs(top - this.top) < 0.25) return;
    this.left = left;
    this.top = top;
    this.fitted = false;
    this.version++;
  }

  /** The point of the canvas of a place in cells. */
  point(x, y) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  /** The place in cells of a point of the canvas; whole numbers are the middles of cells. */
  place(px, py) {
    return [(px - this.left) / this.scale - 0.5, (this.top - py) / this.scale - 0.5];
  }

  cell(px, py) {
    return [Math.floor((px - this.left) / this.scale), Math.floor((this.top - py) / this.scale)];
  }
}

/** The least box (left, top, width, height) around some. */
function around(boxes) {
  const left = Math.min(...boxes.map(([x]) => x)),
    top = Math.min(...boxes.map(([, y]) => y));
  const right = Math.max(...boxes.map(([x, , wide]) => x + wide));
  const bottom = Math.max(...boxes.map(([, y, , high]) => y + high));
  return [left, top, right - left, bottom - top];
}
