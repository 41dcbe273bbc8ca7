/* Beside the map: the team, how the mission stands or how it ended, and the plans. */

import { changed } from "#log/ahead.js";
import { looks } from "#draw/colours.js";
import { make, setText } from "#draw/dom.js";
import { amount, area, clock, count, energy, metres, share } from "#text/format.js";
import { actThere, doing, ending, ofCharge, ofPlan } from "#text/why.js";
import { newsShort } from "#text/news.js";

const FIGURED = new Set(["battery", "m"]); // columns of the team with figures
const MILESTONES = [50, 90, 99]; // per cent of the reachable area
const LOW_CHARGE = 0.2; // a charge below is marked

/** Whether a mission has come to its end at t. */
export function isOver(mission, t) {
  return mission.ended !== null && t >= mission.to;
}

/** The state of a mission at t in a word. */
export function stateAt(mission, t) {
  return isOver(mission, t) ? ending(mission.ended) : "under way";
}

/** When half of the reachable area was known, when most and when nearly all. */
export function knownTimes({ known_ms }) {
  const found = new Map(known_ms),
    at = MILESTONES.map((percent) => found.get(percent) ?? null);
  if (at[0] === null) return `less than ${MILESTONES[0]} % known`;
  return `${MILESTONES.join(" / ")} % known at ${at.map((ms) => (ms === null ? "never" : clock(ms))).join(" / ")}`;
}

/** A row for each robot; a click chooses it. */
export class Team {
  constructor(mission, choose) {
    this.mission = mission;
    this.rows = mission.robots.map((robot) => this.row(robot, choose));
    this.batteries = mission.robots.some((robot) => robot.kind.battery);
    const heads = ["robot", "does", ...(this.batteries ? ["battery"] : []), "m"].map((text) =>
      make("th", { scope: "col", text, class: FIGURED.has(text) ? "number" : "" }),
    );
    this.element = make(
      "table",
      { class: `team${this.batteries ? " batteries" : ""}` },
      make("thead", {}, make("tr", {}, ...heads)),
      make("tbody", {}, ...this.rows.map((row) => row.row)),
    );
    for (const { row, charge } of this.batteries ? this.rows : []) row.insertBefore(charge, row.lastChild);
  }

  row(robot, choose) {
    const { hue, shade } = looks(this.mission).get(robot.name),
      does = make("td"),
      driven = make("td", { class: "number" });
    const mark = make("span", { class: `mark ${robot.kind.role}`, style: `background: var(--family-${hue}-${shade})` });
    const { name, kind } = robot,
      about = `${name}: ${kind.name}, ${kind.speed_mps} m/s, sees ${metres(kind.sensor_range_m)}, radius ${kind.radius_m} m`;
    const button = make(
      "button",
      { type: "button", title: about, "aria-pressed": "false", onclick: () => choose(robot) },
      mark,
      name,
    );
    const row = make("tr", { class: kind.role }, make("td", {}, button), does, driven),
      charge = make("td", { class: "number charge" });
    return { row, button, does, driven, charge, robot };
  }

  draw(views, chosen, t) {
    views.forEach((view, i) => {
      const { row, button, does, driven, charge, robot } = this.rows[i];
      setText(does, `${view.away && !view.lost ? "no contact: " : ""}${doing(this.mission, view)}`);
      does.title = does.textContent;
      setText(driven, amount(view.driven));
      if (view.charge !== null) this.drawCharge(charge, view, t);
      else setText(charge, "");
      row.classList.toggle("lost", view.lost !== null);
      button.setAttribute("aria-pressed", String(chosen === robot));
    });
  }

  /** The charge in per cent over a bar of that length; an arrow up while it charges. */
  drawCharge(cell, view, t) {
    const percent = Math.round(100 * view.charge),
      charges = this.mission.charging(view) !== null;
    setText(cell, `${charges ? "↑ " : ""}${percent} %`);
    cell.title = ofCharge(this.mission, view, t);
    cell.style.setProperty("--charge", `${percent}%`);
    cell.classList.toggle("low", view.charge < LOW_CHARGE);
  }
}

/** How a mission stands; at its end, the stop report in its place. */
export class Report {
  constructor(mission, show) {
    this.mission = mission;
    this.show = show;
    this.title = make("h2");
    this.body = make("div", { class: "report" });
    this.element = make("section", { class: "card", "aria-label": "How the mission stands" }, this.title, this.body);
    this.shown = "";
  }

  draw(t, views) {
    const over = isOver(this.mission, t),
      key = over ? "over" : `${this.mission.planIndex(t)} ${this.mission.docked.index(t)}`;
    if (key === this.shown) return;
    this.shown = key;
    setText(this.title, over ? "Stop report" : "Progress");
    this.body.replaceChildren(...(over ? this.ended() : this.progress(t, views)));
  }

