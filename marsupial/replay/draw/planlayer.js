/* What the plan puts on the map: planned ways, targets, and the meeting points still in use. It is drawn on a canvas of its
   own when the plan, what has begun of it or the camera changes, and only laid over the map in between. */

import { fitted } from "#draw/dom.js";
import { plannedWays } from "#log/routes.js";
import { diamond, line, meeting } from "#draw/shapes.js";

const CLOSE = 5,
  SMALLEST_SIGN = 0.55; // points of the page a metre from which on signs have their full size; the least share of it
const FADED = 0.25; // ways of others than the chosen robot

export class PlanLayer {
  constructor(mission) {
    this.mission = mission;
    this.canvas = document.createElement("canvas");
    this.forget();
  }

  /** Draw all anew the next time. */
  forget() {
    this.shown = "";
  }

  /** Bring the layer to a plan at t. `look`: camera, ink, colours and the chosen robot, or null. Leaves `hits`, what can
      be pointed at. */
  draw(plan, views, t, look) {
    const begun = plan.actions.filter((action) => action.start_ms <= t).length,
      { camera, chosen } = look;
    const legs = views.map((view) => view.robot.legs.index(t)).join(),
      shown = [plan.revision, begun, legs, camera.version, chosen?.name].join(" ");
    if (shown === this.shown) return;
    this.shown = shown;
    const { width, height } = camera.size,
      g = fitted(this.canvas, width, height);
    g.clearRect(0, 0, width, height);
    this.hits = [];
    const points = camera.scale / this.mission.resolution;
    this.size = Math.min(1, Math.max(SMALLEST_SIGN, points / CLOSE));
    this.drawWays(g, plan, views, t, look);
    this.drawMeetings(g, plan, t, look);
    this.drawTargets(g, plan, look);
  }

  drawWays(g, plan, views, t, { camera, colours, chosen }) {
    for (const view of views) {
      g.globalAlpha = view.robot === chosen ? 1 : chosen ? FADED : 0.65;
      for (const way of plannedWays(this.mission, plan, view, t)) {
        line(
          g,
          way.map(([x, y]) => camera.point(x, y)),
          colours.get(view.robot.name),
          1.75,
          [1, 5],
        );
      }
    }
    g.globalAlpha = 1;
  }

  drawMeetings(g, plan, t, { camera, ink }) {
    const used = new Set(
      plan.actions.filter((action) => action.start_ms + action.duration_ms > t).map((action) => action.place),
    );
    for (const one of plan.meetings.filter(({ name }) => used.has(name))) {
      const [cx, cy] = camera.point(...one.carrier_cell),
        [rx, ry] = camera.point(...one.rover_cell);
      meeting(g, cx, cy, rx, ry, ink, this.size);
      this.hits.push({ x: cx, y: cy, r: 9, meeting: one.name }, { x: rx, y: ry, r: 7, meeting: one.name });
    }
  }

  drawTargets(g, plan, { camera, ink }) {
    for (const target of plan.targets) {
      const [x, y] = camera.point(...target.cell);
      const roles = this.mission.start.types
        .filter((type) => target.explorers.includes(type.name))
        .map((type) => type.role);
      diamond(g, x, y, 6 * this.size, ink, roles.includes("carrier"));
      this.hits.push({ x, y, r: 10, target: target.name });
    }
  }
}
