/* One mission's map with what stands on it: buttons to zoom, labels of areas, and the card of what was clicked. */

import { button, icon, make, setText } from "./dom.js";
import { area, share } from "./format.js";
import { targetAt } from "./frontier.js";
import { MapView } from "./map.js";
import { isOver, stateAt } from "./panels.js";
import { listenMap } from "./pointer.js";
import { ofMeeting, ofRemaining, ofRobot, ofTarget } from "./why.js";

const WHOLE = "M2 2h5v2H4v3H2zM9 2h5v5h-2V4H9zM2 9h2v3h3v2H2zM12 9h2v5H9v-2h3z";

export class Pane {
  /** `changed()` asks for another picture; `tip` shows what the pointer is on. */
  constructor(mission, name, headed, changed, tip) {
    Object.assign(this, { mission, name, changed, tip, t: mission.from, picked: null, taker: null });
    this.map = new MapView(mission, name);
    const zoom = (factor) => { this.follow(null); if (factor) this.map.camera.zoom(factor); else this.map.camera.fit(); changed(); };
    this.state = make("span", { class: "badge" });
    this.known = make("p", { class: "known" });
    this.where = make("p", { class: "where", "aria-hidden": "true" });
    this.card = make("div", { class: "picked", role: "status", hidden: true });
    this.following = make("button", { type: "button", class: "following", text: "following", hidden: true, onclick: () => this.follow(null) });
    this.buttons = make("div", { class: "zoom", role: "group", "aria-label": "Zoom" },
      button("Zoom in", "+", () => zoom(1.5)), button("Zoom out", "−", () => zoom(1 / 1.5)), button("Show the whole map", icon(WHOLE), () => zoom(0)));
    this.element = make("section", { class: "pane", "aria-label": `Map of ${name}` },
      ...(headed ? [make("h2", { class: "pane-head" }, make("span", { text: name }), this.state)] : []),
      make("div", { class: "stage" }, this.map.element, this.buttons, make("div", { class: "chips" }, this.known, this.following), this.card, this.where));
    listenMap(this.map.canvas, this.map.camera, {
      moved: () => { this.follow(null); changed(); }, clicked: (x, y) => { if (this.taker) this.taker(this.map.camera.place(x, y)); else this.pick(x, y); },
      over: (x, y, event) => { tip.show(event, this.story(this.map.hit(x, y))); setText(this.where, this.map.whereAt(x, y)); },
      left: () => { tip.hide(); setText(this.where, ""); },
    });
  }

  /** What a change in size of which asks for `resize`. */
  get sized() { return [this.map.element, this.known]; }

  resize() {
    const stage = this.map.element.getBoundingClientRect();
    this.map.resize([this.known, this.buttons].map((one) => {
      const { left, top, width, height } = one.getBoundingClientRect();
      return [left - stage.left, top - stage.top, width, height];
    }));
  }

  /** Keep a robot in the middle; null: no more. */
  follow(robot) {
    if (this.map.followed === robot && robot === null) return;
    this.map.followed = this.map.followed === robot ? null : robot;
    this.following.hidden = this.map.followed === null;
    if (this.map.followed) setText(this.following, `following ${robot.name} ×`);
    this.changed();
  }

  /** Show a frontier that is left. */
  show(frontier) {
    this.map.camera.centre(...frontier.cell);
    this.picked = { remaining: frontier };
    this.changed();
  }

  /** Take what was clicked: a thing, or the target whose frontier is there. */
  pick(x, y) {
    const hit = this.map.hit(x, y), cell = this.map.camera.cell(x, y), plan = this.mission.planAt(this.t);
    const target = hit ? undefined : targetAt(this.map.ground, plan, cell);
    this.tip.hide();
    this.picked = hit || (target === undefined ? null : target === null ? { unplanned: cell } : { target });
    this.changed();
  }

  unpick() { this.picked = null; this.changed(); }

  /** What is to be told of a thing on the map; null for nothing. */
  story(thing) {
    const { mission, t } = this;
    if (!thing) return null;
    if (thing.target) return ofTarget(mission, thing.target, t, this.map.ground.known);
    if (thing.meeting) return ofMeeting(mission, thing.meeting, t);
    if (thing.remaining) return ofRemaining(mission, thing.remaining);
    if (thing.unplanned) return { title: "Frontier", lines: this.unplanned() };
    const cargo = mission.robots.filter((robot) => mission.view(robot, t).carrier === thing.robot).map((robot) => robot.name);
    return ofRobot(mission, mission.view(thing.robot, t), t, cargo);
  }

  unplanned() {
    const plan = this.mission.planAt(this.t);
    return isOver(this.mission, this.t) ? ["left at the end; the stop report says why"]
      : [plan ? `no target of plan ${plan.revision} lies on it: it is newer than the plan, or no robot can come near` : "no plan has been made yet"];
  }

  draw(t, show) {
    this.t = t;
    const own = Math.min(t, this.mission.to), over = isOver(this.mission, own);
    this.map.draw(own, show);
    setText(this.state, stateAt(this.mission, own));
    this.state.className = `badge ${over ? this.mission.ended.status : ""}`;
    setText(this.known, this.knownText(own, over));
    const story = this.story(this.picked);
    this.card.hidden = !story;
    if (story) this.fillCard(story);
    this.map.canvas.setAttribute("aria-label", this.summary(own));
  }

  /** The known area; at the end, with how much of it robots could reach. */
  knownText(t, over) {
    const { ended } = this.mission, known = `known ${area(this.mission.openArea(t))}`;
    return over ? `${known} · reachable ${area(ended.reachable_area_m2)}, ${share(ended.reachable_area_m2 ? ended.explored_area_m2 / ended.reachable_area_m2 : 1)} explored` : known;
  }

  fillCard({ title, lines }) {
    const text = [title, ...lines].join("\n");
    if (text === this.told) return;
    this.told = text;
    this.card.replaceChildren(make("b", { text: title }), button("Close", "×", () => { this.told = ""; this.unpick(); }, { class: "close" }),
      ...lines.map((line) => make("p", { text: line })));
  }

  /** The picture in a sentence, for those who do not see it. */
  summary(t) {
    const views = this.mission.views(t), out = views.filter((view) => !view.carrier).length, plan = this.mission.planAt(t);
    return `Map of ${this.name}: ${area(this.mission.openArea(t))} known, ${out} of ${views.length} robots on the ground, ${plan ? plan.targets.length : 0} targets`;
  }
}
