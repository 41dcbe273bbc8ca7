/* The player: a view of one mission, or of some side by side with their clocks locked. `show` makes it.

   Theory of operation. Data flows one way, from log lines to canvases, and nothing below draws by itself:

     log lines --append--> Mission (model.js)      all that follows from a log, as values over time
                             |   history.js: values that hold from a moment on; knownmap.js: the map in tiles
                             |   queried for a moment t: views(t), planAt(t), knownMap()
                             v
     Transport (transport.js) --t--> View.draw ----> Pane per mission (pane.js): map.js and its layers, what was clicked
       the clock: play, speed,        at most one    Lanes (lanes.js): the timeline below
       scrubbing, the live moment     per frame      Panels (panels.js), or for several missions the difference

   What is chosen by a click, wherever, is given to all of them (`choose`): a robot in every mission that has it.

   A replay file (file.js) appends all lines before it calls `show`. The page of the service (live.js) calls `show` after
   the first line, appends lines as they arrive, and calls `grew()`, which draws new plans at once and the rest at most
   every RENEW_MS. Both draw in the same way: any moment t can be drawn from a Mission at any time, forwards or backwards,
   so scrubbing, playing and live differ only in who sets t.

   What is costly is kept: what of the timeline does not depend on t is on a canvas of its own, drawn again only for
   another size, theme or span, or for new lines, and a map that moves through time repaints only the tiles that differ.
   `draw()` may be called at every change; it requests one frame, and `drawNow()` draws everything for the present t.
   `restyle()` is for what depends on size, theme, span or the lines so far, not on t.

   Missions share one Transport and one Lanes. The span is that of all; while they go on, the newest moment is that of the
   slowest one, so that they can be compared; those that have ended don't count. */

import { Camera, shareFrame } from "#draw/camera.js";
import { sideColour } from "#draw/colours.js";
import { button, icon, make, setText } from "#draw/dom.js";
import { lead, outcome, sideNames } from "#text/difference.js";
import { count, listed, metres } from "#text/format.js";
import { isTaken, keysDialog } from "#page/keys.js";
import { Lanes } from "#draw/lanes.js";
import { laneLegend, mapLegend } from "#draw/legend.js";
import { Pane } from "#page/pane.js";
import { Plans, Report, Team } from "#page/panels.js";
import { listenLanes } from "#page/pointer.js";
import { openingMoment } from "#log/opening.js";
import { Tip } from "#page/tip.js";
import { Transport } from "#page/transport.js";
import { decider } from "#text/why.js";

const ALONE = ["alone", "what one alone knows", true]; // of missions side by side in one frame
const LAYERS = [
  ["plan", "plan", true],
  ["trails", "trails", true],
  ["labels", "all names", false],
  ["sensors", "sensor range", false],
];
const HALF_FULL = "M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 1.6v10.8a5.4 5.4 0 0 1 0-10.8z";
const RENEW_MS = 250; // so often at most, what a live mission has more is shown, but for plans: drawing its lanes takes longest

/** Put a view of `missions` (each with its first line) in `container`.

    `options`: `live` (the view goes with the newest moment), `result` (it opens with the end), `rate` (live: seconds of
    the mission a second, where that is known), `save` (`[label, function]`, a button), `home` (first in the head),
    `controls` (for each mission, what stands in the place of its name and state). Returns the view: call `grew()`
    after a mission has got more lines, `close()` when it is over. */
export function show(container, missions, options = {}) {
  return new View(container, missions, options);
}

