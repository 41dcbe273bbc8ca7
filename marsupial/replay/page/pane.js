/* One mission's map with what stands on it: its name and state, buttons to zoom, the card of what is chosen, and below it
   a sentence on what robots do. */

import { button, icon, make, setText } from "#draw/dom.js";
import { area, share } from "#text/format.js";
import { targetAt } from "#log/frontier.js";
import { activity } from "#text/activity.js";
import { MapView } from "#draw/map.js";
import { isOver, knownTimes, stateAt } from "#page/panels.js";
import { listenMap } from "#page/pointer.js";
import { ending, ofMeeting, ofRemaining, ofRobot, ofTarget } from "#text/why.js";

const WHOLE = "M2 2h5v2H4v3H2zM9 2h5v5h-2V4H9zM2 9h2v3h3v2H2zM12 9h2v5H9v-2h3z";

export class Pane {
  /** `head`: what stands on the map beside its known area; `changed()` requests another picture, `choose(thing)` gets
      what was clicked (null: nothing), `tip` shows what the pointer is on, `side` names the mission's colour beside
      others (null: it is alone). */
  constructor(mission, name, { head, camera, changed, choose, tip, side }) {
    Object.assign(this, { mission, name, changed, choose, tip, t: mission.from, picked: null, onPlace: null });
    this.map = new MapView(mission, name, camera, side);
    const zoom = (factor) => {
      this.follow(null);
      if (factor) this.map.camera.zoom(factor);
      else this.map.camera.fit();
      changed();
    };
    this.state = make("span", { class: "badge" });
    this.known = make("span", { class: "known" });
    this.now = make("span", { class: "now" });
    this.where = make("span", { class: "where", "aria-hidden": "true" });
    this.card = make("div", { class: "picked", role: "status", hidden: true });
    this.following = make("button", {
      type: "button",
      class: "following",
      text: "following",
      hidden: true,
      onclick: () => this.follow(null),
    });
    this.buttons = make(
      "div",
      { class: "zoom", role: "group", "aria-label": "Zoom" },
      button("Zoom in", "+", () => zoom(1.5)),
      button("Zoom out", "−", () => zoom(1 / 1.5)),
      button("Show the whole map", icon(WHOLE), () => zoom(0)),
    );
    this.chips = make("div", { class: "chips" }, ...head(name, this.state), this.known, this.following);
    this.times = make("p", { class: "times" });
    if (side) this.chips.firstElementChild.style.borderLeftColor = `var(--${side})`;
    this.element = make(
      "section",
      { class: "pane", "aria-label": `Map of ${name}` },
      make("div", { class: "stage" }, this.map.element, this.buttons, this.chips, this.card),
      make("p", { class: "activity" }, this.now, this.where),
      ...(side ? [this.times] : []),
    );
    listenMap(this.map.canvas, this.map.camera, {
      moved: () => {
        this.follow(null);
        changed();
      },
      clicked: (x, y) => {
        if (this.onPlace) this.onPlace(this.map.camera.place(x, y));
        else choose(this.thingAt(x, y));
      },
      over: (x, y, event) => {
        const hit = this.map.hit(x, y);
        this.hover(hit);
        tip.show(event, this.story(hit));
        setText(this.where, this.map.whereAt(x, y));
      },
      left: () => {
        this.hover(null);
        tip.hide();
        setText(this.where, "");
      },
    });
  }

  hover(hit) {
    const before = this.map.hovered;
    this.map.hovered = hit;
    if ((hit?.target ?? hit?.meeting) !== (before?.target ?? before?.meeting)) this.changed();
  }

  /** Elements whose change in size requires `resize`. */
  get sized() {
    return [this.map.element, this.chips];
  }

  resize() {
    const stage = this.map.element.getBoundingClientRect();
    this.map.resize(
      [this.chips, this.buttons].map((one) => {
        const { left, top, width, height } = one.getBoundingClientRect();
        return [left - stage.left, top - stage.top, width, height];
      }),
    );
  }

  /** Keep a robot in the middle; null: no more. */
  follow(robot) {
    const { camera } = this.map;
    if (camera.followed === robot && robot === null) return;
    camera.followed = camera.followed === robot ? null : robot;
    this.changed();
  }

