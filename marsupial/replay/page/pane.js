/* One mission's map with what stands on it: its name and state, buttons to zoom, the card of what is chosen, and below
   it a sentence on what robots do. */

import { button, icon, make, setText } from "#draw/dom.js";
import { MapView } from "#draw/map.js";
import { targetAt } from "#log/frontier.js";
import { exploredShare, isOver, milestones, stateAt } from "#page/panels.js";
import { listenMap } from "#page/pointer.js";
import { activity } from "#text/activity.js";
import { area, clock, share } from "#text/format.js";
import { ending, ofMeeting, ofRemaining, ofRobot, ofTarget } from "#text/why.js";

const WHOLE = "M2 2h5v2H4v3H2zM9 2h5v5h-2V4H9zM2 9h2v3h3v2H2zM12 9h2v5H9v-2h3z";
const EDGE = 8; // points between the card and the edges of the map
const SCALE_BAR = 30; // points of the page: the height of what it needs
const AROUND = 20; // points around what is chosen that the card leaves free

/** `head` makes what stands on the map beside its known area, of name and state; `changed` requests another picture;
    `choose` gets what was clicked (null: nothing), `go` a moment; `side` names the mission's colour beside others
    (null: it is alone).
    @typedef {{
      camera: Camera, side: string | null, tip: import("#page/tip.js").Tip,
      head: (name: string, state: HTMLElement) => HTMLElement[],
      changed: () => void, choose: (thing: Thing | null) => void, go: (t: number) => void }} PaneOptions */

export class Pane {
  /** @param {Mission} mission
      @param {string} name
      @param {PaneOptions} options */
  constructor(mission, name, { head, camera, changed, choose, go, tip, side }) {
    this.mission = mission;
    this.name = name;
    this.changed = changed;
    this.choose = choose;
    this.go = go;
    this.tip = tip;
    this.t = mission.from;
    /** @type {Thing | null} */
    this.picked = null;
    /** @type {((place: Cell) => void) | null} */
    this.onPlace = null; // gets the places that are clicked, if there is one
    this.cardText = "";
    this.corner = 0; // of the map, where the card is
    /** @type {Thing | null} */
    this.placedFor = null; // what was chosen when the card came there
    this.map = new MapView(mission, name, camera, side);
    this.state = make("span", { class: "badge" });
    this.known = make("span", { class: "known" });
    this.now = make("span", { class: "now" });
    this.where = make("span", { class: "where", "aria-hidden": "true" });
    this.title = make("b");
    this.lines = make("div", { class: "lines", tabindex: "0" });
    const follow = () => this.follow(this.focus.robot);
    this.followButton = make("button", { type: "button", class: "follow", text: "Follow on the map", onclick: follow });
    const close = button("Close", "×", () => this.choose(null), { class: "close" });
    this.card = make(
      "div",
      { class: "picked", role: "status", hidden: true },
      ...[this.title, close, this.lines, this.followButton],
    );
    const unfollow = () => this.follow(null);
    this.following = make("button", {
      type: "button",
      class: "following",
      text: "following",
      hidden: true,
      onclick: unfollow,
    });
    this.buttons = make(
      "div",
      { class: "zoom", role: "group", "aria-label": "Zoom" },
      button("Zoom in", "+", () => this.zoom(1.5)),
      button("Zoom out", "−", () => this.zoom(1 / 1.5)),
      button("Show the whole map", icon(WHOLE), () => this.showWhole()),
    );
    this.chips = make("div", { class: "chips" }, ...head(name, this.state), this.known, this.following);
    this.longest = 0; // ms that bars of times are drawn for
    this.times = make("p", { class: "times" });
    this.times.style.setProperty("--bar", `var(--${side})`);
    const [first] = this.chips.children;
    if (side && first instanceof HTMLElement) first.style.borderLeftColor = `var(--${side})`;
    this.element = make(
      "section",
      { class: "pane", "aria-label": `Map of ${name}` },
      make("div", { class: "stage" }, this.map.element, this.buttons, this.chips, this.card),
      make("p", { class: "activity" }, this.now, this.where),
      ...(side ? [this.times] : []),
    );
    this.listen();
  }

