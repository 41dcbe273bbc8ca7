/* What targets and meeting points are called: T1, T2 ... and M1, M2 ... in the order in which plans first name them.

   The log calls them after their cells (t_209_27), and otherwise once the frame has grown: here they keep one name. */

/** How many of the numbers in a name are of cells. */
const NUMBERS = new Map([
  ["t", 2],
  ["m", 4],
  ["charge", 2],
]);

/** The name of a target, meeting point or charging place in the log, as it was in the first frame of the mission.
    @type {(name: string, shift: Cell) => string} */
export function firstName(name, shift) {
  const match = shift[0] || shift[1] ? /^(t|m|charge)_(-?\d+(?:_-?\d+)+)(.*)$/.exec(name) : null;
  if (!match) return name;
  const [, kind, numbers, rest] = match;
  const cells = NUMBERS.get(kind) ?? 0;
  const moved = numbers.split("_").map((n, i) => (i < cells ? Number(n) - shift[i % 2] : n));
  return [kind, ...moved].join("_") + rest;
}

/** The places of a mission by their first names. */
export class Places {
  constructor() {
    /** @type {Map<string, Place>} */
    this.byName = new Map();
    this.targets = 0;
    this.meetings = 0;
  }

  /** Enter a target that a plan names; `logged` is its name in the log at this time.
      @type {(thing: Target, t: number, logged: string) => void} */
  enterTarget(thing, t, logged) {
    const known = this.byName.get(thing.name);
    if (known) known.thing = thing;
    else this.byName.set(thing.name, { kind: "target", thing, label: `T${++this.targets}`, since: t, logged });
  }

  /** The same of a meeting point.
      @type {(thing: Meeting, t: number, logged: string) => void} */
  enterMeeting(thing, t, logged) {
    const known = this.byName.get(thing.name);
    if (known) known.thing = thing;
    else this.byName.set(thing.name, { kind: "meeting", thing, label: `M${++this.meetings}`, since: t, logged });
  }

  /** @type {(name: string) => Place | null} */
  get(name) {
    return this.byName.get(name) || null;
  }

  /** The short name of a meeting point where rovers stand on a cell, or undefined.
      @type {(cell: Cell) => string | undefined} */
  meetingAt([x, y]) {
    /** @type {(place: Place) => boolean} */
    const isThere = (place) =>
      place.kind === "meeting" && place.thing.rover_cell[0] === x && place.thing.rover_cell[1] === y;
    return [...this.byName.values()].find(isThere)?.label;
  }

  /** The short name of a place: T12, M4; the start of a robot in words.
      @type {(name: string) => string} */
  label(name) {
    const place = this.byName.get(name);
    if (place) return place.label;
    if (name.startsWith("charge_")) return "a charging place";
    const start = /^([sh])_(.+)$/.exec(name);
    if (start) return start[1] === "s" ? "where it was" : "home";
    return name;
  }
}
