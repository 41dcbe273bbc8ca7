"""The kinds of files that a mission can be exported as, by suffix.

Each writer is imported when it is used: matplotlib takes long to import, and others need optional packages.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from marsupial.errors import UsageError
from marsupial.exports.style import plain_style
from marsupial.model.mission import MissionEvent
from marsupial.replay.palette import DARK, LIGHT


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions:
    """The options of an export."""

    at_ms: int | None = None  # the moment that a figure shows; None for the end of the mission
    speed: float | None = None  # seconds of the mission per second of a film; None makes the film some 20 s long
    dark: bool = False  # whether figures and films have a dark background


PNG_DPI = 150.0

MissionEvents = Sequence[MissionEvent]


class Export(NamedTuple):
    """A kind of file: the function that writes it, given its suffix, and the `ExportOptions` that it takes."""

    write: Callable[[MissionEvents, str, ExportOptions], bytes]
    takes: frozenset[str]


def _figure(events: MissionEvents, suffix: str, options: ExportOptions) -> bytes:
    kind, palette = suffix.removeprefix("."), DARK if options.dark else LIGHT
    with plain_style():
        from marsupial.exports.drawing import mission_figure
        from marsupial.exports.figures import figure_file

        drawn = mission_figure(events, at_ms=options.at_ms, palette=palette, dpi=PNG_DPI if kind == "png" else 100.0)
        return figure_file(drawn, kind)


def _film(events: MissionEvents, suffix: str, options: ExportOptions) -> bytes:
    with plain_style():
        from marsupial.exports import film

        make = film.gif if suffix == ".gif" else film.mp4
        return make(events, speed=options.speed, palette=DARK if options.dark else LIGHT)


def _mcap(events: MissionEvents, suffix: str, options: ExportOptions) -> bytes:
    try:
        from marsupial.exports.recording import write_recording
    except ModuleNotFoundError as error:
        raise UsageError("MCAP needs its libraries: pip install 'marsupial[mcap]'") from error
    out = io.BytesIO()
    write_recording(events, out)
    return out.getvalue()


EXPORTS: Mapping[str, Export] = {
    **dict.fromkeys((".gif", ".mp4"), Export(_film, frozenset({"speed", "dark"}))),
    **dict.fromkeys((".svg", ".png", ".pdf"), Export(_figure, frozenset({"at_ms", "dark"}))),
    ".mcap": Export(_mcap, frozenset()),
}
"""By suffix."""

_NOUNS = {"at_ms": "a moment (at)", "speed": "a speed", "dark": "a dark background"}


def check_export(suffix: str, options: ExportOptions) -> None:
    """Raise a `UsageError` if there is no such kind of file, or it does not take an option that was chosen."""
    kind = EXPORTS.get(suffix.lower())
    if kind is None:
        raise UsageError(f"can't write {suffix or 'a file without a suffix'}; there are {', '.join(EXPORTS)}")
    for name, noun in _NOUNS.items():
        if getattr(options, name) != getattr(ExportOptions(), name) and name not in kind.takes:
            takers = ", ".join(other for other, export in EXPORTS.items() if name in export.takes)
            raise UsageError(f"{suffix} takes no {noun.removeprefix('a ')}; {noun} is for {takers}")


def export_mission(events: MissionEvents, suffix: str, options: ExportOptions) -> bytes:
    """Return the mission as a file of the kind with this suffix; raise a `UsageError` if that can't be made here."""
    check_export(suffix, options)
    return EXPORTS[suffix.lower()].write(events, suffix.lower(), options)
