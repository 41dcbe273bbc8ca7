/* The timeline: the known area over time, and below it a lane for each robot with what it did when.

   Closed, a robot is a thin line; open, its bars have room for names. Of several missions the curves are compared, and
   the lanes stand one under the other when open. What depends on no moment is drawn once, on a canvas of its own. */

import { ahead, planEnd } from "#log/ahead.js";
import { colour, inks, robotColours, sideColour } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { area, clock, share, tickStep } from "#text/format.js";
import { lastAt } from "#log/history.js";
import { drawPlans } from "#draw/planlanes.js";
import { bar, cross, line, rover, vehicle } from "#draw/shapes.js";
import { ofPlanned, ofSegment, waiting } from "#text/why.js";
import { newsLong } from "#text/news.js";

const AXIS = 23,
  HEAD = 15,
  RIGHT = 12;
const OPEN = { top: 50, tallest: 19, lowest: 11, room: 260 },
  CLOSED = { top: 22, tallest: 12, lowest: 6, room: 110 }; // points of the page: a lane, and all lanes together if they can
const COMPARED = 100; // points of the page: the height of curves that are compared
const FEW = 9; // points of a lane from which on its robot is named
const FONT = "system-ui, 'DejaVu Sans', sans-serif";
const PLAN_ROOM_MS = 2000; // beyond the end of the plan
const AHEAD = 1.15; // how much longer than a mission that goes on its axis is

export class Lanes {
  constructor(missions, names) {
    this.missions = missions;
    this.names = names;
    this.still = make("canvas", { class: "still", "aria-hidden": "true" });
    this.canvas = make("canvas", {
      class: "moment",
      role: "img",
      "aria-label": "Timeline: known area, and what each robot does when",
    });
    this.element = make("div", { class: "lanes" }, this.still, this.canvas);
    this.isOpen = false;
    this.rows = this.layOut();
    this.shown = "";
    this.showAll();
  }

  /** Each row with its mission, its robot (or none: a headline) and where it begins. */
  layOut() {
    const robots = this.missions.reduce((sum, mission) => sum + mission.robots.length, 0),
      rows = [],
      size = this.isOpen ? OPEN : CLOSED;
    this.lane = Math.max(size.lowest, Math.min(size.tallest, Math.floor(size.room / robots)));
    this.top = this.compares ? COMPARED : size.top;
    let { top } = this;
    if (this.isOpen || !this.compares) {
      this.missions.forEach((mission, i) => {
        if (this.compares) {
          rows.push({ mission, i, robot: null, top, high: HEAD });
          top += HEAD;
        }
        for (const robot of mission.robots) {
          rows.push({ mission, i, robot, top, high: this.lane });
          top += this.lane;
        }
      });
    }
    this.bottom = top;
    return rows;
  }

  /** Give bars room for names, or take it back. */
  toggle() {
    this.isOpen = !this.isOpen;
    this.rows = this.layOut();
    this.restyle();
  }

  get right() {
    return this.width - RIGHT;
  }
  get compares() {
    return this.missions.length > 1;
  }
  get begin() {
    return Math.min(...this.missions.map((mission) => mission.from));
  }
  get end() {
    return Math.max(...this.missions.map((mission) => mission.to));
  }

  showAll() {
    this.from = this.begin;
    const open = this.missions.filter((mission) => !mission.ended),
      plans = open.map((mission) => mission.plans.at(-1));
    const until = Math.max(this.end, ...plans.filter(Boolean).map(planEnd));
    const room = Math.max(this.from + (this.end - this.from) * AHEAD + 5000, until + PLAN_ROOM_MS);
    this.to = open.length ? room : this.end;
    this.whole = true;
  }

  x(t) {
    return this.gutter + ((t - this.from) / (this.to - this.from)) * (this.width - this.gutter - RIGHT);
  }
  time(x) {
    return this.from + ((x - this.gutter) / (this.width - this.gutter - RIGHT)) * (this.to - this.from);
  }

  /** Look closer at the time around x. */
  zoom(factor, x) {
    const t = Math.min(this.end, Math.max(this.begin, this.time(x))),
      most = this.end - this.begin;
    const span = Math.min(most, Math.max(2000, (this.to - this.from) / factor)),
      part = (t - this.from) / (this.to - this.from);
    this.show(t - part * span, span);
    this.whole = span === most;
  }

  show(from, span) {
    this.from = Math.min(Math.max(from, this.begin), this.end - span);
    this.to = this.from + span;
    this.restyle();
  }

  /** Keep the moment in sight while it moves. */
  follow(t) {
    const span = this.to - this.from;
    if (!this.whole && (t < this.from || t > this.to)) this.show(t - span * 0.1, span);
  }

