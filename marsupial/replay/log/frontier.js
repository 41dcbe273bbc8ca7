/* Which target a frontier belongs to: for clicks on the edge of what is known. */

const NEAR = 3; // cells between the click and the frontier
const MOST = 4000; // cells looked at along the frontier

/** The target whose frontier is at a cell, by following the frontier from there: its name, null where the plan has
    none there, undefined where there is no frontier.
    @type {(known: KnownMap, plan: Plan | null, cell: Cell) => string | null | undefined} */
export function targetAt(known, plan, [x, y]) {
  const start = nearest(known, x, y);
  if (!start) return undefined;
  const targets = new Map((plan ? plan.targets : []).map((target) => [target.cell.join(), target.name]));
  const seen = new Set([start.join()]);
  const queue = [start];
  for (let i = 0; i < queue.length && i < MOST; i++) {
    const [cx, cy] = queue[i];
    const name = targets.get(queue[i].join());
    if (name) return name;
    for (let dy = -1; dy <= 1; dy++) {
      for (let dx = -1; dx <= 1; dx++) {
        /** @type {Cell} */
        const next = [cx + dx, cy + dy];
        if (seen.has(next.join()) || !known.isFrontier(...next)) continue;
        seen.add(next.join());
        queue.push(next);
      }
    }
  }
  return null;
}

/** @type {(known: KnownMap, x: number, y: number) => Cell | null} */
function nearest(known, x, y) {
  /** @type {Cell | null} */
  let best = null;
  let least = Infinity;
  for (let dy = -NEAR; dy <= NEAR; dy++) {
    for (let dx = -NEAR; dx <= NEAR; dx++) {
      const away = dx * dx + dy * dy;
      if (away < least && known.isFrontier(x + dx, y + dy)) {
        least = away;
        best = [x + dx, y + dy];
      }
    }
  }
  return best;
}
