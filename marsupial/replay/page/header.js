/* The head of a view: what its missions are, and its buttons. */

import { button, icon, make } from "#draw/dom.js";
import { count, listed, metres } from "#text/format.js";
import { decider } from "#text/why.js";

export const HALF_FULL = "M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 1.6v10.8a5.4 5.4 0 0 1 0-10.8z";

/** `second`: what stands in the place of the subtitle; `state`: of a mission alone, unless it has controls.
    @typedef {{
      legend: HTMLElement, second: HTMLElement | null, state: HTMLElement,
      showKeys: () => void, switchTheme: () => void }} HeaderParts */

/** @type {(missions: Mission[], names: string[], options: ViewOptions, parts: HeaderParts) => HTMLElement} */
export function header(
  missions,
  names,
  { save, home = [], controls, shared = [] },
  { legend, second, state, ...parts },
) {
  const subtitle = subtitleOf(missions, names);
  const title = make("h1", { text: missions[0].start.scenario || "Mission", title: subtitle });
  const line = second ?? make("p", { class: "subtitle", text: subtitle, title: subtitle });
  const head = make("header", {}, ...home, title, line);
  if (!second) head.append(...(controls ?? [state]));
  head.append(...shared, legend);
  if (save) {
    const [text, onclick] = save;
    head.append(make("button", { type: "button", text, title: "Save the mission log as JSON lines", onclick }));
  }
  head.append(
    button("Keys", "?", parts.showKeys, { class: "keys-button" }),
    button("Switch between light and dark", icon(HALF_FULL), parts.switchTheme),
  );
  return head;
}

/** @type {(missions: Mission[], names: string[]) => string} */
function subtitleOf(missions, names) {
  const [{ start, robots, resolution }] = missions;
  const carriers = robots.filter((robot) => robot.carrier).length;
  const size = `${metres(start.width * resolution)} x ${metres(start.height * resolution)}`;
  return [
    missions.length > 1 ? listed(names) : decider(missions[0]),
    `seed ${start.seed}`,
    `${count(carriers, "carrier")}, ${count(robots.length - carriers, "rover")}`,
    `${size} at ${Number(resolution.toPrecision(3))} m a cell`,
  ].join(" · ");
}
