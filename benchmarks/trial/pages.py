"""Pages in a real browser: their size, their frame rate, the delay until they show a plan."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from support.pictures.browser import Browser, chromium, missing, tab
from support.services.plain_client import ask, frames

from benchmarks.speed.drawn import generated
from benchmarks.trial.rows import Judgement, TrialRow, judged, times
from benchmarks.trial.tasks import LARGEST, suite_body
from benchmarks.trial.trial_server import TrialServer, running_server
from marsupial.generators.builtin import bare_map_scenario
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.model.mission import Status
from marsupial.model.planning import Budget
from marsupial.model.scenario import MissionLimits, Scenario
from marsupial.replay.page import replay_page
from marsupial_service.store.opening import open_for_maintenance

PAGE = "pages"
SHOWN_GOAL_S, FRAMES_GOAL_HZ, SIZE_GOAL_KB = 0.1, 30.0, 500.0

_CELLS, _CELL_M, _CARRIERS, _ROVERS = 2048, 0.1, 6, 3
_PLAYED_S, _SPEEDS = 5.0, (10, 20)
_FREE = ("--disable-frame-rate-limit", "--disable-gpu-vsync")
_SEARCH_S = 4.0
_MOST_S = 120.0
_SEEN = """
let last = 0;
window.seen = [];
const look = () => {
  const count = arguments[0] === "ol.plans" ? document.querySelectorAll("ol.plans li").length
    : Number(/(\\d+) plans?/.exec(document.querySelector(arguments[0])?.textContent ?? "")?.[1] ?? 0);
  for (; last < count; last++) {
    const n = last + 1;
    requestAnimationFrame(() => setTimeout(() => window.seen.push([n, Date.now()])));
  }
};
new MutationObserver(look).observe(document.body, { subtree: true, childList: true, characterData: true });
look();
"""
"""Records when the page has drawn each number of plans; its argument is the element that shows the number."""

_FRAMES = """
const [seconds, speed, done] = arguments, select = document.querySelector(".transport select");
if (![...select.options].some((one) => Number(one.value) === speed)) throw new Error(`no speed of ${speed}`);
select.value = speed;
select.dispatchEvent(new Event("change"));
const play = document.querySelector(".transport .play"), bar = document.querySelector(".transport input[type=range]");
bar.value = bar.max / 2;
bar.dispatchEvent(new Event("input"));
play.click();
let count = -1, begun = 0;
const next = (now) => {
  if (count++ < 0) begun = now;
  if (now - begun < 1000 * seconds) { requestAnimationFrame(next); return; }
  play.click();
  done(1000 * count / (now - begun));
};
requestAnimationFrame(next);
"""


def rows(plans: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Play a large mission, measure a usual one's size, and time `plans` plans of jobs and as many of missions."""
    lacking = missing()
    if lacking is not None:
        yield TrialRow(part=PAGE, requirement="in a browser", figure=lacking, judgement=Judgement.NOT_RUN)
        return
    say("pages: a mission of 8 robots")
    yield _size_row(_page(bare_map_scenario("office", generated("office", 512, 0.25, 1), 2, 3), 600))
    say(f"pages: {_CARRIERS * (1 + _ROVERS)} robots on {_CELLS} x {_CELLS} cells")
    grid = generated("rooms", _CELLS, _CELL_M, 1)
    yield from _frame_rows(_page(bare_map_scenario("rooms", grid, _CARRIERS, _ROVERS), 300))
    say(f"pages: {plans} plans of jobs, {plans} of missions")
    with running_server(("--limit=slots=1",)) as server, chromium() as driver:
        for what, timed in (("a job", _of_job), ("a mission", _of_mission)):
            seconds: list[float] = []
            while len(seconds) < plans:
                with tab(driver) as browser:
                    seconds += timed(server, browser)
            yield times(PAGE, f"a plan of {what}, from its storing to the page", seconds[:plans], SHOWN_GOAL_S)


def _page(scenario: Scenario, most_s: int) -> str:
    recorder = Recorder()
    limited = replace(scenario, limits=MissionLimits(time_ms=1000 * most_s))
    found = simulate(limited, strategy="temporal", planner="greedy", budget=Budget(steps=20), seed=1, observer=recorder)
    assert found.status is Status.TIME_LIMIT, found.reason
    return replay_page(recorder.events)


