"""What each robot does when: a lane for each robot, in the colours of activities."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from marsupial.exports.activity import Activity, activity
from marsupial.mission.playback import Playback
from marsupial.mission.state import views
from marsupial.replay.palette import Palette
from marsupial.wording import clock

LANE = 0.72
"""Height of a lane's bars, of the room that it has."""


def draw_lanes(axes: Axes, playback: Playback, palette: Palette, colours: Mapping[str, str]) -> Rectangle:
    """Draw the lanes of a whole mission by minutes; return what covers the time to come."""
    names = list(playback.timeline)
    start, end = playback.start_ms / 60_000, max(playback.end_ms, playback.start_ms + 1) / 60_000
    axes.set_xlim(start, end)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_facecolor(palette.page)
    for row, found in enumerate(stretches(playback).values()):
        for does, bars in found.items():
            if does is not Activity.WAIT:
                low = row - LANE / 2
                axes.broken_barh(bars, (low, LANE), facecolors=palette.actions[does], linewidth=0)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="x", length=0, labelsize=8.5, colors=palette.ink)
    axes.tick_params(axis="y", length=0, labelsize=min(8.5, 100 / max(1, len(names))), colors=palette.ink)
    for label, name in zip(axes.get_yticklabels(), names, strict=True):
        label.set_color(colours[name])
        label.set_fontweight("bold")
    axes.xaxis.set_major_formatter(lambda minutes, _: clock(60 * minutes))
    axes.spines[:].set_visible(False)
    shown = [does for does in Activity if does is not Activity.WAIT]
    handles = [Patch(facecolor=palette.actions[does], label=str(does)) for does in shown]
    axes.legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(handles), frameon=False,
        fontsize=8, labelcolor=palette.ink, handlelength=1.2, borderaxespad=0.2, columnspacing=1.2,
    )  # fmt: skip
    cover = Rectangle((start, -0.5), end - start, len(names), facecolor=palette.page, alpha=0.78, linewidth=0)
    axes.add_patch(cover)
    return cover


def stretches(playback: Playback) -> dict[str, dict[Activity, list[tuple[float, float]]]]:
    """Return for each robot when (min) and how long (min) it does what."""
    found: dict[str, dict[Activity, list[tuple[float, float]]]] = {}
    for name, changes in _changes(playback).items():
        own = found.setdefault(name, {})
        for (start_ms, does), (end_ms, _) in pairwise([*changes, (playback.end_ms, Activity.WAIT)]):
            if end_ms > start_ms:
                own.setdefault(does, []).append((start_ms / 60_000, (end_ms - start_ms) / 60_000))
    return found


def _changes(playback: Playback) -> dict[str, list[tuple[int, Activity]]]:
    """Return for each robot from when (ms) on it does what."""
    found: dict[str, list[tuple[int, Activity]]] = {name: [] for name in playback.timeline}
    for number, tracks in playback.moments:
        t_ms = playback.events[number].t_ms
        for robot in views(tracks, t_ms):
            changes, does = found[robot.name], activity(robot)
            if not changes or changes[-1][1] is not does:
                changes.append((t_ms, does))
    return found
