/* The plans that a strategy compared for one decision, in words. */

import { clock, count } from "#text/format.js";

/** @type {(mission: Mission, maker: string) => string} */
function makerOf({ start }, maker) {
  if (maker === "previous") return "the plan before";
  return maker === start.planner ? `planner ${maker}` : maker;
}

/** Whose plans were compared, and what each costs more than the first one, which is followed.
    @type {(mission: Mission, plan: Plan) => [maker: string, price: string][]} */
export function prices(mission, { compared }) {
  const [first] = compared;
  return compared.map((one) => [makerOf(mission, one[0]), one === first ? clock(one[1]) : dearer(first, one)]);
}

/** @type {(first: Compared, other: Compared) => string} */
function dearer([, price, leftOut], [, otherPrice, otherLeftOut]) {
  if (otherLeftOut > leftOut) return `leaves out ${count(otherLeftOut - leftOut, "target")}`;
  return `${clock(otherPrice - price)} higher`;
}

/** Where the second of the plans compared would send a robot; null where that is not told, or it would be the same.
    @type {(mission: Mission, plan: Plan, name: string) => string | null} */
export function otherwise(mission, plan, name) {
  const found = plan.instead.find(([robot]) => robot === name);
  if (!found || plan.compared.length < 2) return null;
  const [maker, price] = prices(mission, plan)[1];
  const way = found[1].map((place) => mission.places.label(place)).join(", then ");
  return `the next best plan (${maker}, ${price}) would have it ${way ? `go to ${way}` : "do nothing"}`;
}
