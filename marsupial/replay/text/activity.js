/* What robots do at a moment, in one sentence: who does what, and what that robot does next by the plan. */

import { act, expected, following, whyAlong } from "#text/why.js";

const RANKS = ["dock", "undock", "explore", "move"]; // what is described first
const SIDES = [
  ["south-west", "south", "south-east"],
  ["west", "middle", "east"],
  ["north-west", "north", "north-east"],
];

/** The sentence, and the robots and places that it names; of `chosen` (a robot or null), or of who does most. */
export function activity(mission, t, views, chosen) {
  const view = chosen ? views.find((one) => one.robot === chosen) : mainView(mission, views);
  if (!view) {
    return {
      text: views.some((one) => one.action)
        ? ""
        : mission.plans.length
          ? "all robots wait"
          : "the first plan is being made",
      names: new Set(),
    };
  }
  const { robot, action } = view,
    names = new Set([robot.name]),
    parts = [];
  if (view.lost) parts.push(`is lost: ${view.lost.reason}`);
  else if (view.away) parts.push(`is out of contact, expected ${expected(mission, view.away)}`);
  else if (action) {
    const next = following(mission, robot, Math.max(t, action.start_ms), t);
    parts.push(phrase(mission, action, robot, names, true));
    if (next) parts.push(`then ${phrase(mission, next, robot, names, next.place !== action.place)}`);
  } else {
    const next = following(mission, robot, t);
    parts.push(view.carrier ? `is aboard ${view.carrier.name}` : "waits");
    if (view.carrier) names.add(view.carrier.name);
    if (next) parts.push(`then ${phrase(mission, next, robot, names, true)}`);
  }
  return { text: `${robot.name} ${parts.join(", ")}`, names };
}

/** The robot that is described: picking up and setting down come first, then what began last. */
function mainView(mission, views) {
  const rank = ({ robot, action }) =>
    RANKS.indexOf(action.name) * 1e12 - (mission.segmentAt(robot, action.start_ms)?.start ?? action.start_ms);
  const busy = views.filter(({ robot, action, lost }) => action && !lost && (action.carrier === null || robot.carrier));
  return busy.reduce((best, one) => (best === null || rank(one) < rank(best) ? one : best), null);
}

function phrase(mission, action, robot, names, placed) {
  names.add(action.place).add(action.robot);
  if (action.carrier) names.add(action.carrier);
  const words = act(mission, action, robot);
  if (action.carrier) return placed ? `${words} at ${mission.places.label(action.place)}` : words;
  const target = mission.places.get(action.place),
    why = whyAlong(mission, action);
  const side = action.name === "explore" && target ? sideOf(mission, target.thing.cell) : "";
  return words + side + (why ? `: ${why}` : "");
}

/** Where on the map a cell is, in a word. */
function sideOf({ sightings: { box } }, [x, y]) {
  const third = (value, from, to) =>
    Math.max(0, Math.min(2, Math.floor((3 * (value - from)) / Math.max(1, to - from))));
  return ` in the ${SIDES[third(y, box.low, box.high)][third(x, box.left, box.right)]}`;
}
