"""The head of a comparison's folder, ``comparison.json``: the definition of the comparison.

It has everything that the rows depend on. A folder is continued only by the same comparison, or by one that includes
all its missions.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from marsupial.bench.compare.plan import Case, Comparison, Contender, digest
from marsupial.cluster.make import LIBRARIES
from marsupial.errors import InputError, Problem, UsageError
from marsupial.formats.jsonvalues import JsonFault, parse_json

FORMAT, VERSION = "marsupial-comparison", 1


def header_of(comparison: Comparison) -> dict[str, Any]:
    """Return the head as JSON values; `made_with` is information only, and may differ if a folder is continued."""
    budget = comparison.budget
    return {
        "format": FORMAT,
        "version": VERSION,
        "marsupial": version("marsupial"),
        "paper": comparison.paper,
        **({"suite": comparison.suite, "first_seed": comparison.first_seed} if comparison.suite else {}),
        "contenders": [[contender.strategy, contender.planner] for contender in comparison.contenders],
        "cases": [
            {
                "scenario": case.scenario,
                "carriers": case.carriers,
                "rovers": case.rovers,
                **({"interference": True} if scenario.interference else {}),
                "digest": digest(scenario),
            }
            for case, scenario in comparison.scenarios.items()
        ],
        "runs": comparison.runs,
        "budget": {"steps": budget.steps} if budget.seconds is None else {"seconds": budget.seconds},
        "made_with": {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}},
    }


def written(header: Mapping[str, Any]) -> str:
    """Return the head as the text of its file."""
    return json.dumps(header, indent=1) + "\n"


def parse(text: str, source: str) -> dict[str, Any]:
    """Parse the text of a head; raise an `InputError` if it is not one."""
    try:
        header = parse_json(text)
    except JsonFault as error:
        raise InputError("is not the head of a comparison: no JSON", source=source) from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise InputError("is not the head of a comparison", source=source)
    if header.get("version") != VERSION:
        raise InputError(f"is of version {header.get('version')}, this marsupial knows {VERSION}", source=source)
    try:
        cases_of(header), contenders_of(header), int(header["runs"]), dict(header["budget"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("is damaged", source=source) from error
    return header


def cases_of(header: Mapping[str, Any]) -> tuple[Case, ...]:
    """Return the cases of a comparison in their order."""
    return tuple(Case(str(c["scenario"]), int(c["carriers"]), int(c["rovers"])) for c in header["cases"])


def contenders_of(header: Mapping[str, Any]) -> tuple[Contender, ...]:
    """Return the contenders of a comparison in their order."""
    return tuple(Contender(str(strategy), str(planner)) for strategy, planner in header["contenders"])


def budget_text(header: Mapping[str, Any]) -> str:
    """Return the budget of each planning in words."""
    ((unit, amount),) = header["budget"].items()
    return f"{amount:g} {unit if amount != 1 else unit.removesuffix('s')}"


def demand_part(there: Mapping[str, Any], asked: Mapping[str, Any], source: str) -> None:
    """Raise a `UsageError` with the differences if a folder's comparison is not part of the requested one.

    The request may have more cases, contenders and runs, and another base or paper, since no mission depends on these.
    """
    grown = {
        "cases": all(case in asked["cases"] for case in there["cases"]),
        "contenders": all(contender in asked["contenders"] for contender in there["contenders"]),
        "runs": there["runs"] <= asked["runs"],
    }
    same = (name for name in ("marsupial", "suite", "first_seed", "budget") if there.get(name) != asked.get(name))
    if names := [*same, *(name for name, fits in grown.items() if not fits)]:
        problems = [Problem(name, _difference(name, there.get(name), asked.get(name))) for name in names]
        lines = [f"{source}: {problem}" for problem in problems]
        raise UsageError("\n".join([*lines, f"{source}: it holds another comparison: choose another --out"]))


def _difference(name: str, there: Any, asked: Any) -> str:
    if name == "cases":
        before, now = (
            {f"{case['scenario']} {case['carriers']}x{case['rovers']}": case["digest"] for case in cases}
            for cases in (there, asked)
        )
        if changed := [name for name in now if name in before and before[name] != now[name]]:
            return f"another map, team or goal under the same name: {', '.join(changed)}"
        there, asked = ", ".join(before), ", ".join(now)
    if name == "contenders":
        there, asked = ([str(Contender(*pair)) for pair in pairs] for pairs in (there, asked))
    return f"the folder has {there}, asked for is {asked}"
