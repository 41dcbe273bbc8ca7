/* The missions and jobs there are, the newest first: those that were started here, and those of robots elsewhere.
   Missions that are ticked can be watched side by side; those that go on can be paused, resumed and wound down here. */

import { make } from "#draw/dom.js";
import { painted } from "#live/picture.js";
import { get, messageOf, post, Refused, Unreachable } from "#live/service.js";
import { forget, mark, pause } from "#live/stream.js";
import { clock, count } from "#text/format.js";
import { ending } from "#text/why.js";

const EVERY_MS = 2000;
const MOST = 6; // missions side by side
const MOST_ROWS = 200;
const THUMBNAIL = [76, 46]; // points of the page, as in the style
const RENEW_MS = 15000; // of mission time, after which the picture of one that goes on is requested again

/** What can be done with a mission in a state: path and label.
    @type {Map<string, [control: string, text: string][]>} */
const CONTROLS = new Map([
  [
    "running",
    [
      ["pause", "Pause"],
      ["wind-down", "Wind down"],
    ],
  ],
  [
    "paused",
    [
      ["resume", "Resume"],
      ["wind-down", "Wind down"],
    ],
  ],
  ["winding_down", [["pause", "Pause"]]],
]);

/** A state in a word, in its colour.
    @type {(state: string) => HTMLElement} */
export function badge(state) {
  return make("span", { class: `badge ${state.replace(" ", "_")}`, text: state.replace("_", " ") });
}

/** How a mission stands, or how it ended.
    @type {(mission: MissionEntry) => string} */
export function missionState({ status, reason, state }) {
  return status ? ending({ status, reason }) : state;
}

/** Whose robots they are, and how many.
    @type {(mission: MissionEntry) => string} */
export function robots({ simulation }) {
  if (!simulation) return "robots elsewhere";
  const { carriers, rovers, seed } = simulation;
  return `${count(carriers, "carrier")}, ${count(rovers, "rover")}, seed ${seed}`;
}

/** @type {(map: CellMap) => HTMLCanvasElement} */
function thumbnail(map) {
  const [wide, high] = THUMBNAIL;
  const ratio = window.devicePixelRatio || 1;
  return painted(map, null, Math.max(1, Math.ceil(Math.max(map.width / wide, map.height / high) / ratio)));
}

/** A list of entries, renewed as long as it is not closed; those derived from it make its rows. */
class EntryList {
  /** @param {"missions" | "jobs"} kind
      @param {{ title: string, heads: string[], none: string }} words */
  constructor(kind, { title, heads, none }) {
    this.kind = kind;
    this.heads = heads;
    this.rows = make("tbody");
    const columns = heads.map((text) => make("th", { scope: "col", "data-head": text, text }));
    this.table = make("table", { hidden: true }, make("thead", {}, make("tr", {}, ...columns)), this.rows);
    this.none = make("p", { class: "dim", text: none, hidden: true });
    const older = () => this.showOlder();
    this.more = make("button", { type: "button", text: "Show older ones", hidden: true, onclick: older });
    this.element = make(
      "section",
      { class: "card list" },
      make("h2", { text: title }),
      this.none,
      this.table,
      this.more,
    );
    this.limit = 12;
    this.closed = false;
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
      await pause(EVERY_MS);
    }
  }

  showOlder() {
    this.limit = Math.min(MOST_ROWS, 4 * this.limit);
    this.refresh();
  }

  /** @type {(text: string) => void} */
  showNotice(text) {
    this.none.textContent = text;
    this.none.hidden = false;
  }

  async refresh() {
    /** @type {EntryPage} */
    let found;
    try {
      found = await get(`/v1/${this.kind}?limit=${this.limit}`);
      mark(this, false);
    } catch (error) {
      mark(this, error instanceof Unreachable && !this.closed);
      if (error instanceof Refused && error.status === 403) {
        this.showNotice(messageOf(error));
        this.close();
      }
      return;
    }
    const text = JSON.stringify(found);
    if (text === this.shown) return;
    this.shown = text;
    const rows = this.rowsOf(found);
    this.none.hidden = rows.length > 0;
    this.table.hidden = rows.length === 0;
    this.more.hidden = found.next === null || this.limit >= MOST_ROWS;
    this.rows.replaceChildren(...rows);
  }

  /** @type {(found: EntryPage) => HTMLElement[]} */
  rowsOf(_found) {
    return [];
  }

  /** A cell of a column.
      @type {(i: number, ...children: (Node | string)[]) => HTMLElement} */
  cell(i, ...children) {
    return make("td", { "data-head": this.heads[i] }, ...children);
  }
}

