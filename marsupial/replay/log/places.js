/* What targets and meeting points are called: T1, T2 ... and M1, M2 ... in the order in which plans first name them. */

/** The places of a mission by name. */
export class Places {
  constructor() {
    /** @type {Map<string, Place>} */
    this.byName = new Map();
    this.targets = 0;
    this.meetings = 0;
  }

  /** Enter a target that a plan names.
      @type {(thing: Target, t: number) => void} */
  enterTarget(thing, t) {
    const known = this.byName.get(thing.name);
    if (known) known.thing = thing;
    else this.byName.set(thing.name, { kind: "target", thing, label: `T${++this.targets}`, since: t });
  }

  /** The same of a meeting point.
      @type {(thing: Meeting, t: number) => void} */
  enterMeeting(thing, t) {
    const known = this.byName.get(thing.name);
    if (known) known.thing = thing;
    else this.byName.set(thing.name, { kind: "meeting", thing, label: `M${++this.meetings}`, since: t });
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
