"""The page of the service in a browser: start, follow, compare and control missions; jobs; keys."""

import base64
import io
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from support.missions.reference_missions import STEPS, reference_log
from support.pictures.browser import DESK, PHONE, Browser
from support.services.servers import Server
from support.waiting import wait_until

from marsupial_service.keys import KeyFile

LOBBY = {"scenario": "lobby", "planner": "greedy", "budget": {"steps": STEPS.steps}}
YAML = "image: room.png\nresolution: 0.25\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
MAPS = ".panes canvas.map, .panes canvas"


BAD = "#b3251f"  # the colour of no-go zones (page.css)

PRESS = """
const [selector, x, y] = arguments, canvas = document.querySelector(selector), box = canvas.getBoundingClientRect();
const at = { clientX: box.left + x * box.width, clientY: box.top + y * box.height, pointerId: 1 };
for (const kind of ["pointerdown", "pointerup"]) canvas.dispatchEvent(new PointerEvent(kind, { ...at, bubbles: true }));
"""
"""Click on a canvas, at shares of its width and height."""


DROP = """
const files = arguments[0].map(([name, text]) => new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
const dataTransfer = new DataTransfer();
for (const file of files) dataTransfer.items.add(file);
window.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
"""
"""Drop files, given as names and base64, on the page."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("page"), "--limit", "simulations=20") as server:
        server.wait_ready()
        yield server


STARTING = """
const real = window.fetch, told = { detail: "starting: compiling, 15 of 41 functions" };
window.starts = true;
window.fetch = (path, ...more) => path === "readyz" && window.starts
  ? Promise.resolve(new Response(JSON.stringify(told), { status: 503 })) : real(path, ...more);
"""
"""Have the page be answered as by a service that starts, as long as `starts` is true."""


HELD = """
const real = window.fetch;
window.fetch = async (path, ...more) => {
  if (String(path).includes("preview")) await new Promise((resolve) => { window.answer = resolve; });
  return real(path, ...more);
};
"""
"""Hold back requests for a preview until `answer` is called."""


def choose(browser: Browser, **values: Any) -> None:
    """Fill in fields of the form by name."""
    browser.find("form.start details.more")
    browser.run("document.querySelector('form.start details.more').open = true")
    for name, value in values.items():
        field = browser.find(f"#start-{name}")
        browser.run(
            "arguments[0].value = arguments[1]; for (const kind of ['input', 'change'])"
            " arguments[0].dispatchEvent(new Event(kind, { bubbles: true }))",
            field,
            str(value),
        )


def start(browser: Browser, server: Server, beside: Sequence[str] = (), **values: Any) -> list[str]:
    """Start one mission, or one for each strategy, from the form, and return their ids once shown."""
    browser.open(f"{server.url}/")
    choose(browser, **{"scenario": "lobby", "planner": "greedy", **values})
    for name in beside:
        browser.run("document.querySelector(arguments[0]).click()", f"#start-beside-{name}")
    browser.click("form.start button.first")
    browser.wait("location.hash.startsWith('#/missions/') && document.querySelector('.view .transport output')")
    return str(browser.value("location.hash")).rpartition("/")[2].split(",")


def upload(browser: Browser, server: Server, *files: Path) -> None:
    """Fill in yaml and image of a map, and request a mission."""
    browser.open(f"{server.url}/")
    choose(browser, scenario="")
    for name, file in zip(("yaml", "image"), files, strict=True):
        browser.find(f"#start-{name}").send_keys(str(file))
    browser.click("form.start button.first")


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


def open_missions(server: Server) -> list[Any]:
    missions = server.ask("GET", "/v1/missions").document["missions"]
    return [one["id"] for one in missions if one["state"] not in ("cancelling", "ended")]


def start_three(browser: Browser, server: Server, before: str = "") -> str:
    """Ask for three missions, of which one can't be created, and return what the form says."""
    browser.open(f"{server.url}/")
    choose(browser, scenario="lobby", planner="greedy")
    browser.run("document.querySelector('details.others').open = true;" + before)
    for name in ("heuristic", "assignment"):
        browser.run("document.querySelector(arguments[0]).click()", f"#start-beside-{name}")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('form.start > .problem').textContent")
    return str(browser.value("document.querySelector('form.start > .problem').textContent"))


def test_of_missions_side_by_side_all_start_or_none_and_their_limit_is_shown_before(
    browser: Browser, tmp_path: Path
) -> None:
    with Server(tmp_path, "--limit", "simulations=2") as server:
        problem = start_three(browser, server)
        room = "At most 2 simulated missions run here at a time; 2 more may start now."
        assert problem == f"3 missions can't start now. {room}"
        assert browser.value("document.querySelector('.others .note').textContent") == room
        assert server.ask("GET", "/v1/missions").document["missions"] == []


