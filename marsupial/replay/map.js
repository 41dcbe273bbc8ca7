/* The map: what is known, painted as it becomes known, and on it the robots, their routes and the plan. */

import { Ground } from "./ground.js";
import { UNKNOWN } from "./knownmap.js";
import { along } from "./legs.js";

const HUES = [212, 22, 275, 150, 335, 48, 188, 100];
const TRAIL_MS = 120000;
const SMALLEST = { carrier: 8, rover: 5 };

/** One colour per robot: a hue for each carrier, its own rovers beside it. */
export function robotColours(mission) {
  const colours = new Map(), family = new Map();
  let loose = 0;
  for (const robot of mission.robots) {
    if (robot.carrier) family.set(robot.name, { hue: HUES[family.size % HUES.length], rovers: 0 });
  }
  for (const robot of mission.robots) {
    const kin = family.get(robot.carrier ? robot.name : robot.home);
    if (robot.carrier) colours.set(robot.name, `hsl(${kin.hue} 78% 44%)`);
    else if (kin) {
      const k = kin.rovers++;
      colours.set(robot.name, `hsl(${kin.hue + (k % 2 ? -24 : 24) * Math.ceil((k + 1) / 2)} 74% ${k % 2 ? 50 : 57}%)`);
    } else colours.set(robot.name, `hsl(${(HUES[loose++ % HUES.length] + 70) % 360} 60% 50%)`);
  }
  return colours;
}

export function themeColour(name) { return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); }

/** CSS colour of a terrain class; classes that no map has from the start get one from their name. */
export function terrainColour(terrain) {
  if (terrain.code === 0) return themeColour("obstacle");
  if (terrain.code === 1) return themeColour("floor");
  if (terrain.code === 2) return themeColour("rough");
  let hash = 7;
  for (const letter of terrain.name) hash = (hash * 31 + letter.codePointAt(0)) % 360;
  return `hsl(${hash} 55% ${terrain.blocks_sight ? 42 : 78}%)`;
}

