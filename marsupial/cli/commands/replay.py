"""`marsupial replay`: a mission log, played in the terminal, or as a page, film, figure or recording."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.display.messages import say, warn
from marsupial.cli.options.shared import Quiet, keep_inputs, within
from marsupial.errors import LogError, UsageError
from marsupial.formats.files import write_bytes, write_file

if TYPE_CHECKING:
    from marsupial.exports.write import ExportOptions
    from marsupial.model.mission import MissionEvent

TERMINAL_SPEED = 20.0
MOST_BESIDE = 6  # missions on a page


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A mission log.")],
    others: Annotated[
        list[Path] | None, typer.Argument(metavar="LOG...", help="More logs, shown beside the first; six at most.")
    ] = None,
    html: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page instead.")] = None,
    export: Annotated[
        Path | None,
        typer.Option(help="Write a film (.gif, .mp4), a figure (.svg, .pdf, .png) or a recording (.mcap) instead."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            callback=within(0.1), help=f"Simulated seconds per second [default: {TERMINAL_SPEED:g}; films last 20 s]."
        ),
    ] = None,
    at: Annotated[
        float | None, typer.Option(callback=within(0), help="Simulated second shown in a figure [default: the end].")
    ] = None,
    dark: Annotated[bool, typer.Option("--dark", help="Use a dark background for films and figures.")] = False,
    quiet: Quiet = False,
) -> None:
    """Play a mission log, or write it as a page, film or figure.

    Plays in the terminal unless --html or --export is given. Several logs make one page, side by side. A recording
    (MCAP) is for Foxglove, Lichtblick and other viewers of robots' data, with a layout of their panels beside it. MP4
    needs the extra marsupial[video], MCAP the extra marsupial[mcap].

    Example: marsupial run lobby --log lobby.jsonl

    marsupial replay lobby.jsonl --html lobby.html

    marsupial replay lobby.jsonl --export lobby.gif
    """
    keep_inputs(log, *(others or ()), html=html, export=export)
    if export is None and (at is not None or dark):
        raise UsageError("--at and --dark are for --export")
    if html is not None and export is None and speed is not None:
        raise UsageError("--speed does not apply to pages: choose the speed on the page")
    if others and (html is None or export is not None):
        raise UsageError("several logs can only be played on a page: add --html FILE")
    if others and len(others) >= MOST_BESIDE:
        raise UsageError(f"at most {MOST_BESIDE} logs fit on a page, got {len(others) + 1}")
    if export is not None:
        from marsupial.exports.write import ExportOptions, check_export

        options = ExportOptions(at_ms=None if at is None else round(1000 * at), speed=speed, dark=dark)
        check_export(export.suffix, options)
    events = _events(log)
    if html is not None:
        from marsupial.replay.page import replay_page

        write_file(html, replay_page(events, *map(_events, others or ())))
        say(f"wrote {html}")
    if export is not None:
        _export(events, export, options)
    elif html is None:
        from rich.console import Console

        from marsupial.cli.display.terminal_replay import play

        play(events, Console(), speed or TERMINAL_SPEED, time.monotonic, time.sleep)


def _export(events: Sequence[MissionEvent], path: Path, options: ExportOptions) -> None:
    from marsupial.exports.write import export_mission
    from marsupial.mission.rebuild import check_moment

    if options.at_ms is not None:
        check_moment(events, options.at_ms)
    say(f"writing {path} ...")
    data = export_mission(events, path.suffix, options)
    write_bytes(path, data)
    say(f"wrote {path} ({len(data) / 1000:.0f} kB)")
    if path.suffix.lower() == ".mcap":
        from marsupial.exports.layout import recording_layout

        layout = path.with_suffix(".layout.json")
        write_file(layout, recording_layout(events))
        say(f"wrote {layout}, the layout of panels to import in Foxglove or Lichtblick")


def _events(log: Path) -> tuple[MissionEvent, ...]:
    """Return the events of a log, with a warning if its last line is cut off."""
    from marsupial.formats.missionlog import read_log

    try:
        mission = read_log(log)
    except LogError as error:
        if (kind := _other_kind(log)) is None:
            raise
        made = f"`marsupial run {log} --log FILE` makes one"
        raise LogError(f"is {kind}, not a mission log: {made}", source=str(log)) from error
    if mission.truncated:
        warn(f"{log}: the last line is cut off and left out")
    return mission.events


def _other_kind(log: Path) -> str | None:
    """Return what a file that is no log is by its name, if that can be run; None if it can't."""
    from marsupial.formats.mapfiles.read import kind_of
    from marsupial.formats.scenario import is_scenario_file

    if not log.is_file():
        return None
    return "a scenario file" if is_scenario_file(log) and log.suffix != ".json" else kind_of(log)
