"""A small scenario with batteries that bind, and charging places."""

import random
from pathlib import Path
from tempfile import TemporaryDirectory

from support.missions.faulty_mission import FAULTS, YARD

from marsupial.formats.scenario.read import read_scenario
from marsupial.model import Scenario


def battery_text(seed: int | None = None, faults: str = "") -> str:
    """Return the text of a scenario file; `seed` draws its batteries, and None takes large ones."""
    draw = random.Random(seed)

    def of_type(idle_w: int, drive_w: int, metre_j: float, sizes_j: tuple[int, ...], powers_w: tuple[int, ...]) -> str:
        metre_j, size_j, power_w = draw.choice([0, metre_j]), draw.choice(sizes_j), draw.choice(powers_w)
        if seed is None:
            metre_j, size_j, power_w = 0, sizes_j[-1], powers_w[0]
        energy = f"energy: {{idle_w: {idle_w}, drive_w: {drive_w}, metre_j: {metre_j}}}"
        return f"{energy}, battery: {{capacity_j: {size_j}, charge_w: {power_w}}}"

    carrier = of_type(20, 60, 7.3, (4000, 8000, 20000), (100, 400))
    rover = of_type(4, 8, 1.1, (200, 400, 900), (10, 30))
    text = YARD.replace("capacity: 2}", f"capacity: 2, {carrier}}}").replace("undock_s: 5}", f"undock_s: 5, {rover}}}")
    return f"{text}chargers:\n  - {{at_m: [2.25, 2.25]}}\n  - {{at_m: [12.25, 1.25]}}\n{faults}"


def battery_yard(seed: int | None = None, *, faults: bool = False) -> Scenario:
    """Return the scenario, with faults of all kinds if wanted."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "yard.yaml"
        path.write_text(battery_text(seed, FAULTS if faults else ""))
        return read_scenario(path)