  /** What was clicked: a thing, or the target whose frontier is there. */
  thingAt(x, y) {
    const hit = this.map.hit(x, y),
      cell = this.map.camera.cell(x, y);
    this.tip.hide();
    if (hit) return hit;
    const target = targetAt(this.map.ground, this.mission.planAt(this.t), cell);
    return target === undefined ? null : target === null ? { unplanned: cell } : { target };
  }

  /** The story of a thing on the map; null for nothing. */
  story(thing) {
    const { mission, t } = this;
    if (!thing) return null;
    if (thing.target) return ofTarget(mission, thing.target, t, this.map.ground.known);
    if (thing.meeting) return ofMeeting(mission, thing.meeting, t);
    if (thing.remaining) return ofRemaining(mission, thing.remaining);
    if (thing.unplanned) return { title: "Frontier", lines: this.unplanned() };
    const cargo = mission.robots
      .filter((robot) => mission.view(robot, t).carrier === thing.robot)
      .map((robot) => robot.name);
    return ofRobot(mission, mission.view(thing.robot, t), t, cargo);
  }

  unplanned() {
    const plan = this.mission.planAt(this.t);
    return isOver(this.mission, this.t)
      ? ["left at the end; the stop report says why"]
      : [
          plan
            ? `no target of plan ${plan.revision} lies on it: it is newer than the plan, or no robot can come near`
            : "no plan has been made yet",
        ];
  }

  /** The robot and the place that are chosen, null for none. */
  get focus() {
    const { robot = null, place, target, meeting } = this.picked ?? {};
    return { robot, place: place ?? target ?? meeting ?? null };
  }

  draw(t, show) {
    this.t = t;
    const { mission, map, focus } = this,
      own = Math.min(t, mission.to),
      over = isOver(mission, own),
      views = mission.views(own);
    const sentence = over ? { text: this.result(), names: new Set() } : activity(mission, own, views, focus.robot);
    const { text, names } = sentence;
    map.draw(own, views, show, { ...focus, names });
    setText(this.now, text);
    this.now.title = text;
    setText(this.state, stateAt(mission, own));
    this.state.className = `badge ${over ? ending(mission.ended).replace(" ", "_") : ""}`;
    this.following.hidden = !map.follows;
    if (map.follows) setText(this.following, `following ${map.camera.followed.name} ×`);
    setText(this.times, mission.ended?.known_ms ? knownTimes(mission.ended) : "");
    setText(this.known, this.knownText(own, over));
    const story = this.story(this.picked);
    this.card.hidden = !story;
    if (story) this.fillCard(story);
    map.canvas.setAttribute("aria-label", this.summary(own, views));
  }

  /** How the mission ended, and why. */
  result() {
    const { ended } = this.mission,
      word = ending(ended);
    return ended.reason.startsWith(word) ? ended.reason : `${word}: ${ended.reason}`;
  }

  /** The known area; at the end, how much of what robots could reach was explored. */
  knownText(t, over) {
    const { ended } = this.mission;
    return over
      ? `reachable ${area(ended.reachable_area_m2)}, ${share(ended.reachable_area_m2 ? ended.explored_area_m2 / ended.reachable_area_m2 : 1)} explored`
      : `known ${area(this.mission.openArea(t))}`;
  }

  fillCard({ title, lines }) {
    const text = [title, ...lines].join("\n"),
      { robot } = this.picked;
    if (text === this.cardText) return;
    this.cardText = text;
    this.card.replaceChildren(
      make("b", { text: title }),
      button("Close", "×", () => this.choose(null), { class: "close" }),
      ...lines.map((line) => make("p", { text: line })),
    );
    if (robot) {
      this.card.append(
        make("button", {
          type: "button",
          class: "follow",
          text: "Follow on the map",
          onclick: () => this.follow(robot),
        }),
      );
    }
  }

  /** The picture in a sentence, for those who do not see it. */
  summary(t, views) {
    const out = views.filter((view) => !view.carrier).length,
      plan = this.mission.planAt(t);
    return `Map of ${this.name}: ${area(this.mission.openArea(t))} known, ${out} of ${views.length} robots on the ground, ${plan ? plan.targets.length : 0} targets`;
  }
}