export class MapView {
  constructor(canvas, mission, colours) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.mission = mission;
    this.colours = colours;
    this.ground = new Ground(mission);
    this.palette = new Uint32Array(256);
    this.scale = 1;
    this.left = 0;
    this.top = 0;
    this.fitted = true;
    this.hits = [];
    this.restyle();
  }

  /** Take the colours of the theme and paint the map anew. */
  restyle() {
    const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    const packed = (colour) => {
      probe.fillStyle = colour;
      probe.fillRect(0, 0, 1, 1);
      return new Uint32Array(probe.getImageData(0, 0, 1, 1).data.buffer)[0];
    };
    this.palette.fill(packed("#808080"));
    for (const terrain of this.mission.start.terrains) this.palette[terrain.code] = packed(terrainColour(terrain));
    this.palette[UNKNOWN] = packed(themeColour("unknown"));
    this.ink = Object.fromEntries(["unknown", "target", "meeting", "bad", "ink", "card"].map((name) => [name, themeColour(name)]));
    this.ground.restyle(this.palette);
  }

  /** Show all that is ever known. */
  fit() {
    const { width, height } = this.size();
    const box = this.mission.sightings.box || { left: 0, right: this.mission.width - 1, low: 0, high: this.mission.height - 1 };
    const across = box.right - box.left + 1, up = box.high - box.low + 1;
    this.scale = Math.min((width - 36) / across, (height - 84) / up);
    this.left = (width - across * this.scale) / 2 - box.left * this.scale;
    this.top = (height + 34 - up * this.scale) / 2 - 8 + (box.high + 1) * this.scale;
    this.fitted = true;
  }

  size() { return { width: this.canvas.clientWidth, height: this.canvas.clientHeight }; }

  resize() {
    const { width, height } = this.size(), ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    if (this.fitted) this.fit();
  }

  zoom(factor, x = this.size().width / 2, y = this.size().height / 2) {
    const scale = Math.min(200, Math.max(0.02, this.scale * factor));
    this.left = x - (x - this.left) * scale / this.scale;
    this.top = y - (y - this.top) * scale / this.scale;
    this.scale = scale;
    this.fitted = false;
  }

  pan(dx, dy) { this.left += dx; this.top += dy; this.fitted = false; }

  centre(cell) {
    const { width, height } = this.size();
    this.scale = Math.max(this.scale, 24 * this.mission.resolution);
    this.left = this.top = 0;
    const [x, y] = this.toScreen(cell[0], cell[1]);
    this.pan(width / 2 - x, height / 2 - y);
  }

  /** Page position, within the canvas, of a point in cells. */
  toScreen(x, y) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  toCell(px, py) {
    return [Math.floor((px - this.left) / this.scale), Math.floor((this.top - py) / this.scale)];
  }

  draw(t, show) {
    this.ground.seek(t);
    const g = this.context, ratio = window.devicePixelRatio || 1, { width, height } = this.size();
    const { mission, scale } = this;
    this.hits = [];
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = this.ink.unknown;
    g.fillRect(0, 0, width, height);
    this.ground.draw(g, this.left, this.top, scale, ratio);
    g.lineJoin = g.lineCap = "round";
    const views = mission.views(t), over = mission.ended !== null && t >= mission.to;
    const plan = over ? null : mission.plans[mission.planIndex(t)] || null;
    if (show.trails) for (const view of views) this.drawTrail(view, t);
    if (show.plan && plan) this.drawPlan(plan, views, t);
    for (const view of views) if (!view.carrier && !view.lost) this.drawRoute(view, t);
    if (show.sensors) for (const view of views) this.drawRange(view);
    if (over) this.drawRemaining();
    const outside = views.filter((view) => !view.carrier);
    outside.sort((a, b) => b.robot.kind.radius_m - a.robot.kind.radius_m);
    for (const view of outside) this.drawRobot(view, views, t);
    if (show.labels) this.drawNames(outside);
    this.drawScaleBar(height);
  }

  line(points, colour, width, dash) {
    const g = this.context;
    g.setLineDash(dash);
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.beginPath();
    points.forEach(([x, y], i) => (i ? g.lineTo(x, y) : g.moveTo(x, y)));
    g.stroke();
    g.setLineDash([]);
  }

  drawTrail(view, t) {
    const { legs } = view.robot, since = t - TRAIL_MS, g = this.context;
    let points = [];
    const flush = () => {
      if (points.length > 1) this.line(points, this.colours.get(view.robot.name), 2, []);
      points = [];
    };
    g.globalAlpha = 0.38;
    for (let i = Math.max(legs.index(since), 0); i < legs.times.length && legs.times[i] <= t; i++) {
      const leg = legs.values[i], until = Math.min(t, i + 1 < legs.times.length ? legs.times[i + 1] : t);
      if (leg.aboard) { flush(); continue; }
      if (!leg.times) { points.push(this.toScreen(leg.x, leg.y)); continue; }
      const end = along(leg, until);
      for (let k = along(leg, Math.max(since, legs.times[i])).i; k <= end.i; k++) points.push(this.toScreen(leg.xs[k], leg.ys[k]));
      points.push(this.toScreen(end.x, end.y));
    }
    flush();
    g.globalAlpha = 1;
  }

  drawRoute(view, t) {
    const { leg } = view;
    if (!leg.times) return;
    const now = along(leg, t), last = leg.xs.length - 1;
    if (now.i >= last) return;
    const points = [this.toScreen(now.x, now.y)];
    for (let k = now.i + 1; k <= last; k++) points.push(this.toScreen(leg.xs[k], leg.ys[k]));
    this.line(points, "#ffffffb0", 4.5, []);
    this.line(points, this.colours.get(view.robot.name), 2, [6, 5]);
  }

  drawPlan(plan, views, t) {
    const g = this.context;
    g.globalAlpha = 0.85;
    for (const view of views) {
      for (const points of this.plannedWays(plan, view, t)) this.line(points, this.colours.get(view.robot.name), 1.75, [1, 5]);
    }
    g.globalAlpha = 1;
    for (const meeting of plan.meetings) this.drawMeeting(meeting);
    for (const target of plan.targets) this.drawTarget(target);
  }

  /** Where a robot will go by the plan after what it does now: a way for each stretch that it is not aboard. */
  plannedWays(plan, view, t) {
    const { leg, robot } = view, ways = [[]];
    if (!view.carrier) ways[0].push(leg.times ? [leg.xs[leg.xs.length - 1], leg.ys[leg.ys.length - 1]] : [leg.x, leg.y]);
    for (const action of plan.actions) {
      if (action.start_ms <= t || (action.robot !== robot.name && action.carrier !== robot.name)) continue;
      if (action.name === "undock" && !robot.carrier) ways.push([]);
      const cell = this.mission.placeCell(plan, action.place, robot);
      if (cell) ways[ways.length - 1].push(cell);
    }
    return ways.filter((way) => way.length > 1).map((way) => way.map((cell) => this.toScreen(...cell)));
  }

  drawTarget(target) {
    const [x, y] = this.toScreen(...target.cell);
    const roles = target.explorers.map((name) => this.mission.start.types.find((type) => type.name === name)).filter(Boolean);
    diamond(this.context, x, y, 6.5, this.ink.target, roles.some((type) => type.role === "carrier"));
    const who = target.explorers.join(", ") || "nobody";
    this.hits.push({ x, y, r: 9, text: `target ${target.name}\ncan be explored by: ${who}\n${target.frontier_cells} frontier cells, may reveal ${round(target.reveal_m2)} m²` });
  }

  drawMeeting(meeting) {
    const g = this.context, [cx, cy] = this.toScreen(...meeting.carrier_cell), [rx, ry] = this.toScreen(...meeting.rover_cell);
    this.line([[cx, cy], [rx, ry]], this.ink.meeting, 2, []);
    meetingMark(g, cx, cy, rx, ry, this.ink.meeting);
    const text = `meeting point ${meeting.name}\n${meeting.carrier_type} at the square, ${meeting.rover_type} at the dot`;
    this.hits.push({ x: cx, y: cy, r: 8, text }, { x: rx, y: ry, r: 6, text });
  }

  drawRange(view) {
    if (view.carrier || view.lost) return;
    const g = this.context, [x, y] = this.toScreen(view.x, view.y);
    g.beginPath();
    g.arc(x, y, view.robot.kind.sensor_range_m / this.mission.resolution * this.scale, 0, 7);
    g.globalAlpha = 0.09;
    g.fillStyle = this.colours.get(view.robot.name);
    g.fill();
    g.globalAlpha = 0.8;
    g.strokeStyle = this.colours.get(view.robot.name);
    g.lineWidth = 1.25;
    g.setLineDash([3, 4]);
    g.stroke();
    g.setLineDash([]);
    g.globalAlpha = 1;
  }

  drawRobot(view, views, t) {
    const g = this.context, [x, y] = this.toScreen(view.x, view.y), { robot } = view;
    const r = this.radius(robot);
    const cargo = views.filter((other) => other.carrier === robot);
    disc(g, x, y, r, this.colours.get(robot.name), view.lost);
    if (robot.carrier) pips(g, x, y, r, robot.kind.capacity, cargo.map((other) => this.colours.get(other.robot.name)));
    if (view.action && (view.action.name === "dock" || view.action.name === "undock") && !robot.carrier) this.drawDocking(view, t, x, y);
    if (view.lost) cross(g, x, y, r * 0.8, "#fff", 2);
    this.hits.push({ x, y, r: r + 4, text: this.describe(view, cargo) });
  }

  /** A line that runs from rover to carrier (dock) or from carrier to rover (undock). */
  drawDocking(view, t, x, y) {
    const carrier = this.mission.view(this.mission.byName.get(view.action.carrier), t);
    const [cx, cy] = this.toScreen(carrier.x, carrier.y), g = this.context, docks = view.action.name === "dock";
    g.lineDashOffset = (docks ? -1 : 1) * (t / 120) % 8;
    this.line([[x, y], [cx, cy]], themeColour(view.action.name), 3, [5, 3]);
    g.lineDashOffset = 0;
  }

  describe(view, cargo) {
    const lines = [`${view.robot.name} (${view.robot.kind.name})`, doing(view)];
    if (view.robot.carrier) {
      const names = cargo.map((other) => other.robot.name).join(", ") || "no rover";
      lines.push(`carries ${names}; room for ${view.robot.kind.capacity}`);
    }
    lines.push(`${round(view.driven)} m driven`);
    return lines.join("\n");
  }

  /** Write each name beside its robot, at the first of four places where it covers no other name. */
  drawNames(views) {
    const g = this.context, taken = [];
    g.font = "600 11px system-ui, 'DejaVu Sans', sans-serif";
    g.textBaseline = "middle";
    for (const view of views) {
      const [x, y] = this.toScreen(view.x, view.y), r = this.radius(view.robot);
      const wide = g.measureText(view.robot.name).width + 8, high = 15;
      const spots = [[x + r + 4, y - r - 9], [x + r + 4, y + r - 6], [x - r - 4 - wide, y - r - 9], [x - r - 4 - wide, y + r - 6]];
      const free = ([left, top]) => taken.every(([l, t, w]) => left > l + w || left + wide < l || top > t + high || top + high < t);
      const [left, top] = spots.find(free) || spots[0];
      taken.push([left, top, wide]);
      g.fillStyle = "#ffffffd8";
      g.beginPath();
      g.roundRect(left, top, wide, high, 4);
      g.fill();
      g.fillStyle = "#15181c";
      g.fillText(view.robot.name, left + 4, top + 8);
    }
  }

  /** Radius of a robot on the page: its true one, or as much as it takes to be seen. */
  radius(robot) {
    return Math.max(robot.kind.radius_m / this.mission.resolution * this.scale, SMALLEST[robot.kind.role]);
  }

  drawRemaining() {
    for (const frontier of this.mission.ended.remaining) {
      const [x, y] = this.toScreen(...frontier.cell);
      cross(this.context, x, y, 5, "#fff", 4);
      cross(this.context, x, y, 5, this.ink.bad, 2);
      this.hits.push({ x, y, r: 8, text: `left unexplored\n${frontier.reason}\n${frontier.frontier_cells} frontier cells` });
    }
  }

  drawScaleBar(height) {
    const metre = this.scale / this.mission.resolution;
    const length = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].find((m) => m * metre >= 60) || 5000;
    const g = this.context, x = 14, y = height - 14;
    this.line([[x, y - 5], [x, y], [x + length * metre, y], [x + length * metre, y - 5]], "#ffffffd0", 5, []);
    this.line([[x, y - 5], [x, y], [x + length * metre, y], [x + length * metre, y - 5]], "#15181c", 2, []);
    g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    g.textBaseline = "alphabetic";
    g.lineWidth = 3;
    g.strokeStyle = "#ffffffd0";
    g.fillStyle = "#15181c";
    g.strokeText(`${length} m`, x + 5, y - 5);
    g.fillText(`${length} m`, x + 5, y - 5);
  }

  /** What the pointer is on, as text, or null. The last drawn wins. */
  textAt(px, py) {
    for (let i = this.hits.length - 1; i >= 0; i--) {
      const hit = this.hits[i];
      if ((hit.x - px) ** 2 + (hit.y - py) ** 2 <= hit.r ** 2) return hit.text;
    }
    return null;
  }

  /** Metres in the map frame and terrain at a point of the canvas, as text. */
  whereAt(px, py) {
    const [x, y] = this.toCell(px, py), [mx, my] = this.mission.metres([x, y]);
    const code = this.ground.known.at(x, y), terrain = this.mission.terrain(code);
    const name = code === UNKNOWN ? "unknown" : terrain ? terrain.name : `terrain ${code}`;
    return `${mx.toFixed(2)}, ${my.toFixed(2)} m · cell ${x}, ${y} · ${name}`;
  }
}

