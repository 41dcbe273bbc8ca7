/* Types that several modules share. For tsc alone: no browser reads this file. */

type Mission = import("#log/model.js").Mission;
type Robot = import("#log/robot.js").Robot;
type KnownMap = import("#log/knownmap.js").KnownMap;
type Camera = import("#draw/camera.js").Camera;

/** Column and row in the first frame of a mission; places between cells have fractions. */
type Cell = [x: number, y: number];

/** A point of a canvas, from its upper left corner, or in metres in the frame of a map. */
type Point = [x: number, y: number];

/** A box on a canvas. */
type Box = [left: number, top: number, width: number, height: number];

/** Cells from `left` to `right` and from `low` to `high`, these included. */
type Extent = { left: number; right: number; low: number; high: number };

/* Lines of a log, as docs/mission-log.md describes them. */

type Role = "carrier" | "rover";
type ActionName = "move" | "explore" | "dock" | "undock";
type ActionEnd = "done" | "superseded" | "blocked" | "failed" | "lost";
type ZoneKind = "no_go" | "priority" | "explore";

type Terrain = { code: number; name: string };

type RobotKind = {
  name: string;
  role: Role;
  speed_mps: number;
  sensor_range_m: number;
  radius_m: number;
  terrains: number[];
  capacity: number;
  seats?: [type: string, most: number][];
  diagonal?: number;
  battery?: object;
};

type PlacedRobot = { name: string; type: string; cell: Cell | null; carrier: string | null };

type Target = { name: string; cell: Cell; explorers: string[]; reveal_m2: number; frontier_cells: number };

type Meeting = { name: string; carrier_cell: Cell; rover_cell: Cell; carrier_type: string; rover_type: string };

type Action = {
  name: ActionName;
  start_ms: number;
  duration_ms: number;
  robot: string;
  place: string;
  carrier: string | null;
  origin: string | null;
  along?: boolean; // another robot reaches the target sooner (noteAlong)
};

/** A frontier that is left at the end, and why. */
type Remaining = { cell: Cell; frontier_cells: number; reason: string };

/** A zone of an operator; corners in metres. */
type LoggedZone = { kind: ZoneKind; polygon_m: Point[]; weight?: number };

type FrameOfMap = { origin_m: [x: number, y: number, yaw: number]; resolution_m: number };

type MissionLine = FrameOfMap & {
  event: "mission";
  t_ms: number;
  scenario: string;
  strategy: string;
  planner: string;
  seed: number;
  width: number;
  height: number;
  terrains: Terrain[];
  types: RobotKind[];
  robots: PlacedRobot[];
  chargers?: Cell[];
};

/** `cells`: for each run the cells since the end of the run before, its length, its code. */
type LookLine = { event: "reveal" | "change"; t_ms: number; robot: string; cells: number[] };
type FrameLine = { event: "frame"; t_ms: number; width: number; height: number; shift: Cell };
type DriveLine = { event: "drive"; t_ms: number; robot: string; cell: Cell; steps: string };
type StandLine = { event: "stand"; t_ms: number; robot: string; cell: Cell };
type PlanLine = {
  event: "plan";
  t_ms: number;
  revision: number;
  trigger: string;
  targets: (Target | string)[];
  meetings: (Meeting | string)[];
  actions: Action[];
  charges?: [robot: string, share: number][];
  guess?: GuessedGround;
  compared?: Compared[];
  instead?: Instead[];
};

/** Unknown squares whose contents are guessed, by column and row, a `side` of cells each, from the cell `corner` on. */
type GuessedGround = { corner: Cell; side: number; halls: Cell[]; rooms: Cell[] };

/** A plan that was compared with others: whose it is. */
type Compared = [maker: string, price_ms: number, left_out: number];

