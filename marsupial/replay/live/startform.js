/* The form that starts a mission in the simulator, or some side by side, with a preview of its map. What the service refuses
   stands beside the field that was meant. */

import { make } from "#draw/dom.js";
import { Preview } from "#live/preview.js";
import { get, post, Refused } from "#live/service.js";

const OWN_MAP = "";
const SPEEDS = [
  [1, "real time"],
  [5, "5 times"],
  [10, "10 times"],
  [30, "30 times"],
  [100, "100 times"],
  ["", "as fast as it can be planned"],
];
const SPEED = 10;
const MAP_FILE = /\.(ya?ml|pgm|png)$/i;
const SOON_MS = 250; // after a change, the map is requested anew

/** The field that a JSON pointer into the request means; problems of a map as a whole stand below all fields. */
const FIELDS = [
  ["/map/yaml", "yaml"],
  ["/map/image_base64", "image"],
  ["/map/name", "yaml"],
  ["/scenario", "scenario"],
  ["/carriers", "carriers"],
  ["/rovers", "rovers"],
  ["/strategy", "strategy"],
  ["/planner", "planner"],
  ["/seed", "seed"],
  ["/budget", "budget"],
  ["/speed", "speed"],
];

export class StartForm {
  /** `open(missions)` is called with the missions that were started. */
  constructor(open) {
    this.open = open;
    Object.assign(this, { fields: new Map(), coarser: 1, beside: [], roverless: [] });
    Object.assign(this, { pending: false, stale: 0, version: 0, attempts: 0 });
    this.over = new AbortController();
    this.preview = new Preview(() => this.look(), this.over.signal);
    this.element = make("form", {
      class: "card start",
      novalidate: true,
      "aria-labelledby": "start-title",
      onsubmit: (event) => {
        event.preventDefault();
        this.start();
      },
    });
    this.element.append(
      make("h1", { id: "start-title", text: "Explore a map in the simulator" }),
      make("p", { class: "dim", text: "asking what there is …" }),
    );
    this.fill();
    this.listen();
  }

  /** Take maps that are dropped anywhere on the page. */
  listen() {
    const { signal } = this.over;
    window.addEventListener("dragover", (event) => event.preventDefault(), { signal });
    window.addEventListener(
      "drop",
      (event) => {
        event.preventDefault();
        this.drop([...event.dataTransfer.files]);
      },
      { signal },
    );
  }

  close() {
    this.over.abort();
    clearTimeout(this.stale);
  }

  drop(files) {
    if (!this.upload || !files.length) return;
    const ofMap = files.filter((file) => MAP_FILE.test(file.name));
    if (!ofMap.length) {
      this.showProblems(files.map(({ name }) => ({ detail: `${name} is neither a yaml file nor a PNG or PGM image` })));
      return;
    }
    for (const file of ofMap) {
      const given = new DataTransfer();
      given.items.add(file);
      this.input(/\.ya?ml$/i.test(file.name) ? "yaml" : "image").files = given.files;
    }
    this.input("scenario").value = OWN_MAP;
    this.adapt();
    this.look(true);
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
    const notes = ({ name, with_rovers }) => [
      name,
      name === defaults.strategy && "(recommended)",
      !with_rovers && "(rovers 0 only)",
    ];
    const names = strategies.map((one) => [one.name, notes(one).filter(Boolean).join(" ")]);
    this.element.append(
      this.select(
        "scenario",
        "Map",
        [
          ...scenarios.map((one) => [one.name, `${one.name}: ${one.width_m} × ${one.height_m} m`]),
          [OWN_MAP, "my own map (nav2) …"],
        ],
        scenarios[0].name,
      ),
      (this.note = make("p", { class: "dim note" })),
      (this.upload = make(
        "div",
        { class: "files" },
        this.file("yaml", "Its yaml file", ".yaml,.yml,text/yaml"),
        this.file("image", "Its image", ".pgm,.png,image/png,image/x-portable-graymap"),
      )),
      make(
        "div",
        { class: "pair" },
        this.number("carriers", "Carriers", defaults.carriers, 1),
        this.number("rovers", "Rovers on each", defaults.rovers, 0),
      ),
      this.select("strategy", "Strategy", names, defaults.strategy),
      (this.idea = make("p", { class: "dim note" })),
      (this.others = make(
        "details",
        { class: "others", ontoggle: () => this.showRoom() },
        make("summary", { text: "Compare with others" }),
        make("div", {}, ...strategies.map((one) => this.other(one))),
        (this.room = make("p", { class: "dim note" })),
      )),
      this.select("speed", "Speed", SPEEDS, SPEED),
      (this.more = make(
        "details",
        { class: "more" },
        make("summary", { text: "More" }),
        make(
          "div",
          { class: "pair" },
          this.select(
            "planner",
            "Planner",
            planners.map((name) => [name, name]),
            defaults.planner,
          ),
          this.number("budget", "Seconds for each plan", defaults.budget.seconds ?? 1, 0.05, 0.05),
        ),
        make("div", { class: "pair" }, this.number("seed", "Seed of the starts", defaults.seed, 0)),
      )),
      (this.problems = make("p", { class: "problem", role: "alert" })),
      (this.button = make("button", { class: "first", text: "Start" })),
    );
    for (const name of ["scenario", "strategy", "rovers"]) {
      this.input(name).addEventListener("change", () => this.adapt());
    }
    for (const name of ["carriers", "rovers", "seed"]) this.input(name).addEventListener("input", () => this.look());
    for (const name of ["scenario", "yaml", "image"]) {
      this.input(name).addEventListener("change", () => this.look(true));
    }
    this.adapt();
    this.look(true);
  }

