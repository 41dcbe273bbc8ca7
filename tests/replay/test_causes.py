from generate_api import CAUSES
from marsupial.model.mission import Cause
from marsupial.replay.causes import SENTENCES, causes_module


def test_the_page_has_a_sentence_for_each_cause_of_a_plan() -> None:
    assert {*Cause} - {*SENTENCES} == {Cause.OTHER}


def test_the_page_s_sentences_are_those_that_python_has() -> None:
    assert CAUSES.read_text(encoding="utf-8") == causes_module(), "run `make generated`"
