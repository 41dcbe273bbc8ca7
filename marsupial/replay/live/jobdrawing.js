/* Pictures of a planning job: the map with the ways of its best plan, lanes of that plan, the makespan over time. */

import { colourOf, inks, robotColours } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { FONT } from "#draw/labels.js";
import { bar, cross, diamond, line, meeting, rover, vehicle } from "#draw/shapes.js";
import { painted } from "#live/picture.js";
import { clock, tickStep } from "#text/format.js";

const LANE_HIGH = 22;
const GUTTER = 92;
const AXIS = 20;
const MARGIN = 12;
const PLOT_LEFT = 54; // of the figures beside the plot
const MOST_CROSSES = 60; // plans that are marked one by one

/** The team of a situation, as far as its colours go: a rover on the ground is one of the carrier named before it.
    @type {(situation: Situation) => Crew} */
function crewOf({ robots, types }) {
  const carriers = new Set(types.filter((type) => type.role === "carrier").map((type) => type.name));
  /** @type {string | null} */
  let last = null;
  return {
    robots: robots.map(({ name, type, carrier }) => {
      if (!carriers.has(type)) return { name, home: carrier ?? last };
      last = name;
      return { name, home: null };
    }),
  };
}

/** An axis of time up to `span` ms: `x` returns where a moment is, `room` points it has; lines go from `top` down.
    @typedef {Size & { span: number, x: (t: number) => number, room: number, top: number }} TimeAxis */

/** @type {(g: Context, ink: Ink, axis: TimeAxis) => void} */
function drawTimes(g, ink, { span, x, room, top, width, height }) {
  const step = tickStep(span, room, 60);
  g.font = `11px ${FONT}`;
  g.textBaseline = "middle";
  g.textAlign = "center";
  for (let t = 0; t <= span; t += step) {
    g.fillStyle = ink.line;
    g.fillRect(x(t), top, 1, height - AXIS - top);
    g.fillStyle = ink.dim;
    g.fillText(clock(t, step < 1000), Math.min(x(t), width - 18), height - AXIS / 2);
  }
}

/** The map of a situation with its places. */
export class JobMap {
  constructor() {
    const label = "Map with targets, meeting points and the ways of the best plan";
    this.canvas = make("canvas", { role: "img", "aria-label": label });
    this.element = make("div", { class: "picture" }, this.canvas);
    /** @type {{ situation: Situation, places: PlaceCells, ground: CellMap | null } | null} */
    this.shown = null;
    /** @type {HTMLCanvasElement | null} */
    this.painted = null;
    this.scale = 1; // points a cell
    this.left = 0; // of the lower left corner
    this.top = 0;
  }

  /** @type {(situation: Situation, places: PlaceCells, ground: CellMap | null) => void} */
  setSituation(situation, places, ground) {
    this.shown = { situation, places, ground };
    this.painted = null;
  }

  /** Paint the ground anew when it is drawn next; needed after a change of theme. */
  restyle() {
    this.painted = null;
  }

  /** @type {(plan: JobPlan | null) => void} */
  draw(plan) {
    const { clientWidth: wide, clientHeight: high } = this.element;
    const g = fitted(this.canvas, wide, high);
    const ink = inks();
    g.fillStyle = ink.unknown;
    g.fillRect(0, 0, wide, high);
    if (this.shown === null) {
      g.fillStyle = ink.ink;
      g.font = `13px ${FONT}`;
      g.fillText("The map is being analysed …", 14, 26);
      return;
    }
    const { situation, places, ground } = this.shown;
    this.fit(wide, high, ground ? { left: 0, low: 0, right: ground.width, high: ground.height } : extentOf(places));
    if (ground) this.drawGround(g, ground);
    const colours = robotColours(crewOf(situation));
    if (plan) this.drawWays(g, situation, places, plan, colours);
    this.drawTargets(g, situation, places, ink);
    this.drawMeetings(g, situation, places, ink);
    this.drawRobots(g, situation, places, colours, ink);
  }

  /** Choose how many points a cell has, and where the lower left corner is.
      @type {(wide: number, high: number, extent: Extent) => void} */
  fit(wide, high, { left, low, right, high: top }) {
    this.scale = Math.min((wide - 2 * MARGIN) / (right - left), (high - 2 * MARGIN) / (top - low));
    this.left = (wide - (right - left) * this.scale) / 2 - left * this.scale;
    this.top = (high + (top - low) * this.scale) / 2 + low * this.scale;
  }

