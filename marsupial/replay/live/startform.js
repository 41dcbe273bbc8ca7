/* The form that starts a mission in the simulator, or some side by side, with a preview of its map. What the service
   refuses stands beside the field that was meant. */

import { make } from "#draw/dom.js";
import { base64, Fields } from "#live/fields.js";
import { Preview } from "#live/preview.js";
import { get, messageOf, post, problemsOf, Refused } from "#live/service.js";

const OWN_MAP = "";
/** @type {[value: string, text: string][]} */
const SPEEDS = [
  ["1", "real time"],
  ["5", "5 times"],
  ["10", "10 times"],
  ["30", "30 times"],
  ["100", "100 times"],
  ["", "as fast as it can be planned"],
];
const SPEED = "10";
const APART = "Robots pass through each other here. On the command line, --interference keeps them apart.";
const MAP_FILE = /\.(ya?ml|pgm|png)$/i;
const YAML_FILE = /\.ya?ml$/i;
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

/** @typedef {{ id: string, links: { cancel: string } }} Started */

export class StartForm {
  /** @param {(missions: { id: string }[]) => void} open is called with the missions that were started */
  constructor(open) {
    this.open = open;
    this.fields = new Fields();
    this.coarser = 1; // how many cells of the file make one
    /** @type {Offer | null} */
    this.offer = null;
    /** @type {string[]} */
    this.beside = []; // strategies that do the same mission besides
    /** @type {{ name: string, with_rovers: boolean, box: HTMLInputElement, label: HTMLElement }[]} */
    this.boxes = []; // for them
    this.pending = false; // a preview
    this.stale = 0; // timer until the next one
    this.version = 0; // of what it shows
    this.attempts = 0; // to start
    this.closed = new AbortController();
    this.preview = new Preview(() => this.look(), this.closed.signal);
    this.note = make("p", { class: "dim note" });
    this.upload = make("div", { class: "files" });
    this.idea = make("p", { class: "dim note" });
    this.room = make("p", { class: "dim note" });
    this.more = make("details", { class: "more" }, make("summary", { text: "More" }));
    this.problems = make("p", { class: "problem", role: "alert" });
    this.button = make("button", { class: "first", text: "Start" });
    /** @type {(event: Event) => void} */
    const onsubmit = (event) => {
      event.preventDefault();
      this.start();
    };
    const attributes = { class: "card start", novalidate: true, "aria-labelledby": "start-title", onsubmit };
    const title = make("h1", { id: "start-title", text: "Explore a map in the simulator" });
    this.waiting = make("p", { class: "dim", text: "asking what there is …" });
    this.element = make("form", attributes, title, this.waiting);
    this.fill();
    this.listen();
  }

  /** Take maps that are dropped anywhere on the page. */
  listen() {
    const { signal } = this.closed;
    /** @type {(event: DragEvent) => void} */
    const drop = (event) => {
      event.preventDefault();
      this.drop([...(event.dataTransfer?.files ?? [])]);
    };
    window.addEventListener("dragover", (event) => event.preventDefault(), { signal });
    window.addEventListener("drop", drop, { signal });
  }

  close() {
    this.closed.abort();
    clearTimeout(this.stale);
  }

  /** @type {(files: File[]) => void} */
  drop(files) {
    if (!this.offer || !files.length) return;
    const ofMap = files.filter((file) => MAP_FILE.test(file.name));
    if (!ofMap.length) {
      this.showProblems(files.map(({ name }) => ({ detail: `${name} is neither a yaml file nor a PNG or PGM image` })));
      return;
    }
    for (const file of ofMap) this.fields.setFile(YAML_FILE.test(file.name) ? "yaml" : "image", file);
    this.fields.input("scenario").value = OWN_MAP;
    this.adapt(this.offer);
    this.look(true);
  }

  /** Make the form of what the service offers. */
  async fill() {
    /** @type {Offer} */
    let offer;
    try {
      offer = await get("/v1/scenarios");
    } catch (error) {
      this.waiting.textContent = messageOf(error);
      return;
    }
    this.offer = offer;
    this.waiting.remove();
    this.build(offer);
    this.adapt(offer);
    this.look(true);
  }

