"""Tables of a comparison as plain text and as LaTeX."""

from collections.abc import Sequence

from marsupial.bench.compare.tables import GOOD, ReportTable

_ESCAPES = {sign: f"\\{sign}" for sign in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "²": r"\textsuperscript{2}",
    "–": "--",
}


def plain(table: ReportTable) -> str:
    """Return a table as lines of text in columns, numbers to the right, without its caption."""
    lines = [table.heads, *([cell.text for cell in row] for row in table.rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    left = _text_columns(table)
    return "\n".join(
        "  ".join(
            text.ljust(width) if i in left else text.rjust(width)
            for i, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def latex(table: ReportTable) -> str:
    """Return a table as a ``tabular`` with the rules of booktabs, its caption a comment; `GOOD` cells are bold."""
    left = _text_columns(table)
    columns = "".join("l" if i in left else "r" for i in range(len(table.heads)))
    rows = [[_bold(cell.text) if cell.mark == GOOD else _escaped(cell.text) for cell in row] for row in table.rows]
    body = [_row([_escaped(head) for head in table.heads]), r"\midrule", *map(_row, rows)]
    head = [f"% {table.caption}", rf"\begin{{tabular}}{{{columns}}}", r"\toprule"]
    return "\n".join([*head, *body, r"\bottomrule", r"\end{tabular}"])


def _text_columns(table: ReportTable) -> set[int]:
    """Return the columns that hold names: the first, the teams, and those without a digit in their first row."""
    first = [cell.is_number for cell in (table.rows or [()])[0]]
    return {i for i, head in enumerate(table.heads) if i == 0 or head == "team" or first[i : i + 1] == [False]}


def _bold(text: str) -> str:
    return rf"\textbf{{{_escaped(text)}}}"


def _escaped(text: str) -> str:
    return "".join(_ESCAPES.get(letter, letter) for letter in text)


def _row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"
