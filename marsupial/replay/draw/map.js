/* The map: what is known, and on it, in a canvas of its own, the robots, their routes and the plan. */

import { aloneColour, colourOf, inks, looks, packed, robotColours, terrainColour } from "#draw/colours.js";
import { contextOf, fitted, make } from "#draw/dom.js";
import { Ground } from "#draw/ground.js";
import { drawGuess, guessedAt } from "#draw/guess.js";
import { FONT, Labels } from "#draw/labels.js";
import { PlanLayer } from "#draw/planlayer.js";
import { charger, cross, leftover, line, pause, rover, vehicle } from "#draw/shapes.js";
import { drawZone, isWithin, zoneText } from "#draw/zones.js";
import { isOpen, UNKNOWN } from "#log/knownmap.js";
import { along } from "#log/legs.js";
import { trail } from "#log/routes.js";
import { point } from "#text/format.js";
import { onlyFor } from "#text/why.js";

const AGAIN = [6, 6]; // dashes of trails in hues that other carriers have already
const SMALLEST = { carrier: 9, rover: 6 }; // points of the page; however far away, robots can be seen
const NAMED = 3; // points a metre from which on all places are named, if names are on
const LEAST_CHARGER = 6; // points of the page, at least
const SCALE_BARS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]; // metres
const ROUND = 7; // radians, a little more than a circle

export class MapView {
  /** @param {Mission} mission
      @param {string} name
      @param {Camera} camera
      @param {string | null} side the name of the mission's colour beside others, null if it is alone */
  constructor(mission, name, camera, side) {
    this.mission = mission;
    this.side = side;
    this.floor = make("canvas", { class: "floor", "aria-hidden": "true" });
    this.canvas = make("canvas", { class: "map", role: "img", tabindex: "0", "aria-label": `Map of ${name}` });
    this.element = make("div", { class: "canvases" }, this.floor, this.canvas);
    this.g = contextOf(this.canvas);
    this.camera = camera;
    this.ground = new Ground(mission);
    this.layer = new PlanLayer(mission);
    this.ratio = 1; // pixels of the floor a point
    this.painted = -1; // version of the camera for which the floor is painted
    /** @type {Hit | null} */
    this.hovered = null; // the hit under the pointer
    /** @type {{ kind: ZoneKind, corners: Cell[] } | null} */
    this.sketch = null; // a zone that is being drawn
    /** @type {{ name: string, kind: ZoneKind, corners: Cell[] }[]} */
    this.asked = []; // zones that were sent, until the log has them
    /** @type {GuessedGround | null} */
    this.guess = null; // of unknown ground
    /** @type {Hit[]} */
    this.hits = [];
    /** @type {Point[]} */
    this.ringed = []; // where what is chosen is
    /** @type {Map<string, Zone>} */
    this.zones = new Map();
    this.ink = inks();
    this.colours = robotColours(mission);
    this.restyle();
  }

  /** Take the colours of the theme and paint all anew. */
  restyle() {
    const codes = this.mission.start.terrains.map((terrain) => terrain.code);
    const palette = new Uint32Array(256).fill(packed("#808080"));
    for (const code of codes) palette[code] = packed(terrainColour(code, codes));
    this.ink = inks();
    palette[UNKNOWN] = packed(this.ink.unknown) & 0xffffff; // what is guessed shows through
    const alone = palette.slice();
    if (this.side) for (const code of codes.filter(isOpen)) alone[code] = packed(aloneColour(code, codes, this.side));
    this.colours = robotColours(this.mission);
    this.ground.restyle(palette, alone);
    this.layer.forget();
    this.painted = -1;
  }

  /** Show which cells are known here and in none of the other missions.
      @type {(others: KnownMap[]) => void} */
  compare(others) {
    if (others.length === this.ground.others.length) return;
    this.ground.compare(others);
    this.painted = -1;
  }

  /** Take the size of the page's element; `covers` as in `Camera.resize`.
      @type {(covers: Box[]) => void} */
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

  /** The robot of this mission that is followed, or null. */
  get followed() {
    const { followed } = this.camera;
    return followed && this.mission.robots.includes(followed) ? followed : null;
  }

