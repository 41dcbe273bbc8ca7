"""Find the line of a YAML file for each problem.

Files are parsed into plain values, which have no line numbers. Only if there are problems, the text is parsed a second
time, into nodes that have them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import yaml

from marsupial.errors import Problem
from marsupial.formats.yamlvalues import compose_yaml

_INDEX = re.compile(r"\[(\d+)\]")


def with_lines(problems: Iterable[Problem], text: str | bytes) -> list[Problem]:
    """Return the problems with the line of their field, or of the part that it is missing from."""
    # A text of a single line, as JSON may be, gets no line numbers.
    problems = list(problems)
    root = compose_yaml(text) if problems else None
    if root is None or root.start_mark.line == root.end_mark.line:
        return problems
    return [replace(problem, line=_line(root, problem.path)) for problem in problems]


def _line(node: yaml.Node, path: str) -> int | None:
    """Return the line of the last existing part of a path (``robot_types[1].speed_mps``); None if none exists."""
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
    """Return the node of the key that a path begins with, the node of its value, and the rest of the path."""
    path = path.removeprefix(".")
    # Keys may hold dots and brackets themselves: take the longest key that the path begins with.
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
