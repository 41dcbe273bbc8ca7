import numpy as np
import pytest
from scipy import stats

from marsupial.bench.compare.statistics import Estimate, Origin, estimate

SETS = 1000


def on_one_map(*values: float) -> Estimate | None:
    return estimate([Origin("lobby", seed) for seed in range(len(values))], values)


def test_intervals_of_independent_starts_are_those_of_scipy() -> None:
    values = (3.0, 5.5, 4.0, 7.0, 6.5)
    found = on_one_map(*values)
    assert (found.low, found.high) == pytest.approx(stats.t.interval(0.95, 4, np.mean(values), stats.sem(values)))
    assert found.units == "5 starts"


def test_fewer_than_five_starts_have_a_mean_and_no_interval_and_none_has_nothing() -> None:
    four = on_one_map(4.0, 5.0, 6.0, 5.0)
    assert (four.mean, four.low, four.half, four.sign, four.sides) == (5.0, None, None, 0, (0.0, 0.0))
    assert estimate([], []) is None


def test_missions_with_the_same_start_count_once() -> None:
    once = on_one_map(1.0, 2.0, 3.0, 4.0, 6.0)
    starts = [Origin("lobby", seed) for seed in range(5)]
    thrice = estimate([start for start in starts for _ in range(3)], np.repeat([1.0, 2.0, 3.0, 4.0, 6.0], 3).tolist())
    assert (thrice.count, thrice.mean, thrice.low) == (15, pytest.approx(once.mean), pytest.approx(once.low))


def test_five_maps_are_the_units_however_many_starts_each_has() -> None:
    origins = [Origin(f"comb-{number}", seed) for number in range(5) for seed in range(40)]
    found = estimate(origins, [float(origin.map[-1]) for origin in origins])
    assert found.units == "5 maps"
    assert (found.low, found.high) == pytest.approx(stats.t.interval(0.95, 4, 2.0, stats.sem(np.arange(5))))


def test_floors_of_a_building_count_once() -> None:
    values = {"kth_a1": 0.0, "kth_a2": 3.0, "kth_a3": 6.0, "fr101": 1.0, "g4s": 2.0, "fr052": 4.0, "uma236": 5.0}
    found = estimate([Origin(name, 1) for name in values], list(values.values()))
    assert (found.count, found.units) == (7, "5 buildings")
    assert (found.low, found.high) == pytest.approx(stats.t.interval(0.95, 4, 3.0, stats.sem(np.arange(1, 6))))


def test_a_building_of_a_few_has_the_weight_of_each_however_many_floors_it_has() -> None:
    names = ("kth_b1", "kth_b3", "fr101")
    found = estimate([Origin(name, seed) for name in names for seed in range(3)], [0, 1, 2, 4, 5, 6, 8, 9, 10])
    spread = np.sqrt(1 / 3 * (1 / 16 + 1 / 16 + 1 / 4))  # of a mean of means of 3 starts, whose variance is 1
    assert (found.mean, found.half) == (6.0, pytest.approx(stats.t.ppf(0.975, 6) * spread))


def test_differences_between_a_few_maps_do_not_widen_their_interval() -> None:
    alike, apart = (
        estimate([Origin(name, seed) for name in "ab" for seed in range(4)], [*range(4), *range(offset, offset + 4)])
        for offset in (0, 100)
    )
    assert (apart.mean - alike.mean, apart.half) == (50.0, pytest.approx(alike.half))


def coverage(maps: int, starts: int, teams: int, *, map_spread: float, of_these_maps: bool, lost: float) -> float:
    """Return in how many of simulated data sets the interval holds the true mean, of these maps or of all.

    The effect of a start is the same for all its teams; a share `lost` of the missions is incomplete.
    """
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(SETS):
        of_maps = rng.normal(0, map_spread, (maps, 1, 1))
        values = of_maps + rng.normal(0, 0.1, (maps, starts, 1)) + rng.normal(0, 0.1, (maps, starts, teams))
        kept = np.argwhere(rng.random(values.shape) >= lost)
        found = estimate([Origin(str(m), seed) for m, seed, _ in kept.tolist()], values[tuple(kept.T)].tolist())
        held += found.low <= (of_maps.mean() if of_these_maps else 0.0) <= found.high
    return held / SETS


OVER_MAPS = ((8, 3, 2, 0.0), (5, 1, 4, 0.0), (8, 3, 2, 0.15), (40, 2, 2, 0.0))
OVER_STARTS = ((1, 6, 18, 0.0), (2, 8, 3, 0.0), (4, 5, 2, 0.15))


@pytest.mark.parametrize(
    ("maps", "starts", "teams", "lost", "spread"),
    [*((*sizes, 0.1) for sizes in OVER_MAPS), *((*sizes, 0.3) for sizes in OVER_STARTS)],
)
def test_intervals_hold_the_mean_of_all_such_maps_or_of_these_in_95_of_100_data_sets(
    maps: int, starts: int, teams: int, lost: float, spread: float
) -> None:
    of_these = (maps, starts, teams, lost) in OVER_STARTS
    share = coverage(maps, starts, teams, map_spread=spread, of_these_maps=of_these, lost=lost)
    assert share == pytest.approx(0.95, abs=0.02)
