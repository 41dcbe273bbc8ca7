/* The player: a view of one mission, or of some side by side with their clocks locked. `show` makes it.

   Theory of operation. Data flows one way, from log lines to canvases, and nothing below draws by itself:

     log lines --append--> Mission (model.js)      all that follows from a log, as values over time
                             |   history.js: values that hold from a moment on; knownmap.js: the map in tiles
                             |   queried for a moment t: views(t), planAt(t), knownMap()
                             v
     Transport (transport.js) --t--> View.draw ----> Pane per mission (pane.js): map.js, its layers, what was clicked
       the clock: play, speed,        at most one    Lanes (lanes.js): the timeline below
       scrubbing, the live moment     per frame      Panels (panels.js), or for several missions the difference

   What is chosen by a click, wherever, is given to all of them (`choose`): a robot in every mission that has it.

   A replay file (file.js) appends all lines before it calls `show`. The page of the service (missionspage.js) calls
   `show` after the first line, appends lines as they arrive, and calls `grew()`, which draws new plans at once and the
   rest at most every RENEW_MS. Both draw in the same way: any moment t can be drawn from a Mission at any time,
   forwards or backwards, so scrubbing, playing and live differ only in who sets t.

   What is costly is kept: what of the timeline does not depend on t is on a canvas of its own, drawn again only for
   another size, theme or span, or for new lines, and a map that moves through time repaints only the tiles that differ.
   `draw()` may be called at every change; it requests one frame, and `drawNow()` draws everything for the present t.
   `restyle()` is for what depends on size, theme, span or the lines so far, not on t.

   Missions share one Transport and one Lanes. The span is that of all; while they go on, the newest moment is that of
   the slowest one, so that they can be compared; those that have ended don't count. */

import { Camera, shareFrame } from "#draw/camera.js";
import { sideColour } from "#draw/colours.js";
import { button, make, setText } from "#draw/dom.js";
import { Lanes } from "#draw/lanes.js";
import { laneStory, thingAt } from "#draw/lanestories.js";
import { openingMoment } from "#log/opening.js";
import { header } from "#page/header.js";
import { clickedIn, isTaken, keyActions, keysDialog } from "#page/keys.js";
import { LegendCard } from "#page/legendcard.js";
import { Pane } from "#page/pane.js";
import { Plans, Report, Team } from "#page/panels.js";
import { listenLanes } from "#page/pointer.js";
import { Tip } from "#page/tip.js";
import { Transport } from "#page/transport.js";
import { lead, outcome, sideNames } from "#text/difference.js";

const RENEW_MS = 250; // between pictures of a live mission that has no new plan: drawing lanes takes long
const COLUMNS = [1, 2, 3, 2, 3, 3]; // of panes, by the number of missions

/** Put a view of `missions` (each with its first line) in `container`. Returns the view: call `grew()` after a mission
    has got more lines, `close()` when it is over.
    @type {(container: Element, missions: Mission[], options?: ViewOptions) => View} */
export function show(container, missions, options = {}) {
  return new View(container, missions, options);
}

export class View {
  /** @param {Element} container
      @param {Mission[]} missions
      @param {ViewOptions} options */
  constructor(container, missions, options) {
    this.missions = missions;
    this.options = options;
    this.over = new AbortController();
    this.drawing = false;
    this.renewed = performance.now();
    this.renewing = 0;
    this.plans = 0;
    this.theme = "";
    this.from = Math.min(...missions.map((one) => one.from));
    this.to = this.from; // the end of all
    this.newest = this.from; // the newest moment that is known of all
    this.measure();
    this.names = sideNames(missions);
    this.tip = new Tip();
    this.transport = new Transport(
      {
        span: () => [this.from, this.to],
        newest: () => this.newest,
        moved: () => this.draw(),
        step: (direction) => this.stepPlan(direction),
      },
      options,
    );
    const isShared = shareFrame(missions);
    const shared = new Camera(missions);
    this.panes = missions.map((mission, i) => this.makePane(i, isShared ? shared : new Camera([mission])));
    this.lanes = new Lanes(missions, this.names);
    this.legend = new LegendCard(missions, isShared && missions.length > 1, () => this.draw());
    this.dialog = keysDialog();
    this.outcome = make("b");
    this.lead = make("span");
    this.difference = make("p", { class: "difference", role: "status" }, this.outcome, " ", this.lead);
    this.opener = button("Open the lanes", "Lanes", () => this.toggleLanes(), {
      class: "opener",
      "aria-expanded": "false",
    });
    this.panels = missions.length > 1 ? null : this.makePanels();
    this.element = this.build();
    this.clicked = clickedIn(this.element);
    container.replaceChildren(this.element);
    this.listen();
    this.setTheme(preferredTheme());
    this.resized = new ResizeObserver(() => this.resize());
    for (const one of [...this.panes.flatMap((pane) => pane.sized), this.lanes.content]) this.resized.observe(one);
    this.open();
  }

