/* The map of a mission to be started, as the service understands it: who can stand where, what looks odd, and where the
   robots start. Carriers can be dragged elsewhere; no-go zones and a boundary of what is explored are drawn corner by corner. */

import { colour, inks } from "#draw/colours.js";
import { button, fitted, make, setText } from "#draw/dom.js";
import { count, metres } from "#text/format.js";
import { metresOf, placeOf } from "#log/model.js";
import { painted } from "#live/picture.js";
import { vehicle } from "#draw/shapes.js";
import { drawZone } from "#draw/zones.js";

const MARGIN = 16,
  NEAR = 14; // points of the page
const ROBOT = 9; // radius of a carrier, in points
const FAMILIES = 8,
  SHADES = 3;
const CLASSES = [
  // by the codes of the service, with the name and the colours that are mixed
  ["obstacle", "wall"],
  ["carriers can stand here", "free"],
  ["only rovers can", "other"],
  ["too narrow for all", "free", "dim"],
  ["cut off", "free", "accent"],
  ["leaks at the border", "bad"],
];

function classColour(code) {
  const [, first, second] = CLASSES[code];
  return second ? `color-mix(in srgb, ${colour(first)}, ${colour(second)} 40%)` : colour(first);
}

export class Preview {
  /** `changed()` is called when robots or zones were moved or drawn; all ends with `signal`. */
  constructor(changed, signal) {
    Object.assign(this, { changed, map: null, starts: [], zones: [], tool: null, corners: [], dragged: -1, rovers: 0 });
    this.canvas = make("canvas", { role: "img", "aria-label": "No map yet" });
    this.hint = make("p", { class: "dim hint" });
    this.legend = make("ul", { class: "classes" });
    this.list = make("span", { class: "drawn" });
    this.bySeed = button(
      "Let the seed place the robots",
      "Starts by seed",
      () => {
        this.starts = [];
        this.changed();
      },
      { hidden: true },
    );
    this.tools = [
      ["no_go", "Draw a no-go zone"],
      ["explore", "Draw a boundary"],
    ].map(([kind, text]) =>
      make("button", {
        type: "button",
        text,
        "aria-pressed": "false",
        onclick: () => this.take(this.tool === kind ? null : kind),
      }),
    );
    this.warnings = make("ul", { class: "warnings", "aria-label": "Warnings about the map" });
    this.stage = make("div", { class: "picture" }, this.canvas);
    this.element = make(
      "section",
      { class: "preview", "aria-label": "The map" },
      this.stage,
      make("div", { class: "preview-tools" }, this.hint, this.list, this.bySeed, ...this.tools),
      this.legend,
      this.warnings,
    );
    this.listen();
    const resized = new ResizeObserver(() => this.draw());
    resized.observe(this.stage);
    signal.addEventListener("abort", () => resized.disconnect());
    window.addEventListener(
      "themechange",
      () => {
        this.painted = null;
        this.draw();
      },
      { signal },
    );
  }

  /** Forget what was placed and drawn: the map is another one. */
  clear() {
    Object.assign(this, { starts: [], zones: [] });
    this.take(null);
  }

  /** What of a request is decided here. */
  get request() {
    return {
      ...(this.starts.length ? { starts_m: this.starts } : {}),
      ...(this.zones.length ? { zones: this.zones } : {}),
    };
  }

  /** Show an answer of the service; `rovers`: how many each carrier has. Null: there is no map. */
  show(map, rovers = 0, note = "") {
    Object.assign(this, {
      map,
      rovers,
      painted: null,
      robots: map?.robots.length ? map.robots.map((robot) => robot.point_m) : this.starts,
    });
    setText(
      this.hint,
      map
        ? `${metres(map.width * map.resolution_m)} × ${metres(map.height * map.resolution_m)}${this.tool ? "" : "; drag a carrier to place it"}`
        : note,
    );
    const codes = new Set(map ? map.runs.filter((_, i) => i % 3 === 2) : []);
    this.legend.replaceChildren(
      ...CLASSES.flatMap(([text], code) =>
        codes.has(code)
          ? [make("li", {}, make("span", { class: "swatch", style: `background: ${classColour(code)}` }), text)]
          : [],
      ),
    );
    this.warnings.replaceChildren(...(map ? map.warnings : []).map((text) => make("li", { text })));
    this.element.classList.toggle("empty", note !== "");
    for (const tool of this.tools) tool.hidden = !map;
    this.canvas.setAttribute(
      "aria-label",
      map ? `Map with ${count(this.robots.length, "carrier")} and ${count(this.zones.length, "zone")}` : "No map yet",
    );
    this.draw();
  }

