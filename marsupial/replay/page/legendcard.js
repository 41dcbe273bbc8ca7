/* The card behind "Legend": which layers the map shows, and what its signs and those of the lanes mean. */

import { make } from "#draw/dom.js";
import { anyGuess, anyInstead, laneLegend, mapLegend } from "#draw/legend.js";

/** @type {[id: string, name: string, shown: boolean][]} */
const LAYERS = [
  ["plan", "plan", true],
  ["trails", "trails", true],
  ["labels", "all names", false],
  ["sensors", "sensor range", false],
  ["guess", "guess", true],
];
/** @type {[id: string, name: string, shown: boolean]} */
const ALONE = ["alone", "what one alone knows", true]; // of missions side by side in one frame

export class LegendCard {
  /** @param {Mission[]} missions
      @param {boolean} alike whether a cell is the same place in all of several missions
      @param {() => void} changed */
  constructor(missions, alike, changed) {
    this.missions = missions;
    this.changed = changed;
    const layers = alike ? [...LAYERS, ALONE] : LAYERS;
    this.boxes = new Map(layers.map(([id, , shown]) => [id, checkbox(shown, changed)]));
    this.mapSigns = make("ul", { "aria-label": "Legend of the map" });
    this.laneSigns = make("ul", { "aria-label": "Legend of the timeline" });
    this.explained = 0; // how many signs of the map there are by what was seen
    const toggles = layers.map(([id, name]) => make("label", {}, this.boxes.get(id) ?? "", name));
    this.card = make(
      "div",
      { class: "card" },
      make("div", { class: "layers", role: "group", "aria-label": "What the map shows" }, ...toggles),
      this.mapSigns,
      this.laneSigns,
    );
    this.element = make("details", { class: "legend" }, make("summary", { text: "Legend" }), this.card);
  }

  /** Close the legend. Returns whether it was open.
      @type {() => boolean} */
  close() {
    const isOpen = this.element.open;
    this.element.open = false;
    return isOpen;
  }

  /** Whether it is open and lies over an element, not beside it.
      @type {(element: Element) => boolean} */
  covers(element) {
    return this.element.open && this.card.getBoundingClientRect().left < element.getBoundingClientRect().right - 1;
  }

  /** Which layers are shown.
      @type {() => Layers} */
  shown() {
    return Object.fromEntries([...this.boxes].map(([id, box]) => [id, box.checked]));
  }

  /** @type {(id: string) => void} */
  flip(id) {
    const box = this.boxes.get(id);
    if (!box) return;
    box.checked = !box.checked;
    this.changed();
  }

  /** Show the layers that an address asks for: their names with 0 or 1.
      @type {(given: URLSearchParams) => void} */
  read(given) {
    for (const [id, box] of this.boxes) if (given.has(id)) box.checked = given.get(id) !== "0";
  }

  /** Draw the signs in the colours of the theme. */
  restyle() {
    this.laneSigns.replaceChildren(...laneLegend(this.missions));
    this.drawMapSigns();
  }

  /** Draw the signs of the map again if terrains or zones were seen that have none. */
  renew() {
    if (this.explained !== this.countSigns()) this.drawMapSigns();
  }

  drawMapSigns() {
    this.mapSigns.replaceChildren(...mapLegend(this.missions));
    this.explained = this.countSigns();
  }

  countSigns() {
    const seen = this.missions.map((one) => one.sightings.codes.size + one.zones.values.length);
    return seen.reduce((sum, one) => sum + one, Number(anyGuess(this.missions)) + Number(anyInstead(this.missions)));
  }
}

/** @type {(checked: boolean, onchange: () => void) => HTMLInputElement} */
function checkbox(checked, onchange) {
  return make("input", { type: "checkbox", checked, onchange });
}