  /** Draw what depends on no moment; needed after a change of size, theme or span, and when a mission has grown. */
  restyle() {
    this.width = this.element.clientWidth;
    if (!this.width) return;
    this.height = this.bottom + AXIS;
    this.element.style.height = `${this.height}px`;
    fitted(this.canvas, this.width, this.height);
    this.ink = inks();
    this.gutter = this.gutterWide();
    this.colours = this.missions.map(robotColours);
    this.curves = this.missions.map((_, i) => (this.compares ? colour(sideColour(i)) : this.ink.ink));
    this.g = fitted(this.still, this.width, this.height);
    this.g.fillStyle = this.ink.card;
    this.g.fillRect(0, 0, this.width, this.height);
    this.drawAxis();
    this.drawAreas();
    for (const row of this.rows) {
      if (row.robot) this.drawLane(row);
      else this.drawHead(row);
    }
    this.shown = "";
  }

  /** As wide as the names of robots need it, or of missions with what they know; at most a part of the timeline. */
  gutterWide() {
    const g = this.still.getContext("2d"),
      [{ robots }] = this.missions;
    const names = this.compares ? this.names : robots.map((robot) => robot.name);
    g.font = `600 11px ${FONT}`;
    const widest = Math.max(...names.map((name) => g.measureText(name).width)),
      more = this.compares ? 100 : 36;
    return Math.ceil(Math.min(this.width * 0.42, Math.max(this.width < 600 ? 84 : 104, widest + more)));
  }

  drawAxis() {
    const { g } = this,
      step = tickStep(this.to - this.from, this.width - this.gutter, 56);
    g.font = `11px ${FONT}`;
    g.textAlign = "center";
    g.textBaseline = "alphabetic";
    for (let t = Math.ceil(this.from / step) * step; t <= this.to; t += step) {
      const x = Math.round(this.x(t)) + 0.5;
      line(
        g,
        [
          [x, 4],
          [x, this.bottom + 3],
        ],
        this.ink.line,
        1,
      );
      g.fillStyle = this.ink.dim;
      if (x < this.width - 20) g.fillText(clock(t, step < 1000), x, this.height - 3);
    }
    g.textAlign = "left";
    g.fillText("plans", 4, this.bottom + 11);
    const { curves, compares, ink } = this;
    this.missions.forEach((mission, i) => this.drawPlanTicks(mission, compares ? curves[i] : ink.accent));
  }

  drawPlanTicks(mission, ink) {
    this.g.fillStyle = ink;
    for (const t of mission.planTimes) {
      if (t < this.from || t > this.to) continue;
      this.g.fillRect(this.x(t) - 0.75, this.bottom + 2, 1.5, 6);
    }
  }

  drawAreas() {
    const { g, gutter } = this;
    this.most = Math.max(1, ...this.missions.map((mission) => mission.openArea(mission.to)));
    g.save();
    g.beginPath();
    g.rect(gutter, 0, this.width - gutter - RIGHT, this.top - 4);
    g.clip();
    this.missions.forEach((mission, i) => this.drawArea(mission, this.curves[i]));
    g.restore();
    g.fillStyle = this.ink.dim;
    g.textBaseline = "alphabetic";
    g.fillText("known area", 4, 15);
    if (this.isOpen && !this.compares) g.fillText(`of ${area(this.most)}`, 4, 43);
  }

  areaY(value) {
    return this.top - 5 - (value / this.most) * (this.top - 10);
  }

  /** What is known at t: of missions that are compared and have ended, as a share of the most that one came to know. */
  known(mission, t) {
    const value = mission.openArea(t);
    return this.compares && this.missions.every((one) => one.ended) ? share(value / this.most) : area(value);
  }

  drawArea(mission, ink) {
    const { g } = this,
      { areaTimes, areas } = mission.sightings,
      cell = mission.resolution ** 2;
    const first = Math.max(lastAt(areaTimes, this.from), 0),
      last = Math.max(lastAt(areaTimes, this.to), first);
    const stride = Math.max(1, Math.floor((last - first) / 3000)),
      right = this.x(Math.min(this.to, mission.to));
    const points = [[this.x(areaTimes[first]), this.areaY(areas[first] * cell)]];
    for (let i = first; i <= last; i += stride) {
      const at = Math.min(i + stride, last),
        x = this.x(areaTimes[at]);
      points.push([x, points[points.length - 1][1]], [x, this.areaY(areas[at] * cell)]);
    }
    points.push([right, points[points.length - 1][1]]);
    line(g, points, ink, this.compares ? 2.25 : 1.75);
    if (this.compares) return; // the areas below several would hide each other
    g.lineTo(right, this.top);
    g.lineTo(points[0][0], this.top);
    g.globalAlpha = 0.12;
    g.fillStyle = ink;
    g.fill();
    g.globalAlpha = 1;
  }

