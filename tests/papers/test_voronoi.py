import numpy as np
from hypothesis import given
from scipy import ndimage
from support.maps.drawn_maps import draw, random_cells

from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, CellArray, Grid, Mask
from marsupial.papers.wurm2008.voronoi import Blocks, VoronoiGraph, _traced, voronoi_graph

FLOORS = frozenset({FLOOR})
EIGHT = np.ones((3, 3))


def graph_of(grid: Grid) -> tuple[Blocks, VoronoiGraph]:
    space = Blocks.of(grid, FLOORS)
    return space, voronoi_graph(space)


def drawn(graph: VoronoiGraph, shape: tuple[int, int]) -> Mask:
    mask = np.zeros(shape, dtype=np.bool_)
    mask.ravel()[graph.nodes] = True
    mask.ravel()[graph.inner] = True
    return mask


def bitmap(cells: CellArray) -> Mask:
    mask: Mask = np.pad(cells == FLOOR, 1)
    return mask


@given(cells=random_cells(codes=(OBSTACLE, OBSTACLE, FLOOR)))
def test_a_graph_has_every_block_once_and_is_connected_as_the_blocks_are(cells: CellArray) -> None:
    mask = bitmap(cells)
    graph = _traced(mask)
    assert sorted([*graph.nodes.tolist(), *graph.inner.tolist()]) == np.flatnonzero(mask).tolist()
    _, parts = ndimage.label(mask, EIGHT)
    home = list(range(len(graph.nodes)))
    for a, b in graph.ends.tolist():
        home = [home[a] if one == home[b] else one for one in home]
    assert len(set(home)) == parts


@given(cells=random_cells(codes=(OBSTACLE, OBSTACLE, FLOOR)))
def test_a_node_has_as_many_links_as_edges_end_there(cells: CellArray) -> None:
    graph = _traced(bitmap(cells))
    assert np.bincount(graph.ends.ravel(), minlength=len(graph.nodes)).tolist() == graph.degrees.tolist()


@given(cells=random_cells(codes=(OBSTACLE, OBSTACLE, FLOOR)))
def test_the_blocks_of_an_edge_touch_one_after_the_other(cells: CellArray) -> None:
    mask = bitmap(cells)
    graph = _traced(mask)
    for edge, (a, b) in enumerate(graph.ends.tolist()):
        inner = graph.inner[graph.bounds[edge] : graph.bounds[edge + 1]]
        y, x = np.divmod(np.concatenate([graph.nodes[[a]], inner, graph.nodes[[b]]]), mask.shape[1])
        assert np.maximum(np.abs(np.diff(y)), np.abs(np.diff(x))).tolist() == [1] * (len(inner) + 1)


def test_a_ring_without_a_junction_is_one_node_with_an_edge_to_itself() -> None:
    graph = _traced(np.pad(draw(".#.", "#.#").cells[[1, 0, 1]] != FLOOR, 1))
    assert (graph.degrees.tolist(), graph.ends.tolist(), len(graph.inner)) == ([2], [[0, 0]], 3)


def test_the_graph_of_a_room_with_a_door_leads_through_the_door_and_not_into_corners() -> None:
    floor, wall, door = "#" + "." * 59 + "#", "#" * 61, "#" * 27 + "." * 8 + "#" * 26
    grid = draw(wall, *[floor] * 20, door, *[floor] * 30, wall, resolution_m=0.1)
    space, graph = graph_of(grid)
    mask = drawn(graph, space.known.shape)
    assert mask[31 - space.row].sum() == 1
    corners = [(1, 1), (1, 59), (51, 1), (51, 59)]
    for y, x in corners:
        near = mask[max(0, y - space.row - 3) : y - space.row + 4, max(0, x - space.column - 3) : x - space.column + 4]
        assert not near.any()


def test_the_unknown_is_no_wall() -> None:
    known = ["#" * 60, *["." * 60] * 19, "#" * 60]
    whole = draw(*known, resolution_m=0.1)
    half = draw(*[row[:30] + "?" * 30 for row in known], resolution_m=0.1)
    space, _ = graph_of(half)
    ours, theirs = space.clearance, Blocks.of(whole, FLOORS)
    columns = slice(15 - space.column, 30 - space.column)
    rows = slice(-space.row, 21 - space.row)
    expected = theirs.clearance[-theirs.row : 21 - theirs.row, 15 - theirs.column : 30 - theirs.column]
    assert np.abs(ours[rows, columns] - expected).max() < 1e-9


def test_clutter_that_one_walks_round_bounds_no_room() -> None:
    rows = ["#" * 40, *["#" + "." * 38 + "#"] * 38, "#" * 40]
    empty, full = draw(*rows, resolution_m=0.1), draw(*rows, resolution_m=0.1)
    cells = full.cells.copy()
    cells[12:15, 20:24] = OBSTACLE
    cells[30, 8] = OBSTACLE
    _, bare = graph_of(empty)
    _, cluttered = graph_of(Grid(cells=cells, resolution_m=0.1))
    assert cluttered.inner.tolist() == bare.inner.tolist()
    cells[12:15, 20:26] = OBSTACLE
    _, furnished = graph_of(Grid(cells=cells, resolution_m=0.1))
    assert furnished.inner.tolist() != bare.inner.tolist()


def test_a_map_of_which_nothing_is_known_has_an_empty_graph() -> None:
    _, graph = graph_of(Grid(cells=np.full((5, 7), UNKNOWN, dtype=np.uint8), resolution_m=0.05))
    assert len(graph.nodes) == len(graph.ends) == 0
