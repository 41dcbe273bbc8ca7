from dataclasses import replace

import pytest

from marsupial.model.robots import default_types
from marsupial.model.sizes import SIZES, Extent, ground_faults, radius_fault
from marsupial_service.settings import ServiceLimits

HALL = Extent(cells=2000 * 2000, resolution_m=0.01)
"""20 m x 20 m of 1 cm cells."""


def test_a_hall_of_one_centimetre_cells_is_taken_with_robots_of_real_size() -> None:
    kinds = [replace(kind, radius_m=radius_m) for kind in default_types(2) for radius_m in (0.5, 0.15)]
    for most in ({name: size.most for name, size in SIZES.items()}, ServiceLimits().sizes):
        assert all(radius_fault(kind.radius_m, HALL, most) is None for kind in kinds)
        assert list(ground_faults(kinds, HALL, most)) == []


def test_the_largest_map_there_may_be_is_taken_with_the_default_robots() -> None:
    assert list(ground_faults(default_types(2), Extent(100_000_000, 0.05))) == []


def test_a_radius_is_bounded_in_cells() -> None:
    assert radius_fault(2.0, HALL) is None
    assert radius_fault(2.01, HALL) == "must be at most 200 cells of the map, got 201 cells of 0.01 m"


def test_robots_that_are_each_in_bounds_may_be_too_much_together() -> None:
    carrier, rover = default_types(2)
    many = [replace(rover, name=f"r{i}", radius_m=1.0 + 0.001 * i) for i in range(50)]
    (work,) = ground_faults([carrier, *many], HALL)
    assert work.startswith("too much for this map: cells of a map times the cells under a robot")
    pairs = [replace(kind, name=f"{kind.name}{i}") for kind in (carrier, rover) for i in range(30)]
    (layers,) = ground_faults(pairs, HALL._replace(cells=10_000_000))
    assert "pairs of types that dock are 9.6e+09" in layers


def test_types_of_the_same_ground_count_once() -> None:
    _, rover = default_types(2)
    many = [replace(rover, name=f"r{i}", radius_m=1.0) for i in range(50)]
    assert list(ground_faults(many, HALL)) == []


@pytest.mark.parametrize("name", SIZES)
def test_the_service_allows_no_more_than_files_do(name: str) -> None:
    assert ServiceLimits().sizes[name] <= SIZES[name].most
