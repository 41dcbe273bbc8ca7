/* A mission, built up from its log line by line: who is where, doing what, and what is known, at any moment.

   A mission grows: `append` takes one line of the log (docs/mission-log.md) at any time, at a cost that does not depend
   on what came before, and any moment may be queried between two lines. Touches no page.

   Cells are those of the first frame of the mission. Where the frame grows, later lines have cells of another one;
   `append` takes them back, so that nothing that is known already has to change. */

import { noteAlong } from "#log/ahead.js";
import { metresOf, placeOf } from "#log/frame.js";
import { History, lastAt } from "#log/history.js";
import { KnownMap, Sightings } from "#log/knownmap.js";
import { along, begun, ended, standing } from "#log/legs.js";
import { Places } from "#log/places.js";
import { Robot } from "#log/robot.js";

/** A name of a target or meeting point in a text. */
const NAME = /\b[tm](_-?\d+)+\w*/g;

export class Mission {
  /** @param {MissionLine} start the first line of the log */
  constructor(start) {
    this.start = start;
    /** @type {EndedLine | null} */
    this.ended = null;
    /** @type {Cell} */
    this.shift = [0, 0];
    /** @type {Plan[]} */
    this.plans = [];
    /** @type {number[]} */
    this.planTimes = [];
    /** @type {Map<number, Plan>} */
    this.revisions = new Map();
    this.places = new Places();
    /** @type {Map<string, Target>} */
    this.lastTargets = new Map(); // those of the last plan, by name
    /** @type {Map<string, Meeting>} */
    this.lastMeetings = new Map();
    /** @type {Map<string, Cell>} */
    this.cells = new Map(); // of a robot at a place, as "robot place", from the actions that were started
    this.from = start.t_ms;
    this.to = start.t_ms + 1;
    this.width = start.width;
    this.resolution = start.resolution_m;
    this.chargers = start.chargers ?? []; // charging places
    this.sightings = new Sightings(start.t_ms);
    /** @type {History<{ down: number, up: number }>} */
    this.docked = new History();
    this.docked.add(start.t_ms, { down: 0, up: 0 });
    /** @type {History<Map<string, Zone>>} */
    this.zones = new History(); // that hold, by name
    this.zones.add(start.t_ms, new Map());
    this.robots = start.robots.map((placed) => new Robot(placed, this.kindOf(placed.type), start.t_ms));
    this.byName = new Map(this.robots.map((robot) => [robot.name, robot]));
  }

  /** Take in the next line of the log, as parsed.
      @type {(line: LogLine) => void} */
  append(line) {
    this.apply(line);
    this.to = Math.max(this.to, line.t_ms, this.from + 1);
  }

  /** @type {(line: LogLine) => void} */
  apply(line) {
    const t = line.t_ms;
    switch (line.event) {
      case "reveal":
      case "change":
        return this.sightings.add(line, this.width, this.shift);
      case "frame":
        this.shift = [this.shift[0] + line.shift[0], this.shift[1] + line.shift[1]];
        this.width = line.width;
        return undefined;
      case "drive":
        return this.robot(line.robot).drive(t, this.cell(line.cell), line.steps, this.resolution);
      case "stand":
        return this.robot(line.robot).stand(t, this.cell(line.cell));
      case "plan":
        return this.follow(line);
      case "start":
        return this.startAction(line);
      case "end":
        return this.endAction(line);
      case "lost":
        return this.lose(this.robot(line.robot), line);
      case "returned":
        for (const last of this.robot(line.robot).losses.slice(-1)) last.to = t;
        return undefined;
      case "away": {
        const parting = { start: t, to: null, cell: this.cell(line.cell), wait_ms: line.wait_ms };
        this.robot(line.robot).partings.push(parting);
        return undefined;
      }
      case "contact":
        for (const last of this.robot(line.robot).partings.slice(-1)) last.to = t;
        return undefined;
      case "speed":
        this.robot(line.robot).speed = line.share;
        return undefined;
      case "zone":
        return this.setZone(line);
      case "ended":
        this.ended = this.readable(line);
        return undefined;
      default:
        return undefined; // later versions may have more events
    }
  }

