/* A mission as it goes on, or some with their clocks locked: read from its stream, paused, resumed, wound down and
   cancelled. */

import { make, nothing, setText } from "#draw/dom.js";
import { badge, missionState, robots } from "#live/entrylist.js";
import { get, getText, messageOf, post, Refused } from "#live/service.js";
import { Stream } from "#live/stream.js";
import { ZoneForm } from "#live/zoneform.js";
import { Mission, readMission } from "#log/model.js";
import { show } from "#page/app.js";
import { saveButton } from "#page/saving.js";

const WAITING = "waiting for the first look around …";

/** One mission of the service: what it is, what came of it so far, and what can be done with it. */
class Followed {
  /** @param {string} id
      @param {MissionEntry} about
      @param {() => void} changed
      @param {() => import("#page/pane.js").Pane | undefined} pane */
  constructor(id, about, changed, pane) {
    this.id = id;
    this.path = pathOf(id);
    this.about = about;
    this.changed = changed;
    /** @type {Mission | null} */
    this.mission = null; // none before its first line
    this.notice = "";
    /** @type {Stream | null} */
    this.stream = null;
    this.pause = this.button(() => (this.about.state === "paused" ? "resume" : "pause"));
    this.windDown = this.button(() => "wind-down");
    this.windDown.textContent = "Wind down";
    this.windDown.title = "End exploring: recover the rovers, then end the mission";
    this.cancel = this.button(() => "cancel");
    this.cancel.textContent = "Cancel";
    this.cancel.title = "End the mission at once; rovers stay where they are";
    this.form = new ZoneForm(this.path, pane, (text) => this.showNotice(text));
    this.zones = make("button", {
      type: "button",
      text: "Zones",
      title: "Draw where robots must not go, or should explore",
      hidden: true,
      "aria-expanded": "false",
      onclick: () => this.toggleZones(),
    });
    this.name = make("b");
    this.state = make("span");
    this.element = make(
      "span",
      { class: "followed contender" },
      this.name,
      this.state,
      this.pause,
      this.windDown,
      this.zones,
      this.cancel,
    );
    this.showState();
  }

  /** A button that controls the mission.
      @type {(control: () => string) => HTMLButtonElement} */
  button(control) {
    return make("button", { type: "button", hidden: true, onclick: () => this.order(control()) });
  }

  /** @type {(control: string) => Promise<void>} */
  async order(control) {
    try {
      this.update(await post(`${this.path}/${control}`));
    } catch (error) {
      this.showNotice(messageOf(error));
    }
    this.changed();
  }

  /** Leave the controls, but for those of zones, to one bar for several missions. */
  share() {
    for (const one of [this.pause, this.windDown, this.cancel]) one.remove();
  }

  /** Read what there is, and then what comes. Throws what `getText` throws. */
  async begin() {
    if (this.isOver) {
      const log = await this.log();
      if (log) this.mission = readMission(log);
      this.changed();
      return;
    }
    this.stream = new Stream(
      `${this.path}/events`,
      (event) => this.take(event),
      (reason) => this.over(reason),
    );
  }

  log() {
    return getText(`${this.path}/log`);
  }

  /** @type {(event: StreamEvent) => void} */
  take({ type, data }) {
    if (type === "log") {
      const line = JSON.parse(data);
      if (this.mission) this.mission.append(line);
      else this.mission = new Mission(line);
    } else if (type === "state") {
      this.showNotice(JSON.parse(data).reason || "");
      this.look();
    } else if (type === "end") this.update({ ...this.about, ...JSON.parse(data), state: "ended" });
    else return;
    this.changed();
  }

  /** Request how the mission stands: what its stream says may be older than an answer here. */
  async look() {
    const before = this.about;
    try {
      /** @type {MissionEntry} */
      const about = await get(this.path);
      if (this.about === before) this.update(about);
      else if (!this.isOver) this.look();
    } catch {
      /* the stream says when the service is back */
    }
  }

  /** @type {(reason: string) => void} */
  over(reason) {
    if (reason) this.showNotice(reason);
  }

  /** @type {(text: string) => void} */
  showNotice(text) {
    this.notice = text;
    this.changed();
  }

  /** Take how it stands, unless it is known to be over: answers may come later than the end in the stream.
      @type {(about: MissionEntry) => void} */
  update(about) {
    if (this.isOver) return;
    this.about = about;
    this.showState();
  }

  showState() {
    const { name, planner, strategy, state } = this.about;
    setText(this.name, strategy);
    this.name.title = [name, planner, robots(this.about), ...this.warnings].join("\n");
    this.state.replaceChildren(badge(missionState(this.about)));
    setText(this.pause, state === "paused" ? "Resume" : "Pause");
    const hidden = !this.goesOn;
    for (const one of [this.pause, this.cancel, this.zones]) one.hidden = hidden;
    if (hidden && !this.form.hidden) this.toggleZones();
    this.windDown.hidden = hidden || state === "winding_down";
  }

  toggleZones() {
    this.form.toggle();
    this.zones.setAttribute("aria-expanded", String(!this.form.hidden));
  }

  get isOver() {
    return this.about.state === "ended";
  }

  /** Whether it can be controlled. */
  get goesOn() {
    return !["ended", "cancelling"].includes(this.about.state);
  }

