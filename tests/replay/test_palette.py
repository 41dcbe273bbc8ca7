import pytest
from skimage.color import deltaE_ciede2000
from support.missions.small_teams import begun_on, drawn_grid
from support.pictures.colour_vision import contrast, nearest, seen

from marsupial.model import MissionStarted, PlacedRobot
from marsupial.model.robots import Role, default_types
from marsupial.replay.palette import DARK, LIGHT, REACH, Palette, robot_styles

PALETTES = pytest.mark.parametrize("palette", [LIGHT, DARK], ids=["light", "dark"])


def carriers(palette: Palette) -> list[str]:
    return [family[0] for family in palette.families]


@PALETTES
def test_every_reader_can_distinguish_carriers_the_first_four_easily(palette: Palette) -> None:
    assert nearest(carriers(palette)) >= 10
    assert nearest(carriers(palette)[:4]) >= 14


@PALETTES
def test_every_reader_can_distinguish_a_carrier_from_its_rovers(palette: Palette) -> None:
    for family in palette.families:
        assert nearest(list(family)) >= 10


@PALETTES
def test_robots_stand_out_from_the_floor(palette: Palette) -> None:
    for carrier, rover, *others in palette.families:
        assert min(contrast(carrier, palette.free), contrast(rover, palette.free)) >= 3
        assert min(contrast(other, palette.free) for other in others) >= 1.8


@PALETTES
def test_every_reader_can_distinguish_actions_from_each_other_and_from_robots(palette: Palette) -> None:
    actions = list(palette.actions.values())
    assert nearest(actions) >= 7
    robots = [colour for family in palette.families for colour in family]
    plain = deltaE_ciede2000(seen(actions, "all cones")[:, None], seen(robots, "all cones")[None])
    assert plain.min() >= 7


@PALETTES
def test_every_reader_can_distinguish_kinds_of_ground_and_read_the_text(palette: Palette) -> None:
    assert nearest([palette.unknown, palette.wall], [palette.free, palette.other]) >= 7
    assert nearest([palette.frontier], [palette.unknown, palette.free, palette.wall, palette.other]) >= 12
    assert contrast(palette.ink, palette.page) >= 7
    assert contrast(palette.dim, palette.page) >= 4.5


def test_every_reader_can_distinguish_classes_of_reach() -> None:
    assert nearest([*REACH.values(), LIGHT.wall]) >= 10
    assert nearest([LIGHT.unknown], [*REACH.values(), LIGHT.wall]) >= 8


def team(*aboard: tuple[str, str | None]) -> MissionStarted:
    carrier, rover = default_types(4)
    robots = [PlacedRobot(name=n, type="rover" if n[0] == "r" else "carrier", carrier=c) for n, c in aboard]
    return begun_on(drawn_grid("."), (carrier, rover), robots)


def test_rovers_have_shades_of_the_carrier_they_start_on_and_another_shape() -> None:
    styles = robot_styles(team(("c1", None), ("r1", "c1"), ("r2", "c1"), ("c2", None), ("r3", "c2"), ("r4", None)))
    assert [(style.hue, style.shade) for style in styles.values()] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0)]
    assert [name for name, style in styles.items() if style.role is Role.ROVER] == ["r1", "r2", "r3", "r4"]
    assert LIGHT.robot(styles["r3"]) == LIGHT.families[1][1]


def test_carriers_beyond_the_hues_differ_by_dashes_and_rovers_beyond_the_shades_by_names() -> None:
    styles = robot_styles(team(*((f"c{i}", None) for i in range(9)), *((f"r{i}", "c0") for i in range(4))))
    assert (styles["c8"].hue, styles["c8"].dashed) == (0, True)
    assert not any(style.dashed for name, style in styles.items() if name != "c8")
    assert [styles[f"r{i}"].shade for i in range(4)] == [1, 2, 3, 1]
