/* The timeline: the known area over time, and below it a lane for each robot with what it did when.

   Closed, a robot is a thin line; open, its bars have room for names. Of several missions the curves are compared, and
   the lanes stand one under the other when open. What depends on no moment is drawn once, on a canvas of its own. */

import { ahead, planEnd } from "#log/ahead.js";
import { Areas, NAME, NAMES } from "#draw/areas.js";
import { colour, colourOf, inks, robotColours, sideColour } from "#draw/colours.js";
import { contextOf, fitted, make } from "#draw/dom.js";
import { cut, FONT } from "#draw/labels.js";
import { drawPlans, drawWait } from "#draw/planlanes.js";
import { bar, CHOSEN, cross, line, rover, vehicle } from "#draw/shapes.js";
import { waits } from "#log/waits.js";
import { clock, tickStep } from "#text/format.js";

const AXIS = 23;
const HEAD = 15;
const RIGHT = 12;
/** Points of the page: curves, those that are compared, with room for six names; a lane, and all lanes together. */
const OPEN = { top: 50, compared: 64, tallest: 19, lowest: 11, room: Infinity };
const CLOSED = { top: 22, compared: 106, tallest: 12, lowest: 6, room: 110 };
const FEW = 9; // points of a lane from which on its robot is named
const PLAN_ROOM_MS = 2000; // beyond the end of the plan
const AHEAD = 1.15; // how much longer than a mission that goes on its axis is

export class Lanes {
  /** @param {Mission[]} missions
      @param {string[]} names */
  constructor(missions, names) {
    this.missions = missions;
    this.names = names;
    this.still = make("canvas", { class: "still", "aria-hidden": "true" });
    const label = "Timeline: known area, and what each robot does when";
    this.canvas = make("canvas", { class: "moment", role: "img", tabindex: "0", "aria-label": label });
    this.sheet = make("div", { class: "sheet" }, this.still, this.canvas); // stays in sight
    this.content = make("div", { class: "lanes" }, this.sheet);
    this.element = make("div", { class: "lanes-box", onscroll: () => this.scroll() }, this.content);
    this.g = contextOf(this.still);
    this.isOpen = false;
    this.compares = missions.length > 1;
    this.begin = Math.min(...missions.map((mission) => mission.from));
    this.t = this.begin;
    this.from = this.begin;
    this.to = this.end;
    this.whole = true; // all is shown, not a part of the time
    this.plans = true; // are shown
    this.width = 0;
    this.height = 0;
    this.gutter = 0; // the width of the names
    this.lane = 0; // the height of a lane
    this.top = 0; // of the first lane
    this.bottom = 0;
    /** @type {Row[]} */
    this.rows = [];
    /** @type {{ i: number, top: number }[]} */
    this.heads = []; // of missions
    this.ink = inks();
    /** @type {Colours[]} */
    this.colours = [];
    /** @type {string[]} */
    this.curves = []; // colours of the missions
    this.areas = new Areas(this);
    this.shown = ""; // what is drawn of the moment
    /** @type {Focus[]} */
    this.chosen = []; // in each mission
    this.showAll();
  }

  /** Place the lanes, and headlines where missions are compared or plans are shown. What has no room is scrolled to,
      below the curves and above the axis. */
  layOut() {
    const { missions, compares, isOpen } = this;
    const size = isOpen ? OPEN : CLOSED;
    const most = Math.floor(parseFloat(getComputedStyle(this.element).maxHeight)) || Infinity;
    const robots = !isOpen && compares ? 0 : missions.reduce((sum, mission) => sum + mission.robots.length, 0);
    const isHeaded = robots > 0 && (compares || isOpen || missions.some((mission) => !mission.ended));
    const heads = isHeaded ? missions.length * HEAD : 0;
    this.top = compares ? Math.max(size.compared, NAMES + NAME * missions.length) : size.top;
    const room = Math.min(size.room, most - this.top - heads - AXIS);
    this.lane = Math.max(size.lowest, Math.min(size.tallest, Math.floor(room / robots)));
    const whole = this.top + heads + robots * this.lane + AXIS;
    this.height = Math.min(whole, most);
    this.bottom = this.height - AXIS;
    this.content.style.height = `${whole}px`;
    this.sheet.style.height = `${this.height}px`;
    this.rows = [];
    this.heads = [];
    let top = this.top - this.element.scrollTop;
    missions.forEach((mission, i) => {
      if (isHeaded) this.heads.push({ i, top });
      top += heads / missions.length;
      for (const robot of robots ? mission.robots : []) {
        this.rows.push({ mission, i, robot, waits: waits(mission, robot), top });
        top += this.lane;
      }
    });
  }

  /** Draw what was scrolled to. */
  scroll() {
    this.restyle();
    this.draw(this.t, this.chosen, this.plans);
  }

  /** Give bars room for names, or take it back. */
  toggle() {
    this.isOpen = !this.isOpen;
    this.restyle();
  }

  get right() {
    return this.width - RIGHT;
  }