  /** @type {(offer: Offer) => void} */
  build(offer) {
    const { fields } = this;
    const { scenarios, strategies, planners, defaults } = offer;
    /** @type {[value: string, text: string][]} */
    const maps = scenarios.map((one) => [one.name, `${one.name}: ${one.width_m} × ${one.height_m} m`]);
    this.upload.append(
      fields.file("yaml", "Its yaml file", ".yaml,.yml,text/yaml"),
      fields.file("image", "Its image", ".pgm,.png,image/png,image/x-portable-graymap"),
    );
    const planner = fields.select(
      "planner",
      "Planner",
      planners.map((name) => [name, name]),
      defaults.planner,
    );
    const budget = fields.number("budget", "Seconds for each plan", defaults.budget.seconds ?? 1, 0.05, 0.05);
    const seed = fields.number("seed", "Seed of the starts", defaults.seed, 0);
    const apart = make("p", { class: "dim note", text: APART });
    this.more.append(make("div", { class: "pair" }, planner, budget), make("div", { class: "pair" }, seed), apart);
    this.boxes = strategies.map((strategy) => this.boxOf(strategy));
    this.element.append(
      fields.select("scenario", "Map", [...maps, [OWN_MAP, "my own map (nav2) …"]], scenarios[0].name),
      this.note,
      this.upload,
      make(
        "div",
        { class: "pair" },
        fields.number("carriers", "Carriers", defaults.carriers, 1),
        fields.number("rovers", "Rovers on each", defaults.rovers, 0),
      ),
      fields.select("strategy", "Strategy", strategyOptions(offer), defaults.strategy),
      this.idea,
      make(
        "details",
        { class: "others", ontoggle: () => this.showRoom() },
        make("summary", { text: "Compare with others" }),
        make("div", {}, ...this.boxes.map((one) => one.label)),
        this.room,
      ),
      fields.select("speed", "Speed", SPEEDS, SPEED),
      this.more,
      this.problems,
      this.button,
    );
    for (const name of ["scenario", "strategy", "rovers"]) {
      fields.input(name).addEventListener("change", () => this.adapt(offer));
    }
    for (const name of ["carriers", "rovers", "seed"]) {
      fields.input(name).addEventListener("input", () => this.look());
    }
    for (const name of ["scenario", "yaml", "image"]) {
      fields.input(name).addEventListener("change", () => this.look(true));
    }
  }

  /** A box for a strategy that does the same mission besides.
      @param {Offer["strategies"][number]} strategy */
  boxOf({ name, summary, with_rovers }) {
    const onchange = () => {
      this.beside = this.beside.filter((one) => one !== name);
      if (box.checked) this.beside.push(name);
      if (this.offer) this.adapt(this.offer);
      this.showRoom();
    };
    const box = make("input", { type: "checkbox", id: `start-beside-${name}`, onchange });
    const text = make("span", {}, name, make("small", { class: "dim", text: summary }));
    return { name, with_rovers, box, label: make("label", {}, box, text) };
  }

  /** Show what goes with what is chosen.
      @type {(offer: Offer) => void} */
  adapt({ scenarios, strategies }) {
    const { fields } = this;
    const scenario = scenarios.find((one) => one.name === fields.value("scenario"));
    this.note.textContent = scenario?.summary ?? "the two files that map_saver writes; drop them anywhere on the page";
    this.upload.hidden = scenario !== undefined;
    const chosen = fields.value("strategy");
    this.idea.textContent = strategies.find((one) => one.name === chosen)?.summary ?? "";
    const hasRovers = fields.numberIn("rovers") !== 0;
    for (const { name, with_rovers, box, label } of this.boxes) {
      box.disabled = name === chosen;
      label.hidden = hasRovers && !with_rovers;
      if (label.hidden && box.checked) box.click();
    }
    const planned = strategies.some((one) => one.asks_planner && this.strategies.includes(one.name));
    for (const name of ["planner", "budget"]) fields.input(name).disabled = !planned;
    const count = this.strategies.length;
    this.button.textContent = count > 1 ? `Start ${count} missions` : "Start";
  }

  /** The strategies that are started, each once. */
  get strategies() {
    return [...new Set([this.fields.value("strategy"), ...this.beside])];
  }

  /** Request a preview of the map soon; `another`: it is another map than before. */
  look(another = false) {
    this.version++;
    const own = this.fields.value("scenario") === OWN_MAP;
    const lacks = own ? ["yaml", "image"].filter((name) => !this.fields.fileIn(name)) : [];
    if (another) {
      const files = lacks.join(" and ").replace("yaml", "yaml file");
      this.coarser = 1;
      this.preview.clear();
      this.preview.show(null, 0, files && `choose or drop the map's ${files}`);
    }
    const carriers = Math.max(0, Number(this.fields.value("carriers")));
    this.preview.starts = this.preview.starts.slice(0, carriers);
    this.preview.draw();
    clearTimeout(this.stale);
    if (!lacks.length) this.requestSoon();
  }

  requestSoon() {
    this.stale = setTimeout(() => this.requestPreview(), SOON_MS);
  }

