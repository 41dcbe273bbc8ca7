/* What keys do, and the list of them; beside it, words of the page that need some. */

import { button, make } from "#draw/dom.js";

const KEYS = [
  ["space", "play or pause"],
  ["← →", "5 s back or on; with shift 60 s"],
  ["+ −", "faster, slower"],
  ["[ ]", "plan before, next plan"],
  ["home end", "start, end"],
  ["N S P T G", "all names, sensor range, plan, trails, guess"],
  ["O", "open or close the lanes"],
  ["F", "the whole map"],
  ["D", "dark or light"],
  ["esc", "close the legend; choose nothing, follow no more"],
  ["wheel", "zoom where the pointer is"],
  ["ctrl + wheel", "on the lanes: look closer at a time"],
  ["click", "on a robot, target, meeting point, frontier or bar: what, who and why"],
];
const DOCKING =
  "A carrier sets rovers down (they undock) and picks them up (they dock); aboard is a rover that its carrier carries.";
const AREAS =
  "Areas: known is all ground seen that is no obstacle, also where no robot can stand; reachable is where robots of " +
  "the team could get to; explored is as much of the reachable as was seen, and their share is the coverage.";
const GUESS =
  "Guess: unknown ground is divided into squares. Which of them only rovers can explore is drawn at random, as often " +
  "as in the ground seen so far. Plans count on them, so a second robot may go along to a target for what is behind.";

/** A dialog with the keys, and what words mean. */
export function keysDialog() {
  const list = KEYS.flatMap(([key, does]) => [make("dt", { text: key }), make("dd", { text: does })]);
  const dialog = make(
    "dialog",
    { class: "keys", "aria-label": "Keys" },
    make("h2", { text: "Keys and pointer" }),
    make("dl", {}, ...list),
    make("p", { text: DOCKING }),
    make("p", { text: AREAS }),
    make("p", { text: GUESS }),
  );
  dialog.append(button("Close", "Close", () => dialog.close()));
  return dialog;
}

/** What in an element has the focus by a click: a function that returns it.
    @type {(element: Element) => () => Element | null} */
export function clickedIn(element) {
  /** @type {Element | null} */
  let clicked = null;
  element.addEventListener("focusin", () => (clicked = null));
  element.addEventListener("pointerup", () => (clicked = document.activeElement));
  return () => clicked;
}

/** Whether a key is meant for what has the focus. What was `clicked` has it too, but is not to be pressed again.
    @type {(event: KeyboardEvent, clicked: Element | null) => boolean} */
export function isTaken({ target, key, ctrlKey, metaKey, altKey }, clicked) {
  if (ctrlKey || metaKey || altKey) return true;
  const type = target instanceof HTMLInputElement ? target.type : "";
  if (target instanceof HTMLTextAreaElement) return true;
  if (target instanceof HTMLInputElement && !["range", "checkbox"].includes(type)) return true;
  if (key === " " && target === clicked) return false;
  if (target instanceof HTMLSelectElement) return true;
  const tag = target instanceof Element ? target.tagName : "";
  return key === " " && (tag === "BUTTON" || tag === "SUMMARY" || type === "checkbox");
}

/** What keys do in a view; arrows leap so many ms.
    @type {(view: import("#page/app.js").View, leap: number) => Map<string, () => void>} */
export function keyActions(view, leap) {
  const { transport, legend } = view;
  return new Map([
    [" ", () => transport.toggle()],
    ["ArrowLeft", () => transport.go(transport.t - leap)],
    ["ArrowRight", () => transport.go(transport.t + leap)],
    ["+", () => transport.changeSpeed(1)],
    ["=", () => transport.changeSpeed(1)],
    ["-", () => transport.changeSpeed(-1)],
    ["?", () => view.dialog.showModal()],
    ["[", () => view.stepPlan(-1)],
    ["]", () => view.stepPlan(1)],
    ["Home", () => transport.go(view.from)],
    ["End", () => transport.go(view.to)],
    ["n", () => legend.flip("labels")],
    ["l", () => legend.flip("labels")],
    ["s", () => legend.flip("sensors")],
    ["p", () => legend.flip("plan")],
    ["t", () => legend.flip("trails")],
    ["g", () => legend.flip("guess")],
    ["f", () => view.panes.forEach((pane) => pane.showWhole())],
    ["d", () => view.switchTheme()],
    ["o", () => view.toggleLanes()],
    ["Escape", () => legend.close() || view.chooseNothing()],
  ]);
}
