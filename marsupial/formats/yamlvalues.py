"""Read YAML (and so JSON) from outside as plain values: with limits, and one exception for whatever a parser raises.

PyYAML raises much more than its own `YAMLError`: for odd scalars, the exceptions of `int`, `chr` and `datetime` come
through. `parse_yaml` turns all of them into a `YamlFault`, with the line if it is known.

A few lines of YAML can stand for gigabytes, by nesting or by aliases of aliases. So `parse_yaml` walks the parser's
events first, which takes no memory, and refuses what is nested or repeated beyond a limit.

Plain values have no line numbers. Only if there are problems, `with_lines` parses the text a second time, into nodes
that have them.
"""

import re
from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import yaml

from marsupial.errors import Problem

try:
    from yaml import CSafeLoader as SafeLoader
except ImportError:  # PyYAML without libyaml
    from yaml import SafeLoader  # type: ignore[assignment]

MOST_LEVELS = 20  # most levels of nested lists and mappings; no file of ours needs more

TOO_DEEP = f"lists and mappings are nested more than {MOST_LEVELS} levels deep"

MOST_ALIASED = 100_000  # most values that all aliases together repeat


class YamlFault(Exception):
    """The reason why a text can't be read as YAML, in one line."""


class PlainLoader(SafeLoader):
    """Safe YAML without a field that is given twice.

    Its values can be written again: no half of a surrogate pair, no number of thousands of digits.
    """

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
            if isinstance(value, str):
                value.encode()
            elif isinstance(value, int):
                str(value)
        except yaml.YAMLError:
            raise
        except Exception as error:  # int, float, datetime and PyYAML's own tables, for odd scalars
            reason = str(error).partition(";")[0] or type(error).__name__
            raise yaml.constructor.ConstructorError(None, None, f"can't be read ({reason})", node.start_mark) from error
        return value

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"field {key.value!r} is given twice", key.start_mark
                )
            seen.add(str(key.value))
        return super().construct_mapping(node, deep)


class StrictLoader(PlainLoader):
    """Also reads JSON's numbers (``1e3``)."""


StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+\Z"), list("-+0123456789")
)


def parse_yaml(text: str | bytes, loader: type[PlainLoader] = StrictLoader, *, aliases: bool = True) -> Any:
    """Return the value of a YAML text, with or without aliases and tags; raise a `YamlFault` if that fails."""
    return _guarded(text, loader, aliases, "get_single_data")


def compose_yaml(text: str | bytes) -> yaml.Node | None:
    """Return the tree of nodes of a YAML text; see `parse_yaml`."""
    return _guarded(text, PlainLoader, True, "get_single_node")


def _guarded(text: str | bytes, loader: type[PlainLoader], aliases: bool, take: str) -> Any:
    try:
        _check_events(text, aliases)
        reader = loader(text)
        try:
            return getattr(reader, take)()
        finally:
            reader.dispose()
    except YamlFault:
        raise
    except Exception as error:
        raise YamlFault(_fault(error, text)) from error


def _check_events(text: str | bytes, aliases: bool) -> None:
    """Raise a `YamlFault` if values are nested too deep (libyaml builds trees by recursion) or repeated too often."""
    sizes: dict[str, int] = {}  # number of values below each anchor, with those that its aliases repeat
    opened: list[tuple[str | None, int]] = []  # anchor of each open collection, and `count` at its start
    count = aliased = 0
    for event in yaml.parse(text, SafeLoader):
        if not aliases and (isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None) is not None):
            raise YamlFault("aliases and tags are not allowed")
        if isinstance(event, yaml.ScalarEvent):
            count += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                assert event.start_mark is not None
                raise YamlFault(f"line {event.start_mark.line + 1}: alias *{event.anchor} names nothing before it")
            aliased += sizes[event.anchor]
            count += sizes[event.anchor]
        elif isinstance(event, yaml.CollectionStartEvent):
            opened.append((event.anchor, count))
            count += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = opened.pop()
            if anchor is not None:
                sizes[anchor] = count - before
        if len(opened) > MOST_LEVELS:
            raise YamlFault(TOO_DEEP)
        if aliased > MOST_ALIASED:
            raise YamlFault(f"aliases repeat more than {MOST_ALIASED} values")


def _fault(error: Exception, text: str | bytes) -> str:
    """Return in one line why reading `text` failed with `error`, and where if that is known."""
    if isinstance(error, yaml.reader.ReaderError):
        newline = "\n" if isinstance(text, str) else b"\n"
        line = text[: error.position].count(newline) + 1  # type: ignore[arg-type]
        return f"line {line}: {str(error).splitlines()[0]}; is it an image, or another binary file?"
    if not isinstance(error, yaml.MarkedYAMLError) or error.problem is None:
        return (str(error).splitlines() or [type(error).__name__])[0]
    if "nesting depth" in error.problem:  # PyYAML looks ahead, and may reach its own limit before ours
        return TOO_DEEP
    mark = error.problem_mark
    if mark is None:
        return error.problem
    rest = text.splitlines()[mark.line : mark.line + 1]
    tab = bool(rest) and rest[0][mark.column : mark.column + 1] in ("\t", b"\t")
    words = "a tab can't stand here: YAML is indented by spaces" if tab else error.problem
    return f"line {mark.line + 1}, column {mark.column + 1}: {words}"


def with_lines(problems: Iterable[Problem], text: str | bytes) -> list[Problem]:
    """Return the problems with the line of their field, or of the part that it is missing from, in a text of YAML."""
    # A text of a single line, as JSON may be, gets no line numbers.
    problems = list(problems)
    root = PlainLoader(text).get_single_node() if problems else None
    if root is None or root.start_mark.line == root.end_mark.line:
        return problems
    parts = cache(_parts)  # there may be thousands of problems
    return [replace(problem, line=_line(root, problem.path, parts)) for problem in problems]


_NodeParts = dict[str, tuple[yaml.Node, yaml.Node]]


def _parts(node: yaml.Node) -> _NodeParts:
    """Return the parts of a node by key or index (``[1]``): the node of the name and that of the value."""
    if isinstance(node, yaml.MappingNode):
        return {key.value: (key, value) for key, value in node.value if isinstance(key, yaml.ScalarNode)}
    return {f"[{i}]": (item, item) for i, item in enumerate(node.value)} if isinstance(node, yaml.SequenceNode) else {}


def _line(node: yaml.Node, path: str, parts: Callable[[yaml.Node], _NodeParts]) -> int | None:
    """Return the line of the last existing part of a path (``robot_types[1].speed_mps``); None if none exists."""
    line = None
    while path:
        # Keys may hold dots and brackets themselves: take the longest key that the path begins with.
        ends = (end for end in range(len(path), 0, -1) if path[end : end + 1] in ("", ".", "["))
        end = next((end for end in ends if path[:end] in parts(node)), None)
        if end is None:
            break
        named, node = parts(node)[path[:end]]
        line, path = named.start_mark.line + 1, path[end:].removeprefix(".")
    return line
