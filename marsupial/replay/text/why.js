/* What things are and why they happen, in words: for hovering, for the card of what was clicked, for lists. */

import { area, clock, count, listed, metres, point, seconds, share } from "#text/format.js";
import { isSameStep, workAhead } from "#log/ahead.js";
import { otherwise } from "#text/compared.js";
import { newsLong } from "#text/news.js";

const DOES = { move: "drives to", explore: "explores", dock: "boards", undock: "leaves" };
const ALONG = "goes along to";
const GUESS = "unknown ground behind it is guessed"; // why a robot goes where another one explores
const HANDLES = { move: "", explore: "", dock: "picks up", undock: "sets down" };
const ENDS = {
  done: "done",
  superseded: "given up for the next plan",
  blocked: "stopped: its route is no longer passable",
  failed: "failed: its robots could not do it",
  lost: "a robot was lost",
};

/** How a mission ended, in a word: to be called back is no failure.
    @type {(end: { status: string, reason?: string | null }) => string} */
export function ending({ status, reason }) {
  return status === "cancelled" && reason?.startsWith("called back") ? "called back" : status.replace("_", " ");
}

/** Strategy and planner of a mission.
    @type {(mission: Mission) => string} */
export function decider({ start }) {
  return start.planner && start.planner !== "none" ? `${start.strategy} with planner ${start.planner}` : start.strategy;
}

/** What a robot is doing at t, in few words.
    @type {(mission: Mission, view: RobotView, t: number) => string} */
export function doing(mission, view, t) {
  if (view.lost) return `lost: ${view.lost.reason}`;
  if (view.carrier) return `aboard ${view.carrier.name}`;
  if (view.action) return act(mission, view.action, view.robot);
  const next = following(mission, view.robot, t);
  return next?.carrier ? `waits for ${partner(next, view.robot)}` : "waits";
}

/** Whom a robot meets for an action.
    @type {(action: Action, robot: Robot) => string | null} */
function partner(action, robot) {
  return action.carrier === robot.name ? action.robot : action.carrier;
}

/** Where and when a rover out of contact will wait.
    @type {(mission: Mission, parting: Parting) => string} */
export function expected(mission, { cell, wait_ms }) {
  return `at ${mission.places.meetingAt(cell) ?? point(mission.metres(cell))} at ${clock(wait_ms)}`;
}

/** An action as its robot, or the carrier in it, does it.
    @type {(mission: Mission, action: Action, robot: Robot) => string} */
export function act(mission, action, robot) {
  const does = action.along ? ALONG : DOES[action.name];
  if (action.carrier === null) return `${does} ${mission.places.label(action.place)}`;
  if (action.robot === robot.name) return `${DOES[action.name]} ${action.carrier}`;
  return `${HANDLES[action.name]} ${action.robot}`;
}

/** The same, and where a docking is.
    @type {(mission: Mission, action: Action, robot: Robot) => string} */
export function actThere(mission, action, robot) {
  const where = action.carrier ? ` at ${mission.places.label(action.place)}` : "";
  return act(mission, action, robot) + where;
}

/** Why a robot goes where another one explores; null where it does not, or its strategy has another reason.
    @type {(mission: Mission, action: Action) => string | null} */
export function whyAlong({ start }, { along }) {
  return along && start.strategy.startsWith("temporal") ? GUESS : null;
}

/** What the plan in force at t has a robot do next, after what it is doing; driving left out: that leads to it.
    @type {(mission: Mission, robot: Robot, t: number, now?: Action | null) => Action | null} */
export function following(mission, robot, t, now = null) {
  const plan = mission.planAt(t);
  const since = Math.max(t, now?.start_ms ?? t);
  const steps = plan ? workAhead(plan, robot, since) : [];
  return steps.find((one) => one.start_ms > since && !isSameStep(one, now)) ?? null;
}

/** For what or whom a robot waits.
    @type {(mission: Mission, robot: Robot, t: number) => string[]} */
export function waiting(mission, robot, t) {
  const plan = mission.planAt(t);
  const next = following(mission, robot, t);
  if (!plan) return ["waits for the first plan"];
  if (!next) return [`waits: plan ${plan.revision} has nothing more for it to do`];
  const then = `${actThere(mission, next, robot)} at ${clock(next.start_ms)} by plan ${plan.revision}`;
  const name = partner(next, robot);
  if (name === null) return ["waits", then];
  const other = mission.view(mission.robot(name), t);
  return [`waits for ${name}, which ${other.carrier ? "is " : ""}${doing(mission, other, t)}`, then];
}

/** How many rovers a carrier has room for, in all and of each type that fits.
    @type {(kind: RobotKind) => string} */
function room({ capacity, seats = [] }) {
  if (!seats.length) return String(capacity);
  return `${capacity}: ${listed(seats.map(([type, most]) => `${most} ${type}`))}`;
}

