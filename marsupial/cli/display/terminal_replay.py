"""A mission played in the terminal: map, robots, clock and actions, animated on one screen.

If the output is no terminal, or has no colours, it prints one line for every plan and for the end instead.
"""

from collections.abc import Callable, Sequence

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from marsupial.cli.display.picture import Picture, moves, plan_line, plan_text, printable
from marsupial.mission.playback import Playback
from marsupial.model import UNKNOWN, MissionEnded, MissionEvent
from marsupial.wording import clock, counted

FRAME_S = 0.1


def play(
    events: Sequence[MissionEvent],
    console: Console,
    speed: float,
    clock: Callable[[], float],
    sleep: Callable[[float], None],
) -> None:
    """Play a mission at `speed` times its own pace; `clock` returns wall-clock seconds and `sleep` waits for some."""
    playback = Playback(events)
    if not moves(console):
        for line in summary_lines(playback):
            console.print(Text(line), soft_wrap=True)
        return
    picture = Picture(playback.mission, playback.cells_at(playback.end_ms) != UNKNOWN, console)
    begin = clock()
    with Live(console=console, auto_refresh=False) as live:
        while True:
            t_ms = playback.start_ms + round((clock() - begin) * 1000 * speed)
            live.update(_frame(playback, picture, min(t_ms, playback.end_ms)), refresh=True)
            if t_ms >= playback.end_ms:
                return
            sleep(FRAME_S)


def summary_lines(playback: Playback) -> list[str]:
    news = [(plan.t_ms, plan_line(plan)) for plan in playback.plans]
    news.append((playback.end_ms, _end_text(playback.ended)))
    wide = max(len(clock(t_ms / 1000)) for t_ms, _ in news)
    return [f"{clock(t_ms / 1000):>{wide}}  {_known(playback, t_ms)}  {text}" for t_ms, text in news]


def _frame(playback: Playback, picture: Picture, t_ms: int) -> Group:
    robots, plan = playback.robots_at(t_ms), playback.plan_at(t_ms)
    over = t_ms >= playback.end_ms
    news = _end_text(playback.ended) if over else plan_text(plan) if plan else "no plan yet"
    line = Text(no_wrap=True, overflow="ellipsis")
    line.append(clock(t_ms / 1000), style="bold")
    line.append(f"  {_known(playback, t_ms)}  {news}")
    return Group(picture.map(playback.cells_at(t_ms), robots), line, picture.team(robots))


def _known(playback: Playback, t_ms: int) -> str:
    return f"{playback.coverage_at(t_ms).open_m2:.1f} m2 known"


def _end_text(ended: MissionEnded | None) -> str:
    if ended is None:
        return "the log ends here, without a stop report"
    left = f", {counted(len(ended.remaining), 'frontier')} left" if ended.remaining else ""
    return printable(f"{ended.status}: {ended.reason}; coverage {100 * ended.coverage:.1f} %{left}")
