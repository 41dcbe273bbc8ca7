/* Missions side by side: what to call them, and what sets them apart in a sentence. */

import { area, clock, count, listed, lasting } from "#text/format.js";
import { decider } from "#text/why.js";

const MOST = 90; // per cent of the reachable area

/** A name for each mission, by what they differ in.
    @type {(missions: Mission[]) => string[]} */
export function sideNames(missions) {
  /** @type {((mission: Mission) => string)[]} */
  const ways = [
    ({ start }) => start.strategy,
    decider,
    ({ start }) => `${start.strategy}, seed ${start.seed}`,
    (mission) => `${decider(mission)}, ${mission.start.scenario}`,
  ];
  const way = ways.find((one) => new Set(missions.map(one)).size === missions.length);
  return missions.map((mission, i) => (way ? way(mission) : `${mission.start.strategy} (${"ABCDEF"[i]})`));
}

/** What came out; before all have ended, which one was first. Of two that explored everything: how much sooner the
    first one knew most of the map, all of it, and ended.
    @type {(missions: Mission[], names: string[]) => string} */
export function outcome(missions, names) {
  const ends = missions.flatMap((mission) => mission.ended ?? []);
  if (!ends.length) return "";
  if (ends.length < missions.length) return firstEnd(missions, names);
  const times = ends.map((end) => end.exploration_ms);
  if (missions.length > 2) return ranking(ends, times, names);
  const [time, other] = times;
  if (time === null && other === null) {
    const areas = missions.map((mission) => mission.openArea(mission.to));
    const more = areas[1] > areas[0] ? 1 : 0;
    const known = `${names[more]} came to know ${area(areas[more])}, ${names[1 - more]} ${area(areas[1 - more])}`;
    return `Neither explored everything; ${known}.`;
  }
  if (time === null || other === null) {
    const done = time === null ? 1 : 0;
    const left = count(ends[1 - done].remaining.length, "frontier");
    return `${names[done]} finished exploring at ${clock(time ?? other ?? 0)}; ${names[1 - done]} left ${left}.`;
  }
  const most = ends.map((end) => new Map(end.known_ms ?? []).get(MOST) ?? null);
  const stages = [
    ...(most[0] !== null && most[1] !== null ? [`knew ${MOST} % ${sooner(most[0], most[1])}`] : []),
    `explored all ${sooner(time, other)}`,
    `ended ${sooner(ends[0].t_ms, ends[1].t_ms)}`,
  ];
  return `${names[0]} ${listed(stages)} than ${names[1]}.`;
}

/** By how much one moment comes before or after another, as the two are written, and when it is.
    @type {(time: number, other: number) => string} */
function sooner(time, other) {
  const by = lasting(Math.min(time, other), Math.max(time, other));
  const how = by === clock(0) ? "no sooner" : `${by} ${time < other ? "sooner" : "later"}`;
  return `${how} (${clock(time)})`;
}

/** @type {(missions: Mission[], names: string[]) => string} */
function firstEnd(missions, names) {
  const over = missions.filter((mission) => mission.ended);
  const first = over.reduce((best, one) => (one.to < best.to ? one : best));
  const others = names.filter((_name, i) => !missions[i].ended);
  const rest = `${listed(others)} ${others.length > 1 ? "go" : "goes"} on`;
  return `${names[missions.indexOf(first)]} ended first, at ${clock(first.to)}; ${rest}.`;
}

/** Of more than two: which one finished first, and how much later the others did.
    @type {(ends: EndedLine[], times: (number | null)[], names: string[]) => string} */
function ranking(ends, times, names) {
  const order = names.map((_name, i) => i).sort((a, b) => (times[a] ?? Infinity) - (times[b] ?? Infinity));
  const [best, ...others] = order;
  const first = times[best];
  if (first === null) return "None explored everything.";
  const late = others.map((i) => {
    const time = times[i];
    if (time === null) return `${names[i]} left ${count(ends[i].remaining.length, "frontier")}`;
    return `${names[i]} ${clock(time - first)} later`;
  });
  return `${names[best]} finished exploring first, at ${clock(first)}; ${listed(late)}.`;
}

/** How they stand at a moment.
    @type {(missions: Mission[], names: string[], t: number) => string} */
export function lead(missions, names, t) {
  const areas = missions.map((mission) => mission.openArea(t));
  const order = areas.map((_area, i) => i).sort((a, b) => areas[b] - areas[a]);
  const [first, second] = order;
  const last = order[order.length - 1];
  const many = areas.length > 2;
  if (areas[first] - areas[last] < 0.5) return `At ${clock(t)} ${many ? "all" : "both"} know as much.`;
  const more = areas[first] - areas[second];
  const than = many ? ` than ${names[second]}` : "";
  const ahead = more < 0.5 ? `as much as ${names[second]}` : `${area(more)} more${than}`;
  return `At ${clock(t)} ${names[first]} knows ${many ? `most, ${ahead}; ${names[last]} least` : ahead}.`;
}