  /** The robot of a name that the log has.
      @type {(name: string) => Robot} */
  robot(name) {
    const robot = this.byName.get(name);
    if (!robot) throw new Error(`the log has no robot ${name}`);
    return robot;
  }

  /** @type {(name: string) => RobotKind} */
  kindOf(name) {
    const kind = this.start.types.find((type) => type.name === name);
    if (!kind) throw new Error(`the log has no type ${name}`);
    return kind;
  }

  /** @type {(line: PlanLine) => void} */
  follow(line) {
    const plan = {
      t_ms: line.t_ms,
      revision: line.revision,
      trigger: line.trigger,
      targets: this.targetsOf(line),
      meetings: this.meetingsOf(line),
      actions: noteAlong(line.actions.map((action) => ({ ...action }))),
      looks: this.sightings.times.length,
      guess: line.guess ? { ...line.guess, corner: this.cell(line.guess.corner) } : null,
      compared: line.compared ?? [],
      instead: line.instead ?? [],
    };
    for (const [name, share] of line.charges ?? []) this.robot(name).charges.add(line.t_ms, share);
    this.plans.push(plan);
    this.planTimes.push(plan.t_ms);
    this.revisions.set(plan.revision, plan);
  }

  /** The targets of a plan: those that stood in the one before just the same are only named.
      @type {(line: PlanLine) => Target[]} */
  targetsOf(line) {
    const targets = line.targets.flatMap((one) => {
      if (typeof one === "string") return this.lastTargets.get(one) ?? [];
      const moved = { ...one, cell: this.cell(one.cell) };
      this.places.enterTarget(moved, line.t_ms);
      return moved;
    });
    this.lastTargets = new Map(targets.map((target) => [target.name, target]));
    return targets;
  }

  /** The same of its meeting points.
      @type {(line: PlanLine) => Meeting[]} */
  meetingsOf(line) {
    const meetings = line.meetings.flatMap((one) => {
      if (typeof one === "string") return this.lastMeetings.get(one) ?? [];
      const cells = { carrier_cell: this.cell(one.carrier_cell), rover_cell: this.cell(one.rover_cell) };
      const moved = { ...one, ...cells };
      this.places.enterMeeting(moved, line.t_ms);
      return moved;
    });
    this.lastMeetings = new Map(meetings.map((meeting) => [meeting.name, meeting]));
    return meetings;
  }

  /** @type {(line: StartLine) => void} */
  startAction(line) {
    const { t_ms } = line;
    const action = { ...line.action };
    const cell = this.cell(line.cell);
    /** @type {(one: Action) => boolean} */
    const isSame = (one) => one.name === action.name && one.robot === action.robot && one.place === action.place;
    action.along = this.plans.at(-1)?.actions.find(isSame)?.along ?? false;
    this.cells.set(`${action.robot} ${action.place}`, cell);
    for (const robot of this.partners(action)) robot.start(t_ms, action, line.revision);
    if (action.carrier === null) return;
    const rover = this.robot(action.robot);
    rover.put(t_ms, begun(rover.where, action, standing(cell, this.view(rover, t_ms).heading)));
  }

  /** @type {(line: EndLine) => void} */
  endAction({ t_ms, action, end }) {
    for (const robot of this.partners(action)) {
      robot.finish(t_ms, end);
      robot.actions.add(t_ms, null);
    }
    if (action.carrier === null) return;
    const rover = this.robot(action.robot);
    rover.put(t_ms, ended(rover.where, action, end));
    if (end !== "done") return;
    const { down, up } = this.docked.last;
    this.docked.add(t_ms, action.name === "undock" ? { down: down + 1, up } : { down, up: up + 1 });
  }

  /** @type {(robot: Robot, line: LostLine) => void} */
  lose({ losses }, { t_ms, reason }) {
    if (losses.at(-1)?.to !== null) losses.push({ start: t_ms, to: null, reason });
  }

  /** @type {(line: ZoneLine) => void} */
  setZone({ t_ms, name, zone }) {
    const zones = new Map(this.zones.last);
    zones.delete(name);
    if (zone) zones.set(name, { ...zone, corners: zone.polygon_m.map((point) => placeOf(this.start, point)) });
    this.zones.add(t_ms, zones);
  }

