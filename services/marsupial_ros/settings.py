"""The settings of `marsupial ros`: a YAML file; docs/ros.md describes it field by field."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

from marsupial.errors import Problem, ScenarioError
from marsupial.formats.fields import Fields, shown
from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.formats.mapfiles.occupancy import FREE_THRESH, OCCUPIED_THRESH
from marsupial.formats.scenario.map import read_filters, read_terrains
from marsupial.formats.scenario.read import parse, read_goal, read_limits, read_types, read_version
from marsupial.formats.scenario.team import MemberEntry, check_carriers, check_names
from marsupial.formats.scenario.zones import read_zones
from marsupial.formats.yamlvalues import with_lines
from marsupial.model.bounds import BOUNDS, Bound
from marsupial.model.grid import Terrain
from marsupial.model.robots import RobotType, TeamMember
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.zones import DatedZone
from marsupial_ros.transforms import Point

Word = TypeVar("Word", bound=StrEnum)

FORMAT, VERSION = "marsupial-ros", 1

ROSBRIDGE = "ws://127.0.0.1:9090"

SECONDS = Bound(0, 10**6, "s", above=True)

METRES = Bound(0, 100, "m")


class DriveAction(StrEnum):
    """Which action of nav2 carries a drive out."""

    FOLLOW_PATH = "follow_path"
    """Run the controller alone, along the planned route."""

    NAVIGATE_TO_POSE = "navigate_to_pose"
    """Drive to the end of the route, on a path planned by nav2."""


class Compression(StrEnum):
    """How maps are encoded on the websocket."""

    CBOR = "cbor"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSettings:
    """One robot: the namespace of its actions (``/carrier1``, or empty), and the carrier it is aboard at first.

    `base_frame` is its frame on the topic `tf`; static transforms are on ``<tf>_static``. `speed_limit` is the topic of
    its speed limits, if it has one; `battery` that of its state of charge.
    """

    name: str
    kind: RobotType
    namespace: str
    carrier: str | None
    tf: str
    base_frame: str
    drive: DriveAction
    speed_limit: str | None = None
    battery: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapSettings:
    """The source of the map, and the masks applied to it; `topics` have the topic of the updates of each."""

    topics: Mapping[str, str]
    frame: str
    free_thresh: float
    occupied_thresh: float
    compression: Compression
    masks: FilterMasks

    @property
    def topic(self) -> str:
        """The topics, for messages to the user."""
        return " + ".join(self.topics)


@dataclass(frozen=True, slots=True, kw_only=True)
class Waits:
    """How long to wait, in seconds, and how far a robot may be from where it should be.

    `report_s` passes between reports while robots drive or the map changes. A robot without transforms is silent after
    `silent_s`, which ends its drive, and lost for good after `lost_s`. A drive without progress is given up after
    `stuck_s`, a docking or undocking after `handover_s`. A robot within `tolerance_m` of its route is on it; within
    that of where it can stand, it stands there.
    """

    report_s: float = 1.0
    silent_s: float = 5.0
    lost_s: float = 120.0
    stuck_s: float = 30.0
    handover_s: float = 180.0
    tolerance_m: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """The plugins of nav2's controller server that follow paths; empty if it has only one of each."""

    controller_id: str = ""
    goal_checker_id: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Planning:
    """The strategy, planner and budget; None: the service's default."""

    strategy: str | None = None
    planner: str | None = None
    budget_s: float = 1.0
    planning_time: PlanningTime = PlanningTime.CHARGED


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Settings:
    """The whole file; `clock` is the topic of simulated time, None for this machine's clock."""

    name: str
    rosbridge: str
    clock: str | None
    map: MapSettings
    waits: Waits
    terrains: tuple[Terrain, ...]
    kinds: tuple[RobotType, ...]
    robots: tuple[RobotSettings, ...]
    goal: Goal
    limits: MissionLimits
    planning: Planning
    controller: Controller
    zones: tuple[DatedZone, ...] = ()
    chargers: tuple[Point, ...] = ()  # charging places, in metres of the map frame


def read_settings(path: Path) -> Settings:
    """Read the file. Raises ScenarioError with every wrong field by its path and line."""
    data, text = parse(path)
    if not isinstance(data, Mapping):
        raise ScenarioError(f"must be a mapping of fields, got {shown(data)}", source=str(path))
    problems: list[Problem] = []
    settings = _read(Fields(data, "", problems), path)
    if problems or settings is None:
        raise ScenarioError(with_lines(problems, text), source=str(path))
    return settings


def _read(top: Fields, path: Path) -> Settings | None:
    if not read_version(top, FORMAT, VERSION):
        return None
    name = top.text("name", path.stem)
    rosbridge = top.text("rosbridge", ROSBRIDGE)
    if rosbridge and not rosbridge.startswith(("ws://", "wss://")):
        top.wrong("rosbridge", f"must be like {ROSBRIDGE}, got {shown(rosbridge)}")
    clock = top.text("clock") if top.has("clock") else None
    terrains = read_terrains(top)
    kinds = read_types(top, terrains, None)
    fields = top.part("controller", required=False)
    controller = Controller(**{name: fields.text(name) for name in asdict(Controller()) if fields.has(name)})
    fields.finish()
    settings = Settings(
        name=name,
        rosbridge=rosbridge,
        clock=clock,
        map=_read_map(top.part("map", required=False), terrains, path.parent),
        waits=_read_waits(top.part("waits", required=False)),
        terrains=terrains,
        kinds=tuple(kind for kind in kinds.values() if kind is not None),
        robots=_read_robots(top, kinds),
        goal=read_goal(top),
        limits=read_limits(top),
        planning=_read_planning(top.part("planning", required=False)),
        controller=controller,
        zones=read_zones(top),
        chargers=tuple(map(_read_charger, top.parts("chargers", required=False))),
    )
    if settings.limits.coverage < 1:
        top.wrong("limits.coverage", "must be 1: the area to explore is not known")
    top.finish()
    return None if top.problems else settings