  drawHead({ i, top }) {
    const { g } = this;
    line(
      g,
      [
        [5, top + 8],
        [21, top + 8],
      ],
      this.curves[i],
      3,
    );
    g.fillStyle = this.ink.ink;
    g.font = `600 11px ${FONT}`;
    g.textBaseline = "middle";
    g.fillText(this.names[i], 28, top + HEAD / 2 + 1);
  }

  drawLane({ mission, i, robot, top }) {
    const { g, gutter, lane } = this,
      middle = top + lane / 2,
      right = this.width - RIGHT,
      own = this.colours[i].get(robot.name);
    line(
      g,
      [
        [4, top + 0.5],
        [right, top + 0.5],
      ],
      this.ink.line,
      1,
    );
    if (robot.carrier) vehicle(g, 11, middle, Math.min(5.5, lane / 2.6), 0, own, 0, [], this.ink);
    else rover(g, 18, middle, Math.min(4, lane / 3.2), 0, own, this.ink);
    g.fillStyle = this.ink.ink;
    g.textBaseline = "middle";
    g.font = `${robot.carrier ? "600 " : ""}${Math.min(11, lane)}px ${FONT}`;
    if (lane >= FEW) {
      g.fillText(cut(g, robot.name, gutter - (robot.carrier ? 24 : 29)), robot.carrier ? 22 : 28, middle + 0.5);
    }
    g.save();
    g.beginPath();
    g.rect(gutter, top, right - gutter, lane);
    g.clip();
    for (const { start, to, carrier } of robot.aboard) {
      line(
        g,
        [
          [this.x(start), middle],
          [this.x(to ?? mission.to), middle],
        ],
        this.colours[i].get(carrier),
        2,
      );
    }
    for (const segment of robot.segments) this.drawSegment(mission, segment, top);
    for (const { start } of robot.losses) cross(g, this.x(start), middle, 5, this.ink);
    g.restore();
  }

  drawSegment(mission, { start, to, action, end }, top) {
    const x = this.x(start),
      wide = Math.max(1, this.x(to ?? mission.to) - x - 0.5),
      { g, lane, gutter } = this;
    if (to === start || x > this.width || x + wide < gutter) return;
    const gap = lane > 10 ? 2 : 1;
    bar(g, x, top + gap, wide, lane - 2 * gap, action.name, end, this.ink);
    if (wide < 14 || action.carrier !== null) return;
    const left = Math.max(x, gutter) + 3,
      ink = end === "done" || end === null ? "#0b0d10" : this.ink.ink;
    this.writeIn(g, left, x + wide - left - 3, top, mission.places.label(action.place), ink);
  }

  /** Draw the moment: cursor, what is known by then, what is chosen (a robot and a place for each mission), and the plan in
      force. */
  draw(t, chosen) {
    if (!this.width) return;
    const x = Math.round(2 * this.x(t)) / 2,
      shown = `${x} ${this.missions.map((mission) => mission.planIndex(t))} ${chosen.map(({ robot, place }) => `${robot?.name} ${place}`)}`;
    if (shown === this.shown) return;
    this.shown = shown;
    this.t = t;
    const g = this.canvas.getContext("2d");
    g.clearRect(0, 0, this.width, this.height);
    drawPlans(g, this);
    for (const row of this.rows) if (row.robot) this.drawChosen(g, row, chosen[row.i]);
    g.font = `600 11px ${FONT}`;
    g.textBaseline = "alphabetic";
    this.missions.forEach((mission, i) => {
      g.fillStyle = this.ink.ink;
      if (this.compares) this.drawKnown(g, mission, i, t);
      else if (this.isOpen) g.fillText(this.known(mission, t), 4, 29);
      if (t < this.from || t > this.to) return;
      g.beginPath();
      g.arc(x, this.areaY(mission.openArea(t)), 3.5, 0, 7);
      g.fillStyle = this.curves[i];
      g.fill();
    });
    g.fillStyle = this.ink.ink;
    if (t >= this.from && t <= this.to) g.fillRect(x - 0.75, 0, 1.5, this.bottom + 4);
  }

  /** Write what the i-th of some missions knows at t. */
  drawKnown(g, mission, i, t) {
    const y = 30 + 14 * i,
      text = this.known(mission, t),
      right = this.gutter - 8;
    line(
      g,
      [
        [5, y - 4],
        [21, y - 4],
      ],
      this.curves[i],
      3,
    );
    g.textAlign = "right";
    g.fillText(text, right, y);
    g.textAlign = "left";
    g.fillText(cut(g, this.names[i], right - 34 - g.measureText(text).width), 28, y);
  }

