/* What a plan holds for a robot from a moment on: its actions, and for whom it waits before it is picked up or picks
   up. */

export const WAIT_MS = 1000; // shorter waits are not shown

/** @type {(action: Action) => number} */
function endOf({ start_ms, duration_ms }) {
  return start_ms + duration_ms;
}

/** When all of a plan is done.
    @type {(plan: Plan) => number} */
export function planEnd(plan) {
  return Math.max(plan.t_ms, ...plan.actions.map(endOf));
}

/** A robot's part in a plan, without drives to where it stands already.
    @type {(plan: Plan, name: string) => Action[]} */
function actionsOf(plan, name) {
  const own = plan.actions.filter((one) => one.robot === name || one.carrier === name);
  return own.filter((one) => one.name !== "move" || one.duration_ms > 1);
}

/** When a robot is there for an action: at the end of what it does before.
    @type {(plan: Plan, name: string, action: Action) => number} */
function readyFor(plan, name, action) {
  const before = actionsOf(plan, name).filter((one) => one.start_ms < action.start_ms);
  return Math.max(plan.t_ms, ...before.map(endOf));
}

/** The actions of a robot that are not over at t, in order.
    @type {(plan: Plan, robot: Robot, t: number) => Ahead[]} */
export function ahead(plan, robot, t) {
  return actionsOf(plan, robot.name)
    .filter((action) => endOf(action) > t)
    .sort((a, b) => a.start_ms - b.start_ms)
    .map((action) => ({ action, to: endOf(action), wait: waitFor(plan, robot.name, action) }));
}

/** The same without drives: these lead to other steps.
    @type {(plan: Plan, robot: Robot, t: number) => Action[]} */
export function workAhead(plan, robot, t) {
  return ahead(plan, robot, t)
    .map(({ action }) => action)
    .filter(({ name }) => name !== "move");
}

/** For whom a robot waits before an action: the one that comes later to their meeting point.
    @type {(plan: Plan, name: string, action: Action) => Ahead["wait"]} */
function waitFor(plan, name, action) {
  if (action.name !== "dock" || action.carrier === null) return null;
  const partner = action.robot === name ? action.carrier : action.robot;
  const from = readyFor(plan, name, action);
  const isFirst = from < readyFor(plan, partner, action);
  return isFirst && action.start_ms - from >= WAIT_MS ? { from, partner } : null;
}

/** Whose next step a plan changed, with that step now and before; null where there is none. A drive that leads to
    another step belongs to that one; a docking that has begun goes on in any plan.
    @type {(robots: Robot[], plan: Plan, earlier: Plan | undefined) =>
      { robot: Robot, now: Action | null, before: Action | null }[]} */
export function changed(robots, plan, earlier) {
  /** @type {(one: Plan | undefined, robot: Robot) => Action | null} */
  const next = (one, robot) => {
    const now = robot.actions.at(plan.t_ms);
    const planned = one ? ahead(one, robot, plan.t_ms).map(({ action }) => action) : [];
    const steps = planned.filter((step) => !step.carrier || !isSameStep(step, now));
    return steps.find(({ name }) => name !== "move") ?? steps[0] ?? null;
  };
  const steps = robots.map((robot) => ({ robot, now: next(plan, robot), before: next(earlier, robot) }));
  return steps.filter(({ now, before }) => !isSameStep(now, before));
}

/** @type {(one: Action | null, other: Action | null) => boolean} */
export function isSameStep(one, other) {
  return one?.name === other?.name && one?.place === other?.place && one?.robot === other?.robot;
}

/** Note which robots explore a target that another one reaches sooner: they go `along`.
    @type {(actions: Action[]) => Action[]} */
export function noteAlong(actions) {
  const explores = actions.filter((one) => one.name === "explore").sort((a, b) => endOf(a) - endOf(b));
  const taken = new Set();
  for (const action of explores) {
    action.along = taken.has(action.place);
    taken.add(action.place);
  }
  return actions;
}
