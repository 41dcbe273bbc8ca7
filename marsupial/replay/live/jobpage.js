/* A planning job: its map with targets, meeting points and the ways of its best plan, lanes of that plan, and how the
   makespan falls as plans get better. */

import { make, nothing, setText } from "#draw/dom.js";
import { badge } from "#live/entrylist.js";
import { JobLanes, JobMap, MakespanPlot } from "#live/jobdrawing.js";
import { get, messageOf, post, Refused } from "#live/service.js";
import { Stream } from "#live/stream.js";
import { clock, count } from "#text/format.js";

const KEY =
  "Lines: whole to what is explored, dashed to where robots drive. Diamonds: targets, hollow for rovers only. " +
  "Square and dot: where carrier and rover meet.";

export class JobPage {
  /** @param {string} id */
  constructor(id) {
    this.id = id;
    this.path = `/v1/jobs/${encodeURIComponent(id)}`;
    /** @type {JobPlan[]} */
    this.plans = [];
    /** @type {JobEntry | null} */
    this.about = null;
    /** @type {Situation | null} */
    this.situation = null;
    this.requested = false; // the situation
    this.drawing = false;
    this.closed = new AbortController();
    /** @type {Stream | null} */
    this.stream = null;
    this.map = new JobMap();
    this.lanes = new JobLanes();
    this.plot = new MakespanPlot();
    this.state = make("span");
    this.notice = make("p", { class: "notice", role: "status", hidden: true });
    this.figure = make("b", { class: "makespan" });
    this.details = make("span", { class: "dim" });
    const cancel = async () => this.update(await post(`${this.path}/cancel`));
    this.cancel = make("button", { type: "button", text: "Cancel", hidden: true, onclick: cancel });
    this.ground = make(
      "section",
      { class: "card job-map" },
      make("h2", { text: "Situation and best plan" }),
      this.map.element,
      make("p", { class: "dim", text: KEY }),
    );
    const name = make("h1", { text: `job ${id.slice(0, 8)}` });
    const title = "Who does what when";
    this.element = make(
      "div",
      { class: "job-page" },
      make("header", { class: "bar-of-missions" }, make("span", { class: "followed" }, name, this.state, this.cancel)),
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
          { class: "card job-lanes", tabindex: "0", "aria-label": title },
          make("h2", { text: title }),
          this.lanes.element,
        ),
      ),
    );
  }

  async begin() {
    const { signal } = this.closed;
    const resized = new ResizeObserver(() => this.draw());
    resized.observe(this.element);
    signal.addEventListener("abort", () => resized.disconnect());
    window.addEventListener("themechange", () => this.restyle(), { signal });
    try {
      this.update(await get(this.path));
    } catch (error) {
      const isGone = error instanceof Refused && error.status === 404;
      const why = isGone ? `There is no job ${this.id}; it may have been removed.` : messageOf(error);
      this.element.replaceChildren(nothing(why));
      return;
    }
    if (signal.aborted) return;
    this.stream = new Stream(
      `${this.path}/events`,
      (event) => this.take(event),
      (reason) => this.showNotice(reason),
    );
  }

  restyle() {
    this.map.restyle();
    this.draw();
  }

  /** Read the situation, and the map, if there is one: there are both as soon as there is a plan. */
  async readSituation() {
    if (this.requested) return;
    this.requested = true;
    try {
      /** @type {{ situation: Situation, places: PlaceCells | null }} */
      const { situation, places } = await get(`${this.path}/situation`);
      this.situation = situation;
      this.ground.hidden = places === null; // a situation by itself has no places on a map
      if (places) this.map.setSituation(situation, places, await get(`${this.path}/map`));
      this.draw();
    } catch (error) {
      this.showNotice(messageOf(error));
    }
  }

  /** @type {(event: StreamEvent) => void} */
  take({ type, data }) {
    const news = JSON.parse(data);
    if (type === "plan") {
      this.plans.push(news);
      this.readSituation();
    } else this.update({ ...this.about, ...news });
    this.draw();
  }

  /** @type {(text: string) => void} */
  showNotice(text) {
    setText(this.notice, text);
    this.notice.hidden = !text;
  }

  /** Take how it stands, unless it is known to be over: answers may come later than the end in the stream.
      @type {(about: JobEntry) => void} */
  update(about) {
    if (this.about?.outcome) return;
    this.about = about;
    this.state.replaceChildren(badge(about.outcome || about.state));
    this.cancel.hidden = Boolean(about.outcome);
    this.showNotice(about.outcome && about.detail ? about.detail : "");
  }

  /** Draw with the next picture; what comes before it is drawn in one. */
  draw() {
    if (this.drawing || this.closed.signal.aborted) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      if (!this.closed.signal.aborted) this.drawNow();
    });
  }

  drawNow() {
    const best = this.plans.at(-1) ?? null;
    const bound = this.about?.lower_bound_ms ?? null;
    const details = this.about ? [`by ${this.about.planner}`] : [];
    setText(this.figure, best ? clock(best.makespan_ms, true) : "no plan yet");
    if (best) {
      const first = clock(this.plans[0].makespan_ms, true);
      this.figure.dataset.revision = String(best.revision);
      details.push(count(this.plans.length, "plan"), `the first one took ${first}`);
    }
    if (bound) details.push(`none takes less than ${clock(bound, true)}`);
    setText(this.details, details.join(" · "));
    this.map.draw(best);
    this.lanes.draw(best, this.situation);
    this.plot.draw(this.plans, bound);
  }

  close() {
    this.closed.abort();
    this.stream?.close();
  }
}
