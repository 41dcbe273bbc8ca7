"""The page's model of a mission (`log/model.js`), run in a JavaScript engine if there is one."""

import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from typing import Any

import pytest
from support.missions.faulty_mission import explored, yard
from support.missions.growing_mission import growing_mission
from support.missions.synthetic_mission import synthetic_mission
from support.waiting import HANG_S

from marsupial.formats.loglines import log_lines
from marsupial.mission.playback import Playback
from marsupial.model.mission import FrameGrown, MissionEvent, Planned

EVENTS = synthetic_mission()
GROWN = growing_mission()
_, FAULTY = explored(yard())
TIMES = [*range(0, 26_006, 499), 26_005, 12_502, 5_001, 13_003, 0]
"""Times up to the end, and back in jumps."""

MODEL = f"""
import {{ readFileSync }} from "node:fs";
import {{ Mission, readMission }} from "{files("marsupial.replay").joinpath("log/model.js")}";
const lines = readFileSync(0, "utf8").trim().split("\\n").map((line) => JSON.parse(line));
const mission = new Mission(lines.shift());
const answer = (value) => console.log(JSON.stringify(value));
"""

ASK = """
const ask = (known, t, [width, height, dx, dy]) => {
  known.seek(t);
  const cells = [];
  for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) cells.push(known.at(x - dx, y - dy));
  return {
    robots: mission.views(t).map(({ x, y, carrier, action, lost }) => (
      [x + dx, y + dy, carrier && carrier.name, action && action.name, lost !== null])),
    cells, area: mission.openArea(t), plan: mission.planIndex(t),
  };
};
"""


def answer_of(question: str, events: Sequence[MissionEvent], **given: object) -> Any:
    """Return the result of a script that gets the log's parsed `lines`, an empty `mission` and further values."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no JavaScript engine (node) is installed here")
    told = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in given.items())
    script = MODEL + told + question
    log = "\n".join(log_lines(events))
    answer = subprocess.run(
        [node, "--input-type=module", "-e", script],
        input=log,
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)


def frame_of(events: Sequence[MissionEvent]) -> list[int]:
    """Return the size of the last frame, and where the first one lies in it."""
    mission, shifts = Playback(events).mission, [e.shift for e in events if isinstance(e, FrameGrown)]
    return [mission.width, mission.height, sum(s.x for s in shifts), sum(s.y for s in shifts)]


def check(events: Sequence[MissionEvent], times: Sequence[int], answers: Sequence[dict[str, list]]) -> None:
    """Compare the page's answers for each moment with those of Python."""
    playback = Playback(events)
    for t_ms, answer in zip(times, answers, strict=True):
        for robot, seen in zip(playback.robots_at(t_ms), answer["robots"], strict=True):
            assert seen[:2] == pytest.approx([robot.x, robot.y])
            assert seen[2:] == [robot.carrier, robot.action and robot.action.name, robot.lost]
        assert answer["cells"] == playback.cells_at(t_ms).ravel().tolist()
        assert answer["area"] == pytest.approx(playback.coverage_at(t_ms).open_m2)


AT_ONCE = "lines.forEach((line) => mission.append(line)); const known = mission.knownMap();"
LINE_BY_LINE = (
    "const known = mission.knownMap();"
    "for (const line of lines) {"
    "  mission.append(line); ask(known, mission.to, frame); ask(known, mission.to / 2, frame);"
    "}"
)
"""The mission grows line by line, with queries between lines."""


@pytest.mark.parametrize("events", [EVENTS, GROWN, FAULTY], ids=["as it was", "in a frame that grows", "with faults"])
@pytest.mark.parametrize("comes", [AT_ONCE, LINE_BY_LINE], ids=["at once", "line by line"])
def test_the_page_shows_what_the_playback_says(events: tuple[MissionEvent, ...], comes: str) -> None:
    question = f"{ASK}{comes}answer(times.map((t) => ask(known, t, frame)));"
    check(events, TIMES, answer_of(question, events, times=TIMES, frame=frame_of(events)))


def test_going_back_changes_only_the_tiles_that_differ() -> None:
    question = (
        "lines.forEach((line) => mission.append(line)); const known = mission.knownMap();"
        "const changed = (t) => { known.seek(t); return known.changed.size; };"
        "answer([mission.to, mission.to, mission.to - 1, 0].map(changed));"
    )
    first, again, before, start = answer_of(question, EVENTS)
    assert first > 0
    assert again == 0
    assert before <= first
    assert start > 0


def test_places_have_short_names() -> None:
    question = (
        "lines.forEach((line) => mission.append(line));"
        "answer([...mission.places.byName].map(([name, place]) => [name, place.label, place.since]));"
    )
    assert answer_of(question, EVENTS) == [["t1", "T1", 0], ["m1", "M1", 0], ["t2", "T2", 12_502]]


def test_reasons_of_the_end_call_places_by_their_short_names() -> None:
    name = next(target.name for event in FAULTY if isinstance(event, Planned) for target in event.targets)
    ended = replace(FAULTY[-1], reason=f"no rover can get to {name}, not even carried; none to t_999_9")
    question = "lines.forEach((line) => mission.append(line)); answer(mission.ended.reason);"
    told = answer_of(question, (*FAULTY[:-1], ended))
    assert re.fullmatch(r"no rover can get to T\d+, not even carried; none to t_999_9", told)


def test_a_robot_waits_from_its_last_work_until_it_meets_another() -> None:
    question = (
        f"const {{ waits }} = await import('{files('marsupial.replay').joinpath('log/waits.js')}');"
        "const told = () => mission.robots.flatMap((robot) => waits(mission, robot).map(Object.values));"
        "let before = null;"
        "for (const line of lines) {"
        "  if (line.t_ms >= 16005) before ??= told();"
        "  mission.append(line);"
        "}"
        "answer([before, told()]);"
    )
    before, after = answer_of(question, EVENTS)
    assert after == [[10_001, 16_005, "rover1_1"]]
    assert [wait[:1] for wait in before] == [[10_001]]  # it goes on
