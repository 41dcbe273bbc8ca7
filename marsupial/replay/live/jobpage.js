/* A planning job: its map with targets, meeting points and the ways of its best plan, lanes of that plan, and how the
   makespan falls as plans get better. */

import { make, nothing, setText } from "#draw/dom.js";
import { badge } from "#live/entrylist.js";
import { clock, count } from "#text/format.js";
import { JobLanes, JobMap, MakespanPlot } from "#live/jobdrawing.js";
import { get, post } from "#live/service.js";
import { Stream } from "#live/stream.js";

export class JobPage {
  constructor(id) {
    Object.assign(this, { id, path: `/v1/jobs/${encodeURIComponent(id)}`, plans: [], about: null, situation: null });
    this.map = new JobMap();
    this.lanes = new JobLanes();
    this.plot = new MakespanPlot();
    this.name = make("h1", { text: `job ${id.slice(0, 8)}` });
    this.state = make("span");
    this.notice = make("p", { class: "notice", role: "status", hidden: true });
    this.figure = make("b", { class: "makespan" });
    this.details = make("span", { class: "dim" });
    this.cancel = make("button", {
      type: "button",
      text: "Cancel",
      hidden: true,
      onclick: async () => this.showState(await post(`${this.path}/cancel`)),
    });
    this.ground = make(
      "section",
      { class: "card job-map" },
      make("h2", { text: "Situation and best plan" }),
      this.map.element,
      make("p", {
        class: "dim",
        text: "Lines: whole to what is explored, dashed to where robots drive. Diamonds: targets, hollow for rovers only. Square and dot: where carrier and rover meet.",
      }),
    );
    this.element = make(
      "div",
      { class: "job-page" },
      make(
        "header",
        { class: "bar-of-missions" },
        make("span", { class: "followed" }, this.name, this.state, this.cancel),
      ),
      this.notice,
      make(
        "main",
        { class: "job" },
        this.ground,
        make(
          "section",
          { class: "card" },
          make("h2", { text: "Makespan" }),
          make("p", { class: "figure-line" }, this.figure, " ", this.details),
          this.plot.element,
        ),
        make(
          "section",
          { class: "card job-lanes", tabindex: "0", "aria-label": "Who does what when" },
          make("h2", { text: "Who does what when" }),
          this.lanes.element,
        ),
      ),
    );
  }

  async begin() {
    this.resized = new ResizeObserver(() => this.draw());
    this.resized.observe(this.element);
    this.restyle = () => {
      this.map.restyle();
      this.draw();
    };
    window.addEventListener("themechange", this.restyle);
    try {
      this.showState(await get(this.path));
    } catch (error) {
      this.element.replaceChildren(
        nothing(error.status === 404 ? `There is no job ${this.id}; it may have been removed.` : error.message),
      );
      return;
    }
    this.stream = new Stream(
      `${this.path}/events`,
      (event) => this.take(event),
      (reason) => this.showNotice(reason),
    );
  }

  /** Read the situation, and the map, if there is one: there are both as soon as there is a plan. */
  async readSituation() {
    if (this.requested) return;
    this.requested = true;
    try {
      const { situation, places } = await get(`${this.path}/situation`),
        ground = places === null ? null : await get(`${this.path}/map`);
      this.situation = situation;
      this.ground.hidden = places === null; // a situation by itself says nothing of where its places are
      this.map.setSituation(situation, places, ground);
      this.draw();
    } catch (error) {
      this.showNotice(error.message);
    }
  }

  take({ type, data }) {
    const news = JSON.parse(data);
    if (type === "plan") {
      this.plans.push(news);
      this.readSituation();
    } else this.showState({ ...this.about, ...news });
    this.draw();
  }

  showNotice(text) {
    setText(this.notice, text);
    this.notice.hidden = !text;
  }

  /** Show how it stands, unless it is known to be over: answers may come later than the end in the stream. */
  showState(about) {
    if (this.about?.outcome) return;
    this.about = about;
    this.state.replaceChildren(badge(about.outcome || about.state));
    this.cancel.hidden = about.outcome !== null && about.outcome !== undefined;
    this.showNotice(about.outcome && about.detail ? about.detail : "");
  }

  /** Draw with the next picture; what comes before it is drawn in one. */
  draw() {
    if (this.drawing || this.closed) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      if (!this.closed) this.drawNow();
    });
  }

  drawNow() {
    const best = this.plans[this.plans.length - 1] ?? null,
      first = this.plans[0],
      { about } = this;
    setText(this.figure, best ? clock(best.makespan_ms, true) : "no plan yet");
    if (best) this.figure.dataset.revision = best.revision;
    const details = [about?.planner ? `by ${about.planner}` : ""];
    if (best) details.push(count(this.plans.length, "plan"), `the first one took ${clock(first.makespan_ms, true)}`);
    if (about?.lower_bound_ms) details.push(`none takes less than ${clock(about.lower_bound_ms, true)}`);
    setText(this.details, details.filter(Boolean).join(" · "));
    this.map.draw(best);
    this.lanes.draw(best, this.situation);
    this.plot.draw(this.plans, about?.lower_bound_ms ?? null);
  }

  close() {
    this.closed = true;
    this.stream?.close();
    this.resized?.disconnect();
    window.removeEventListener("themechange", this.restyle);
  }
}
