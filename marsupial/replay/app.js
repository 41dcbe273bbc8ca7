/* The page: reads the log out of it, fills its panels and moves through time. */

import { lastAt } from "./history.js";
import { bar, clock, Lanes } from "./lanes.js";
import { cross, diamond, disc, doing, MapView, meetingMark, pips, robotColours, round, terrainColour, themeColour } from "./map.js";
import { readMission } from "./model.js";

const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
const byId = (id) => document.getElementById(id);

function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

class App {
  constructor(mission) {
    this.mission = mission;
    this.t = mission.from;
    this.playing = false;
    this.stamp = 0;
    const colours = robotColours(mission);
    this.colours = colours;
    this.map = new MapView(byId("map"), mission, colours);
    this.lanes = new Lanes(byId("lanes"), mission, colours);
    this.speed = SPEEDS.find((speed) => speed >= (mission.to - mission.from) / 45000) || SPEEDS[SPEEDS.length - 1];
    this.fillHead();
    this.fillTeam();
    this.fillReport();
    this.fillPlans();
    this.fillSpeeds();
    this.listen();
    this.readHash();
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
    new ResizeObserver(() => this.resize()).observe(byId("lanes-box"));
  }

  fillHead() {
    const { start, ended, robots } = this.mission;
    const carriers = robots.filter((robot) => robot.carrier).length, rovers = robots.length - carriers;
    byId("title").textContent = start.scenario || "Mission replay";
    const size = `${round(start.width * start.resolution_m)} x ${round(start.height * start.resolution_m)} m`;
    byId("subtitle").textContent = [
      start.planner ? `${start.strategy} with ${start.planner}` : start.strategy, `seed ${start.seed}`,
      `${count(carriers, "carrier")}, ${count(rovers, "rover")}`, `${size} at ${start.resolution_m} m a cell`,
    ].join(" · ");
    byId("status").textContent = ended ? ended.status.replace("_", " ") : "no end in the log";
    if (ended) byId("status").classList.add(ended.status);
  }

  fillTeam() {
    this.rows = this.mission.robots.map((robot) => {
      const row = element("tr", robot.kind.role), name = element("td"), does = element("td"), metres = element("td", "number");
      const dot = element("span", "dot");
      dot.style.background = this.colours.get(robot.name);
      name.append(dot, robot.name);
      name.title = `${robot.name}: ${robot.kind.name}, ${robot.kind.speed_mps} m/s, sees ${robot.kind.sensor_range_m} m, radius ${robot.kind.radius_m} m`;
      row.append(name, does, metres);
      byId("team").append(row);
      return { row, does, metres };
    });
  }

  fillReport() {
    const { ended } = this.mission, report = byId("report");
    if (!ended) {
      report.append(element("p", "reason", "The log ends without a stop report: the run was cut off, or is still going on."));
      return;
    }
    report.append(element("p", "reason", `${ended.status.replace("_", " ")}: ${ended.reason}`));
    const total = (pairs) => pairs.reduce((sum, pair) => sum + pair[1], 0);
    const share = ended.reachable_area_m2 ? ended.explored_area_m2 / ended.reachable_area_m2 : 1;
    const list = element("dl");
    for (const [name, value] of [
      ["explored in", ended.exploration_ms === null ? "never" : clock(ended.exploration_ms)], ["ended at", clock(ended.t_ms)],
      ["coverage", `${(100 * share).toFixed(1)} %`], ["of", `${round(ended.reachable_area_m2)} m²`],
      ["distance", `${round(total(ended.distance_m))} m`], ["energy", `${round(total(ended.energy_j) / 1000)} kJ`],
      ["set down", count(ended.deployments, "time")], ["picked up", count(ended.retrievals, "time")],
      ["plans", ended.plans_valid], ["refused", ended.plans_invalid],
    ]) list.append(element("dt", "", name), element("dd", "", value));
    report.append(list);
    this.fillRemaining(report, ended.remaining);
  }

  fillRemaining(report, remaining) {
    if (!remaining.length) { report.append(element("p", "", "No frontier is left.")); return; }
    const box = element("details"), list = element("ul");
    box.append(element("summary", "", `${count(remaining.length, "frontier")} left, and why`), list);
    for (const frontier of remaining) {
      const item = element("li"), button = element("button", "", `${frontier.reason} (${count(frontier.frontier_cells, "cell")})`);
      button.type = "button";
      button.title = "Show it on the map";
      button.addEventListener("click", () => { this.map.centre(frontier.cell); this.go(this.mission.to); });
      item.append(button);
      list.append(item);
    }
    report.append(box);
  }

