/* Names on the map, each beside its thing where it covers no other name and no robot. */

const HIGH = 15;
export const FONT = "system-ui, 'DejaVu Sans', sans-serif";
export const BOLD = `600 11px ${FONT}`;
const PLAIN = `10.5px ${FONT}`;
/** @type {Map<string, number>} */
const widths = new Map(); // of names in bold and plain, which every picture needs

/** @type {(g: Context, name: string) => number} */
function widthOf(g, name) {
  const key = `${g.font} ${name}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  const { width } = g.measureText(name);
  widths.set(key, width);
  return width;
}

export class Labels {
  /** @param {Context} g
      @param {Ink} ink
      @param {{ size: Size, covers: Box[] }} canvas */
  constructor(g, ink, { size, covers }) {
    this.g = g;
    this.ink = ink;
    this.size = size;
    this.taken = [...covers];
  }

  /** No name shall lie on what is within r of a point.
      @type {(x: number, y: number, r: number) => void} */
  keepFree(x, y, r) {
    this.taken.push([x - r, y - r, 2 * r, 2 * r]);
  }

  /** Write a name, a `strong` one in bold, beside a point where there is room; else it is left out.
      @type {(name: string, x: number, y: number, r: number, strong: boolean) => void} */
  write(name, x, y, r, strong) {
    const { g, size } = this;
    if (x < -20 || y < -20 || x > size.width + 20 || y > size.height + 20) return;
    g.font = strong ? BOLD : PLAIN;
    const wide = widthOf(g, name) + 6;
    const spot = spotsAround(x, y, r, wide).find(([left, top]) => this.isFree(left, top, wide));
    if (!spot) return;
    const [left, top] = spot;
    this.taken.push([left, top, wide, HIGH]);
    g.globalAlpha = strong ? 0.88 : 0.7;
    g.fillStyle = this.ink.card;
    g.beginPath();
    g.roundRect(left, top, wide, HIGH, 4);
    g.fill();
    g.globalAlpha = 1;
    g.fillStyle = this.ink.ink;
    g.textBaseline = "middle";
    g.fillText(name, left + 3, top + HIGH / 2 + 0.5);
  }

  /** Whether a name of this width fits there.
      @type {(left: number, top: number, wide: number) => boolean} */
  isFree(left, top, wide) {
    const { width, height } = this.size;
    if (left < 2 || left + wide > width - 2 || top < 2 || top + HIGH > height - 2) return false;
    return this.taken.every(([l, t, w, h]) => left >= l + w || left + wide <= l || top >= t + h || top + HIGH <= t);
  }
}

/** The upper left corners for a name beside a point, best first.
    @type {(x: number, y: number, r: number, wide: number) => Point[]} */
function spotsAround(x, y, r, wide) {
  const gap = r + 3;
  return [
    [x + gap, y - HIGH / 2],
    [x + gap - 2, y - r - HIGH],
    [x + gap - 2, y + r],
    [x - gap - wide, y - HIGH / 2],
    [x - wide / 2, y - gap - HIGH],
    [x - wide / 2, y + gap],
    [x - gap + 2 - wide, y - r - HIGH],
    [x - gap + 2 - wide, y + r],
  ];
}

/** As much of a text as there is room for.
    @type {(g: Context, text: string, room: number) => string} */
export function cut(g, text, room) {
  if (g.measureText(text).width <= room) return text;
  let short = text;
  while (short && g.measureText(`${short}…`).width > room) short = short.slice(0, -1);
  return short ? `${short}…` : "";
}