export function disc(g, x, y, r, colour, lost) {
  g.beginPath();
  g.arc(x, y, r, 0, 7);
  g.fillStyle = lost ? "#7a7f87" : colour;
  g.fill();
  g.lineWidth = 3;
  g.strokeStyle = "#15181c";
  g.stroke();
  g.lineWidth = 1.6;
  g.strokeStyle = "#fff";
  g.stroke();
}

/** The places of a carrier round its middle: a dot in the rover's colour, or a ring where none is aboard. */
export function pips(g, x, y, r, capacity, aboard) {
  const count = Math.max(capacity, aboard.length), around = count > 1 ? r * 0.5 : 0;
  const size = Math.min(r * 0.36, count > 1 ? Math.max(1.8, around * Math.sin(Math.PI / count) * 0.85) : r * 0.45);
  for (let k = 0; k < count; k++) {
    const angle = 2 * Math.PI * k / count - Math.PI / 2 + (count === 2 ? Math.PI / 2 : 0);
    g.beginPath();
    g.arc(x + around * Math.cos(angle), y + around * Math.sin(angle), size, 0, 7);
    g.fillStyle = k < aboard.length ? aboard[k] : "#00000038";
    g.fill();
    g.lineWidth = 1;
    g.strokeStyle = k < aboard.length ? "#fff" : "#ffffffa0";
    g.stroke();
  }
}

