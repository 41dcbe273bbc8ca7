/* When a robot stood without work: from the end of what it did until it does something again, or until the one comes
   that it meets. */

import { WAIT_MS, workAhead } from "#log/ahead.js";

/** The waits of a robot by now; `partner`: whom it met then, or was to meet by the plan; null for nobody.
    @type {(mission: Mission, robot: Robot) => Wait[]} */
export function waits(mission, robot) {
  const now = mission.to;
  /** @type {(Span & { action?: Action })[]} */
  const spans = [...robot.segments, ...robot.aboard, ...robot.losses, { start: now, to: null }];
  const busy = spans.filter(({ start, to }) => start !== to).sort((a, b) => a.start - b.start);
  /** @type {Wait[]} */
  const found = [];
  let free = mission.from;
  for (const { start, to, action } of busy) {
    if (start - free >= WAIT_MS) {
      const partner = met(robot, action) ?? met(robot, planned(mission, robot, start - 1));
      found.push({ start: free, to: start, partner });
    }
    free = Math.max(free, to ?? now);
  }
  return found;
}

/** The wait that holds t, or undefined.
    @type {(found: Wait[], t: number) => Wait | undefined} */
export function waitAt(found, t) {
  return found.find(({ start, to }) => start <= t && t < to);
}

/** Whom a robot meets to be picked up or to pick up.
    @type {(robot: Robot, action: Action | undefined) => string | null} */
function met({ name }, action) {
  if (action?.name !== "dock") return null;
  return action.robot === name ? action.carrier : action.robot;
}

/** What the plan in force at t has a robot do next, wherever it drives for that.
    @type {(mission: Mission, robot: Robot, t: number) => Action | undefined} */
function planned(mission, robot, t) {
  const plan = mission.planAt(t);
  return plan ? workAhead(plan, robot, t)[0] : undefined;
}
