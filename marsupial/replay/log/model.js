/* A mission, built up from its log line by line: who is where, doing what, and what is known, at any moment.

   A mission grows: `append` takes one line of the log (docs/mission-log.md) at any time, at a cost that does not depend
   on what came before, and any moment may be queried between two lines. Touches no page.

   Cells are those of the first frame of the mission. Where the frame grows, later lines have cells of another
   one; `append` takes them back, so that nothing that is known already has to change. */

import { noteAlong } from "#log/ahead.js";
import { History, lastAt } from "#log/history.js";
import { KnownMap, Sightings } from "#log/knownmap.js";
import { along, begun, driving, ended, riding, standing } from "#log/legs.js";
import { firstName, Places } from "#log/places.js";
import { readRuns, readStrips } from "#log/strips.js";

const EAST = 0;

export class Mission {
  constructor() {
    this.start = null;
    this.ended = null;
    this.shift = [0, 0];
    this.robots = [];
    this.byName = new Map();
    this.plans = [];
    this.planTimes = [];
    this.places = new Places();
    this.cells = new Map(); // of a robot at a place, as "robot place", from the actions that were started
    this.revisions = new Map();
    this.docked = new History();
    this.zones = new History(); // that hold, by name
    this.lastPlaces = { targets: new Map(), meetings: new Map() };
    this.lines = 0;
  }

  /** Take in the next line of the log, as parsed. */
  append(line) {
    this.lines++;
    if (line.event === "mission") this.begin(line);
    else this[`on_${line.event}`]?.(line);
    this.to = Math.max(this.to, line.t_ms, this.from + 1);
  }

  begin(line) {
    this.start = line;
    this.from = line.t_ms;
    this.to = line.t_ms + 1;
    this.width = line.width;
    this.height = line.height;
    this.resolution = line.resolution_m;
    this.sightings = new Sightings(line.t_ms);
    this.docked.add(line.t_ms, { down: 0, up: 0 });
    this.zones.add(line.t_ms, new Map());
    this.chargers = line.chargers ?? []; // charging places
    this.robots = line.robots.map((placed) => this.newRobot(placed));
    this.byName = new Map(this.robots.map((robot) => [robot.name, robot]));
  }

  newRobot(placed) {
    const kind = this.start.types.find((type) => type.name === placed.type);
    const robot = {
      name: placed.name,
      kind,
      carrier: kind.role === "carrier",
      home: placed.carrier,
      legs: new History(),
      driven: [],
      actions: new History(),
      segments: [],
      starts: [],
      aboard: [],
      running: null,
      losses: [],
      partings: [],
      speed: 1,
      where: null,
      charges: new History(), // shares of its battery, as plans note them
    };
    this.put(robot, this.from, {
      at: placed.cell ? standing(placed.cell, EAST) : null,
      carrier: placed.carrier,
      left: null,
    });
    return robot;
  }

  /** Put a robot somewhere from t on: `where` says what it stands or drives on, or whom it is aboard. */
  put(robot, t, where) {
    const was = robot.where,
      last = robot.legs.values.length - 1;
    robot.where = where;
    if (was && was.at === where.at && (where.at !== null || was.carrier === where.carrier)) return;
    const before = last < 0 ? 0 : robot.driven[last] + (robot.legs.last.times ? along(robot.legs.last, t).length : 0);
    const open = robot.aboard[robot.aboard.length - 1];
    if (open && open.to === null) open.to = t;
    if (where.at === null) robot.aboard.push({ start: t, to: null, carrier: where.carrier });
    robot.legs.add(t, where.at ?? riding(where.carrier));
    robot.driven.push(before);
  }

  on_reveal(line) {
    this.see(line);
  }

  on_change(line) {
    this.see(line);
  }

  see(line) {
    const [dx, dy] = this.shift,
      width = this.width;
    for (const [robot, after, text] of line.looks || [[line.robot, 0, null]]) {
      const t = line.t_ms + after;
      this.sightings.add(t, robot, (take) => {
        const moved = (x, y, cells, code) => take(x - dx, y - dy, cells, code);
        if (text === null) readRuns(line.runs, width, moved);
        else readStrips(text, moved);
      });
      this.to = Math.max(this.to, t);
    }
  }

  on_frame(line) {
    this.shift = [this.shift[0] + line.shift[0], this.shift[1] + line.shift[1]];
    this.width = line.width;
    this.height = line.height;
  }

  on_drive(line) {
    const robot = this.byName.get(line.robot),
      heading = along(robot.legs.last, line.t_ms).heading;
    const kind = { ...robot.kind, speed_mps: robot.kind.speed_mps * robot.speed };
    const at = driving(line.t_ms, this.cell(line.cell), line.steps, this.resolution, kind, heading);
    this.put(robot, line.t_ms, { at, carrier: robot.where.carrier, left: null });
  }

