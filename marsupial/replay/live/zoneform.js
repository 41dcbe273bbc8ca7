/* Zones of a mission that goes on: drawn on its map corner by corner, sent to the service, and removed. */

import { button, make } from "#draw/dom.js";
import { get, put, remove } from "#live/service.js";

const KINDS = [
  ["no_go", "no-go"],
  ["priority", "priority"],
  ["explore", "explore only"],
];

export class ZoneForm {
  /** `path` is the mission's, `pane()` returns the pane of its map, `showNotice(text)` shows what is wrong. */
  constructor(path, pane, showNotice) {
    Object.assign(this, { path: `${path}/zones`, pane, showNotice, corners: [], hidden: true });
    this.kind = make(
      "select",
      { "aria-label": "Kind of zone", onchange: () => this.show() },
      ...KINDS.map(([value, text]) => make("option", { value, text })),
    );
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
    this.element = make(
      "form",
      {
        class: "zone-form",
        hidden: true,
        onsubmit: (event) => {
          event.preventDefault();
          this.send();
        },
      },
      this.kind,
      this.name,
      this.weight,
      this.add,
      make("button", { type: "button", text: "Clear", onclick: () => this.clear() }),
      make("span", { class: "dim", text: "click its corners on the map" }),
      this.list,
    );
  }

  /** Open the form, or close it: while it is open, clicks on the map add corners. */
  toggle() {
    this.hidden = this.element.hidden = !this.hidden;
    this.pane().onPlace = this.hidden
      ? null
      : (place) => {
          this.corners.push(place);
          this.show();
        };
    this.clear();
    if (!this.hidden) this.update(() => get(this.path));
  }

  clear() {
    this.corners = [];
    this.show();
  }

  show() {
    const pane = this.pane();
    this.weight.hidden = this.kind.value !== "priority";
    this.add.disabled = this.corners.length < 3;
    pane.map.sketch = this.hidden ? null : { kind: this.kind.value, corners: this.corners };
    pane.changed();
  }

  async update(request) {
    try {
      const { zones } = await request();
      this.list.replaceChildren(
        ...zones.map(({ name }) =>
          button(`Remove ${name}`, `${name} ×`, () => this.update(() => remove(`${this.path}/${name}`))),
        ),
      );
      return true;
    } catch (error) {
      this.showNotice(error.message);
      return false;
    }
  }

  async send() {
    const { mission } = this.pane(),
      kind = this.kind.value;
    const zone = { kind, polygon_m: this.corners.map((place) => mission.metres(place)) };
    if (kind === "priority") zone.weight = Number(this.weight.value);
    if (!(await this.update(() => put(`${this.path}/${this.name.value}`, zone)))) return;
    this.clear();
    this.name.value = this.name.value.replace(/\d*$/, (number) => Number(number) + 1);
  }
}
