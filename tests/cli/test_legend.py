from marsupial.cli.display.map_picture import legend_rows
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, LegendEntry

NAMES = {OBSTACLE: "obstacle", FLOOR: "floor", UNKNOWN: "unknown"}


def greys(*cells: tuple[int, int, int]) -> list[LegendEntry]:
    return [LegendEntry(symbol=f"grey {grey}", code=code, cells=count) for grey, code, count in cells]


def test_many_greys_that_mean_the_same_are_a_range_with_the_commonest_of_them() -> None:
    shades = [(g, OBSTACLE, 10) for g in range(1, 90)]
    legend = greys((0, OBSTACLE, 8000), *shades, (205, UNKNOWN, 70), (240, FLOOR, 1), (254, FLOOR, 5))
    legend.append(LegendEntry(symbol="transparent", code=UNKNOWN, cells=3))
    assert legend_rows(legend, NAMES) == [
        ("grey 0 to 89", "obstacle", "8890", "grey 0 (90.0%)"),
        ("grey 205", "unknown", "70", ""),
        ("grey 240", "floor", "1", ""),
        ("grey 254", "floor", "5", ""),
        ("transparent", "unknown", "3", ""),
    ]


def test_a_range_without_a_common_grey_shows_its_extent() -> None:
    legend = greys(*[(g, FLOOR, 2) for g in range(200, 256)])
    assert legend_rows(legend, NAMES) == [("grey 200 to 255", "floor", "112", "spread over 56")]


def test_greys_parted_by_another_meaning_are_two_ranges() -> None:
    codes = [OBSTACLE] * 4 + [UNKNOWN] + [OBSTACLE] * 4
    rows = legend_rows(greys(*[(g, code, 1) for g, code in enumerate(codes)]), NAMES)
    assert [row[0] for row in rows] == ["grey 0 to 3", "grey 4", "grey 5 to 8"]


def test_characters_are_listed_one_by_one() -> None:
    legend = [LegendEntry(symbol=f"'{sign}'", code=OBSTACLE, cells=1) for sign in "@OTWX"]
    assert [row[0] for row in legend_rows(legend, NAMES)] == ["'@'", "'O'", "'T'", "'W'", "'X'"]
