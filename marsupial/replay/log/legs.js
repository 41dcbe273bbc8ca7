/* Where one robot is: it drives, stands, or is aboard. The rules are those of the mission log (docs/mission-log.md). */

import { lastAt } from "#log/history.js";

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

/** A robot stands at a cell, facing `heading` (radians, counter-clockwise from east). */
export function standing([x, y], heading) {
  return { x, y, heading };
}

/** A robot is carried. */
export function riding(carrier) {
  return { aboard: carrier };
}

/** A robot drives from `cell` on along the digits of `steps`; times in ms, lengths in metres. */
export function driving(t, cell, steps, resolution, kind, heading) {
  const n = steps.length + 1;
  const leg = {
    times: new Float64Array(n),
    xs: new Int32Array(n),
    ys: new Int32Array(n),
    lengths: new Float64Array(n),
    heading,
  };
  let straight = 0,
    slanted = 0;
  leg.times[0] = t;
  [leg.xs[0], leg.ys[0]] = cell;
  for (let i = 1; i < n; i++) {
    const digit = steps.charCodeAt(i - 1) - 48;
    if (digit % 2) slanted++;
    else straight++;
    leg.lengths[i] = (straight + slanted * (kind.diagonal ?? Math.SQRT2)) * resolution;
    leg.times[i] = t + Math.round((1000 * leg.lengths[i]) / kind.speed_mps);
    leg.xs[i] = leg.xs[i - 1] + STEPS[digit][0];
    leg.ys[i] = leg.ys[i - 1] + STEPS[digit][1];
  }
  return leg;
}

/** Where a leg has come to at t: position, metres along it, the index of the last cell passed, and the heading. */
export function along(leg, t) {
  if (!leg.times) return { x: leg.x, y: leg.y, length: 0, i: 0, heading: leg.heading };
  const { times, xs, ys, lengths } = leg,
    last = times.length - 1,
    i = Math.min(Math.max(lastAt(times, t), 0), last);
  const from = Math.max(0, Math.min(i, last - 1)),
    to = Math.min(from + 1, last);
  const heading = to > from ? Math.atan2(ys[to] - ys[from], xs[to] - xs[from]) : leg.heading;
  if (i >= last) return { x: xs[last], y: ys[last], length: lengths[last], i: last, heading };
  const share = Math.max(0, (t - times[i]) / (times[i + 1] - times[i]));
  const between = (values) => values[i] + share * (values[i + 1] - values[i]);
  return { x: between(xs), y: between(ys), length: between(lengths), i, heading };
}

/** What an action's beginning makes of `{ at, carrier, left }`, as `marsupial.model.team.Whereabouts` says. */
export function begun(where, action, at) {
  return action.name === "dock"
    ? { at, carrier: action.carrier, left: null }
    : { at, carrier: null, left: where.carrier };
}

/** What its end makes of it. */
export function ended(where, action, end) {
  const docking = action.name === "dock" && where.at !== null && where.carrier !== null;
  if (docking && end === "done") return { at: null, carrier: where.carrier, left: null };
  if (docking && (end === "failed" || end === "lost")) return { at: where.at, carrier: null, left: null };
  if (action.name === "undock" && end === "failed" && where.left !== null) {
    return { at: null, carrier: where.left, left: null };
  }
  return where;
}
