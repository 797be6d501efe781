"""A patch that was left out is seen however small it is on the screen, and listed with its size and place."""

import numpy as np
import pytest

from tests.tui import pan
from tests.tui.console import until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Area
from touchline.tui.area_dots import AreaScene
from touchline.tui.area_layer import AreaLayer
from touchline.tui.lines_view import SegmentsTable
from touchline.tui.map_raster import MISSED_MARK, Ink, MapRaster, MapScene
from touchline.tui.map_view import MapView
from touchline.tui.raster import Polyline
from touchline.tui.viewport import Viewport

WIDTH_M = 2.2
LENGTH_M, BREADTH_M = 40.0, 20.0
FIELD = ((0.0, 0.0), (LENGTH_M, 0.0), (LENGTH_M, BREADTH_M), (0.0, BREADTH_M))
AREAS = (Area(id="pan", outline=FIELD),)


def lanes(*gaps: tuple[int, float, float]) -> Polyline:
    """Lanes 2 m apart over all of the field, but for gaps: (lane, from x, to x)."""
    strokes = []
    for lane in range(10):
        y, begin = 1.0 + 2.0 * lane, -1.0
        for _, start, end in sorted(gap for gap in gaps if gap[0] == lane):
            strokes.append(((begin, start), (y, y)))
            begin = end
        strokes.append(((begin, LENGTH_M + 1.0), (y, y)))
    return Polyline.of([(np.array(x), np.array(y)) for x, y in strokes])


def seen(view: Viewport, way: Polyline, **changes: object) -> list[tuple[int, int]]:
    """The cells (column, row) with a mark."""
    scene = MapScene(area=AreaScene(AREAS, way, 1, WIDTH_M, at=None, **changes))  # type: ignore[arg-type]
    cells = MapRaster().compose(view, scene)
    marked = cells.inks == Ink.MISSED
    assert (cells.codes[marked] == ord(MISSED_MARK)).all()
    return [(int(column), int(row)) for row, column in zip(*np.nonzero(marked), strict=True)]


def view_of(columns: int, rows: int) -> Viewport:
    return Viewport(columns, rows).fitted((0.0, 0.0, LENGTH_M, BREADTH_M))


@pytest.mark.parametrize("size", [(19, 5), (30, 11), (60, 19), (4, 2)])
def test_every_patch_is_seen_where_it_is(size: tuple[int, int]) -> None:
    """Also where a dot is several times as large as the patch, and between its middle and the next one's."""
    view = view_of(*size)
    gaps = [(1, 4.07, 4.47), (3, 13.9, 16.9), (3, 26.2, 27.2), (6, 35.4, 35.8), (9, 19.0, 19.4)]
    marked = seen(view, lanes(*gaps))
    assert marked, "something"
    for lane, begin, end in gaps:
        cell = view.to_cell(0.5 * (begin + end), 1.0 + 2.0 * lane)
        assert cell is not None
        assert any(abs(column - cell[0]) <= 1 and abs(row - cell[1]) <= 1 for column, row in marked)
    assert seen(view, lanes()) == [], "and nothing where all is covered"


def test_a_strip_between_two_lanes_is_seen_all_along() -> None:
    way = lanes()
    keep = np.abs(way.y_m - 9.0) > 0.1
    shifted = Polyline(way.x_m[keep], way.y_m[keep] + np.where(way.y_m[keep] > 9.0, -0.6, 0.0), way.joined[keep])
    marked = seen(view_of(19, 5), shifted)
    assert len({column for column, _ in marked}) >= 17


def test_a_view_that_is_panned_and_zoomed_does_not_draw_the_ground_anew() -> None:
    layer, scene = AreaLayer(), AreaScene(AREAS, lanes((7, 31.9, 32.6)), 1, WIDTH_M, at=None)
    layer.update(view_of(70, 26), scene)
    before = layer._ground._covered
    for factor in (1.4, 3.0, 20.0):
        _, missed = layer.update(view_of(70, 26).zoomed(factor).centered(32.2, 15.0), scene)
        assert missed.any()
    assert layer._ground._covered is before


def test_what_the_report_names_is_marked_even_if_the_console_saw_it_covered() -> None:
    view = view_of(19, 5)
    assert seen(view, lanes(), missed=((21.0, 9.0),)) == [view.to_cell(21.0, 9.0)]


async def test_patches_are_listed_with_size_and_place() -> None:
    patches = tuple(m.MissedPatch(x_m=x, y_m=y, area_m2=area) for x, y, area in ((20.0, 4.9, 35.0), (39.7, 0.3, 0.06)))
    report = m.AreaReport(area_m2=791.0, coverage_pct=94.8, missed_m2=35.06, missed=patches)
    app = pan.app_with([*pan.finished(), received(topics.AREA_REPORT, report)])
    async with app.run_test(size=(80, 24)) as pilot:
        app.tick()
        await pilot.pause()
        table = app.query_one(SegmentsTable)
        await until(pilot, lambda: str(table.border_title).startswith("Missed 2"))
        rows = [table.render_line(y).text.rstrip() for y in range(3)]
        assert rows[:2] == ["×   35.0 m²  at 20.0, 4.9 m", "×   0.06 m²  at 39.7, 0.3 m"]
        assert "pan, swath 1" in rows[2]
        cells, view = app.query_one(MapView).cells, app.query_one(MapView).view
        assert cells is not None
        for patch in patches:
            at = view.to_cell(patch.x_m, patch.y_m)
            assert at is not None and cells.inks[at[1], at[0]] == Ink.MISSED
