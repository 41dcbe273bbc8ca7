import numpy as np
import numpy.typing as npt
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

from marsupial.model.mission import MissionStarted, PlacedRobot
from marsupial.model.robots import Role, default_types
from marsupial.model.scenario import Goal
from marsupial.replay.palette import DARK, LIGHT, Palette, robot_looks

Colours = npt.NDArray[np.float64]

# Machado, Oliveira and Fernandes 2009, severity 1.0: linear RGB as seen without one kind of cones.
SIGHT = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}

PALETTES = pytest.mark.parametrize("palette", [LIGHT, DARK], ids=["light", "dark"])


def linear(colours: list[str]) -> Colours:
    """Return linear RGB, (colours, 3), of ``#rrggbb``."""
    values = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in colours]) / 255
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4))


def seen(colours: list[str], sight: str) -> Colours:
    """Return the CIELAB values, (colours, 3), of colours as somebody sees them."""
    light = np.clip(linear(colours) @ SIGHT[sight].T, 0, 1)
    return np.asarray(rgb2lab(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)))


def nearest(colours: list[str], others: list[str] | None = None) -> float:
    """Return the least CIEDE2000 distance of two of `colours`, or of one to one of `others`, for any reader."""
    found = []
    for sight in SIGHT:
        distances = deltaE_ciede2000(seen(colours, sight)[:, None], seen(others or colours, sight)[None])
        if others is None:
            distances = distances[np.triu_indices(len(colours), 1)]
        found.append(float(distances.min()))
    return min(found)


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2."""
    low, high = sorted(linear([one, other]) @ [0.2126, 0.7152, 0.0722])
    return float((high + 0.05) / (low + 0.05))


def carriers(palette: Palette) -> list[str]:
    return [family[0] for family in palette.families]


@PALETTES
def test_carriers_are_told_apart_by_every_reader_the_first_four_easily(palette: Palette) -> None:
    assert nearest(carriers(palette)) >= 10
    assert nearest(carriers(palette)[:4]) >= 14


@PALETTES
def test_a_carrier_and_its_rovers_are_told_apart_by_every_reader(palette: Palette) -> None:
    for family in palette.families:
        assert nearest(list(family)) >= 10


@PALETTES
def test_robots_stand_out_from_the_floor(palette: Palette) -> None:
    for carrier, rover, *others in palette.families:
        assert min(contrast(carrier, palette.free), contrast(rover, palette.free)) >= 3
        assert min(contrast(other, palette.free) for other in others) >= 1.8


@PALETTES
def test_actions_are_told_apart_by_every_reader_and_are_not_the_colours_of_robots(palette: Palette) -> None:
    actions = list(palette.actions.values())
    assert nearest(actions) >= 7
    robots = [colour for family in palette.families for colour in family]
    plain = deltaE_ciede2000(seen(actions, "all cones")[:, None], seen(robots, "all cones")[None])
    assert plain.min() >= 7


@PALETTES
def test_ground_is_told_apart_by_every_reader_and_text_can_be_read_on_the_page(palette: Palette) -> None:
    assert nearest([palette.unknown, palette.wall], [palette.free, palette.other]) >= 7
    assert nearest([palette.frontier], [palette.unknown, palette.free, palette.wall, palette.other]) >= 12
    assert contrast(palette.ink, palette.page) >= 7
    assert contrast(palette.dim, palette.page) >= 4.5


def team(*aboard: tuple[str, str | None]) -> MissionStarted:
    carrier, rover = default_types(4)
    robots = [PlacedRobot(name=n, type="rover" if n[0] == "r" else "carrier", carrier=c) for n, c in aboard]
    return MissionStarted(
        t_ms=0, scenario="", strategy="", planner="", seed=1, width=1, height=1, resolution_m=1.0,
        origin_m=(0.0, 0.0, 0.0), terrains=(), types=(carrier, rover), robots=tuple(robots), goal=Goal(),
    )  # fmt: skip


def test_rovers_have_shades_of_the_carrier_they_start_on_and_another_shape() -> None:
    looks = robot_looks(team(("c1", None), ("r1", "c1"), ("r2", "c1"), ("c2", None), ("r3", "c2"), ("r4", None)))
    assert [(look.hue, look.shade) for look in looks.values()] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0)]
    assert [name for name, look in looks.items() if look.role is Role.ROVER] == ["r1", "r2", "r3", "r4"]
    assert LIGHT.robot(looks["r3"]) == LIGHT.families[1][1]


def test_more_carriers_than_hues_are_told_apart_by_dashes_and_more_rovers_than_shades_by_names() -> None:
    looks = robot_looks(team(*((f"c{i}", None) for i in range(9)), *((f"r{i}", "c0") for i in range(4))))
    assert (looks["c8"].hue, looks["c8"].dashed) == (0, True)
    assert not any(look.dashed for name, look in looks.items() if name != "c8")
    assert [looks[f"r{i}"].shade for i in range(4)] == [1, 2, 3, 1]
