/* What keys do, and the list of them; beside it, words of the page that need some. */

import { button, make } from "#draw/dom.js";

const KEYS = [
  ["space", "play or pause"],
  ["← →", "5 s back or on; with shift 60 s"],
  ["+ −", "faster, slower"],
  ["[ ]", "plan before, next plan"],
  ["home end", "start, end"],
  ["N S P T", "all names, sensor range, plan, trails"],
  ["O", "open or close the lanes"],
  ["F", "the whole map"],
  ["D", "dark or light"],
  ["esc", "choose nothing, follow no more"],
  ["wheel", "zoom where the pointer is"],
  ["ctrl + wheel", "on the lanes: look closer at a time"],
  ["click", "on a robot, target, meeting point, frontier or bar: what, who and why"],
];
const DOCKING =
  "A carrier sets rovers down (they undock) and picks them up (they dock); aboard is a rover that its carrier carries.";
const AREAS =
  "Areas: known is all ground seen that is no obstacle, also where no robot can stand; reachable is where robots of the team " +
  "could get to; explored is as much of the reachable as was seen, and their share is the coverage.";

/** A dialog with the keys, and what words mean. */
export function keysDialog() {
  const dialog = make(
    "dialog",
    { class: "keys", "aria-label": "Keys" },
    make("h2", { text: "Keys and pointer" }),
    make("dl", {}, ...KEYS.flatMap(([key, does]) => [make("dt", { text: key }), make("dd", { text: does })])),
    make("p", { text: DOCKING }),
    make("p", { text: AREAS }),
  );
  dialog.append(button("Close", "Close", () => dialog.close()));
  return dialog;
}

/** Whether a key is meant for what has the focus. */
export function isTaken(event) {
  const on = event.target.tagName,
    type = event.target.type;
  if (event.ctrlKey || event.metaKey || event.altKey || on === "SELECT" || on === "TEXTAREA") return true;
  if (on === "INPUT" && !["range", "checkbox"].includes(type)) return true;
  return event.key === " " && (on === "BUTTON" || on === "SUMMARY" || type === "checkbox");
}
