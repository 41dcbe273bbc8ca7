from contextlib import suppress

import pytest

from benchmarks.fuzz.mutations import mutations
from benchmarks.fuzz.targets import TARGETS
from benchmarks.fuzz.trying import fault_of

MUTATIONS = 30
"""Number of mutations per family; a full run of the fuzzer has a million."""


@pytest.mark.parametrize("family", TARGETS)
def test_no_reader_breaks_on_examples_and_mutations_of_them(family: str) -> None:
    target = TARGETS[family]
    seeds = target.seeds()
    found = [fault_of(target, data) for data in (*seeds, *mutations(seeds, MUTATIONS, target.words.encode().split()))]
    assert [fault for fault in found if fault is not None] == []


@pytest.mark.parametrize("family", TARGETS)
def test_at_least_one_example_of_each_family_is_taken(family: str) -> None:
    target, taken = TARGETS[family], list[object]()
    for data in target.seeds():
        with suppress(*target.refuses):
            taken.append(target.read(data))
    assert taken
