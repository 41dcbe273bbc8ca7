/* The legend: small drawings by the very functions that draw the map and the lanes, and what they mean. */

import { shareFrame } from "#draw/camera.js";
import { aloneColour, colourOf, inks, robotColours, sideColour, terrainColour } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { hall, room } from "#draw/guess.js";
import { instead } from "#draw/planlayer.js";
import {
  bar,
  CHOSEN,
  charger,
  diamond,
  leftover,
  line,
  meeting,
  pause,
  plannedBar,
  rover,
  vehicle,
  WAITS,
} from "#draw/shapes.js";
import { drawZone } from "#draw/zones.js";
import { isOpen } from "#log/knownmap.js";
import { onlyFor } from "#text/why.js";

const SIGN = { width: 26, height: 18 };
const MIDDLE = SIGN.height / 2;
/** @type {Point[]} */
const ACROSS = [
  [1, MIDDLE],
  [25, MIDDLE],
];
/** @type {Point[]} */
const FRAME = [
  [4, 3],
  [22, 3],
  [22, 15],
  [4, 15],
];

/** A drawing and what it means.
    @typedef {[draw: (g: Context) => void, text: string]} Sign */

/** The signs of the map; terrains that were seen, with who can drive on them, where not all can.
    @type {(missions: Mission[]) => HTMLElement[]} */
export function mapLegend(missions) {
  const ink = inks();
  /** @type {Sign[]} */
  const signs = [
    ...robotSigns(missions[0], ink),
    [(g) => diamond(g, 13, MIDDLE, 5.5, ink, true), "target, carriers can"],
    [(g) => diamond(g, 13, MIDDLE, 5.5, ink, false), "target, only rovers"],
    [(g) => meeting(g, 7, MIDDLE, 20, MIDDLE, ink), "meeting point"],
  ];
  if (missions.some((one) => one.chargers.length)) {
    signs.push([(g) => charger(g, 13, MIDDLE, 7, ink), "charging place"]);
  }
  signs.push(
    [(g) => line(g, ACROSS, ink.ink, 2.25, [6, 5]), "route now"],
    [(g) => line(g, ACROSS, ink.ink, 1.75, [1, 5]), "planned"],
    [(g) => leftover(g, 13, MIDDLE, ink), "left unexplored"],
    ...insteadSigns(missions, ink),
    ...guessSigns(missions, ink),
    ...zoneSigns(missions, ink),
    ...groundSigns(missions, ink),
  );
  return entries(signs);
}

/** @type {(mission: Mission, ink: Ink) => Sign[]} */
function robotSigns(mission, ink) {
  const team = mission.robots;
  const colours = robotColours(mission);
  const carrier = team.find((robot) => robot.carrier);
  const riders = team.filter((robot) => carrier && robot.home === carrier.name);
  const loose = riders[0] || team.find((robot) => !robot.carrier);
  /** @type {Sign[]} */
  const signs = [];
  if (carrier) {
    const own = colourOf(colours, carrier.name);
    const aboard = riders.slice(0, 1).map((one) => colourOf(colours, one.name));
    signs.push([
      (g) => vehicle(g, 13, MIDDLE, 8, 0, own, carrier.kind.capacity, aboard, ink),
      "carrier; its seats show who is aboard",
    ]);
  }
  if (loose) signs.push([(g) => rover(g, 12, MIDDLE, 6, 0, colourOf(colours, loose.name), ink), "rover"]);
  signs.push([(g) => pause(g, 13, MIDDLE, ink), "beside a robot: it waits"]);
  return signs;
}

/** Whether a plan so far was compared with others.
    @type {(missions: Mission[]) => boolean} */
export function anyInstead(missions) {
  return missions.some(({ plans }) => plans.some((plan) => plan.instead.length));
}

/** @type {(missions: Mission[], ink: Ink) => Sign[]} */
function insteadSigns(missions, ink) {
  if (!anyInstead(missions)) return [];
  return [[(g) => instead(g, [1, MIDDLE], [[19, MIDDLE]], 5, ink.ink), "next best plan, if compared"]];
}

/** Whether a plan so far guesses unknown ground.
    @type {(missions: Mission[]) => boolean} */
export function anyGuess(missions) {
  return missions.some(({ plans }) => plans.some((plan) => plan.guess));
}

