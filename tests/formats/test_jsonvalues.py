import pytest

from marsupial.formats.jsonvalues import JsonFault, parse_json


def test_values_are_those_of_json() -> None:
    assert parse_json('{"a": [1, 2.5, "x", null, true]}') == {"a": [1, 2.5, "x", None, True]}


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "Expecting value: line 1 column 1 (char 0)"),
        ("[" * 100_000, "is nested too deep"),
        ('{"a": 1, "b": {"a": "}", "c": 2, "\\u0063": 3}}', "field 'c' is given twice"),
        ('{"a": "{",\n "b": [1],\n "b": 2}', "line 3: field 'b' is given twice"),
        ("[NaN]", "NaN is no finite number"),
        ("-Infinity", "-Infinity is no finite number"),
        ("1e999", "1e999 is no finite number"),
        ("9" * 5000, "Exceeds the limit (4300 digits) for integer string conversion: value has 5000 digits"),
    ],
)
def test_all_errors_of_json_text_are_one_exception(text: str, fault: str) -> None:
    with pytest.raises(JsonFault) as caught:
        parse_json(text)
    assert str(caught.value) == fault
