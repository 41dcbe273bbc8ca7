"""`marsupial replay`: a mission log, played in the terminal or as a page."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer


def replay(
    log: Annotated[Path, typer.Argument(help="A mission log.")],
    html: Annotated[Path | None, typer.Option(help="Write one self-contained HTML page there instead.")] = None,
    speed: Annotated[float, typer.Option(min=0.1, help="Simulated seconds in a second.")] = 20.0,
) -> None:
    """Play a mission log in the terminal, or write it as a page.

    Example: marsupial run lobby --log lobby.jsonl

    marsupial replay lobby.jsonl --html lobby.html
    """
    from marsupial.cli.display.messages import say, warn
    from marsupial.cli.outputs import write_file
    from marsupial.formats.missionlog import read_log

    mission = read_log(log)
    if mission.truncated:
        warn(f"{log}: the last line is cut off and left out")
    if html is None:
        from rich.console import Console

        from marsupial.cli.display.terminal_replay import play

        play(mission.events, Console(), speed, time.monotonic, time.sleep)
        return
    from marsupial.replay.page import replay_page

    write_file(html, replay_page(mission.events))
    say(f"wrote {html}")