/** Where a robot would go first by the second of the plans compared. */
type Instead = [robot: string, places: string[]];
type StartLine = { event: "start"; t_ms: number; revision: number; action: Action; cell: Cell };
type EndLine = { event: "end"; t_ms: number; revision: number; action: Action; end: ActionEnd };
type LostLine = { event: "lost"; t_ms: number; robot: string; reason: string };
type BackLine = { event: "returned" | "contact"; t_ms: number; robot: string };
type AwayLine = { event: "away"; t_ms: number; robot: string; cell: Cell; wait_ms: number };
type SpeedLine = { event: "speed"; t_ms: number; robot: string; share: number };
type ZoneLine = { event: "zone"; t_ms: number; name: string; zone: LoggedZone | null };
type EndedLine = {
  event: "ended";
  t_ms: number;
  status: string;
  reason: string;
  exploration_ms: number | null;
  explored_area_m2: number;
  reachable_area_m2: number;
  distance_m: [robot: string, metres: number][];
  energy_j: [robot: string, joules: number][];
  deployments: number;
  retrievals: number;
  plans_valid: number;
  plans_invalid: number;
  remaining: Remaining[];
  known_ms?: [percent: number, ms: number | null][];
};

type LogLine =
  | MissionLine
  | LookLine
  | FrameLine
  | DriveLine
  | StandLine
  | PlanLine
  | StartLine
  | EndLine
  | LostLine
  | BackLine
  | AwayLine
  | SpeedLine
  | ZoneLine
  | EndedLine;

/* What a mission makes of them. */

/** A plan; `looks`: how many had come before it. */
type Plan = {
  t_ms: number;
  revision: number;
  trigger: string;
  targets: Target[];
  meetings: Meeting[];
  actions: Action[];
  looks: number;
  guess: GuessedGround | null;
  compared: Compared[];
  instead: Instead[];
};

type Standing = { x: number; y: number; heading: number; times?: undefined; aboard?: undefined };
type Riding = { x: number; y: number; heading: number; times?: undefined; aboard: string };
type Driving = {
  times: Float64Array; // ms, at each cell
  xs: Int32Array;
  ys: Int32Array;
  lengths: Float64Array; // metres, at each cell
  heading: number; // before the first step
  aboard?: undefined;
};
type Leg = Standing | Driving | Riding;

/** What a robot stands or drives on, or whom it is aboard; `left`: the carrier that sets it down. */
type Whereabouts = { at: Standing | Driving | null; carrier: string | null; left: string | null };

/** From `start` to `to` in ms; null: not over yet. */
type Span = { start: number; to: number | null };
type Segment = Span & { action: Action; revision: number; end: ActionEnd | null };
type Aboard = Span & { carrier: string };
type Loss = Span & { reason: string };
type Parting = Span & { cell: Cell; wait_ms: number };

/** A robot at a moment: its place in cells, metres driven, and its loss and parting, if it has any. */
type RobotView = {
  robot: Robot;
  carrier: Robot | null;
  x: number;
  y: number;
  heading: number;
  leg: Leg;
  action: Action | null;
  driven: number;
  lost: Loss | null;
  away: Parting | null;
  charge: number | null;
};

/** A target or meeting point with its short name; `logged`: its name in the log when it was first named. */
type Place = { label: string; since: number } & (
  { kind: "target"; thing: Target } | { kind: "meeting"; thing: Meeting }
);

type Zone = LoggedZone & { corners: Cell[] };

/** An action of a plan that is not over; `wait`: for whom its robot waits before, and from when on. */
type Ahead = { action: Action; to: number; wait: { from: number; partner: string } | null };

/** A robot without work; `partner`: for whom it waits, where that is known. */
type Wait = { start: number; to: number; partner: string | null };

/* What pages show. */

/** A title and lines of text. */
type Story = { title: string; lines: string[] };

/** Something that can be pointed at or chosen. */
type Thing = {
  robot?: Robot;
  place?: string | null; // where the robot is at work
  target?: string;
  meeting?: string;
  remaining?: Remaining;
  unplanned?: Cell; // of a frontier that no target lies on
};

/** A thing that is drawn within `r` points of a point. */
type Hit = Thing & { x: number; y: number; r: number };

