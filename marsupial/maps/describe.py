"""A map in numbers, with warnings about what looks wrong.

Most trouble with maps is a wrong interpretation: unknown space that reads as free, a gap in a wall that connects inside
and outside, millimetres taken for metres. The description holds the share of every class, the free space connected to
the border, the reach of each robot type, and warnings as sentences.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.maps.discs import disc
from marsupial.maps.footprint import Footprint, footprint_of
from marsupial.maps.reach import parts
from marsupial.maps.repairs import find_specks, painted, without_specks
from marsupial.model import OBSTACLE, UNKNOWN, Cell, Grid, LegendEntry, MapReading, Mask
from marsupial.model.grid import ground_in
from marsupial.model.robots import RobotType, Role, TeamMember, default_types
from marsupial.wording import counted

USUAL_RESOLUTION_M = (0.005, 1.0)
USUAL_EXTENT_M = 5000.0

NOTABLE_GAIN = 0.05  # warn of specks that keep robots out of this much ground, as a share of what they reach

NOISY_GAIN = 1.0  # the same for obstacles: many are legs of furniture, so only a loss of half the ground suggests noise


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainShare:
    """One terrain class of a map (or obstacle, or unknown); `share` is its share of all cells, 0 to 1."""

    name: str
    code: int
    cells: int
    area_m2: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeReach:
    """Where one robot type may stand."""

    type: str
    radius_m: float
    area_m2: float  # of the largest connected part
    parts: int
    at_border: bool  # whether a robot in the largest part can reach the map's border


@dataclass(frozen=True, slots=True, kw_only=True)
class MapDescription:
    """The contents of a map."""

    format: str  # of the file; empty for a grid that was not read from a file
    width: int  # in cells, as `height`
    height: int
    width_m: float
    height_m: float
    resolution_m: float
    origin_m: tuple[float, float, float]
    free: tuple[TerrainShare, ...]  # the free classes that occur
    occupied: TerrainShare
    unknown: TerrainShare
    border_cells: int  # free cells on the map's border
    border_area_m2: float  # free area connected to them
    reach: tuple[TypeReach, ...]  # one entry per requested robot type
    legend: tuple[LegendEntry, ...]  # interpretation of every symbol of the file
    warnings: tuple[str, ...]  # the file's own first


def describe(
    grid: Grid, kinds: Sequence[RobotType], *, reading: MapReading | None = None, team: Sequence[TeamMember] = ()
) -> MapDescription:
    """Describe a map for the given robot types, or for the default ones if there are none; check the starts of `team`.

    `reading` is the interpretation of the file; None for a grid that was not read from a file. Its map may differ from
    `grid` (terrain mask).
    """
    # one pass over the map instead of one per class
    counts = np.bincount(grid.cells.ravel(), minlength=256)
    names = {terrain.code: terrain.name for terrain in grid.terrains}
    shares = {code: _share(grid, names.get(code, f"code {code}"), code, int(counts[code])) for code in range(255)}
    unknown = _share(grid, "unknown", UNKNOWN, int(counts[UNKNOWN]))
    free = tuple(shares[code] for code in range(OBSTACLE + 1, UNKNOWN) if counts[code])
    border_cells, leaking = _leak(grid)
    reach, footprints = _reaches(grid, kinds)
    masks = [footprint.standable for footprint in footprints]
    warnings = [
        *(reading.warnings if reading is not None else ()),
        *_content_warnings(shares[OBSTACLE], unknown, free, reading),
        *_leak_warnings(grid, border_cells, leaking, reach or _reaches(grid, default_types(1))[0], reading),
        *_scale_warnings(grid),
        *_reach_warnings(grid, kinds, reach, masks),
        *_noise_warnings(grid, kinds, reach),
        *_speck_warnings(grid, kinds, reach, footprints),  # modifies the masks
        *_start_warnings(grid, team),
    ]
    return MapDescription(
        format="" if reading is None else reading.format,
        width=grid.width,
        height=grid.height,
        width_m=grid.width * grid.resolution_m,
        height_m=grid.height * grid.resolution_m,
        resolution_m=grid.resolution_m,
        origin_m=grid.origin_m,
        free=free,
        occupied=shares[OBSTACLE],
        unknown=unknown,
        border_cells=border_cells,
        border_area_m2=leaking * grid.cell_area_m2,
        reach=reach,
        legend=() if reading is None else reading.legend,
        warnings=tuple(warnings),
    )


def edge_warnings(grid: Grid, kinds: Sequence[RobotType]) -> tuple[str, ...]:
    """Return the warning that robots of these types can drive to the edge of a map, if they can."""
    border_cells, leaking = _leak(grid)
    if not border_cells:  # most maps are closed, and reach takes time
        return ()
    return tuple(_leak_warnings(grid, border_cells, leaking, _reaches(grid, kinds)[0], None))


def _start_warnings(grid: Grid, team: Sequence[TeamMember]) -> Iterator[str]:
    starting: dict[Cell, list[str]] = {}
    for member in team:
        if member.start is not None:
            starting.setdefault(member.start, []).append(member.name)
    for cell, names in starting.items():
        if len(names) > 1:
            x_m, y_m = grid.centre_m(cell)
            yield f"{', '.join(names)} start on the same cell, at [{x_m:g}, {y_m:g}] m: no two robots can stand there"


def _share(grid: Grid, name: str, code: int, cells: int) -> TerrainShare:
    return TerrainShare(
        name=name, code=code, cells=cells, area_m2=cells * grid.cell_area_m2, share=cells / grid.cells.size
    )


def _leak(grid: Grid) -> tuple[int, int]:
    """Return the number of free cells on the border, and the number of all free cells connected to them."""
    free = ground_in(grid.cells)
    inside = np.zeros(grid.cells.shape, dtype=np.bool_)
    inside[1:-1, 1:-1] = True
    border = free & ~inside
    labels, count = parts(free)
    leaking = np.zeros(count + 1, dtype=np.bool_)
    leaking[labels[border]] = True
    return int(np.count_nonzero(border)), int(np.count_nonzero(leaking[labels]))


def _reaches(grid: Grid, kinds: Sequence[RobotType]) -> tuple[tuple[TypeReach, ...], list[Footprint]]:
    reach, footprints = [], []
    for kind in kinds:
        footprint = footprint_of(grid, kind)
        labels, count = parts(footprint.standable)
        sizes = np.bincount(labels.ravel(), minlength=2)[1:]
        largest = int(sizes.argmax()) + 1
        # a robot there, entirely on the map, covers a border cell
        span = int(footprint.offsets.max())
        inside = (labels == largest)[span : grid.height - span, span : grid.width - span]
        at_border = bool(inside.size) and bool(inside[[0, -1]].any() or inside[:, [0, -1]].any())
        reach.append(
            TypeReach(
                type=kind.name,
                radius_m=kind.radius_m,
                area_m2=int(sizes[largest - 1]) * grid.cell_area_m2,
                parts=count,
                at_border=at_border,
            )
        )
        footprints.append(footprint)
    return tuple(reach), footprints


def _content_warnings(
    occupied: TerrainShare, unknown: TerrainShare, free: tuple[TerrainShare, ...], reading: MapReading | None
) -> Iterator[str]:
    if not free:
        yield "there is no free cell: no robot can stand anywhere"
    if not occupied.cells:
        yield "there is no obstacle: no wall was recognised"
    if reading is not None and not reading.walled and not unknown.cells:
        yield "there is no unknown cell: what the map maker never saw counts as free or as obstacle"


def _leak_warnings(
    grid: Grid, border: int, leaking: int, reach: Sequence[TypeReach], reading: MapReading | None
) -> Iterator[str]:
    """Warn if robots can drive to more than one cell of the border."""
    # on scanned maps single wall pixels are free and connect inside and outside, but no robot passes there
    if border < 2 or not any(entry.at_border for entry in reach) or (reading is not None and reading.walled):
        return
    free = np.count_nonzero(ground_in(grid.cells))
    yield (
        f"free space leaks to the border: {border} of the cells on it are free, and "
        f"{leaking * grid.cell_area_m2:.4g} m2 of free space ({leaking / free:.1%}) are connected to them; robots may "
        "explore outside the walls, and the edge counts as the end of the world: leave a row of unknown cells where it "
        "goes on, or close the map (`marsupial map FILE --boundary OUT`)"
    )


def _scale_warnings(grid: Grid) -> Iterator[str]:
    low, high = USUAL_RESOLUTION_M
    extent_m = max(grid.width, grid.height) * grid.resolution_m
    if not (low <= grid.resolution_m <= high and extent_m <= USUAL_EXTENT_M):
        yield (
            f"resolution {grid.resolution_m:g} m per cell makes the map {grid.width * grid.resolution_m:g} m x "
            f"{grid.height * grid.resolution_m:g} m: check that it is in metres"
        )


def _reach_warnings(
    grid: Grid, kinds: Sequence[RobotType], reach: tuple[TypeReach, ...], masks: list[Mask]
) -> Iterator[str]:
    for entry in reach:
        if not entry.parts:
            yield f"{entry.type} (radius {entry.radius_m:g} m) can stand nowhere on this map"
    carriers = [mask for kind, mask in zip(kinds, masks, strict=True) if kind.role is Role.CARRIER]
    rovers = [mask for kind, mask in zip(kinds, masks, strict=True) if kind.role is Role.ROVER]
    if carriers and rovers and not np.any(np.logical_or.reduce(rovers) & ~np.logical_or.reduce(carriers)):
        yield f"rovers can stand nowhere that carriers can't (a cell is {grid.resolution_m:g} m): nothing needs a rover"


def _noise_warnings(grid: Grid, kinds: Sequence[RobotType], reach: tuple[TypeReach, ...]) -> Iterator[str]:
    """Warn if obstacles smaller than the smallest robot keep types out of much ground, as on noisy laser maps."""
    if not kinds:
        return
    smallest = min(kinds, key=lambda kind: kind.radius_m)
    clean, number = without_specks(grid, cells_below(smallest, grid), (OBSTACLE,))
    if not number:
        return
    for before, after in zip(reach, _reaches(clean, kinds)[0], strict=True):
        gain_m2 = after.area_m2 - before.area_m2
        if gain_m2 > NOISY_GAIN * before.area_m2:
            them = "1 speck of obstacle, smaller" if number == 1 else f"{number} specks of obstacle, each smaller"
            keep, it, away = ("keeps", "it is", "it") if number == 1 else ("keep", "they are", "them")
            yield (
                f"{them} than {smallest.name}, {keep} {before.type} (radius {before.radius_m:g} m) out of "
                f"{gain_m2:.4g} m2, so that it reaches {before.area_m2:.4g} m2 at most: if {it} noise, "
                f"`marsupial map FILE --clean OUT` writes the map without {away}"
            )


def cells_below(kind: RobotType, grid: Grid) -> int:
    """Return the number of cells of a type's footprint: specks of fewer cells are smaller than the robot."""
    return len(disc(kind.radius_m / grid.resolution_m))


def _speck_warnings(
    grid: Grid, kinds: Sequence[RobotType], reach: tuple[TypeReach, ...], footprints: list[Footprint]
) -> Iterator[str]:
    """Warn if specks smaller than a carrier keep it out of ground; reveals them to the carriers' footprints."""
    carriers = [i for i, kind in enumerate(kinds) if kind.role is Role.CARRIER and reach[i].parts]
    if not carriers or not (grid.cells == UNKNOWN).any():
        return
    specks = find_specks(grid)
    for i in carriers:
        small = specks.smaller(len(footprints[i].offsets))
        footprints[i].reveal(small.cells, painted(grid, small))
        labels, _ = parts(footprints[i].standable)
        gain_m2 = int(np.bincount(labels.ravel(), minlength=2)[1:].max()) * grid.cell_area_m2 - reach[i].area_m2
        if gain_m2 > NOTABLE_GAIN * reach[i].area_m2:
            keep, them = ("keeps", "it") if small.number == 1 else ("keep", "them")
            yield (
                f"{counted(small.number, 'speck')} of unknown inside free space {keep} {reach[i].type} (radius "
                f"{reach[i].radius_m:g} m) out of {gain_m2:.4g} m2: paint {them} free, unless something stands there"
            )
