"""Starting by itself: template, plan, speed and start as the command line asked for them."""

import threading

from tests.tui import scenes
from tests.tui.console import console, last, until
from tests.tui.scenes import FakeLink
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.autostart import AutoStart


async def test_starting_by_itself(template: Template) -> None:
    async with console(size=(80, 24), autostart=AutoStart("soccer-11", 20.0, run=True)) as (app, link, pilot):
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
    async with console(size=(80, 24), autostart=AutoStart("soccer-11", 20.0, run=True), link=link) as (
        app,
        link,
        pilot,
    ):
        await until(pilot, lambda: last(app)[1] == "Load refused: busy")
        app.tick()
        assert link.names() == [topics.PLAN_SERVICE.name, topics.LOAD.name]


async def test_starting_by_itself_ends_without_its_template_or_amid_a_job(template: Template) -> None:
    for events, name, problem in (
        (scenes.up(), "no-such", "no-such"),
        (scenes.mid_run(template), "study-square", "on a job"),
    ):
        autostart = AutoStart(name, 20.0, run=True)
        async with console(*events, size=(80, 24), autostart=autostart) as (app, link, pilot):
            await until(pilot, lambda app=app, problem=problem: any(problem in e.text for e in app.state.log.entries))
            app.tick()
            assert link.asked == [] and not autostart.under_way


async def test_the_emergency_stop_ends_starting_by_itself(template: Template) -> None:
    link = FakeLink(incoming=scenes.up(), held=threading.Event())
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
    async with console(size=(80, 24), autostart=AutoStart("soccer-11", run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: link.names() == [topics.PLAN_SERVICE.name])
        await pilot.press("e")
        assert link.held is not None
        link.held.set()
        await until(pilot, lambda: app.state.path is not None)
        app.tick()
        assert topics.LOAD.name not in link.names()
