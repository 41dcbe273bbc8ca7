/* What a point of the timeline stands for, in words. */

import { ahead } from "#log/ahead.js";
import { waitAt } from "#log/waits.js";
import { clock, lasting } from "#text/format.js";
import { newsLong } from "#text/news.js";
import { doing, ofPlanned, ofSegment, waiting } from "#text/why.js";

/** What the plan that is shown holds for the robot of a row at a time; null: nothing; undefined: none is shown there.
    @type {(lanes: Lanes, t: number, row: Row) => { plan: Plan, step: Ahead | null } | undefined} */
function plannedAt(lanes, t, { mission, robot }) {
  const plan = t > lanes.t ? lanes.planned(mission) : null;
  if (!plan) return undefined;
  /** @type {(step: Ahead) => boolean} */
  const isThen = ({ action, to, wait }) => (wait?.from ?? action.start_ms) <= t && t <= to;
  return { plan, step: ahead(plan, robot, lanes.t).find(isThen) ?? null };
}

/** What of a row is at a time: its robot, with the place of what it does then.
    @type {(lanes: Lanes, x: number, row: Row) => Thing} */
export function thingAt(lanes, x, row) {
  const { robot, mission } = row;
  const t = lanes.time(x);
  if (x < lanes.gutter) return { robot, place: null };
  const planned = plannedAt(lanes, t, row);
  if (planned) return { robot, place: planned.step?.action.place ?? null };
  const segment = robot.segments.find(({ start, to }) => start <= t && t <= (to ?? mission.to) && start !== to);
  return { robot, place: segment?.action.place ?? null };
}

/** The story of a point of the timeline, beside others with the mission's name; null for nothing.
    @type {(lanes: Lanes, x: number, y: number) => Story | null} */
export function laneStory(lanes, x, y) {
  const story = storyAt(lanes, x, y);
  const row = lanes.missions.length > 1 ? lanes.row(y) : null;
  return story && row ? { ...story, title: `${story.title} (${lanes.names[row.i]})` } : story;
}

/** @type {(lanes: Lanes, x: number, y: number) => Story | null} */
function storyAt(lanes, x, y) {
  const t = lanes.time(x);
  const row = lanes.row(y);
  if (x < lanes.gutter) return row ? { title: row.robot.name, lines: ["click to choose it"] } : null;
  if (y < lanes.top) {
    const lines = lanes.missions.map((mission, i) => `${lanes.names[i]}: ${lanes.areas.known(mission, t)} known`);
    return { title: clock(t), lines };
  }
  if (y >= lanes.bottom) return planStory(lanes, x);
  if (!row) return null;
  const { mission, robot } = row;
  const slack = (lanes.to - lanes.from) / lanes.width;
  const planned = plannedAt(lanes, t, row);
  if (planned) return planned.step && ofPlanned(mission, planned.plan, planned.step, robot);
  const segment = robot.segments.find((one) => one.start - slack <= t && t <= (one.to ?? mission.to) + slack);
  if (segment) return ofSegment(mission, segment, robot);
  const span = robot.aboard.find((one) => one.start <= t && t <= (one.to ?? mission.to));
  return { title: robot.name, lines: span ? [`aboard ${span.carrier}`] : waitLines(row, t) };
}

/** For whom a robot waited and how long, by the log, and what the plan of the time had for it.
    @type {(row: Row, t: number) => string[]} */
function waitLines({ mission, robot, waits }, t) {
  const wait = waitAt(waits, t);
  const planned = waiting(mission, robot, t);
  if (!wait) return planned;
  const { start, to, partner } = wait;
  const when = `${lasting(start, to)}, from ${clock(start)} to ${clock(to)}`;
  if (!partner) return [`waits ${when}`, ...planned];
  const other = mission.view(mission.robot(partner), t);
  return [`waits for ${partner}, ${when}`, `${partner} ${doing(mission, other, t)}`, ...planned.slice(1)];
}

/** @type {(lanes: Lanes, x: number) => Story | null} */
function planStory(lanes, x) {
  for (const [i, mission] of lanes.missions.entries()) {
    const near = mission.plans.findLast((plan) => Math.abs(lanes.x(plan.t_ms) - x) <= 4);
    const of = lanes.missions.length > 1 ? ` of ${lanes.names[i]}` : "";
    if (near) return { title: `Plan ${near.revision}${of} at ${clock(near.t_ms)}`, lines: [newsLong(mission, near)] };
  }
  return null;
}
