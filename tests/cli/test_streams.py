import subprocess
import sys
from pathlib import Path

import pytest

COMMANDS = ("--help", "planners --json", "map lobby")

FULL = Path("/dev/full")

needs_full = pytest.mark.skipif(not FULL.exists(), reason="there is no /dev/full here")


def shell(line: str) -> subprocess.CompletedProcess[str]:
    """Run a line of bash in which $M is the program."""
    script = f'M="{sys.executable} -m marsupial"\n{line}'
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_closed_pipe_ends_a_command_silently(command: str) -> None:
    done = shell(f"(sleep 0.1; $M {command}; echo $? >&2) | true")  # the reader has left when it begins to write
    assert done.stderr == "141\n"


def test_a_reader_of_messages_who_leaves_ends_a_mission() -> None:
    done = shell("{ $M run lobby --planner greedy --steps 1 2>&1 >/dev/null; echo $? >&3; } 3>&2 2>&1 | true")
    assert done.stderr == "141\n"


@pytest.mark.parametrize("command", ["--help", "map lobby"])
@pytest.mark.parametrize(
    ("target", "reason"),
    [pytest.param("> /dev/full", "no space left on device", marks=needs_full), (">&-", "it is closed")],
)
def test_stdout_that_takes_nothing_is_an_error_in_a_line(command: str, target: str, reason: str) -> None:
    done = shell(f"$M {command} {target}")
    assert done.returncode == 2
    (line,) = [line for line in done.stderr.splitlines() if not line.startswith("warning: ")]
    assert line.startswith("error: can't write")
    assert line.endswith(reason)


def test_a_command_that_has_nothing_for_stdout_does_without_it(tmp_path: Path) -> None:
    done = shell(f"$M export lobby -o {tmp_path} >&-")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "problem.pddl").exists()


@pytest.mark.parametrize("target", ["2>&-", pytest.param("2> /dev/full", marks=needs_full)])
def test_stderr_that_takes_nothing_ends_no_mission_and_puts_no_message_into_the_data(target: str) -> None:
    done = shell(f"$M run lobby --planner greedy --steps 1 --json {target}")
    assert done.returncode == 0
    assert done.stdout.startswith("{\n")
    assert shell(f"$M run nowhere {target}").stdout == ""
