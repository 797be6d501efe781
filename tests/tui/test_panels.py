"""What the panels beside the map tell, whatever happens to services and to the window."""

import pytest

from tests.tui import scenes
from tests.tui.console import console, plain, until
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import format
from touchline.tui.header import HeaderBar
from touchline.tui.lines_view import SegmentsTable
from touchline.tui.log_view import LogView
from touchline.tui.panels import ServicesPanel, StatusPanel
from touchline.tui.protocol import NodeChanged


async def test_a_dead_service_is_shown_at_once(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):
        link.incoming.append(NodeChanged(topics.ROBOT_SIM, False))
        await until(pilot, lambda: "NO ROBOT" in plain(app, StatusPanel))
        assert "○ robot" in plain(app, HeaderBar)
        assert "○ robot      down" in plain(app, ServicesPanel)
        assert len(app.query_one(LogView).lines) > 0


@pytest.mark.parametrize(
    ("size", "row"), [((120, 40), "truth    53.8 % covered, 3 mm off"), ((80, 24), "truth    53.8 %, 3 mm off")]
)
async def test_the_truth_is_told_apart_from_what_the_robot_says(
    template: Template, size: tuple[int, int], row: str
) -> None:
    async with console(*scenes.mid_run(template), size=size) as (app, _link, pilot):
        await until(pilot, lambda: row in plain(app, StatusPanel))
        assert "error +4 mm" in plain(app, StatusPanel)
        assert "covered" in plain(app, StatusPanel) and "53.9 %" in plain(app, StatusPanel)


async def test_paint_far_off_its_line_is_set_off(template: Template) -> None:
    astray = scenes.received(topics.TRUE_COVERAGE, scenes.truth(template, 14, 0.55, lateral_m=-0.123))
    async with console(*scenes.mid_run(template), astray, size=(80, 24)) as (app, _link, pilot):
        await until(pilot, lambda: "truth    53.8 %, 123 mm off ▲" in plain(app, StatusPanel))


async def test_a_robot_that_tells_no_truth_has_no_row_of_it(template: Template) -> None:
    told = [event for event in scenes.mid_run(template) if getattr(event, "topic", "") != topics.TRUE_COVERAGE.name]
    async with console(*told) as (app, _link, pilot):
        await until(pilot, lambda: "error +4 mm" in plain(app, StatusPanel))
        assert "truth" not in plain(app, StatusPanel)


async def test_resizing_to_nothing_and_back(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        for size in ((20, 5), (1, 1), (300, 90), (80, 24), (120, 40)):
            await pilot.resize_terminal(*size)
            app.tick()
            await pilot.pause()
        assert "RUNNING" in plain(app, StatusPanel)


async def test_the_current_line_is_kept_in_view(template: Template) -> None:
    async with console(*scenes.mid_run(template, done=25), size=(80, 24)) as (app, _link, pilot):
        table = app.query_one(SegmentsTable)
        await until(pilot, lambda: table.scroll_offset.y > 0)
        rows = range(table.scroll_offset.y, table.scroll_offset.y + table.content_size.height)
        assert 25 in rows
        assert "25/27" in str(table.border_title)


@pytest.mark.parametrize("width", range(12, 19))
def test_names_that_differ_at_their_ends_are_told_apart_when_cut(width: int) -> None:
    left, right = (format.cut(f"penalty-area-{side}", width) for side in ("left", "right"))
    assert left != right
    assert len(left) <= width and len(right) <= width
    assert left.startswith("pen") and left.endswith("left") and right.endswith("right")


def test_a_name_that_fits_is_not_cut() -> None:
    assert [format.cut("goal line", width) for width in (9, 5, 2, 1, 0)] == ["goal line", "g…ine", "…e", "…", ""]