  input(name) {
    return this.fields.get(name).input;
  }

  field(name, label, input) {
    const id = `start-${name}`,
      problem = make("span", { class: "problem", id: `${id}-problem`, role: "alert" });
    input.id = id;
    input.name = name;
    input.setAttribute("aria-describedby", problem.id);
    input.addEventListener("input", () => this.showProblem(name, ""));
    this.fields.set(name, { input, problem });
    return make("label", { for: id }, make("span", { text: label }), input, problem);
  }

  /** A box for a strategy that does the same mission besides. */
  other({ name, summary, with_rovers }) {
    const box = make("input", {
      type: "checkbox",
      id: `start-beside-${name}`,
      onchange: () => {
        this.beside = [...this.beside.filter((one) => one !== name), ...(box.checked ? [name] : [])];
        this.adapt();
        this.showRoom();
      },
    });
    const label = make("label", {}, box, make("span", {}, name, make("small", { class: "dim", text: summary })));
    if (!with_rovers) this.roverless.push({ box, label });
    return label;
  }

  select(name, label, options, chosen) {
    const input = make("select", {}, ...options.map(([value, text]) => make("option", { value, text })));
    input.value = chosen;
    return this.field(name, label, input);
  }

  number(name, label, value, min, step = 1) {
    return this.field(name, label, make("input", { type: "number", value, min, step, required: true }));
  }

  file(name, label, accept) {
    return this.field(name, label, make("input", { type: "file", accept }));
  }

  /** Show what goes with what is chosen. */
  adapt() {
    const named = this.input("scenario").value,
      one = this.offer.scenarios.find((each) => each.name === named);
    this.note.textContent = one ? one.summary : "the two files that map_saver writes; drop them anywhere on the page";
    this.upload.hidden = one !== undefined;
    this.idea.textContent = this.offer.strategies.find((each) => each.name === this.input("strategy").value).summary;
    const rovers = Number(this.input("rovers").value) !== 0;
    for (const { box, label } of this.roverless) {
      label.hidden = rovers;
      if (rovers && box.checked) box.click();
    }
    for (const box of this.others.querySelectorAll("input")) {
      box.disabled = box.id === `start-beside-${this.input("strategy").value}`;
    }
    const needsPlanner = (name) => this.offer.strategies.some((each) => each.name === name && each.asks_planner);
    const planned = this.strategies.some(needsPlanner);
    for (const name of ["planner", "budget"]) this.input(name).disabled = !planned;
    this.button.textContent = this.strategies.length > 1 ? `Start ${this.strategies.length} missions` : "Start";
  }

  /** The strategies that are started, each once. */
  get strategies() {
    return [...new Set([this.input("strategy").value, ...this.beside])];
  }

  /** Request a preview of the map soon; `another`: it is another map than before. */
  look(another = false) {
    this.version++;
    const own = this.input("scenario").value === OWN_MAP,
      lacks = ["yaml", "image"].filter((name) => own && !this.input(name).files.length);
    if (another) {
      this.coarser = 1;
      this.preview.clear();
      this.preview.show(
        null,
        0,
        lacks.length ? `choose or drop the map's ${lacks.join(" and ").replace("yaml", "yaml file")}` : "",
      );
    }
    this.preview.starts.length = Math.min(
      this.preview.starts.length,
      Math.max(0, Number(this.input("carriers").value)),
    );
    this.preview.draw();
    clearTimeout(this.stale);
    if (!lacks.length) this.stale = setTimeout(() => this.requestPreview(), SOON_MS);
  }

