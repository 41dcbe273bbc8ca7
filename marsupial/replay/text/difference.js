/* Missions side by side: what to call them, and what sets them apart in a sentence. */

import { area, clock, count, listed } from "#text/format.js";
import { decider } from "#text/why.js";

/** A name for each mission, by what they differ in. */
export function sideNames(missions) {
  const ways = [
    ({ start }) => start.strategy,
    decider,
    ({ start }) => `${start.strategy}, seed ${start.seed}`,
    (mission) => `${decider(mission)}, ${mission.start.scenario}`,
  ];
  const way = ways.find((one) => new Set(missions.map(one)).size === missions.length);
  return way
    ? missions.map(way)
    : missions.map((mission, i) => `${mission.start.strategy}${missions.length > 1 ? ` (${"ABCDEF"[i]})` : ""}`);
}

/** What came out; before all have ended, who was first. Of two, as `compare` says it of a pair: in how much less time
    the first one explored, as a share of the second one's, and when it finished. */
export function outcome(missions, names) {
  const ends = missions.map((mission) => mission.ended),
    over = missions.filter((mission) => mission.ended);
  if (!over.length) return "";
  if (over.length < missions.length) {
    const first = over.reduce((best, one) => (one.to < best.to ? one : best));
    const others = names.filter((_, i) => !ends[i]);
    const rest = `${listed(others)} ${others.length > 1 ? "go" : "goes"} on`;
    return `${names[missions.indexOf(first)]} ended first, at ${clock(first.to)}; ${rest}.`;
  }
  const times = ends.map((end) => end.exploration_ms);
  if (missions.length > 2) return ranking(ends, times, names);
  if (times.every((t) => t === null)) {
    const areas = missions.map((mission) => mission.openArea(mission.to)),
      more = areas[1] > areas[0] ? 1 : 0;
    return `Neither explored everything; ${names[more]} came to know ${area(areas[more])}, ${names[1 - more]} ${area(areas[1 - more])}.`;
  }
  if (times.includes(null)) {
    const done = times[0] === null ? 1 : 0;
    return `${names[done]} finished exploring at ${clock(times[done])}; ${names[1 - done]} left ${count(ends[1 - done].remaining.length, "frontier")}.`;
  }
  const [time, other] = times,
    gain = ((100 * Math.abs(other - time)) / other).toFixed(1),
    [at, before] = times.map((ms) => Math.round(ms / 1000));
  if (time === other) return `Both finished exploring at ${clock(time)}.`;
  const earlier = before === at ? "" : `, ${clock(1000 * Math.abs(before - at))} ${time < other ? "earlier" : "later"}`;
  const less = `${gain} % ${time < other ? "less" : "more"} time`;
  return `${names[0]} explored in ${less} than ${names[1]}: it finished at ${clock(time)}${earlier}.`;
}

/** Of more than two: who finished first, and how much later the others did. */
function ranking(ends, times, names) {
  const order = names.map((_, i) => i).sort((a, b) => (times[a] ?? Infinity) - (times[b] ?? Infinity)),
    [best, ...others] = order;
  if (times[best] === null) return "None explored everything.";
  const late = others.map((i) =>
    times[i] === null
      ? `${names[i]} left ${count(ends[i].remaining.length, "frontier")}`
      : `${names[i]} ${clock(times[i] - times[best])} later`,
  );
  return `${names[best]} finished exploring first, at ${clock(times[best])}; ${listed(late)}.`;
}

/** How they stand at a moment. */
export function lead(missions, names, t) {
  const areas = missions.map((mission) => mission.openArea(t));
  const order = areas.map((_, i) => i).sort((a, b) => areas[b] - areas[a]);
  const [first, second] = order,
    last = order[order.length - 1],
    many = areas.length > 2;
  if (areas[first] - areas[last] < 0.5) return `At ${clock(t)} ${many ? "all" : "both"} know as much.`;
  const more = areas[first] - areas[second],
    than = many ? ` than ${names[second]}` : "";
  const ahead = more < 0.5 ? `as much as ${names[second]}` : `${area(more)} more${than}`;
  return `At ${clock(t)} ${names[first]} knows ${many ? `most, ${ahead}; ${names[last]} least` : ahead}.`;
}
