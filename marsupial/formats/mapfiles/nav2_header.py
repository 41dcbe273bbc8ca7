"""The yaml file of a nav2 map, checked field by field.

Numbers are read as the map server reads them, so ``5e-2`` (a string to YAML 1.1) is a number here too. The file
comes from outside: it is size-limited, and aliases and tags, which no map file needs, are refused: with them
a few lines unfold without end. All wrong fields are reported at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import yaml

from marsupial.errors import MapError, Problem
from marsupial.formats.files import file_fault, read_map_bytes

MAX_YAML_BYTES = 64 * 1024
MAX_YAML_DEPTH = 20

_REQUIRED = ("image", "resolution", "origin", "negate", "free_thresh", "occupied_thresh")


class Mode(StrEnum):
    """How greys become occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True)
class Nav2Header:
    """A map's yaml file; `image` is the resolved path, thresholds are occupancies from 0 to 1."""

    image: Path
    resolution_m: float
    origin_m: tuple[float, float, float]
    negate: bool
    free_thresh: float
    occupied_thresh: float
    mode: Mode


def read_header(path: Path) -> Nav2Header:
    """Read a map's yaml file; that the image is there is checked too.

    Raises
    ------
    MapError
        Naming every wrong field.
    """
    fields = _load(read_map_bytes(path, MAX_YAML_BYTES), str(path))
    values, problems = _values(fields)
    if "image" in values:
        values["image"] = path.parent / values["image"]
        problems += _image_problems(values["image"], fields["image"], path)
    return _header(values, problems, str(path))


def header_of(data: bytes, *, source: str = "") -> Nav2Header:
    """Return the header that the bytes of a yaml file hold; nothing is looked for at its image's path.

    Raises
    ------
    MapError
        Naming every wrong field.
    """
    if len(data) > MAX_YAML_BYTES:
        raise MapError(f"has {len(data)} bytes, more than the limit of {MAX_YAML_BYTES}", source=source)
    values, problems = _values(_load(data, source))
    return _header(values, problems, source)


def _values(fields: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Return the fields that could be read, and what is wrong with the others."""
    problems = [Problem(key, "missing") for key in _REQUIRED if key not in fields]
    values: dict[str, Any] = {}
    for key, parse in _PARSERS.items():
        if key in fields:
            try:
                values[key] = parse(fields[key])
            except ValueError as error:
                problems.append(Problem(key, str(error)))
    free, occupied = values.get("free_thresh"), values.get("occupied_thresh")
    if free is not None and occupied is not None and free > occupied:
        problems.append(Problem("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}"))
    return values, problems


def _header(values: Mapping[str, Any], problems: list[Problem], source: str) -> Nav2Header:
    if problems:
        raise MapError(problems, source=source)
    return Nav2Header(
        image=Path(values["image"]),
        resolution_m=values["resolution"],
        origin_m=values["origin"],
        negate=values["negate"],
        free_thresh=values["free_thresh"],
        occupied_thresh=values["occupied_thresh"],
        mode=values.get("mode", Mode.TRINARY),
    )


def _load(data: bytes, source: str) -> Mapping[str, Any]:
    try:
        _refuse_bombs(data)
        fields = yaml.safe_load(data)
    except (yaml.YAMLError, ValueError) as error:
        raise MapError(f"is not valid YAML ({' '.join(str(error).split())})", source=source) from error
    if not isinstance(fields, dict):
        raise MapError("must hold `key: value` lines (image, resolution, ...)", source=source)
    return fields


def _refuse_bombs(data: bytes) -> None:
    depth = 0
    for event in yaml.parse(data, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError("aliases are not allowed")
        if getattr(event, "tag", None) is not None:
            raise ValueError("tags are not allowed")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise ValueError(f"nested more than {MAX_YAML_DEPTH} deep")


def _image_problems(image: Path, written: str, path: Path) -> list[Problem]:
    fault = file_fault(image)
    if fault is None:
        return []
    text = f"{fault}: {image}"
    beside = path.parent / image.name
    if Path(written).is_absolute() and file_fault(beside) is None:
        text += f" (an absolute path; {image.name} stands beside the yaml: write `image: {image.name}`)"
    return [Problem("image", text)]


def _image(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"must be the path of an image, got {_shown(value)}")
    return value


def _number(value: object) -> float:
    try:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        number = float(value)
    except (ValueError, OverflowError):
        raise ValueError(f"must be a number, got {_shown(value)}") from None
    if not math.isfinite(number):
        raise ValueError(f"must be a finite number, got {_shown(value)}")
    return number


def _resolution(value: object) -> float:
    number = _number(value)
    if number <= 0:
        raise ValueError(f"must be positive (metres per pixel), got {number:g}")
    return number


def _threshold(value: object) -> float:
    number = _number(value)
    if not 0 <= number <= 1:
        raise ValueError(f"must be from 0 to 1, got {number:g}")
    return number


def _origin(value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(f"must be three numbers [x, y, yaw], got {_shown(value)}")
    x, y, yaw = (_number(part) for part in value)
    return x, y, yaw


def _negate(value: object) -> bool:
    if not isinstance(value, int):
        raise ValueError(f"must be 0 or 1, got {_shown(value)}")
    return bool(value)


def _mode(value: object) -> Mode:
    try:
        return Mode(str(value).lower())
    except ValueError:
        raise ValueError(f"must be trinary, scale or raw, got {_shown(value)}") from None


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


_PARSERS = {
    "image": _image,
    "resolution": _resolution,
    "origin": _origin,
    "negate": _negate,
    "free_thresh": _threshold,
    "occupied_thresh": _threshold,
    "mode": _mode,
}
