"""Missions and jobs on the page of the service, in a browser: started, followed, compared and controlled."""

import base64
import io
from collections.abc import Sequence
from typing import Any

import pytest
from live_pages import PRESS, choose
from PIL import Image
from support.missions.reference_missions import STEPS, reference_log
from support.pictures.browser import PHONE, Browser
from support.services.servers import Server
from support.waiting import wait_until
from uploaded_maps import YAML

LOBBY = {"scenario": "lobby", "planner": "greedy", "budget": {"steps": STEPS.steps}}
MAPS = ".panes canvas.map, .panes canvas"


BAD = "#b3251f"  # the colour of no-go zones (page.css)


def start(browser: Browser, server: Server, beside: Sequence[str] = (), **values: Any) -> list[str]:
    """Start one mission, or one for each strategy, from the form, and return their ids once shown."""
    browser.open(f"{server.url}/")
    choose(browser, **{"scenario": "lobby", "planner": "greedy", **values})
    for name in beside:
        browser.run("document.querySelector(arguments[0]).click()", f"#start-beside-{name}")
    browser.click("form.start button.first")
    browser.wait("location.hash.startsWith('#/missions/') && document.querySelector('.view .transport output')")
    return str(browser.value("location.hash")).rpartition("/")[2].split(",")


def start_simulation(server: Server, **more: Any) -> str:
    reply = server.ask("POST", "/v1/simulations", {**LOBBY, **more})
    assert reply.status == 201, reply.document
    return str(reply.document["id"])


def shown_ms(browser: Browser) -> int:
    return int(browser.value("Number(document.querySelector('.transport input[type=range]').value)"))


def drawn(browser: Browser) -> bool:
    """Return whether a canvas of the map has several colours."""
    counts = browser.value(f"[...document.querySelectorAll('{MAPS}')].map((one, i) => one.id = `canvas-${{i}}`)")
    return any(len(browser.colours(f"#{name}")) > 5 for name in counts)


def scrub(browser: Browser, t_ms: int) -> None:
    browser.run(
        "const bar = document.querySelector('.transport input[type=range]'); bar.value = arguments[0];"
        " bar.dispatchEvent(new Event('input'))",
        t_ms,
    )


def choose_speed(browser: Browser, speed: str) -> None:
    browser.run(
        "const list = document.querySelector('.speed select'); list.value = arguments[0];"
        " list.dispatchEvent(new Event('change'))",
        speed,
    )


def is_live(browser: Browser) -> bool:
    return browser.value("document.querySelector('.transport .live').getAttribute('aria-pressed')") == "true"


def test_a_mission_is_run_from_the_form_scrubbed_and_followed_live_to_its_end(browser: Browser, pages: Server) -> None:
    (mission,) = start(browser, pages, speed=5, budget=0.1)
    browser.wait("Number(document.querySelector('.transport input[type=range]').value) > 3000")
    assert is_live(browser)
    assert drawn(browser)
    assert browser.value("document.querySelector('.layers input').offsetHeight < 20"), "boxes are no text fields"
    browser.run(_WATCH_CLOCK)
    assert browser.value("document.querySelector('.speed select').value") == "5", "the speed that was asked for"
    scrub(browser, 1000)
    browser.wait("document.querySelector('.transport output').textContent.startsWith('0:01.0')")
    assert not is_live(browser)
    before = int(browser.value("Number(document.querySelector('.transport input[type=range]').max)"))
    browser.wait(f"Number(document.querySelector('.transport input[type=range]').max) > {before + 1000}")
    assert shown_ms(browser) == 1000, "the mission goes on, the moment that is looked at does not"
    browser.click(".transport .live")
    browser.wait(f"Number(document.querySelector('.transport input[type=range]').value) > {before}")
    assert is_live(browser)
    browser.wait("document.querySelector('.followed .badge').textContent === 'complete'")
    assert pages.ask("GET", f"/v1/missions/{mission}").document["status"] == "complete"
    browser.wait("document.querySelector('.view > header .badge').textContent === 'complete'")
    assert browser.value("document.querySelector('.speed select').value") == "1", "all of it in 45 s at most"
    assert browser.value("window.ahead") <= 0, "no moment is shown before it is known"
    browser.run("URL.createObjectURL = (blob) => { blob.text().then((text) => { window.saved = text; }); return '#'; }")
    browser.click(".view > header button[title^=Save]")
    assert browser.wait("window.saved") == pages.ask("GET", f"/v1/missions/{mission}/log").document
    assert browser.errors() == []


