"""Makes what `docs/gallery.md` links to, by the commands on it: `python docs/gallery.py FOLDER` in a checkout."""

import re
import subprocess
import sys
from pathlib import Path

from benchmarks.figures.kept import comparison
from marsupial.bench.compare.report import documents

COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def make(folder: Path) -> None:
    """Write all pages and pictures of the gallery."""
    folder.mkdir(parents=True, exist_ok=True)
    page = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    for command in "".join(COMMANDS.findall(page)).splitlines():
        program, *arguments = command.split()
        subprocess.run([sys.executable, "-m", program, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    report = dict(documents(comparison("footprint")))["report.html"]
    (folder / "footprint.html").write_bytes(report)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
