"""Needs of a job from tank and battery, shown and asked about before it is started."""

from collections.abc import Callable

import pytest

from tests.tui import scenes
from tests.tui.console import console, last, plain, until
from tests.tui.scenes import FakeLink, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.event_log import WARN
from touchline.tui.panels import StatusPanel

LARGE = m.PlanReport(paint_l=50.0, battery_wh=155.0, total_time_s=4209.0, painted_segments=27, wet_crossings=3)


def ready(app: ConsoleApp, link: FakeLink, template: Template, report: m.PlanReport, tank_l: float) -> None:
    """The robot has the plan that was made here."""
    app.state.choose_template(template, template.model_dump_json())
    app.state.planned(scenes.trajectory(template), report)
    app.state.handed_over()
    link.incoming += scenes.robot_health(battery=0.9, tank_l=tank_l)
    app.tick()


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_what_the_job_needs_is_shown_at_every_size(template: Template, size: tuple[int, int]) -> None:
    async with console(*scenes.loaded(template), size=size) as (app, link, _pilot):
        ready(app, link, template, LARGE, 14.9)
        shown = plain(app, StatusPanel)
        for part in (
            "50.0 L, tank 14.9 L",
            "▲ refill twice",
            "155 Wh, battery 612 Wh",
            "1:10:09",
            "crosses  3 times wet paint",
        ):
            assert part in shown
        width = app.query_one(StatusPanel).content_size.width
        assert max(len(line) for line in shown.splitlines() if "━" not in line) <= width


def one_console(app: ConsoleApp, link: FakeLink, template: Template) -> None:
    ready(app, link, template, LARGE, 14.9)


def no_level(app: ConsoleApp, link: FakeLink, template: Template) -> None:
    ready(app, link, template, m.PlanReport(paint_l=1.1, battery_wh=9.0), 14.9)
    app.state.robot.sprayer = app.state.robot.battery = None


def another_console(app: ConsoleApp, link: FakeLink, _template: Template) -> None:
    """Its plan is evaluated by its lines."""
    link.incoming.append(received(topics.SPRAYER, m.SprayerState(tank_l=2.0)))
    app.tick()
    assert "5.5 L, tank 2.0 L" in plain(app, StatusPanel)


@pytest.mark.parametrize("situation", [one_console, no_level, another_console])
async def test_a_start_that_will_run_dry_or_may_asks_first(
    template: Template, situation: Callable[[ConsoleApp, FakeLink, Template], None]
) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        situation(app, link, template)
        for answer, orders in (("n", []), ("y", [topics.START.name])):
            await pilot.press("s")
            await until(pilot, lambda: isinstance(app.screen, ConfirmDialog))
            assert link.asked == []
            await pilot.press(answer)
            await until(pilot, lambda orders=orders: link.names() == orders)


async def test_a_start_that_will_do_asks_nothing(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        ready(app, link, template, LARGE.model_copy(update={"paint_l": 14.0}), 14.9)
        await pilot.press("s")
        await until(pilot, lambda: link.names() == [topics.START.name])


async def test_starting_by_itself_tells_that_it_will_run_dry(template: Template) -> None:
    link = FakeLink(incoming=[*scenes.up(), *scenes.robot_health(tank_l=14.9)])
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template).model_copy(update={"report": LARGE})
    async with console(autostart=AutoStart("soccer-11", run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: topics.START.name in link.names())
        told = [(entry.severity, entry.text) for entry in app.state.log.entries]
        assert (WARN, "the job needs 50.0 L of paint, the tank has 14.9 L: refill it twice") in told
        assert last(app)
