"""`marsupial ros`: run a mission of the service on robots with ROS 2."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.display.messages import say
from marsupial.cli.options.shared import Json, Quiet, check_extra, keep_inputs
from marsupial.cli.process.exit_codes import INTERRUPTED, MISSION_CODES
from marsupial.errors import UsageError
from marsupial.formats.files import writing

if TYPE_CHECKING:
    from marsupial_ros.bridge import BridgeOutcome
    from marsupial_ros.journal import Journal
    from marsupial_ros.settings import Settings


def ros(
    settings: Annotated[
        Path,
        typer.Argument(metavar="SETTINGS", help="Settings file with robots, types, topics and frames: docs/ros.md."),
    ],
    server: Annotated[
        str, typer.Option(help="URL of the planning service; MARSUPIAL_KEY holds the API key.")
    ] = "http://127.0.0.1:8080",
    rosbridge: Annotated[
        str | None, typer.Option(help="Address of rosbridge (ws://HOST:PORT); overrides the settings.")
    ] = None,
    state: Annotated[Path | None, typer.Option(help="State file; a restarted bridge resumes from it.")] = None,
    log: Annotated[Path | None, typer.Option(help="Write the mission log to this file at the end.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Check the settings and exit.")] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a mission on robots with ROS 2.

    Receives maps and poses and sends paths and docking goals over rosbridge: docs/ros.md.

    Example: marsupial ros fleet.yaml --state fleet.state
    """
    check_extra("the bridge to ROS", "ros", "cbor2", "httpx2", "websockets")
    from dataclasses import replace

    from marsupial.cli.display.tables import print_json, print_text
    from marsupial.wording import counted
    from marsupial_ros.journal import Journal
    from marsupial_ros.settings import read_settings

    keep_inputs(settings, state=state, log=log)
    read = read_settings(settings)
    if rosbridge is not None:
        read = replace(read, rosbridge=rosbridge)
    if check:
        say(f"{settings}: {counted(len(read.robots), 'robot')}, map on {read.map.topic}, rosbridge at {read.rosbridge}")
        return
    outcome = _carry_out(read, server, Journal(state), log)
    ended = outcome.ended
    status, reason = (
        ("cancelled", "the bridge left before the end of the mission")
        if ended is None
        else (ended["status"], ended["reason"])
    )
    if json:
        print_json({"mission": outcome.mission, "status": status, "reason": reason})
    else:
        print_text(f"{status}: {reason}\n")
    raise typer.Exit(INTERRUPTED if ended is None else MISSION_CODES[status])


def _carry_out(settings: Settings, server: str, journal: Journal, log: Path | None) -> BridgeOutcome:
    from marsupial.cli.process.interrupt import stop_requests
    from marsupial_client import AsyncClient, Busy, ClientError
    from marsupial_ros.bridge import PATIENCE_S, Bridge
    from marsupial_ros.ros_listener import subscriptions
    from marsupial_ros.rosbridge import Rosbridge

    async def drive() -> BridgeOutcome:
        key = os.environ.get("MARSUPIAL_KEY")
        async with AsyncClient(server, key=key, patience_s=PATIENCE_S) as client:
            transport = Rosbridge(settings.rosbridge, subscriptions(settings))
            outcome = await Bridge(settings, transport, client, journal, say, stops).run()
            if log is not None and outcome.mission is not None:
                text = await (await client.mission(outcome.mission)).log()
                with writing(log):
                    log.write_text(text)
            return outcome

    try:
        with stop_requests() as stops:
            return asyncio.run(drive())
    except ValueError as error:
        raise UsageError(f"--server: {error}") from error
    except Busy as error:
        raise UsageError(f"the service can't be reached: {error}") from error
    except ClientError as error:
        raise UsageError(str(error)) from error
