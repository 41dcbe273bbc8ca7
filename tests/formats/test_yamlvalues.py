from pathlib import Path

import pytest

from marsupial.errors import MapError
from marsupial.formats.mapfiles.nav2 import header_of
from marsupial.formats.scenario import is_scenario_file
from marsupial.formats.yamlvalues import YamlFault, compose_yaml, parse_yaml


@pytest.mark.parametrize(
    "value",
    [
        r'"\ud800"',
        r'"\UFFFFFFFF"',
        "!!bool maybe",
        '!!int ""',
        "!!timestamp soon",
        "2024-99-99",
        "0b_",
        "0x" + "f" * 5000,
        "&a [*a]",
        "*nobody",
        "{[a]: 1}",
        "{<<: [1]}",
    ],
)
def test_all_errors_of_yaml_values_are_one_exception_with_a_line(value: str) -> None:
    with pytest.raises(YamlFault, match=r"^line 2.*$"):
        parse_yaml(f"a: 1\nb: {value}\n")
    with pytest.raises(MapError, match="is not valid YAML: "):
        header_of(f"a: 1\nb: {value}\n".encode())


def test_merges_that_multiply_are_refused() -> None:
    layers = [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 30)]
    with pytest.raises(YamlFault, match="aliases repeat more than"):
        parse_yaml("\n".join(["a0: &a0 {x: 1}", *layers]))


def test_aliases_of_a_few_values_are_read() -> None:
    assert parse_yaml("a: &a [1, 2]\nb: *a\nc: {<<: {d: 3}, e: *a}") == {
        "a": [1, 2],
        "b": [1, 2],
        "c": {"d": 3, "e": [1, 2]},
    }
    assert compose_yaml("") is None


def test_a_file_with_a_list_as_a_key_is_no_scenario(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("[a]: 1\n")
    assert not is_scenario_file(tmp_path / "map.yaml")
