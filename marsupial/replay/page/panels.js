/* Beside the map: the team, how the mission stands or how it ended, and the plans. */

import { looks } from "#draw/colours.js";
import { make, setText } from "#draw/dom.js";
import { changed } from "#log/ahead.js";
import { area, clock, count, energy, metres, share } from "#text/format.js";
import { prices } from "#text/compared.js";
import { newsShort } from "#text/news.js";
import { actThere, doing, ending, ofCharge, ofPlan } from "#text/why.js";

const FIGURED = new Set(["battery", "driven"]); // columns of the team with figures
const MILESTONES = [50, 90, 99]; // per cent of the reachable area
const PRICE = "Price: about the mean time until a target is reached.";
const LOW_CHARGE = 0.2; // a charge below is marked

/** Whether a mission has come to its end at t.
    @type {(mission: Mission, t: number) => boolean} */
export function isOver(mission, t) {
  return mission.ended !== null && t >= mission.to;
}

/** The state of a mission at t in a word.
    @type {(mission: Mission, t: number) => string} */
export function stateAt(mission, t) {
  return mission.ended && isOver(mission, t) ? ending(mission.ended) : "under way";
}

/** The share of the reachable area that was explored.
    @type {(end: EndedLine) => number} */
export function exploredShare({ reachable_area_m2: reachable, explored_area_m2: explored }) {
  return reachable ? explored / reachable : 1;
}

/** When half of the reachable area was known, when most and when nearly all.
    @type {(knownMs: [percent: number, ms: number | null][]) => [percent: number, ms: number | null][]} */
export function milestones(knownMs) {
  const found = new Map(knownMs);
  return MILESTONES.map((percent) => [percent, found.get(percent) ?? null]);
}

/** The same in words.
    @type {(knownMs: [percent: number, ms: number | null][]) => string} */
function knownTimes(knownMs) {
  const at = milestones(knownMs).map(([, ms]) => ms);
  if (at[0] === null) return `less than ${MILESTONES[0]} % known`;
  const times = at.map((ms) => (ms === null ? "never" : clock(ms)));
  return `${MILESTONES.join(" / ")} % known at ${times.join(" / ")}`;
}

/** A row for each robot; a click chooses it. */
export class Team {
  /** @param {Mission} mission
      @param {(robot: Robot) => void} choose */
  constructor(mission, choose) {
    this.mission = mission;
    const batteries = mission.robots.some((robot) => robot.kind.battery);
    this.rows = mission.robots.map((robot) => this.row(robot, batteries, choose));
    const columns = ["robot", "does", ...(batteries ? ["battery"] : []), "driven"];
    const heads = columns.map((text) => make("th", { scope: "col", text, class: FIGURED.has(text) ? "number" : "" }));
    this.element = make(
      "table",
      { class: `team${batteries ? " batteries" : ""}` },
      make("thead", {}, make("tr", {}, ...heads)),
      make("tbody", {}, ...this.rows.map((row) => row.row)),
    );
  }

  /** @param {Robot} robot
      @param {boolean} batteries
      @param {(robot: Robot) => void} choose */
  row(robot, batteries, choose) {
    const { name, kind } = robot;
    const { hue, shade } = looks(this.mission).get(name) ?? { hue: 0, shade: 0 };
    const style = `background: var(--family-${hue}-${shade})`;
    const range = metres(kind.sensor_range_m);
    const button = make(
      "button",
      {
        type: "button",
        title: `${name}: ${kind.name}, ${kind.speed_mps} m/s, sees ${range}, radius ${kind.radius_m} m`,
        "aria-pressed": "false",
        onclick: () => choose(robot),
      },
      make("span", { class: `mark ${kind.role}`, style }),
      name,
    );
    const does = make("td");
    const charge = make("td", { class: "number charge" });
    const driven = make("td", { class: "number" });
    const cells = [make("td", {}, button), does, ...(batteries ? [charge] : []), driven];
    return { row: make("tr", { class: kind.role }, ...cells), button, does, driven, charge, robot };
  }

  /** @type {(views: RobotView[], chosen: Robot | null, t: number) => void} */
  draw(views, chosen, t) {
    views.forEach((view, i) => {
      const { row, button, does, driven, charge, robot } = this.rows[i];
      const text = `${view.away && !view.lost ? "no contact: " : ""}${doing(this.mission, view, t)}`;
      setText(does, text);
      does.title = text;
      setText(driven, metres(view.driven));
      if (view.charge === null) setText(charge, "");
      else this.drawCharge(charge, view, view.charge, t);
      row.classList.toggle("lost", view.lost !== null);
      button.setAttribute("aria-pressed", String(chosen === robot));
    });
  }

