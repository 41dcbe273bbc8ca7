/* What stands on the map and in the legend: the same functions draw both. Colours come as `ink` (colours.js). */

/** A carrier: a vehicle seen from above, with a seat for each rover it has room for. `aboard`: colours of those there.
    @type {(g: Context, x: number, y: number, r: number, heading: number, colour: string, capacity: number,
      aboard: string[], ink: Ink) => void} */
export function vehicle(g, x, y, r, heading, colour, capacity, aboard, ink) {
  g.save();
  g.translate(x, y);
  g.rotate(-heading);
  g.beginPath();
  g.roundRect(-1.15 * r, -0.88 * r, 2.3 * r, 1.76 * r, 0.42 * r);
  outlined(g, colour, ink);
  g.beginPath();
  g.moveTo(0.78 * r, -0.5 * r);
  g.lineTo(1.02 * r, 0);
  g.lineTo(0.78 * r, 0.5 * r);
  g.lineWidth = Math.max(1.2, 0.14 * r);
  g.strokeStyle = ink.page;
  g.stroke();
  seats(g, r, Math.max(capacity, aboard.length), aboard);
  g.restore();
}

/** @type {(g: Context, r: number, count: number, aboard: string[]) => void} */
function seats(g, r, count, aboard) {
  const rows = count > 2 ? 2 : 1,
    columns = Math.ceil(count / rows),
    size = Math.min(0.42 * r, (0.8 * r) / columns);
  for (let k = 0; k < count; k++) {
    const x = -0.18 * r + (columns === 1 ? 0 : (Math.floor(k / rows) / (columns - 1) - 0.5) * (1.6 * r - 2 * size));
    const y = rows === 1 ? 0 : ((k % 2) - 0.5) * 0.84 * r;
    g.beginPath();
    g.arc(x, y, size, 0, 7);
    g.fillStyle = k < aboard.length ? aboard[k] : "#0004";
    g.fill();
    g.lineWidth = k < aboard.length ? Math.max(1, 0.12 * r) : 1;
    g.strokeStyle = k < aboard.length ? "#fff" : "#fff9";
    g.stroke();
  }
}

/** A rover: a small arrowhead that points where it goes.
    @type {(g: Context, x: number, y: number, r: number, heading: number, colour: string, ink: Ink) => void} */
export function rover(g, x, y, r, heading, colour, ink) {
  g.save();
  g.translate(x, y);
  g.rotate(-heading);
  g.beginPath();
  g.moveTo(1.3 * r, 0);
  g.lineTo(-0.9 * r, 0.95 * r);
  g.lineTo(-0.5 * r, 0);
  g.lineTo(-0.9 * r, -0.95 * r);
  g.closePath();
  outlined(g, colour, ink);
  g.restore();
}

/** @type {(g: Context, colour: string, ink: Ink) => void} */
function outlined(g, colour, ink) {
  g.lineJoin = "round";
  g.lineWidth = 4;
  g.strokeStyle = ink.page;
  g.stroke();
  g.lineWidth = 2;
  g.strokeStyle = ink.ink;
  g.stroke();
  g.fillStyle = colour;
  g.fill();
}

/** A target; filled where carriers can explore it, hollow where only rovers can.
    @type {(g: Context, x: number, y: number, r: number, ink: Ink, filled: boolean) => void} */
export function diamond(g, x, y, r, ink, filled) {
  g.beginPath();
  g.moveTo(x, y - r);
  g.lineTo(x + r, y);
  g.lineTo(x, y + r);
  g.lineTo(x - r, y);
  g.closePath();
  g.lineJoin = "round";
  g.lineWidth = 0.75 * r;
  g.strokeStyle = ink.ink;
  g.stroke();
  g.lineWidth = 0.42 * r;
  g.strokeStyle = ink.frontier;
  g.stroke();
  g.fillStyle = filled ? ink.frontier : ink.page;
  g.fill();
}

/** A meeting point: a square where the carrier stands, a dot where the rover does.
    @type {(g: Context, cx: number, cy: number, rx: number, ry: number, ink: Ink, size?: number) => void} */
export function meeting(g, cx, cy, rx, ry, ink, size = 1) {
  g.lineWidth = 1.75;
  g.strokeStyle = ink.ink;
  g.beginPath();
  g.moveTo(cx, cy);
  g.lineTo(rx, ry);
  g.stroke();
  g.fillStyle = ink.page;
  g.fillRect(cx - 4 * size, cy - 4 * size, 8 * size, 8 * size);
  g.strokeRect(cx - 4 * size, cy - 4 * size, 8 * size, 8 * size);
  g.beginPath();
  g.arc(rx, ry, 3 * size, 0, 7);
  g.fillStyle = ink.ink;
  g.fill();
}

/** A charging place: a flash.
    @type {(g: Context, x: number, y: number, r: number, ink: Ink) => void} */
export function charger(g, x, y, r, ink) {
  g.beginPath();
  for (const [dx, dy] of [
    [0.25, -1.1],
    [-0.7, 0.2],
    [-0.05, 0.2],
    [-0.25, 1.1],
    [0.7, -0.2],
    [0.05, -0.2],
  ]) {
    g.lineTo(x + dx * r, y + dy * r);
  }
  g.closePath();
  outlined(g, ink.frontier, ink);
}

