from __future__ import annotations

from threading import Event

import pytest

from marsupial.cli.display.alive import Alive


def test_silence_is_broken_again_and_again(capsys: pytest.CaptureFixture[str]) -> None:
    asked, often = [0], Event()

    def what() -> str:
        asked[0] += 1
        if asked[0] == 3:
            often.set()
        return f"at work {asked[0]}"

    with Alive(what, every_s=0.01):
        assert often.wait(60)
    assert capsys.readouterr().err.startswith("at work 1\nat work 2\nat work 3\n")


def test_who_is_quick_says_only_what_it_has_to_say(capsys: pytest.CaptureFixture[str]) -> None:
    with Alive(lambda: "at work", every_s=3600) as alive:
        alive.say("done")
    assert capsys.readouterr().err == "done\n"
