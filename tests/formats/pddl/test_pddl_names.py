"""Names in PDDL and back."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from marsupial.formats.pddl.domain import FUNCTIONS, PREDICATES, SUPERTYPES
from marsupial.formats.pddl.names import RESERVED, decode_name, decode_type, encode_name, encode_type


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("rover1_2", "rover1_2"),
        ("m-1", "m-1"),
        ("home", "n-home"),
        ("Room 1", "n--52-oom-20-1"),
        ("n-x", "n-n-2d-x"),
        ("a_type", "n-a-5f-type"),
        ("7", "n-7"),
        ("", "n-"),
    ],
)
def test_a_name_that_pddl_cannot_hold_is_escaped(name: str, word: str) -> None:
    assert encode_name(name) == word
    assert decode_name(word) == name


def test_robot_types_get_a_suffix_and_words_that_no_encoding_gives_are_left_alone() -> None:
    assert encode_type("rover") == "rover_type"
    assert encode_type("robot") == "n-robot_type"
    assert encode_type("Big one") == "n--42-ig-20-one_type"
    assert decode_name("n-foo") == "n-foo"
    assert decode_name("n-ffffffff-") == "n-ffffffff-"
    assert decode_type("heavy") == "heavy"


@given(st.lists(st.text(max_size=6), max_size=6, unique=True), st.lists(st.text(max_size=6), max_size=6, unique=True))
def test_names_come_back_and_never_clash(names: list[str], types: list[str]) -> None:
    words = [encode_name(name) for name in names] + [encode_type(name) for name in types]
    assert len(set(words)) == len(words)
    assert [decode_name(word) for word in words[: len(names)]] == names
    assert [decode_type(word) for word in words[len(names) :]] == types
    assert all(re.fullmatch(r"[a-z][a-z0-9_-]*", word) and word not in RESERVED for word in words)


def test_every_word_of_the_domain_is_reserved() -> None:
    assert {*PREDICATES, *FUNCTIONS, *SUPERTYPES} <= RESERVED
