/* Where robots came from and where the plan will take them, as lists of places in cells. */

import { along } from "#log/legs.js";

const TRAIL_MS = 120000;

/** The ways of a robot on its own wheels in the last two minutes.
    @type {(robot: Robot, t: number) => Cell[][]} */
export function trail({ legs }, t) {
  const since = t - TRAIL_MS;
  /** @type {Cell[][]} */
  const ways = [[]];
  for (let i = Math.max(legs.index(since), 0); i < legs.times.length && legs.times[i] <= t; i++) {
    const leg = legs.values[i];
    const until = Math.min(t, i + 1 < legs.times.length ? legs.times[i + 1] : t);
    const way = ways[ways.length - 1];
    if (leg.aboard) {
      if (way.length) ways.push([]);
    } else if (leg.times) {
      const begin = along(leg, Math.max(since, legs.times[i]));
      const end = along(leg, until);
      way.push([begin.x, begin.y]);
      for (let k = begin.i + 1; k <= end.i; k++) if (bends(leg, k)) way.push([leg.xs[k], leg.ys[k]]);
      way.push([end.x, end.y]);
    } else way.push([leg.x, leg.y]);
  }
  return ways.filter((way) => way.length > 1);
}

/** Whether a way turns at its k-th cell: between turns it is straight, and no more points are needed.
    @type {(leg: Driving, k: number) => boolean} */
function bends({ xs, ys }, k) {
  return k + 1 >= xs.length || xs[k] - xs[k - 1] !== xs[k + 1] - xs[k] || ys[k] - ys[k - 1] !== ys[k + 1] - ys[k];
}

/** Where the drive of a robot ends, or where it stands; nothing of one that is aboard.
    @type {(view: RobotView) => Cell[]} */
function startOf({ leg, carrier }) {
  if (carrier) return [];
  return [leg.times ? [leg.xs[leg.xs.length - 1], leg.ys[leg.ys.length - 1]] : [leg.x, leg.y]];
}

/** Where a robot would go by another plan, which has these places for it, and from where: it was there when the plan
    was made; null if it was aboard.
    @type {(mission: Mission, plan: Plan, robot: Robot, places: string[]) => { from: Cell | null, cells: Cell[] }} */
export function insteadWay(mission, plan, robot, places) {
  const { carrier, x, y } = mission.view(robot, plan.t_ms);
  const cells = places.map((place) => mission.placeCell(plan, place, robot)).filter((cell) => cell !== null);
  return { from: carrier ? null : [x, y], cells };
}

/** Where a robot will go by the plan after what it does now: a way for each stretch that it is not aboard.
    @type {(mission: Mission, plan: Plan, view: RobotView, t: number) => Cell[][]} */
export function plannedWays(mission, plan, view, t) {
  const { robot } = view;
  const ways = [startOf(view)];
  for (const action of plan.actions) {
    if (action.start_ms <= t || (action.robot !== robot.name && action.carrier !== robot.name)) continue;
    if (action.name === "undock" && !robot.carrier) ways.push([]);
    const cell = mission.placeCell(plan, action.place, robot);
    if (cell) ways[ways.length - 1].push(cell);
  }
  return ways.filter((way) => way.length > 1);
}
