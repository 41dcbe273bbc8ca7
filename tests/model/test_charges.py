"""Charges of batteries, from what robots do."""

from dataclasses import dataclass, field, replace

import pytest

from marsupial.model.charges import BatteryUse, TeamCharges
from marsupial.model.robots import Battery, EnergyModel, RobotType, default_types

STANDING = BatteryUse(driving_ms=0, distance_m=0.0)


def kind_of(kind: RobotType, idle_w: float, capacity_j: float) -> RobotType:
    energy = EnergyModel(idle_w=idle_w, drive_w=10.0, metre_j=2.0)
    return replace(kind, energy=energy, battery=Battery(capacity_j=capacity_j, charge_w=50.0))


@dataclass
class Team:
    """A carrier with a rover aboard, both with batteries of 1000 J that charge with 50 W."""

    uses: dict[str, BatteryUse] = field(default_factory=lambda: {"c": STANDING, "r": replace(STANDING, charging=True)})
    aboard: dict[str, str] = field(default_factory=lambda: {"r": "c"})

    def __post_init__(self) -> None:
        carrier, rover = default_types(capacity=1)
        kinds = {"c": kind_of(carrier, 20.0, 1000.0), "r": kind_of(rover, 4.0, 1000.0)}
        self.charges = TeamCharges(kinds, lambda name: self.uses[name], self.aboard.get)

    def begin(self, t_ms: int, robot: str, use: BatteryUse) -> None:
        self.charges.settle(t_ms, robot)
        self.uses[robot] = use
        if not use.charging:
            self.aboard.pop(robot, None)

    def joules(self, t_ms: int) -> tuple[float, float]:
        return tuple(1000 * self.charges.share(name, t_ms) for name in ("c", "r"))  # type: ignore[return-value]


def test_standing_and_driving_discharge() -> None:
    team = Team()
    team.begin(0, "r", replace(STANDING, driving_ms=3000, distance_m=1.5))
    assert team.joules(10_000) == pytest.approx((1000 - 10 * 20, 1000 - 10 * 4 - 3 * 10 - 1.5 * 2))


def test_a_rover_aboard_charges_from_its_carrier_until_it_is_full() -> None:
    team = Team()
    team.charges.correct(0, "r", 0.9)
    assert team.joules(1000) == pytest.approx((1000 - 20 - 50, 950))
    assert team.joules(10_000) == pytest.approx((1000 - 200 - 100, 1000))
    team.begin(10_000, "c", replace(STANDING, charging=True))
    assert team.joules(11_000) == pytest.approx((750, 1000))


def test_asking_changes_nothing_to_the_last_bit() -> None:
    asked, other = Team(), Team()
    for team in (asked, other):
        team.charges.correct(0, "r", 1 / 3)
    for t_ms in range(0, 7000, 7):
        asked.joules(t_ms)
        asked.charges.reported("c", t_ms)
    assert asked.joules(7000) == other.joules(7000)


def test_a_report_has_the_charge_at_the_next_stop() -> None:
    team = Team()
    team.begin(0, "r", replace(STANDING, free_at_ms=2000, step_ms=2000, step_m=1.0))
    assert 1000 * team.charges.reported("r", 500) == pytest.approx(1000 - 2 * 4 - 2 * 10 - 2)


def test_a_lost_robot_keeps_its_charge() -> None:
    team = Team()
    team.begin(1000, "c", replace(STANDING, lost=True))
    team.uses["r"] = replace(team.uses["r"], lost=True)
    assert team.joules(90_000) == pytest.approx((980, 1000))
    team.uses["c"] = STANDING
    team.charges.resume(90_000, "c")
    assert team.joules(91_000)[0] == pytest.approx(960)
