"""The layout of panels in Foxglove and Lichtblick for the recording of a mission: map, coverage, doings, messages.

Both read the same JSON: the settings of each panel by id, and how panels share the window. What they don't know they
ignore.
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from marsupial.mission.playback import Playback
from marsupial.model import UNKNOWN, Grid
from marsupial.model.mission import MissionEvent

UNSEEN = np.full((1, 1), UNKNOWN, dtype=np.uint8)

MAP, COVERAGE, CHARGES, DOINGS, MESSAGES = "3D!map", "Plot!area", "Plot!charge", "StateTransitions!doing", "RosOut!log"
"""Ids of panels: the names of their kinds, and what they show."""


def recording_layout(events: Sequence[MissionEvent]) -> str:
    """Return the layout for the recording of a mission as JSON."""
    playback = Playback(events)
    mission, robots = playback.mission, list(playback.timeline)
    blank = Grid(cells=UNSEEN, resolution_m=mission.resolution_m, origin_m=mission.origin_m)
    wide_m, high_m = mission.width * mission.resolution_m, mission.height * mission.resolution_m
    panels: dict[str, dict[str, Any]] = {
        MAP: {
            "followMode": "follow-none",
            "followTf": "map",
            # from above; a camera without perspective shows `distance` metres from top to bottom
            "cameraState": {
                "perspective": False,
                "phi": 0,
                "thetaOffset": 0,
                "distance": 1.1 * max(wide_m / 2, high_m),
                "target": [*blank.point_m(mission.width / 2, mission.height / 2), 0],
                "targetOffset": [0, 0, 0],
                "targetOrientation": [0, 0, 0, 1],
                "near": 0.5,
                "far": 5000,
                "fovy": 45,
            },
            "scene": {"transforms": {"visible": False}},
            "topics": {
                "/map": {"visible": True, "colorMode": "rgba-fields"},
                **{topic: {"visible": True} for topic in ("/robots", "/trails", "/plan")},
            },
        },
        COVERAGE: _plot("Known area, m2", ["/progress.known_m2", "/progress.seen_m2"]),
        DOINGS: {
            "isSynced": True,
            "paths": [
                {"value": f"/progress.doing.{json.dumps(name)}", "label": name, "timestampMethod": "receiveTime"}
                for name in robots
            ],
        },
        MESSAGES: {"topicToRender": "/log", "minLogLevel": 1},
    }
    plots: Any = COVERAGE
    if charged := [name for name, _ in next((plan.charges for plan in playback.plans if plan.charges), ())]:
        panels[CHARGES] = _plot("Charge", [f"/charges.{json.dumps(name)}" for name in charged])
        plots = _split("row", COVERAGE, CHARGES, 50)
    below = _split("row", _split("column", plots, MESSAGES, 60), DOINGS, 50)
    layout = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 5},
        "layout": _split("column", MAP, below, 65),
    }
    return json.dumps(layout, indent=1) + "\n"


def _plot(title: str, paths: Sequence[str]) -> dict[str, Any]:
    lines = [{"value": path, "enabled": True, "timestampMethod": "receiveTime"} for path in paths]
    titles = {"foxglovePanelTitle": title, "lichtblickPanelTitle": title}
    return {**titles, "isSynced": True, "showLegend": True, "xAxisVal": "timestamp", "paths": lines}


def _split(direction: str, first: Any, second: Any, share: int) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": share}