class View {
  constructor(container, missions, options) {
    Object.assign(this, {
      container,
      missions,
      options,
      over: new AbortController(),
      drawing: false,
      from: Math.min(...missions.map((one) => one.from)),
      renewed: performance.now(),
      renewing: 0,
      plans: 0,
    });
    this.measure();
    this.names = sideNames(missions);
    this.tip = new Tip();
    this.transport = new Transport(
      () => this.span(),
      () => this.draw(),
      (direction) => this.stepPlan(direction),
      { ...options, newest: () => this.newest },
    );
    const shared = shareFrame(missions) ? new Camera(missions) : null;
    this.alike = missions.length > 1 && shared !== null; // whether a cell is the same place in all of several missions
    this.panes = missions.map(
      (mission, i) =>
        new Pane(mission, this.names[i], {
          camera: shared ?? new Camera([mission]),
          side: missions.length > 1 ? sideColour(i) : null,
          head: (name, state) =>
            missions.length > 1
              ? [options.controls?.[i] ?? make("span", { class: "contender" }, make("b", { text: name }), state)]
              : [],
          changed: () => this.draw(),
          choose: (thing) => this.choose(thing, i),
          tip: this.tip,
        }),
    );
    this.lanes = new Lanes(missions, this.names);
    this.build();
    this.listen();
    this.setTheme(this.preferredTheme());
    this.resized = new ResizeObserver(() => this.resize());
    for (const element of [...this.panes.flatMap((pane) => pane.sized), this.lanes.element]) {
      this.resized.observe(element);
    }
    this.open();
  }

  /** Note how far the logs go, which is as far as missions are shown: the end of all, and the newest moment
      that is known of all; of two that go on, the slower one is waited for. */
  measure() {
    const open = this.missions.filter((mission) => !mission.ended);
    this.to = Math.max(...this.missions.map((mission) => mission.to));
    this.newest = open.length ? Math.min(...open.map((mission) => mission.to)) : this.to;
  }

  span() {
    return [this.from, this.to];
  }

  build() {
    const two = this.missions.length > 1;
    const shown = this.alike ? [...LAYERS, ALONE] : LAYERS;
    const box = (on) => make("input", { type: "checkbox", checked: on, onchange: () => this.draw() });
    this.layers = Object.fromEntries(shown.map(([id, , on]) => [id, box(on)]));
    this.dialog = keysDialog();
    this.difference = make("p", { class: "difference", role: "status" }, make("b"), " ", make("span"));
    this.mapLegend = make("ul", { "aria-label": "Legend of the map" });
    this.laneLegend = make("ul", { "aria-label": "Legend of the timeline" });
    const toggles = shown.map(([id, name]) => make("label", {}, this.layers[id], name));
    const layers = make("div", { class: "layers", role: "group", "aria-label": "What the map shows" }, ...toggles);
    const legend = make(
      "details",
      { class: "legend" },
      make("summary", { text: "Legend" }),
      make("div", { class: "card" }, layers, this.mapLegend, this.laneLegend),
    );
    this.opener = button("Open the lanes", "Lanes", () => this.toggleLanes(), {
      class: "opener",
      "aria-expanded": "false",
    });
    this.transport.element.append(this.opener);
    const time = make(
      "section",
      { class: "time", "aria-label": "Time" },
      this.transport.element,
      make("div", { class: "lanes-box" }, this.lanes.element),
    );
    this.panels = two ? [] : this.makePanels();
    this.element = make(
      "div",
      { class: `view ${two ? "two" : "one"}` },
      this.head(legend),
      make(
        "main",
        {},
        make(
          "div",
          { class: "panes", style: `--columns: ${[1, 2, 3, 2, 3, 3][this.missions.length - 1]}` },
          ...this.panes.map((pane) => pane.element),
        ),
        time,
        ...(two ? [] : [make("aside", {}, ...this.panels.element)]),
      ),
      this.tip.element,
      this.dialog,
    );
    this.container.replaceChildren(this.element);
  }