export class JobList extends EntryList {
  constructor() {
    super("jobs", {
      title: "Planning jobs",
      heads: ["job", "planner", "plans", "makespan", "state"],
      none: "None yet. Programs send them to /v1/jobs.",
    });
  }

  /** @type {(found: EntryPage) => HTMLElement[]} */
  rowsOf({ jobs = [] }) {
    return jobs.map((job) => {
      const link = make("a", { href: `#/jobs/${job.id}`, text: job.id.slice(0, 8) });
      const makespan = job.makespan_ms === null ? "" : clock(job.makespan_ms, true);
      const cells = [job.planner, String(job.plans), makespan, badge(job.outcome || job.state)];
      return make("tr", {}, make("td", {}, link), ...cells.map((cell, i) => this.cell(i + 1, cell)));
    });
  }
}

export class MissionList extends EntryList {
  constructor() {
    super("missions", {
      title: "Missions",
      heads: ["map", "mission", "decided by", "robots", "time", "state"],
      none: "None yet. Start one here, or have robots report to /v1/missions.",
    });
    /** @type {string[]} */
    this.ticked = []; // ids
    /** @type {Map<string, { key: string, box: HTMLElement }>} */
    this.pictures = new Map();
    this.beside = make("a", { class: "beside", hidden: true });
    this.element.append(this.beside);
  }

  /** @type {(found: EntryPage) => HTMLElement[]} */
  rowsOf({ missions = [] }) {
    return missions.map((one) => {
      const link = make("a", { href: `#/missions/${one.id}`, text: one.name });
      const decided = one.planner === "none" ? one.strategy : `${one.strategy}, ${one.planner}`;
      return make(
        "tr",
        {},
        this.cell(0, this.picture(one)),
        make("td", {}, this.tick(one), link),
        this.cell(2, decided),
        this.cell(3, robots(one)),
        this.cell(4, clock(one.t_ms)),
        this.cell(5, ...this.controls(one), badge(missionState(one))),
      );
    });
  }

  /** A box that chooses a mission; of too many, the first one is chosen no more.
      @type {(mission: MissionEntry) => HTMLElement} */
  tick({ id, name }) {
    const box = make("input", {
      type: "checkbox",
      value: id,
      checked: this.ticked.includes(id),
      "aria-label": `Show ${name} beside another`,
      title: "Tick some to see them side by side",
    });
    box.addEventListener("change", () => {
      const others = this.ticked.filter((other) => other !== id);
      this.ticked = [...others, ...(box.checked ? [id] : [])].slice(-MOST);
      for (const other of this.rows.querySelectorAll("input")) other.checked = this.ticked.includes(other.value);
      this.beside.hidden = this.ticked.length < 2;
      this.beside.textContent = `Show the ${this.ticked.length} side by side`;
      this.beside.href = `#/missions/${this.ticked.join(",")}`;
    });
    return box;
  }

  /** A small picture of what is known in a mission, kept from one list to the next.
      @type {(mission: MissionEntry) => HTMLElement} */
  picture({ id, state, t_ms }) {
    const key = state === "ended" ? "ended" : String(Math.floor(t_ms / RENEW_MS));
    const link = { href: `#/missions/${id}`, class: "thumbnail", tabindex: "-1", "aria-hidden": "true" };
    const kept = this.pictures.get(id) ?? { key: "", box: make("a", link) };
    this.pictures.set(id, kept);
    if (kept.key === key) return kept.box;
    kept.key = key;
    /** @type {(map: CellMap) => void} */
    const show = (map) => {
      if (map.runs.length) kept.box.replaceChildren(thumbnail(map));
    };
    const again = () => {
      kept.key = "";
    };
    get(`/v1/missions/${id}/map`).then(show, again);
    return kept.box;
  }

  /** Buttons that control a mission that goes on.
      @type {(mission: MissionEntry) => HTMLElement[]} */
  controls({ id, name, state }) {
    return (CONTROLS.get(state) ?? []).map(([control, text]) => {
      const onclick = async () => {
        try {
          await post(`/v1/missions/${id}/${control}`);
        } catch (error) {
          this.showNotice(messageOf(error));
          return;
        }
        await this.refresh();
      };
      return make("button", { type: "button", text, "aria-label": `${text} ${name}`, onclick });
    });
  }
}