  on_stand(line) {
    const robot = this.byName.get(line.robot),
      heading = along(robot.legs.last, line.t_ms).heading;
    this.put(robot, line.t_ms, {
      at: standing(this.cell(line.cell), heading),
      carrier: robot.where.carrier,
      left: null,
    });
  }

  on_plan(line) {
    const targets = this.named(line, "targets"),
      meetings = this.named(line, "meetings");
    const plan = {
      t_ms: line.t_ms,
      revision: line.revision,
      trigger: this.renamed(line.trigger),
      targets,
      meetings,
      actions: noteAlong(line.actions.map((action) => this.action(action))),
      looks: this.sightings.times.length,
    };
    for (const [name, share] of line.charges ?? []) this.byName.get(name).charges.add(line.t_ms, share);
    this.plans.push(plan);
    this.planTimes.push(plan.t_ms);
    this.revisions.set(plan.revision, plan);
  }

  /** The targets or meeting points of a plan: those that stood in the one before just the same are only named. */
  named(line, part) {
    const before = this.lastPlaces[part],
      kind = part === "targets" ? "target" : "meeting",
      logged = new Map();
    const things = line[part].map((thing) => {
      if (typeof thing === "string") return before.get(firstName(thing, this.shift));
      const moved = { ...thing, name: firstName(thing.name, this.shift) };
      for (const key of ["cell", "carrier_cell", "rover_cell"]) if (thing[key]) moved[key] = this.cell(thing[key]);
      logged.set(moved.name, thing.name);
      return moved;
    });
    for (const thing of things) this.places.enter(kind, thing, line.t_ms, logged.get(thing.name) || thing.name);
    this.lastPlaces[part] = new Map(things.map((thing) => [thing.name, thing]));
    return things;
  }

  on_start(line) {
    const action = this.action(line.action),
      cell = this.cell(line.cell),
      same = ["name", "robot", "place"];
    const planned = this.plans.at(-1)?.actions.find((one) => same.every((part) => one[part] === action[part]));
    action.along = planned?.along ?? false;
    this.cells.set(`${action.robot} ${action.place}`, cell);
    for (const robot of this.partners(action)) {
      this.finish(robot, line.t_ms, null);
      robot.running = { start: line.t_ms, to: null, action, revision: line.revision, end: null };
      robot.segments.push(robot.running);
      robot.starts.push(line.t_ms);
      robot.actions.add(line.t_ms, action);
    }
    if (action.carrier === null) return;
    const rover = this.byName.get(action.robot),
      heading = this.view(rover, line.t_ms).heading;
    this.put(rover, line.t_ms, begun(rover.where, action, standing(cell, heading)));
  }

  on_end(line) {
    const action = this.action(line.action);
    for (const robot of this.partners(action)) {
      this.finish(robot, line.t_ms, line.end);
      robot.actions.add(line.t_ms, null);
    }
    if (action.carrier === null) return;
    const rover = this.byName.get(action.robot),
      { down, up } = this.docked.last;
    this.put(rover, line.t_ms, ended(rover.where, action, line.end));
    if (line.end !== "done") return;
    this.docked.add(line.t_ms, action.name === "undock" ? { down: down + 1, up } : { down, up: up + 1 });
  }

  finish(robot, t, end) {
    if (robot.running) Object.assign(robot.running, { to: t, end });
    robot.running = null;
  }

  on_lost(line) {
    const { losses } = this.byName.get(line.robot),
      last = losses[losses.length - 1];
    if (!last || last.to !== null) losses.push({ start: line.t_ms, to: null, reason: line.reason });
  }

  on_returned(line) {
    const { losses } = this.byName.get(line.robot);
    if (losses.length) losses[losses.length - 1].to = line.t_ms;
  }

  on_away(line) {
    this.byName
      .get(line.robot)
      .partings.push({ start: line.t_ms, to: null, cell: this.cell(line.cell), wait_ms: line.wait_ms });
  }

  on_contact(line) {
    this.byName.get(line.robot).partings.at(-1).to = line.t_ms;
  }

  on_speed(line) {
    this.byName.get(line.robot).speed = line.share;
  }

  on_zone(line) {
    const zones = new Map(this.zones.last);
    zones.delete(line.name);
    if (line.zone) {
      zones.set(line.name, { ...line.zone, corners: line.zone.polygon_m.map((point) => this.place(point)) });
    }
    this.zones.add(line.t_ms, zones);
  }

