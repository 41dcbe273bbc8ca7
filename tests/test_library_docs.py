"""Pages with Python: their snippets work in order, and print the documented output."""

import doctest
import re
import shlex
import tomllib
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from marsupial.cli.main import main

ROOT = Path(__file__).resolve().parents[1]
MADE = {
    "library": {"lobby.jsonl", "lobby.png", "lobby.html", "problem.pddl", "compared.png"},
    "own-strategy": {"most-first.html", "most-first.jsonl", "most-first"},
    "coming-from": set(),
}
"""The pages, and files that their snippets write."""
COMMANDS = {"own-strategy"}
"""The pages whose commands run here too."""
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def text_of(page: str) -> str:
    return (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", MADE)
def test_every_snippet_works_and_prints_the_documented_output(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "snippets"}
    printed = ""
    blocks = BLOCKS.findall(text_of(page))
    for _, block in blocks:
        if named := re.match(r"# (\w+\.py)\n", block):
            (tmp_path / named[1]).write_text(block)
    for language, block in blocks:
        if language == "python":
            out = StringIO()
            with redirect_stdout(out):
                exec(compile(block, f"docs/{page}.md", "exec"), names)
            printed = out.getvalue()
        elif language == "text":
            assert printed == block
        elif language == "sh" and page in COMMANDS:
            assert [main(shlex.split(line)[1:]) for line in block.splitlines()] == [0] * block.count("\n")
    assert {path.name for path in tmp_path.iterdir()} >= MADE[page]


@pytest.mark.parametrize("page", ["library", "own-strategy"])
def test_the_entry_points_are_toml(page: str) -> None:
    (text,) = (block for language, block in BLOCKS.findall(text_of(page)) if language == "toml")
    points = set(tomllib.loads(text)["project"]["entry-points"])
    assert {"marsupial.strategies"} <= points <= {"marsupial.strategies", "marsupial.engines"}


def test_the_session_in_the_readme_prints_the_documented_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (session,) = (block for language, block in BLOCKS.findall(readme) if language == "pycon")
    test = doctest.DocTestParser().get_doctest(session, {}, "README.md", "README.md", 0)
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test).failed == 0
    assert (tmp_path / "office.html").exists()
