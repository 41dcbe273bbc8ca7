/* The missions and jobs there are, the newest first: those that were started here, and those of robots elsewhere. Two
   missions that are ticked can be watched side by side. */

import { make } from "./dom.js";
import { clock } from "./format.js";
import { get, Unreachable } from "./service.js";
import { forget, mark } from "./stream.js";

const EVERY_MS = 2000;

const KINDS = {
  missions: {
    title: "Missions", heads: ["mission", "decided by", "robots", "time", "state"],
    none: "None yet. Start one here, or have robots report to /v1/missions.",
    cells: (one) => [one.name, decider(one), robots(one), clock(one.t_ms), badge(one.status || one.state)],
  },
  jobs: {
    title: "Planning jobs", heads: ["job", "planner", "plans", "makespan", "state"], none: "None yet. Programs send them to /v1/jobs.",
    cells: (one) => [one.id.slice(0, 8), one.planner, one.plans, one.makespan_ms === null ? "" : clock(one.makespan_ms, true), badge(one.outcome || one.state)],
  },
};

/** A state in a word, in its colour. */
export function badge(state) { return make("span", { class: `badge ${state}`, text: state.replace("_", " ") }); }

function decider(mission) { return mission.planner === "none" ? mission.strategy : `${mission.strategy}, ${mission.planner}`; }

/** Whose robots they are, and how many. */
export function robots({ simulation }) {
  if (!simulation) return "robots elsewhere";
  const { carriers, rovers, seed } = simulation;
  return `simulated: ${carriers} + ${rovers}, seed ${seed}`;
}

export class EntryList {
  constructor(kind) {
    this.kind = kind;
    const { title, heads, none } = KINDS[kind];
    this.rows = make("tbody");
    this.table = make("table", {}, make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col", "data-head": text, text })))), this.rows);
    this.none = make("p", { class: "dim", text: none });
    this.more = make("button", { type: "button", text: "Show older ones", onclick: () => { this.limit = Math.min(200, 4 * this.limit); this.refresh(); } });
    this.ticked = [];
    this.beside = make("a", { class: "beside", text: "Show the two side by side", hidden: true });
    this.element = make("section", { class: "card list" }, make("h2", { text: title }), this.none, this.table, this.more, this.beside);
    this.limit = 12;
    this.none.hidden = this.table.hidden = this.more.hidden = true;
    this.shown = "";
    this.run();
  }

  close() {
    this.closed = true;
    forget(this);
  }

  async run() {
    while (!this.closed) {
      if (!document.hidden) await this.refresh();
      await new Promise((resolve) => { setTimeout(resolve, EVERY_MS); });
    }
  }

  async refresh() {
    let found;
    try {
      found = await get(`/v1/${this.kind}?limit=${this.limit}`);
      mark(this, false);
    } catch (error) {
      mark(this, error instanceof Unreachable && !this.closed);
      if (error.status === 403) { this.none.textContent = error.message; this.none.hidden = false; this.close(); }
      return;
    }
    const entries = found[this.kind], told = JSON.stringify(found);
    if (told === this.shown) return;
    this.shown = told;
    this.none.hidden = entries.length > 0;
    this.table.hidden = entries.length === 0;
    this.more.hidden = found.next === null || this.limit >= 200;
    this.rows.replaceChildren(...entries.map((one) => this.row(one)));
  }

  /** A box that chooses a mission; of three, the first one is chosen no more. */
  tick({ id, name }) {
    const box = make("input", { type: "checkbox", value: id, checked: this.ticked.includes(id), "aria-label": `Show ${name} beside another`, title: "Tick two to see them side by side" });
    box.addEventListener("change", () => {
      this.ticked = [...this.ticked.filter((other) => other !== id), ...(box.checked ? [id] : [])].slice(-2);
      for (const other of this.rows.querySelectorAll("input")) other.checked = this.ticked.includes(other.value);
      this.beside.hidden = this.ticked.length < 2;
      this.beside.href = `#/missions/${this.ticked.join(",")}`;
    });
    return box;
  }

  row(one) {
    const { cells, heads } = KINDS[this.kind], [first, ...rest] = cells(one), link = make("a", { href: `#/${this.kind}/${one.id}`, text: first });
    return make("tr", {}, make("td", {}, ...(this.kind === "missions" ? [this.tick(one)] : []), link), ...rest.map((cell, i) => make("td", { "data-head": heads[i + 1] }, cell)));
  }
}
