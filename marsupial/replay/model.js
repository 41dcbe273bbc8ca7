/* The mission as data: who is where, doing what, and what is known, at any moment. Touches no page.

   Who is on whom and what everybody does is told by TEAM, which stands in the page: by robot its `legs`, each from when
   and either the carrier it is aboard or the number of the event that says where it drives or stands, and its `actions`,
   each the number of the event that starts it, until when, and how it ends (null where the log does not say). */

const UNKNOWN = 255;
const STEPS = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
const MOST_KEYFRAMES = 16;
const DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
const ALIKE = 1;

/** The events of a log: looks one by one with their runs of cells, and all of each plan, all in the last frame. */
function readLog(text) {
  const lines = text.split("\n").filter((line) => line.trim()).map((line) => JSON.parse(line));
  const before = { targets: new Map(), meetings: new Map() };
  let width = lines[0].width;
  for (const line of lines) {
    if (line.event === "frame") width = line.width;
    if (line.looks) for (const look of line.looks) look.push(readRuns(readNumbers(look[2]), width));
    if (line.event !== "plan") continue;
    for (const [part, known] of Object.entries(before)) {
      line[part] = line[part].map((thing) => (typeof thing === "string" ? known.get(thing) : thing));
      before[part] = new Map(line[part].map((thing) => [thing.name, thing]));
    }
  }
  return intoLastFrame(lines).flatMap((line) => (!line.looks ? [line] : line.looks.map(([robot, after, , runs]) => (
    { event: line.event, t_ms: line.t_ms + after, robot, runs }))));
}

/** Lines without those that tell that the frame has grown, as if it had been the last one from the start. */
function intoLastFrame(lines) {
  const frames = lines.filter((line) => line.event === "frame"), moved = new Set();
  if (frames.length === 0) return lines;
  const last = frames[frames.length - 1], start = lines[0];
  let [dx, dy] = frames.reduce(([x, y], { shift }) => [x + shift[0], y + shift[1]], [0, 0]), width = start.width;
  const cell = (of, key) => {
    if (of && of[key] && !moved.has(of[key])) { of[key] = [of[key][0] + dx, of[key][1] + dy]; moved.add(of[key]); }
  };
  const name = (of, key) => { if (of && of[key]) of[key] = movedName(of[key], [dx, dy]); };
  const thing = (one) => {
    if (moved.has(one)) return;
    moved.add(one);
    ["cell", "carrier_cell", "rover_cell"].forEach((key) => cell(one, key));
    ["name", "place", "origin"].forEach((key) => (key !== "name" || !one.robot) && name(one, key));
  };
  for (const line of lines) {
    if (line.event === "frame") { dx -= line.shift[0]; dy -= line.shift[1]; width = line.width; continue; }
    cell(line, "cell");
    for (const one of [...(line.robots || []), ...(line.remaining || [])]) cell(one, "cell");
    for (const part of ["targets", "meetings", "actions"]) (line[part] || []).forEach(thing);
    if (line.action) thing(line.action);
    for (const look of line.looks || []) look[3] = movedRuns(look[3], width, last.width, dx, dy);
  }
  Object.assign(start, { width: last.width, height: last.height, origin_m: last.origin_m });
  return lines.filter((line) => line.event !== "frame");
}

/** What a target or meeting point, called after its cells, is called now. */
function movedName(name, by) {
  const match = /^([tm])((?:_-?\d+)+)(.*)$/.exec(name);
  if (!match) return name;
  const numbers = match[2].slice(1).split("_").map(Number), count = match[1] === "t" ? 2 : 4;
  return [match[1], ...numbers.map((number, i) => (i < count ? number + by[i % 2] : number))].join("_") + match[3];
}

/** Runs of cells in a frame that has grown; one over the end of a row becomes several. */
function movedRuns(runs, width, wider, dx, dy) {
  const found = [];
  for (let i = 0; i < runs.length; i += 3) {
    for (let at = runs[i], end = at + runs[i + 1]; at < end;) {
      const y = Math.floor(at / width), stop = Math.min(end, (y + 1) * width);
      found.push((y + dy) * wider + at - y * width + dx, stop - at, runs[i + 2]);
      at = stop;
    }
  }
  return found;
}

/** The whole numbers of a text of digits of base 64, five bits each from the lowest on. */
function readNumbers(text) {
  const numbers = [];
  let number = 0, weight = 1;
  for (const digit of text) {
    const value = DIGITS.indexOf(digit);
    number += (value & 31) * weight;
    if (value & 32) weight *= 32;
    else { numbers.push(number); number = 0; weight = 1; }
  }
  return numbers;
}