/** The story of a robot at t; `cargo`: the names of those aboard.
    @type {(mission: Mission, view: RobotView, t: number, cargo: string[]) => Story} */
export function ofRobot(mission, view, t, cargo) {
  const { robot } = view;
  const segment = view.carrier ? null : robot.segmentAt(t);
  let lines = waiting(mission, robot, t);
  if (segment) ({ lines } = ofSegment(mission, segment, robot, t));
  else if (view.carrier || view.lost) lines = [doing(mission, view, t)];
  lines.splice(1, 0, ...afterwards(mission, robot, segment, t));
  if (view.away) {
    lines.push(`out of contact since ${clock(view.away.start)}, expected ${expected(mission, view.away)}`);
  }
  if (robot.carrier) {
    lines.push(
      `${cargo.length ? `carries ${listed(cargo)}` : "carries no rover"}; room for ${room(robot.kind)} in all`,
    );
  }
  lines.push(`${metres(view.driven)} driven`);
  if (view.charge !== null) lines.push(ofCharge(mission, view, view.charge, t));
  return { title: `${robot.name} (${robot.kind.name})`, lines };
}

/** What a robot does after its action by the plan, and what it would do first by the next best one.
    @type {(mission: Mission, robot: Robot, segment: Segment | null, t: number) => string[]} */
function afterwards(mission, robot, segment, t) {
  const plan = mission.planAt(t);
  const next = segment && following(mission, robot, t, segment.action);
  const then = next ? [`then ${actThere(mission, next, robot)} at ${clock(next.start_ms)}`] : [];
  const other = plan && otherwise(mission, plan, robot.name);
  return other ? [...then, other] : then;
}

/** The charge of a battery (a share) as the last plan has it, and where it charges.
    @type {(mission: Mission, view: RobotView, charge: number, t: number) => string} */
export function ofCharge(mission, view, charge, t) {
  const plan = mission.planAt(t);
  const where = mission.charging(view);
  return `battery ${share(charge)}${plan ? ` at ${clock(plan.t_ms)}` : ""}${where ? `; charges ${where}` : ""}`;
}

/** The parting in which a rover makes a drive of its own, which has no duration in the log; undefined for drives by a
    plan.
    @type {(robot: Robot, segment: Segment) => Parting | undefined} */
function partingOf(robot, { action, start }) {
  if (action.duration_ms) return undefined;
  return robot.partings.find((one) => one.start <= start && (one.to === null || start < one.to));
}

/** The story of one action: what, when, why, and how it came out if that is known at t.
    @type {(mission: Mission, segment: Segment, robot: Robot, t?: number) => Story} */
export function ofSegment(mission, segment, robot, t = Infinity) {
  const { action, start, to, end, revision } = segment;
  const isOver = to !== null && to <= t;
  const plan = mission.revisions.get(revision);
  const parting = partingOf(robot, segment);
  const guess = whyAlong(mission, action);
  const lines = [actThere(mission, action, robot)];
  if (guess) lines.push(guess);
  const planned = action.start_ms + action.duration_ms;
  const due = parting ? `expected at ${clock(parting.wait_ms)}` : `planned until ${clock(planned)}`;
  if (!isOver) lines.push(`since ${clock(start)}, ${due}`);
  else lines.push(`${clock(start)} to ${clock(to)} (${seconds(to - start)}); ${due}`);
  if (parting) lines.push("not by a plan: out of contact, it goes where a carrier can pick it up");
  else {
    if (plan) lines.push(`plan ${revision} at ${clock(plan.t_ms)}: ${newsLong(mission, plan)}`);
    lines.push(`decided by ${decider(mission)}`);
  }
  if (isOver && end !== null) lines.push(`outcome: ${ENDS[end] ?? end}`);
  return { title: robot.name, lines };
}

/** The story of an action of a plan that is still to come.
    @type {(mission: Mission, plan: Plan, ahead: Ahead, robot: Robot) => Story} */
export function ofPlanned(mission, plan, { action, to, wait }, robot) {
  const guess = whyAlong(mission, action);
  const lines = [actThere(mission, action, robot)];
  if (guess) lines.push(guess);
  if (wait) lines.push(`waits for ${wait.partner} from ${clock(wait.from)} on`);
  lines.push(`${clock(action.start_ms)} to ${clock(to)} by plan ${plan.revision}`);
  return { title: robot.name, lines };
}

/** The story of a plan.
    @type {(mission: Mission, plan: Plan) => Story} */
export function ofPlan(mission, plan) {
  const targets = `${count(plan.targets.length, "target")}, ${count(plan.meetings.length, "meeting point")}`;
  const lines = [`because ${newsLong(mission, plan)}`, `${count(plan.actions.length, "action")} for ${targets}`];
  return { title: `Plan ${plan.revision} at ${clock(plan.t_ms)}`, lines };
}

