"""Folders that Python takes for installed packages, with entry points."""

from collections.abc import Mapping
from pathlib import Path

CODE = '''
from marsupial import Decision, EngineInfo, Finished, Improved, Outcome, StrategyInfo
from marsupial.planning.list_scheduling.greedy import Greedy, serve


class Plain:
    """A strategy that asks no planner."""

    name = "plain"
    info = StrategyInfo(
        name="plain", summary="lists what can be done", parameters={"patience": 3.0}, source="Nobody 2020"
    )

    def decide(self, briefing):
        return Decision(plan=serve(briefing.situation, briefing.previous)[0])


class Asking:
    """A strategy that asks one."""

    asks_planner = True
    name = "asking"

    def __init__(self, engine, budget):
        self.engine, self.budget = engine, budget

    def decide(self, briefing):
        events = list(self.engine.solve(briefing.situation, self.budget))
        plans = [event.plan for event in events if isinstance(event, Improved)]
        return Decision(plan=plans[-1] if plans else serve(briefing.situation)[0])


class Copy(Greedy):
    """An engine."""

    info = EngineInfo(name="copy", summary="list scheduling once more", licence="MIT", deterministic_steps=True)


class Half:
    """Neither."""

    info = "none"


def fails():
    raise RuntimeError("out of order")
'''


def install(folder: Path, name: str, groups: Mapping[str, Mapping[str, str]], code: str = CODE) -> Path:
    """Lay a package called `name` with these entry points into `folder`, which then has to be on `sys.path`."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [
        line for group, names in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in names.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    (folder / f"{name}.py").write_text(code)
    return folder
