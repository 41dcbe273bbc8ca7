/* The map: what is known, and on it, in a canvas of its own, the robots, their routes and the plan. */

import { aloneColour, inks, looks, packed, robotColours, terrainColour } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { point } from "#text/format.js";
import { Ground } from "#draw/ground.js";
import { isOpen, UNKNOWN } from "#log/knownmap.js";
import { Labels } from "#draw/labels.js";
import { along } from "#log/legs.js";
import { PlanLayer } from "#draw/planlayer.js";
import { trail } from "#log/routes.js";
import { charger, cross, leftover, line, rover, vehicle } from "#draw/shapes.js";
import { onlyFor } from "#text/why.js";
import { drawZone, isWithin, zoneText } from "#draw/zones.js";

const AGAIN = [6, 6]; // dashes of trails in hues that other carriers have already
const SMALLEST = { carrier: 9, rover: 6 }; // points of the page; however far away, robots can be seen
const NAMED = 3; // points a metre from which on all places are named, if names are on
const LEAST_CHARGER = 6; // points of the page, at least
const SCALE_BARS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]; // metres

export class MapView {
  /** `side`: the name of the mission's colour beside others, null if it is alone. */
  constructor(mission, name, camera, side) {
    Object.assign(this, { mission, side });
    this.floor = make("canvas", { class: "floor", "aria-hidden": "true" });
    this.canvas = make("canvas", { class: "map", role: "img", tabindex: "0", "aria-label": `Map of ${name}` });
    this.element = make("div", { class: "canvases" }, this.floor, this.canvas);
    this.camera = camera;
    this.ground = new Ground(mission);
    this.layer = new PlanLayer(mission);
    this.painted = -1;
    this.hovered = null; // the hit under the pointer
    this.sketch = null; // a zone that is being drawn: its kind and corners
    this.hits = [];
    this.zones = new Map();
    this.restyle();
  }

  /** Take the colours of the theme and paint all anew. */
  restyle() {
    const { terrains } = this.mission.start,
      palette = new Uint32Array(256).fill(packed("#808080"));
    for (const terrain of terrains) palette[terrain.code] = packed(terrainColour(terrain, terrains));
    this.ink = inks();
    palette[UNKNOWN] = packed(this.ink.unknown);
    const alone = palette.slice();
    for (const terrain of this.side ? terrains.filter(({ code }) => isOpen(code)) : []) {
      alone[terrain.code] = packed(aloneColour(terrain, terrains, this.side));
    }
    this.colours = robotColours(this.mission);
    this.ground.restyle(palette, alone);
    this.layer.forget();
    this.painted = -1;
  }

  /** Show which cells are known here and in none of the other missions. */
  compare(others) {
    if (others.length === this.ground.others.length) return;
    this.ground.compare(others);
    this.painted = -1;
  }

  /** Take the size of the page's element; `covers` as in `Camera.resize`. */
  resize(covers) {
    const { clientWidth, clientHeight } = this.element;
    if (!clientWidth || !clientHeight) return;
    this.camera.resize(this, clientWidth, clientHeight, covers);
    fitted(this.floor, clientWidth, clientHeight);
    this.ratio = this.floor.width / clientWidth;
    fitted(this.canvas, clientWidth, clientHeight);
    this.layer.forget();
    this.painted = -1;
  }

  /** Whether the robot that is followed is one of this mission. */
  get follows() {
    return this.mission.robots.includes(this.camera.followed);
  }

  /** Point the camera to what is followed at t; otherwise to the whole map, while that grows. */
  aim(t) {
    const { camera, mission } = this;
    if (this.follows) {
      const { x, y } = mission.view(camera.followed, t);
      camera.centre(x, y);
    } else if (camera.fitted && !mission.ended) camera.fit();
  }

  /** Draw the moment. `focus`: what is chosen, `robot` and `place` (null for none), and `names` in the sentence below. */
  draw(t, views, show, focus) {
    this.drawGround(t);
    this.drawTeam(t, views, show, focus);
  }

  /** Bring the floor to t: all of it where the camera has moved, otherwise only the tiles that changed. */
  drawGround(t) {
    const changed = this.ground.seek(t),
      { left, top, scale, size, version } = this.camera;
    const g = this.floor.getContext("2d"),
      { ratio } = this;
    const all = this.painted !== version;
    if (!all && !changed.size) return;
    this.painted = version;
    if (all) {
      this.drawPart(g, 0, 0, size.width, size.height, ratio);
      return;
    }
    const snap = (v) => Math.floor(v * ratio) / ratio; // to whole pixels, which are clipped without blending
    for (const key of changed) {
      const [x, y, wide, high] = this.ground.place(key, left, top, scale),
        px = snap(x),
        py = snap(y);
      this.drawPart(g, px, py, snap(x + wide) + 1 - px, snap(y + high) + 1 - py, ratio);
    }
  }

