"""Which rovers a carrier has places for."""

from dataclasses import replace

import pytest
from support.planning.situations import mixed_types, seat_taken

from marsupial.errors import SituationError
from marsupial.model.robots import default_types
from marsupial.model.seats import has_place, most_aboard, overload

ANY, _ = default_types(2)
SEATED = replace(ANY, seats=(("small", 2), ("large", 1)))


@pytest.mark.parametrize(
    ("carrier", "aboard", "fit"),
    [
        (ANY, [], {"small", "large", "other"}),
        (ANY, ["small", "other"], set()),
        (SEATED, [], {"small", "large"}),
        (SEATED, ["large"], {"small"}),
        (SEATED, ["small"], {"small", "large"}),
        (SEATED, ["small", "large"], set()),  # three seats, two places
        (replace(SEATED, capacity=0), [], set()),
    ],
)
def test_a_carrier_has_a_place_where_capacity_and_seats_allow_it(carrier, aboard: list[str], fit: set[str]) -> None:
    assert {rover for rover in ("small", "large", "other") if has_place(carrier, rover, aboard)} == fit


def test_no_more_rovers_of_a_type_are_aboard_than_places_or_seats() -> None:
    assert [most_aboard(SEATED, rover) for rover in ("small", "large", "other")] == [2, 1, 0]
    assert most_aboard(replace(SEATED, capacity=1), "small") == 1
    assert most_aboard(ANY, "other") == 2


@pytest.mark.parametrize(
    ("aboard", "fault"),
    [
        (["small", "large"], None),
        (["small"] * 3, "carries 3 rovers, type 'carrier' has capacity 2"),
        (["large"] * 2, "carries 2 rovers of type 'large', type 'carrier' has 1 seat for them"),
        (["other"], "carries 1 rover of type 'other', type 'carrier' has no seat for them"),
    ],
)
def test_an_overload_is_told_by_type(aboard: list[str], fault: str | None) -> None:
    assert overload(SEATED, aboard) == fault


@pytest.mark.parametrize(
    ("types", "message"),
    [
        (mixed_types((("climber", 1),)), "robots[0]: c1 carries 1 rover of type 'rover', type 'carrier' has no seat"),
        (mixed_types((("lorry", 1),)), "types[0].seats.lorry: unknown robot type 'lorry'"),
        (mixed_types((("hauler", 1),)), "types[0].seats.hauler: 'hauler' is a carrier, not a rover"),
        (mixed_types((("rover", -1),)), "types[0].seats.rover: must be 0 or more"),
        (mixed_types((("rover", 1), ("rover", 1))), "types[0].seats: name 'rover' is used twice"),
        ((replace(mixed_types(())[0], seats_as="rover"), *mixed_types(())[1:]), "types[0].seats_as: only rovers"),
        ((*mixed_types(())[:4], replace(mixed_types(())[4], seats_as="lorry")), "types[4].seats_as: unknown robot"),
        ((*mixed_types(())[:4], replace(mixed_types(())[4], seats=(("rover", 1),))), "types[4].seats: only carriers"),
    ],
)
def test_a_situation_with_wrong_seats_is_refused(types, message: str) -> None:
    with pytest.raises(SituationError) as caught:
        replace(seat_taken(), types=types)
    assert message in str(caught.value)
