"""What is stored packed comes back as it was, also after years."""

from __future__ import annotations

import os
import zlib

import pytest

from marsupial_service.store import packing
from marsupial_service.store.packing import PIECE, pack, pieces, unpack, whole

LINE = b'log {"event":"reveal","t_ms":68934,"looks":[["carrier1",0,"ACxCoKBuBBCwCqKC"]]}'


@pytest.mark.parametrize("data", [b"x", LINE, os.urandom(5000), LINE * 2000, "\u00e9\u2028".encode()])
def test_what_was_packed_is_unpacked(data: bytes) -> None:
    assert unpack(pack(data)) == data


def test_a_line_of_a_log_takes_half_of_its_length() -> None:
    assert len(pack(LINE)) < len(LINE) / 2


def test_the_dictionary_is_the_one_that_stored_rows_were_packed_with() -> None:
    assert zlib.crc32(packing._DICTIONARY_1) == 1071597026
    packed = bytes.fromhex("01c357cc9b22c2252b3fb552a91600")
    assert unpack(packed) == b'log {"event":"stand","t_ms":5,"robot":"joey"}'


def test_parts_are_put_together_in_their_order() -> None:
    values = [pack(os.urandom(size)) for size in (10, PIECE - 1, PIECE, 3 * PIECE + 1)]
    rows = [{"seq": i, "part": part, "data": data} for i, one in enumerate(values) for part, data in pieces(one)]
    assert max(len(row["data"]) for row in rows) == PIECE
    assert [(row["seq"], data) for row, data in whole(rows)] == [(i, unpack(one)) for i, one in enumerate(values)]
    assert list(whole([])) == []
