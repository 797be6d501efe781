"""Preparing a job from the console: choosing a template, planning it, loading the plan."""

import threading
from pathlib import Path

import pytest
from textual.widgets import Input, Static

from tests.tui import scenes
from tests.tui.console import console, last, plain, until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.tui import format
from touchline.tui.dialogs import PlanDialog, Tick
from touchline.tui.event_log import ERROR, INFO
from touchline.tui.panels import StatusPanel
from touchline.tui.template_dialog import TemplateDialog


async def test_a_template_file_that_is_wrong_is_explained_and_can_be_mended(
    tmp_path: Path, template: Template, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    file = tmp_path / "mine.json"
    file.write_text('{"name": "mine", "segments": []}')
    async with console(*scenes.up(), size=(80, 24)) as (app, _link, pilot):
        await pilot.press("t")
        await until(pilot, lambda: isinstance(app.screen, TemplateDialog))
        field = app.screen.query_one(Input)
        field.focus()
        for wrong, problem in (
            ("~/none.json", f"{tmp_path}/none.json is neither"),
            ("~nobody-here/x", "whole path"),
            (str(file), "segments"),
            (str(tmp_path), "s a "),
        ):
            field.value = wrong
            await pilot.press("enter")
            assert isinstance(app.screen, TemplateDialog)
            assert problem in str(app.screen.query_one("#problem", Static).visual)
        file.write_text(template.model_dump_json())
        field.value = "~/mine.json"
        await pilot.press("enter")
        assert app.state.template is not None


async def test_planning_with_options_of_the_robot_on_the_bus(template: Template) -> None:
    slow = m.String(data=Setup(vehicle=Vehicle(tool={"paint_speed_mps": 0.25})).model_dump_json())
    async with console(*scenes.up(), received(topics.SETUP, slow), size=(80, 24)) as (app, link, pilot):
        await pilot.press("p")
        assert last(app)[1] == "Plan: choose a template first (t)"
        app.operator.choose(template, template.model_dump_json())
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.press("p")
        assert isinstance(app.screen, PlanDialog)
        assert app.screen.query_one("#paint_speed_mps", Input).placeholder == "0.25"
        app.screen.query_one("#paint_speed_mps", Input).value = "-1"
        await pilot.press("enter")
        assert isinstance(app.screen, PlanDialog)
        assert "above 0" in str(app.screen.query_one("#problem", Static).visual)
        app.screen.query_one("#paint_speed_mps", Input).value = "0.8"
        for name in ("#order", "#return_to_start", "#ok"):
            app.screen.query_one(name).focus()
            await pilot.press("enter")
        await until(pilot, lambda: app.state.path is not None)
        (name, request) = link.asked[0]
        assert name == topics.PLAN_SERVICE.name
        assert request.template_json == template.model_dump_json()
        assert request.options == m.PlanOptions(method="g2", paint_speed_mps=0.8, order="given", return_to_start=True)
        assert last(app) == (INFO, "Plan: 1.53 km in 26:23")
        await pilot.press("p")
        assert app.screen.query_one("#paint_speed_mps", Input).value == "0.8"
        assert [tick.value for tick in app.screen.query(Tick)] == [True, False, True]


async def test_a_plan_can_be_loaded_to_go_on_by_who_has_it_though_the_robot_has_lost_it(template: Template) -> None:
    async with console(*scenes.up(), size=(80, 24)) as (app, link, pilot):
        app.operator.choose(template, template.model_dump_json())
        planned, beside = scenes.trajectory(template), m.PlanReport(paint_length_m=1.0)
        app.state.planned(planned, beside)
        app.tick()
        assert f"paint    {format.length(template.length_m)} in" in plain(app, StatusPanel), (
            "of the lines, not the axle"
        )
        link.answers[topics.LOAD.name] = m.LoadResponse(success=True, message="loaded, to go on at 7.00 m")
        (command,) = (c for c in app.get_system_commands(app.screen) if c.title == "Go on with the job")
        command.callback()
        await until(pilot, lambda: link.asked)
        assert link.asked[0][1].resume and link.asked[0][1].trajectory == planned


async def test_progress_is_shown_while_planning(template: Template) -> None:
    async with console(*scenes.up(), size=(80, 24)) as (app, link, pilot):
        app.operator.choose(template, template.model_dump_json())
        link.held = threading.Event()
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.press("p", "enter")
        await until(pilot, lambda: link.asked)
        progress = m.Progress(request_id=link.asked[0][1].request_id, stage="transitions", fraction=0.4)
        link.incoming.append(received(topics.PLANNER_PROGRESS, progress))
        await until(pilot, lambda: "planning: transitions 40 %" in plain(app, StatusPanel))
        link.held.set()
        await until(pilot, lambda: app.state.path is not None)
        assert app.state.progress is None
        # The answer and the progress come on two ways: the last of one may be later than the other.
        link.incoming.append(received(topics.PLANNER_PROGRESS, progress.model_copy(update={"stage": "report"})))
        app.tick()
        assert app.state.progress is None


async def test_a_plan_that_makes_no_sense_or_is_for_a_template_that_was_left_is_not_taken(template: Template) -> None:
    nonsense = m.PlanResponse(success=True, trajectory=m.Trajectory(path=m.Path(segments=(m.Segment(id="x"),))))
    async with console(*scenes.up(), size=(80, 24)) as (app, link, pilot):
        for answer, chosen_meanwhile in ((nonsense, "one"), (scenes.plan_response(template), "another")):
            app.operator.choose(template, "one")
            link.held = threading.Event()
            link.asked.clear()
            link.answers[topics.PLAN_SERVICE.name] = answer
            await pilot.press("p", "enter")
            await until(pilot, lambda: link.asked)
            app.operator.choose(template, chosen_meanwhile)
            link.held.set()
            await until(pilot, lambda: last(app)[0] == ERROR)
            assert "of no use" in last(app)[1]
            assert app.state.path is None


async def test_loading_hands_over_plan_and_template(template: Template) -> None:
    async with console(*scenes.up(), size=(80, 24)) as (app, link, pilot):
        await pilot.press("l")
        assert last(app)[1] == "Load: plan a template first (p)"
        app.operator.choose(template, template.model_dump_json())
        app.state.planned(scenes.trajectory(template), m.PlanReport())
        link.answers[topics.LOAD.name] = m.LoadResponse(success=True, total_time=100.0)
        await pilot.press("l")
        await until(pilot, lambda: link.asked and app.state.loaded.path is not None)
        link.incoming.append(received(topics.STATUS, scenes.status(template, m.TraversalStatus.READY)))
        await until(pilot, lambda: app.state.path_loaded)
        (name, request) = link.asked[0]
        assert name == topics.LOAD.name
        assert request.trajectory == scenes.trajectory(template)
        assert request.template_json == template.model_dump_json()
        assert last(app)[1] == "Load: takes 1:40"


async def test_no_other_job_is_prepared_while_the_robot_is_on_one(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, _link, pilot):
        for key in ("t", "p"):
            await pilot.press(key)
            assert len(app.screen_stack) == 1
            assert "on a job" in last(app)[1]