/** Which types of robots can drive on a terrain, where not all can: "only rovers".
    @type {(mission: Mission, code: number) => string} */
export function onlyFor({ start }, code) {
  const can = start.types.filter((type) => type.terrains.includes(code));
  if (can.length === start.types.length) return "";
  return can.length ? `only ${listed(kinds(can, start.types))}` : "nobody";
}

/** Types by name, or by role where all of the role are among them.
    @type {(types: RobotKind[], all: RobotKind[]) => string[]} */
function kinds(types, all) {
  const roles = [...new Set(types.map((type) => type.role))];
  const whole = roles.every((role) => all.every((type) => type.role !== role || types.includes(type)));
  return whole ? roles.map((role) => `${role}s`) : types.map((type) => type.name);
}

/** The story of a target: where, who can explore it and who not, who goes there and when, what became of it.
    @type {(mission: Mission, name: string, t: number, known: KnownMap) => Story | null} */
export function ofTarget(mission, name, t, known) {
  const place = mission.places.get(name);
  if (place?.kind !== "target") return null;
  const { thing } = place;
  const { types } = mission.start;
  const lines = [
    `at ${point(mission.metres(thing.cell))}; ${place.thing.name} in the log`,
    `${count(thing.frontier_cells, "frontier cell")}, may reveal ${area(thing.reveal_m2)}`,
  ];
  const can = types.filter((type) => thing.explorers.includes(type.name));
  const cannot = types.filter((type) => !can.includes(type));
  lines.push(can.length ? `${listed(kinds(can, types))} can explore it` : "nobody can reach it");
  for (const type of cannot) lines.push(whyNot(mission, type, known.at(...thing.cell)));
  lines.push(...sent(mission, name, t), ...fate(mission, name, place, t));
  return { title: `Target ${place.label}`, lines };
}

/** @type {(mission: Mission, type: RobotKind, code: number) => string} */
function whyNot(mission, type, code) {
  const terrain = mission.terrain(code);
  if (terrain && code > 0 && !type.terrains.includes(code)) {
    return `${type.name}s cannot: they do not drive on ${terrain.name}`;
  }
  return `${type.name}s cannot: no way for them leads there, or it is too narrow`;
}

/** Who goes there by the plan in force, and when they arrive.
    @type {(mission: Mission, name: string, t: number) => string[]} */
function sent(mission, name, t) {
  const plan = mission.planAt(t);
  if (!plan || !plan.targets.some((target) => target.name === name)) return [];
  const going = plan.actions.filter((action) => action.place === name && action.name === "explore");
  if (!going.length) return [`plan ${plan.revision} sends nobody there yet`];
  return going.map(({ robot, start_ms, duration_ms }) => {
    return `${robot} goes there by plan ${plan.revision}: there at ${clock(start_ms + duration_ms)}`;
  });
}

/** What became of a target by t.
    @type {(mission: Mission, name: string, place: Place, t: number) => string[]} */
function fate(mission, name, place, t) {
  const first = mission.plans.find((plan) => plan.t_ms >= place.since);
  const lines = first ? [`a target since plan ${first.revision}, ${clock(place.since)}`] : [];
  for (const robot of mission.robots) {
    for (const { action, end, to } of robot.segments) {
      const isDone = action.name === "explore" && action.place === name && end === "done";
      if (isDone && to !== null && to <= t) return [...lines, `explored by ${robot.name} at ${clock(to)}`];
    }
  }
  const last = mission.plans.findLastIndex((plan) => plan.targets.some((target) => target.name === name));
  const next = mission.plans[last + 1];
  return next && next.t_ms <= t
    ? [...lines, `no target any more from plan ${next.revision} on, ${clock(next.t_ms)}`]
    : lines;
}

/** The story of a meeting point.
    @type {(mission: Mission, name: string, t: number) => Story | null} */
export function ofMeeting(mission, name, t) {
  const place = mission.places.get(name);
  if (place?.kind !== "meeting") return null;
  const { thing } = place;
  const lines = [
    `${thing.carrier_type} at the square, ${point(mission.metres(thing.carrier_cell))}`,
    `${thing.rover_type} at the dot, ${point(mission.metres(thing.rover_cell))}`,
    `${place.thing.name} in the log`,
  ];
  for (const action of mission.planAt(t)?.actions ?? []) {
    if (action.place !== name || action.carrier === null) continue;
    lines.push(`${clock(action.start_ms)}: ${action.carrier} ${HANDLES[action.name]} ${action.robot}`);
  }
  return { title: `Meeting point ${place.label}`, lines };
}

/** The story of a frontier that is left at the end.
    @type {(mission: Mission, frontier: Remaining) => Story} */
export function ofRemaining(mission, frontier) {
  const where = `at ${point(mission.metres(frontier.cell))}`;
  return { title: "Left unexplored", lines: [frontier.reason, count(frontier.frontier_cells, "frontier cell"), where] };
}
