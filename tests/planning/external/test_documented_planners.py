"""The installed planners of docs/external-planners.md, run with the commands on that page."""

import os
import re
import shutil
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import pytest
from support.planning.situations import bring_them_home, in_flight, many_rooms, one_room, relay, two_rooms
from support.planning.spots import carrier, hall, situation_of
from support.waiting import doubling_budgets

from marsupial.model import Budget, Outcome, Situation
from marsupial.planning.checker import check
from marsupial.planning.external.commands import External

pytestmark = pytest.mark.slow

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "external-planners.md").read_text(encoding="utf-8")
COMMANDS: Mapping[str, str] = dict(re.findall(r"^\| ([\w/]+)[^|]* \| `(cmd:[^`]+)` \|", PAGE, re.MULTILINE))
(SCRIPT,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
LPG_PACKAGE = find_spec("up_lpg")

SITUATIONS: Mapping[str, Situation] = {
    "one_room": one_room(),
    "two_rooms": two_rooms(),
    "relay": relay(),
    "in_flight": in_flight(),
    "bring_them_home": bring_them_home(),
    "many_rooms": many_rooms(1, 2, 4, 2),
    "beside": situation_of([carrier()], {"t1": hall(0), "t2": hall(3)}, {}, {"c1_start": hall(0)}),
}


@pytest.fixture(autouse=True)
def documented_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the page's script, and LPG from its package, on the path."""
    script = tmp_path / "tfd.sh"
    script.write_text("\n".join(line.removeprefix("  ") for line in SCRIPT.splitlines()))
    script.chmod(0o700)
    folders = [str(tmp_path)]
    if LPG_PACKAGE is not None and LPG_PACKAGE.origin is not None:
        folders.append(str(Path(LPG_PACKAGE.origin).parent))
    monkeypatch.setenv("PATH", os.pathsep.join([*folders, os.environ["PATH"]]))


def test_the_page_has_the_commands_of_four_planners() -> None:
    assert set(COMMANDS) == {"LPG", "Kairos", "POPF", "TFD/M"}


@pytest.mark.parametrize("situation", SITUATIONS.values(), ids=SITUATIONS)
@pytest.mark.parametrize("planner", COMMANDS)
def test_every_plan_of_a_documented_command_is_accepted(planner: str, situation: Situation) -> None:
    command = COMMANDS[planner]
    _skip_if_absent(command)
    for seconds in doubling_budgets(6):
        *improved, end = External(command).solve(situation, Budget(seconds=seconds))
        if improved or end.outcome is not Outcome.TIMEOUT:
            break
    assert improved, end.detail
    assert "refused" not in end.detail
    for event in improved:
        assert check(situation, event.plan).valid


def _skip_if_absent(command: str) -> None:
    words = command.removeprefix("cmd:").split()
    needed = [words[0]]
    if words[0] == "tfd.sh":
        (home,) = re.findall(r"^\s*tfd=(.*)$", SCRIPT, re.MULTILINE)
        needed += ["python2", f"{home}/build/tfd_search", f"{home}/build/tfd_preprocess"]
    for program in needed:
        if shutil.which(program) is None:
            pytest.skip(f"there is no executable {program} here")
