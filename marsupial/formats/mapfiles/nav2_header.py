"""Read the yaml file of a nav2 map and check it field by field.

Values are read as nav2's map server reads them, so ``5e-2``, a text in YAML 1.1, is a number here too. The file comes
from outside: its size is limited, and aliases and tags, which no map file needs, are refused. All wrong fields are
reported at once. Like the map server, we ignore unknown fields; but if one looks like a field that is absent, it is
probably a typo, and a warning names it.
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
from marsupial.formats.yamlvalues import PlainLoader, YamlFault, parse_yaml, with_lines
from marsupial.model.bounds import BOUNDS
from marsupial.wording import suggestion

MAX_YAML_BYTES = 64 * 1024

_THRESHOLDS = ("free_thresh", "occupied_thresh")
_NUMBERS = ("resolution", "origin", *_THRESHOLDS)
_FIELDS = ("image", "mode", "negate", *_NUMBERS)

_TRUTHS = {"y": 1, "n": 0}  # texts that the map server reads as true and false, but PyYAML doesn't


class Mode(StrEnum):
    """How greys become occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True)
class Nav2Header:
    """The content of a map's yaml file; thresholds are occupancies from 0 to 1, `warnings` name probable typos."""

    image: Path
    resolution_m: float
    origin_m: tuple[float, float, float]
    negate: bool
    free_thresh: float
    occupied_thresh: float
    mode: Mode
    warnings: tuple[str, ...] = ()


def read_header(path: Path) -> Nav2Header:
    """Read a map's yaml file, and check that its image exists. Raise `MapError` with every wrong field."""
    return _header(read_bytes(path, MapError, MAX_YAML_BYTES), path.parent, str(path))


def header_of(data: bytes) -> Nav2Header:
    """Return the header in the bytes of a yaml file, without a look at its image."""
    if len(data) > MAX_YAML_BYTES:
        raise MapError(f"has {len(data)} bytes, more than the limit of {MAX_YAML_BYTES}")
    return _header(data, None, "")


def _header(text: bytes, folder: Path | None, source: str) -> Nav2Header:
    """Read the fields in `text`, and check that the image exists if a folder is given."""
    fields = Fields(_load(text, source), "", [])
    origin = fields.numbers("origin", 3) or (0.0, 0.0, 0.0)
    free, occupied = (_threshold(fields, key) for key in _THRESHOLDS)
    if not fields.problems and free > occupied:
        fields.wrong("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}")
    typos = [Problem(key, f"unknown field{meant}") for key, meant in _typos(fields.data)]
    header = Nav2Header(
        image=(folder or Path()) / fields.text("image"),
        resolution_m=fields.number("resolution", None, BOUNDS["resolution_m"]),
        origin_m=(origin[0], origin[1], origin[2]),
        negate=bool(fields.integer("negate")),
        free_thresh=free,
        occupied_thresh=occupied,
        mode=Mode(fields.choice("mode", list(Mode), Mode.TRINARY) or Mode.TRINARY),
        warnings=tuple(f"{typo}; it is ignored" for typo in with_lines(typos, text)),
    )
    if fields.problems:  # a typo may be why a field is missing
        fields.problems += typos
    written = fields.data.get("image")
    if folder is not None and written and isinstance(written, str):
        _check_image(written, folder, fields)
    if fields.problems:
        raise MapError(with_lines(fields.problems, text), source=source)
    return header


def _threshold(fields: Fields, key: str) -> float:
    """Read a share; explain how to write it if it is in percent, which the map server refuses too."""
    value = fields.data.get(key)
    if isinstance(value, str) and value.endswith("%"):
        fields.wrong(key, f"must be a share from 0 to 1 without a percent sign, as 0.65, got {shown(value)}")
        return 0.0
    return fields.number(key, None, BOUNDS["share"])


def _typos(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield each unknown field that looks like an absent one, with a suggestion."""
    absent = [key for key in _FIELDS if key not in data]
    for key in data:
        if meant := "" if key in _FIELDS else suggestion(str(key), absent):
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
    """Return a value as the map server reads it: numbers may be written as texts, a mode in capitals."""
    if isinstance(value, list):
        return [_as_map_server(key, item) for item in value]
    if key == "negate" and isinstance(value, bool):
        return int(value)
    if key == "negate" and isinstance(value, str):
        is_short = len(value) < 10  # `int` refuses thousands of digits
        return _TRUTHS.get(value.lower(), int(value) if is_short and value.isascii() and value.isdigit() else value)
    if key == "mode" and isinstance(value, str):
        return value.lower()
    if key in _NUMBERS and isinstance(value, str):
        with suppress(ValueError):
            return float(value)
    return value


def _check_image(written: str, folder: Path, fields: Fields) -> None:
    image = folder / written
    if (fault := file_fault(image)) is None:
        return
    text = f"{fault}: {image}"
    if Path(written).is_absolute() and file_fault(folder / image.name) is None:
        text += f" (an absolute path; {image.name} stands beside the yaml: write `image: {image.name}`)"
    fields.wrong("image", text)
