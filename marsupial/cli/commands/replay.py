"""`marsupial replay`: a mission log, played in the terminal or as a page."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from marsupial.errors import UsageError
from marsupial.model.mission import MissionEvent


def replay(
    log: Annotated[Path, typer.Argument(help="A mission log.")],
    other: Annotated[Path | None, typer.Argument(help="Another one, to be seen beside it on the page.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write one self-contained HTML page there instead.")] = None,
    speed: Annotated[float, typer.Option(min=0.1, help="Simulated seconds in a second.")] = 20.0,
) -> None:
    """Play a mission log in the terminal, or write it as a page; two logs as a page with both side by side.

    Example: marsupial replay office.jsonl --html office.html
    """
    from marsupial.cli.display.messages import say
    from marsupial.cli.outputs import write_file

    if other is not None and html is None:
        raise UsageError("two logs are played on a page only: add --html FILE")
    events = _events(log)
    if html is None:
        from rich.console import Console

        from marsupial.cli.display.terminal_replay import play

        play(events, Console(), speed, time.monotonic, time.sleep)
        return
    from marsupial.replay.page import replay_page

    write_file(html, replay_page(events, None if other is None else _events(other)))
    say(f"wrote {html}")


def _events(log: Path) -> tuple[MissionEvent, ...]:
    """Return the events of a log, with a notice where its last line is cut off."""
    from marsupial.cli.display.messages import warn
    from marsupial.formats.missionlog import read_log

    mission = read_log(log)
    if mission.truncated:
        warn(f"{log}: the last line is cut off and left out")
    return mission.events