  /** Note how far the logs go, which is as far as missions are shown; of two that go on, the slower one is waited
      for. */
  measure() {
    const open = this.missions.filter((mission) => !mission.ended);
    this.to = Math.max(...this.missions.map((mission) => mission.to));
    this.newest = open.length ? Math.min(...open.map((mission) => mission.to)) : this.to;
  }

  /** @type {(i: number, camera: Camera) => Pane} */
  makePane(i, camera) {
    const many = this.missions.length > 1;
    /** @type {(name: string, state: HTMLElement) => HTMLElement[]} */
    const head = (name, state) => {
      if (!many) return [];
      return [this.options.controls?.[i] ?? make("span", { class: "contender" }, make("b", { text: name }), state)];
    };
    return new Pane(this.missions[i], this.names[i], {
      ...{ camera, head, tip: this.tip },
      side: many ? sideColour(i) : null,
      changed: () => this.draw(),
      choose: (thing) => this.choose(thing, i),
      go: (t) => this.transport.go(t),
    });
  }

  makePanels() {
    const [mission] = this.missions;
    const [pane] = this.panes;
    /** @type {(t: number) => void} */
    const go = (t) => this.transport.go(t);
    /** @type {(robot: Robot) => void} */
    const choose = (robot) => this.choose(pane.focus.robot === robot ? null : { robot }, 0);
    /** @type {(remaining: Remaining) => void} */
    const showRemaining = (remaining) => {
      go(mission.to);
      pane.map.camera.centre(...remaining.cell);
      this.choose({ remaining }, 0);
    };
    return {
      team: new Team(mission, choose),
      report: new Report(mission, showRemaining),
      plans: new Plans(mission, go, () => this.draw()),
    };
  }

  build() {
    const { panels, missions } = this;
    const columns = `--columns: ${COLUMNS[missions.length - 1]}`;
    this.transport.element.append(this.opener);
    const main = make(
      "main",
      { onpointerdown: () => this.legend.covers(main) && this.legend.close() },
      make("div", { class: "panes", style: columns }, ...this.panes.map((pane) => pane.element)),
      make("section", { class: "time", "aria-label": "Time" }, this.transport.element, this.lanes.element),
    );
    if (panels) {
      const team = make("section", { class: "card", "aria-label": "Team" }, panels.team.element);
      main.append(make("aside", {}, team, panels.report.element, panels.plans.element));
    }
    const head = header(missions, this.names, this.options, {
      legend: this.legend.element,
      second: panels ? null : this.difference,
      state: this.panes[0].state,
      showKeys: () => this.dialog.showModal(),
      switchTheme: () => this.switchTheme(),
    });
    return make("div", { class: `view ${panels ? "one" : "two"}` }, head, main, this.tip.element, this.dialog);
  }

  listen() {
    const { signal } = this.over;
    const { lanes, tip } = this;
    document.addEventListener("keydown", (event) => this.key(event), { signal });
    window.addEventListener("hashchange", () => this.readHash(), { signal });
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", () => this.setTheme(preferredTheme()), { signal });
    listenLanes(lanes.canvas, {
      seek: (x) => this.seek(x),
      clicked: (x, y) => this.chooseLane(x, y),
      over: (x, y, event) => tip.show(event, laneStory(lanes, x, y), event.clientY - y + lanes.clear(y)),
      left: () => tip.hide(),
      all: () => {
        lanes.showAll();
        lanes.restyle();
        this.draw();
      },
      zoom: (factor, x) => {
        lanes.zoom(factor, x);
        this.draw();
      },
    });
  }

  /** Go to a point of the timeline, if it is one.
      @type {(x: number) => boolean} */
  seek(x) {
    if (x < this.lanes.gutter) return false;
    this.transport.go(this.lanes.time(x));
    return true;
  }

  /** Choose what was clicked on the lanes: a robot, and where it is at work then.
      @type {(x: number, y: number) => void} */
  chooseLane(x, y) {
    this.tip.hide();
    const row = this.lanes.row(y);
    if (row) this.choose(thingAt(this.lanes, x, row), row.i);
  }

  /** Choose a thing of the i-th mission, wherever it is shown; a robot in every mission that has it; null: nothing.
      @type {(thing: Thing | null, i: number) => void} */
  choose(thing, i) {
    this.panes.forEach((pane, k) => {
      const robot = thing?.robot && pane.mission.byName.get(thing.robot.name);
      if (k === i) pane.picked = thing;
      else pane.picked = robot ? { robot } : null;
    });
    this.draw();
  }

  toggleLanes() {
    this.opener.setAttribute("aria-expanded", String(!this.lanes.isOpen)); // which gives the lanes more height
    this.lanes.toggle();
    this.draw();
  }

  /** Play; or where motion is to be reduced, or the address names a moment, stand still there. */
  open() {
    const { transport } = this;
    const { live, result } = this.options;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (live) transport.t = this.newest;
    else if (result) transport.t = this.to;
    else transport.t = still ? openingMoment(this.missions[0]) : this.from;
    const given = this.readHash();
    if (live) transport.grew();
    else if (!still && !result && !given.has("t") && given.get("play") !== "0") transport.play();
    this.draw();
  }

