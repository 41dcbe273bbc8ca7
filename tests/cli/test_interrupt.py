import os
import signal

import pytest

from marsupial.cli.process.interrupt import Interrupted, asked_to_stop, interruptible


def test_a_signal_raises_wherever_the_program_is() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(Interrupted), interruptible():
        os.kill(os.getpid(), signal.SIGTERM)
    assert signal.getsignal(signal.SIGINT) == before


def test_the_first_signal_asks_and_the_second_raises(capsys: pytest.CaptureFixture[str]) -> None:
    with asked_to_stop() as asked:
        assert not asked()
        os.kill(os.getpid(), signal.SIGINT)
        assert asked()
        assert "once more" in capsys.readouterr().err
        with pytest.raises(Interrupted):
            os.kill(os.getpid(), signal.SIGINT)