export function diamond(g, x, y, r, colour, filled) {
  g.beginPath();
  g.moveTo(x, y - r);
  g.lineTo(x + r, y);
  g.lineTo(x, y + r);
  g.lineTo(x - r, y);
  g.closePath();
  g.lineWidth = 4;
  g.strokeStyle = "#fffffff0";
  g.stroke();
  g.fillStyle = filled ? colour : "#fff";
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = colour;
  g.stroke();
}

export function meetingMark(g, cx, cy, rx, ry, colour) {
  g.lineWidth = 2;
  g.fillStyle = "#fff";
  g.strokeStyle = colour;
  g.fillRect(cx - 4.5, cy - 4.5, 9, 9);
  g.strokeRect(cx - 4.5, cy - 4.5, 9, 9);
  g.beginPath();
  g.arc(rx, ry, 3.5, 0, 7);
  g.fillStyle = colour;
  g.fill();
}

export function cross(g, x, y, r, colour, width) {
  g.lineWidth = width;
  g.strokeStyle = colour;
  g.beginPath();
  g.moveTo(x - r, y - r);
  g.lineTo(x + r, y + r);
  g.moveTo(x + r, y - r);
  g.lineTo(x - r, y + r);
  g.stroke();
}

export function round(value) { return Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(1); }

/** What a robot is doing, in words. */
export function doing(view) {
  if (view.lost) return `lost: ${view.robot.lost.reason}`;
  if (view.carrier) return `aboard ${view.carrier.name}`;
  const { action } = view;
  if (!action) return "waits";
  if (action.carrier === null) return `${action.name} ${action.place}`;
  if (action.robot === view.robot.name) return `${action.name} ${action.name === "dock" ? "on" : "from"} ${action.carrier}`;
  return `${action.name} ${action.robot}`;
}