  /** Mark the lane of the chosen robot, and all that is done at the chosen place. */
  drawChosen(g, { mission, robot, top }, chosen) {
    g.fillStyle = g.strokeStyle = this.ink.accent;
    if (robot === chosen.robot) {
      g.globalAlpha = 0.14;
      g.fillRect(0, top, this.width, this.lane);
      g.globalAlpha = 1;
    }
    g.lineWidth = 2;
    for (const { action, start, to } of chosen.place ? robot.segments : []) {
      const x = Math.max(this.gutter, this.x(start)),
        end = Math.min(this.width - RIGHT, this.x(to ?? mission.to));
      if (action.place === chosen.place && end > this.gutter && start !== to) {
        g.strokeRect(x, top + 1, Math.max(2, end - x), this.lane - 2);
      }
    }
  }

  /** The plan to show: that of the moment. Where the lanes are closed, what came later shows more. */
  planned(mission) {
    const isOver = mission.ended && (this.t >= mission.to || !this.isOpen);
    return isOver ? null : mission.planAt(this.t);
  }

  /** Write a text in a lane where all of it has room. Returns how wide it is, with a space; 0 if it has none. */
  writeIn(g, x, room, top, text, ink) {
    g.font = `10px ${FONT}`;
    const { width } = g.measureText(text);
    if (this.lane < 14 || width > room) return 0;
    g.fillStyle = ink;
    g.textBaseline = "middle";
    g.fillText(text, x, top + this.lane / 2 + 0.5);
    return width + 4;
  }

  /** The row at a height, or undefined. */
  row(y) {
    return this.rows.find((row) => y >= row.top && y < row.top + row.high);
  }

  /** What the plan that is shown holds for the robot of a row at a time; null: nothing, undefined: none is shown. */
  plannedAt(t, { mission, robot }) {
    const plan = t > this.t ? this.planned(mission) : null;
    if (!plan || t > planEnd(plan)) return undefined;
    const isThen = ({ action, to, wait }) => (wait?.from ?? action.start_ms) <= t && t <= to;
    return ahead(plan, robot, this.t).find(isThen) ?? null;
  }

  /** What of a row is at a time: its robot, with the place of what it does then. */
  thingAt(x, row) {
    const t = this.time(x),
      planned = this.plannedAt(t, row);
    if (x >= this.gutter && planned !== undefined) return { robot: row.robot, place: planned?.action.place ?? null };
    const isThen = (one) => one.start <= t && t <= (one.to ?? row.mission.to) && one.start !== one.to;
    const segment = x < this.gutter ? null : row.robot.segments.find(isThen);
    return { robot: row.robot, place: segment ? segment.action.place : null };
  }

  /** The story of a point of the timeline; null for nothing. */
  story(x, y) {
    const t = this.time(x),
      row = this.row(y);
    if (x < this.gutter) return row && row.robot ? { title: row.robot.name, lines: ["click to choose it"] } : null;
    const knows = (mission, i) => `${this.names[i]}: ${this.known(mission, t)} known`;
    if (y < this.top) return { title: clock(t), lines: this.missions.map(knows) };
    if (!row) return this.planStory(x);
    if (!row.robot) return null;
    const { mission, robot } = row,
      slack = (this.to - this.from) / this.width;
    const planned = this.plannedAt(t, row);
    if (planned !== undefined) return planned && ofPlanned(mission, this.planned(mission), planned, robot);
    const segment = robot.segments.find((one) => one.start - slack <= t && t <= (one.to ?? mission.to) + slack);
    if (segment) return ofSegment(mission, segment, robot);
    const span = robot.aboard.find((one) => one.start <= t && t <= (one.to ?? mission.to));
    return { title: robot.name, lines: span ? [`aboard ${span.carrier}`] : waiting(mission, robot, t) };
  }

  planStory(x) {
    for (const mission of this.missions) {
      const near = mission.plans.filter((plan) => Math.abs(this.x(plan.t_ms) - x) <= 4).pop();
      if (near) return { title: `Plan ${near.revision} at ${clock(near.t_ms)}`, lines: [newsLong(mission, near)] };
    }
    return null;
  }
}

/** As much of a text as there is room for. */
function cut(g, text, room) {
  if (g.measureText(text).width <= room) return text;
  let short = text;
  while (short && g.measureText(`${short}…`).width > room) short = short.slice(0, -1);
  return short ? `${short}…` : "";
}
