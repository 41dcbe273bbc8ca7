"""The program `marsupial`: its commands, and how it ends.

Packages: `commands` has a module per command, which reads arguments and prints; `options` what commands share of
arguments; `work` what the larger commands do; `display` output on stdout and stderr; `process` exit codes and signals.

Shells may pass stdout and stderr closed, full, or with a reader that leaves early (`open_closed`, `settled`).

Commands import what they need when they run, so that `marsupial --help` is quick. Here exceptions become one line per
problem on stderr and an exit code (`marsupial.cli.process.exit_codes`); bad input never shows a traceback.
"""

import errno
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import version
from types import SimpleNamespace
from typing import Annotated, TextIO

import typer

from marsupial.cli.commands.bench import bench
from marsupial.cli.commands.compare import compare
from marsupial.cli.commands.demo import demo
from marsupial.cli.commands.export import export
from marsupial.cli.commands.lists import planners, scenarios, strategies
from marsupial.cli.commands.map import describe_map
from marsupial.cli.commands.plan import plan
from marsupial.cli.commands.replay import replay
from marsupial.cli.commands.reproduce import reproduce
from marsupial.cli.commands.ros import ros
from marsupial.cli.commands.run import run
from marsupial.cli.commands.serve import serve
from marsupial.cli.commands.validate import validate
from marsupial.cli.display.help import PlainProgram
from marsupial.cli.display.messages import Volume, complain, set_volume
from marsupial.cli.process.exit_codes import DONE, ERROR_CODES, INTERNAL, INTERRUPTED, READER_LEFT, USAGE
from marsupial.cli.process.interrupt import Interrupted, interruptible
from marsupial.errors import InternalError, MarsupialError, UsageError
from marsupial.formats.files import reason

app = PlainProgram(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


DISK_FULL = (errno.ENOSPC, errno.EDQUOT)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"marsupial {version('marsupial')}")
        raise typer.Exit


@app.callback()
def _program(
    context: typer.Context,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an internal error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Temporal planning for teams of carriers and rovers that explore unknown maps."""
    context.obj.debug = debug


# In the order of `marsupial --help`.
_command: Callable[..., None]
for _command in (run, replay, compare, reproduce, plan, export, validate):
    app.command()(_command)
app.command("map")(describe_map)
for _listing in (strategies, planners, scenarios):
    app.command()(_listing)
app.add_typer(bench, name="bench")
app.command()(demo)
app.command()(ros)
app.add_typer(serve, name="serve")


@app.command("help")
def show_help(
    context: typer.Context,
    command: Annotated[list[str] | None, typer.Argument(metavar="[COMMAND]...", help="A command.")] = None,
) -> None:
    """Show the help of the program, or of a command.

    Example: marsupial help run
    """
    app(args=[*(command or ()), "--help"], prog_name="marsupial", obj=context.obj)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code; `arguments` are those of the process if None."""
    open_closed()
    # tests call `main` several times in a process
    set_volume(Volume.NORMAL)
    try:
        code = _run(arguments)
    except BrokenPipeError:
        code = READER_LEFT
    return settled(code)


def _run(arguments: Sequence[str] | None) -> int:
    settings = SimpleNamespace(debug=False)  # set by the options before the command
    try:
        with interruptible():
            app(args=arguments, prog_name="marsupial", obj=settings)
    except SystemExit as leaving:
        if isinstance(leaving.__context__, BrokenPipeError):  # typer and rich exit with a code of their own
            return READER_LEFT
        return leaving.code if isinstance(leaving.code, int) else DONE
    except (Interrupted, KeyboardInterrupt):
        complain("interrupted")
        return INTERRUPTED
    except MarsupialError as error:
        return _report_bug(error, settings.debug) if isinstance(error, InternalError) else _refuse(error)
    except OSError as error:
        if error.errno not in DISK_FULL and fault_of(sys.stdout) is None:
            return _report_bug(error, settings.debug)
        return _refuse(UsageError(f"can't write: {reason(error)}"))  # help, as typer prints it; a temporary file
    except Exception as error:
        return _report_bug(error, settings.debug)
    return DONE


def _refuse(error: MarsupialError) -> int:
    for line in str(error).splitlines():
        complain(f"error: {line}")
    return next(ERROR_CODES[kind] for kind in type(error).__mro__ if kind in ERROR_CODES)


def _report_bug(error: Exception, debug: bool) -> int:
    """Report a bug of marsupial in a line, with the traceback in a file."""
    text = "".join(traceback.format_exception(error))
    line = f"internal error: {type(error).__name__}: {error}".splitlines()[0]
    kept = None if debug else _keep(text)
    if kept is None:
        complain(text + line)
    else:
        complain(f"{line}; this is a bug, its traceback is in {kept}")
    return INTERNAL


def _keep(text: str) -> str | None:
    """Write the text to a new temporary file and return its name; None if no folder is writable."""
    try:
        with tempfile.NamedTemporaryFile(prefix="marsupial-", suffix=".txt", delete=False) as file:
            file.write(text.encode(errors="backslashreplace"))
            return file.name
    except OSError:
        return None


def open_closed() -> None:
    """Reopen closed standard streams, so that the next opened file does not take their place."""
    # Writing to stdout fails then, as on a full disk; messages on stderr are dropped.
    for number, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # takes the lowest free number, which is this one
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def fault_of(stream: TextIO) -> OSError | None:
    """Flush a stream; return the error if that fails."""
    try:
        stream.flush()
    except OSError as error:
        return error
    return None


def settled(code: int) -> int:
    """Flush both streams and return the exit code; drop unwritable output, so that Python does not retry at exit."""
    for stream in (sys.stdout, sys.stderr):
        if (fault := fault_of(stream)) is None:
            continue
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        if isinstance(fault, BrokenPipeError):
            code = READER_LEFT
        elif stream is sys.stdout and code == DONE:
            complain(f"error: can't write to stdout: {reason(fault)}")
            code = USAGE
    return code


if __name__ == "__main__":
    sys.exit(main())
