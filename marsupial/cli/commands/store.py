"""`marsupial serve store`: maintenance of the service's store."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import ModuleType
from typing import Annotated

import typer

from marsupial.cli.commands.serve import DEFAULT_DATA, Data, Shared, store_errors
from marsupial.cli.options.shared import Quiet

store = typer.Typer(no_args_is_help=True, help="Inspect, back up, restore and prune a store.")


@store.command()
def info(
    data: Data = DEFAULT_DATA,
    store: Shared = None,
    live: Annotated[
        bool, typer.Option("--live", help="Also measure the size of the rows alone; needs time and space for a copy.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show version, size, row counts and the age of the oldest row. Servers may run.

    Example: marsupial serve store info --data jobs
    """
    from marsupial.cli.display.tables import print_facts, print_json

    with _upkeep() as upkeep:
        found = upkeep.info(_place(data, store))
        live_bytes = upkeep.live_bytes(_place(data, store)) if live else None
    if json:
        print_json({**asdict(found), **({} if live_bytes is None else {"live_bytes": live_bytes})})
        return
    facts = [("store", found.place), ("version", str(found.version)), ("on disk", _size(found.disk_bytes))]
    facts.append(("free in it", _size(found.free_bytes)))
    if live_bytes is not None:
        facts.append(("live", f"{_size(live_bytes)}: {found.disk_bytes / live_bytes:.2f} times that is on the disk"))
    facts.append(("jobs and missions", _size(found.stored_bytes)))
    facts += [(name, f"{count} rows") for name, count in found.rows.items()]
    facts += [(f"open {name}", str(count)) for name, count in found.open.items()]
    if found.oldest_ms is not None:
        facts.append(("oldest", time.strftime("%Y-%m-%d %H:%M:%SZ", time.gmtime(found.oldest_ms / 1000))))
    print_facts(facts)


@store.command()
def backup(
    file: Annotated[Path, typer.Argument(help="File to create.")],
    data: Data = DEFAULT_DATA,
    store: Shared = None,
) -> None:
    """Write a consistent backup to a file, with the hashes of the keys. A server may run.

    Example: marsupial serve store backup monday.backup --data jobs
    """
    with _upkeep() as upkeep:
        upkeep.backup(_place(data, store), file)


@store.command()
def restore(
    file: Annotated[Path, typer.Argument(help="A backup.")],
    data: Data = DEFAULT_DATA,
    quiet: Quiet = False,
) -> None:
    """Check a backup and restore it into a new folder.

    Example: marsupial serve store backup monday.backup --data jobs

    marsupial serve store restore monday.backup --data jobs-again
    """
    from marsupial.cli.display.messages import say

    with _upkeep() as upkeep:
        version = upkeep.restore(file, data)
    say(f"{data} holds the store of {file}, of version {version}")


@store.command()
def retain(
    days: Annotated[float | None, typer.Option(min=0, help="Remove what ended more than this many days ago.")] = None,
    kept: Annotated[
        int | None, typer.Option(min=0, help="Keep this many finished jobs and this many finished missions.")
    ] = None,
    data: Data = DEFAULT_DATA,
    store: Shared = None,
    quiet: Quiet = False,
) -> None:
    """Remove finished jobs and missions now and free their space. Servers may run.

    Example: marsupial serve store retain --days 2 --data jobs
    """
    from marsupial.cli.display.messages import say

    with _upkeep() as upkeep:
        removed = upkeep.retain(_place(data, store), days=days, kept=kept, now_ms=round(1000 * time.time()))
    say("removed " + " and ".join(f"{count} {name}" for name, count in removed.items()))


@contextmanager
def _upkeep() -> Iterator[ModuleType]:
    with store_errors():
        from marsupial_service.operations import upkeep

        yield upkeep


def _place(data: Path, store: str | None) -> Path | str:
    return data if store is None else store


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB"