def test_strategies_are_shown_side_by_side_at_the_same_moment(browser: Browser, pages: Server) -> None:
    missions = start(browser, pages, beside=["heuristic", "assignment"], speed=100, budget=0.1)
    assert len(missions) == 3
    choose_speed(browser, "20")
    told = [pages.ask("GET", f"/v1/missions/{mission}").document for mission in missions]
    assert [one["strategy"] for one in told] == ["temporal", "heuristic", "assignment"]
    assert told[0]["simulation"]["seed"] == told[1]["simulation"]["seed"]
    browser.wait("[...document.querySelectorAll('.followed .badge')].every((one) => one.textContent === 'complete')")
    assert browser.value("document.querySelectorAll('.pane').length") == 3
    assert browser.value("document.querySelectorAll('.transport').length") == 1
    browser.wait("document.querySelector('.transport .live').hidden")
    assert browser.value("document.querySelector('.speed select').value") == "20", "what was chosen stays"
    assert drawn(browser)
    scrub(browser, int(browser.value("document.querySelector('.transport input[type=range]').max")))
    browser.wait("document.querySelector('.difference').textContent.includes('all know as much')")
    browser.look(PHONE)
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    browser.click(".legend summary")
    assert browser.value("document.querySelector('.legend > .card').getBoundingClientRect().left >= 0")
    assert browser.errors() == []


def test_missions_side_by_side_have_one_bar_of_controls(browser: Browser, pages: Server) -> None:
    start(browser, pages, beside=["heuristic"], speed="1", scenario="office")
    browser.wait("document.querySelectorAll('.pane').length === 2")
    buttons = "[...document.querySelectorAll('.view > header button')]"
    press = f"{buttons}.find((one) => one.textContent === arguments[0]).click()"
    assert browser.value("[...document.querySelectorAll('.pane .followed button')].map((one) => one.textContent)") == [
        "Zones",
        "Zones",
    ]
    for control, state in (("Pause all", "paused"), ("Resume all", "running"), ("Cancel all", "cancelled")):
        browser.run(press, control)
        browser.wait(
            f"[...document.querySelectorAll('.followed .badge')].every((one) => one.textContent === '{state}')"
        )
    left = "[...document.querySelectorAll('.view > header > button:not([hidden])')].map((one) => one.textContent)"
    assert "Cancel all" not in browser.value(left)
    assert browser.errors() == []


def test_missions_of_the_list_have_pictures_and_are_paused_there(browser: Browser, pages: Server) -> None:
    mission = start_simulation(pages, speed=1)
    browser.open(f"{pages.url}/")
    row = f"[...document.querySelectorAll('.list tr')].find((one) => one.querySelector('input')?.value === '{mission}')"
    browser.wait(f"{row}?.querySelector('.thumbnail canvas')")
    for state in ("paused", "running"):
        browser.run(f"{row}.querySelector('button').click()")
        browser.wait(f"{row}.querySelector('.badge').textContent === '{state}'")
    pages.ask("POST", f"/v1/missions/{mission}/cancel")
    assert browser.errors() == []


def test_all_warnings_about_a_map_are_shown_above_its_mission(browser: Browser, pages: Server) -> None:
    picture = io.BytesIO()
    Image.new("L", (48, 36), 254).save(picture, "PNG")
    image = base64.b64encode(picture.getvalue()).decode()
    body = {"map": {"name": "hall", "yaml": YAML, "image_base64": image}, "planner": "greedy", "speed": 10}
    mission = pages.ask("POST", "/v1/simulations", body).document
    browser.open(f"{pages.url}/#/missions/{mission['id']}")
    browser.find(".view")
    said = browser.text(".missions-page > .notice")
    assert len(mission["simulation"]["warnings"]) > 1
    for warning in mission["simulation"]["warnings"]:
        assert warning in said
    pages.ask("POST", mission["links"]["cancel"])