  get end() {
    return Math.max(...this.missions.map((mission) => mission.to));
  }

  showAll() {
    this.from = this.begin;
    const open = this.missions.filter((mission) => !mission.ended);
    const until = Math.max(this.end, ...open.flatMap((mission) => mission.plans.slice(-1)).map(planEnd));
    const room = Math.max(this.from + (this.end - this.from) * AHEAD + 5000, until + PLAN_ROOM_MS);
    this.to = open.length ? room : this.end;
    this.whole = true;
  }

  /** @type {(t: number) => number} */
  x(t) {
    return this.gutter + ((t - this.from) / (this.to - this.from)) * (this.right - this.gutter);
  }

  /** @type {(x: number) => number} */
  time(x) {
    return this.from + ((x - this.gutter) / (this.right - this.gutter)) * (this.to - this.from);
  }

  /** Look closer at the time around x.
      @type {(factor: number, x: number) => void} */
  zoom(factor, x) {
    const t = Math.min(this.end, Math.max(this.begin, this.time(x)));
    const most = this.end - this.begin;
    const span = Math.min(most, Math.max(2000, (this.to - this.from) / factor));
    const part = (t - this.from) / (this.to - this.from);
    this.show(t - part * span, span);
    this.whole = span === most;
  }

  /** @type {(from: number, span: number) => void} */
  show(from, span) {
    this.from = Math.min(Math.max(from, this.begin), this.end - span);
    this.to = this.from + span;
    this.restyle();
  }

  /** Keep the moment in sight while it moves.
      @type {(t: number) => void} */
  follow(t) {
    const span = this.to - this.from;
    if (!this.whole && (t < this.from || t > this.to)) this.show(t - span * 0.1, span);
  }

  /** Draw what depends on no moment; needed after a change of size, theme and span, and when a mission has grown. */
  restyle() {
    this.width = this.content.clientWidth;
    if (!this.width) return;
    this.layOut();
    fitted(this.canvas, this.width, this.height);
    this.ink = inks();
    this.gutter = this.gutterWide();
    this.colours = this.missions.map(robotColours);
    this.curves = this.missions.map((_mission, i) => (this.compares ? colour(sideColour(i)) : this.ink.ink));
    this.g = fitted(this.still, this.width, this.height);
    this.g.fillStyle = this.ink.card;
    this.g.fillRect(0, 0, this.width, this.height);
    this.drawAxis();
    this.areas.draw(this.g);
    this.clipLanes(this.g);
    for (const head of this.compares ? this.heads : []) this.drawHead(head);
    // Upwards: a name hangs into the lane below, whose line would cut it.
    for (const row of [...this.rows].reverse()) this.drawLane(row);
    this.g.restore();
    this.shown = "";
  }

  /** Draw only between curves and axis until the context is restored.
      @type {(g: Context) => void} */
  clipLanes(g) {
    g.save();
    g.beginPath();
    g.rect(0, this.top, this.width, this.bottom - this.top);
    g.clip();
  }

  /** As wide as the names of robots need it, or of missions with what they know; at most a part of the timeline. */
  gutterWide() {
    const [{ robots }] = this.missions;
    const names = this.compares ? this.names : robots.map((robot) => robot.name);
    this.g.font = `600 11px ${FONT}`;
    const widest = Math.max(...names.map((name) => this.g.measureText(name).width)) + (this.compares ? 100 : 36);
    return Math.ceil(Math.min(this.width * 0.42, Math.max(this.width < 600 ? 84 : 104, widest)));
  }