  head(legend) {
    const [{ start, robots, resolution }] = this.missions,
      carriers = robots.filter((robot) => robot.carrier).length,
      two = this.missions.length > 1;
    const facts = [
      ...(two ? [listed(this.names)] : [decider(this.missions[0])]),
      `seed ${start.seed}`,
      `${count(carriers, "carrier")}, ${count(robots.length - carriers, "rover")}`,
      `${metres(start.width * resolution)} x ${metres(start.height * resolution)} at ${Number(resolution.toPrecision(3))} m a cell`,
    ];
    const { save, home = [], controls } = this.options,
      buttons = [legend];
    if (save) {
      buttons.push(
        make("button", {
          type: "button",
          text: save[0],
          title: "Save the mission log as JSON lines",
          onclick: save[1],
        }),
      );
    }
    buttons.push(
      button("Keys", "?", () => this.dialog.showModal(), { class: "keys-button" }),
      button("Switch between light and dark", icon(HALF_FULL), () =>
        this.setTheme(this.theme === "dark" ? "light" : "dark"),
      ),
    );
    const subtitle = facts.join(" · "),
      title = make("h1", { text: start.scenario || "Mission", title: subtitle });
    return make(
      "header",
      {},
      ...home,
      title,
      two ? this.difference : make("p", { class: "subtitle", text: subtitle, title: subtitle }),
      ...(two ? [] : (controls ?? [this.panes[0].state])),
      ...buttons,
    );
  }

  makePanels() {
    const [mission] = this.missions,
      [pane] = this.panes,
      go = (t) => this.transport.go(t);
    const panels = {
      team: new Team(mission, (robot) => this.choose(pane.focus.robot === robot ? null : { robot }, 0)),
      report: new Report(mission, (frontier) => {
        go(mission.to);
        pane.map.camera.centre(...frontier.cell);
        this.choose({ remaining: frontier }, 0);
      }),
      plans: new Plans(mission, go),
    };
    const card = make("section", { class: "card", "aria-label": "Team" }, panels.team.element);
    return { ...panels, element: [card, panels.report.element, panels.plans.element] };
  }

