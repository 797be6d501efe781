"""The map under keys and mouse, and when it is drawn anew."""

import pytest
from textual.events import MouseMove, MouseScrollDown, MouseScrollUp

from tests.tui import scenes
from tests.tui.console import console, until
from tests.tui.scenes import FakeLink, received
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.app import ConsoleApp
from touchline.tui.map_view import MapView


async def test_map_keys(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(120, 40)) as (app, link, pilot):
        view = app.query_one(MapView)
        home = view.view
        await pilot.press("plus", "plus")
        assert view.view.dot_m < home.dot_m
        await pilot.press("minus")
        await pilot.press("right", "up")
        assert view.view.center_x_m > home.center_x_m
        assert view.view.center_y_m > home.center_y_m
        await pilot.press("f")
        assert view.follow
        assert "following" in str(view.border_title)
        pose = app.state.robot.pose
        assert pose is not None
        assert abs(view.view.center_x_m - pose.x_m) <= view.view.cell_m
        link.incoming.append(received(topics.ODOMETRY, scenes.odometry(0.0, 0.0, 0.0)))
        await until(pilot, lambda: abs(view.view.center_x_m) <= view.view.cell_m)
        await pilot.press("left")
        assert not view.follow
        for key in ("0", "home"):
            await pilot.press("plus", key)
            assert view.view == home


async def test_the_wheel_zooms_at_the_pointer_and_dragging_pans(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(120, 40)) as (app, _link, pilot):
        view = app.query_one(MapView)
        column, row = 20, 10  # of the widget; its frame is one cell wide
        await pilot.hover(MapView, offset=(column, row))
        assert str(view.border_subtitle).endswith("m")
        home = view.view
        pointer = home.to_field(column - 0.5, row - 0.5)
        await pilot._post_mouse_events([MouseScrollUp], MapView, offset=(column, row))
        assert view.view.dot_m < home.dot_m
        assert view.view.to_field(column - 0.5, row - 0.5) == pytest.approx(pointer)
        await pilot._post_mouse_events([MouseScrollDown], MapView, offset=(column, row))
        assert view.view.dot_m == pytest.approx(home.dot_m)

        before = view.view
        await pilot.mouse_down(MapView, offset=(column, row))
        view.on_mouse_move(MouseMove(view, column + 5, row - 2, 5, -2, 1, False, False, False))
        await pilot.mouse_up(MapView, offset=(column + 5, row - 2))
        # The field point that was under the pointer still is.
        assert view.view.to_field(25, 8) == pytest.approx(before.to_field(20, 10))


async def test_only_rows_that_changed_are_redrawn(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(120, 40)) as (app, link, _pilot):
        view = app.query_one(MapView)
        for row in range(view.size.height):
            view.render_line(row)
        kept = dict(view._strips)
        link.incoming.append(received(topics.ODOMETRY, scenes.odometry(0.0, 0.0, 0.0)))
        app.tick()
        changed = set(kept) - set(view._strips)
        assert 1 <= len(changed) <= 4
        app.tick()
        assert set(kept) - set(view._strips) <= changed


async def test_paint_is_fetched_on_connecting_and_asked_for_again_until_it_comes(template: Template) -> None:
    now = [0.0]
    link = FakeLink(incoming=[*scenes.up()])
    link.fetch_paint = lambda: setattr(link, "fetches", link.fetches + 1)  # type: ignore[method-assign]
    app = ConsoleApp(link, clock=lambda: now[0])
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: link.fetches == 1)
        now[0] = 0.9
        app.tick()
        assert link.fetches == 1
        now[0] = 1.5
        await until(pilot, lambda: link.fetches == 2)
