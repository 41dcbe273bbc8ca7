"""A scenario of two types of carriers and of rovers, each of which fits only on some."""

from pathlib import Path

import yaml

ROWS = (
    "####################",
    "#......#~~~~~#mmmmm#",
    "#......#~~~~~#mmmmm#",
    "#......~~~~~~#mmmmm#",
    "#......#######mmmmm#",
    "#............#mmmmm#",
    "#.............mmmmm#",
    "####################",
)
KIND = {"sensor_range_m": 1.2, "radius_m": 0.1}
CARRIER = KIND | {"role": "carrier", "speed_mps": 1.0, "terrains": ["floor"]}
ROVER = KIND | {"role": "rover", "speed_mps": 0.5, "dock_s": 5, "undock_s": 3}


def stored(folder: Path, team: list[dict[str, object]], **fields: object) -> Path:
    """Store a scenario: trucks carry wheeled rovers only, barges one wheeled and one tracked rover."""
    scenario = {
        "format": "marsupial-scenario",
        "version": 1,
        "map": {"resolution_m": 0.5, "rows": list(ROWS), "legend": {"m": "mud"}},
        "terrains": [{"name": "mud", "blocks_sight": False}],
        "robot_types": [
            CARRIER | {"name": "truck", "seats": {"wheeled": 2}},
            CARRIER | {"name": "barge", "capacity": 2, "seats": {"tracked": 1, "wheeled": 1}},
            ROVER | {"name": "wheeled", "terrains": ["rough"]},
            ROVER | {"name": "tracked", "terrains": ["mud"]},
        ],
        "team": team,
        "goal": {"recover_rovers": True},
        "limits": {"time_s": 600},
        **fields,
    }
    file = folder / "team.yaml"
    file.write_text(yaml.safe_dump(scenario))
    return file


TRUCK = {"name": "truck1", "type": "truck", "start": [1.25, 1.25]}
BARGE = {"name": "barge1", "type": "barge", "start": [1.75, 2.25]}
WHEELED = {"name": "w1", "type": "wheeled", "carrier": "truck1"}
TRACKED = {"name": "k1", "type": "tracked", "carrier": "barge1"}
FITTING = {("w1", "truck1"), ("w1", "barge1"), ("w2", "truck1"), ("w2", "barge1"), ("k1", "barge1")}
