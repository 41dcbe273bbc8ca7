"""Parameters of a rule, as they are written behind its name: ``bidding/W_n=1/W_p=0.5``."""

from __future__ import annotations

import math
from dataclasses import fields

from marsupial.errors import UsageError
from marsupial.strategies.frontier.rule import FrontierRule


def with_parameters(rule: type[FrontierRule], text: str) -> FrontierRule:
    """Return the rule with the values that a text like ``W_n=1/W_p=0.5`` gives; the others are the paper's.

    Raises
    ------
    UsageError
        If a value is no finite number, 0 or more, or the rule has no such parameter.
    """
    known = [each.name for each in fields(rule) if each.init]  # type: ignore[arg-type]
    values: dict[str, float] = {}
    for part in text.split("/"):
        name, _, number = part.partition("=")
        if name not in known or name in values:
            takes = f"the parameters {', '.join(known)}, once each" if known else "no parameters"
            raise UsageError(f"strategy {rule.name}: takes {takes}, got {part!r}")
        try:
            values[name] = float(number)
        except ValueError:
            values[name] = math.nan
        if not 0 <= values[name] < math.inf:
            raise UsageError(f"strategy {rule.name}: {name}: must be a number, 0 or more, got {number!r}")
    return rule(**values)
