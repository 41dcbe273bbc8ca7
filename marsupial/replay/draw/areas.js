/* Curves of the known area over time, at the top of the timeline. */

import { cut, FONT } from "#draw/labels.js";
import { line } from "#draw/shapes.js";
import { lastAt } from "#log/history.js";
import { area, share } from "#text/format.js";

const MOST_STEPS = 3000; // of a curve
/** Points of the page: above the names of missions, and each of them. */
export const NAMES = 20;
export const NAME = 14;

export class Areas {
  /** @param {Lanes} lanes */
  constructor(lanes) {
    this.lanes = lanes;
    this.most = 1; // square metres
  }

  /** Draw the curves.
      @type {(g: Context) => void} */
  draw(g) {
    const { missions, gutter, right, top, ink, isOpen, compares } = this.lanes;
    this.most = Math.max(1, ...missions.map((mission) => mission.openArea(mission.to)));
    g.save();
    g.beginPath();
    g.rect(gutter, 0, right - gutter, top - 4);
    g.clip();
    missions.forEach((mission, i) => this.drawCurve(g, mission, i));
    g.restore();
    g.fillStyle = ink.dim;
    g.textBaseline = "alphabetic";
    g.fillText("known area", 4, 15);
    if (isOpen && !compares) g.fillText(`of ${area(this.most)}`, 4, 43);
  }

  /** @type {(value: number) => number} */
  y(value) {
    const { top } = this.lanes;
    return top - 5 - (value / this.most) * (top - 10);
  }

  /** What is known at t: of missions that are compared and have ended, as a share of the most that one came to know.
      @type {(mission: Mission, t: number) => string} */
  known(mission, t) {
    const { compares, missions } = this.lanes;
    const value = mission.openArea(t);
    return compares && missions.every((one) => one.ended) ? share(value / this.most) : area(value);
  }

  /** @type {(g: Context, mission: Mission, i: number) => void} */
  drawCurve(g, mission, i) {
    const { lanes } = this;
    const { areaTimes, areas } = mission.sightings;
    const cell = mission.resolution ** 2;
    const first = Math.max(lastAt(areaTimes, lanes.from), 0);
    const last = Math.max(lastAt(areaTimes, lanes.to), first);
    const stride = Math.max(1, Math.floor((last - first) / MOST_STEPS));
    const right = lanes.x(Math.min(lanes.to, mission.to));
    const left = lanes.x(areaTimes[first]);
    let y = this.y(areas[first] * cell);
    /** @type {Point[]} */
    const points = [[left, y]];
    for (let k = first; k <= last; k += stride) {
      const at = Math.min(k + stride, last);
      const x = lanes.x(areaTimes[at]);
      points.push([x, y]);
      y = this.y(areas[at] * cell);
      points.push([x, y]);
    }
    points.push([right, y]);
    line(g, points, lanes.curves[i], lanes.compares ? 2.25 : 1.75);
    if (lanes.compares) return; // the areas below several would hide each other
    g.lineTo(right, lanes.top);
    g.lineTo(left, lanes.top);
    g.globalAlpha = 0.12;
    g.fillStyle = lanes.curves[i];
    g.fill();
    g.globalAlpha = 1;
  }

  /** Draw what is known at t, which is at x.
      @type {(g: Context, t: number, x: number) => void} */
  drawMoment(g, t, x) {
    const { missions, from, to, ink, curves, compares, isOpen } = this.lanes;
    g.font = `600 11px ${FONT}`;
    g.textBaseline = "alphabetic";
    missions.forEach((mission, i) => {
      g.fillStyle = ink.ink;
      if (compares) this.drawKnown(g, mission, i, t);
      else if (isOpen) g.fillText(this.known(mission, t), 4, 29);
      if (t < from || t > to) return;
      g.beginPath();
      g.arc(x, this.y(mission.openArea(t)), 3.5, 0, 7);
      g.fillStyle = curves[i];
      g.fill();
    });
  }

  /** Write what the i-th of some missions knows at t.
      @type {(g: Context, mission: Mission, i: number, t: number) => void} */
  drawKnown(g, mission, i, t) {
    const { names, curves, gutter } = this.lanes;
    const y = NAMES + 10 + NAME * i;
    const text = this.known(mission, t);
    const right = gutter - 8;
    line(
      g,
      [
        [5, y - 4],
        [21, y - 4],
      ],
      curves[i],
      3,
    );
    g.textAlign = "right";
    g.fillText(text, right, y);
    g.textAlign = "left";
    g.fillText(cut(g, names[i], right - 34 - g.measureText(text).width), 28, y);
  }
}
