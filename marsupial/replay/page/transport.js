/* The clock of the page: playing, scrubbing, speed; live, it goes with the newest moment until someone goes back. */

import { button, icon, make, setText } from "#draw/dom.js";
import { clock } from "#text/format.js";

const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
const WHOLE_MS = 45000; // in which a mission is played at the speed it opens with
const CATCH_UP_MS = 1000; // in which a live clock makes good what it is behind the newest moment
const LONGEST_MS = 250; // between two pictures; a page that was hidden goes on where it was
const PLAY = "M4 2v12l9-6z";
const PAUSE = "M4 2h3v12H4zM9 2h3v12H9z";
const BACK = "M3 3h2v10H3zM13 3v10L6 8z";
const ON = "M11 3h2v10h-2zM3 3v10l7-5z";

/** The first and the last moment, the newest one of a live mission; what is called after each change of the moment,
    and goes to the plan before (-1) or after (1).
    @typedef {{
      span: () => [from: number, to: number], newest: () => number, moved: () => void,
      step: (direction: number) => void }} Timeline */

export class Transport {
  /** @param {Timeline} timeline
      @param {ViewOptions} options */
  constructor({ span, newest, moved, step }, { live = false, rate = null }) {
    this.span = span;
    this.newest = newest;
    this.moved = moved;
    this.live = live;
    this.rate = rate;
    this.t = span()[0];
    this.playing = false;
    this.stamp = 0; // of the last picture while playing
    this.follows = live; // the newest moment
    this.ticking = false;
    this.isChosen = false; // the speed
    this.speed = 1;
    this.closed = false;
    this.playIcon = icon(PLAY);
    this.playButton = button("Play", this.playIcon, () => this.toggle(), { class: "play" });
    const scrubbed = () => this.go(Number(this.scrub.value));
    this.scrub = make("input", { type: "range", step: "1", "aria-label": "Mission time", oninput: scrubbed });
    this.output = make("output", { class: "clock" });
    this.select = make(
      "select",
      { "aria-label": "Seconds of the mission a second", onchange: () => this.setSpeed(Number(this.select.value)) },
      ...SPEEDS.map((speed) => new Option(`${speed}×`, String(speed))),
    );
    this.badge = make("button", {
      type: "button",
      class: "live",
      text: "live",
      title: "Go with the newest moment",
      hidden: !live,
      onclick: () => this.goLive(),
    });
    this.openSpeed();
    this.element = make(
      "div",
      { class: "transport", role: "group", "aria-label": "Time" },
      this.playButton,
      button("To the plan before ([)", icon(BACK), () => step(-1), { class: "step" }),
      button("To the next plan (])", icon(ON), () => step(1), { class: "step" }),
      this.scrub,
      this.badge,
      this.output,
      make("label", { class: "speed" }, make("span", { text: "speed " }), this.select),
    );
  }

  /** A moment that can be shown.
      @type {(t: number) => number} */
  clamped(t) {
    const [from, to] = this.span();
    return Math.min(to, Math.max(from, t));
  }

  /** The moment at which playing ends. */
  end() {
    return this.live ? this.newest() : this.span()[1];
  }

  /** @type {(t: number) => void} */
  go(t) {
    this.follows = false;
    this.t = this.clamped(t);
    this.moved();
  }

  goLive() {
    this.follows = true;
    this.t = this.newest();
    this.pause();
    this.grew();
  }

  /** Unless someone chose a speed, take that at which the whole is played in a while; live, that of the mission at
      least. */
  openSpeed() {
    if (this.isChosen) return;
    const [from, to] = this.span();
    const least = Math.max((to - from) / WHOLE_MS, this.live ? (this.rate ?? 0) : 0);
    this.speed = SPEEDS.find((speed) => speed >= least) || SPEEDS[SPEEDS.length - 1];
    this.select.value = String(this.speed);
  }

  /** The mission has more to show; `over`: and will have no more. */
  grew(over = false) {
    if (over) {
      this.live = false;
      this.badge.hidden = true;
    }
    if (over || this.follows) this.openSpeed();
    if (this.follows) {
      if (!this.rate || over) this.t = this.newest();
      else if (!this.ticking) this.tick(this.rate);
      if (over) this.follows = false;
    }
    this.moved();
  }

  /** Follow a live mission at its rate, never beyond its log; faster where that is far ahead.
      @type {(rate: number) => void} */
  tick(rate) {
    this.ticking = true;
    let last = performance.now();
    /** @type {(now: number) => void} */
    const next = (now) => {
      if (!this.follows || this.closed) {
        this.ticking = false;
        return;
      }
      const behind = this.newest() - this.t;
      this.t += Math.min(behind, Math.min(now - last, LONGEST_MS) * Math.max(rate, behind / CATCH_UP_MS));
      last = now;
      this.moved();
      requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    const [from] = this.span();
    if (this.follows || this.t >= this.end()) this.t = from;
    this.follows = false;
    this.playing = true;
    this.stamp = 0;
    this.showPlaying();
    requestAnimationFrame((stamp) => this.frame(stamp));
  }

  pause() {
    this.playing = false;
    this.showPlaying();
  }

  showPlaying() {
    this.playIcon.firstElementChild?.setAttribute("d", this.playing ? PAUSE : PLAY);
    this.playButton.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.playButton.title = `${this.playing ? "Pause" : "Play"} (space)`;
  }

  /** @type {(stamp: number) => void} */
  frame(stamp) {
    if (!this.playing || this.closed) return;
    if (this.stamp) this.t = this.clamped(this.t + Math.min(stamp - this.stamp, LONGEST_MS) * this.speed);
    this.stamp = stamp;
    if (this.t >= this.end()) {
      if (this.live) this.goLive();
      else this.pause();
    }
    this.moved();
    requestAnimationFrame((next) => this.frame(next));
  }

  /** @type {(direction: number) => void} */
  changeSpeed(direction) {
    const i = SPEEDS.indexOf(this.speed) + direction;
    this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, i))]);
  }

  /** @type {(speed: number) => void} */
  setSpeed(speed) {
    if (!SPEEDS.includes(speed)) return;
    this.isChosen = true;
    this.speed = speed;
    this.select.value = String(speed);
  }

  draw() {
    const [from, to] = this.span();
    this.scrub.min = String(from);
    this.scrub.max = String(to);
    this.scrub.value = String(Math.round(this.t));
    this.scrub.setAttribute("aria-valuetext", clock(this.t));
    setText(this.output, `${clock(this.t, true)} / ${clock(to, true)}`);
    this.badge.classList.toggle("on", this.follows);
    this.badge.setAttribute("aria-pressed", String(this.follows));
  }
}