  /** The stop report with short names of places, and cells of the first frame.
      @type {(line: EndedLine) => EndedLine} */
  readable(line) {
    /** @type {(text: string) => string} */
    const short = (text) => text.replace(NAME, (name) => this.places.get(name)?.label ?? name);
    const remaining = line.remaining.map((one) => ({ ...one, cell: this.cell(one.cell), reason: short(one.reason) }));
    return { ...line, reason: short(line.reason), remaining };
  }

  /** A cell of the frame as it is now, in the first one.
      @type {(cell: Cell) => Cell} */
  cell([x, y]) {
    return [x - this.shift[0], y - this.shift[1]];
  }

  /** @type {(action: Action) => Robot[]} */
  partners({ robot, carrier }) {
    return carrier === null ? [this.robot(robot)] : [this.robot(robot), this.robot(carrier)];
  }

  /** @type {(robot: Robot, t: number) => RobotView} */
  view(robot, t) {
    const i = Math.max(robot.legs.index(t), 0);
    const leg = robot.legs.values[i];
    const carrier = leg.aboard ? this.robot(leg.aboard) : null;
    const point = along(carrier ? carrier.legs.values[Math.max(carrier.legs.index(t), 0)] : leg, t);
    const { x, y, heading } = point;
    return {
      ...{ robot, carrier, x, y, heading, leg },
      action: robot.actions.at(t),
      driven: robot.driven[i] + (leg.times ? point.length : 0),
      lost: spanAt(robot.losses, t),
      away: spanAt(robot.partings, t),
      charge: robot.charges.at(t),
    };
  }

  /** @type {(t: number) => RobotView[]} */
  views(t) {
    return this.robots.map((robot) => this.view(robot, t));
  }

  /** Where the battery of a robot charges: "aboard c1", "at a charging place"; null if it does not.
      @type {(view: RobotView) => string | null} */
  charging({ robot, carrier, leg, lost }) {
    if (!robot.kind.battery || lost) return null;
    if (carrier) return `aboard ${carrier.name}`;
    const stands = !leg.times && this.chargers.some(([x, y]) => x === leg.x && y === leg.y);
    return stands ? "at a charging place" : null;
  }

  /** @type {(t: number) => number} */
  planIndex(t) {
    return lastAt(this.planTimes, t);
  }

  /** @type {(t: number) => Plan | null} */
  planAt(t) {
    return this.plans[this.planIndex(t)] ?? null;
  }

  /** The cell where a robot has to be at a place of a plan, or null where the log does not have it.
      @type {(plan: Plan, place: string, robot: Robot) => Cell | null} */
  placeCell(plan, place, robot) {
    const target = plan.targets.find((one) => one.name === place);
    if (target) return target.cell;
    const meeting = plan.meetings.find((one) => one.name === place);
    if (meeting) return robot.carrier ? meeting.carrier_cell : meeting.rover_cell;
    return this.cells.get(`${robot.name} ${place}`) || null;
  }

  /** Area known at t that is no obstacle, in square metres.
      @type {(t: number) => number} */
  openArea(t) {
    return this.sightings.openAt(t) * this.resolution * this.resolution;
  }

  /** @type {(cell: Cell) => Point} */
  metres(cell) {
    return metresOf(this.start, cell);
  }

  /** @type {(code: number) => Terrain | null} */
  terrain(code) {
    return this.start.terrains.find((one) => one.code === code) || null;
  }

  /** The map as known at a moment, to be moved through time. */
  knownMap() {
    return new KnownMap(this.sightings);
  }
}

/** The span that holds t.
    @template {Span} T
    @param {T[]} spans
    @param {number} t */
function spanAt(spans, t) {
  return spans.find(({ start, to }) => start <= t && (to === null || t < to)) ?? null;
}

/** A mission from the text of its log.
    @type {(text: string) => Mission} */
export function readMission(text) {
  const [first, ...lines] = text.split("\n").filter((line) => line.trim());
  const mission = new Mission(JSON.parse(first));
  for (const line of lines) mission.append(JSON.parse(line));
  return mission;
}
