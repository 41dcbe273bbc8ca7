/* What targets and meeting points are called: T1, T2 ... and M1, M2 ... in the order in which plans first name them.

   The log calls them after their cells (t_209_27), and otherwise once the frame has grown: here they keep one name. */

const NUMBERS = { t: 2, m: 4, charge: 2 };

/** The name of a target, meeting point or charging place in the log, as it was in the first frame of the mission. */
export function firstName(name, [dx, dy]) {
  const match = dx || dy ? /^(t|m|charge)_(-?\d+(?:_-?\d+)+)(.*)$/.exec(name) : null;
  if (!match) return name;
  const numbers = match[2].split("_").map(Number);
  return [match[1], ...numbers.map((n, i) => (i < NUMBERS[match[1]] ? n - [dx, dy][i % 2] : n))].join("_") + match[3];
}

/** The places of a mission by their first names. */
export class Places {
  constructor() {
    this.byName = new Map();
    this.counts = { target: 0, meeting: 0 };
  }

  /** Enter a place that a plan names; `thing` holds its cells, `logged` is its name in the log at this time. */
  enter(kind, thing, t, logged) {
    const known = this.byName.get(thing.name);
    if (known) {
      known.thing = thing;
      return known;
    }
    const number = ++this.counts[kind];
    const place = {
      kind,
      number,
      label: `${kind === "target" ? "T" : "M"}${number}`,
      thing,
      since: t,
      logged,
      gone: null,
      seenBy: null,
    };
    this.byName.set(thing.name, place);
    return place;
  }

  get(name) {
    return this.byName.get(name) || null;
  }

  /** The short name of a meeting point where rovers stand on a cell, or undefined. */
  meetingAt([x, y]) {
    return [...this.byName.values()].find(({ thing: { rover_cell: at } }) => at && at[0] === x && at[1] === y)?.label;
  }

  /** The short name of a place: T12, M4; the start of a robot in words. */
  label(name) {
    const place = this.byName.get(name);
    if (place) return place.label;
    if (name.startsWith("charge_")) return "a charging place";
    const start = /^([sh])_(.+)$/.exec(name);
    if (start) return start[1] === "s" ? "where it was" : "home";
    return name;
  }
}