  async requestPreview() {
    if (this.pending) {
      this.requestSoon();
      return;
    }
    const { version, attempts } = this;
    this.pending = true;
    this.preview.wait();
    /** @type {FieldProblem[]} */
    let problems;
    try {
      const body = await this.request();
      /** @type {MapPreview} */
      const map = await post("/v1/simulations/preview", body);
      problems = map.errors;
      if (version === this.version) this.preview.show(map, body.rovers ?? 0);
    } catch (error) {
      problems = problemsOf(error);
      if (version === this.version) this.showUnseen(problems);
    } finally {
      this.pending = false;
    }
    // what a start was answered stands
    if (version === this.version && attempts === this.attempts) this.showProblems(problems);
  }

  /** Show the map before, unless it is the map that has problems.
      @type {(problems: FieldProblem[]) => void} */
  showUnseen(problems) {
    const isLost = problems.some(({ pointer = "" }) => /^\/(map|scenario)/.test(pointer));
    if (isLost) this.preview.show(null, this.preview.rovers, "no map to show: the form says why");
    else this.preview.show(this.preview.map, this.preview.rovers);
  }

  /** @type {(name: string, text: string) => void} */
  showProblem(name, text) {
    const problem = this.fields.showProblem(name, text);
    if (text && this.more.contains(problem)) this.more.open = true;
    const by = /cells (\d) times as large/.exec(text)?.[1];
    if (!by) return;
    const onclick = () => {
      this.coarser = Number(by);
      this.look();
    };
    problem.append(" ", make("button", { type: "button", text: `Use cells ${by} times as large`, onclick }));
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
      const first = this.showProblems(problemsOf(error));
      if (first) this.fields.input(first).focus();
    } finally {
      this.button.disabled = false;
    }
  }

  /** Create a mission for each strategy: all, or none.
      @type {(body: object, strategies: string[]) => Promise<Started[]>} */
  async begin(body, strategies) {
    const count = strategies.length;
    /** @type {Started[]} */
    const started = [];
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
      /** @type {Offer} */
      const { simulations } = await get("/v1/scenarios");
      const { limit, free } = simulations;
      this.room.textContent = `At most ${limit} simulated missions run here at a time; ${free} more may start now.`;
      return free;
    } catch (error) {
      this.room.textContent = messageOf(error);
      return Infinity;
    }
  }

  /** The request, without its strategy. */
  async request() {
    const { fields } = this;
    const scenario = fields.value("scenario");
    const isPlanned = !fields.input("planner").disabled;
    return {
      carriers: fields.numberIn("carriers"),
      rovers: fields.numberIn("rovers"),
      seed: fields.numberIn("seed"),
      ...this.preview.request,
      ...(scenario === OWN_MAP ? { map: await this.map() } : { scenario }),
      ...(isPlanned ? { planner: fields.value("planner"), budget: { seconds: fields.numberIn("budget") } } : {}),
      ...(fields.value("speed") ? { speed: fields.numberIn("speed") } : {}),
    };
  }

  /** The map of the files that were chosen. Throws Refused where one is missing. */
  async map() {
    const [yaml, image] = [this.fields.fileIn("yaml"), this.fields.fileIn("image")];
    const errors = [];
    if (!yaml) errors.push({ pointer: "/map/yaml", detail: "choose the map's yaml file" });
    if (!image) errors.push({ pointer: "/map/image_base64", detail: "choose the image that the yaml file names" });
    if (!yaml || !image) throw new Refused(0, { errors });
    return {
      name: yaml.name.replace(YAML_FILE, "") || "map",
      yaml: await yaml.text(),
      image_base64: await base64(image),
      image_name: image.name,
      ...(this.coarser > 1 ? { coarser: this.coarser } : {}),
    };
  }

  /** Show problems beside their fields, and nothing else; returns the first field that has one.
      @type {(errors: FieldProblem[]) => string | undefined} */
  showProblems(errors) {
    /** @type {Map<string, string>} */
    const texts = new Map();
    for (const { pointer = "", detail } of errors) {
      const name = FIELDS.find(([start]) => pointer === start || pointer.startsWith(`${start}/`))?.[1] ?? "";
      texts.set(name, texts.has(name) ? `${texts.get(name)}\n${detail}` : detail);
    }
    const names = [...this.fields.byName.keys()];
    this.problems.textContent = texts.get("") ?? "";
    for (const name of names) this.showProblem(name, texts.get(name) ?? "");
    return names.find((name) => texts.has(name));
  }
}

/** The strategies of a service with what is to be known before one is chosen.
    @type {(offer: Offer) => [value: string, text: string][]} */
function strategyOptions({ strategies, defaults }) {
  return strategies.map(({ name, with_rovers }) => {
    const notes = [name === defaults.strategy && "(recommended)", !with_rovers && "(rovers 0 only)"];
    return [name, [name, ...notes].filter(Boolean).join(" ")];
  });
}