  get warnings() {
    return this.about.simulation?.warnings ?? [];
  }

  close() {
    this.stream?.close();
  }
}

export class MissionsPage {
  /** @param {string[]} ids */
  constructor(ids) {
    this.ids = ids;
    /** @type {Followed[]} */
    this.followed = [];
    this.notice = make("p", { class: "notice", role: "status" });
    this.stage = make(
      "div",
      { class: "stage-of-view" },
      make("main", { class: "notice" }, make("h1", { text: WAITING })),
    );
    this.controls = make("div", { class: "bar-of-missions" });
    this.pause = this.forAll(() => (this.isPaused ? "resume" : "pause"));
    this.windDown = this.forAll(() => "wind-down", "Wind all down");
    this.cancel = this.forAll(() => "cancel", "Cancel all");
    this.element = make("div", { class: "missions-page" }, this.controls, this.notice, this.stage);
    this.bar = document.querySelector("#bar"); // there is one head on a page: that of the view, once there is one
    /** @type {ReturnType<typeof show> | null} */
    this.view = null;
    /** @type {string[]} */
    this.lost = []; // why missions are not shown
    this.reading = true; // not all missions have begun to be read
    this.renewing = false;
    this.closed = false;
  }

  async begin() {
    for (const id of this.ids) {
      try {
        await this.follow(id);
      } catch (error) {
        const isGone = error instanceof Refused && error.status === 404;
        this.lost.push(isGone ? `There is no mission ${id}; it may have been removed.` : messageOf(error));
      }
      if (this.closed) return;
    }
    this.reading = false;
    if (!this.followed.length) this.stage.replaceChildren(nothing(this.lost.join("\n")));
    this.renew();
  }

  /** Begin to read a mission. Throws what `get` throws.
      @type {(id: string) => Promise<void>} */
  async follow(id) {
    const one = new Followed(
      id,
      await get(pathOf(id)),
      () => this.renew(),
      () => this.view?.panes[this.followed.indexOf(one)],
    );
    if (this.closed) return;
    await one.begin();
    this.followed.push(one);
    this.controls.append(one.element);
  }

  /** A button that controls all missions that go on.
      @type {(control: () => string, text?: string) => HTMLButtonElement} */
  forAll(control, text) {
    const onclick = () => {
      const order = control();
      for (const one of this.followed) if (one.goesOn) one.order(order);
    };
    return make("button", { type: "button", text, onclick });
  }

  /** Whether all missions that go on are paused. */
  get isPaused() {
    return this.followed.every((one) => !one.goesOn || one.about.state === "paused");
  }

  /** Show what is new with the next picture. */
  renew() {
    if (this.renewing) return;
    this.renewing = true;
    requestAnimationFrame(() => {
      this.renewing = false;
      if (!this.closed) this.update();
    });
  }

  update() {
    const notices = [...this.lost, ...this.followed.flatMap((one) => [one.notice, ...one.warnings])];
    const text = [...new Set(notices)].filter(Boolean).join("\n");
    setText(this.notice, text);
    this.notice.hidden = !text || !this.followed.length;
    setText(this.pause, this.isPaused ? "Resume all" : "Pause all");
    const isOver = !this.followed.some((one) => one.goesOn);
    for (const one of [this.pause, this.windDown, this.cancel]) one.hidden = isOver;
    if (this.view) this.view.grew();
    else if (!this.reading) this.open();
  }

  /** Show the missions, once all have their first line. */
  open() {
    const missions = this.followed.flatMap((one) => one.mission ?? []);
    if (!missions.length || missions.length < this.followed.length) return;
    const live = !this.followed.every((one) => one.isOver);
    const many = missions.length > 1;
    if (many) for (const one of this.followed) one.share();
    const home = make("a", { href: "#/", class: "home", "aria-label": "All missions", title: "All missions" });
    this.view = show(this.stage, missions, {
      live,
      result: !live,
      rate: live ? this.rate() : null,
      save: saveButton(missions.length, () => this.logs()),
      controls: this.followed.map((one) => one.element),
      shared: many ? [this.pause, this.windDown, this.cancel] : [],
      home: [home],
    });
    this.bar?.toggleAttribute("hidden", true);
  }

  /** How fast the clock of missions goes that nobody paused, where that is known. */
  rate() {
    const [first, ...speeds] = this.followed.map((one) => one.about.simulation?.speed ?? null);
    return speeds.every((speed) => speed === first) ? first : null;
  }

  /** The missions' logs as they are now.
      @type {() => Promise<NamedLog[]>} */
  async logs() {
    try {
      const { followed } = this;
      const texts = await Promise.all(followed.map((one) => one.log()));
      return followed.map(({ about }, i) => ({ text: texts[i], name: `${about.name}-${about.strategy}` }));
    } catch (error) {
      this.followed[0].showNotice(messageOf(error));
      return [];
    }
  }

  close() {
    this.closed = true;
    this.bar?.toggleAttribute("hidden", false);
    for (const one of this.followed) one.close();
    this.view?.close();
  }
}

/** @type {(id: string) => string} */
function pathOf(id) {
  return `/v1/missions/${encodeURIComponent(id)}`;
}