/** @type {(missions: Mission[], ink: Ink) => Sign[]} */
function guessSigns(missions, ink) {
  if (!anyGuess(missions)) return [];
  return [
    [(g) => hall(piece(g, ink.unknown, ink), 5, 4, 16, 10, ink), "unknown, guessed: carriers can"],
    [(g) => room(piece(g, ink.unknown, ink), 5, 4, 16, 10, ink), "unknown, guessed: only rovers"],
  ];
}

/** @type {(missions: Mission[], ink: Ink) => Sign[]} */
function zoneSigns(missions, ink) {
  const held = missions.flatMap((one) => one.zones.values).flatMap((zones) => [...zones.values()]);
  const kinds = new Set(held.map((zone) => zone.kind));
  /** @type {[ZoneKind, string][]} */
  const texts = [
    ["no_go", "no-go zone"],
    ["priority", "priority zone"],
    ["explore", "area to explore"],
  ];
  return texts
    .filter(([kind]) => kinds.has(kind))
    .map(([kind, text]) => [(g) => drawZone(g, kind, FRAME, ink, SIGN), text]);
}

/** A piece of ground.
    @type {(g: Context, fill: string, ink: Ink) => Context} */
function piece(g, fill, ink) {
  g.fillStyle = fill;
  g.strokeStyle = ink.dim;
  g.fillRect(4, 3, 18, 12);
  g.strokeRect(4.5, 3.5, 17, 11);
  return g;
}

/** @type {(missions: Mission[], ink: Ink) => Sign[]} */
function groundSigns(missions, ink) {
  const [mission] = missions;
  const { terrains } = mission.start;
  const codes = terrains.map((terrain) => terrain.code);
  /** @type {(fill: string, text: string) => Sign} */
  const box = (fill, text) => [(g) => piece(g, fill, ink), text];
  const signs = [box(ink.unknown, "unknown")];
  const ground = codes.find(isOpen);
  if (ground !== undefined && missions.length > 1 && shareFrame(missions)) {
    signs.push(box(aloneColour(ground, codes, sideColour(0)), "known to this mission alone"));
  }
  for (const { code, name } of terrains) {
    if (code > 1 && !missions.some((one) => one.sightings.codes.has(code))) continue;
    const only = code > 0 ? onlyFor(mission, code) : "";
    signs.push(box(terrainColour(code, codes), only ? `${name}: ${only}` : name));
  }
  return signs;
}

/** The signs of the lanes.
    @type {(missions: Mission[]) => HTMLElement[]} */
export function laneLegend([mission]) {
  const ink = inks();
  const carrier = mission.robots.find((robot) => robot.carrier);
  const hue = carrier && colourOf(robotColours(mission), carrier.name);
  /** @type {(name: ActionName, end: ActionEnd, text: string) => Sign} */
  const lane = (name, end, text) => [(g) => bar(g, 2, 3, 22, 12, name, end, ink), text];
  const signs = [
    lane("move", "done", "drive"),
    lane("explore", "done", "explore"),
    lane("undock", "done", "set down"),
    lane("dock", "done", "pick up"),
  ];
  if (hue) signs.push([(g) => line(g, ACROSS, hue, 2), "aboard"]);
  signs.push(
    lane("move", "superseded", "drive given up for a new plan"),
    lane("explore", "superseded", "the same of exploring"),
    lane("move", "blocked", "blocked or failed"),
    [(g) => plannedBar(g, 2, 3, 22, 12, "explore", ink), "planned, in open lanes; else what came later"],
  );
  if (hue) signs.push([(g) => line(g, ACROSS, hue, 2, WAITS), "waits for the robot of this colour; grey: for work"]);
  signs.push([(g) => marked(g, ink), "chosen robot; work at the chosen place"]);
  return entries(signs);
}

/** @type {(g: Context, ink: Ink) => void} */
function marked(g, ink) {
  g.fillStyle = g.strokeStyle = ink.accent;
  g.globalAlpha = CHOSEN;
  g.fillRect(0, 0, SIGN.width, SIGN.height);
  g.globalAlpha = 1;
  g.lineWidth = 2;
  g.strokeRect(9, 3, 10, 12);
}

/** @type {(signs: Sign[]) => HTMLElement[]} */
function entries(signs) {
  const { width, height } = SIGN;
  return signs.map(([draw, text]) => {
    const canvas = make("canvas", { "aria-hidden": "true", style: `width: ${width}px; height: ${height}px` });
    draw(fitted(canvas, width, height));
    return make("li", {}, canvas, text);
  });
}
