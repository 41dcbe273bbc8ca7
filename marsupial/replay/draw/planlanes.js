/* The plan of a moment in the lanes: pale bars to its end, who waits for whom, and who meets whom. */

import { ahead, planEnd } from "#log/ahead.js";
import { colourOf } from "#draw/colours.js";
import { BOLD } from "#draw/labels.js";
import { line, plannedBar, WAITS } from "#draw/shapes.js";
import { waitAt } from "#log/waits.js";
import { clock, lasting } from "#text/format.js";

/** Draw the plans that `lanes` shows, in the place of what came later.
    @type {(g: Context, lanes: Lanes) => void} */
export function drawPlans(g, lanes) {
  g.save();
  g.beginPath();
  g.rect(lanes.gutter, 0, lanes.right - lanes.gutter, lanes.bottom);
  g.clip();
  lanes.missions.forEach((mission, i) => {
    const plan = lanes.planned(mission);
    const rows = lanes.rows.filter((row) => row.i === i);
    if (!plan || !rows.length) return;
    for (const row of rows) hide(g, lanes, row);
    for (const row of rows) drawRow(g, lanes, plan, row);
    drawEnd(g, lanes, plan, rows);
  });
  g.restore();
}

/** Hide what came later: a plan is read alone.
    @type {(g: Context, lanes: Lanes, row: Row) => void} */
function hide(g, lanes, { top }) {
  const x = lanes.x(lanes.t);
  g.fillStyle = lanes.ink.card;
  g.fillRect(x, top + 1, Math.max(0, lanes.right - x), lanes.lane - 1);
}

/** @type {(g: Context, lanes: Lanes, plan: Plan, row: Row) => void} */
function drawRow(g, lanes, plan, row) {
  const { mission, robot, top } = row;
  const { lane, ink, t } = lanes;
  const gap = lane > 10 ? 2 : 1;
  const isWritten = drawUntilNow(g, lanes, row);
  for (const { action, to, wait } of ahead(plan, robot, t)) {
    const x = lanes.x(Math.max(action.start_ms, t));
    const wide = Math.max(1, lanes.x(to) - x - 0.5);
    const left = x + 3;
    plannedBar(g, x, top + gap, wide, lane - 2 * gap, action.name, ink);
    if (action.carrier === null) {
      const text = isWritten && action.start_ms < t ? "" : mission.places.label(action.place);
      lanes.writeIn(g, left, x + wide - left - 3, top, text, ink.ink);
    } else if (robot.carrier) tie(g, lanes, row, action, x);
    if (wait) drawWait(g, lanes, row, { ...wait, start: wait.from, to: action.start_ms }, Math.max(wait.from, t));
  }
}

/** Draw again what goes on at the moment, up to it, so that its words end there. Returns whether they have room.
    @type {(g: Context, lanes: Lanes, row: Row) => boolean} */
function drawUntilNow(g, lanes, row) {
  const { t } = lanes;
  const segment = row.robot.segmentAt(t);
  const wait = waitAt(row.waits, t);
  const start = segment?.start ?? wait?.start;
  if (start === undefined) return false;
  const x = lanes.x(start);
  g.fillStyle = lanes.ink.card;
  g.fillRect(x, row.top + 1, lanes.x(t) - x, lanes.lane - 1);
  if (segment) return lanes.drawSegment(g, row.mission, { ...segment, to: t, end: null }, row.top);
  if (wait) drawWait(g, lanes, row, { ...wait, to: t }, start);
  return false;
}

/** Tie a carrier to the rover that it picks up or sets down.
    @type {(g: Context, lanes: Lanes, row: Row, action: Action, x: number) => void} */
function tie(g, { rows, lane, ink }, { mission, top }, action, x) {
  const other = rows.find((row) => row.mission === mission && row.robot.name === action.robot);
  if (other) {
    line(
      g,
      [
        [x, top + lane / 2],
        [x, other.top + lane / 2],
      ],
      ink.dim,
      1.25,
    );
  }
}

/** A wait, from a moment on, in the colour of the one who is waited for; with its words where these have room.
    @type {(g: Context, lanes: Lanes, row: { i: number, top: number }, wait: Wait, from: number) => void} */
export function drawWait(g, lanes, { i, top }, { start, to, partner }, from) {
  const { ink } = lanes;
  const left = Math.max(lanes.gutter, lanes.x(from)) + 3;
  const right = lanes.x(to) - 2;
  const middle = top + lanes.lane / 2;
  const time = lasting(start, to);
  const short = `waits ${time}`;
  const text = partner ? `waits for ${partner}, ${time}` : short;
  const written = [text, short].reduce(
    (wide, one) => wide || lanes.writeIn(g, left, right - left - 4, top, one, ink.ink),
    0,
  );
  if (left + written >= right) return;
  line(
    g,
    [
      [left + written, middle],
      [right, middle],
    ],
    partner ? colourOf(lanes.colours[i], partner) : ink.dim,
    2,
    WAITS,
  );
}

/** Mark when all of the plan is done.
    @type {(g: Context, lanes: Lanes, plan: Plan, rows: Row[]) => void} */
function drawEnd(g, lanes, plan, rows) {
  const { ink } = lanes;
  const top = lanes.heads.find(({ i }) => i === rows[0].i)?.top ?? 0;
  const end = planEnd(plan);
  const isSeen = lanes.x(end) <= lanes.right;
  const x = Math.min(lanes.right, lanes.x(end));
  if (isSeen) {
    line(
      g,
      [
        [x, top],
        [x, rows[rows.length - 1].top + lanes.lane],
      ],
      ink.dim,
      1.5,
      [4, 3],
    );
  }
  const text = `plan until ${clock(end)}${isSeen ? "" : " →"}`;
  g.font = BOLD;
  g.textBaseline = "alphabetic";
  const isLeft = x - g.measureText(text).width - 4 >= lanes.gutter;
  g.textAlign = isLeft ? "right" : "left";
  g.lineWidth = 3;
  g.strokeStyle = ink.card;
  g.strokeText(text, isLeft ? x - 4 : x + 4, top + 12);
  g.fillStyle = ink.ink;
  g.fillText(text, isLeft ? x - 4 : x + 4, top + 12);
  g.textAlign = "left";
}
