from threading import Event

import pytest
from support.waiting import HANG_S

from marsupial.cli.display.messages import Alive


def test_silence_is_broken_again_and_again(capsys: pytest.CaptureFixture[str]) -> None:
    asked, often = [0], Event()

    def what() -> str:
        asked[0] += 1
        if asked[0] == 3:
            often.set()
        return f"at work {asked[0]}"

    with Alive(what, first_s=0.01, last_s=0.02):
        assert often.wait(HANG_S)
    assert capsys.readouterr().err.startswith("at work 1\nat work 2\nat work 3\n")


def test_a_quick_command_prints_only_its_own_output(capsys: pytest.CaptureFixture[str]) -> None:
    with Alive(lambda: "at work", first_s=3600) as alive:
        alive.say("done")
    assert capsys.readouterr().err == "done\n"


def test_silence_lasts_twice_as_long_each_time_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []
    alive = Alive(lambda: "at work", first_s=1.0, last_s=5.0)

    class Silence(Event):
        def wait(self, timeout: float | None = None) -> bool:
            waited.append(timeout or 0.0)
            alive._over = len(waited) == 5
            return False

    monkeypatch.setattr(alive, "_spoken", Silence())
    alive._watch()
    assert waited == [1.0, 2.0, 4.0, 5.0, 5.0]
