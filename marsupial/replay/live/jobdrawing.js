/* Pictures of a planning job: the map with the ways of its best plan, lanes of that plan, the makespan over time. */

import { inks, robotColours } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { clock, tickStep } from "#text/format.js";
import { painted } from "#live/picture.js";
import { bar, cross, diamond, line, meeting, rover, vehicle } from "#draw/shapes.js";

const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";
const LANE_HIGH = 22,
  GUTTER = 92,
  AXIS = 20,
  MARGIN = 12;

/** The team of a situation, as far as its colours go: a rover on the ground is one of the carrier named before it. */
function team({ robots, types }) {
  const carriers = new Set(types.filter((type) => type.role === "carrier").map((type) => type.name));
  let last = null;
  return {
    robots: robots.map((robot) => {
      if (!carriers.has(robot.type)) return { ...robot, home: robot.carrier ?? last };
      last = robot.name;
      return { ...robot, home: null };
    }),
  };
}

/** Draw an axis of time up to `span` ms: `x` says where a moment is, `room` points it has; lines go from `top` down. */
function drawTimes(g, ink, { span, x, room, top, wide, high }) {
  const step = tickStep(span, room, 60);
  g.font = FONT;
  g.textBaseline = "middle";
  g.textAlign = "center";
  for (let t = 0; t <= span; t += step) {
    g.fillStyle = ink.line;
    g.fillRect(x(t), top, 1, high - AXIS - top);
    g.fillStyle = ink.dim;
    g.fillText(clock(t, step < 1000), Math.min(x(t), wide - 18), high - AXIS / 2);
  }
}

export class JobMap {
  constructor() {
    this.canvas = make("canvas", {
      role: "img",
      "aria-label": "Map with targets, meeting points and the ways of the best plan",
    });
    this.element = make("div", { class: "picture" }, this.canvas);
    this.situation = this.places = this.ground = this.painted = null;
  }

  setSituation(situation, places, ground) {
    Object.assign(this, { situation, places, ground, painted: null });
  }

  /** Paint the ground anew when it is drawn next; needed after a change of theme. */
  restyle() {
    this.painted = null;
  }

  draw(plan) {
    const { clientWidth: wide, clientHeight: high } = this.element,
      g = fitted(this.canvas, wide, high),
      ink = inks();
    g.fillStyle = ink.unknown;
    g.fillRect(0, 0, wide, high);
    if (this.places === null) {
      g.fillStyle = ink.ink;
      g.font = "13px system-ui, 'DejaVu Sans', sans-serif";
      g.fillText("The map is being analysed …", 14, 26);
      return;
    }
    this.fit(wide, high);
    if (this.ground) this.drawGround(g);
    const colours = robotColours(team(this.situation));
    if (plan) this.drawWays(g, plan, colours);
    this.drawPlaces(g, ink);
    this.drawRobots(g, colours, ink);
  }

  /** Choose how many points a cell has, and where the lower left corner is. */
  fit(wide, high) {
    const cells = Object.values(this.places).flatMap((poses) => Object.values(poses).map((pose) => pose.cell));
    const box = this.ground
      ? [0, 0, this.ground.width, this.ground.height]
      : [
          Math.min(...cells.map((c) => c[0])),
          Math.min(...cells.map((c) => c[1])),
          Math.max(...cells.map((c) => c[0])) + 1,
          Math.max(...cells.map((c) => c[1])) + 1,
        ];
    const [left, low, right, top] = box;
    this.scale = Math.min((wide - 2 * MARGIN) / (right - left), (high - 2 * MARGIN) / (top - low));
    this.left = (wide - (right - left) * this.scale) / 2 - left * this.scale;
    this.top = (high + (top - low) * this.scale) / 2 + low * this.scale;
  }

  point([x, y]) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  drawGround(g) {
    const { width, height } = this.ground;
    this.painted ??= painted(this.ground);
    g.imageSmoothingEnabled = this.scale < 1;
    g.drawImage(this.painted, this.left, this.top - height * this.scale, width * this.scale, height * this.scale);
  }

  cell(place, robot) {
    return this.places[place]?.[robot.type]?.cell ?? null;
  }

  drawWays(g, plan, colours) {
    for (const robot of this.situation.robots) {
      for (const { origin, place, name, robot: mover } of plan.actions) {
        if (mover !== robot.name || (name !== "move" && name !== "explore")) continue;
        const ends = [this.cell(origin, robot), this.cell(place, robot)];
        if (ends.every(Boolean)) {
          line(
            g,
            ends.map((cell) => this.point(cell)),
            colours.get(robot.name),
            2.5,
            name === "move" ? [7, 5] : [],
          );
        }
      }
    }
  }

