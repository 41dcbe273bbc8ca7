from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.fuzz import runs
from benchmarks.fuzz.mutations import PNG, mutations
from benchmarks.fuzz.targets import TARGETS, FuzzTarget
from benchmarks.fuzz.trying import fault_of

MUTATIONS = 30
"""Of the examples of each family; a full run of the fuzzer has a million."""


@pytest.mark.parametrize("family", TARGETS)
def test_no_reader_breaks_on_examples_and_mutations_of_them(family: str) -> None:
    target = TARGETS[family]
    seeds = target.seeds()
    found = [fault_of(target, data) for data in (*seeds, *mutations(seeds, MUTATIONS, target.words.encode().split()))]
    assert [fault for fault in found if fault is not None] == []


@pytest.mark.parametrize("family", TARGETS)
def test_at_least_one_example_of_each_family_is_taken(family: str) -> None:
    def is_taken(data: bytes) -> bool:
        try:
            TARGETS[family].read(data)
        except TARGETS[family].refuses:
            return False
        return True

    assert any(map(is_taken, TARGETS[family].seeds()))


def test_what_a_reader_does_not_document_is_a_finding() -> None:
    def read(data: bytes) -> None:
        raise {b"a": ValueError, b"b": KeyError}[data]("boom")

    target = FuzzTarget(read, tuple, refuses=(ValueError,))
    assert fault_of(target, b"a") is None
    assert "KeyError" in (fault_of(target, b"b") or "")


def test_mutations_are_the_same_each_time_and_keep_a_png_decodable() -> None:
    seeds = [data for data in TARGETS["image"].seeds() if data.startswith(PNG)]
    first, again = (list(mutations(seeds, 300, ())) for _ in range(2))
    assert first == again
    assert len(set(first)) > 100


def test_a_kept_input_is_run_again_by_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "strips.0123"
    file.write_bytes(b"no strips")
    assert runs.main(["--replay", str(file)]) == 0
    assert capsys.readouterr().out == "strips: no finding\n"
    assert runs.main(["--replay", str(file.rename(tmp_path / "nothing.0123"))]) == 2
