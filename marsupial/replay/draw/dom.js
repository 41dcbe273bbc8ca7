/* Elements of the page, made where they are needed. */

const SVG = "http://www.w3.org/2000/svg";

/** Make an element. Attributes by name; `text` and `title` as they are; what begins with `on` listens.
    @template {keyof HTMLElementTagNameMap} K
    @param {K} tag
    @param {Attributes} attributes
    @param {(Node | string)[]} children */
export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name.slice(2), value);
    else if (value === false || value === null || value === undefined) continue;
    else if (name === "text") made.textContent = String(value);
    // as an attribute, the policy of the live page forbids it
    else if (name === "style") made.style.cssText = String(value);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children);
  return made;
}

/** A picture of 16 by 16 from one path.
    @type {(path: string) => SVGElement} */
export function icon(path) {
  const made = document.createElementNS(SVG, "svg");
  made.setAttribute("viewBox", "0 0 16 16");
  made.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS(SVG, "path");
  shape.setAttribute("d", path);
  made.append(shape);
  return made;
}

/** A button with a picture or a word.
    @type {(name: string, face: Node | string, onclick: () => void, more?: Attributes) => HTMLButtonElement} */
export function button(name, face, onclick, more = {}) {
  return make("button", { type: "button", "aria-label": name, title: name, onclick, ...more }, face);
}

/** What stands on the page where there is nothing to show: why, and the way home.
    @type {(why: string) => HTMLElement} */
export function nothing(why) {
  const home = make("a", { href: "#/", text: "All missions and jobs" });
  return make("main", { class: "notice" }, make("h1", { text: why }), home);
}

/** Write a text only where it is another one: writing is what costs.
    @type {(node: Node, text: string) => void} */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** @type {(canvas: HTMLCanvasElement, settings?: CanvasRenderingContext2DSettings) => Context} */
export function contextOf(canvas, settings) {
  const g = canvas.getContext("2d", settings);
  if (!g) throw new Error("this browser draws nothing on canvases");
  return g;
}

/** Fit a canvas to its element at the screen's resolution. Returns its context, in units of the page.
    @type {(canvas: HTMLCanvasElement, width: number, height: number) => Context} */
export function fitted(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const wide = Math.max(1, Math.round(width * ratio));
  const high = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== wide) canvas.width = wide;
  if (canvas.height !== high) canvas.height = high;
  const g = contextOf(canvas);
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return g;
}
