/* How figures are written, everywhere on the page: one rounding for each quantity. */

/** Milliseconds as m:ss or h:mm:ss, or with tenths; rounded as `marsupial.wording` does.
    @type {(ms: number, tenths?: boolean) => string} */
export function clock(ms, tenths = false) {
  const whole = tenths ? Math.round(ms / 100) / 10 : Math.round(ms / 1000);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  const rest = whole - 3600 * hours - 60 * minutes;
  const text = (tenths ? rest.toFixed(1) : String(rest)).padStart(tenths ? 4 : 2, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${text}` : `${minutes}:${text}`;
}

/** The time between two moments, as the two are written.
    @type {(start: number, to: number) => string} */
export function lasting(start, to) {
  return clock(1000 * (Math.round(to / 1000) - Math.round(start / 1000)));
}

const TICKS = [100, 200, 500, 1e3, 2e3, 5e3, 1e4, 15e3, 3e4, 6e4, 12e4, 3e5, 6e5, 12e5, 18e5, 36e5, 72e5, 144e5];

/** How many ms lie between the marks of an axis of time: of `span` ms on `wide` points, marks at least `apart` points
    apart.
    @type {(span: number, wide: number, apart: number) => number} */
export function tickStep(span, wide, apart) {
  return TICKS.find((one) => (one / span) * wide >= apart) || 288e5;
}

/** A quantity with a tenth below 100 and whole from there on; in thousands parted by a thin space.
    @type {(value: number) => string} */
export function amount(value) {
  if (Math.abs(value) < 99.95) return value.toFixed(1);
  return value.toFixed(0).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

/** @type {(value: number) => string} */
export function metres(value) {
  return `${amount(value)} m`;
}

/** @type {(value: number) => string} */
export function area(value) {
  return `${amount(value)} m²`;
}

/** Joules as kJ.
    @type {(value: number) => string} */
export function energy(value) {
  return `${amount(value / 1000)} kJ`;
}

/** A share of one; 100 % only where it is all.
    @type {(value: number) => string} */
export function share(value) {
  return value >= 1 ? "100 %" : `${Math.min(99.9, 100 * value).toFixed(1)} %`;
}

/** Milliseconds that something took, in seconds.
    @type {(ms: number) => string} */
export function seconds(ms) {
  return `${(ms / 1000).toFixed(1)} s`;
}

/** A point in metres.
    @type {(point: Point) => string} */
export function point([x, y]) {
  return `(${x.toFixed(2)}, ${y.toFixed(2)}) m`;
}

/** @type {(n: number, word: string) => string} */
export function count(n, word) {
  return `${n} ${word}${n === 1 ? "" : "s"}`;
}

/** Names as in a sentence: a, b and c.
    @type {(names: string[]) => string} */
export function listed(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}
