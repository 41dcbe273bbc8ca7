"""The families of readers to fuzz: how each gets its bytes, what it may raise, examples, words of its format.

A reader may return, or raise an exception that it documents (`refuses`); anything else is a finding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from benchmarks.fuzz import examples, files, messages
from marsupial.bench.suite.best import known_best, write_best
from marsupial.errors import MarsupialError
from marsupial_client.errors import ClientError


@dataclass(frozen=True, slots=True)
class FuzzTarget:
    """A family of readers."""

    read: Callable[[bytes], object]
    seeds: Callable[[], Sequence[bytes]]
    words: str = ""
    refuses: tuple[type[Exception], ...] = (MarsupialError,)


def _texts(read: Callable[[str], object], seeds: Callable[[], Sequence[bytes]], words: str = "") -> FuzzTarget:
    return FuzzTarget(partial(files.read_text_of, read), seeds, words)


def _lines(*texts: str) -> Callable[[], list[bytes]]:
    return lambda: [text.encode() for text in texts]


def _body(path: str) -> FuzzTarget:
    return FuzzTarget(partial(messages.body, path=path), partial(messages.bodies, path), _FIELDS)


_FIELDS = "name map rows legend image nav2 robot_types carrier rover terrains floor team start cell pose_m goal budget"
_PDDL = "(define (problem (domain (:objects (:init (:goal (:metric (= (at (and (not - move explore dock undock ; : [ ]"
_ROS = "op publish topic msg info width height data action_result fragment status inf"

TARGETS: Mapping[str, FuzzTarget] = {
    "scenario": FuzzTarget(files.scenario, examples.scenarios, f"{_FIELDS} generator file mask keepout speed drawn"),
    "nav2": FuzzTarget(
        files.nav2,
        examples.headers,
        "image mode trinary scale raw resolution origin negate occupied_thresh free_thresh yes",
    ),
    "image": FuzzTarget(files.image, examples.images, "P1 P2 P4 P5 IHDR IDAT tRNS PLTE acTL"),
    "movingai": FuzzTarget(
        partial(files.map_file, name="grid.map"),
        _lines("type octile\nheight 2\nwidth 3\nmap\n.G@\nSTW\n"),
        "type octile height width map",
    ),
    "movingai-problems": FuzzTarget(
        files.movingai_problems, _lines("version 1\n0\tgrid.map\t3\t2\t0\t0\t1\t1\t1.41\n"), "version"
    ),
    "mcap": FuzzTarget(partial(files.map_file, name="run.mcap"), partial(examples.recordings, ".mcap")),
    "db3": FuzzTarget(partial(files.map_file, name="run.db3"), partial(examples.recordings, ".db3")),
    "situation": _texts(files.situation, examples.situations),
    "pddl-domain": _texts(files.domain, examples.of("pddl/domain.pddl"), _PDDL),
    "pddl-problem": _texts(files.problem, examples.of("pddl/examples/*/problem.pddl"), _PDDL),
    "plan": _texts(files.plan, examples.of("pddl/examples/deploy/*.plan"), _PDDL),
    "planner-output": FuzzTarget(
        files.planner_output, examples.of("pddl/examples/deploy/*.plan"), f"unsolvable {_PDDL}"
    ),
    "log": FuzzTarget(files.log, examples.logs, "mission reveal drive stand plan start end lost ended change frame"),
    "comparison": FuzzTarget(files.comparison, examples.comparisons, "complete error crashed 1e5"),
    "best-plans": _texts(files.best, lambda: [write_best(dict(list(known_best().items())[:2])).encode()]),
    "command-line": _texts(
        files.command_line,
        _lines("1-3,6", "temporal:greedy,bidding/W_n=1/W_p=0.5", "cmd:optic '{domain}' {problem}", "gone: t1; new: t2"),
        "temporal bidding sheng covering W_n W_p = / : , - {domain} {plan} greedy auto",
    ),
    "operator": _texts(
        messages.operator_words,
        _lines("cells=1000", "wait = 5", "http://host:80/a", "body_s=1e3"),
        "cells wait http://",
    ),
    "job": _body("/v1/jobs"),
    "analysis": _body("/v1/analysis"),
    "validation": _body("/v1/validations"),
    "mission": _body("/v1/missions"),
    "simulation": _body("/v1/simulations"),
    "report": _body("/v1/missions/{mission}/reports"),
    "events": FuzzTarget(messages.stream, messages.events, "id event data retry : end log state", (ClientError,)),
    "answers": FuzzTarget(messages.refusal, messages.answers, "status detail errors", (ClientError,)),
    "ros-settings": FuzzTarget(
        messages.settings, messages.ros_settings, f"{_FIELDS} namespace tf waits controller drive"
    ),
    "ros-journal": FuzzTarget(messages.journal, messages.journals),
    "ros-json": FuzzTarget(partial(messages.rosbridge, packed=False), partial(messages.messages, packed=False), _ROS),
    "ros-cbor": FuzzTarget(partial(messages.rosbridge, packed=True), partial(messages.messages, packed=True), _ROS),
}