def test_two_missions_of_the_list_are_shown_side_by_side(browser: Browser, pages: Server) -> None:
    missions = [start_simulation(pages, speed=100, seed=seed) for seed in (1, 2)]
    browser.open(f"{pages.url}/")
    browser.find(".preview .classes li")  # its coming moves the list below it
    for mission in missions:
        browser.click(f".list input[value='{mission}']")
    browser.click(".list .beside")
    browser.wait("document.querySelectorAll('.pane').length === 2")
    assert browser.value("location.hash") == f"#/missions/{','.join(missions)}"


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("missions/nothing", "There is no mission nothing; it may have been removed."),
        ("missions/no-such,a%20b", "There is no mission no-such; it may have been removed.\nThere is no mission a b;"),
        ("jobs/100%25", "There is no job 100%; it may have been removed."),
        ("jobs/%", "There is no job %; it may have been removed."),
        ("simulations/3", "There is no page at this address."),
    ],
)
def test_an_address_of_nothing_says_so_with_a_way_home(
    browser: Browser, pages: Server, address: str, said: str
) -> None:
    browser.open(f"{pages.url}/#/{address}")
    browser.wait("document.querySelector('main.notice a')")
    assert browser.text("main h1").startswith(said)
    assert browser.value("document.querySelectorAll('main h1').length") == 1
    browser.click("main a")
    browser.find("#start-scenario")


