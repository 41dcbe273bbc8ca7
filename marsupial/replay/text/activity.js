/* What happens at a moment, in one sentence: who does what, and what that robot does next by the plan. */

import { act, expected, following, whyAlong } from "#text/why.js";

const NEWS = ["dock", "undock", "explore", "move"]; // what is told first
const SIDES = [
  ["south-west", "south", "south-east"],
  ["west", "middle", "east"],
  ["north-west", "north", "north-east"],
];

/** The sentence, and the robots and places that it names; of `chosen` (a robot or null), or of who does most. */
export function happening(mission, t, views, chosen) {
  const view = chosen ? views.find((one) => one.robot === chosen) : teller(mission, views);
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
    told = [];
  if (view.lost) told.push(`is lost: ${view.lost.reason}`);
  else if (view.away) told.push(`is out of contact, expected ${expected(mission, view.away)}`);
  else if (action) {
    const next = following(mission, robot, Math.max(t, action.start_ms), t);
    told.push(phrase(mission, action, robot, names, true));
    if (next) told.push(`then ${phrase(mission, next, robot, names, next.place !== action.place)}`);
  } else {
    const next = following(mission, robot, t);
    told.push(view.carrier ? `is aboard ${view.carrier.name}` : "waits");
    if (view.carrier) names.add(view.carrier.name);
    if (next) told.push(`then ${phrase(mission, next, robot, names, true)}`);
  }
  return { text: `${robot.name} ${told.join(", ")}`, names };
}

/** The robot whose doing is told: picking up and setting down come first, then what began last. */
function teller(mission, views) {
  const rank = ({ robot, action }) =>
    NEWS.indexOf(action.name) * 1e12 - (mission.segmentAt(robot, action.start_ms)?.start ?? action.start_ms);
  const busy = views.filter(({ robot, action, lost }) => action && !lost && (action.carrier === null || robot.carrier));
  return busy.reduce((best, one) => (best === null || rank(one) < rank(best) ? one : best), null);
}

function phrase(mission, action, robot, names, placed) {
  names.add(action.place).add(action.robot);
  if (action.carrier) names.add(action.carrier);
  const said = act(mission, action, robot);
  if (action.carrier) return placed ? `${said} at ${mission.places.label(action.place)}` : said;
  const target = mission.places.get(action.place),
    why = whyAlong(mission, action);
  const side = action.name === "explore" && target ? sideOf(mission, target.thing.cell) : "";
  return said + side + (why ? `: ${why}` : "");
}

/** Where on the map a cell is, in a word. */
function sideOf({ sightings: { box } }, [x, y]) {
  const third = (value, from, to) =>
    Math.max(0, Math.min(2, Math.floor((3 * (value - from)) / Math.max(1, to - from))));
  return ` in the ${SIDES[third(y, box.low, box.high)][third(x, box.left, box.right)]}`;
}
