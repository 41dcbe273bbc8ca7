"""`marsupial serve`: the HTTP service, the API keys of its remote users, and maintenance of its store."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.display.help import PlainProgram
from marsupial.cli.display.messages import say
from marsupial.cli.options.shared import Quiet, check_extra, options_given, within
from marsupial.errors import UsageError

if TYPE_CHECKING:
    from marsupial_service.keys import Keys

serve = PlainProgram(no_args_is_help=False)
keys = PlainProgram(no_args_is_help=True, help="Create, list and revoke API keys.")
serve.add_typer(keys, name="keys")
store = PlainProgram(no_args_is_help=True, help="Inspect, back up, restore and prune a store.")
serve.add_typer(store, name="store")

DEFAULT_DATA = Path("marsupial-data")

SERVICE = ("the service", "service", "fastapi", "prometheus_client", "uvicorn")
"""The part of marsupial, its extra, and the libraries that come with it."""

Data = Annotated[Path, typer.Option(help="Folder for jobs, missions and keys.")]
Shared = Annotated[
    str | None,
    typer.Option(
        "--store",
        envvar="MARSUPIAL_STORE",
        show_default=False,
        help="Keep them in this PostgreSQL database instead, shared by several servers (postgresql://user@host/name).",
    ),
]


@serve.callback(invoke_without_command=True)
def run(
    context: typer.Context,
    host: Annotated[
        str, typer.Option(help="Address to listen on; addresses beyond this machine require keys.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(callback=within(0, 65535), help="Port; 0 picks a free one.")] = 8080,
    data: Data = DEFAULT_DATA,
    store: Shared = None,
    require_keys: Annotated[
        bool, typer.Option("--require-keys", help="Require keys from clients on this machine too.")
    ] = False,
    planner: Annotated[
        list[str] | None, typer.Option(help="NAME=COMMAND: offer an external planner under this name; repeatable.")
    ] = None,
    limit: Annotated[
        list[str] | None, typer.Option(help="NAME=NUMBER: set one of the limits listed at /v1/limits; repeatable.")
    ] = None,
    log_level: Annotated[str, typer.Option(help="debug, info, warning or error.")] = "info",
    openapi: Annotated[bool, typer.Option("--openapi", help="Print the OpenAPI document and exit.")] = False,
) -> None:
    """Serve plans and a page over HTTP: docs/service.md.

    Example: marsupial serve --port 8080 --data jobs
    """
    if context.invoked_subcommand is not None:
        return
    check_extra(*SERVICE)
    from marsupial.cli.display.tables import print_text
    from marsupial.cli.process.interrupt import Interrupted
    from marsupial.wording import unknown_name
    from marsupial_service.http.openapi import stored_text
    from marsupial_service.server import serve as run_server
    from marsupial_service.settings import ServiceLimits, ServiceSettings, limits_from

    if openapi:
        if others := options_given(context, "openapi"):
            raise UsageError(f"--openapi takes no {' and no '.join(others)}: it only prints a document")
        print_text(stored_text())
        return
    if log_level.lower() not in ("debug", "info", "warning", "error"):
        raise UsageError(f"--log-level: must be debug, info, warning or error, got {log_level!r}")
    given = dict(_pairs("--limit", limit))
    names = {one.name for one in fields(ServiceLimits)}
    for name in given:
        if name not in names:
            raise UsageError(f"--limit: {unknown_name('limit', name, sorted(names))}")
    settings = ServiceSettings(
        data=data,
        store=store,
        host=host,
        port=port,
        keys=require_keys,
        limits=limits_from(os.environ, given),
        planners={name: f"cmd:{command}" for name, command in _pairs("--planner", planner)},
    )
    try:
        started = run_server(settings, level=log_level, tell=lambda address: say(f"marsupial serves at {address}"))
    except Interrupted:
        return
    if not started:
        raise typer.Exit(1)


@keys.command()
def add(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Owner of the key; jobs and missions belong to this name.")
    ],
    scope: Annotated[
        list[str] | None, typer.Option(help="plan, mission or admin; repeatable or comma-separated.")
    ] = None,
    days: Annotated[float, typer.Option(help="Days until the key expires.")] = 90.0,
    data: Data = DEFAULT_DATA,
    store: Shared = None,
) -> None:
    """Create a key and print it; it is shown only once.

    A name may have two valid keys: create the new one, give it to all clients, then revoke the old one.

    Example: marsupial serve keys add fleet --scope plan,mission --data jobs
    """
    from marsupial.cli.display.tables import print_text

    scopes = [word.strip() for text in scope or ["plan,mission"] for word in text.split(",") if word.strip()]
    with _keys(data, store) as kept:
        print_text(kept.add(name, scopes, days, time.time()) + "\n")


@keys.command("list")
def list_keys(data: Data = DEFAULT_DATA, store: Shared = None) -> None:
    """List the keys, without their secrets.

    Example: marsupial serve keys list --data jobs
    """
    from marsupial.cli.display.tables import print_table

    now_s = time.time()
    with _keys(data, store) as kept:
        rows = []
        for key in kept.all():
            day = time.strftime("%Y-%m-%d", time.gmtime(key.expires_s))
            rows.append((key.name, key.id, ", ".join(key.scopes), day, "yes" if key.is_valid(now_s) else "no"))
    print_table(("name", "id", "scopes", "expires", "valid"), rows)


@keys.command()
def revoke(
    which: Annotated[
        str, typer.Argument(metavar="KEY|NAME", help="The id of one key, or a name to revoke all its keys.")
    ],
    data: Data = DEFAULT_DATA,
    store: Shared = None,
) -> None:
    """Revoke keys immediately.

    Example: marsupial serve keys add fleet --data jobs

    marsupial serve keys revoke fleet --data jobs
    """
    with _keys(data, store) as kept:
        kept.revoke(which, time.time())


@contextmanager
def _keys(data: Path, store: str | None) -> Iterator[Keys]:
    with store_errors():
        from marsupial_service.keys import open_keys

        try:
            with open_keys(data if store is None else store) as kept:
                yield kept
        except OSError as error:
            raise UsageError(f"{error.filename or data}: {(error.strerror or str(error)).lower()}") from error


@contextmanager
def store_errors() -> Iterator[None]:
    """Raise a `UsageError` for an error of the store inside."""
    check_extra(*SERVICE)
    from marsupial_service.store import StoreError

    try:
        yield
    except StoreError as error:
        raise UsageError(str(error)) from error


def _pairs(option: str, given: list[str] | None) -> list[tuple[str, str]]:
    pairs = []
    for text in given or []:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise UsageError(f"{option}: must be NAME=VALUE, got {text!r}")
        pairs.append((name, value))
    return pairs


@store.command()
def info(
    data: Data = DEFAULT_DATA,
    store: Shared = None,
    live: Annotated[
        bool, typer.Option("--live", help="Also measure the size of the rows alone; needs time and space for a copy.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show version, size, row counts, versions of open missions, the age of the oldest row. Servers may run.

    Example: marsupial serve store info --data jobs
    """
    from marsupial.cli.display.tables import print_facts, print_json

    with _upkeep() as upkeep:
        from marsupial_service.missions.codeversion import code_version

        found = upkeep.info(_place(data, store))
        live_bytes = upkeep.live_bytes(_place(data, store)) if live else None
    if json:
        print_json({**asdict(found), **({} if live_bytes is None else {"live_bytes": live_bytes})})
        return
    facts = [("store", found.place), ("version", str(found.version)), ("on disk", _size(found.disk_bytes))]
    facts.append(("free", _size(found.free_bytes)))
    if live_bytes is not None:
        facts.append(("live", f"{_size(live_bytes)} (on disk: {found.disk_bytes / live_bytes:.2f} times as much)"))
    facts.append(("jobs and missions", _size(found.stored_bytes)))
    facts += [(name, f"{count} rows") for name, count in found.rows.items()]
    facts += [(f"open {name}", str(count)) for name, count in found.open.items()]
    here = code_version()
    for version, count in found.versions.items():
        whose = "this version" if version == here else f"version {version or '(unknown)'}; this one is {here}"
        facts.append(("open missions", f"{count} of {whose}"))
    if found.left:
        facts.append(("left", f"{found.left} open missions that a server could not continue"))
    if found.oldest_ms is not None:
        facts.append(("oldest", time.strftime("%Y-%m-%d %H:%M:%SZ", time.gmtime(found.oldest_ms / 1000))))
    print_facts(facts)


@store.command()
def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to create.")],
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
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A backup.")],
    data: Data = DEFAULT_DATA,
    quiet: Quiet = False,
) -> None:
    """Check a backup and restore it into a new folder.

    Example: marsupial serve store backup monday.backup --data jobs

    marsupial serve store restore monday.backup --data jobs-again
    """
    with _upkeep() as upkeep:
        version, has_checksum = upkeep.restore(file, data)
    say(f"restored {file} (version {version}) to {data}")
    if not has_checksum:
        say("it has no checksum, as backups of earlier versions: a changed byte in a page would go unnoticed")


@store.command()
def retain(
    days: Annotated[
        float | None, typer.Option(callback=within(0), help="Remove what ended more than this many days ago.")
    ] = None,
    kept: Annotated[
        int | None,
        typer.Option(callback=within(0), help="Keep this many finished jobs and this many finished missions."),
    ] = None,
    data: Data = DEFAULT_DATA,
    store: Shared = None,
    quiet: Quiet = False,
) -> None:
    """Remove finished jobs and missions now and free their space. Servers may run.

    Example: marsupial serve store retain --days 2 --data jobs
    """
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
