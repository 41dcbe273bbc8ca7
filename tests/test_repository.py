"""The repository holds sources, and few binary files: those listed here."""

import os
import shutil
import subprocess
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

AT_THE_TOP = {
    ".ci", ".gitignore", ".npmrc", "benchmarks", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "docker", "docs",
    "eslint.config.js", "generate_api.py", "hatch_build.py", "LICENSE", "Makefile", "marsupial", "package.json",
    "package-lock.json", "pddl", "pyproject.toml", "README.md", "services", "tests", "tsconfig.json",
}  # fmt: skip
OF_AN_SDIST = {"PKG-INFO"}

BINARIES = (
    "benchmarks/figures/rows/*.gz",  # results behind figures
    "docs/pictures/*.gif",
    "docs/pictures/*.png",
    "docs/tutorial/*.png",
    "marsupial/bench/suite/moments/*.gz",  # situations of the planner suite
)


def test_nothing_lies_at_the_top_that_is_not_listed() -> None:
    assert {name.split("/")[0] for name in files()} - AT_THE_TOP - OF_AN_SDIST == set()


def test_only_the_listed_files_are_binary() -> None:
    unlisted = [name for name in files() if not any(fnmatch(name, pattern) for pattern in BINARIES)]
    assert [name for name in unlisted if is_binary(ROOT / name)] == []


def files() -> list[str]:
    """Return the files of the repository as git has them; in a source distribution, all that are not ignored."""
    if (ROOT / ".git").exists() and shutil.which("git"):
        command = ["git", "-C", str(ROOT), "ls-files", "-z"]
        listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]
    ignored = [line.strip("/") for line in (ROOT / ".gitignore").read_text().split()]

    def kept(names: list[str]) -> list[str]:
        return [name for name in names if not any(fnmatch(name, pattern) for pattern in ignored)]

    found = []
    for folder, below, names in os.walk(ROOT):
        below[:] = kept(below)
        found += [Path(folder, name).relative_to(ROOT).as_posix() for name in kept(names)]
    return found


def is_binary(path: Path) -> bool:
    """Return whether a file is not text."""
    try:
        return "\0" in path.read_bytes().decode()
    except UnicodeDecodeError:
        return True