  drawPlaces(g, ink) {
    const kinds = new Map(this.situation.types.map((type) => [type.name, type.role]));
    for (const target of this.situation.targets) {
      const [cell] = target.explorers.map((type) => this.places[target.name]?.[type]?.cell).filter(Boolean);
      if (cell) {
        diamond(
          g,
          ...this.point(cell),
          6,
          ink,
          target.explorers.some((type) => kinds.get(type) === "carrier"),
        );
      }
    }
    for (const name of this.situation.meetings) {
      const poses = Object.entries(this.places[name] ?? {}),
        of = (role) => poses.find(([type]) => kinds.get(type) === role)?.[1].cell;
      if (of("carrier") && of("rover")) meeting(g, ...this.point(of("carrier")), ...this.point(of("rover")), ink);
    }
  }

  drawRobots(g, colours, ink) {
    const { robots, types } = this.situation;
    for (const robot of robots) {
      const cell = robot.place && this.cell(robot.place, robot),
        type = types.find((one) => one.name === robot.type);
      if (!cell) continue;
      const aboard = robots.filter((one) => one.carrier === robot.name).map((one) => colours.get(one.name));
      if (type.role === "carrier") {
        vehicle(g, ...this.point(cell), 10, 0, colours.get(robot.name), type.capacity ?? 0, aboard, ink);
      } else rover(g, ...this.point(cell), 7, 0, colours.get(robot.name), ink);
    }
  }
}

export class JobLanes {
  constructor() {
    this.canvas = make("canvas", { role: "img", "aria-label": "Lanes: what each robot does when by the best plan" });
    this.element = make("div", { class: "picture" }, this.canvas);
  }

  draw(plan, situation) {
    const robots = situation ? situation.robots : [],
      high = robots.length * LANE_HIGH + AXIS;
    this.element.style.height = `${high}px`;
    const wide = this.element.clientWidth,
      g = fitted(this.canvas, wide, high),
      ink = inks();
    g.fillStyle = ink.card;
    g.fillRect(0, 0, wide, high);
    if (!plan || !situation) return;
    const span = Math.max(plan.makespan_ms, 1),
      x = (t) => GUTTER + (t / span) * (wide - GUTTER - MARGIN),
      colours = robotColours(team(situation));
    drawTimes(g, ink, { span, x, room: wide - GUTTER, top: 0, wide, high });
    g.textAlign = "left";
    robots.forEach((robot, i) => this.drawLane(g, robot, i * LANE_HIGH, plan, x, colours.get(robot.name), ink));
  }

  drawLane(g, robot, top, plan, x, colour, ink) {
    g.fillStyle = colour;
    g.fillRect(0, top + 5, 6, LANE_HIGH - 10);
    g.fillStyle = ink.ink;
    g.fillText(robot.name, 11, top + LANE_HIGH / 2, GUTTER - 16);
    for (const action of plan.actions) {
      if (action.robot !== robot.name && action.carrier !== robot.name) continue;
      const from = Math.max(x(action.start_ms), GUTTER),
        wide = Math.max(1.5, x(action.start_ms + action.duration_ms) - from - 0.5);
      bar(g, from, top + 3, wide, LANE_HIGH - 6, action.name, "done", ink);
    }
  }
}

export class MakespanPlot {
  constructor() {
    this.canvas = make("canvas", { role: "img", "aria-label": "Makespan of the best plan over the time of planning" });
    this.element = make("div", { class: "picture plot" }, this.canvas);
  }

  draw(plans, boundMs) {
    const { clientWidth: wide, clientHeight: high } = this.element,
      g = fitted(this.canvas, wide, high),
      ink = inks();
    g.fillStyle = ink.card;
    g.fillRect(0, 0, wide, high);
    if (!plans.length) return;
    const spans = plans.map((plan) => plan.makespan_ms),
      most = Math.max(...spans),
      least = Math.min(...spans, boundMs ?? Infinity);
    const room = Math.max(1, (most - least) * 0.15),
      lowest = Math.max(0, least - room),
      highest = most + room;
    const until = Math.max(1000, 1.08 * plans[plans.length - 1].found_after_ms);
    const x = (t) => 54 + (t / until) * (wide - 54 - MARGIN),
      y = (v) => high - AXIS - ((v - lowest) / (highest - lowest)) * (high - AXIS - 8);
    this.drawAxes(g, ink, { wide, high, until, x, y, values: [...new Set([most, least])] });
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
    const steps = plans.flatMap((plan, i) => [
      [x(plan.found_after_ms), y(i ? spans[i - 1] : spans[0])],
      [x(plan.found_after_ms), y(spans[i])],
    ]);
    line(g, [...steps, [x(until), y(spans[spans.length - 1])]], ink.accent, 2.5);
    if (plans.length < 60) {
      for (const [i, plan] of plans.entries()) cross(g, x(plan.found_after_ms), y(spans[i]), 2, ink, 1.5);
    }
  }

  drawAxes(g, ink, { wide, high, until, x, y, values }) {
    drawTimes(g, ink, { span: until, x, room: wide - 54, top: 4, wide, high });
    g.textAlign = "right";
    for (const value of values) {
      g.fillStyle = ink.line;
      g.fillRect(54, y(value), wide - 54 - MARGIN, 1);
      g.fillStyle = ink.ink;
      g.fillText(clock(value, true), 49, y(value));
    }
    g.textAlign = "left";
  }
}