  drawAxis() {
    const { g, curves, compares, ink } = this;
    const step = tickStep(this.to - this.from, this.width - this.gutter, 56);
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
        ink.line,
        1,
      );
      g.fillStyle = ink.dim;
      if (x < this.width - 20) g.fillText(clock(t, step < 1000), x, this.height - 3);
    }
    g.textAlign = "left";
    g.fillText("plans", 4, this.bottom + 11);
    this.missions.forEach((mission, i) => this.drawPlanTicks(mission, compares ? curves[i] : ink.accent));
  }

  /** @type {(mission: Mission, ink: string) => void} */
  drawPlanTicks(mission, ink) {
    this.g.fillStyle = ink;
    for (const t of mission.planTimes) {
      if (t < this.from || t > this.to) continue;
      this.g.fillRect(this.x(t) - 0.75, this.bottom + 2, 1.5, 6);
    }
  }

  /** @type {(head: { i: number, top: number }) => void} */
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

  /** @type {(row: Row) => void} */
  drawLane(row) {
    const { mission, i, robot, top } = row;
    const { g, gutter, lane, right } = this;
    const middle = top + lane / 2;
    const own = colourOf(this.colours[i], robot.name);
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
    const [left, room] = robot.carrier ? [22, gutter - 24] : [28, gutter - 29];
    if (lane >= FEW) g.fillText(cut(g, robot.name, room), left, middle + 0.5);
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
        colourOf(this.colours[i], carrier),
        2,
      );
    }
    for (const wait of row.waits) drawWait(g, this, row, wait, wait.start);
    for (const segment of robot.segments) this.drawSegment(g, mission, segment, top);
    for (const { start } of robot.losses) cross(g, this.x(start), middle, 5, this.ink);
    g.restore();
  }

  /** Draw what a robot did. Returns whether its place is written there.
      @type {(g: Context, mission: Mission, segment: Segment, top: number) => boolean} */
  drawSegment(g, mission, { start, to, action, end }, top) {
    const { lane, gutter } = this;
    const x = this.x(start);
    const wide = Math.max(1, this.x(to ?? mission.to) - x - 0.5);
    if (to === start || x > this.width || x + wide < gutter) return false;
    const gap = lane > 10 ? 2 : 1;
    bar(g, x, top + gap, wide, lane - 2 * gap, action.name, end, this.ink);
    if (wide < 14 || action.carrier !== null) return false;
    const left = Math.max(x, gutter) + 3;
    const ink = end === "done" || end === null ? "#0b0d10" : this.ink.ink;
    return this.writeIn(g, left, x + wide - left - 3, top, mission.places.label(action.place), ink) > 0;
  }

  /** Draw the moment: cursor, what is known by then, what is chosen in each mission, and the plan in force, if plans
      are to be shown.
      @type {(t: number, chosen: Focus[], isPlanShown: boolean) => void} */
  draw(t, chosen, isPlanShown) {
    if (!this.width) return;
    const x = Math.round(2 * this.x(t)) / 2;
    const plans = this.missions.map((mission) => mission.planIndex(t));
    const shown = `${x} ${plans} ${isPlanShown} ${chosen.map(({ robot, place }) => `${robot?.name} ${place}`)}`;
    if (shown === this.shown) return;
    this.shown = shown;
    this.t = t;
    this.plans = isPlanShown;
    this.chosen = chosen;
    const g = contextOf(this.canvas);
    g.clearRect(0, 0, this.width, this.height);
    this.clipLanes(g);
    drawPlans(g, this);
    for (const row of this.rows) this.drawChosen(g, row, chosen[row.i]);
    g.restore();
    this.areas.drawMoment(g, t, x);
    g.fillStyle = this.ink.ink;
    if (t >= this.from && t <= this.to) g.fillRect(x - 0.75, 0, 1.5, this.bottom + 4);
  }

  /** Mark the lane of the chosen robot, and all that is done at the chosen place.
      @type {(g: Context, row: Row, chosen: Focus) => void} */
  drawChosen(g, { mission, robot, top }, chosen) {
    g.fillStyle = this.ink.accent;
    g.strokeStyle = this.ink.accent;
    if (robot === chosen.robot) {
      g.globalAlpha = CHOSEN;
      g.fillRect(0, top, this.width, this.lane);
      g.globalAlpha = 1;
    }
    g.lineWidth = 2;
    const plan = chosen.place ? this.planned(mission) : null;
    const until = plan ? this.t : mission.to;
    const past = (chosen.place ? robot.segments : []).filter(({ start }) => start < until);
    const done = past.map(({ action, start, to }) => ({ action, start, to: Math.min(to ?? until, until) }));
    const next = plan ? ahead(plan, robot, this.t) : [];
    const planned = next.map(({ action, to }) => ({ action, start: Math.max(action.start_ms, this.t), to }));
    for (const { action, start, to } of [...done, ...planned]) {
      if (action.place !== chosen.place || start === to) continue;
      const x = Math.max(this.gutter, this.x(start));
      const end = Math.min(this.right, this.x(to));
      if (end > this.gutter) g.strokeRect(x, top + 1, Math.max(2, end - x), this.lane - 2);
    }
  }

  /** The plan to show in the place of what came later: that of the moment. Closed lanes show what came later, where
      it is known, and so do all if plans are not to be shown.
      @type {(mission: Mission) => Plan | null} */
  planned(mission) {
    const isOver = mission.ended && (this.t >= mission.to || !this.isOpen);
    return isOver || !this.plans ? null : mission.planAt(this.t);
  }

  /** Write a text in a lane where all of it has room. Returns how wide it is, with a space; 0 if it has none.
      @type {(g: Context, x: number, room: number, top: number, text: string, ink: string) => number} */
  writeIn(g, x, room, top, text, ink) {
    g.font = `10px ${FONT}`;
    const { width } = g.measureText(text);
    if (this.lane < 14 || width > room) return 0;
    g.fillStyle = ink;
    g.textBaseline = "middle";
    g.fillText(text, x, top + this.lane / 2 + 0.5);
    return width + 4;
  }

  /** The height above which nothing is covered that is of a kind with what is at another height: lanes, or curves.
      @type {(y: number) => number} */
  clear(y) {
    return y < this.top ? 0 : this.top;
  }

  /** The row at a height, or undefined.
      @type {(y: number) => Row | undefined} */
  row(y) {
    if (y < this.top || y >= this.bottom) return undefined;
    return this.rows.find((row) => y >= row.top && y < row.top + this.lane);
  }
}