  async requestPreview() {
    if (this.pending) {
      this.stale = setTimeout(() => this.requestPreview(), SOON_MS);
      return;
    }
    const { version, attempts } = this;
    // what a start was answered stands
    const show = (errors) => {
      if (attempts === this.attempts) this.showProblems(errors);
    };
    this.pending = true;
    this.preview.wait();
    try {
      const body = await this.request(),
        map = await post("/v1/simulations/preview", body);
      if (version !== this.version) return;
      show(map.errors);
      this.preview.show(map, body.rovers);
    } catch (error) {
      if (version !== this.version) return;
      const isLost = error.errors?.some(({ pointer = "" }) => /^\/(map|scenario)/.test(pointer));
      this.preview.show(
        isLost ? null : this.preview.map,
        this.preview.rovers,
        isLost ? "no map to show: the form says why" : "",
      );
      show(error.errors?.length ? error.errors : [{ detail: error.message }]);
    } finally {
      this.pending = false;
    }
  }

  showProblem(name, text) {
    const { input, problem } = this.fields.get(name);
    problem.textContent = text;
    input.toggleAttribute("aria-invalid", text !== "");
    if (text && this.more.contains(input)) this.more.open = true;
    const [, by] = /cells (\d) times as large/.exec(text) ?? [];
    if (by) {
      problem.append(
        " ",
        make("button", {
          type: "button",
          text: `Use cells ${by} times as large`,
          onclick: () => {
            this.coarser = Number(by);
            this.look();
          },
        }),
      );
    }
  }

  async start() {
    clearTimeout(this.stale);
    this.attempts++;
    this.button.disabled = true;
    try {
      const body = await this.request();
      this.showProblems([]);
      this.open(await this.begin(body, this.strategies));
    } catch (error) {
      const first = this.showProblems(error.errors?.length ? error.errors : [{ detail: error.message }]);
      if (first) this.input(first).focus();
    } finally {
      this.button.disabled = false;
    }
  }

  /** Create a mission for each strategy: all, or none. */
  async begin(body, strategies) {
    const count = strategies.length,
      started = [];
    if (count > 1 && count > (await this.showRoom())) {
      throw new Error(`${count} missions can't start now. ${this.room.textContent}`);
    }
    try {
      for (const strategy of strategies) {
        started.push(await post("/v1/simulations", { ...body, strategy }, crypto.randomUUID?.()));
      }
    } catch (error) {
      await Promise.allSettled(started.map(({ links }) => post(links.cancel)));
      throw error;
    }
    return started;
  }

  /** Show how many missions may start now; returns the number, without a limit if the service can't be reached. */
  async showRoom() {
    try {
      const { limit, free } = (await get("/v1/scenarios")).simulations;
      this.room.textContent = `At most ${limit} simulated missions run here at a time; ${free} more may start now.`;
      return free;
    } catch (error) {
      this.room.textContent = error.message;
      return Infinity;
    }
  }

  /** The request, without its strategy. */
  async request() {
    const value = (name) => this.input(name).value,
      number = (name) => (value(name) === "" ? null : Number(value(name)));
    const body = {
      carriers: number("carriers"),
      rovers: number("rovers"),
      seed: number("seed"),
      ...this.preview.request,
    };
    if (value("scenario") === OWN_MAP) body.map = await this.map();
    else body.scenario = value("scenario");
    if (!this.input("planner").disabled) {
      Object.assign(body, { planner: value("planner"), budget: { seconds: number("budget") } });
    }
    if (value("speed")) body.speed = number("speed");
    return body;
  }

  async map() {
    const [yaml] = this.input("yaml").files,
      [image] = this.input("image").files,
      missing = [];
    if (!yaml) missing.push({ pointer: "/map/yaml", detail: "choose the map's yaml file" });
    if (!image) missing.push({ pointer: "/map/image_base64", detail: "choose the image that the yaml file names" });
    if (missing.length) throw new Refused(0, { errors: missing });
    return {
      name: yaml.name.replace(/\.ya?ml$/i, "") || "map",
      yaml: await yaml.text(),
      image_base64: await base64(image),
      image_name: image.name,
      ...(this.coarser > 1 ? { coarser: this.coarser } : {}),
    };
  }

  /** Show problems beside their fields, and nothing else; returns the first of them. */
  showProblems(errors) {
    const byField = new Map([...this.fields.keys()].map((name) => [name, []]).concat([["", []]]));
    for (const { pointer = "", detail } of errors) {
      const meant = FIELDS.find(([start]) => pointer === start || pointer.startsWith(`${start}/`));
      byField.get(meant ? meant[1] : "").push(detail);
    }
    this.problems.textContent = byField.get("").join("\n");
    for (const [name, details] of byField) if (name) this.showProblem(name, details.join("\n"));
    return [...byField].find(([name, details]) => name && details.length)?.[0];
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
