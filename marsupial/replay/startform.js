/* The form that starts a mission in the simulator, or two side by side; what the service refuses stands beside the field
   that was meant. */

import { make } from "./dom.js";
import { get, post, Refused } from "./service.js";

const OWN_MAP = "";
const SPEEDS = [[1, "real time"], [5, "5 times"], [10, "10 times"], [30, "30 times"], [100, "100 times"], ["", "as fast as it can be planned"]];
const SPEED = 10;

/** The field that a JSON pointer into the request means; what is said of a map as a whole stands below all fields. */
const FIELDS = [
  ["/map/yaml", "yaml"], ["/map/image_base64", "image"], ["/map/name", "yaml"], ["/scenario", "scenario"],
  ["/carriers", "carriers"], ["/rovers", "rovers"], ["/strategy", "strategy"], ["/planner", "planner"], ["/seed", "seed"],
  ["/budget", "budget"], ["/speed", "speed"],
];

export class StartForm {
  /** `started(missions)` is called with the one or two missions that were begun. */
  constructor(started) {
    this.started = started;
    this.fields = new Map();
    this.element = make("form", { class: "card start", novalidate: true, "aria-labelledby": "start-title", onsubmit: (event) => { event.preventDefault(); this.start(); } });
    this.element.append(make("h2", { id: "start-title", text: "Explore a map in the simulator" }), make("p", { class: "dim", text: "asking what there is …" }));
    this.fill();
  }

  async fill() {
    try {
      this.offer = await get("/v1/scenarios");
    } catch (error) {
      this.element.lastChild.textContent = error.message;
      return;
    }
    const { scenarios, strategies, planners, defaults } = this.offer;
    this.element.lastChild.remove();
    const names = strategies.map((one) => [one.name, one.with_rovers ? one.name : `${one.name} (rovers 0 only)`]);
    this.element.append(
      this.select("scenario", "Map", [...scenarios.map((one) => [one.name, `${one.name}: ${one.width_m} × ${one.height_m} m`]), [OWN_MAP, "a map of mine (nav2) …"]], scenarios[0].name),
      this.note = make("p", { class: "dim note" }),
      this.upload = make("div", { class: "pair" },
        this.file("yaml", "Its yaml file", ".yaml,.yml,text/yaml"), this.file("image", "Its image", ".pgm,.png,image/png,image/x-portable-graymap")),
      make("div", { class: "pair" }, this.number("carriers", "Carriers", defaults.carriers, 1), this.number("rovers", "Rovers on each", defaults.rovers, 0)),
      make("div", { class: "pair" }, this.select("strategy", "Strategy", names, defaults.strategy), this.select("beside", "Beside it", [["", "nothing"], ...names], "")),
      make("div", { class: "pair" },
        this.select("planner", "Planner", planners.map((name) => [name, name]), defaults.planner),
        this.number("budget", "Seconds for each plan", defaults.budget.seconds ?? 1, 0.05, 0.05)),
      make("div", { class: "pair" }, this.number("seed", "Seed", defaults.seed, 0), this.select("speed", "Speed", SPEEDS, SPEED)),
      this.problems = make("p", { class: "problem", role: "alert" }),
      this.button = make("button", { class: "first", text: "Start" }),
    );
    for (const name of ["scenario", "strategy", "beside"]) this.input(name).addEventListener("change", () => this.adapt());
    this.adapt();
  }

  input(name) { return this.fields.get(name).input; }

  field(name, label, input) {
    const id = `start-${name}`, problem = make("span", { class: "problem", id: `${id}-problem`, role: "alert" });
    input.id = id;
    input.name = name;
    input.setAttribute("aria-describedby", problem.id);
    input.addEventListener("input", () => this.blame(name, ""));
    this.fields.set(name, { input, problem });
    return make("label", { for: id }, make("span", { text: label }), input, problem);
  }

  select(name, label, options, chosen) {
    const input = make("select", {}, ...options.map(([value, text]) => make("option", { value, text })));
    input.value = chosen;
    return this.field(name, label, input);
  }

  number(name, label, value, min, step = 1) { return this.field(name, label, make("input", { type: "number", value, min, step, required: true })); }

  file(name, label, accept) { return this.field(name, label, make("input", { type: "file", accept })); }

  /** Show what goes with what is chosen. */
  adapt() {
    const named = this.input("scenario").value, one = this.offer.scenarios.find((each) => each.name === named);
    this.note.textContent = one ? one.summary : "the two files that map_saver writes; robots start where the seed puts them";
    this.upload.hidden = one !== undefined;
    const asks = (name) => this.offer.strategies.some((each) => each.name === name && each.asks_planner);
    const planned = asks(this.input("strategy").value) || asks(this.input("beside").value);
    for (const name of ["planner", "budget"]) this.input(name).disabled = !planned;
    this.button.textContent = this.input("beside").value ? "Start both" : "Start";
  }

  blame(name, text) {
    const { input, problem } = this.fields.get(name);
    problem.textContent = text;
    input.toggleAttribute("aria-invalid", text !== "");
  }

  async start() {
    for (const name of this.fields.keys()) this.blame(name, "");
    this.problems.textContent = "";
    this.button.disabled = true;
    try {
      const body = await this.request(), strategies = [this.input("strategy").value, this.input("beside").value].filter(Boolean);
      const begun = [];
      for (const [i, strategy] of strategies.entries()) {
        this.asked = i ? "beside" : "strategy";
        begun.push(await post("/v1/simulations", { ...body, strategy }, crypto.randomUUID?.()));
      }
      this.started(begun);
    } catch (error) {
      this.refuse(error);
    } finally {
      this.button.disabled = false;
    }
  }

  /** What is asked for, but for the strategy. */
  async request() {
    const value = (name) => this.input(name).value, number = (name) => (value(name) === "" ? null : Number(value(name)));
    const body = { carriers: number("carriers"), rovers: number("rovers"), seed: number("seed") };
    if (value("scenario") === OWN_MAP) body.map = await this.map(); else body.scenario = value("scenario");
    if (!this.input("planner").disabled) Object.assign(body, { planner: value("planner"), budget: { seconds: number("budget") } });
    if (value("speed")) body.speed = number("speed");
    return body;
  }

  async map() {
    const [yaml] = this.input("yaml").files, [image] = this.input("image").files, missing = [];
    if (!yaml) missing.push({ pointer: "/map/yaml", detail: "choose the map's yaml file" });
    if (!image) missing.push({ pointer: "/map/image_base64", detail: "choose the image that the yaml file names" });
    if (missing.length) throw new Refused(0, { errors: missing });
    return { name: yaml.name.replace(/\.ya?ml$/i, "") || "map", yaml: await yaml.text(), image_base64: await base64(image), image_name: image.name };
  }

  refuse(error) {
    const told = new Map();
    for (const { pointer = "", detail } of error.errors || []) {
      const meant = FIELDS.find(([start]) => pointer === start || pointer.startsWith(`${start}/`)), name = meant ? meant[1] : "";
      const field = name === "strategy" ? this.asked : name;
      told.set(field, [...(told.get(field) || []), detail]);
    }
    for (const [name, details] of told) if (name) this.blame(name, details.join("\n"));
    const elsewhere = told.get("") || (told.size ? [] : [error.message]);
    this.problems.textContent = elsewhere.join("\n");
    const first = [...told.keys()].find(Boolean);
    if (first) this.input(first).focus();
  }
}

/** The bytes of a file in base 64. */
async function base64(file) {
  const address = await new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(file);
  });
  return address.slice(address.indexOf(",") + 1);
}
