"""Progress: robots that report their own map do not explore the same for ever, and plans lead somewhere."""

from collections import Counter
from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell

MOST_EXPLORES = 15
"""How often a robot may explore one target without news: three looks, and three more each time that it changes."""

MOST_PLANS = 60
"""How many plans may follow each other without any news, and without an action that is done."""


class StormProgress:
    """Counts what happens without news."""

    def __init__(self) -> None:
        self._explores = Counter[tuple[str, Cell]]()
        self._plans = 0

    def __call__(self, account: Account, event: Document) -> Iterator[str]:
        """Check one event."""
        match event["event"]:
            case "reveal":
                if any(account.holds((x, y)) and not account.ever[y, x] for (x, y), _ in event["seen"]):
                    self._explores.clear()
                    self._plans = 0
            case "lost" | "returned" | "zone" | "contact" | "away" | "speed" | "frame" | "change":
                self._plans = 0
            case "plan":
                self._plans += 1
                if self._plans == MOST_PLANS:
                    yield f"{MOST_PLANS} plans follow each other without any news"
            case "end" if event["end"] == "done":
                self._plans = 0
                action = event["action"]
                target = account.targets.get(action["place"], {}).get("cell")
                if action["name"] != "explore" or target is None:
                    return
                self._explores[action["robot"], target] += 1
                if self._explores[action["robot"], target] == MOST_EXPLORES:
                    yield f"{action['robot']} explores {target} {MOST_EXPLORES} times without any news"