  drawPart(g, x, y, wide, high, ratio) {
    const { left, top, scale } = this.camera;
    g.save();
    g.beginPath();
    g.rect(x, y, wide, high);
    g.clip();
    g.fillStyle = this.ink.unknown;
    g.fillRect(x, y, wide, high);
    this.ground.draw(g, left, top, scale, ratio);
    g.restore();
  }

  drawTeam(t, views, show, focus) {
    const g = this.canvas.getContext("2d"),
      {
        mission,
        camera: { size },
      } = this;
    this.g = g;
    this.hits = [];
    g.clearRect(0, 0, size.width, size.height);
    const over = mission.ended !== null && t >= mission.to,
      plan = over ? null : mission.planAt(t);
    this.zones = mission.zones.at(t) ?? new Map();
    for (const { kind, corners } of [...this.zones.values(), ...(this.sketch ? [this.sketch] : [])]) {
      drawZone(
        g,
        kind,
        corners.map((corner) => this.point(...corner)),
        this.ink,
        size,
      );
    }
    for (const place of mission.chargers) {
      charger(g, ...this.point(...place), Math.max(LEAST_CHARGER, 0.5 * this.camera.scale), this.ink);
    }
    if (show.sensors) for (const view of views) this.drawRange(view);
    if (show.trails) this.drawTrails(views, t, focus.robot);
    if (show.plan && plan) this.drawPlan(plan, views, t, focus.robot);
    for (const view of views) if (!view.carrier && !view.lost) this.drawRoute(view, t, focus.robot);
    if (over) this.drawRemaining();
    const outside = views
      .filter((view) => !view.carrier)
      .sort((a, b) => Number(b.robot.carrier) - Number(a.robot.carrier));
    for (const view of outside) this.drawRobot(view, views, t);
    this.drawFocus(views, focus);
    this.drawNames(outside, show.labels, focus);
    this.drawScaleBar();
  }

  point(x, y) {
    return this.camera.point(x, y);
  }

  /** Mark what is chosen; a robot that is carried, by its carrier. */
  drawFocus(views, { robot, place }) {
    const view = views.find((one) => one.robot === robot);
    if (view) this.drawRing(...this.point(view.x, view.y), this.radius(view.carrier ?? robot) + 6);
    for (const hit of place ? this.hits.filter((one) => place === (one.target ?? one.meeting)) : []) {
      this.drawRing(hit.x, hit.y, hit.r + 1);
    }
  }

  /** Name the robots, and of places those in the sentence, chosen or pointed at, or all; none on another. */
  drawNames(outside, all, { place, names }) {
    const labels = new Labels(this.g, this.ink, this.camera),
      close = this.camera.scale / this.mission.resolution >= NAMED;
    for (const hit of this.hits) if (!hit.remaining) labels.keepFree(hit.x, hit.y, hit.r - 5);
    for (const view of outside) {
      labels.write(
        `${view.robot.name}${view.away ? " (no contact)" : ""}`,
        ...this.point(view.x, view.y),
        this.radius(view.robot),
        true,
      );
    }
    const isNamed = (name) =>
      name === place || names.has(name) || (all && close) || name === (this.hovered?.target ?? this.hovered?.meeting);
    const written = new Set();
    for (const { x, y, target, meeting } of this.hits) {
      const name = target ?? meeting;
      if (!name || written.has(name) || !isNamed(name)) continue;
      written.add(name);
      labels.write(this.mission.places.label(name), x, y, 7, false);
    }
  }

  drawTrails(views, t, chosen) {
    const found = looks(this.mission);
    for (const { robot } of views) {
      this.g.globalAlpha = !chosen || robot === chosen ? 0.4 : 0.12;
      const dash = found.get(robot.name).dashed ? AGAIN : [];
      for (const way of trail(robot, t)) {
        line(
          this.g,
          way.map(([x, y]) => this.point(x, y)),
          this.colours.get(robot.name),
          2,
          dash,
        );
      }
    }
    this.g.globalAlpha = 1;
  }

  drawRoute(view, t, chosen) {
    const { leg } = view;
    if (!leg.times) return;
    const now = along(leg, t),
      last = leg.xs.length - 1;
    if (now.i >= last) return;
    const points = [this.point(now.x, now.y)];
    for (let k = now.i + 1; k <= last; k++) points.push(this.point(leg.xs[k], leg.ys[k]));
    if (chosen && chosen !== view.robot) this.g.globalAlpha = 0.3;
    line(this.g, points, this.ink.page, 4.5);
    line(this.g, points, this.colours.get(view.robot.name), 2.25, [6, 5]);
    this.g.globalAlpha = 1;
  }

  /** Lay the plan over the map. */
  drawPlan(plan, views, t, chosen) {
    const {
      layer,
      camera: { size },
    } = this;
    layer.draw(plan, views, t, { camera: this.camera, ink: this.ink, colours: this.colours, chosen });
    this.g.drawImage(layer.canvas, 0, 0, size.width, size.height);
    this.hits.push(...layer.hits);
  }