def test_missions_side_by_side_are_cancelled_if_one_of_them_is_refused(browser: Browser, pages: Server) -> None:
    before = set(open_missions(pages))
    lost = "let posts = 0; const real = window.fetch; window.fetch = (path, options) =>"
    lost += (
        " path === '/v1/simulations' && ++posts === 3 ? Promise.reject(new TypeError('lost')) : real(path, options);"
    )
    assert "can't be reached" in start_three(browser, pages, lost)
    assert set(open_missions(pages)) <= before


def test_rivals_are_those_that_suit_the_team(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/")
    choose(browser, scenario="lobby")
    offered = "document.querySelector('#start-beside-segmentation').parentElement.checkVisibility()"
    browser.run("document.querySelector('details.others').open = true")
    assert not browser.value(offered)
    choose(browser, rovers=0)
    assert browser.value(offered)
    browser.run("document.querySelector('#start-beside-segmentation').click()")
    choose(browser, rovers=1)
    assert browser.value("document.querySelector('form.start button.first').textContent") == "Start"


def test_errors_in_a_map_are_shown_beside_their_field(browser: Browser, pages: Server, tmp_path: Path) -> None:
    yaml, image = tmp_path / "room.yaml", tmp_path / "room.png"
    yaml.write_text(YAML.replace("resolution", "resolutoin"))
    image.write_bytes(b"no image")
    browser.open(f"{pages.url}/")
    choose(browser, scenario="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('#start-yaml-problem').textContent.includes('choose')")
    browser.find("#start-yaml").send_keys(str(yaml))
    browser.find("#start-image").send_keys(str(image))
    browser.click("form.start button.first")
    browser.wait("document.querySelector('#start-yaml-problem').textContent.includes('resolution')")
    assert "is not a PNG or PGM image" in browser.text("#start-image-problem")
    assert browser.value("document.querySelector('#start-yaml').hasAttribute('aria-invalid')")
    assert browser.value("document.querySelector('#start-seed-problem').textContent") == ""
    assert browser.errors(network=False) == []

    yaml.write_text(YAML)
    room = Image.new("L", (48, 36), 0)
    room.paste(254, (2, 2, 46, 34))
    room.save(image)
    browser.find("#start-yaml").send_keys(str(yaml))
    browser.find("#start-image").send_keys(str(image))
    choose(browser, planner="greedy", speed="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('.followed .badge')?.textContent === 'complete'")
    assert browser.text(".view > header h1") == "room"


def test_warnings_about_a_map_without_room_are_not_errors_of_the_yaml(
    browser: Browser, pages: Server, tmp_path: Path
) -> None:
    yaml, image = tmp_path / "room.yaml", tmp_path / "room.png"
    yaml.write_text(YAML)
    Image.new("L", (48, 36), 0).save(image)
    warned = "document.querySelector('form.start > [role=alert]').textContent.includes('warning: ')"
    upload(browser, pages, yaml, image)
    browser.wait(warned)
    assert browser.text("form.start > [role=alert]").startswith("no room")
    assert not browser.value("document.querySelector('#start-yaml').hasAttribute('aria-invalid')")

    browser.run(HELD)  # the preview's answer comes after that to the request for a mission, and does not replace it
    browser.run("document.querySelector('#start-image').dispatchEvent(new Event('change', { bubbles: true }))")
    browser.wait("Boolean(window.answer)")
    browser.click("form.start button.first")
    browser.wait(f"!document.querySelector('form.start button.first').disabled && {warned}")
    browser.run("window.answer()")
    browser.wait("!document.querySelector('.preview').innerText.includes('looking at the map')")
    assert browser.value(warned)


def test_a_dropped_map_is_shown_as_it_is_understood_before_it_is_explored(
    browser: Browser, pages: Server, tmp_path: Path
) -> None:
    room = Image.new("L", (48, 36), 0)
    room.paste(254, (2, 0, 46, 34))
    room.save(tmp_path / "room.png")
    (tmp_path / "room.yaml").write_text(YAML)
    browser.open(f"{pages.url}/")
    browser.wait("document.querySelectorAll('.classes li').length > 2")
    files = [[name, base64.b64encode((tmp_path / name).read_bytes()).decode()] for name in ("room.yaml", "room.png")]
    browser.run(DROP, [["notes.txt", ""]])
    assert "notes.txt is neither a yaml file nor" in browser.text("form.start > [role=alert]")
    browser.run(DROP, files[:1])
    browser.wait("document.querySelector('.hint').textContent === \"choose or drop the map's image\"")
    browser.run(DROP, files[1:])
    browser.wait("document.querySelector('.warnings').textContent.includes('leaks to the border')")
    assert "12.0 m × 9.0 m" in browser.text(".hint")
    assert browser.value("document.querySelector('#start-scenario').value") == ""
    assert len(browser.colours(".preview canvas")) > 4
    browser.run("document.querySelectorAll('.preview-tools > [aria-pressed]')[1].click()")
    for x, y in ((0.3, 0.2), (0.7, 0.2), (0.7, 0.8), (0.3, 0.8), (0.3, 0.2)):
        browser.run(PRESS, ".preview canvas", x, y)
    browser.wait("document.querySelector('.drawn').textContent === 'boundary1 ×'")
    choose(browser, planner="greedy", speed="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('.followed .badge')?.textContent === 'complete'")
    (zone,) = pages.ask("GET", f"/v1/missions/{browser.value('location.hash').rpartition('/')[2]}/zones").document[
        "zones"
    ]
    assert zone["kind"] == "explore"
    assert browser.errors() == []


def test_a_map_with_too_many_cells_is_made_coarser_by_one_click(browser: Browser, tmp_path: Path) -> None:
    room = Image.new("L", (48, 36), 0)
    room.paste(254, (2, 2, 46, 34))
    room.save(tmp_path / "room.png")
    (tmp_path / "room.yaml").write_text(YAML)
    with Server(tmp_path, "--limit", "cells=1000") as server:
        upload(browser, server, tmp_path / "room.yaml", tmp_path / "room.png")
        assert browser.text("#start-image-problem button") == "Use cells 2 times as large"
        browser.click("#start-image-problem button")
        browser.wait("document.querySelector('.hint').textContent.startsWith('12.0 m × 9.0 m')")
        assert browser.value("document.querySelector('#start-image-problem').textContent") == ""


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


def test_a_service_with_keys_requires_one_and_keeps_it_for_the_tab(browser: Browser, tmp_path: Path) -> None:
    key = KeyFile(tmp_path).add("fleet", ["plan", "mission"], 1, now_s=time.time())
    with Server(tmp_path, "--require-keys") as server:
        browser.open(f"{server.url}/", DESK)
        for text in ("guess", key):
            browser.find("#key-text").send_keys(text)
            browser.click("#key button")
            if text != key:
                browser.wait("document.querySelector('#key-notice').textContent.includes('unknown')")
        browser.wait("document.querySelector('#start-seed') && !document.querySelector('#key').open")
        assert browser.value("Object.keys(localStorage).length") == 0
        assert browser.value("Object.values(sessionStorage)") == [key]
        browser.click("#leave")
        browser.find("#key-text")
        assert browser.value("Object.keys(sessionStorage).length") == 0


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("view", [DESK, PHONE])
def test_every_word_of_the_start_page_can_be_read(browser: Browser, pages: Server, view: Any, dark: bool) -> None:
    browser.open(f"{pages.url}/", view, dark=dark)
    browser.find("#start-scenario")
    faint = browser.run(_FAINT)
    assert faint == []
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")


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

_FAINT = """
const parse = (css) => (css.match(/[\\d.]+/g) || []).map(Number);
const linear = (v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const light = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
const ground = (node) => {
  for (let one = node; one; one = one.parentElement) {
    const found = parse(getComputedStyle(one).backgroundColor);
    if (found.length && found[3] !== 0) return found;
  }
  return [255, 255, 255];
};
const faint = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const node = walker.currentNode.parentElement, text = walker.currentNode.textContent.trim();
  if (!text || !node.checkVisibility() || node.closest("option, dialog, script, noscript")) continue;
  const [a, b] = [light(parse(getComputedStyle(node).color)), light(ground(node))].sort((x, y) => y - x);
  const contrast = (a + 0.05) / (b + 0.05);
  if (contrast < 4.5 && !node.closest(":disabled")) faint.push(`${contrast.toFixed(2)} ${text}`);
}
return faint;
"""


def test_the_page_says_how_far_a_service_is_that_starts(browser: Browser, pages: Server) -> None:
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": STARTING})
    try:
        browser.open(f"{pages.url}/")
        browser.wait("document.querySelector('#connection').textContent.includes('compiling, 15 of 41 functions')")
        browser.run("window.starts = false")
        browser.wait("!document.querySelector('#connection').textContent")
        assert browser.errors() == []
    finally:
        browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)


def test_each_strategy_is_offered_with_its_idea(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/")
    browser.find("#start-strategy")
    chosen = browser.value("document.querySelector('#start-strategy').selectedOptions[0].text")
    assert chosen == "temporal (recommended)"
    assert "guessed targets" in browser.text("form.start")
    choose(browser, strategy="assignment")
    assert "Hungarian assignment" in browser.text("form.start")
