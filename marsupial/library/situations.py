"""Read situations from values or files, and write them as files that PDDL planners take."""

import json
from collections.abc import Mapping
from os import PathLike
from typing import Any

from marsupial.errors import SituationError
from marsupial.formats.files import about, read_text
from marsupial.formats.pddl.text import domain_of, domain_text, problem_text, read_problem
from marsupial.formats.situation import situation_from_json, situation_to_json
from marsupial.model.arguments import instance, text
from marsupial.model.arguments import path as path_argument
from marsupial.model.situation import Situation


def situation_of(source: Situation | Mapping[str, Any] | str | PathLike[str]) -> Situation:
    """Return a situation unchanged, from its JSON as a dict, or from a file (PDDL if its name ends in ``.pddl``)."""
    if isinstance(source, Situation):
        return source
    if isinstance(source, Mapping):
        try:
            return situation_from_json(json.dumps(dict(source)))
        except (TypeError, ValueError, RecursionError) as error:
            raise SituationError(f"can't be written as JSON ({error})") from error
    path = path_argument("situation", source)
    content = read_text(path, SituationError)
    with about(path):
        return read_problem(content) if path.suffix.lower() == ".pddl" else situation_from_json(content)


def situation_files(situation: Situation, name: str = "exploration") -> dict[str, str]:
    """Return the texts of the files that ``marsupial export`` writes of a situation; `name` is the PDDL problem's."""
    instance("situation", situation, Situation)
    return {
        "situation.json": situation_to_json(situation),
        "domain.pddl": domain_text(domain_of(situation)),
        "problem.pddl": problem_text(situation, name=text("name", name)),
    }
