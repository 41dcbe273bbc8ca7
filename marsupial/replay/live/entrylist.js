/* The missions and jobs there are, the newest first: those that were started here, and those of robots elsewhere. Missions
   that are ticked can be watched side by side; those that go on can be paused, resumed and wound down here. */

import { make } from "#draw/dom.js";
import { clock, count } from "#text/format.js";
import { painted } from "#live/picture.js";
import { get, post, Unreachable } from "#live/service.js";
import { forget, mark } from "#live/stream.js";
import { ending } from "#text/why.js";

const EVERY_MS = 2000;
const MOST = 6; // missions side by side
const THUMBNAIL = [76, 46]; // points of the page, as in the style
const RENEW_MS = 15000; // of mission time, after which the picture of one that goes on is requested again

const KINDS = {
  missions: {
    title: "Missions",
    heads: ["map", "mission", "decided by", "robots", "time", "state"],
    none: "None yet. Start one here, or have robots report to /v1/missions.",
    cells: (one) => [one.name, decider(one), robots(one), clock(one.t_ms), badge(missionState(one))],
  },
  jobs: {
    title: "Planning jobs",
    heads: ["job", "planner", "plans", "makespan", "state"],
    none: "None yet. Programs send them to /v1/jobs.",
    cells: (one) => [
      one.id.slice(0, 8),
      one.planner,
      one.plans,
      one.makespan_ms === null ? "" : clock(one.makespan_ms, true),
      badge(one.outcome || one.state),
    ],
  },
};

/** A state in a word, in its colour. */
export function badge(state) {
  return make("span", { class: `badge ${state.replace(" ", "_")}`, text: state.replace("_", " ") });
}

/** How a mission stands, or how it ended. */
export function missionState(mission) {
  return mission.status ? ending(mission) : mission.state;
}

function decider(mission) {
  return mission.planner === "none" ? mission.strategy : `${mission.strategy}, ${mission.planner}`;
}

function thumbnail(map) {
  const [wide, high] = THUMBNAIL,
    ratio = window.devicePixelRatio || 1;
  return painted(map, null, Math.max(1, Math.ceil(Math.max(map.width / wide, map.height / high) / ratio)));
}

/** Whose robots they are, and how many. */
export function robots({ simulation }) {
  if (!simulation) return "robots elsewhere";
  const { carriers, rovers, seed } = simulation;
  return `${count(carriers, "carrier")}, ${count(rovers, "rover")}, seed ${seed}`;
}

export class EntryList {
  constructor(kind) {
    this.kind = kind;
    const { title, heads, none } = KINDS[kind];
    this.rows = make("tbody");
    this.table = make(
      "table",
      {},
      make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col", "data-head": text, text })))),
      this.rows,
    );
    this.none = make("p", { class: "dim", text: none });
    this.more = make("button", {
      type: "button",
      text: "Show older ones",
      onclick: () => {
        this.limit = Math.min(200, 4 * this.limit);
        this.refresh();
      },
    });
    this.ticked = [];
    this.pictures = new Map();
    this.beside = make("a", { class: "beside", hidden: true });
    this.element = make(
      "section",
      { class: "card list" },
      make("h2", { text: title }),
      this.none,
      this.table,
      this.more,
      this.beside,
    );
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
      await new Promise((resolve) => {
        setTimeout(resolve, EVERY_MS);
      });
    }
  }

  async refresh() {
    let found;
    try {
      found = await get(`/v1/${this.kind}?limit=${this.limit}`);
      mark(this, false);
    } catch (error) {
      mark(this, error instanceof Unreachable && !this.closed);
      if (error.status === 403) {
        this.none.textContent = error.message;
        this.none.hidden = false;
        this.close();
      }
      return;
    }
    const entries = found[this.kind],
      text = JSON.stringify(found);
    if (text === this.shown) return;
    this.shown = text;
    this.none.hidden = entries.length > 0;
    this.table.hidden = entries.length === 0;
    this.more.hidden = found.next === null || this.limit >= 200;
    this.rows.replaceChildren(...entries.map((one) => this.row(one)));
  }

  /** A box that chooses a mission; of too many, the first one is chosen no more. */
  tick({ id, name }) {
    const box = make("input", {
      type: "checkbox",
      value: id,
      checked: this.ticked.includes(id),
      "aria-label": `Show ${name} beside another`,
      title: "Tick some to see them side by side",
    });
    box.addEventListener("change", () => {
      this.ticked = [...this.ticked.filter((other) => other !== id), ...(box.checked ? [id] : [])].slice(-MOST);
      for (const other of this.rows.querySelectorAll("input")) other.checked = this.ticked.includes(other.value);
      this.beside.hidden = this.ticked.length < 2;
      this.beside.textContent = `Show the ${this.ticked.length} side by side`;
      this.beside.href = `#/missions/${this.ticked.join(",")}`;
    });
    return box;
  }

  /** A small picture of what is known in a mission, kept from one list to the next. */
  picture(one) {
    const key = one.state === "ended" ? "ended" : Math.floor(one.t_ms / RENEW_MS),
      kept = this.pictures.get(one.id) ?? {
        key: null,
        box: make("a", { href: `#/missions/${one.id}`, class: "thumbnail", tabindex: "-1", "aria-hidden": "true" }),
      };
    this.pictures.set(one.id, kept);
    if (kept.key !== key) {
      kept.key = key;
      get(`/v1/missions/${one.id}/map`).then(
        (map) => {
          if (map.runs.length) kept.box.replaceChildren(thumbnail(map));
        },
        () => {
          kept.key = null;
        },
      );
    }
    return kept.box;
  }

  /** Buttons that control a mission that goes on. */
  commands(one) {
    const controls =
      {
        running: [
          ["pause", "Pause"],
          ["wind-down", "Wind down"],
        ],
        paused: [
          ["resume", "Resume"],
          ["wind-down", "Wind down"],
        ],
        winding_down: [["pause", "Pause"]],
      }[one.state] ?? [];
    return controls.map(([control, text]) =>
      make("button", {
        type: "button",
        text,
        "aria-label": `${text} ${one.name}`,
        onclick: () =>
          post(`/v1/missions/${one.id}/${control}`).then(
            () => this.refresh(),
            (error) => {
              this.none.textContent = error.message;
              this.none.hidden = false;
            },
          ),
      }),
    );
  }

  row(one) {
    const { cells, heads } = KINDS[this.kind],
      [first, ...rest] = cells(one),
      link = make("a", { href: `#/${this.kind}/${one.id}`, text: first });
    const isMission = this.kind === "missions",
      named = make("td", {}, ...(isMission ? [this.tick(one)] : []), link),
      shift = isMission ? 2 : 1;
    const others = rest.map((cell, i) =>
      make(
        "td",
        { "data-head": heads[i + shift] },
        ...(isMission && i === rest.length - 1 ? this.commands(one) : []),
        cell,
      ),
    );
    return make(
      "tr",
      {},
      ...(isMission ? [make("td", { "data-head": "map" }, this.picture(one))] : []),
      named,
      ...others,
    );
  }
}