  fillPlans() {
    byId("plan-count").textContent = this.mission.plans.length ? `(${this.mission.plans.length}; click to go there)` : "(none)";
    this.planItems = this.mission.plans.map((plan) => {
      const item = element("li"), button = element("button");
      button.type = "button";
      button.title = `${plan.trigger}\n${count(plan.actions.length, "action")}, ${count(plan.targets.length, "target")}, ${count(plan.meetings.length, "meeting point")}`;
      button.append(element("b", "", plan.revision), element("span", "", clock(plan.t_ms)), element("span", "", plan.trigger));
      button.addEventListener("click", () => this.go(plan.t_ms));
      item.append(button);
      return item;
    });
    byId("plans").append(...this.planItems);
    this.planShown = -1;
  }

  fillSpeeds() {
    for (const speed of SPEEDS) byId("speed").append(new Option(`${speed}×`, speed));
    byId("speed").value = this.speed;
    byId("scrub").min = this.mission.from;
    byId("scrub").max = this.mission.to;
  }

  /** Fill the legend with small drawings by the very functions that draw the map and the lanes. */
  fillLegend() {
    const { start } = this.mission, ink = this.map.ink, lanes = this.lanes.ink;
    const mark = (draw) => (g) => draw(g, 11, 8);
    const box = (colour) => (g) => { g.fillStyle = colour; g.fillRect(1, 1, 20, 14); g.strokeStyle = "#8888"; g.strokeRect(1.5, 1.5, 19, 13); };
    const dash = (dashes) => (g) => { g.setLineDash(dashes); g.lineWidth = 2; g.strokeStyle = lanes.move; g.beginPath(); g.moveTo(0, 8); g.lineTo(22, 8); g.stroke(); };
    const lane = (name, end) => (g) => bar(g, 1, 2, 20, 12, lanes[name], end, lanes.bad);
    legendList("legend-map", [
      [box(themeColour("unknown")), "unknown"], ...start.terrains.map((terrain) => [box(terrainColour(terrain)), terrain.name]),
      [mark((g, x, y) => { disc(g, x, y, 6.5, "hsl(212 78% 44%)"); pips(g, x, y, 6.5, 2, ["hsl(236 74% 57%)"]); }), "carrier, 1 of 2 aboard"],
      [mark((g, x, y) => disc(g, x, y, 4.5, "hsl(236 74% 57%)")), "rover"],
      [mark((g, x, y) => diamond(g, x, y, 5.5, ink.target, true)), "target for a carrier"],
      [mark((g, x, y) => diamond(g, x, y, 5.5, ink.target, false)), "target, rovers only"],
      [mark((g, x, y) => meetingMark(g, x - 4, y, x + 6, y, ink.meeting)), "meeting point"],
      [mark((g, x, y) => cross(g, x, y, 5, ink.bad, 2)), "left unexplored"],
      [dash([6, 4]), "route now"], [dash([1, 4]), "planned next"],
    ]);
    legendList("legend-lanes", [
      ...["move", "explore", "dock", "undock"].map((name) => [lane(name, "done"), name]),
      [lane("explore", "superseded"), "superseded"], [lane("explore", "blocked"), "blocked, failed or lost"],
      [(g) => { g.fillStyle = this.colours.values().next().value; g.globalAlpha = 0.55; g.fillRect(0, 7, 22, 2); }, "aboard"],
      [(g) => { g.fillStyle = lanes.explore; g.fillRect(0, 11, 22, 2.5); }, "as planned"],
    ]);
  }

