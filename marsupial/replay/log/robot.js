/* One robot of a mission: where it was, what it did, and what is known of it, as values over time. */

import { History, lastAt } from "#log/history.js";
import { along, driving, riding, standing } from "#log/legs.js";

export class Robot {
  /** @param {PlacedRobot} placed
      @param {RobotKind} kind
      @param {number} t */
  constructor(placed, kind, t) {
    this.name = placed.name;
    this.kind = kind;
    this.carrier = kind.role === "carrier";
    this.home = placed.carrier; // the carrier that it starts aboard
    /** @type {History<Leg>} */
    this.legs = new History();
    /** @type {number[]} */
    this.driven = []; // metres before each leg
    /** @type {History<Action | null>} */
    this.actions = new History();
    /** @type {Segment[]} */
    this.segments = [];
    /** @type {number[]} */
    this.starts = []; // of the segments
    /** @type {Aboard[]} */
    this.aboard = [];
    /** @type {Segment | null} */
    this.running = null;
    /** @type {Loss[]} */
    this.losses = [];
    /** @type {Parting[]} */
    this.partings = [];
    this.speed = 1; // share of the speed of its kind
    /** @type {History<number>} */
    this.charges = new History(); // shares of its battery, as plans note them
    /** @type {Whereabouts} */
    this.where = { at: placed.cell ? standing(placed.cell) : null, carrier: placed.carrier, left: null };
    this.move(t, 0);
  }

  /** Put it somewhere from t on.
      @type {(t: number, where: Whereabouts) => void} */
  put(t, where) {
    const was = this.where;
    this.where = where;
    if (was.at === where.at && (where.at !== null || was.carrier === where.carrier)) return;
    this.move(t, this.drivenAt(t));
  }

  /** Begin a leg as it is now.
      @type {(t: number, driven: number) => void} */
  move(t, driven) {
    const { at, carrier } = this.where;
    const open = this.aboard[this.aboard.length - 1];
    if (open && open.to === null) open.to = t;
    if (at === null && carrier !== null) this.aboard.push({ start: t, to: null, carrier });
    this.legs.add(t, at ?? riding(carrier ?? ""));
    this.driven.push(driven);
  }

  /** Metres driven by t, which is not before its last leg.
      @type {(t: number) => number} */
  drivenAt(t) {
    const last = this.driven[this.driven.length - 1];
    return last + along(this.legs.last, t).length;
  }

  /** Its heading at t, which is not before its last leg.
      @type {(t: number) => number} */
  headingAt(t) {
    return along(this.legs.last, t).heading;
  }

  /** It drives from t on, at its speed.
      @type {(t: number, cell: Cell, steps: string, resolution: number) => void} */
  drive(t, cell, steps, resolution) {
    const kind = { ...this.kind, speed_mps: this.kind.speed_mps * this.speed };
    const at = driving(t, cell, steps, resolution, kind, this.headingAt(t));
    this.put(t, { at, carrier: this.where.carrier, left: null });
  }

  /** It stands from t on.
      @type {(t: number, cell: Cell) => void} */
  stand(t, cell) {
    this.put(t, { at: standing(cell, this.headingAt(t)), carrier: this.where.carrier, left: null });
  }

  /** @type {(t: number, action: Action, revision: number) => void} */
  start(t, action, revision) {
    this.finish(t, null);
    this.running = { start: t, to: null, action, revision, end: null };
    this.segments.push(this.running);
    this.starts.push(t);
    this.actions.add(t, action);
  }

  /** @type {(t: number, end: ActionEnd | null) => void} */
  finish(t, end) {
    if (this.running) Object.assign(this.running, { to: t, end });
    this.running = null;
  }

  /** Its action at t with start, end and plan; null while it has none.
      @type {(t: number) => Segment | null} */
  segmentAt(t) {
    return this.actions.at(t) && this.segments[lastAt(this.starts, t)];
  }
}
