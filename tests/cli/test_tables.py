import pytest

from marsupial.cli.display.tables import print_report, print_table
from marsupial.cli.main import main


def test_a_piped_table_fits_100_columns_and_cuts_no_word(capsys: pytest.CaptureFixture[str]) -> None:
    words = [f"word{i}" for i in range(40)]
    print_table(("name", "what it is", "number"), [("a", " ".join(words), "1")], right=(2,))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    assert [word for line in lines for word in line.split() if word.startswith("word")] == words


def test_long_lines_of_a_report_wrap_at_words_with_an_indent(capsys: pytest.CaptureFixture[str]) -> None:
    long = "  x" + " some-words" * 12
    print_report(f"  heads   a\n{long}\n\n{'y' * 120}\nend")
    heads, first, second, empty, unbroken, end = capsys.readouterr().out.splitlines()
    assert (heads, empty, unbroken, end) == ("  heads   a", "", "y" * 120, "end")
    assert len(first) <= 100
    assert second.startswith("    some-words")
    assert f"{first} {second.strip()}" == long


@pytest.mark.parametrize("command", [["planners"], ["scenarios"], ["map", "office"]])
def test_lists_of_commands_fit_100_columns(capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    assert main(command) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 100
