"""docs/architecture.md: all packages and files it names exist, and it names all packages."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
ROOMS = re.findall(r"^\| `([\w/]+)` \| .* \| (`.*`) \|$", TEXT, re.MULTILINE)
"""Path of each package, and its files to read first."""


def folder(room: str) -> Path:
    return ROOT / room if room.startswith("services") else ROOT / "marsupial" / room


def test_every_room_and_every_file_to_look_at_first_is_there() -> None:
    assert ROOMS
    for room, files in ROOMS:
        for name in re.findall(r"`([^`]+)`", files):
            assert (folder(room) / name).exists(), f"{room}: {name}"


def test_every_package_has_its_line() -> None:
    packages = {path.parent.name for path in (ROOT / "marsupial").glob("*/__init__.py")}
    assert packages == {room for room, _ in ROOMS if "/" not in room}


def test_every_file_that_is_named_elsewhere_is_there() -> None:
    places = [ROOT, ROOT / "marsupial", ROOT / "services" / "marsupial_service"]
    prose = re.sub(r"^\|.*$", "", TEXT, flags=re.MULTILINE)
    for name in re.findall(r"`([\w/]+/[\w/]*\w\.py|[\w/]+/)`", prose):
        assert any((place / name).exists() for place in places), name