def _read_charger(fields: Fields) -> Point:
    x, y = fields.numbers("at_m", 2) or (0.0, 0.0)
    fields.finish()
    return x, y


def _read_map(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> MapSettings:
    share = BOUNDS["share"]
    settings = MapSettings(
        topics=_read_topics(fields),
        frame=fields.text("frame", "map").lstrip("/"),
        free_thresh=fields.number("free_thresh", FREE_THRESH, share),
        occupied_thresh=fields.number("occupied_thresh", OCCUPIED_THRESH, share),
        compression=_choice(fields, "compression", Compression.CBOR),
        masks=read_filters(fields, terrains, folder),
    )
    if settings.free_thresh >= settings.occupied_thresh:
        fields.wrong("free_thresh", f"must be below occupied_thresh ({settings.occupied_thresh:g})")
    fields.finish()
    return settings


def _read_topics(fields: Fields) -> dict[str, str]:
    """Read the topics of the map, or of one map for each robot, each with that of its updates."""
    topic = fields.text("topic", "/map")
    updates = fields.text("updates", f"{topic}_updates")
    if not fields.has("topics"):
        return {topic: updates}
    for key in ("topic", "updates"):
        if fields.has(key):
            fields.wrong(key, "can't be given beside topics")
    topics = fields.texts("topics")
    if len(set(topics)) < len(topics):
        fields.wrong("topics", "must not name a topic twice")
    return {topic: f"{topic}_updates" for topic in topics}


def _choice(fields: Fields, key: str, usual: Word) -> Word:
    words = type(usual)
    return words(fields.choice(key, list(words), usual) or usual)


def _read_waits(fields: Fields) -> Waits:
    bounds = dict.fromkeys(asdict(Waits()), SECONDS) | {"tolerance_m": METRES}
    waits = Waits(**{name: fields.number(name, usual, bounds[name]) for name, usual in asdict(Waits()).items()})
    if waits.lost_s < waits.silent_s:
        fields.wrong("lost_s", f"must not be below silent_s ({waits.silent_s:g})")
    fields.finish()
    return waits


def _read_planning(fields: Fields) -> Planning:
    usual = Planning()
    planning = Planning(
        strategy=fields.text("strategy") if fields.has("strategy") else None,
        planner=fields.text("planner") if fields.has("planner") else None,
        budget_s=fields.number("budget_s", usual.budget_s, BOUNDS["budget_s"]),
        planning_time=_choice(fields, "planning_time", usual.planning_time),
    )
    fields.finish()
    return planning


def _read_robots(top: Fields, kinds: Mapping[str, RobotType | None]) -> tuple[RobotSettings, ...]:
    """Read the robots; the result is valid only if no problem was noted."""
    read = [(fields, _read_robot(fields, kinds)) for fields in top.parts("robots")]
    robots = [(fields, robot) for fields, robot in read if robot is not None]
    entries = [
        MemberEntry(fields, TeamMember(name=robot.name, type=robot.kind.name, carrier=robot.carrier))
        for fields, robot in robots
    ]
    check_names(entries)
    check_carriers(entries, kinds)
    if not top.problems and not any(robot.kind.capacity or robot.carrier is None for _, robot in robots):
        top.wrong("robots", "must not be empty")
    for key in ("namespace", "base_frame"):
        _check_apart(robots, key)
    return tuple(robot for _, robot in robots)


def _read_robot(fields: Fields, kinds: Mapping[str, RobotType | None]) -> RobotSettings | None:
    name = fields.name("name")
    kind = kinds.get(fields.choice("type", kinds, what="robot type") if kinds else fields.text("type"))
    carrier = fields.name("carrier") if fields.has("carrier") else None
    settings = {
        "namespace": _namespace(fields, f"/{name}"),
        "tf": fields.text("tf", "/tf"),
        "base_frame": fields.text("base_frame", f"{name or 'robot'}/base_link").lstrip("/"),
        "drive": _choice(fields, "drive", DriveAction.FOLLOW_PATH),
        "speed_limit": fields.text("speed_limit") if fields.has("speed_limit") else None,
        "battery": fields.text("battery") if fields.has("battery") else None,
    }
    if settings["battery"] is not None and kind is not None and kind.battery is None:
        fields.wrong("battery", f"a {kind.name} has no battery")
    fields.finish()
    return None if kind is None else RobotSettings(name=name, kind=kind, carrier=carrier, **settings)  # type: ignore[arg-type]


def _namespace(fields: Fields, usual: str) -> str:
    """Read a namespace, which begins with a slash; ``/`` is none at all."""
    found = fields.text("namespace", usual).rstrip("/")
    if found and not found.startswith("/"):
        fields.wrong("namespace", f"must begin with '/', got {shown(found)}")
    return found


def _check_apart(robots: list[tuple[Fields, RobotSettings]], key: str) -> None:
    """Check that no two robots can be mistaken for each other."""
    seen: dict[tuple[str, str], str] = {}
    for notes, robot in robots:
        place = ("", robot.namespace) if key == "namespace" else (robot.tf, robot.base_frame)
        other = seen.setdefault(place, robot.name)
        if other != robot.name:
            where = f" of {place[0]}" if place[0] else ""
            notes.wrong(key, f"{place[1] or '/'!r}{where} is also that of {other}")
