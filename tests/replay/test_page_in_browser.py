from __future__ import annotations

from pathlib import Path

from browser import DESK, PHONE, Browser
from synthetic_mission import synthetic_mission

from marsupial.replay.page import replay_page


def test_a_replay_page_draws_its_map_in_a_browser_without_a_word_on_the_console(
    browser: Browser, tmp_path: Path
) -> None:
    file = tmp_path / "replay.html"
    file.write_text(replay_page(synthetic_mission()))
    for view in (DESK, PHONE):
        browser.open(file.as_uri(), view)
        browser.wait("document.querySelector('canvas')?.width > 100")
        assert len(browser.colours("canvas")) > 3
        assert browser.errors() == []