/** A frontier that is left at the end.
    @type {(g: Context, x: number, y: number, ink: Ink) => void} */
export function leftover(g, x, y, ink) {
  g.beginPath();
  g.arc(x, y, 2.5, 0, 7);
  g.lineWidth = 2;
  g.strokeStyle = ink.page;
  g.stroke();
  g.fillStyle = ink.ink;
  g.fill();
}

/** Something given up: lost, blocked.
    @type {(g: Context, x: number, y: number, r: number, ink: Ink, width?: number) => void} */
export function cross(g, x, y, r, ink, width = 2) {
  for (const [wide, colour] of /** @type {[number, string][]} */ ([
    [width + 2.5, ink.page],
    [width, ink.ink],
  ])) {
    g.lineWidth = wide;
    g.strokeStyle = colour;
    g.beginPath();
    g.moveTo(x - r, y - r);
    g.lineTo(x + r, y + r);
    g.moveTo(x + r, y - r);
    g.lineTo(x - r, y + r);
    g.stroke();
  }
}

/** A robot without work: a sign for a pause.
    @type {(g: Context, x: number, y: number, ink: Ink) => void} */
export function pause(g, x, y, ink) {
  g.beginPath();
  for (const dx of [-4, 1]) g.rect(x + dx, y - 4, 3, 8);
  g.lineJoin = "round";
  g.lineWidth = 3;
  g.strokeStyle = ink.page;
  g.stroke();
  g.fillStyle = ink.ink;
  g.fill();
}

/** A line through points.
    @type {(g: Context, points: Point[], colour: string, width: number, dash?: number[]) => void} */
export function line(g, points, colour, width, dash = []) {
  g.setLineDash(dash);
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.lineJoin = g.lineCap = "round";
  g.beginPath();
  for (let i = 0; i < points.length; i++) g.lineTo(points[i][0], points[i][1]);
  g.stroke();
  g.setLineDash([]);
}

/** How opaque the lane of the chosen robot is marked. */
export const CHOSEN = 0.14;

/** Dashes of a wait, in the colour of whom a robot waits for. */
export const WAITS = [1, 4];

/** What an action is drawn as: `move` is driving.
    @type {(name: ActionName | "wait", ink: Ink) => string} */
function actionInk(name, ink) {
  return ink[name === "move" ? "drive" : name];
}

/** A bar of a lane; pale where the action was not finished, crossed where something stopped it. Picking up and setting
    down are marks.
    @type {(g: Context, x: number, y: number, wide: number, high: number, name: ActionName, end: ActionEnd | null,
      ink: Ink) => void} */
export function bar(g, x, y, wide, high, name, end, ink) {
  const whole = end === "done" || end === null,
    mark = name === "dock" || name === "undock";
  g.beginPath();
  g.roundRect(x, y, wide, high, Math.min(2.5, wide / 2));
  g.fillStyle = actionInk(mark ? "wait" : name, ink);
  g.globalAlpha = whole || mark ? 1 : 0.4;
  g.fill();
  g.globalAlpha = 1;
  if (mark ? wide >= 5 : name === "explore" && whole && wide > 3) {
    g.lineWidth = 1;
    g.strokeStyle = ink.dim;
    g.stroke();
  }
  if (mark && wide < 5) {
    g.fillStyle = ink.dim;
    g.fillRect(x + wide / 2 - 0.75, y, 1.5, high);
  } else if (mark) chevron(g, x + wide / 2, y + high / 2, Math.min(3.5, high * 0.3), name === "dock" ? 1 : -1, ink.ink);
  if (!whole && end !== "superseded") cross(g, x + wide, y + high / 2, 3, ink, 1.5);
}

/** The same, of what is only planned: pale, in a dashed line.
    @type {(g: Context, x: number, y: number, wide: number, high: number, name: ActionName, ink: Ink) => void} */
export function plannedBar(g, x, y, wide, high, name, ink) {
  const mark = name === "dock" || name === "undock";
  g.beginPath();
  g.roundRect(x, y, wide, high, Math.min(2.5, wide / 2));
  g.fillStyle = actionInk(mark ? "wait" : name, ink);
  g.globalAlpha = 0.4;
  g.fill();
  g.globalAlpha = 1;
  g.setLineDash([3, 2]);
  g.lineWidth = 1;
  g.strokeStyle = ink.dim;
  g.stroke();
  g.setLineDash([]);
  const up = name === "dock" ? 1 : -1;
  if (mark && wide >= 5) chevron(g, x + wide / 2, y + high / 2, Math.min(3.5, high * 0.3), up, ink.dim);
}

/** Up: onto the carrier. Down: set down.
    @type {(g: Context, x: number, y: number, r: number, up: number, colour: string) => void} */
function chevron(g, x, y, r, up, colour) {
  g.beginPath();
  g.moveTo(x - 1.4 * r, y + 0.7 * r * up);
  g.lineTo(x, y - 0.7 * r * up);
  g.lineTo(x + 1.4 * r, y + 0.7 * r * up);
  g.lineWidth = 1.6;
  g.strokeStyle = colour;
  g.stroke();
}
