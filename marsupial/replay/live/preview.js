/* The map of a mission to be started, as the service understands it: who can stand where, what looks odd, and where the
   robots start. Carriers can be dragged elsewhere; no-go zones and a boundary of what is explored are drawn corner by
   corner. */

import { colour, FAMILIES, inks, SHADES } from "#draw/colours.js";
import { button, fitted, make, setText } from "#draw/dom.js";
import { vehicle } from "#draw/shapes.js";
import { drawZone } from "#draw/zones.js";
import { codesOf, painted } from "#live/picture.js";
import { metresOf, placeOf } from "#log/frame.js";
import { count, metres } from "#text/format.js";

const MARGIN = 16;
const NEAR = 14; // points of the page
const ROBOT = 9; // radius of a carrier, in points
/** What robots can do on cells, by the codes of the service, with the colours that are mixed. */
const CLASSES = [
  { text: "obstacle", mixed: ["wall"] },
  { text: "carriers can stand here", mixed: ["free"] },
  { text: "only rovers can", mixed: ["other"] },
  { text: "too narrow for all", mixed: ["free", "dim"] },
  { text: "cut off", mixed: ["free", "accent"] },
  { text: "leaks at the border", mixed: ["bad"] },
];
/** @type {{ kind: ZoneKind, name: string, text: string }[]} */
const TOOLS = [
  { kind: "no_go", name: "no-go", text: "Draw a no-go zone" },
  { kind: "explore", name: "boundary", text: "Draw a boundary" },
];

/** @type {(code: number) => string} */
function classColour(code) {
  const [first, second] = CLASSES[code].mixed;
  return second ? `color-mix(in srgb, ${colour(first)}, ${colour(second)} 40%)` : colour(first);
}

export class Preview {
  /** @param {() => void} changed is called when robots or zones were moved or drawn
      @param {AbortSignal} signal ends all */
  constructor(changed, signal) {
    this.changed = changed;
    /** @type {MapPreview | null} */
    this.map = null;
    /** @type {Point[]} */
    this.starts = []; // of carriers that were placed here
    /** @type {Point[]} */
    this.robots = []; // where carriers stand
    this.rovers = 0; // on each
    /** @type {NamedZone[]} */
    this.zones = [];
    /** @type {ZoneKind | null} */
    this.tool = null;
    /** @type {Cell[]} */
    this.corners = []; // of the zone that is being drawn
    this.dragged = -1;
    /** @type {HTMLCanvasElement | null} */
    this.painted = null;
    this.coarse = 1; // cells a side for each of its pixels
    this.scale = 1; // points a cell
    this.left = 0; // of the lower left corner
    this.top = 0;
    this.canvas = make("canvas", { role: "img", "aria-label": "No map yet" });
    this.hint = make("p", { class: "dim hint" });
    this.legend = make("ul", { class: "classes" });
    this.list = make("span", { class: "drawn" });
    const bySeed = () => {
      this.starts = [];
      this.changed();
    };
    this.bySeed = button("Let the seed place the robots", "Starts by seed", bySeed, { hidden: true });
    this.tools = TOOLS.map(({ kind, text }) => {
      const onclick = () => this.take(this.tool === kind ? null : kind);
      return make("button", { type: "button", text, "aria-pressed": "false", onclick });
    });
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
    this.listen(signal);
  }

  /** Forget what was placed and drawn: the map is another one. */
  clear() {
    this.starts = [];
    this.zones = [];
    this.take(null);
  }

  /** What of a request is decided here. */
  get request() {
    return {
      ...(this.starts.length ? { starts_m: this.starts } : {}),
      ...(this.zones.length ? { zones: this.zones } : {}),
    };
  }

  /** Show an answer of the service; `rovers`: how many each carrier has. Null: there is no map, as `note` explains.
      @type {(map: MapPreview | null, rovers?: number, note?: string) => void} */
  show(map, rovers = 0, note = "") {
    this.map = map;
    this.rovers = rovers;
    this.painted = null;
    this.robots = map?.robots.length ? map.robots.map((robot) => robot.point_m) : this.starts;
    setText(this.hint, map ? this.sizeText(map) : note);
    this.legend.replaceChildren(...(map ? classSigns(map) : []));
    this.warnings.replaceChildren(...(map ? map.warnings : []).map((text) => make("li", { text })));
    this.element.classList.toggle("empty", note !== "");
    for (const tool of this.tools) tool.hidden = !map;
    const things = `${count(this.robots.length, "carrier")} and ${count(this.zones.length, "zone")}`;
    this.canvas.setAttribute("aria-label", map ? `Map with ${things}` : "No map yet");
    this.draw();
  }

  /** @type {(map: MapPreview) => string} */
  sizeText({ width, height, resolution_m }) {
    const size = `${metres(width * resolution_m)} × ${metres(height * resolution_m)}`;
    return this.tool ? size : `${size}; drag a carrier to place it`;
  }

  /** Show that an answer is on its way. */
  wait() {
    setText(this.hint, "looking at the map …");
  }

  /** Take a tool in hand; null: none.
      @type {(tool: ZoneKind | null) => void} */
  take(tool) {
    this.tool = tool;
    this.corners = [];
    this.tools.forEach((one, i) => one.setAttribute("aria-pressed", String(tool === TOOLS[i].kind)));
    this.draw();
  }

