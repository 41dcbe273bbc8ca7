from pathlib import Path

import pytest

from marsupial.cli.main import main


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "lobby.jsonl"
    assert main(["run", "lobby", "--strategy", "heuristic", "--time-limit", "40", "--log", str(path)]) == 5
    return path


def test_without_a_terminal_the_plans_are_listed(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(log)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "plan 1" in lines[0]
    assert "time_limit" in lines[-1]


def test_a_page_is_written(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    assert main(["replay", str(log), "--html", str(page)]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", f"wrote {page}\n")
    assert page.read_text().lstrip().lower().startswith("<!doctype html>")


def test_two_logs_make_a_page_with_both_and_nothing_else(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "both.html"
    assert main(["replay", str(log), str(log), "--html", str(page)]) == 0
    assert page.read_text().count('class="log"') == 2
    capsys.readouterr()
    assert main(["replay", str(log), str(log)]) == 2
    assert "several logs can only be played on a page: add --html FILE" in capsys.readouterr().err


def test_a_log_that_was_cut_off_is_replayed_as_far_as_it_goes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.jsonl"
    cut.write_bytes(log.read_bytes()[:-40])
    assert main(["replay", str(cut), "--html", str(tmp_path / "page.html")]) == 0
    assert "the last line is cut off and left out" in capsys.readouterr().err


def test_a_figure_of_a_moment_is_written(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure = tmp_path / "lobby.svg"
    assert main(["replay", str(log), "--export", str(figure), "--at", "10"]) == 0
    assert capsys.readouterr().err.endswith(" kB)\n")
    assert ">0:10</text>" in figure.read_text()


def test_an_impossible_export_is_a_usage_error(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(log), "--export", str(tmp_path / "lobby.avi")]) == 2
    assert "can't write .avi; there are .gif, .mp4, .svg" in capsys.readouterr().err
    assert main(["replay", str(log), "--export", str(tmp_path / "lobby.svg"), "--at", "4000"]) == 2
    assert "there is nothing at 4000 s: the mission goes from 0 s to 28.311 s" in capsys.readouterr().err
    assert main(["replay", str(log), "--at", "10"]) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("file", "option", "reason"),
    [
        ("x.mcap", "--speed 5", ".mcap takes no speed; a speed is for .gif, .mp4"),
        ("x.svg", "--speed 5", ".svg takes no speed"),
        ("x.gif", "--at 5", ".gif takes no moment (at); a moment (at) is for .svg, .png, .pdf"),
        ("x.mcap", "--dark", ".mcap takes no dark background"),
        ("x.html", "--speed 5", "--speed does not apply to pages"),
    ],
)
def test_an_option_that_a_file_makes_nothing_of_is_refused(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, option: str, reason: str
) -> None:
    how = "--html" if file.endswith(".html") else "--export"
    assert main(["replay", str(log), how, str(tmp_path / file), *option.split()]) == 2
    assert capsys.readouterr().err.startswith(f"error: {reason}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("map.yaml", "image: map.pgm\nresolution: 0.1\n", "a nav2 map"),
        ("team.yaml", "format: marsupial-scenario\n", "a scenario file"),
        ("arena.map", "type octile\n", "a MovingAI map"),
        ("plan.png", "none", "an image"),
    ],
)
def test_what_is_no_log_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, kind: str
) -> None:
    (tmp_path / name).write_text(text)
    assert main(["replay", str(tmp_path / name)]) == 3
    assert f"{name}: is {kind}, not a mission log: `marsupial run" in capsys.readouterr().err
