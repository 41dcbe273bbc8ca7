/* Names on the map, each beside its thing where it covers no other name and no robot. */

const HIGH = 15;
export const BOLD = "600 11px system-ui, 'DejaVu Sans', sans-serif";
const PLAIN = "10.5px system-ui, 'DejaVu Sans', sans-serif";
const widths = new Map(); // of names in bold and plain, which every picture needs

function widthOf(g, name) {
  const key = `${g.font} ${name}`;
  if (!widths.has(key)) widths.set(key, g.measureText(name).width);
  return widths.get(key);
}

export class Labels {
  constructor(g, ink, { size, covers }) {
    Object.assign(this, { g, ink, size, taken: [...covers] });
  } // boxes: left, top, width, height

  /** No name shall lie on what is within r of a point. */
  keepFree(x, y, r) {
    this.taken.push([x - r, y - r, 2 * r, 2 * r]);
  }

  /** Write a name, a `strong` one in bold, beside a point where there is room; else it is left out. */
  write(name, x, y, r, strong) {
    const { g, size } = this;
    if (x < -20 || y < -20 || x > size.width + 20 || y > size.height + 20) return;
    g.font = strong ? BOLD : PLAIN;
    const wide = widthOf(g, name) + 6,
      gap = r + 3;
    const spots = [
      [x + gap, y - HIGH / 2],
      [x + gap - 2, y - r - HIGH],
      [x + gap - 2, y + r],
      [x - gap - wide, y - HIGH / 2],
      [x - wide / 2, y - gap - HIGH],
      [x - wide / 2, y + gap],
      [x - gap + 2 - wide, y - r - HIGH],
      [x - gap + 2 - wide, y + r],
    ];
    const clear = ([left, top]) =>
      this.taken.every(([l, t, w, h]) => left >= l + w || left + wide <= l || top >= t + h || top + HIGH <= t);
    const free = (spot) =>
      spot[0] >= 2 &&
      spot[0] + wide <= size.width - 2 &&
      spot[1] >= 2 &&
      spot[1] + HIGH <= size.height - 2 &&
      clear(spot);
    const spot = spots.find(free);
    if (!spot) return;
    this.taken.push([spot[0], spot[1], wide, HIGH]);
    g.globalAlpha = strong ? 0.88 : 0.7;
    g.fillStyle = this.ink.card;
    g.beginPath();
    g.roundRect(spot[0], spot[1], wide, HIGH, 4);
    g.fill();
    g.globalAlpha = 1;
    g.fillStyle = this.ink.ink;
    g.textBaseline = "middle";
    g.fillText(name, spot[0] + 3, spot[1] + HIGH / 2 + 0.5);
  }
}