  /** Go to t: point the camera to what is followed then; otherwise to the whole map, while that grows.
      @type {(t: number) => void} */
  aim(t) {
    const { camera, mission, followed } = this;
    this.ground.known.seek(t);
    if (followed) {
      const { x, y } = mission.view(followed, t);
      camera.centre(x, y);
    } else if (camera.fitted && !mission.ended) camera.fit();
  }

  /** Draw the moment; `names`: of the places in the sentence below.
      @type {(t: number, views: RobotView[], layers: Layers, focus: Focus, names: Set<string>) => void} */
  draw(t, views, layers, focus, names) {
    const isOver = this.mission.ended !== null && t >= this.mission.to;
    this.drawGround((layers.guess && !isOver && this.mission.planAt(t)?.guess) || null);
    this.drawTeam(t, views, layers, focus, names);
  }

  /** Bring the floor to the moment: all of it where the camera has moved or another guess is shown, otherwise only the
      tiles that changed.
      @type {(guess: GuessedGround | null) => void} */
  drawGround(guess) {
    const { ratio } = this;
    const { left, top, scale, size, version } = this.camera;
    const changed = this.ground.renew();
    const all = this.painted !== version || this.guess !== guess;
    this.guess = guess;
    if (!all && !changed.size) return;
    const g = contextOf(this.floor);
    this.painted = version;
    if (all) {
      this.drawPart(g, 0, 0, size.width, size.height);
      return;
    }
    /** @type {(v: number) => number} */
    const snap = (v) => Math.floor(v * ratio) / ratio; // to whole pixels, which are clipped without blending
    for (const key of changed) {
      const [x, y, wide, high] = this.ground.place(key, left, top, scale);
      const [px, py] = [snap(x), snap(y)];
      this.drawPart(g, px, py, snap(x + wide) + 1 - px, snap(y + high) + 1 - py);
    }
  }

  /** @type {(g: Context, x: number, y: number, wide: number, high: number) => void} */
  drawPart(g, x, y, wide, high) {
    const { left, top, scale } = this.camera;
    g.save();
    g.beginPath();
    g.rect(x, y, wide, high);
    g.clip();
    g.fillStyle = this.ink.unknown;
    g.fillRect(x, y, wide, high);
    if (this.guess) drawGuess(g, this.guess, this.camera, this.ink);
    this.ground.draw(g, left, top, scale, this.ratio);
    g.restore();
  }

  /** @type {(t: number, views: RobotView[], layers: Layers, focus: Focus, names: Set<string>) => void} */
  drawTeam(t, views, layers, focus, names) {
    const { g, mission } = this;
    const { size, scale } = this.camera;
    this.hits = [];
    this.ringed = [];
    g.clearRect(0, 0, size.width, size.height);
    const end = mission.ended !== null && t >= mission.to ? mission.ended : null;
    const plan = end ? null : mission.planAt(t);
    this.zones = mission.zones.at(t) ?? new Map();
    this.asked = this.asked.filter(({ name }) => !mission.zones.last.has(name));
    for (const { kind, corners } of [...this.zones.values(), ...this.asked, ...(this.sketch ? [this.sketch] : [])]) {
      const points = corners.map((corner) => this.point(...corner));
      drawZone(g, kind, points, this.ink, size);
    }
    for (const place of mission.chargers) {
      charger(g, ...this.point(...place), Math.max(LEAST_CHARGER, 0.5 * scale), this.ink);
    }
    const outside = views.filter((view) => !view.carrier);
    if (layers.sensors) for (const view of outside) this.drawRange(view);
    if (layers.trails) this.drawTrails(views, t, focus.robot);
    if (layers.plan && plan) this.drawPlan(plan, views, t, focus.robot, layers.compared);
    for (const view of outside) if (!view.lost) this.drawRoute(view, t, focus.robot);
    if (end) this.drawRemaining(end.remaining);
    outside.sort((a, b) => Number(b.robot.carrier) - Number(a.robot.carrier));
    for (const view of outside) this.drawRobot(view, views, t);
    this.drawFocus(views, focus);
    this.drawNames(outside, layers.labels, focus, names);
    this.drawScaleBar();
  }

  /** @type {(x: number, y: number) => Point} */
  point(x, y) {
    return this.camera.point(x, y);
  }