  /** The charge in per cent over a bar of that length; an arrow up while it charges.
      @type {(cell: HTMLElement, view: RobotView, charge: number, t: number) => void} */
  drawCharge(cell, view, charge, t) {
    const percent = Math.round(100 * charge);
    const charges = this.mission.charging(view) !== null;
    setText(cell, `${charges ? "↑ " : ""}${percent} %`);
    cell.title = ofCharge(this.mission, view, charge, t);
    cell.style.setProperty("--charge", `${percent}%`);
    cell.classList.toggle("low", charge < LOW_CHARGE);
  }
}

/** How a mission stands; at its end, the stop report in its place. */
export class Report {
  /** @param {Mission} mission
      @param {(frontier: Remaining) => void} show */
  constructor(mission, show) {
    this.mission = mission;
    this.show = show;
    this.title = make("h2");
    this.body = make("div", { class: "report" });
    this.element = make("section", { class: "card", "aria-label": "How the mission stands" }, this.title, this.body);
    this.shown = "";
  }

  /** @type {(t: number, views: RobotView[]) => void} */
  draw(t, views) {
    const { mission } = this;
    const end = isOver(mission, t) ? mission.ended : null;
    const key = end ? "over" : `${mission.planIndex(t)} ${mission.docked.index(t)}`;
    if (key === this.shown) return;
    this.shown = key;
    setText(this.title, end ? "Stop report" : "Progress");
    this.body.replaceChildren(...(end ? this.ended(end) : [this.progress(t, views)]));
  }

  /** @type {(t: number, views: RobotView[]) => HTMLElement} */
  progress(t, views) {
    const { mission } = this;
    const { down, up } = mission.docked.at(t) ?? { down: 0, up: 0 };
    return figures([
      ["targets", mission.planAt(t)?.targets.length ?? 0],
      ["plans so far", mission.planIndex(t) + 1],
      ["set down", down],
      ["picked up", up],
      ["rovers out", views.filter((view) => !view.robot.carrier && !view.carrier).length],
      ["aboard", views.filter((view) => view.carrier).length],
    ]);
  }

  /** @type {(end: EndedLine) => HTMLElement[]} */
  ended(end) {
    /** @type {(pairs: [string, number][]) => number} */
    const total = (pairs) => pairs.reduce((sum, [, value]) => sum + value, 0);
    const list = figures([
      ["all explored", end.exploration_ms === null ? "never" : clock(end.exploration_ms)],
      ["ended at", clock(end.t_ms)],
      ["reachable", area(end.reachable_area_m2)],
      ["explored", share(exploredShare(end))],
      ["distance", metres(total(end.distance_m))],
      ["energy", energy(total(end.energy_j))],
      ["set down", end.deployments],
      ["picked up", end.retrievals],
      ["plans", end.plans_valid],
      ["refused", end.plans_invalid],
    ]);
    const times = end.known_ms ? [make("p", { text: knownTimes(end.known_ms) })] : [];
    return [list, ...times, this.remaining(end.remaining)];
  }

  /** @type {(left: Remaining[]) => HTMLElement} */
  remaining(left) {
    if (!left.length) return make("p", { text: "No frontier is left." });
    const items = left.map((frontier) => {
      const text = `${frontier.reason} (${count(frontier.frontier_cells, "cell")})`;
      const onclick = () => this.show(frontier);
      return make("li", {}, make("button", { type: "button", title: "Show it on the map", text, onclick }));
    });
    const summary = make("summary", { text: `${count(left.length, "frontier")} left, and why` });
    return make("details", {}, summary, make("ul", {}, ...items));
  }
}

/** @type {(pairs: [name: string, value: string | number][]) => HTMLElement} */
function figures(pairs) {
  const items = pairs.flatMap(([name, value]) => [make("dt", { text: name }), make("dd", { text: value })]);
  return make("dl", {}, ...items);
}

/** The plan that is followed, and whose next step it changed; folded, the plans that it was compared with, and all
    plans with the cause of each: a click goes there. */