  listen() {
    byId("play").addEventListener("click", () => this.toggle());
    byId("plan-before").addEventListener("click", () => this.stepPlan(-1));
    byId("plan-next").addEventListener("click", () => this.stepPlan(1));
    byId("scrub").addEventListener("input", () => this.go(Number(byId("scrub").value)));
    byId("speed").addEventListener("change", () => { this.speed = Number(byId("speed").value); });
    byId("theme").addEventListener("click", () => this.setTheme(this.theme === "dark" ? "light" : "dark"));
    byId("save").addEventListener("click", () => saveLog(this.mission.start.scenario));
    byId("zoom-in").addEventListener("click", () => { this.map.zoom(1.5); this.draw(); });
    byId("zoom-out").addEventListener("click", () => { this.map.zoom(1 / 1.5); this.draw(); });
    byId("zoom-fit").addEventListener("click", () => { this.map.fit(); this.draw(); });
    for (const id of ["labels", "sensors", "plan", "trails"]) byId(id).addEventListener("change", () => this.draw());
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("hashchange", () => { this.readHash(); this.draw(); });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => this.setTheme(event.matches ? "dark" : "light"));
    listenMap(this);
    listenLanes(this);
  }

  /** The part of the address behind # says where to start: t (seconds), speed, play, theme, and layers as 0 or 1. */
  readHash() {
    const given = new URLSearchParams(location.hash.slice(1));
    const dark = given.has("theme") ? given.get("theme") === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    this.setTheme(dark ? "dark" : "light");
    for (const id of ["labels", "sensors", "plan", "trails"]) if (given.has(id)) byId(id).checked = given.get(id) !== "0";
    if (given.has("legend")) byId("legend").open = given.get("legend") !== "0";
    const speed = Number(given.get("speed"));
    if (SPEEDS.includes(speed)) { this.speed = speed; byId("speed").value = speed; }
    const t = Number(given.get("t"));
    if (given.has("t") && Number.isFinite(t)) this.t = this.clamped(t * 1000);
    if (given.get("play") === "1" && !this.playing) this.toggle();
  }

  setTheme(theme) {
    if (theme === this.theme) return;
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    this.map.restyle();
    this.lanes.restyle();
    this.fillLegend();
    this.draw();
  }

  resize() {
    this.map.resize();
    this.lanes.restyle();
    this.draw();
  }

  clamped(t) { return Math.min(this.mission.to, Math.max(this.mission.from, t)); }

  go(t) { this.t = this.clamped(t); this.draw(); }

  stepPlan(direction) {
    const { plans, planTimes } = this.mission;
    const i = direction > 0 ? lastAt(planTimes, this.t) + 1 : lastAt(planTimes, this.t - 1);
    if (plans[i]) this.go(plans[i].t_ms); else this.go(direction > 0 ? this.mission.to : this.mission.from);
  }

  changeSpeed(direction) {
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, SPEEDS.indexOf(this.speed) + direction))];
    byId("speed").value = this.speed;
  }

  toggle() {
    if (!this.playing && this.t >= this.mission.to) this.t = this.mission.from;
    this.playing = !this.playing;
    this.stamp = 0;
    byId("play").querySelector("path").setAttribute("d", this.playing ? "M4 2h3v12H4zM9 2h3v12H9z" : "M4 2v12l9-6z");
    byId("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    if (this.playing) requestAnimationFrame((stamp) => this.frame(stamp));
    else this.draw();
  }

  frame(stamp) {
    if (!this.playing) return;
    if (this.stamp) this.t = this.clamped(this.t + Math.min(stamp - this.stamp, 250) * this.speed);
    this.stamp = stamp;
    if (this.t >= this.mission.to) { this.toggle(); return; }
    this.lanes.follow(this.t);
    this.draw();
    requestAnimationFrame((next) => this.frame(next));
  }

  key(event) {
    const on = event.target.tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || on === "SELECT") return;
    if (event.key === " " && (on === "BUTTON" || on === "SUMMARY" || (on === "INPUT" && event.target.type === "checkbox"))) return;
    const flip = (id) => { byId(id).checked = !byId(id).checked; this.draw(); };
    const leap = event.shiftKey ? 60000 : 5000;
    const keys = {
      " ": () => this.toggle(), ArrowLeft: () => this.go(this.t - leap), ArrowRight: () => this.go(this.t + leap),
      "+": () => this.changeSpeed(1), "=": () => this.changeSpeed(1), "-": () => this.changeSpeed(-1),
      "[": () => this.stepPlan(-1), "]": () => this.stepPlan(1), Home: () => this.go(this.mission.from), End: () => this.go(this.mission.to),
      l: () => flip("labels"), s: () => flip("sensors"), p: () => flip("plan"), t: () => flip("trails"),
    };
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }

  draw() {
    const show = Object.fromEntries(["labels", "sensors", "plan", "trails"].map((id) => [id, byId(id).checked]));
    this.map.draw(this.t, show);
    this.lanes.draw(this.t);
    this.drawPanels();
  }

  drawPanels() {
    const views = this.mission.views(this.t);
    let driven = 0;
    views.forEach((view, i) => {
      const { row, does, metres } = this.rows[i];
      setText(does, doing(view));
      does.title = does.textContent;
      setText(metres, view.driven.toFixed(0));
      row.classList.toggle("lost", view.lost);
      driven += view.driven;
    });
    setText(byId("clock"), clock(this.t));
    setText(byId("clock-2"), `${clock(this.t, true)} / ${clock(this.mission.to)}`);
    setText(byId("known"), round(this.mission.openArea(this.t)));
    setText(byId("driven"), round(driven));
    byId("scrub").value = Math.round(this.t);
    byId("scrub").setAttribute("aria-valuetext", clock(this.t));
    this.markPlan();
  }

  markPlan() {
    const i = this.mission.planIndex(this.t);
    if (i === this.planShown) return;
    if (this.planShown >= 0) this.planItems[this.planShown].removeAttribute("aria-current");
    this.planShown = i;
    if (i < 0) return;
    const item = this.planItems[i], list = byId("plans");
    item.setAttribute("aria-current", "true");
    const top = item.offsetTop - list.offsetTop;
    if (top < list.scrollTop || top + item.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = top - list.clientHeight / 2;
  }
}

