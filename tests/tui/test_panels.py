"""The panels beside the map, whatever happens to services and to the window."""

import pytest

from tests.tui import scenes
from tests.tui.console import console, plain, reduced, until
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import format
from touchline.tui.lines_view import SegmentsTable
from touchline.tui.panels import StatusPanel, status_lines
from touchline.tui.protocol import Incoming


def test_the_truth_is_told_apart_from_what_the_robot_says(template: Template) -> None:
    def shown(events: list[Incoming], width: int) -> str:
        return "\n".join(line.plain for line in status_lines(reduced(events), width))

    painting = scenes.mid_run(template)
    for width, row in ((46, "truth    53.8 % covered, 3 mm off"), (30, "truth    53.8 %, 3 mm off")):
        text = shown(painting, width)
        assert row in text and "error +4 mm" in text and "53.9 %" in text
    astray = scenes.received(topics.TRUE_COVERAGE, scenes.truth(template, 14, 0.55, lateral_m=-0.123))
    assert "truth    53.8 %, 123 mm off ▲" in shown([*painting, astray], 30)
    real = [event for event in painting if getattr(event, "topic", "") != topics.TRUE_COVERAGE.name]
    assert "error +4 mm" in shown(real, 30) and "truth" not in shown(real, 30)


async def test_resizing_to_nothing_and_back(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        for size in ((20, 5), (1, 1), (200, 60), (80, 24), (120, 40)):
            await pilot.resize_terminal(*size)
            app.tick()
            await pilot.pause()
            app.export_screenshot()
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