  drawRange(view) {
    if (view.carrier || view.lost) return;
    const { g } = this,
      colour = this.colours.get(view.robot.name);
    g.beginPath();
    g.arc(
      ...this.point(view.x, view.y),
      (view.robot.kind.sensor_range_m / this.mission.resolution) * this.camera.scale,
      0,
      7,
    );
    g.globalAlpha = 0.1;
    g.fillStyle = colour;
    g.fill();
    g.globalAlpha = 0.8;
    g.setLineDash([3, 4]);
    g.lineWidth = 1.25;
    g.strokeStyle = colour;
    g.stroke();
    g.setLineDash([]);
    g.globalAlpha = 1;
  }

  drawRobot(view, views, t) {
    const { g } = this,
      { robot } = view,
      [x, y] = this.point(view.x, view.y),
      r = this.radius(robot);
    const colour = view.lost ? this.ink.dim : this.colours.get(robot.name);
    const cargo = views.filter((other) => other.carrier === robot).map((other) => other.robot.name);
    if (!robot.carrier && view.action && view.action.carrier) this.drawDocking(view, t, x, y);
    if (robot.carrier) {
      vehicle(
        g,
        x,
        y,
        r,
        view.heading,
        colour,
        robot.kind.capacity,
        cargo.map((name) => this.colours.get(name)),
        this.ink,
      );
    } else rover(g, x, y, r, view.heading, colour, this.ink);
    if (view.lost) cross(g, x, y, r * 0.8, this.ink);
    this.hits.push({ x, y, r: r + 5, robot });
  }

  drawRing(x, y, r) {
    this.g.beginPath();
    this.g.arc(x, y, r, 0, 7);
    this.g.lineWidth = 2;
    this.g.strokeStyle = this.ink.accent;
    this.g.stroke();
  }

  /** A line that runs from rover to carrier (dock) or from carrier to rover (undock). */
  drawDocking(view, t, x, y) {
    const carrier = this.mission.view(this.mission.byName.get(view.action.carrier), t);
    this.g.lineDashOffset = ((view.action.name === "dock" ? -1 : 1) * (t / 120)) % 8;
    line(this.g, [[x, y], this.point(carrier.x, carrier.y)], this.ink.ink, 3, [5, 3]);
    this.g.lineDashOffset = 0;
  }

  /** Radius of a robot on the page: its true one, or as much as it takes to be seen. */
  radius(robot) {
    return Math.max((robot.kind.radius_m / this.mission.resolution) * this.camera.scale, SMALLEST[robot.kind.role]);
  }

  drawRemaining() {
    for (const frontier of this.mission.ended.remaining) {
      const [x, y] = this.point(...frontier.cell);
      leftover(this.g, x, y, this.ink);
      this.hits.push({ x, y, r: 9, remaining: frontier });
    }
  }

  drawScaleBar() {
    const metre = this.camera.scale / this.mission.resolution,
      length = SCALE_BARS.find((m) => m * metre >= 48) || 5000;
    const { g } = this,
      x = 12,
      y = this.camera.size.height - 10,
      way = [
        [x, y - 5],
        [x, y],
        [x + length * metre, y],
        [x + length * metre, y - 5],
      ];
    line(g, way, this.ink.card, 5);
    line(g, way, this.ink.ink, 2);
    g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    g.textBaseline = "alphabetic";
    g.lineWidth = 3;
    g.strokeStyle = this.ink.card;
    g.fillStyle = this.ink.ink;
    g.strokeText(`${length} m`, x + 5, y - 5);
    g.fillText(`${length} m`, x + 5, y - 5);
  }

  /** What is drawn at a point of the canvas: a robot, target, meeting point or frontier left; null for nothing. */
  hit(px, py) {
    for (let i = this.hits.length - 1; i >= 0; i--) {
      const hit = this.hits[i];
      if ((hit.x - px) ** 2 + (hit.y - py) ** 2 <= hit.r ** 2) return hit;
    }
    return null;
  }

  /** Metres in the map's frame, and what is there, as text. */
  whereAt(px, py) {
    const cell = this.camera.cell(px, py),
      code = this.ground.known.at(...cell),
      only = onlyFor(this.mission, code);
    const place = this.camera.place(px, py),
      zones = [...this.zones]
        .filter(([, zone]) => isWithin(zone, place))
        .map(([one, zone]) => ` · ${zoneText(one, zone)}`);
    const terrain = this.mission.terrain(code),
      name = code === UNKNOWN ? "unknown" : terrain ? terrain.name : `terrain ${code}`;
    const charging = this.mission.chargers.some(([x, y]) => x === cell[0] && y === cell[1]) ? " · charging place" : "";
    return `${point(this.mission.metres(cell))} · ${name}${code > 0 && code !== UNKNOWN && only ? ` (${only})` : ""}${charging}${zones.join("")}`;
  }
}
