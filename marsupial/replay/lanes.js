/* The timeline: the known area over time, and below it a lane for each robot with what it did when. */

import { lastAt } from "./history.js";
import { cross, round, themeColour } from "./map.js";

const LANE = { top: 56, height: 20, gutter: 104, right: 12, axis: 22 };

export class Lanes {
  constructor(canvas, mission, colours) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.mission = mission;
    this.colours = colours;
    this.still = document.createElement("canvas");
    this.showAll();
  }

  showAll() { this.from = this.mission.from; this.to = this.mission.to; }

  get width() { return this.canvas.clientWidth; }
  get height() { return LANE.top + this.mission.robots.length * LANE.height + LANE.axis; }
  get bottom() { return this.height - LANE.axis; }
  x(t) { return LANE.gutter + (t - this.from) / (this.to - this.from) * (this.width - LANE.gutter - LANE.right); }
  time(x) { return this.from + (x - LANE.gutter) / (this.width - LANE.gutter - LANE.right) * (this.to - this.from); }

  /** Look closer at the time around x. */
  zoom(factor, x) {
    const { from, to } = this.mission, t = Math.min(to, Math.max(from, this.time(x)));
    const span = Math.min(to - from, Math.max(2000, (this.to - this.from) / factor));
    const share = (t - this.from) / (this.to - this.from);
    this.show(t - share * span, span);
  }

  show(from, span) {
    this.from = Math.min(Math.max(from, this.mission.from), this.mission.to - span);
    this.to = this.from + span;
    this.restyle();
  }

  /** Draw all that does not depend on the moment; wanted after a change of size, theme or span. */
  restyle() {
    const ratio = window.devicePixelRatio || 1;
    this.canvas.style.height = `${this.height}px`;
    for (const canvas of [this.canvas, this.still]) {
      canvas.width = Math.max(1, Math.round(this.width * ratio));
      canvas.height = Math.max(1, Math.round(this.height * ratio));
    }
    this.ink = Object.fromEntries(
      ["card", "line", "ink", "dim", "accent", "bad", "move", "explore", "dock", "undock", "on-bar"].map((name) => [name, themeColour(name)]));
    const g = this.still.getContext("2d");
    this.g = g;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = this.ink.card;
    g.fillRect(0, 0, this.width, this.height);
    this.drawAxis();
    this.drawCoverage();
    this.mission.robots.forEach((robot, i) => this.drawLane(robot, LANE.top + i * LANE.height));
  }

  drawAxis() {
    const { g } = this, span = this.to - this.from;
    const steps = [100, 200, 500, 1000, 2000, 5000, 10000, 15000, 30000, 60000, 120000, 300000, 600000, 1200000, 1800000, 3600000, 7200000];
    const step = steps.find((one) => one / span * (this.width - LANE.gutter) >= 64) || 14400000;
    g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    g.textAlign = "center";
    g.textBaseline = "alphabetic";
    g.lineWidth = 1;
    for (let t = Math.ceil(this.from / step) * step; t <= this.to; t += step) {
      const x = Math.round(this.x(t)) + 0.5;
      g.strokeStyle = this.ink.line;
      g.beginPath();
      g.moveTo(x, 4);
      g.lineTo(x, this.bottom + 3);
      g.stroke();
      g.fillStyle = this.ink.dim;
      if (x < this.width - 20) g.fillText(clock(t, step < 1000), x, this.height - 3);
    }
    g.textAlign = "left";
    g.fillText("plans", 4, this.bottom + 10);
    g.fillStyle = this.ink.accent;
    for (const t of this.mission.planTimes) {
      if (t < this.from || t > this.to) continue;
      const x = this.x(t);
      g.beginPath();
      g.moveTo(x, this.bottom + 1);
      g.lineTo(x + 3, this.bottom + 7);
      g.lineTo(x - 3, this.bottom + 7);
      g.fill();
    }
  }

  drawCoverage() {
    const { g } = this, { areaTimes: coverTimes, areas: cover } = this.mission.sightings;
    const most = Math.max(1, cover[cover.length - 1]), low = LANE.top - 8, high = 8;
    const y = (cells) => low - cells / most * (low - high);
    const first = Math.max(lastAt(coverTimes, this.from), 0), last = Math.max(lastAt(coverTimes, this.to), first);
    const right = this.x(this.to), stride = Math.max(1, Math.floor((last - first) / 4000));
    g.save();
    g.beginPath();
    g.rect(LANE.gutter, 0, right - LANE.gutter, low + 1);
    g.clip();
    g.beginPath();
    g.moveTo(this.x(coverTimes[first]), y(cover[first]));
    for (let i = first; i < last; i += stride) {
      g.lineTo(this.x(coverTimes[i]), y(cover[i]));
      g.lineTo(this.x(coverTimes[Math.min(i + stride, last)]), y(cover[i]));
    }
    g.lineTo(this.x(coverTimes[last]), y(cover[last]));
    g.lineTo(right, y(cover[last]));
    g.strokeStyle = this.ink.explore;
    g.lineWidth = 1.75;
    g.stroke();
    g.lineTo(right, low);
    g.lineTo(this.x(coverTimes[first]), low);
    g.globalAlpha = 0.16;
    g.fillStyle = this.ink.explore;
    g.fill();
    g.restore();
    g.fillStyle = this.ink.dim;
    g.textBaseline = "alphabetic";
    g.fillText("known area", 4, 18);
    g.fillText(`of ${round(most * this.mission.resolution ** 2)} m²`, 4, 46);
    this.coverY = y;
  }

  drawLane(robot, top) {
    const { g } = this, middle = top + LANE.height / 2, right = this.width - LANE.right;
    g.strokeStyle = this.ink.line;
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(4, top + 0.5);
    g.lineTo(right, top + 0.5);
    g.stroke();
    g.fillStyle = this.colours.get(robot.name);
    g.beginPath();
    g.arc(robot.carrier ? 10 : 18, middle, robot.carrier ? 5 : 3.5, 0, 7);
    g.fill();
    g.fillStyle = this.ink.ink;
    g.textBaseline = "middle";
    g.font = `${robot.carrier ? "600 " : ""}11px system-ui, 'DejaVu Sans', sans-serif`;
    g.fillText(clipped(g, robot.name, LANE.gutter - 32), robot.carrier ? 20 : 27, middle + 0.5);
    g.save();
    g.beginPath();
    g.rect(LANE.gutter, top, right - LANE.gutter, LANE.height);
    g.clip();
    for (const span of robot.aboard) this.drawAboard(span, middle);
    for (const segment of robot.segments) if ((segment.to ?? this.mission.to) > segment.start) this.drawSegment(segment, top);
    if (robot.lost) cross(g, this.x(robot.lost.t_ms), middle, 5, this.ink.bad, 2.5);
    g.restore();
  }

  drawAboard(span, middle) {
    const { g } = this;
    g.strokeStyle = this.colours.get(span.carrier);
    g.lineWidth = 2;
    g.globalAlpha = 0.55;
    g.beginPath();
    g.moveTo(this.x(span.start), middle);
    g.lineTo(this.x(span.to ?? this.mission.to), middle);
    g.stroke();
    g.globalAlpha = 1;
  }

  drawSegment(segment, top) {
    const x = this.x(segment.start), wide = Math.max(1, this.x((segment.to ?? this.mission.to)) - x - 0.5);
    if (x > this.width || x + wide < LANE.gutter) return;
    const { g } = this, high = LANE.height - 5, y = top + 3;
    bar(g, x, y, wide, high, this.ink[segment.action.name], segment.end, this.ink.bad);
    if (wide < 14) return;
    const left = Math.max(x, LANE.gutter), label = segment.action.place;
    g.font = "10.5px system-ui, 'DejaVu Sans', sans-serif";
    const room = g.measureText(label).width;
    if (room > x + wide - left - 6) return;
    g.fillStyle = this.ink[segment.action.name];
    if (segment.end !== "done" && segment.end !== null) g.fillRect(left + 1.5, y + 2, room + 4, high - 4);
    g.fillStyle = this.ink["on-bar"];
    g.fillText(label, left + 3.5, top + LANE.height / 2 + 1);
  }

  /** Draw the moment: cursor, what is known by then, and the plan in force as thin lines under the lanes. */
  draw(t) {
    const g = this.context, ratio = window.devicePixelRatio || 1;
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.drawImage(this.still, 0, 0);
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawPlanned(g, t);
    if (t < this.from || t > this.to) return;
    const x = this.x(t), cells = this.mission.openArea(t) / this.mission.resolution ** 2;
    g.fillStyle = this.ink.ink;
    g.fillRect(x - 0.75, 0, 1.5, this.bottom + 4);
    g.beginPath();
    g.arc(x, this.coverY(cells), 3.5, 0, 7);
    g.fillStyle = this.ink.explore;
    g.fill();
    g.fillStyle = this.ink.ink;
    g.font = "600 11px system-ui, 'DejaVu Sans', sans-serif";
    g.textBaseline = "alphabetic";
    g.fillText(`${round(this.mission.openArea(t))}`, 4, 32);
  }

  drawPlanned(g, t) {
    const plan = this.mission.plans[this.mission.planIndex(t)];
    if (!plan) return;
    g.save();
    g.beginPath();
    g.rect(LANE.gutter, 0, this.width - LANE.gutter - LANE.right, this.bottom);
    g.clip();
    this.mission.robots.forEach((robot, i) => {
      for (const action of plan.actions) {
        if (action.robot !== robot.name && action.carrier !== robot.name) continue;
        const x = this.x(action.start_ms), y = LANE.top + (i + 1) * LANE.height - 2.5;
        g.fillStyle = this.ink[action.name];
        g.fillRect(x, y, Math.max(1, this.x(action.start_ms + action.duration_ms) - x - 0.5), 2.5);
      }
    });
    g.restore();
  }

  /** Keep the moment in sight while it moves. */
  follow(t) {
    const span = this.to - this.from;
    if (t < this.from || t > this.to) this.show(t - span * 0.1, span);
  }

  textAt(x, y) {
    const robot = this.mission.robots[Math.floor((y - LANE.top) / LANE.height)];
    if (x < LANE.gutter || y < 0) return null;
    const t = this.time(x);
    if (y < LANE.top) return `${clock(t)}: ${round(this.mission.openArea(t))} m² known`;
    if (!robot) {
      const near = this.mission.plans.filter((plan) => Math.abs(this.x(plan.t_ms) - x) <= 4).pop();
      return near ? `plan ${near.revision} at ${clock(near.t_ms)}\n${near.trigger}` : null;
    }
    const slack = (this.to - this.from) / this.width;
    const segment = robot.segments.find((one) => one.start - slack <= t && t <= one.to + slack);
    if (segment) return describeSegment(segment, robot);
    const span = robot.aboard.find((one) => one.start <= t && t <= one.to);
    return span ? `${robot.name}\naboard ${span.carrier}` : `${robot.name}\nwaits`;
  }
}

