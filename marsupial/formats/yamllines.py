"""The lines of a YAML file at which problems stand.

Files are parsed into plain values, which know no lines. Only where something is wrong the text is looked at once more,
as a tree of nodes with their places.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import yaml

from marsupial.errors import Problem

try:
    from yaml import CSafeLoader as SafeLoader
except ImportError:  # PyYAML without libyaml
    from yaml import SafeLoader  # type: ignore[assignment]

_INDEX = re.compile(r"\[(\d+)\]")


def with_lines(problems: Iterable[Problem], text: str | bytes) -> list[Problem]:
    """Return the problems with the line of their field, or of what it is missing from.

    Parameters
    ----------
    text
        Valid YAML. What is written on a single line, as JSON may be, gets no line numbers.
    """
    problems = list(problems)
    root = yaml.compose(text, SafeLoader) if problems else None
    if root is None or root.start_mark.line == root.end_mark.line:
        return problems
    return [replace(problem, line=_line(root, problem.path)) for problem in problems]


def yaml_fault(error: Exception, text: str | bytes) -> str:
    """Say in a line why reading `text` as YAML failed with `error`, and where in it if that is known."""
    if not isinstance(error, yaml.MarkedYAMLError) or error.problem is None:
        return str(error).splitlines()[0]
    mark = error.problem_mark
    if mark is None:
        return error.problem
    rest = text.splitlines()[mark.line : mark.line + 1]
    tab = bool(rest) and rest[0][mark.column : mark.column + 1] in ("\t", b"\t")
    words = "a tab can't stand here: YAML is indented by spaces" if tab else error.problem
    return f"line {mark.line + 1}, column {mark.column + 1}: {words}"


def _line(node: yaml.Node, path: str) -> int | None:
    """Return the line of the last part of a path (``robot_types[1].speed_mps``) that is there; None where none is."""
    line = None
    rest = path
    while rest:
        found = _key(node, rest) if isinstance(node, yaml.MappingNode) else _item(node, rest)
        if found is None:
            break
        named, node, rest = found
        line = named.start_mark.line + 1
    return line


def _key(node: yaml.MappingNode, path: str) -> tuple[yaml.Node, yaml.Node, str] | None:
    """Return the node of the key a path begins with, that of its value, and the path below it."""
    path = path.removeprefix(".")
    fitting = [
        (key, value, path[len(key.value) :])
        for key, value in node.value
        if isinstance(key, yaml.ScalarNode) and key.value and path.startswith(key.value)
    ]
    ending = [found for found in fitting if not found[2] or found[2][0] in ".["]
    return min(ending, key=lambda found: len(found[2]), default=None)


def _item(node: yaml.Node, path: str) -> tuple[yaml.Node, yaml.Node, str] | None:
    match = _INDEX.match(path)
    if match is None or not isinstance(node, yaml.SequenceNode) or int(match[1]) >= len(node.value):
        return None
    item = node.value[int(match[1])]
    return item, item, path[match.end() :]