  /** Show that an answer is on its way. */
  wait() {
    setText(this.hint, "looking at the map …");
  }

  take(tool) {
    Object.assign(this, { tool, corners: [] });
    this.tools.forEach((one, i) => one.setAttribute("aria-pressed", String(tool === ["no_go", "explore"][i])));
    this.draw();
  }

  /** Close the polygon that is being drawn. */
  finish() {
    const kind = this.tool,
      name = (n) => `${kind === "no_go" ? "no-go" : "boundary"}${n}`,
      taken = new Set(this.zones.map((zone) => zone.name));
    let n = 1;
    while (taken.has(name(n))) n++;
    this.zones = [
      ...this.zones,
      { name: name(n), kind, polygon_m: this.corners.map((place) => metresOf(this.map, place)) },
    ];
    this.take(null);
    this.changed();
  }

  listen() {
    const at = (event) => [event.offsetX, event.offsetY],
      near = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by) <= NEAR;
    this.canvas.addEventListener("pointerdown", (event) => {
      if (!this.map) return;
      const here = at(event);
      if (!this.tool) {
        this.dragged = this.robots.findIndex((point) => near(this.point(placeOf(this.map, point)), here));
        if (this.dragged >= 0) this.canvas.setPointerCapture(event.pointerId);
      } else if (this.corners.length > 2 && near(this.point(this.corners[0]), here)) this.finish();
      else {
        this.corners.push(this.place(here));
        this.draw();
      }
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (this.dragged < 0) return;
      this.robots = this.robots.map((point, i) =>
        i === this.dragged ? metresOf(this.map, this.place(at(event))) : point,
      );
      this.draw();
    });
    this.canvas.addEventListener("pointerup", () => {
      if (this.dragged >= 0) {
        this.starts = this.robots.map((point) => point.map((value) => Math.round(1000 * value) / 1000));
        this.changed();
      }
      this.dragged = -1;
    });
  }

  point([x, y]) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }
  place([px, py]) {
    return [(px - this.left) / this.scale - 0.5, (this.top - py) / this.scale - 0.5];
  }

  draw() {
    const { clientWidth: wide, clientHeight: high } = this.stage;
    if (!wide) return;
    const g = fitted(this.canvas, wide, high),
      ink = inks(),
      { map } = this;
    g.fillStyle = ink.unknown;
    g.fillRect(0, 0, wide, high);
    this.bySeed.hidden = !this.starts.length;
    this.list.replaceChildren(
      ...this.zones.map((zone) =>
        button(`Remove ${zone.name}`, `${zone.name} ×`, () => {
          this.zones = this.zones.filter((one) => one !== zone);
          this.changed();
        }),
      ),
    );
    if (!map) return;
    this.scale = Math.min((wide - 2 * MARGIN) / map.width, (high - 2 * MARGIN) / map.height);
    const coarse = Math.max(1, Math.floor(1 / this.scale / (window.devicePixelRatio || 1)));
    if (coarse !== this.coarse) Object.assign(this, { coarse, painted: null });
    this.painted ??= painted(map, classColour, coarse);
    this.left = (wide - map.width * this.scale) / 2;
    this.top = (high + map.height * this.scale) / 2;
    g.imageSmoothingEnabled = this.scale < 1;
    g.drawImage(
      this.painted,
      this.left,
      this.top - map.height * this.scale,
      this.painted.width * coarse * this.scale,
      this.painted.height * coarse * this.scale,
    );
    for (const { kind, polygon_m } of this.zones) {
      drawZone(
        g,
        kind,
        polygon_m.map((point) => this.point(placeOf(map, point))),
        ink,
        { width: wide, height: high },
      );
    }
    if (this.tool) this.drawSketch(g, ink, wide, high);
    this.robots.forEach((point, i) => {
      const hue = i % FAMILIES,
        aboard = Array.from({ length: this.rovers }, (_, k) => colour(`family-${hue}-${(k % SHADES) + 1}`));
      vehicle(g, ...this.point(placeOf(map, point)), ROBOT, 0, colour(`family-${hue}-0`), this.rovers, aboard, ink);
    });
  }

  drawSketch(g, ink, width, height) {
    const points = this.corners.map((corner) => this.point(corner));
    if (points.length) drawZone(g, this.tool, points, ink, { width, height });
    for (const [x, y] of points) {
      g.fillStyle = ink.ink;
      g.fillRect(x - 3, y - 3, 6, 6);
    }
    setText(this.hint, points.length < 3 ? "click its corners on the map" : "click the first corner again to close it");
  }
}