const ENDS = { done: "done", superseded: "superseded: the next plan wants something else", blocked: "blocked: the route is no longer passable", failed: "its robots could not do it", lost: "a robot was lost" };

function describeSegment(segment, robot) {
  const { action } = segment, seconds = (((segment.to ?? this.mission.to) - segment.start) / 1000).toFixed(1);
  const partner = action.carrier === null ? "" : ` with ${action.carrier === robot.name ? action.robot : action.carrier}`;
  const end = segment.end === null ? "still running when the log stops" : ENDS[segment.end];
  return `${robot.name}: ${action.name} ${action.place}${partner}\n${clock(segment.start, true)} to ${clock((segment.to ?? this.mission.to), true)} (${seconds} s), plan ${segment.revision}\n${end}`;
}

/** One bar of a lane; hatched where the action was not finished. */
export function bar(g, x, y, wide, high, colour, end, bad) {
  g.fillStyle = colour;
  if (end === "done" || end === null) {
    g.beginPath();
    g.roundRect(x, y, wide, high, Math.min(3, wide / 2));
    g.fill();
    return;
  }
  g.save();
  g.beginPath();
  g.roundRect(x, y, wide, high, Math.min(3, wide / 2));
  g.clip();
  g.globalAlpha = 0.35;
  g.fillRect(x, y, wide, high);
  g.globalAlpha = 1;
  g.strokeStyle = end === "superseded" ? colour : bad;
  g.lineWidth = 1.6;
  g.beginPath();
  for (let k = Math.floor(-high / 5); k * 5 < wide; k++) {
    g.moveTo(x + k * 5, y + high);
    g.lineTo(x + k * 5 + high, y);
  }
  g.stroke();
  g.lineWidth = end === "superseded" ? 1 : 2.5;
  g.strokeRect(x, y, wide, high);
  g.restore();
}

export function clipped(g, text, room) {
  if (g.measureText(text).width <= room) return text;
  let short = text;
  while (short && g.measureText(`${short}…`).width > room) short = short.slice(0, -1);
  return short ? `${short}…` : "";
}

/** Milliseconds as h:mm:ss, with tenths where asked. */
export function clock(ms, tenths = false) {
  const whole = tenths ? Math.floor(ms / 100) / 10 : Math.floor(ms / 1000);
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60, seconds = whole - 3600 * hours - 60 * minutes;
  const text = (tenths ? seconds.toFixed(1) : String(seconds)).padStart(tenths ? 4 : 2, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${text}` : `${minutes}:${text}`;
}
