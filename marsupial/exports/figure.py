"""A moment of a mission as a figure for papers and slides: SVG, PDF or PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from marsupial.exports.drawing import MissionDrawing
from marsupial.mission.playback import Playback
from marsupial.model.mission import MissionEvent
from marsupial.replay.palette import LIGHT, Palette

PNG_DPI = 150.0

SAME_BYTES: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
"""What is left out of a file, so that the same figure is the same bytes."""


def figure(events: Sequence[MissionEvent], kind: str, *, at_ms: int | None = None, palette: Palette = LIGHT) -> bytes:
    """Return the drawing of a mission at a moment, or its end, as a file of that kind (`SAME_BYTES`)."""
    playback = Playback(events)
    drawing = MissionDrawing(playback, palette=palette, dpi=PNG_DPI if kind == "png" else 100.0)
    t_ms = playback.end_ms if at_ms is None else min(max(at_ms, playback.start_ms), playback.end_ms)
    return file_of(drawing.still(t_ms), kind)


def file_of(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file of that kind (`SAME_BYTES`). Text in an SVG is text: it can be searched, and edited."""
    from matplotlib import rc_context

    out = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "marsupial", "pdf.fonttype": 42}):
        figure.savefig(out, format=kind, metadata=SAME_BYTES[kind])
    return out.getvalue()
