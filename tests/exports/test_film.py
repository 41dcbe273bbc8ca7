import io
import sys

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence
from support.missions.synthetic_mission import synthetic_mission

from marsupial.errors import UsageError
from marsupial.exports.film import FILM_S, GIF_FPS, HOLD_S, MP4_FPS, gif, moments, mp4
from marsupial.exports.write import EXPORTS, ExportOptions, export_mission
from marsupial.mission.playback import Playback

EVENTS = synthetic_mission()
FAST = 20.0


def test_a_film_begins_and_ends_with_the_mission_and_holds_the_end() -> None:
    playback = Playback(EVENTS)
    times = moments(playback, FAST, 10)
    assert times[0] == 0
    assert times == sorted(times)
    assert times.count(playback.end_ms) == 1 + HOLD_S * 10
    assert len(moments(playback, None, 10)) == FILM_S * 10 + 1 + HOLD_S * 10


def test_a_gif_is_moving_pictures_without_end() -> None:
    image = Image.open(io.BytesIO(gif(EVENTS, speed=FAST)))
    frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]
    assert image.info["loop"] == 0
    assert image.size == (960, 540)
    assert (frames[0] != frames[-1]).any()
    whole_ms = sum(frame.info["duration"] for frame in ImageSequence.Iterator(image))
    assert whole_ms == 1000 // GIF_FPS * len(moments(Playback(EVENTS), FAST, GIF_FPS))


def test_an_mp4_is_a_film_that_browsers_play() -> None:
    with av.open(io.BytesIO(mp4(EVENTS, speed=FAST))) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height) == (1280, 720)
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]
    assert len(frames) == len(moments(Playback(EVENTS), FAST, MP4_FPS))
    assert (frames[0] != frames[-1]).any()


@pytest.mark.parametrize(("suffix", "library", "extra"), [(".mp4", "av", "video"), (".mcap", "mcap.writer", "mcap")])
def test_a_missing_library_is_named_with_how_to_install_it(
    suffix: str, library: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    monkeypatch.delitem(sys.modules, "marsupial.exports.recording", raising=False)
    with pytest.raises(UsageError, match=rf"pip install 'marsupial\[{extra}\]'"):
        export_mission(EVENTS, suffix, ExportOptions())


def test_every_kind_of_file_can_be_written() -> None:
    begins = {".gif": b"GIF8", ".svg": b"<?xml", ".png": b"\x89PNG", ".pdf": b"%PDF", ".mcap": b"\x89MCAP"}
    assert {*begins, ".mp4"} == set(EXPORTS)
    for suffix, magic in begins.items():
        options = ExportOptions(speed=100.0) if "speed" in EXPORTS[suffix].takes else ExportOptions()
        assert export_mission(EVENTS, suffix.upper(), options).startswith(magic)