  /** Mark what is chosen; a robot that is carried, by its carrier.
      @type {(views: RobotView[], focus: Focus) => void} */
  drawFocus(views, { robot, place }) {
    const view = views.find((one) => one.robot === robot);
    if (view) this.drawRing(...this.point(view.x, view.y), this.radius(view.carrier ?? view.robot) + 6);
    if (!place) return;
    for (const hit of this.hits) if (place === placeOfHit(hit)) this.drawRing(hit.x, hit.y, hit.r + 1);
  }

  /** Name the robots, and of places those in the sentence, chosen or pointed at, or all; none on another.
      @type {(outside: RobotView[], all: boolean, focus: Focus, names: Set<string>) => void} */
  drawNames(outside, all, { place }, names) {
    const labels = new Labels(this.g, this.ink, this.camera);
    const close = this.camera.scale / this.mission.resolution >= NAMED;
    for (const hit of this.hits) if (!hit.remaining) labels.keepFree(hit.x, hit.y, hit.r - 5);
    for (const { robot, away, x, y } of outside) {
      labels.write(`${robot.name}${away ? " (no contact)" : ""}`, ...this.point(x, y), this.radius(robot), true);
    }
    const hovered = placeOfHit(this.hovered);
    const written = new Set();
    for (const hit of this.hits) {
      const name = placeOfHit(hit);
      if (!name || written.has(name)) continue;
      if (name !== place && !names.has(name) && !(all && close) && name !== hovered) continue;
      written.add(name);
      labels.write(this.mission.places.label(name), hit.x, hit.y, 7, false);
    }
  }

  /** @type {(views: RobotView[], t: number, chosen: Robot | null) => void} */
  drawTrails(views, t, chosen) {
    const found = looks(this.mission);
    for (const { robot } of views) {
      this.g.globalAlpha = !chosen || robot === chosen ? 0.4 : 0.12;
      const dash = found.get(robot.name)?.dashed ? AGAIN : [];
      for (const way of trail(robot, t)) {
        const points = way.map(([x, y]) => this.point(x, y));
        line(this.g, points, colourOf(this.colours, robot.name), 2, dash);
      }
    }
    this.g.globalAlpha = 1;
  }

  /** @type {(view: RobotView, t: number, chosen: Robot | null) => void} */
  drawRoute({ robot, leg }, t, chosen) {
    if (!leg.times) return;
    const now = along(leg, t);
    const last = leg.xs.length - 1;
    if (now.i >= last) return;
    const points = [this.point(now.x, now.y)];
    for (let k = now.i + 1; k <= last; k++) points.push(this.point(leg.xs[k], leg.ys[k]));
    if (chosen && chosen !== robot) this.g.globalAlpha = 0.3;
    line(this.g, points, this.ink.page, 4.5);
    line(this.g, points, colourOf(this.colours, robot.name), 2.25, [6, 5]);
    this.g.globalAlpha = 1;
  }

  /** Lay the plan over the map; `compared`: with what the next best one has all robots do instead.
      @type {(plan: Plan, views: RobotView[], t: number, chosen: Robot | null, compared: boolean) => void} */
  drawPlan(plan, views, t, chosen, compared) {
    const { layer, camera, ink, colours } = this;
    layer.draw(plan, views, t, { camera, ink, colours, chosen, compared });
    this.g.drawImage(layer.canvas, 0, 0, camera.size.width, camera.size.height);
    this.hits.push(...layer.hits);
  }

