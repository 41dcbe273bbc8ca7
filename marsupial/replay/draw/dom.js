/* Elements of the page, made where they are needed. */

/** Make an element. Attributes by name; `text` and `title` as they are; what begins with `on` listens. */
export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") made.textContent = value;
    else if (name === "style") {
      made.style.cssText = value;
    } // as an attribute, the policy of the live page forbids it
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** A picture of 16 by 16 from one path. */
export function icon(path) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  made.setAttribute("viewBox", "0 0 16 16");
  made.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS("http://www.w3.org/2000/svg", "path");
  shape.setAttribute("d", path);
  made.append(shape);
  return made;
}

/** A button with a picture or a word. */
export function button(name, face, onclick, more = {}) {
  return make("button", { type: "button", "aria-label": name, title: name, onclick, ...more }, face);
}

/** What stands on the page where there is nothing to show: why, and the way home. */
export function nothing(why) {
  return make(
    "main",
    { class: "notice" },
    make("h1", { text: why }),
    make("a", { href: "#/", text: "All missions and jobs" }),
  );
}

/** Write a text only where it is another one: writing is what costs. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Fit a canvas to its element at the screen's resolution. Returns its context, in units of the page. */
export function fitted(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const wide = Math.max(1, Math.round(width * ratio)),
    high = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== wide) canvas.width = wide;
  if (canvas.height !== high) canvas.height = high;
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return g;
}
