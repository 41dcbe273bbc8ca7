"""docs/library.md: its snippets work in order, and print the documented output."""

import doctest
import re
import tomllib
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_every_snippet_works_and_prints_the_documented_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "snippets"}
    printed = ""
    for language, block in BLOCKS.findall(TEXT):
        if language == "python":
            out = StringIO()
            with redirect_stdout(out):
                exec(compile(block, "docs/library.md", "exec"), names)
            printed = out.getvalue()
        elif language == "text":
            assert printed == block
    assert {path.name for path in tmp_path.iterdir()} >= {"lobby.jsonl", "lobby.png", "lobby.html", "problem.pddl"}


def test_the_entry_points_are_toml() -> None:
    (text,) = (block for language, block in BLOCKS.findall(TEXT) if language == "toml")
    assert set(tomllib.loads(text)["project"]["entry-points"]) == {"marsupial.strategies", "marsupial.engines"}


def test_the_session_in_the_readme_prints_the_documented_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (session,) = (block for language, block in BLOCKS.findall(readme) if language == "pycon")
    test = doctest.DocTestParser().get_doctest(session, {}, "README.md", "README.md", 0)
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test).failed == 0
    assert (tmp_path / "office.html").exists()
