"""A mission as a film, GIF or MP4: one frame of the drawing per moment, then its end for some seconds."""

import io
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from marsupial.errors import UsageError
from marsupial.exports.drawing import MissionDrawing, Pixels
from marsupial.mission.playback import Playback
from marsupial.model.mission import MissionEvent
from marsupial.replay.palette import LIGHT, Palette

# Length of a film whose speed is not chosen: about as long as a reader watches a moving picture in a text.
FILM_S = 20.0

HOLD_S = 2.0  # how long the end is shown

# Frames per second, and pixels per inch: both low, as a GIF holds nearly every pixel of every frame.
GIF_FPS, GIF_DPI = 10, 75.0

MP4_FPS, MP4_DPI = 20, 100.0

QUALITY = "20"  # constant rate factor of H.264: 18 is visually lossless, 28 visibly is not
SAMPLES = 4  # number of frames that the 255 colours of a GIF are chosen from


def moments(playback: Playback, speed: float | None, fps: int) -> list[int]:
    """Return the moment (ms) of each frame of a film with `speed` seconds of the mission per second of the film."""
    # Without a speed the film is `FILM_S` long, but never slower than the mission.
    speed = max(1.0, playback.duration_ms / 1000 / FILM_S) if speed is None else speed
    count = max(1, round(playback.duration_ms / 1000 / speed * fps))
    times = np.linspace(playback.start_ms, playback.end_ms, count + 1).round().astype(int).tolist()
    return [*times, *[playback.end_ms] * round(HOLD_S * fps)]


def gif(events: Sequence[MissionEvent], *, speed: float | None = None, palette: Palette = LIGHT) -> bytes:
    """Return a mission as an animated GIF that repeats."""
    from PIL import Image

    playback = Playback(events)
    drawing = MissionDrawing(playback, palette=palette, dpi=GIF_DPI)
    times = moments(playback, speed, GIF_FPS)
    # One palette for all frames, or colours would flicker; without dithering, which moves from frame to frame.
    samples = [drawing.frame(t_ms) for t_ms in np.linspace(playback.start_ms, playback.end_ms, SAMPLES).astype(int)]
    colours = Image.fromarray(np.vstack(samples)).quantize(255)
    frames = map(Image.fromarray, _frames(drawing, times))
    plain = (frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames)
    out = io.BytesIO()
    next(plain).save(
        out, format="GIF", save_all=True, append_images=plain, duration=1000 // GIF_FPS, loop=0, optimize=False
    )
    return out.getvalue()


def mp4(events: Sequence[MissionEvent], *, speed: float | None = None, palette: Palette = LIGHT) -> bytes:
    """Return a mission as H.264 in MP4, which browsers and slides play. Raise `UsageError` without PyAV."""
    try:
        import av
    except ModuleNotFoundError as error:
        raise UsageError("MP4 needs PyAV: pip install 'marsupial[video]'") from error
    playback = Playback(events)
    drawing = MissionDrawing(playback, palette=palette, dpi=MP4_DPI)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        _encode(av, path, _frames(drawing, moments(playback, speed, MP4_FPS)))
        return path.read_bytes()


def _encode(av: Any, path: Path, frames: Iterator[Pixels]) -> None:
    # The index is moved to the front at the end, so that playing can begin before the whole file has arrived. That
    # second pass needs a file instead of memory.
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream: Any = container.add_stream("libx264", rate=MP4_FPS, options={"crf": QUALITY})
        stream.pix_fmt = "yuv420p"
        first = next(frames)
        stream.height, stream.width = (size // 2 * 2 for size in first.shape[:2])  # yuv420p needs even sizes
        for pixels in chain([first], frames):
            even = np.ascontiguousarray(pixels[: stream.height, : stream.width])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")))
        container.mux(stream.encode())


def _frames(drawing: MissionDrawing, times: Sequence[int]) -> Iterator[Pixels]:
    """Yield the drawing at these moments; equal moments in a row are drawn once."""
    last: Pixels | None = None
    for i, t_ms in enumerate(times):
        if last is None or t_ms != times[i - 1]:
            last = drawing.frame(t_ms)
        yield last
