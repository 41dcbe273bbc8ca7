"""The yaml file of a nav2 map, checked field by field.

Numbers are read as the map server reads them, so ``5e-2`` (a string to YAML 1.1) is a number here too. The file
comes from outside: it is size-limited, and aliases and tags, which no map file needs, are refused: with them
a few lines unfold without end. All wrong fields are reported at once. The map server ignores fields that it doesn't
know, and so do we, but one that looks like a field that is absent is a slip of the pen, and named.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from marsupial.errors import MapError, Problem
from marsupial.formats.fields import Fields, shown
from marsupial.formats.files import file_fault, read_bytes
from marsupial.formats.yamllines import with_lines
from marsupial.formats.yamlvalues import PlainLoader, YamlFault, parse_yaml
from marsupial.model.bounds import BOUNDS
from marsupial.wording import suggestion

MAX_YAML_BYTES = 64 * 1024

_THRESHOLDS = ("free_thresh", "occupied_thresh")
_NUMBERS = ("resolution", "origin", *_THRESHOLDS)
_FIELDS = ("image", "mode", "negate", *_NUMBERS)

_TRUTHS = {"y": 1, "n": 0}
"""Truth values to the map server that are texts to YAML's other readers."""


class Mode(StrEnum):
    """How greys become occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True)
class Nav2Header:
    """A map's yaml file.

    `image` is the resolved path, thresholds are occupancies from 0 to 1, `warnings` name fields that were ignored and
    may have been meant otherwise.
    """

    image: Path
    resolution_m: float
    origin_m: tuple[float, float, float]
    negate: bool
    free_thresh: float
    occupied_thresh: float
    mode: Mode
    warnings: tuple[str, ...] = ()


def read_header(path: Path) -> Nav2Header:
    """Read a map's yaml file; that the image is there is checked too.

    Raises
    ------
    MapError
        Naming every wrong field.
    """
    text = read_bytes(path, MapError, MAX_YAML_BYTES)
    data = _load(text, str(path))
    fields = Fields(data, "", [])
    header = _header(fields, path.parent, text)
    if data.get("image") and isinstance(data["image"], str):
        _check_image(data["image"], path.parent, fields)
    if fields.problems:
        raise MapError(with_lines(fields.problems, text), source=str(path))
    return header


def header_of(data: bytes) -> Nav2Header:
    """Return the header that the bytes of a yaml file hold; nothing is looked for at its image's path.

    Raises
    ------
    MapError
        Naming every wrong field.
    """
    if len(data) > MAX_YAML_BYTES:
        raise MapError(f"has {len(data)} bytes, more than the limit of {MAX_YAML_BYTES}")
    fields = Fields(_load(data, ""), "", [])
    header = _header(fields, Path(), data)
    if fields.problems:
        raise MapError(with_lines(fields.problems, data))
    return header


def _header(fields: Fields, folder: Path, text: bytes) -> Nav2Header:
    """Read the fields of the file `text`; the header means something only if no problem was noted."""
    before = len(fields.problems)
    origin = fields.numbers("origin", 3) or (0.0, 0.0, 0.0)
    free, occupied = (_threshold(fields, key) for key in _THRESHOLDS)
    if len(fields.problems) == before and free > occupied:
        fields.wrong("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}")
    slips = [Problem(key, f"unknown field{meant}") for key, meant in _slips(fields.data)]
    header = Nav2Header(
        image=folder / fields.text("image"),
        resolution_m=fields.number("resolution", None, BOUNDS["resolution_m"]),
        origin_m=(origin[0], origin[1], origin[2]),
        negate=bool(fields.integer("negate")),
        free_thresh=free,
        occupied_thresh=occupied,
        mode=Mode(fields.choice("mode", list(Mode), Mode.TRINARY) or Mode.TRINARY),
        warnings=tuple(f"{slip}; it is ignored" for slip in with_lines(slips, text)),
    )
    if len(fields.problems) > before:
        fields.problems += slips
    return header


def _threshold(fields: Fields, key: str) -> float:
    """Take a share; one in percent, which the map server refuses too, is told how it is written."""
    value = fields.data.get(key)
    if isinstance(value, str) and value.endswith("%"):
        fields.wrong(key, f"must be a share from 0 to 1 without a percent sign, as 0.65, got {shown(value)}")
        return 0.0
    return fields.number(key, None, BOUNDS["share"])


def _slips(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Return each unknown field that looks like an absent one, with words on which."""
    absent = [key for key in _FIELDS if key not in data]
    for key in data:
        meant = "" if key in _FIELDS else suggestion(str(key), absent)
        if meant:
            yield str(key), meant


def _load(data: bytes, source: str) -> Mapping[str, Any]:
    try:
        fields = parse_yaml(data, PlainLoader, aliases=False)
    except YamlFault as fault:
        raise MapError(f"is not valid YAML: {fault}", source=source) from fault
    if fields is None:
        raise MapError("is empty", source=source)
    if not isinstance(fields, dict):
        raise MapError("must hold `key: value` lines (image, resolution, ...)", source=source)
    return {key: _as_map_server(str(key), value) for key, value in fields.items()}


def _as_map_server(key: str, value: Any) -> Any:
    """Return a value as the map server reads it: texts of numbers are numbers, a mode may be in capitals."""
    if isinstance(value, list):
        return [_as_map_server(key, item) for item in value]
    if key == "negate" and isinstance(value, bool):
        return int(value)
    if key == "negate" and isinstance(value, str):
        is_short = len(value) < 10  # Python makes no number of thousands of digits
        return _TRUTHS.get(value.lower(), int(value) if is_short and value.isascii() and value.isdigit() else value)
    if key == "mode" and isinstance(value, str):
        return value.lower()
    if key in _NUMBERS and isinstance(value, str):
        with suppress(ValueError):
            return float(value)
    return value


def _check_image(written: str, folder: Path, fields: Fields) -> None:
    image = folder / written
    fault = file_fault(image)
    if fault is None:
        return
    text = f"{fault}: {image}"
    if Path(written).is_absolute() and file_fault(folder / image.name) is None:
        text += f" (an absolute path; {image.name} stands beside the yaml: write `image: {image.name}`)"
    fields.wrong("image", text)
