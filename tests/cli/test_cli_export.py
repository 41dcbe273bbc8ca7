from pathlib import Path

import pytest

from marsupial.cli.main import main
from marsupial.formats.missionlog import read_log
from marsupial.formats.pddl.text import check_domain, read_problem
from marsupial.formats.situation import situation_from_json
from marsupial.model import Planned, Situation

FILES = ("domain.pddl", "problem.pddl", "situation.json")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "lobby.jsonl"
    assert main(["run", "lobby", "--planner", "greedy", "--steps", "1", "--log", str(path)]) == 0
    return path


def exported(folder: Path) -> Situation:
    assert tuple(sorted(path.name for path in folder.iterdir())) == FILES
    check_domain((folder / "domain.pddl").read_text())
    situation = situation_from_json((folder / "situation.json").read_text())
    assert read_problem((folder / "problem.pddl").read_text()) == situation
    return situation


def test_the_start_of_a_scenario_is_exported(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["export", "lobby", "-o", str(tmp_path / "start")]) == 0
    situation = exported(tmp_path / "start")
    assert len(situation.robots) == 6
    assert situation.targets
    assert capsys.readouterr().out == ""


def test_the_team_and_the_seed_of_a_scenario_can_be_chosen(tmp_path: Path) -> None:
    assert main(["export", "lobby", "-o", str(tmp_path / "a"), "--carriers", "1", "--rovers", "1", "--seed", "4"]) == 0
    assert [robot.name for robot in exported(tmp_path / "a").robots] == ["carrier1", "rover1_1"]


def test_a_planning_of_a_log_gives_its_targets_and_meetings(log: Path, tmp_path: Path) -> None:
    plan = next(event for event in read_log(log).events if isinstance(event, Planned) and event.revision == 3)
    assert main(["export", str(log), "--at", str(plan.t_ms / 1000), "-o", str(tmp_path / "m")]) == 0
    situation = exported(tmp_path / "m")
    assert [target.name for target in situation.targets] == [target.name for target in plan.targets]
    assert list(situation.meetings) == [meeting.name for meeting in plan.meetings]


def test_a_log_is_known_by_what_is_in_it(log: Path, tmp_path: Path) -> None:
    copy = tmp_path / "lobby.log"
    copy.write_bytes(log.read_bytes())
    assert main(["export", str(copy), "-o", str(tmp_path / "m")]) == 0
    exported(tmp_path / "m")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--at", "-1"), "--at: must be 0 or more, got -1"),
        (("--at", "nan"), "--at: must be 0 or more"),
        (("--at", "99999"), "there is nothing at 99999 s: the mission goes from 0 s to"),
        *(((name, "1"), "only apply to scenarios, not to logs") for name in ("--seed", "--rovers", "--carriers")),
    ],
)
def test_a_moment_that_does_not_exist_or_options_of_scenarios_are_a_usage_error(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    assert main(["export", str(log), *arguments, "-o", str(tmp_path / "m")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "m").exists()
