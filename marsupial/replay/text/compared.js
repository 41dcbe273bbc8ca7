/* The plans that a strategy compared for one decision, in words. */

import { clock, count } from "#text/format.js";

/** @type {(maker: string) => string} */
function makerOf(maker) {
  return maker === "previous" ? "the plan before" : maker;
}

/** Whose plans were compared, and what each costs more than the first one, which is followed.
    @type {(plan: Plan) => [maker: string, price: string][]} */
export function prices({ compared }) {
  const [first] = compared;
  return compared.map((one) => [makerOf(one[0]), one === first ? clock(one[1]) : dearer(first, one)]);
}

/** @type {(first: Compared, other: Compared) => string} */
function dearer([, price, leftOut], [, otherPrice, otherLeftOut]) {
  if (otherLeftOut > leftOut) return `leaves out ${count(otherLeftOut - leftOut, "target")}`;
  return `${clock(otherPrice - price)} more`;
}

/** Where the second of the plans compared would send a robot; null where that is not told, or it would be the same.
    @type {(mission: Mission, plan: Plan, name: string) => string | null} */
export function otherwise({ places }, plan, name) {
  const found = plan.instead.find(([robot]) => robot === name);
  if (!found || plan.compared.length < 2) return null;
  const [maker, price] = prices(plan)[1];
  const way = found[1].map((place) => places.label(place)).join(", then ");
  return `by the next best plan (${maker}, ${price}): ${way ? `to ${way}` : "nothing"}`;
}
