/* Zones of a mission that goes on: drawn on its map corner by corner, sent to the service, and removed. */

import { button, make } from "#draw/dom.js";
import { get, messageOf, put, remove } from "#live/service.js";
import { placeOf } from "#log/frame.js";

/** @typedef {import("#page/pane.js").Pane} Pane */

/** @type {[kind: ZoneKind, text: string][]} */
const KINDS = [
  ["no_go", "no-go"],
  ["priority", "priority"],
  ["explore", "explore only"],
];

export class ZoneForm {
  /** @param {string} path of the mission
      @param {() => Pane | undefined} pane returns the pane of its map, once there is one
      @param {(text: string) => void} showNotice shows what is wrong */
  constructor(path, pane, showNotice) {
    this.path = `${path}/zones`;
    this.pane = pane;
    this.showNotice = showNotice;
    /** @type {Cell[]} */
    this.corners = [];
    this.hidden = true;
    const kinds = KINDS.map(([value, text]) => make("option", { value, text }));
    this.select = make("select", { "aria-label": "Kind of zone", onchange: () => this.show() }, ...kinds);
    this.name = make("input", {
      "aria-label": "Name of the zone",
      value: "zone1",
      pattern: "[A-Za-z][\\w\\-]*",
      required: true,
      size: 8,
    });
    this.weight = make("input", {
      "aria-label": "Weight",
      type: "number",
      value: 5,
      min: 1,
      max: 1000,
      step: "any",
      title: "How much more targets there are worth",
    });
    this.add = make("button", { type: "submit", text: "Add" });
    this.list = make("span", { class: "zones" });
    /** @type {(event: Event) => void} */
    const onsubmit = (event) => {
      event.preventDefault();
      this.send();
    };
    this.element = make(
      "form",
      { class: "zone-form", hidden: true, onsubmit },
      this.select,
      this.name,
      this.weight,
      this.add,
      make("button", { type: "button", text: "Undo", title: "Take the last corner back", onclick: () => this.undo() }),
      make("span", { class: "dim", text: "click its corners on the map" }),
      this.list,
    );
  }

  /** The kind that is chosen. */
  get kind() {
    return KINDS[this.select.selectedIndex][0];
  }

  /** Open the form above the map, or close it: while it is open, clicks on the map add corners. */
  toggle() {
    const pane = this.pane();
    if (!pane) return;
    pane.element.prepend(this.element);
    this.hidden = !this.hidden;
    this.element.hidden = this.hidden;
    pane.onPlace = this.hidden ? null : (place) => this.addCorner(place);
    this.clear();
    if (!this.hidden) this.update(() => get(this.path));
  }

  /** @type {(place: Cell) => void} */
  addCorner(place) {
    this.corners.push(place);
    this.show();
  }

  undo() {
    this.corners.pop();
    this.show();
  }

  clear() {
    this.corners = [];
    this.show();
  }

  show() {
    const pane = this.pane();
    this.weight.hidden = this.kind !== "priority";
    this.add.disabled = this.corners.length < 3;
    if (!pane) return;
    pane.map.sketch = this.hidden ? null : { kind: this.kind, corners: this.corners };
    pane.changed();
  }

  /** Show the zones that a request answers, also on the map: a mission that is paused takes them in when it goes on.
      Returns whether it was answered.
      @type {(request: () => Promise<{ zones: (LoggedZone & { name: string })[] }>) => Promise<boolean>} */
  async update(request) {
    try {
      const { zones } = await request();
      const { map, mission, changed } = this.pane() ?? {};
      if (map && mission) {
        map.asked = zones.map((zone) => ({ ...zone, corners: zone.polygon_m.map((p) => placeOf(mission.start, p)) }));
      }
      changed?.();
      const buttons = zones.map(({ name }) =>
        button(`Remove ${name}`, `${name} ×`, () => this.update(() => remove(`${this.path}/${name}`))),
      );
      this.list.replaceChildren(...buttons);
      return true;
    } catch (error) {
      this.showNotice(messageOf(error));
      return false;
    }
  }

  async send() {
    const { mission } = this.pane() ?? {};
    if (!mission) return;
    const zone = {
      kind: this.kind,
      polygon_m: this.corners.map((place) => mission.metres(place)),
      ...(this.kind === "priority" ? { weight: Number(this.weight.value) } : {}),
    };
    if (!(await this.update(() => put(`${this.path}/${this.name.value}`, zone)))) return;
    this.clear();
    this.name.value = this.name.value.replace(/\d*$/, (number) => String(Number(number) + 1));
  }
}