  progress(t, views) {
    const plan = this.mission.planAt(t),
      { down, up } = this.mission.docked.at(t),
      out = views.filter((view) => !view.robot.carrier && !view.carrier);
    return [
      figures([
        ["targets", plan ? plan.targets.length : 0],
        ["plans so far", this.mission.planIndex(t) + 1],
        ["set down", down],
        ["picked up", up],
        ["rovers out", out.length],
        ["aboard", views.filter((view) => view.carrier).length],
      ]),
    ];
  }

  ended() {
    const { ended } = this.mission,
      total = (pairs) => pairs.reduce((sum, pair) => sum + pair[1], 0);
    const covered = ended.reachable_area_m2 ? ended.explored_area_m2 / ended.reachable_area_m2 : 1;
    return [
      figures([
        ["all explored", ended.exploration_ms === null ? "never" : clock(ended.exploration_ms)],
        ["ended at", clock(ended.t_ms)],
        ["reachable", area(ended.reachable_area_m2)],
        ["explored", share(covered)],
        ["distance", metres(total(ended.distance_m))],
        ["energy", energy(total(ended.energy_j))],
        ["set down", ended.deployments],
        ["picked up", ended.retrievals],
        ["plans", ended.plans_valid],
        ["refused", ended.plans_invalid],
      ]),
      ...(ended.known_ms ? [make("p", { text: knownTimes(ended) })] : []),
      this.remaining(ended.remaining),
    ];
  }

  remaining(left) {
    if (!left.length) return make("p", { text: "No frontier is left." });
    const items = left.map((frontier) =>
      make(
        "li",
        {},
        make("button", {
          type: "button",
          title: "Show it on the map",
          text: `${frontier.reason} (${count(frontier.frontier_cells, "cell")})`,
          onclick: () => this.show(frontier),
        }),
      ),
    );
    return make(
      "details",
      {},
      make("summary", { text: `${count(left.length, "frontier")} left, and why` }),
      make("ul", {}, ...items),
    );
  }
}

function figures(pairs) {
  return make("dl", {}, ...pairs.flatMap(([name, value]) => [make("dt", { text: name }), make("dd", { text: value })]));
}

/** The plan that is followed, and whose next step it changed; folded, all plans with the cause of each: a click goes
    there. */
export class Plans {
  constructor(mission, go) {
    this.mission = mission;
    this.go = go;
    this.items = [];
    this.list = make("ol", { class: "plans", tabindex: "0", "aria-label": "Plans" });
    this.number = make("summary");
    this.title = make("h2");
    this.changes = make("ul", { class: "changes", "aria-label": "What this plan changed" });
    const all = make("details", {}, this.number, this.list);
    this.element = make("section", { class: "card grows" }, this.title, this.changes, all);
    this.shown = -1;
    this.fill();
    this.showChanges(-1);
  }

  /** Add what the mission has more. */
  fill() {
    for (const plan of this.mission.plans.slice(this.items.length)) this.items.push(this.item(plan));
    this.list.append(...this.items.slice(this.list.childElementCount));
    setText(this.number, `All ${count(this.items.length, "plan")}`);
  }

  item(plan) {
    const cells = [
      ["b", plan.revision],
      ["span", clock(plan.t_ms)],
      ["span", newsShort(this.mission, plan)],
    ].map(([tag, text]) => make(tag, { text }));
    const button = make("button", { type: "button", onclick: () => this.go(plan.t_ms) }, ...cells);
    button.addEventListener(
      "pointerenter",
      () => {
        const story = ofPlan(this.mission, plan);
        button.title = [story.title, ...story.lines].join("\n");
      },
      { once: true },
    );
    return make("li", {}, button);
  }

  /** Show what the plan changed. */
  showChanges(i) {
    const { mission } = this,
      { [i]: plan, [i - 1]: earlier } = mission.plans;
    setText(this.title, plan ? `Plan ${plan.revision}: ${newsShort(mission, plan)}` : "No plan yet");
    const step = (action, robot) => (action ? actThere(mission, action, robot) : "nothing");
    const lines = plan
      ? changed(mission.robots, plan, earlier).map(({ robot, now, before }) => {
          const was = earlier ? [make("span", { text: ` (before: ${step(before, robot)})` })] : [];
          return make("li", {}, make("b", { text: robot.name }), ` ${step(now, robot)}`, ...was);
        })
      : [];
    if (plan && !lines.length) lines.push(make("li", { text: "All robots go on as before." }));
    this.changes.replaceChildren(...lines);
  }

  draw(t) {
    if (this.items.length < this.mission.plans.length) this.fill();
    const i = this.mission.planIndex(t),
      { list } = this;
    if (i === this.shown) return;
    if (this.shown >= 0) this.items[this.shown].removeAttribute("aria-current");
    this.shown = i;
    this.showChanges(i);
    if (i < 0) return;
    const item = this.items[i],
      top = item.offsetTop; // in the list, which is positioned
    item.setAttribute("aria-current", "true");
    if (top < list.scrollTop || top + item.offsetHeight > list.scrollTop + list.clientHeight) {
      list.scrollTop = top - list.clientHeight / 2;
    }
  }
}