  on_ended(line) {
    const worded = ({ reason }) =>
      reason.replace(/\b[tm](_-?\d+)+\w*/g, (name) => this.places.get(firstName(name, this.shift))?.label ?? name);
    this.ended = {
      ...line,
      reason: worded(line),
      remaining: line.remaining.map((one) => ({ ...one, cell: this.cell(one.cell), reason: worded(one) })),
    };
  }

  /** A cell of the frame as it is now, in the first one. */
  cell([x, y]) {
    return [x - this.shift[0], y - this.shift[1]];
  }

  action(action) {
    const { place, origin } = action;
    return { ...action, place: firstName(place, this.shift), origin: origin && firstName(origin, this.shift) };
  }

  renamed(trigger) {
    return trigger.replace(/\b[tm](_-?\d+)+\S*?(?=[,;]|$)/g, (name) => firstName(name, this.shift));
  }

  partners(action) {
    return [action.robot, action.carrier].filter((name) => name !== null).map((name) => this.byName.get(name));
  }

  /** Everything about a robot at t: cell position, heading, carrier, action, metres driven, its loss and parting, or null. */
  view(robot, t) {
    const i = Math.max(robot.legs.index(t), 0),
      leg = robot.legs.values[i];
    const carrier = leg.aboard ? this.byName.get(leg.aboard) : null;
    const point = along(carrier ? carrier.legs.at(t) : leg, t);
    const now = (spans) => spans.find(({ start, to }) => start <= t && (to === null || t < to)) ?? null;
    return {
      robot,
      carrier,
      x: point.x,
      y: point.y,
      heading: point.heading,
      leg,
      action: robot.actions.at(t),
      driven: robot.driven[i] + (leg.times ? point.length : 0),
      lost: now(robot.losses),
      away: now(robot.partings),
      charge: robot.charges.at(t),
    };
  }

  /** Where the battery of a robot charges: "aboard c1", "at a charging place"; null if it does not. */
  charging({ robot, carrier, leg, lost }) {
    if (!robot.kind.battery || lost) return null;
    if (carrier) return `aboard ${carrier.name}`;
    const stands = !leg.times && this.chargers.some(([x, y]) => x === leg.x && y === leg.y);
    return stands ? "at a charging place" : null;
  }

  views(t) {
    return this.robots.map((robot) => this.view(robot, t));
  }

  planIndex(t) {
    return lastAt(this.planTimes, t);
  }

  planAt(t) {
    return this.plans[this.planIndex(t)] || null;
  }

  /** The action of a robot at t with its start, end and plan; null while it has none. */
  segmentAt(robot, t) {
    const action = robot.actions.at(t);
    return action && robot.segments[lastAt(robot.starts, t)];
  }

  /** The cell where `robot` has to be at a place of a plan, or null where the log does not say. */
  placeCell(plan, place, robot) {
    const target = plan.targets.find((one) => one.name === place);
    if (target) return target.cell;
    const meeting = plan.meetings.find((one) => one.name === place);
    if (meeting) return robot.carrier ? meeting.carrier_cell : meeting.rover_cell;
    return this.cells.get(`${robot.name} ${place}`) || null;
  }

  /** Area known at t that is no obstacle, in square metres. */
  openArea(t) {
    return this.sightings.openAt(t) * this.resolution * this.resolution;
  }

  metres(cell) {
    return metresOf(this.start, cell);
  }

  place(point) {
    return placeOf(this.start, point);
  }

  terrain(code) {
    return this.start.terrains.find((one) => one.code === code) || null;
  }

  /** The map as known at a moment, to be moved through time. */
  knownMap() {
    return new KnownMap(this.sightings);
  }
}

/** Metres in a map's frame of a cell. */
export function metresOf({ origin_m: [x0, y0, yaw], resolution_m }, [x, y]) {
  const dx = (x + 0.5) * resolution_m,
    dy = (y + 0.5) * resolution_m;
  return [x0 + Math.cos(yaw) * dx - Math.sin(yaw) * dy, y0 + Math.sin(yaw) * dx + Math.cos(yaw) * dy];
}

/** The place in cells of a point of a map's frame in metres. */
export function placeOf({ origin_m: [x0, y0, yaw], resolution_m }, [x, y]) {
  const dx = (x - x0) / resolution_m,
    dy = (y - y0) / resolution_m;
  return [Math.cos(yaw) * dx + Math.sin(yaw) * dy - 0.5, Math.cos(yaw) * dy - Math.sin(yaw) * dx - 0.5];
}

/** A mission from the text of its log. */
export function readMission(text) {
  const mission = new Mission();
  for (const line of text.split("\n")) if (line.trim()) mission.append(JSON.parse(line));
  return mission;
}