def _size_row(page: str) -> TrialRow:
    found = len(page.encode()) / 1000
    return TrialRow(
        part=PAGE,
        requirement="size, of 8 robots and 10 minutes",
        figure=f"{found:.0f} kB",
        goal=f"{SIZE_GOAL_KB:.0f} kB",
        judgement=judged(found <= SIZE_GOAL_KB),
        values={"kB": found},
    )


def _frame_rows(page: str) -> Iterator[TrialRow]:
    with TemporaryDirectory() as folder, chromium(*_FREE) as driver, tab(driver) as browser:
        file = Path(folder) / "page.html"
        file.write_text(page, encoding="utf-8")
        browser.open(file.as_uri() + "#play=0")
        browser.find(".transport .play")
        for speed in _SPEEDS:
            found = float(driver.execute_async_script(_FRAMES, _PLAYED_S, speed))
            yield TrialRow(
                part=PAGE,
                requirement=f"pictures a second of {_CARRIERS * (1 + _ROVERS)} robots at {speed} times their speed",
                figure=f"{found:.0f}",
                goal=f"{FRAMES_GOAL_HZ:.0f}",
                judgement=judged(found >= FRAMES_GOAL_HZ),
                values={"hz": found},
            )


def _of_job(server: TrialServer, browser: Browser) -> list[float]:
    """Follow a job from before its start, while another one has the slot; return each plan's delay to the page."""
    first = _asked(server, "/v1/jobs", json.loads(suite_body(LARGEST[1], "anytime", 2.0)))
    job = _asked(server, "/v1/jobs", json.loads(suite_body(LARGEST[0], "anytime", _SEARCH_S)))
    browser.open(f"{server.url}/#/jobs/{job}")
    browser.find(".figure-line")
    browser.run(_SEEN, ".figure-line")
    _ended(server, f"/v1/jobs/{first}", "state", ("queued", "running"))
    _ended(server, f"/v1/jobs/{job}", "state", ("queued", "running"))
    with open_for_maintenance(server.data) as store:
        sql = "SELECT revision, at_ms FROM plans JOIN jobs ON job = number WHERE id = ?"
        stored = store.read(lambda c: {row["revision"]: row["at_ms"] for row in c.execute(sql, (job,)).fetchall()})
    return _between(browser, stored)


def _of_mission(server: TrialServer, browser: Browser) -> list[float]:
    """Follow a simulated mission; return each plan's delay to the page, for plans after it was open."""
    asked = {"scenario": "office", "planner": "greedy", "budget": {"steps": 20}, "speed": 20}
    mission = _asked(server, "/v1/simulations", asked)
    browser.open(f"{server.url}/#/missions/{mission}")
    browser.find("ol.plans")
    browser.run(_SEEN, "ol.plans")
    opened_ms = 1000 * time.time()
    _ended(server, f"/v1/missions/{mission}", "state", ("running", "paused"))
    sent = list(frames(server.port, f"/v1/missions/{mission}/events"))
    plans = [one.id for one in sent if one.type == "log" and json.loads(one.data)["event"] == "plan"]
    with open_for_maintenance(server.data) as store:
        sql = "SELECT seq, at_ms FROM mission_events JOIN missions ON mission = number WHERE id = ? ORDER BY seq"
        turns = store.read(lambda c: [(row["seq"], row["at_ms"]) for row in c.execute(sql, (mission,)).fetchall()])
    stored = {i: next(at_ms for last, at_ms in turns if last >= seq) for i, seq in enumerate(plans, 1)}
    return _between(browser, {i: at_ms for i, at_ms in stored.items() if at_ms > opened_ms})


def _asked(server: TrialServer, path: str, body: Mapping[str, Any]) -> str:
    reply = ask(server.port, "POST", path, body)
    assert reply.status in (201, 202), reply
    return str(reply.document["id"])


def _ended(server: TrialServer, path: str, field: str, going_on: tuple[str, ...]) -> None:
    until = time.monotonic() + _MOST_S
    while ask(server.port, "GET", path).document[field] in going_on and time.monotonic() < until:
        time.sleep(0.1)


def _between(browser: Browser, stored_ms: Mapping[int, int]) -> list[float]:
    """Return the seconds from when plans were stored to when the page had drawn them, by their numbers."""
    browser.wait(f"window.seen.length >= {max(stored_ms, default=0)}")
    seen: dict[int, int] = dict(browser.value("window.seen"))
    return [(seen[number] - at_ms) / 1000 for number, at_ms in stored_ms.items()]