function setText(node, text) { if (node.textContent !== text) node.textContent = text; }

function count(n, word) { return `${n} ${word}${n === 1 ? "" : "s"}`; }

function legendList(id, entries) {
  const ratio = window.devicePixelRatio || 1;
  byId(id).replaceChildren(...entries.map(([draw, text]) => {
    const item = element("li"), canvas = element("canvas");
    canvas.width = 22 * ratio;
    canvas.height = 16 * ratio;
    const g = canvas.getContext("2d");
    g.scale(ratio, ratio);
    draw(g);
    item.append(canvas, text);
    return item;
  }));
}

function saveLog(name) {
  const link = element("a"), address = URL.createObjectURL(new Blob([`${byId("log").textContent.trim()}\n`], { type: "application/jsonl" }));
  link.href = address;
  link.download = `${name.replace(/[^\w.-]+/g, "-") || "mission"}.jsonl`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

function showTip(event, text) {
  const tip = byId("tip");
  tip.hidden = !text;
  if (!text) return;
  tip.textContent = text;
  tip.style.left = `${Math.max(4, Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8))}px`;
  const below = event.clientY + 16;
  tip.style.top = `${below + tip.offsetHeight > innerHeight - 4 ? event.clientY - tip.offsetHeight - 12 : below}px`;
}

/** Dragging moves the map, the wheel and two fingers zoom, a double click shows everything. */
function listenMap(app) {
  const canvas = byId("map"), fingers = new Map();
  const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y) || 1; };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    canvas.classList.add("dragging");
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) {
      showTip(event, app.map.textAt(event.offsetX, event.offsetY));
      byId("where").textContent = app.map.whereAt(event.offsetX, event.offsetY);
      return;
    }
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()];
      app.map.zoom(spread() / before, (a.x + b.x) / 2, (a.y + b.y) / 2);
    } else app.map.pan(event.offsetX - last.x, event.offsetY - last.y);
    app.draw();
  });
  const drop = (event) => { fingers.delete(event.pointerId); if (!fingers.size) canvas.classList.remove("dragging"); };
  canvas.addEventListener("pointerup", drop);
  canvas.addEventListener("pointercancel", drop);
  canvas.addEventListener("pointerleave", (event) => { showTip(event, null); byId("where").textContent = ""; });
  canvas.addEventListener("dblclick", () => { app.map.fit(); app.draw(); });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    app.map.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.offsetX, event.offsetY);
    app.draw();
  }, { passive: false });
}

/** Pressing and dragging goes to a time; the wheel with ctrl or shift zooms the time, a double click shows all of it. */
function listenLanes(app) {
  const canvas = byId("lanes");
  let down = false;
  const seek = (event) => app.go(app.lanes.time(event.offsetX));
  canvas.addEventListener("pointerdown", (event) => { down = true; canvas.setPointerCapture(event.pointerId); seek(event); });
  canvas.addEventListener("pointermove", (event) => {
    if (down) seek(event);
    showTip(event, app.lanes.textAt(event.offsetX, event.offsetY));
  });
  canvas.addEventListener("pointerup", () => { down = false; });
  canvas.addEventListener("pointercancel", () => { down = false; });
  canvas.addEventListener("pointerleave", (event) => showTip(event, null));
  canvas.addEventListener("dblclick", () => { app.lanes.showAll(); app.lanes.restyle(); app.draw(); });
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    app.lanes.zoom(Math.exp(-(event.deltaY || event.deltaX) * (event.deltaMode ? 0.05 : 0.003)), event.offsetX);
    app.draw();
  }, { passive: false });
}

new App(readMission(byId("log").textContent));
