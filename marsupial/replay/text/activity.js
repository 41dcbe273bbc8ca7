/* What robots do at a moment, in one sentence: who does what, and what that robot does next by the plan. */

import { act, doing, expected, following, whyAlong } from "#text/why.js";

const RANKS = ["dock", "undock", "explore", "move"]; // what is described first
const SIDES = [
  ["south-west", "south", "south-east"],
  ["west", "middle", "east"],
  ["north-west", "north", "north-east"],
];

/** The sentence, and the robots and places that it names; of `chosen`, or of the robot that does most.
    @type {(mission: Mission, t: number, views: RobotView[], chosen: Robot | null) =>
      { text: string, names: Set<string> }} */
export function activity(mission, t, views, chosen) {
  const view = chosen ? views.find((one) => one.robot === chosen) : mainView(views);
  if (!view) return { text: idle(mission, views), names: new Set() };
  const { robot, action } = view;
  const names = new Set([robot.name]);
  const parts = [];
  if (view.lost) parts.push(`is lost: ${view.lost.reason}`);
  else if (view.away) parts.push(`is out of contact, expected ${expected(mission, view.away)}`);
  else if (action) {
    const next = following(mission, robot, t, action);
    parts.push(phrase(mission, action, robot, names, true));
    if (next) parts.push(`then ${phrase(mission, next, robot, names, next.place !== action.place)}`);
  } else {
    const next = following(mission, robot, t);
    parts.push(`${view.carrier ? "is " : ""}${doing(mission, view, t)}`);
    if (view.carrier) names.add(view.carrier.name);
    if (next) parts.push(`then ${phrase(mission, next, robot, names, true)}`);
  }
  return { text: `${robot.name} ${parts.join(", ")}`, names };
}

/** @type {(mission: Mission, views: RobotView[]) => string} */
function idle(mission, views) {
  if (views.some((one) => one.action)) return "";
  return mission.plans.length ? "all robots wait" : "the first plan is being made";
}

/** The robot that is described: picking up and setting down come first, then what began last.
    @type {(views: RobotView[]) => RobotView | null} */
function mainView(views) {
  /** @type {RobotView | null} */
  let best = null;
  let least = Infinity;
  for (const view of views) {
    const { robot, action } = view;
    if (!action || view.lost || (action.carrier !== null && !robot.carrier)) continue;
    const rank = RANKS.indexOf(action.name) * 1e12 - (robot.segmentAt(action.start_ms)?.start ?? action.start_ms);
    if (rank >= least) continue;
    least = rank;
    best = view;
  }
  return best;
}

/** What a robot does, at its place where `placed`; what it names is added to `names`.
    @type {(mission: Mission, action: Action, robot: Robot, names: Set<string>, placed: boolean) => string} */
function phrase(mission, action, robot, names, placed) {
  names.add(action.place).add(action.robot);
  const words = act(mission, action, robot);
  if (action.carrier) {
    names.add(action.carrier);
    return placed ? `${words} at ${mission.places.label(action.place)}` : words;
  }
  const place = mission.places.get(action.place);
  const why = whyAlong(mission, action);
  const side = action.name === "explore" && place?.kind === "target" ? sideOf(mission, place.thing.cell) : "";
  return words + side + (why ? `: ${why}` : "");
}

/** Where on the map a cell is, in a word.
    @type {(mission: Mission, cell: Cell) => string} */
function sideOf({ sightings: { box } }, [x, y]) {
  if (!box) return "";
  /** @type {(value: number, from: number, to: number) => number} */
  const third = (value, from, to) =>
    Math.max(0, Math.min(2, Math.floor((3 * (value - from)) / Math.max(1, to - from))));
  return ` in the ${SIDES[third(y, box.low, box.high)][third(x, box.left, box.right)]}`;
}
