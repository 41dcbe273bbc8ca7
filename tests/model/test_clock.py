from __future__ import annotations

import pytest

from marsupial.model.clock import clock_text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (12.5, "0:13"),
        (59.6, "1:00"),
        (61, "1:01"),
        (279.7, "4:40"),
        (3600, "1:00:00"),
        (3723.4, "1:02:03"),
    ],
)
def test_times_are_shown_as_on_a_clock_to_the_nearest_second(seconds: float, text: str) -> None:
    assert clock_text(seconds) == text