def test_an_unknown_mission_beside_another_is_left_out(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/#/missions/nothing,{start_simulation(pages, speed=100)}")
    browser.find(".view.one")
    assert browser.text(".notice").startswith("There is no mission nothing")


def test_small_pictures_of_a_map_show_its_thin_walls(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/")
    browser.run(_SMALL)
    wall, floor = browser.wait("window.small")
    assert (wall, floor) == (2, 2), "points of a map of 8 x 8 cells with a wall of one cell, four cells a side"


def test_a_page_reports_a_killed_server_and_continues_after_its_restart(browser: Browser, pages: Server) -> None:
    mission = start_simulation(pages, speed=10)
    browser.open(f"{pages.url}/#/missions/{mission}")
    browser.wait("Number(document.querySelector('.transport input[type=range]')?.value) > 2000")
    pages.kill()
    browser.wait("document.querySelector('#connection').textContent === 'connection lost, trying again'")
    pages.start()
    browser.wait("document.querySelector('#connection').textContent === 'back'")
    at = shown_ms(browser)
    browser.wait(f"Number(document.querySelector('.transport input[type=range]').value) > {at + 1000}")
    browser.wait("document.querySelector('.followed .badge').textContent === 'complete'")
    assert pages.ask("GET", f"/v1/missions/{mission}/log").document == reference_log("lobby")
    assert browser.errors(network=False) == []
    pages.wait_ready()


def test_a_mission_is_paused_resumed_and_cancelled_from_the_page(browser: Browser, pages: Server) -> None:
    mission = start_simulation(pages, speed=1)
    browser.open(f"{pages.url}/#/missions/{mission}")
    browser.wait("document.querySelector('.view')")
    for number, state in ((1, "paused"), (1, "running"), (2, "called back")):
        browser.click(f".followed button:nth-of-type({number})")
        browser.wait(f"document.querySelector('.followed .badge').textContent === '{state}'")
    assert pages.ask("GET", f"/v1/missions/{mission}").document["state"] == "ended"
    browser.open(f"{pages.url}/#/missions/{mission}")
    assert browser.text(".now").startswith("called back by the operator"), "it opens with its result"
    assert browser.value("[...document.querySelectorAll('.followed > button')].every((one) => one.hidden)")
    assert browser.errors() == []


def test_a_zone_is_drawn_on_the_page_and_removed(browser: Browser, pages: Server) -> None:
    (mission,) = start(browser, pages, speed="1", scenario="office")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    pages.ask("POST", f"/v1/missions/{mission}/pause")
    browser.run("[...document.querySelectorAll('.followed > button')].find((one) => one.innerText === 'Zones').click()")
    assert browser.value("document.querySelector('.zone-form [type=submit]').disabled")
    for share in ((0.1, 0.1), (0.3, 0.1), (0.3, 0.3)):
        browser.run(PRESS, "canvas.map", *share)
    browser.wait("!document.querySelector('.zone-form [type=submit]').disabled")
    browser.click(".zone-form [type=submit]")
    browser.wait("document.querySelector('.zone-form .zones').innerText.includes('zone1')")
    (zone,) = pages.ask("GET", f"/v1/missions/{mission}/zones").document["zones"]
    assert (zone["name"], zone["kind"], len(zone["polygon_m"])) == ("zone1", "no_go", 3)
    assert f"{BAD}ff" in browser.colours("canvas.map"), "it is drawn although the mission is paused"
    assert browser.value("document.querySelector('.zone-form').getBoundingClientRect().bottom") <= browser.value(
        "document.querySelector('.stage').getBoundingClientRect().top"
    )
    pages.ask("POST", f"/v1/missions/{mission}/resume")
    wait_until(lambda: '"event":"zone"' in pages.ask("GET", f"/v1/missions/{mission}/log").document)
    browser.wait("[...document.querySelectorAll('.legend li')].some((one) => one.textContent === 'no-go zone')")
    browser.click(".zone-form .zones button")
    browser.wait("!document.querySelector('.zone-form .zones').innerText")
    assert pages.ask("GET", f"/v1/missions/{mission}/zones").document["zones"] == []
    assert browser.errors() == []
    pages.ask("POST", f"/v1/missions/{mission}/cancel")


def test_a_job_is_shown_with_its_map_its_best_plan_and_its_falling_makespan(browser: Browser, pages: Server) -> None:
    demo = pages.ask("GET", "/v1/demo-data/yard").document
    job = pages.ask("POST", "/v1/jobs", {**demo, "planner": "anytime", "budget": {"seconds": 1}}).document
    browser.open(f"{pages.url}/")
    browser.find(f".list a[href$='{job['id']}']")
    sizes = "[...document.querySelectorAll('.list td')].map((one) => getComputedStyle(one).fontSize)"
    assert len(set(browser.value(sizes))) == 1
    browser.open(f"{pages.url}/#/jobs/{job['id']}")
    browser.wait("document.querySelector('.job-page .badge')?.textContent === 'satisficing'")
    best = pages.ask("GET", job["links"]["self"]).document["best"]
    browser.wait(f"document.querySelector('.makespan').dataset.revision === '{best['revision']}'")
    pictures = [".job-map canvas", ".plot canvas", ".job-lanes canvas"]
    for picture in pictures:
        browser.wait(f"document.querySelector('{picture}').width > 100")
        wait_until(lambda name=picture: len(browser.colours(name)) > 4, f"{picture} drawn")
    assert browser.errors() == []


def test_missions_and_jobs_are_listed_whoever_has_begun_them(browser: Browser, pages: Server) -> None:
    frame = {"width": 8, "height": 6, "resolution_m": 0.5}
    kind = {"name": "carrier", "role": "carrier", "speed_mps": 1.0, "sensor_range_m": 3.0, "radius_m": 0.2}
    body = {
        "name": "elsewhere",
        "frame": frame,
        "robot_types": [{**kind, "terrains": ["floor"], "capacity": 1}],
        "team": [{"name": "mother", "type": "carrier", "cell": [2, 2]}],
        "planner": "greedy",
        "budget": {"steps": 1},
    }
    mission = pages.ask("POST", "/v1/missions", body).document
    browser.open(f"{pages.url}/")
    browser.wait("[...document.querySelectorAll('.list a')].some((one) => one.textContent === 'elsewhere')")
    assert "robots elsewhere" in browser.text(".lists")
    report = {"n": 1, "t_ms": 0, "revealed": [{"robot": "mother", "runs": [9, 4, 1, 17, 4, 1]}]}
    assert pages.ask("POST", mission["links"]["reports"], report).status == 200
    browser.run("location.hash = `/missions/${arguments[0]}`", mission["id"])
    browser.wait("document.querySelector('.view > header h1')?.textContent === 'elsewhere'")
    assert pages.ask("POST", mission["links"]["cancel"]).status == 200
    browser.wait("document.querySelector('.followed .badge').textContent === 'cancelled'")
    assert browser.errors() == []


_SMALL = """
import("#live/picture.js").then(({ painted }) => {
  const map = { width: 8, height: 8, runs: [0, 8, 1, 8, 8, 0, 16, 48, 1] };
  const small = painted(map, (code) => (code ? "#fff" : "#000"), 4);
  const { data } = small.getContext("2d").getImageData(0, 0, 2, 2), reds = [0, 4, 8, 12].map((at) => data[at]);
  window.small = [0, 255].map((red) => reds.filter((one) => one === red).length);
});
"""

_WATCH_CLOCK = """
const seconds = (text) => text.split(":").reduce((sum, part) => 60 * sum + Number(part), 0);
window.ahead = -Infinity;
const watch = () => {
  const [now, known] = document.querySelector(".clock").textContent.split(" / ").map(seconds);
  window.ahead = Math.max(window.ahead, now - known);
  requestAnimationFrame(watch);
};
watch();
"""
