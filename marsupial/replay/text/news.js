/* What caused a plan, in words. */

import { SENTENCES } from "#text/causes.js";
import { listed } from "#text/format.js";

const NEAR = 12; // cells between a look and a target that it may have changed; further away, something else did

/** The causes of a plan (docs/mission-log.md), each with names of robots, targets or zones.
    @type {(plan: Plan) => { cause: string, names: string[] }[]} */
function news(plan) {
  return plan.trigger.split("; ").map((words) => {
    const [cause, names] = words.split(": ");
    return { cause, names: names ? names.split(", ") : [] };
  });
}

/** In few words, for lists: T5 gone, T12 new.
    @type {(mission: Mission, plan: Plan) => string} */
export function newsShort(mission, plan) {
  const texts = news(plan).map(({ cause, names }) => {
    const labels = names.map((name) => mission.places.label(name)).join(", ");
    if (cause === "gone" || cause === "new") return `${labels} ${cause}`;
    return labels ? `${cause}: ${labels}` : cause;
  });
  return texts.join(" · ");
}

/** In a sentence, with the robots that saw it.
    @type {(mission: Mission, plan: Plan) => string} */
export function newsLong(mission, plan) {
  return news(plan)
    .map(({ cause, names }) => because(mission, plan, cause, names))
    .join("; ");
}

/** @type {(mission: Mission, plan: Plan, cause: string, names: string[]) => string} */
function because(mission, plan, cause, names) {
  const labels = listed(names.map((name) => mission.places.label(name)));
  if (!isCause(cause)) return labels ? `${cause}: ${labels}` : cause;
  const [one, many = one] = [SENTENCES[cause]].flat();
  const by = seers(mission, plan, names);
  const seen = by.length ? `, seen by ${listed(by)}` : "";
  return (names.length > 1 ? many : one).replace("{names}", labels).replace("{seen}", seen);
}

/** @type {(text: string) => text is keyof typeof SENTENCES} */
function isCause(text) {
  return Object.hasOwn(SENTENCES, text);
}

/** Whose looks since the plan before came nearest to the targets named; the nearest within their sensor range.
    @type {(mission: Mission, plan: Plan, names: string[]) => string[]} */
function seers(mission, plan, names) {
  const i = mission.plans.indexOf(plan);
  const from = i > 0 ? mission.plans[i - 1].looks : 0;
  const found = names.flatMap((name) => {
    const place = mission.places.get(name);
    return place?.kind === "target" ? (nearestLook(mission, place.thing.cell, from, plan.looks) ?? []) : [];
  });
  return [...new Set(found)];
}

/** The robot of the look nearest to a cell.
    @type {(mission: Mission, cell: Cell, from: number, to: number) => string | null} */
function nearestLook({ sightings }, [cx, cy], from, to) {
  const runs = sightings.runs.array;
  let best = null;
  let least = NEAR;
  for (let look = to - 1; look >= from; look--) {
    for (let i = sightings.begin(look), end = sightings.ends[look]; i < end; i += 4) {
      const away = Math.abs(runs[i + 1] - cy) + Math.max(0, runs[i] - cx, cx - runs[i] - runs[i + 2] + 1);
      if (away < least) {
        least = away;
        best = sightings.robots[look];
      }
    }
  }
  return best;
}