  listen() {
    const { signal } = this.over;
    document.addEventListener("keydown", (event) => this.key(event), { signal });
    window.addEventListener("hashchange", () => this.readHash(), { signal });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.setTheme(this.preferredTheme()), {
      signal,
    });
    const { lanes } = this;
    listenLanes(lanes.canvas, {
      seek: (x, y) => this.seek(x),
      clicked: (x, y) => this.chooseLane(x, y),
      over: (x, y, event) => this.tip.show(event, lanes.story(x, y)),
      left: () => this.tip.hide(),
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

  /** Go to a point of the timeline, if it is one. */
  seek(x) {
    if (x < this.lanes.gutter) return false;
    this.transport.go(this.lanes.time(x));
    return true;
  }

  /** Choose what was clicked on the lanes: a robot, and where it is at work then. */
  chooseLane(x, y) {
    const row = this.lanes.row(y);
    if (row?.robot) this.choose(this.lanes.thingAt(x, row), row.i);
  }

  /** Choose a thing of the i-th mission (null: nothing), wherever it is shown; a robot in every mission that has it. */
  choose(thing, i) {
    this.panes.forEach((pane, k) => {
      const robot = thing?.robot && pane.mission.byName.get(thing.robot.name);
      pane.picked = k === i ? thing : robot ? { robot } : null;
    });
    this.draw();
  }

  toggleLanes() {
    this.lanes.toggle();
    this.opener.setAttribute("aria-expanded", String(this.lanes.isOpen));
    this.draw();
  }

  /** Play; or where motion is to be reduced, or the address names a moment, stand still there. */
  open() {
    const { transport } = this,
      still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const { live, result } = this.options;
    transport.t = live ? this.newest : result ? this.to : still ? openingMoment(this.missions[0]) : this.from;
    const given = this.readHash();
    if (live) transport.grew();
    else if (!still && !result && !given.has("t") && given.get("play") !== "0") transport.play();
    this.draw();
  }

  /** The part of the address behind # says where to start: t (seconds), speed, play, theme, and layers as 0 or 1. */
  readHash() {
    const given = new URLSearchParams(location.hash.slice(1)),
      t = Number(given.get("t"));
    if (given.has("theme")) this.setTheme(this.preferredTheme());
    for (const id of Object.keys(this.layers)) if (given.has(id)) this.layers[id].checked = given.get(id) !== "0";
    this.transport.setSpeed(Number(given.get("speed")));
    if (given.has("t") && Number.isFinite(t)) this.transport.go(t * 1000);
    if (given.get("play") === "1" && !this.transport.playing) this.transport.play();
    return given;
  }

  preferredTheme() {
    return (
      new URLSearchParams(location.hash.slice(1)).get("theme") ||
      (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")
    );
  }

  setTheme(theme) {
    if (theme === this.theme) return;
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    for (const pane of this.panes) pane.map.restyle();
    this.lanes.restyle();
    this.drawLegend();
    this.laneLegend.replaceChildren(...laneLegend(this.missions));
    this.draw();
  }

  /** Draw the legend of the map, which has the terrains and zones that were seen so far. */
  drawLegend() {
    this.mapLegend.replaceChildren(...mapLegend(this.missions));
    this.explained = this.signs();
  }

  signs() {
    return this.missions.reduce((sum, mission) => sum + mission.sightings.codes.size + mission.zones.values.length, 0);
  }

  resize() {
    for (const pane of this.panes) pane.resize();
    this.lanes.restyle();
    this.drawNow(); // at once: a canvas of another size is empty
  }

  stepPlan(direction) {
    const times = this.missions.flatMap((mission) => mission.planTimes).sort((a, b) => a - b),
      { t } = this.transport;
    const next = direction > 0 ? times.find((one) => one > t) : times.findLast((one) => one < t);
    this.transport.go(next ?? this.span()[direction > 0 ? 1 : 0]);
  }

  key(event) {
    if (isTaken(event) || this.dialog.open) return;
    const { transport } = this,
      leap = event.shiftKey ? 60000 : 5000,
      go = (t) => transport.go(t);
    const flip = (id) => {
      this.layers[id].checked = !this.layers[id].checked;
      this.draw();
    };
    const keys = {
      " ": () => transport.toggle(),
      ArrowLeft: () => go(transport.t - leap),
      ArrowRight: () => go(transport.t + leap),
      "+": () => transport.changeSpeed(1),
      "=": () => transport.changeSpeed(1),
      "-": () => transport.changeSpeed(-1),
      "?": () => this.dialog.showModal(),
      "[": () => this.stepPlan(-1),
      "]": () => this.stepPlan(1),
      Home: () => go(this.span()[0]),
      End: () => go(this.span()[1]),
      n: () => flip("labels"),
      l: () => flip("labels"),
      s: () => flip("sensors"),
      p: () => flip("plan"),
      t: () => flip("trails"),
      f: () => {
        for (const pane of this.panes) {
          pane.follow(null);
          pane.map.camera.fit();
        }
        this.draw();
      },
      d: () => this.setTheme(this.theme === "dark" ? "light" : "dark"),
      Escape: () => {
        for (const pane of this.panes) pane.follow(null);
        this.choose(null);
      },
      o: () => this.toggleLanes(),
    };
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** The missions have more lines: they are shown soon, a plan at once. */
  grew() {
    if (this.plansMade() > this.plans) this.renew();
    else if (!this.renewing) {
      this.renewing = setTimeout(() => this.renew(), Math.max(0, this.renewed + RENEW_MS - performance.now()));
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
    if (this.explained !== this.signs()) this.drawLegend();
    this.transport.grew(over);
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
    const { t } = this.transport,
      show = Object.fromEntries(Object.entries(this.layers).map(([id, box]) => [id, box.checked]));
    // All are aimed before any is drawn: they may share a camera.
    for (const { map } of this.panes) {
      map.aim(Math.min(t, map.mission.to));
      map.compare(show.alone ? this.missions.filter((one) => one !== map.mission) : []);
    }
    for (const pane of this.panes) pane.draw(t, show);
    this.lanes.follow(t);
    this.lanes.draw(
      t,
      this.panes.map((pane) => pane.focus),
    );
    this.transport.draw();
    if (this.missions.length > 1) this.drawDifference(t);
    else this.drawPanels(t);
  }

  drawPanels(t) {
    const [mission] = this.missions,
      views = mission.views(t),
      { team, report, plans } = this.panels;
    team.draw(views, this.panes[0].focus.robot, t);
    report.draw(t, views);
    plans.draw(t);
  }

  drawDifference(t) {
    setText(this.difference.firstChild, outcome(this.missions, this.names));
    setText(this.difference.lastChild, lead(this.missions, this.names, Math.min(t, this.newest)));
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
