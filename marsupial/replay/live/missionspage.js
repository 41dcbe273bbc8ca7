/* A mission as it goes on, or some with their clocks locked: read from its stream, paused, resumed, wound down and cancelled. */

import { show } from "#page/app.js";
import { make, nothing, setText } from "#draw/dom.js";
import { badge, missionState, robots } from "#live/entrylist.js";
import { Mission, readMission } from "#log/model.js";
import { saveButton } from "#page/saving.js";
import { get, getText, post } from "#live/service.js";
import { Stream } from "#live/stream.js";
import { ZoneForm } from "#live/zoneform.js";

const WAITING = "waiting for the first look around …";

/** One mission of the service: what it is, what came of it so far, and what can be done with it. */
class Followed {
  constructor(id, news, pane) {
    Object.assign(this, {
      id,
      path: `/v1/missions/${encodeURIComponent(id)}`,
      news,
      model: new Mission(),
      lines: 0,
      about: null,
      notice: "",
    });
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
      onclick: () => {
        if (pane()) this.toggleZones();
      },
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
      this.form.element,
    );
  }

  button(control) {
    return make("button", {
      type: "button",
      hidden: true,
      onclick: async () => {
        try {
          this.showState(await post(`${this.path}/${control()}`));
        } catch (error) {
          this.showNotice(error.message);
        }
      },
    });
  }

  /** Read what there is, and then what comes. Throws what `get` throws. */
  async begin() {
    this.showState(await get(this.path));
    if (this.about.state === "ended") {
      const log = await this.log();
      if (log) {
        this.model = readMission(log);
        this.lines = this.model.lines;
      }
      this.news();
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

  take({ type, data }) {
    if (type === "log") {
      this.model.append(JSON.parse(data));
      this.lines++;
    } else if (type === "state") {
      this.showNotice(JSON.parse(data).reason || "");
      this.look();
    } else if (type === "end") {
      this.showState({ ...this.about, ...JSON.parse(data), state: "ended" });
    } else return;
    this.news();
  }

  /** Request how the mission stands: what its stream says may be older than an answer here. */
  async look() {
    const before = this.about;
    try {
      const about = await get(this.path);
      if (this.about === before) this.showState(about);
      else if (!this.isOver) this.look();
    } catch {
      /* the stream says when the service is back */
    }
  }

  over(reason) {
    if (reason) this.showNotice(reason);
  }

  showNotice(text) {
    this.notice = text;
    this.news();
  }

  /** Show how it stands, unless it is known to be over: answers may come later than the end in the stream. */
  showState(about) {
    if (this.isOver) return;
    this.about = about;
    const { state, simulation } = about;
    setText(this.name, about.strategy);
    this.name.title = [about.name, about.planner, robots(about), ...(simulation ? simulation.warnings : [])].join("\n");
    this.state.replaceChildren(badge(missionState(about)));
    setText(this.pause, state === "paused" ? "Resume" : "Pause");
    this.pause.hidden = this.cancel.hidden = this.zones.hidden = state === "ended" || state === "cancelling";
    if (this.zones.hidden && !this.form.hidden) this.toggleZones();
    this.windDown.hidden = this.pause.hidden || state === "winding_down";
  }

  toggleZones() {
    this.form.toggle();
    this.zones.setAttribute("aria-expanded", String(!this.form.hidden));
  }

  get isOver() {
    return this.about !== null && this.about.state === "ended";
  }

  close() {
    this.stream?.close();
  }
}

export class MissionsPage {
  constructor(ids) {
    this.followed = ids.map((id) => {
      const one = new Followed(
        id,
        () => this.renew(),
        () => this.view?.panes[this.followed.indexOf(one)],
      );
      return one;
    });
    this.notice = make("p", { class: "notice", role: "status" });
    this.stage = make(
      "div",
      { class: "stage-of-view" },
      make("main", { class: "notice" }, make("h1", { text: WAITING })),
    );
    this.element = make(
      "div",
      { class: "missions-page" },
      make("div", { class: "bar-of-missions" }, ...this.followed.map((one) => one.element)),
      this.notice,
      this.stage,
    );
    this.bar = document.getElementById("bar"); // there is one head on a page: that of the view, once there is one
    this.view = null;
    this.lost = [];
    this.renewing = false;
  }

  async begin() {
    for (const one of this.followed) {
      try {
        await one.begin();
      } catch (error) {
        this.drop(
          one,
          error.status === 404 ? `There is no mission ${one.id}; it may have been removed.` : error.message,
        );
      }
    }
  }

  /** Show the others only: there is nothing to be had of this one. */
  drop(one, why) {
    this.followed = this.followed.filter((other) => other !== one);
    this.lost.push(why);
    one.element.remove();
    if (!this.followed.length) this.stage.replaceChildren(nothing(this.lost.join("\n")));
    this.renew();
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
    const notices = [...new Set([...this.lost, ...this.followed.flatMap((one) => [one.notice, ...warningsOf(one)])])]
      .filter(Boolean)
      .join("\n");
    setText(this.notice, notices);
    this.notice.hidden = !notices || !this.followed.length;
    if (this.view === null) {
      if (!this.followed.length || this.followed.some((one) => one.model.start === null)) return;
      const live = !this.followed.every((one) => one.isOver),
        save = saveButton(this.followed.length, () => this.logs());
      this.view = show(
        this.stage,
        this.followed.map((one) => one.model),
        {
          live,
          result: !live,
          rate: live ? this.rate() : null,
          save,
          controls: this.followed.map((one) => one.element),
          home: [make("a", { href: "#/", class: "home", "aria-label": "All missions", title: "All missions" })],
        },
      );
      this.bar.hidden = true;
    } else this.view.grew();
  }

  /** How fast the clock of missions goes that nobody paused, where that is known. */
  rate() {
    const speeds = this.followed.map((one) => one.about.simulation?.speed ?? null);
    return speeds.every((speed) => speed !== null && speed === speeds[0]) ? speeds[0] : null;
  }

  /** The missions' logs as they are now. */
  async logs() {
    try {
      return await Promise.all(
        this.followed.map(async (one) => ({ text: await one.log(), name: `${one.about.name}-${one.about.strategy}` })),
      );
    } catch (error) {
      this.followed[0].showNotice(error.message);
      return [];
    }
  }

  close() {
    this.closed = true;
    this.bar.hidden = false;
    for (const one of this.followed) one.close();
    this.view?.close();
  }
}

function warningsOf({ about }) {
  return about?.simulation?.warnings ?? [];
}