  listen() {
    const { map, tip } = this;
    listenMap(map.canvas, map.camera, {
      moved: () => {
        this.follow(null, false);
        this.changed();
      },
      clicked: (x, y) => {
        if (this.onPlace) this.onPlace(map.camera.place(x, y));
        else this.choose(this.thingAt(x, y));
      },
      over: (x, y, event) => {
        const hit = map.hit(x, y);
        this.hover(hit);
        tip.show(event, this.story(hit));
        setText(this.where, map.whereAt(x, y));
      },
      left: () => {
        this.hover(null);
        tip.hide();
        setText(this.where, "");
      },
    });
  }

  /** @type {(factor: number) => void} */
  zoom(factor) {
    this.follow(null, false);
    this.map.camera.zoom(factor);
    this.changed();
  }

  showWhole() {
    this.follow(null, false);
    this.map.camera.fit();
    this.changed();
  }

  /** @type {(hit: Hit | null) => void} */
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
    /** @type {(element: Element) => Box} */
    const boxOf = (element) => {
      const { left, top, width, height } = element.getBoundingClientRect();
      return [left - stage.left, top - stage.top, width, height];
    };
    this.map.resize([this.chips, this.buttons].map(boxOf));
  }

  /** Keep a robot in the middle; null, or the same one again: no more, and go `back` to what was seen before.
      @type {(robot: Robot | null, back?: boolean) => void} */
  follow(robot, back = true) {
    const { camera } = this.map;
    if (camera.followed === robot && robot === null) return;
    camera.follow(camera.followed === robot ? null : robot, back);
    this.changed();
  }

  /** What was clicked: a thing, or the target whose frontier is there.
      @type {(x: number, y: number) => Thing | null} */
  thingAt(x, y) {
    const hit = this.map.hit(x, y);
    const cell = this.map.camera.cell(x, y);
    this.tip.hide();
    if (hit) return hit;
    const target = targetAt(this.map.ground.known, this.mission.planAt(this.t), cell);
    if (target === undefined) return null;
    return target === null ? { unplanned: cell } : { target };
  }

  /** The story of a thing on the map; null for nothing.
      @type {(thing: Thing | null) => Story | null} */
  story(thing) {
    const { mission, t } = this;
    if (!thing) return null;
    if (thing.target) return ofTarget(mission, thing.target, t, this.map.ground.known);
    if (thing.meeting) return ofMeeting(mission, thing.meeting, t);
    if (thing.remaining) return ofRemaining(mission, thing.remaining);
    if (thing.unplanned) return { title: "Frontier", lines: [this.whyUnplanned()] };
    const { robot } = thing;
    if (!robot) return null;
    const cargo = mission.robots.filter((one) => mission.view(one, t).carrier === robot).map((one) => one.name);
    return ofRobot(mission, mission.view(robot, t), t, cargo);
  }

  /** Why no target lies on a frontier. */
  whyUnplanned() {
    const plan = this.mission.planAt(this.t);
    if (isOver(this.mission, this.t)) return "left at the end; the stop report says why";
    if (!plan) return "no plan has been made yet";
    return `no target of plan ${plan.revision} lies on it: it is newer than the plan, or no robot can come near`;
  }

  /** The robot and the place that are chosen, null for none.
      @returns {Focus} */
  get focus() {
    const { robot = null, place, target, meeting } = this.picked ?? {};
    return { robot, place: place ?? target ?? meeting ?? null };
  }

  /** @type {(t: number, layers: Layers) => void} */
  draw(t, layers) {
    this.t = t;
    const { mission, map, focus } = this;
    const own = Math.min(t, mission.to);
    const end = isOver(mission, own) ? mission.ended : null;
    const views = mission.views(own);
    const sentence = end ? { text: resultOf(end), names: new Set() } : activity(mission, own, views, focus.robot);
    map.draw(own, views, layers, focus, sentence.names);
    setText(this.now, sentence.text);
    this.now.title = sentence.text;
    setText(this.state, stateAt(mission, own));
    this.state.className = `badge ${end ? ending(end).replace(" ", "_") : ""}`;
    this.following.hidden = !map.followed;
    if (map.followed) setText(this.following, `following ${map.followed.name} ×`);
    setText(this.known, this.knownText(own, end));
    const story = this.story(this.picked);
    this.card.hidden = !story;
    if (story) {
      this.fillCard(story);
      this.placeCard();
    }
    map.canvas.setAttribute("aria-label", this.summary(own, views));
  }

  /** How much is known, of what is in reach when it is over, and which part no other mission knows.
      @type {(t: number, end: EndedLine | null) => string} */
  knownText(t, end) {
    const { others, aloneCells } = this.map.ground;
    const parts = [`known ${area(this.mission.openArea(t))}`];
    if (others.length) parts.push(`${area(aloneCells * this.mission.resolution ** 2)} here only`);
    if (end) parts.push(`${share(exploredShare(end))} of ${area(end.reachable_area_m2)} in reach`);
    return parts.join(", ");
  }

  /** Show when half, most and nearly all was known, as bars; `longest` ms has the length of the pane.
      @type {(longest: number) => void} */
  showTimes(longest) {
    const known = this.mission.ended?.known_ms;
    if (!known || longest === this.longest) return;
    this.longest = longest;
    const bars = milestones(known).map(([percent, ms]) => {
      const length = `--length: ${ms === null ? 0 : (100 * ms) / longest}%`;
      if (ms === null) return make("span", { style: length, text: `${percent} % never` });
      const [text, title] = [`${percent} % known at ${clock(ms)}`, `Go to ${clock(ms)}`];
      return make("button", { type: "button", style: length, text, title, onclick: () => this.go(ms) });
    });
    this.times.replaceChildren(...bars);
  }

  /** @type {(story: Story) => void} */
  fillCard({ title, lines }) {
    const text = [title, ...lines].join("\n");
    if (text === this.cardText) return;
    this.cardText = text;
    setText(this.title, title);
    this.lines.replaceChildren(...lines.map((line) => make("p", { text: line })));
    this.followButton.hidden = !this.picked?.robot;
  }

  /** Put the card in a corner of the map where it covers nothing that is chosen, and of the rest as little as it can.
      It stays there while what is chosen is beside it. */
  placeCard() {
    const { map, card, chips, buttons } = this;
    const { width, height } = map.camera.size;
    const [wide, high] = [card.offsetWidth, card.offsetHeight];
    const right = width - EDGE - wide;
    const below = chips.offsetTop + chips.offsetHeight + EDGE;
    /** @type {Point[]} */
    const corners = [
      [EDGE, height - SCALE_BAR - high],
      [right, height - EDGE - high],
      [right - buttons.offsetWidth - EDGE, below],
      [EDGE, below],
    ];
    const { remaining, unplanned } = this.picked ?? {};
    const cells = [remaining?.cell, unplanned].filter((cell) => cell !== undefined);
    const chosen = [...map.ringed, ...cells.map((cell) => map.camera.point(...cell))];
    /** @type {(points: Point[], corner: Point) => number} */
    const covered = (points, [left, top]) =>
      points.filter(([x, y]) => {
        return Math.abs(x - left - wide / 2) < wide / 2 + AROUND && Math.abs(y - top - high / 2) < high / 2 + AROUND;
      }).length;
    if (this.placedFor !== this.picked || covered(chosen, corners[this.corner])) {
      /** @type {Point[]} */
      const drawn = map.hits.map(({ x, y }) => [x, y]);
      const costs = corners.map((corner) => covered(chosen, corner) * drawn.length + covered(drawn, corner));
      this.corner = costs.indexOf(Math.min(...costs));
      this.placedFor = this.picked;
    }
    const [left, top] = corners[this.corner];
    card.style.left = `${left}px`;
    card.style.top = `${top}px`;
  }

  /** The picture in a sentence, for those who do not see it.
      @type {(t: number, views: RobotView[]) => string} */
  summary(t, views) {
    const out = views.filter((view) => !view.carrier).length;
    const targets = this.mission.planAt(t)?.targets.length ?? 0;
    const known = area(this.mission.openArea(t));
    return `Map of ${this.name}: ${known} known, ${out} of ${views.length} robots on the ground, ${targets} targets`;
  }
}

/** How a mission ended, and why.
    @type {(end: EndedLine) => string} */
function resultOf(end) {
  const word = ending(end);
  return end.reason.startsWith(word) ? end.reason : `${word}: ${end.reason}`;
}
