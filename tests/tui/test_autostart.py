"""Starting by itself: template, plan, speed and start as the command line asked for them."""

import threading

from tests.tui import scenes
from tests.tui.console import console, last, until
from tests.tui.scenes import FakeLink
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.autostart import AutoStart
from touchline.tui.event_log import ERROR


async def test_starting_by_itself(template: Template) -> None:
    async with console(autostart=AutoStart("soccer-11", 20.0, run=True)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        app.tick()
        assert link.asked == []  # nobody is there yet
        assert app.state.template is not None
        link.incoming += scenes.up()
        await until(pilot, lambda: topics.START.name in link.names())
        assert link.names() == [
            topics.PLAN_SERVICE.name,
            topics.LOAD.name,
            topics.SET_SPEED.name,
            topics.START.name,
        ]
        assert link.asked[2][1].factor == 20.0


async def test_starting_by_itself_ends_at_the_first_refusal(template: Template) -> None:
    link = FakeLink(incoming=scenes.up())
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
    link.answers[topics.LOAD.name] = m.LoadResponse(success=False, message="busy")
    async with console(autostart=AutoStart("soccer-11", 20.0, run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: last(app)[1] == "Load refused: busy")
        app.tick()
        assert link.names() == [topics.PLAN_SERVICE.name, topics.LOAD.name]


async def test_starting_by_itself_with_a_template_that_is_not_there() -> None:
    link = FakeLink(incoming=scenes.up())
    async with console(autostart=AutoStart("no-such", run=True), link=link) as (app, link, _pilot):
        app.tick()
        assert any("no-such" in entry.text and entry.severity == ERROR for entry in app.state.log.entries)
        assert link.asked == []


async def test_the_emergency_stop_ends_starting_by_itself(template: Template) -> None:
    link = FakeLink(incoming=scenes.up(), held=threading.Event())
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
    async with console(autostart=AutoStart("soccer-11", run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: link.names() == [topics.PLAN_SERVICE.name])
        await pilot.press("e")
        assert link.held is not None
        link.held.set()
        await until(pilot, lambda: app.state.path is not None)
        app.tick()
        assert topics.LOAD.name not in link.names()


async def test_starting_by_itself_leaves_a_running_job_alone(template: Template) -> None:
    link = FakeLink(incoming=scenes.mid_run(template))
    async with console(autostart=AutoStart("study-square", 20.0, run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: any("on a job" in entry.text for entry in app.state.log.entries))
        app.tick()
        assert link.asked == []
        assert app.state.template is not None
        assert app.state.template.template == template
