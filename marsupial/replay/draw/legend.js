/* The legend: small drawings by the very functions that draw the map and the lanes, and what they mean. */

import { shareFrame } from "#draw/camera.js";
import { aloneColour, inks, robotColours, sideColour, terrainColour } from "#draw/colours.js";
import { fitted, make } from "#draw/dom.js";
import { isOpen } from "#log/knownmap.js";
import { bar, charger, diamond, leftover, line, meeting, plannedBar, rover, vehicle, WAITS } from "#draw/shapes.js";
import { onlyFor } from "#text/why.js";
import { drawZone } from "#draw/zones.js";

const SIGN_WIDE = 26,
  SIGN_HIGH = 18;

/** The signs of the map; terrains that were seen, with who can drive on them, where not all can. */
export function mapLegend(missions) {
  const [mission] = missions,
    ink = inks(),
    team = mission.robots,
    colours = robotColours(mission);
  const carrier = team.find((robot) => robot.carrier),
    riders = team.filter((robot) => carrier && robot.home === carrier.name);
  const loose = riders[0] || team.find((robot) => !robot.carrier),
    middle = SIGN_HIGH / 2;
  const used = mission.start.terrains.filter(
    (terrain) => terrain.code < 2 || missions.some((one) => one.sightings.codes.has(terrain.code)),
  );
  const { terrains } = mission.start,
    ground = terrains.find((terrain) => isOpen(terrain.code));
  const box = (fill) => (g) => {
    g.fillStyle = fill;
    g.strokeStyle = ink.dim;
    g.fillRect(4, 3, 18, 12);
    g.strokeRect(4.5, 3.5, 17, 11);
  };
  const zone = (kind) => (g) =>
    drawZone(
      g,
      kind,
      [
        [4, 3],
        [22, 3],
        [22, 15],
        [4, 15],
      ],
      ink,
      { width: SIGN_WIDE, height: SIGN_HIGH },
    );
  const zoned = (kind) =>
    missions.some((one) => one.zones.values.some((zones) => [...zones.values()].some((other) => other.kind === kind)));
  return entries([
    carrier && [
      (g) =>
        vehicle(
          g,
          13,
          middle,
          8,
          0,
          colours.get(carrier.name),
          carrier.kind.capacity,
          riders.slice(0, 1).map((one) => colours.get(one.name)),
          ink,
        ),
      "carrier; its seats show who is aboard",
    ],
    loose && [(g) => rover(g, 12, middle, 6, 0, colours.get(loose.name), ink), "rover"],
    [(g) => diamond(g, 13, middle, 5.5, ink, true), "target, carriers can"],
    [(g) => diamond(g, 13, middle, 5.5, ink, false), "target, only rovers"],
    [(g) => meeting(g, 7, middle, 20, middle, ink), "meeting point"],
    missions.some((one) => one.chargers.length) && [(g) => charger(g, 13, middle, 7, ink), "charging place"],
    [
      (g) =>
        line(
          g,
          [
            [1, middle],
            [25, middle],
          ],
          ink.ink,
          2.25,
          [6, 5],
        ),
      "route now",
    ],
    [
      (g) =>
        line(
          g,
          [
            [1, middle],
            [25, middle],
          ],
          ink.ink,
          1.75,
          [1, 5],
        ),
      "planned",
    ],
    [(g) => leftover(g, 13, middle, ink), "left unexplored"],
    zoned("no_go") && [zone("no_go"), "no-go zone"],
    zoned("priority") && [zone("priority"), "priority zone"],
    zoned("explore") && [zone("explore"), "area to explore"],
    [box(ink.unknown), "unknown"],
    ground &&
      missions.length > 1 &&
      shareFrame(missions) && [box(aloneColour(ground, terrains, sideColour(0))), "known to this mission alone"],
    ...used.map((terrain) => [box(terrainColour(terrain, mission.start.terrains)), described(mission, terrain)]),
  ]);
}

function described(mission, terrain) {
  const only = terrain.code > 0 ? onlyFor(mission, terrain.code) : "";
  return only ? `${terrain.name}: ${only}` : terrain.name;
}

/** The signs of the lanes. */
export function laneLegend(missions) {
  const ink = inks(),
    [mission] = missions,
    carrier = mission.robots.find((robot) => robot.carrier),
    middle = SIGN_HIGH / 2;
  const hue = carrier && robotColours(mission).get(carrier.name);
  const lane = (name, end) => (g) => bar(g, 2, 3, 22, 12, name, end, ink);
  return entries([
    [lane("move", "done"), "drive"],
    [lane("explore", "done"), "explore"],
    [lane("undock", "done"), "set down"],
    [lane("dock", "done"), "pick up"],
    carrier && [
      (g) =>
        line(
          g,
          [
            [1, middle],
            [25, middle],
          ],
          hue,
          2,
        ),
      "aboard",
    ],
    [lane("move", "superseded"), "given up for a new plan"],
    [lane("move", "blocked"), "blocked or failed"],
    [(g) => plannedBar(g, 2, 3, 22, 12, "explore", ink), "as planned now"],
    carrier && [
      (g) =>
        line(
          g,
          [
            [1, middle],
            [25, middle],
          ],
          hue,
          2,
          WAITS,
        ),
      "waits for this robot",
    ],
  ]);
}

function entries(list) {
  return list.filter(Boolean).map(([draw, text]) => {
    const canvas = make("canvas", { "aria-hidden": "true", style: `width: ${SIGN_WIDE}px; height: ${SIGN_HIGH}px` });
    draw(fitted(canvas, SIGN_WIDE, SIGN_HIGH));
    return make("li", {}, canvas, text);
  });
}
