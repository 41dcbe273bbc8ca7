"""The documentation builds without a warning, its notebook runs, and its drawings are current."""

import re
import subprocess
import sys
import tarfile
from pathlib import Path
from xml.etree import ElementTree

import yaml
from support.waiting import HANG_S

import marsupial

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def run(*command: str) -> None:
    done = subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True, timeout=HANG_S)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]


def test_the_site_is_built_without_a_warning_and_the_notebook_runs(tmp_path: Path) -> None:
    run("-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "-c", "docs", ".", str(tmp_path))
    notebook = (tmp_path / "docs" / "notebook.html").read_text(encoding="utf-8")
    assert "exploration time" in notebook
    assert "sooner in the mean" in notebook
    reference = (tmp_path / "docs" / "reference.html").read_text(encoding="utf-8")
    missing = [name for name in marsupial.__all__ if f"marsupial.{name}" not in reference and name != "__version__"]
    assert not missing


def test_the_drawings_are_those_of_the_pages(tmp_path: Path) -> None:
    run("docs/drawings.py", "--to", str(tmp_path))
    pages = "".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    shown = set(re.findall(r"pictures/([\w-]+\.svg)", pages))
    assert shown == {path.name for path in tmp_path.iterdir()} | {"footprint.svg"}
    shown.remove("footprint.svg")  # `python -m benchmarks figures` draws it
    for name in shown:
        assert said_in(DOCS / "pictures" / name) == said_in(tmp_path / name), "run `make drawings`"


def said_in(drawing: Path) -> tuple[str | None, list[str]]:
    """Return the size of a drawing and its words and figures."""
    root = ElementTree.parse(drawing).getroot()
    return root.get("viewBox"), [text for text in root.itertext() if text.strip()]


def test_the_gallery_makes_what_it_links_to() -> None:
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    made = "".join(re.findall(r"^```sh\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)) + "footprint.html"
    assert all(name in made for name in re.findall(r'href="gallery/([^"]+)"', page))


def test_a_source_archive_has_the_documentation(tmp_path: Path) -> None:
    run("-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path))
    (archive,) = tmp_path.iterdir()
    with tarfile.open(archive) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    assert {"docs/tutorial.md", "docs/pictures/step.svg", "docs/notebook.ipynb", "CITATION.cff"} <= names


def test_the_citation_names_the_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == marsupial.__version__
    assert citation["cff-version"] == "1.2.0"
