/* What the plan puts on the map: planned ways, targets, and the meeting points still in use. It is drawn on a canvas of
   its own when the plan, what has begun of it or the camera changes, and only laid over the map in between. */

import { colourOf } from "#draw/colours.js";
import { fitted } from "#draw/dom.js";
import { diamond, line, meeting } from "#draw/shapes.js";
import { insteadWay, plannedWays } from "#log/routes.js";

const CLOSE = 5; // points of the page a metre from which on signs have their full size
const SMALLEST_SIGN = 0.55; // the least share of it
const FADED = 0.25; // ways of others than the chosen robot
const INSTEAD = [9, 4, 2, 4]; // dashes of ways by the next best plan

/** `compared`: all that robots would do instead is shown, not only what the chosen one would.
    @typedef {{ camera: Camera, ink: Ink, colours: Colours, chosen: Robot | null, compared: boolean }} Look */

export class PlanLayer {
  /** @param {Mission} mission */
  constructor(mission) {
    this.mission = mission;
    this.canvas = document.createElement("canvas");
    this.shown = ""; // what is drawn
    this.size = 1; // of signs
    /** @type {Hit[]} */
    this.hits = [];
  }

  /** Draw all anew the next time. */
  forget() {
    this.shown = "";
  }

  /** Bring the layer to a plan at t. Leaves `hits`, what can be pointed at.
      @type {(plan: Plan, views: RobotView[], t: number, look: Look) => void} */
  draw(plan, views, t, look) {
    const { camera, chosen, compared } = look;
    const begun = plan.actions.filter((action) => action.start_ms <= t).length;
    const legs = views.map((view) => view.robot.legs.index(t)).join();
    const shown = [plan.revision, begun, legs, camera.version, chosen?.name, compared].join(" ");
    if (shown === this.shown) return;
    this.shown = shown;
    const { width, height } = camera.size;
    const g = fitted(this.canvas, width, height);
    g.clearRect(0, 0, width, height);
    this.hits = [];
    const points = camera.scale / this.mission.resolution;
    this.size = Math.min(1, Math.max(SMALLEST_SIGN, points / CLOSE));
    this.drawWays(g, plan, views, t, look);
    this.drawMeetings(g, plan, t, look);
    this.drawTargets(g, plan, look);
    this.drawInstead(g, plan, look);
  }

  /** @type {(g: Context, plan: Plan, views: RobotView[], t: number, look: Look) => void} */
  drawWays(g, plan, views, t, { camera, colours, chosen }) {
    for (const view of views) {
      g.globalAlpha = view.robot === chosen ? 1 : chosen ? FADED : 0.65;
      for (const way of plannedWays(this.mission, plan, view, t)) {
        const points = way.map(([x, y]) => camera.point(x, y));
        line(g, points, colourOf(colours, view.robot.name), 1.75, [1, 5]);
      }
    }
    g.globalAlpha = 1;
  }

  /** Draw where robots would go first by the next best plan.
      @type {(g: Context, plan: Plan, look: Look) => void} */
  drawInstead(g, plan, { camera, colours, chosen, compared }) {
    for (const [name, places] of plan.instead) {
      if (!compared && name !== chosen?.name) continue;
      const { from, cells } = insteadWay(this.mission, plan, this.mission.robot(name), places);
      const points = cells.map(([x, y]) => camera.point(x, y));
      instead(g, from && camera.point(...from), points, 9 * this.size, colourOf(colours, name));
    }
  }

  /** @type {(g: Context, plan: Plan, t: number, look: Look) => void} */
  drawMeetings(g, plan, t, { camera, ink }) {
    const left = plan.actions.filter((action) => action.start_ms + action.duration_ms > t);
    const used = new Set(left.map((action) => action.place));
    for (const one of plan.meetings.filter(({ name }) => used.has(name))) {
      const [cx, cy] = camera.point(...one.carrier_cell);
      const [rx, ry] = camera.point(...one.rover_cell);
      meeting(g, cx, cy, rx, ry, ink, this.size);
      this.hits.push({ x: cx, y: cy, r: 9, meeting: one.name }, { x: rx, y: ry, r: 7, meeting: one.name });
    }
  }

  /** @type {(g: Context, plan: Plan, look: Look) => void} */
  drawTargets(g, plan, { camera, ink }) {
    for (const target of plan.targets) {
      const [x, y] = camera.point(...target.cell);
      const explorers = this.mission.start.types.filter((type) => target.explorers.includes(type.name));
      const filled = explorers.some((type) => type.role === "carrier");
      diamond(g, x, y, 6 * this.size, ink, filled);
      this.hits.push({ x, y, r: 10, target: target.name });
    }
  }
}

/** A way by the next best plan, with a ring at each of its places.
    @type {(g: Context, from: Point | null, places: Point[], r: number, colour: string) => void} */
export function instead(g, from, places, r, colour) {
  line(g, from ? [from, ...places] : places, colour, 2, INSTEAD);
  for (const [x, y] of places) {
    g.beginPath();
    g.arc(x, y, r, 0, 7);
    g.lineWidth = 2;
    g.strokeStyle = colour;
    g.stroke();
  }
}