/** Runs of cells as start, length and terrain code, from the numbers of strips (docs/mission-log.md). */
function readRuns(numbers, width) {
  const runs = [], signed = (n) => (n % 2 ? -(n + 1) / 2 : n / 2);
  for (let at = 0; at < numbers.length;) {
    const code = numbers[at++];
    for (let left = numbers[at++], row = 0, column = 0; left > 0; left--) {
      const above = numbers[at++];
      row += Math.floor(above / 2);
      column += signed(numbers[at++]);
      let cells = above % 2 ? 1 : numbers[at++] + 1, y = row, x = column;
      runs.push(y * width + x, cells, code);
      for (let step = above % 2 ? 0 : numbers[at++]; step > 0; step = numbers[at++]) {
        const again = step === ALIKE ? numbers[at++] + 1 : 1;
        if (step > ALIKE) {
          const root = Math.floor(Math.sqrt(step - ALIKE)), rest = step - ALIKE - root * root;
          x += signed(rest < root ? rest : root);
          cells += signed(rest < root ? root : rest - root);
        }
        for (let i = 0; i < again; i++) runs.push(++y * width + x, cells, code);
      }
    }
  }
  return runs;
}

/** Index of the last of the growing `times` that is not after t, or -1. */
function lastAt(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** Values that hold from a moment on, added in order of time. */
class History {
  constructor() { this.times = []; this.values = []; }
  add(t, value) { this.times.push(t); this.values.push(value); }
  index(t) { return lastAt(this.times, t); }
  at(t) { const i = this.index(t); return i < 0 ? null : this.values[i]; }
}

class Mission {
  constructor(events, team = TEAM) {
    const start = events[0], last = events[events.length - 1];
    this.start = start;
    this.width = start.width;
    this.height = start.height;
    this.resolution = start.resolution_m;
    this.from = start.t_ms;
    this.to = Math.max(last.t_ms, this.from + 1);
    this.ended = last.event === "ended" ? last : null;
    this.plans = events.filter((event) => event.event === "plan");
    this.planTimes = this.plans.map((plan) => plan.t_ms);
    this.places = new Map();
    this.robots = start.robots.map((placed) => this.newRobot(placed, events, team[placed.name]));
    this.byName = new Map(this.robots.map((robot) => [robot.name, robot]));
    for (const event of events) {
      if (event.event === "start") this.places.set(`${event.action.robot} ${event.action.place}`, event.cell);
      if (event.event === "lost") this.byName.get(event.robot).lost = event;
    }
    for (const robot of this.robots) this.measure(robot);
    this.reveals = packReveals(events.filter((event) => event.event === "reveal" || event.event === "change"), this);
  }

  newRobot(placed, events, told) {
    const kind = this.start.types.find((type) => type.name === placed.type);
    const robot = {
      name: placed.name, kind, carrier: kind.role === "carrier", legs: new History(), actions: new History(),
      segments: [], lost: null, home: placed.carrier,
    };
    for (const [t, where] of told.legs) {
      if (typeof where === "string") robot.legs.add(t, { aboard: where });
      else if (events[where].event === "drive") robot.legs.add(t, driving(events[where], this.resolution, kind));
      else robot.legs.add(t, standing(events[where].cell || placed.cell));
    }
    for (const [number, to, end] of told.actions) {
      const { t_ms: start, action, revision } = events[number];
      robot.segments.push({ start, to, action, revision, end });
      robot.actions.add(start, action);
      if (end !== null) robot.actions.add(to, null);
    }
    return robot;
  }

  /** Note how far a robot had driven when each of its legs began, and when it was aboard whom. */
  measure(robot) {
    let driven = 0;
    robot.driven = robot.legs.values.map((leg, i) => {
      const before = driven;
      const until = i + 1 < robot.legs.times.length ? robot.legs.times[i + 1] : Infinity;
      if (leg.times) driven += along(leg, until).length;
      return before;
    });
    robot.aboard = [];
    robot.legs.values.forEach((leg, i) => {
      if (!leg.aboard) return;
      const to = i + 1 < robot.legs.times.length ? robot.legs.times[i + 1] : this.to;
      robot.aboard.push({ start: robot.legs.times[i], to, carrier: leg.aboard });
    });
  }

  /** Everything about a robot at t: cell position, carrier, action, metres driven, whether it is lost. */
  view(robot, t) {
    const i = robot.legs.index(t), leg = robot.legs.values[i];
    const carrier = leg.aboard ? this.byName.get(leg.aboard) : null;
    const point = along(carrier ? carrier.legs.at(t) : leg, t);
    return {
      robot, carrier, x: point.x, y: point.y, leg, action: robot.actions.at(t),
      driven: robot.driven[i] + (leg.times ? point.length : 0),
      lost: robot.lost !== null && t >= robot.lost.t_ms,
    };
  }

  views(t) { return this.robots.map((robot) => this.view(robot, t)); }

  planIndex(t) { return lastAt(this.planTimes, t); }

  /** The cell where `robot` has to be at a place of a plan, or null where the log does not say. */
  placeCell(plan, place, robot) {
    const target = plan.targets.find((one) => one.name === place);
    if (target) return target.cell;
    const meeting = plan.meetings.find((one) => one.name === place);
    if (meeting) return robot.carrier ? meeting.carrier_cell : meeting.rover_cell;
    return this.places.get(`${robot.name} ${place}`) || null;
  }

  openArea(t) {
    const i = lastAt(this.reveals.coverTimes, t);
    return i < 0 ? 0 : this.reveals.cover[i] * this.resolution * this.resolution;
  }
}

function standing(cell) { return { x: cell[0], y: cell[1] }; }

function driving(event, resolution, kind) {
  const n = event.steps.length + 1;
  const leg = { times: new Float64Array(n), xs: new Int32Array(n), ys: new Int32Array(n), lengths: new Float64Array(n) };
  let straight = 0, slanted = 0;
  leg.times[0] = event.t_ms;
  [leg.xs[0], leg.ys[0]] = event.cell;
  for (let i = 1; i < n; i++) {
    const digit = event.steps.charCodeAt(i - 1) - 48;
    if (digit % 2) slanted++; else straight++;
    leg.lengths[i] = (straight + slanted * (kind.diagonal ?? Math.SQRT2)) * resolution;
    leg.times[i] = event.t_ms + Math.round(1000 * leg.lengths[i] / kind.speed_mps);
    leg.xs[i] = leg.xs[i - 1] + STEPS[digit][0];
    leg.ys[i] = leg.ys[i - 1] + STEPS[digit][1];
  }
  return leg;
}

/** Where a leg has come to at t: position, metres along it, and the index of the last cell passed. */
function along(leg, t) {
  if (!leg.times) return { x: leg.x, y: leg.y, length: 0, i: 0 };
  const i = Math.max(lastAt(leg.times, t), 0), last = leg.times.length - 1;
  if (i >= last) return { x: leg.xs[last], y: leg.ys[last], length: leg.lengths[last], i: last };
  const share = Math.max(0, (t - leg.times[i]) / (leg.times[i + 1] - leg.times[i]));
  const between = (values) => values[i] + share * (values[i + 1] - values[i]);
  return { x: between(leg.xs), y: between(leg.ys), length: between(leg.lengths), i };
}

/** All runs in one flat array, with the time and the first run of each reveal, the area known and its bounds. */
function packReveals(events, mission) {
  const count = events.reduce((sum, event) => sum + event.runs.length, 0);
  const packed = {
    runs: new Int32Array(count), times: [], ends: [], coverTimes: [mission.from], cover: [0],
    box: { left: mission.width, right: -1, low: mission.height, high: -1 },
  };
  const changes = events.some((event) => event.event === "change");
  const cells = changes ? new Uint8Array(mission.width * mission.height).fill(UNKNOWN) : null;
  const isOpen = (code) => code !== 0 && code !== UNKNOWN;
  let at = 0, open = 0;
  for (const event of events) {
    packed.runs.set(event.runs, at);
    for (const end = at + event.runs.length; at < end; at += 3) {
      const from = packed.runs[at], count = packed.runs[at + 1], code = packed.runs[at + 2];
      if (isOpen(code)) open += count;
      if (cells) {
        for (const was of cells.subarray(from, from + count)) if (isOpen(was)) open--;
        cells.fill(code, from, from + count);
      }
      stretch(packed.box, packed.runs[at], packed.runs[at + 1], mission.width);
    }
    packed.times.push(event.t_ms);
    packed.ends.push(at);
    const last = packed.coverTimes.length - 1;
    if (packed.coverTimes[last] === event.t_ms) packed.cover[last] = open;
    else { packed.coverTimes.push(event.t_ms); packed.cover.push(open); }
    event.runs = null;
  }
  return packed;
}

function stretch(box, start, length, width) {
  const end = start + length - 1, low = Math.floor(start / width), high = Math.floor(end / width);
  box.low = Math.min(box.low, low);
  box.high = Math.max(box.high, high);
  box.left = Math.min(box.left, low === high ? start % width : 0);
  box.right = Math.max(box.right, low === high ? end % width : width - 1);
}

/** The known map at a moment. Going on costs only what is new; going back starts from a copy kept on the way. */
class KnownMap {
  constructor(mission) {
    this.reveals = mission.reveals;
    this.cells = new Uint8Array(mission.width * mission.height).fill(UNKNOWN);
    this.done = 0;
    this.frames = [{ done: 0, cells: this.cells.slice() }];
    this.stride = Math.max(1, Math.ceil(this.reveals.times.length / MOST_KEYFRAMES));
  }

  /** Go to t. Returns which runs were added (offsets into reveals.runs), or `all` where the map was begun anew. */
  seek(t) {
    const wanted = lastAt(this.reveals.times, t) + 1;
    const frame = this.frames[Math.min(Math.floor(wanted / this.stride), this.frames.length - 1)];
    const all = wanted < this.done || frame.done > this.done;
    if (all) { this.cells.set(frame.cells); this.done = frame.done; }
    const from = this.offset(this.done);
    while (this.done < wanted) this.step();
    return { all, from, to: this.offset(this.done) };
  }

  offset(reveals) { return reveals === 0 ? 0 : this.reveals.ends[reveals - 1]; }

  step() {
    const { runs } = this.reveals;
    const end = this.offset(this.done + 1);
    for (let i = this.offset(this.done); i < end; i += 3) this.cells.fill(runs[i + 2], runs[i], runs[i] + runs[i + 1]);
    this.done++;
    if (this.done === this.frames.length * this.stride) this.frames.push({ done: this.done, cells: this.cells.slice() });
  }
}
