/* Where one robot is: it drives, stands, or is aboard. The rules are those of the mission log (docs/mission-log.md). */

import { lastAt } from "#log/history.js";

const EAST = 0;
const STEPS = [
  [1, 0],
  [1, 1],
  [0, 1],
  [-1, 1],
  [-1, 0],
  [-1, -1],
  [0, -1],
  [1, -1],
];

/** A robot stands at a cell, facing `heading` (radians, counter-clockwise from east).
    @type {(cell: Cell, heading?: number) => Standing} */
export function standing([x, y], heading = EAST) {
  return { x, y, heading };
}

/** A robot is carried: where it is, its carrier says.
    @type {(carrier: string) => Riding} */
export function riding(carrier) {
  return { x: 0, y: 0, heading: EAST, aboard: carrier };
}

/** A robot drives from `cell` on along the digits of `steps`; times in ms, lengths in metres.
    @type {(t: number, cell: Cell, steps: string, resolution: number, kind: RobotKind, heading: number) => Driving} */
export function driving(t, cell, steps, resolution, kind, heading) {
  const n = steps.length + 1;
  const [times, lengths] = [new Float64Array(n), new Float64Array(n)];
  const [xs, ys] = [new Int32Array(n), new Int32Array(n)];
  let straight = 0;
  let slanted = 0;
  times[0] = t;
  [xs[0], ys[0]] = cell;
  for (let i = 1; i < n; i++) {
    const digit = steps.charCodeAt(i - 1) - 48;
    if (digit % 2) slanted++;
    else straight++;
    lengths[i] = (straight + slanted * (kind.diagonal ?? Math.SQRT2)) * resolution;
    times[i] = t + Math.round((1000 * lengths[i]) / kind.speed_mps);
    xs[i] = xs[i - 1] + STEPS[digit][0];
    ys[i] = ys[i - 1] + STEPS[digit][1];
  }
  return { times, xs, ys, lengths, heading };
}

/** Where a leg has come to at t: position, metres along it, the index of the last cell passed, and the heading.
    @type {(leg: Leg, t: number) => { x: number, y: number, length: number, i: number, heading: number }} */
export function along(leg, t) {
  if (!leg.times) return { x: leg.x, y: leg.y, length: 0, i: 0, heading: leg.heading };
  const { times, xs, ys, lengths } = leg;
  const last = times.length - 1;
  const i = Math.min(Math.max(lastAt(times, t), 0), last);
  const from = Math.max(0, Math.min(i, last - 1));
  const to = Math.min(from + 1, last);
  const heading = to > from ? Math.atan2(ys[to] - ys[from], xs[to] - xs[from]) : leg.heading;
  if (i >= last) return { x: xs[last], y: ys[last], length: lengths[last], i: last, heading };
  const share = Math.max(0, (t - times[i]) / (times[i + 1] - times[i]));
  /** @type {(values: ArrayLike<number>) => number} */
  const between = (values) => values[i] + share * (values[i + 1] - values[i]);
  return { x: between(xs), y: between(ys), length: between(lengths), i, heading };
}

/** Whereabouts after an action has begun, as `marsupial.model.team.Whereabouts` has them.
    @type {(where: Whereabouts, action: Action, at: Standing) => Whereabouts} */
export function begun(where, action, at) {
  if (action.name === "dock") return { at, carrier: action.carrier, left: null };
  return { at, carrier: null, left: where.carrier };
}

/** Whereabouts after it has ended.
    @type {(where: Whereabouts, action: Action, end: ActionEnd) => Whereabouts} */
export function ended(where, action, end) {
  const docking = action.name === "dock" && where.at !== null && where.carrier !== null;
  if (docking && end === "done") return { at: null, carrier: where.carrier, left: null };
  if (docking && (end === "failed" || end === "lost")) return { at: where.at, carrier: null, left: null };
  const stays = action.name === "undock" && end === "failed" && where.left !== null;
  return stays ? { at: null, carrier: where.left, left: null } : where;
}
