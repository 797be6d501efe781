"""The raster: known dots, equal scales both ways, clipping, growth."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.tui.map_raster import Ink, MapRaster, MapScene
from touchline.tui.raster import EMPTY, GrowingLayer, Polyline, draw
from touchline.tui.viewport import Viewport

FIELD = st.floats(-1e4, 1e4)


def polyline(*points: tuple[float, float]) -> Polyline:
    x, y = np.array(points, dtype=float).T
    return Polyline(x, y, np.arange(len(x)) > 0)


def drawn(view: Viewport, line: Polyline) -> np.ndarray:
    bits = np.zeros((view.rows, view.columns), dtype=np.uint8)
    draw(bits, view, line)
    return bits


def text(bits: np.ndarray) -> list[str]:
    return ["".join(chr(0x2800 + int(value)) for value in row) for row in bits]


def dots(bits: np.ndarray) -> set[tuple[int, int]]:
    """(column, row) of every dot set, from the characters' definition."""
    order = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]
    return {
        (2 * column + order[bit][0], 4 * row + order[bit][1])
        for row, line in enumerate(bits.tolist())
        for column, value in enumerate(line)
        for bit in range(8)
        if value >> bit & 1
    }


# One dot is one metre; the field's origin is the corner between the middle dots.
METRE = Viewport(columns=4, rows=2, dot_m=1.0)


def test_each_dot_has_its_bit() -> None:
    for column in range(8):
        for row in range(8):
            x, y = column - 4 + 0.5, 4 - row - 0.5
            assert dots(drawn(METRE, polyline((x, y)))) == {(column, row)}


def test_north_is_up_and_east_is_right() -> None:
    assert text(drawn(METRE, polyline((-3.5, 3.5), (3.5, 3.5)))) == ["⠉⠉⠉⠉", "⠀⠀⠀⠀"]
    assert text(drawn(METRE, polyline((3.5, 3.5), (3.5, -3.5)))) == ["⠀⠀⠀⢸", "⠀⠀⠀⢸"]
    assert text(drawn(METRE, polyline((-3.5, -3.5), (3.5, 3.5)))) == ["⠀⠀⡠⠊", "⡠⠊⠀⠀"]


def test_a_pen_up_leaves_a_gap() -> None:
    line = Polyline(np.array([-3.5, -2.5, 2.5, 3.5]), np.full(4, 3.5), np.array([False, True, False, True]))
    assert text(drawn(METRE, line))[0] == "⠉⠀⠀⠉"


def test_a_metre_is_as_long_upwards_as_sideways() -> None:
    """A square of the field is a square of the screen, for cells twice as high as wide and for others."""
    for aspect in (1.8, 2.0, 2.4):
        view = Viewport(columns=60, rows=30, cell_aspect=aspect).fitted((-1.0, -1.0, 1.0, 1.0))
        found = dots(drawn(view, polyline((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))))
        columns, rows = ({dot[axis] for dot in found} for axis in (0, 1))
        width_in_cells = (max(columns) - min(columns)) / 2
        height_in_cell_widths = (max(rows) - min(rows)) / 4 * aspect
        assert width_in_cells == pytest.approx(height_in_cell_widths, abs=1.2)


def test_what_is_not_finite_is_skipped() -> None:
    line = Polyline(np.array([np.nan, -3.5, 3.5]), np.array([0.0, 3.5, 3.5]), np.array([False, True, True]))
    assert text(drawn(METRE, line))[0] == "⠉⠉⠉⠉"
    assert not drawn(METRE, polyline((np.inf, 0.0), (np.inf, 1.0))).any()


def test_bounds_ignore_what_is_not_finite() -> None:
    assert polyline((1.0, 2.0), (np.nan, 0.0), (-1.0, 5.0)).bounds() == (-1.0, 2.0, 1.0, 5.0)
    assert EMPTY.bounds() is None


def test_far_ends_cost_nothing_and_the_visible_part_is_right() -> None:
    """A line whose ends are 1000 km away still crosses the view where it should."""
    found = dots(drawn(METRE, polyline((-1e6, 0.5), (1e6, 0.5))))
    assert found == {(column, 3) for column in range(8)}


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(FIELD, FIELD), min_size=1, max_size=12), st.floats(0.01, 40.0))
def test_dots_are_where_the_points_are(points: list[tuple[float, float]], dot_m: float) -> None:
    """Every point in view has its dot, and every dot lies within a dot of the line."""
    view = Viewport(columns=12, rows=7, dot_m=dot_m)
    line = polyline(*points)
    found = dots(drawn(view, line))
    u, v = view.to_dots(line.x_m, line.y_m)
    for column, row in zip(u, v, strict=True):
        if 0 <= column < view.width and 0 <= row < view.height:
            assert any(abs(column - c - 0.5) <= 1.51 and abs(row - r - 0.5) <= 1.51 for c, r in found)
    if found:
        assert distances(np.array(sorted(found)) + 0.5, u, v).max() <= 1.5