/** What is chosen in a pane; names of places and robots in its sentence. */
type Focus = { robot: Robot | null; place: string | null };

/** Which layers are shown, by their names. */
type Layers = Record<string, boolean>;

/** The colours of the theme by name. */
type Ink = Record<string, string>;

type Colours = Map<string, string>;

type Context = CanvasRenderingContext2D;

/** What an element is made with; `text` becomes its content, functions listen (`onclick`). */
type Attributes = { [name: string]: string | number | boolean | null | undefined | ((event: Event) => void) };

type Size = { width: number; height: number };

/** A map as runs of cells: start, length, code. */
type CellMap = Size & { runs: number[] };

/** What the colours of a team depend on; `home`: the carrier that a rover starts aboard. */
type Crew = { robots: { name: string; home: string | null }[] };

type Lanes = import("#draw/lanes.js").Lanes;

/** The lane of a robot of the i-th mission, from `top` down. */
type Row = { mission: Mission; i: number; robot: Robot; waits: Wait[]; top: number };

/** What a view can be given besides its missions. */
type ViewOptions = {
  live?: boolean; // it goes with the newest moment
  result?: boolean; // it opens with the end
  rate?: number | null; // live: seconds of the mission a second, where that is known
  save?: SaveButton;
  home?: HTMLElement[]; // first in the head
  controls?: HTMLElement[]; // for each mission, what stands in the place of its name and state
  shared?: HTMLElement[]; // controls of all missions, in the head
};

type SaveButton = [label: string, save: () => void];

/** The text of a log and the name of its file. */
type NamedLog = { text: string; name: string };

/* What the service answers, as far as its page shows it; docs/service.md and openapi.json have all of it. */

type Simulation = { carriers: number; rovers: number; seed: number; speed: number | null; warnings: string[] };

type MissionEntry = {
  id: string;
  name: string;
  strategy: string;
  planner: string;
  state: string;
  status?: string | null; // how it ended
  reason?: string | null;
  t_ms: number;
  simulation: Simulation | null;
};

type JobEntry = {
  id: string;
  planner: string;
  plans: number;
  makespan_ms: number | null;
  lower_bound_ms?: number | null;
  state: string;
  outcome?: string | null;
  detail?: string | null;
};

/** A page of a list; `next` is null on the last one. */
type EntryPage = { missions?: MissionEntry[]; jobs?: JobEntry[]; next: string | null };

type JobPlan = { revision: number; makespan_ms: number; found_after_ms: number; actions: Action[] };

type Situation = {
  robots: { name: string; type: string; place?: string | null; carrier?: string | null }[];
  types: { name: string; role: Role; capacity?: number }[];
  targets: { name: string; explorers: string[] }[];
  meetings: string[];
};

/** The cell of a place, for each type of robot. */
type PlaceCells = Record<string, Record<string, { cell: Cell }>>;

type Offer = {
  scenarios: { name: string; width_m: number; height_m: number; summary: string }[];
  strategies: { name: string; summary: string; with_rovers: boolean; asks_planner: boolean }[];
  planners: string[];
  defaults: {
    strategy: string;
    planner: string;
    carriers: number;
    rovers: number;
    seed: number;
    budget: { seconds?: number };
  };
  simulations: { limit: number; free: number };
};

/** A map as the service understands it; `errors` are of the request, of which it is a preview. */
type MapPreview = CellMap & FrameOfMap & { robots: { point_m: Point }[]; warnings: string[]; errors: FieldProblem[] };

/** What is wrong, and where: a JSON pointer into the request. */
type FieldProblem = { pointer?: string; detail: string };

type Problem = { title?: string; detail?: string; errors?: FieldProblem[] };

type NamedZone = { name: string; kind: ZoneKind; polygon_m: Point[] };

/** What a page shows below its head; `close` ends what it reads. */
type LivePage = { element: HTMLElement; begin?: () => Promise<void>; close: () => void };

type StreamEvent = { id: number; type: string; data: string };