  /** The part of the address behind # says where to start: t (seconds), speed, play, theme, and layers as 0 or 1. */
  readHash() {
    const given = addressOptions();
    const t = Number(given.get("t"));
    if (given.has("theme")) this.setTheme(preferredTheme());
    this.legend.read(given);
    this.transport.setSpeed(Number(given.get("speed")));
    if (given.has("t") && Number.isFinite(t)) this.transport.go(t * 1000);
    if (given.get("play") === "1" && !this.transport.playing) this.transport.play();
    return given;
  }

  switchTheme() {
    this.setTheme(this.theme === "dark" ? "light" : "dark");
  }

  /** @type {(theme: string) => void} */
  setTheme(theme) {
    if (theme === this.theme) return;
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    for (const pane of this.panes) pane.map.restyle();
    this.lanes.restyle();
    this.legend.restyle();
    this.draw();
  }

  resize() {
    for (const pane of this.panes) pane.resize();
    this.lanes.restyle();
    this.drawNow(); // at once: a canvas of another size is empty
  }

  /** @type {(direction: number) => void} */
  stepPlan(direction) {
    const times = this.missions.flatMap((mission) => mission.planTimes).sort((a, b) => a - b);
    const { t } = this.transport;
    const next = direction > 0 ? times.find((one) => one > t) : times.findLast((one) => one < t);
    this.transport.go(next ?? (direction > 0 ? this.to : this.from));
  }

  /** @type {(event: KeyboardEvent) => void} */
  key(event) {
    if (isTaken(event, this.clicked()) || this.dialog.open) return;
    const actions = keyActions(this, event.shiftKey ? 60000 : 5000);
    const action = actions.get(event.key) ?? actions.get(event.key.toLowerCase());
    if (!action) return;
    event.preventDefault();
    const { target } = event; // which some browsers press when the key comes up
    if (event.key === " " && target instanceof HTMLElement && target === this.clicked()) target.blur();
    action();
  }

  chooseNothing() {
    for (const pane of this.panes) {
      pane.follow(null);
      pane.picked = null;
    }
    this.draw();
  }

  /** The missions have more lines: they are shown soon, a plan at once. */
  grew() {
    if (this.plansMade() > this.plans) this.renew();
    else if (!this.renewing) {
      const wait = this.renewed + RENEW_MS - performance.now();
      this.renewing = setTimeout(() => this.renew(), Math.max(0, wait));
    }
  }

  plansMade() {
    return this.missions.reduce((sum, mission) => sum + mission.plans.length, 0);
  }

  renew() {
    const over = this.missions.every((mission) => mission.ended);
    clearTimeout(this.renewing);
    this.renewing = 0;
    this.renewed = performance.now();
    this.plans = this.plansMade();
    this.measure();
    if (this.lanes.whole || over) this.lanes.showAll();
    this.lanes.restyle();
    this.legend.renew();
    this.transport.grew(over);
    this.drawNow(); // at once: the lanes may have another span
  }

  /** Draw everything with the next frame, once however often called. */
  draw() {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      if (!this.over.signal.aborted) this.drawNow();
    });
  }

  drawNow() {
    const { t } = this.transport;
    /** @type {Layers} */
    const layers = { ...this.legend.shown(), compared: this.panels?.plans.compares ?? false };
    const known = this.panes.map((pane) => pane.map.ground.known);
    // All are aimed before any is drawn: they may share a camera, and are compared with what the others know.
    for (const { map } of this.panes) {
      map.aim(Math.min(t, map.mission.to));
      map.compare(layers.alone ? known.filter((one) => one !== map.ground.known) : []);
    }
    for (const pane of this.panes) {
      pane.draw(t, layers);
      if (this.missions.length > 1) pane.showTimes(this.to);
    }
    this.lanes.follow(t);
    const chosen = this.panes.map((pane) => pane.focus);
    this.lanes.draw(t, chosen, layers.plan);
    this.transport.draw();
    if (this.panels) this.drawPanels(this.panels, t);
    else this.drawDifference(t);
  }

  /** @type {(panels: { team: Team, report: Report, plans: Plans }, t: number) => void} */
  drawPanels({ team, report, plans }, t) {
    const views = this.missions[0].views(t);
    team.draw(views, this.panes[0].focus.robot, t);
    report.draw(t, views);
    plans.draw(t);
  }

  /** @type {(t: number) => void} */
  drawDifference(t) {
    setText(this.outcome, outcome(this.missions, this.names));
    setText(this.lead, lead(this.missions, this.names, Math.min(t, this.newest)));
    this.difference.title = this.difference.textContent; // there may be no room for all of it
  }

  /** Stop drawing and listening. */
  close() {
    this.over.abort();
    clearTimeout(this.renewing);
    this.transport.closed = true;
    this.transport.pause();
    this.resized.disconnect();
    this.element.remove();
  }
}

/** The part of the address behind #. */
function addressOptions() {
  return new URLSearchParams(location.hash.slice(1));
}

/** The theme that the address or the system asks for. */
function preferredTheme() {
  return addressOptions().get("theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
}