  /** Close the polygon that is being drawn.
      @type {(map: MapPreview) => void} */
  finish(map) {
    const tool = TOOLS.find((one) => one.kind === this.tool);
    if (!tool) return;
    const taken = new Set(this.zones.map((zone) => zone.name));
    let n = 1;
    while (taken.has(`${tool.name}${n}`)) n++;
    const polygon_m = this.corners.map((place) => metresOf(map, place));
    this.zones = [...this.zones, { name: `${tool.name}${n}`, kind: tool.kind, polygon_m }];
    this.take(null);
    this.changed();
  }

  /** @type {(signal: AbortSignal) => void} */
  listen(signal) {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (this.map) this.press(this.map, event);
    });
    canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
      const { map, dragged } = this;
      if (!map || dragged < 0) return;
      const here = metresOf(map, this.place([offsetX, offsetY]));
      this.robots = this.robots.map((point, i) => (i === dragged ? here : point));
      this.draw();
    });
    canvas.addEventListener("pointerup", () => {
      if (this.dragged >= 0) {
        this.starts = this.robots.map(([x, y]) => [Math.round(1000 * x) / 1000, Math.round(1000 * y) / 1000]);
        this.changed();
      }
      this.dragged = -1;
    });
    const resized = new ResizeObserver(() => this.draw());
    resized.observe(this.stage);
    signal.addEventListener("abort", () => resized.disconnect());
    const restyle = () => {
      this.painted = null;
      this.draw();
    };
    window.addEventListener("themechange", restyle, { signal });
  }

  /** Take hold of a carrier, or draw a corner of a zone.
      @type {(map: MapPreview, event: PointerEvent) => void} */
  press(map, { offsetX, offsetY, pointerId }) {
    /** @type {(point: Point) => boolean} */
    const isNear = ([x, y]) => Math.hypot(x - offsetX, y - offsetY) <= NEAR;
    if (!this.tool) {
      this.dragged = this.robots.findIndex((point) => isNear(this.point(placeOf(map, point))));
      if (this.dragged >= 0) this.canvas.setPointerCapture(pointerId);
    } else if (this.corners.length > 2 && isNear(this.point(this.corners[0]))) this.finish(map);
    else {
      this.corners.push(this.place([offsetX, offsetY]));
      this.draw();
    }
  }

  /** @type {(place: Cell) => Point} */
  point([x, y]) {
    return [this.left + (x + 0.5) * this.scale, this.top - (y + 0.5) * this.scale];
  }

  /** @type {(point: Point) => Cell} */
  place([px, py]) {
    return [(px - this.left) / this.scale - 0.5, (this.top - py) / this.scale - 0.5];
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width) return;
    const { map } = this;
    const g = fitted(this.canvas, width, height);
    const ink = inks();
    g.fillStyle = ink.unknown;
    g.fillRect(0, 0, width, height);
    this.bySeed.hidden = !this.starts.length;
    this.list.replaceChildren(...this.zones.map((zone) => this.removeButton(zone)));
    if (!map) return;
    this.drawMap(g, map, width, height);
    for (const { kind, polygon_m } of this.zones) {
      const points = polygon_m.map((point) => this.point(placeOf(map, point)));
      drawZone(g, kind, points, ink, { width, height });
    }
    if (this.tool) this.drawSketch(g, this.tool, ink, { width, height });
    this.robots.forEach((point, i) => {
      const hue = i % FAMILIES;
      const aboard = Array.from({ length: this.rovers }, (_none, k) => colour(`family-${hue}-${(k % SHADES) + 1}`));
      const own = colour(`family-${hue}-0`);
      vehicle(g, ...this.point(placeOf(map, point)), ROBOT, 0, own, this.rovers, aboard, ink);
    });
  }

  /** @type {(zone: NamedZone) => HTMLElement} */
  removeButton(zone) {
    return button(`Remove ${zone.name}`, `${zone.name} ×`, () => {
      this.zones = this.zones.filter((one) => one !== zone);
      this.changed();
    });
  }

  /** @type {(g: Context, map: MapPreview, width: number, height: number) => void} */
  drawMap(g, map, width, height) {
    this.scale = Math.min((width - 2 * MARGIN) / map.width, (height - 2 * MARGIN) / map.height);
    const coarse = Math.max(1, Math.floor(1 / this.scale / (window.devicePixelRatio || 1)));
    if (coarse !== this.coarse) this.painted = null;
    this.coarse = coarse;
    this.painted ??= painted(map, classColour, coarse);
    this.left = (width - map.width * this.scale) / 2;
    this.top = (height + map.height * this.scale) / 2;
    g.imageSmoothingEnabled = this.scale < 1;
    const pixel = coarse * this.scale;
    const top = this.top - map.height * this.scale;
    g.drawImage(this.painted, this.left, top, this.painted.width * pixel, this.painted.height * pixel);
  }

  /** @type {(g: Context, kind: ZoneKind, ink: Ink, size: Size) => void} */
  drawSketch(g, kind, ink, size) {
    const points = this.corners.map((corner) => this.point(corner));
    if (points.length) drawZone(g, kind, points, ink, size);
    g.fillStyle = ink.ink;
    for (const [x, y] of points) g.fillRect(x - 3, y - 3, 6, 6);
    setText(this.hint, points.length < 3 ? "click its corners on the map" : "click the first corner again to close it");
  }
}

/** The signs of the classes that a map has.
    @type {(map: MapPreview) => HTMLElement[]} */
function classSigns({ runs }) {
  const codes = codesOf(runs).filter((code) => code in CLASSES);
  return codes
    .sort((a, b) => a - b)
    .map((code) => {
      const swatch = make("span", { class: "swatch", style: `background: ${classColour(code)}` });
      return make("li", {}, swatch, CLASSES[code].text);
    });
}