export class Plans {
  /** @param {Mission} mission
      @param {(t: number) => void} go
      @param {() => void} redraw */
  constructor(mission, go, redraw) {
    this.mission = mission;
    this.go = go;
    /** @type {HTMLElement[]} */
    this.items = [];
    this.list = make("ol", { class: "plans", tabindex: "0", "aria-label": "Plans" });
    this.number = make("summary");
    this.title = make("h2");
    this.changes = make("ul", { class: "changes", "aria-label": "What this plan changed" });
    this.prices = make("table", { class: "prices", "aria-label": "Plans compared" });
    this.instead = make("p");
    this.others = make("summary");
    this.compared = make("details", { class: "compared", ontoggle: redraw }, this.others, this.prices, this.instead);
    const all = make("details", {}, this.number, this.list);
    // the list first: what a click on it changes stands below it, so that it stays under the pointer
    this.element = make("section", { class: "card grows" }, all, this.title, this.changes, this.compared);
    this.shown = -1;
    this.fill();
    this.showChanges(-1);
  }

  /** Add the plans that are not in the list yet. */
  fill() {
    for (const plan of this.mission.plans.slice(this.items.length)) this.items.push(this.item(plan));
    this.list.append(...this.items.slice(this.list.childElementCount));
    setText(this.number, `All ${count(this.items.length, "plan")}`);
  }

  /** @type {(plan: Plan) => HTMLElement} */
  item(plan) {
    const button = make(
      "button",
      { type: "button", onclick: () => this.go(plan.t_ms) },
      make("b", { text: plan.revision }),
      make("span", { text: clock(plan.t_ms) }),
      make("span", { text: newsShort(this.mission, plan) }),
    );
    const explain = () => {
      const { title, lines } = ofPlan(this.mission, plan);
      button.title = [title, ...lines].join("\n");
    };
    button.addEventListener("pointerenter", explain, { once: true });
    return make("li", {}, button);
  }

  /** Show what the plan with this index changed.
      @type {(i: number) => void} */
  showChanges(i) {
    const { mission } = this;
    /** @type {Plan | undefined} */
    const plan = mission.plans[i];
    /** @type {Plan | undefined} */
    const earlier = mission.plans[i - 1];
    setText(this.title, plan ? `Plan ${plan.revision}: ${newsShort(mission, plan)}` : "No plan yet");
    /** @type {(action: Action | null, robot: Robot) => string} */
    const step = (action, robot) => (action ? actThere(mission, action, robot) : "nothing");
    const changes = plan ? changed(mission.robots, plan, earlier) : [];
    const lines = changes.map(({ robot, now, before }) => {
      const was = earlier ? [make("span", { text: ` (plan ${earlier.revision}: ${step(before, robot)})` })] : [];
      return make("li", {}, make("b", { text: robot.name }), ` ${step(now, robot)}`, ...was);
    });
    if (plan && !lines.length) lines.push(make("li", { text: "All robots go on as before." }));
    this.changes.replaceChildren(...lines);
    this.showCompared(plan);
  }

  /** Whether the next best plan is shown beside the one that is followed. */
  get compares() {
    return this.compared.open;
  }

  /** Show which plans a plan was compared with, and what each costs.
      @type {(plan: Plan | undefined) => void} */
  showCompared(plan) {
    const { mission } = this;
    this.compared.hidden = !plan || plan.compared.length < 2;
    if (!plan) return;
    setText(this.others, `Compared with ${count(plan.compared.length - 1, "other plan")}`);
    const rows = prices(mission, plan).map(([maker, price]) => {
      return make("tr", {}, make("td", { text: maker }), make("td", { class: "number", text: price }));
    });
    const heads = ["plan by", "price"].map((text) => make("th", { scope: "col", text }));
    this.prices.replaceChildren(make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows));
    setText(this.instead, `${PRICE} The map shows in long dashes where the next best plan would send robots first.`);
  }

  /** @type {(t: number) => void} */
  draw(t) {
    if (this.items.length < this.mission.plans.length) this.fill();
    const i = this.mission.planIndex(t);
    const { list } = this;
    if (i === this.shown) return;
    if (this.shown >= 0) this.items[this.shown].removeAttribute("aria-current");
    this.shown = i;
    this.showChanges(i);
    if (i < 0) return;
    const item = this.items[i];
    const top = item.offsetTop; // in the list, which is positioned
    item.setAttribute("aria-current", "true");
    const isSeen = top >= list.scrollTop && top + item.offsetHeight <= list.scrollTop + list.clientHeight;
    const high = item.offsetHeight;
    if (!isSeen) list.scrollTop = top - Math.floor(list.clientHeight / high / 2) * high; // so that no row is cut
  }
}