  /** @type {(cell: Cell) => Point} */
  point([x, y]) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  /** @type {(g: Context, ground: CellMap) => void} */
  drawGround(g, ground) {
    const [wide, high] = [ground.width * this.scale, ground.height * this.scale];
    this.painted ??= painted(ground);
    g.imageSmoothingEnabled = this.scale < 1;
    g.drawImage(this.painted, this.left, this.top - high, wide, high);
  }

  /** @type {(g: Context, situation: Situation, places: PlaceCells, plan: JobPlan, colours: Colours) => void} */
  drawWays(g, { robots }, places, { actions }, colours) {
    for (const robot of robots) {
      for (const { origin, place, name, robot: mover } of actions) {
        if (mover !== robot.name || (name !== "move" && name !== "explore")) continue;
        const ends = [origin, place].flatMap((one) => {
          const cell = one === null ? null : cellOf(places, one, robot.type);
          return cell ? [this.point(cell)] : [];
        });
        const dash = name === "move" ? [7, 5] : [];
        if (ends.length === 2) line(g, ends, colourOf(colours, robot.name), 2.5, dash);
      }
    }
  }

  /** @type {(g: Context, situation: Situation, places: PlaceCells, ink: Ink) => void} */
  drawTargets(g, { targets, types }, places, ink) {
    for (const { name, explorers } of targets) {
      const [cell] = explorers.flatMap((type) => places[name]?.[type] ?? []).map((pose) => pose.cell);
      const filled = types.some((type) => type.role === "carrier" && explorers.includes(type.name));
      if (cell) diamond(g, ...this.point(cell), 6, ink, filled);
    }
  }

  /** @type {(g: Context, situation: Situation, places: PlaceCells, ink: Ink) => void} */
  drawMeetings(g, { meetings, types }, places, ink) {
    for (const name of meetings) {
      /** @type {(role: Role) => Cell | undefined} */
      const cellOfRole = (role) =>
        types.filter((type) => type.role === role).flatMap((type) => places[name]?.[type.name] ?? [])[0]?.cell;
      const [carrier, other] = [cellOfRole("carrier"), cellOfRole("rover")];
      if (carrier && other) meeting(g, ...this.point(carrier), ...this.point(other), ink);
    }
  }

  /** @type {(g: Context, situation: Situation, places: PlaceCells, colours: Colours, ink: Ink) => void} */
  drawRobots(g, { robots, types }, places, colours, ink) {
    for (const robot of robots) {
      const cell = robot.place ? cellOf(places, robot.place, robot.type) : null;
      if (!cell) continue;
      const type = types.find((one) => one.name === robot.type);
      const own = colourOf(colours, robot.name);
      if (type?.role === "carrier") {
        const aboard = robots.filter((one) => one.carrier === robot.name).map((one) => colourOf(colours, one.name));
        vehicle(g, ...this.point(cell), 10, 0, own, type.capacity ?? 0, aboard, ink);
      } else rover(g, ...this.point(cell), 7, 0, own, ink);
    }
  }
}

/** @type {(places: PlaceCells, place: string, type: string) => Cell | null} */
function cellOf(places, place, type) {
  return places[place]?.[type]?.cell ?? null;
}

/** The extent of all places.
    @type {(places: PlaceCells) => Extent} */
function extentOf(places) {
  const cells = Object.values(places).flatMap((poses) => Object.values(poses).map((pose) => pose.cell));
  const [xs, ys] = [cells.map(([x]) => x), cells.map(([, y]) => y)];
  return { left: Math.min(...xs), low: Math.min(...ys), right: Math.max(...xs) + 1, high: Math.max(...ys) + 1 };
}

/** What each robot does when. */
export class JobLanes {
  constructor() {
    const label = "Lanes: what each robot does when by the best plan";
    this.canvas = make("canvas", { role: "img", "aria-label": label });
    this.element = make("div", { class: "picture" }, this.canvas);
  }

