/* What the plan puts on the map: planned ways, meeting points and targets with their names. It is drawn on a canvas of its
   own when the plan, what has begun of it or the camera changes, and only laid over the map in between. */

import { fitted } from "./dom.js";
import { Labels } from "./labels.js";
import { plannedWays } from "./routes.js";
import { diamond, line, meeting } from "./shapes.js";

const CLOSE = 5, SMALLEST_SIGN = 0.55;  // points of the page a metre from which on signs have their full size; the least share of it
const NAMED = 3;  // points a metre from which on places are named

export class PlanLayer {
  constructor(mission) {
    this.mission = mission;
    this.canvas = document.createElement("canvas");
    this.forget();
  }

  /** Draw all anew the next time. */
  forget() { this.shown = ""; }

  /** Bring the layer to a plan at t. `look`: camera, ink, colours and whether names are wanted. Leaves `hits`, what can
      be pointed at, and `taken`, where its names are. */
  draw(plan, views, t, look) {
    const begun = plan.actions.filter((action) => action.start_ms <= t).length, { camera, named } = look;
    const legs = views.map((view) => view.robot.legs.index(t)).join(), shown = [plan.revision, begun, legs, camera.version, named].join(" ");
    if (shown === this.shown) return;
    this.shown = shown;
    const { width, height } = camera.size, g = fitted(this.canvas, width, height);
    g.clearRect(0, 0, width, height);
    this.hits = [];
    const points = camera.scale / this.mission.resolution;
    this.size = Math.min(1, Math.max(SMALLEST_SIGN, points / CLOSE));
    this.drawWays(g, plan, views, t, look);
    this.drawMeetings(g, plan, look);
    this.drawTargets(g, plan, look);
    const labels = new Labels(g, look.ink, camera);
    if (named && points >= NAMED) this.drawNames(plan, camera, labels);
    this.taken = labels.taken;
  }

  drawWays(g, plan, views, t, { camera, colours }) {
    for (const view of views) {
      for (const way of plannedWays(this.mission, plan, view, t)) {
        line(g, way.map(([x, y]) => camera.point(x, y)), colours.get(view.robot.name), 1.75, [1, 5]);
      }
    }
  }

  drawMeetings(g, plan, { camera, ink }) {
    for (const one of plan.meetings) {
      const [cx, cy] = camera.point(...one.carrier_cell), [rx, ry] = camera.point(...one.rover_cell);
      meeting(g, cx, cy, rx, ry, ink, this.size);
      this.hits.push({ x: cx, y: cy, r: 9, meeting: one.name }, { x: rx, y: ry, r: 7, meeting: one.name });
    }
  }

  drawTargets(g, plan, { camera, ink }) {
    for (const target of plan.targets) {
      const [x, y] = camera.point(...target.cell);
      const roles = this.mission.start.types.filter((type) => target.explorers.includes(type.name)).map((type) => type.role);
      diamond(g, x, y, 6 * this.size, ink, roles.includes("carrier"));
      this.hits.push({ x, y, r: 10, target: target.name });
    }
  }

  drawNames(plan, camera, labels) {
    const name = (thing, cell) => labels.write(this.mission.places.label(thing.name), ...camera.point(...cell), 7, false);
    for (const target of plan.targets) labels.keepFree(...camera.point(...target.cell), 5);
    const wanted = new Set(plan.actions.map((action) => action.place));
    for (const target of plan.targets) name(target, target.cell);
    for (const one of plan.meetings) if (wanted.has(one.name)) name(one, one.carrier_cell);
  }
}