  /** @type {(view: RobotView) => void} */
  drawRange({ robot, lost, x, y }) {
    if (lost) return;
    const { g } = this;
    const colour = colourOf(this.colours, robot.name);
    g.beginPath();
    g.arc(...this.point(x, y), (robot.kind.sensor_range_m / this.mission.resolution) * this.camera.scale, 0, ROUND);
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

  /** @type {(view: RobotView, views: RobotView[], t: number) => void} */
  drawRobot({ robot, lost, action, heading, ...view }, views, t) {
    const { g, ink, mission } = this;
    const isOver = mission.ended !== null && t >= mission.to;
    const [x, y] = this.point(view.x, view.y);
    const r = this.radius(robot);
    const colour = lost ? ink.dim : colourOf(this.colours, robot.name);
    if (!robot.carrier && action?.carrier) this.drawDocking(action.name, action.carrier, t, x, y);
    if (robot.carrier) {
      const cargo = views.filter((other) => other.carrier === robot);
      const aboard = cargo.map((other) => colourOf(this.colours, other.robot.name));
      vehicle(g, x, y, r, heading, colour, robot.kind.capacity, aboard, ink);
    } else rover(g, x, y, r, heading, colour, ink);
    if (lost) cross(g, x, y, r * 0.8, ink);
    else if (!action && !isOver) pause(g, x - r - 5, y - r, ink);
    this.hits.push({ x, y, r: r + 5, robot });
  }

  /** @type {(x: number, y: number, r: number) => void} */
  drawRing(x, y, r) {
    this.ringed.push([x, y]);
    this.g.beginPath();
    this.g.arc(x, y, r, 0, ROUND);
    this.g.lineWidth = 2;
    this.g.strokeStyle = this.ink.accent;
    this.g.stroke();
  }

  /** A line that runs from a rover at a point to its carrier (dock) or from there to it (undock).
      @type {(name: ActionName, carrier: string, t: number, x: number, y: number) => void} */
  drawDocking(name, carrier, t, x, y) {
    const other = this.mission.view(this.mission.robot(carrier), t);
    this.g.lineDashOffset = ((name === "dock" ? -1 : 1) * (t / 120)) % 8;
    line(this.g, [[x, y], this.point(other.x, other.y)], this.ink.ink, 3, [5, 3]);
    this.g.lineDashOffset = 0;
  }

  /** Radius of a robot on the page: its true one, or as much as it takes to be seen.
      @type {(robot: Robot) => number} */
  radius({ kind }) {
    return Math.max((kind.radius_m / this.mission.resolution) * this.camera.scale, SMALLEST[kind.role]);
  }

  /** @type {(left: Remaining[]) => void} */
  drawRemaining(left) {
    for (const remaining of left) {
      const [x, y] = this.point(...remaining.cell);
      leftover(this.g, x, y, this.ink);
      this.hits.push({ x, y, r: 9, remaining });
    }
  }

  drawScaleBar() {
    const { g, ink } = this;
    const metre = this.camera.scale / this.mission.resolution;
    const length = SCALE_BARS.find((m) => m * metre >= 48) || 5000;
    const [x, y, end] = [12, this.canvas.height / this.ratio - 10, 12 + length * metre];
    /** @type {Point[]} */
    const way = [
      [x, y - 5],
      [x, y],
      [end, y],
      [end, y - 5],
    ];
    line(g, way, ink.card, 5);
    line(g, way, ink.ink, 2);
    g.font = `11px ${FONT}`;
    g.textBaseline = "alphabetic";
    g.lineWidth = 3;
    g.strokeStyle = ink.card;
    g.fillStyle = ink.ink;
    g.strokeText(`${length} m`, x + 5, y - 5);
    g.fillText(`${length} m`, x + 5, y - 5);
  }

  /** What is drawn at a point of the canvas: a robot, target, meeting point or frontier left; null for nothing.
      @type {(px: number, py: number) => Hit | null} */
  hit(px, py) {
    return this.hits.findLast(({ x, y, r }) => (x - px) ** 2 + (y - py) ** 2 <= r ** 2) ?? null;
  }

  /** Metres in the map's frame, and what is there, as text.
      @type {(px: number, py: number) => string} */
  whereAt(px, py) {
    const { mission, camera } = this;
    const cell = camera.cell(px, py);
    const code = this.ground.known.at(...cell);
    const guessed = code === UNKNOWN && this.guess ? guessedAt(this.guess, cell) : null;
    const texts = [point(mission.metres(cell)), this.groundText(code), ...(guessed ? [guessed] : [])];
    if (this.ground.isAlone(...cell)) texts.push("known here only");
    if (mission.chargers.some(([x, y]) => x === cell[0] && y === cell[1])) texts.push("charging place");
    const place = camera.place(px, py);
    for (const [name, zone] of this.zones) if (isWithin(zone, place)) texts.push(zoneText(name, zone));
    return texts.join(" · ");
  }

  /** A terrain class with who can drive on it, where not all can.
      @type {(code: number) => string} */
  groundText(code) {
    if (code === UNKNOWN) return "unknown";
    const name = this.mission.terrain(code)?.name ?? `terrain ${code}`;
    const only = code > 0 ? onlyFor(this.mission, code) : "";
    return only ? `${name} (${only})` : name;
  }
}

/** @type {(hit: Hit | null) => string | undefined} */
function placeOfHit(hit) {
  return hit?.target ?? hit?.meeting;
}