  /** @type {(plan: JobPlan | null, situation: Situation | null) => void} */
  draw(plan, situation) {
    const robots = situation ? situation.robots : [];
    const height = robots.length * LANE_HIGH + AXIS;
    this.element.style.height = `${height}px`;
    const width = this.element.clientWidth;
    const g = fitted(this.canvas, width, height);
    const ink = inks();
    g.fillStyle = ink.card;
    g.fillRect(0, 0, width, height);
    if (!plan || !situation) return;
    const span = Math.max(plan.makespan_ms, 1);
    /** @type {(t: number) => number} */
    const x = (t) => GUTTER + (t / span) * (width - GUTTER - MARGIN);
    const colours = robotColours(crewOf(situation));
    drawTimes(g, ink, { span, x, room: width - GUTTER, top: 0, width, height });
    g.textAlign = "left";
    robots.forEach(({ name }, i) => this.drawLane(g, name, i * LANE_HIGH, plan, x, colourOf(colours, name), ink));
  }

  /** @type {(g: Context, name: string, top: number, plan: JobPlan, x: (t: number) => number, colour: string,
        ink: Ink) => void} */
  drawLane(g, name, top, plan, x, colour, ink) {
    g.fillStyle = colour;
    g.fillRect(0, top + 5, 6, LANE_HIGH - 10);
    g.fillStyle = ink.ink;
    g.fillText(name, 11, top + LANE_HIGH / 2, GUTTER - 16);
    for (const action of plan.actions) {
      if (action.robot !== name && action.carrier !== name) continue;
      const from = Math.max(x(action.start_ms), GUTTER);
      const wide = Math.max(1.5, x(action.start_ms + action.duration_ms) - from - 0.5);
      bar(g, from, top + 3, wide, LANE_HIGH - 6, action.name, "done", ink);
    }
  }
}

/** The makespan of the best plan over the time of planning. */
export class MakespanPlot {
  constructor() {
    const label = "Makespan of the best plan over the time of planning";
    this.canvas = make("canvas", { role: "img", "aria-label": label });
    this.element = make("div", { class: "picture plot" }, this.canvas);
  }

  /** @type {(plans: JobPlan[], boundMs: number | null) => void} */
  draw(plans, boundMs) {
    const { clientWidth: width, clientHeight: height } = this.element;
    const g = fitted(this.canvas, width, height);
    const ink = inks();
    g.fillStyle = ink.card;
    g.fillRect(0, 0, width, height);
    if (!plans.length) return;
    const spans = plans.map((plan) => plan.makespan_ms);
    const most = Math.max(...spans);
    const least = Math.min(...spans, boundMs ?? Infinity);
    const room = Math.max(1, (most - least) * 0.15);
    const lowest = Math.max(0, least - room);
    const until = Math.max(1000, 1.08 * plans[plans.length - 1].found_after_ms);
    /** @type {(t: number) => number} */
    const x = (t) => PLOT_LEFT + (t / until) * (width - PLOT_LEFT - MARGIN);
    /** @type {(v: number) => number} */
    const y = (v) => height - AXIS - ((v - lowest) / (most + room - lowest)) * (height - AXIS - 8);
    drawTimes(g, ink, { span: until, x, room: width - PLOT_LEFT, top: 4, width, height });
    g.textAlign = "right";
    for (const value of new Set([most, least])) {
      g.fillStyle = ink.line;
      g.fillRect(PLOT_LEFT, y(value), width - PLOT_LEFT - MARGIN, 1);
      g.fillStyle = ink.ink;
      g.fillText(clock(value, true), PLOT_LEFT - 5, y(value));
    }
    g.textAlign = "left";
    if (boundMs) {
      line(
        g,
        [
          [x(0), y(boundMs)],
          [x(until), y(boundMs)],
        ],
        ink.dim,
        1.5,
        [2, 5],
      );
    }
    /** @type {Point[]} */
    const steps = plans.flatMap((plan, i) => [
      [x(plan.found_after_ms), y(spans[Math.max(0, i - 1)])],
      [x(plan.found_after_ms), y(spans[i])],
    ]);
    line(g, [...steps, [x(until), y(spans[spans.length - 1])]], ink.accent, 2.5);
    if (plans.length >= MOST_CROSSES) return;
    plans.forEach((plan, i) => cross(g, x(plan.found_after_ms), y(spans[i]), 2, ink, 1.5));
  }
}
