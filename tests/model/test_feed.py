import gc
import weakref

import numpy as np

from marsupial.arrays import Ints
from marsupial.model.feed import Feed


def cells(*indices: int) -> Ints:
    return np.array(indices, dtype=np.int64)


def test_a_reader_gets_what_is_added_after_it_came_and_each_of_it_once() -> None:
    feed = Feed()
    feed.add(cells(1))
    reader = feed.reader()
    assert reader.parts() == []
    feed.add(cells(2, 3))
    feed.add(cells(4))
    assert [part.tolist() for part in reader.parts()] == [[2, 3], [4]]
    feed.add(cells(5))
    assert reader.cells().tolist() == [5]
    assert reader.cells().tolist() == []


def test_one_reader_takes_nothing_from_another() -> None:
    feed = Feed()
    early = feed.reader()
    feed.add(cells(1))
    late = feed.reader()
    feed.add(cells(2))
    assert late.cells().tolist() == [2]
    assert early.cells().tolist() == [1, 2]


def test_items_that_all_readers_have_read_are_dropped() -> None:
    feed = Feed()
    quick, slow = feed.reader(), feed.reader()
    part = cells(1, 2)
    kept = weakref.ref(part)
    feed.add(part)
    del part
    quick.cells()
    gc.collect()
    assert kept() is not None
    slow.cells()
    gc.collect()
    assert kept() is None