def distances(points: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """From points (n, 2) to a polyline."""
    line = np.column_stack((u, v))
    best = np.hypot(*(points - line[0]).T)
    for start, end in pairwise(line):
        along = end - start
        t = np.clip((points - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        best = np.minimum(best, np.hypot(*(start + t[:, None] * along - points).T))
    return best


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.floats(-60, 60), st.floats(-40, 40)), min_size=2, max_size=60), st.data())
def test_growing_in_pieces_draws_the_same(points: list[tuple[float, float]], data: st.DataObject) -> None:
    view = Viewport(columns=40, rows=20, dot_m=1.5)
    whole = polyline(*points)
    joined = np.array([False] + [data.draw(st.booleans()) for _ in points[1:]])
    whole = Polyline(whole.x_m, whole.y_m, joined)
    layer = GrowingLayer()
    for cut in [*sorted({data.draw(st.integers(1, len(points))) for _ in range(3)}), len(points)]:
        layer.update(view, Polyline(whole.x_m[:cut], whole.y_m[:cut], joined[:cut]), revision=0)
    expected = dots(drawn(view, whole))
    # A point that was the last one for a while was drawn as a dot of its own; the line through it covers it later.
    assert expected <= dots(layer.bits)
    assert all(any(abs(c - a) <= 1 and abs(r - b) <= 1 for a, b in expected) for c, r in dots(layer.bits))


def test_a_layer_starts_afresh_for_another_line_or_view() -> None:
    layer, left, right = GrowingLayer(), polyline((-3.5, 0.5)), polyline((3.5, 0.5))
    assert layer.update(METRE, left, revision=1)
    assert not layer.update(METRE, left, revision=1)
    assert layer.update(METRE, right, revision=2)
    assert dots(layer.bits) == {(7, 3)}
    assert layer.update(METRE.panned(1, 0), right, revision=2)
    assert dots(layer.bits) == {(5, 3)}


@settings(deadline=None, max_examples=40)
@given(st.floats(0.1, 10), st.floats(0, 11), st.floats(0, 6), st.floats(0.01, 5))
def test_zoom_keeps_the_point_under_the_pointer(factor: float, column: float, row: float, dot_m: float) -> None:
    view = Viewport(columns=12, rows=7, center_x_m=3.0, center_y_m=-2.0, dot_m=dot_m)
    assert view.zoomed(factor, column, row).to_field(column, row) == pytest.approx(view.to_field(column, row), abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), st.floats(0.5, 300), st.floats(0.5, 300))
def test_fit_shows_all(corner: tuple[float, float], width_m: float, height_m: float) -> None:
    x, y = corner
    view = Viewport(columns=33, rows=11).fitted((x, y, x + width_m, y + height_m))
    for point in ((x, y), (x + width_m, y + height_m)):
        assert view.to_cell(*point) is not None


def test_pan_and_center_move_by_cells() -> None:
    assert METRE.panned(1, 0).center_x_m == 2.0
    assert METRE.panned(0, 1).center_y_m == -4.0
    moved = METRE.centered(7.1, 0.0)
    assert (moved.center_x_m / METRE.cell_m).is_integer()
    assert abs(moved.center_x_m - 7.1) <= METRE.cell_m / 2


def test_a_cell_is_coloured_as_most_of_its_dots_are() -> None:
    """Of four dots of a line in a cell, one above the other."""
    whole, view = polyline((0.5, 1.5), (0.5, -1.5)), Viewport(columns=1, rows=1, dot_m=1.0)
    seen = []
    for dots_painted in range(5):
        paint = polyline((0.5, 1.5), (0.5, 2.5 - dots_painted)) if dots_painted else EMPTY
        cells = MapRaster().compose(view, MapScene(template=whole, paint=paint))
        seen.append(Ink(cells.inks[0, 0]))
    assert seen == [Ink.TEMPLATE, Ink.TEMPLATE, Ink.PAINT, Ink.PAINT, Ink.PAINT]


@pytest.mark.parametrize("end", [(60.0, 0.0), (0.0, 30.0), (50.0, 20.0), (-35.0, 24.0)])
@pytest.mark.parametrize("beside", [-0.3, 0.0, 0.3])
def test_a_line_half_painted_looks_half_painted(end: tuple[float, float], beside: float) -> None:
    """Wherever paint lies within a third of a dot beside its line."""
    view = Viewport(columns=70, rows=20, center_x_m=0.5, center_y_m=0.5, dot_m=1.0)
    line = polyline((0.0, 0.0), end)
    paint = polyline((beside, -beside), (end[0] / 2 + beside, end[1] / 2 - beside))
    inks = MapRaster().compose(view, MapScene(template=line, paint=paint)).inks
    share = float((inks == Ink.PAINT).sum() / np.isin(inks, (Ink.PAINT, Ink.TEMPLATE)).sum())
    assert share == pytest.approx(0.5, abs=0.1)


def test_a_dot_of_paint_leaves_what_is_left_to_paint_beside_it() -> None:
    """And the line that is being painted."""
    view = Viewport(columns=1, rows=1, dot_m=1.0)
    line, dot = polyline((0.5, 1.5), (0.5, -1.5)), polyline((-0.5, -1.5))
    assert MapRaster().compose(view, MapScene(template=line, paint=dot)).inks[0, 0] == Ink.TEMPLATE
    now = MapScene(template=line, current=line, current_paints=True, paint=dot)
    assert MapRaster().compose(view, now).inks[0, 0] == Ink.CURRENT
